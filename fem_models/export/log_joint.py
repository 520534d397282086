"""The joint of a log in the terms of MuJoCo: friction, damping, spring and backlash of one axis, with 95 % intervals.

The whole axis is one hinge, its angle that of the record. A moment is the moment arm times the force that drives, or
times the difference of the tensions of tendons a and b.

* Force known: ``stiffness``, ``springref``, ``frictionloss`` and ``damping`` from moment and angle
  (:mod:`hysteresis.fitting.play_joint`).
* Displacement of the drive known: ``backlash`` from wheel = zero + gain P[drive], P the play operator of half the gap.
  With a force, moment = drive_stiffness (wheel - angle) tells the gap, in which the moment stays, from friction, which
  winds the drive up. Without one the wheel is the axis, and the backlash is all lost motion.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from hysteresis.arrays import Floats
from hysteresis.files import RecordError
from hysteresis.fitting.play_joint import PlayJoint, fit_play_joint, lagging_play
from hysteresis.fitting.uncertainty import Parameter
from hysteresis.records.metrics import noise_floor
from hysteresis.records.path import branches, require_reversal
from hysteresis.records.record import Record
from hysteresis.sensors.readings import cleaned

MM = 1e-3  # m
RATES = 2.0
"""Least ratio of the speeds of long strokes by which damping is distinguished from friction, the same at any speed."""
MOST_NOISE = 0.2
"""Noise of the angle over what a drive gives way: the stiffness is then too low by 4 %."""
CONTROL = {"mm": ("m", MM), "deg": ("rad", math.pi / 180), "step": ("step", 1.0), "N": ("N", 1.0)}
"""Unit of the drive -> unit of the control in the file, and its factor."""
NO_FORCE = "the record has no force: expected columns.force, or tension_a"
NO_TIME = "the record has no time: expected columns.time"


@dataclass(frozen=True, eq=False)
class LogJoint:
    """Values of one axis from a log, in N m, rad and s; m samples.

    ``values`` are those that the log tells, ``missing`` says of the others why not. ``zero_rad`` and ``gain``, rad for
    each unit of the control, are those of the drive; both are 0 where a force drives. ``start`` has the coordinates at
    the first sample: axis, wheel, motor, rad. ``predicted_deg``, shape (m,), is the loop of the values, and
    ``rmse_deg`` its distance from the record. ``largest_moment_Nm`` is 0 without a force.
    """

    record: Record
    moment_arm_mm: float | None
    values: dict[str, Parameter]
    missing: dict[str, str]
    zero_rad: float
    gain: float
    sign: float  # of the moment that bends to positive angles, for positive forces
    start: tuple[float, float, float]
    predicted_deg: Floats
    rmse_deg: float
    noise_deg: float
    blocks: int
    largest_moment_Nm: float

    @property
    def name(self) -> str:
        """Name of the record's file, or its title."""
        return Path(self.record.source).name or self.record.title or "record"

    def number(self, name: str) -> float:
        """Give a value; 0 where the log does not tell it."""
        return self.values[name].value if name in self.values else 0.0


def joint_of_log(record: Record, moment_arm_mm: float | None, *, seed: int = 0) -> LogJoint:
    """Identify the joint of a record.

    Parameters
    ----------
    record
        A loop: the drive must reverse.
    moment_arm_mm
        Of the tendon at the axis; None if it is not known, and no moment then.
    seed
        Of the block bootstrap.

    Raises
    ------
    RecordError
        A drive that never reverses; an angle that never changes, or falls with the force; a force without moment arm.
    """
    require_reversal(record)
    where = record.source or "record"
    if np.ptp(record.angle_deg) == 0:
        raise RecordError(f"{where}: angle = {record.angle_deg[0]:g} throughout: expected an angle that changes")
    if record.drive_unit == "N" and moment_arm_mm is None:
        expected = "expected --moment-arm MM, or a rig in the sidecar"
        raise RecordError(f"{where}: moment arm: missing: a force alone has no moment: {expected}")
    record = cleaned(record).record
    noise_deg = min(noise_floor(record), _from_sample_to_sample(record.angle_deg))
    angle = np.radians(record.angle_deg)
    moment, sign = _moment(record, moment_arm_mm, angle)
    values, missing = dict[str, Parameter](), dict[str, str]()
    spring = None if moment is None else _spring(record, moment, angle, (values, missing), seed)
    if moment is None:
        why = NO_FORCE if record.tension_a_N is None else "moment arm: missing: expected --moment-arm MM"
        missing |= dict.fromkeys(("frictionloss", "damping", "stiffness", "springref"), why)
    drive = None
    if record.drive_unit == "N":
        missing["backlash"] = "a force drives: expected the displacement of the drive in columns.drive"
    else:
        drive = _drive(record, moment, angle, math.radians(noise_deg), (values, missing), seed)
    predicted, start = _prediction(record, moment, spring, drive, values)
    _, factor = CONTROL[record.drive_unit]
    return LogJoint(
        record=record,
        moment_arm_mm=moment_arm_mm,
        values=values,
        missing=missing,
        zero_rad=0.0 if drive is None else drive.zero,
        gain=0.0 if drive is None else drive.gain / factor,
        sign=sign,
        start=start,
        predicted_deg=np.degrees(predicted),
        rmse_deg=float(np.degrees(np.sqrt(np.mean((predicted - angle) ** 2)))),
        noise_deg=noise_deg,
        blocks=max(one.blocks for one in (spring, drive) if one is not None),
        largest_moment_Nm=0.0 if moment is None else float(np.abs(moment).max()),
    )


