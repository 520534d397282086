"""Long records made short: of cycles that repeat each other some are used, and of their samples every so many.

Which cycles repeat is told by their drive: the same turning points, ends and duration. Of a run of such cycles the
first two, the last two and some in between are used. Then the angle of every cycle, as means over parts of the drive's
range in either direction, is compared with what lies on straight lines between the cycles used, and the cycle that is
farthest off is used, too, until none is off by more than its noise: a drift, a leap or one cycle that differs stays in
the record. Turning points of the drive, and the last sample of each cycle, are always used. Times and numbers of cycles
stay those of the whole record.
"""

from __future__ import annotations

from dataclasses import dataclass, fields, replace
from pathlib import Path
from typing import Any

import numpy as np

from hysteresis.arrays import Floats, Ints, Mask
from hysteresis.records.held import held_updates
from hysteresis.records.path import branches, cycle_index, turning_points
from hysteresis.records.record import FURTHER_DRIVES, Record

WHOLE = 20_000
"""Samples of a record up to which it is used as it is."""
KEPT = 12_000
"""Samples to which a longer record is thinned, about; turning points come on top."""
EVENLY = 8
"""Cycles of a run that repeats which are used, first and last among them; the second and the last but one are, too."""
LEAST_RUN = 3 * EVENLY
"""Cycles of a run that repeats from which some of them are left out."""
MOST_MORE = 30
"""Most cycles of a record that are used on top, because they differ from the others."""
ALIKE, AS_LONG = 0.02, 0.1
"""Largest differences of cycles that repeat: of their turning points, in ranges of the drive, and of their duration."""
OFF = 6.0
"""Standard deviations of the mean angle of a cycle by which one that differs is off."""
_PARTS = 4  # of the drive's range, in which the angles of a cycle are averaged
_LEAST_NOISE = 1e-6  # of the angle's range
_FAR = 3.0  # ranges of nine tenths of the angles from their median: a reading that was lost


@dataclass(frozen=True)
class _Used:
    """Cycles that are used, shape (K,), and how far the others are off the lines between them, deg."""

    cycles: Mask
    drift_deg: float
    off_deg: float


def thinned(record: Record) -> Record:
    """Give a record of more than :data:`WHOLE` samples with fewer of them, and words on that in ``left_out``.

    A shorter record is returned as it is. The time taken is linear in samples and in cycles.
    """
    if record.drive.size <= WHOLE:
        return record
    numbers = cycle_index(record)
    starts = np.concatenate([[0], np.flatnonzero(np.diff(numbers)) + 1])
    drives = [record.drive, *(one for one in (getattr(record, name) for name in FURTHER_DRIVES) if one is not None)]
    turns, small = np.zeros((2, record.drive.size), dtype=bool)
    for drive in drives:
        turns[[part.stop - 1 for part in branches(drive)]] = True
        small[turning_points(drive)] = True
    used = _used_cycles(record, drives, starts, turns)
    of_used = np.repeat(used.cycles, np.diff([*starts, record.drive.size]))
    every = max(1, round(int(of_used.sum()) / KEPT))
    kept = np.flatnonzero(of_used & _some(record, of_used, starts, turns | small, every))
    words = _words(record, numbers[starts], used, every, kept.size)
    return replace(_only(record, kept), cycle=numbers[kept], left_out=words)


def _used_cycles(record: Record, drives: list[Floats], starts: Ints, turns: Mask) -> _Used:
    """Choose the cycles; ``starts`` are their first samples, shape (K,)."""
    used, drift, off, more = np.zeros(starts.size, dtype=bool), 0.0, 0.0, MOST_MORE
    levels = _levels(record, starts, turns)
    for first, last in _runs(record, drives, starts, turns):
        count = last - first
        chosen = {*np.round(np.linspace(0, count - 1, EVENLY)).astype(int).tolist(), min(1, count - 1)}
        chosen.add(max(0, count - 2))
        own = levels[first:last]
        own = own[:, np.isfinite(own).all(axis=0)]
        if count < LEAST_RUN or own.shape[1] == 0:  # parts without samples show nothing
            chosen = set(range(count))
        if len(chosen) < count:
            noise = np.median(np.abs(np.diff(own, axis=0)), axis=0) * 1.4826 / np.sqrt(2.0)
            noise = np.maximum(noise, _LEAST_NOISE * np.ptp(record.angle_deg))
            while True:
                at = sorted(chosen)
                lines = np.array([np.interp(np.arange(count), at, column) for column in own[at].T]).T
                away = np.abs(own - lines)
                worst = int(np.argmax((away / noise).max(axis=1)))
                if more == 0 or float((away[worst] / noise).max()) <= OFF or worst in chosen:
                    break
                chosen.add(worst)
                more -= 1
            drift, off = max(drift, float(np.ptp(own[at], axis=0).max())), max(off, float(away.max()))
        used[first + np.array(sorted(chosen))] = True
    return _Used(used, drift, off)


