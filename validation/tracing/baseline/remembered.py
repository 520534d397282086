"""Results that are kept as long as few are: parts of a model that most derivatives leave as they are."""

from __future__ import annotations

from collections.abc import Callable, Hashable
from typing import Any, TypeVar

Out = TypeVar("Out")

MOST = 256
"""Results that are kept: a step of a fit needs a few dozen."""


class Remembered:
    """Results by key; all are forgotten where they are too many."""

    def __init__(self) -> None:
        self._results: dict[Hashable, Any] = {}

    def get(self, key: Hashable, compute: Callable[[], Out]) -> Out:
        """Give the result of a key, computed once; the key must tell all that it depends on."""
        if key in self._results:
            found: Out = self._results[key]
            return found
        if len(self._results) >= MOST:
            self._results.clear()
        self._results[key] = result = compute()
        return result
