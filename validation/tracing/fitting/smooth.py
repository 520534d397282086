"""Smooth functions fitted to a residual: what an effect must do better than to be named.

Functions of the drive, its direction, the rate, time, the cycle, the distance since the last reversal and the preload
fit much of any residual and name no cause.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from itertools import pairwise

import numpy as np

from hysteresis.arrays import Floats, Mask
from validation.tracing.fitting.criterion import bic
from validation.tracing.fitting.fitted import Fitted
from validation.tracing.fitting.least_squares import solve
from validation.tracing.fitting.regressors import direction, distance_since_reversal, even, odd, rate, spline
from validation.tracing.problem import Problem
from validation.tracing.settings import SMOOTH_FUNCTION_BIC

_ODD, _EVEN = "an odd function of the drive", "an even function of the drive"
_OF_THE_DRIVE = frozenset({_ODD, _EVEN, "the drive"})


@dataclass(frozen=True)
class Smooth:
    """Smooth functions that were added to a fitted model.

    Parameters
    ----------
    names
        What they are functions of, in the order in which they were added.
    square
        Mean square error over all samples with them, deg^2.
    parameters
        Number of parameters, those of the model included.
    gains
        Part of the mean square that each function takes away.
    competitor
        The functions that a named effect must be better than, where they are not all of these: a curve of the only
        input of records that only load fits whatever they show, and speaks against no effect.
    """

    names: tuple[str, ...]
    square: float
    parameters: int
    gains: tuple[float, ...]
    competitor: Smooth | None = None

    def bic(self, samples: float) -> float:
        """Criterion of the model with these functions."""
        return bic(self.square, self.parameters, samples)


def smooth_functions(fitted: Fitted, samples: float | None = None) -> Smooth:
    """Add smooth functions to a fitted model, the best first, as long as the BIC falls.

    Each is linear in its parameters and fitted, together with the linearised model, to the training samples.

    Parameters
    ----------
    samples
        Number of independent samples; by default that of the model.
    """
    samples = fitted.angle_samples if samples is None else samples
    bases = bases_of(fitted.model.problem)
    if not all(one.only_loads for one in fitted.model.problem.records):
        return _selected(fitted, samples, bases)
    others = {name: basis for name, basis in bases.items() if "direction" not in name}
    del others["the distance since the last reversal"]
    competitors = {name: basis for name, basis in others.items() if name not in _OF_THE_DRIVE}
    return replace(_selected(fitted, samples, others), competitor=_selected(fitted, samples, competitors))


def _selected(fitted: Fitted, samples: float, bases: Mapping[str, Floats]) -> Smooth:
    """Add the best function, then the next one."""
    remaining = dict(bases)
    train, columns = fitted.holdout.train_mask, fitted.jacobian
    taken: list[str] = []
    squares, parameters = [fitted.mean_square], columns.shape[1]
    while remaining:
        trials = {
            name: _mean_square(fitted.error_deg, np.column_stack([columns, basis]), train)
            for name, basis in remaining.items()
        }
        scores = {name: bic(s, parameters + remaining[name].shape[1], samples) for name, s in trials.items()}
        best = min(scores, key=lambda name: scores[name])
        if scores[best] > bic(squares[-1], parameters, samples) - SMOOTH_FUNCTION_BIC:
            break
        basis = remaining.pop(best)
        taken.append(best)
        columns, parameters = np.column_stack([columns, basis]), parameters + basis.shape[1]
        squares.append(trials[best])
    gains = tuple(1 - b / a for a, b in pairwise(squares))
    return Smooth(tuple(taken), squares[-1], parameters, gains)


def _mean_square(error_deg: Floats, columns: Floats, train: Mask) -> float:
    """Mean square over all samples after columns were fitted to the training samples."""
    residual = error_deg + columns @ solve(columns[train], -error_deg[train])
    return float(residual @ residual) / residual.size


def bases_of(problem: Problem) -> dict[str, Floats]:
    """Columns of the smooth functions, shapes (m, k), centred in every record, by what they are functions of."""
    inputs = problem.inputs
    reach = max(float(np.abs(s.drive).max()) for s in inputs)
    x = [s.drive / reach for s in inputs]
    signs = [direction(s.drive) for s in inputs]
    since = [distance_since_reversal(s.drive) / reach for s in inputs]
    preload = problem.preloads_N
    mean = float(np.mean(preload)) if preload else 0.0
    most = max(int(s.cycle.max()) for s in inputs)
    out = {
        _ODD: [odd(v) for v in x],
        _EVEN: [even(v) for v in x],
        "the drive": [spline(v, -1, 1, 10) for v in x],
        "the drive and its direction": [spline(v, -1, 1, 8) * sign[:, None] for v, sign in zip(x, signs, strict=True)],
        "the distance since the last reversal": [
            spline(np.minimum(d, 2.0), 0, 2, 8) * sign[:, None] for d, sign in zip(since, signs, strict=True)
        ],
        "time": [spline(s.time_s / max(float(s.time_s[-1]), 1e-9), 0, 1, 6) for s in inputs],
    }
    if all(s.timed for s in inputs):
        fastest = max(float(np.abs(rate(s)).max()) for s in inputs)
        out["the rate"] = [spline(np.clip(rate(s) / fastest, -1, 1), -1, 1, 5) for s in inputs]
    if most >= 2:
        count = min(5, most + 1)
        out["the cycle"] = [spline(s.cycle / most, 0, 1, count) for s in inputs]
        out["the cycle and the direction of the drive"] = [
            spline(s.cycle / most, 0, 1, count) * sign[:, None] for s, sign in zip(inputs, signs, strict=True)
        ]
    if mean > 0 and np.ptp(preload) > 0.05 * mean:
        out["the drive, by preload"] = [spline(v, -1, 1, 8) * (p / mean - 1) for v, p in zip(x, preload, strict=True)]
        out["the direction of the drive, by preload"] = [
            spline(v, -1, 1, 6) * (sign * (p / mean - 1))[:, None] for v, sign, p in zip(x, signs, preload, strict=True)
        ]
    return {name: np.concatenate([c - c.mean(axis=0) for c in columns]) for name, columns in out.items()}
