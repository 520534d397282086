"""What a fit leaves above the noise of the sensor: its discrepancy, and noise that the sensor does not have."""

from __future__ import annotations

import math

import numpy as np

from validation.tracing.inference.discrepancy import Linearised
from validation.tracing.inference.score import Covariance, reduced

SENSOR_MARGIN = 1.1
"""Noise over that of neighbouring samples that still counts as the sensor's: both are estimates."""


def leftover_deg(linear: Linearised, covariance: Covariance, noise_deg: float, sensor_deg: float | None) -> float:
    """Root mean square of what a fit leaves above the sensor's noise, deg.

    The discrepancy counts as it is most likely, K K'P y. Noise counts as far as it is above the sensor's, because a
    correlated noise can be a bending that the model lacks; all of it is the sensor's where that is not known. What one
    cycle differs from the next counts as the sensor's, since no model repeats it. Nothing is left within the steps of
    the sensor and of the drive.
    """
    if linear.within_steps:
        return 0.0
    discrepancy = likely_discrepancy_deg(linear, covariance)
    above = 0.0 if sensor_deg is None else max(noise_deg**2 - (SENSOR_MARGIN * sensor_deg) ** 2, 0.0)
    return math.sqrt(discrepancy**2 + above)


def likely_discrepancy_deg(linear: Linearised, covariance: Covariance) -> float:
    """Root mean square of the discrepancy that is most likely at a covariance, deg."""
    space = reduced(linear, covariance.rho)
    modes = space.modes(covariance.pattern)
    inside = space.rows(linear.residual[:, None]).inside[:, 0]
    weighted = modes.turn.T @ (modes.weights(covariance.tau) * (modes.turn @ inside))
    found = linear.shapes @ (covariance.tau**2 * linear.shares * (space.shapes.T @ weighted))
    for name, scale in covariance.pattern:
        found += scale**2 * linear.smooth[name] @ (space.smooth[name].T @ weighted)
    return float(np.sqrt(np.mean(found**2)))
