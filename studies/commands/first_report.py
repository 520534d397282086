"""The work of ``notchbend run``: simulate at both preloads of the paper, cross-check, identify, separate, and trace.

Everything that the report needs goes into one folder: records (CSV and sidecar), one JSON file for each fit,
``run.json``, and the bent tube as a picture and as a mesh. ``notchbend report`` writes the page again from these.
"""

from __future__ import annotations

import math
import tempfile
from collections.abc import Callable
from dataclasses import dataclass
from importlib.metadata import version
from pathlib import Path

import numpy as np

from fem_models.analytic import simulate_analytic
from fem_models.joint import joint_mechanics
from fem_models.joint.strain import limits_passed, strain_limits
from fem_models.load import triangle
from fem_models.multibody.quasi_static import MultibodySolution, solve_multibody
from fem_models.rig import Rig, preset
from fem_models.rig.presets import PRESETS
from fem_models.rig.rig import numeric_fields
from fem_models.view import SceneError, render
from hysteresis.arrays import Floats
from hysteresis.files import write_files
from hysteresis.own import marked_png
from hysteresis.record import Record
from hysteresis.record_file import read_record, write_record
from hysteresis.settings import IdentifySettings
from studies.commands.identification import identify_records, write_fit
from studies.commands.separation import separate_rig
from studies.commands.tracing import FILES as TRACE_FILES
from studies.commands.tracing import trace_loaded
from studies.progress import steps
from studies.report.tube import write_tube
from studies.results import write_result
from studies.results.run import (
    CrossCheckRow,
    FitEntry,
    Picture,
    RigNumber,
    RunLoop,
    RunSummary,
    SeparationEntry,
    StrainLimit,
    TraceEntry,
    checksums,
    loop_summary,
)
from validation.engines import compare_engines
from validation.practice.bench_record import SHIPPED

PRESET = "du2018"
PRELOADS_N = (10.0, 20.0)
AMPLITUDE_MM = 2.2
CYCLES = 3
PACKAGES = ("notchbend", "exudyn", "numpy", "scipy", "numba", "pygad", "pyvista", "plotly")

Step = Callable[[str], None]


@dataclass(frozen=True)
class Energy:
    """Work of the wheel and losses over the last cycle, and the error of the energy balance."""

    wheel_work_mJ: float
    friction_loss_mJ: float
    material_loss_mJ: float
    viscous_loss_mJ: float
    energy_gap_percent: float


@dataclass(frozen=True)
class Strain:
    """Peak strain of a run, and the drives at which strain limits of Nitinol are exceeded."""

    peak_strain_percent: float
    strain_limits: tuple[StrainLimit, ...]


def files_of_run(out: Path) -> list[Path]:
    """Give the files that :func:`first_report` and the report after it may write."""
    loops = [f"{PRESET}-{preload:g}N" for preload in PRELOADS_N]
    records = [*loops, *(f"{name}-analytic" for name in loops), SHIPPED.stem]
    fits = [f"identify-{name}" for name in (*loops, SHIPPED.stem, f"{SHIPPED.stem}-unknown-geometry")]
    jsons = ["run", *fits, f"separate-{loops[-1]}", f"trace-{SHIPPED.stem}", "tube"]
    names = [*(f"{name}.json" for name in jsons), *(f"{name}.csv" for name in fits), "report.html", "tube.png"]
    pictures = [name for name in TRACE_FILES if name.endswith(".png")]
    return [
        *(out / name for name in (*names, *pictures)),
        *(out / "records" / f"{name}{end}" for name in records for end in (".csv", ".toml")),
    ]


def first_report(out: Path, *, seed: int = 0, progress: bool = True) -> RunSummary:
    """Run the main job into ``out`` and return the summary that is stored as ``run.json``.

    ``run.json`` and the page of an earlier run are removed first, and ``run.json`` is written last: a folder that has
    it holds a finished run.

    Raises
    ------
    SolverError, RecordError, OSError
        From the parts; files that are already written stay, each of them complete.
    """
    for name in ("run.json", "report.html"):
        (out / name).unlink(missing_ok=True)
    with steps(progress, total=3 * len(PRELOADS_N) + 5) as step:
        records, loops, checks = _simulated(out, step)
        shipped = read_record(SHIPPED)
        records[SHIPPED.stem] = shipped
        write_record(shipped, out / "records" / SHIPPED.name)
        fits = _identified(out, records, seed, step)
        step(f"separating {PRESET} at {PRELOADS_N[-1]:g} N")
        separation = _separated(out, PRELOADS_N[-1], seed)
        step(f"tracing {SHIPPED.stem}")
        traced = trace_loaded([shipped], seed=seed)
        write_result(out / f"trace-{SHIPPED.stem}.json", traced.report.to_dict())
        write_files({out / name: marked_png(png) for name, png in traced.figures.items()})
        step("drawing the tube")
        last = records[f"{PRESET}-{PRELOADS_N[-1]:g}N"]
        picture = _picture(preset(PRESET), last, out)
    largest_joint_rad = math.radians(float(np.abs(_joints_deg(last)).max()))
    summary = RunSummary(
        seed=seed,
        versions={name: version(name) for name in PACKAGES},
        rig=rig_numbers(PRESET),
        peak_strain_percent=100 * joint_mechanics(preset(PRESET)).peak_strain_per_rad * largest_joint_rad,
        loops=tuple(loops),
        crosscheck=tuple(checks),
        fits=tuple(fits),
        separations=(separation,),
        trace=TraceEntry(traced.report.verdict, tuple(effect.name for effect in traced.report.effects)),
        picture=picture,
        sha256=checksums(out, [*records, *(loop.theory for loop in loops)]),
    )
    write_result(out / "run.json", summary)
    return summary


