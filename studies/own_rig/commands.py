"""Command ``record new``."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Any, Literal

import typer

from fem_models.rig import RigError
from studies.commands.options import Common, RigChoice
from studies.own_rig.columns import Reading
from studies.own_rig.new_record import RecordRig, lines, new_record

DriveUnits = Literal["mm", "um", "cm", "m", "in", "deg", "rad", "turn", "step", "N", "mN", "kN"]
AngleUnits = Literal["deg", "rad", "mrad", "turn"]
TimeUnits = Literal["s", "ms", "us", "ns", "min", "h"]


@dataclass(frozen=True)
class ColumnChoice:
    """Columns and units of a table that are not found by their names, and how it is to be read."""

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

    drive_unit: Annotated[
        DriveUnits | None,
        typer.Option("--drive-unit", help="Unit of the drive; by default what the name of its column says, else mm."),
    ] = None
    angle_unit: Annotated[
        AngleUnits | None,
        typer.Option("--angle-unit", help="Unit of the angle; by default what the name of its column says, else deg."),
    ] = None
    time_unit: Annotated[
        TimeUnits | None,
        typer.Option("--time-unit", help="Unit of the time; by default what the name of its column says, else s."),
    ] = None
    no_time: Annotated[bool, typer.Option("--no-time", help="Leave the times out: a quasi-static record.")] = False
    encoding: Annotated[
        str | None, typer.Option("--encoding", help="Encoding of a text, such as cp1252; by default by its bytes.")
    ] = None
    sheet: Annotated[
        str | None, typer.Option("--sheet", help="Sheet of a spreadsheet, its name or number; by default the only one.")
    ] = None

    def reading(self) -> Reading:
        """Give what is said of the table."""
        return Reading(
            columns={key: getattr(self, f"{key}_column") for key in ("drive", "angle", "time", "cycle")},
            drive_unit=self.drive_unit,
            angle_unit=self.angle_unit,
            time_unit=self.time_unit,
            no_time=self.no_time,
            encoding=self.encoding,
            sheet=self.sheet,
        )


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
    table: Annotated[
        Path,
        typer.Argument(help="The table of the bench: CSV, .xlsx, .parquet or .mat; it is never changed."),
    ],
    rig: RecordRigChoice,
    columns: ColumnChoice,
    title: Annotated[
        str | None, typer.Option("--title", help="One line for reports; by default the file's stem.")
    ] = None,
    out: Annotated[
        Path | None,
        typer.Option(
            "--out",
            help="The clean copy, CSV; by default <stem>-record.csv, and none where the CSV can be read as it is.",
        ),
    ] = None,
    common: Common,
) -> None:
    """Make a record of a table from the bench, and say what is understood of it. Nothing is overwritten.

    A CSV that can be read as it is gets a sidecar; of any other table a clean copy is written with its sidecar.
    """
    found = new_record(table, _rig_of(rig), columns.reading(), title=title, out=out)
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
    rig = any_rig if any_rig.is_planar else None  # the analytic model of one plane says what the angle would be
    preload_N = any_rig.preload_N
    source: dict[str, Any] = {"preset": choice.preset} if choice.rig is None else {"file": str(choice.rig.absolute())}
    return RecordRig(source | ({"preload_N": preload_N} if preload_N > 0 else {}), rig)
