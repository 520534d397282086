"""Lines of a serial monitor: ``angle: 12.3, pos: 0.5`` with a label before each number, and stamps before an arrow."""

from __future__ import annotations

import re
from collections.abc import Sequence
from pathlib import Path

from hysteresis.files import RecordError
from hysteresis.messages import listed, quoted
from hysteresis.records.units import unit_called

_PAIR = re.compile(
    r"[\s,;|]{0,9}([^\W\d][\w .()/\[\]°%-]{0,40}?)\s{0,9}[:=]\s{0,9}"
    r"([+-]?\d{0,20}[.,]?\d{1,20}(?:[eE][+-]?\d{1,3})?|nan)\s{0,9}([^\W\d]{1,9}|[°%])?(?=[\s,;|]|$)",
    re.IGNORECASE,
)
_ARROW = re.compile(r"(\d{1,2}:\d{2}:\d{2}[.,]\d{1,6}) -> (.*)")
_MOST = 0.8
"""Part of the lines that have labels, or stamps, where all are read so."""
_LOOKED_AT = 50
_LONGEST = 1000
"""Characters of a line that may have labels."""


def of_monitor(path: Path, numbers: Sequence[int], lines: Sequence[str]) -> tuple[list[int], list[str], list[str]]:
    """Give the lines as those of a table with names, their numbers, and notes; unchanged where they are one.

    The first line and the last one may be cut off: they are left out then.

    Raises
    ------
    RecordError
        A line between them with other labels than the first one.
    """
    first = lines[:_LOOKED_AT]
    least = _MOST * len(first)
    if len(lines) > 2 and sum(_ARROW.fullmatch(line.strip()) is not None for line in first) >= least:
        stamped = [_ARROW.fullmatch(line.strip()) for line in lines]
        rest = [(number, found) for number, found in zip(numbers, stamped, strict=True) if found]
        mark = next((mark for mark in (";", "\t", ",") if mark in rest[-1][1][2]), " ")
        named = [number for number, found in rest[:1] if not re.match(r"[\s+-]*[\d.]", found[2])]
        head = [f"time{mark}{rest[0][1][2]}"] if named else []
        rows = [f"{found[1].replace(',', '.')}{mark}{found[2]}" for _, found in rest[len(named) :]]
        return [number for number, _ in rest], head + rows, ["stamps before an arrow: the first column"]
    if len(lines) > 2 and sum(bool(_pairs(line)) for line in first) >= least:
        return _table(path, numbers, lines, [_pairs(line) for line in lines])
    return list(numbers), list(lines), []


def _pairs(line: str) -> list[tuple[str, str]]:
    """Give names and numbers of a line that consists of them; the unit behind a number is put into its name."""
    found, at, line = list[tuple[str, str]](), 0, line.strip()
    if len(line) > _LONGEST:
        return []
    while line[at:].strip(" \t,;|"):
        pair = _PAIR.match(line, at)
        if pair is None:
            return []
        unit = pair[3] if pair[3] and unit_called(pair[3]) is not None else None
        name, at = pair[1].strip(), pair.end(2) if unit is None else pair.end()
        found.append((name if unit is None else f"{name} [{unit}]", pair[2]))
    return found if len(found) > 1 else []


def _table(
    path: Path, numbers: Sequence[int], lines: Sequence[str], pairs: Sequence[list[tuple[str, str]]]
) -> tuple[list[int], list[str], list[str]]:
    names = max((tuple(name for name, _ in one) for one in pairs[:3]), key=len)
    texts, kept = ["\t".join(names)], list[int]()
    for i, one in enumerate(pairs):
        if tuple(name for name, _ in one) == names:
            texts.append("\t".join(value for _, value in one))
            kept.append(numbers[i])
        elif 0 < i < len(pairs) - 1:
            expected = listed(f"{name}: NUMBER" for name in names)
            raise RecordError(f"{path}:{numbers[i]}: {quoted(lines[i].strip())}: expected {expected}, or no such line")
    left = len(lines) - len(kept)
    notes = ["a label before each number: the names of the columns"]
    notes += [f"{left} line{'s' * (left > 1)} cut off at the ends left out"] * (left > 0)
    return [kept[0], *kept], texts, notes
