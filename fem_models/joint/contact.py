"""Closed notches and weight as both engines take them."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from fem_models.joint.flexure import closure_angle_rad
from fem_models.rig.checks import SolverError
from fem_models.rig.joints import MeasuredJoint, NotchedTube
from fem_models.rig.rig import Rig

GRAVITY_MM_PER_S2 = 9806.65


def contact_angle_rad(rig: Rig) -> float:
    """Angle of a joint at which its notch is closed; inf without contact."""
    if rig.closure is None:
        return math.inf
    return closure_angle_rad(rig) if rig.closure.angle_deg is None else math.radians(rig.closure.angle_deg)


def closes_one_way(rig: Rig) -> bool:
    """Whether notches are on one side only, where positive bending closes them."""
    return isinstance(rig.joint, NotchedTube) and rig.joint.one_sided


def ring_weight_N(rig: Rig) -> tuple[float, float]:
    """Weight of one ring along the straight tube and across it, in the bending plane, N."""
    if rig.gravity is None:
        return 0.0, 0.0
    weight = rig.gravity.ring_mass_g * 1e-6 * GRAVITY_MM_PER_S2  # g to kg, mm/s^2 to m/s^2
    way = math.radians(rig.gravity.direction_deg)
    return weight * math.cos(way), weight * math.sin(way)


def require_open(rig: Rig, joint_angles_rad: NDArray[np.float64]) -> None:
    """Refuse angles past the closure of a notch, shape (m, N), on a rig without contact of the edges.

    Raises
    ------
    SolverError
        With the first sample, the joint and the angle at which the notch closes.
    """
    if rig.closure is not None or isinstance(rig.joint, MeasuredJoint):
        return
    limit = closure_angle_rad(rig)
    turned = joint_angles_rad if closes_one_way(rig) else np.abs(joint_angles_rad)
    past = np.argwhere(turned > limit)
    if past.size:
        sample, joint = past[0]
        raise SolverError(
            f"rig {rig.name}, sample {sample} of {len(turned)}: joint {joint + 1} at "
            f"{math.degrees(turned[sample, joint]):.1f} deg, but its notch closes at {math.degrees(limit):.1f} deg: "
            "expected a smaller drive, or a rig with [closure]"
        )
