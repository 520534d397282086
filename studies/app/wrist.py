"""Loops, path and picture of a rig in space, computed by the chain in space from the values of the sliders."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np

from fem_models.joint import joint_row
from fem_models.joint.strain import peak_strain, thrust_N
from fem_models.load import LoadProgram
from fem_models.rig import Rig
from fem_models.rig.checks import SolverError
from fem_models.spatial.drives import WheelProgram, circle, round_axes
from fem_models.spatial.motion.run_record import record_of
from fem_models.spatial.motion.workspace import smooth_rig
from fem_models.spatial.rig import of_rig_in_space
from fem_models.spatial.solve import SpatialSolution, solve_spatial
from hysteresis.arrays import Floats
from hysteresis.records.metrics import loop_width
from hysteresis.records.record import Record
from studies.app.advice import warnings_of_run
from studies.app.loop_svg import Plot
from studies.app.playground import AMPLITUDE, Answer, loop_plots, outer_mm, with_values
from studies.app.scene import MeshState, mesh_of_parts
from studies.own_rig.plane import PlaneOfLoop, facing_drive, lost_motion_mm
from studies.own_rig.wheels import Motion, motions_of
from studies.report.tube import wrist_tube
from validation.separation import loop_program

_STEPS = 12
"""Samples on the radius of the circle."""
_Y, _Z = 1, 2


@dataclass(frozen=True)
class _Loop:
    """The run of one motion: its record has the drive of the motion, and its angle is that in the plane of the loop."""

    motion: Motion
    program: LoadProgram
    run: SpatialSolution
    stored: Record
    record: Record
    plane: PlaneOfLoop


def wrist_answer(rig: Rig, values: Mapping[str, float]) -> Answer:
    """Run a cycle of each motion of the rig, and the path of its tip, with the values of the sliders.

    Raises
    ------
    RigError, SolverError
        A rig that is not possible, or cannot follow the drive; one line.
    """
    amplitude = float(values[AMPLITUDE])
    numbers = {name: float(value) for name, value in values.items() if name != AMPLITUDE}
    moved = with_values(rig, numbers)
    loops = [_loop(moved, motion, amplitude) for motion in motions_of(moved)]
    path, smooth, program = _path(moved, loops, amplitude)
    apart = np.linalg.norm(path.tip_mm - smooth.tip_mm, axis=1)
    records = {f"-{one.motion.name.replace(' ', '-')}": one.stored for one in loops}
    if moved.wheel_count > 1:
        records["-path"] = record_of(moved, program, path)
    pulls = np.concatenate([run.tensions_N[:, :, 0] for run in (*(one.run for one in loops), path)])
    bending = np.linalg.norm(path.bending_deg, axis=1)
    strain = 100 * max(float(np.abs(_strain(moved, one.run)).max()) for one in loops)
    figures = [("Largest angle", f"{bending.max():.2f} deg")]
    for one in loops:
        width = loop_width(one.record.drive, one.record.angle_deg, one.record.cycle).max_deg
        figures.append((f"Direction, {one.motion.name}", f"{round(one.plane.direction_deg, 1) + 0.0:.1f} deg from y"))
        figures.append((f"Loop width, {one.motion.name}", f"{width:.2f} deg"))
        lost = lost_motion_mm(one.program, one.plane)
        figures.append((f"Lost motion, {one.motion.name}", "none" if lost is None else f"{lost:.3f} mm"))
    figures += [
        ("Friction moves the tip by", f"{apart.max():.3f} mm"),
        ("Tension", f"{pulls.min():.1f} to {pulls.max():.1f} N"),
        ("Peak strain, weak bending", f"{strain:.2f} %"),
    ]
    return Answer(
        rig=moved,
        records=records,
        figures=tuple(figures),
        warnings=tuple(words for one in loops for words in _warnings(moved, one)),
        plots=(*(plot for one in loops for plot in _plots(one)), _path_plot(path, smooth)),
        mesh=_mesh(moved, path),
        directions_deg=tuple(one.plane.direction_deg for one in loops),
    )


def _loop(rig: Rig, motion: Motion, amplitude_mm: float) -> _Loop:
    program = loop_program(-amplitude_mm if motion.both_ways else 0.0, amplitude_mm)
    run, wheels = _run(rig, motion.of_wheels(program)), motion.of_wheels(program)
    stored, plane = record_of(rig, wheels, run), facing_drive(program.drive_mm, run.bending_deg)
    record = replace(stored, drive=program.drive_mm, angle_deg=plane.angle_deg)
    return _Loop(motion, program, run, stored, record, plane)


def _run(rig: Rig, program: WheelProgram) -> SpatialSolution:
    run = solve_spatial(of_rig_in_space(rig), program.of_tendons(rig))
    if not np.isfinite(run.bending_deg).all():
        raise SolverError(f"rig {rig.name}: angles that are not finite")
    return run


def _path(rig: Rig, loops: list[_Loop], amplitude_mm: float) -> tuple[SpatialSolution, SpatialSolution, WheelProgram]:
    """Go round with friction and without; the only wheel of a rig through its loop."""
    if rig.wheel_count == 1:
        (one,) = loops
        program = one.motion.of_wheels(one.program)
        return one.run, _run(smooth_rig(rig), program), program
    program = circle(amplitude_mm, step_mm=amplitude_mm / _STEPS, axes=round_axes(rig))
    return _run(rig, program), _run(smooth_rig(rig), program), program


def _strain(rig: Rig, run: SpatialSolution) -> Floats:
    return peak_strain(joint_row(rig.in_plane), np.radians(run.notches_deg[:, :, 2]), thrust_N=thrust_N(run.tensions_N))


def _warnings(rig: Rig, one: _Loop) -> list[str]:
    tensions = one.run.tensions_N if len(rig.wheels) > 1 else None
    found = warnings_of_run(rig, one.program.drive_mm, _strain(rig, one.run), tensions)
    return [f"{one.motion.name[0].upper()}{one.motion.name[1:]}: {words}" for words in found]


def _plots(one: _Loop) -> tuple[Plot, Plot]:
    return loop_plots(one.record, f"{one.motion.name}: angle, deg", f"{one.motion.name}: less backbone, deg")


def _path_plot(path: SpatialSolution, smooth: SpatialSolution) -> Plot:
    tips = [(run.tip_mm[:, _Y], run.tip_mm[:, _Z]) for run in (path, smooth)]
    return Plot("path", "tip z, mm", tips[0], smooth=tips[1], x_label="tip y, mm", equal=True)


def _mesh(rig: Rig, path: SpatialSolution) -> MeshState:
    """Give the wrist where it bends most in both planes, else in one."""
    both = path.bending_deg.min(axis=1)
    at = int((both if both.max() > 1.0 else np.linalg.norm(path.bending_deg, axis=1)).argmax())
    stored = wrist_tube(rig, path.notches_deg[at, :, 2])
    parts = stored.points_mm, stored.triangles, stored.strain_percent
    return mesh_of_parts(*parts, stored.tendons_mm, outer_mm(rig))
