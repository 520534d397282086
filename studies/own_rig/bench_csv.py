"""The CSV of a bench as its logger writes it: which delimiter, comment lines, decimal sign and columns it has."""

from __future__ import annotations

import csv
import re
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from hysteresis.arrays import Floats
from hysteresis.files import RecordError, read_text
from hysteresis.records.record import DriveUnit
from hysteresis.records.units import expected_unit

DELIMITERS = {",": "comma", ";": "semicolon", "\t": "tab", " ": "space"}
COMMENTS = ("#", "%", "//")
_THOUSANDS = re.compile(r"[+-]?\d{1,3}(\.\d{3})+(,\d+)?")
_DECIMAL_COMMA = re.compile(r"[+-]?\d+,\d+([eE][+-]?\d+)?")
_WORDS = {
    "drive": r"drive|displacement|tendon|pull|wheel|motor|stroke|stage|actuator",
    "angle": r"angle|theta|bend|tip_deg|cam",
    "time": r"time|^t$|^t[ _(\[]|stamp|seconds",
    "cycle": r"cycle|^lap$|^trial$",
    "force": r"tension|force",
}
"""What the names of columns have in them, by key of the sidecar."""
_NOT = {
    "drive": r"tension|force|_n$|time|^drive_[2-4]_",
    "angle": r"time|^angle_2_",
    "time": r"tendon",
    "cycle": r"time",
    "force": r"time",
}


@dataclass(frozen=True, eq=False)
class BenchTable:
    """A table of numbers with named columns, and what had to be understood to read it.

    ``columns`` has the values by name, each of shape (m,), NaN where a cell is no number; ``lines`` are the lines of
    the file, shape (m,). ``plain`` says whether the record reader can read the file as it is.
    """

    path: Path
    columns: dict[str, Floats]
    lines: tuple[int, ...]
    delimiter: str
    comments: int
    decimal_comma: bool
    plain: bool

    def numbers(self, name: str) -> Floats:
        """Give a column, shape (m,).

        Raises
        ------
        RecordError
            A column that is missing, or a cell that is no number; one line with its place.
        """
        if name not in self.columns:
            raise RecordError(f"{self.path}: column {name!r} missing: the columns are {', '.join(self.columns)}")
        values = self.columns[name]
        for i in np.flatnonzero(~np.isfinite(values))[:1]:
            raise RecordError(f"{self.path}:{self.lines[i]}: column {name!r}: expected a number in every row")
        return values


def read_bench_csv(path: Path) -> BenchTable:
    """Read a CSV with commas, semicolons, tabs or spaces, comment lines, and decimal points or commas.

    Raises
    ------
    RecordError
        A file that cannot be read, without a line of names above its numbers, or with rows of another length.
    """
    text = read_text(path, "a CSV file")
    every = list(enumerate(text.splitlines(), start=1))
    kept = [(number, line) for number, line in every if line.strip() and not line.lstrip().startswith(COMMENTS)]
    if len(kept) < 2:
        raise RecordError(f"{path}: {len(kept)} lines with values: expected a header that names the columns, then rows")
    delimiter = _delimiter([line for _, line in kept[:20]])
    rows = [_cells(line, delimiter) for _, line in kept]
    names = [name.strip() for name in rows[0]]
    if any(_is_number(name) for name in names):
        raise RecordError(f"{path}:{kept[0][0]}: numbers in place of names: expected a line that names the columns")
    twice = next((name for i, name in enumerate(names) if name in names[:i]), None)
    if twice is not None:
        raise RecordError(f"{path}:{kept[0][0]}: column {twice!r} occurs twice: expected different names")
    for (number, _), row in zip(kept, rows, strict=True):
        if len(row) != len(names):
            raise RecordError(f"{path}:{number}: {len(row)} fields: expected {len(names)}, one a column")
    comma = delimiter != "," and any(_DECIMAL_COMMA.fullmatch(cell.strip()) for row in rows[1:20] for cell in row)
    cells = [[_number(cell, comma) for cell in row] for row in rows[1:]]
    if comma:  # beside decimal commas a point is for thousands, or a slip: 1.000 may be 1 or 1000
        _refuse_points(path, names, rows[1:], [number for number, _ in kept[1:]])
    return BenchTable(
        path=path,
        columns=dict(zip(names, np.array(cells, dtype=float).T, strict=True)),
        lines=tuple(number for number, _ in kept[1:]),
        delimiter=delimiter,
        comments=sum(line.lstrip().startswith(COMMENTS) for _, line in every),
        decimal_comma=comma,
        plain=delimiter == "," and len(kept) == len(text.rstrip().splitlines()) and '"' not in text,
    )


