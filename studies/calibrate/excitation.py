"""Choose a drive program by the information that it gives on the law of a compensator.

The chain of the rig makes one rich record without noise, and a law f + h is identified on it. For any other program the
Fisher information of white noise is J^T J / sigma^2, J being the derivatives of the law's angles by its parameters
(Ljung 1999, section 7.4), so the covariance of an estimate is known before anything is measured. What counts is the
error that it makes in the angle along paths of all sizes, root mean square. The shortest program whose error is small
enough is taken.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from itertools import pairwise
from typing import Literal

import numpy as np

from fem_models.chain.solve import solve_chain
from fem_models.joint.strain import SUPERELASTIC
from fem_models.load import LoadProgram, triangle
from fem_models.rig import Rig, RigError
from fem_models.rig.checks import SolverError, require
from hysteresis import Fit, Record, identify
from hysteresis.arrays import Floats
from hysteresis.display import on_screen
from hysteresis.fitting.samples import Samples, join
from hysteresis.fitting.settings import IdentifySettings
from hysteresis.fitting.uncertainty import coordinates, linearise
from hysteresis.laws.bouc_wen import BoucWen
from hysteresis.plain import optional
from studies.results.made import Made

STRAIN_PERCENT = 100 * SUPERELASTIC.strain
TENSION_FACTOR = 3.0
"""Largest tension over the preload, if none is given."""
ASSUMED_WIDTH = 0.05
"""Width of the loop over the range of the angle of a rig that declares no friction."""
_SEARCH = IdentifySettings(population=40, generations=20)
_STEP_MM = 0.05
_TRIES = 12
_SIZES = (1.0, 0.75, 0.55, 0.4, 0.28, 0.18)
_LEAST_SIZES = 3
"""Sizes of loops in a program: no law is quite the device, and small loops show where they differ."""
_AT_ONCE = (3, 2, 1)
_PATHS_SEED, _PATHS_REVERSALS = 0, 24
Grade = Literal["full", "partial"]


@dataclass(frozen=True)
class Demands:
    """What a calibration has to meet.

    Parameters
    ----------
    amplitude_mm
        Drive up to which the compensator will work, in both directions.
    error_deg
        Error of the angle that the noise may cause; None for a fiftieth of the largest width of the loop.
    noise_deg, resolution_deg
        Standard deviation of the sensor of the angle, and its step.
    speed_mm_per_s, rate_Hz
        Of the motion, and of the samples.
    minutes
        Longest motion.
    strain_percent, tension_N
        Largest strain of a flexure and tension of a tendon; None for the strain to which Nitinol is tested, and three
        times the preload.

    Raises
    ------
    RigError
        A number out of range.
    """

    amplitude_mm: float
    error_deg: float | None = None
    noise_deg: float = 0.05
    resolution_deg: float = 0.0
    speed_mm_per_s: float = 0.5
    rate_Hz: float = 20.0
    minutes: float = 5.0
    strain_percent: float | None = None
    tension_N: float | None = None

    def __post_init__(self) -> None:
        for name in ("amplitude_mm", "noise_deg", "speed_mm_per_s", "rate_Hz", "minutes"):
            value = getattr(self, name)
            require(math.isfinite(value) and value > 0, _option(name), value, "above 0")
        for name in ("error_deg", "strain_percent", "tension_N"):
            value = getattr(self, name)
            require(value is None or (math.isfinite(value) and value > 0), _option(name), value or 0.0, "above 0")
        require(self.resolution_deg >= 0, _option("resolution_deg"), self.resolution_deg, "at least 0")

    @property
    def sensor_deg(self) -> float:
        """Standard deviation of a reading: noise, and the rounding to steps (a twelfth of the square)."""
        return math.hypot(self.noise_deg, self.resolution_deg / math.sqrt(12))


def _option(name: str) -> str:
    return f"--{name.rsplit('_', 1)[0] if name != 'speed_mm_per_s' else 'speed'}"


@dataclass(frozen=True)
class Expected:
    """A parameter of the law: its value by the model of the rig, and the standard deviation of an estimate."""

    name: str
    value: float
    standard_deviation: float
    unit: str


@dataclass(frozen=True, eq=False, repr=False)
class Calibration:
    """A program with what it is expected to give.

    ``error_deg`` is the error of the angle that noise causes, root mean square over paths of all sizes; ``wanted_deg``
    what was asked for, which ``grade`` says whether it is met within the time. ``limited`` says that the limits are why
    the amplitude is below the one that was asked for, ``assumed_loop`` that the rig declares no friction.
    """

    schema: int
    rig: str
    program: str
    amplitude_mm: float
    limited: bool
    strain_percent: float | None
    tension_N: float
    sizes: tuple[float, ...]
    duration_s: float
    samples: int
    loop_width_deg: float
    assumed_loop: bool
    error_deg: float
    wanted_deg: float
    grade: Grade
    law: str
    parameters: tuple[Expected, ...]
    drive_mm: tuple[float, ...]
    time_s: tuple[float, ...]
    made: Made | None = optional()

    def __repr__(self) -> str:
        return f"Calibration({self.rig}: {self.duration_s:.3g} s, {self.error_deg:.2g} deg)"

    def __str__(self) -> str:
        return on_screen(self.lines())

    def lines(self) -> list[str]:
        """Say it in lines."""
        why = ", as far as strain and tension allow" if self.limited else ""
        of = "as assumed, since the rig declares none" if self.assumed_loop else "by the model"
        strain = "not known of measured joints" if self.strain_percent is None else f"{self.strain_percent:.2g} %"
        met = "" if self.grade == "full" else f": {self.wanted_deg:.2g} deg was wanted, more than this time allows"
        lines = [
            f"{self.duration_s / 60:.2g} min of motion to +-{self.amplitude_mm:.3g} mm{why}; strokes of "
            f"{', '.join(f'{100 * size:.0f}' for size in self.sizes)} %",
            f"strain {strain}, tension up to {self.tension_N:.3g} N by the model",
            f"error of the angle by noise {self.error_deg:.2g} deg, of a loop {self.loop_width_deg:.2g} deg wide "
            f"{of}{met}",
        ]
        lines += [
            f"  {one.name} = {one.value:.4g} +- {one.standard_deviation:.2g}{'' if one.unit == '1' else ' ' + one.unit}"
            for one in self.parameters
        ]
        return lines

    @property
    def load_program(self) -> LoadProgram:
        """The motion as a load program."""
        return LoadProgram(np.array(self.drive_mm), np.array(self.time_s))


def calibration(rig: Rig, demands: Demands, program: str = "") -> Calibration:
    """Find the shortest program.

    Parameters
    ----------
    rig
        In one plane, driven in mm. Its constants need only be near: they choose the program and not the compensator.
    demands
        See :class:`Demands`.
    program
        Name of the file that the program is written to.

    Raises
    ------
    RigError
        A rig that exceeds the limits at any drive, or demands that no program meets in time.
    SolverError
        A rig that cannot follow its drive.
    """
    amplitude, strain, tension = _allowed(rig, demands)
    rich = _moved(amplitude, _SIZES, demands)
    record = solve_chain(rig, LoadProgram(rich)).record
    fit = identify(record, settings=_SEARCH)
    assumed = not fit.point.sign
    if assumed:
        record = _with_loop(record)
        fit = identify(record, settings=_SEARCH)
    width = record.loop_width_deg
    wanted = width / 50 if demands.error_deg is None else demands.error_deg
    error, sizes, drive, covariance = _shortest(fit, amplitude, demands, wanted)
    return Calibration(
        schema=1,
        rig=rig.name,
        program=program,
        amplitude_mm=amplitude,
        limited=amplitude < demands.amplitude_mm * (1 - 1e-9),
        strain_percent=strain,
        tension_N=tension,
        sizes=sizes,
        duration_s=drive.size / demands.rate_Hz,
        samples=drive.size,
        loop_width_deg=width,
        assumed_loop=assumed,
        error_deg=error,
        wanted_deg=wanted,
        grade="full" if error <= wanted else "partial",
        law=fit.law_title,
        parameters=tuple(_expected(fit, covariance)),
        drive_mm=tuple(np.round(drive, 6).tolist()),
        time_s=tuple((np.arange(drive.size) / demands.rate_Hz).tolist()),
    )


def _shortest(
    fit: Fit, amplitude: float, demands: Demands, wanted: float
) -> tuple[float, tuple[float, ...], Floats, Floats]:
    """Find the shortest program: error of the angle, deg, sizes of its loops, drive, and covariance of the law.

    Where none in time meets what is wanted, the one with the least error.
    """
    paths = _columns(fit, _paths(amplitude, demands))
    best: tuple[float, tuple[float, ...], Floats, Floats] | None = None
    for sizes in _candidates():
        drive = _moved(amplitude, sizes, demands)
        if drive.size / demands.rate_Hz > 60 * demands.minutes:
            continue
        covariance = _covariance(_columns(fit, drive), demands.sensor_deg)
        error = float(np.sqrt(np.mean(np.einsum("ij,jk,ik->i", paths, covariance, paths))))
        if best is None or error < best[0]:
            best = (error, sizes, drive, covariance)
        if error <= wanted:
            break
    if best is None:
        least = 60 * demands.minutes * demands.rate_Hz
        raise RigError(
            f"--minutes {demands.minutes:g}: {least:.0f} samples: too short for one loop of +-{amplitude:.3g} mm at "
            f"{demands.speed_mm_per_s:g} mm/s: expected more, or a higher --speed"
        )
    return best


def _with_loop(record: Record) -> Record:
    """Give a record a loop of :data:`ASSUMED_WIDTH`, half of the motion lost after a reversal."""
    saturation = 0.5 * ASSUMED_WIDTH * float(np.ptp(record.angle_deg))
    law = BoucWen(A=-0.5, beta=0.25 / saturation, gamma=0.25 / saturation, n=1.0, h0_deg=0.0)
    return replace(record, angle_deg=record.angle_deg + law.along(record.angle_deg))


def _allowed(rig: Rig, demands: Demands) -> tuple[float, float | None, float]:
    """Find the largest amplitude, at most the one asked for, with its strain, % or None, and its tension, N."""
    most_strain = (STRAIN_PERCENT if demands.strain_percent is None else demands.strain_percent) / 100
    most_tension = TENSION_FACTOR * rig.preload_N if demands.tension_N is None else demands.tension_N
    amplitude = demands.amplitude_mm
    for _ in range(_TRIES):
        try:
            run = solve_chain(rig, triangle(amplitude, step_mm=amplitude / 20))
        except (RigError, SolverError):
            amplitude *= 0.8
            continue
        strain, tension = float(np.abs(run.peak_strain).max()), float(run.segment_tensions_N.max())
        over = max(tension / most_tension, strain / most_strain if math.isfinite(strain) else 0.0)
        if over <= 1.0:
            return amplitude, 100 * strain if math.isfinite(strain) else None, tension
        amplitude *= min(0.95, max(0.5, 0.98 / over))
    raise RigError(
        f"rig {rig.name}: beyond {100 * most_strain:g} % of strain or {most_tension:g} N at every drive: expected a "
        "larger --strain or --tension, or a smaller preload"
    )


def _candidates() -> list[tuple[float, ...]]:
    """Sizes of the loops of all programs, the shortest first: a full loop, and decaying ones down to small ones."""
    found = set[tuple[float, ...]]()
    for full in _AT_ONCE:
        for count in range(_LEAST_SIZES, len(_SIZES) + 1):
            found.add((*(_SIZES[0],) * full, *_SIZES[1:count]))
    return sorted(found, key=lambda sizes: (sum(sizes), len(sizes)))


def _moved(amplitude: float, sizes: Sequence[float], demands: Demands) -> Floats:
    """Give loops of these sizes from rest and back to zero, sample by sample, mm."""
    turns = [0.0, *(x for size in sizes for x in (size * amplitude, -size * amplitude)), 0.0]
    return _along(turns, demands.speed_mm_per_s / demands.rate_Hz)


def _along(turns: Sequence[float], step: float) -> Floats:
    parts = [np.linspace(a, b, max(2, math.ceil(abs(b - a) / step - 1e-9) + 1))[1:] for a, b in pairwise(turns)]
    return np.concatenate([np.zeros(1), *parts])


def _paths(amplitude: float, demands: Demands) -> Floats:
    """Give a path with reversals anywhere, as a reference for the compensator."""
    turns = np.random.default_rng(_PATHS_SEED).uniform(-amplitude, amplitude, _PATHS_REVERSALS)
    return _along([0.0, *turns.tolist()], max(_STEP_MM, demands.speed_mm_per_s / demands.rate_Hz))


def _columns(fit: Fit, drive: Floats) -> Floats:
    """Differentiate the angles of the law along a drive by its parameters: shape (m, p)."""
    return linearise(_samples(fit, drive), fit.form, fit.point).columns


def _samples(fit: Fit, drive: Floats) -> Samples:
    angle = fit.predict(drive)
    record = Record(drive=drive, angle_deg=angle, kind="simulated")
    return join([record], [np.ones(drive.size, dtype=bool)])


def _covariance(columns: Floats, sensor_deg: float) -> Floats:
    """Covariance of an estimate, shape (p, p); what a program does not show at all is held."""
    size = np.linalg.norm(columns, axis=0)
    shown = size > 1e-9 * size.max()
    scaled = columns[:, shown] / size[shown]
    out = np.zeros((size.size, size.size))
    within = np.linalg.pinv(scaled.T @ scaled, rcond=1e-12, hermitian=True) * sensor_deg**2
    out[np.ix_(shown, shown)] = within / np.outer(size[shown], size[shown])
    return out


def _expected(fit: Fit, covariance: Floats) -> list[Expected]:
    """Parameters of the law; those that the law has as logarithms by their relative deviation."""
    found = []
    for name, at in coordinates(fit.form):
        deviation = math.sqrt(max(0.0, float(covariance[at, at])))
        if name not in fit.parameters and name != "saturation_deg":
            continue
        one = fit.saturation_deg if name == "saturation_deg" else fit.parameters[name]
        found.append(Expected(name, one.value, abs(one.value) * deviation, one.unit))
    return found
