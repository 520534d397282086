"""Command ``record new``."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Any, Literal

import typer

from fem_models.rig import Rig, RigError
from studies.commands.options import Common, RigChoice
from studies.own_rig.new_record import RecordRig, lines, new_record


@dataclass(frozen=True)
class ColumnChoice:
    """Columns of a CSV that are not found by their names."""

    drive_column: Annotated[
        str | None,
        typer.Option(
            "--drive-column", help="Column of the drive, or of the tendon's force; by default found by its name."
        ),
    ] = None
    angle_column: Annotated[
        str | None, typer.Option("--angle-column", help="Column of the angle, deg; by default found by its name.")
    ] = None
    time_column: Annotated[
        str | None, typer.Option("--time-column", help="Column of the time, s; by default found by its name.")
    ] = None
    cycle_column: Annotated[
        str | None, typer.Option("--cycle-column", help="Column of the cycle; by default found by its name.")
    ] = None


@dataclass(frozen=True)
class RecordRigChoice(RigChoice):
    """The rig that a record was measured on, if it is known."""

    rig: Annotated[
        Path | None,
        typer.Option("--rig", help="The rig file, TOML, in place of --preset; by default the geometry is unknown."),
    ] = None
    preload: Annotated[
        float | None, typer.Option("--preload", help="Preload of the tendons on the bench, N; by default the rig's.")
    ] = None


def record_new(
    *,
    csv: Annotated[Path, typer.Argument(help="The CSV of the bench; it is never changed.")],
    rig: RecordRigChoice,
    columns: ColumnChoice,
    drive_unit: Annotated[
        Literal["mm", "deg", "step", "N"] | None,
        typer.Option("--drive-unit", help="Unit of the drive; by default what the name of its column says, else mm."),
    ] = None,
    title: Annotated[
        str | None, typer.Option("--title", help="One line for reports; by default the file's stem.")
    ] = None,
    out: Annotated[
        Path | None,
        typer.Option("--out", help="Write a copy with commas, of a CSV with semicolons or comments; by default none."),
    ] = None,
    common: Common,
) -> None:
    """Write the sidecar of a CSV from the bench, and say what is understood of it. Nothing is overwritten."""
    found = new_record(
        csv,
        _rig_of(rig),
        columns={key: getattr(columns, f"{key}_column") for key in ("drive", "angle", "time", "cycle")},
        drive_unit=drive_unit,
        title=title,
        out=out,
    )
    common.show(found, *lines(found))


def _rig_of(choice: RigChoice) -> RecordRig:
    """Read the rig of a record; without one the sidecar has the preload, if it is known.

    Raises
    ------
    RigError
        Both a preset and a file, a rig that cannot be read, or an impossible preload.
    """
    if choice.preset is None and choice.rig is None:
        if choice.preload is not None and not choice.preload > 0:
            raise RigError(f"--preload {choice.preload:g}: expected above 0")
        return RecordRig({} if choice.preload is None else {"preload_N": choice.preload}, None)
    any_rig = choice.read_any()
    rig = any_rig if isinstance(any_rig, Rig) else None  # the analytic model of one plane says what the angle would be
    preload_N = any_rig.preload_N if isinstance(any_rig, Rig) else any_rig.rig.preload_N
    source: dict[str, Any] = {"preset": choice.preset} if choice.rig is None else {"file": str(choice.rig.absolute())}
    return RecordRig(source | ({"preload_N": preload_N} if preload_N > 0 else {}), rig)
