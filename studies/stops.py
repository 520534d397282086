"""Ctrl-C and SIGTERM: one line and an exit code, whatever runs when they come.

Python raises an exception for a signal wherever its main thread is. Three places keep it from the command: code that
libraries call back, and destructors, drop it; a library turns it into an error of its own; and a compiler of kernels
does not come back to Python for many seconds. So a thread looks on after a signal: an exception that was dropped is
raised again, and a process that still compiles after :data:`GRACE_S` ends. That is safe at any moment: files are
written whole or not at all, those of the cache of compiled kernels, too.
"""
# Only the standard library: this stands before all other imports of a command.

from __future__ import annotations

import _thread
import atexit
import os
import signal
import socket
import sys
import threading
import time
import weakref
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from dataclasses import dataclass
from types import FrameType
from typing import NoReturn

GRACE_S = 1.0
"""Time that a command has to end by itself while kernels are compiled."""
LOOK_S = 0.1
"""Time between two looks at a command that was told to stop."""


class Interrupted(KeyboardInterrupt):
    """SIGINT, as from Ctrl-C. Unlike Python's own exception it can be followed by a weak reference."""


class Terminated(KeyboardInterrupt):
    """SIGTERM: handled as Ctrl-C, with its own exit code."""


class StoppedError(Exception):
    """A command was stopped: ``code`` is that of the process; the text says what is stored, and how to go on."""

    def __init__(self, stop: KeyboardInterrupt) -> None:
        word, self.code = ("terminated", 143) if isinstance(stop, Terminated) else ("interrupted", 130)
        stored = "; ".join(getattr(stop, "__notes__", ())) or "no file is half-written, the same command starts again"
        super().__init__(f"{word}: {stored}")


@dataclass
class _State:
    """What has come of the signals of this process."""

    watched: bool = False
    raised: weakref.ref[KeyboardInterrupt] | None = None  # of the last signal
    kind: type[KeyboardInterrupt] | None = None
    arrived: bool = False  # the exception, where it is turned into a line
    told: bool = False
    code: int | None = None  # of a process that leaves after a stop

    @property
    def dropped(self) -> bool:
        """Whether the exception of a signal is gone and has not arrived."""
        return self.raised is not None and self.raised() is None and not self.arrived


_state = _State()
_telling = threading.Lock()


@contextmanager
def stoppable() -> Iterator[None]:
    """Turn Ctrl-C and SIGTERM within the block into :class:`StoppedError`.

    A command that has stored something says so by ``add_note`` on the KeyboardInterrupt.
    """
    try:
        yield
    except KeyboardInterrupt as stop:
        _state.arrived = True
        raise StoppedError(stop) from None


def asked_to_stop() -> StoppedError | None:
    """Tell whether a signal has come: an error that follows it may be what a library made of it."""
    return None if _state.kind is None or _state.told else StoppedError(_state.kind())


def end(stopped: StoppedError) -> int:
    """Print the line of a command that was stopped and give its exit code; a second signal ends the process at once."""
    with _telling:
        _tell(stopped)
    return stopped.code


def leave(code: int) -> NoReturn:
    """Exit the process; after a stop, without destroying what libraries hold.

    A compiler that was left half way may crash when its objects are destroyed.
    """
    if _state.told:
        _state.code = code
    sys.exit(code)


def _skip_destructors() -> None:
    """End a process that leaves after a stop: the last of Python's exit functions."""
    if _state.code is not None:
        for stream in (sys.stdout, sys.stderr):
            with suppress(OSError, ValueError):  # closed, or a pipe that nobody reads
                stream.flush()
        os._exit(_state.code)


def _tell(stopped: StoppedError) -> None:
    _state.told = _state.arrived = True
    print(f"notchbend: {_one_line(str(stopped))}", file=sys.stderr, flush=True)  # noqa: T201


def _one_line(text: str) -> str:
    """Give a text in one line; without importing anything, as the stop may have come while imports run."""
    messages = sys.modules.get("hysteresis.messages")
    one_line: Callable[[str], str] | None = getattr(messages, "one_line", None)
    return text if one_line is None else one_line(text)


def watch() -> None:
    """Take over SIGTERM and, where the shell has not switched it off, SIGINT; call it in the main thread."""
    if _state.told:  # an earlier command of this process was stopped
        _state.raised, _state.kind, _state.arrived, _state.told = None, None, False, False
    sys.unraisablehook = _report_dropped
    if not _state.watched:
        _look_on_from_now()
        _state.watched = True
    signal.signal(signal.SIGTERM, _raise)
    if signal.getsignal(signal.SIGINT) is signal.default_int_handler:
        signal.signal(signal.SIGINT, _raise)


def _look_on_from_now() -> None:
    """Start the thread that looks on after a signal; before the handlers are set, as to start it is to wait."""
    atexit.register(_skip_destructors)  # the first to be registered runs last
    here, there = socket.socketpair()
    there.setblocking(False)
    signal.set_wakeup_fd(there.fileno(), warn_on_full_buffer=False)
    if hasattr(os, "register_at_fork"):  # a signal to a worker is none to this process
        os.register_at_fork(after_in_child=lambda: signal.set_wakeup_fd(-1))
    threading.Thread(target=_look_on, args=(here, there), name="stops", daemon=True).start()


def _raise(number: int, frame: FrameType | None) -> None:
    """Raise the exception of a signal; no name keeps it, so that it is gone as soon as it is dropped."""
    _state.kind = Terminated if number == signal.SIGTERM else Interrupted
    stop = _state.kind()
    if _state.told:  # a second one, while the process ends
        os._exit(StoppedError(stop).code)
    _state.raised = weakref.ref(stop)
    try:
        raise stop
    finally:
        del stop


def _report_dropped(dropped: sys.UnraisableHookArgs) -> None:
    """Report what Python cannot raise, but no stop, which is raised again, and nothing that follows from one."""
    if _state.kind is None:
        sys.__unraisablehook__(dropped)


def _look_on(here: socket.socket, there: socket.socket) -> None:
    """Wait for a signal, then look on until its line is printed; ``there`` is kept open."""
    while True:
        number = here.recv(1)[0]
        if number not in (signal.SIGINT, signal.SIGTERM):
            continue
        begun = time.monotonic()
        while not _state.told:
            time.sleep(LOOK_S)
            if time.monotonic() - begun > GRACE_S and _compiles():
                _end_now(StoppedError((Terminated if number == signal.SIGTERM else Interrupted)()))
            if _state.dropped:
                _signal_main(number)


def _end_now(stopped: StoppedError) -> None:
    """End the process, unless the command is just doing so."""
    with _telling:
        if not _state.told:
            _tell(stopped)
            os._exit(stopped.code)


def _signal_main(number: int) -> None:
    """Send the main thread a signal, which ends what it waits for."""
    main = threading.main_thread().ident
    if hasattr(signal, "pthread_kill") and main is not None:
        signal.pthread_kill(main, number)
    else:  # on Windows
        _thread.interrupt_main(signal.Signals(number))


def _compiles() -> bool:
    """Tell whether another thread compiles a kernel: numba has a lock for it."""
    module = sys.modules.get("numba.core.compiler_lock")
    lock = getattr(getattr(module, "global_compiler_lock", None), "_lock", None)
    if lock is None:
        return False
    if lock.acquire(blocking=False):
        lock.release()
        return False
    return True
