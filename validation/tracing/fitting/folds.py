"""Cross-validation: folds that report, folds inside them that choose, and whether one model predicts better.

A figure that is printed as held out comes from a fold that has chosen neither baseline nor effect (nested
cross-validation; Varma, Simon 2006, doi 10.1186/1471-2105-7-91). A fold is a record where there are several; half of
one of two records, since a fit without one of them could not learn what their protocols tell together; else a cycle,
else a block of the path.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from hysteresis.arrays import Floats, Ints, Mask
from validation.tracing.fitting.fitted import Fitted
from validation.tracing.fitting.holdout import Holdout
from validation.tracing.prepared import PreparedRecord
from validation.tracing.settings import (
    BOOTSTRAP_DRAWS,
    BOOTSTRAP_SAMPLES,
    CONFIDENCE,
    FOLD_BLOCKS,
    LEAST_FOLD_CYCLES,
    LEAST_FOLD_RECORDS,
    MOST_FOLDS,
)


@dataclass(frozen=True, eq=False)
class Fold:
    """Samples that are held out together, shapes (m_i,), and what they are."""

    test: tuple[Mask, ...]
    name: str

    def training(self, *others: Fold) -> Holdout:
        """Give the training masks without this fold and without some others."""
        masks = [fold.test for fold in (self, *others)]
        return Holdout(tuple(~np.any(rows, axis=0) for rows in zip(*masks, strict=True)), self.name)


def extrapolation(drives: Sequence[Floats], fold: Fold, training: Holdout) -> float:
    """Part of the range of a fold's drive that its training samples have not seen; drives have shapes (m_i,)."""
    trained = np.concatenate([drive[mask] for drive, mask in zip(drives, training.train, strict=True)])
    own = np.concatenate([drive[test] for drive, test in zip(drives, fold.test, strict=True)])
    missed = max(0.0, float(trained.min() - own.min())) + max(0.0, float(own.max() - trained.max()))
    return missed / max(float(np.ptp(own)), 1e-300)


def has_folds(records: Sequence[PreparedRecord]) -> bool:
    """Whether records have parts that can predict each other: several records, or several cycles."""
    return len(records) > 1 or _cycles(records[0]).size >= LEAST_FOLD_CYCLES


def folds_of(records: Sequence[PreparedRecord], traced: int | None = None) -> tuple[Fold, ...]:
    """Divide records into folds: each sample is in one of them.

    Parameters
    ----------
    traced
        Number of the first records that are divided; the others are a reference, which is never held out. All by
        default.
    """
    own = list(records[:traced])
    labels: list[Ints]
    if len(own) > LEAST_FOLD_RECORDS:
        labels = [np.full(one.kept.size, i) for i, one in enumerate(own)]
        names = [_name(one, i) for i, one in enumerate(own)]
    elif len(own) > 1:
        labels = [_half(one) + 2 * i for i, one in enumerate(own)]
        names = [f"{half} half of {_name(one, i)}" for i, one in enumerate(own) for half in ("first", "second")]
    else:
        label, names = _within(own[0])
        labels = [label]
    groups = np.array_split(np.arange(len(names)), min(MOST_FOLDS, len(names)))
    fixed = [np.zeros(one.kept.size, dtype=bool) for one in records[len(own) :]]
    return tuple(
        Fold((*(np.isin(row, group) for row in labels), *fixed), ", ".join(names[i] for i in group)) for group in groups
    )


def _name(one: PreparedRecord, i: int) -> str:
    return Path(one.record.source).name or f"record {i + 1}"


def _half(one: PreparedRecord) -> Ints:
    """0 in the first half of a record and 1 in the second, divided between two cycles where there are several."""
    cycles, middle = one.inputs.cycle, one.kept.size // 2
    starts = np.flatnonzero(np.diff(cycles)) + 1
    cut = int(starts[np.argmin(np.abs(starts - middle))]) if starts.size else middle
    return (np.arange(one.kept.size) >= cut).astype(np.int64)


def _cycles(one: PreparedRecord) -> Ints:
    """Numbers of the cycles of a record."""
    return np.unique(one.inputs.cycle[one.inputs.cycle >= 1])


