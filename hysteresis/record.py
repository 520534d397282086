"""A record: drive and angle of one test, measured or simulated, with what is known of it.

The file format (a CSV and a TOML sidecar of the same stem) stands in ``docs/records.md``.
"""

from __future__ import annotations

import json
import os
import tomllib
from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass, field, fields
from itertools import pairwise
from pathlib import Path
from sys import float_info
from typing import Any, Literal

import numpy as np
from numpy.typing import NDArray

from hysteresis.files import RecordError as RecordError
from hysteresis.files import write_files

DriveUnit = Literal["mm", "deg", "step", "N"]
DRIVE_UNITS: tuple[str, ...] = ("mm", "deg", "step", "N")
KINDS: tuple[str, ...] = ("measured", "simulated")
MAX_MAGNITUDE = (
    1e9  # of a value in mm, deg, steps or N: beyond it is a wrong unit or a broken log, and squares overflow
)

# Keys of [columns] with the field of Record that each one fills; a bare CSV calls a column as its field.
_FIELDS: dict[str, str] = {
    "time": "time_s",
    "cycle": "cycle",
    "drive": "drive",  # in a bare CSV: drive_mm
    "force": "drive",  # the drive of load-controlled data
    "angle": "angle_deg",
    "tension_a": "tension_a_N",
    "tension_b": "tension_b_N",
}
_LIST_FIELDS: dict[str, str] = {"notches": "notches_deg", "tip": "tip_mm"}  # these name a list of columns
MEASURED_KEYS = (
    "joints",
    "moment_arm_mm",
    "flexure_stiffness_Nmm_per_rad",
    "tendon_EA_N",
    "tendon_free_length_mm",
    "pitch_mm",
)
"""Quantities of ``[rig]`` that stand in place of a preset or a file; all of them, or none."""
_RIG_NUMBERS = ("preload_N", *MEASURED_KEYS)
_KEYS: dict[str, tuple[str, ...]] = {
    "": ("schema", "title", "kind", "columns", "drive", "rig", "tube", "notch", "kinematics"),
    "columns": (*_FIELDS, *_LIST_FIELDS),
    "drive": ("unit",),
    "rig": ("preset", "file", *_RIG_NUMBERS),
    "kinematics": ("file",),
}


_MAX_COUNT = 2.0**53  # of times, which may be those of a clock, and of cycles: whole numbers up to it are exact


