"""Non-local memory: loops of a Prandtl-Ishlinskii law close and are congruent, those of Bouc-Wen are not."""

from itertools import pairwise

import numpy as np
import pytest

from hysteresis.laws.bouc_wen import BoucWen, hysteresis
from hysteresis.laws.elements import LAWS, Place, elements_of
from hysteresis.laws.prandtl_ishlinskii import plays
from hysteresis.laws.stops import follow_stops, thresholds

A, SATURATION, POWER, SHARE = -0.9, 2.0, 0.6, 0.2
FINE = 40


def path_through(*turns: float) -> np.ndarray:
    pieces = [np.linspace(a, b, FINE, endpoint=False) for a, b in pairwise(turns)]
    return np.concatenate([*pieces, turns[-1:]])


def iwan(path, skew=0.0, bow=0.0, state=0.0):
    row = np.array([[A, SATURATION, POWER, SHARE, skew, bow, state]])
    return follow_stops(path, row, 0.0, 10.0)[0]


def test_a_law_of_stops_is_a_sum_of_plays():
    path = path_through(0, 7, -3, 5, -8, 2)
    r = thresholds(SATURATION / abs(A), POWER, SHARE)
    weights = np.append(np.full(len(r) - 1, (1 - SHARE) / (len(r) - 1)), SHARE)
    assert weights @ r == pytest.approx(SATURATION / abs(A), rel=1e-12)
    np.testing.assert_allclose(iwan(path), A * (path - weights @ plays(path, r)), atol=1e-12)
    assert np.abs(iwan(path_through(0, 60))).max() == pytest.approx(SATURATION, rel=1e-12)


def test_thresholds_tend_to_the_power_law():
    """First loading is the integral of min(d, r) over the density: closed form of Segalman's four constants."""
    top = thresholds(1.0, POWER, 0.0)[-1]
    d = np.linspace(0, 1.2 * top, 30)
    u = np.minimum(d / top, 1.0)
    exact = -SATURATION * (u - u ** (POWER + 1) / (POWER + 1)) * (POWER + 1) / POWER
    found = follow_stops(np.append(d, 9e9), np.array([[-SATURATION, SATURATION, POWER, 0.0, 0, 0, 0]]), 0.0, 1.0)[
        0, :-1
    ]
    np.testing.assert_allclose(found, exact, atol=4e-3 * SATURATION)  # 20 thresholds in place of a density


@pytest.mark.parametrize("skew", [0.0, 0.3])
def test_wiping_out(skew):
    """An inner loop leaves no trace once the path has passed its turning points: the outer loop closes."""
    whole, with_inner = path_through(0, 8, -8, 8), path_through(0, 8, -8, 3, -4, 1, -2, 8)
    assert iwan(with_inner, skew)[-1] == pytest.approx(iwan(whole, skew)[-1], abs=1e-12)
    shrinking = path_through(0, 8, -2, 4, -2)  # back to the turning point -2 from inside
    assert iwan(shrinking, skew)[-1] == pytest.approx(iwan(shrinking, skew)[2 * FINE], abs=1e-12)


def test_shrinking_loops_of_bouc_wen_do_not_close():
    law = BoucWen(A=-0.9, beta=0.3, gamma=0.1, n=1.0)
    shrinking = path_through(0, 4, -1, 2, -1)
    h = hysteresis(shrinking, law)
    gap = abs(h[-1] - h[2 * FINE])
    # y' = 1 - y and 1 + kappa |y| in closed form (n = 1), from the turning point -1 and back to it
    s, kappa, unit = law.saturation_deg, (0.3 - 0.1) / 0.4, abs(law.A) / law.saturation_deg

    def onward(y: float, way: float) -> float:
        way *= unit
        if y < 0:
            to_zero = np.log1p(kappa * -y) / kappa
            if way < to_zero:
                return float(-((1 + kappa * -y) * np.exp(-kappa * way) - 1) / kappa)
            y, way = 0.0, way - to_zero
        return float(1 - (1 - y) * np.exp(-way))

    first = onward(-onward(0.0, 4), 5)
    back = onward(-onward(-first, 3), 3)
    assert gap == pytest.approx(s * abs(back - first), rel=1e-9)
    assert gap > 0.02 * s


def test_loops_of_equal_range_are_congruent_unless_the_width_depends_on_position():
    """The same small loop after two histories and at two places, from its lower turning point: the shape of h."""

    def small(skew: float, *before: float, at: float) -> np.ndarray:
        h = iwan(path_through(0, *before, at, at + 2, at), skew)[-2 * FINE - 1 :]
        return h - h[0]

    here = small(0.0, 8, at=-3)
    np.testing.assert_allclose(small(0.0, 8, -6, 6, at=2), here, atol=1e-12)
    assert np.abs(small(0.6, 8, -6, 6, at=2) - small(0.6, 8, at=-3)).max() > 0.02


def test_width_depends_on_position_by_its_factor():
    skew, bow = 0.3, -0.2
    path = path_through(0, -12, 12, -12)
    h, x = iwan(path, skew, bow), path / 10
    rising, falling = h[FINE : 2 * FINE + 1], h[2 * FINE :][::-1]
    middle = slice(FINE // 2 - 4, FINE // 2 + 5)  # all stops slip there on both ways
    expected = 2 * SATURATION * np.exp((skew + bow * x) * x)[FINE : 2 * FINE + 1]
    np.testing.assert_allclose((falling - rising)[middle], expected[middle], rtol=1e-9)


@pytest.mark.parametrize("name", LAWS)
def test_an_element_follows_as_its_law_and_keeps_its_state(name):
    rng = np.random.default_rng(3)
    law = LAWS[name]
    place = Place(1.0, 8.0)
    between = [c.low + (0.3 + 0.4 * rng.random()) * (c.high - c.low) for c in law.constants]
    values = np.array([np.log(0.8), np.log(1.7), *between, -0.6])
    path = path_through(0, 7, -3, 5, -8, 2)
    whole = law.follow(path, np.array([-1.0]), values[np.newaxis], place)[0]
    (element,) = elements_of(name, -1.0, [values.tolist()], list(place))
    np.testing.assert_allclose(element.along(path), whole, atol=1e-12)
    half = 2 * FINE + 7
    np.testing.assert_allclose(element.after(path[: half + 1]).along(path[half:]), whole[half:], atol=1e-9)
    assert np.abs(whole).max() <= element.saturation_deg * (1 + 1e-9)
    with pytest.raises(ValueError, match="expected rows of"):
        elements_of(name, -1.0, [[0.0]], [0.0, 1.0])
