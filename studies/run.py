"""The main job: simulate at both preloads of the paper, cross-check, identify, and store what the report shows.

Everything the report needs goes into the folder: records (CSV and sidecar), one JSON a fit, ``run.json``, the
picture of the tube. ``notchbend report`` makes the page again from these alone.
"""

from __future__ import annotations

import json
import math
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import replace
from importlib.metadata import version
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray
from rich.console import Console
from rich.progress import BarColumn, Progress, TaskProgressColumn, TextColumn, TimeElapsedColumn

from fem_models.bench import rig_of
from fem_models.kinematics import simulate_analytic, theory_curve
from fem_models.multibody import MultibodySolution, solve_multibody
from fem_models.presets import PRESETS, preset
from fem_models.program import triangle
from fem_models.rig import Rig, numeric_fields
from fem_models.scene import SceneError, render
from fem_models.snr import peak_strain_per_rad
from hysteresis.backbone import Kinematics
from hysteresis.holdout import hold_out
from hysteresis.identify import Fit
from hysteresis.identify import identify as identify_layer
from hysteresis.metrics import dissipated_area, loop_width
from hysteresis.record import Record, read_record, write_files, write_record
from validation.crosscheck import crosscheck
from validation.practice.bench_record import SHIPPED

PRESET = "du2018"
PRELOADS_N = (10.0, 20.0)
AMPLITUDE_MM = 2.2
CYCLES = 3
PACKAGES = ("notchbend", "exudyn", "numpy", "scipy", "numba", "pygad", "pyvista")


def first_report(out: Path, *, seed: int = 0, progress: bool = True) -> dict[str, Any]:
    """Run the main job into ``out`` and return the summary that is stored as ``run.json``.

    Raises
    ------
    SolverError, RecordError, OSError
        What the parts raise; files already written stay, each whole.
    """
    with _steps(progress, total=2 * len(PRELOADS_N) + 3 + len(PRELOADS_N)) as step:
        loops, checks, fits = [], [], []
        records: dict[str, Record] = {}
        for preload in PRELOADS_N:
            step(f"simulating {PRESET} at {preload:g} N")
            rig = preset(PRESET, preload_N=preload)
            solution = solve_multibody(rig, triangle(AMPLITUDE_MM, cycles=CYCLES))
            name = f"{PRESET}-{preload:g}N"
            records[name] = solution.record
            write_record(solution.record, out / "records" / f"{name}.csv")
            theory = f"{name}-analytic"
            write_record(simulate_analytic(rig, triangle(AMPLITUDE_MM)), out / "records" / f"{theory}.csv")
            loops.append(
                {"record": name, "theory": theory, **loop_summary(solution.record), **energy_summary(solution)}
            )
            step(f"cross-checking at {preload:g} N")
            checks.append(crosscheck(rig, amplitude_mm=AMPLITUDE_MM).to_dict())
        shipped = read_record(SHIPPED)
        records[SHIPPED.stem] = shipped
        write_record(shipped, out / "records" / SHIPPED.name)
        # the shipped record twice: with its rig, and as if nothing were known of it
        jobs = [(name, name, True) for name in records] + [(f"{SHIPPED.stem}-unknown-geometry", SHIPPED.stem, False)]
        for label, name, known in jobs:
            step(f"identifying {label}")
            fit = identify_record(records[name], seed=seed, use_rig=known)
            write_fit(fit, records[name], out, f"identify-{label}")
            fits.append({"name": label, "record": name, "title": records[name].title})
        step("drawing the tube")
        picture = _picture(preset(PRESET), records[f"{PRESET}-{PRELOADS_N[-1]:g}N"], out / "tube.png")
    summary = {
        "schema": 1,
        "seed": seed,
        "versions": {name: version(name) for name in PACKAGES},
        "rig": rig_table(PRESET),
        "peak_strain_percent": 100
        * peak_strain_per_rad(preset(PRESET))
        * math.radians(float(np.abs(_joints_deg(records[f"{PRESET}-{PRELOADS_N[-1]:g}N"])).max())),
        "loops": loops,
        "crosscheck": checks,
        "fits": fits,
        "picture": picture,
    }
    write_json(out / "run.json", summary)
    return summary


def crosschecks(rig: Rig, *, progress: bool = True) -> list[dict[str, Any]]:
    """Analytic beside multibody at both preloads."""
    with _steps(progress, total=len(PRELOADS_N)) as step:
        out = []
        for preload in PRELOADS_N:
            step(f"{rig.name} at {preload:g} N")
            out.append(crosscheck(replace(rig, preload_N=preload)).to_dict())
    return out


def identify_record(record: Record, *, seed: int = 0, use_rig: bool = True, progress: bool = False) -> Fit:
    """Identify the layer with the best base that the record allows: user's theory, analytic rig, or a fitted f."""
    base = _analytic(record) if use_rig else None
    with _bar(progress) as bar:
        task = bar.add_task("searching", total=None)
        return identify_layer(
            record, base, seed=seed, progress=lambda done, total: bar.update(task, completed=done, total=total)
        )


