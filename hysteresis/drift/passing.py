"""When a drifting number will pass a limit, with an interval.

From an unknown record on, the number is a straight line over time or uses, before it a constant, with normal noise. The
record has weights by its likelihood, and given the record the line has the distribution of a regression with flat
priors (Box and Tiao 1973, chapter 2). Draws of both give the time at which the line crosses the limit.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from hysteresis.arrays import Floats

DRAWS = 4_000
_EDGE = 2
_CENTRAL = 0.95


@dataclass(frozen=True)
class Passing:
    """When a limit is passed, on the axis of the records.

    ``at`` is None if fewer than half of the draws pass it within ``horizon``, and ``high`` if fewer than 97.5 % do.
    ``share`` is the share that does. ``passed`` says that the last records are beyond it already.
    """

    at: float | None
    low: float | None
    high: float | None
    share: float
    horizon: float
    passed: bool


def when_passed(at: Floats, values: Floats, limit: float, *, start: int | None = None, seed: int = 0) -> Passing:
    """Extrapolate a number, shape (n,), at increasing places, shape (n,), to a limit.

    Parameters
    ----------
    start
        The record from which the number changes, if that is known from a test of all numbers: then the two records on
        either side count, too.
    seed
        Of the draws.
    """
    n, rng = at.size, np.random.default_rng(seed)
    firsts = range(_EDGE, n - _EDGE) if start is None else range(max(1, start - 2), min(n - 2, start + 2) + 1)
    fits = [_line(at, values, k) for k in firsts]
    freedom = max(1, n - 3)
    logs = np.array([-0.5 * n * math.log(max(squares, 1e-300)) for _, _, squares in fits])
    weights = np.exp(logs - logs.max())
    counts = rng.multinomial(DRAWS, weights / weights.sum())
    crossings = []
    side = math.copysign(1.0, limit - float(values[: max(2, firsts[0])].mean()))
    for (line, root, squares), k, count in zip(fits, firsts, counts, strict=True):
        deviation = np.sqrt(squares / rng.chisquare(freedom, count))
        drawn = line + (rng.standard_normal((count, 2)) @ root.T) * deviation[:, np.newaxis]
        slope = drawn[:, 1]
        crossing = np.where(
            slope * side > 0, at[k - 1] + (limit - drawn[:, 0]) / np.where(slope == 0, 1.0, slope), np.inf
        )
        crossings.append(crossing)
    every = np.concatenate(crossings)
    horizon = float(at[-1] + 10.0 * (at[-1] - at[0]))
    passing = every <= horizon

    def quantile(share: float) -> float | None:
        found = float(np.quantile(np.where(passing, every, np.inf), share, method="lower"))
        return found if math.isfinite(found) else None

    beyond = bool(np.all((values[-2:] - limit) * side >= 0))
    tail = 0.5 * (1.0 - _CENTRAL)
    return Passing(quantile(0.5), quantile(tail), quantile(1.0 - tail), float(passing.mean()), horizon, beyond)


def _line(at: Floats, values: Floats, first: int) -> tuple[Floats, Floats, float]:
    """Fit a constant and a line from the record before ``first`` on: coefficients, root of covariance, squares."""
    columns = np.column_stack([np.ones(at.size), np.maximum(at - at[first - 1], 0.0)])
    within = np.linalg.inv(columns.T @ columns)
    line = within @ columns.T @ values
    rest = values - columns @ line
    return line, np.linalg.cholesky(within), float(rest @ rest)
