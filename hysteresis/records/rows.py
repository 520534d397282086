"""Rows of a table, ``[[notch]]`` in a TOML file: one row a notch, or one for several equal ones."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from itertools import chain, repeat
from pathlib import Path
from sys import float_info
from typing import Any

from hysteresis.files import RecordError
from hysteresis.messages import as_given, quoted

Value = str | bool | float | list[float]
"""What a table of rows holds: one for all notches, or a list of one for each."""
MOST_ROWS = 1_000
"""Most notches of a tube."""


def is_number(value: object) -> bool:
    """Whether a value of a TOML file is a finite number that a float can hold."""
    return isinstance(value, int | float) and not isinstance(value, bool) and abs(value) <= float_info.max


def table_of_rows(where: Path | str, name: str, rows: Sequence[object]) -> Mapping[str, Value]:
    """Make one table of rows: a number for all where the rows have the same, else a list of one for each notch.

    A row stands for ``count`` notches, 1 by default. Texts and switches must be the same in all rows.

    Raises
    ------
    RecordError
        One line with file, row, key, value and what was expected.
    """
    if not 1 <= len(rows) <= MOST_ROWS:
        raise RecordError(f"{where}: [[{name}]]: {len(rows):,} rows: expected at most {MOST_ROWS:,}")
    counts, tables, last = list[int](), list[Mapping[str, Any]](), 0
    for number, row in enumerate(rows, start=1):
        at = f"{where}: [[{name}]] row {number}"
        if not isinstance(row, Mapping):
            raise RecordError(f"{at} = {quoted(row)}: expected a table")
        count = row.get("count", 1)
        if isinstance(count, bool) or not isinstance(count, int) or not 1 <= count <= MOST_ROWS - last:
            raise RecordError(f"{at}: count = {quoted(count)}: expected at least 1, at most {MOST_ROWS:,} in all rows")
        last += count
        counts.append(count)
        tables.append({key: value for key, value in row.items() if key != "count"})
    for number, table in enumerate(tables[1:], start=2):
        _require_like(f"{where}: [[{name}]] row {number}", table, tables[0])
    out: dict[str, Value] = {"count": last}
    for key, first in tables[0].items():
        values = [table[key] for table in tables]
        if not isinstance(first, str | bool) and not all(map(is_number, values)):
            wrong = next(k for k, value in enumerate(values) if not is_number(value))
            found = f"{where}: [[{name}]] row {wrong + 1}: {as_given(key)} = {quoted(values[wrong])}"
            raise RecordError(f"{found}: expected a number")
        same = all(value == first for value in values)
        out[key] = first if same else list(chain.from_iterable(map(repeat, values, counts)))
    return out


def _require_like(at: str, row: Mapping[str, Any], first: Mapping[str, Any]) -> None:
    """Refuse a row that has other keys than the first one, or another text or switch."""
    for key in first:
        if key not in row:
            raise RecordError(f"{at}: {as_given(key)}: missing, expected the keys of row 1")
    for key, value in row.items():
        if key not in first:
            raise RecordError(f"{at}: {as_given(key)} = {quoted(value)}: expected the keys of row 1")
        if isinstance(first[key], str | bool) and not (type(value) is type(first[key]) and value == first[key]):
            raise RecordError(f"{at}: {as_given(key)} = {quoted(value)}: expected {quoted(first[key])}, as of row 1")


def check_list(name: str, values: Sequence[object]) -> None:
    """Refuse a list that is not one number for each notch.

    Raises
    ------
    RecordError
        One line with ``name``, the notch, its value and what was expected.
    """
    if not 1 <= len(values) <= MOST_ROWS:
        raise RecordError(f"{name} = {len(values):,} numbers: expected one a notch, at most {MOST_ROWS:,}")
    for number, value in enumerate(values, start=1):
        if not is_number(value):
            raise RecordError(f"{name} of notch {number} = {quoted(value)}: expected a number")
