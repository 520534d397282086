"""The samples of a record out of a table: units converted, times in order, angles unwrapped."""

from __future__ import annotations

import re
from collections.abc import Mapping
from dataclasses import dataclass, replace
from itertools import pairwise

import numpy as np

from hysteresis.arrays import Floats, Ints
from hysteresis.files import RecordError
from hysteresis.messages import listed, quoted
from hysteresis.records.path import find_cycles
from hysteresis.records.record import FIELDS, LIST_FIELDS, DriveUnit, bad_cycles
from hysteresis.records.units import UNITS, Unit
from hysteresis.records.wrapped import unwrapped, wraps
from studies.own_rig.columns import BenchColumns, Known, Reading, further_channels, known_columns
from studies.own_rig.tables import BenchTable, Column

_CLOCKS = {"ms": (1e11, 1e13), "us": (1e14, 1e16), "ns": (1e17, 1e19)}
"""Units of time in which a clock that counts from 1970 has values in this range now."""
_DAY_S = 86_400.0
_LARGE_S = 1e8
_SLOW_S = 1.0
"""Time between rows above which the seconds that nothing says may be milliseconds."""
_RESTARTS = 0.1
"""Part of the range of times: a fall to within it of the first one is a trial that begins anew."""
_OF_ONE = re.compile(r"pre-?load|pretension|specimen|sample_?(id|name)|device|prototype|vorspannung|probe_?nr")
"""Names of columns whose value is one for a whole record."""
_MOST_SPECIMENS = 20
_APART = 0.05
"""Part of the largest preload by which two differ that are set; below it, one is measured and drifts."""
_FEWEST = 5
"""Rows of a trial, at least."""
_DAYS = ((30_000.0, 80_000.0), (700_000.0, 800_000.0))
"""Days from 1900, as spreadsheets count them, and from the year 0, as MATLAB does, between 1982 and 2119."""
_MOST_DAYS = 1e-4
"""Days between rows, at most, where times are days: seconds would be of more than 10,000 samples a second."""
_STAMP = re.compile(r"(.*?)(nanosecs?|nanoseconds|nsecs?)", re.IGNORECASE)


@dataclass(frozen=True, eq=False)
class Samples:
    """Arrays by field of a record, its columns in the table, and notes on what was understood.

    ``as_they_are``: the columns of the file hold these numbers, row by row.
    """

    values: Mapping[str, Floats]
    columns: BenchColumns
    drive_unit: DriveUnit
    notes: tuple[str, ...]
    as_they_are: bool


def samples_of(table: BenchTable, reading: Reading) -> Samples:
    """Take the samples out of a table.

    Raises
    ------
    RecordError
        Columns that are not found, a cell that is no number, no row with drive and angle, or times that do not rise.
    """
    known, notes = known_columns(table, reading), list(table.notes)
    notes += known.notes
    moves = "force" if "force" in known.columns else "drive"
    drive_unit = _drive_unit(known.units[moves])
    rows = _rows(table, known, notes)
    whole = np.array_equal(rows, np.arange(len(table.lines)))
    further = further_channels(table, drive_unit, known.columns.values(), rows)
    columns: BenchColumns = {**known.columns, **further}
    rows = _filled(table, known, _once(table, columns, rows), notes)
    _require_one_specimen(table, columns, rows)
    raw = {key: table.numbers(name)[rows] for key, name in known.columns.items()}
    values = {"drive": raw[moves] * (1.0 if drive_unit == "step" else known.units[moves].factor)}
    values["angle_deg"] = _angle(known, values["drive"], raw["angle"], notes)
    if "time" in raw:
        values["time_s"] = _times(table, known, raw["time"], rows, notes)
    if "cycle" in raw:
        given = bool(reading.columns.get("cycle"))
        if _is_cycle(known.columns["cycle"], raw["cycle"], values, given, notes):
            values["cycle"] = raw["cycle"]
        else:
            del columns["cycle"]
    for key, names in further.items():
        if isinstance(names, str):
            values[FIELDS[key]] = table.numbers(names)[rows]
        else:
            values[LIST_FIELDS[key]] = np.column_stack([table.numbers(name)[rows] for name in names])
    pairs = ((moves, "drive"), ("angle", "angle_deg"), ("time", "time_s"))
    same = all(np.array_equal(raw[key], values[name]) for key, name in pairs if key in raw)
    clock = "time" in raw and table.columns[known.columns["time"]].parsed.clock
    in_place = whole and same and not clock and reading.angle_unit is None and reading.time_unit is None
    return Samples(values, columns, drive_unit, tuple(notes), as_they_are=in_place)


def _drive_unit(unit: Unit) -> DriveUnit:
    units: dict[str, DriveUnit] = {"length": "mm", "angle": "deg", "force": "N"}
    return units.get(unit.kind, "step")


