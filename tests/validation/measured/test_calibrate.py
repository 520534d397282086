"""Calibration of the preset: the script finds what the preset has, and sees what the facts exclude."""

import pytest

from fem_models.rig.presets import preset
from validation.measured.preset_du2018 import alternatives, calibrate, with_constants


def test_the_script_finds_the_preset_again_from_elsewhere():
    rig = preset("du2018")
    found = calibrate(with_constants(rig, EA_N=30_000.0, toe_N=20.0, sheath_N=2.5))
    assert pytest.approx(rig.tendon_a.EA_N, rel=0.02) == found.EA_N
    assert found.toe_N == pytest.approx(rig.tendon_a.toe_N, rel=0.02)
    assert found.sheath_N == pytest.approx(rig.friction.sheath_N, rel=0.02)
    assert found.meets_the_facts


@pytest.mark.parametrize(("held", "meets"), [("no material loop", False), ("moment arm 2.60 mm", True)])
def test_what_the_facts_exclude_and_what_they_do_not(held, meets):
    assert calibrate(alternatives()[held]).meets_the_facts == meets
