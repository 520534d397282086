"""What the analytic model makes of a record's drive, to tell records in another unit than that of their rig."""

from __future__ import annotations

import math

import numpy as np

from fem_models.analytic.kinematics import theory_curve
from fem_models.rig import RigError
from fem_models.rig.of_record import rig_of
from fem_models.rig.rig import Rig
from hysteresis.records.record import Record
from hysteresis.sensors.readings import cleaned

_UNIT = 20.0  # factor between the two that is one of units: 57.3 of radians


def angle_range_of_rig(rig: Rig | None, record: Record) -> tuple[float, float] | None:
    """Range of the angle of a rig without friction over a record's drive, deg; None where it cannot follow it."""
    if rig is None or record.drive_unit != "mm":
        return None
    drive = np.linspace(record.drive.min(), record.drive.max(), 41)
    try:
        angle = theory_curve(rig, drive).angle_deg
    except (RigError, ValueError):  # the rig cannot follow this drive, which is said elsewhere
        return None
    return float(angle.min()), float(angle.max())


def unit_words(record: Record) -> str | None:
    """Say that an angle covers far more, or far less, than its rig makes of the drive; None where it does not.

    Readings that a sensor lost do not count.

    Raises
    ------
    RigError
        As :func:`fem_models.rig.of_record.rig_of`.
    """
    model = angle_range_of_rig(rig_of(record), record)
    record = cleaned(record).record
    mine, its = float(np.ptp(record.angle_deg)), 0.0 if model is None else math.dist([model[1]], [model[0]])
    if its == 0.0 or its / _UNIT <= mine <= its * _UNIT:
        return None
    return (
        f"{record.source or 'record'}: the angle covers {mine:.3g} deg, and {its:.3g} deg by its rig: expected degrees "
        "and mm; `notchbend record new` converts units (--angle-unit, --drive-unit)"
    )
