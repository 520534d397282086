"""A table of a study or design file, with checked access to its values; errors name them by their dotted names."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

from hysteresis.messages import as_given, listed, quoted
from studies.sweep.errors import StudyError

MOST = 1e15
"""Largest magnitude of a number of such a file."""


class FileTable:
    """A table of the file, with checked access to its values; errors name them by their dotted names."""

    def __init__(self, name: str, data: object, known: Sequence[str] | None) -> None:
        if not isinstance(data, Mapping):
            raise StudyError(f"{name} = {quoted(data)}: expected a table")
        self.name, self.data = name, data
        for key in data:
            if known is not None and key not in known:
                raise StudyError(f"{self.at(key)} = {quoted(data[key])}: expected one of {listed(known)}")

    def at(self, key: str) -> str:
        """Give the dotted name of a key."""
        return f"{self.name}.{as_given(str(key))}".lstrip(".")

    def complain(self, key: str, expected: str) -> StudyError:
        """Make the error of a key: its name, its value and what was expected."""
        found = f" = {quoted(self.data[key])}" if key in self.data else ": missing"
        return StudyError(f"{self.at(key)}{found}: expected {expected}")

    def table(self, key: str, *known: str) -> FileTable:
        """Give a table within; only the keys that are named may stand in it."""
        return FileTable(self.at(key), self.data.get(key, {}), known or None)

    def text(self, key: str, default: str | None = None, among: Sequence[str] = ()) -> str:
        """Give a text."""
        value = self.data.get(key, default)
        if not isinstance(value, str) or (among and value not in among):
            raise self.complain(key, "one of " + listed(among) if among else "text")
        return value

    def texts(self, key: str, default: Sequence[str], among: Sequence[str]) -> tuple[str, ...]:
        """Give a list of different texts."""
        value = self.data.get(key, default)
        is_list = isinstance(value, Sequence) and not isinstance(value, str)
        if not is_list or not value or len(set(map(quoted, value))) < len(value):
            raise self.complain(key, "a list of different names")
        for item in value:
            if item not in among:
                raise StudyError(f"{self.at(key)} = {quoted(item)}: expected one of {listed(among)}")
        return tuple(value)

    def number(self, key: str, default: float | None = None, expected: str = "a finite number") -> float:
        """Give a finite number."""
        value = self.data.get(key, default)
        if isinstance(value, bool) or not isinstance(value, int | float) or not abs(value) <= MOST:
            raise self.complain(key, expected)
        return float(value)

    def whole(self, key: str, default: int | None, low: int, high: int) -> int:
        """Give a whole number."""
        value = self.data.get(key, default)
        if isinstance(value, bool) or not isinstance(value, int) or not low <= value <= high:
            raise self.complain(key, f"a whole number from {low} to {high:,}")
        return value
