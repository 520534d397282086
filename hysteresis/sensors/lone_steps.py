"""A step between two samples that nothing before or after it is like: lost counts of the drive, a leap of the angle.

A motor moves on from sample to sample, and so does the angle. A single step several times as large as any other is no
motion. It is taken out where the record is then far nearer to a curve with play operators, which knows no step. The
first stroke, which starts from an unknown state, is left alone.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
from numpy.polynomial import chebyshev

from hysteresis.arrays import Floats
from hysteresis.laws.prandtl_ishlinskii import plays
from hysteresis.records.path import branches, first_stroke
from hysteresis.records.record import Record

PLAY_RADII = (0.005, 0.01, 0.02, 0.04, 0.07, 0.11, 0.16, 0.22, 0.3)
"""Radii of the plays over the range of the drive: as dense at small strokes as at large ones."""
LONE_STEP, LEAST_LONE_STEP, LONE_NEIGHBOURS = 3.0, 0.01, 4
"""Step between two samples over the largest other one from which it stands alone, and least one over the range of the
values; samples on either side whose median step is that of the motion."""
LONE_STEP_TAKES, LONE_CURVE_DEGREE = 0.7, 7
"""Error without a step over that with it, of a polynomial of this degree with play operators, below which the step is
taken out."""


@dataclass(frozen=True)
class LoneStep:
    """A step before a sample, in the unit of the values."""

    sample: int
    size: float

    def of_each(self, count: int) -> Floats:
        """Give what is off in each of ``count`` samples, shape (count,)."""
        return np.where(np.arange(count) >= self.sample, self.size, 0.0)


def lone_step(values: Floats) -> LoneStep | None:
    """Find a step that is several times as large as any other, shape (m,) -> its sample and size; None without one.

    Its size is what it exceeds the median of the steps about it by. Of fewer than 19 values none is found.
    """
    steps = np.diff(values)
    reach = LONE_NEIGHBOURS
    if steps.size <= 4 * reach + 1:  # of fewer, all may be near the largest
        return None
    windows = np.lib.stride_tricks.sliding_window_view(steps, 2 * reach + 1)
    excess = windows[:, reach] - np.median(np.delete(windows, reach, axis=1), axis=1)
    k = int(np.abs(excess).argmax())
    far = np.abs(np.arange(excess.size) - k) > reach
    others = max(float(np.abs(excess[far]).max()), float(np.abs(steps[np.r_[:reach, -reach:0]]).max()))
    size = float(excess[k])
    if abs(size) < max(LONE_STEP * others, LEAST_LONE_STEP * float(np.ptp(values))):
        return None
    return LoneStep(k + reach + 1, size)


def lost_counts(record: Record) -> LoneStep | None:
    """Find a step of the logged drive that the rig did not make; None without one, and under a tendon force.

    A motor that takes hold makes steps of its own: where none stands alone in the whole record, one may do so behind
    the first stroke.
    """
    if record.drive_unit == "N":
        return None
    step, turn = lone_step(record.drive), _first_turn(record)
    if step is None and (begin := first_stroke(record.drive).stop - 1) * 2 < record.drive.size:
        behind = lone_step(record.drive[begin:])
        step = behind and replace(behind, sample=begin + behind.sample)
    if step is None or step.sample <= turn:
        return None
    return step if _is_nearer(record, replace(record, drive=record.drive - step.of_each(record.drive.size))) else None


def leap_of_angle(record: Record) -> LoneStep | None:
    """Find a step of the angle that stays, while the drive makes none; None without one."""
    step = lone_step(record.angle_deg)
    if step is None or step.sample <= _first_turn(record):
        return None
    without = replace(record, angle_deg=record.angle_deg - step.of_each(record.drive.size))
    return step if _is_nearer(record, without) else None


def without_lost_counts(record: Record) -> tuple[Record, str]:
    """Give a record whose drive goes on where counts were lost, and words on it; empty where none were."""
    step = lost_counts(record)
    if step is None:
        return record, ""
    mended = replace(record, drive=record.drive - step.of_each(record.drive.size))
    when = f"sample {step.sample + 1}" if record.time_s is None else f"{record.time_s[step.sample]:.3g} s"
    return mended, (
        f"{Path(record.source).name or 'a record'}: the drive leaps by {step.size:.3g} {record.drive_unit} at {when}, "
        "between two samples, and the angle does not follow: counts that an encoder lost, or a drive that was set to "
        "another zero; it is taken out"
    )


def _first_turn(record: Record) -> int:
    """Sample of the first reversal; 0 where half of the record is before it."""
    turn = branches(record.drive)[0].stop - 1
    return turn if 2 * turn < record.drive.size else 0


def _is_nearer(record: Record, without: Record) -> bool:
    """Whether a record without a step is far nearer to a curve with play operators than with it."""
    start = _first_turn(record)
    return _misfit(without, start) < LONE_STEP_TAKES * _misfit(record, start)


def _misfit(record: Record, start: int) -> float:
    """Give the residual of a curve with plays whose widths depend on the position, from a sample on, deg rms."""
    x, span = record.drive, float(np.ptp(record.drive))
    if span <= 0.0:
        return 0.0
    position = 2.0 * (x - x.min()) / span - 1.0
    loops = (plays(x, span * np.array(PLAY_RADII)).T - x[:, None]) / span
    curve = chebyshev.chebvander(position, LONE_CURVE_DEGREE)
    columns = np.column_stack([curve, loops, loops * position[:, None]])[start:]
    angle = record.angle_deg[start:]
    found = np.linalg.lstsq(columns, angle, rcond=1e-8)[0]
    return float(np.sqrt(np.mean((columns @ found - angle) ** 2)))
