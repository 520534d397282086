"""Changes that are hidden in the records of a rig: their character is drawn first, their size is found after."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from hysteresis.records.record import Record
from validation.practice.hidden.labels import clock, delayed, drifted, leapt, lost, run_out, with_play

Rng = np.random.Generator

LARGEST_DELAY = 0.05
"""Of the duration of the shortest record."""
LARGEST_PLAY = 0.3
"""Over the range of the drive."""
LARGEST_LOSS = 0.3
"""Over the range of the drive, and of the angle for a leap."""
LARGEST_RUN_OUT = 0.1
"""Over the radius of the wheel: a wheel that runs out by more is not round, and the catalogue does not name it."""
REVOLUTIONS = (1.2, 3.0)
"""Of the wheel over the range of the drive: fewer are a curve."""
AT = (0.2, 0.8)
"""Instants of a loss or a leap, over the duration of a record."""


@dataclass(frozen=True)
class Change:
    """A change of a given size: its constants with units in the names, and the records that it makes of others."""

    numbers: Mapping[str, float]
    records: Callable[[Sequence[Record]], tuple[Record, ...]]


Sized = Callable[[float], Change]
"""A change of drawn character, from a size up to 1."""


def _of_each(numbers: Mapping[str, float], change: Callable[[Record], Record]) -> Change:
    return Change(numbers, lambda records: tuple(change(record) for record in records))


def _time_delay(records: Sequence[Record], rng: Rng) -> Sized:
    most = LARGEST_DELAY * min(float(clock(record)[-1]) for record in records)
    return lambda size: _of_each({"delay_s": most * size}, lambda record: delayed(record, most * size))


def _thermal_drift(records: Sequence[Record], rng: Rng) -> Sized:
    longest = max(float(clock(record)[-1]) for record in records)
    most = float(rng.choice([-1.0, 1.0])) * _angle_range(records) / longest
    return lambda size: _of_each({"deg_per_s": most * size}, lambda record: drifted(record, most * size))


def _wheel_eccentricity(records: Sequence[Record], rng: Rng) -> Sized:
    radius = _drive_range(records) / (2 * np.pi * float(np.exp(rng.uniform(*np.log(REVOLUTIONS)))))
    phase, unit = float(rng.uniform(-np.pi, np.pi)), records[0].drive_unit

    def at(size: float) -> Change:
        amplitude = LARGEST_RUN_OUT * radius * size
        numbers = {f"amplitude_{unit}": amplitude, f"radius_{unit}": radius, "phase_deg": float(np.degrees(phase))}
        return _of_each(numbers, lambda record: run_out(record, amplitude, radius, phase))

    return at


def _backlash(records: Sequence[Record], rng: Rng) -> Sized:
    most, unit = LARGEST_PLAY * _drive_range(records), records[0].drive_unit
    return lambda size: _of_each({f"width_{unit}": most * size}, lambda record: with_play(record, most * size))


def _lost_counts(records: Sequence[Record], rng: Rng) -> Sized:
    events, unit = _events(records, rng), records[0].drive_unit

    def at(size: float) -> Change:
        most = LARGEST_LOSS * _drive_range(records) * size
        return Change({f"loss_{unit}": most}, lambda given: _at_events(given, events, most, lost))

    return at


def _leap(records: Sequence[Record], rng: Rng) -> Sized:
    events = _events(records, rng)

    def at(size: float) -> Change:
        most = LARGEST_LOSS * _angle_range(records) * size
        return Change({"leap_deg": most}, lambda given: _at_events(given, events, most, leapt))

    return at


def _events(records: Sequence[Record], rng: Rng) -> list[tuple[float, float] | None]:
    """Instant and sign of the event of each record; about half of the records have one, at least one has."""
    hit = rng.permutation(len(records))[: int(rng.integers(1, max(2, (len(records) + 3) // 2)))]
    return [
        (float(rng.uniform(*AT)), float(rng.choice([-1.0, 1.0]))) if index in hit else None
        for index in range(len(records))
    ]


def _at_events(
    records: Sequence[Record],
    events: Sequence[tuple[float, float] | None],
    size: float,
    change: Callable[[Record, float, float], Record],
) -> tuple[Record, ...]:
    return tuple(
        record if event is None else change(record, event[0], event[1] * size)
        for record, event in zip(records, events, strict=True)
    )


def _drive_range(records: Sequence[Record]) -> float:
    return max(float(np.ptp(record.drive)) for record in records)


def _angle_range(records: Sequence[Record]) -> float:
    return max(float(np.ptp(record.angle_deg)) for record in records)


CHANGES: dict[str, Callable[[Sequence[Record], Rng], Sized]] = {
    "time_delay": _time_delay,
    "thermal_drift": _thermal_drift,
    "wheel_eccentricity": _wheel_eccentricity,
    "backlash": _backlash,
    "lost_counts": _lost_counts,
    "leap": _leap,
}
"""By the name of the effect."""
OUTSIDE = ("lost_counts", "leap")
"""Changes that are no effect of the catalogue: nothing new is to be named."""