def _simulated(out: Path, step: Step) -> tuple[dict[str, Record], list[RunLoop], list[CrossCheckRow]]:
    """Simulate and cross-check at both preloads: the records by name, their loops, and the comparisons of engines."""
    records, loops, checks = {}, [], []
    for preload in PRELOADS_N:
        step(f"simulating {PRESET} at {preload:g} N")
        rig = preset(PRESET, preload_N=preload)
        solution = solve_multibody(rig, triangle(AMPLITUDE_MM, cycles=CYCLES))
        name = f"{PRESET}-{preload:g}N"
        records[name] = solution.record
        write_record(solution.record, out / "records" / f"{name}.csv")
        theory = f"{name}-analytic"
        write_record(simulate_analytic(rig, triangle(AMPLITUDE_MM)), out / "records" / f"{theory}.csv")
        parts = (loop_summary(solution.record), energy_summary(solution), strain_summary(rig, solution))
        loops.append(RunLoop(record=name, theory=theory, **{k: v for part in parts for k, v in vars(part).items()}))
        step(f"cross-checking at {preload:g} N")
        checks.append(CrossCheckRow(**vars(compare_engines(rig, amplitude_mm=AMPLITUDE_MM))))
    return records, loops, checks


def _identified(out: Path, records: dict[str, Record], seed: int, step: Step) -> list[FitEntry]:
    """Identify each record; the shipped one twice, with its rig and as if the rig were unknown."""
    jobs = [(name, name, True) for name in records] + [(f"{SHIPPED.stem}-unknown-geometry", SHIPPED.stem, False)]
    fits = []
    for label, name, use_rig in jobs:
        step(f"identifying {label}")
        fit = identify_records([records[name]], settings=IdentifySettings(seed=seed), use_rig=use_rig)
        write_fit(fit, [records[name]], out, f"identify-{label}")
        fits.append(FitEntry(label, name, records[name].title))
    return fits


def strain_summary(rig: Rig, solution: MultibodySolution) -> Strain:
    """Find the peak strain of a run, and the drives at which limits of Nitinol are exceeded; None where none is."""
    passed = limits_passed(solution.record.drive, solution.peak_strain, strain_limits(rig))
    limits = (
        StrainLimit(
            name=p.limit.name,
            kind=p.limit.kind,
            limit_percent=100 * p.limit.strain,
            largest_percent=100 * p.largest,
            passed_at_mm=p.drive,
            joint=p.joint,
            source=p.limit.source,
        )
        for p in passed
    )
    return Strain(100 * float(np.abs(solution.peak_strain).max()), tuple(limits))


def energy_summary(solution: MultibodySolution) -> Energy:
    """Sum the work of the wheel and the losses over the last cycle."""
    cycle = solution.record.cycle
    assert cycle is not None
    last = np.flatnonzero(cycle == cycle[-1])
    first, end = last[0] - 1, last[-1]
    s = solution
    work, friction, material, viscous = (
        float(e[end] - e[first]) for e in (s.wheel_work_mJ, s.friction_loss_mJ, s.material_loss_mJ, s.viscous_loss_mJ)
    )
    return Energy(work, friction, material, viscous, 100 * (friction + material + viscous - work) / work)


def rig_numbers(name: str) -> tuple[RigNumber, ...]:
    """Give every number of a preset with its source."""
    known = PRESETS[name]
    return tuple(
        RigNumber(field, value, known.sources[field].kind, known.sources[field].note)
        for field, value in numeric_fields(known.rig).items()
    )


def _separated(out: Path, preload_N: float, seed: int) -> SeparationEntry:
    """Divide the loop of the preset with the chain, and store the result."""
    name = f"{PRESET}-{preload_N:g}N"
    write_result(
        out / f"separate-{name}.json", separate_rig(preset(PRESET, preload_N=preload_N), AMPLITUDE_MM, seed=seed)
    )
    options = f"--preset {PRESET} --preload {preload_N:g} --amplitude {AMPLITUDE_MM:g} --seed {seed}"
    return SeparationEntry(
        file=f"separate-{name}.json",
        label=f"{PRESET}, {preload_N:g} N, {AMPLITUDE_MM:g} mm",
        command=f"notchbend separate {options} --out DIR",
    )


def _picture(rig: Rig, record: Record, out: Path) -> Picture:
    """Draw the tube at full drive; without OpenGL there is no still image, and the result says why."""
    full = int(np.argmax(record.angle_deg))
    joints = _joints_deg(record)[full]
    caption = f"{rig.name} at {record.drive[full]:g} mm, {record.angle_deg[full]:.1f} deg"
    write_tube(rig, joints, out / "tube.json")
    try:
        with tempfile.TemporaryDirectory(prefix=".tube-", dir=out) as folder:
            render(rig, joints, Path(folder) / "tube.png")
            write_files({out / "tube.png": marked_png((Path(folder) / "tube.png").read_bytes())})
    except SceneError as error:
        return Picture(tube="tube.json", caption=caption, missing=str(error))
    return Picture(tube="tube.json", caption=caption, file="tube.png")


def _joints_deg(record: Record) -> Floats:
    assert record.notches_deg is not None  # every engine gives them
    return record.notches_deg
