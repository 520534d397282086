"""Where the names, the units and the numbers of a table stand, between what else a logger writes above and below."""

from __future__ import annotations

import re
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from hysteresis.files import RecordError
from hysteresis.messages import as_given, listed, quoted
from hysteresis.records.record_file import MOST_COLUMNS, STATISTICS
from hysteresis.records.units import UNITS, unit_called
from studies.own_rig.tables.cells import Cell, Marks, MarksError, find_marks, is_missing, is_value, parse
from studies.own_rig.tables.table import Column, require_size

_LOOKED_AT = 400
"""Rows above the numbers, at most."""
_ROWS_OF_PROFILE = 3
_ROWS_OF_DECIMALS = 30
"""Rows that show how many decimals the numbers of a column have."""
_MOST_OF_NAMES = 4
"""Rows of names, units and types above the numbers."""
_MOST_OF_MEANS = 5
"""Rows of means, sums or limits at the end."""
_WHEN = re.compile(r"\W*(date|time|samples?|x0|start(ed)?|datum|uhrzeit|heure)\W*", re.IGNORECASE)
"""First cells of the rows above the names that may differ where a logger writes them again."""
_MOST_BELOW = 50
"""Lines below the numbers that are left out, at most."""
_OTHER_UNITS = frozenset(
    ["", "-", "--", "1", "none", "unit", "units", "n.a.", "string", "text", "bool", "datetime", "date", "time", "c",
     "k", "f", "w", "hh:mm:ss", "hh:mm:ss.fff"]
)  # fmt: skip


_TYPES = frozenset(
    ["float", "float32", "float64", "double", "single", "real", "int", "int32", "int64", "integer", "string", "text",
     "str", "object", "number", "numeric", "bool", "f4", "f8", "datetime", "datetime64[ns]"]
)  # fmt: skip
"""Words of a row that says the types of the columns."""


_REMARKS = frozenset(["comment", "comments", "note", "notes", "remark", "remarks", "marker", "event"])
"""Names of a last column that few rows have, or none."""


@dataclass(frozen=True, eq=False)
class Grid:
    """Rows of cells with their lines, as they stand in a file; empty rows and comments are left out.

    ``comments`` are comment lines with their line numbers, without the mark and split into cells. ``marks`` are the
    marks that numbers may have: a comma, a point, or both.
    ``cut_off`` says whether the last line may be incomplete.
    """

    path: Path
    lines: list[int]
    rows: list[Sequence[Cell]]
    comments: list[tuple[int, Sequence[Cell]]]
    cut_off: bool = False
    quoted_commas: bool = False
    marks: str = ",."

    def where(self, row: int) -> str:
        """Name the line of a row in a message."""
        return f"{self.path}:{self.lines[row]}"


@dataclass(frozen=True, eq=False)
class Layout:
    """Columns by name with the line of each row; ``header`` is the line of the names, None where there are none."""

    columns: dict[str, Column]
    lines: tuple[int, ...]
    header: int | None
    notes: tuple[str, ...]
    clean: bool


