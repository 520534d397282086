"""Reading and writing records: a CSV and a TOML sidecar of the same stem (``docs/guide/records.md``)."""

from __future__ import annotations

import shlex
from collections.abc import Collection, Mapping, Sequence
from itertools import pairwise
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from hysteresis.arguments import checked
from hysteresis.arrays import Floats
from hysteresis.files import MOST_TOML_BYTES, RecordError, inside, place, present, read_bytes, read_text, write_files
from hysteresis.messages import as_given, listed, quoted
from hysteresis.own import MAKER
from hysteresis.records.planes import require_one_wheel, second_plane
from hysteresis.records.record import FIELDS, LIST_FIELDS, MAX_COUNT, MAX_MAGNITUDE, Record, bad_cycles
from hysteresis.records.sidecar import (
    Columns,
    Sidecar,
    bare_columns,
    check_rig_tables,
    is_sidecar,
    read_sidecar,
    toml,
)
from hysteresis.records.wrapped import wraps

MOST_COLUMNS = 1_000
OTHER_TABLES = frozenset([".xlsx", ".xls", ".parquet", ".mat"])
"""Endings of tables that ``notchbend record new`` makes a record of."""
MOST_DIGITS = 100
"""Most characters of a number."""
STATISTICS = frozenset(
    ["mean", "max", "min", "maximum", "minimum", "average", "avg", "median", "std", "sd", "stdev", "std dev", "sum",
     "range", "rms", "mittelwert", "mittel", "summe", "moyenne", "écart-type", "media", "promedio"]
)  # fmt: skip
"""Words of rows above or below the samples that are made of them."""

# --- reading -----------------------------------------------------------------------------------------------------


@checked
def read_record(path: Path | str) -> Record:
    """Read a CSV and, if there is one, the TOML sidecar of the same stem.

    A row that repeats the whole previous row, time included, is one sample logged twice and is read once.

    Parameters
    ----------
    path
        The CSV. Without a sidecar it needs the columns drive_mm and angle_deg, in mm and deg; a sidecar names others.

    Raises
    ------
    RecordError
        One line with file, line or field, value and what was expected.

    Examples
    --------
    >>> record = nb.read_record("bench-10N.csv")
    >>> record.drive, record.angle_deg, record.loop_width_deg
    """
    path = Path(path)
    if path.suffix.lower() == ".toml":
        raise RecordError(f"{path}: expected the CSV of the record, not its sidecar")
    _require_text(path)
    names, rows = _read_csv(path)
    side = path.with_suffix(".toml")
    sidecar = read_sidecar(side) if present(side) else Sidecar()
    if sidecar.columns is None:
        _require_bare_columns(path, names)
    columns = bare_columns(names) if sidecar.columns is None else sidecar.columns
    clocks = [name for key in ("time", "cycle") for name in columns.get(key, [])]
    values = _parse(path, names, rows, [name for group in columns.values() for name in group], clocks)
    values = _without_repeats(path, rows, values, columns)
    arrays: dict[str, Any] = {field: values[columns[key][0]] for key, field in FIELDS.items() if key in columns}
    for key, name in LIST_FIELDS.items():
        if key in columns:
            arrays[name] = np.column_stack([values[column] for column in columns[key]])
    rig = dict(sidecar.rig)
    if "file" in rig:
        rig["file"] = str(inside(side, "rig.file", rig["file"], [".toml"]).resolve())
    if sidecar.kinematics_file is not None:
        arrays["kinematics"] = _read_kinematics(inside(side, "kinematics.file", sidecar.kinematics_file, [".csv"]))
    record = Record(
        **arrays,
        drive_unit=sidecar.drive_unit,
        title=path.stem if sidecar.title is None else sidecar.title,
        kind=sidecar.kind,
        rig=rig,
        tube=sidecar.tube,
        notch=sidecar.notch,
        source=str(path),
        drive_column=columns["force" if "force" in columns else "drive"][0],
    )
    if record.kind == "measured":
        _require_unwrapped(path, record, columns["angle"][0])
    return record


def read_records(paths: Sequence[Path], plane: int = 1) -> list[Record]:
    """Read the records of one rig, for a model of one bending plane; 2 is the second one, with the second wheel.

    Raises
    ------
    RecordError
        As :func:`read_record`, or a file that is given twice: it would count as a test that was repeated; a second
        wheel that moves (:mod:`hysteresis.records.planes`).
    """
    records = read_whole_records(paths)
    if plane == 2:
        return [second_plane(record) for record in records]
    for record in records:
        require_one_wheel(record)
    return records


