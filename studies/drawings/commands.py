"""Command ``import``: a rig file from a drawing, a table of notches, or the moment-angle curve of a joint."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Any

import typer

from fem_models.rig import Rig, RigError
from hysteresis.files import RecordError, write_files
from hysteresis.messages import one_line
from studies.commands.options import Common, Overwrite, RigChoice
from studies.drawings.curves import rig_of_curve
from studies.drawings.imported import Reading, read_rows, rig_file, rig_of_drawing, rig_of_table
from studies.progress import status


@dataclass(frozen=True)
class ReadingChoice:
    """How a drawing is read."""

    unit: Annotated[
        str | None, typer.Option("--unit", help="Unit of a drawing: mm, inch, ...; by default that of its header.")
    ] = None
    layer: Annotated[
        str | None, typer.Option("--layer", help="Layer of a drawing; by default CUT, or the only one with outlines.")
    ] = None
    kerf: Annotated[
        float | None, typer.Option("--kerf", help="Width of the beam, mm; by default as in the header, or 0.")
    ] = None
    beam: Annotated[
        str | None, typer.Option("--beam", help="plane or radial; by default as in the header, or plane.")
    ] = None


def import_rig(
    *,
    source: Annotated[
        Path,
        typer.Argument(
            metavar="FILE", help="A flat pattern, DXF; a table of notches, CSV; a moment-angle curve, CSV or VTU."
        ),
    ],
    rig: RigChoice,
    reading: ReadingChoice,
    out: Annotated[Path, typer.Option("--out", help="The rig file, TOML.")],
    replacing: Overwrite,
    common: Common,
) -> None:
    """Make a rig file of a base rig and the notches of a drawing or table, or the measured curve of a joint."""
    if out.suffix.lower() != ".toml":
        raise RecordError(f"{out}: expected a name that ends in .toml")
    base = rig.read_any()
    replacing.allow([out])
    with status(common.shows_progress, f"reading {source}"):
        made, lines = _read(source, base, reading)
    words = one_line(source.name)
    write_files({out: rig_file(made, words)})
    result = {"rig": str(out), "from": str(source), **{k: v for k, v in made.to_dict().items() if k in _SHOWN}}
    common.show(result, *lines, f"rig: {out}")


_SHOWN = ("tube", "notch", "bench")


def _read(source: Path, base: Rig, reading: ReadingChoice) -> tuple[Rig, list[str]]:
    how = Reading(reading.unit, reading.layer, reading.kerf, reading.beam)
    kind = source.suffix.lower()
    if kind == ".dxf":
        made = rig_of_drawing(source, base, how)
        return made, _lines(made)
    for name, value in vars(reading).items():
        if value is not None:
            raise RigError(f"--{name} {value}: of a drawing: expected a DXF, not {source}")
    if kind == ".csv" and "depth_mm" in read_rows(source)[0]:
        made = rig_of_table(source, base)
        return made, _lines(made)
    if kind in (".csv", ".vtu"):
        joints, law = rig_of_curve(source, base)
        kept = f"law of {len(law.elements.stiffness)} elements, {100 * law.rms:.2g} % rms off the curve, "
        kept += f"{100 * law.most:.2g} % at most, of the largest moment"
        return joints, [kept, f"stiffness at rest: {law.elements.stiffness.sum():.4g} N mm/rad"]
    raise RigError(f"{source}: expected a drawing, .dxf, a table of notches, .csv, or a curve of a joint, .csv or .vtu")


def _lines(made: Rig) -> list[str]:
    """Give the table of the notches for a terminal."""
    tables: Mapping[str, Any] = made.to_dict()
    notch: Mapping[str, object] = tables["notch"]
    return [f"notch.{key}: {_text(value)}" for key, value in notch.items()]


def _text(value: object) -> str:
    if isinstance(value, list):
        return f"{min(value):g} to {max(value):g}, of each notch"
    return f"{value:g}" if isinstance(value, float) else f"{value}"
