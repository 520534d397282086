"""Angles that are wrapped at a full turn: a sensor that counts from 0 to 360 deg, or from -180 to 180."""

from __future__ import annotations

import numpy as np

from hysteresis.arrays import Floats, Ints

_LEAST_JUMP_DEG = 270.0
"""A jump back over more of a turn than this is a wrap: the angle moved by less than a quarter of a turn."""
_MOST_DRIVE = 0.25
"""Part of the drive's range: beyond it the drive was reset, and the angle with it."""
_BEYOND_DEG, _LEAST_INSIDE = 2.0, 0.95


def wraps(drive: Floats, angle_deg: Floats) -> Ints:
    """Find the samples before which the angle jumps by a turn while the drive hardly moves, shapes (m,) -> (k,).

    None where the angles cover more than one turn; a few readings that are wrong may lie beyond it.
    """
    jumps = np.abs(np.diff(angle_deg)) > _LEAST_JUMP_DEG
    jumps &= np.abs(np.diff(drive)) <= _MOST_DRIVE * np.ptp(drive)
    for low in (0.0, -180.0):
        inside = (angle_deg >= low - _BEYOND_DEG) & (angle_deg <= low + 360.0 + _BEYOND_DEG)
        if inside.mean() >= _LEAST_INSIDE:
            return np.flatnonzero(jumps & inside[1:] & inside[:-1]).astype(np.int64) + 1
    return np.empty(0, dtype=np.int64)


def unwrapped(drive: Floats, angle_deg: Floats) -> Floats:
    """Put the turns back at the samples of :func:`wraps`; the median of the angles is within half a turn of zero."""
    at = wraps(drive, angle_deg)
    if at.size == 0:
        return angle_deg
    turns = np.zeros(angle_deg.size)
    turns[at] = -np.sign(angle_deg[at] - angle_deg[at - 1])
    whole = angle_deg + 360.0 * np.cumsum(turns)
    return np.asarray(whole - 360.0 * np.rint(np.median(whole) / 360.0))
