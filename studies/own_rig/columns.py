"""Which column of a bench CSV is what: the keys of a sidecar's ``[columns]``, by option or by name."""

from __future__ import annotations

import re
from collections.abc import Mapping

import numpy as np

from hysteresis.arrays import Floats
from hysteresis.files import RecordError
from hysteresis.messages import listed, quoted
from hysteresis.records.record import FIELDS, FURTHER_DRIVES, LIST_FIELDS, DriveUnit
from studies.own_rig.bench_csv import BenchTable, drive_unit_of, guess_column, require_unit

NAMED = ("drive", "angle", "time", "cycle")
"""Keys whose column an option may name. The drive may be a force; its key in the sidecar is then ``force``."""
BenchColumns = dict[str, str | list[str]]
"""Key of a sidecar's ``[columns]`` -> its column, or list of columns."""


def columns_of(table: BenchTable, given: Mapping[str, str | None], unit: DriveUnit | None) -> BenchColumns:
    """Name the columns of a CSV: those of ``given``, else by their names.

    Drive, angle, time and cycle are guessed from words in their names. The other channels need the names that a record
    has: ``notch_1_deg``, ``tension_a_N``, ``angle_2_deg``, ``tip_x_mm`` and so on. A channel with a cell that is no
    number is left out.

    Raises
    ------
    RecordError
        No column for drive or angle, several of them, one for both, or one in another unit.
    """
    known = dict[str, str]()
    for key in NAMED:
        name = given.get(key) or _guess(table, key)
        if given.get(key) and name in table.columns and not (key == "drive" and unit):
            require_unit(table, key, name)
        if name is None and key in ("drive", "angle"):
            raise RecordError(
                f"{table.path}: no column is named as the {key}: the columns are {', '.join(table.columns)}: "
                f"expected --{key}-column NAME"
            )
        if key == "angle" and name == known["drive"]:
            raise RecordError(
                f"{table.path}: column {quoted(name)}: drive and angle at once: the columns are "
                f"{listed(tuple(table.columns))}: expected --drive-column NAME and --angle-column NAME, of two columns"
            )
        if name is not None and (given.get(key) or name not in known.values()):
            known[key] = name
    if known["drive"] not in table.columns:
        table.numbers(known["drive"])  # says which columns there are
    force = (unit or drive_unit_of(known["drive"])) == "N"
    columns: BenchColumns = {("force" if force and key == "drive" else key): name for key, name in known.items()}
    return columns | _channels(table, unit or drive_unit_of(known["drive"]), set(known.values()))


def values_of(table: BenchTable, columns: BenchColumns) -> dict[str, Floats]:
    """Values by field of a :class:`hysteresis.Record`.

    Raises
    ------
    RecordError
        A column that is missing, or a cell that is no number.
    """
    return {
        FIELDS[key] if isinstance(names, str) else LIST_FIELDS[key]: table.numbers(names)
        if isinstance(names, str)
        else np.column_stack([table.numbers(name) for name in names])
        for key, names in columns.items()
    }


def unused(table: BenchTable, columns: BenchColumns) -> list[str]:
    """Columns of a CSV that no key names."""
    used = {name for names in columns.values() for name in ([names] if isinstance(names, str) else names)}
    return [name for name in table.columns if name not in used]


def _guess(table: BenchTable, key: str) -> str | None:
    """As :func:`guess_column`; where no column is a displacement, the drive is the one force of the tendon."""
    found = guess_column(table, key)
    return guess_column(table, "force") if found is None and key == "drive" else found


def _channels(table: BenchTable, unit: str, taken: set[str]) -> BenchColumns:
    """Further channels by the names that a record has."""

    def there(name: str) -> bool:
        return name in table.columns and name not in taken and bool(np.isfinite(table.columns[name]).all())

    names = {key: f"{key}_{unit}" if key in FURTHER_DRIVES else field for key, field in FIELDS.items()}
    columns: BenchColumns = {key: name for key, name in names.items() if key not in (*NAMED, "force") and there(name)}
    notches = [name for name in table.columns if re.fullmatch(r"notch_[1-9]\d*_deg", name)]
    notches.sort(key=lambda name: int(name.split("_")[1]))
    if notches and notches == [f"notch_{k + 1}_deg" for k in range(len(notches))] and all(map(there, notches)):
        columns["notches"] = notches
    tip = [name for name in ("tip_x_mm", "tip_y_mm", "tip_z_mm") if there(name)]
    if tip[:2] == ["tip_x_mm", "tip_y_mm"]:
        columns["tip"] = tip
    return columns
