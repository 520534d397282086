"""Cells of a table: numbers with their marks for decimals and thousands, times of a clock, and cells without either."""

from __future__ import annotations

import math
import re
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from datetime import date, datetime, time, timedelta

import numpy as np

from hysteresis.arrays import Floats
from hysteresis.records.record_file import MOST_DIGITS

Cell = str | float | datetime | date | time | timedelta | None
MISSING = frozenset(
    ["", "nan", "-nan", "na", "n/a", "#n/a", "#na", "null", "none", "nil", "missing", "-", "--", "---", "?", ".",
     "#div/0!", "#value!", "#num!", "#ref!", "nan(ind)", "-nan(ind)", "1.#qnan", "1.#ind", "-1.#ind", "n. a.", "n.a.",
     "\u2013", "\u2014", "...", "#nv", "#wert!", "#zahl!", "#bezug!", "#valeur!", "ol", "o.l", "ovld", "ovl",
     "overload", "overflow", "over", "ovrflw", *("*" * k for k in range(1, 21))]
)  # fmt: skip
"""How programs write that there is no number, in small letters."""
_GROUPS = re.compile(r"(?<=\d)['’\u00a0\u2009\u202f ](?=\d{3}(?!\d))")
_COMMA_GROUPS = re.compile(r"[+-]?[1-9]\d{0,2}(,\d{3})+")
_POINT_GROUPS = re.compile(r"[+-]?[1-9]\d{0,2}(\.\d{3})+")
_POINT_GROUPS_COMMA = re.compile(r"[+-]?\d{1,3}(\.\d{3})+,\d+")
_COMMA_GROUPS_POINT = re.compile(r"[+-]?\d{1,3}(,\d{3})+\.\d+")
_DECIMAL_COMMA = re.compile(r"[+-]?\d*,\d+([eE][+-]?\d+)?|[+-]?\d+,")
_DECIMAL_POINT = re.compile(r"[+-]?\d*\.\d+([eE][+-]?\d+)?")
_SHAPES = (
    ("points, then a comma", _POINT_GROUPS_COMMA),
    ("commas, then a point", _COMMA_GROUPS_POINT),
    ("comma groups", _COMMA_GROUPS),
    ("point groups", _POINT_GROUPS),
    ("comma", _DECIMAL_COMMA),
    ("point", _DECIMAL_POINT),
)
_FORTRAN = re.compile(r"([+-]?\d*\.?\d*)[dD]([+-]?\d{1,3})")
_OF_DAY = re.compile(r"(?:(\d{1,3}):)?(\d{1,2}):(\d{1,2})(?:[.,:](\d{1,9}))?(?:\s*([AaPp])\.?[Mm]\.?)?")
_DATED = re.compile(r"(\d{1,4})[./-](\d{1,2})[./-](\d{1,4})[T_,\s]+(\S+(?:\s*[AaPp]\.?[Mm]\.?)?)")
_WITH_MONTH = re.compile(
    r"(?:[A-Za-z]{2,9}\.?,? )?(?:(\d{1,2})[-./ ]+([A-Za-z]{3,9})|([A-Za-z]{3,9})[-./ ]+(\d{1,2})),?"
    r"(?:[-./ ]+(\d{4}))?[ T,]+(\d{1,2}:\d{2}:\d{2}(?:[.,]\d{1,9})?(?:\s*[AaPp]\.?[Mm]\.?)?)(?: (\d{4}))?"
)
_COMPACT = re.compile(r"(\d{8})[T_ -](\d{2})(\d{2})(\d{2})(?:[.,](\d{1,9}))?Z?")
_MONTHS = ("jan", "feb", "mar", "apr", "may", "jun", "jul", "aug", "sep", "oct", "nov", "dec")
_OTHER_MONTHS = {"mrz": 3, "mai": 5, "okt": 10, "dez": 12}
_HALF_A_DAY_S = 43_200.0


@dataclass(frozen=True)
class Marks:
    """The marks of the numbers of a table: of decimals, and of thousands where they have any."""

    decimal: str = "."
    thousands: str = ""


@dataclass(frozen=True, eq=False)
class Parsed:
    """Numbers of a column, shape (m,), nan where there is none; ``wrong`` is the first cell that is something else.

    ``clock``: the cells are dates or times of the day, and the numbers are seconds from the first one.
    """

    values: Floats
    wrong: int | None = None
    clock: bool = False


class MarksError(ValueError):
    """Marks that may be of decimals or of thousands; ``cell`` is one of them."""

    def __init__(self, cell: str, expected: str) -> None:
        super().__init__(cell)
        self.cell, self.expected = cell, expected