def _from_sample_to_sample(angle_deg: Floats) -> float:
    """Noise of second differences, deg: cycles at other rates differ by more than noise."""
    return float(1.4826 * np.median(np.abs(np.diff(angle_deg, 2))) / math.sqrt(6)) if angle_deg.size > 2 else 0.0


Found = tuple[dict[str, Parameter], dict[str, str]]
"""Values, and why others are missing."""


def _moment(record: Record, arm_mm: float | None, angle: Floats) -> tuple[Floats | None, float]:
    """Give the moment, N m, shape (m,), positive where it bends to positive angles; and its sign."""
    force = record.drive if record.drive_unit == "N" else record.tension_a_N
    if force is None or arm_mm is None:
        return None, 1.0
    if record.drive_unit != "N" and record.tension_b_N is not None:
        force = force - record.tension_b_N
    if np.ptp(force) == 0:
        raise RecordError(f"{record.source or 'record'}: force = {force[0]:g} N throughout: expected one that changes")
    sign = math.copysign(1.0, float((force - force.mean()) @ angle))
    return sign * MM * arm_mm * force, sign


def _spring(record: Record, moment: Floats, angle: Floats, found: Found, seed: int) -> PlayJoint:
    values, missing = found
    why = _no_damping(record)
    fit = fit_play_joint(moment, angle, time_s=None if why else record.time_s, seed=seed)
    _require_rising(record, fit)
    if why is None:
        damping = fit.value(lambda x: x[3] / x[1], "N m s/rad", least=0.0)
        why = _told(damping, values, "damping")
        if why is not None:
            fit = fit_play_joint(moment, angle, seed=seed)
            _require_rising(record, fit)
    if why is not None:
        missing["damping"] = why
    values["stiffness"] = fit.value(lambda x: 1 / x[1], "N m/rad")
    values["springref"] = fit.value(lambda x: x[2], "rad")
    if (said := _told(fit.value(lambda x: x[0], "N m", least=0.0), values, "frictionloss")) is not None:
        missing["frictionloss"] = said
    return fit


def _require_rising(record: Record, fit: PlayJoint) -> None:
    if fit.gain <= 0:
        raise RecordError(f"{record.source or 'record'}: angle: does not rise with the moment: expected a spring")


def _told(value: Parameter, values: dict[str, Parameter], name: str) -> str | None:
    """Keep a value whose interval lies above 0; say why another one is not kept."""
    if value.low is not None and value.low > 0:
        values[name] = value
        return None
    if value.high is None:
        return "the record does not tell it"
    return f"not told from 0: at most {value.high:.3g} {value.unit}"


def _no_damping(record: Record) -> str | None:
    """Say why a record does not tell damping from friction; None if it may."""
    if record.time_s is None:
        return NO_TIME
    drive, time_s = record.drive, record.time_s
    strokes = [one for one in branches(drive) if abs(drive[one.stop - 1] - drive[one.start]) >= 0.5 * np.ptp(drive)]
    speeds = [abs(drive[s.stop - 1] - drive[s.start]) / (time_s[s.stop - 1] - time_s[s.start]) for s in strokes]
    ratio = max(speeds) / min(speeds) if speeds else 1.0
    if ratio >= RATES:
        return None
    return f"one rate (the fastest stroke is {ratio:.2g} times the slowest): expected rates that differ by {RATES:g}"


