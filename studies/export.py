"""Command ``export``: a rig for other simulators."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, Literal

import typer

from fem_models.export import guide_table, mujoco_model
from fem_models.export.loop import guide_loop
from fem_models.rig import Rig
from hysteresis.files import RecordError, write_files
from hysteresis.messages import quoted
from studies.commands.options import Common, Overwrite, RigChoice
from studies.progress import status

Simulator = Literal["mujoco"]
AMPLITUDE_MM = 2.2


def export_rig(
    *,
    to: Annotated[Simulator, typer.Option("--to", help="Simulator that the model is for.")],
    out: Annotated[Path, typer.Option("--out", help="The model file, .xml; the table of tensions is put beside it.")],
    rig: RigChoice,
    amplitude: Annotated[
        float, typer.Option("--amplitude", help="Largest drive that the model is meant for, mm.")
    ] = AMPLITUDE_MM,
    replacing: Overwrite,
    common: Common,
) -> None:
    """Write a rig as a model of another simulator, and a table of the tension at every guide."""
    chosen = rig.read()
    replacing.allow([out, out.with_name(f"{out.stem}-guides.csv")])
    with status(common.shows_progress, f"exporting {chosen.name}"):
        model, table = write_model(chosen, out, to=to, amplitude_mm=amplitude)
    common.show({"model": str(model), "table": str(table)}, f"model: {model}", f"tension at every guide: {table}")


def write_model(rig: Rig, out: Path, *, to: Simulator, amplitude_mm: float) -> tuple[Path, Path]:
    """Write a rig for another simulator.

    Returns
    -------
    The model file and the table of tensions, ``<stem>-guides.csv``.

    Raises
    ------
    ValueError
        An unknown simulator.
    RecordError
        A name that does not end in .xml, or a folder that cannot be written to.
    RigError, SolverError
        An amplitude that is not above 0, or that the rig cannot follow.
    """
    if not isinstance(to, str) or to != "mujoco":
        raise ValueError(f"to = {quoted(to)}: expected 'mujoco'")
    if out.suffix.lower() != ".xml":
        raise RecordError(f"{out}: expected a name that ends in .xml")
    loop = guide_loop(rig, amplitude_mm)
    table = out.with_name(f"{out.stem}-guides.csv")
    write_files({table: guide_table(loop), out: mujoco_model(rig, loop)})
    return out, table
