"""One table at the end of the run: medians with their limits, exponents, machine and versions."""

from __future__ import annotations

import math
import os
import platform
from collections.abc import Callable, Iterator
from dataclasses import dataclass, field
from importlib.metadata import version
from typing import Any

import pytest

PACKAGES = ("notchbend", "numba", "numpy", "scipy", "exudyn", "pytest-benchmark")


@dataclass
class Row:
    """One line of the table; rows of the same ``series``, with a size each, give its exponent."""

    label: str
    seconds: float
    limit_s: float | None = None
    series: str = ""
    size: int = 0
    notes: str = ""


@dataclass
class Table:
    """Rows of a run, and the limit of the exponent of each series."""

    rows: list[Row] = field(default_factory=list)
    exponent_limits: dict[str, float] = field(default_factory=dict)

    def add(self, label: str, seconds: float, limit_s: float | None = None, **more: Any) -> None:
        """Add a row; ``more`` are the further fields of :class:`Row`."""
        self.rows.append(Row(label, seconds, limit_s, **more))


TABLE = pytest.StashKey[Table]()


def pytest_configure(config: pytest.Config) -> None:
    """Start an empty table."""
    config.stash[TABLE] = Table()


@pytest.fixture
def table(request: pytest.FixtureRequest) -> Table:
    """Give the table of this run."""
    return request.config.stash[TABLE]


@pytest.fixture
def median_s(benchmark: Any) -> Callable[..., float]:
    """Time a function after one warm-up call: median over ``rounds``, seconds."""

    def time(function: Callable[[], object], rounds: int) -> float:
        benchmark.pedantic(function, rounds=rounds, iterations=1, warmup_rounds=1)
        return float(benchmark.stats.stats.median)

    return time


def exponent(rows: list[Row]) -> float:
    """Fit the slope of log time over log size by least squares."""
    x, y = [math.log(r.size) for r in rows], [math.log(r.seconds) for r in rows]
    mx, my = sum(x) / len(x), sum(y) / len(y)
    return sum((a - mx) * (b - my) for a, b in zip(x, y, strict=True)) / sum((a - mx) ** 2 for a in x)


def pytest_terminal_summary(terminalreporter: Any, config: pytest.Config) -> None:
    """Print the table."""
    table = config.stash[TABLE]
    if not table.rows:
        return
    terminalreporter.section("medians")
    for line in _lines(table):
        terminalreporter.write_line(line)


def _lines(table: Table) -> Iterator[str]:
    yield f"{os.cpu_count()} cores, {platform.machine()}, Python {platform.python_version()}"
    yield ", ".join(f"{package} {version(package)}" for package in PACKAGES)
    yield ""
    yield "| benchmark | median / limit | median | limit | notes |"
    yield "|---|---|---|---|---|"
    for r in table.rows:
        share, limit = (f"{r.seconds / r.limit_s:.2f}", _time(r.limit_s)) if r.limit_s else ("-", "-")
        yield f"| {r.label} | {share} | {_time(r.seconds)} | {limit} | {r.notes} |"
    for series, limit_of in table.exponent_limits.items():
        rows = sorted((r for r in table.rows if r.series == series), key=lambda r: r.size)
        if len(rows) > 1:
            slope, sizes = exponent(rows), ", ".join(str(r.size) for r in rows)
            yield f"| {series}: exponent in N | {slope / limit_of:.2f} | {slope:.2f} | {limit_of:g} | N = {sizes} |"


def _time(seconds: float) -> str:
    return f"{1e3 * seconds:.3g} ms" if seconds < 1 else f"{seconds:.3g} s"
