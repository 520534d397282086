"""Sheets of a spreadsheet, ``.xlsx``, as rows of cells."""

from __future__ import annotations

import io
import warnings
import zipfile
from collections.abc import Sequence
from pathlib import Path
from typing import Any

from hysteresis.extras import require_extra
from hysteresis.files import MB, MOST_BYTES, RecordError
from hysteresis.messages import as_given, listed, quoted
from hysteresis.records.record_file import MOST_COLUMNS
from studies.own_rig.tables.cells import Cell
from studies.own_rig.tables.layout import Grid, Layout, layout_of
from studies.own_rig.tables.table import MOST_CELLS, BenchTable

_MOST_EMPTY = 10_000
"""Rows without a value, one below the other, after which a sheet ends."""


def read_spreadsheet(path: Path, content: bytes, sheet: str | None = None) -> BenchTable:
    """Read one sheet; cells with a formula have the value that the spreadsheet stored.

    Raises
    ------
    RecordError
        No spreadsheet, no sheet with a table, or several of them.
    MissingError
        Without openpyxl.
    """
    sheets = _sheets(path, content, sheet)
    found, failed = dict[str, Layout](), list[RecordError]()
    for name, grid in sheets.items():
        try:
            found[name] = layout_of(grid)
        except RecordError as error:
            failed.append(error)
    if len(found) > 1:
        raise RecordError(f"{path}: sheets {listed(map(repr, found))} have tables: expected --sheet NAME")
    if not found:
        raise failed[0] if failed else RecordError(f"{path}: no cell with a value: expected a table")
    ((name, layout),) = found.items()
    return BenchTable(
        path=path,
        columns=layout.columns,
        lines=layout.lines,
        kind="xlsx",
        sheet=name,
        named=layout.header is not None,
        notes=layout.notes,
    )


def _sheets(path: Path, content: bytes, sheet: str | None) -> dict[str, Grid]:
    """Give the cells of the sheets, or of the one that is asked for, with the numbers of their rows."""
    try:
        with zipfile.ZipFile(io.BytesIO(content)) as archive:
            members = {one.filename: one.file_size for one in archive.infolist()}
    except Exception as error:
        raise RecordError(f"{path}: not a whole file: {as_given(str(error))}: expected a spreadsheet, .xlsx") from None
    if "xl/workbook.xml" not in members:
        raise RecordError(f"{path}: an archive without a workbook: expected a spreadsheet saved as .xlsx, or a CSV")
    if sum(members.values()) > MOST_BYTES:
        raise RecordError(f"{path}: unpacked more than {MOST_BYTES / MB:,.0f} MB: expected a smaller spreadsheet")
    require_extra("tables", "tables in .xlsx and .parquet")
    import openpyxl

    with warnings.catch_warnings():  # of styles and extensions, which say nothing of the cells
        warnings.simplefilter("ignore")
        try:
            book: Any = openpyxl.load_workbook(io.BytesIO(content), read_only=True, data_only=True)
            names = [one.title for one in book.worksheets]
            wanted = names if sheet is None else [_named(path, names, sheet)]
            return {name: _cells(path, book[name]) for name in wanted}
        except RecordError:
            raise
        except Exception as error:  # of XML, of archives, of numbers: whatever a broken file makes the library raise
            found = as_given(f"{type(error).__name__}: {error}", 120)
            raise RecordError(f"{path}: not read: {found}: expected a spreadsheet, .xlsx") from None


def _named(path: Path, names: Sequence[str], sheet: str) -> str:
    if sheet in names:
        return sheet
    if sheet.isdecimal() and sheet.isascii() and len(sheet) < 6 and 1 <= int(sheet) <= len(names):
        return names[int(sheet) - 1]
    raise RecordError(f"{path}: --sheet {quoted(sheet)}: expected one of {listed(map(repr, names))}")


def _cells(path: Path, sheet: Any) -> Grid:
    sheet.reset_dimensions()  # what the file says of them may be wrong
    lines, rows, empty, width, count = list[int](), list[Sequence[Cell]](), 0, 0, 0
    for number, row in enumerate(sheet.iter_rows(values_only=True), start=1):
        cells = list(row)
        while cells and cells[-1] is None:
            cells.pop()
        if not any(cell is not None and str(cell).strip() for cell in cells):
            empty += 1
            if empty > _MOST_EMPTY:
                break
            continue
        empty, width, count = 0, max(width, len(cells)), count + len(cells)
        if width > MOST_COLUMNS:
            raise RecordError(f"{path}:{number}: {width:,} columns: expected at most {MOST_COLUMNS:,}")
        if count > MOST_CELLS:
            raise RecordError(f"{path}: sheet {quoted(sheet.title)}: expected at most {MOST_CELLS:,} cells")
        lines.append(number)
        rows.append([_plain(cell) for cell in cells])
    return Grid(path, lines, [[*row, *[None] * (width - len(row))] for row in rows], comments=[])


def _plain(cell: Any) -> Cell:
    if isinstance(cell, bool):
        return str(cell)
    return float(cell) if isinstance(cell, int) and abs(cell) < 2**53 else cell
