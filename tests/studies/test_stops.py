"""Ctrl-C and SIGTERM in a process of its own: one line and the exit code, also while imports run or kernels compile."""

import os
import signal
import subprocess
import sys
import time
from pathlib import Path

import pytest

from studies import stops

COMMAND = "from notchbend_start import main; main()"
SIMULATE = ["simulate", "--preset", "du2018", "--amplitude", "0.1", "--cycles", "1", "--engine", "chain"]
CODES = {signal.SIGINT: (130, "interrupted"), signal.SIGTERM: (143, "terminated")}
CALLED_BACK = """
import ctypes, os, signal, sys, time
from studies import stops
stops.watch()
number = getattr(signal, sys.argv[1])
call_back = ctypes.CFUNCTYPE(None)(lambda: os.kill(os.getpid(), number) or time.sleep(0.01))
try:
    with stops.stoppable():
        call_back()  # Python drops what a function raises that C has called
        time.sleep(20)
except stops.StoppedError as stop:
    sys.exit(stops.end(stop))
"""
TURNED = """
import os, signal, sys, time
from studies.commands import cli
def run(*given, **more):
    try:
        os.kill(os.getpid(), getattr(signal, sys.argv[1]))
        time.sleep(20)
    except KeyboardInterrupt:
        pass
    raise RuntimeError("no compiled object yet")  # as a library that the signal has stopped half way
stops = cli.watch()
cli.app = run
sys.exit(cli.call(["effects"]))
"""


def started(code, *arguments, **environment):
    """Start Python with the signals of a terminal: a shell's background jobs ignore Ctrl-C."""
    heard = "import signal; signal.signal(signal.SIGINT, signal.default_int_handler)\n"
    python = [sys.executable, "-c", heard + code, *map(str, arguments)]
    return subprocess.Popen(
        python, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True, env={**os.environ, **environment}
    )


def ended_by(process, number, after_s=0.0):
    time.sleep(after_s)
    begun = time.monotonic()
    process.send_signal(number)
    _, said = process.communicate(timeout=60)
    return time.monotonic() - begun, said


@pytest.mark.parametrize("number", CODES)
@pytest.mark.parametrize("code", [CALLED_BACK, TURNED], ids=["called back", "turned into another error"])
def test_a_stop_that_a_library_drops_or_turns_is_one_line_and_the_code(code, number):
    process = started(code, number.name)
    _, said = process.communicate(timeout=60)
    expected, word = CODES[number]
    assert (process.returncode, said.count("\n")) == (expected, 1), said
    assert said.startswith(f"notchbend: {word}: ")


@pytest.mark.parametrize("number", CODES)
def test_a_stop_while_imports_run_is_one_line(number):
    for after_s in (0.2, 0.4):
        process = started(COMMAND, "effects")
        _, said = ended_by(process, number, after_s)
        expected, word = CODES[number]
        if process.returncode == -number:  # Python itself was still starting
            continue
        assert (process.returncode, said.count("\n")) == (expected, 1), said
        assert word in said


@pytest.mark.slow  # the kernels compile
@pytest.mark.parametrize("number", CODES)
def test_a_stop_while_kernels_compile_is_one_line_and_the_cache_stays_usable(number, tmp_path):
    cache = {"NUMBA_CACHE_DIR": str(tmp_path / "cache")}
    expected, word = CODES[number]
    for after_s in (4, 9):  # those of the first are in the cache of the second
        process = started(COMMAND, *SIMULATE, "--out", tmp_path / "loop.csv", **cache)
        took, said = ended_by(process, number, after_s)
        assert process.returncode == expected, said
        lines = said.splitlines()
        assert len(lines) <= 2, said  # the other one says what runs
        assert lines[-1].startswith(f"notchbend: {word}: ")
        assert took < 3.0  # s; a second of grace, and a busy machine
        assert not list(tmp_path.glob("*.csv"))
    if number == signal.SIGTERM:
        process = started(COMMAND, *SIMULATE, "--out", tmp_path / "loop.csv", **cache)
        _, said = process.communicate(timeout=300)
        assert process.returncode == 0, said
        assert Path(tmp_path / "loop.csv").exists()


def test_a_stop_says_what_is_stored():
    stop = stops.Terminated()
    stop.add_note("3 of 4 cases are stored")
    with pytest.raises(stops.StoppedError, match=r"^terminated: 3 of 4 cases are stored$") as caught, stops.stoppable():
        raise stop
    assert caught.value.code == 143


def test_a_stop_is_over_with_its_line(monkeypatch, capsys):
    """A process that runs several commands, as the tests do, is not told of an earlier stop."""
    monkeypatch.setattr(stops, "_state", stops._State(kind=stops.Interrupted))
    stopped = stops.asked_to_stop()
    assert stopped is not None
    assert stops.end(stopped) == 130
    assert stops.asked_to_stop() is None
    assert stops.end(stops.StoppedError(KeyboardInterrupt())) == 130
    assert capsys.readouterr().err.count("notchbend: interrupted: ") == 2
