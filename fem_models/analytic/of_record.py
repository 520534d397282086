"""What the analytic model makes of a record's drive, to tell records in another unit than that of their rig."""

from __future__ import annotations

import math

import numpy as np

from fem_models.analytic.kinematics import theory_curve
from fem_models.rig import RigError
from fem_models.rig.of_record import rig_of
from fem_models.rig.rig import Rig
from hysteresis.records.record import Record, RecordError
from hysteresis.sensors.readings import cleaned

_UNIT = 20.0  # factor between the two that is one of units: 57.3 of radians
_RADIANS, _ALIKE = math.degrees(1.0), 1.6  # factor of radians, and how far the rig's range may be from it
_FOLLOWS = 0.9  # correlation of the angle with the drive, of a rig that moves all along


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
    mine, its = _ranges(record)
    if its == 0.0 or its / _UNIT <= mine <= its * _UNIT:
        return None
    return _unit_words(record, mine, its)


def require_the_rigs_unit(record: Record) -> None:
    """Refuse an angle that covers far more than its rig makes of the drive, and one in radians.

    An angle that covers far less is in radians where it follows the drive all along, and is less by about their factor.
    Others may be those of a rig that is stuck, or within its play or slack.

    Raises
    ------
    RecordError
        One line with the record.
    RigError
        As :func:`fem_models.rig.of_record.rig_of`.
    """
    mine, its = _ranges(record)
    less = its / mine if mine > 0 else 1.0
    if its > 0 and (less < 1 / _UNIT or (_RADIANS / _ALIKE < less < _RADIANS * _ALIKE and _follows(record))):
        raise RecordError(_unit_words(record, mine, its))


def _follows(record: Record) -> bool:
    with np.errstate(invalid="ignore"):  # a constant angle
        return float(np.corrcoef(record.drive, cleaned(record).record.angle_deg)[0, 1]) > _FOLLOWS


def _ranges(record: Record) -> tuple[float, float]:
    """Ranges of a record's angle and of that of its rig, deg; 0 where there is none."""
    model = angle_range_of_rig(rig_of(record), record)
    its = 0.0 if model is None else math.dist([model[1]], [model[0]])
    return float(np.ptp(cleaned(record).record.angle_deg)), its


def _unit_words(record: Record, mine: float, its: float) -> str:
    return (
        f"{record.source or 'record'}: the angle covers {mine:.3g} deg, and {its:.3g} deg by its rig: expected degrees "
        "and mm; `notchbend record new` converts units (--angle-unit, --drive-unit)"
    )
