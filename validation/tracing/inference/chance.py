"""How often chance makes a residual look as much like an effect: a parametric bootstrap of the fit without effects.

The statistic of an effect is T = 2 [max l with it - max l without], both over the same covariances and over all forms
and starts of the effect. Draws are delta + eps: noise and smooth functions as often as each is likely without an
effect, the shapes of the effects as large as clean rigs have them. p is (1 + draws whose largest T is at least that of
the record) / (1 + draws) (Davison, Hinkley 1997, section 4.2.3).
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from itertools import groupby

import numpy as np

from hysteresis.arrays import Floats
from validation.tracing.inference.autoregression import coloured
from validation.tracing.inference.discrepancy import Linearised
from validation.tracing.inference.relevance import Grid
from validation.tracing.inference.score import Covariance, log_likelihood, noise_deg, plain_square, scored

SIMULATIONS = 999
LEVELS = (0.01, 0.05, 0.2)


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
        Statistic that chance reaches in a part alpha of the draws, for each alpha that was asked for.
    covariance, noise_deg
        Most likely without an effect.
    """

    p: float
    statistics: Mapping[str, float]
    critical: Mapping[float, float]
    covariance: Covariance
    noise_deg: float


def chance_of(grid: Grid, *, seed: int = 0, simulations: int = SIMULATIONS, levels: Sequence[float] = LEVELS) -> Chance:
    """Test whether a record shows any effect that it has a shape of; p is 1 where the residual is within steps.

    ``levels`` are the parts of the draws that reach the critical values.
    """
    linear, rng = grid.linear, np.random.default_rng(seed)
    likely = likelihoods(grid)
    weights = np.exp([one.score - likely[0].score for one in likely])
    counts = rng.multinomial(simulations, weights / weights.sum())
    draws = [
        one.noise_deg * drawn(linear, one.covariance, scales_of_rigs(grid, one.noise_deg, rng, int(count)), rng)
        for one, count in zip(likely, counts, strict=True)
        if count
    ]
    without, with_each = _largest_scores(grid, np.column_stack([linear.residual, *draws]))
    statistics = 2 * (with_each - without)
    largest = statistics.max(axis=0, initial=0.0)
    return Chance(
        p=1.0 if linear.within_steps else float(1 + (largest[1:] >= largest[0]).sum()) / (1 + simulations),
        statistics=dict(zip(linear.names, statistics[:, 0].tolist(), strict=True)),
        critical={alpha: float(np.quantile(largest[1:], 1 - alpha)) for alpha in levels},
        covariance=likely[0].covariance,
        noise_deg=likely[0].noise_deg,
    )


@dataclass(frozen=True)
class Likely:
    """A covariance with its score without an effect, and the noise that is most likely there, deg."""

    covariance: Covariance
    score: float
    noise_deg: float


def likelihoods(grid: Grid) -> list[Likely]:
    """Covariances without an effect, the most likely first."""
    linear, found = grid.linear, list[Likely]()
    rows = {rho: one.rows(linear.residual[:, None]) for rho, one in grid.spaces.items()}
    for g in grid.covariances:
        square = float(plain_square(grid.spaces[g.rho], rows[g.rho], g)[0])
        score = float(log_likelihood(grid.spaces[g.rho], np.array(square), g, grid.prior))
        found.append(Likely(g, score, noise_deg(linear, square)))
    return sorted(found, key=lambda one: -one.score)


def scales_of_rigs(grid: Grid, noise: float, rng: np.random.Generator, count: int) -> Floats:
    """Draw how much clean rigs mimic each effect, over the noise, shape (e, count): never fitted to the record itself.

    A rig has a scale that is log-normal over rigs, and each of its effects another about it, log-normal with the same
    mean square.
    """
    prior = grid.prior
    rigs = prior.median * np.exp(prior.spread * rng.standard_normal(count))
    own = np.exp(prior.spread_of_effects * rng.standard_normal((len(grid.linear.names), count)))
    return own * np.exp(-(prior.spread_of_effects**2)) * rigs * grid.linear.half_range_deg / noise


def drawn(linear: Linearised, covariance: Covariance, scales: Floats, rng: np.random.Generator) -> Floats:
    """Draw residuals, discrepancy and noise together, over the noise, shape (m, N).

    The shapes of each effect have ``scales``, shape (e, N); noise and smooth functions are those of the covariance.
    """
    count = scales.shape[1]
    out = coloured(rng.standard_normal((linear.gap.size, count)), linear.gap, covariance.rho)
    shapes = rng.standard_normal((linear.shapes.shape[1], count)) * np.sqrt(linear.shares)[:, None]
    out += linear.shapes @ (shapes * np.repeat(scales, linear.counts, axis=0))
    for name, scale in covariance.pattern:
        columns = linear.smooth[name]
        out += scale * columns @ rng.standard_normal((columns.shape[1], count))
    return out


def _largest_scores(grid: Grid, rows: Floats) -> tuple[Floats, Floats]:
    """Largest scores of rows over the grid: without an effect, shape (N,), and with each, shape (e, N)."""
    plain = np.full(rows.shape[1], -np.inf)
    with_effect = np.full((len(grid.linear.names), rows.shape[1]), -np.inf)
    for rho, covariances in groupby(grid.covariances, key=lambda g: g.rho):
        space = grid.spaces[rho]
        own = space.rows(rows)
        for covariance in covariances:
            found = scored(space, own, covariance, grid.prior)
            np.maximum(plain, found.plain, out=plain)
            np.maximum(with_effect, found.with_effect, out=with_effect)
    return plain, with_effect
