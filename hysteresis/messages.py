"""Values and names in messages: printable, in one line, and cut where they are long."""

from __future__ import annotations

import reprlib
from collections.abc import Iterable

MOST_QUOTED = 80
"""Longest text of a value in a message."""
MOST_LISTED = 150
"""Longest list of names in a message."""
MOST_LINE = 280
"""Longest message, one line; the name of the command stands before it."""
_MOST_BITS = 14_000
_OWN = ("hysteresis", "fem_models", "validation", "studies")


class _Short(reprlib.Repr):
    """Text of a value of any depth and size, without making all of it first."""

    def __init__(self) -> None:
        super().__init__()
        self.maxstring = self.maxother = 2 * MOST_QUOTED
        self.maxlevel = 3

    def repr_int(self, x: int, level: int) -> str:
        """Give digits, which Python refuses to make beyond 4,300, of integers that have few."""
        return repr(x) if x.bit_length() <= _MOST_BITS else f"an integer of {x.bit_length()} bits"


def quoted(value: object, most: int = MOST_QUOTED) -> str:
    """Give a value as Python writes it, cut after ``most`` characters."""
    return _cut(value if isinstance(value, _Verbatim) else _Short().repr(value), most)


class _Verbatim(str):
    """A text that :func:`quoted` gives without quotation marks."""


def as_given(text: str, most: int = MOST_QUOTED) -> str:
    """Give a text without quotation marks, cut; as :func:`quoted` where it has characters that do not print."""
    return quoted(_Verbatim(text) if text.isprintable() else text, most)


def listed(names: Iterable[object], most: int = MOST_LISTED) -> str:
    """Give names with commas between them; of a long list the first ones, and how many more there are."""
    texts = [as_given(str(name)) for name in names]
    whole = ", ".join(texts)
    if len(whole) <= most:
        return whole
    shown, size = list[str](), 0
    for text in texts:
        size += len(text) + 2
        if size > most - 20 and shown:
            break
        shown.append(text)
    return f"{', '.join(shown)} and {len(texts) - len(shown)} more"


def one_line(text: str, most: int = MOST_LINE) -> str:
    """Give a message in one printable line; of a long one the beginning and the end, where what was expected stands."""
    words = " ".join(text.split())
    line = "".join(one if one.isprintable() else repr(one)[1:-1] for one in words)
    if len(line) <= most:
        return line
    tail = most // 3
    return f"{line[: most - tail - 5]} ... {line[len(line) - tail :]}"


def failure(error: BaseException) -> str:
    """Give an error in one line: the first of what it says, after its type where it is not of this project."""
    lines, kind = str(error).strip().splitlines(), type(error)
    if not lines:
        return kind.__name__
    said = one_line(lines[0])
    return said if kind.__module__.partition(".")[0] in _OWN else f"{kind.__name__}: {said}"


def _cut(text: str, most: int) -> str:
    return text if len(text) <= most else f"{text[: most - 3]}..."
