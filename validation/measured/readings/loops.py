"""The paper's tests on a rig, by the chain: static loops at 10 and 20 N, a smaller static one, and the 1 Hz sine."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from functools import lru_cache

import numpy as np

from fem_models.chain.parameters import ChainSettings
from fem_models.chain.solve import chain_angle_deg
from fem_models.load import LoadProgram, sine, triangle
from fem_models.rig import Rig
from hysteresis.arrays import Floats
from validation.measured.preset_du2018 import AMPLITUDE_MM

SMALLER_MM = 1.1
"""Amplitude that is compared with the full one; the paper names none."""
SECONDS_A_STEP = 10.0
"""Time of a static step: slow for every rate mechanism."""
RATE_HZ, CYCLES, SAMPLES = 1.0, 2, 200
STEP_MM = 0.1


@dataclass(frozen=True)
class Loop:
    """A closed loop at increasing drives, shapes (k,): angles of the rising and of the falling branch, deg."""

    drive_mm: Floats
    up_deg: Floats
    down_deg: Floats

    @property
    def width_deg(self) -> Floats:
        """Falling less rising branch, shape (k,): positive where the angle lags."""
        return self.down_deg - self.up_deg


@dataclass(frozen=True)
class Loops:
    """The static loops of a rig by the paper's tests, and how its loop at 1 Hz differs from the static one at 20 N.

    ``peak_ratio`` is the largest angle at 1 Hz over the static one, ``apart_deg`` the largest difference between the
    two loops on the same branch at the same drive. A rig without a rate mechanism has 1 and 0.
    """

    low: Loop
    high: Loop
    smaller: Loop
    peak_ratio: float
    apart_deg: float


@lru_cache
def static_program(amplitude_mm: float = AMPLITUDE_MM, step_mm: float = STEP_MM) -> LoadProgram:
    """First quarter and one cycle of the point-by-point test, with times."""
    program = triangle(amplitude_mm, step_mm=step_mm)
    time_s = SECONDS_A_STEP * np.arange(program.drive_mm.size, dtype=float)
    return LoadProgram(program.drive_mm, time_s=time_s, cycle=program.cycle)


@lru_cache
def fast_program() -> LoadProgram:
    """First quarter and two cycles of the 1 Hz sine."""
    return sine(AMPLITUDE_MM, RATE_HZ, cycles=CYCLES, samples_per_cycle=SAMPLES)


def has_rate(rig: Rig) -> bool:
    """Whether a rig has a mechanism that depends on the rate."""
    heated = rig.superelastic is not None and rig.superelastic.heating_time_s is not None
    return heated or rig.drag is not None or rig.stribeck is not None


def static_loop(rig: Rig, amplitude_mm: float = AMPLITUDE_MM, step_mm: float = STEP_MM) -> Loop:
    """Run the static test and give its closed loop.

    Raises
    ------
    SolverError, RigError
        From the chain.
    """
    program = static_program(amplitude_mm, step_mm)
    angle = chain_angle_deg(rig, program, ChainSettings(max_step_mm=step_mm))
    quarter = (program.drive_mm.size - 1) // 5
    return Loop(program.drive_mm[3 * quarter :], angle[3 * quarter :], angle[quarter : 3 * quarter + 1][::-1])


def fast_angle_deg(rig: Rig, delay_ms: float = 0.0) -> Floats:
    """Angle of the 1 Hz test as a sensor of that delay reads it, shape of :func:`fast_program`."""
    program = fast_program()
    angle = chain_angle_deg(rig, program)
    assert program.time_s is not None
    return np.interp(program.time_s - 1e-3 * delay_ms, program.time_s, angle)


def last_cycle(angle_deg: Floats) -> tuple[Floats, Floats]:
    """Drive and angle of the last cycle of the 1 Hz test, from peak to peak, shapes (SAMPLES + 1,)."""
    return fast_program().drive_mm[-SAMPLES - 1 :], angle_deg[-SAMPLES - 1 :]


def _compared(fast_deg: Floats, static: Loop) -> tuple[float, float]:
    drive, angle = last_cycle(fast_deg)
    half = SAMPLES // 2
    falling = np.interp(drive[: half + 1], static.drive_mm, static.down_deg)
    rising = np.interp(drive[half:], static.drive_mm, static.up_deg)
    apart = max(np.abs(angle[: half + 1] - falling).max(), np.abs(angle[half:] - rising).max())
    return float(angle.max() / max(static.up_deg.max(), static.down_deg.max())), float(apart)


def loops_of(
    rig: Rig, camera: Mapping[str, float] | None = None, step_mm: float = STEP_MM, low: Loop | None = None
) -> Loops:
    """Run the paper's tests on a rig; ``camera`` may hold the delay of the sensor, ``delay_ms``.

    ``low`` is the loop at 10 N, if it is known.

    Raises
    ------
    SolverError, RigError
        From the chain.
    """
    low = low or static_loop(replace(rig, preload_N=10.0), step_mm=step_mm)
    rig = replace(rig, preload_N=20.0)
    high, smaller = static_loop(rig, step_mm=step_mm), static_loop(rig, SMALLER_MM, step_mm)
    delay = (camera or {}).get("delay_ms", 0.0)
    if not has_rate(rig) and delay == 0:
        return Loops(low, high, smaller, 1.0, 0.0)
    return Loops(low, high, smaller, *_compared(fast_angle_deg(rig, delay), high))
