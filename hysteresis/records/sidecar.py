"""The sidecar of a record: the TOML file that names the columns of the CSV and describes the rig."""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from hysteresis.files import RecordError, read_toml
from hysteresis.messages import as_given, quoted
from hysteresis.records.record import FIELDS, FURTHER_DRIVES, KINDS, LIST_FIELDS, MEASURED_KEYS, DriveUnit, Kind
from hysteresis.records.rows import check_list, is_number, table_of_rows
from hysteresis.records.units import declared_unit, expected_unit, unit_of

Columns = Mapping[str, list[str]]
"""Key of ``[columns]`` -> columns of the CSV."""
_RIG_NUMBERS = ("preload_N", *MEASURED_KEYS)
TOLERANCE = "tolerance"
"""Table of ``[rig]``: standard deviations of its numbers, by names that the model of the rig knows."""
_KEYS: dict[str, tuple[str, ...]] = {
    "": ("schema", "title", "kind", "maker", "columns", "drive", "rig", "tube", "notch", "kinematics"),
    "columns": (*FIELDS, *LIST_FIELDS),
    "drive": ("unit",),
    "rig": ("preset", "file", *_RIG_NUMBERS, TOLERANCE),
    "kinematics": ("file",),
}


@dataclass(frozen=True)
class Sidecar:
    """Contents of a sidecar, checked. ``columns`` is None where the CSV uses the names of a bare CSV."""

    title: str | None = None
    kind: Kind = "measured"
    columns: Columns | None = None
    drive_unit: DriveUnit = "mm"
    rig: Mapping[str, Any] = field(default_factory=dict)
    tube: Mapping[str, Any] = field(default_factory=dict)
    notch: Mapping[str, Any] = field(default_factory=dict)
    kinematics_file: str | None = None


def read_sidecar(path: Path) -> Sidecar:
    """Read and check a sidecar.

    Raises
    ------
    RecordError
        One line with the file, the key, its value and what was expected.
    """
    tables = dict(read_toml(path, "the record's sidecar"))
    _check_keys(path, "", tables)
    if isinstance(tables.get("notch"), list):
        tables["notch"] = table_of_rows(path, "notch", tables["notch"])
    if type(tables.get("schema")) is not int or tables["schema"] != 1:
        raise RecordError(f"{path}: schema = {quoted(tables.get('schema', 'missing'))}: expected 1")
    if not isinstance(tables.get("title", ""), str):
        raise RecordError(f"{path}: title = {quoted(tables['title'])}: expected text")
    if tables.get("kind", "measured") not in KINDS:
        raise RecordError(f"{path}: kind = {quoted(tables['kind'])}: expected measured or simulated")
    if not isinstance(tables.get("maker", ""), str):
        raise RecordError(f"{path}: maker = {quoted(tables['maker'])}: expected text")
    for name in ("columns", "drive", "kinematics"):
        _check_keys(path, name, tables.get(name, {}))
    check_rig_tables(path, tables)
    if not isinstance(tables.get("kinematics", {"file": ""}).get("file"), str):
        raise RecordError(f"{path}: kinematics.file: expected the name of a CSV file")
    declares_unit = "unit" in tables.get("drive", {})
    columns = _columns(path, tables["columns"], declares_unit=declares_unit) if "columns" in tables else None
    return Sidecar(
        title=tables.get("title"),
        kind=tables.get("kind", "measured"),
        columns=columns,
        drive_unit=_drive_unit(path, tables, columns or {}),
        rig=tables.get("rig", {}),
        tube=tables.get("tube", {}),
        notch=tables.get("notch", {}),
        kinematics_file=tables.get("kinematics", {}).get("file"),
    )


def _check_keys(where: Path, name: str, table: object) -> None:
    if not isinstance(table, Mapping):
        raise RecordError(f"{where}: {name} = {quoted(table)}: expected a table")
    for key in table:
        if key not in _KEYS[name]:
            full = f"{name}.{key}" if name else key
            raise RecordError(f"{where}: {as_given(full)}: unknown key: expected one of {', '.join(_KEYS[name])}")


def check_rig_tables(where: Path, tables: Mapping[str, Any]) -> None:
    """Check keys and values of ``[rig]``; of ``[tube]`` and ``[notch]`` only the values.

    The mechanical model checks the keys of ``[tube]`` and ``[notch]``.

    Raises
    ------
    RecordError
        One line with the file, the key, its value and what was expected.
    """
    _check_keys(where, "rig", tables.get("rig", {}))
    for table in ("rig", "tube", "notch"):
        items = tables.get(table, {})
        if not isinstance(items, Mapping):
            raise RecordError(f"{where}: {table} = {quoted(items)}: expected a table")
        for key, value in items.items():
            text = isinstance(value, str)
            number = is_number(value)
            if table == "notch" and isinstance(value, list | tuple):
                check_list(f"{where}: notch.{as_given(key)}", value)
                continue
            if table == "rig" and key == TOLERANCE:
                good = isinstance(value, Mapping) and all(is_number(one) and one > 0 for one in value.values())
                expected = "a table of standard deviations above 0"
            elif table != "rig":
                good, expected = text or number, "a number or text"
            elif key not in _RIG_NUMBERS:
                good, expected = text, "text"
            elif key == "joints":
                good, expected = isinstance(value, int) and number and value >= 1, "a whole number of at least 1"
            else:
                good, expected = number and value > 0, "a number above 0"
            if not good:
                raise RecordError(f"{where}: {table}.{as_given(key)} = {quoted(value)}: expected {expected}")


