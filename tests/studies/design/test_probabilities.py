"""Probabilities from draws and by subset simulation, against closed forms."""

import numpy as np
import pytest
from scipy.stats import norm

from studies.design.reliability import share
from studies.design.subset import SubsetSize, small_probability, subset_simulation


def test_interval_of_a_share_is_the_exact_one():
    """No failure in n draws: the lower end of P(met) is 0.025^(1/n) (Clopper and Pearson)."""
    found = share(np.ones(100, dtype=bool))
    assert (found.value, found.high) == (1.0, 1.0)
    assert found.low == pytest.approx(0.025 ** (1 / 100))
    assert share(np.zeros(100, dtype=bool)).high == pytest.approx(1 - 0.025 ** (1 / 100))


def plane(beta):
    """Fail beyond a plane at a distance of beta: the probability is that of the normal tail."""
    return lambda z: beta - z.sum(axis=1) / np.sqrt(z.shape[1])


@pytest.mark.parametrize("beta", [1.0, 2.0, 3.09, 4.5])
def test_tail_beyond_a_plane(beta):
    found = small_probability(plane(beta), 6, seed=1)
    assert found.low <= norm.sf(beta) <= found.high
    assert found.high / found.low < 6


def test_two_ways_to_fail():
    found = small_probability(lambda z: 3.0 - np.abs(z[:, 0]), 3, seed=2)
    assert found.low <= 2 * norm.sf(3.0) <= found.high


def test_far_fewer_tubes_than_draws_would_take():
    _, calls = subset_simulation(plane(4.5), 6, np.random.default_rng(0), 500)
    assert calls < 5000  # one draw in 300,000 fails


def test_same_seed_same_result():
    size = SubsetSize(100, 3)
    assert small_probability(plane(2.5), 4, 9, size) == small_probability(plane(2.5), 4, 9, size)


@pytest.mark.slow
def test_intervals_cover():
    """Of 40 seeds about 38 hold the probability: 33 or more, but for one chance in a thousand."""
    found = [small_probability(plane(3.09), 6, seed) for seed in range(40)]
    assert sum(one.low <= norm.sf(3.09) <= one.high for one in found) >= 33
