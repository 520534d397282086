"""The design report of a rig in space: the work of ``notchbend run --rig wrist.toml``.

The loops of the wheels at each preload, the path of the tip round a circle of the drives with friction and without, the
tip compliance, and the workspace. The engine is the chain in space.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, field, replace
from pathlib import Path

import numpy as np

from fem_models.rig import Rig, RigError
from fem_models.rig.checks import SolverError
from fem_models.rig.joints import NotchedTube
from fem_models.rig.rig import with_joint
from fem_models.spatial.drives import WheelProgram, circle, round_axes
from fem_models.spatial.motion.run_record import record_of
from fem_models.spatial.motion.workspace import smooth_rig, workspace
from fem_models.spatial.parameters import SpatialSettings
from fem_models.spatial.rig import of_rig_in_space
from fem_models.spatial.solve import SpatialSolution, solve_spatial
from hysteresis.own import is_own
from hysteresis.records.record import Record
from hysteresis.records.record_file import write_record
from studies.commands.first_report import versions_found
from studies.commands.workspace import compliance_of, write_workspace
from studies.own_rig.design import Design, files_replaced, numbers_of_design, remove_earlier
from studies.own_rig.loops import draw_rig
from studies.own_rig.programs import programs_of_report
from studies.own_rig.wheels import motions_of, wheel_loop
from studies.progress import steps
from studies.results import write_result
from studies.results.files import file_stem
from studies.results.made import Made
from studies.results.run import NOT_DRAWN, checksums
from studies.results.workspace import FILES as WORKSPACE_FILES
from studies.results.workspace import ComplianceAt
from studies.results.wrist import FILE, NotchInSpace, TendonInSpace, TipPath, WheelLoop, WristSummary, read_wrist

STEPS = 20
"""Samples on the radius of a circle, at least."""
FINE = SpatialSettings(max_step_mm=0.01)
"""Steps of a loop: its energy balance closes to first order in the step, within 0.1 % of this one."""
_MOST_STEP_MM = 0.1

Step = Callable[[str], None]


@dataclass
class _Found:
    """What a report has collected so far: records by name, loops, paths, and what was left out."""

    records: dict[str, Record] = field(default_factory=dict)
    loops: list[WheelLoop] = field(default_factory=list)
    paths: list[TipPath] = field(default_factory=list)
    notes: list[str] = field(default_factory=list)


def files_of_wrist(out: Path, design: Design) -> list[Path]:
    """Give the files of a folder that :func:`wrist_report` may replace, but the records of an earlier report."""
    patterns = ("run.json", "report.html", "tube.*", "trace*.json", "separate*.json", *WORKSPACE_FILES)
    known = read_wrist(out).sha256 if is_own(out / FILE) else {}
    return [out / FILE, *files_replaced(out, patterns, [f"{file_stem(design.name)}-*"], known)]


def wrist_report(design: Design, out: Path, *, made: Made | None, progress: bool = True) -> WristSummary:
    """Write the results of a report into ``out`` and return the summary that is stored as ``wrist.json``.

    Summary and page of an earlier run are removed first, and ``wrist.json`` is written last, before the picture. What
    has no equilibrium beside the loops is left out, and a note says why.

    Raises
    ------
    SolverError, RigError, RecordError
        A rig whose wheels cannot follow the drive one by one, or a folder that cannot be written to.
    """
    remove_earlier(out, (FILE, "run.json", "report.html", *WORKSPACE_FILES))
    found, last = _Found(), design.rigs[-1]
    with steps(progress, total=len(design.rigs) * (len(motions_of(last)) + 1) + 3) as step:
        for rig in design.rigs:
            _loops(design, rig, out, found, step)
            _path(design, rig, out, found, step)
        compliance = _compliance(design, found, step)
        _workspace(design, compliance, out, found, made, step)
        summary = WristSummary(
            name=design.name,
            option=design.option,
            amplitude_mm=design.amplitude_mm,
            versions=versions_found(),
            rig=numbers_of_design(design),
            notches=_notches(last),
            tendons=_tendons(last),
            loops=tuple(found.loops),
            paths=tuple(found.paths),
            compliance=compliance,
            picture=NOT_DRAWN,
            notes=tuple(found.notes),
            sha256=checksums(out, found.records),
            made=made,
        )
        write_result(out / FILE, summary)
        step("drawing the wrist")
        shown = found.paths[-1].record if found.paths else found.loops[-1].record
        summary = replace(summary, picture=draw_rig(last, found.records[shown], out))
    write_result(out / FILE, summary)
    return summary


# --- geometry -----------------------------------------------------------------------------------------------------


def _notches(rig: Rig) -> tuple[NotchInSpace, ...]:
    joints, out = of_rig_in_space(rig).joints, list[NotchInSpace]()
    for number, joint in enumerate(joints):
        one = with_joint(rig.in_plane, number).joint
        assert isinstance(one, NotchedTube)  # a rig in space has no measured joints
        assert isinstance(rig.joint, NotchedTube)
        stiff = joint.stiffness
        out.append(
            NotchInSpace(
                middle_mm=float(rig.joint.places().middles[number]),
                turn_deg=rig.turns_deg[number],
                depth_mm=one.cut.depth_mm,
                width_mm=one.cut.width_mm,
                weak_Nmm_per_rad=stiff.weak,
                strong_Nmm_per_rad=stiff.strong,
                torsion_Nmm_per_rad=stiff.torsion,
                closes_at_deg=math.degrees(joint.mechanics.closure_angle_rad),
            )
        )
    return tuple(out)


def _tendons(rig: Rig) -> tuple[TendonInSpace, ...]:
    wound_in = rig.winding().max(axis=0) > 0
    places = zip(rig.angles_deg, rig.wheels, wound_in.tolist(), rig.tendons, strict=True)
    return tuple(
        TendonInSpace(angle, wheel, into, one.moment_arm_mm, one.EA_N, one.free_length_mm)
        for angle, wheel, into, one in places
    )


# --- motion -------------------------------------------------------------------------------------------------------


def _run(rig: Rig, program: WheelProgram, title: str) -> tuple[SpatialSolution, Record]:
    run = solve_spatial(of_rig_in_space(rig), program.of_tendons(rig), FINE)
    record = record_of(rig, program, run)
    return run, replace(record, title=f"{record.title}, {title}")


def _store(found: _Found, out: Path, name: str, record: Record) -> str:
    write_record(record, out / "records" / f"{name}.csv")
    found.records[name] = record
    return name


def _loops(design: Design, rig: Rig, out: Path, found: _Found, step: Step) -> None:
    """Run each motion by itself, with friction and without."""
    for motion in motions_of(rig):
        name = f"{file_stem(design.name)}-{rig.preload_N:g}N-{motion.name.replace(' ', '-')}"
        step(f"simulating {name}")
        loop, theory = programs_of_report(design.amplitude_mm, both_ways=motion.both_ways)
        run, record = _run(rig, motion.of_wheels(loop), motion.name)
        _, plain = _run(smooth_rig(rig), motion.of_wheels(theory), f"{motion.name}, no friction, no loop")
        names = _store(found, out, name, record), _store(found, out, f"{name}-smooth", plain)
        found.loops.append(wheel_loop(rig, motion, loop, run, names))


def _path(design: Design, rig: Rig, out: Path, found: _Found, step: Step) -> None:
    """Move all wheels once round, with friction and without; one wheel through its loop."""
    name, amplitude = f"{file_stem(design.name)}-{rig.preload_N:g}N-path", design.amplitude_mm
    step(f"simulating {name}")
    is_circle = rig.wheel_count > 1
    if is_circle:
        program = circle(amplitude, step_mm=min(_MOST_STEP_MM, amplitude / STEPS), axes=round_axes(rig))
    else:
        (motion,) = motions_of(rig)
        program = motion.of_wheels(programs_of_report(amplitude, both_ways=motion.both_ways)[0])
    try:
        run, record = _run(rig, program, "path")
        smooth, plain = _run(smooth_rig(rig), program, "path, no friction, no loop")
    except SolverError as error:
        found.notes.append(f"{name}: no path of the tip: {error}")
        return
    apart = np.linalg.norm(run.tip_mm - smooth.tip_mm, axis=1)
    pulls = run.tensions_N[:, :, 0]
    found.paths.append(
        TipPath(
            record=_store(found, out, name, record),
            smooth=_store(found, out, f"{name}-smooth", plain),
            preload_N=rig.preload_N,
            circle=is_circle,
            largest_bending_deg=float(np.linalg.norm(run.bending_deg, axis=1).max()),
            largest_apart_mm=float(apart.max()),
            mean_apart_mm=float(apart.mean()),
            least_tension_N=float(pulls.min()),
            largest_tension_N=float(pulls.max()),
        )
    )


def _compliance(design: Design, found: _Found, step: Step) -> tuple[ComplianceAt, ...]:
    step("tip compliance")
    try:
        return compliance_of(design.rigs[-1], design.amplitude_mm)
    except SolverError as error:
        found.notes.append(f"no tip compliance: {error}")
        return ()


def _workspace(
    design: Design,
    compliance: tuple[ComplianceAt, ...],
    out: Path,
    found: _Found,
    made: Made | None,
    step: Step,
) -> None:
    """Find what the tip reaches at the last preload."""
    rig, amplitude = design.rigs[-1], design.amplitude_mm
    step("workspace")
    try:
        reached = workspace(rig, amplitude)
    except (SolverError, RigError) as error:
        found.notes.append(f"no workspace: {error}")
        return
    write_workspace(rig, amplitude, reached, compliance, out, made, found.notes)
