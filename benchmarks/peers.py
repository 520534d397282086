"""The same loop in this package and in its peers: ``python benchmarks/peers.py [--json FILE]`` prints Markdown.

Every engine runs in a process of its own. Cold is the first loop with the engine's imports and just-in-time compiling
(numba's on-disk cache, which this package and PyElastica use, is not cleared); warm is the median of later loops.
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
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path
from typing import Any

ENGINES = {  # module here: (name, package)
    "with_chain": ("chain", "notchbend"),
    "with_multibody": ("multibody", "exudyn"),
    "with_mujoco": ("MuJoCo", "mujoco"),
    "with_soromox": ("soromox", "soromox"),
    "with_elastica": ("PyElastica", "pyelastica"),
}
WARM_SECONDS = 10.0  # runs for the median: as many as fit, 3 to 21
TIMEOUT_S = 600
OURS = ("with_chain", "with_multibody")


def measure(module: str) -> dict[str, Any]:
    """Run one engine in this process; what it returns goes through JSON."""
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
    friction = [_measure_friction(engine, task, variant) for variant in getattr(engine, "FRICTION_VARIANTS", ())]
    return {
        "full_drive_error_deg": float((angle - exact)[drive.argmax()]),
        "rmse_deg": _rms(angle - exact),
        "rmse_to_own_closed_form_deg": None if own is None else _rms(angle - own),
        "warm_s": _median_time(run),
        "cold_s": cold,
        "lines": code_lines(module_file(module)),
        "difference": engine.DIFFERENCE,
        "lacks": engine.LACKS,
        "friction": friction,
    }


def _rms(error: Any) -> float:
    return float((error**2).mean() ** 0.5)


def module_file(module: str) -> Path:
    """File of an engine's module, beside this one."""
    return Path(__file__).with_name(module + ".py")


def _measure_friction(engine: Any, task: Any, variant: str) -> dict[str, Any]:
    from task import FRICTION_N, loop_with_friction

    from hysteresis.metrics import loop_width

    program = loop_with_friction()
    angle, drift = engine.friction_loop(task, program.drive_mm, FRICTION_N, variant)
    width = loop_width(program.drive_mm, angle, program.cycle).max_deg
    return {"variant": variant, "width_deg": width, "by_hand_deg": task.friction_width_deg(), "drift_deg": drift}


def _median_time(run: Any) -> float:
    times: list[float] = []
    while len(times) < 3 or (sum(times) < WARM_SECONDS and len(times) < 21):
        start = time.perf_counter()
        run()
        times.append(time.perf_counter() - start)
    return statistics.median(times)


def code_lines(path: Path) -> int:
    """Lines of a module that hold code: no blank lines, comments or docstrings."""
    text = path.read_text()
    skip: set[int] = set()
    for node in ast.walk(ast.parse(text)):
        if isinstance(node, ast.Expr) and isinstance(node.value, ast.Constant) and isinstance(node.value.value, str):
            skip.update(range(node.lineno, (node.end_lineno or node.lineno) + 1))
    lines = enumerate(text.splitlines(), 1)
    return sum(1 for i, line in lines if i not in skip and line.strip() and not line.lstrip().startswith("#"))


def measure_apart(module: str) -> dict[str, Any]:
    """Run one engine in a process of its own; an engine that fails says why in ``error``."""
    command = [sys.executable, __file__, "--engine", module]
    try:
        done = subprocess.run(command, capture_output=True, text=True, timeout=TIMEOUT_S, check=False)
    except subprocess.TimeoutExpired:
        return {"error": f"not done after {TIMEOUT_S} s"}
    if done.returncode:
        return {"error": (done.stderr.strip().splitlines() or ["no message"])[-1]}
    result: dict[str, Any] = json.loads(done.stdout.strip().splitlines()[-1])
    return result


def machine() -> str:
    """One line: processor cores, Python, platform."""
    return f"{os.cpu_count()} cores, {platform.machine()}, Python {platform.python_version()}"


def installed(package: str) -> str:
    """Version of a package, or a dash."""
    try:
        return version(package)
    except PackageNotFoundError:
        return "-"


def markdown(results: dict[str, dict[str, Any]]) -> str:
    """Tables without and with friction; engines that failed are named below them."""
    done = {m: r for m, r in results.items() if "error" not in r}
    fastest = min(r["warm_s"] for r in done.values())
    out = [
        machine(),
        "",
        "| engine | warm, of the fastest | error at full drive, deg | RMSE, deg | RMSE to its own closed form, deg "
        "| warm, ms a loop | cold, s | lines | beside the exact answer | lacks |",
        "|---|---|---|---|---|---|---|---|---|---|",
    ]
    for module, r in done.items():
        name, package = ENGINES[module]
        own = r["rmse_to_own_closed_form_deg"]
        cells = (
            f"{name} ({package} {installed(package)})",
            f"{r['warm_s'] / fastest:.3g}",
            f"{r['full_drive_error_deg']:.2g}",
            f"{r['rmse_deg']:.2g}",
            "-" if own is None else f"{own:.2g}",
            f"{1e3 * r['warm_s']:.3g}",
            f"{r['cold_s']:.3g}",
            str(r["lines"]),
            r["difference"],
            r["lacks"],
        )
        out.append("| " + " | ".join(cells) + " |")
    out += [
        "",
        "| engine, friction | width, deg | of the width by hand | drift over 10,000 further steps, deg |",
        "|---|---|---|---|",
    ]
    for module, r in done.items():
        for f in r["friction"]:
            out.append(
                f"| {ENGINES[module][0]}, {f['variant']} | {f['width_deg']:.4f} "
                f"| {f['width_deg'] / f['by_hand_deg']:.3f} | {f['drift_deg']:.1e} |"
            )
    out += [""] + [f"{ENGINES[m][0]}: {r['error']}" for m, r in results.items() if "error" in r]
    return "\n".join(out).rstrip() + "\n"


def main() -> None:
    """Measure all engines, or one of them for a parent process."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--json", type=Path, metavar="FILE", help="write the figures here as well")
    parser.add_argument("--only", nargs="+", choices=ENGINES, default=list(ENGINES), metavar="MODULE")
    parser.add_argument("--engine", choices=ENGINES, help=argparse.SUPPRESS)
    given = parser.parse_args()
    if given.engine:
        sys.stdout.write(json.dumps(measure(given.engine)) + "\n")
        return
    results = {module: measure_apart(module) for module in given.only}
    if not any("error" not in r for r in results.values()):
        sys.exit("\n".join(f"{ENGINES[m][0]}: {r['error']}" for m, r in results.items()))
    sys.stdout.write(markdown(results))
    if given.json:
        versions = {package: installed(package) for _, package in ENGINES.values()}
        text = json.dumps({"machine": machine(), "versions": versions, "engines": results}, indent=1)
        part = given.json.with_name(given.json.name + ".part")
        part.write_text(text + "\n")
        part.replace(given.json)


if __name__ == "__main__":
    main()
