"""Independent computations in threads, in order; kernels release the lock of the interpreter."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from concurrent.futures import ThreadPoolExecutor
from functools import lru_cache
from typing import TypeVar

In = TypeVar("In")
Out = TypeVar("Out")


def in_threads(function: Callable[[In], Out], items: Iterable[In], threads: int) -> list[Out]:
    """Apply a function to items; results are in their order. The function must not use threads itself."""
    if threads <= 1:
        return [function(item) for item in items]
    return list(_pool(threads).map(function, items))


@lru_cache
def _pool(threads: int) -> ThreadPoolExecutor:
    """Threads that are kept: a fit asks for them every few milliseconds, and to start them takes one."""
    return ThreadPoolExecutor(threads, thread_name_prefix="fit")
