"""Which samples of a record a baseline is fitted to, and the middle and mean slope of records."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from hysteresis.arrays import Floats, Ints
from hysteresis.records.path import branches


def kept_samples(drive: Floats, most: int, cycle: Ints | None = None) -> NDArray[np.intp]:
    """Choose about ``most`` samples evenly, with all turning points: the laws are rate independent between them.

    Parameters
    ----------
    drive
        Shape (m,).
    cycle
        Shape (m,); with it the first sample of every cycle is kept, too, where effects of the cycle change.
    """
    every = -(-len(drive) // most)
    kept = [np.arange(0, len(drive), every)]
    if every > 1:
        kept.append(np.array([branch.stop - 1 for branch in branches(drive)], dtype=np.intp))
        if cycle is not None:
            kept.append(np.flatnonzero(np.diff(cycle)) + 1)
    return np.unique(np.concatenate(kept))


def middle_of(drives: Sequence[Floats]) -> float:
    """Middle of the stroke of all records; zero where they go both ways about it."""
    low, high = min(float(d.min()) for d in drives), max(float(d.max()) for d in drives)
    middle = 0.5 * (low + high)
    return 0.0 if abs(middle) < 0.1 * (high - low) else middle


def mean_slope(drives: Sequence[Floats], angles: Sequence[Floats]) -> float:
    """Slope of the regression of angle on drive over all records, each with its own zero."""
    x = np.concatenate([drive - drive.mean() for drive in drives])
    y = np.concatenate([angle - angle.mean() for angle in angles])
    return float(x @ y / (x @ x))


def fastest(drive: Floats, time_s: Floats) -> float:
    """Largest rate of a drive; a few times that a logger wrote too close count as a quarter of the median step."""
    step = np.diff(time_s)
    return float(np.max(np.abs(np.diff(drive)) / np.maximum(step, 0.25 * np.median(step))))
