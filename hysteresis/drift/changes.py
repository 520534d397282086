"""When a device began to change: likelihood-ratio test of a step or a ramp in all followed numbers together.

The numbers of n records are rows of a normal vector with an unknown covariance. For a column c (a step, or a ramp from
a record on) the likelihood ratio against a constant mean is n log(|S0| / |S1|), S being the scatter of the residuals
(Wilks 1932, doi 10.2307/2331979; for a change of the mean, Srivastava and Worsley 1986, doi
10.1080/01621459.1986.10478260). The largest over all records and both shapes decides. Its distribution under no change
depends on n and the number of rows alone, not on the covariance, so the critical value is simulated.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import lru_cache
from typing import Literal

import numpy as np

from hysteresis.arrays import Floats

Shape = Literal["step", "ramp"]
SHAPES: tuple[Shape, ...] = ("step", "ramp")
LEAST_RECORDS = 6
MOST_CHANGES = 3
_EDGE = 2  # records on either side of a change, at least
_DRAWS = 4_000
_BEYOND = 4  # draws beyond a critical value, at least
_CONFIDENCE = 0.95


@dataclass(frozen=True)
class ChangePoint:
    """A change: ``first`` is the first record that differs, from 0, ``low`` and ``high`` the ends of its 95 % set.

    ``p`` is the probability that a steady device looks as much like a change.
    """

    first: int
    low: int
    high: int
    shape: Shape
    p: float


def usable_count(records: int) -> int:
    """How many numbers can be tested together: at most half of the records less four."""
    return max(0, (records - 4) // 2)


def change_points(values: Floats, false_alarm: float, *, most: int = MOST_CHANGES) -> list[ChangePoint]:
    """Find changes, the clearest first; the next one is tested beside those found.

    Parameters
    ----------
    values
        Shape (n, p), n at least :data:`LEAST_RECORDS`, p at most :func:`usable_count`; no column constant.
    false_alarm
        Probability that a change of a steady device is claimed.

    Raises
    ------
    ValueError
        Too few records for so many numbers.
    """
    n, p = values.shape
    if n < LEAST_RECORDS or p > usable_count(n):
        raise ValueError(f"values: {n} records of {p} numbers: expected at most {usable_count(n)} numbers")
    found, known = list[ChangePoint](), [np.ones(n)]
    while len(found) < most:
        by_column, columns = _ratios(values, known)
        best = int(np.argmax(by_column))
        draws = max(_DRAWS, math.ceil(_BEYOND / false_alarm))
        chance = _largest_by_chance(n, p, tuple((one.first, one.shape) for one in found), draws)
        probability = (1.0 + float((chance >= by_column[best]).sum())) / (1.0 + chance.size)
        if probability > false_alarm:
            break
        first, shape = columns[best]
        # 95 % set by the likelihood: the first records whose ratio is within that of one free number of the best
        near = [
            k for (k, s), ratio in zip(columns, by_column, strict=True) if s == shape and ratio > by_column[best] - 3.84
        ]
        found.append(ChangePoint(first, min(near), max(near), shape, probability))
        known.append(column(n, first, shape))
    return found


def column(n: int, first: int, shape: Shape) -> Floats:
    """Give a step from 0 to 1 at a record, or a ramp that rises by 1 a record from the one before, shape (n,)."""
    after = np.maximum(np.arange(n) - first + 1, 0).astype(float)
    return after if shape == "ramp" else np.minimum(after, 1.0)


def _ratios(values: Floats, known: list[Floats]) -> tuple[Floats, list[tuple[int, Shape]]]:
    """Likelihood ratios of all columns beside the known ones, and which they are.

    ``values`` of shape (..., n, p) give ratios of shape (..., k).
    """
    n = values.shape[-2]
    columns = [(k, shape) for shape in SHAPES for k in range(_EDGE, n - _EDGE + 1)]
    basis = np.linalg.qr(np.column_stack(known))[0]
    rows = np.array([column(n, k, shape) for k, shape in columns])
    rows = rows - (rows @ basis) @ basis.T
    size = np.linalg.norm(rows, axis=1)
    usable = size > 1e-6  # a column that is found already is left out
    rows, columns = (
        rows[usable] / size[usable, np.newaxis],
        [c for c, keep in zip(columns, usable, strict=True) if keep],
    )
    scaled = values / np.maximum(values.std(axis=-2, keepdims=True), 1e-300)
    rest = scaled - basis @ (basis.T @ scaled)
    scatter = np.swapaxes(rest, -1, -2) @ rest
    along = rows @ rest
    taken = ((along @ np.linalg.pinv(scatter, rcond=1e-12, hermitian=True)) * along).sum(axis=-1)
    return -n * np.log1p(-np.minimum(taken, 1.0 - 1e-15)), columns


@lru_cache(maxsize=64)
def _largest_by_chance(n: int, p: int, found: tuple[tuple[int, Shape], ...], draws: int) -> Floats:
    """Largest ratios of steady devices, shape (draws,), beside the changes that were found."""
    rng = np.random.default_rng(3)
    known = [np.ones(n), *(column(n, *one) for one in found)]
    sizes = [min(_DRAWS, draws - start) for start in range(0, draws, _DRAWS)]
    return np.concatenate([_ratios(rng.standard_normal((size, n, p)), known)[0].max(axis=1) for size in sizes])
