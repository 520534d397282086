"""The text of a table: its encoding, what stands between its fields, and its rows."""

from __future__ import annotations

import codecs
import csv
import re
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from pathlib import Path

from hysteresis.files import RecordError
from hysteresis.messages import as_given
from hysteresis.records.record_file import MOST_COLUMNS
from studies.own_rig.tables.cells import Cell, is_missing, is_value
from studies.own_rig.tables.labelled import of_monitor
from studies.own_rig.tables.layout import Grid, layout_of
from studies.own_rig.tables.table import BenchTable

DELIMITERS = {";": "semicolon", "\t": "tab", ",": "comma", "|": "bar", "  ": "space", " ": "space"}
COMMENTS = ("#", "%", "//")
_BOMS = (
    (codecs.BOM_UTF8, "utf-8-sig"),
    (codecs.BOM_UTF32_LE, "utf-32"),
    (codecs.BOM_UTF16_LE, "utf-16"),
    (codecs.BOM_UTF16_BE, "utf-16"),
)
_LOOKED_AT = 300
"""Lines that say what stands between the fields."""
_MOST_CHARACTERS = 200_000
"""Characters of the longest line."""
_MOST_LINES_OF_FIELD = 20
_FULL_WIDTH_DIGITS = re.compile("[\uff10-\uff19]")
_FULL_WIDTH = {0xFF00 + code - 0x20: chr(code) for code in map(ord, "0123456789.,+-")}
"""Digits and marks as wide as a Chinese or Japanese character."""
_RULER = frozenset(" \t|+:=-")
"""Characters of a line of dashes and bars, as of Markdown and of tables with frames."""
_SPLIT = {" ": re.compile(r"[ \t]+"), "  ": re.compile(r"\t|\s{2,}")}


def decoded(path: Path, content: bytes, encoding: str | None) -> tuple[str, str]:
    """Give the text of a file and its encoding: the one that is given, else by its first bytes, UTF-8, or cp1252.

    Raises
    ------
    RecordError
        An encoding that there is not, or bytes that it does not have.
    """
    if encoding is not None:
        try:
            if "\0" in encoding:
                raise LookupError
            return _lines_ended(content.decode(encoding).removeprefix("\ufeff")), encoding
        except LookupError:
            given = as_given(encoding)
            raise RecordError(f"--encoding {given}: expected one such as utf-8, utf-16, cp1252, latin-1") from None
        except (UnicodeError, ValueError) as error:
            at = f"byte {error.start}" if isinstance(error, UnicodeDecodeError) else "its bytes"
            raise RecordError(f"{path}: {at}: not {as_given(encoding)}: expected another --encoding") from None
    found = next((name for mark, name in _BOMS if content.startswith(mark)), None) or _without_mark(content[:4000])
    tried = [found] if found else ["utf-8", "cp1252", "latin-1"]
    for name in tried:
        try:
            text = content.decode(name)
        except UnicodeDecodeError as error:
            failed = error
            continue
        if "\0" in text:
            raise RecordError(f"{path}: has NUL in it: expected a table as text, or --encoding NAME")
        return _lines_ended(text), name
    raise RecordError(f"{path}: byte {failed.start}: not {tried[0]}: expected a table as text, or --encoding NAME")


def _without_mark(begin: bytes) -> str | None:
    """Tell UTF-16 without a mark by its zeros: every other byte of Latin letters and digits."""
    if len(begin) < 4 or b"\0" not in begin:
        return None
    even, odd = (begin[k::2].count(0) / max(1, len(begin[k::2])) for k in (0, 1))
    return "utf-16-le" if odd > 0.4 > 0.1 > even else "utf-16-be" if even > 0.4 > 0.1 > odd else None


def _lines_ended(text: str) -> str:
    if _FULL_WIDTH_DIGITS.search(text):
        text = text.translate(_FULL_WIDTH)
    return text.replace("\r\n", "\n").replace("\r", "\n")


@dataclass(frozen=True, eq=False)
class _Lines:
    """Lines with values and comments, each with its number."""

    numbers: list[int]
    texts: list[str]
    comments: list[tuple[int, str]]


def read_text_table(path: Path, content: bytes, encoding: str | None = None) -> BenchTable:
    """Read a table as text, with commas, semicolons, tabs, bars or spaces between its fields.

    Raises
    ------
    RecordError
        A file that is no such table; one line with its place and what was expected.
    """
    text, encoding = decoded(path, content, encoding)
    hint = re.match(r"\s*\"?sep=(.)\"?[ \t]*\n", text, re.IGNORECASE)
    lines = _kept(path, text, skip=1 if hint else 0)
    if len(lines.texts) < 2 and not lines.comments:
        found = f"{len(lines.texts)} lines with values"
        raise RecordError(f"{path}: {found}: expected a header that names the columns, then rows")
    numbers, texts, monitored = of_monitor(path, lines.numbers, lines.texts)
    if monitored:
        lines = _Lines(numbers, texts, [])
    delimiter = hint[1] if hint and hint[1] in DELIMITERS else _delimiter(lines.texts[:_LOOKED_AT])
    grid = _grid(path, lines, delimiter, text)
    layout = layout_of(grid)
    plain = (
        (delimiter, hint, layout.clean, '"' in text, monitored) == (",", None, True, False, [])
        and encoding in ("utf-8", "utf-8-sig")
        and layout.header == 1
        and layout.lines == tuple(range(2, 2 + len(layout.lines)))
        and all(len(row) == len(grid.rows[0]) for row in grid.rows)
    )
    return BenchTable(
        path=path,
        columns=layout.columns,
        lines=layout.lines,
        encoding=encoding.removesuffix("-sig"),
        delimiter=DELIMITERS[delimiter],
        comments=len(lines.comments),
        named=layout.header is not None,
        plain=plain,
        notes=(*monitored, *layout.notes),
    )


