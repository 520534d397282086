"""Which column of a table is what, and in which unit: by option, by name, or by the unit in its name."""

from __future__ import annotations

import re
from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass, field

import numpy as np

from hysteresis.arrays import Ints
from hysteresis.files import RecordError
from hysteresis.messages import listed, quoted
from hysteresis.records.record import FIELDS, FURTHER_DRIVES
from hysteresis.records.units import EXPECTED, UNITS, Measured, Unit, called, unit_of, unknown_unit
from studies.own_rig.tables import BenchTable

NAMED = ("drive", "angle", "time", "cycle")
"""Keys whose column an option may name. The drive may be a force; its key in the sidecar is then ``force``."""
BenchColumns = dict[str, str | list[str]]
"""Key of a sidecar's ``[columns]`` -> its column, or list of columns."""
_EXACT = {"drive": "drive_mm", "angle": "angle_deg", "time": "time_s", "cycle": "cycle", "force": "tendon_force_N"}
_WORDS = {
    "drive": (
        r"drive|displacement|tendon|pull|wheel|motor|stroke|stage|actuator",
        r"position|extension|cable|wire|rope|spool|pulley|servo|travel|insertion|command|cmd|setpoint|input|"
        r"位移|行程|変位|spostamento|desloca|desplaza|verplaatsing|förskjutning|déplacement|"
        r"weg|hub|kurbel|pwm|volt|^enc|encoder|steps|counts|ticks|(^|[^a-z])pos([^a-z]|$)",
    ),
    "angle": (
        r"angle|theta|bend|tip_deg|cam(?!era)",
        r"winkel|phi|biegung|yaw|pitch|roll|tilt|θ|φ|α|rotation|deflection|orientation|flexion|[aá]ngulo|(^|_)(rot|ang)(_|$)|"
        r"角|angolo|ângulo|hoek|vinkel|kąt|úhel",
    ),
    "time": (
        r"time|^t$|^t[ _(\[]|stamp|seconds",
        r"zeit|temps|tiempo|tempo(?!r)|tijd|^tid\b|horodat|时间|時間|elapsed|clock|uhr|millis|micros|^x_value$|^t/|\.t$|"
        r"^sec|^ms$",
    ),
    "cycle": (r"cycle|^lap$|^trial$", r"^(run|rep|repetition|loop|zyklus|versuch)(_?(no|nr|id|number))?$"),
    "force": (r"(?<!ex)tension|force", r"load|kraft|fuerza|forza|força|kracht|力|(^|[^a-z])f[ _(\[]*(n|kn|mn)\b"),
}
"""What the names of columns have in them, by key; the second where no column has the first."""
_NOT = {
    "drive": r"(?<!ex)tension|force|load|_n$|time|stamp|^drive_[2-4]_|speed|velocity|effort|error",
    "angle": r"time|stamp|^angle_2_|speed|velocity|rate|frame|error|motor|servo|wheel|spool|pulley",
    "time": r"tendon",
    "cycle": r"time|duty",
    "force": r"time|stamp|rate",
}
_RANKS: dict[str, tuple[str, ...]] = {
    "drive": ("length", "angle", "", "steps", "counts", "voltage"),
    "angle": ("angle", ""),
    "time": ("time", ""),
    "force": ("force", ""),
    "cycle": ("", "counts"),
}
"""Kinds of units that a column of this key may have; of several columns those of the earlier kind are taken."""
_AT_THE_TIP = re.compile(r"tip|end.?effector|marker|camera")
"""Of columns whose names say "position" and the like: not of the drive."""
_ONE_CLOCK = ("time", "t", "__time", "timestamp", "%time")
"""Of several times the one that is taken."""
_OPTION = {"force": "drive"}
_ROS = re.compile(r"/|\.(position|x|y|z)\b|position\[")
_OF_AN_ANGLE = frozenset(["angle", "theta", "phi", "alpha", "winkel", "rotation"])
ASSUMED = {"drive": "mm", "angle": "deg", "time": "s", "force": "N"}
"""Units where nothing says one."""