def read_whole_records(paths: Sequence[Path]) -> list[Record]:
    """Read the records of one rig, with all of its wheels.

    Raises
    ------
    RecordError
        As :func:`read_record`, or a file that is given twice.
    """
    files = [place(path) for path in paths]
    for i, path in enumerate(paths):
        if files[i] in files[:i]:
            raise RecordError(f"{path}: given twice: expected different records")
    return [read_record(path) for path in paths]


def read_columns(path: Path, wanted: Sequence[str], optional: Sequence[str] = ()) -> dict[str, Floats]:
    """Read columns of a CSV by name: all of ``wanted``, and those of ``optional`` that exist.

    Parameters
    ----------
    path
        A CSV in UTF-8 with a header. Other columns are not read and may hold anything.

    Returns
    -------
    dict
        Column name -> finite values, shape (rows,); only ``time_s`` may exceed 1e9.

    Raises
    ------
    RecordError
        One line with file, line, column, value and what was expected.
    """
    names, rows = _read_csv(path)
    return _parse(path, names, rows, [*wanted, *(name for name in optional if name in names)], ["time_s"])


def column_names(path: Path) -> list[str]:
    """Names of the columns of a CSV.

    Raises
    ------
    RecordError
        A file that cannot be read, or without a header.
    """
    return _read_csv(path)[0]


def _require_bare_columns(path: Path, names: Sequence[str]) -> None:
    """Refuse a CSV without ``[columns]`` that has other columns than a bare one, and say how it becomes a record."""
    missing = next((name for name in ("drive_mm", "angle_deg") if name not in names), None)
    if missing is None:
        return
    new, comment = f"`notchbend record new {shlex.quote(str(path))}", names[0].startswith(("#", "%", "//"))
    if comment or (len(names) == 1 and any(mark in names[0] for mark in ";\t ")):
        found = "begins with a comment" if comment else "has no commas"
        way = f"{found}: {new} --out NEW.csv` writes a copy with commas, and its sidecar"
    else:
        way = f"{new} --drive-column NAME --angle-column NAME` writes a sidecar that names them"
    raise RecordError(f"{path}: column {missing!r} missing: the columns are {', '.join(names)}: {way}")


def _copy_of(path: Path) -> str:
    return f": `notchbend record new {shlex.quote(str(path))} --out NEW.csv` writes a copy that can be read"


def _require_text(path: Path) -> None:
    """Refuse a file of another kind than CSV, and say how it becomes a record."""
    if path.suffix.lower() in OTHER_TABLES and path.is_file():
        new = f"`notchbend record new {shlex.quote(str(path))}`"
        raise RecordError(f"{path}: expected a CSV file: {new} writes one, and its sidecar")


def _require_unwrapped(path: Path, record: Record, name: str) -> None:
    """Refuse an angle that jumps by a turn, where a sensor is wrapped: it would be a loop of hundreds of degrees."""
    for i in wraps(record.drive, record.angle_deg)[:1]:
        found = f"{record.angle_deg[i]:.6g} after {record.angle_deg[i - 1]:.6g}"
        new = f"`notchbend record new {shlex.quote(str(path))} --out NEW.csv`"
        raise RecordError(f"{path}: column {quoted(name)} = {found}: wrapped at a turn: {new} puts the turns back")


def _require_samples(where: Path, count: int) -> None:
    if count < 3:
        raise RecordError(f"{where}: {'one sample' if count == 1 else f'{count} samples'}: expected at least 3")


def _read_csv(path: Path) -> tuple[list[str], list[str]]:
    """Return column names and data rows; row i is line i + 2 of the file."""
    lines = read_text(path, "a CSV file", or_else=_copy_of(path)).rstrip().split("\n")
    if (count := lines[0].count(",") + 1) > MOST_COLUMNS:
        raise RecordError(f"{path}:1: {count:,} columns: expected at most {MOST_COLUMNS:,}")
    names = [name.strip().strip('"') for name in lines[0].split(",")]
    if not any(names):
        raise RecordError(f"{path}: empty: expected a header that names the columns, then one row a sample")
    twice = next((name for i, name in enumerate(names) if name and name in names[:i]), None)
    if twice is not None:
        raise RecordError(f"{path}:1: column {quoted(twice)} occurs twice: expected different names")
    if said := next((cell for cell in lines[-1].split(",") if cell.strip('" .:').lower() in STATISTICS), None):
        found = f"{path}:{len(lines)}: a row of {as_given(said)} below the samples"
        raise RecordError(f"{found}: expected samples alone{_copy_of(path)}")
    return names, lines[1:]


