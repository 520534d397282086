"""Records of a rig that bends in two planes, where a model of one plane reads them."""

from __future__ import annotations

import numpy as np

from hysteresis.records.record import FIELDS, FURTHER_DRIVES, Record, RecordError

_OF_SPACE = ("angle_2", "torsion", "tension_c", "tension_d")


def require_one_wheel(record: Record) -> None:
    """Refuse a record in which a wheel beside the first one moves: one drive does not explain its angle.

    Raises
    ------
    RecordError
        One line with the file and the wheel.
    """
    for key in FURTHER_DRIVES:
        drive = getattr(record, key)
        if drive is not None and np.ptp(drive) > 0:
            found = f"{record.source or 'record'}: columns.{key}: this wheel moves"
            raise RecordError(
                f"{found}: expected a record in which the first wheel moves alone, for a model of one plane"
            )


def not_used(record: Record) -> str:
    """Name the columns that a model of one plane does not use; empty where there are none."""
    given = [key for key in _OF_SPACE if getattr(record, FIELDS[key]) is not None]
    where = record.source or "record"
    return f"{where}: {', '.join(given)}: not used: a model of one plane fits angle alone" if given else ""
