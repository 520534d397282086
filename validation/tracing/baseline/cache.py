"""Results that are kept as long as they are few: parts of a model that most derivatives leave as they are."""

from __future__ import annotations

from collections.abc import Callable, Hashable
from typing import Any, TypeVar

Out = TypeVar("Out")

_NONE = object()


class Cache:
    """Results by key; all are forgotten where they are more than ``most``. Threads may share it."""

    def __init__(self, most: int = 256) -> None:
        self._most, self._results = most, dict[Hashable, Any]()

    def get(self, key: Hashable, compute: Callable[[], Out]) -> Out:
        """Give the result of a key, computed once; the key must tell all that it depends on."""
        found: Any = self._results.get(key, _NONE)
        if found is not _NONE:
            out: Out = found
            return out
        if len(self._results) >= self._most:
            self._results.clear()
        self._results[key] = result = compute()
        return result
