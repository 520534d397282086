"""Flexures whose stiffness varies along the bend."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from hysteresis.arrays import Floats


class Hardening(NamedTuple):
    """Growth of a flexure's stiffness with the angle from rest; see :class:`fem_models.rig.joints.MeasuredJoint`."""

    slope: float = 0.0
    limit: float = 0.0
    angle_rad: float = 1.0

    @property
    def is_linear(self) -> bool:
        """Whether the stiffness is the same at all angles."""
        return self.slope == 0.0 and self.limit == 0.0


def beyond_linear_rad(bent_rad: Floats, hardening: Hardening) -> Floats:
    """Moment of a flexure over its stiffness at rest, less its angle from rest; any shape.

    The integral of (slope u + limit u^2) / (1 + u^2), u = angle / hardening.angle_rad.
    """
    u = np.abs(bent_rad) / hardening.angle_rad
    beyond = 0.5 * hardening.slope * np.log1p(u**2) + hardening.limit * (u - np.arctan(u))
    return np.asarray(np.sign(bent_rad) * hardening.angle_rad * beyond)
