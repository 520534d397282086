"""Covariance of the parameters of a fit, from its derivatives."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from hysteresis.arrays import Floats
from validation.tracing.fitting.fitted import Fitted


class Covariance(NamedTuple):
    """Covariance of the coordinates, shape (p, p), and the degrees of freedom that it is known with."""

    matrix: Floats
    freedom: float


def covariance(fitted: Fitted) -> Covariance:
    """Covariance of a least-squares fit, s^2 (J^T J)^-1, with the number of independent samples in place of all.

    Directions without slope get the covariance of a slope of 1e-9 of the steepest one.
    """
    rows = fitted.rows
    J, error = rows.jacobian[rows.train], rows.errors[rows.train]
    train = error.size
    count = max(2.0, fitted.samples * train / rows.errors.size)
    variance = float(error @ error) / max(1, train - J.shape[1]) * train / count
    scale = np.maximum(np.linalg.norm(J, axis=0), 1e-12)
    _, singular, basis = np.linalg.svd(J / scale, full_matrices=False)
    root = (basis.T / np.maximum(singular, 1e-9 * singular[0])) / scale[:, None]
    return Covariance(variance * root @ root.T, max(1.0, count - J.shape[1]))
