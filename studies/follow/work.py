"""The work of ``notchbend follow``: fit, chart, test for changes, name the cause, extrapolate to limits."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field

import numpy as np
from scipy.stats import t as student

from hysteresis import Fit, identify
from hysteresis.arrays import Floats
from hysteresis.drift import ChangePoint, DeviceState, change_points, control_chart, states_of, when_passed
from hysteresis.drift.changes import LEAST_RECORDS, column, usable_count
from hysteresis.drift.chart import WEIGHT, limit, run_length
from hysteresis.drift.states import Followed, followed_in
from hysteresis.fitting.settings import IdentifySettings
from hysteresis.fitting.uncertainty import Parameter
from hysteresis.records.record import Record, RecordError
from studies.follow.cause import ProgressWords, Shift, cause_of
from studies.follow.result import Axis, Change, ChartFacts, FollowedNumber, FollowReport, LimitPassed, NamedCause

FALSE_ALARM = 0.01
LEAST_REFERENCE = 3
REFERENCE_SHARE = 1 / 3
SOURCE = "EWMA, Roberts 1959; limits for estimated parameters by simulation, after Jones, Champ and Rigdon 2001"
_CLEAR = 0.05  # of the numbers of a change that is found, together


@dataclass(frozen=True)
class FollowSettings:
    """How a device is followed.

    Parameters
    ----------
    reference
        How many of the first records are the device as it should be; None for a third, at least three.
    false_alarm
        Probability that a device that has not changed is said to have, over all its records.
    limits
        Values of followed numbers, by name; the result estimates when each is passed.
    trace
        Whether the cause of a change is traced.
    threads
        Of the trace.
    identify
        Settings of the law of the first record.

    Raises
    ------
    ValueError
        A false alarm outside 0.0001 to 0.2.
    """

    reference: int | None = None
    false_alarm: float = FALSE_ALARM
    limits: Mapping[str, float] = field(default_factory=dict)
    trace: bool = True
    threads: int = 2
    identify: IdentifySettings = field(default_factory=IdentifySettings)

    def __post_init__(self) -> None:
        if not 1e-4 <= self.false_alarm <= 0.2:
            raise ValueError(f"false_alarm = {self.false_alarm:g}: expected 0.0001 to 0.2")

    def reference_of(self, count: int) -> int:
        """Give the number of reference records of so many.

        Raises
        ------
        RecordError
            Too few records, or a reference that leaves none.
        """
        if count < LEAST_RECORDS:
            raise RecordError(f"{count} records: expected at least {LEAST_RECORDS}, to tell a change from scatter")
        chosen = max(LEAST_REFERENCE, round(REFERENCE_SHARE * count)) if self.reference is None else self.reference
        if not LEAST_REFERENCE <= chosen <= count - 2:
            found = f"--reference-count {chosen}"
            raise RecordError(f"{found}: expected {LEAST_REFERENCE} to {count - 2} of {count} records")
        return chosen


def follow_loaded(
    records: Sequence[Record],
    axis: Axis,
    settings: FollowSettings,
    *,
    progress: ProgressWords | None = None,
) -> FollowReport:
    """Follow a device over its records, in their order.

    Parameters
    ----------
    records
        At least six, of one device with the same drive program, or nearly: what a number is depends on the strokes.
    axis
        Where they stand.
    settings
        See :class:`FollowSettings`.
    progress
        Told what is computed.

    Raises
    ------
    RecordError
        Records that cannot be compared, or an unknown name of a limit; one line.
    """
    tell = progress or (lambda words, done, expected: None)
    reference, followed = settings.reference_of(len(records)), followed_in(records)
    _require_known(settings.limits, followed)
    tell("the law of the first record", 0, len(records))
    fit = identify(records[0], settings=settings.identify)
    states = _states(fit, records, followed, tell)
    table = np.array([[state.parameters[one.name].value for one in followed] for state in states])
    each = 0.5 * settings.false_alarm / len(followed)
    numbers = tuple(_number(one, states, reference, each) for one in followed)
    moving = np.flatnonzero(np.ptp(table, axis=0) > 0)[: usable_count(len(records))]
    points = change_points(table[:, moving], 0.5 * settings.false_alarm)
    shifts = _shifts(table, points, followed)
    first, cause = _first(points, numbers), None
    if first is not None and settings.trace:
        tell("the cause of the change", len(records), len(records))
        old = records[: max(LEAST_REFERENCE, min([first, *(one.low for one in points)]))]
        standing = _standing(shifts, table, followed, reference)
        cause = cause_of(fit, standing, old, records, threads=settings.threads, progress=tell)
    changes = tuple(_change(k, points, axis, shifts[k]) for k in range(len(points)))
    passed = _all_passed(numbers, axis, points, settings)
    return FollowReport(
        schema=1,
        records=tuple(state.record for state in states),
        axis=axis,
        verdict="steady" if first is None else "changed",
        words=tuple(_words(axis, numbers, changes, cause, passed, settings.false_alarm)),
        law=fit.law_title,
        heldout_rmse_deg=fit.heldout.rmse_deg,
        parameters=numbers,
        chart=_facts(reference, len(records), each, len(followed)),
        changes=changes,
        cause=cause,
        limits=passed,
        seed=settings.identify.seed,
    )


def _all_passed(
    numbers: Sequence[FollowedNumber], axis: Axis, points: Sequence[ChangePoint], settings: FollowSettings
) -> tuple[LimitPassed, ...]:
    asked, seed = settings.limits, settings.identify.seed
    return tuple(_passed(one, axis, asked[one.name], points, seed) for one in numbers if one.name in asked)


def _states(
    fit: Fit, records: Sequence[Record], followed: Sequence[Followed], tell: ProgressWords
) -> list[DeviceState]:
    states = list[DeviceState]()
    for k, record in enumerate(records):
        tell("records", k, len(records))
        states += states_of(fit, [record], followed)
    return states


def _require_known(limits: Mapping[str, float], followed: Sequence[Followed]) -> None:
    names = [one.name for one in followed]
    for name in limits:
        if name not in names:
            raise RecordError(f"--limit {name}: not followed in these records: expected one of {', '.join(names)}")


def _number(one: Followed, states: Sequence[DeviceState], reference: int, false_alarm: float) -> FollowedNumber:
    found = [state.parameters[one.name] for state in states]
    values = np.array([parameter.value for parameter in found])
    chart = control_chart(values, reference, false_alarm)
    return FollowedNumber(
        name=one.name,
        unit=one.unit,
        words=one.words,
        values=tuple(values.tolist()),
        low=tuple(_end(parameter.low, parameter.value) for parameter in found),
        high=tuple(_end(parameter.high, parameter.value) for parameter in found),
        average=tuple(None if math.isnan(value) else value for value in chart.average.tolist()),
        chart_mean=chart.mean,
        chart_low=chart.low,
        chart_high=chart.high,
        alarm=None if chart.alarm is None else chart.alarm + 1,
    )


def _end(end: float | None, value: float) -> float:
    return value if end is None else end


def _first(points: Sequence[ChangePoint], numbers: Sequence[FollowedNumber]) -> int | None:
    """Give the first record that differs, from 0: of the changes, else of the alarms; None of a steady device."""
    alarms = [one.alarm - 1 for one in numbers if one.alarm is not None]
    found = [one.first for one in points] or alarms
    return min(found) if found else None


def _shifts(table: Floats, points: Sequence[ChangePoint], followed: Sequence[Followed]) -> list[dict[str, Parameter]]:
    """Give the changes of the numbers at each change point, by a regression on all of them: those that are clear."""
    n = len(table)
    if not points:
        return []
    columns = np.column_stack([np.ones(n), *(column(n, one.first, one.shape) for one in points)])
    within = np.linalg.pinv(columns.T @ columns)
    line = within @ columns.T @ table
    freedom = max(1, n - columns.shape[1])
    deviation = np.sqrt(((table - columns @ line) ** 2).sum(axis=0) / freedom)
    quantile = float(student.ppf(1 - 0.5 * _CLEAR / len(followed), freedom))
    usual = float(student.ppf(0.975, freedom))
    out = []
    for k in range(len(points)):
        size = float(columns[-1, k + 1])  # to the last record
        found = dict[str, Parameter]()
        for j, one in enumerate(followed):
            value, half = size * float(line[k + 1, j]), size * float(deviation[j] * math.sqrt(within[k + 1, k + 1]))
            if abs(value) > quantile * half:
                found[one.name] = Parameter(value, value - usual * half, value + usual * half, one.unit)
        out.append(found)
    return out


def _standing(
    shifts: Sequence[Mapping[str, Parameter]], table: Floats, followed: Sequence[Followed], reference: int
) -> list[Shift]:
    """Say how far each number has gone from the reference at the end, in standard deviations of the reference."""
    old, last = table[:reference], table[-min(3, len(table) - reference) :]
    deviation = np.maximum(old.std(axis=0, ddof=1), 1e-12)
    ratios = (last.mean(axis=0) - old.mean(axis=0)) / deviation
    clear = {name for found in shifts for name in found}
    return [Shift(one.name, float(ratio), one.name in clear) for one, ratio in zip(followed, ratios, strict=True)]


def _change(k: int, points: Sequence[ChangePoint], axis: Axis, found: Mapping[str, Parameter]) -> Change:
    one, at = points[k], axis.values
    return Change(
        first=one.first + 1,
        first_low=one.low + 1,
        first_high=one.high + 1,
        at=at[one.first],
        at_low=at[one.low],
        at_high=at[one.high],
        shape=one.shape,
        p=one.p,
        parameters=found,
    )


def _passed(
    number: FollowedNumber, axis: Axis, limit_of: float, changes: Sequence[ChangePoint], seed: int
) -> LimitPassed:
    """Extrapolate one number to its limit; a steady one has no time at which it passes."""
    at, values = np.array(axis.values), np.array(number.values)
    start = min((one.first for one in changes), default=None)
    found = when_passed(at, values, limit_of, start=start, seed=seed)
    drifts = number.alarm is not None or bool(changes)
    name, unit = number.name, "" if number.unit == "1" else f" {number.unit}"
    what = f"{name} = {limit_of:g}{unit}"
    if found.passed:
        words = f"{what} is passed already"
    elif found.at is None or not drifts:
        words = f"{what} is not passed before {axis.name} {found.horizon:.4g} as it goes now"
    else:
        high = "later than can be said" if found.high is None else f"{found.high:.4g}"
        words = f"{what} will be passed at {axis.name} {found.at:.4g} (95 %: {found.low:.4g} to {high}) as it goes now"
    shown = drifts and not found.passed
    return LimitPassed(
        name,
        limit_of,
        found.at if shown else None,
        found.low if shown else None,
        found.high if shown else None,
        found.passed,
        found.horizon,
        words,
    )


def _facts(reference: int, count: int, each: float, charts: int) -> ChartFacts:
    length = run_length(reference, count, each)
    together = length / charts  # of independent charts, each with a constant rate
    return ChartFacts(
        kind="EWMA",
        weight=WEIGHT,
        reference=reference,
        limit_deviations=limit(reference, count, each),
        false_alarm=each * charts,
        run_length=together if math.isfinite(together) else None,
        source=SOURCE,
    )


def _words(
    axis: Axis,
    numbers: Sequence[FollowedNumber],
    changes: Sequence[Change],
    cause: NamedCause | None,
    passed: Sequence[LimitPassed],
    false_alarm: float,
) -> list[str]:
    """Say in sentences what was found: the verdict first."""
    alarms = sorted((one.alarm, one.name) for one in numbers if one.alarm is not None)
    words = list[str]()
    if changes:
        one = min(changes, key=lambda change: change.first)
        how = "has been drifting since" if one.shape == "ramp" else "changed at"
        between = "" if one.at_low == one.at_high else f" (95 %: {one.at_low:g} to {one.at_high:g})"
        words.append(f"The device {how} {axis.name} {one.at:g}{between}.")
    elif alarms:
        words.append(
            f"The device has changed: {alarms[0][1]} is outside its limits since {axis.name} {_at(axis, alarms[0][0])}."
        )
    else:
        words.append(f"The device has not changed over {len(axis.values)} records, as far as they show.")
    if cause is not None:
        words.append(f"{'Cause' if cause.effects else 'Cause not named'}: {cause.words}.")
    for change in changes:
        moved = [f"{name} by {parameter}" for name, parameter in change.parameters.items()]
        if moved:
            words.append(f"Since {axis.name} {change.at:g} moved: {', '.join(moved)}.")
    for alarm, name in alarms:
        words.append(f"{name} left its control limits at {axis.name} {_at(axis, alarm)}.")
    words += [f"{one.words}." for one in passed]
    words.append(
        f"A device that has not changed would be said to have with a probability of {100 * false_alarm:g} %, if its "
        "records scatter independently."
    )
    return words


def _at(axis: Axis, number: int) -> str:
    return f"{axis.values[number - 1]:g}"
