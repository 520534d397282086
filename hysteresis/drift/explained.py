"""Which one number explains that records differ from those of a reference.

Each number of a law (:mod:`hysteresis.drift.states`) is fitted to a record together with the zero alone, and the error
that remains is compared with that of the records of a reference, which have a prediction interval for so many further
ones (Hahn and Meeker 1991, *Statistical Intervals*, section 4.8). What the law cannot describe of the device as it was
is taken out first, where all records have the same drive program: it is the mean error of the reference, sample by
sample.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy.optimize import least_squares
from scipy.stats import t as student

from hysteresis.arrays import Floats
from hysteresis.drift.states import DRAG, LAG, PLAY, ZERO, Followed, RecordModel, longest_lag
from hysteresis.fitting.fit import Fit
from hysteresis.records.record import Record

MISSED = 0.01
"""Probability that records of an unchanged device are beyond the limit."""
_SAME_DRIVE = 1e-2  # of the range: programs that differ by less are the same
_PLAYS = (0.02, 0.06, 0.15, 0.3)  # its error has more than one minimum
_STEP = 1e-5  # of derivatives


@dataclass(frozen=True)
class Left:
    """Errors, root mean square, of new records in which a number may differ.

    ``left`` is that of the number, ``unexplained`` that with the zero alone, and ``usual`` that of the reference with
    the number, all in the unit of the channel. ``limit`` is the largest ``left`` of a reference, see above.
    """

    left: float
    unexplained: float
    usual: float
    limit: float


def left_by(
    fit: Fit, reference: Sequence[Record], records: Sequence[Record], numbers: Sequence[Followed]
) -> dict[str, Left]:
    """Give the errors that remain with each number, by its name.

    Parameters
    ----------
    fit
        Of the device as it was, without a delay.
    reference
        Of the device as it was, at least three.
    records
        Of the device as it is.
    numbers
        Each is fitted with the zero; :data:`hysteresis.drift.states.ZERO` for the zero alone.
    """
    usual = [_fitted(fit, one, ZERO, None) for one in reference] if _same_program([*reference, *records]) else None
    mean = None if usual is None else _mean_of(usual)
    plain = _together([_rms(_fitted(fit, one, ZERO, mean)) for one in records])
    found = dict[str, Left]()
    for number in numbers:
        old = [
            _rms(_fitted(fit, one, number, None if usual is None else _mean_of(usual, but=k)))
            for k, one in enumerate(reference)
        ]
        left = _together([_rms(_fitted(fit, one, number, mean)) for one in records])
        found[number.name] = Left(left, plain, _together(old), _limit(np.array(old), len(records)))
    return found


def _together(errors: Sequence[float]) -> float:
    return _rms(np.array(errors))


def _same_program(records: Sequence[Record]) -> bool:
    first = records[0].drive
    slack = _SAME_DRIVE * float(np.ptp(first))
    return all(one.drive.size == first.size and np.abs(one.drive - first).max() <= slack for one in records)


def _mean_of(rows: Sequence[Floats], but: int | None = None) -> Floats:
    return np.mean([row for k, row in enumerate(rows) if k != but], axis=0)


def _rms(values: Floats) -> float:
    return float(np.sqrt(np.mean(values**2)))


def _limit(old: Floats, count: int) -> float:
    """Upper prediction limit of the mean of ``count`` further values."""
    quantile = float(student.ppf(1 - MISSED, old.size - 1))
    return float(old.mean() + quantile * old.std(ddof=1) * math.sqrt(1 / old.size + 1 / count))


def _fitted(fit: Fit, record: Record, number: Followed, usual: Floats | None) -> Floats:
    """Error of a record in which a number and the zero may differ, less the usual one, shape (m,), deg."""
    names = tuple(dict.fromkeys((ZERO.name, number.name)))
    model = RecordModel(fit, record, names)
    expected = 0.0 if usual is None else usual

    def residual(x: Floats) -> Floats:
        return model.residual(x) - expected

    most = longest_lag(record) if number in (LAG, DRAG) and record.time_s is not None else math.inf
    low, high = [-math.inf, -1.0], [math.inf, 1.0]  # of the zero and the first h
    starts: Sequence[Sequence[float]] = [[0.0, 0.0]]
    if number is not ZERO:
        low.insert(1, max(number.low, -most))
        high.insert(1, min(number.high, most))
        firsts = _PLAYS if number is PLAY else (0.3 * most,) if number is DRAG else (number.unchanged,)
        starts = [[0.0, first, 0.0] for first in firsts]
    tries = [
        least_squares(residual, start, bounds=(low, high), x_scale=model.scales(), diff_step=_STEP) for start in starts
    ]
    return np.asarray(min(tries, key=lambda one: float(one.cost)).fun)
