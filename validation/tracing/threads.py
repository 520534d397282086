"""Independent computations in threads, in order; kernels release the lock of the interpreter."""

from __future__ import annotations

import os
from collections.abc import Callable, Sequence
from concurrent.futures import ThreadPoolExecutor
from functools import lru_cache
from typing import TypeVar

In = TypeVar("In")
Out = TypeVar("Out")


def in_threads(function: Callable[[In], Out], items: Sequence[In], threads: int) -> list[Out]:
    """Apply a function to items; results are in their order. The function must not use these threads itself."""
    if threads <= 1 or len(items) < 2:
        return [function(item) for item in items]
    return list(_pool(threads).map(function, items))


@lru_cache
def _pool(threads: int) -> ThreadPoolExecutor:
    """Threads that are kept: a fit asks for them every few milliseconds, and they take a part of one to start."""
    return ThreadPoolExecutor(threads, thread_name_prefix="fit")


if hasattr(os, "register_at_fork"):  # a forked process has the pool, but none of its threads
    os.register_at_fork(after_in_child=_pool.cache_clear)