def layout_of(grid: Grid) -> Layout:
    """Find names, units and numbers.

    The numbers begin where a row has two of them or more and the next rows have numbers in the same columns. The names
    are the last row of texts above them, or else the last comment. A row of units may stand between.

    Raises
    ------
    RecordError
        No rows of numbers, rows of another length, names that occur twice, or marks that may be of decimals or not.
    """
    start = _start(grid)
    header, names, units = _names(grid, start)
    numbered = bool(names) and len(grid.rows) > start + 1 and _are_column_numbers(grid.rows[start])
    start += numbered
    width = len(names) if names else max(_filled(grid.rows[i]) for i in range(start, min(start + 3, len(grid.rows))))
    # notes to the right of the first rows may be of means, too: only the first cell counts
    skipped = next((i for i in range(start, len(grid.rows)) if not _is_statistic(_first(grid.rows[i]))), start) - start
    start += skipped
    if names and names[-1].lower() in _REMARKS:
        grid = replace(grid, rows=[[*row, ""] if len(row) == width - 1 else row for row in grid.rows])
    grid, of_rows = _without_row_names(grid, start, width if names else 0)
    rows, lines, notes = _rows_of_numbers(grid, start, header, width)
    notes += of_rows
    if skipped:
        notes.append(f"{skipped} row{'s' * (skipped > 1)} of means or limits above the numbers left out")
    require_size(grid.path, width, len(rows))
    if numbered:
        notes.append("a row that numbers the columns left out")
    names_or = names or [str(k + 1) for k in range(width)]
    kept, dropped = _columns_kept(grid, header, names_or, rows)
    if dropped:
        notes.append(f"{dropped} empty column{'s' * (dropped > 1)} without a name left out")
    marks = _marks(grid, rows, lines)
    columns = {names_or[k]: Column([row[k] for row in rows], units[k] if k < len(units) else "", marks) for k in kept}
    start -= skipped
    above = [line for line in grid.lines[:start] if line != header] if header in grid.lines else grid.lines[:start]
    if any(units):
        notes.append(f"units: {listed(f'{name} in {col.unit}' for name, col in columns.items() if col.unit)}")
        above = above[:-1]
    if above:
        notes.insert(0, f"{len(above)} line{'s' * (len(above) > 1)} above the names left out")
    return Layout(columns, tuple(lines), header if names else None, tuple(notes), clean=not notes)


def _without_row_names(grid: Grid, start: int, width: int) -> tuple[Grid, list[str]]:
    """Leave out a column without a name that numbers the rows from 1, as R does; ``width`` is that of the names."""
    rows = grid.rows[start:]
    numbers = [str(k + 1) for k in range(len(rows))]
    if width < 2 or len(rows) < _ROWS_OF_PROFILE:
        return grid, []
    if any(
        len(row) != width + 1 or _is_empty(row[-1]) or str(row[0]).strip() != k
        for row, k in zip(rows, numbers, strict=True)
    ):
        return grid, []
    note = "a first column without a name, which numbers the rows, left out"
    return replace(grid, rows=[*grid.rows[:start], *(row[1:] for row in rows)]), [note]


def _first(row: Sequence[Cell]) -> Sequence[Cell]:
    return next(([cell] for cell in row if not _is_empty(cell)), [])


def _is_statistic(row: Sequence[Cell]) -> bool:
    """Tell whether a cell of a row says that it is of means, limits or sums."""
    return any(isinstance(cell, str) and cell.strip(" .:").lower() in STATISTICS for cell in row)


def _are_column_numbers(row: Sequence[Cell]) -> bool:
    """Tell whether a row counts the columns: 1, 2, 3 ..."""

    def value(cell: Cell) -> str:
        return f"{cell:g}" if isinstance(cell, float) else str(cell).strip()

    return len(row) > 2 and [value(cell) for cell in row] == [str(k + 1) for k in range(len(row))]


def _filled(row: Sequence[Cell]) -> int:
    """Count the cells of a row up to the last one that is not empty."""
    return next((k + 1 for k in reversed(range(len(row))) if not _is_empty(row[k])), 0)


def _is_empty(cell: Cell) -> bool:
    return cell is None or (isinstance(cell, str) and not cell.strip())


def _start(grid: Grid) -> int:
    """Find the first row of numbers."""
    rows, wide = grid.rows, next((i for i, row in enumerate(grid.rows) if len(row) > MOST_COLUMNS), None)
    if wide is not None:
        raise RecordError(f"{grid.where(wide)}: more than {MOST_COLUMNS:,} columns: expected at most that")
    values = [[is_value(cell) for cell in row] for row in rows[: _LOOKED_AT + _ROWS_OF_PROFILE + 1]]
    for i, mine in enumerate(values[:_LOOKED_AT]):
        if sum(mine) >= 2 and all(_fits(rows[i], mine, later) for later in values[i + 1 : i + 1 + _ROWS_OF_PROFILE]):
            while i > 0 and any(values[i - 1]) and _fits(rows[i - 1], values[i - 1], mine):
                i -= 1
            return i
    found = f"{grid.path}: {len(rows)} lines with values" if len(rows) < 2 else f"{grid.path}: no rows of numbers"
    raise RecordError(f"{found}: expected a header that names the columns, then rows")


