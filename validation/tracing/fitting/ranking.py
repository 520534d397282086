"""The candidates of a trace as a chart ranks them: held-out errors with intervals, and the criterion above the best."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING

from validation.tracing.fitting.criterion import independent_samples, lag_one_correlation
from validation.tracing.fitting.fitted import Fitted

if TYPE_CHECKING:  # a trace makes its own report
    from validation.tracing.outcome import Candidate, Trace

MOST_RANKED = 10
_Z = 1.96


@dataclass(frozen=True)
class RankedModel:
    """A model of the chart of candidates; its ``name`` is empty for the baseline alone, which comes last.

    ``low_deg`` and ``high_deg`` are the ends of a 95 % interval of the held-out error. ``bic_above_best`` is None where
    folds rank the models. ``chosen`` is the model whose effects are named.
    """

    name: str
    heldout_rmse_deg: float
    low_deg: float
    high_deg: float
    bic_above_best: float | None
    chosen: bool


def best_candidates(trace: Trace) -> list[Candidate]:
    """Give the best candidates, at most ten: by folds where the trace has them, else by the criterion.

    One that finds no equilibrium on the held-out samples has no error there, and is left out.
    """
    there = [c for c in trace.candidates if math.isfinite(c.fitted.heldout_rmse_deg)]
    by_criterion = sorted(there, key=lambda c: -c.delta_bic)
    if trace.baseline.fold_errors is not None:
        by_criterion.sort(key=lambda c: c.fitted.heldout_rmse_deg)
    return by_criterion[:MOST_RANKED]


def ranked_models(trace: Trace) -> tuple[RankedModel, ...]:
    """Rank the best candidates and the baseline; empty where there is no candidate."""
    best = best_candidates(trace)
    if not best:
        return ()
    own, top = len(trace.baseline.names), max(0.0, *(float(c.delta_bic) for c in best))
    by_folds = trace.baseline.fold_errors is not None

    def row(name: str, fitted: Fitted, gain: float) -> RankedModel:
        value, half = with_interval(fitted)
        chosen = bool(trace.names) and fitted.names == trace.augmented.names
        return RankedModel(name, value, value - half, value + half, None if by_folds else top - gain, chosen)

    rows = [row(" + ".join(c.names[own:]), c.fitted, float(c.delta_bic)) for c in best]
    return (*rows, row("", trace.baseline, 0.0))


def with_interval(fitted: Fitted) -> tuple[float, float]:
    """Give the held-out error and half its 95 % interval, for as many samples as are independent."""
    out = [error for error in fitted.heldout_errors if error.size]
    count = max(2.0, independent_samples(fitted.heldout_error_deg.size, lag_one_correlation(out), len(out)))
    return fitted.heldout_rmse_deg, _Z * fitted.heldout_rmse_deg / math.sqrt(2 * count)
