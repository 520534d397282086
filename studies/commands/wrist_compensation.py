"""``notchbend compensate`` of a rig in space: the motion of the wheels that makes the tip follow two angles."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np

from fem_models.rig import Rig, RigError
from fem_models.rig.checks import SolverError
from fem_models.rig.rig_file import read_any_rig
from fem_models.spatial.drives import WheelProgram
from fem_models.spatial.motion.compensated import compensated_wheels
from fem_models.spatial.motion.run_record import simulate_in_space
from fem_models.spatial.motion.workspace import smooth_rig
from hysteresis.arrays import Floats
from hysteresis.records.record import Record, RecordError
from hysteresis.records.record_file import check_target, files_of_record, read_columns, write_record
from studies.commands.options import Common, Overwrite
from studies.commands.tables import values_table
from studies.progress import Count, counted
from studies.results import write_result
from studies.results.compensation import ENDING, SpaceCompensation
from studies.results.made import made_now


def compensate_rig(rig: Path, reference: Path, out: Path, replacing: Overwrite, common: Common) -> None:
    """Write the wheel motions as a record, and the errors beside it.

    Raises
    ------
    RigError, RecordError, SolverError
        A planar rig, a reference without both angles, or angles out of reach; one line.
    """
    check_target(out, [rig, reference])
    target = out.with_name(out.stem + ENDING)
    replacing.allow([*files_of_record(out), target])
    chosen = read_any_rig(rig)
    if chosen.is_planar:
        raise RigError(
            f"{rig}: rig {chosen.name} bends in one plane: expected a record of it, CSV, or an identify.json"
        )
    columns = read_columns(reference, ["angle_deg", "angle_2_deg"], optional=["time_s"])
    made, wanted = made_now(common.command), np.column_stack([columns["angle_deg"], columns["angle_2_deg"]])
    try:
        with counted(common.shows_progress, f"drives of {chosen.name}") as count:
            record, plain = follow(chosen, wanted, columns.get("time_s"), count)
    except SolverError as error:
        raise SolverError(f"{reference}: {error}") from None
    write_record(replace(record, rig={"file": str(rig.absolute()), **record.rig}), out)
    errors, before = off_deg(record, wanted), off_deg(plain, wanted)
    summary = SpaceCompensation(
        schema=1,
        rig=chosen.name,
        reference=str(reference),
        drive=out.name,
        samples=len(wanted),
        rms_deg=float(np.sqrt(np.mean(errors**2))),
        largest_error_deg=float(errors.max()),
        rms_without_compensation_deg=float(np.sqrt(np.mean(before**2))),
        largest_correction_mm=float(np.abs(_wheels(record) - _wheels(plain)).max()),
        made=made,
    )
    write_result(target, summary)
    numbers = {name: value for name, value in vars(summary).items() if isinstance(value, str | int | float)}
    common.show(summary, values_table(numbers), f"drives: {out}")


def follow(
    rig: Rig, wanted_deg: Floats, time_s: Floats | None = None, progress: Count | None = None
) -> tuple[Record, Record]:
    """Simulate the drives that follow wanted angles, shape (s, 2), and those of the wrist without friction and loop.

    Raises
    ------
    RigError, RecordError, SolverError
        As :func:`fem_models.spatial.motion.compensated.compensated_wheels`; fewer than 3 samples.
    """
    if len(wanted_deg) < 3:
        raise RecordError(f"{len(wanted_deg)} angles: expected at least 3")
    found = compensated_wheels(rig, wanted_deg, progress=progress)
    plain = compensated_wheels(smooth_rig(rig), wanted_deg)
    first, second = (simulate_in_space(rig, WheelProgram(one.wheels_mm, time_s)) for one in (found, plain))
    return first, second


def off_deg(record: Record, wanted_deg: Floats) -> Floats:
    """Distance of both angles from the wanted ones, deg, shape (s,)."""
    assert record.angle_2_deg is not None
    return np.asarray(np.hypot(record.angle_deg - wanted_deg[:, 0], record.angle_2_deg - wanted_deg[:, 1]))


def _wheels(record: Record) -> Floats:
    wheels = (record.drive, record.drive_2, record.drive_3, record.drive_4)
    return np.column_stack([wheel for wheel in wheels if wheel is not None])
