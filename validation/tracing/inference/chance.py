"""How often chance makes a residual look as much like an effect: a parametric bootstrap of the fit without effects.

The statistic of an effect is T = 2 [max l with it - max l without], both over the same covariances and over all forms
and starts of the effect. Draws are delta + eps at the covariance that is most likely without an effect. p is
(1 + draws whose largest T is at least that of the record) / (1 + draws) (Davison, Hinkley 1997, section 4.2.3).
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from hysteresis.arrays import Floats
from validation.tracing.inference.autoregression import coloured
from validation.tracing.inference.discrepancy import Linearised
from validation.tracing.inference.priors import DiscrepancyPrior
from validation.tracing.inference.relevance import relevant_grid
from validation.tracing.inference.score import Covariance, Reduced, noise_deg, scored

SIMULATIONS = 999


@dataclass(frozen=True, eq=False)
class Chance:
    """The test of a record for any effect.

    Parameters
    ----------
    p
        Probability that chance makes as large a statistic.
    statistics
        Of each effect, by name.
    critical
        Statistic that chance reaches in a part alpha of the draws, for each alpha of 0.01, 0.05 and 0.2.
    covariance, noise_deg
        Most likely without an effect.
    """

    p: float
    statistics: Mapping[str, float]
    critical: Mapping[float, float]
    covariance: Covariance
    noise_deg: float


def chance_of(
    linear: Linearised, prior: DiscrepancyPrior, *, seed: int = 0, simulations: int = SIMULATIONS
) -> Chance:
    """Test whether a record shows any effect that it has a shape of."""
    covariances, spaces = relevant_grid(linear, prior)
    plain = {one: float(_scores(linear, spaces, [one], linear.residual[:, None], prior)[0][0]) for one in covariances}
    best = max(plain, key=lambda one: plain[one])
    noise = _noise_at(spaces[best.rho], best, linear.residual)
    draws = drawn(linear, best, noise, np.random.default_rng(seed), simulations)
    without, with_each = _scores(linear, spaces, covariances, np.column_stack([linear.residual, draws]), prior)
    statistics = 2 * (with_each - without)
    largest = statistics.max(axis=0, initial=0.0)
    return Chance(
        p=float(1 + (largest[1:] >= largest[0]).sum()) / (1 + simulations),
        statistics=dict(zip(linear.names, statistics[:, 0].tolist(), strict=True)),
        critical={alpha: float(np.quantile(largest[1:], 1 - alpha)) for alpha in (0.01, 0.05, 0.2)},
        covariance=best,
        noise_deg=noise,
    )


def drawn(
    linear: Linearised, covariance: Covariance, noise: float, rng: np.random.Generator, count: int
) -> Floats:
    """Draw residuals, discrepancy and noise together, shape (m, count), deg."""
    out = coloured(rng.standard_normal((linear.gap.size, count)), linear.gap, covariance.rho)
    shapes = rng.standard_normal((linear.shapes.shape[1], count)) * np.sqrt(linear.shares)[:, None]
    out += covariance.tau * linear.shapes @ shapes
    for name, scale in covariance.pattern:
        columns = linear.smooth[name]
        out += scale * columns @ rng.standard_normal((columns.shape[1], count))
    return noise * out


def _scores(
    linear: Linearised,
    spaces: Mapping[float, Reduced],
    covariances: Sequence[Covariance],
    rows: Floats,
    prior: DiscrepancyPrior,
) -> tuple[Floats, Floats]:
    """Largest scores of rows over covariances: without an effect, shape (N,), and with each, shape (e, N)."""
    plain = np.full(rows.shape[1], -np.inf)
    with_effect = np.full((len(linear.names), rows.shape[1]), -np.inf)
    for rho in dict.fromkeys(one.rho for one in covariances):
        own = spaces[rho].rows(rows)
        for covariance in covariances:
            if covariance.rho == rho:
                found = scored(spaces[rho], own, covariance, prior)
                np.maximum(plain, found.plain, out=plain)
                np.maximum(with_effect, found.with_effect, out=with_effect)
    return plain, with_effect


def _noise_at(one: Reduced, covariance: Covariance, residual: Floats) -> float:
    """Noise that is most likely at a covariance, deg."""
    rows, modes = one.rows(residual[:, None]), one.modes(covariance.pattern)
    square = rows.outside + modes.weights(covariance.tau) @ (modes.turn @ rows.inside) ** 2
    return noise_deg(one.of, float(square[0]))
