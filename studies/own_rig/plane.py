"""The plane in which a wheel bends the tip most, and the lost motion in it."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from fem_models.load import LoadProgram
from hysteresis.arrays import Floats
from hysteresis.records.metrics import loop_width

ROUNDING_DEG = 1e-6
"""Least range of a bending angle that tells a loop: the chain is solved to 1e-10 of its forces."""


@dataclass(frozen=True)
class PlaneOfLoop:
    """A loop in the plane in which the tip bends most.

    ``angle_deg``, shape (m,), is the bending in it and ``direction_deg`` its angle from y towards z; ``across_deg`` is
    the largest bending out of it.
    """

    direction_deg: float
    angle_deg: Floats
    across_deg: float


def plane_of_loop(bending_deg: Floats) -> PlaneOfLoop:
    """Find the plane of the largest bending of a run, shape (m, 2)."""
    most = bending_deg[int(np.linalg.norm(bending_deg, axis=1).argmax())]
    size = float(np.linalg.norm(most))
    y, z = most / size if size > 0 else np.array([1.0, 0.0])
    across = bending_deg @ np.array([-z, y])
    return PlaneOfLoop(math.degrees(math.atan2(z, y)), bending_deg @ np.array([y, z]), float(np.abs(across).max()))


def facing_drive(drive_mm: Floats, bending_deg: Floats) -> PlaneOfLoop:
    """Find the same plane, turned so that the largest drive, shape (m,), bends above 0."""
    plane = plane_of_loop(bending_deg)
    if plane.angle_deg[int(drive_mm.argmax())] >= 0:
        return plane
    direction = plane.direction_deg + (180.0 if plane.direction_deg <= 0 else -180.0)
    return PlaneOfLoop(direction, -plane.angle_deg, plane.across_deg)


def lost_motion_mm(program: LoadProgram, plane: PlaneOfLoop) -> float | None:
    """Largest width of a loop along the drive: how far the wheel goes back until the tip is where it was.

    None where nothing bends but for rounding.
    """
    if np.ptp(plane.angle_deg) < ROUNDING_DEG:
        return None
    return loop_width(plane.angle_deg, program.drive_mm, program.cycle).max_deg
