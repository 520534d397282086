"""The same loop in this package and in other codes: ``python benchmarks/peers.py [--json FILE]`` prints Markdown.

Every engine runs in a separate process. Cold is the first loop, with the engine's imports and just-in-time compiling
(numba's cache on disk, which this package and PyElastica use, is not cleared); warm is the median of later loops.
"""

from __future__ import annotations

import argparse
import ast
import importlib
import json
import os
import platform
import statistics
import subprocess
import sys
import time
from collections.abc import Callable, Mapping
from dataclasses import asdict, dataclass
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path
from typing import Any

ENGINES = {  # module here: (name, package)
    "with_chain": ("chain", "notchbend"),
    "with_space": ("chain in space", "notchbend"),
    "with_multibody": ("multibody", "exudyn"),
    "with_mujoco": ("MuJoCo", "mujoco"),
    "with_soromox": ("soromox", "soromox"),
    "with_elastica": ("PyElastica", "pyelastica"),
}
WARM_SECONDS = 10.0  # time for the runs of the median, 3 to 21 of them
TIMEOUT_S = 600
OURS = ("with_chain", "with_space", "with_multibody")


@dataclass(frozen=True)
class FrictionResult:
    """The loop with friction: its width, the width by hand, and the drift over further steps at constant drive."""

    variant: str
    width_deg: float
    by_hand_deg: float
    drift_deg: float


@dataclass(frozen=True)
class EngineResult:
    """Errors and times of one engine, and in which respects it differs from the exact answer."""

    full_drive_error_deg: float
    rmse_deg: float
    rmse_to_own_closed_form_deg: float | None
    warm_s: float
    cold_s: float
    lines: int
    difference: str
    lacks: str
    friction: tuple[FrictionResult, ...]


@dataclass(frozen=True)
class Failed:
    """An engine that could not run, and why."""

    error: str


def measure(module: str) -> EngineResult:
    """Run one engine in this process."""
    start = time.perf_counter()
    import task as tasks  # here, because it imports this package

    task, drive = tasks.frictionless(), tasks.loop_without_friction().drive_mm
    if module not in OURS:
        start = time.perf_counter()
    engine = importlib.import_module(module)
    run = engine.prepare(task, drive)
    angle = run()
    cold = time.perf_counter() - start
    exact = task.exact_deg(drive)
    own = {"chords": exact, "constant arm": task.constant_arm_deg(drive)}.get(engine.CLOSED_FORM)
    variants = getattr(engine, "FRICTION_VARIANTS", ())
    return EngineResult(
        full_drive_error_deg=float((angle - exact)[drive.argmax()]),
        rmse_deg=_rms(angle - exact),
        rmse_to_own_closed_form_deg=None if own is None else _rms(angle - own),
        friction=tuple(_measure_friction(engine, task, variant) for variant in variants),
        warm_s=_median_time(run),
        cold_s=cold,
        lines=code_lines(module_file(module)),
        difference=engine.DIFFERENCE,
        lacks=engine.LACKS,
    )


def _rms(error: Any) -> float:
    return float((error**2).mean() ** 0.5)


def module_file(module: str) -> Path:
    """Give the file of an engine's module."""
    return Path(__file__).with_name(module + ".py")


def _measure_friction(engine: Any, task: Any, variant: str) -> FrictionResult:
    from task import FRICTION_N, loop_with_friction

    from hysteresis.records.metrics import loop_width

    program = loop_with_friction()
    angle, drift = engine.friction_loop(task, program.drive_mm, FRICTION_N, variant)
    width = loop_width(program.drive_mm, angle, program.cycle).max_deg
    return FrictionResult(variant, width, task.friction_width_deg(), drift)


def _median_time(run: Callable[[], object]) -> float:
    times: list[float] = []
    while len(times) < 3 or (sum(times) < WARM_SECONDS and len(times) < 21):
        start = time.perf_counter()
        run()
        times.append(time.perf_counter() - start)
    return statistics.median(times)


def code_lines(path: Path) -> int:
    """Count the lines of a module that hold code: no blank lines, comments or docstrings."""
    text = path.read_text()
    skip: set[int] = set()
    for node in ast.walk(ast.parse(text)):
        if isinstance(node, ast.Expr) and isinstance(node.value, ast.Constant) and isinstance(node.value.value, str):
            skip.update(range(node.lineno, (node.end_lineno or node.lineno) + 1))
    lines = enumerate(text.splitlines(), 1)
    return sum(1 for i, line in lines if i not in skip and line.strip() and not line.lstrip().startswith("#"))


