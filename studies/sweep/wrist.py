"""Quantities of one case of a study whose rig bends in space: a loop in each plane, workspace, tip compliance."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np

from fem_models.load import LoadProgram
from fem_models.rig import Rig
from fem_models.spatial.drives import WheelProgram
from fem_models.spatial.motion.workspace import tip_compliance, workspace
from fem_models.spatial.rig import of_rig_in_space
from fem_models.spatial.solve import SpatialSolution, solve_spatial
from hysteresis.arrays import Floats
from hysteresis.records.metrics import loop_width
from studies.own_rig.plane import lost_motion_mm, plane_of_loop

CIRCLES, DIRECTIONS = 2, 24
"""Circles of the drives in a workspace, half the amplitude and all of it, and directions on each."""
PLANES = 2
"""Wheels whose loops are taken, each while the others stand still."""
SLACK = 0.01
"""Share of the preload at which a tendon counts as slack: one with a toe region never loses all its tension."""


@dataclass(frozen=True)
class _Loop:
    """The loop of one wheel, in the plane in which the tip bends most."""

    full_scale_angle_deg: float
    loop_width_deg: float
    lost_motion_mm: float
    across_deg: float


def winds_both_ways(rig: Rig) -> bool:
    """Whether a wheel has two tendons, so that it can be driven either way."""
    return any(rig.winds_both_ways(wheel) for wheel in rig.wheels)


def groups_in_space(rig: Rig, program: LoadProgram, groups: Sequence[str]) -> Iterator[dict[str, float]]:
    """Give the quantities of a case, group by group, so that those before an error are kept.

    Parameters
    ----------
    program
        Of one wheel after the other in ``planes``; its largest drive is the amplitude of the other groups.
    groups
        Of ``planes``, ``workspace``, ``compliance``.

    Raises
    ------
    RigError, SolverError
        As the functions of :mod:`fem_models.spatial`, whose name of the group comes first.
    """
    amplitude = float(np.abs(program.drive_mm).max())
    if "planes" in groups:
        yield _planes(rig, program)
    if "workspace" in groups:
        found = workspace(rig, amplitude, circles=CIRCLES, directions=DIRECTIONS)
        yield {
            "largest_bending_deg": float(np.linalg.norm([found.forth_deg, found.back_deg], axis=-1).max()),
            "area_mm2": found.area_mm2(found.forth_mm),
            "area_without_friction_mm2": found.area_mm2(found.smooth_mm),
            "largest_spread_mm": float(found.spread_mm.max()),
            "mean_spread_mm": float(found.spread_mm.mean()),
        }
    if "compliance" in groups:
        first = np.eye(rig.wheel_count)[0]
        for name, wheels in (("straight", 0 * first), ("bent", amplitude * first)):
            tip = tip_compliance(rig, wheels)
            yield {
                f"{name}_compliance_held_mm_per_N": float(np.linalg.norm(tip.held, ord=2)),
                f"{name}_compliance_sliding_mm_per_N": float(np.linalg.norm(tip.sliding, ord=2)),
            }


def _planes(rig: Rig, program: LoadProgram) -> dict[str, float]:
    """Loops of the first wheels, one after the other from rest."""
    found, tensions = dict[str, float](), list[Floats]()
    for k in range(min(PLANES, rig.wheel_count)):
        wheels = np.zeros((program.drive_mm.size, rig.wheel_count))
        wheels[:, k] = program.drive_mm
        run = solve_spatial(of_rig_in_space(rig), WheelProgram(wheels).of_tendons(rig))
        tensions.append(run.tensions_N)
        numbers = [(*name.rsplit("_", 1), value) for name, value in vars(_loop(program, run)).items()]
        found |= {f"{name}_{k + 1}_{unit}": value for name, unit, value in numbers}
    lowest = min(float(one.min()) for one in tensions)
    return found | {
        "tension_max_N": max(float(one.max()) for one in tensions),
        "tension_min_N": lowest,
        "slack_reached": float(lowest <= SLACK * rig.preload_N),
    }


def _loop(program: LoadProgram, run: SpatialSolution) -> _Loop:
    """Measure the loop of one wheel."""
    plane = plane_of_loop(run.bending_deg)
    lost = lost_motion_mm(program, plane)
    return _Loop(
        full_scale_angle_deg=float(np.abs(plane.angle_deg).max()),
        loop_width_deg=loop_width(program.drive_mm, plane.angle_deg, program.cycle).max_deg,
        lost_motion_mm=math.nan if lost is None else lost,
        across_deg=plane.across_deg,
    )