@dataclass(frozen=True)
class Reading:
    """What a user says of a table: columns and units that are not found by their names, None where they are found.

    ``columns`` names the column of drive, angle, time and cycle. ``no_time`` leaves the times out.
    """

    columns: Mapping[str, str | None] = field(default_factory=dict)
    drive_unit: str | None = None
    angle_unit: str | None = None
    time_unit: str | None = None
    no_time: bool = False
    encoding: str | None = None
    sheet: str | None = None

    def unit(self, key: str) -> Unit | None:
        """Give the unit of an option; steps are one without a factor."""
        name = {"drive": self.drive_unit, "force": self.drive_unit, "angle": self.angle_unit, "time": self.time_unit}
        given = name.get(key)
        return None if given is None else UNITS[given.lower()]


@dataclass(frozen=True)
class Known:
    """The columns of drive (or force), angle, time and cycle, their units, and notes on these.

    ``assumed``: of which nothing said the unit.
    """

    columns: Mapping[str, str]
    units: Mapping[str, Unit]
    notes: tuple[str, ...]
    assumed: frozenset[str]


def known_columns(table: BenchTable, reading: Reading) -> Known:
    """Name the columns of drive, angle, time and cycle, and their units: those that are given, else by their names.

    Raises
    ------
    RecordError
        No column for drive or angle, several of them, one for both, or one that measures something else.
    """
    if not table.named and not (reading.columns.get("drive") and reading.columns.get("angle")):
        found = f"{table.path}:{table.lines[0]}: numbers in place of names"
        raise RecordError(
            f"{found}: expected --drive-column K and --angle-column K, numbers from 1 to {len(table.columns)}"
        )
    known, units, notes, assumed = dict[str, str](), dict[str, Unit](), list[str](), set[str]()
    for key in NAMED:
        if key == "time" and reading.no_time:
            continue
        name = _given(table, reading.columns.get(key))
        if name:
            table.require(name)
        elif key == "drive":
            name = _guess(table, "drive") or _guess(table, "force")
        else:
            name = _guess(table, key, taken=list(known.values()))
        if name is None and key in ("drive", "angle"):
            found = f"{table.path}: no column is named as the {key}: the columns are {listed(table.columns)}"
            other = ", or another --encoding" * (table.encoding in ("cp1252", "latin-1"))
            raise RecordError(f"{found}: expected --{key}-column NAME{other}")
        if key == "angle" and name == next(iter(known.values())):
            raise RecordError(
                f"{table.path}: column {quoted(name)}: drive and angle at once: the columns are "
                f"{listed(tuple(table.columns))}: expected --drive-column NAME and --angle-column NAME, of two columns"
            )
        if name is None or (not reading.columns.get(key) and name in known.values()):
            continue
        if key == "time" and not reading.columns.get(key) and _is_empty(table, name):
            notes.append(f"{quoted(name)} is empty: no times")
            continue
        if key == "cycle" and not reading.columns.get(key) and table.columns[name].parsed.wrong is not None:
            notes.append(f"{quoted(name)} has words in it: cycles are found from the reversals")
            continue
        role = "force" if key == "drive" and _is_force(table, name, reading) else key
        known[role] = name
        if role != "cycle":
            unit = reading.unit(role) or _unit_said(table, role, name)
            units[role] = unit or UNITS[ASSUMED[role].lower()]
            notes += _words_on(role, name, unit)
            if unit is None:
                assumed.add(role)
    return Known(known, units, tuple(notes), frozenset(assumed))


def _is_empty(table: BenchTable, name: str) -> bool:
    parsed = table.columns[name].parsed
    return parsed.wrong is None and bool(np.isnan(parsed.values).all())


def _given(table: BenchTable, name: str | None) -> str | None:
    """Give the column that an option names; a number is that of the column, from 1, where none has it as its name."""
    if name is None or name in table.columns or not (name.isascii() and name.isdecimal() and len(name) < 6):
        return name
    return list(table.columns)[int(name) - 1] if 1 <= int(name) <= len(table.columns) else name


def _is_force(table: BenchTable, name: str, reading: Reading) -> bool:
    unit = reading.unit("drive") or unit_of("drive", name, table.columns[name].unit)
    if unit is None:
        return bool({"force", "tension", "load", "weight"} & set(re.sub(r"[^a-z]+", " ", name.lower()).split()))
    return unit.kind == "force"