def bare_columns(names: Sequence[str]) -> Columns:
    """Map the columns of a CSV without ``[columns]``: the drive and the angle, and those of the others that exist."""
    bare = {**FIELDS, "drive": "drive_mm", **{key: f"{key}_mm" for key in FURTHER_DRIVES}}
    del bare["force"]
    return {key: [name] for key, name in bare.items() if key in ("drive", "angle") or name in names}


def _columns(where: Path, table: Mapping[str, Any], *, declares_unit: bool) -> Columns:
    """Check ``[columns]``; a name that says another unit than the file has is refused, or ``[drive]`` says the unit."""
    columns: dict[str, list[str]] = {}
    for key, value in table.items():
        group = value if key in LIST_FIELDS else [value]
        if not isinstance(group, list) or not group or not all(isinstance(name, str) for name in group):
            expected = "a list of column names" if key in LIST_FIELDS else "the name of a column"
            raise RecordError(f"{where}: columns.{key} = {quoted(value)}: expected {expected}")
        columns[key] = group
    if len(columns.get("tip", ["x", "y"])) not in (2, 3):
        expected = "two columns, along and across, or three of a tip in space"
        raise RecordError(f"{where}: columns.tip = {quoted(columns['tip'])}: expected {expected}")
    if "angle" not in columns:
        raise RecordError(f"{where}: columns.angle: missing: expected the name of a column")
    if ("drive" in columns) == ("force" in columns):
        raise RecordError(f"{where}: columns.drive, columns.force: expected one of the two")
    roles = dict[str, str]()
    for key, name in ((key, name) for key, group in columns.items() for name in group):
        if name in roles:
            raise RecordError(f"{where}: columns.{key} = {quoted(name)}: is columns.{roles[name]}: expected another")
        roles[name] = key
        moves = key.startswith("drive") or key == "force"
        if not (declares_unit and moves):
            _require_unit(f"{where}: columns.{key} = {quoted(name)}", key, name, moves=moves)
    return columns


def _require_unit(where: str, key: str, name: str, *, moves: bool) -> None:
    """Refuse a name that says another unit than the file has."""
    if (unit := expected_unit(key, name)) is not None:
        how = "convert the column, or declare drive.unit" if moves else "convert the column"
        raise RecordError(f"{where}: expected {unit}: {how}")
    said = unit_of("drive", name) if key == "drive" else None
    unit = None if said is None else declared_unit("drive", said)
    if unit not in ("mm", None):
        how = "columns.force in place of columns.drive" if unit == "N" else f'unit = "{unit}" in [drive]'
        raise RecordError(f"{where}: its name says {unit}: expected {how}")


def _drive_unit(where: Path, tables: Mapping[str, Any], columns: Columns) -> DriveUnit:
    allowed: tuple[DriveUnit, ...] = ("N",) if "force" in columns else ("mm", "deg", "step")
    unit: DriveUnit = tables.get("drive", {}).get("unit", allowed[0])
    if unit not in allowed:
        raise RecordError(f"{where}: drive.unit = {quoted(unit)}: expected {' or '.join(allowed)}")
    return unit


def is_sidecar(path: Path) -> bool:
    """Tell whether a TOML file is the sidecar of a record."""
    try:
        return {"schema", "columns"} <= set(read_toml(path, "a sidecar"))
    except RecordError:
        return False


def toml(tables: Mapping[str, Any]) -> str:
    """Write plain values and tables of plain values as TOML."""

    def text(value: Any) -> str:
        if isinstance(value, list | tuple):
            return "[" + ", ".join(map(text, value)) + "]"
        if isinstance(value, bool):
            return "true" if value else "false"
        if isinstance(value, str):  # JSON strings are TOML strings, except for DEL
            return json.dumps(value, ensure_ascii=False).replace("\x7f", "\\u007f")
        return repr(int(value)) if isinstance(value, int) else repr(float(value))

    def lines(table: Mapping[str, Any]) -> list[str]:
        return [
            f"{text(key) if not key.isidentifier() or not key.isascii() else key} = {text(value)}"
            for key, value in table.items()
            if not isinstance(value, Mapping)
        ]

    def headed(name: str, table: Mapping[str, Any]) -> list[str]:
        own, inner = lines(table), [(key, one) for key, one in table.items() if isinstance(one, Mapping) and one]
        head = [f"\n[{name}]", *own] if own or not inner else []
        return head + [line for key, one in inner for line in headed(f"{name}.{key}", one)]

    parts = [lines(tables)]
    parts += [headed(name, table) for name, table in tables.items() if isinstance(table, Mapping) and table]
    return "\n".join(line for part in parts for line in part) + "\n"
