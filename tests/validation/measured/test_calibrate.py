"""Calibration of the preset du2018 from the facts of the paper."""

import pytest

from fem_models.rig import preset
from validation.measured.preset_du2018 import alternatives, calibrate, with_parameters


def test_calibration_recovers_the_preset_from_other_starting_values():
    rig = preset("du2018")
    found = calibrate(with_parameters(rig, EA_N=30_000.0, toe_N=20.0, sheath_N=6.0))
    assert pytest.approx(rig.tendon_a.EA_N, rel=0.02) == found.EA_N
    assert found.toe_N == pytest.approx(rig.tendon_a.toe_N, rel=0.02)
    assert found.sheath_N == pytest.approx(rig.friction.sheath_N, rel=0.02)
    assert found.meets_the_facts


@pytest.mark.parametrize(("fixed", "meets"), [("no material loop", False), ("moment arm 2.52 mm", True)])
def test_facts_exclude_some_alternatives(fixed, meets):
    assert calibrate(alternatives()[fixed]).meets_the_facts == meets
