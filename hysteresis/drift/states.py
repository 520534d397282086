"""What a device is like in each of its records: a few numbers beside the law that was identified at first.

The law theta = f(x) + h of the first records stays, and a record differs from it by

    theta = zero + gain f(x(t - lag)) + bow u^2 + flatness (u^3 - u) + h,

u being f + h from -1 to 1 over the range of the first records, with the saturation of h times a width, and its slope
after a reversal times a factor. The numbers are found by least squares from those of the first records, so a record
takes milliseconds. h at its first sample is free.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from scipy.optimize import least_squares

from hysteresis.arrays import Floats
from hysteresis.fitting.fit import Fit
from hysteresis.fitting.uncertainty import Parameter
from hysteresis.records.record import Record, RecordError

_QUANTILE = 1.96  # of 95 % intervals
_STEP = 1e-5  # of derivatives
_LEAST_STEPS = 3  # samples; a lag of less of them is not told from zero
_LONGEST_LAG = 0.1  # of the duration of a record over its number of strokes


@dataclass(frozen=True)
class Followed:
    """A number that is followed: name, unit, what it is, value of a device that has not changed, and bounds."""

    name: str
    unit: str
    words: str
    unchanged: float
    low: float
    high: float


ZERO = Followed("zero_deg", "deg", "offset of the angle", 0.0, -math.inf, math.inf)
GAIN = Followed("gain", "1", "angle for each unit of the drive, over that of the first records", 1.0, 0.3, 3.0)
WIDTH = Followed("width", "1", "width of a full loop, over that of the first records", 1.0, 0.02, 50.0)
SLOPE = Followed(
    "lost_after_reversal", "1", "part of the motion lost just after a reversal, over that at first", 1.0, 0.05, 20.0
)
LAG = Followed("lag_s", "s", "time by which the angle is late, beyond that of the first records", 0.0, -1.0, 1.0)
BOW = Followed("bow_deg", "deg", "both ends of the stroke move the same way", 0.0, -math.inf, math.inf)
FLATNESS = Followed("flatness_deg", "deg", "the curve is flatter in its middle", 0.0, -math.inf, math.inf)
TENSION = Followed("tension_N", "N", "mean tension of both tendons", 0.0, 0.0, math.inf)
LEFT = Followed("left_deg", "deg", "error that the law leaves, root mean square", 0.0, 0.0, math.inf)
PLAY = Followed("play", "1", "play before the drive, over half of the drive's range", 0.0, 0.0, 1.0)
DRAG = Followed("drag_s", "s", "time constant with which the angle follows the drive", 0.0, 0.0, 1.0)
SPEED = Followed("per_speed", "1", "part that grows with the speed of the drive", 0.0, -math.inf, math.inf)
"""Play, drag and a part by speed are not followed, since other numbers show them together; they stand for a cause."""
OF_THE_LAW = (ZERO, GAIN, WIDTH, SLOPE, LAG, BOW, FLATNESS)


@dataclass(frozen=True)
class DeviceState:
    """The device in one record: ``parameters`` with 95 % intervals by name, of the record alone."""

    record: str
    parameters: dict[str, Parameter]


def states_of(fit: Fit, records: Sequence[Record], followed: Sequence[Followed] = ()) -> list[DeviceState]:
    """Give the state of a device in each of its records.

    Parameters
    ----------
    fit
        Of the first records, without a delay.
    records
        Of the same drive unit.
    followed
        Which numbers; by default those that all of the records show (:func:`followed_in`).

    Raises
    ------
    RecordError
        Records of another drive unit, or whose drive goes beyond that of the first ones by more than half; a
        fit with a delay.
    """
    if fit.delay_s > 0:
        raise RecordError(f"{fit.records[0]}: delay_s = {fit.delay_s:g}: expected a fit without delay")
    followed = tuple(followed) or followed_in(records)
    low, high = fit.drive_range
    for record in records:
        name = record.source or record.title or "record"
        if record.drive_unit != fit.drive_unit:
            raise RecordError(f"{name}: drive in {record.drive_unit}: expected {fit.drive_unit}, as in the first one")
        reach, most = float(np.abs(record.drive - 0.5 * (low + high)).max()), 0.75 * (high - low)
        if reach > most:
            raise RecordError(f"{name}: drive to {reach:g} {fit.drive_unit}: expected up to {most:g}, as at first")
    return [_state(fit, record, followed) for record in records]


def followed_in(records: Sequence[Record]) -> tuple[Followed, ...]:
    """Say which numbers all records show: a lag those with times, a tension those with both tensions."""
    timed = all(record.time_s is not None for record in records)
    tensions = all(record.tension_a_N is not None and record.tension_b_N is not None for record in records)
    law = tuple(one for one in OF_THE_LAW if timed or one is not LAG)
    return (*law, *((TENSION,) if tensions else ()), LEFT)


def _state(fit: Fit, record: Record, followed: tuple[Followed, ...]) -> DeviceState:
    law = [one for one in followed if one in OF_THE_LAW]
    start = np.array([*(one.unchanged for one in law), 0.0])
    low, high = (np.array([*(getattr(one, side) for one in law), end]) for side, end in (("low", -1.0), ("high", 1.0)))
    if LAG in law and record.time_s is not None:
        most = longest_lag(record)
        low[law.index(LAG)], high[law.index(LAG)] = -most, most
    model = RecordModel(fit, record, tuple(one.name for one in law))
    found = least_squares(model.residual, start, bounds=(low, high), x_scale=model.scales(), diff_step=_STEP)
    error, jacobian = found.fun, found.jac
    deviation = _standard_deviations(error, jacobian)
    parameters = {
        one.name: Parameter(float(value), float(value - _QUANTILE * sd), float(value + _QUANTILE * sd), one.unit)
        for one, value, sd in zip(law, found.x, deviation, strict=False)
    }
    if TENSION in followed and record.tension_a_N is not None and record.tension_b_N is not None:
        parameters[TENSION.name] = _mean(0.5 * (record.tension_a_N + record.tension_b_N))
    left = float(np.sqrt(np.mean(error**2)))
    spread = _QUANTILE * left / math.sqrt(2.0 * _effective(error))
    parameters[LEFT.name] = Parameter(left, max(0.0, left - spread), left + spread, "deg")
    return DeviceState(record.source or record.title or "record", parameters)


@dataclass(frozen=True, eq=False)
class RecordModel:
    """The law with the numbers of one record; ``names`` are those that may differ."""

    fit: Fit
    record: Record
    names: tuple[str, ...]

    def residual(self, x: Floats) -> Floats:
        """Predicted less measured angle, shape (m,), deg."""
        value = dict(zip(self.names, x, strict=False))
        fit, record, path = self.fit, self.record, self.record.drive
        lag = value.get("lag_s", 0.0)
        if lag and record.time_s is not None:
            path = np.interp(record.time_s - lag, record.time_s, path)
        if value.get(PLAY.name):
            low, high = fit.drive_range
            path = _played(path, value[PLAY.name] * 0.5 * (high - low))
        if value.get(DRAG.name) and record.time_s is not None:
            path = _dragged(path, record.time_s, value[DRAG.name])
        f, (low, high) = fit.f(path), self._ends
        h = self._hysteresis(f, value, float(x[-1]))
        u = (f + h - 0.5 * (low + high)) / max(0.5 * (high - low), 1e-9)
        out = value["zero_deg"] + value.get("gain", 1.0) * f + value.get("bow_deg", 0.0) * u**2
        if value.get(SPEED.name) and record.time_s is not None:
            out = out + value[SPEED.name] * np.gradient(record.drive, record.time_s)
        return out + value.get("flatness_deg", 0.0) * (u**3 - u) + h - record.angle_deg

    @cached_property
    def _ends(self) -> tuple[float, float]:
        low, high = np.sort(self.fit.f(np.array(self.fit.drive_range)))
        return float(low), float(high)

    def _hysteresis(self, f: Floats, value: dict[str, float], start: float) -> Floats:
        fit = self.fit
        if not fit.point.sign:
            return np.zeros(f.size)
        q, size = fit.point.q.copy(), fit.form.base_law.size
        for i in range(fit.form.elements):
            q[size * i] += math.log(value.get("lost_after_reversal", 1.0))
            q[size * i + 1] += math.log(value.get("width", 1.0))
        q[fit.form.state(0)] = start
        return np.asarray(fit.form.hysteresis_along(f, np.array([fit.point.sign]), q[np.newaxis], 0)[0])

    def scales(self) -> Floats:
        """Typical changes of the numbers."""
        size = max(float(np.ptp(self.record.angle_deg)), 1e-6)
        typical = {one.name: 0.05 * size for one in (ZERO, BOW, FLATNESS, SPEED)} | {LAG.name: 0.05, DRAG.name: 0.05}
        return np.array([*(typical.get(name, 0.2) for name in self.names), 0.2])


def _played(drive: Floats, width: float) -> Floats:
    """Output of a play of a width, shape (m,), taken up at first in the direction in which the drive sets out."""
    out = np.empty(drive.size)
    moves = np.diff(drive)
    moves = moves[moves != 0.0]
    at = float(drive[0]) - (0.5 * width * float(np.sign(moves[0])) if moves.size else 0.0)
    for k, x in enumerate(drive.tolist()):
        at = min(max(at, x - 0.5 * width), x + 0.5 * width)
        out[k] = at
    return out


def _dragged(drive: Floats, time: Floats, constant_s: float) -> Floats:
    """Output of tau y' = x - y, from rest, shape (m,), exactly for a drive that is straight between samples."""
    out = np.empty(drive.size)
    out[0] = at = float(drive[0])
    for k in range(1, drive.size):
        step = float(time[k] - time[k - 1])
        slope = float(drive[k] - drive[k - 1]) / step if step > 0 else 0.0
        behind = slope * constant_s
        at = float(drive[k]) - behind + (at - float(drive[k - 1]) + behind) * math.exp(-max(step, 0.0) / constant_s)
        out[k] = at
    return out


