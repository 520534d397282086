"""Analytic curve and chain against the multibody model."""

from fem_models.rig import preset
from validation.engines import compare_engines


def test_models_agree_where_they_model_the_same():
    result = compare_engines(preset("du2018"), step_mm=0.2)
    assert result.frictionless_max_deg < 0.05
    assert result.tip_pose_max_mm < 0.1
    assert result.chain_max_deg < 0.01
    assert result.frictionless_tension_max_N < 0.5
    # friction is what the analytic model lacks: a good half of the loop's half width
    assert result.friction_shift_rmse_deg > 0.5
    assert result.to_dict()["rig"] == "du2018"
