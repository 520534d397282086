"""Which samples of a record are readings of the angle: sensors repeat values, and lose some.

A logger that is faster than its sensor repeats each value until the next one. Only samples at which the value changes
tell the angle. A single value far from its neighbours on both sides, which agree without it, is a spike: a lost mark of
a camera. A leap is none, because it divides its neighbours; a kink is none, because it does, too.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from hysteresis.arrays import Floats, Ints, Mask
from hysteresis.records.metrics import leap_between_cycles
from hysteresis.records.path import branches, cycle_index
from hysteresis.records.record import Record
from validation.tracing.sensors.drive_steps import drive_step_deg
from validation.tracing.sensors.lone_steps import leap_of_angle
from validation.tracing.settings import (
    HELD_SHARE,
    HELD_STEP,
    LEAST_SPIKE_RECORD,
    MAD_TO_SIGMA,
    MOST_SPIKES,
    SPIKE,
    SPIKE_APART,
    STEPS_TOLD,
)

LEAPT = "a leap amid a cycle is no property of the rig: look at the sensor, the clamp and the encoder"
"""Reason not to say that nothing is missing."""


@dataclass(frozen=True, eq=False)
class Readings:
    """Which samples are readings.

    Parameters
    ----------
    read
        Shape (m,).
    held
        Samples for which a value is repeated, as a median; 1 where none is.
    spikes
        Number of spikes.
    leap_deg
        What is taken out of the angle of each sample, shape (m,): a sudden leap; None without one.
    """

    read: Mask
    held: int = 1
    spikes: int = 0
    leap_deg: Floats | None = None


def readings_of(record: Record) -> Readings:
    """Find the samples at which a record reads the angle; all of them where no sensor held or lost a value.

    Trials under a tendon force are taken as they are.
    """
    every = np.ones(record.angle_deg.size, dtype=bool)
    if record.drive_unit == "N":
        return Readings(every)
    leap_deg = sudden_leap(record)
    updates = held_updates(record.drive, record.angle_deg)
    if updates is not None:
        return Readings(updates, round(float(np.median(np.diff(np.flatnonzero(updates))))), leap_deg=leap_deg)
    spikes = isolated_spikes(record.angle_deg, record.time_s)
    return Readings(~spikes, spikes=int(spikes.sum()), leap_deg=leap_deg)


def sudden_leap(record: Record) -> Floats | None:
    """Leap of the angle amid a cycle or between two samples, which no rig makes, shape (m,), deg; None without one."""
    leap = leap_between_cycles(record)
    if leap is None or not leap.sudden:
        lone = leap_of_angle(record)
        return None if lone is None else lone.of_each(record.angle_deg.size)
    return np.where(np.arange(record.angle_deg.size) >= leap.sample, leap.size_deg, 0.0)


def sensor_words(records: Sequence[Record], floor_deg: float) -> tuple[str, ...]:
    """Say which samples are not taken as readings, and whether the drive's steps make most of a noise floor."""
    found = [readings_of(record) for record in records]
    held = [one.held for one in found if one.held > 1]
    spikes, samples = sum(one.spikes for one in found), sum(one.read.size for one in found)
    words = []
    if held:
        slow = f"{held[0]}" if min(held) == max(held) else f"{min(held)} to {max(held)}"
        words.append(f"the sensor repeats its values for {slow} samples: only samples where they change are used")
    if spikes:
        words.append(f"{spikes} of {samples} angles are isolated spikes, which are left out")
    words += [_leap_words(record, i) for i, record in enumerate(records) if record.drive_unit != "N"]
    steps = max(drive_step_deg(record) for record in records)
    if steps > STEPS_TOLD * floor_deg:
        words.append(f"the steps in which the drive is recorded make an error of {steps:.2g} deg")
    return tuple(word for word in words if word)


def _leap_words(record: Record, number: int) -> str:
    """Say where a record is off against its own earlier cycles; empty where it is not."""
    leap = leap_between_cycles(record)
    name = Path(record.source).name or f"record {number + 1}"
    if leap is None or not leap.sudden:
        lone = leap_of_angle(record)
        if lone is not None:
            when = f"sample {lone.sample + 1}" if record.time_s is None else f"{record.time_s[lone.sample]:.3g} s"
            return (
                f"{name}: the angle leaps by {lone.size:.2g} deg at {when}, between two samples, and stays off: a "
                "sensor or a clamp that moved; it is taken out"
            )
    if leap is None:
        return ""
    when = f"sample {leap.sample + 1}" if record.time_s is None else f"{record.time_s[leap.sample]:.3g} s"
    out = "it is taken out" if leap.sudden else "repeatability leaves it out"
    return (
        f"{name} is off by {abs(leap.size_deg):.2g} deg from {when} on, against the same drive in its other cycles: a "
        f"leap of the sensor or a clamp, or lost counts; {out}"
    )


