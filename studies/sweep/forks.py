"""The process that the workers of this machine are forked from: it imports their modules once."""

from __future__ import annotations

import signal
from collections.abc import Iterator
from contextlib import contextmanager
from multiprocessing import forkserver, resource_tracker, set_forkserver_preload


def begin_forking() -> None:
    """Start that process, unless it runs: its imports take two seconds, in which this process has its own."""
    set_forkserver_preload(["distributed", "studies.sweep.cases"])
    resource_tracker.ensure_running()  # which unblocks signals when it starts
    with _interrupts_blocked():
        forkserver.ensure_running()


@contextmanager
def _interrupts_blocked() -> Iterator[None]:
    """Block Ctrl-C, which a terminal sends to all processes: child processes inherit that.

    One that comes meanwhile is delivered when the block ends. It would be lost if Ctrl-C was ignored.
    """
    before = signal.pthread_sigmask(signal.SIG_BLOCK, {signal.SIGINT})
    try:
        yield
    finally:
        signal.pthread_sigmask(signal.SIG_SETMASK, before)
