"""Which samples of a record are readings of the angle: sensors repeat values, and lose some.

A logger that is faster than its sensor repeats each value until the next one. Only samples at which the value changes
tell the angle. A single value far from its neighbours on both sides, which agree without it, is a spike: a lost mark of
a camera. A leap is none, because it divides its neighbours; a kink is none, because it does, too. So are values as
999 or 0 that a logger writes for a few readings that it lost.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from hysteresis.arrays import Floats, Ints, Mask
from hysteresis.records.held import held_updates
from hysteresis.records.metrics import leap_between_cycles
from hysteresis.records.path import branches, cycle_index
from hysteresis.records.record import Record, RecordError
from hysteresis.records.wrapped import wraps
from hysteresis.sensors.lone_steps import leap_of_angle, without_lost_counts

SPIKE, SPIKE_APART = 8.0, 0.3
"""Least distance of a spike from its neighbours over its usual size, and largest distance of these neighbours from
theirs over that of the spike: of a leap it is 1, of a kink about one half."""
MOST_ALONE, ALIKE = 4, 0.5
"""Samples in a row that may be one spike, and the least of their distances over the largest: those of a kink differ,
but not where a logger wrote the same value for all. Several are as far off as lost readings are."""
MOST_SPIKES, LEAST_SPIKE_RECORD = 0.03, 40
"""Most spikes over a record's samples, those in a row counted once, and samples of a record in which they are looked
for."""
FAR, ABOUT, LEAST_FAR, MOST_FAR = 6.0, 8, 0.05, 0.1
"""Distance of a lost reading from the median of as many samples on either side, over the middle three fifths of their
range; least one over the range of nine tenths of the record; and the largest part of a record's samples that are lost.
The widest distance of noise is 10 times its sigma."""
LEAP = 2.0
"""Least step into or out of lost readings, over the step that three of four samples keep to."""
LEAST_HELD_ONCE = 3
"""Equal values in a row that are lost readings, where they are the only ones."""
UNORDERED = 0.15
"""Median step of the drive over its range from which rows are in no order."""
SHUFFLED, LEAST_SET_POINTS = 0.5, 10
"""Part of the rows at which the drive turns, and its different values, from which such rows are refused."""
MAD_TO_SIGMA = 1.4826
"""Standard deviation of a normal distribution over its median absolute deviation."""
TAKEN = "it is taken out"

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
        Samples that are spikes or lost.
    leap_deg
        What is taken out of the angle of each sample, shape (m,): a sudden leap; None without one.
    """

    read: Mask
    held: int = 1
    spikes: tuple[int, ...] = ()
    leap_deg: Floats | None = None


def readings_of(record: Record, seen: int | None = None) -> Readings:
    """Find the samples at which a record reads the angle; all of them where no sensor held or lost a value.

    Trials under a tendon force are taken as they are. A leap is looked for in the first ``seen`` samples only, so that
    no angle behind them takes part.
    """
    every = np.ones(record.angle_deg.size, dtype=bool)
    if record.drive_unit == "N":
        return Readings(every)
    lost = lost_readings(record.drive, record.angle_deg)
    record = _without(record, lost)
    updates = held_updates(record.drive, record.angle_deg)
    if updates is not None:
        held = round(float(np.median(np.diff(np.flatnonzero(updates)))))
        return Readings(updates & ~lost, held, _places(lost), sudden_leap(record, seen))
    spikes = isolated_spikes(record.angle_deg, record.time_s)
    spikes &= ~_driven(record.drive, spikes)
    spikes = lost | (spikes & (~_turns(record.drive) | _is_far_off(record, spikes)))
    return Readings(~spikes, spikes=_places(spikes), leap_deg=sudden_leap(_without(record, spikes), seen))


def _driven(drive: Floats, spikes: Mask) -> Mask:
    """Whether the drive itself is elsewhere for a moment than between its neighbours, shape (m,): no spike then."""
    off = np.abs(drive - filled(drive, ~spikes))
    usual = float(np.quantile(np.abs(np.diff(drive)), 0.75))
    turned = 0.51 * (MOST_ALONE + 1) * usual  # where the drive turns amid the longest spike
    return np.asarray(off > max(turned, 1e-9 * float(np.ptp(drive))))


