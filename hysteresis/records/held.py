"""Samples at which a sensor that is slower than its log has a new value."""

from __future__ import annotations

import numpy as np

from hysteresis.arrays import Floats, Mask

HELD_SHARE, HELD_STEP = 0.5, 3.0
"""Part of the values that are equal to the one before, and median change in steps of the sensor, from which a sensor
counts as slower than its log."""
LEAST_HELD, EVENLY_HELD = 2.0, 2.0
"""Least median number of samples between changes, and nine of ten of these numbers over the median, at most: a sensor
has a clock. A tube that stands still within a play then moves on sample by sample."""


def held_updates(drive: Floats, angle_deg: Floats) -> Mask | None:
    """Find the samples at which a held value changes, shape (m,); None where values are not held.

    Held are values most of which are equal to the one before while the drive moves, and which change by several of
    the sensor's steps at even intervals: a coarse sensor also repeats its values, but it then goes on by one step.
    """
    change = np.abs(np.diff(angle_deg))
    moves = np.diff(drive) != 0
    leaps = change[change > 0]
    if not moves.any() or leaps.size < 2 or float(np.mean(change[moves] == 0)) < HELD_SHARE:
        return None
    steps = np.diff(np.unique(np.round(angle_deg, 9)))
    if float(np.median(leaps)) < HELD_STEP * float(np.quantile(steps, 0.1)):
        return None
    between = np.diff(np.flatnonzero(change > 0))
    median, most = float(np.median(between)), float(np.quantile(between, 0.9))
    if median < LEAST_HELD or most > EVENLY_HELD * median:
        return None
    return np.concatenate([[False], change > 0])  # the first value may be older than the record
