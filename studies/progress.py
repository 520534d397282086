"""Progress of long computations, on standard error: a bar on a terminal, plain lines elsewhere.

Both show what is running, how much is done, its share, and the time since the start. Nothing is written within the
first :data:`FIRST_S` seconds where there is no terminal, so that short commands and early errors stay one line.
"""

from __future__ import annotations

import sys
import threading
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import NamedTuple

from rich.console import Console
from rich.progress import BarColumn, Progress, ProgressColumn, Task, TextColumn, TimeElapsedColumn
from rich.text import Text

FIRST_S = 3.0
"""Time of the first plain line."""
NEXT_S, NEXT_SHARE = 10.0, 0.1
"""Least time between plain lines, and their distance as a share of the time so far: an hour makes 60 lines."""

Count = Callable[[int, int], None]
"""Called with how much is done, and of how much."""


class _CountColumn(ProgressColumn):
    def render(self, task: Task) -> Text:
        return Text(count_of(task))


def count_of(task: Task) -> str:
    """Give count and share in words: ``3 of 12 (25 %)``, ``3`` of an unknown number, or nothing."""
    if task.total is None:
        return f"{task.completed:g}" if task.completed else ""
    return f"{task.completed:g} of {task.total:g} ({task.percentage:.0f} %)"


@contextmanager
def bar(show: bool) -> Iterator[Progress]:
    """Show progress in a ``with`` block: ``task = shown.add_task(words, total=n)``, ``shown.update(task, advance=1)``.

    The total is None where it is not known. Elsewhere than on a terminal the last task is shown as lines.
    """
    console = Console(stderr=True)
    columns = (TextColumn("{task.description}", markup=False), BarColumn(), _CountColumn(), TimeElapsedColumn())
    with Progress(*columns, console=console, disable=not (show and console.is_terminal), transient=True) as progress:
        if show and not console.is_terminal:
            with _lines(progress):
                yield progress
        else:
            yield progress


@contextmanager
def _lines(progress: Progress) -> Iterator[None]:
    """Write the last task of a progress as lines, from :data:`FIRST_S` on."""
    ended = threading.Event()

    start = time.monotonic()

    def write() -> None:
        wait = FIRST_S
        while not ended.wait(wait):
            elapsed = time.monotonic() - start
            if progress.tasks:
                print(line_of(progress.tasks[-1], elapsed), file=sys.stderr, flush=True)  # noqa: T201
            wait = max(NEXT_S, NEXT_SHARE * elapsed)

    writer = threading.Thread(target=write, daemon=True)
    writer.start()
    try:
        yield
    finally:
        ended.set()
        writer.join(timeout=1.0)


def line_of(task: Task, elapsed_s: float) -> str:
    """Give a task as a line: what is running, count and share, seconds since the start."""
    count = count_of(task)
    return ", ".join([task.description, *([count] if count else []), f"{elapsed_s:.0f} s"])


@contextmanager
def steps(show: bool, total: int) -> Iterator[Callable[[str], None]]:
    """Show the progress of named steps; the yielded call begins the next one."""
    with bar(show) as progress:
        task = progress.add_task("starting", total=total)
        done = -1

        def step(description: str) -> None:
            nonlocal done
            done += 1
            progress.update(task, description=description, completed=done)

        yield step
        progress.update(task, completed=total)


@contextmanager
def counted(show: bool, words: str) -> Iterator[Count]:
    """Show work that reports how much is done, and of how much; work that reports nothing shows the time alone."""
    with bar(show) as progress:
        task = progress.add_task(words, total=None)
        yield lambda done, total: progress.update(task, completed=done, total=total)


@contextmanager
def status(show: bool, text: str) -> Iterator[None]:
    """Show what is running, for work of unknown length."""
    with counted(show, text):
        yield


class Stages(NamedTuple):
    """``begin`` begins the next stage, ``say`` says what happens within it; both take words."""

    begin: Callable[[str], None]
    say: Callable[[str], None]


@contextmanager
def stages(show: bool, text: str, total: int) -> Iterator[Stages]:
    """Show work in a known number of stages, of which each has an unknown number of steps."""
    with bar(show) as progress:
        task = progress.add_task(text, total=total)

        def begin(words: str) -> None:
            progress.update(task, description=f"{text}: {words}", advance=1)

        yield Stages(begin, lambda words: progress.update(task, description=f"{text}: {words}"))
