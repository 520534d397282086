"""A leap between cycles that repeat: from one instant on, the angle or the drive is off by a constant."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from hysteresis.arrays import Floats

LEAVES = 0.15
"""Largest share of the squared difference between cycles that may remain with a jump: of the whole, and of what remains
with a steady drift. With a wandering sensor more than a third remains with the best jump."""
INSTANTS = 200
"""Phases of a cycle at which a leap is tried, at most about."""


@dataclass(frozen=True, eq=False)
class Leap:
    """A leap before a phase of a cycle, its mean size, and the deviations without it, shape (K, phases).

    ``of_angle`` tells a leap of the angle from one of the drive.
    """

    cycle: int
    phase: int
    size_deg: float
    left: Floats
    of_angle: bool


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
        None where the residual squares exceed :data:`LEAVES` of all squares, or of those of the residual of a drift.
    """
    count, phases = deviation.shape
    whole = float(np.sum(deviation**2))
    if whole == 0.0:
        return None
    tried = np.arange(0, phases, max(1, phases // INSTANTS))
    best: tuple[float, Leap] | None = None
    for of_angle, values in ((True, np.ones(phases)), (False, slope)):
        gains = leap_gains(deviation, values)[:, tried]
        k, i = (int(index) for index in np.unravel_index(int(np.argmax(gains)), gains.shape))
        left = whole - float(gains[k, i])
        if best is None or left < best[0]:
            column = _column(values, count, k, int(tried[i]))
            size = float(np.sum(column * deviation)) / max(float(np.sum(column**2)), 1e-300)
            best = left, Leap(k, int(tried[i]), size * float(values.mean()), deviation - size * column, of_angle)
    assert best is not None
    drift = np.repeat(np.arange(count)[:, None] - (count - 1) / 2, phases, axis=1)
    left, found = best
    return found if left < LEAVES * (whole - _gain(deviation, drift)) else None


def leap_gains(deviation: Floats, values: Floats) -> Floats:
    """By how much each leap lowers the sum of squares, by cumulative sums, shape (K, phases).

    A leap before phase p of cycle k acts in the cycles after k, and in cycle k from p on: at each phase in n of the K
    cycles, so that its column of values v has the square v^2 n (1 - n/K), and its product with deviations d is v times
    the sum of d over those n cycles less n/K of the sum over all.
    """
    count = len(deviation)
    whole = deviation.sum(axis=0)
    after = whole - np.cumsum(deviation, axis=0)  # of the cycles after k
    acting = (count - 1.0 - np.arange(count))[:, None]

    def summed(early: Floats, late: Floats) -> Floats:
        """Sum over phases: ``early`` before p, ``late`` from p on."""
        before = np.cumsum(early, axis=1) - early
        return before + np.cumsum(late[:, ::-1], axis=1)[:, ::-1]

    product = summed(
        values * (after - acting / count * whole), values * (after + deviation - (acting + 1) / count * whole)
    )
    early, late = (n * (1.0 - n / count) for n in (acting, acting + 1.0))
    square = summed(values**2 * early, values**2 * late)
    return np.divide(product**2, square, out=np.zeros_like(product), where=square > 1e-12 * square.max())


def _column(values: Floats, count: int, cycle: int, phase: int) -> Floats:
    """Deviations that a leap of one makes, shape (K, phases)."""
    k, p = np.arange(count)[:, None], np.arange(values.size)
    column = np.where((k > cycle) | ((k == cycle) & (p >= phase)), values, 0.0)
    return np.asarray(column - column.mean(axis=0))


def _gain(deviation: Floats, column: Floats) -> float:
    """By how much a column lowers the sum of squares."""
    square = float(np.sum(column**2))
    return float(np.sum(column * deviation)) ** 2 / square if square > 0.0 else 0.0