@dataclass(frozen=True, eq=False)
class Record:
    """One test of one rig, sample by sample. All arrays have the same length m.

    ``drive_unit`` is N for load-controlled data (the drive is then the tendon force). ``rig``, ``tube`` and
    ``notch`` hold the sidecar's tables as they stand: what they mean is the mechanical model's business
    (``rig["file"]`` is absolute in a record that was read). ``kinematics`` is the user's own theory f(x) as rows
    (drive_mm, angle_deg), shape (k, 2), by increasing drive.

    Arrays are copied and read-only. Two records are equal when all values are; ``source`` and ``drive_column``
    (where it came from) do not count.

    Raises
    ------
    RecordError
        An array of another shape, a value that is not finite or beyond 1e9 (times may be larger), time that does not
        increase, a cycle that is not a whole number or falls, an unknown kind or unit.
    """

    drive: NDArray[np.float64]
    angle_deg: NDArray[np.float64]
    drive_unit: DriveUnit = "mm"
    title: str = ""
    kind: Literal["measured", "simulated"] = "measured"
    time_s: NDArray[np.float64] | None = None
    cycle: NDArray[np.int64] | None = None
    tension_a_N: NDArray[np.float64] | None = None
    tension_b_N: NDArray[np.float64] | None = None
    notches_deg: NDArray[np.float64] | None = None  # shape (m, notches), base to tip
    tip_mm: NDArray[np.float64] | None = None  # shape (m, 2): along the straight tube, and across in the bending plane
    rig: Mapping[str, Any] = field(default_factory=dict)
    tube: Mapping[str, Any] = field(default_factory=dict)
    notch: Mapping[str, Any] = field(default_factory=dict)
    kinematics: NDArray[np.float64] | None = None
    source: str = field(default="", compare=False)  # the file it came from, for messages; "" when made in memory
    drive_column: str = field(default="drive", compare=False)  # the drive's name there

    def __post_init__(self) -> None:
        self._require(self.drive_unit in DRIVE_UNITS, "drive_unit", repr(self.drive_unit), "one of mm, deg, step, N")
        self._require(self.kind in KINDS, "kind", repr(self.kind), "measured or simulated")
        self._require(np.ndim(self.drive) == 1 and np.size(self.drive) > 0, "drive", "no samples", "a row of numbers")
        m = len(self.drive)
        # None stands for any number of columns or rows.
        shapes: dict[str, tuple[int | None, ...]] = {
            **dict.fromkeys(_FIELDS.values(), (m,)),
            "notches_deg": (m, None),
            "tip_mm": (m, 2),
            "kinematics": (None, 2),
        }
        for name, shape in shapes.items():
            if getattr(self, name) is not None or name == "angle_deg":
                object.__setattr__(self, name, self._checked(name, shape))
        for name in ("rig", "tube", "notch"):
            object.__setattr__(self, name, dict(getattr(self, name)))

    def _checked(self, name: str, shape: tuple[int | None, ...]) -> NDArray[Any]:
        """Copy an array, read-only; raise where it breaks what the class promises."""
        array = np.array(getattr(self, name), dtype=float)
        fits = array.ndim == len(shape) and all(want in (None, n) for want, n in zip(shape, array.shape, strict=True))
        expected = str(shape).replace("None", "any")
        self._require(fits and array.size > 0, name, f"shape {array.shape}", f"shape {expected}")
        self._require(bool(np.isfinite(array).all()), name, "NaN or infinite", "finite numbers")
        largest, limit = float(np.abs(array).max()), _MAX_COUNT if name in ("time_s", "cycle") else MAX_MAGNITUDE
        self._require(largest <= limit, name, f"magnitude {largest:g}", f"at most {limit:g}")
        if name == "cycle":
            self._require(not _bad_cycles(array).any(), name, "not a count", "whole numbers that never fall")
            array = array.astype(np.int64)
        elif name in ("time_s", "kinematics"):
            increasing = array if name == "time_s" else array[:, 0]
            self._require(bool((np.diff(increasing) > 0).all()), name, "not increasing", "increasing values")
        array.flags.writeable = False
        return array

    def _require(self, condition: bool, name: str, value: str, expected: str) -> None:
        if not condition:
            raise RecordError(f"{self.source or 'record'}: {name}: {value}: expected {expected}")

    def __eq__(self, other: object) -> bool:
        if not isinstance(other, Record):
            return NotImplemented
        pairs = [(getattr(self, f.name), getattr(other, f.name)) for f in fields(self) if f.compare]
        return all(
            np.array_equal(a, b) if isinstance(a, np.ndarray) else type(a) is type(b) and a == b for a, b in pairs
        )


# --- reading -----------------------------------------------------------------------------------------------------


def read_record(path: Path) -> Record:
    """Read a CSV and, where there is one, the TOML sidecar of the same stem.

    A row that repeats the whole row before it, time included, is one sample logged twice and is read once.

    Parameters
    ----------
    path
        The CSV. Without a sidecar it needs the columns drive_mm and angle_deg.

    Raises
    ------
    RecordError
        One line with file, line or field, value and what was expected.
    """
    if path.suffix.lower() == ".toml":
        raise RecordError(f"{path}: expected the CSV of the record, not its sidecar")
    names, rows = _read_csv(path)
    sidecar = path.with_suffix(".toml")
    tables = _read_sidecar(sidecar) if sidecar.exists() else {}
    columns = _column_map(sidecar, tables, names)
    clocks = [name for key in ("time", "cycle") for name in columns.get(key, [])]
    values = _parse(path, names, rows, [name for group in columns.values() for name in group], clocks)
    values = _sampled_once(path, rows, values, columns)
    arrays: dict[str, Any] = {field: values[columns[key][0]] for key, field in _FIELDS.items() if key in columns}
    for key, name in _LIST_FIELDS.items():
        if key in columns:
            arrays[name] = np.column_stack([values[column] for column in columns[key]])
    rig = dict(tables.get("rig", {}))
    if "file" in rig:
        rig["file"] = str((sidecar.parent / rig["file"]).resolve())
    if "kinematics" in tables:
        arrays["kinematics"] = _read_kinematics(sidecar.parent / tables["kinematics"]["file"])
    return Record(
        **arrays,
        drive_unit=_drive_unit(sidecar, tables, columns),
        title=tables.get("title", path.stem),
        kind=tables.get("kind", "measured"),
        rig=rig,
        tube=tables.get("tube", {}),
        notch=tables.get("notch", {}),
        source=str(path),
        drive_column=columns["force" if "force" in columns else "drive"][0],
    )


