"""The single-valued part f(x) of a hysteretic curve, as a family of curves with a few coefficients.

If the geometry is known, f is the caller's kinematics and only its zero (and, for a drive that is not in mm, its gain)
is fitted. Otherwise f is a monotone curve whose slope is given at a few knots and linear between them.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike
from scipy.interpolate import PchipInterpolator
from scipy.optimize import least_squares, lsq_linear

from hysteresis.arrays import Floats

Kinematics = Callable[[Floats], ArrayLike]

_MOST_TRAVEL_MM, _LEAST_TRAVEL_MM = 100.0, 0.1
_TABLE = 2001


@dataclass(frozen=True)
class Backbone:
    """Family of single-valued angles f(x; c) with p coefficients c.

    Parameters
    ----------
    names, units
        Of the coefficients, p each.
    start, low, high
        Shape (p,): initial values of a fit, and the bounds.
    at
        Maps drives of shape (m,) to the function c -> f in deg, shape (m,). Everything that does not depend on c is
        computed once.
    linear
        Whether f is linear in c.
    """

    names: tuple[str, ...]
    units: tuple[str, ...]
    start: Floats
    low: Floats
    high: Floats
    at: Callable[[Floats], Callable[[Floats], Floats]]
    linear: bool

    def jacobian(self, drive: Floats, c: Floats) -> Floats:
        """Differentiate f with respect to the coefficients, shape (m, p)."""
        f = self.at(drive)
        steps = np.eye(len(c)) * (1.0 if self.linear else 1e-6 * np.maximum(np.abs(c), 1e-3))
        return np.column_stack([(f(c + e) - f(c)) / e.sum() for e in steps])


def fit_curves(
    backbones: Sequence[Backbone], drives: Sequence[Floats], angles_deg: Sequence[Floats]
) -> tuple[Floats, Floats]:
    """Fit curves to data by least squares, within the bounds.

    Parameters
    ----------
    backbones
        One for each record, with the same coefficients c, shape (p,).
    drives, angles_deg
        Of each record, shapes (m_i,).

    Returns
    -------
    coefficients
        Shape (p,), shared by the records.
    zeros_deg
        Shape (records - 1,): offset of the angle of each record after the first.
    """
    first, target, p = backbones[0], np.concatenate(angles_deg), len(backbones[0].start)
    fs = [backbone.at(drive) for backbone, drive in zip(backbones, drives, strict=True)]
    record = np.repeat(np.arange(len(drives)), [len(drive) for drive in drives])
    zeros = (record[:, np.newaxis] == np.arange(1, len(drives))).astype(float)
    unbounded = np.full(len(drives) - 1, np.inf)
    bounds = np.concatenate([first.low, -unbounded]), np.concatenate([first.high, unbounded])

    def residual(x: Floats) -> Floats:
        return np.concatenate([f(x[:p]) for f in fs]) + zeros @ x[p:] - target

    start = np.concatenate([first.start, np.zeros(len(drives) - 1)])
    if first.linear:
        of_c = [b.jacobian(drive, 0 * first.start) for b, drive in zip(backbones, drives, strict=True)]
        found = lsq_linear(np.column_stack([np.concatenate(of_c), zeros]), -residual(0 * start), bounds, "bvls").x
    else:
        found = least_squares(residual, start, bounds=bounds, x_scale="jac").x
    found = np.clip(found, *bounds)
    return found[:p], found[p:]


def fitted_backbone(drive: Floats, angle_deg: Floats, knots: int) -> Backbone:
    """Return a monotone curve whose slope is given at equally spaced knots and linear between them.

    Parameters
    ----------
    drive, angle_deg
        Shape (m,): the data, which set the range of the knots and the sign of the slope. The curve is straight beyond
        that range.
    knots
        Number of slopes; 1 gives a straight line.
    """
    first, last = float(np.min(drive)), float(np.max(drive))
    at_knots = np.linspace(first, last, knots)
    direction = 1.0 if np.polyfit(drive, angle_deg, 1)[0] >= 0 else -1.0
    span = max(float(np.ptp(angle_deg)), 1e-12)

    def at(drive: Floats) -> Callable[[Floats], Floats]:
        matrix = np.column_stack([np.ones(len(drive)), direction * _integrated_hats(drive, at_knots, last - first)])
        return lambda c: matrix @ c

    free = np.full(knots, np.inf)
    return Backbone(
        names=("f_middle_deg", *(f"f_slope_{i}" for i in range(knots))),
        units=("deg", *["deg per range"] * knots),
        start=np.array([float(np.mean(angle_deg)), *[span] * knots]),
        low=np.array([-np.inf, *np.zeros(knots)]),
        high=np.array([np.inf, *free]),
        at=at,
        linear=True,
    )


def _integrated_hats(drive: Floats, knots: Floats, span: float) -> Floats:
    """Integrate the hat function of each knot from the middle of the range, shape (m, knots)."""
    t = (drive - knots[0]) / span
    if len(knots) == 1:
        return (t - 0.5)[:, None]
    width = 1.0 / (len(knots) - 1)

    def integrals(t: Floats) -> Floats:
        u = t[:, None] / width - np.arange(len(knots))  # distance from the knot, in knot spacings
        inside = np.clip(u, -1.0, 1.0)
        rising = 0.5 * (np.minimum(inside, 0.0) + 1.0) ** 2
        falling = np.maximum(inside, 0.0) - 0.5 * np.maximum(inside, 0.0) ** 2
        whole = width * (rising + falling)
        # The outermost hats are half hats that stay constant beyond the range: the curve is straight there.
        whole[:, 0] = width * (falling[:, 0] + np.minimum(u[:, 0], 0.0))
        whole[:, -1] = width * (rising[:, -1] + np.maximum(u[:, -1], 0.0))
        return whole

    return integrals(t) - integrals(np.array([0.5]))


def given_backbone(base: Kinematics, drive: Floats, angle_deg: Floats, unit: str) -> Backbone:
    """Return the caller's kinematics, angle_deg = base(drive_mm), with their unknown zero and gain as coefficients.

    For a drive in mm, only the zero of the angle is unknown (camera, wheel). A drive in another unit has an unknown
    gain and an unknown zero of the drive; their fit starts from the gain, of either sign, that fits the data best. Such
    kinematics may have a limited range, beyond which they raise an error or return NaN; the last angle is used there.

    Parameters
    ----------
    base
        Drive in mm (tendon force in N for load-controlled data) -> angle in deg, shape (m,) -> (m,).
    drive, angle_deg
        Shape (m,): the data.
    unit
        Of the drive: mm, deg, step or N.
    """
    if unit in ("mm", "N"):

        def at(drive: Floats) -> Callable[[Floats], Floats]:
            values = np.asarray(base(drive), dtype=float)
            return lambda c: values + c[0]

        unbounded = np.array([np.inf])
        return Backbone(("offset_deg",), ("deg",), np.zeros(1), -unbounded, unbounded, at, linear=True)

    return _scaled_backbone(base, drive, angle_deg, unit)


def _scaled_backbone(base: Kinematics, drive: Floats, angle_deg: Floats, unit: str) -> Backbone:
    table, low, high = _tabulated(base)

    def scaled(drive: Floats) -> Callable[[Floats], Floats]:
        return lambda c: table(np.clip(c[0] * (drive - c[1]), low, high))

    first, last = float(np.min(drive)), float(np.max(drive))
    middle, span = 0.5 * (first + last), last - first
    f = scaled(drive)
    sizes = np.geomspace(2e-3, 2.0, 61) * max(-low, high) / span
    starts = [np.array([gain, zero]) for gain in (*sizes, *-sizes) for zero in (middle, first, last)]
    start = min(starts, key=lambda c: float(np.sum((f(c) - angle_deg) ** 2)))
    ends = sorted((0.2 * start[0], 5.0 * start[0]))
    return Backbone(
        names=(f"gain_mm_per_{unit}", f"zero_{unit}"),
        units=(f"mm/{unit}", unit),
        start=start,
        low=np.array([ends[0], first - span]),
        high=np.array([ends[1], last + span]),
        at=scaled,
        linear=False,
    )


def _tabulated(base: Kinematics) -> tuple[PchipInterpolator, float, float]:
    """Tabulate kinematics over the travel for which they are defined, up to +-100 mm; also return its ends.

    A fit of the gain evaluates thousands of curves, and the curve of a chain of joints is expensive. The table is dense
    near zero, where most rigs operate: samples are 0.005 mm apart, and 0.5 mm at 100 mm.
    """
    low, high = _defined_to(base, -1.0), _defined_to(base, 1.0)
    drive = np.sinh(np.linspace(np.arcsinh(low), np.arcsinh(high), _TABLE))
    drive[[0, -1]] = low, high
    angle = _angle(base, drive) if low < high else None
    if angle is None:
        raise ValueError(
            f"base: no finite angles within {_LEAST_TRAVEL_MM:g} mm of zero: expected kinematics, mm -> deg"
        )
    return PchipInterpolator(drive, angle), low, high


def _defined_to(base: Kinematics, side: float) -> float:
    """Find up to which drive kinematics are defined on one side of zero (+1 or -1), mm with that sign; 0 for none."""
    inside, outside = 0.0, None
    for travel in np.geomspace(_LEAST_TRAVEL_MM, _MOST_TRAVEL_MM, 31):
        if _angle(base, np.array([0.0, side * travel])) is None:
            outside = float(travel)
            break
        inside = float(travel)
    if outside is None or inside == 0.0:
        return side * inside
    for _ in range(30):
        middle = 0.5 * (inside + outside)
        if _angle(base, np.array([0.0, side * middle])) is None:
            outside = middle
        else:
            inside = middle
    return side * inside


def _angle(base: Kinematics, drive: Floats) -> Floats | None:
    """Evaluate kinematics; None if they are undefined at one of the drives."""
    try:
        angle = np.asarray(base(drive), dtype=float)
    except (ValueError, ArithmeticError, RuntimeError):  # undefined that far out
        return None
    return angle if angle.shape == drive.shape and np.isfinite(angle).all() else None