def measure_apart(module: str) -> EngineResult | Failed:
    """Run one engine in a separate process."""
    from hysteresis.plain import from_plain  # here, because the time to import this package is measured

    command = [sys.executable, __file__, "--engine", module]
    try:
        done = subprocess.run(command, capture_output=True, text=True, timeout=TIMEOUT_S, check=False)
    except subprocess.TimeoutExpired:
        return Failed(f"not done after {TIMEOUT_S} s")
    if done.returncode:
        return Failed((done.stderr.strip().splitlines() or ["no message"])[-1])
    return from_plain(EngineResult, json.loads(done.stdout.strip().splitlines()[-1]), module)


def machine() -> str:
    """Describe the machine in one line: processor cores, Python, platform."""
    return f"{os.cpu_count()} cores, {platform.machine()}, Python {platform.python_version()}"


def installed(package: str) -> str:
    """Give the version of a package, or a dash."""
    try:
        return version(package)
    except PackageNotFoundError:
        return "-"


def markdown(results: Mapping[str, EngineResult | Failed]) -> str:
    """Make the tables without and with friction; engines that failed are named below them."""
    done = {m: r for m, r in results.items() if isinstance(r, EngineResult)}
    fastest = min(r.warm_s for r in done.values())
    out = [
        machine(),
        "",
        "| engine | warm, relative to the fastest | error at full drive, deg | RMSE, deg "
        "| RMSE to its own closed form, deg | warm, ms a loop | cold, s | lines "
        "| difference from the exact model | lacks |",
        "|---|---|---|---|---|---|---|---|---|---|",
    ]
    for module, r in done.items():
        name, package = ENGINES[module]
        own = r.rmse_to_own_closed_form_deg
        cells = (
            f"{name} ({package} {installed(package)})",
            f"{r.warm_s / fastest:.3g}",
            f"{r.full_drive_error_deg:.2g}",
            f"{r.rmse_deg:.2g}",
            "-" if own is None else f"{own:.2g}",
            f"{1e3 * r.warm_s:.3g}",
            f"{r.cold_s:.3g}",
            str(r.lines),
            r.difference,
            r.lacks,
        )
        out.append("| " + " | ".join(cells) + " |")
    out += [
        "",
        "| engine, friction | width, deg | width / width by hand | drift over 10,000 further steps, deg |",
        "|---|---|---|---|",
    ]
    for module, r in done.items():
        for f in r.friction:
            out.append(
                f"| {ENGINES[module][0]}, {f.variant} | {f.width_deg:.4f} "
                f"| {f.width_deg / f.by_hand_deg:.3f} | {f.drift_deg:.1e} |"
            )
    out += ["", *_failures(results)]
    return "\n".join(out).rstrip() + "\n"


def _failures(results: Mapping[str, EngineResult | Failed]) -> list[str]:
    return [f"{ENGINES[module][0]}: {r.error}" for module, r in results.items() if isinstance(r, Failed)]


def main() -> None:
    """Measure all engines, or one of them for a parent process."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--json", type=Path, metavar="FILE", help="also write the numbers to this file")
    parser.add_argument("--only", nargs="+", choices=ENGINES, default=list(ENGINES), metavar="MODULE")
    parser.add_argument("--engine", choices=ENGINES, help=argparse.SUPPRESS)
    given = parser.parse_args()
    if given.engine:
        sys.stdout.write(json.dumps(asdict(measure(given.engine))) + "\n")
        return
    results = {module: measure_apart(module) for module in given.only}
    if not any(isinstance(r, EngineResult) for r in results.values()):
        sys.exit("\n".join(_failures(results)))
    sys.stdout.write(markdown(results))
    if given.json:
        versions = {package: installed(package) for _, package in ENGINES.values()}
        engines = {module: asdict(result) for module, result in results.items()}
        text = json.dumps({"machine": machine(), "versions": versions, "engines": engines}, indent=1)
        part = given.json.with_name(given.json.name + ".part")
        part.write_text(text + "\n")
        part.replace(given.json)


if __name__ == "__main__":
    main()