def _rows(table: BenchTable, known: Known, notes: list[str]) -> Ints:
    """Give the rows with a drive, an angle and a time, in the order of time, and note how many are without.

    Raises
    ------
    RecordError
        No rows with all of them.
    """
    kept = np.ones(len(table.lines), dtype=bool)
    for key, name in known.columns.items():
        if key == "cycle":
            continue
        without = np.isnan(_numbers(table, key, name)) & kept
        if left := int(without.sum()):
            first = table.lines[int(np.flatnonzero(without)[0])]
            rows = f"{left} row{'s' * (left > 1)}"
            notes.append(f"{rows} without a number in {quoted(name)} left out, line {first} first")
        kept &= ~without
    if not kept.any():
        names = listed(repr(name) for key, name in known.columns.items() if key != "cycle")
        raise RecordError(f"{table.path}: no row has numbers in {names}: expected all of them in one row")
    found = np.flatnonzero(kept)
    time = table.numbers(known.columns["time"])[found] if "time" in known.columns else np.empty(0)
    if time.size > 2 and (np.diff(time) < 0).all():
        notes.append(f"{quoted(known.columns['time'])} falls from row to row: rows in reverse order")
        found = found[::-1]
    return np.asarray(found, dtype=np.int64)


def _numbers(table: BenchTable, key: str, name: str) -> Floats:
    try:
        return table.numbers(name)
    except RecordError as error:
        empty = ", or an empty cell" if "a number in every row" in str(error) else ""
        raise RecordError(f"{error}; --no-time leaves it out" if key == "time" else f"{error}{empty}") from None


def _filled(table: BenchTable, known: Known, rows: Ints, notes: list[str]) -> Ints:
    """Leave out rows of zeros at the end, where the time is zero as well: a buffer that was not filled."""
    if "time" not in known.columns or table.columns[known.columns["time"]].parsed.clock:
        return rows
    zero = np.all([table.numbers(name)[rows] == 0 for key, name in known.columns.items() if key != "cycle"], axis=0)
    count = int(np.argmin(zero[::-1])) if zero[-1] and not zero.all() else 0
    if count == 0 or rows.size - count < _FEWEST:
        return rows
    notes.append(f"{count} row{'s' * (count > 1)} of zeros at the end, the time too, left out: a buffer not filled")
    return rows[:-count]


def _require_one_specimen(table: BenchTable, columns: BenchColumns, rows: Ints) -> None:
    """Refuse a table of several specimens or preloads, one below the other.

    Raises
    ------
    RecordError
        One line with the column and its values.
    """
    used = {name for names in columns.values() for name in ([names] if isinstance(names, str) else names)}
    for name, column in table.columns.items():
        if name in used or not _OF_ONE.search(name.lower()):
            continue
        cells = [str(column.cells[i]).strip() for i in rows.tolist()]
        values = list(dict.fromkeys(cells))
        changes = sum(a != b for a, b in pairwise(cells))
        if changes != len(values) - 1 or (column.parsed.wrong is None and _drifts(column.parsed.values[rows])):
            continue
        if 1 < len(values) <= _MOST_SPECIMENS and len(cells) >= _FEWEST * len(values):
            found = f"{table.path}: column {quoted(name)} has {listed(values, 60)}: a record is of one of them"
            raise RecordError(f"{found}: expected a table of each")


def _drifts(values: Floats) -> bool:
    """Tell whether values differ so little that they are measured, not set."""
    steps = np.diff(np.unique(np.abs(values)))
    return steps.size > 0 and bool(steps.min() < _APART * np.abs(values).max())


def _once(table: BenchTable, columns: BenchColumns, rows: Ints) -> Ints:
    """Drop samples that were logged twice, as where a record with times is read."""
    if "time" not in columns:
        return rows
    names = [name for names in columns.values() for name in ([names] if isinstance(names, str) else names)]
    values = np.column_stack([table.numbers(name)[rows] for name in names])
    return rows[np.r_[True, (np.diff(values, axis=0) != 0).any(axis=1)]]


def _angle(known: Known, drive: Floats, raw: Floats, notes: list[str]) -> Floats:
    angle = raw if known.units["angle"].factor == 1.0 else raw * known.units["angle"].factor
    if places := wraps(drive, angle).size:
        found = f"{quoted(known.columns['angle'])} is wrapped at a turn"
        notes.append(f"{found}: put back at {places} place{'s' * (places > 1)}")
    return unwrapped(drive, angle)