def read_columns(path: Path, wanted: Sequence[str], optional: Sequence[str] = ()) -> dict[str, NDArray[np.float64]]:
    """Read columns of a CSV by name: all of ``wanted``, and those of ``optional`` that it has.

    Parameters
    ----------
    path
        A CSV in UTF-8 with a header; other columns are not read and may hold anything.

    Returns
    -------
    dict
        Column name -> finite values, shape (rows,); no value but that of ``time_s`` is beyond 1e9.

    Raises
    ------
    RecordError
        One line with file, line, column, value and what was expected.
    """
    names, rows = _read_csv(path)
    return _parse(path, names, rows, [*wanted, *(name for name in optional if name in names)], ["time_s"])


def _require_samples(where: Path, count: int) -> None:
    if count < 3:
        raise RecordError(f"{where}: {'one sample' if count == 1 else f'{count} samples'}: expected at least 3")


def _read_text(path: Path, expected: str) -> str:
    try:
        return path.read_text(encoding="utf-8-sig")
    except OSError as error:
        raise RecordError(f"{path}: {error.strerror}: expected {expected}") from None
    except UnicodeDecodeError as error:
        raise RecordError(f"{path}: byte {error.start} is not UTF-8: expected {expected} in UTF-8") from None


def _read_csv(path: Path) -> tuple[list[str], list[str]]:
    """Column names and data rows; row i is line i + 2 of the file."""
    lines = _read_text(path, "a CSV file").rstrip().split("\n")
    names = [name.strip().strip('"') for name in lines[0].split(",")]
    if not any(names):
        raise RecordError(f"{path}: empty: expected a header that names the columns, then one row a sample")
    twice = next((name for i, name in enumerate(names) if name and name in names[:i]), None)
    if twice is not None:
        raise RecordError(f"{path}:1: column {twice!r} stands twice: expected different names")
    return names, lines[1:]


def _parse(
    path: Path, names: list[str], rows: list[str], wanted: Sequence[str], clocks: Collection[str] = ()
) -> dict[str, NDArray[np.float64]]:
    """Parse the wanted columns at C speed; only when that fails look for the culprit. ``clocks`` may be large."""
    for name in wanted:
        if name not in names:
            raise RecordError(f"{path}: column {name!r} missing: the columns are {', '.join(names)}")
    for line, row in enumerate(rows, start=2):
        if row.count(",") != len(names) - 1 or not row.strip():
            found = row.count(",") + 1 if row.strip() else 0
            raise RecordError(f"{path}:{line}: {found} fields: expected {len(names)}, one a column")
    if not rows:
        return {name: np.empty(0) for name in wanted}
    wanted = list(dict.fromkeys(wanted))
    indices = [names.index(name) for name in wanted]
    try:
        values = np.loadtxt(rows, delimiter=",", comments=None, usecols=indices, ndmin=2)
    except ValueError as error:
        raise RecordError(_culprit(path, names, rows, wanted) or f"{path}: {error}") from None
    limits = np.array([_MAX_COUNT if name in clocks else MAX_MAGNITUDE for name in wanted])
    for i, j in np.argwhere(~(np.abs(values) <= limits))[:1]:
        text = rows[i].split(",")[indices[j]].strip()
        expected = f"at most {limits[j]:g} in magnitude" if np.isfinite(values[i, j]) else "a finite number"
        raise RecordError(f"{path}:{i + 2}: column {wanted[j]!r} = {text}: expected {expected}")
    return {name: values[:, j] for j, name in enumerate(wanted)}


