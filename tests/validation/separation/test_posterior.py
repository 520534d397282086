"""Randomised fits against posteriors that are known in closed form or by quadrature."""

from dataclasses import dataclass

import numpy as np
import pytest

from validation.separation.posterior import about, effective, optimum, quantiles, sampled, weights_of


@dataclass(frozen=True)
class Linear:
    """H(z) = (A z - b, z): a normal posterior."""

    a: np.ndarray
    b: np.ndarray

    def residual(self, z):
        return np.concatenate([self.a @ z - self.b, z])

    def columns(self, z):
        return np.vstack([self.a, np.eye(z.size)])


@dataclass(frozen=True)
class Exponential:
    """H(z) = ((exp(z) - 2) / s, z)."""

    s: float

    def residual(self, z):
        return np.array([(np.exp(z[0]) - 2) / self.s, z[0]])

    def columns(self, z):
        return np.array([[np.exp(z[0]) / self.s], [1.0]])


def drawn(target, count, size):
    best = optimum(target, np.zeros(size))
    samples = sampled(target, best, count, np.random.default_rng(0))
    return best, np.array([one.z for one in samples]), np.array([one.log_weight for one in samples])


def test_samples_of_a_linear_target_have_its_normal_posterior():
    rng = np.random.default_rng(1)
    target = Linear(rng.normal(size=(6, 3)), rng.normal(size=6))
    best, z, logs = drawn(target, 4000, 3)
    covariance = np.linalg.inv(target.a.T @ target.a + np.eye(3))
    assert np.ptp(logs) < 1e-9  # all weigh the same
    assert z.mean(axis=0) == pytest.approx(covariance @ target.a.T @ target.b, abs=0.05)
    assert np.cov(z.T) == pytest.approx(covariance, abs=0.05)
    # evidence of b ~ N(0, A A' + I), over the constant that it shares with every other model
    marginal = target.a @ target.a.T + np.eye(6)
    exact = -0.5 * target.b @ np.linalg.solve(marginal, target.b) - 0.5 * np.linalg.slogdet(marginal)[1]
    assert logs[0] == pytest.approx(exact, abs=1e-9)
    assert best.log_evidence == pytest.approx(exact, abs=1e-6)


@pytest.mark.parametrize("s", [0.3, 2.0, 20.0])
def test_weights_make_up_for_a_target_that_bends(s):
    target = Exponential(s)
    _, z, logs = drawn(target, 4000, 1)
    grid = np.linspace(-8, 8, 20_001)
    density = np.exp(
        -0.5 * np.array([target.residual(np.array([one])) @ target.residual(np.array([one])) for one in grid])
    )
    area = density.sum() * (grid[1] - grid[0])
    mean = (grid * density).sum() / density.sum()
    spread = np.sqrt(((grid - mean) ** 2 * density).sum() / density.sum())
    weights = weights_of(logs)
    assert weights @ z[:, 0] == pytest.approx(mean, abs=0.06 * spread)
    assert np.sqrt(weights @ (z[:, 0] - mean) ** 2) == pytest.approx(spread, rel=0.06)
    assert np.mean(np.exp(logs)) == pytest.approx(area / np.sqrt(2 * np.pi), rel=0.05)  # the evidence
    assert effective(weights) > 1000


def test_samples_about_an_optimum_have_laplaces_covariance_and_evidence():
    target = Linear(np.array([[2.0, 1.0]]), np.array([1.0]))
    best = optimum(target, np.zeros(2))
    found = about(best, 4000, np.random.default_rng(0))
    covariance = np.linalg.inv(target.a.T @ target.a + np.eye(2))
    assert np.cov(np.array([one.z for one in found]).T) == pytest.approx(covariance, abs=0.05)
    assert found[0].log_weight == best.log_evidence


def test_quantiles_of_equal_weights_are_at_plotting_positions():
    """A further sample is within the k-th and (n + 1 - k)-th of n with the chance 1 - 2 k/(n + 1)."""
    values, weights = np.arange(39.0)[::-1], np.full(39, 1 / 39)
    assert quantiles(values, weights, (0.025, 0.5, 0.975)) == pytest.approx([0.0, 19.0, 38.0])


def test_quantiles_beyond_few_samples_are_on_the_line_of_the_outermost():
    rng, held = np.random.default_rng(0), 0
    for _ in range(2000):
        z = rng.standard_normal(13)
        low, high = quantiles(z[1:], np.full(12, 1 / 12), (0.025, 0.975))
        held += low <= z[0] <= high
    assert 0.91 < held / 2000 < 0.97  # the range of 12 samples holds 11 of 13, 0.85


def test_weights_count_as_repetitions():
    weights = np.array([2.0, 1.0, 1.0]) / 4
    assert effective(weights) == pytest.approx(16 / 6)
    assert quantiles([5.0, 1.0, 2.0], np.array([0.2, 0.6, 0.2]), (0.5,))[0] < 2.0
    assert weights_of([1000.0, 1000.0]) == pytest.approx([0.5, 0.5])
