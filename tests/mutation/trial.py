"""Put one change into this working copy, run tests in a child process, and take the change out again."""

from __future__ import annotations

import io
import math
import os
import re
import resource
import shutil
import signal
import sys
import tempfile
import time
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path

TIMES_NORMAL, START_S, COMPILE_S = 5.0, 15.0, 90.0
"""Limit of a run in seconds of computing: five times its normal time, and what starting and compiling take."""
WAITS_S = 10.0
"""Seconds of the clock for one of computing, after which a run counts as waiting: the machine may be shared."""


@dataclass(frozen=True)
class Outcome:
    """What became of a change: ``killed``, ``timeout`` or ``survived``; by which test; in how many seconds."""

    outcome: str
    test: str
    seconds: float
    words: str = ""


def load_libraries() -> None:
    """Load what the tests use and is not part of the project: each child has it then."""
    parts = ("optimize", "stats", "signal", "integrate", "interpolate", "linalg", "special")
    for name in ("pytest", "hypothesis", "numba", "matplotlib.figure", "pygad", "cma", *(f"scipy.{p}" for p in parts)):
        try:
            __import__(name)
        except ImportError:  # an extra; the test that uses it says so
            continue


@contextmanager
def with_change(root: Path, module: str, code: str, caches: Sequence[str]) -> Iterator[None]:
    """Change a file for a while. Compiled kernels of some folders are made anew; those from before come back."""
    path = root / module
    before, stat = path.read_bytes(), path.stat()
    stored = [f for folder in caches for f in (root / folder).rglob("__pycache__/*.nb?")]
    with tempfile.TemporaryDirectory() as kept:
        for i, file in enumerate(stored):
            shutil.move(file, Path(kept) / str(i))
        try:
            path.write_text(code, encoding="utf-8")
            yield
        finally:
            path.write_bytes(before)
            os.utime(path, ns=(stat.st_atime_ns, stat.st_mtime_ns))
            for folder in caches:
                for made in (root / folder).rglob("__pycache__/*.nb?"):
                    made.unlink()
            for i, file in enumerate(stored):
                shutil.move(Path(kept) / str(i), file)


def run_tests(tests: Sequence[str], limit_s: float) -> Outcome:
    """Run tests in a child of this process until one fails, in their order."""
    started = time.monotonic()
    with tempfile.TemporaryDirectory() as made:
        log, listed = Path(made) / "log", Path(made) / "tests"
        listed.write_text("\n".join(tests), encoding="utf-8")
        child = os.fork()
        if child == 0:
            _child(listed, log, limit_s)
        try:
            while not (ended := os.waitpid(child, os.WNOHANG))[0]:
                if time.monotonic() - started > WAITS_S * limit_s:
                    return Outcome("timeout", "", time.monotonic() - started)
                time.sleep(0.05)
            child = 0
        finally:
            if child:
                os.killpg(child, signal.SIGKILL)
                os.waitpid(child, 0)
        words = log.read_text(encoding="utf-8", errors="replace") if log.exists() else ""
    code, seconds = os.waitstatus_to_exitcode(ended[1]), time.monotonic() - started
    if code in (-signal.SIGXCPU, -signal.SIGKILL):
        return Outcome("timeout", "", seconds)
    if code in (0, 5):
        return Outcome("survived", "", seconds, words[-300:])
    imported = re.search(r"^ERROR (tests/\S+\.py) - (?!KeyboardInterrupt)\w", words, re.MULTILINE)
    if code in (2, 4) and imported:  # what a test module does as it is imported is checked, too
        return Outcome("killed", imported[1], seconds)
    if code in (2, 3, 4):  # interrupted, an error of pytest, tests that are not there: no answer
        raise RuntimeError(f"pytest: {words[-1500:]}")
    found = re.search(r"^(?:FAILED|ERROR) (.+?)(?: - .*)?$", words, re.MULTILINE)
    return Outcome("killed", found[1] if found else f"ended with code {code}", seconds)


def _child(listed: Path, log: Path, limit_s: float) -> None:
    """Run pytest, and end."""
    os.setpgid(0, 0)
    signal.signal(signal.SIGTERM, signal.SIG_DFL)
    resource.setrlimit(resource.RLIMIT_CPU, (math.ceil(limit_s), math.ceil(limit_s)))
    os.environ["PYTHONDONTWRITEBYTECODE"] = "1"
    sys.dont_write_bytecode = True
    for name in [m for m in sys.modules if m.partition(".")[0] in ("tests", "fem_models", "hysteresis", "validation")]:
        del sys.modules[name]
    code = 3
    try:
        import pytest

        with log.open("w", encoding="utf-8") as file:
            sys.stdout = sys.stderr = io.TextIOWrapper(os.fdopen(os.dup(file.fileno()), "wb"), write_through=True)
            plugins = [
                "-o",
                "faulthandler_timeout=0",
                "-p",
                "no:xdist",
                "-p",
                "no:cacheprovider",
                "-p",
                "tests.mutation.in_order",
            ]
            code = int(pytest.main(["-x", "--tb=no", "-rfE", "-m", "", *plugins, f"@{listed}"]))  # the slow ones, too
    finally:
        sys.stdout.flush()
        os._exit(code)
