"""Changes of a record's labels that are what a rig with an effect, or a sensor with a fault, would have logged.

No angle is computed by a model. The angle that was measured stays; what was logged beside it changes, or a known amount
is added to it.
"""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np

from hysteresis.arrays import Floats
from hysteresis.records.path import branches
from hysteresis.records.record import Record, RecordError

STEADY = 0.002
"""Part of the drive's range: a smaller motion back is noise of the drive, not a reversal."""
MOST_ROWS = 60
"""Samples that a drive takes to cross a play at most."""
CONVERGED = 1e-13
_PER_SAMPLE = ("drive", "angle_deg", "time_s", "cycle", "tension_a_N", "tension_b_N", "notches_deg", "tip_mm")
_OF_DRIVE = ("drive", "tension_a_N", "tension_b_N")
"""Channels that share the clock of the drive, where the angle comes late."""


def clock(record: Record) -> Floats:
    """Time from the first sample, s, shape (m,); a record without times cannot have a change in time."""
    if record.time_s is None:
        raise RecordError(f"{record.source or record.title}: no times: expected a record with times")
    return record.time_s - record.time_s[0]


def delayed(record: Record, delay_s: float) -> Record:
    """Record whose angle comes late: the angle of an instant is logged beside the drive of ``delay_s`` after it.

    The drive is interpolated, which is smooth, and not the angle, whose noise stays as it was. Samples at the end for
    which there is no later drive are left out.
    """
    time = clock(record)
    kept = np.flatnonzero(time + delay_s <= time[-1])
    late: dict[str, Any] = {
        name: np.interp(time[kept] + delay_s, time, getattr(record, name))
        for name in _OF_DRIVE
        if getattr(record, name) is not None
    }
    rest = {name: column[kept] for name, column in _columns(record).items() if name not in late}
    return replace(record, **late, **rest)


def drifted(record: Record, deg_per_s: float) -> Record:
    """Record whose zero drifts steadily from its first sample on."""
    return replace(record, angle_deg=record.angle_deg + deg_per_s * clock(record))


def lost(record: Record, at: float, counts: float) -> Record:
    """Record whose drive is off by a constant from one instant on; ``at`` is a part of its samples."""
    after = np.arange(record.drive.size) >= at * record.drive.size
    return replace(record, drive=record.drive + counts * after)


def leapt(record: Record, at: float, leap_deg: float) -> Record:
    """Record whose angle leaps once, as if the camera had been moved; ``at`` is a part of its samples."""
    after = np.arange(record.drive.size) >= at * record.drive.size
    return replace(record, angle_deg=record.angle_deg + leap_deg * after)


def run_out(record: Record, amplitude: float, radius: float, phase_rad: float) -> Record:
    """Record of a wheel that runs out: it is logged as x, and winds x + e [sin(x/R + p) - sin p].

    The tendon moved by what was logged, d. So the drive becomes the x that winds d, by Newton's method.

    Raises
    ------
    ValueError
        Unless |e| < R, where x is not unique.
    """
    if not abs(amplitude) < radius:
        raise ValueError(f"run-out {amplitude:g} at a radius of {radius:g}: expected less than the radius")
    moved = record.drive
    x = moved.copy()
    for _ in range(100):
        error = x + amplitude * (np.sin(x / radius + phase_rad) - np.sin(phase_rad)) - moved
        x = x - error / (1.0 + amplitude / radius * np.cos(x / radius + phase_rad))
        if np.abs(error).max() <= CONVERGED * max(1.0, float(np.abs(moved).max())):
            return replace(record, drive=x)
    raise ValueError(f"run-out {amplitude:g} at a radius of {radius:g}: the drive was not found")


def with_play(record: Record, width: float) -> Record:
    """Record of a rig behind a play: the drive is ahead by half the width, and crosses it at reversals.

    While it crosses, the angle and the time of the rig stand still: samples are put in, at the pace of the drive, and
    later samples come later by as much. The play starts in its middle.
    """
    drive = record.drive
    step = float(np.median(np.abs(np.diff(drive))[np.diff(drive) != 0]))
    rows = int(np.clip(np.ceil(width / step), 2, MOST_ROWS))
    interval = 0.0 if record.time_s is None else float(np.median(np.diff(record.time_s)))
    parts = branches(drive, tolerance=STEADY * float(np.ptp(drive)))
    signs = [float(np.sign(drive[part.stop - 1] - drive[part.start])) or 1.0 for part in parts]
    chosen, shift, start = [], [], 0
    ahead = 0.0  # of the drive, over half the width
    for part, sign in zip(parts, signs, strict=True):
        crossing = np.linspace(ahead, sign, rows + 1)[1:-1]
        chosen += [np.full(crossing.size, max(start - 1, 0)), np.arange(start, part.stop)]
        shift += [crossing, np.full(part.stop - start, sign)]
        ahead, start = sign, part.stop
    index, offset = np.concatenate(chosen), np.concatenate(shift)
    columns = {name: column[index] for name, column in _columns(record).items()}
    columns["drive"] = columns["drive"] + 0.5 * width * offset
    if record.time_s is not None:
        put_in = np.cumsum(np.diff(index, prepend=index[0] - 1) == 0)
        columns["time_s"] = columns["time_s"] + interval * put_in
    return replace(record, **columns)


def _columns(record: Record) -> dict[str, Any]:
    return {name: getattr(record, name) for name in _PER_SAMPLE if getattr(record, name) is not None}