def _unit_said(table: BenchTable, key: str, name: str) -> Unit | None:
    """Give the unit that the name of a column, or the row of units, says.

    Raises
    ------
    RecordError
        A column that measures something else, or one of ROS whose unit is not said.
    """
    measured: Measured = key  # type: ignore[assignment]
    unit, option = unit_of(measured, name, table.columns[name].unit), _OPTION.get(key, key)
    where = f"{table.path}: column {quoted(name)}"
    if unit is None and key == "drive" and re.search(r"(^|[^a-z])enc(oder)?($|[^a-z])", name.lower()):
        return UNITS["counts"]
    if unit is None and key == "drive" and re.search(r"servo|pulse", name.lower()) and name.lower().endswith("us"):
        return UNITS["pulse"]
    _require_one_unit(table, measured, name, option)
    if unit is None:
        like = "rad or deg" if key == "angle" else "m, mm, rad, deg or step"
        if key in ("drive", "angle") and _ROS.search(name):
            raise RecordError(f"{where}: says no unit (ROS has rad and m): expected --{option}-unit {like}")
        if key == "drive" and _OF_AN_ANGLE & set(re.split(r"[\W\d_]+", name.lower())):
            raise RecordError(f"{where}: an angle that says no unit: expected --drive-unit deg, rad, turn or mm")
        if key != "time" and (unknown := unknown_unit(name)) is not None:
            found = f"{where}: {quoted(unknown)} is no known unit"
            raise RecordError(f"{found}: expected --{option}-unit UNIT, or a column in {EXPECTED[measured]}")
        return None
    if unit.kind not in _RANKS[key]:
        more = {"drive": "--drive-unit step", "angle": "--angle-unit deg"}.get(key)
        way = "convert it, or name another column" if more is None else f"convert it, name another column, or {more}"
        found = f"{where}: expected {EXPECTED[measured]}, not {called(unit.kind)}"
        raise RecordError(f"{found}; {way}")
    return unit


def _require_one_unit(table: BenchTable, measured: Measured, name: str, option: str) -> None:
    """Refuse a column whose name and whose row of units say two, and one whose "in" may be an input.

    Raises
    ------
    RecordError
        One line with both units.
    """
    where, below = f"{table.path}: column {quoted(name)}", table.columns[name].unit
    of_name, of_row = unit_of(measured, name), unit_of(measured, "", below) if below else None
    if of_name is not None and of_row is not None and of_name.kind == of_row.kind and of_name.factor != of_row.factor:
        found = f"{where}: {of_name.symbol} in its name, {of_row.symbol} in the row of units"
        raise RecordError(f"{found}: expected one, or --{option}-unit UNIT")
    outputs = any(other.lower().endswith("_out") for other in table.columns)
    if measured == "drive" and not below and name.lower().endswith("_in") and outputs:
        raise RecordError(f"{where}: inches, or an input: expected --drive-unit in, mm, deg or step")


def _words_on(key: str, name: str, unit: Unit | None) -> list[str]:
    """Say what was assumed of a unit, or how it is converted."""
    if unit is None:
        return [] if key == "time" else [f"{quoted(name)} says no unit: taken as {ASSUMED[key]}"]
    if unit.kind in ("counts", "voltage"):
        of = "V" if unit.kind == "voltage" else unit.symbol or "counts"
        return [f"{quoted(name)} is in {of}: a drive in steps, whose gain to mm is unknown"]
    if unit.symbol == "grad":
        return [f"{quoted(name)} in grad: taken as degrees; gon are 0.9 of them"]
    if unit.factor == 1.0 or unit.kind == "steps":
        return []
    to = {"length": "mm", "angle": "deg", "time": "s", "force": "N"}[unit.kind]
    symbol = {"in": "inches", "kn": "kN", "mn": "mN", "cn": "cN", "dan": "daN"}.get(unit.symbol, unit.symbol)
    return [f"{quoted(name)} in {symbol}: times {unit.factor:.6g}, to {to}"]


