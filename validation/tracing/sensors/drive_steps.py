"""Error of the angle that the steps of the drive's sensor make: they round the drive that a model is given."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np

from hysteresis.arrays import Floats
from hysteresis.records.path import branches
from hysteresis.records.record import Record
from hysteresis.sensors.readings import reading_words
from validation.tracing.settings import MAD_TO_SIGMA, STEP_BRANCH_SAMPLES, STEPS_TOLD

_ON_A_STEP, _MOSTLY = 0.05, 0.95  # distance from a multiple of the step, over it; part of the samples
_TRIED = 10  # smallest distances of neighbouring values


def sensor_words(records: Sequence[Record], floor_deg: float) -> tuple[str, ...]:
    """Say which samples of a long record are used, which are no readings, and whether drive steps make the noise."""
    steps = max(drive_step_deg(record) for record in records)
    words = (f"the steps in which the drive is recorded make an error of {steps:.2g} deg",)
    left_out = (record.left_out for record in records if record.left_out)
    return (*left_out, *reading_words(records), *(words if steps > STEPS_TOLD * floor_deg else ()))


def drive_step_deg(record: Record) -> float:
    """Give the standard deviation of the error that rounding of the drive makes in the angle, deg.

    A step rounds with a standard deviation of 1/sqrt(12) of it. It counts as far as the drive itself shows it, in its
    third differences inside the branches between reversals: a drive that is commanded in equal steps is exact, and so
    may be a branch of few samples. The mean slope of the angle makes degrees of it. Zero under a tendon force, and
    where the drive's values are no multiples of one step.
    """
    drive = record.drive
    spans = float(np.ptp(drive)), float(np.ptp(record.angle_deg))
    levels = np.diff(np.unique(np.round(drive, 9)))
    if record.drive_unit == "N" or drive.size < 8 or levels.size == 0:
        return 0.0
    step = _step(drive, levels)
    if step is None:
        return 0.0
    inside = [drive[b][1:-1] for b in branches(drive) if b.stop - b.start >= STEP_BRANCH_SAMPLES]
    if not inside:
        return 0.0
    shown = MAD_TO_SIGMA * float(np.median(np.abs(np.concatenate([np.diff(d, 3) for d in inside])))) / math.sqrt(20)
    return min(step / math.sqrt(12), shown) * spans[1] / spans[0]


def _step(drive: Floats, levels: Floats) -> float | None:
    """Give the largest step of which the drive's values are multiples; None if there is none.

    Parameters
    ----------
    levels
        Distances of neighbouring values: a drive that moves by several steps a sample leaves most values out.
    """
    for step in np.unique(np.round(levels, 9))[:_TRIED][::-1].tolist():
        counts = (drive - drive[0]) / step
        if float(np.mean(np.abs(counts - np.round(counts)) < _ON_A_STEP)) >= _MOSTLY:
            return float(step)
    return None
