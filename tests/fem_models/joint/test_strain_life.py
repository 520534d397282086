"""Cycles to failure of Nitinol, against the sentences of the sources, and the line of one's own metal."""

import math
from itertools import pairwise

import pytest

from fem_models.joint.strain_life import ENDURANCE_CYCLES, StrainLife, endurance_limit, nitinol_life

KNEE = 0.009


@pytest.mark.parametrize(("mean", "limit"), [(0.0, 0.0055), (0.03, 0.0016), (0.07, 0.0016), (-0.03, 0.0016)])
def test_endurance_limit_is_that_of_cao(mean, limit):
    """0.55 % without mean strain, 0.16 % from 3 to 7 %."""
    assert endurance_limit(mean) == pytest.approx(limit)


def test_below_the_endurance_limit_no_failure_is_expected():
    life = nitinol_life(0.004, 0.0, KNEE)
    assert (life.low, life.median) == (ENDURANCE_CYCLES, math.inf)


def test_at_the_transformation_life_is_below_1e5():
    """Tobushi 1998: shorter than 1e5 cycles in the region of the martensitic transformation."""
    life = nitinol_life(KNEE, 0.0, KNEE)
    assert 2e4 < life.median < 1e5
    assert life.low < 2e4 < 1e5 < life.high


def test_exponent_lies_in_the_range_of_the_source():
    """Ten times the amplitude shortens life by 10^(1/c), c from 0.40 (source) to 0.56 (assumed)."""
    ratio = nitinol_life(KNEE, 0.0, KNEE).median / nitinol_life(10 * KNEE, 0.0, KNEE).median
    assert 10 ** (1 / 0.56) < ratio < 10 ** (1 / 0.40)


def test_the_assumed_exponent_widens_the_interval():
    """By hand at ten times the amplitude: slopes from 1/0.40, each end with the least favourable upper exponent."""
    life, other = nitinol_life(10 * KNEE, 0.0, KNEE), math.hypot(
        0.475 * math.log(5), 1.96 * math.sqrt(math.log1p(0.3**2))
    )  # fmt: skip

    def ends(most):
        slopes, ratio = (2.5, 1 / most), math.log(10)
        wide = math.hypot(other, 0.475 * (slopes[0] - slopes[1]) * ratio)
        median = math.sqrt(2e4 * 1e5) * math.exp(-0.5 * sum(slopes) * ratio)
        return median * math.exp(-wide), median * math.exp(wide)

    assert life.low == pytest.approx(min(ends(most)[0] for most in (0.48, 0.64)))
    assert life.high == pytest.approx(max(ends(most)[1] for most in (0.48, 0.64)))
    assert ends(0.56)[0] > life.low
    assert ends(0.56)[1] < life.high


def test_life_falls_with_amplitude_and_the_interval_widens():
    lives = [nitinol_life(a, 0.0, KNEE) for a in (0.006, 0.008, KNEE, 0.02, 0.04)]
    assert all(one.median > two.median for one, two in pairwise(lives))
    assert all(one.low < one.median < one.high for one in lives)
    assert lives[-1].high / lives[-1].low > lives[2].high / lives[2].low


def test_mean_strain_shortens_life_below_the_transformation():
    assert nitinol_life(0.005, 0.03, KNEE).median < nitinol_life(0.005, 0.0, KNEE).low


def test_own_metal_follows_its_line():
    """ln N is normal with the scatter: half width 1.96 of it."""
    steel = StrainLife(strain=0.002, cycles=1e6, exponent=0.5, scatter=0.5)
    life = steel.life(0.004)
    assert life.median == pytest.approx(1e6 / 4)
    assert math.log(life.high / life.low) == pytest.approx(2 * 1.96 * 0.5)
    assert steel.life(0.0).median == math.inf


@pytest.mark.parametrize("change", [{"strain": 0.0}, {"cycles": -1.0}, {"exponent": math.nan}, {"scatter": -0.1}])
def test_impossible_lines_are_refused(change):
    with pytest.raises(ValueError, match="expected"):
        StrainLife(**({"strain": 0.002, "cycles": 1e6, "exponent": 0.5, "scatter": 0.5} | change))
