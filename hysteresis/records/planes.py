"""Records of a rig that bends in two planes, where a model of one plane reads them."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from hysteresis.records.record import FIELDS, FURTHER_DRIVES, Record, RecordError

PULLED = 0.1
"""Range of a tension over that of the force that drives: a tendon with more is pulled, too."""
_OF_SPACE = ("angle_2", "torsion", "tension_c", "tension_d")


def require_one_wheel(record: Record) -> None:
    """Refuse a record in which another wheel than the first one moves: one drive does not explain its angle.

    Where the drive is a force, tendons c and d are the ones that must not be pulled; b may give way as a is pulled.

    Raises
    ------
    RecordError
        One line with the file and the wheel, or the tendon.
    """
    for key in FURTHER_DRIVES:
        drive = getattr(record, key)
        if drive is not None and np.ptp(drive) > 0:
            found = f"{record.source or 'record'}: columns.{key}: this wheel moves"
            raise RecordError(
                f"{found}: expected a record in which the first wheel moves alone, for a model of one plane"
            )
    for key in ("tension_c", "tension_d"):
        tension = getattr(record, FIELDS[key])
        if record.drive_unit == "N" and tension is not None and np.ptp(tension) > PULLED * np.ptp(record.drive):
            found = f"{record.source or 'record'}: columns.{key}: this tendon is pulled"
            raise RecordError(f"{found}: expected a record in which c and d are held, for a model of one plane")


def not_used(record: Record) -> str:
    """Name the columns that a model of one plane does not use; empty where there are none."""
    given = [key for key in _OF_SPACE if getattr(record, FIELDS[key]) is not None]
    where = record.source or "record"
    return f"{where}: {', '.join(given)}: not used: a model of one plane fits angle alone" if given else ""


def second_plane(record: Record) -> Record:
    """Give the second plane of a record as a record: second wheel, second angle, tendons c and d.

    Notches and tip belong to both planes and are left out.

    Raises
    ------
    RecordError
        A record without a second wheel or a second angle; another wheel that moves.
    """
    where = record.source or "record"
    for key in ("drive_2", "angle_2"):
        if getattr(record, FIELDS[key]) is None:
            raise RecordError(f"{where}: columns.{key}: missing: expected a record of a rig with a second plane")
    others = {"drive": record.drive, "drive_3": record.drive_3, "drive_4": record.drive_4}
    for key, drive in others.items():
        if drive is not None and np.ptp(drive) > 0:
            raise RecordError(f"{where}: columns.{key}: this wheel moves: expected the second wheel to move alone")
    assert record.drive_2 is not None
    assert record.angle_2_deg is not None
    return replace(
        record,
        notches_deg=None,
        tip_mm=None,
        tension_c_N=None,
        tension_d_N=None,
        kinematics=None,
        drive=record.drive_2,
        angle_deg=record.angle_2_deg,
        drive_2=record.drive,
        angle_2_deg=record.angle_deg,
        tension_a_N=record.tension_c_N,
        tension_b_N=record.tension_d_N,
        plane=2,
    )


@dataclass(frozen=True)
class Coupling:
    """What the other plane does while the wheel of one plane moves.

    ``share`` is the slope of the other angle over that of the plane (least squares), ``largest_deg`` the largest angle
    of the other plane, ``torsion_deg`` the largest torsion; NaN where it was not recorded.
    """

    record: str
    share: float
    largest_deg: float
    torsion_deg: float


def coupling(record: Record) -> Coupling | None:
    """Measure the coupling of a record in which one wheel moves; None without a second angle or without a motion."""
    if record.angle_2_deg is None:
        return None
    own, other = (angle - angle.mean() for angle in (record.angle_deg, record.angle_2_deg))
    if not own.any():
        return None
    torsion = float("nan") if record.torsion_deg is None else float(np.abs(record.torsion_deg).max())
    share, largest = float(own @ other / (own @ own)), float(np.abs(record.angle_2_deg).max())
    return Coupling(record.source or record.title, share, largest, torsion)
