"""The load program: the motion of the wheel. Every engine is a function ``(Rig, LoadProgram) -> Record``."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from fem_models.rig.checks import RigError, require
from hysteresis.arguments import checked, checked_class
from hysteresis.display import from_to, html_table
from hysteresis.messages import quoted
from hysteresis.records.record import MAX_MAGNITUDE

MAX_SAMPLES = 2_000_000
"""Most samples of a program made here: more is a typing error, and would fill the memory."""


@checked_class(RigError)
@dataclass(frozen=True, repr=False)
class LoadProgram:
    """Motion of the wheel: tendon displacement sample by sample, with times where the rate matters.

    Parameters
    ----------
    drive_mm
        Shape (m,), tendon displacement at the wheel; a quasi-static engine visits the samples in order.
        The rig starts straight, preloaded, at zero drive.
    time_s
        Shape (m,), strictly increasing; None for a quasi-static program.
    cycle
        Shape (m,), the cycle of each sample; 0 is the branch from rest to the first reversal.
    """

    drive_mm: NDArray[np.float64]
    time_s: NDArray[np.float64] | None = None
    cycle: NDArray[np.int64] | None = None

    def __post_init__(self) -> None:
        drive = _numbers("drive_mm", self.drive_mm, float)
        require(
            drive.ndim == 1 and drive.size >= 2,
            "drive_mm",
            f"shape {drive.shape}",
            "a row of at least 2 values",
        )
        require(bool(np.isfinite(drive).all()), "drive_mm", "NaN or infinite", "finite numbers")
        largest = float(np.abs(drive).max())
        require(largest <= MAX_MAGNITUDE, "drive_mm", f"{largest:g}", f"at most {MAX_MAGNITUDE:g}, as in a record")
        drive.flags.writeable = False
        object.__setattr__(self, "drive_mm", drive)
        for name in ("time_s", "cycle"):
            value = getattr(self, name)
            if value is None:
                continue
            value = _numbers(name, value, float if name == "time_s" else np.int64)
            require(
                value.shape == drive.shape,
                name,
                f"shape {value.shape}",
                f"the shape of drive_mm, {drive.shape}",
            )
            if name == "time_s":
                require(bool(np.isfinite(value).all()), name, "NaN or infinite", "finite times")
                require(bool((np.diff(value) > 0).all()), name, "not increasing", "strictly increasing times")
            value.flags.writeable = False
            object.__setattr__(self, name, value)

    def to_dict(self) -> dict[str, list[float] | list[int]]:
        """Plain values by column name; ``time_s`` and ``cycle`` only where there are any."""
        columns = {"drive_mm": self.drive_mm, "time_s": self.time_s, "cycle": self.cycle}
        return {name: column.tolist() for name, column in columns.items() if column is not None}

    def __repr__(self) -> str:
        return f"LoadProgram({', '.join(f'{name} {value}' for name, value in self._facts())})"

    def _repr_html_(self) -> str:
        return html_table("load program", self._facts())

    def _facts(self) -> list[tuple[str, str]]:
        facts = [("samples", str(self.drive_mm.size)), ("drive", from_to(self.drive_mm, "mm"))]
        if self.time_s is not None:
            facts.append(("time", from_to(self.time_s, "s")))
        return facts if self.cycle is None else [*facts, ("cycles", f"{self.cycle.min()} to {self.cycle.max()}")]


def _numbers(name: str, given: object, kind: type) -> NDArray[Any]:
    try:
        return np.array(given, dtype=kind)
    except (TypeError, ValueError, OverflowError):
        raise RigError(f"{name} = {quoted(given, 40)}: expected numbers") from None


@checked
def triangle(amplitude_mm: float, *, step_mm: float = 0.1, cycles: int = 1) -> LoadProgram:
    """Point-by-point program of the paper (section 4.2): 0 to +A, then ``cycles`` times +A to -A to +A.

    The first quarter (cycle 0) leaves the virgin state; the closed loops are cycles 1, 2, ...
    Samples lie on the reversals: the step is the largest one not above ``step_mm`` that divides A.

    Parameters
    ----------
    amplitude_mm
        A, drive of the tendon at the wheel, mm.
    step_mm
        Largest step from sample to sample, mm.
    cycles
        Closed loops after the first quarter.

    Raises
    ------
    RigError
        An argument out of its range, or more than :data:`MAX_SAMPLES` samples.

    Examples
    --------
    >>> nb.triangle(2.2, cycles=2).drive_mm.size
    199
    """
    require(math.isfinite(amplitude_mm) and amplitude_mm > 0, "amplitude_mm", amplitude_mm, "above 0")
    require(
        math.isfinite(step_mm) and 0 < step_mm <= amplitude_mm,
        "step_mm",
        step_mm,
        "above 0, up to amplitude_mm",
    )
    require(cycles >= 1, "cycles", cycles, "at least 1")
    require_few(
        amplitude_mm / step_mm, cycles, "amplitude_mm, step_mm, cycles", f"{amplitude_mm:g}, {step_mm:g}, {cycles}"
    )
    quarter = math.ceil(amplitude_mm / step_mm - 1e-9)
    k = np.arange(quarter * (1 + 4 * cycles) + 1)
    phase = k / quarter  # in quarters: 0 -> 1 is the virgin branch
    drive = amplitude_mm * (1 - np.abs((phase + 1) % 4 - 2))
    cycle = np.where(k <= quarter, 0, (k - quarter - 1) // (4 * quarter) + 1)
    return LoadProgram(drive, cycle=cycle)


@checked
def sine(amplitude_mm: float, rate_Hz: float, *, cycles: int = 1, samples_per_cycle: int = 100) -> LoadProgram:
    """Sine of the paper's dynamic test (section 4.3), starting at zero drive.

    Parameters
    ----------
    amplitude_mm
        Drive of the tendon at the wheel, mm.
    rate_Hz
        Cycles a second, Hz.
    cycles
        Closed loops after the first quarter.
    samples_per_cycle
        A multiple of 4.

    Raises
    ------
    RigError
        An argument out of its range, or more than :data:`MAX_SAMPLES` samples.

    Examples
    --------
    >>> float(nb.sine(1.0, 0.5).time_s[-1])
    2.5
    """
    require(math.isfinite(amplitude_mm) and amplitude_mm > 0, "amplitude_mm", amplitude_mm, "above 0")
    require(1e-9 <= rate_Hz <= 1e9, "rate_Hz", rate_Hz, "above 0, from 1e-9 to 1e9")
    require(cycles >= 1, "cycles", cycles, "at least 1")
    require(
        8 <= samples_per_cycle <= MAX_SAMPLES and samples_per_cycle % 4 == 0,
        "samples_per_cycle",
        samples_per_cycle,
        f"a multiple of 4, from 8 to {MAX_SAMPLES:,}",
    )
    require_few(samples_per_cycle / 4, cycles, "cycles, samples_per_cycle", f"{cycles}, {samples_per_cycle}")
    quarter = samples_per_cycle // 4
    k = np.arange(quarter + samples_per_cycle * cycles + 1)
    phase = k / samples_per_cycle
    cycle = np.where(k <= quarter, 0, (k - quarter - 1) // samples_per_cycle + 1)
    return LoadProgram(amplitude_mm * np.sin(2 * np.pi * phase), time_s=phase / rate_Hz, cycle=cycle)


def require_few(quarter: float, cycles: int, names: str, values: str) -> None:
    """Refuse a program of too many samples before its arrays are made; ``quarter`` is the number in a quarter cycle."""
    # an int beyond the range of floats cannot be multiplied with one
    few = cycles <= MAX_SAMPLES and quarter * (1 + 4 * cycles) < MAX_SAMPLES
    require(few, names, values, f"at most {MAX_SAMPLES:,} samples")