def find_marks(cells: Iterable[str], *, quoted_commas: bool, points: bool = True) -> Marks:
    """Find the marks of the numbers of a table.

    A comma before three digits may be of thousands. Where commas stand between the fields, it is, if other cells have
    decimal points; else it is of decimals, if no other cell has points.

    Parameters
    ----------
    cells
        The cells that have a comma or a point in them.
    quoted_commas
        Whether commas stand between the fields, too, so that those within are quoted. Then a comma before three digits
        is of decimals only where other cells show it.
    points
        Whether there are points at all; else the first comma that is of decimals decides.

    Raises
    ------
    MarksError
        Marks that may be either.
    """
    seen: dict[str, str] = {}
    for cell in cells:
        text = cell.strip()
        if len(text) > MOST_DIGITS:
            continue
        kind = next((name for name, shape in _SHAPES if shape.fullmatch(text)), None)
        if kind == "comma groups" and text.count(",") > 1:
            kind = "commas, then a point"
        if kind is not None:
            seen.setdefault(kind, text)
        if kind == "comma" and not points:
            break
    expected = "expected decimal commas, as in other cells, and no points for thousands"
    if "points, then a comma" in seen and "commas, then a point" not in seen:
        return Marks(",", ".")
    if "commas, then a point" in seen:
        if "comma" in seen or "points, then a comma" in seen:
            raise MarksError(seen["commas, then a point"], "expected one mark for decimals, as in other cells")
        return Marks(".", ",")
    if "comma" in seen:
        if "point groups" in seen:
            raise MarksError(seen["point groups"], expected)
        return Marks(",")
    if "comma groups" in seen:
        if quoted_commas and "point" in seen:
            return Marks(".", ",")
        if quoted_commas or "point" in seen or "point groups" in seen:
            raise MarksError(seen["comma groups"], "may be of decimals or of thousands: expected no marks of thousands")
        return Marks(",")
    return Marks()


def number(text: str, marks: Marks) -> float:
    """Give the number of a cell; nan where it is none, or has more characters than a number may have.

    A point is a decimal one beside decimal commas, too, where none is for thousands.
    """
    text = text.strip()
    if not text.isascii():
        text = text.replace("\u2212", "-").replace("\u2013", "-")
    if len(text) > MOST_DIGITS:
        return math.nan
    if marks.thousands:
        text = text.replace(marks.thousands, "")
    if marks.decimal == "," and _DECIMAL_COMMA.fullmatch(text):
        text = text.replace(",", ".")
    try:
        return float(text) if text.isascii() and "_" not in text else _odd_number(text)
    except ValueError:
        return _odd_number(text)


def _odd_number(text: str) -> float:
    """Read numbers with spaces or apostrophes for thousands, or with the exponent of Fortran."""
    plain = _GROUPS.sub("", text)
    if plain != text and (found := re.fullmatch(r"[+-]?\d+([.,]\d+)?", plain)):
        return float(found[0].replace(",", "."))
    if (found := _FORTRAN.fullmatch(text)) is not None and re.search(r"\d", found[1]):
        return float(f"{found[1]}e{found[2]}")
    return math.nan


def is_missing(cell: Cell) -> bool:
    """Tell whether a cell is empty, or says that there is no number."""
    if isinstance(cell, str):
        return cell.strip().lower() in MISSING
    return cell is None or (isinstance(cell, float) and math.isnan(cell))


def is_value(cell: Cell) -> bool:
    """Tell whether a cell is a number with any marks, or a time."""
    if isinstance(cell, str):
        if is_missing(cell) or not any(map(str.isdigit, cell)) or ("." in cell and cell.rstrip().endswith(",")):
            return False
        loose = (Marks(), Marks(","), Marks(",", "."), Marks(".", ","))
        return any(math.isfinite(number(cell, marks)) for marks in loose) or instant(cell) is not None
    return not is_missing(cell)


def parse(cells: Sequence[Cell] | Floats, marks: Marks) -> Parsed:
    """Give the numbers of a column, or the seconds of its times from the first one."""
    if isinstance(cells, np.ndarray):
        return Parsed(cells)
    first = next((cell for cell in cells if not is_missing(cell)), None)
    clock = (isinstance(first, str) and math.isnan(number(first, marks)) and instant(first) is not None) or isinstance(
        first, datetime | date | time | timedelta
    )
    if clock:
        return _clock(cells)
    values = np.full(len(cells), math.nan)
    for i, cell in enumerate(cells):
        if isinstance(cell, str):
            values[i] = number(cell, marks)
            if math.isnan(values[i]) and not is_missing(cell):
                return Parsed(values, i)
        elif isinstance(cell, int | float):
            values[i] = cell
        elif cell is not None:
            return Parsed(values, i)
    return Parsed(values)


