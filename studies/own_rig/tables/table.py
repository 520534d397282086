"""A table of the bench: columns by name, and what had to be understood to read them."""

from __future__ import annotations

from dataclasses import dataclass, field
from functools import cached_property
from pathlib import Path

import numpy as np

from hysteresis.arrays import Floats
from hysteresis.files import RecordError
from hysteresis.messages import as_given, listed, quoted
from hysteresis.records.record_file import MOST_COLUMNS
from studies.own_rig.tables.cells import Cell, Marks, Parsed, parse

MOST = 1e20
"""Largest magnitude of a number in any unit; that of a clock in ns is 2e18."""
MOST_CELLS = 50_000_000
"""Most cells of a table."""


@dataclass(frozen=True, eq=False)
class Column:
    """Cells of one column, the unit that a row of units says (empty where there is none), and their marks."""

    cells: list[Cell] | Floats
    unit: str = ""
    marks: Marks = field(default_factory=Marks)

    @cached_property
    def parsed(self) -> Parsed:
        """The numbers, made when they are asked for: most columns of a wide log are not."""
        return parse(self.cells, self.marks)


@dataclass(frozen=True, kw_only=True, eq=False)
class BenchTable:
    """Columns by name, with the line of each row, shape (m,), and how the file was written.

    ``plain`` says whether the reader of records can read the file as it is. ``notes`` are sentences on what was left
    out or taken as what. ``kind`` is CSV, xlsx, parquet or mat.
    """

    path: Path
    columns: dict[str, Column]
    lines: tuple[int, ...]
    kind: str = "CSV"
    encoding: str = ""
    sheet: str = ""
    delimiter: str = ""
    comments: int = 0
    named: bool = True
    plain: bool = False
    notes: tuple[str, ...] = ()

    @property
    def decimal_comma(self) -> bool:
        """Whether numbers have decimal commas."""
        return any(column.marks.decimal == "," for column in self.columns.values())

    def require(self, name: str) -> Column:
        """Give a column.

        Raises
        ------
        RecordError
            A column that is missing.
        """
        if name not in self.columns:
            there = listed(self.columns)
            raise RecordError(f"{self.path}: column {quoted(name)} missing: the columns are {there}")
        return self.columns[name]

    def numbers(self, name: str) -> Floats:
        """Give a column, shape (m,), nan where a cell is empty or says that there is no number.

        Raises
        ------
        RecordError
            A column that is missing, or a cell that is no number; one line with its place.
        """
        parsed = self.require(name).parsed
        wrong, expected = parsed.wrong, "a number in every row"
        for i in np.flatnonzero(np.abs(parsed.values) > MOST)[:1] if wrong is None else ():
            wrong = int(i)
            expected = expected if np.isinf(parsed.values[i]) else f"at most {MOST:g} in magnitude"
        if wrong is not None:
            text = as_given(str(self.columns[name].cells[wrong]).strip())
            found = f"{self.path}:{self.lines[wrong]}: column {quoted(name)} = {text}"
            raise RecordError(f"{found}: expected {expected}")
        return parsed.values


def require_size(path: Path | str, columns: int, rows: int) -> None:
    """Refuse a table that is too large, before it is made.

    Raises
    ------
    RecordError
        More columns or cells than a table may have.
    """
    if columns > MOST_COLUMNS:
        raise RecordError(f"{path}: {columns:,} columns: expected at most {MOST_COLUMNS:,}")
    if columns * rows > MOST_CELLS:
        raise RecordError(f"{path}: {columns * rows:,} cells: expected at most {MOST_CELLS:,}")