def _parse(
    path: Path, names: list[str], rows: list[str], wanted: Sequence[str], clocks: Collection[str] = ()
) -> dict[str, Floats]:
    """Parse the wanted columns in compiled code; look for the offending cell only if that fails.

    ``clocks`` names the columns that may exceed 1e9.
    """
    for name in wanted:
        if name not in names:
            raise RecordError(f"{path}: column {quoted(name)} missing: the columns are {listed(names)}")
    for line, row in enumerate(rows, start=2):
        if row.count(",") != len(names) - 1 or not row.strip():
            found = row.count(",") + 1 if row.strip() else 0
            raise RecordError(f"{path}:{line}: {found} fields: expected {len(names)}, one a column")
    if not rows:
        return {name: np.empty(0) for name in wanted}
    wanted = list(dict.fromkeys(wanted))
    indices = [names.index(name) for name in wanted]
    for line, row in enumerate(rows, start=2):
        if len(row) > MOST_DIGITS:  # else none of its cells is longer
            cells = row.split(",")
            for name, at in zip(wanted, indices, strict=True):
                if (size := len(cells[at])) > MOST_DIGITS:
                    where = f"{path}:{line}: column {quoted(name)}"
                    raise RecordError(f"{where}: {size:,} characters: expected at most {MOST_DIGITS}")
    try:
        values = np.loadtxt(rows, delimiter=",", comments=None, usecols=indices, ndmin=2)
    except ValueError as error:
        raise RecordError(_offending_cell(path, names, rows, wanted) or f"{path}: {as_given(str(error))}") from None
    limits = np.array([MAX_COUNT if name in clocks else MAX_MAGNITUDE for name in wanted])
    for i, j in np.argwhere(~(np.abs(values) <= limits))[:1]:
        text = rows[i].split(",")[indices[j]].strip()
        expected = f"at most {limits[j]:g} in magnitude" if np.isfinite(values[i, j]) else "a finite number"
        raise RecordError(f"{path}:{i + 2}: column {quoted(wanted[j])} = {as_given(text)}: expected {expected}")
    return {name: values[:, j] for j, name in enumerate(wanted)}


def _offending_cell(path: Path, names: list[str], rows: list[str], wanted: Sequence[str]) -> str | None:
    for line, row in enumerate(rows, start=2):
        cells = row.split(",")
        for name in wanted:
            text = cells[names.index(name)].strip()
            try:
                number = text.isascii() and "_" not in text  # Python accepts 1_000 and other digits, NumPy does not
                float(text)
            except ValueError:
                number = False
            if not number:
                return f"{path}:{line}: column {quoted(name)} = {quoted(text)}: expected a number"
    return None


_ROWS_OF_COUNTER = 20  # fewer say nothing of what a column counts


def _without_repeats(path: Path, rows: list[str], values: dict[str, Floats], columns: Columns) -> dict[str, Floats]:
    """Check time and cycle, drop samples that were logged twice, and require three samples."""
    _require_samples(path, len(rows))
    for name in columns.get("cycle", []):
        for i in np.flatnonzero(bad_cycles(values[name]))[:1]:
            expected = "a whole number that never falls"
            raise RecordError(f"{path}:{i + 2}: column {quoted(name)} = {values[name][i]:g}: expected {expected}")
    for name in columns.get("time", []):
        time = values[name]
        once = np.array([True, *(a != b for a, b in pairwise(rows))])
        for i in np.flatnonzero(once[1:] & (np.diff(time) <= 0))[:1]:
            found = f"{time[i + 1]:.12g} after {time[i]:.12g}"
            raise RecordError(f"{path}:{i + 3}: column {quoted(name)} = {found}: expected increasing time")
        _require_samples(path, int(once.sum()))
        values = {key: column[once] for key, column in values.items()}
    for name in columns.get("cycle", []):
        numbers, samples = np.unique(values[name]).size, values[name].size
        if 2 * numbers > samples >= _ROWS_OF_COUNTER:  # of a scan or a row; each would be a cycle
            found = f"{numbers} numbers in {samples} rows"
            raise RecordError(f"{path}: column {quoted(name)}: {found}: expected several samples of each cycle")
    return values


