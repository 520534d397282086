"""A record out of a table in memory, such as a DataFrame of pandas or polars, and back."""

from __future__ import annotations

import re
from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any, Union

import numpy as np

from hysteresis.arrays import Floats
from hysteresis.messages import listed, quoted
from hysteresis.records.record import FIELDS, FURTHER_DRIVES, KINDS, LIST_FIELDS, DriveUnit, Record, RecordError
from hysteresis.records.record_file import read_record
from hysteresis.records.wrapped import wraps

if TYPE_CHECKING:
    import pandas as pd

RecordLike = Union["Record", Path, str, "pd.DataFrame"]
"""What a function that takes a record takes: a record, the path of its CSV, or a DataFrame with the columns of one."""
DRIVES: dict[str, DriveUnit] = {
    "drive_mm": "mm",
    "drive_deg": "deg",
    "drive_step": "step",
    "tendon_force_N": "N",
    "force_N": "N",
    "drive_N": "N",
}
"""Columns of a table in memory that are the drive, the first of them that is there, with their unit."""
TABLES = ("rig", "tube", "notch")
"""Tables of a sidecar that a DataFrame has in its ``attrs``."""


def as_record(what: RecordLike, name: str = "record") -> Record:
    """Give a record as it is, read it from the path of its CSV, or make it of a DataFrame.

    Raises
    ------
    RecordError
        As :func:`hysteresis.read_record` and :func:`record_of_frame`.
    TypeError
        Something else.
    """
    if isinstance(what, Record):
        return what
    if isinstance(what, str | Path):
        return read_record(what)
    if is_frame(what):
        return record_of_frame(what)
    raise TypeError(f"{name} = {quoted(what, 40)}: expected a Record, the path of a CSV, or a DataFrame")


def is_frame(what: object) -> bool:
    """Tell whether something is a table with named columns, as of pandas or polars."""
    return hasattr(what, "columns") and hasattr(what, "__getitem__") and hasattr(what, "__len__")


def record_of_frame(frame: Any) -> Record:
    """Make a record of a DataFrame with the columns of its CSV: ``drive_mm``, ``angle_deg``, perhaps ``time_s`` ...

    The drive may be ``drive_deg``, ``drive_step`` or ``force_N`` in place of ``drive_mm``. Title, kind and the tables
    of the rig are those of ``frame.attrs``, as :meth:`Record.to_dataframe` puts them there; the index is not read.

    Raises
    ------
    RecordError
        One line with the column, the row, the value and what was expected.
    """
    names = [str(name) for name in frame.columns]
    drive = next((name for name in DRIVES if name in names), None)
    if drive is None or "angle_deg" not in names:
        missing = "drive_mm" if drive is None else "angle_deg"
        found = f"DataFrame: column {missing!r} missing: the columns are {listed(names)}"
        raise RecordError(f"{found}: expected drive_mm (or drive_deg, drive_step, force_N) and angle_deg")
    wanted = {field: field for key, field in FIELDS.items() if key not in ("drive", "force", *FURTHER_DRIVES)}
    wanted |= {"drive": drive} | {key: f"{key}_{DRIVES[drive]}" for key in FURTHER_DRIVES}
    values: dict[str, Any] = {field: _column(frame, name, names) for field, name in wanted.items() if name in names}
    notches = sorted(
        (n for n in names if re.fullmatch(r"notch_[1-9]\d{0,5}_deg", n)), key=lambda n: int(n.split("_")[1])
    )
    tip = [name for name in ("tip_x_mm", "tip_y_mm", "tip_z_mm") if name in names]
    for key, group in (("notches", notches), ("tip", tip if len(tip) > 1 else [])):
        if group:
            values[LIST_FIELDS[key]] = np.column_stack([_column(frame, name, names) for name in group])
    attrs = getattr(frame, "attrs", None)
    known: Mapping[str, Any] = attrs if isinstance(attrs, Mapping) else {}
    tables = {name: known[name] for name in TABLES if isinstance(known.get(name), Mapping)}
    title = known.get("title", "")
    record = Record(
        **values,
        drive_unit=DRIVES[drive],
        title=title if isinstance(title, str) else "",
        kind=known["kind"] if known.get("kind") in KINDS else "measured",
        **tables,
        drive_column=drive,
    )
    for i in wraps(record.drive, record.angle_deg)[:1] if record.kind == "measured" else ():
        found = f"angle_deg = {record.angle_deg[i]:.6g} after {record.angle_deg[i - 1]:.6g}: wrapped at a turn"
        raise RecordError(f"DataFrame: row {i}: {found}: expected np.unwrap(angle_deg, period=360)")
    return record


def _column(frame: Any, name: str, names: list[str]) -> Floats:
    if names.count(name) > 1:
        raise RecordError(f"DataFrame: column {quoted(name)} occurs twice: expected different names")
    kind = str(getattr(frame[name], "dtype", ""))
    try:
        if kind.lower().startswith(("datetime", "timedelta", "date", "duration", "time", "period")):
            raise TypeError
        values = np.asarray(frame[name], dtype=float)
    except (TypeError, ValueError):
        raise RecordError(f"DataFrame: column {quoted(name)}: {kind}: expected numbers in every row") from None
    for i in np.flatnonzero(~np.isfinite(values))[:1]:
        raise RecordError(
            f"DataFrame: row {i}: column {quoted(name)} = {values[i]}: expected a finite number (dropna?)"
        )
    return values