def _without(record: Record, lost: Mask) -> Record:
    """Put samples between those about them; at a turning point of the drive, on from those before it."""
    if not lost.any():
        return record
    angle, drive = filled(record.angle_deg, ~lost), record.drive
    for k in np.flatnonzero(lost):
        before = k - 2 >= 0 and drive[k - 1] != drive[k - 2]
        last = k + 1 == lost.size
        if before and (last or (drive[k + 1] - drive[k]) * (drive[k] - drive[k - 1]) < 0):
            slope = (angle[k - 1] - angle[k - 2]) / (drive[k - 1] - drive[k - 2])
            angle[k] = angle[k - 1] + slope * (drive[k] - drive[k - 1])
    return replace(record, angle_deg=angle)


def _turns(drive: Floats) -> Mask:
    """Find the samples at which the drive turns, where the angle has a kink."""
    steps = np.diff(drive)
    return np.concatenate([[False], steps[1:] * steps[:-1] < 0, [False]])


def _is_far_off(record: Record, spikes: Mask) -> Mask:
    """Whether samples are as far off as lost readings from where they would be without spikes, shape (m,)."""
    low, high = np.quantile(record.angle_deg, [0.05, 0.95])
    off = np.abs(record.angle_deg - _without(record, spikes).angle_deg)
    return np.asarray(off > LEAST_FAR * (high - low))


def _places(samples: Mask) -> tuple[int, ...]:
    return tuple(int(i) for i in np.flatnonzero(samples))


@dataclass(frozen=True, eq=False)
class Cleaned:
    """A record without what its sensors added.

    Parameters
    ----------
    record
        Leaps of the angle and lost counts of the drive are taken out; samples that are no readings are filled in.
    read
        Which samples are readings, shape (m,).
    words
        What was found, one sentence each.
    """

    record: Record
    read: Mask
    words: tuple[str, ...]


def cleaned(record: Record, seen: int | None = None) -> Cleaned:
    """Take out of a record what a sensor added and no rig makes; the record itself where nothing was found.

    Of samples behind the first ``seen`` ones nothing but spikes is left out: they are held out of a fit.
    """
    mended, lost = without_lost_counts(record)
    readings = readings_of(mended, seen)
    words = (*([lost] if lost else []), *_order_words(record), *reading_words([mended], seen))
    if readings.read.all() and readings.leap_deg is None:
        return Cleaned(mended, readings.read, words)
    if readings.leap_deg is not None:
        mended = replace(mended, angle_deg=mended.angle_deg - readings.leap_deg)
    if readings.held > 1:
        mended = replace(mended, angle_deg=filled(mended.angle_deg, readings.read))
    return Cleaned(_without(mended, ~readings.read), readings.read, words)


def _order_words(record: Record) -> tuple[str, ...]:
    """Warn of rows that are in no order: each of them jumps across the drive's range, by a third on average."""
    steps = np.abs(np.diff(record.drive))
    if record.time_s is not None or steps.size < LEAST_SPIKE_RECORD:
        return ()
    if float(np.median(steps)) <= UNORDERED * float(np.ptp(record.drive)):
        return ()
    return ("the drive jumps across its range from row to row: expected rows in the order of time",)


def require_rows(record: Record) -> None:
    """Refuse rows in no order, and an angle that is wrapped at a turn: the path of neither is that of the rig.

    Raises
    ------
    RecordError
        One line with the record.
    """
    where = record.source or "record"
    if _is_shuffled(record):
        raise RecordError(f"{where}: {_order_words(record)[0]}, or a column of times (t_s)")
    at = wraps(record.drive, record.angle_deg)
    apart = np.diff(at, prepend=-MOST_ALONE - 1, append=record.drive.size + MOST_ALONE) > MOST_ALONE
    for i in at[apart[1:] & apart[:-1]][:1]:  # a reading that was lost jumps back
        leap = f"{record.angle_deg[i]:.6g} after {record.angle_deg[i - 1]:.6g}"
        raise RecordError(f"{where}: angle_deg = {leap}: wrapped at a turn: expected np.unwrap(angle_deg, period=360)")


