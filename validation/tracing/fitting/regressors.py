"""Quantities that a residual may depend on, and smooth functions of them."""

from __future__ import annotations

import numpy as np
from scipy.interpolate import BSpline

from hysteresis.arrays import Floats
from hysteresis.records.path import branches
from validation.tracing.effect import SampleInputs


def spline(x: Floats, low: float, high: float, count: int) -> Floats:
    """Cubic B-splines on even knots, shape (m, count); of lower degree where there are few."""
    degree = min(3, count - 1)
    inner = np.linspace(low, high, count - degree + 1)
    knots = np.concatenate([[low] * degree, inner, [high] * degree])
    return np.asarray(BSpline.design_matrix(np.clip(x, low, high), knots, degree).toarray())


def odd(x: Floats) -> Floats:
    """Odd polynomials, shape (m, 3)."""
    return np.column_stack([x, x**3, x**5])


def even(x: Floats) -> Floats:
    """Even polynomials, shape (m, 2)."""
    return np.column_stack([x**2, x**4])


def rate(inputs: SampleInputs) -> Floats:
    """Rate of the drive, its unit per second."""
    return np.gradient(inputs.drive, inputs.time_s)


def direction(drive: Floats) -> Floats:
    """Give +1 on rising branches, -1 on falling ones."""
    out = np.empty(drive.size)
    for branch in branches(drive):
        start = branch.start + 1 if branch.start else 0
        out[start : branch.stop] = np.sign(drive[branch.stop - 1] - drive[branch.start])
    return out


def distance_since_reversal(drive: Floats) -> Floats:
    """Distance of the drive from the last turning point, not negative."""
    out = np.empty(drive.size)
    for branch in branches(drive):
        part = slice(branch.start + 1 if branch.start else 0, branch.stop)
        out[part] = np.abs(drive[part] - drive[branch.start])
    return out
