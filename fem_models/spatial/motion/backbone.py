"""Bending over the drive of one wheel without friction and without a loop: the kinematics of one plane."""

from __future__ import annotations

from collections.abc import Callable, Sequence

import numpy as np

from fem_models.rig import Rig
from fem_models.rig.checks import require
from fem_models.spatial.drives import WheelProgram
from fem_models.spatial.motion.workspace import smooth_rig
from fem_models.spatial.rig import of_rig_in_space
from fem_models.spatial.solve import solve_spatial
from hysteresis.arrays import Floats


def plane_backbone(rig: Rig, plane: int, still_mm: Sequence[float]) -> Callable[[Floats], Floats]:
    """Give the bending of one plane over the drive of its wheel.

    Parameters
    ----------
    plane
        1 is the first wheel and the bending towards y, 2 the second wheel and that towards z.
    still_mm
        Where every wheel stands; that of the plane is moved.

    Returns
    -------
    Callable
        Drives, shape (m,), mm -> bending, (m,), deg; it raises what :func:`fem_models.spatial.solve_spatial` raises.

    Raises
    ------
    RigError
        A rig without that wheel, or another number of wheels.
    """
    wheels, name = rig.wheel_count, f"of rig {rig.name}"
    require(plane in (1, 2) and plane <= wheels, "plane", plane, f"1 to {min(wheels, 2)}, the wheels {name}")
    require(len(still_mm) == wheels, "still_mm", f"{len(still_mm)} wheels", f"the {wheels} {name}")
    smooth = smooth_rig(rig)
    chain = of_rig_in_space(smooth)

    def bending_deg(drive_mm: Floats) -> Floats:
        drive = np.asarray(drive_mm, dtype=float)
        places, back = np.unique(drive, return_inverse=True)
        angle = np.empty_like(places)
        for side in (places >= 0, places < 0):  # outwards from rest, on either side
            out = places[side] if places[side][:1] >= 0 else places[side][::-1]
            if out.size:
                way = np.tile(np.asarray(still_mm, dtype=float), (out.size + 1, 1))
                way[:, plane - 1] = [0.0, *out]
                bent = solve_spatial(chain, WheelProgram(way).of_tendons(smooth)).bending_deg[1:, plane - 1]
                angle[side] = bent if out[0] >= 0 else bent[::-1]
        return angle[back.reshape(drive.shape)]

    return bending_deg
