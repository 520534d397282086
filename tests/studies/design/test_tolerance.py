"""Tolerances: their distributions, and what they change of a rig."""

from pathlib import Path

import numpy as np
import pytest
from scipy.stats import norm

from fem_models.rig import preset, read_rig
from fem_models.rig.rig import notched_tube
from studies.design.tolerance import CHANGES, Tolerance, Tolerances, normal_draws

YORK = Path(__file__).parents[3] / "docs" / "validation" / "york2015.toml"
Z = norm.ppf([0.025, 0.5, 0.975])


@pytest.mark.parametrize(
    ("tolerance", "expected"),
    [
        (Tolerance("depth_mm", "normal", 0.1, percent=False), 2 + 0.1 * Z),
        (Tolerance("depth_mm", "uniform", 0.1, percent=False), 2 + 0.1 * np.array([-0.95, 0, 0.95])),
        (Tolerance("plateau_MPa", "uniform", 10.0, percent=True), 2 + 0.2 * np.array([-0.95, 0, 0.95])),
        (Tolerance("capstan_coefficient", "lognormal", 20.0, percent=True), 2 * np.exp(0.2 * Z)),
    ],
)
def test_quantiles_are_those_of_the_distribution(tolerance, expected):
    assert [tolerance.value(2.0, z) for z in Z] == pytest.approx(expected)


def test_half_as_wide():
    assert Tolerance("depth_mm", "normal", 0.1, percent=False).halved().value(2.0, 1.0) == pytest.approx(2.05)


def test_wall_changes_from_inside_and_takes_the_tendon_along():
    rig = CHANGES["wall_mm"](read_rig(YORK), lambda wall: wall + 0.01)
    tube = notched_tube(rig).tube
    assert (tube.outer_diameter_mm, tube.inner_diameter_mm) == pytest.approx((1.16, 0.84))
    assert rig.tendon_a.moment_arm_mm == pytest.approx(0.38 - 0.01)


def test_width_keeps_the_pitch():
    rig = CHANGES["width_mm"](read_rig(YORK), lambda width: width + 0.02)
    notch = notched_tube(rig).notch
    assert (notch.width_mm, notch.spacing_mm) == pytest.approx((0.528, 0.49))


def test_both_plateaus_move_by_the_same_stress():
    law = CHANGES["plateau_MPa"](read_rig(YORK), lambda plateau: plateau + 20).superelastic
    assert (law.plateau_MPa, law.unloading_plateau_MPa) == pytest.approx((570.0, 271.35))


@pytest.mark.parametrize("name", ["depth_mm", "youngs_modulus_GPa", "capstan_coefficient"])
def test_number_of_the_rig_is_the_one_that_changes(name):
    before, after = read_rig(YORK).to_dict(), CHANGES[name](read_rig(YORK), lambda value: 1.01 * value).to_dict()
    changed = {(t, k) for t, v in before.items() if isinstance(v, dict) for k in v if after[t][k] != v[k]}
    assert {key for _, key in changed} == {name}


def test_preload_of_two_tendons():
    assert CHANGES["preload_N"](preset("du2018"), lambda preload: preload - 1).preload_N == 19.0


def test_draws_are_those_of_their_seed():
    tolerances = Tolerances((Tolerance("depth_mm", "normal", 0.1, percent=False),) * 2)
    assert np.array_equal(normal_draws(tolerances, 5, 3), normal_draws(tolerances, 5, 3))
    assert not np.array_equal(normal_draws(tolerances, 5, 3), normal_draws(tolerances, 5, 4))
    many = normal_draws(tolerances, 20_000, 0)
    assert many.std() == pytest.approx(1.0, abs=0.02)
