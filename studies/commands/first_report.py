"""The main job: simulate at both preloads of the paper, cross-check, identify, separate, and store it all.

Everything the report needs goes into the folder: records (CSV and sidecar), one JSON a fit, ``run.json``, the
tube, as a picture and as a mesh. ``notchbend report`` makes the page again from these alone.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import replace
from importlib.metadata import version
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from fem_models.analytic.kinematics import simulate_analytic
from fem_models.joint import joint_mechanics
from fem_models.joint.strain import limits_passed, strain_limits
from fem_models.load.program import triangle
from fem_models.multibody.quasi_static import MultibodySolution, solve_multibody
from fem_models.rig.presets import PRESETS, preset
from fem_models.rig.rig import Rig, numeric_fields
from fem_models.view.manipulator import SceneError, render
from hysteresis.files import write_files
from hysteresis.record import Record
from hysteresis.record_file import read_record, write_record
from hysteresis.settings import IdentifySettings
from studies.commands.identification import identify_records, write_fit
from studies.commands.separation import separate_rig
from studies.commands.tracing import trace_loaded
from studies.progress import steps
from studies.report.tube import write_tube
from studies.results import checksums, loop_summary, write_json
from validation.engines import compare_engines
from validation.practice.bench_record import SHIPPED

PRESET = "du2018"
PRELOADS_N = (10.0, 20.0)
AMPLITUDE_MM = 2.2
CYCLES = 3
PACKAGES = ("notchbend", "exudyn", "numpy", "scipy", "numba", "pygad", "pyvista", "plotly")


def first_report(out: Path, *, seed: int = 0, progress: bool = True) -> dict[str, Any]:
    """Run the main job into ``out`` and return the summary that is stored as ``run.json``.

    ``run.json`` and the page of a run before are removed first and ``run.json`` is written last: a folder that has
    it holds a finished run.

    Raises
    ------
    SolverError, RecordError, OSError
        What the parts raise; files already written stay, each whole.
    """
    for name in ("run.json", "report.html"):
        (out / name).unlink(missing_ok=True)
    with steps(progress, total=3 * len(PRELOADS_N) + 5) as step:
        records, loops, checks = _simulated(out, step)
        shipped = read_record(SHIPPED)
        records[SHIPPED.stem] = shipped
        write_record(shipped, out / "records" / SHIPPED.name)
        # the shipped record twice: with its rig, and as if nothing were known of it
        jobs = [(name, name, True) for name in records] + [(f"{SHIPPED.stem}-unknown-geometry", SHIPPED.stem, False)]
        fits = []
        for label, name, known in jobs:
            step(f"identifying {label}")
            fit = identify_records([records[name]], settings=IdentifySettings(seed=seed), use_rig=known)
            write_fit(fit, [records[name]], out, f"identify-{label}")
            fits.append({"name": label, "record": name, "title": records[name].title})
        step(f"separating {PRESET} at {PRELOADS_N[-1]:g} N")
        separations = [_separate(out, PRELOADS_N[-1], seed)]
        step(f"tracing {SHIPPED.stem}")
        traced = trace_loaded([records[SHIPPED.stem]], seed=seed)
        write_json(out / f"trace-{SHIPPED.stem}.json", traced.report.to_dict())
        write_files({out / name: png for name, png in traced.figures.items()})
        step("drawing the tube")
        last = records[f"{PRESET}-{PRELOADS_N[-1]:g}N"]
        picture = _picture(preset(PRESET), last, out)
    largest_joint_rad = math.radians(float(np.abs(_joints_deg(last)).max()))
    summary = {
        "schema": 1,
        "seed": seed,
        "versions": {name: version(name) for name in PACKAGES},
        "rig": rig_table(PRESET),
        "peak_strain_percent": 100 * joint_mechanics(preset(PRESET)).peak_strain_per_rad * largest_joint_rad,
        "loops": loops,
        "crosscheck": checks,
        "fits": fits,
        "separations": separations,
        "trace": {"verdict": traced.report.verdict, "effects": [e.name for e in traced.report.effects]},
        "picture": picture,
        "sha256": checksums(out, [*records, *(loop["theory"] for loop in loops)]),
    }
    write_json(out / "run.json", summary)
    return summary


def _simulated(
    out: Path, step: Callable[[str], None]
) -> tuple[dict[str, Record], list[dict[str, Any]], list[dict[str, Any]]]:
    """Simulate and cross-check at both preloads: records by name, what the loops are like, and the comparisons."""
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
        loops.append(
            {
                "record": name,
                "theory": theory,
                **loop_summary(solution.record),
                **energy_summary(solution),
                **strain_summary(rig, solution),
            }
        )
        step(f"cross-checking at {preload:g} N")
        checks.append(compare_engines(rig, amplitude_mm=AMPLITUDE_MM).to_dict())
    return records, loops, checks


def strain_summary(rig: Rig, solution: MultibodySolution) -> dict[str, Any]:
    """Peak strain of the run, and the drives at which limits of Nitinol are passed; null where they are not."""
    passed = limits_passed(solution.record.drive, solution.peak_strain, strain_limits(rig))
    return {
        "peak_strain_percent": 100 * float(np.abs(solution.peak_strain).max()),
        "strain_limits": [
            {
                "name": p.limit.name,
                "kind": p.limit.kind,
                "limit_percent": 100 * p.limit.strain,
                "largest_percent": 100 * p.largest,
                "passed_at_mm": p.drive,
                "joint": p.joint,
                "source": p.limit.source,
            }
            for p in passed
        ],
    }


def crosschecks(rig: Rig, *, progress: bool = True) -> list[dict[str, Any]]:
    """Analytic beside multibody at both preloads; none for one tendon, whose rig has no preload to speak of."""
    if rig.tendon_b is None:
        return []
    with steps(progress, total=len(PRELOADS_N)) as step:
        out = []
        for preload in PRELOADS_N:
            step(f"{rig.name} at {preload:g} N")
            out.append(compare_engines(replace(rig, preload_N=preload)).to_dict())
    return out


def model_comparison(rig: Rig, *, progress: bool = True) -> dict[str, Any]:
    """Every model of one joint and of the chain beside the solid; see :mod:`validation.joints.models`."""
    from validation.joints import compare_models  # finite elements, which the main job does without

    with steps(progress, total=7) as step:
        return compare_models(rig, progress=step).to_dict()


def energy_summary(solution: MultibodySolution) -> dict[str, float]:
    """Work of the wheel and losses over the last cycle, mJ, and what is left of the balance in percent."""
    cycle = solution.record.cycle
    assert cycle is not None
    last = np.flatnonzero(cycle == cycle[-1])
    first, end = last[0] - 1, last[-1]
    s = solution
    work, friction, material, viscous = (
        float(e[end] - e[first]) for e in (s.wheel_work_mJ, s.friction_loss_mJ, s.material_loss_mJ, s.viscous_loss_mJ)
    )
    return {
        "wheel_work_mJ": work,
        "friction_loss_mJ": friction,
        "material_loss_mJ": material,
        "viscous_loss_mJ": viscous,
        "energy_gap_percent": 100 * (friction + material + viscous - work) / work,
    }


def rig_table(name: str) -> list[dict[str, Any]]:
    """Every number of a preset with its source."""
    known = PRESETS[name]
    return [
        {"name": field, "value": value, "source": known.sources[field].kind, "note": known.sources[field].note}
        for field, value in numeric_fields(known.rig).items()
    ]


def _separate(out: Path, preload_N: float, seed: int) -> dict[str, str]:
    """Divide the loop of the preset by the chain; what was written, and the command that makes it again."""
    name = f"{PRESET}-{preload_N:g}N"
    write_json(
        out / f"separate-{name}.json", separate_rig(preset(PRESET, preload_N=preload_N), AMPLITUDE_MM, seed=seed)
    )
    options = f"--preset {PRESET} --preload {preload_N:g} --amplitude {AMPLITUDE_MM:g} --seed {seed}"
    return {
        "file": f"separate-{name}.json",
        "label": f"{PRESET}, {preload_N:g} N, {AMPLITUDE_MM:g} mm",
        "command": f"notchbend separate {options} --out DIR",
    }


def _picture(rig: Rig, record: Record, out: Path) -> dict[str, str]:
    """Draw the tube at full drive, or say why there is no picture: a machine without OpenGL can still report."""
    full = int(np.argmax(record.angle_deg))
    joints = _joints_deg(record)[full]
    words = {
        "tube": "tube.json",
        "caption": f"{rig.name} at {record.drive[full]:g} mm, {record.angle_deg[full]:.1f} deg",
    }
    write_tube(rig, joints, out / words["tube"])
    try:
        render(rig, joints, out / "tube.png")
    except SceneError as error:
        return {**words, "missing": str(error)}
    return {**words, "file": "tube.png"}


def _joints_deg(record: Record) -> NDArray[np.float64]:
    assert record.notches_deg is not None  # every engine returns them
    return record.notches_deg