def longest_lag(record: Record) -> float:
    """Give the longest lag that is fitted, s: a tenth of a stroke, at least three samples."""
    assert record.time_s is not None
    turns = np.flatnonzero(np.diff(np.sign(np.diff(record.drive))) != 0).size + 1
    steps = float(np.median(np.diff(record.time_s))) * _LEAST_STEPS
    return max(_LONGEST_LAG * float(np.ptp(record.time_s)) / turns, steps)


def _standard_deviations(error: Floats, jacobian: Floats) -> Floats:
    """Root of the diagonal of s^2 (J^T J)^-1 m / m_eff, shape (p,)."""
    size = np.maximum(np.linalg.norm(jacobian, axis=0), 1e-300)
    within = np.linalg.pinv((jacobian / size).T @ (jacobian / size), rcond=1e-12, hermitian=True) / np.outer(size, size)
    m, p = jacobian.shape
    variance = float(error @ error) / max(1, m - p) * m / _effective(error)
    return np.sqrt(np.maximum(np.diag(within), 0.0) * variance)


def _effective(error: Floats) -> float:
    """Count independent samples m (1 - r) / (1 + r), r the correlation of neighbours."""
    r = float(error[1:] @ error[:-1]) / max(float(error @ error), 1e-300)
    r = min(max(r, 0.0), 0.98)
    return max(4.0, error.size * (1.0 - r) / (1.0 + r))


def _mean(values: Floats) -> Parameter:
    """Mean of a channel; its noise is that of second differences."""
    noise = float(np.std(np.diff(values, 2))) / math.sqrt(6.0) if values.size > 3 else 0.0
    half = _QUANTILE * noise / math.sqrt(values.size)
    mean = float(values.mean())
    return Parameter(mean, mean - half, mean + half, "N")