def _refuse_points(path: Path, names: Sequence[str], rows: Sequence[Sequence[str]], lines: Sequence[int]) -> None:
    """Refuse numbers that are another thousand times as large if their points are for thousands."""
    for line, row in zip(lines, rows, strict=True):
        for name, cell in zip(names, row, strict=True):
            if _THOUSANDS.fullmatch(cell.strip()):
                raise RecordError(
                    f"{path}:{line}: column {name!r} = {cell.strip()}: expected decimal commas, as in other cells, and "
                    "no points for thousands"
                )


def guess_column(table: BenchTable, key: str) -> str | None:
    """Find the one column whose name says that it is the drive, angle, time, cycle or force; None if none does.

    Raises
    ------
    RecordError
        Several columns that it could be, or one with another unit than the record's.
    """
    exact = {"drive": "drive_mm", "angle": "angle_deg", "time": "time_s", "cycle": "cycle", "force": "tendon_force_N"}[
        key
    ]
    if exact in table.columns:
        return exact
    found = [
        name
        for name in table.columns
        if re.search(_WORDS[key], name.lower()) and not re.search(_NOT[key], name.lower())
    ]
    if len(found) > 1:
        raise RecordError(
            f"{table.path}: columns {', '.join(map(repr, found))}: any of them may be the {key}: "
            f"expected --{'drive' if key == 'force' else key}-column NAME"
        )
    if found:
        require_unit(table, key, found[0])
    return found[0] if found else None


def require_unit(table: BenchTable, key: str, name: str) -> None:
    """Refuse a column whose name says another unit than a record has.

    Raises
    ------
    RecordError
        Such a name, found or given.
    """
    if (expected := expected_unit(key, name)) is not None:
        raise RecordError(f"{table.path}: column {name!r}: expected {expected}; convert it, or name another column")


def drive_unit_of(name: str) -> DriveUnit:
    """Give the unit that the name of a drive column says: mm, deg, step, or N of a force; mm if it says none."""
    words = re.sub(r"[^a-z]+", " ", name.lower()).split()
    if words[-1:] in (["n"], ["newton"], ["newtons"]) or {"force", "tension"} & set(words):
        return "N"
    return "deg" if "deg" in words else "step" if {"step", "steps"} & set(words) else "mm"


def _delimiter(lines: Sequence[str]) -> str:
    """Find the delimiter that splits all lines into the same number of fields, two or more; else the comma."""
    for delimiter in (";", "\t", ",", " "):
        counts = {len(_cells(line, delimiter)) for line in lines}
        if len(counts) == 1 and counts.pop() > 1:
            return delimiter
    return next((delimiter for delimiter in (";", "\t") if delimiter in lines[0]), ",")


def _cells(line: str, delimiter: str) -> list[str]:
    if delimiter == " ":
        return line.split()
    return next(csv.reader([line], delimiter=delimiter), [])


def _is_number(text: str) -> bool:
    return bool(np.isfinite(_number(text, comma=True)))


def _number(text: str, comma: bool) -> float:
    text = text.strip()
    if comma and _DECIMAL_COMMA.fullmatch(text):
        text = text.replace(",", ".")
    try:
        return float(text) if text.isascii() and "_" not in text else float("nan")
    except ValueError:
        return float("nan")