def _culprit(path: Path, names: list[str], rows: list[str], wanted: Sequence[str]) -> str | None:
    for line, row in enumerate(rows, start=2):
        cells = row.split(",")
        for name in wanted:
            text = cells[names.index(name)].strip()
            try:
                number = text.isascii() and "_" not in text  # Python takes 1_000 and other digits, NumPy does not
                float(text)
            except ValueError:
                number = False
            if not number:
                return f"{path}:{line}: column {name!r} = {text!r}: expected a number"
    return None


def _sampled_once(
    path: Path, rows: list[str], values: dict[str, NDArray[np.float64]], columns: Mapping[str, list[str]]
) -> dict[str, NDArray[np.float64]]:
    """Check time and cycle, drop samples that were logged twice, and require three samples."""
    _require_samples(path, len(rows))
    for name in columns.get("cycle", []):
        for i in np.flatnonzero(_bad_cycles(values[name]))[:1]:
            expected = "a whole number that never falls"
            raise RecordError(f"{path}:{i + 2}: column {name!r} = {values[name][i]:g}: expected {expected}")
    for name in columns.get("time", []):
        time = values[name]
        once = np.array([True, *(a != b for a, b in pairwise(rows))])
        for i in np.flatnonzero(once[1:] & (np.diff(time) <= 0))[:1]:
            found = f"{time[i + 1]:.12g} after {time[i]:.12g}"
            raise RecordError(f"{path}:{i + 3}: column {name!r} = {found}: expected increasing time")
        _require_samples(path, int(once.sum()))
        values = {key: column[once] for key, column in values.items()}
    return values


def _bad_cycles(cycle: NDArray[np.float64]) -> NDArray[np.bool_]:
    whole = (cycle == np.rint(cycle)) & (np.abs(cycle) < 2**53)
    return ~whole | (np.diff(cycle, prepend=-np.inf) < 0)


def _read_kinematics(path: Path) -> NDArray[np.float64]:
    names, rows = _read_csv(path)
    values = _parse(path, names, rows, ["drive_mm", "angle_deg"])
    theory = np.column_stack([values["drive_mm"], values["angle_deg"]])
    if len(theory) < 2:
        raise RecordError(f"{path}: {len(theory)} rows: expected at least 2")
    theory = theory[np.argsort(theory[:, 0], kind="stable")]
    for i in np.flatnonzero(np.diff(theory[:, 0]) == 0)[:1]:
        raise RecordError(f"{path}: drive_mm = {theory[i, 0]:g} stands twice: expected one angle a drive")
    return theory


# --- the sidecar -------------------------------------------------------------------------------------------------


def _read_sidecar(path: Path) -> dict[str, Any]:
    try:
        tables = tomllib.loads(_read_text(path, "the record's sidecar"))
    except tomllib.TOMLDecodeError as error:
        raise RecordError(f"{path}: not TOML: {error}") from None
    _check_keys(path, "", tables)
    if type(tables.get("schema")) is not int or tables["schema"] != 1:
        raise RecordError(f"{path}: schema = {tables.get('schema', 'missing')!r}: expected 1")
    if not isinstance(tables.get("title", ""), str):
        raise RecordError(f"{path}: title = {tables['title']!r}: expected text")
    if tables.get("kind", "measured") not in KINDS:
        raise RecordError(f"{path}: kind = {tables['kind']!r}: expected measured or simulated")
    for name in ("columns", "drive", "kinematics"):
        _check_keys(path, name, tables.get(name, {}))
    _check_rig_tables(path, tables)
    if not isinstance(tables.get("kinematics", {"file": ""}).get("file"), str):
        raise RecordError(f"{path}: kinematics.file: expected the name of a CSV file")
    return tables


