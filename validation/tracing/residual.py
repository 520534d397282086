"""What is left of records under a model: its noise floor, and what free functions make of it.

A candidate effect must explain the residual better than smooth functions of what the residual may depend on (drive, way
of the drive, rate, time, cycle, distance since the last reversal, preload): such functions fit much and name nothing.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray
from scipy.interpolate import BSpline
from scipy.stats import chi2
from scipy.stats import f as f_law

from hysteresis.arrays import Floats
from hysteresis.metrics import noise_floor
from hysteresis.path import branches
from hysteresis.record import Record
from validation.tracing.effect import SampleInputs
from validation.tracing.fitting import Fitted, bic, correlation_of_neighbours, solve
from validation.tracing.prepared import PreparedRecord
from validation.tracing.problem import Problem

_FEWEST = 8  # samples of a branch that the local noise is read off
_TO_SIGMA = 1.4826  # of a median absolute deviation
_GAIN = 6.0  # BIC that a further free function must bring
_LEAST = 1e-5  # of the angle's range: noise below that is a simulation's
_KNOTS = 6  # columns of a smooth function that dependence is tested with
_LAGS = 10


@dataclass(frozen=True)
class Floor:
    """Noise of the angle, deg: from differences of neighbours, and from cycles that repeat (None without)."""

    local_deg: float
    repeats_deg: float | None

    @property
    def deg(self) -> float:
        """The smaller one: cycles that change count as noise in the one, corners in the other."""
        return self.local_deg if self.repeats_deg is None else min(self.local_deg, self.repeats_deg)


def floor_of(records: Sequence[PreparedRecord], residuals: Sequence[Floats]) -> Floor:
    """Noise floor of records, read off what a model leaves, which is flatter than the angle.

    Locally: the third differences of neighbours along the path, over sqrt(20), by their median; at least what rounding
    to the record's digits makes, 1/sqrt(12) of it, and a part of the range that no sensor of a bending angle resolves.
    """
    local, repeats, weight = [], [], []
    for one, residual in zip(records, residuals, strict=True):
        least = max(one.rounding_deg, _LEAST * float(np.ptp(one.record.angle_deg)))
        third = [np.diff(residual[b], 3) for b in one.branches if b.stop - b.start >= _FEWEST]
        if third:
            size = _TO_SIGMA * float(np.median(np.abs(np.concatenate(third)))) / math.sqrt(20)
            local.append(max(size, least))
            weight.append(residual.size)
        if one.cycles_repeat:
            repeats.append(max(noise_floor(_residual_record(one, residual)), least))
    known = math.sqrt(float(np.mean(np.square(repeats)))) if repeats else None
    if not local:  # branches of a few samples: without cycles that repeat, all that is left may be noise
        whole = np.concatenate([r - r.mean() for r in residuals])
        return Floor(math.sqrt(float(whole @ whole) / whole.size) if known is None else known, known)
    return Floor(math.sqrt(float(np.average(np.square(local), weights=weight))), known)


def _residual_record(one: PreparedRecord, residual: Floats) -> Record:
    return Record(drive=one.drive, angle_deg=residual, drive_unit=one.record.drive_unit, cycle=one.inputs.cycle)


@dataclass(frozen=True)
class Smooth:
    """Free functions of the residual's regressors: their names in the order taken, and what they leave."""

    names: tuple[str, ...]
    square: float  # mean square over all samples
    parameters: int
    gains: tuple[float, ...]  # part of the mean square, one after the other


def smooth_functions(fitted: Fitted, samples: float) -> Smooth:
    """Add free functions to a fitted model, the best first, as long as the criterion falls.

    Each is linear in its constants and fitted together with those of the model, to the fitted samples.

    Parameters
    ----------
    samples
        How many samples count as independent.
    """
    left = _bases(fitted.model.problem)
    seen, own = fitted.holdout.seen, fitted.jacobian
    taken: list[str] = []
    squares, columns, parameters = [fitted.square], own, own.shape[1]
    while left:
        trials = {name: _remaining(fitted.row, np.column_stack([columns, b]), seen) for name, b in left.items()}
        scores = {name: bic(s, parameters + left[name].shape[1], samples) for name, s in trials.items()}
        best = min(scores, key=lambda name: scores[name])
        if scores[best] > bic(squares[-1], parameters, samples) - _GAIN:
            break
        basis = left.pop(best)
        taken.append(best)
        columns, parameters = np.column_stack([columns, basis]), parameters + basis.shape[1]
        squares.append(trials[best])
    gains = tuple(1 - b / a for a, b in pairwise(squares))
    return Smooth(tuple(taken), squares[-1], parameters, gains)


