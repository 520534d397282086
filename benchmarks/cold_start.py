"""What is compiled from an empty cache, and how long it takes: ``python -m benchmarks.cold_start [COMMAND...]``.

COMMAND is one of ``notchbend`` with its options; by default a loop by the chain. It runs in a folder of its own, first
with an empty cache of compiled kernels and then with the one that it has filled. Each row is a function that numba
compiled: seconds of processor time without those that it calls, for how many kinds of arguments, and what took most of
it. Last comes what a user waits for: processor time of the whole command, of the first run and of the second one.
With ``--without-kernels [FOLDER...]`` commands that are to compile nothing run instead, and the reports of these
folders of results; what each of them compiled is counted.
"""

from __future__ import annotations

import argparse
import atexit
import json
import os
import resource
import subprocess
import sys
import tempfile
import time
from collections import Counter, defaultdict
from pathlib import Path
from typing import Any

from numba.core import event

LOOP = "simulate --preset du2018 --engine chain --amplitude 2.2 --out loop.csv --quiet"
WITHOUT_KERNELS = (
    "--help",
    "simulate --help",
    "data list",
    "effects",
    "record new bench.csv",
    "simulate --preset no-such --amplitude 1 --out loop.csv",
    "identify no-such.csv --out fit",
    "trace no-such.csv --out trace",
)
SHOWN = 40


class Passes(event.Listener):  # type: ignore[misc]
    """Processor time of each pass of the compiler over each function, without that of those nested in it."""

    def __init__(self) -> None:
        self.seconds: dict[tuple[str, str, str], float] = defaultdict(float)
        self._open: list[list[float]] = []

    def on_start(self, event: Any) -> None:
        """Begin a pass."""
        self._open.append([time.process_time(), 0.0])

    def on_end(self, event: Any) -> None:
        """End the last pass that began."""
        start, nested = self._open.pop()
        whole = time.process_time() - start
        if self._open:
            self._open[-1][1] += whole
        data = event.data
        name = str(data["name"]).split(" ")[0]
        self.seconds[f"{data['module']}.{data['qualname']}", str(data["args"]), name] += whole - nested


def listen(file: str) -> None:
    """Write what this process compiles to a file when it ends."""
    passes = Passes()
    event.register("numba:run_pass", passes)
    atexit.register(lambda: Path(file).write_text(json.dumps([[*key, s] for key, s in passes.seconds.items()])))


def run(command: list[str], folder: Path, file: Path | None = None) -> tuple[int, float]:
    """Run a command; give its exit code and seconds of processor time. What it compiles goes to a file."""
    listening = f"from benchmarks.cold_start import listen; listen({str(file)!r}); " if file else ""
    code = f"{listening}from notchbend_start import main; main()"
    home = {"NUMBA_CACHE_DIR": str(folder / "cache"), "PYTHONPATH": str(Path(__file__).parents[1])}
    before = resource.getrusage(resource.RUSAGE_CHILDREN)
    done = subprocess.run(
        [sys.executable, "-c", code, *command],
        cwd=folder,
        env=os.environ | home,
        check=False,
        stdout=subprocess.DEVNULL,
        stderr=subprocess.DEVNULL,
    )
    after = resource.getrusage(resource.RUSAGE_CHILDREN)
    return done.returncode, after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime


def compiled(file: Path) -> list[tuple[str, str, str, float]]:
    """Rows of a file of :func:`listen`."""
    return [(name, kinds, step, s) for name, kinds, step, s in json.loads(file.read_text())]


def count_kernels(folder: Path, results: list[str]) -> None:
    """Print how many functions each command compiles that is to compile none; reports of folders of results, too."""
    (folder / "bench.csv").write_text("drive_mm,angle_deg\n" + "0,0\n1,9\n2,19\n1,11\n0,1\n-1,-9\n-2,-19\n" * 3)
    for number, command in enumerate((*WITHOUT_KERNELS, *(f"report {one}" for one in results))):
        code, seconds = run(command.split(), folder, folder / f"{number}.json")
        names = {name for name, *_ in compiled(folder / f"{number}.json")}
        print(f"{len(names):4d} compiled, exit {code}, {seconds:5.1f} s  notchbend {command}")  # noqa: T201


def table(command: list[str], folder: Path) -> None:
    """Print what a command compiles, and its time from an empty cache and after that."""
    code, first = run(command, folder, folder / "rows.json")
    if code:
        sys.exit(f"notchbend {' '.join(command)}: exit {code}")
    seconds, steps, kinds = Counter[str](), defaultdict[str, Counter[str]](Counter), defaultdict[str, set[str]](set)
    for name, arguments, step, s in compiled(folder / "rows.json"):
        seconds[name] += s
        steps[name][step] += s
        kinds[name].add(arguments)
    for name, s in seconds.most_common(SHOWN):
        most = ", ".join(f"{step} {value:.2f}" for step, value in steps[name].most_common(2))
        print(f"{s:7.2f} s  {len(kinds[name])}  {name}  ({most})")  # noqa: T201
    rest = sum(seconds.values()) - sum(s for _, s in seconds.most_common(SHOWN))
    print(f"{rest:7.2f} s  the other {max(0, len(seconds) - SHOWN)} of {len(seconds)} functions")  # noqa: T201
    _, second = run(command, folder)
    print(f"{first:7.1f} s  first run, {sum(seconds.values()):.1f} s of it in the compiler")  # noqa: T201
    print(f"{second:7.1f} s  second run")  # noqa: T201


def main() -> None:
    """Print the table of a command, or what is compiled by those that are to compile nothing."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--without-kernels", action="store_true")
    parser.add_argument("command", nargs=argparse.REMAINDER)
    asked = parser.parse_args()
    with tempfile.TemporaryDirectory() as place:
        if asked.without_kernels:
            count_kernels(Path(place), asked.command)
        else:
            table(asked.command or LOOP.split(), Path(place))


if __name__ == "__main__":
    main()
