"""Analytic curve and chain against the multibody model."""

from fem_models.rig import preset
from validation.engines import compare_engines


def test_engines_agree_where_their_physics_is_the_same():
    result = compare_engines(preset("du2018"), step_mm=0.2)
    assert result.frictionless_max_deg < 0.05
    assert result.tip_pose_max_mm < 0.1
    assert result.chain_max_deg < 0.01
    assert result.frictionless_tension_max_N < 0.5
    # the analytic model lacks friction: the difference is more than half of the loop's half width
    assert result.friction_shift_rmse_deg > 0.5
    assert result.to_dict()["rig"] == "du2018"