def _check_keys(where: Path, name: str, table: object) -> None:
    if not isinstance(table, Mapping):
        raise RecordError(f"{where}: {name} = {table!r}: expected a table")
    for key in table:
        if key not in _KEYS[name]:
            full = f"{name}.{key}" if name else key
            raise RecordError(f"{where}: {full}: unknown key: expected one of {', '.join(_KEYS[name])}")


def _check_rig_tables(where: Path, tables: Mapping[str, Any]) -> None:
    """Check keys and values of [rig]; of [tube] and [notch], whose keys the mechanical model knows, the values."""
    _check_keys(where, "rig", tables.get("rig", {}))
    for table in ("rig", "tube", "notch"):
        items = tables.get(table, {})
        if not isinstance(items, Mapping):
            raise RecordError(f"{where}: {table} = {items!r}: expected a table")
        for key, value in items.items():
            text = isinstance(value, str)
            number = isinstance(value, int | float) and not isinstance(value, bool) and abs(value) <= float_info.max
            if table != "rig":
                good, expected = text or number, "a number or text"
            elif key not in _RIG_NUMBERS:
                good, expected = text, "text"
            elif key == "joints":
                good, expected = isinstance(value, int) and number and value >= 1, "a whole number of at least 1"
            else:
                good, expected = number and value > 0, "a number above 0"
            if not good:
                raise RecordError(f"{where}: {table}.{key} = {value!r}: expected {expected}")


def _column_map(where: Path, tables: Mapping[str, Any], names: Sequence[str]) -> dict[str, list[str]]:
    """Which CSV columns stand for which key; the bare names where the sidecar has no [columns]."""
    if "columns" not in tables:
        bare = {**_FIELDS, "drive": "drive_mm"}
        del bare["force"]
        return {key: [name] for key, name in bare.items() if key in ("drive", "angle") or name in names}
    columns: dict[str, list[str]] = {}
    for key, value in tables["columns"].items():
        group = value if key in _LIST_FIELDS else [value]
        if not isinstance(group, list) or not group or not all(isinstance(name, str) for name in group):
            expected = "a list of column names" if key in _LIST_FIELDS else "the name of a column"
            raise RecordError(f"{where}: columns.{key} = {value!r}: expected {expected}")
        columns[key] = group
    if len(columns.get("tip", ["x", "y"])) != 2:
        raise RecordError(f"{where}: columns.tip = {columns['tip']!r}: expected two columns, along and across")
    if "angle" not in columns:
        raise RecordError(f"{where}: columns.angle: missing: expected the name of a column")
    if ("drive" in columns) == ("force" in columns):
        raise RecordError(f"{where}: columns.drive, columns.force: expected one of the two")
    return columns


def _drive_unit(where: Path, tables: Mapping[str, Any], columns: Mapping[str, Any]) -> DriveUnit:
    allowed = ("N",) if "force" in columns else ("mm", "deg", "step")
    unit = tables.get("drive", {}).get("unit", allowed[0])
    if unit not in allowed:
        raise RecordError(f"{where}: drive.unit = {unit!r}: expected {' or '.join(allowed)}")
    return unit


# --- writing -----------------------------------------------------------------------------------------------------


def write_record(record: Record, path: Path) -> None:
    """Write a record as CSV, with its sidecar and, where it has one, its theory ``<stem>.kinematics.csv``.

    Numbers are written so that reading gives the same floats. All files are staged beside their place before any
    is replaced; the CSV comes last.

    Raises
    ------
    RecordError
        What :func:`read_record` would refuse, what :func:`check_target` refuses, or a folder that cannot be
        written to.
    """
    check_target(path)
    _require_samples(path, len(record.drive))
    sidecar = path.with_suffix(".toml")
    tables: dict[str, Any] = {"rig": dict(record.rig), "tube": record.tube, "notch": record.notch}
    _check_rig_tables(sidecar, tables)
    rig = tables["rig"]
    if "file" in rig:  # relative, so that a folder of records can be moved
        rig["file"] = Path(os.path.relpath(Path(rig["file"]).resolve(), path.parent.resolve())).as_posix()
    columns, data = _columns_to_write(record)
    drive = {} if record.drive_unit == "N" else {"unit": record.drive_unit}
    head = {"schema": 1, "title": record.title, "kind": record.kind, "columns": columns, "drive": drive}
    tables = {**head, **tables}
    files: dict[Path, str] = {}
    if record.kinematics is not None:
        theory = path.with_suffix(".kinematics.csv")
        files[theory] = _csv({"drive_mm": record.kinematics[:, 0], "angle_deg": record.kinematics[:, 1]})
        tables["kinematics"] = {"file": theory.name}
    files[sidecar] = _toml(tables)
    files[path] = _csv(data)
    write_files(files)


