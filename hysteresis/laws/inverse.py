"""The inverse of an identified model: the drive that makes the angle f + h follow a reference.

h depends on the path of f (paper, eq. 7), so the path is found sample by sample. f is monotonic between two angles, h
along it is that of the law (any of :mod:`hysteresis.laws.elements`), and f + h = angle is solved in a bracket. The
inverse of f then gives the drive.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Protocol

import numpy as np
from numpy.typing import ArrayLike
from scipy.optimize import brentq
from scipy.optimize.elementwise import find_root

from hysteresis.arrays import Floats
from hysteresis.laws.elements import Element

_PRECISION = 1e-12  # of a root, relative to its bracket
_PLACES = 2001  # drives at which f is checked to be monotone
_ROUNDING = 1e-9  # of a range: a reference beyond it by less is moved to its end


class Layer(Protocol):
    """Identified model as the inverse uses it: a :class:`hysteresis.fitting.fit.Fit`, or one read from a file."""

    @property
    def elements(self) -> Sequence[Element]:
        """Elements of h, with their initial state in the record."""

    @property
    def drive_range(self) -> tuple[float, float]:
        """Ends of the drives of the records."""

    def f(self, drive: Floats, /) -> Floats:
        """Single-valued part of the angle, shape (m,) -> (m,), deg."""

    def plain(self, drive: Floats, /) -> Floats:
        """Angle of the best curve without hysteresis, shape (m,) -> (m,), deg."""


class UnreachableError(ValueError):
    """An angle beyond the range of a curve; ``sample`` is its index."""

    def __init__(self, sample: int, message: str) -> None:
        super().__init__(f"sample {sample}: {message}")
        self.sample = sample


def inverse_hysteresis(
    angle_deg: ArrayLike, elements: Sequence[Element], f_start_deg: float, gain: float = 1.0
) -> Floats:
    """Find the path of f along which gain f + h is a given angle.

    For a lagging model with |A| > 1, the angle first moves against f after a reversal; f then continues until the
    angle is reached.

    Parameters
    ----------
    angle_deg
        Shape (m,), deg, in order.
    elements
        Their h are added; each is in its initial state.
    f_start_deg
        Initial f; the path starts there and leads to the first angle.
    gain
        Above 0; other than 1 for a device that has drifted (:mod:`hysteresis.fitting.recursive`).

    Returns
    -------
    NDArray
        Shape (m,), f in deg.

    Raises
    ------
    ValueError
        Angles that are not a row of finite numbers, or a model that is not admissible.
    """
    angles = np.asarray(angle_deg, dtype=float)
    if angles.ndim != 1 or not np.isfinite(angles).all():
        raise ValueError(f"angle_deg of shape {angles.shape}: expected a row of finite numbers")
    reach = 2.0 * (1.0 + _ROUNDING) * sum(element.saturation_deg for element in elements)
    at, path, now = float(f_start_deg), np.empty(angles.size), list(elements)
    _sum_along(now, np.array([at]))  # raises if one is not admissible
    for k, target in enumerate(angles.tolist()):
        at, now = _step(at, now, target, reach, gain)
        path[k] = at
    return path


def _sum_along(elements: Sequence[Element], path: Floats) -> float:
    return sum(float(element.along(path)[-1]) for element in elements)


def _step(at: float, elements: list[Element], target: float, reach: float, gain: float) -> tuple[float, list[Element]]:
    """Move f from ``at`` until gain f + h = ``target``; return the new f and the elements in their new states."""
    missing = target - gain * at - _sum_along(elements, np.array([at]))
    if missing == 0.0:
        return at, elements
    # |h| is within saturation at both ends, so this bracket contains the angle
    end = at + (missing + float(np.copysign(reach, missing))) / gain
    span = abs(end - at)

    def excess(f: float) -> float:
        return gain * f + _sum_along(elements, np.array([at, f])) - target

    start = at
    corners = {one.corner_deg for one in elements if one.corner_deg is not None}
    for corner in sorted(corners, key=lambda place: abs(place - at)):
        # h may drop there, and the angle be reached twice: the first time counts
        if min(start, end) < corner < max(start, end):
            start, end = (corner, end) if excess(corner) * missing < 0.0 else (start, corner)
    f = float(brentq(excess, start, end, xtol=_PRECISION * span, rtol=1e-15))
    return f, [element.after(np.array([at, f])) for element in elements]


def inverse_curve(f: Callable[[Floats], Floats], angle_deg: ArrayLike, drive_range: tuple[float, float]) -> Floats:
    """Find the drives at which a monotone curve has given angles.

    Parameters
    ----------
    f
        Drive -> deg, shape (m,) -> (m,).
    angle_deg
        Shape (m,).
    drive_range
        Smallest and largest admissible drive.

    Returns
    -------
    NDArray
        Shape (m,), in the drive's unit.

    Raises
    ------
    UnreachableError
        An angle that the curve does not reach within the range.
    ValueError
        A curve that is not strictly monotone within the range.
    """
    angles = np.asarray(angle_deg, dtype=float)
    places = np.linspace(*drive_range, _PLACES)
    table = f(places)
    steps = np.diff(table)
    rising = bool(table[-1] > table[0])
    if not ((steps > 0) if rising else (steps < 0)).all():
        at = places[int(np.argmax(steps <= 0 if rising else steps >= 0))]
        raise ValueError(f"f is flat or reverses at a drive of {at:g}: expected a curve that rises or falls throughout")
    low, high = sorted((float(table[0]), float(table[-1])))
    slack = _ROUNDING * (high - low)
    beyond = (angles < low - slack) | (angles > high + slack)
    if beyond.any():
        k = int(np.argmax(beyond))
        raise UnreachableError(k, f"f = {angles[k]:g} deg: expected within {low:.4g} to {high:.4g}, the range of f")
    angles = np.clip(angles, low, high)
    sign = 1.0 if rising else -1.0
    i = np.clip(np.searchsorted(sign * table, sign * angles), 1, _PLACES - 1)
    found = find_root(lambda x, angle: f(x) - angle, (places[i - 1], places[i]), args=(angles,))
    return np.asarray(found.x)


def compensating_drive(fit: Layer, reference_deg: ArrayLike, start_drive: float) -> Floats:
    """Find the drive that makes the angle follow a reference, by the first record of a fit.

    Parameters
    ----------
    fit
        An identified model. Its delay does not matter here: the drives are due that much before the angles.
    reference_deg
        Shape (m,), the desired angle, in chronological order.
    start_drive
        Initial drive; the initial state is that of the record (rest, if the record started from rest).

    Returns
    -------
    NDArray
        Shape (m,), in the drive's unit.

    Raises
    ------
    ValueError
        An f without inverse, or a reference that needs a drive beyond those of the records.
    """
    start = float(fit.f(np.array([start_drive]))[0])
    path = inverse_hysteresis(reference_deg, fit.elements, start)
    return inverse_curve(fit.f, path, fit.drive_range)


def uncompensated_drive(fit: Layer, reference_deg: ArrayLike) -> Floats:
    """Invert the baseline, the best curve without hysteresis: the drive without compensation; as above."""
    return inverse_curve(fit.plain, reference_deg, fit.drive_range)
