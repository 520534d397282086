"""A forked process has no thread but its own, and must not wait for those that its parent had."""

import gc
import signal

MOST_S = 60


def alone_in_fork() -> None:
    """Keep a forked process from hanging: called in it first of all.

    Objects of other tests that are collected here may wait for threads of the parent as they go: a client of Dask does.
    A process that hangs in spite of that is ended by the system, which its parent sees by the signal.
    """
    gc.disable()
    signal.signal(signal.SIGALRM, signal.SIG_DFL)
    signal.alarm(MOST_S)
