"""The record of a run, the same for every engine."""

from __future__ import annotations

import numpy as np

from fem_models.load.program import LoadProgram
from fem_models.rig import Rig
from fem_models.rig.presets import sidecar_table
from hysteresis.arrays import Floats, Mask
from hysteresis.records.record import Record


def simulated_record(
    engine: str,
    rig: Rig,
    program: LoadProgram | Floats,
    *,
    angle_deg: Floats,
    joint_angles_rad: Floats,
    tension_N: Floats,
    tip_mm: Floats,
    jump: Mask | None = None,
) -> Record:
    """Make the record of a run.

    Parameters
    ----------
    program
        The load program; under load control the tensions, shape (m,).
    angle_deg
        Shape (m,), bending at the tip.
    joint_angles_rad
        Shape (m, N), base to tip; they add up to the bending.
    tension_N
        Shape (m, 2), tendons a and b at the wheel.
    tip_mm
        Shape (m, 2), along the straight tube and across it.
    jump
        Shape (m,), whether the tube jumped on the way to a sample; the record has the column where it did anywhere.
    """
    return Record(
        drive=program.drive_mm if isinstance(program, LoadProgram) else program,
        drive_unit="mm" if isinstance(program, LoadProgram) else "N",
        angle_deg=angle_deg,
        title=f"{rig.name}, preload {rig.preload_N:g} N, {engine}",
        kind="simulated",
        time_s=program.time_s if isinstance(program, LoadProgram) else None,
        cycle=program.cycle if isinstance(program, LoadProgram) else None,
        tension_a_N=tension_N[:, 0],
        tension_b_N=None if rig.tendon_b is None else tension_N[:, 1],
        notches_deg=np.degrees(joint_angles_rad),
        tip_mm=tip_mm,
        jump=None if jump is None or not jump.any() else jump.astype(np.int64),
        rig=sidecar_table(rig),
    )