def _remaining(row: Floats, columns: Floats, seen: NDArray[np.bool_]) -> float:
    """Mean square that linear columns leave, fitted to some of the samples."""
    left = row + columns @ solve(columns[seen], -row[seen])
    return float(left @ left) / left.size


@dataclass(frozen=True)
class Dependence:
    """How a residual goes with something: the part of its variance that a smooth function of that has, 0 to 1.

    ``p`` is the probability of such a part, or more, were there nothing: of the F test of the function's columns, where
    as many samples count as what the function leaves has independent ones (an autoregression of first order). Of
    whiteness ``part`` is the correlation of neighbours, and ``p`` that of the portmanteau test (Ljung, Box 1978, doi
    10.1093/biomet/65.2.297).
    """

    on: str
    part: float
    p: float


def dependences(fitted: Fitted) -> tuple[Dependence, ...]:
    """Test the residuals of a fit for whiteness, and on drive, angle, rate, tension, preload, cycle, time and way.

    Returns
    -------
    tuple
        Whiteness first; what no record tells is left out.
    """
    out = [Dependence("neighbours", correlation_of_neighbours(fitted.errors), _portmanteau(fitted.errors))]
    whole, cuts = float(fitted.row @ fitted.row), np.cumsum([e.size for e in fitted.errors])[:-1]
    for name, values in _regressors(fitted).items():
        low, high = min(float(v.min()) for v in values), max(float(v.max()) for v in values)
        if high - low <= 0 or whole == 0:
            continue
        columns = [_spline(v, low, high, _KNOTS) for v in values]
        basis = np.concatenate([c - c.mean(axis=0) for c in columns])
        left = fitted.row - basis @ solve(basis, fitted.row)
        if (rank := int(np.linalg.matrix_rank(basis))) == 0:  # constant in every record, as is its zero
            continue
        part = min(max(1.0 - float(left @ left) / whole, 0.0), 1.0)
        r = correlation_of_neighbours(np.split(left, cuts))
        spare = left.size * (1 - r) / (1 + r) - rank - 1
        p = float(f_law.sf(part / rank / ((1 - part) / spare), rank, spare)) if spare > 0 and part < 1 else 1.0
        out.append(Dependence(name, part, p))
    return tuple(out)


def _portmanteau(errors: Sequence[Floats]) -> float:
    """Probability of the first autocorrelations of all records together, were the errors white."""
    total, lags = 0.0, 0
    for error in errors:
        m, power = error.size, float(error @ error)
        if m < 4 * _LAGS or power == 0:
            continue
        r = np.array([float(error[k:] @ error[:-k]) / power for k in range(1, _LAGS + 1)])
        total += m * (m + 2) * float(np.sum(r**2 / (m - np.arange(1, _LAGS + 1))))
        lags += _LAGS
    return float(chi2.sf(total, lags)) if lags else 1.0


def _regressors(fitted: Fitted) -> dict[str, list[Floats]]:
    """Values of what a residual may go with, one array a record."""
    problem = fitted.model.problem
    observed, inputs = problem.observed, problem.inputs
    out = {
        "drive": [s.drive for s in inputs],
        "angle": [angle + error for angle, error in zip(observed, fitted.errors, strict=True)],
        "direction": [_way(s.drive) for s in inputs],
        "way since reversal": [_way(s.drive) * _since_reversal(s.drive) for s in inputs],
        "cycle": [s.cycle.astype(float) for s in inputs],
        "time": [s.time_s for s in inputs],
    }
    if all(s.timed for s in inputs):
        out["rate"] = [_rate(s) for s in inputs]
    tensions = [(one.record.tension_a_N, one.kept) for one in problem.records]
    if all(tension is not None for tension, _ in tensions):
        out["tension"] = [tension[kept] for tension, kept in tensions if tension is not None]
    preloads = problem.preloads_N
    if preloads and np.ptp(preloads) > 0:  # every record has its own zero, so that only a slope by the preload can show
        scale = max(float(np.abs(s.drive).max()) for s in inputs)
        out["drive by preload"] = [
            s.drive / scale * (p - np.mean(preloads)) for s, p in zip(inputs, preloads, strict=True)
        ]
    return out