def _guess(table: BenchTable, key: str, taken: Collection[str] = ()) -> str | None:
    """Find the one column whose name says that it is the drive, angle, time, cycle or force; None if none does.

    Of a drive, an angle or a time also the one column in such a unit. Where only columns that measure something else
    say so, the first of them: what it measures is refused where its unit is asked for.

    Raises
    ------
    RecordError
        Several columns that it could be.
    """
    if _EXACT[key] in table.columns:
        return _EXACT[key]
    wrong: str | None = None
    for tier, words in enumerate(_WORDS[key]):
        found = [name for name in table.columns if _says(key, words, name, first=tier == 0)]
        found = [name for name in found if name not in taken] or found
        fits = _best(table, key, found)
        if key == "time" and (clocks := [name for name in fits if name.lower() in _ONE_CLOCK]):
            fits = clocks[:1]
        if len(fits) > 1:
            option = _OPTION.get(key, key)
            raise RecordError(
                f"{table.path}: columns {listed(map(repr, fits))}: any of them may be the {key}: "
                f"expected --{option}-column NAME"
            )
        if fits:
            return fits[0]
        wrong = wrong or next(iter(found), None)
    if key not in ("drive", "angle", "time"):
        return None
    others = [name for name in table.columns if name not in taken and _says(key, "", name, first=False)]
    others = [name for name in others if not _is_channel(name)]
    of_unit = [name for name in others if _rank(table, key, name) in ((0, 1) if key == "angle" else (0,))]
    if key == "time":
        of_unit = [name for name in of_unit if _rises(table, name)]
        wrong = None
    return of_unit[0] if len(of_unit) == 1 else wrong


def _rises(table: BenchTable, name: str) -> bool:
    parsed = table.columns[name].parsed
    return parsed.wrong is None and bool((np.diff(parsed.values[~np.isnan(parsed.values)]) > 0).all())


def _best(table: BenchTable, key: str, names: Sequence[str]) -> list[str]:
    """Give those whose unit fits best; none of those that measure something else."""
    ranks = {name: rank for name in names if (rank := _rank(table, key, name)) is not None}
    return [name for name, rank in ranks.items() if rank == min(ranks.values())]


def _says(key: str, words: str, name: str, *, first: bool) -> bool:
    small = name.lower()
    if key == "drive" and not first and _AT_THE_TIP.search(small):
        return False
    return bool(re.search(words, small)) and not re.search(_NOT[key], small)


def _rank(table: BenchTable, key: str, name: str) -> int | None:
    """Give how well the unit of a column fits, 0 best; None where it measures something else."""
    if key == "cycle":
        return 0
    measured: Measured = key  # type: ignore[assignment]
    unit = unit_of(measured, name, table.columns[name].unit)
    kind = "" if unit is None else unit.kind
    if kind not in _RANKS[key]:
        return None
    converted = key == "angle" and unit is not None and unit.factor != 1.0
    return 2 * _RANKS[key].index(kind) + converted


def _is_channel(name: str) -> bool:
    """Tell whether a name is that of another channel of a record."""
    return bool(re.fullmatch(r"tip_[xyz]_mm|notch_\d+_deg|torsion_deg|angle_2_deg|drive_[2-4]_\w+", name))


def further_channels(table: BenchTable, unit: str, taken: Collection[str], rows: Ints) -> BenchColumns:
    """Find further channels by the names that a record has, of those with a number in every row that is kept.

    Parameters
    ----------
    unit
        Of the drive, in whose unit further wheels are.
    rows
        Rows that are kept.
    """

    def there(name: str) -> bool:
        if name not in table.columns or name in taken:
            return False
        parsed = table.columns[name].parsed
        return parsed.wrong is None and not parsed.clock and bool(np.isfinite(parsed.values[rows]).all())

    names = {key: f"{key}_{unit}" if key in FURTHER_DRIVES else field for key, field in FIELDS.items()}
    columns: BenchColumns = {key: name for key, name in names.items() if key not in (*NAMED, "force") and there(name)}
    notches = [name for name in table.columns if re.fullmatch(r"notch_[1-9]\d{0,5}_deg", name)]
    notches.sort(key=lambda name: int(name.split("_")[1]))
    if notches and notches == [f"notch_{k + 1}_deg" for k in range(len(notches))] and all(map(there, notches)):
        columns["notches"] = notches
    tip = [name for name in ("tip_x_mm", "tip_y_mm", "tip_z_mm") if there(name)]
    if tip[:2] == ["tip_x_mm", "tip_y_mm"]:
        columns["tip"] = tip
    return columns


def unused(table: BenchTable, columns: BenchColumns) -> list[str]:
    """Columns of a table that no key names."""
    used = {name for names in columns.values() for name in ([names] if isinstance(names, str) else names)}
    return [name for name in table.columns if name not in used]