def _is_shuffled(record: Record) -> bool:
    """Whether a drive turns at most rows: two of three where rows are in no order, few on stairs of any height."""
    if record.drive_unit == "N" or record.cycle is not None or not _order_words(record):
        return False
    steps = np.diff(record.drive)
    turns = float(np.mean(steps[1:] * steps[:-1] < 0))
    return turns > SHUFFLED and np.unique(record.drive).size >= LEAST_SET_POINTS


def sensor_notes(found: Sequence[Cleaned]) -> tuple[str, ...]:
    """Give the words of several records, each with its file where they are more than one."""
    notes = []
    for one in found:
        name = Path(one.record.source).name if len(found) > 1 else ""
        notes += [words if not name or words.startswith(name) else f"{name}: {words}" for words in one.words]
    return tuple(notes)


def sudden_leap(record: Record, seen: int | None = None) -> Floats | None:
    """Leap of the angle amid a cycle or between two samples, which no rig makes, shape (m,), deg; None without one."""
    part = _first(record, seen)
    leap = leap_between_cycles(part)
    if leap is None or not leap.sudden:
        lone = leap_of_angle(part)
        return None if lone is None else lone.of_each(record.angle_deg.size)
    return np.where(np.arange(record.angle_deg.size) >= leap.sample, leap.size_deg, 0.0)


def _first(record: Record, seen: int | None) -> Record:
    """Drive, angle, time and cycle of the first samples of a record."""
    if seen is None or seen >= record.drive.size:
        return record
    time_s = None if record.time_s is None else record.time_s[:seen]
    cycle = None if record.cycle is None else record.cycle[:seen]
    drive, angle = record.drive[:seen], record.angle_deg[:seen]
    return Record(drive, angle, record.drive_unit, time_s=time_s, cycle=cycle, source=record.source)


def reading_words(records: Sequence[Record], seen: int | None = None) -> tuple[str, ...]:
    """Say which samples are not taken as readings, and what is taken out; empty where all are as they should be."""
    found = [readings_of(record, seen) for record in records]
    held = [one.held for one in found if one.held > 1]
    spikes, samples = sum(len(one.spikes) for one in found), sum(one.read.size for one in found)
    words = []
    if held:
        slow = f"{held[0]}" if min(held) == max(held) else f"{min(held)} to {max(held)}"
        words.append(f"the sensor repeats its values for {slow} samples: only samples where they change are used")
    if spikes:
        words.append(f"{spikes} of {samples} angles are isolated spikes, which are left out")
    for i, (one, as_read) in enumerate(zip(found, records, strict=True)):
        if as_read.drive_unit != "N":
            record = _without(as_read, np.isin(np.arange(one.read.size), one.spikes))
            here = _leap_words(_first(record, seen), i)
            words.append(here or _leap_words(record, i).replace(TAKEN, "it stays, as held-out samples have it"))
    return tuple(word for word in words if word)


def _leap_words(record: Record, number: int) -> str:
    """Say where a record without spikes is off against its own earlier cycles; empty where it is not."""
    leap = leap_between_cycles(record)
    name = Path(record.source).name or f"record {number + 1}"
    if leap is None or not leap.sudden:
        lone = leap_of_angle(record)
        if lone is not None:
            when = f"sample {lone.sample + 1}" if record.time_s is None else f"{record.time_s[lone.sample]:.3g} s"
            return (
                f"{name}: the angle leaps by {lone.size:.2g} deg at {when}, between two samples, and stays off: a "
                f"sensor or a clamp that moved; {TAKEN}"
            )
    if leap is None:
        return ""
    when = f"sample {leap.sample + 1}" if record.time_s is None else f"{record.time_s[leap.sample]:.3g} s"
    out = TAKEN if leap.sudden else "repeatability leaves it out"
    return (
        f"{name} is off by {abs(leap.size_deg):.2g} deg from {when} on, against the same drive in its other cycles: a "
        f"leap of the sensor or a clamp, or lost counts; {out}"
    )


def lost_readings(drive: Floats, angle_deg: Floats) -> Mask:
    """Find the samples that are far from all about them, while the drive is not, shape (m,).

    Nothing is lost where so much is that the samples about it tell nothing.
    """
    if angle_deg.size < LEAST_SPIKE_RECORD:
        return np.zeros(angle_deg.size, dtype=bool)
    lost = _entered_by_a_leap(_far(angle_deg) & ~_far(drive) | _held_once(drive, angle_deg), angle_deg)
    return lost if lost.mean() <= MOST_FAR else np.zeros_like(lost)


