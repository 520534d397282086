"""The inverse of an identified layer: the drive that makes the angle f + h follow a reference.

h is a function of the path of f (paper, eq. 7), so the path is found sample by sample: on the way to the next angle f
goes one way, h along it is the exact flow of :mod:`hysteresis.flow`, and f + h = angle is solved in a bracket. Then the
drive is that at which f stands there.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Protocol

import numpy as np
from numpy.typing import ArrayLike
from scipy.optimize import brentq
from scipy.optimize.elementwise import find_root

from hysteresis.arrays import Floats
from hysteresis.bouc_wen import BoucWen, hysteresis_batch

_PRECISION = 1e-12  # of a root, over the range in which it is looked for
_PLACES = 2001  # at which f is asked whether it is monotone
_ROUNDING = 1e-9  # of a range: a reference so little beyond it ends where it ends


class Layer(Protocol):
    """What an inverse needs of an identified layer, be it a :class:`hysteresis.fit.Fit` or read from a file."""

    @property
    def models(self) -> Sequence[BoucWen]:
        """Elements of h, in the state in which the record began."""

    @property
    def drive_range(self) -> tuple[float, float]:
        """Ends of the drives of the records."""

    @property
    def delay_s(self) -> float:
        """Delay of the angle behind the drive."""

    def f(self, drive: Floats, /) -> Floats:
        """Single-valued part of the angle, shape (m,) -> (m,), deg."""

    def plain(self, drive: Floats, /) -> Floats:
        """Angle of the best curve without hysteresis, shape (m,) -> (m,), deg."""


class UnreachableError(ValueError):
    """An angle that a curve does not reach; ``sample`` is its place in the row."""

    def __init__(self, sample: int, message: str) -> None:
        super().__init__(f"sample {sample}: {message}")
        self.sample = sample


def inverse_hysteresis(angle_deg: ArrayLike, models: Sequence[BoucWen], f_start_deg: float) -> Floats:
    """Find the path of f along which f + h is a given angle.

    A lagging model with |A| > 1 has an angle that first goes back after a reversal of f; f then goes on to where the
    angle is met.

    Parameters
    ----------
    angle_deg
        Shape (m,), deg, in order.
    models
        Elements whose h add up; ``h0_deg`` of each is its state at the start.
    f_start_deg
        f at the start; the way from there to the first angle is part of the path.

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
    rows = np.array([model.row() for model in models]).reshape(-1, 5)
    hysteresis_batch([f_start_deg], rows)  # refuses what is not admissible
    reach = 2.0 * (1.0 + _ROUNDING) * sum(model.saturation_deg for model in models)
    at, path = float(f_start_deg), np.empty(angles.size)
    for k, target in enumerate(angles.tolist()):
        at, rows = _step(at, rows, target, reach)
        path[k] = at
    return path


def _step(at: float, rows: Floats, target: float, reach: float) -> tuple[float, Floats]:
    """Go from f = ``at`` one way until f + h = ``target``: the new f and the rows with the new states."""
    missing = target - at - float(rows[:, 4].sum())
    if missing == 0.0:
        return at, rows

    def state(f: float) -> Floats:
        return hysteresis_batch([at, f], rows)[:, 1]

    # |h| is within saturation at both ends, so the angle is met within this way
    end = at + missing + float(np.copysign(reach, missing))
    span = abs(end - at)
    f = float(brentq(lambda f: f + state(f).sum() - target, at, end, xtol=_PRECISION * span, rtol=1e-15))
    return f, np.column_stack([rows[:, :4], state(f)])


def inverse_curve(f: Callable[[Floats], Floats], angle_deg: ArrayLike, drive_range: tuple[float, float]) -> Floats:
    """Find the drives at which a monotone curve has given angles.

    Parameters
    ----------
    f
        Drive -> deg, shape (m,) -> (m,).
    angle_deg
        Shape (m,).
    drive_range
        Ends of the drives that may be asked for.

    Returns
    -------
    NDArray
        Shape (m,), in the drive's unit.

    Raises
    ------
    UnreachableError
        An angle that the curve does not reach there.
    ValueError
        A curve that is flat or turns within the range.
    """
    angles = np.asarray(angle_deg, dtype=float)
    places = np.linspace(*drive_range, _PLACES)
    table = f(places)
    steps = np.diff(table)
    rising = bool(table[-1] > table[0])
    if not ((steps > 0) if rising else (steps < 0)).all():
        at = places[int(np.argmax(steps <= 0 if rising else steps >= 0))]
        raise ValueError(f"f is flat or turns at a drive of {at:g}: expected a curve that rises or falls throughout")
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
        An identified layer without delay.
    reference_deg
        Shape (m,), the angle wanted, in order.
    start_drive
        Where the drive stands at the start, in the state in which the record began (from rest, where it began so).

    Returns
    -------
    NDArray
        Shape (m,), in the drive's unit.

    Raises
    ------
    ValueError
        A delay, an f that has no inverse, or a reference beyond the drives of the records.
    """
    if fit.delay_s > 0:
        raise ValueError("the fit has a delay: expected one without, a drive cannot act before its time")
    start = float(fit.f(np.array([start_drive]))[0])
    path = inverse_hysteresis(reference_deg, fit.models, start)
    return inverse_curve(fit.f, path, fit.drive_range)


def uncompensated_drive(fit: Layer, reference_deg: ArrayLike) -> Floats:
    """Invert the best curve without hysteresis: what a drive without compensation would do; as above."""
    return inverse_curve(fit.plain, reference_deg, fit.drive_range)