def _analytic(record: Record) -> Kinematics | None:
    rig = rig_of(record)  # checks the sidecar's geometry even where the user's own theory is taken
    if rig is None or record.kinematics is not None:
        return None
    return lambda drive: theory_curve(rig, drive).angle_deg


def loop_summary(record: Record) -> dict[str, Any]:
    """Full scale of a record and, where it closes a loop, widest place, width at zero drive, area."""
    full = {"title": record.title, "full_scale_deg": float(np.abs(record.angle_deg).max())}
    try:
        width = loop_width(record.drive, record.angle_deg, record.cycle)
        area = dissipated_area(record.drive, record.angle_deg, record.cycle)
    except ValueError:  # a program of its own need not close a loop
        return full
    return full | {
        "loop_width_deg": width.max_deg,
        "widest_at_drive_mm": width.at_drive,
        "loop_width_at_zero_deg": width.at_zero_deg,
        "loop_area_deg_mm": area,
    }


def energy_summary(solution: MultibodySolution) -> dict[str, float]:
    """Work of the wheel and losses over the last cycle, mJ, and what is left of the balance in percent."""
    cycle = solution.record.cycle
    assert cycle is not None
    last = np.flatnonzero(cycle == cycle[-1])
    first, end = last[0] - 1, last[-1]
    work, friction, material = (
        float(e[end] - e[first]) for e in (solution.wheel_work_mJ, solution.friction_loss_mJ, solution.material_loss_mJ)
    )
    return {
        "wheel_work_mJ": work,
        "friction_loss_mJ": friction,
        "material_loss_mJ": material,
        "energy_gap_percent": 100 * (friction + material - work) / work,
    }


def rig_table(name: str) -> list[dict[str, Any]]:
    """Every number of a preset with its source."""
    known = PRESETS[name]
    return [
        {"name": field, "value": value, "source": known.sources[field].kind, "note": known.sources[field].note}
        for field, value in numeric_fields(known.rig).items()
    ]


def write_fit(fit: Fit, record: Record, out: Path, stem: str) -> None:
    """Write ``STEM.json`` (the contract's identify.json) and ``STEM.csv`` (sample by sample, f alone and with h)."""
    split = hold_out(record)
    alone = fit.backbone.at(record.drive)(fit.backbone.fit(record.drive[split.train], record.angle_deg[split.train]))
    columns = (record.drive, record.angle_deg, alone, fit.predict(record.drive), split.heldout.astype(int))
    rows = zip(*(column.tolist() for column in columns), strict=True)
    lines = ["drive,angle_deg,f_alone_deg,predicted_deg,heldout", *(",".join(map(repr, row)) for row in rows)]
    text = json.dumps(fit.to_dict(), indent=2) + "\n"
    write_files({out / f"{stem}.json": text, out / f"{stem}.csv": "\n".join(lines) + "\n"})


def write_json(path: Path, data: Mapping[str, Any]) -> None:
    """Write JSON whole or not at all; the folder is made."""
    write_files({path: json.dumps(data, indent=2) + "\n"})


def flat(data: Mapping[str, Any], prefix: str = "") -> dict[str, Any]:
    """Nested values under dotted names, for a table on a terminal; long texts and tables of sources left out."""
    out: dict[str, Any] = {}
    for key, value in data.items():
        name = f"{prefix}{key}"
        if name in ("rig", "versions", "fits"):
            continue
        if isinstance(value, Mapping):
            out |= flat(value, name + ".")
        elif isinstance(value, Sequence) and not isinstance(value, str) and value and isinstance(value[0], Mapping):
            for i, item in enumerate(value):
                out |= flat(item, f"{name}[{i}].")
        else:
            out[name] = value
    return out


def _picture(rig: Rig, record: Record, path: Path) -> dict[str, str]:
    """Draw the tube at full drive, or say why there is no picture: a machine without OpenGL can still report."""
    full = int(np.argmax(record.angle_deg))
    try:
        render(rig, _joints_deg(record)[full], path)
    except SceneError as error:
        return {"missing": str(error)}
    return {"file": path.name, "caption": f"{rig.name} at {record.drive[full]:g} mm, {record.angle_deg[full]:.1f} deg"}


def _joints_deg(record: Record) -> NDArray[np.float64]:
    assert record.notches_deg is not None  # every engine returns them
    return record.notches_deg


def _bar(show: bool) -> Progress:
    """Progress bar on standard error, if that is a terminal."""
    console = Console(stderr=True)
    columns = (TextColumn("{task.description}"), BarColumn(), TaskProgressColumn(), TimeElapsedColumn())
    return Progress(*columns, console=console, disable=not (show and console.is_terminal), transient=True)


@contextmanager
def _steps(show: bool, total: int) -> Iterator[Callable[[str], None]]:
    """Progress of named steps; the yielded call begins the next one."""
    with _bar(show) as bar:
        task = bar.add_task("starting", total=total)
        done = -1

        def step(description: str) -> None:
            nonlocal done
            done += 1
            bar.update(task, description=description, completed=done)

        yield step
        bar.update(task, completed=total)