def _fits(row: Sequence[Cell], mine: Sequence[bool], later: Sequence[bool]) -> bool:
    """Tell whether a row has numbers, or nothing, wherever a later one has numbers, and is as long."""
    if len(mine) != len(later) and abs(len(mine) - len(later)) > 1:
        return False
    return sum(later) >= 2 and all(a or is_missing(cell) for cell, a, b in zip(row, mine, later, strict=False) if b)


def _names(grid: Grid, start: int) -> tuple[int | None, list[str], list[str]]:
    """Find the line of the names, the names, and the units of a row of units; empty where there are none."""
    units, of_units = _labelled_units(grid, start), 0
    profile = grid.rows[start + 1 : start + 1 + _ROWS_OF_PROFILE] or grid.rows[start : start + 1]
    numbers = {k for row in profile for k, cell in enumerate(row) if is_value(cell)}
    for i in range(start - 1, max(start - 5, -1), -1):
        texts = ["" if cell is None else re.sub(r"\s+", " ", str(cell)).strip() for cell in grid.rows[i]]
        filled = [text for text in texts if text]
        if len(filled) >= 2 and all(text.lower() in _TYPES for text in filled):
            continue
        if not units and len(filled) >= 2 and _are_units(filled):
            units, of_units = texts, grid.lines[i]
        elif len(filled) >= 2 and not any(is_value(cell) for k, cell in enumerate(grid.rows[i]) if k in numbers):
            if len(set(filled)) < len(filled) and _has_better_names(grid, i, len(numbers)):
                continue
            names = texts[: _filled(grid.rows[i])]
            if not units and i > 0:  # units above the names
                above = ["" if cell is None else str(cell).strip() for cell in grid.rows[i - 1]]
                if len(above) == len(texts) and sum(map(bool, above)) >= 2 and _are_units([x for x in above if x]):
                    units = above
            return grid.lines[i], names, units
    line = grid.lines[start]
    width = _filled(grid.rows[start])
    for at, cells in reversed([one for one in grid.comments if one[0] < line]):
        texts = [str(cell).strip() for cell in cells]
        if len(texts) in (width, len(grid.rows[start])) and all(texts) and not any(map(is_value, cells)):
            if not units and _are_units(texts):
                units, of_units = texts, at
                continue
            return at, texts, units
    if units and all(units):  # they stand in place of names
        return of_units, units, units
    return None, [], units


def _labelled_units(grid: Grid, start: int) -> list[str]:
    """Give the units of the channels that LabVIEW writes above the names; empty where it does not."""
    for i in range(start - 1, max(start - 12, -1), -1):
        if str(grid.rows[i][0]).strip() == "Y_Unit_Label":
            return ["", *(str(cell or "").strip() for cell in grid.rows[i][1:])]
    return []


def _has_better_names(grid: Grid, row: int, columns: int) -> bool:
    """Tell whether one of the next rows above has a text of its own for each column."""
    for above in grid.rows[max(row - 4, 0) : row]:
        texts = [str(cell).strip() for cell in above if not _is_empty(cell)]
        if len(set(texts)) == len(texts) >= columns and not any(map(is_value, texts)) and not _are_units(texts):
            return True
    return False


def _are_units(texts: Sequence[str]) -> bool:
    plain = [re.sub(r"\s+", "", text.strip(" []()")).lower() for text in texts]
    known = [text in UNITS or unit_called(text) is not None for text in plain]
    return any(known) and all(is_one or text in _OTHER_UNITS for is_one, text in zip(known, plain, strict=True))