def _read_kinematics(path: Path) -> Floats:
    names, rows = _read_csv(path)
    values = _parse(path, names, rows, ["drive_mm", "angle_deg"])
    theory = np.column_stack([values["drive_mm"], values["angle_deg"]])
    if len(theory) < 2:
        raise RecordError(f"{path}: {len(theory)} rows: expected at least 2")
    order = np.argsort(theory[:, 0], kind="stable")
    theory = theory[order]
    for i in np.flatnonzero(np.diff(theory[:, 0]) == 0)[:1]:
        line = order[i + 1] + 2
        raise RecordError(f"{path}:{line}: drive_mm = {theory[i, 0]:g} occurs twice: expected one angle a drive")
    return theory


# --- writing -----------------------------------------------------------------------------------------------------


@checked
def write_record(record: Record, path: Path | str) -> None:
    """Write a record as CSV, with its sidecar and, if it has one, its theory ``<stem>.kinematics.csv``.

    A rig file that lies elsewhere is copied to ``<stem>.rig.toml``: a sidecar names files of its own folder only, so
    that a folder of records can be moved.

    Numbers are written so that reading returns the same floats. All files are staged before any is replaced; the CSV
    comes last.

    Raises
    ------
    RecordError
        What :func:`read_record` would refuse, what :func:`check_target` refuses, or a folder that cannot be
        written to.
    """
    path = Path(path)
    check_target(path)
    if record.plane != 1:  # its rig counts the wheels and angles of the whole record
        raise RecordError(f"{path}: the second plane of a record alone: expected the record that it is taken from")
    _require_samples(path, len(record.drive))
    sidecar = path.with_suffix(".toml")
    tables: dict[str, Any] = {"rig": dict(record.rig), "tube": record.tube, "notch": record.notch}
    check_rig_tables(sidecar, tables)
    rig = tables["rig"]
    files: dict[Path, str | bytes] = {}
    if "file" in rig:
        rig["file"] = _rig_beside(Path(rig["file"]), path, files)
    drive = {} if record.drive_unit == "N" else {"unit": record.drive_unit}
    head = {"schema": 1, "title": record.title, "kind": record.kind, "maker": MAKER}
    tables = {**head, "columns": record.column_names(), "drive": drive, **tables}
    if record.kinematics is not None:
        theory = path.with_suffix(".kinematics.csv")
        files[theory] = _csv({"drive_mm": record.kinematics[:, 0], "angle_deg": record.kinematics[:, 1]})
        tables["kinematics"] = {"file": theory.name}
    files[sidecar] = toml(tables)
    files[path] = _csv(record.columns())
    write_files(files)


def files_of_record(path: Path) -> list[Path]:
    """Give the files that :func:`write_record` may write."""
    return [path, path.with_suffix(".toml"), path.with_suffix(".kinematics.csv"), path.with_suffix(".rig.toml")]


def _rig_beside(rig: Path, path: Path, files: dict[Path, str | bytes]) -> str:
    """Give the name of a rig file for the sidecar of a record; add its copy to ``files`` if it lies elsewhere."""
    folder = path.parent.resolve()
    if rig.resolve().is_relative_to(folder):
        return rig.resolve().relative_to(folder).as_posix()
    copy = path.with_suffix(".rig.toml")
    files[copy] = read_bytes(rig, "the rig file of the record", most=MOST_TOML_BYTES)
    return copy.name


def check_target(path: Path, inputs: Collection[Path] = ()) -> None:
    """Refuse a path that :func:`write_record` must not write to, before the record is computed.

    Parameters
    ----------
    path
        The CSV to write.
    inputs
        Files that the record is made from; neither the CSV nor the sidecar may replace them.

    Raises
    ------
    RecordError
        A name that does not end in .csv, an input, or a TOML file of the same stem that is not the sidecar of a record.
    """
    if path.suffix.lower() != ".csv":
        raise RecordError(f"{path}: expected a name that ends in .csv")
    sidecar = path.with_suffix(".toml")
    for target in (path, sidecar):
        for file in inputs:
            if place(target) == place(file) or (target.exists() and file.exists() and target.samefile(file)):
                raise RecordError(
                    f"{path}: writing {target.name} would replace the input {file}: expected another name"
                )
    if sidecar.is_file() and not is_sidecar(sidecar):
        raise RecordError(f"{sidecar}: not the sidecar of a record, would be replaced: expected another name")


def _csv(data: Mapping[str, NDArray[Any]]) -> str:
    cells = [[*map(repr, column.tolist())] for column in data.values()]  # repr: shortest text that reads back the same
    return "\n".join([",".join(data), *map(",".join, zip(*cells, strict=True))]) + "\n"
