"""The program of a wrist in space: a displacement or a tension for each tendon, sample by sample."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from fem_models.rig.checks import require
from hysteresis.arrays import Floats
from hysteresis.records.record import MAX_MAGNITUDE


@dataclass(frozen=True)
class SpatialProgram:
    """Drives of all tendons.

    Parameters
    ----------
    drives
        Shape (steps, tendons), visited in order from the rig at rest: tendon that is wound in, mm, or its tension at
        the wheel, N.
    by_force
        For each tendon whether its drive is a tension; () is displacements throughout.

    Raises
    ------
    RigError
        Another shape, values that are not finite, a tension below 0.
    """

    drives: NDArray[np.float64]
    by_force: tuple[bool, ...] = ()

    def __post_init__(self) -> None:
        drives = np.array(self.drives, dtype=float)
        shaped = drives.ndim == 2 and min(drives.shape) >= 1
        require(shaped, "drives", f"shape {drives.shape}", "a table of (steps, tendons)")
        require(bool(np.isfinite(drives).all()), "drives", "NaN or infinite", "finite numbers")
        largest = float(np.abs(drives).max())
        require(largest <= MAX_MAGNITUDE, "drives", f"{largest:g}", f"at most {MAX_MAGNITUDE:g}")
        by_force = tuple(self.by_force) or (False,) * drives.shape[1]
        one_each = len(by_force) == drives.shape[1]
        require(one_each, "by_force", f"{len(by_force)} switches", f"one for each of {drives.shape[1]} tendons")
        least = min([float(drives[:, j].min()) for j, force in enumerate(by_force) if force], default=0.0)
        require(least >= 0, "drives", f"a tension of {least:g}", "at least 0")
        drives.flags.writeable = False
        object.__setattr__(self, "drives", drives)
        object.__setattr__(self, "by_force", by_force)


def wheel_drives(wheels_mm: ArrayLike) -> Floats:
    """Drives of pairs of tendons, each wound on one wheel in opposite directions: (steps, w) to (steps, 2 w).

    Tendons stand in the order of the wheels: the one that a positive drive pulls, then the other one. A row of shape
    (steps,) is one wheel.
    """
    wheels = np.asarray(wheels_mm, dtype=float)
    wheels = wheels[:, None] if wheels.ndim == 1 else wheels
    return np.stack([wheels, -wheels], axis=2).reshape(len(wheels), -1)
