"""What a residual depends on: tests for whiteness, and for dependence on drive, rate, cycle, time and others."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy.stats import chi2
from scipy.stats import f as f_law

from hysteresis.arrays import Floats
from validation.tracing.fitting.criterion import lag_one_correlation
from validation.tracing.fitting.fitted import Fitted
from validation.tracing.fitting.least_squares import solve
from validation.tracing.fitting.regressors import direction, distance_since_reversal, rate, spline
from validation.tracing.settings import DEPENDENCE_COLUMNS, PORTMANTEAU_LAGS


@dataclass(frozen=True)
class Dependence:
    """How strongly a residual depends on one quantity.

    Parameters
    ----------
    on
        The quantity; ``neighbours`` is the test for whiteness.
    part
        Part of the residual's variance that a smooth function of the quantity explains, 0 to 1. For whiteness, the
        correlation of neighbouring samples.
    p
        Probability of as large a part by chance: F test of the function's columns, with the number of independent
        samples of a first-order autoregression. For whiteness, the portmanteau test (Ljung, Box 1978, doi
        10.1093/biomet/65.2.297).
    """

    on: str
    part: float
    p: float


def dependences(fitted: Fitted) -> tuple[Dependence, ...]:
    """Test the residual of a fit for whiteness, and for dependence on drive, angle, rate, tension, preload and others.

    Returns
    -------
    tuple
        Whiteness first; quantities that the records do not have are left out.
    """
    out = [Dependence("neighbours", lag_one_correlation(fitted.errors), _portmanteau(fitted.errors))]
    error = fitted.error_deg
    whole, cuts = float(error @ error), np.cumsum([e.size for e in fitted.errors])[:-1]
    for name, values in _quantities(fitted).items():
        low, high = min(float(v.min()) for v in values), max(float(v.max()) for v in values)
        if high - low <= 0 or whole == 0:
            continue
        columns = [spline(v, low, high, DEPENDENCE_COLUMNS) for v in values]
        basis = np.concatenate([c - c.mean(axis=0) for c in columns])
        remaining = error - basis @ solve(basis, error)
        if (rank := int(np.linalg.matrix_rank(basis))) == 0:  # constant in every record, as is the offset
            continue
        part = min(max(1.0 - float(remaining @ remaining) / whole, 0.0), 1.0)
        r = lag_one_correlation(np.split(remaining, cuts)) if part < 1 else 0.0  # this residual is rounding
        spare = remaining.size * (1 - r) / (1 + r) - rank - 1
        fisher = part / rank / ((1 - part) / spare) if part < 1 else math.inf
        p = float(f_law.sf(fisher, rank, spare)) if spare > 0 else 1.0
        out.append(Dependence(name, part, p))
    return tuple(out)


def _portmanteau(errors: Sequence[Floats]) -> float:
    """Probability of the first autocorrelations of all records together, were the errors white."""
    total, lags = 0.0, 0
    for error in errors:
        m, power = error.size, float(error @ error)
        if m < 4 * PORTMANTEAU_LAGS or power == 0:
            continue
        r = np.array([float(error[k:] @ error[:-k]) / power for k in range(1, PORTMANTEAU_LAGS + 1)])
        total += m * (m + 2) * float(np.sum(r**2 / (m - np.arange(1, PORTMANTEAU_LAGS + 1))))
        lags += PORTMANTEAU_LAGS
    return float(chi2.sf(total, lags)) if lags else 1.0


def _quantities(fitted: Fitted) -> dict[str, list[Floats]]:
    """Values of what a residual may depend on, one array a record."""
    problem = fitted.model.problem
    observed, inputs = problem.observed, problem.inputs
    out = {
        "drive": [s.drive for s in inputs],
        "angle": [angle + error for angle, error in zip(observed, fitted.errors, strict=True)],
        "direction": [direction(s.drive) for s in inputs],
        "distance since reversal": [direction(s.drive) * distance_since_reversal(s.drive) for s in inputs],
        "cycle": [s.cycle.astype(float) for s in inputs],
        "time": [s.time_s for s in inputs],
    }
    if all(s.timed for s in inputs):
        out["rate"] = [rate(s) for s in inputs]
    tensions = [(one.record.tension_a_N, one.kept) for one in problem.records]
    if all(tension is not None for tension, _ in tensions):
        out["tension"] = [tension[kept] for tension, kept in tensions if tension is not None]
    preloads = problem.preloads_N
    if preloads and np.ptp(preloads) > 0:  # every record has its own offset: the preload only shows in a slope
        scale = max(float(np.abs(s.drive).max()) for s in inputs)
        out["drive by preload"] = [
            s.drive / scale * (p - np.mean(preloads)) for s, p in zip(inputs, preloads, strict=True)
        ]
    return out
