"""Which of several fitted effects a record does not tell apart: each is tested against the best of the others.

If effect e made the record, the fit o of another effect would leave r_o - r_e and noise (Cox's test of separate
families, 1962, by simulation: Williams 1970, doi 10.2307/2528927). Scores are l of the residual beyond the tangent
of each fit, at the covariances and in the contrasts of the fit without effects, less what each parameter costs
(Schwarz 1978, doi 10.1214/aos/1176344136).

Fits that differ by less than the best one leaves are not told apart either: a rig that differs as much from its model
may have any of them.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from hysteresis.arrays import Floats
from validation.tracing.fitting.fitted import Fitted
from validation.tracing.inference.chance import drawn, scales_of_rigs
from validation.tracing.inference.discrepancy import tangent_of
from validation.tracing.inference.leftover import leftover_deg
from validation.tracing.inference.relevance import Grid
from validation.tracing.inference.score import Covariance, Reduced, log_likelihood, noise_deg, reduced


@dataclass(frozen=True, eq=False)
class FrontRunner:
    """A model with effects that is compared with others.

    Parameters
    ----------
    behind
        Score of the best fit less its own.
    p
        Probability that a record of this effect would leave it as far behind.
    within
        Whether it differs from the best fit by no more than that leaves above the noise of the sensor, rms.
    covariance, noise_deg
        Most likely beside it.
    """

    fitted: Fitted
    behind: float
    p: float
    within: bool
    covariance: Covariance
    noise_deg: float


@dataclass(frozen=True, eq=False)
class _Space:
    """Space of all fits for one correlation of the noise: coordinates of residuals, (q, f), and tangents, (q, p)."""

    reduced: Reduced
    residuals: Floats
    tangents: Sequence[Floats]


@dataclass(frozen=True, eq=False)
class _Fits:
    """Fits at one covariance, in coordinates in which the discrepancy with its noise is white.

    ``residuals`` has shape (q, f), ``tangents`` are orthonormal bases, shapes (q, p).
    """

    space: Reduced
    contrasts: Reduced
    turn: Floats
    residuals: Floats
    tangents: Sequence[Floats]


def front_runners_of(grid: Grid, fits: Sequence[Fitted], *, seed: int = 0, simulations: int) -> list[FrontRunner]:
    """Compare fits with effects, the best first; empty without any."""
    if not fits:
        return []
    residuals = np.column_stack([-one.rows.errors[one.rows.train] for one in fits])
    tangents = [tangent_of(one) for one in fits]
    spaces = {rho: _space(grid, rho, residuals, tangents) for rho in dict.fromkeys(g.rho for g in grid.covariances)}
    at = {g: _fits_at(grid, g, spaces[g.rho]) for g in grid.covariances}
    squares = {g: np.array([_square(own, i) for i in range(len(fits))]) for g, own in at.items()}
    sizes = 0.5 * math.log(grid.linear.freedom) * np.array([one.x.size for one in fits])
    scores = {g: log_likelihood(at[g].contrasts, row, g, grid.prior) - sizes for g, row in squares.items()}
    best = [grid.covariances[int(np.argmax([scores[g][i] for g in grid.covariances]))] for i in range(len(fits))]
    own = [float(scores[g][i]) for i, g in enumerate(best)]
    noises = [noise_deg(grid.linear, float(squares[g][i])) for i, g in enumerate(best)]
    found = [
        FrontRunner(one, max(own) - score, 1.0, False, g, noise)
        for one, score, g, noise in zip(fits, own, best, noises, strict=True)
    ]
    drawn_scores = [one - sizes[:, None] for one in _drawn_scores(grid, at, found, seed, simulations)]
    found = [
        replace(one, p=_part_as_far(own_scores.max(axis=0) - own_scores[i], one.behind))
        for i, (one, own_scores) in enumerate(zip(found, drawn_scores, strict=True))
    ]
    found.sort(key=lambda one: one.behind)
    rest, leading = left_deg(grid, found[0]), found[0].fitted
    return [replace(one, within=_difference_deg(one.fitted, leading) <= rest) for one in found]


def _difference_deg(one: Fitted, other: Fitted) -> float:
    """Difference of two fits, rms of the training samples."""
    difference = (one.rows.errors - other.rows.errors)[one.rows.train]
    return float(np.sqrt(np.mean(difference**2)))


def left_deg(grid: Grid, one: FrontRunner) -> float:
    """Measure what a model leaves above the noise of the sensor, rms, deg."""
    rows = one.fitted.rows
    own = replace(grid.linear, residual=-rows.errors[rows.train], tangent=tangent_of(one.fitted))
    return leftover_deg(own, one.covariance, one.noise_deg, one.fitted.noise.unrepeated_deg)


def _part_as_far(behind: Floats, least: float) -> float:
    """Part of the draws that are as far behind, the record counted as one."""
    return float(1 + (behind >= least).sum()) / (1 + behind.size)


def _space(grid: Grid, rho: float, residuals: Floats, tangents: Sequence[Floats]) -> _Space:
    free = replace(grid.linear, tangent=np.empty((len(residuals), 0)))
    space = reduced(free, rho, np.column_stack([residuals, *tangents]))
    return _Space(space, space.rows(residuals).inside, [space.rows(one).inside for one in tangents])


def _fits_at(grid: Grid, g: Covariance, space: _Space) -> _Fits:
    modes = space.reduced.modes(g.pattern)
    turn = np.sqrt(modes.weights(g.tau))[:, None] * modes.turn
    bases = [np.linalg.qr(turn @ one)[0] for one in space.tangents]
    return _Fits(space.reduced, grid.spaces[g.rho], turn, turn @ space.residuals, bases)


def _square(fits: _Fits, i: int) -> float:
    """Give y'P y of the residual of a fit beyond its own tangent."""
    row = fits.residuals[:, i]
    along = fits.tangents[i].T @ row
    return float(row @ row - along @ along)


def _drawn_scores(
    grid: Grid, at: Mapping[Covariance, _Fits], found: Sequence[FrontRunner], seed: int, count: int
) -> list[Floats]:
    """For each fit, if its effect made the record: largest scores of all fits, shape (f, count).

    The covariances are those that are most likely beside one of the fits.
    """
    out = [np.full((len(found), count), -np.inf) for _ in found]
    covariances = tuple(dict.fromkeys(one.covariance for one in found))
    for own in covariances:
        rng, noise = np.random.default_rng(seed), min(one.noise_deg for one in found if one.covariance == own)
        draws = drawn(grid.linear, own, scales_of_rigs(grid, noise, rng, count), rng)
        for g in covariances:
            fits = at[g]
            rows = fits.space.rows(draws)
            unit = fits.turn @ rows.inside
            whole = rows.outside + np.einsum("ij,ij->j", unit, unit)
            along = [basis.T @ unit for basis in fits.tangents]
            for e, own_fit in enumerate(found):
                if own_fit.covariance != own:
                    continue
                size = own_fit.noise_deg
                left = fits.residuals - fits.residuals[:, [e]]
                for o, basis in enumerate(fits.tangents):
                    shift = basis.T @ left[:, o]
                    cross = left[:, o] @ unit - shift @ along[o]
                    plain = whole - np.einsum("ij,ij->j", along[o], along[o])
                    square = size**2 * plain + 2 * size * cross + left[:, o] @ left[:, o] - shift @ shift
                    score = log_likelihood(fits.contrasts, square, g, grid.prior)
                    np.maximum(out[e][o], score, out=out[e][o])
    return out