def _kept(path: Path, text: str, skip: int) -> _Lines:
    numbers, texts, comments = list[int](), list[str](), list[tuple[int, str]]()
    for number, line in enumerate(text.split("\n"), start=1):
        if number <= skip or not line.strip() or _is_ruler(line):
            continue
        if len(line) > _MOST_CHARACTERS:
            raise RecordError(f"{path}:{number}: {len(line):,} characters: expected at most {_MOST_CHARACTERS:,}")
        if line.lstrip().startswith(COMMENTS):
            comments.append((number, line.lstrip()))
        else:
            numbers.append(number)
            texts.append(line)
    return _Lines(numbers, texts, comments)


def _is_ruler(line: str) -> bool:
    return "--" in line and ("|" in line or "+" in line) and _RULER.issuperset(line)


def _delimiter(lines: Sequence[str]) -> str:
    """Find what stands between the fields: where most rows have two numbers or more, and little else.

    A row of names above them that is as long decides between two that do.
    """
    scores = dict[str, float]()
    for delimiter in DELIMITERS:
        rows = [_fields(line, delimiter) for line in lines]
        counts = [sum(map(is_value, row)) for row in rows]
        of_numbers = [row for row, count in zip(rows, counts, strict=True) if count >= 2]
        filled = sum(not is_missing(cell) for row in of_numbers for cell in row)
        share = sum(count for count in counts if count >= 2) / max(1, filled)
        first = next((i for i, count in enumerate(counts) if count >= 2), 0)
        names = first > 0 and len(rows[first - 1]) == len(rows[first]) and counts[first - 1] == 0
        scores[delimiter] = len(of_numbers) * share + 0.5 * names
    best = max(scores, key=lambda one: scores[one])
    if scores[best] > 0:
        return best
    return next((delimiter for delimiter in (";", "\t") if delimiter in lines[0]), ",") if lines else ","


def _fields(line: str, delimiter: str) -> list[str]:
    if (pattern := _SPLIT.get(delimiter)) is not None:
        return pattern.split(line.strip(), MOST_COLUMNS + 1)
    if '"' not in line:
        return line.split(delimiter, MOST_COLUMNS + 1)
    try:
        return next(csv.reader([line], delimiter=delimiter, skipinitialspace=True), [])
    except csv.Error:
        return [line]


def _grid(path: Path, lines: _Lines, delimiter: str, text: str) -> Grid:
    """Split all lines into cells; a quoted field may hold line ends."""
    numbers, rows = list[int](), list[Sequence[Cell]]()
    if '"' not in text or delimiter in _SPLIT:
        for number, line in zip(lines.numbers, lines.texts, strict=True):
            if line.strip(f"{delimiter} \t"):
                numbers.append(number)
                cells = _fields(line, delimiter)
                rows.append([cell.strip('"') for cell in cells] if '"' in line else cells)
    else:
        for number, cells in _quoted_rows(path, lines, delimiter):
            if any(cell and not cell.isspace() for cell in cells):
                numbers.append(number)
                rows.append(cells)
    comments = [(number, _fields(line.lstrip("#%/ \t"), delimiter)) for number, line in lines.comments]
    if delimiter in _SPLIT or not any(len(cells) > 1 for _, cells in comments):  # np.savetxt: names after a #
        for split in (",", " "):
            comments += [(number, _fields(line.lstrip("#%/ \t"), split)) for number, line in lines.comments]
        comments.sort(key=lambda one: one[0])
    return Grid(
        path,
        numbers,
        rows,
        [(number, cells) for number, cells in comments if len(cells) > 1],
        cut_off=not text.endswith("\n"),
        quoted_commas=delimiter == ",",
        marks="." if delimiter == "," and '"' not in text else "".join(mark for mark in ",." if mark in text),
    )


def _quoted_rows(path: Path, lines: _Lines, delimiter: str) -> Iterable[tuple[int, list[str]]]:
    reader = csv.reader((f"{line}\n" for line in lines.texts), delimiter=delimiter, skipinitialspace=True)
    begun = 0
    try:
        for cells in reader:
            if reader.line_num - begun > _MOST_LINES_OF_FIELD:
                number = lines.numbers[begun]
                raise RecordError(
                    f"{path}:{number}: a quotation mark that is not closed: expected one behind the field"
                )
            yield lines.numbers[begun], cells
            begun = reader.line_num
    except csv.Error as error:
        number = lines.numbers[min(begun, len(lines.numbers) - 1)]
        raise RecordError(f"{path}:{number}: {as_given(str(error))}: expected fields that are shorter") from None