def check_target(path: Path, inputs: Collection[Path] = ()) -> None:
    """Refuse a path that :func:`write_record` must not write to, before the work that leads to the record.

    Parameters
    ----------
    path
        The CSV to write.
    inputs
        Files that the record is made from, which neither the CSV nor the sidecar may replace.

    Raises
    ------
    RecordError
        A name that does not end in .csv, an input, or a TOML file beside it that is no sidecar of a record.
    """
    if path.suffix.lower() != ".csv":
        raise RecordError(f"{path}: expected a name that ends in .csv")
    sidecar = path.with_suffix(".toml")
    for target in (path, sidecar):
        for file in inputs:
            if target.resolve() == file.resolve() or (target.exists() and file.exists() and target.samefile(file)):
                raise RecordError(
                    f"{path}: writing {target.name} would replace the input {file}: expected another name"
                )
    if sidecar.is_file() and not _is_sidecar(sidecar):
        raise RecordError(f"{sidecar}: not the sidecar of a record, would be replaced: expected another name")


def _is_sidecar(path: Path) -> bool:
    try:
        return {"schema", "columns"} <= set(tomllib.loads(_read_text(path, "a sidecar")))
    except (RecordError, tomllib.TOMLDecodeError):
        return False


def _columns_to_write(record: Record) -> tuple[dict[str, Any], dict[str, NDArray[Any]]]:
    """Give the [columns] table, and the data by column name."""
    load = record.drive_unit == "N"
    names = {**_FIELDS, "drive": f"drive_{record.drive_unit}", "force": "force_N"}
    del names["drive" if load else "force"]
    columns: dict[str, Any] = {key: name for key, name in names.items() if getattr(record, _FIELDS[key]) is not None}
    data = {name: getattr(record, _FIELDS[key]) for key, name in columns.items()}
    if record.notches_deg is not None:
        columns["notches"] = [f"notch_{i + 1}_deg" for i in range(record.notches_deg.shape[1])]
        data |= dict(zip(columns["notches"], record.notches_deg.T, strict=True))
    if record.tip_mm is not None:
        columns["tip"] = ["tip_x_mm", "tip_y_mm"]
        data |= dict(zip(columns["tip"], record.tip_mm.T, strict=True))
    return columns, data


def _csv(data: Mapping[str, NDArray[Any]]) -> str:
    cells = [[*map(repr, column.tolist())] for column in data.values()]  # repr: shortest text that reads back the same
    return "\n".join([",".join(data), *map(",".join, zip(*cells, strict=True))]) + "\n"


def _toml(tables: Mapping[str, Any]) -> str:
    """Write plain values and tables of plain values as TOML."""

    def text(value: Any) -> str:
        if isinstance(value, list):
            return "[" + ", ".join(map(text, value)) + "]"
        if isinstance(value, str):  # JSON strings are TOML strings but for DEL
            return json.dumps(value, ensure_ascii=False).replace("\x7f", "\\u007f")
        return repr(int(value)) if isinstance(value, int) else repr(float(value))

    def lines(table: Mapping[str, Any]) -> list[str]:
        return [
            f"{text(key) if not key.isidentifier() or not key.isascii() else key} = {text(value)}"
            for key, value in table.items()
            if not isinstance(value, Mapping)
        ]

    parts = [lines(tables)]
    parts += [[f"\n[{name}]", *lines(table)] for name, table in tables.items() if isinstance(table, Mapping) and table]
    return "\n".join(line for part in parts for line in part) + "\n"
