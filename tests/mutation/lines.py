"""Which tests run a line: from the contexts of a coverage file, and how long each test takes."""

from __future__ import annotations

import ast
import json
import subprocess
import sys
from collections.abc import Iterable
from dataclasses import dataclass
from functools import cache
from pathlib import Path

LONG_S = 30.0
"""Tests that take longer are run only where no other one runs the line."""


@dataclass(frozen=True)
class Tests:
    """Tests by the lines that they run, and their times in seconds, set-up included."""

    by_line: dict[str, dict[int, set[str]]]
    seconds: dict[str, float]

    def of(self, module: str, first: int, last: int, compiled: bool) -> list[str]:
        """Tests that run a statement, the shortest first; those of the module where the lines are not known.

        The lines of kernels are not known, since numba runs them, nor is who uses what runs at import.
        """
        lines = self.by_line.get(module, {})
        found = {test for line in range(first, last + 1) for test in lines.get(line, ())}
        if not found or compiled:
            found = {test for own in lines.values() for test in own}
        ordered = sorted(found, key=lambda test: (self.seconds.get(test, 1e9), test))
        short = [test for test in ordered if self.seconds.get(test, 1e9) <= LONG_S]
        return short or ordered

    def inside(self, folder: str) -> list[str]:
        """All tests of a folder with a known time, the shortest first."""
        own = [test for test in self.seconds if test.startswith(f"{folder}/") and self.seconds[test] <= LONG_S]
        return sorted(own, key=lambda test: (self.seconds[test], test))

    def within(self, tests: Iterable[str], most_s: float) -> list[str]:
        """Give the first of these tests, as many as take ``most_s`` together."""
        out, total = [], 0.0
        for test in tests:
            total += self.seconds.get(test, LONG_S)
            if out and total > most_s:
                break
            out.append(test)
        return out


def read_tests(coverage_files: Iterable[Path], time_files: Iterable[Path]) -> Tests:
    """Read coverage files with the contexts of ``pytest --cov-context=test``, and the times of ``in_order``."""
    from coverage import CoverageData

    by_line: dict[str, dict[int, set[str]]] = {}
    for path in coverage_files:
        data = CoverageData(str(path))
        data.read()
        for file in data.measured_files():
            own = by_line.setdefault(file, {})
            for line, contexts in data.contexts_by_lineno(file).items():
                names = {name.partition("|")[0] for name in contexts if name}
                own.setdefault(line, set()).update(name for name in names if name in collected())
    seconds: dict[str, float] = {}
    for path in time_files:
        for text in path.read_text(encoding="utf-8").splitlines():
            row = json.loads(text)
            if row["test"] not in collected():
                continue
            seconds[row["test"]] = seconds.get(row["test"], 0.0) + row["seconds"]
    return Tests(by_line, seconds)


@cache
def collected() -> frozenset[str]:
    """Tests that pytest finds today: one that is gone since a map was made would keep it from running the others."""
    command = [
        sys.executable,
        "-m",
        "pytest",
        "--collect-only",
        "-q",
        "-o",
        "addopts=--import-mode=importlib",
        "-p",
        "no:xdist",
        "tests",
    ]
    done = subprocess.run(command, capture_output=True, text=True, check=False)
    if done.returncode:
        raise RuntimeError(f"pytest --collect-only: {done.stdout[-500:]}")
    found = frozenset(line.strip() for line in done.stdout.splitlines() if "::" in line)
    if not found:
        raise RuntimeError(f"pytest --collect-only names no test: {done.stdout[-500:]}")
    return found


def is_compiled(source: str, line: int) -> bool:
    """Whether a line is in a kernel, or beside the functions of a file with kernels: a constant may be in one."""
    functions = [node for node in ast.walk(ast.parse(source)) if isinstance(node, ast.FunctionDef)]
    kernels = [f for f in functions if any("njit" in ast.unparse(d) for d in f.decorator_list)]
    inside = [f for f in functions if f.lineno <= line <= (f.end_lineno or f.lineno)]
    return bool(kernels) and (not inside or any(f in kernels for f in inside))