def held_updates(drive: Floats, angle_deg: Floats) -> Mask | None:
    """Find the samples at which a held value changes, shape (m,); None where values are not held.

    Held are values most of which are equal to the one before while the drive moves, and which change by several of
    the sensor's steps: a coarse sensor also repeats its values, but it then goes on by one step.
    """
    change = np.abs(np.diff(angle_deg))
    moves = np.diff(drive) != 0
    leaps = change[change > 0]
    if not moves.any() or leaps.size == 0 or float(np.mean(change[moves] == 0)) < HELD_SHARE:
        return None
    steps = np.diff(np.unique(np.round(angle_deg, 9)))
    if float(np.median(leaps)) < HELD_STEP * float(np.quantile(steps, 0.1)):
        return None
    return np.concatenate([[False], change > 0])  # the first value may be older than the record


def isolated_spikes(angle_deg: Floats, time_s: Floats | None) -> Mask:
    """Find the samples that are spikes, shape (m,).

    A sample is compared with the cubic through two neighbours on either side (Hampel's rule with a cubic in place of
    the median, Hampel 1974, doi 10.1080/01621459.1974.10482962), and its two nearest neighbours with the cubic through
    theirs, without it. Nothing is a spike where there are so many of them that they are the sensor's noise.
    """
    spikes = np.zeros(angle_deg.size, dtype=bool)
    if angle_deg.size < LEAST_SPIKE_RECORD:
        return spikes
    t = np.arange(angle_deg.size, dtype=float) if time_s is None else time_s
    if np.any(np.diff(t) <= 0):
        return spikes
    k = np.arange(3, angle_deg.size - 3)
    off = _off_cubic(t, angle_deg, k, (-2, -1, 1, 2), 0)
    before = _off_cubic(t, angle_deg, k, (-3, -2, 1, 2), -1)
    after = _off_cubic(t, angle_deg, k, (-2, -1, 2, 3), 1)
    steps = np.diff(np.unique(np.round(angle_deg, 9)))
    least = float(np.quantile(steps, 0.1)) if steps.size else 0.0
    size = max(MAD_TO_SIGMA * float(np.median(np.abs(off))), least)
    alone = np.maximum(np.abs(before), np.abs(after)) < SPIKE_APART * np.abs(off)
    spikes[k] = (np.abs(off) > SPIKE * size) & alone
    return spikes if 0 < spikes.mean() <= MOST_SPIKES else np.zeros_like(spikes)


def _off_cubic(t: Floats, y: Floats, k: Ints, at: tuple[int, ...], where: int) -> Floats:
    """Deviation of samples ``k + where`` from the cubic through the samples ``k + at`` (Lagrange), shape (n,)."""
    x, value = t[k + where], np.zeros(k.size)
    for i in at:
        weight = np.ones(k.size)
        for j in at:
            if j != i:
                weight *= (x - t[k + j]) / (t[k + i] - t[k + j])
        value += weight * y[k + i]
    return np.asarray(y[k + where] - value)


def kept_readings(record: Record, readings: Readings, kept: Ints) -> Ints:
    """Choose the readings of a sensor that holds its values, in place of samples chosen evenly.

    All turning points and first samples of cycles stay, which the drive's path needs: they need not be readings.

    Parameters
    ----------
    kept
        Indices that were chosen, shape (n,); what is returned begins and ends with the same ones.
    """
    first, last = int(kept[0]), int(kept[-1])
    updates = np.flatnonzero(readings.read)
    updates = updates[(updates >= first) & (updates <= last)]
    updates = updates[:: max(1, -(-updates.size // kept.size))]
    turns = [branch.stop - 1 for branch in branches(record.drive)]
    path = np.concatenate([[first, last], turns, np.flatnonzero(np.diff(cycle_index(record))) + 1]).astype(np.intp)
    return np.unique(np.concatenate([updates, path[(path >= first) & (path <= last)]]))


def filled(values: Floats, read: Mask) -> Floats:
    """Values between readings from the readings on either side, shape (m,): they add nothing of their own."""
    if read.all() or not read.any():
        return values
    k = np.arange(values.size)
    return np.where(read, values, np.interp(k, k[read], values[read]))
