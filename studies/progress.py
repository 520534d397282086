"""Progress of long computations, on standard error: a bar on a terminal, plain lines elsewhere.

Both show what is running, how much is done, its share, and the time since the start, and say so while kernels are
compiled. Nothing is written within the first :data:`FIRST_S` seconds where there is no terminal, so that short commands
and early errors stay one line.
"""

from __future__ import annotations

import sys
import threading
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass

from numba.core.event import Event, Listener, install_listener
from rich.console import Console
from rich.progress import BarColumn, Progress, ProgressColumn, Task, TimeElapsedColumn
from rich.table import Column
from rich.text import Text

FIRST_S = 3.0
"""Time of the first plain line."""
NEXT_S, NEXT_SHARE = 10.0, 0.1
"""Least time between plain lines, and their distance as a share of the time so far: an hour makes 60 lines."""

BAR_WIDTH = 12
"""Of a bar, characters: words, bar, count and time stand in one line of a terminal."""
COMPILING = "compiling kernels, once, 30 to 60 s"
"""Said while kernels are compiled that are not in the cache on disk. All that the main run needs take 30 s of a free
core, and twice as long where other programs run."""

Count = Callable[[int, int], None]
"""Called with how much is done, and of how much."""


class _Compiling(Listener):
    """Whether kernels are being compiled: numba announces no other calls, and none that it reads from its cache."""

    running = 0

    def on_start(self, event: Event) -> None:
        self.running += 1

    def on_end(self, event: Event) -> None:
        self.running -= 1


class _WordsColumn(ProgressColumn):
    def __init__(self, compiling: _Compiling) -> None:
        super().__init__(Column())  # the only column that a narrow terminal shortens
        self.compiling = compiling

    def render(self, task: Task) -> Text:
        words = COMPILING if self.compiling.running else task.description
        return Text(words, no_wrap=True, overflow="ellipsis")


class _CountColumn(ProgressColumn):
    def render(self, task: Task) -> Text:
        return Text(count_of(task))


def count_of(task: Task) -> str:
    """Give count and share in words: ``3 of 12 (25 %)``, ``3`` of an unknown number, or nothing.

    A task with the field ``left`` also says how long the rest takes at the pace of the last half minute.
    """
    if task.total is None:
        return f"{task.completed:g}" if task.completed else ""
    unit = f" {task.fields['unit']}" if task.fields.get("unit") else ""
    known = f"{task.completed:.0f} of {task.total:.0f}{unit} ({task.percentage:.0f} %)"
    rest = task.time_remaining if task.fields.get("left") and not task.finished else None
    return known if rest is None else f"{known}, {rest:.0f} s left"


@contextmanager
def bar(show: bool) -> Iterator[Progress]:
    """Show progress in a ``with`` block: ``task = shown.add_task(words, total=n)``, ``shown.update(task, advance=1)``.

    The total is None where it is not known. Elsewhere than on a terminal the last task is shown as lines.
    """
    console, compiling = Console(stderr=True), _Compiling()
    kept = Column(no_wrap=True)
    others = (BarColumn(BAR_WIDTH, table_column=kept), _CountColumn(kept), TimeElapsedColumn(kept))
    columns = (_WordsColumn(compiling), *others)
    shown = Progress(*columns, console=console, disable=not (show and console.is_terminal), transient=True)
    with install_listener("numba:compile", compiling), shown as progress:
        if show and not console.is_terminal:
            with _lines(progress, compiling):
                yield progress
        else:
            yield progress


@contextmanager
def _lines(progress: Progress, compiling: _Compiling) -> Iterator[None]:
    """Write the last task of a progress as lines, from :data:`FIRST_S` on."""
    ended = threading.Event()

    start = time.monotonic()

    def write() -> None:
        wait = FIRST_S
        while not ended.wait(wait):
            elapsed = time.monotonic() - start
            if progress.tasks:
                print(line_of(progress.tasks[-1], elapsed, compiles=compiling.running > 0), file=sys.stderr, flush=True)  # noqa: T201
            wait = max(NEXT_S, NEXT_SHARE * elapsed)

    writer = threading.Thread(target=write, daemon=True)
    writer.start()
    try:
        yield
    finally:
        ended.set()
        writer.join(timeout=1.0)


def line_of(task: Task, elapsed_s: float, *, compiles: bool) -> str:
    """Give a task as a line: what is running, count and share, seconds since the start."""
    words, count = f"{task.description} ({COMPILING})" if compiles else task.description, count_of(task)
    return ", ".join([words, *([count] if count else []), f"{elapsed_s:.0f} s"])


@dataclass(frozen=True)
class Stages:
    """``begin`` begins the next stage; ``count`` says what happens within it, how much is done, and of about how much.

    Both take words first.
    """

    begin: Callable[[str], None]
    count: Callable[[str, int, int], None]


UNSEEN = Stages(lambda words: None, lambda words, done, total: None)
"""Stages that nobody is shown."""


class Steps:
    """Named steps of a task; a call begins the next one."""

    def __init__(self, progress: Progress, total: int) -> None:
        self._progress, self._done, self._words = progress, -1, "starting"
        self._task = progress.add_task(self._words, total=total)

    def __call__(self, words: str) -> None:
        """Begin the next step."""
        self._done, self._words = self._done + 1, words
        self._progress.update(self._task, description=words, completed=self._done)

    def within(self, unit: str) -> Stages:
        """Show stages of the present step behind its words; their counts have a unit."""

        def say(words: str) -> None:
            self._progress.update(self._task, description=f"{self._words}: {words}")

        return Stages(say, lambda words, done, total: say(f"{words}, {done} of {total} {unit}"))


@contextmanager
def steps(show: bool, total: int) -> Iterator[Steps]:
    """Show the progress of named steps; the yielded call begins the next one."""
    with bar(show) as progress:
        yield Steps(progress, total)


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


@contextmanager
def stages(show: bool, text: str, total: int, unit: str) -> Iterator[Stages]:
    """Show work in a known number of stages, the first of which has begun; counts within a stage have a unit."""
    with bar(show) as progress:
        task, stage = progress.add_task(f"{text}, step 1 of {total}", total=None, unit=unit), 1
        (shown,) = progress.tasks

        def say(words: str) -> None:
            progress.update(task, description=f"{text}, step {stage} of {total}: {words}")

        def begin(words: str) -> None:
            nonlocal stage
            stage, shown.total = stage + 1, None  # update takes None for a total that stays
            progress.update(task, completed=0)
            say(words)

        def count(words: str, done: int, of: int) -> None:
            progress.update(task, completed=done, total=of)
            say(words)

        yield Stages(begin, count)
