"""Ranges over an ensemble, what a measurement leaves of them, and sensitivities."""

from dataclasses import replace

import numpy as np
import pytest

from fem_models.rig import preset
from fem_models.rig.rig import Friction
from validation.separation import loop_program
from validation.separation.ensemble import gathered, left_by, range_of, separate_each
from validation.separation.sensitivity import sensitivities

RIG = preset("du2018")
PROGRAM = loop_program(-1.1, 1.1, cycles=1)


def test_ranges_are_quantiles():
    found = range_of(np.arange(101.0))
    assert (found.low, found.median, found.high) == pytest.approx((5.0, 50.0, 95.0))
    with pytest.raises(ValueError, match="finite"):
        range_of([1.0, np.nan])


@pytest.mark.parametrize("r", [0.0, 0.6, 0.95])
def test_a_measurement_leaves_what_the_correlation_says(r):
    x, y = np.random.default_rng(1).standard_normal((2, 20_000))
    assert left_by(x, r * x + np.sqrt(1 - r**2) * y, 0.0) == pytest.approx(np.sqrt(1 - r**2), abs=0.02)
    error = 0.7  # of the measurement: the correlation falls by its share
    left = np.sqrt(1 - r**2 / (1 + error**2))
    assert left_by(x, r * x + np.sqrt(1 - r**2) * y, error) == pytest.approx(left, abs=0.02)


def test_a_number_that_does_not_vary_tells_nothing():
    assert left_by(np.ones(50), np.arange(50.0), 0.0) == 1.0


def test_shares_over_rigs_are_those_of_each():
    rigs = [RIG, replace(RIG, friction=Friction())]
    found = gathered(separate_each(rigs, PROGRAM, threads=2), "dissipated_mJ")
    assert found["friction"][1] == pytest.approx(0.0, abs=1e-9)
    assert sum(found.values()) == pytest.approx(np.ones(2))


def test_sensitivity_of_what_scales_the_rig():
    """All forces in proportion: E, EA, toe, friction and preload times k leave every angle as it is, energy times k."""
    found = sensitivities(RIG, PROGRAM)
    forces = (
        "material.youngs_modulus_GPa",
        "tendon.EA_N",
        "tendon.toe_N",
        "friction.sheath_N",
        "friction.guide_N",
        "preload_N",
    )
    assert sum(found.of[name].width for name in forces) == pytest.approx(0.0, abs=2e-3)
    assert sum(found.of[name].energy for name in forces) == pytest.approx(1.0, abs=2e-3)


def test_constants_that_move_the_loop_alike_are_named_in_one_line():
    found = sensitivities(RIG, PROGRAM)
    groups = [set(group) for group in found.alike]
    assert any({"tendon.EA_N", "tendon.free_length_mm"} <= group for group in groups)
    assert any({"material.youngs_modulus_GPa", "notch.depth_mm"} <= group for group in groups)
    assert found.sentence().count("\n") == 0
    assert "tendon.EA_N / tendon.free_length_mm" in found.sentence()


def test_as_many_independent_ways_as_constants_say_so():
    found = sensitivities(RIG, PROGRAM)
    assert 1 < found.ways < len(found.of)
    assert found.sentence().startswith(f"one loop cannot separate {len(found.of)} constants")
    two = replace(found, of=dict(list(found.of.items())[:2]), alike=(), ways=2)
    assert two.sentence() == "the 2 constants move the loop in as many independent ways"


def test_a_rig_without_a_loop_has_no_derivative_of_its_width():
    quiet = replace(RIG, friction=Friction(), material=replace(RIG.material, loop_share=0.0))
    found = sensitivities(quiet, PROGRAM)
    assert found.of
    for one in found.of.values():
        assert np.isnan([one.width, one.area, one.energy]).all()
        assert np.isfinite(one.range)
