"""When records were made: a table of their places on an axis of days, uses or anything that increases."""

from __future__ import annotations

import csv
import math
from collections.abc import Sequence
from pathlib import Path

from hysteresis.files import RecordError, read_bytes
from hysteresis.messages import quoted
from studies.follow.result import Axis

IN_ORDER = "record"
_EXPECTED = "a column record with the names of the files, and one with numbers, such as day"


def read_times(path: Path, records: Sequence[Path]) -> Axis:
    """Read the places of records from a CSV with the columns ``record`` and one of numbers, whose name is the axis'.

    Raises
    ------
    RecordError
        One line with file, line, value and what was expected; places that do not increase in the order of the records.
    """
    rows = list(csv.reader(read_bytes(path, _EXPECTED).decode("utf-8-sig", "replace").splitlines()))
    head = [name.strip() for name in rows[0]] if rows else []
    if len(head) != 2 or "record" not in head:
        raise RecordError(f"{path}:1: header {quoted(','.join(head), 60)}: expected {_EXPECTED}")
    key, name = head.index("record"), head[1 - head.index("record")]
    places = dict[str, float]()
    for line, row in enumerate(rows[1:], start=2):
        if not any(cell.strip() for cell in row):
            continue
        if len(row) != 2:
            raise RecordError(f"{path}:{line}: {len(row)} cells: expected 2")
        try:
            value = float(row[1 - key])
        except ValueError:
            value = math.nan
        if not math.isfinite(value):
            raise RecordError(f"{path}:{line}: column {quoted(name)} = {quoted(row[1 - key], 40)}: expected a number")
        places[Path(row[key].strip()).name] = value
    missing = next((one for one in records if one.name not in places), None)
    if missing is not None:
        raise RecordError(f"{path}: {missing.name}: missing: expected a row for each record")
    values = tuple(places[one.name] for one in records)
    for before, after, one in zip(values, values[1:], records[1:], strict=False):
        if after <= before:
            found = f"{path}: {one.name}: {name} = {after:g} after {before:g}"
            raise RecordError(f"{found}: expected records in order, no two at one place")
    return Axis(name, values)


def in_order(count: int) -> Axis:
    """Give the records their numbers."""
    return Axis(IN_ORDER, tuple(float(k) for k in range(1, count + 1)))
