"""A run of a rig in space as a record: two angles, a tip in space, up to four tensions."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from fem_models.rig import Rig
from fem_models.rig.presets_in_space import sidecar_table_in_space
from fem_models.spatial.drives import WheelProgram
from fem_models.spatial.rig import of_rig_in_space
from fem_models.spatial.solve import SpatialSolution, solve_spatial
from hysteresis.records.record import Record


def simulate_in_space(rig: Rig, program: WheelProgram) -> Record:
    """Run the chain in space.

    Returns
    -------
    Record
        Both bending angles (towards y and z), torsion of the tip, its place (x, y, z), tensions at the wheels, and
        the weak bending of every notch, in its own plane.

    Raises
    ------
    RigError, SolverError
        As :func:`fem_models.spatial.solve.solve_spatial`.
    """
    return record_of(rig, program, solve_spatial(of_rig_in_space(rig), program.of_tendons(rig)))


def record_of(rig: Rig, program: WheelProgram, run: SpatialSolution, engine: str = "chain in space") -> Record:
    """Make the record of a run; ``engine`` is for its title."""
    record = Record(
        drive=program.wheels[:, 0],
        drive_unit="N" if program.by_force else "mm",
        angle_deg=run.bending_deg[:, 0],
        angle_2_deg=run.bending_deg[:, 1],
        torsion_deg=run.torsion_deg,
        title=f"{rig.name}, preload {rig.preload_N:g} N, {engine}",
        kind="simulated",
        time_s=program.time_s,
        cycle=program.cycle,
        notches_deg=run.notches_deg[:, :, 2],
        tip_mm=run.tip_mm,
        rig=sidecar_table_in_space(rig),
    )
    tensions = {
        f"tension_{name}_N": one[:, 0] for name, one in zip("abcd", np.moveaxis(run.tensions_N, 1, 0), strict=False)
    }
    wheels = {} if program.by_force else {f"drive_{k + 1}": one for k, one in enumerate(program.wheels.T) if k > 0}
    return replace(record, **tensions, **wheels)
