"""Progress of long computations, on standard error and only on a terminal."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import contextmanager

from rich.console import Console
from rich.progress import BarColumn, Progress, TaskProgressColumn, TextColumn, TimeElapsedColumn


def bar(show: bool) -> Progress:
    """Make a progress bar for a ``with`` block."""
    console = Console(stderr=True)
    columns = (TextColumn("{task.description}"), BarColumn(), TaskProgressColumn(), TimeElapsedColumn())
    return Progress(*columns, console=console, disable=not (show and console.is_terminal), transient=True)


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
def status(show: bool, text: str) -> Iterator[None]:
    """Show what is running, for work of unknown length."""
    console = Console(stderr=True)
    if show and console.is_terminal:
        with console.status(text):
            yield
    else:
        yield


@contextmanager
def status_of_steps(show: bool, text: str) -> Iterator[Callable[[str], None]]:
    """Show which step is running, for work of an unknown number of steps; the yielded call names the step."""
    console = Console(stderr=True)
    if show and console.is_terminal:
        with console.status(text) as line:
            yield lambda step: line.update(f"{text}: {step}")
    else:
        yield lambda step: None