def _clock(cells: Sequence[Cell]) -> Parsed:
    values, days = np.full(len(cells), math.nan), 0.0
    start: datetime | float | None = None
    last: float | None = None
    for i, cell in enumerate(cells):
        if is_missing(cell):
            continue
        at = instant(cell)
        start = at if start is None else start
        seconds = None if at is None or start is None else _between(start, at)
        if seconds is None:
            return Parsed(values, i, clock=True)
        if isinstance(at, float) and last is not None and at < last - _HALF_A_DAY_S:  # midnight
            days += 2 * _HALF_A_DAY_S
        last = at if isinstance(at, float) else None
        values[i] = seconds + days
    return Parsed(values, clock=True)


def _between(start: datetime | float, at: datetime | float) -> float | None:
    if isinstance(start, datetime) and isinstance(at, datetime):
        same = (start.tzinfo is None) == (at.tzinfo is None)
        return (at - start).total_seconds() if same else None
    return at - start if isinstance(start, float) and isinstance(at, float) else None


def instant(cell: Cell) -> datetime | float | None:
    """Give a date with its time, or the seconds of a time of the day; None where a cell is neither."""
    match cell:
        case datetime():
            return cell
        case date():
            return datetime(cell.year, cell.month, cell.day)
        case time():
            return cell.hour * 3600.0 + cell.minute * 60.0 + cell.second + 1e-6 * cell.microsecond
        case timedelta():
            return cell.total_seconds()
        case str() if ":" in cell and len(cell) < 64 and cell.isascii():
            return _of_text(cell.strip())
        case str() if (compact := _COMPACT.fullmatch(cell.strip())) is not None:
            day, *of_day, fraction = compact.groups()
            return _of_text(f"{day[:4]}-{day[4:6]}-{day[6:]} {':'.join(of_day)}.{fraction or 0}")
    return None


def _of_text(text: str) -> datetime | float | None:
    if (found := _OF_DAY.fullmatch(text)) is not None:
        return _of_day(found)
    try:
        return datetime.fromisoformat(text.replace(",", "."))
    except ValueError:
        pass
    if (with_month := _WITH_MONTH.fullmatch(text)) is not None:
        return _of_month(with_month)
    dated = _DATED.fullmatch(text)
    of_day = None if dated is None else _OF_DAY.fullmatch(dated[4])
    seconds = None if of_day is None else _of_day(of_day)
    if dated is None or seconds is None:
        return None
    a, b, c = (int(part) for part in dated.groups()[:3])
    for year, month, day in ((a, b, c), (c, b, a), (c, a, b)):  # the second is of points, mostly; then of slashes
        try:
            return datetime(year if year > 99 else 2000 + year, month, day) + timedelta(seconds=seconds)
        except (ValueError, OverflowError):
            continue
    return None


def _of_month(found: re.Match[str]) -> datetime | None:
    """Read ``29-Nov-2026 14:03:04``, ``Nov 29 2026 14:03:04`` or ``Sun Nov 29 14:03:04 2026``."""
    month = (found[2] or found[3]).lower()[:3]
    of_day, year = _OF_DAY.fullmatch(found[6]), found[5] or found[7]
    seconds = None if of_day is None else _of_day(of_day)
    number = _OTHER_MONTHS.get(month) or (_MONTHS.index(month) + 1 if month in _MONTHS else None)
    if number is None or seconds is None or year is None:
        return None
    try:
        return datetime(int(year), number, int(found[1] or found[4])) + timedelta(seconds=seconds)
    except ValueError:
        return None


def _of_day(found: re.Match[str]) -> float | None:
    hour, minute, second, fraction, half = found.groups()
    if hour is None and fraction is None and not half:  # hours and minutes, or minutes and seconds
        return None
    if half and int(hour or 0) == 0 and fraction is None:  # 3:05 PM
        hour, minute, second = minute, second, "0"
    hours = int(hour or 0)
    if half:
        hours = hours % 12 + 12 * (half.lower() == "p")
    if int(minute) > 59 or int(second) > 59:
        return None
    return hours * 3600.0 + int(minute) * 60.0 + int(second) + float(f"0.{fraction or 0}")
