"""A leap between cycles that repeat: from one instant on, the angle or the drive is off by a constant."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from hysteresis.arrays import Floats

LEAVES = 0.15
"""Part of the squares of what cycles differ by that a leap leaves at most, of those that a steady drift leaves, too. A
wandering sensor leaves more than a third beside the best leap."""
INSTANTS = 200
"""Phases of a cycle at which a leap is tried, at most about."""


@dataclass(frozen=True, eq=False)
class Leap:
    """A leap before a phase of a cycle, its mean size, and the deviations without it, shape (K, phases)."""

    cycle: int
    phase: int
    size_deg: float
    left: Floats


def find_leap(deviation: Floats, slope: Floats) -> Leap | None:
    """Find a leap that explains nearly all of what cycles differ by.

    Parameters
    ----------
    deviation
        Angles of K cycles at the same drives and directions less their mean, in the order of time, shape (K, phases),
        deg.
    slope
        Slope of the angle there, by which a drive that is off changes it, shape (phases,).

    Returns
    -------
    Leap or None
        None where what is left is more than :data:`LEAVES` of the squares, or of what a steady drift leaves of them.
    """
    count, phases = deviation.shape
    whole = float(np.sum(deviation**2))
    if whole == 0.0:
        return None
    tried = np.arange(0, phases, max(1, phases // INSTANTS))
    best: tuple[float, Leap] | None = None
    for values in (np.ones(phases), slope):
        gains = np.array([[_gain(deviation, _column(values, count, k, p)) for p in tried] for k in range(count)])
        k, i = (int(index) for index in np.unravel_index(int(np.argmax(gains)), gains.shape))
        left = whole - float(gains[k, i])
        if best is None or left < best[0]:
            column = _column(values, count, k, int(tried[i]))
            size = float(np.sum(column * deviation)) / max(float(np.sum(column**2)), 1e-300)
            best = left, Leap(k, int(tried[i]), size * float(values.mean()), deviation - size * column)
    assert best is not None
    drift = np.repeat(np.arange(count)[:, None] - (count - 1) / 2, phases, axis=1)
    left, found = best
    return found if left < LEAVES * (whole - _gain(deviation, drift)) else None


def _column(values: Floats, count: int, cycle: int, phase: int) -> Floats:
    """Deviations that a leap of one makes, shape (K, phases)."""
    k, p = np.arange(count)[:, None], np.arange(values.size)
    column = np.where((k > cycle) | ((k == cycle) & (p >= phase)), values, 0.0)
    return np.asarray(column - column.mean(axis=0))


def _gain(deviation: Floats, column: Floats) -> float:
    """By how much a column lowers the sum of squares."""
    square = float(np.sum(column**2))
    return float(np.sum(column * deviation)) ** 2 / square if square > 0.0 else 0.0