def _within(one: PreparedRecord) -> tuple[Ints, list[str]]:
    """Labels of the samples of one record: cycles, or blocks of equal length."""
    numbers = _cycles(one)
    if numbers.size >= LEAST_FOLD_CYCLES:
        label = np.searchsorted(numbers, np.maximum(one.inputs.cycle, numbers[0]))
        return label, [f"cycle {number}" for number in numbers]
    label = np.minimum(np.arange(one.kept.size) * FOLD_BLOCKS // one.kept.size, FOLD_BLOCKS - 1)
    return label, [f"block {i + 1} of {FOLD_BLOCKS}" for i in range(FOLD_BLOCKS)]


def fold_errors(fitted: Fitted, fold: Fold) -> list[Floats]:
    """Errors of a fit on the samples of a fold, one array a record that has some, deg."""
    return [error[test] for error, test in zip(fitted.errors, fold.test, strict=True) if test.any()]


def mean_square(errors: Sequence[Floats]) -> float:
    """Mean square of all errors, deg^2."""
    row = np.concatenate(list(errors))
    return float(row @ row) / row.size


def log_score(errors: Sequence[Floats], noise_deg: float) -> float:
    """Log likelihood of the errors of one fold, less a constant; their variance has that of the noise added."""
    return -0.5 * sum(e.size for e in errors) * math.log(max(mean_square(errors) + noise_deg**2, 1e-300))


@dataclass(frozen=True)
class Estimate:
    """A number with its 95 % interval."""

    value: float
    low: float
    high: float

    @property
    def is_positive(self) -> bool:
        """Whether the whole interval is above zero."""
        return self.low > 0.0


def gain(before: Sequence[Floats], after: Sequence[Floats]) -> Estimate:
    """How much lower the mean square error of one model is than another's, deg^2: paired block bootstrap.

    Blocks of neighbouring samples are drawn together, since their errors are correlated (Kuensch 1989, doi
    10.1214/aos/1176347265).

    Parameters
    ----------
    before, after
        Errors of the same samples, one array a record or part of it, deg.
    """
    a, b, counts = _blocks(before, after)
    draws = _draws(counts.size)
    sums = (a - b)[draws].sum(axis=1) / counts[draws].sum(axis=1)
    return _estimate(float((a - b).sum() / counts.sum()), sums)


def share(before: Sequence[Floats], after: Sequence[Floats], floor_deg: float) -> Estimate:
    """Part of the mean square above the noise floor that one model takes from another's, 0 to 1.

    Parameters
    ----------
    before, after
        As in :func:`gain`.
    """
    a, b, counts = _blocks(before, after)
    draws = _draws(counts.size)
    samples = counts[draws].sum(axis=1)
    value = _part(a.sum() / counts.sum(), b.sum() / counts.sum(), floor_deg)
    drawn = _part(a[draws].sum(axis=1) / samples, b[draws].sum(axis=1) / samples, floor_deg)
    return _estimate(float(value), np.asarray(drawn))


def _part(before: Floats | float, after: Floats | float, floor_deg: float) -> Floats:
    above = np.maximum(np.asarray(before) - floor_deg**2, 1e-12 * np.maximum(before, 1e-300))
    return np.asarray(np.clip((np.asarray(before) - after) / above, 0.0, 1.0))


def _blocks(before: Sequence[Floats], after: Sequence[Floats]) -> tuple[Floats, Floats, Floats]:
    """Give the sums of squares of both models in blocks, and the sample counts of these."""
    rows = []
    for one, other in zip(before, after, strict=True):
        count = max(1, round(one.size / BOOTSTRAP_SAMPLES))
        parts = zip(np.array_split(one**2, count), np.array_split(other**2, count), strict=True)
        rows += [(float(p.sum()), float(q.sum()), float(p.size)) for p, q in parts if p.size]
    a, b, counts = np.array(rows).T
    return a, b, counts


def _draws(blocks: int) -> Ints:
    return np.random.default_rng(0).integers(0, blocks, (BOOTSTRAP_DRAWS, blocks))


def _estimate(value: float, drawn: Floats) -> Estimate:
    tail = 0.5 * (1.0 - CONFIDENCE)
    low, high = np.quantile(drawn, [tail, 1.0 - tail])
    return Estimate(value, float(low), float(high))
