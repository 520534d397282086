"""The ensemble that ships with the package, and the play that preload takes up."""

from dataclasses import replace

import numpy as np
import pytest

from fem_models.load import triangle
from fem_models.load.schedule import schedule
from fem_models.rig import RigError, ensemble, preset
from fem_models.rig.effects import Backlash
from fem_models.rig.ensemble import presets_with_ensemble, with_constants
from fem_models.rig.rig import numeric_fields

RIG = preset("du2018")


def test_members_are_rigs_of_the_preset_with_other_constants():
    rigs = ensemble("du2018")
    assert presets_with_ensemble() == ("du2018", "du2018-full-widths")
    assert len(rigs) == 200
    assert len(set(map(repr, (numeric_fields(rig) for rig in rigs)))) == 200  # copies would make ranges narrow
    assert all(rig.tendon_a == rig.tendon_b for rig in rigs)
    assert all(rig.joint.tube == RIG.joint.tube for rig in rigs)
    assert {rig.preload_N for rig in ensemble("du2018", preload_N=5.0)} == {5.0}


def test_a_preset_without_an_ensemble_is_refused():
    with pytest.raises(RigError, match="ensemble of notched-wrist-90: expected a preset that has one: du2018"):
        ensemble("notched-wrist-90")


def test_constants_of_a_table_that_a_rig_does_not_have_are_added():
    rig = with_constants(RIG, {"tendon.EA_N": 9e3, "backlash.width_mm": 0.1, "preload_N": 10.0})
    assert (rig.tendon_a.EA_N, rig.tendon_b.EA_N, rig.preload_N) == (9e3, 9e3, 10.0)
    assert rig.backlash == Backlash(0.1)
    assert with_constants(RIG, {}) == RIG
    with pytest.raises(RigError, match=r"tendon_a\.EA"):
        with_constants(RIG, {"tendon.EA": 9e3})


def test_play_is_half_as_wide_at_the_preload_that_takes_it_up():
    play = Backlash(0.4, takes_up_N=10.0)
    assert [play.left_mm(p) for p in (1e-9, 10.0, 30.0)] == pytest.approx([0.4, 0.2, 0.1])
    assert Backlash(0.4).left_mm(10.0) == 0.4
    program = triangle(1.0)
    drives = [schedule(replace(RIG, preload_N=30.0, backlash=one), program).drive_mm for one in (play, Backlash(0.1))]
    np.testing.assert_allclose(drives[0], drives[1], rtol=1e-14)
    with pytest.raises(RigError, match=r"backlash\.takes_up_N = 0\.0: expected above 0"):
        Backlash(0.4, takes_up_N=0.0)
