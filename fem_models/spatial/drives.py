"""Programs of a wrist in space: a displacement or a tension for each tendon, or a motion of each wheel."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from fem_models.load.program import LoadProgram, require_few
from fem_models.rig import Rig
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


@dataclass(frozen=True)
class WheelProgram:
    """Motion of the wheels of a rig in space, sample by sample from the rig at rest.

    Parameters
    ----------
    wheels
        Shape (steps, wheels), mm; or, ``by_force``, tensions of the tendons at their wheels, (steps, tendons), N.
    time_s, cycle
        Shape (steps,), of :class:`fem_models.load.LoadProgram`.

    Raises
    ------
    RigError
        As :class:`SpatialProgram`; times that do not increase.
    """

    wheels: NDArray[np.float64]
    time_s: NDArray[np.float64] | None = None
    cycle: NDArray[np.int64] | None = None
    by_force: bool = False

    def __post_init__(self) -> None:
        checked = SpatialProgram(self.wheels, (self.by_force,) * np.shape(self.wheels)[-1])
        first = LoadProgram(checked.drives[:, 0], self.time_s, self.cycle)
        for name, value in (("wheels", checked.drives), ("time_s", first.time_s), ("cycle", first.cycle)):
            object.__setattr__(self, name, value)

    def of_tendons(self, rig: Rig) -> SpatialProgram:
        """Give the drives of the tendons.

        Raises
        ------
        RigError
            Another number of columns than the rig has wheels, or tendons.
        """
        given, wheels, tendons = self.wheels.shape[1], rig.wheel_count, len(rig.angles_deg)
        if self.by_force:
            require(
                given == tendons, "tensions", f"{given} columns", f"one for each of {tendons} tendons of {rig.name}"
            )
            return SpatialProgram(self.wheels, (True,) * given)
        require(given == wheels, "drives", f"{given} columns", f"one for each of {wheels} wheels of {rig.name}")
        return SpatialProgram(self.wheels @ rig.winding())


def first_wheel(program: LoadProgram, rig: Rig) -> WheelProgram:
    """Move the first wheel by a planar program; the others stand still."""
    still = np.zeros((program.drive_mm.size, rig.wheel_count - 1))
    return WheelProgram(np.column_stack([program.drive_mm, still]), program.time_s, program.cycle)


def round_axes(rig: Rig) -> Floats:
    """Give the drives of all wheels on two axes of a circle, shape (2, wheels): the first and the second one go round.

    Two wheels are the axes themselves. Of three or four, each takes the cosine and the sine of the angle of its first
    tendon. That is what tendons are wound in by when a tube bends without a change of its length: none pulls against
    another one.

    Raises
    ------
    RigError
        A rig with one wheel, which has no circle.
    """
    require(rig.wheel_count >= 2, "wheels", rig.wheel_count, f"2 to 4 of rig {rig.name}, to go round")
    if rig.wheel_count == 2:
        return np.eye(2)
    first = np.radians([rig.angles_deg[rig.wheels.index(k + 1)] for k in range(rig.wheel_count)])
    return np.stack([np.cos(first), np.sin(first)])


def circle(amplitude_mm: float, *, step_mm: float = 0.1, cycles: int = 1, axes: Floats | None = None) -> WheelProgram:
    """Move two wheels once round: wheel 1 to its amplitude, then A cos and A sin, ``cycles`` times.

    ``axes``, of :func:`round_axes`, are those of more wheels. The way out is cycle 0. Samples are at most ``step_mm``
    apart along the circle, and four to a quarter at least.

    Raises
    ------
    RigError
        An argument out of its range, or too many samples.
    """
    require(math.isfinite(amplitude_mm) and amplitude_mm > 0, "amplitude_mm", amplitude_mm, "above 0")
    require(math.isfinite(step_mm) and 0 < step_mm <= amplitude_mm, "step_mm", step_mm, "above 0, up to amplitude_mm")
    require(cycles >= 1, "cycles", cycles, "at least 1")
    require_few(2 * amplitude_mm / step_mm, cycles, "amplitude_mm, step_mm, cycles", f"{amplitude_mm:g}, {step_mm:g}")
    out = np.linspace(0.0, amplitude_mm, math.ceil(amplitude_mm / step_mm - 1e-9) + 1)
    quarter = max(4, math.ceil(0.5 * math.pi * amplitude_mm / step_mm - 1e-9))
    k = np.arange(1, 4 * quarter * cycles + 1)
    turn = 2 * math.pi * k / (4 * quarter)
    wheels = [np.column_stack([out, 0 * out]), amplitude_mm * np.column_stack([np.cos(turn), np.sin(turn)])]
    round_mm = np.concatenate(wheels) @ (np.eye(2) if axes is None else axes)
    return WheelProgram(round_mm, cycle=np.concatenate([0 * out, (k - 1) // (4 * quarter) + 1]))
