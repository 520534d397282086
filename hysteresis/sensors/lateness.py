"""An angle that is read later than the drive: after the drive reverses, it goes on.

Whatever does not depend on time stands still or turns back with the drive: friction, plays, elastic tendons, the
metal. Without times nothing tells how late an angle is, and a lag looks like a wide loop.
"""

from __future__ import annotations

from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from hysteresis.records.metrics import noise_floor
from hysteresis.records.path import branches
from hysteresis.records.record import Record
from hysteresis.sensors.readings import cleaned

GOES_ON, OVER_NOISE, AT_LEAST_OF = 0.02, 4.0, 0.75
"""Least motion after a reversal over that of the stroke before it, and over the noise; least part of the reversals."""
LEAST_STROKE, LEAST_REVERSALS = 6, 2
"""Samples of a stroke, and reversals between such strokes, of which the lateness is told."""


@dataclass(frozen=True)
class Late:
    """How long an angle goes on after the drive reverses, medians over the reversals: readings, and deg."""

    samples: int
    angle_deg: float


def lateness(record: Record) -> Late | None:
    """Tell how late the angle of a record without times is; None where it turns back with the drive.

    Trials under a tendon force and records of few reversals tell nothing.
    """
    if record.time_s is not None or record.drive_unit == "N":
        return None
    found = cleaned(record)
    drive, angle = found.record.drive[found.read], found.record.angle_deg[found.read]
    strokes = [one for one in branches(drive) if one.stop - one.start >= LEAST_STROKE]
    turns = [(one, other) for one, other in pairwise(strokes) if other.start == one.stop - 1]
    if len(turns) < LEAST_REVERSALS:
        return None
    least_deg = OVER_NOISE * noise_floor(found.record)
    late = list[Late]()
    for before, after in turns:
        moved = float(angle[before.stop - 1] - angle[before.start])
        held = int(np.argmax(drive[after] != drive[after.start])) - 1  # rests at the end, or an encoder's step
        beyond = np.sign(moved) * (angle[after.start + held : after.stop] - angle[after.start + held])
        last = int(np.argmax(beyond))
        if beyond[last] > max(least_deg, GOES_ON * abs(moved)):
            late.append(Late(last, float(beyond[last])))
    if len(late) < AT_LEAST_OF * len(turns):
        return None
    return Late(int(np.median([one.samples for one in late])), float(np.median([one.angle_deg for one in late])))


def late_words(record: Record) -> str | None:
    """Say that an angle goes on after its drive reverses; None where it does not."""
    late = lateness(record)
    if late is None:
        return None
    samples = "1 sample" if late.samples == 1 else f"{late.samples} samples"
    return f"the angle goes on for {samples} after the drive reverses, by {late.angle_deg:.2g} deg: it is read late"