def _times(table: BenchTable, known: Known, raw: Floats, rows: Ints, notes: list[str]) -> Floats:
    """Give times in s that rise from row to row.

    Raises
    ------
    RecordError
        Times that stand still or fall, other than from trial to trial.
    """
    name = known.columns["time"]
    time = _seconds(table, known, raw, notes)
    lines, steps = np.array(table.lines)[rows], np.diff(time)
    falls = np.flatnonzero(steps < 0) + 1
    anew = falls[time[falls] - time[0] <= _RESTARTS * np.ptp(time)]
    if anew.size and anew.size == falls.size and (steps > 0).any():
        usual, time = float(np.median(steps[steps > 0])), time.copy()
        for i in anew.tolist():
            time[i:] += time[i - 1] + usual - time[i]
        found = f"{quoted(name)} begins anew at line {listed(lines[anew].tolist(), 40)}"
        notes.append(f"{found}: {anew.size + 1} trials, one behind the other")
    for i in np.flatnonzero(np.diff(time) <= 0)[:1]:
        found = f"{table.path}:{lines[i + 1]}: column {quoted(name)} = {time[i + 1]:.12g} after {time[i]:.12g}"
        raise RecordError(f"{found}: expected increasing time; --no-time leaves it out")
    return time


def _seconds(table: BenchTable, known: Known, raw: Floats, notes: list[str]) -> Floats:
    name, unit = known.columns["time"], known.units["time"]
    if table.columns[name].parsed.clock:
        notes.append(f"{quoted(name)} is a clock: seconds from the first row")
        return np.asarray(raw - raw[0])
    size = float(np.abs(raw).max())
    if "time" in known.assumed:
        clock = next((symbol for symbol, (a, b) in _CLOCKS.items() if a < size < b), None)
        unit = unit if clock is None else UNITS[clock]
        notes += [f"{quoted(name)} is a clock in {clock}: seconds from the first row"] * (clock is not None)
        usual = float(np.median(np.abs(np.diff(raw)))) if raw.size > 1 else 0.0
        if 0 < usual < _MOST_DAYS and any(a < size < b for a, b in _DAYS):
            notes.append(f"{quoted(name)} is a clock in days: seconds from the first row")
            return np.round((raw - raw[0]) * _DAY_S, 6)
        if clock is None and usual >= _SLOW_S:
            notes.append(f"{quoted(name)} says no unit: taken as s, a row every {usual:.3g} s (else --time-unit)")
    if unit.factor == 1.0:
        return raw
    start = raw[0] if unit.factor * size > _LARGE_S else 0.0
    return np.asarray((raw - start) * unit.factor)


def _is_cycle(name: str, raw: Floats, values: Mapping[str, Floats], given: bool, notes: list[str]) -> bool:
    """Tell whether a column has the numbers of the cycles; of trials, where none is more than one cycle."""
    if np.isnan(raw).any() or bad_cycles(raw).any():
        if not given:
            notes.append(f"{quoted(name)} has no whole numbers that never fall: cycles are found from the reversals")
        return given  # a column that was given is refused, with its line, where the record is read
    if "cycle" in name.lower():
        return True
    parts = [np.flatnonzero(raw == number) for number in np.unique(raw)]
    most = max((_count(values, part) for part in parts), default=1)
    if most <= 1:
        return True
    if given:
        notes.append(f"{quoted(name)} as the cycle, as given: one of its numbers has {most} cycles and approaches")
        return True
    notes.append(f"{quoted(name)} numbers {len(parts)} trials of several cycles: cycles are found from the reversals")
    return False


def _count(values: Mapping[str, Floats], part: Ints) -> int:
    """Count the cycles, and the approach, of a trial."""
    if part.size < 3:
        return 1
    return int(np.unique(find_cycles(values["drive"][part], values["angle_deg"][part])).size)


def with_stamps(table: BenchTable) -> BenchTable:
    """Make one column of seconds of each pair of seconds and nanoseconds, as ROS stamps a message."""
    for name in list(table.columns):
        found = _STAMP.fullmatch(name)
        wanted = () if found is None else [found[1].lower() + end for end in ("sec", "secs", "seconds")]
        seconds = next((other for other in table.columns if other.lower() in wanted), None)
        if found is None or seconds is None:
            continue
        whole, part = (table.columns[one].parsed for one in (seconds, name))
        if whole.wrong is not None or part.wrong is not None or np.isnan(whole.values).all():
            continue
        first = whole.values[~np.isnan(whole.values)][0]
        stamp = found[1].rstrip("._/ ") or "stamp"
        columns = {key: column for key, column in table.columns.items() if key not in (seconds, name)}
        columns[stamp if stamp not in columns else f"{stamp} s"] = Column((whole.values - first) + 1e-9 * part.values)
        note = f"{quoted(seconds)} and {quoted(name)}: one clock, seconds from the first row"
        table = replace(table, columns=columns, notes=(*table.notes, note), plain=False)
    return table