@dataclass(frozen=True)
class _Drive:
    """Wheel = zero + gain P[drive], rad; the radius of P and its start are those of the fit."""

    radius: float
    start: float
    gain: float
    zero: float
    blocks: int


def _drive(record: Record, moment: Floats | None, angle: Floats, noise_rad: float, found: Found, seed: int) -> _Drive:
    """Fit gain, zero and backlash of the drive, and its stiffness where moments are known."""
    values, missing = found
    if moment is not None:
        fit = fit_play_joint(record.drive, moment, others=(angle,), seed=seed)
        stiffness = fit.value(lambda x: -x[4], "N m/rad")
        if (why := _no_stiffness(fit, record, angle, noise_rad, stiffness)) is None:
            values["drive_stiffness"] = stiffness
            return _as_drive(record, fit, lambda x: -x[4], found)
        missing["drive_stiffness"] = why
    return _as_drive(record, fit_play_joint(record.drive, angle, seed=seed), lambda x: 1.0, found)


def _as_drive(record: Record, fit: PlayJoint, scale: Callable[[Floats], float], found: Found) -> _Drive:
    """Give the drive of a fit whose output is the wheel's angle times a scale."""
    values, missing = found
    unit, factor = CONTROL[record.drive_unit]
    gain = fit.value(lambda x: x[1] / scale(x), "")
    ends = [None if end is None else end / factor for end in (gain.low, gain.high)]
    values["gain"] = Parameter(gain.value / factor, ends[0], ends[1], "1" if unit == "rad" else f"rad/{unit}")
    values["zero"] = fit.value(lambda x: x[2] / scale(x), "rad")
    gap = fit.value(lambda x: 2 * x[0] * abs(x[1] / scale(x)), "rad", least=0.0)
    if (said := _told(gap, values, "backlash")) is not None:
        missing["backlash"] = said
    return _Drive(fit.radius, fit.start, gain.value, values["zero"].value, fit.blocks)


def _no_stiffness(fit: PlayJoint, record: Record, angle: Floats, noise_rad: float, stiffness: Parameter) -> str | None:
    """Say why a record does not tell the stiffness of its drive; None if it does.

    Noise of the angle shrinks the stiffness by the share of its square in that of the angle's distance from the play of
    the drive, which is what the stiffness is seen by.
    """
    if stiffness.low is None or stiffness.low <= 0:
        return "the record does not tell it from a rigid drive"
    play = lagging_play(record.drive, np.ones_like(angle), fit.radius, 0.0, fit.start)
    columns = np.vstack([play, np.ones_like(play)]).T
    away = angle - columns @ np.linalg.lstsq(columns, angle, rcond=None)[0]
    seen = float(np.sqrt(np.mean(away**2)))
    if noise_rad <= MOST_NOISE * seen:
        return None
    return f"the drive gives way by {np.degrees(seen):.2g} deg rms, the noise is {np.degrees(noise_rad):.2g} deg"


def _prediction(
    record: Record, moment: Floats | None, spring: PlayJoint | None, drive: _Drive | None, values: dict[str, Parameter]
) -> tuple[Floats, tuple[float, float, float]]:  # fmt: skip
    """Give the loop of the joint in the file, rad, shape (m,), and axis, wheel and motor at the first sample.

    Behind a drive of stiffness K the axis is k (angle - angle_0) = P[K (wheel - angle)], that is
    (k + K) angle - k angle_0 = P[K wheel] with the lag d / (k + K).
    """
    if drive is None:
        assert spring is not None
        return spring.predicted, (float(spring.predicted[0]), 0.0, 0.0)
    radius = drive.radius if "backlash" in values else 0.0
    ones = np.ones_like(record.drive)
    wheel = drive.zero + drive.gain * lagging_play(record.drive, ones, radius, 0.0, drive.start)
    motor = float(drive.zero + drive.gain * record.drive[0])
    if spring is None or "drive_stiffness" not in values:
        return wheel, (float(wheel[0]), float(wheel[0]), motor)
    stiff, own = values["drive_stiffness"].value, values["stiffness"].value
    friction = values["frictionloss"].value if "frictionloss" in values else 0.0
    lag = (values["damping"].value if "damping" in values else 0.0) / (own + stiff)
    steps = ones if record.time_s is None else np.r_[1.0, np.diff(record.time_s)]
    load = stiff * wheel
    angle = (own * spring.zero + lagging_play(load, steps, friction, lag, spring.start)) / (own + stiff)
    return angle, (float(angle[0]), float(wheel[0]), motor)
