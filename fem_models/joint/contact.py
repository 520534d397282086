"""Notches that close, the weight of the rings and a load on the tip, as both engines take them."""

from __future__ import annotations

import math

import numpy as np

from fem_models.joint.row import JointRow
from fem_models.rig import Rig
from fem_models.rig.checks import ClosedNotchError, FoldedTubeError
from hysteresis.arrays import Floats

GRAVITY_MM_PER_S2 = 9806.65


def weight_N(mass_g: float) -> float:
    """Weight of a mass, N."""
    return mass_g * 1e-6 * GRAVITY_MM_PER_S2  # g to kg, mm/s^2 to m/s^2


def ring_weight_N(rig: Rig) -> tuple[float, float]:
    """Weight of one ring along the straight tube and across it, in the bending plane, N."""
    if rig.gravity is None:
        return 0.0, 0.0
    return _parts(weight_N(rig.gravity.ring_mass_g), rig.gravity.direction_deg)


def tip_force_N(rig: Rig) -> tuple[float, float]:
    """Dead force on the centre of the last ring, along the straight tube and across it, N: load and weight there."""
    x = y = 0.0
    if rig.tip_load is not None:
        x, y = _parts(rig.tip_load.force_N, rig.tip_load.direction_deg)
    if rig.tip_mass is not None:
        weight_x, weight_y = _parts(weight_N(rig.tip_mass.mass_g), rig.tip_mass.direction_deg)
        x, y = x + weight_x, y + weight_y
    return x, y


def _parts(force_N: float, direction_deg: float) -> tuple[float, float]:
    direction = math.radians(direction_deg)
    return force_N * math.cos(direction), force_N * math.sin(direction)


FOLDED_DEG = 720.0
"""Bending at which a tube lies twice round itself: no robot does, and its notches have long met."""


def require_unfolded(rig: Rig, joint_angles_rad: Floats) -> None:
    """Refuse a tube that bends twice round and further, joint angles of shape (m, N).

    Raises
    ------
    FoldedTubeError
        With the first sample, the ring and its bending.
    """
    bent = np.abs(np.degrees(np.cumsum(joint_angles_rad, axis=1)))
    past = np.argwhere(bent > FOLDED_DEG)
    if past.size:
        sample, number = past[0]
        raise FoldedTubeError(
            f"rig {rig.name}, sample {sample} of {len(bent)}: ring {number + 1} is bent by {bent[sample, number]:.0f} "
            f"deg: the tube folds over beyond {FOLDED_DEG:g} deg: expected a smaller drive or preload"
        )


def require_open(rig: Rig, joints: JointRow, joint_angles_rad: Floats) -> None:
    """Refuse angles past the closure of a notch, shape (m, N), on a rig without contact of the edges.

    Raises
    ------
    ClosedNotchError
        With the first sample, the joint and the angle at which the notch closes.
    """
    if rig.closure is not None or joints.first.closure_angle_rad == math.inf:  # of measured joints
        return
    least = min(joint.closure_angle_rad for joint in (joints.each[:1] if joints.alike else joints.each))
    if -least <= joint_angles_rad.min() and joint_angles_rad.max() <= least:  # nearly all runs: at a glance
        return
    limit = joints.of("closure_angle_rad")
    closing = joint_angles_rad if joints.first.one_sided else np.abs(joint_angles_rad)
    past = np.argwhere(closing > limit)
    if past.size:
        sample, number = past[0]
        at, closes = math.degrees(closing[sample, number]), math.degrees(limit[number])
        smaller = "drive" if sample or not rig.preload_N else "drive or preload"
        raise ClosedNotchError(
            f"rig {rig.name}, sample {sample} of {len(closing)}: joint {number + 1} at "
            f"{at:.1f} deg, but its notch closes at {closes:.1f} deg: "
            f"expected a smaller {smaller}, or a rig with [closure]"
        )
