"""Covariance of the parameters of a fit, from its derivatives."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from scipy.optimize import lsq_linear

from hysteresis.arrays import Floats
from validation.tracing.fitting.fitted import Fitted


class Covariance(NamedTuple):
    """Covariance of the coordinates, shape (p, p), the degrees of freedom that it is known with, and s^2, deg^2."""

    matrix: Floats
    freedom: float
    variance: float


def covariance(fitted: Fitted) -> Covariance:
    """Covariance of a least-squares fit, s^2 (J^T J)^-1, with the number of independent samples in place of all.

    Channels that are quieter than the others count for fewer
    (:attr:`validation.tracing.fitting.fitted.Fitted.variance_samples`).

    Directions without slope get the covariance of a slope of 1e-9 of the steepest one.
    """
    rows = fitted.rows
    J, error = rows.jacobian[rows.train], rows.errors[rows.train]
    train = error.size
    count = max(2.0, fitted.variance_samples * train / rows.errors.size)
    variance = float(error @ error) / max(1, train - J.shape[1]) * train / count
    scale = np.maximum(np.linalg.norm(J, axis=0), 1e-12)
    _, singular, basis = np.linalg.svd(J / scale, full_matrices=False)
    root = (basis.T / np.maximum(singular, 1e-9 * singular[0])) / scale[:, None]
    return Covariance(variance * root @ root.T, max(1.0, count - J.shape[1]), variance)


def rise_without(fitted: Fitted, amounts: list[int], shape: list[int]) -> float:
    """By how much the sum of squares rises where amounts are taken to 0, deg^2, by the derivatives of the fit.

    The other parameters follow within their bounds, those of the ``shape`` of the amounts stay. Without bounds that is
    Wald's test; but friction at the base follows a play as far as it may, and no further.
    """
    rows = fitted.rows
    J, error = rows.jacobian[rows.train], rows.errors[rows.train]
    scale = np.maximum(np.linalg.norm(J, axis=0), 1e-12)
    low, high = ((bound - fitted.x) * scale for bound in fitted.model.bounds())
    there = error - J[:, amounts] @ fitted.x[amounts]
    free = [k for k in range(J.shape[1]) if k not in {*amounts, *shape}]
    if not free:
        return max(0.0, float(there @ there - error @ error))
    bounds = np.minimum(low[free], -1e-9), np.maximum(high[free], 1e-9)
    left = 2 * float(lsq_linear(J[:, free] / scale[free], -there, bounds=bounds, method="bvls").cost)
    return max(0.0, left - float(error @ error))