def _runs(record: Record, drives: list[Floats], starts: Ints, turns: Mask) -> list[tuple[int, int]]:
    """Divide the cycles into runs that repeat each other, as numbers of their first one and of the one behind it."""
    stops = np.array([*starts[1:], record.drive.size])
    rows = [np.add.reduceat(turns.astype(float), starts)]  # as many turning points
    tolerances = [0.5]
    for drive in drives:
        near = ALIKE * float(np.ptp(drive))
        rows += [drive[np.maximum(starts - 1, 0)], drive[stops - 1]]
        rows += [np.minimum.reduceat(drive, starts), np.maximum.reduceat(drive, starts)]
        tolerances += [near] * 4
    time = np.arange(record.drive.size, dtype=float) if record.time_s is None else record.time_s
    rows.append(np.log(np.maximum(time[stops - 1] - time[np.maximum(starts - 1, 0)], 1e-12)))
    tolerances.append(AS_LONG)
    table, most = np.array(rows).T, np.array(tolerances)
    bounds, first = [0], table[0]
    for i, row in enumerate(table):
        if (np.abs(row - first) > most).any():
            bounds.append(i)
            first = row
    return list(zip(bounds, [*bounds[1:], len(table)], strict=True))


def _levels(record: Record, starts: Ints, turns: Mask) -> Floats:
    """Mean angles of each cycle in parts of the drive's range, rising and falling, shape (K, parts); NaN for none."""
    drive, angle, count = record.drive, record.angle_deg, starts.size
    ends = np.concatenate([[0], np.flatnonzero(turns)])
    rising = np.diff(drive[ends]) > 0
    up = np.repeat(rising, np.diff(ends))
    up = np.concatenate([np.repeat(up[:1], 1), up])  # a turning point belongs to the branch that it ends
    part = np.minimum((_PARTS * (drive - drive.min()) / max(float(np.ptp(drive)), 1e-300)).astype(int), _PARTS - 1)
    cycle = np.repeat(np.arange(count), np.diff([*starts, drive.size]))
    place = (cycle * 2 + up) * _PARTS + part
    low, middle, high = np.quantile(angle, [0.05, 0.5, 0.95])
    read = np.abs(angle - middle) <= _FAR * (high - low)
    samples = np.bincount(place, read, minlength=2 * _PARTS * count)
    sums = np.bincount(place, np.where(read, angle, 0.0), minlength=2 * _PARTS * count)
    means = np.full(samples.size, np.nan)
    np.divide(sums, samples, out=means, where=samples > 0)
    levels = means.reshape(count, 2 * _PARTS)
    return levels[:, np.isfinite(levels).any(axis=0)]


def _some(record: Record, used: Mask, starts: Ints, turns: Mask, every: int) -> Mask:
    """Mark every so many of the samples that are used, turning points, and first and last samples of cycles.

    Where a sensor is slower than its log, the sample is the next one that changes: the others are older than their
    drive. The steps of a coarse sensor are no such changes: at each it is half a step ahead of the angle.
    """
    if every == 1:
        return np.ones(used.size, dtype=bool)
    some = turns.copy()
    some[starts] = True
    some[starts[1:] - 1] = True
    some[-1] = True
    places = np.flatnonzero(used)[::every]
    updates = held_updates(record.drive, record.angle_deg)
    if updates is not None:
        changes = np.append(np.flatnonzero(updates), used.size - 1)
        places = changes[np.searchsorted(changes, places)]
    some[places] = True
    return some


def _only(record: Record, kept: Ints) -> Record:
    """Give a record of some of its samples; a jump between two of them is at the second."""
    size, changed = record.drive.size, dict[str, Any]()
    for one in fields(record):
        values = getattr(record, one.name)
        if isinstance(values, np.ndarray) and len(values) == size and one.name != "kinematics":
            changed[one.name] = values[kept]
    if record.jump is not None:
        before = np.concatenate([[0], np.cumsum(record.jump)])
        changed["jump"] = (np.diff(before[np.concatenate([[0], kept + 1])]) > 0).astype(np.int64)
    return replace(record, **changed)


def _words(record: Record, numbers: Ints, used: _Used, every: int, samples: int) -> str:
    name = f"{Path(record.source).name}: " if record.source else ""
    words = f"{name}{samples:,} of {record.drive.size:,} samples are used"
    if not used.cycles.all():
        words += (
            f": of {used.cycles.size:,} cycles, most of which repeat, {int(used.cycles.sum())} "
            f"({_ranges(numbers[used.cycles])}); at equal drive these differ by up to {used.drift_deg:.2g} deg, and "
            f"the others are within {used.off_deg:.2g} deg of the lines between them"
        )
    if every > 1:
        of = " of these" if not used.cycles.all() else ""
        words += f"{';' if of else ':'} every {every} samples{of}, and all turning points"
    return words


def _ranges(numbers: Ints) -> str:
    """Write numbers that increase as "0-3, 7, 10", at most a dozen ranges."""
    parts = np.split(numbers, np.flatnonzero(np.diff(numbers) > 1) + 1)
    texts = [f"{part[0]}-{part[-1]}" if part.size > 1 else f"{part[0]}" for part in parts]
    shown = texts if len(texts) <= 12 else [*texts[:6], "...", *texts[-5:]]
    return ", ".join(shown)