def _rows_of_numbers(
    grid: Grid, start: int, header: int | None, width: int
) -> tuple[list[Sequence[Cell]], list[int], list[str]]:
    """Give the rows of numbers, each of the width of the names, with their lines, and notes on what is left out."""
    stop, notes, cut = len(grid.rows), list[str](), 0
    if (
        grid.cut_off
        and stop - start > 1
        and (len(grid.rows[-1]) < min(width, len(grid.rows[-2])) or _is_cut(grid.rows[start:stop]))
    ):
        stop, cut = stop - 1, 1
        notes.append(f"line {grid.lines[-1]}, which is cut off, left out")
    while stop > start + 1 and len(grid.rows) - stop < _MOST_BELOW and _is_below(grid.rows[stop - 1], grid.rows[start]):
        stop -= 1
    while (
        stop > start + 1
        and _is_statistic(grid.rows[stop - 1])
        and (_is_statistic(_first(grid.rows[stop - 1])) or not _rises_on(grid.rows[start:stop], stop - 1 - start))
    ):
        stop -= 1
    if behind := _behind_a_gap(grid, start, stop):
        stop, cut = stop - behind, cut + behind
        notes.append(f"{behind} row{'s' * (behind > 1)} behind an empty line left out")
    below = len(grid.rows) - stop - cut
    if below:
        notes.append(f"{below} line{'s' * (below > 1)} below the numbers left out")
    rows, lines, repeated, names_at = list[Sequence[Cell]](), list[int](), 0, start - _MOST_OF_NAMES
    worded = not is_value(grid.rows[start][0]) and not is_missing(grid.rows[start][0])
    begins = {str(grid.rows[i][0]): i for i in range(max(0, names_at) if worded else 0, start)
              if not is_value(grid.rows[i][0]) and not is_missing(grid.rows[i][0])}  # fmt: skip
    begins = {first: i for first, i in begins.items() if not worded or first != grid.rows[start][0]}
    for line, row in zip(grid.lines[start:stop], grid.rows[start:stop], strict=True):
        if row[0] in begins and _is_repeated(grid, begins[str(row[0])], line, row, names_at):
            repeated += 1
            continue
        if len(row) != width:
            if len(row) < width or any(not _is_empty(cell) for cell in row[width:]):
                raise RecordError(f"{grid.path}:{line}: {_filled(row) if len(row) > width else len(row)} fields: "
                                  f"expected {width}, one a column{_of_commas(row, width)}")  # fmt: skip
            row = row[:width]
        rows.append(row)
        lines.append(line)
    if repeated:
        notes.append(f"names that are repeated below left out: {repeated} line{'s' * (repeated > 1)}")
    return rows, lines, notes


def _is_repeated(grid: Grid, above: int, line: int, row: Sequence[Cell], names_at: int) -> bool:
    """Tell whether a row is one of those above the numbers again, or says when again: a logger that began anew.

    Raises
    ------
    RecordError
        Other names, or other words about the numbers: a second table.
    """
    first, pair = grid.rows[above], (list(grid.rows[above]), list(row))
    if pair[0][: _filled(first)] == pair[1][: _filled(row)] or (above < names_at and _WHEN.fullmatch(str(row[0]))):
        return True
    found = f"{grid.path}:{line}: {quoted(str(row[0]))} as in line {grid.lines[above]}, and not the same behind it"
    raise RecordError(f"{found}: expected one table in a file")


def _behind_a_gap(grid: Grid, start: int, stop: int) -> int:
    """Count the few rows at the end that stand behind the only empty line: means or sums without a word."""
    gaps = [i for i in range(start + 1, stop) if grid.lines[i] - grid.lines[i - 1] > 1]
    if len(gaps) != 1 or stop - gaps[0] > _MOST_OF_MEANS or gaps[0] - start <= _MOST_OF_MEANS:
        return 0
    before, behind = grid.lines[gaps[0] - 1], grid.lines[gaps[0]]
    if any(before < line < behind for line, _ in grid.comments) or _rises_on(grid.rows[start:stop], gaps[0] - start):
        return 0
    return stop - gaps[0]


