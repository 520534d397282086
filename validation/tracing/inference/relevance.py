"""Which groups of smooth functions a record has in its discrepancy: the relevance of each is found from the record.

Automatic relevance determination (MacKay 1992, doi 10.1162/neco.1992.4.3.415) on a grid: groups are added one by one,
each with the scale that raises the score most, as long as it rises.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from validation.tracing.inference.discrepancy import Linearised
from validation.tracing.inference.priors import DiscrepancyPrior
from validation.tracing.inference.score import (
    RHOS,
    SCALES,
    TAUS,
    Covariance,
    Pattern,
    Reduced,
    Rows,
    log_likelihood,
    plain_square,
    reduced,
    squares_by_shape,
)

REACH = 12.0
"""Logarithm of the likelihood ratio beyond which a point of the grid is left out: it saves two fifths of the time."""


@dataclass(frozen=True, eq=False)
class Grid:
    """Covariances that a record asks for, those of one correlation together, and the record reduced for each."""

    linear: Linearised
    prior: DiscrepancyPrior
    covariances: Sequence[Covariance]
    spaces: Mapping[float, Reduced]


def relevant_grid(linear: Linearised, prior: DiscrepancyPrior) -> Grid:
    """Find the covariances that a record asks for.

    Patterns are those of the residual, and those that are left beside the effect that takes most of it.
    """
    spaces = {rho: reduced(linear, rho) for rho in RHOS}
    rows = {rho: one.rows(linear.residual[:, None]) for rho, one in spaces.items()}
    patterns: dict[Pattern, None] = {(): None}
    kept = dict[float, None]()
    for beside in (False, True):
        at, score = _best(spaces, rows, (), prior)
        if beside and linear.names:
            rows = {rho: _without_best_effect(spaces[rho], rows[rho], replace(at, rho=rho)) for rho in RHOS}
            at, score = _best(spaces, rows, (), prior)
        while (wider := _widened(spaces[at.rho], rows[at.rho], at, prior)) is not None:
            found, better = _best(spaces, rows, wider, prior)
            if better <= score:
                break
            at, score = found, better
            patterns[wider] = None
        kept |= dict.fromkeys(_rhos_within(spaces, rows, at.pattern, prior))
        kept |= dict.fromkeys(_rhos_within(spaces, rows, (), prior))
    covariances = [Covariance(rho, pattern, tau) for rho in RHOS if rho in kept for pattern in patterns for tau in TAUS]
    return Grid(linear, prior, covariances, spaces)


def _score(one: Reduced, rows: Rows, covariance: Covariance, prior: DiscrepancyPrior) -> float:
    """Score of a row without an effect."""
    return float(log_likelihood(one, plain_square(one, rows, covariance), covariance, prior)[0])


def _best(
    spaces: dict[float, Reduced], rows: dict[float, Rows], pattern: Pattern, prior: DiscrepancyPrior
) -> tuple[Covariance, float]:
    """Best correlation and scale of the effects' shapes for one pattern, and its score."""
    every = [Covariance(rho, pattern, tau) for rho in RHOS for tau in TAUS]
    scores = [_score(spaces[one.rho], rows[one.rho], one, prior) for one in every]
    best = int(np.argmax(scores))
    return every[best], scores[best]


def _rhos_within(
    spaces: dict[float, Reduced], rows: dict[float, Rows], pattern: Pattern, prior: DiscrepancyPrior
) -> list[float]:
    """Correlations that are within reach of the best one."""
    scores = {
        rho: max(_score(spaces[rho], rows[rho], Covariance(rho, pattern, tau), prior) for tau in TAUS) for rho in RHOS
    }
    return [rho for rho, score in scores.items() if score > max(scores.values()) - REACH]


def _widened(one: Reduced, rows: Rows, at: Covariance, prior: DiscrepancyPrior) -> Pattern | None:
    """Add the group and scale that raise the score most; None where none raises it."""
    modes, linear = one.modes(at.pattern), one.of
    weights = modes.weights(at.tau)
    turned = (modes.turn @ rows.inside)[:, 0]
    square = float(rows.outside[0] + weights @ turned**2)
    chosen = np.log(max(len(linear.smooth), 1) * len(SCALES))
    best, pattern = 0.0, None
    base = float(log_likelihood(one, np.array(square), at, prior))
    for name, smooth in one.smooth.items():
        if any(name == own for own, _ in at.pattern):
            continue
        columns = modes.turn @ smooth
        gram, along = (columns.T * weights) @ columns, columns.T @ (weights * turned)
        size, turn = np.linalg.eigh(gram)
        squares = (turn.T @ along) ** 2
        for scale in SCALES:
            taken = float((scale**2 * squares / (1 + scale**2 * size)).sum())
            determinant = 0.5 * float(np.log1p(scale**2 * np.maximum(size, 0.0)).sum())
            gain = float(log_likelihood(one, np.array(square - taken), at, prior)) - base - determinant - chosen
            if gain > best:
                best, pattern = gain, (*at.pattern, (name, scale))
    return pattern


def _without_best_effect(one: Reduced, rows: Rows, at: Covariance) -> Rows:
    """Take the shape that takes most out of a row, as far as it takes it."""
    modes, linear = one.modes(at.pattern), one.of
    weights = modes.weights(at.tau)
    taken = squares_by_shape(linear, modes.shapes, weights, modes.turn @ rows.inside)[:, 0]
    best = int(np.argmax(taken))
    ends = [*linear.blocks[1:], linear.shapes.shape[1]]
    own = slice(int(linear.blocks[best]), int(ends[best]))
    columns = modes.shapes[:, own]
    amounts = np.linalg.lstsq(columns * np.sqrt(weights)[:, None], np.sqrt(weights) * (modes.turn @ rows.inside)[:, 0])
    return Rows(rows.inside - one.shapes[:, own] @ amounts[0][:, None], rows.outside)