def _bases(problem: Problem) -> dict[str, Floats]:
    """Columns of the free functions, by what they are functions of, shapes (m, k), centred in every record."""
    inputs = problem.inputs
    reach = max(float(np.abs(s.drive).max()) for s in inputs)
    x = [s.drive / reach for s in inputs]
    way = [_way(s.drive) for s in inputs]
    since = [_since_reversal(s.drive) / reach for s in inputs]
    preload = problem.preloads_N
    mean = float(np.mean(preload)) if preload else 0.0
    most = max(int(s.cycle.max()) for s in inputs)
    out = {
        "odd in the drive": [_odd(v) for v in x],
        "even in the drive": [_even(v) for v in x],
        "the drive": [_spline(v, -1, 1, 10) for v in x],
        "the drive, on the way up and down": [_spline(v, -1, 1, 8) * w[:, None] for v, w in zip(x, way, strict=True)],
        "the way since the last reversal": [
            _spline(np.minimum(d, 2.0), 0, 2, 8) * w[:, None] for d, w in zip(since, way, strict=True)
        ],
        "time": [_spline(s.time_s / max(float(s.time_s[-1]), 1e-9), 0, 1, 6) for s in inputs],
    }
    if all(s.timed for s in inputs):
        fastest = max(float(np.abs(_rate(s)).max()) for s in inputs)
        out["the rate"] = [_spline(np.clip(_rate(s) / fastest, -1, 1), -1, 1, 5) for s in inputs]
    if most >= 2:
        out["the cycle"] = [_spline(s.cycle / most, 0, 1, min(5, most + 1)) for s in inputs]
        out["the cycle, on the way up and down"] = [
            _spline(s.cycle / most, 0, 1, min(5, most + 1)) * w[:, None] for s, w in zip(inputs, way, strict=True)
        ]
    if mean > 0 and np.ptp(preload) > 0.05 * mean:
        out["the drive, by preload"] = [_spline(v, -1, 1, 8) * (p / mean - 1) for v, p in zip(x, preload, strict=True)]
        out["the drive's way, by preload"] = [
            _spline(v, -1, 1, 6) * (w * (p / mean - 1))[:, None] for v, w, p in zip(x, way, preload, strict=True)
        ]
    return {name: np.concatenate([c - c.mean(axis=0) for c in columns]) for name, columns in out.items()}


def _spline(x: Floats, low: float, high: float, count: int) -> Floats:
    """Cubic B-splines on even knots, shape (m, count); of lower degree where there are few."""
    degree = min(3, count - 1)
    to_unit = np.linspace(low, high, count - degree + 1)
    knots = np.concatenate([[low] * degree, to_unit, [high] * degree])
    return np.asarray(BSpline.design_matrix(np.clip(x, low, high), knots, degree).toarray())


def _odd(x: Floats) -> Floats:
    return np.column_stack([x, x**3, x**5])


def _even(x: Floats) -> Floats:
    return np.column_stack([x**2, x**4])


def _rate(record_inputs: SampleInputs) -> Floats:
    return np.gradient(record_inputs.drive, record_inputs.time_s)


def _way(drive: Floats) -> Floats:
    """Give +1 on rising branches, -1 on falling ones."""
    out = np.empty(drive.size)
    for branch in branches(drive):
        out[branch.start + 1 if branch.start else 0 : branch.stop] = np.sign(
            drive[branch.stop - 1] - drive[branch.start]
        )
    return out


def _since_reversal(drive: Floats) -> Floats:
    """Way of the drive since the last turning point, without its sign."""
    out = np.empty(drive.size)
    for branch in branches(drive):
        part = slice(branch.start + 1 if branch.start else 0, branch.stop)
        out[part] = np.abs(drive[part] - drive[branch.start])
    return out