def _held_once(drive: Floats, angle_deg: Floats) -> Mask:
    """Find equal values in a row while the drive moves one way, where no other value repeats, shape (m,)."""
    equal = (np.diff(angle_deg) == 0) & (np.diff(drive) != 0)
    edges = np.flatnonzero(np.diff(equal, prepend=False, append=False))
    held = np.zeros(angle_deg.size, dtype=bool)
    if edges.size == 2 and edges[1] - edges[0] >= LEAST_HELD_ONCE - 1:
        first, last = edges
        ways = np.sign(np.diff(drive[max(0, first - 1) : last + 2]))
        held[first : last + 1] = bool(np.all(ways == ways[0]))
    return held


def _entered_by_a_leap(lost: Mask, angle_deg: Floats) -> Mask:
    """Leave out runs of samples that begin and end by steps as the record has them: the tube moves on behind a rest."""
    steps = np.abs(np.diff(angle_deg, prepend=angle_deg[:1], append=angle_deg[-1:]))
    usual, out = LEAP * float(np.quantile(steps, 0.75)), lost.copy()
    edges = np.flatnonzero(np.diff(lost, prepend=False, append=False))
    for first, end in edges.reshape(-1, 2):
        out[first:end] = max(steps[first], steps[end]) > usual
    return out


def _far(values: Floats) -> Mask:
    count, width = values.size, 2 * ABOUT + 1
    first = np.clip(np.arange(count) - ABOUT, 0, count - width)
    about = first[:, None] + np.arange(width)
    others = np.sort(values[about[about != np.arange(count)[:, None]]].reshape(count, width - 1), axis=1)
    fifth = round((width - 1) / 5)
    middle = others[:, -1 - fifth] - others[:, fifth]
    low, high = np.quantile(values, [0.05, 0.95])
    return np.asarray(np.abs(values - np.median(others, axis=1)) > np.maximum(FAR * middle, LEAST_FAR * (high - low)))


def isolated_spikes(angle_deg: Floats, time_s: Floats | None) -> Mask:
    """Find samples that are spikes, shape (m,), up to :data:`MOST_ALONE` in a row, of one value or off by one amount.

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
    steps = np.diff(np.unique(np.round(angle_deg, 9)))
    least = float(np.quantile(steps, 0.1)) if steps.size else 0.0
    low, high = np.quantile(angle_deg, [0.05, 0.95])
    for count in range(1, MOST_ALONE + 1):
        k = np.arange(3, angle_deg.size - count - 2)
        off = [_off_cubic(t, angle_deg, k, (-2, -1, count, count + 1), j) for j in range(count)]
        before = _off_cubic(t, angle_deg, k, (-3, -2, count, count + 1), -1)
        after = _off_cubic(t, angle_deg, k, (-2, -1, count + 1, count + 2), count)
        nearest, farthest = np.min(np.abs(off), axis=0), np.max(np.abs(off), axis=0)
        between = (angle_deg[k] - angle_deg[k - 1]) * (angle_deg[k + count] - angle_deg[k]) >= 0.0  # as held values are
        of_one_value = (count > 1) & (np.ptp([angle_deg[k + j] for j in range(count)], axis=0) == 0.0) & ~between
        distance = np.where(of_one_value, farthest, nearest)
        size = max(MAD_TO_SIGMA * float(np.median(nearest)), least, LEAST_FAR * (high - low) / SPIKE * (count > 1))
        alone = np.maximum(np.abs(before), np.abs(after)) < SPIKE_APART * distance
        alike = (distance > ALIKE * farthest) & (np.abs(np.sum(np.sign(off), axis=0)) == count)
        for start in k[(distance > SPIKE * size) & alone & alike]:
            spikes[start : start + count] = True
    events = int(np.count_nonzero(spikes[1:] & ~spikes[:-1]))  # none begins at the first sample
    few = events <= MOST_SPIKES * spikes.size and spikes.mean() <= MOST_FAR
    return spikes if few else np.zeros_like(spikes)


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
