"""The same work on many tubes, in processes: results come in the order of the tubes, whatever the workers."""

from __future__ import annotations

import multiprocessing
import sys
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import Executor, ProcessPoolExecutor
from contextlib import contextmanager
from dataclasses import dataclass
from functools import partial
from typing import TypeVar

Item = TypeVar("Item")
Result = TypeVar("Result")

CHUNKS = 4
"""Parts of the work for each worker: a slow tube holds up little."""


@dataclass(frozen=True)
class Crew:
    """Workers; ``pool`` is None for one, which is this process."""

    pool: Executor | None
    count: int

    def each(self, work: Callable[[Item], Result], items: Sequence[Item]) -> list[Result]:
        """Do the work on every item; it has to be a function of a module, or a partial of one."""
        if self.pool is None or len(items) < 2 * self.count:
            return [work(item) for item in items]
        size = max(1, len(items) // (CHUNKS * self.count))
        parts = [items[k : k + size] for k in range(0, len(items), size)]
        return [result for part in self.pool.map(partial(_all, work), parts) for result in part]


def _all(work: Callable[[Item], Result], items: Sequence[Item]) -> list[Result]:
    return [work(item) for item in items]


@contextmanager
def crew(count: int) -> Iterator[Crew]:
    """Start workers; on Linux they are copies of this process, with its compiled kernels."""
    if count <= 1:
        yield Crew(None, 1)
        return
    context = multiprocessing.get_context("fork" if sys.platform == "linux" else "spawn")
    with ProcessPoolExecutor(count, mp_context=context) as pool:
        yield Crew(pool, count)