def _rises_on(rows: Sequence[Sequence[Cell]], at: int) -> bool:
    """Tell whether a column that rises from row to row, as a time does, still does at a row: it is a sample."""
    for cells in zip(*rows[: at + 1], strict=False):
        parsed = parse([cell.replace(",", ".") if isinstance(cell, str) else cell for cell in cells], Marks())
        if parsed.wrong is None and bool((np.diff(parsed.values) > 0).all()):
            return True
    return False


def _is_cut(rows: Sequence[Sequence[Cell]]) -> bool:
    """Tell whether the last cell has fewer decimals than all others of its column, which have equally many."""
    ends = [str(row[-1]).strip() for row in rows[-_ROWS_OF_DECIMALS:] if row]
    decimals = [len(end) - 1 - max(end.rfind("."), end.rfind(",")) if re.search(r"\d[.,]", end) else 0 for end in ends]
    return len(ends) == _ROWS_OF_DECIMALS and set(decimals[:-1]) == {decimals[-2]} and decimals[-1] < decimals[-2]


def _of_commas(row: Sequence[Cell], width: int) -> str:
    """Say what to do where decimal commas stand between commas."""
    if len(row) == 2 * width and all(isinstance(cell, str) and cell.strip("+- ").isdigit() for cell in row):
        return "; where these are decimal commas, semicolons or quotes between the fields"
    return ""


def _is_below(row: Sequence[Cell], first: Sequence[Cell]) -> bool:
    """Tell whether a row is of words below the numbers: it begins with a word where the first row has none."""
    k = next((k for k, cell in enumerate(row) if not _is_empty(cell)), 0)
    cell = row[k]
    if not isinstance(cell, str) or is_missing(cell):
        return False
    word = not is_value(cell) and len(cell.strip()) > 1 and cell.strip()[0].isalpha()
    return not any(map(is_value, row)) or (word and k < len(first) and is_value(first[k]))


def _columns_kept(
    grid: Grid, header: int | None, names: list[str], rows: Sequence[Sequence[Cell]]
) -> tuple[list[int], int]:
    """Give the columns that have a name, each name once, and count the empty ones; names without are numbered."""
    kept, dropped = dict[str, int](), 0
    for k, name in enumerate(names):
        if not name:
            if all(_is_empty(row[k]) for row in rows):
                dropped += 1
                continue
            name = names[k] = f"column {k + 1}"
        if name in kept:
            if any(row[k] != row[kept[name]] for row in rows):
                where = f"{grid.path}:{header}"
                raise RecordError(f"{where}: column {quoted(name)} occurs twice: expected different names")
            continue
        kept[name] = k
    return list(kept.values()), dropped


def _marks(grid: Grid, rows: Sequence[Sequence[Cell]], lines: Sequence[int]) -> Marks:
    if "," not in grid.marks:
        return Marks()
    try:
        return find_marks(_marked(rows), quoted_commas=grid.quoted_commas, points="." in grid.marks)
    except MarksError as error:
        i, k = next((i, k) for i, row in enumerate(rows) for k, cell in enumerate(row)
                    if isinstance(cell, str) and cell.strip() == error.cell)  # fmt: skip
        name = next((row[k] for line, row in zip(grid.lines, grid.rows, strict=True) if line < lines[0]
                     and k < len(row) and not _is_empty(row[k]) and len(row) > 1), str(k + 1))  # fmt: skip
        found = f"{grid.path}:{lines[i]}: column {quoted(name)} = {as_given(error.cell)}"
        raise RecordError(f"{found}: {error.expected}") from None


def _marked(rows: Sequence[Sequence[Cell]]) -> Iterator[str]:
    for row in rows:
        for cell in row:
            if isinstance(cell, str) and ("," in cell or "." in cell):
                yield cell
