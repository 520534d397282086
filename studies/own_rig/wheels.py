"""What the loop of one wheel says of a rig in space: angles, lost motion, tensions, strain, energy."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from fem_models.joint import joint_row
from fem_models.joint.strain import peak_strain, thrust_N
from fem_models.load import LoadProgram
from fem_models.rig import Rig
from fem_models.spatial.drives import WheelProgram, round_axes
from fem_models.spatial.solve import SpatialSolution
from hysteresis.arrays import Floats
from hysteresis.records.metrics import dissipated_area, loop_width
from studies.own_rig.loops import energy_of_cycle, fatigue_amplitude_mm, slack_from_mm
from studies.own_rig.plane import facing_drive, lost_motion_mm
from studies.own_rig.strain import strain_of
from studies.results.wrist import WheelLoop

_DIGITS = 9
"""Of angles that are 0 but for rounding."""


@dataclass(frozen=True)
class Motion:
    """A motion of which a report has the loop: ``unit`` has the drives of all wheels for a drive of 1 mm."""

    name: str
    unit: Floats
    both_ways: bool

    def of_wheels(self, program: LoadProgram) -> WheelProgram:
        """Move the wheels by a planar program."""
        return WheelProgram(program.drive_mm[:, None] * self.unit, program.time_s, program.cycle)


def motions_of(rig: Rig) -> tuple[Motion, ...]:
    """Give the motions of a rig: each of one or two wheels while the other one stands still.

    Three wheels or four bend the wrist towards y and towards z together, for a tendon whose opposite one stands still
    would be pulled against it (:func:`fem_models.spatial.drives.round_axes`).
    """
    if rig.wheel_count > 2:
        return tuple(Motion(f"towards {name}", row, True) for name, row in zip("yz", round_axes(rig), strict=True))
    units = np.eye(rig.wheel_count)
    return tuple(Motion(f"wheel {k + 1}", unit, rig.winds_both_ways(k + 1)) for k, unit in enumerate(units))


def wheel_loop(
    rig: Rig, motion: Motion, program: LoadProgram, run: SpatialSolution, names: tuple[str, str]
) -> WheelLoop:
    """Measure the loop of a motion, as the planar report does.

    ``names`` are the records of the loop and of the run without friction.
    """
    drive, cycle = program.drive_mm, program.cycle
    assert cycle is not None
    plane = facing_drive(drive, run.bending_deg)
    width = loop_width(drive, plane.angle_deg, cycle)
    angles = np.radians(run.notches_deg[:, :, 2])
    strain = peak_strain(joint_row(rig.in_plane), angles, thrust_N=thrust_N(run.tensions_N))
    energies = np.array([run.work_mJ, run.friction_mJ, run.material_mJ, np.zeros_like(run.work_mJ)])
    pulls = run.tensions_N[:, :, 0]
    return WheelLoop(
        record=names[0],
        theory=names[1],
        title=f"{rig.name}, preload {rig.preload_N:g} N, {motion.name}",
        full_scale_deg=float(np.abs(plane.angle_deg).max()),
        loop_width_deg=width.max_deg,
        widest_at_drive_mm=width.at_drive,
        loop_width_at_zero_deg=width.at_zero_deg,
        loop_area_deg_mm=dissipated_area(drive, plane.angle_deg, cycle),
        **vars(energy_of_cycle(cycle, energies)),
        **vars(strain_of(rig.in_plane, drive, strain)),
        preload_N=rig.preload_N,
        slack_from_mm=slack_from_mm(rig.preload_N, drive, run.tensions_N) if len(rig.wheels) > 1 else None,
        fatigue_amplitude_mm=fatigue_amplitude_mm(drive, strain, both_ways=motion.both_ways),
        moves=motion.name,
        unit=tuple(motion.unit.tolist()),
        one_way=not motion.both_ways,
        direction_deg=round(plane.direction_deg, _DIGITS) + 0.0,  # turns -0.0 into 0.0
        across_deg=round(plane.across_deg, _DIGITS),
        lost_motion_mm=lost_motion_mm(program, plane),
        largest_torsion_deg=round(float(np.abs(run.torsion_deg).max()), _DIGITS),
        least_tension_N=float(pulls.min()),
        largest_tension_N=float(pulls.max()),
    )
