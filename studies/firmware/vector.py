"""The test vector of a compensator: references, and the drives that :mod:`hysteresis.laws.inverse` finds for them."""

from __future__ import annotations

import numpy as np

from hysteresis.arrays import Floats
from hysteresis.laws.inverse import UnreachableError, compensating_drive, inverse_curve
from studies.commands.compensation import Layer

SAMPLES = 1000
_PART = 0.95  # of the drives that the first try spans
_TRIES = 60


def random_path(count: int, ends: tuple[float, float], start: float, seed: int) -> Floats:
    """Walk between random turning points in steps of random sizes, shape (count,).

    Parameters
    ----------
    count
        Number of places, the start not among them.
    ends
        The turning points lie between them.
    start
        Where the walk starts.
    """
    random, at, path = np.random.default_rng(seed), start, np.empty(count)
    goal, step = start, 0.0
    for k in range(count):
        if at == goal:
            goal = random.uniform(*ends)
            step = (ends[1] - ends[0]) * 10.0 ** random.uniform(-3.5, -0.5)
        at = goal if abs(goal - at) <= step else at + np.copysign(step, goal - at)
        path[k] = at
    return path


def predicted(layer: Layer, drive: Floats) -> Floats:
    """Predict the angle along drives that follow the first one of the record, shape (m,) -> (m,), deg."""
    f = layer.f(np.append(layer.first_drive, drive))
    return (f + sum(element.along(f) for element in layer.elements))[1:]


def required_drive(layer: Layer, reference_deg: Floats) -> Floats:
    """Find the drives as ``notchbend compensate`` does, shape (m,) -> (m,); also for a fit without hysteresis."""
    if not any(element.saturation_deg for element in layer.elements):
        return inverse_curve(layer.f, reference_deg, layer.drive_range)
    return compensating_drive(layer, reference_deg, layer.first_drive)


def made_vector(layer: Layer, *, count: int = SAMPLES, seed: int = 0) -> tuple[Floats, Floats]:
    """Make references that a layer reaches, and the drives for them.

    Returns
    -------
    reference_deg, drive
        Shapes (count,).

    Raises
    ------
    UnreachableError
        No random reference stays within the drives.
    """
    low, high = layer.drive_range
    middle, half, part = 0.5 * (low + high), 0.5 * (high - low), _PART
    for trial in range(_TRIES):
        ends = middle - part * half, middle + part * half
        reference = predicted(layer, random_path(count, ends, layer.first_drive, seed))
        try:
            return reference, required_drive(layer, reference)
        except UnreachableError:  # a lagging law with a steep start may need a drive beyond the one of the prediction
            if trial == _TRIES - 1:
                raise
            part *= 0.9
    raise AssertionError("unreachable")
