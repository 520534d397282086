"""``notchbend workspace``: what the tip of a rig in space reaches, and what force moves it."""

from __future__ import annotations

import io
from dataclasses import dataclass
from typing import Annotated

import numpy as np
import typer

from fem_models.rig import Rig, RigError
from fem_models.spatial.motion.workspace import TipCompliance, Workspace, tip_compliance, workspace
from hysteresis.arrays import Floats
from hysteresis.files import write_files
from hysteresis.own import marked_png
from hysteresis.plain import optional
from studies.commands.options import Common, Out, Overwrite, RigChoice
from studies.commands.tables import values_table
from studies.progress import counted
from studies.results import write_result
from studies.results.made import Made, made_now

Matrix = tuple[tuple[float, float, float], ...]
FILES = ("workspace.json", "workspace.csv", "workspace.png")


@dataclass(frozen=True)
class ComplianceAt:
    """Tip compliance, mm/N, rows and columns x, y, z: guides that stick, and a wrist without friction and loop."""

    drive_1_mm: float
    drive_2_mm: float
    held_mm_per_N: Matrix
    sliding_mm_per_N: Matrix


@dataclass(frozen=True)
class WorkspaceSummary:
    """What a tip reaches.

    Areas are those within the outermost circle of the drives, seen along the straight tube. ``spread`` is the distance
    of the tips that the same drives reach when the wheels go round forth and back: what friction leaves open.
    """

    schema: int
    rig: str
    preload_N: float
    amplitude_mm: float
    largest_bending_deg: float
    reach_y_mm: float
    reach_z_mm: float
    least_x_mm: float
    area_mm2: float
    area_without_friction_mm2: float
    largest_spread_mm: float
    mean_spread_mm: float
    least_tension_N: float
    largest_tension_N: float
    compliance: tuple[ComplianceAt, ...]
    made: Made | None = optional()


def workspace_of_rig(
    *,
    out: Out,
    rig: RigChoice,
    amplitude: Annotated[float, typer.Option("--amplitude", help="Largest drive of both wheels, mm.")],
    circles: Annotated[int, typer.Option("--circles", help="Circles of the drives, up to the amplitude.")] = 4,
    directions: Annotated[int, typer.Option("--directions", help="Directions on each circle.")] = 36,
    replacing: Overwrite,
    common: Common,
) -> None:
    """Find what the tip of a rig in space reaches, with friction and without, and what force moves it."""
    chosen = rig.read_any()
    if isinstance(chosen, Rig):
        raise RigError(f"rig {chosen.name} bends in one plane: expected a rig in space, whose notches are turned")
    targets = [out / name for name in FILES]
    replacing.allow(targets)
    made = made_now(common.command)
    with counted(common.shows_progress, f"workspace of {chosen.name}") as count:
        found = workspace(chosen, amplitude, circles=circles, directions=directions, progress=count)
    places = amplitude * np.array([[0.0, 0.0], [1.0, 0.0], [0.0, 1.0]])
    gives = [tip_compliance(chosen, place) for place in places]
    summary = WorkspaceSummary(
        schema=1,
        rig=chosen.name,
        preload_N=chosen.preload_N,
        amplitude_mm=amplitude,
        largest_bending_deg=float(np.linalg.norm(found.forth_deg, axis=2).max()),
        reach_y_mm=float(np.abs(found.forth_mm[..., 1]).max()),
        reach_z_mm=float(np.abs(found.forth_mm[..., 2]).max()),
        least_x_mm=float(found.forth_mm[..., 0].min()),
        area_mm2=found.area_mm2(found.forth_mm),
        area_without_friction_mm2=found.area_mm2(found.smooth_mm),
        largest_spread_mm=float(found.spread_mm.max()),
        mean_spread_mm=float(found.spread_mm.mean()),
        least_tension_N=found.least_tension_N,
        largest_tension_N=found.largest_tension_N,
        compliance=tuple(_compliance(one) for one in gives),
        made=made,
    )
    write_files({targets[1]: _table(found), targets[2]: marked_png(_figure(found))})
    write_result(targets[0], summary)
    numbers = {name: value for name, value in vars(summary).items() if isinstance(value, str | int | float)}
    common.show(
        summary, values_table(numbers), *map(_line, summary.compliance), f"wrote {', '.join(map(str, targets))}"
    )


def _compliance(one: TipCompliance) -> ComplianceAt:
    first, second = one.wheels_mm.tolist()
    return ComplianceAt(first, second, _rows(one.held), _rows(one.sliding))


def _rows(matrix: Floats) -> Matrix:
    return tuple((float(x), float(y), float(z)) for x, y, z in matrix)


def _line(one: ComplianceAt) -> str:
    held, sliding = (np.linalg.norm(np.array(rows), ord=2) for rows in (one.held_mm_per_N, one.sliding_mm_per_N))
    return (
        f"at drives ({one.drive_1_mm:g}, {one.drive_2_mm:g}) mm the tip gives at most {held:.3g} mm/N "
        f"where guides stick, {sliding:.3g} mm/N without friction"
    )


def _table(found: Workspace) -> str:
    """Rows of all circles and directions as CSV: drives, and tips without friction, forth and back."""
    names = ["drive_1_mm", "drive_2_mm"]
    names += [f"{way}_{axis}_mm" for way in ("smooth", "forth", "back") for axis in "xyz"]
    values = np.concatenate([found.wheels_mm, found.smooth_mm, found.forth_mm, found.back_mm], axis=2)
    rows = values.reshape(-1, len(names)).tolist()
    return "\n".join([",".join(names), *(",".join(map(repr, row)) for row in rows)]) + "\n"


def _figure(found: Workspace) -> bytes:
    from matplotlib.figure import Figure  # half a second, and only this needs it

    figure = Figure(figsize=(8.4, 4.2), layout="constrained")
    across, along = figure.subplots(1, 2)
    for k in range(len(found.wheels_mm)):
        label = k == 0
        for tips, colour, name in (
            (found.smooth_mm, "0.6", "no friction, no loop"),
            (found.forth_mm, "tab:blue", "with friction, forth"),
            (found.back_mm, "tab:orange", "with friction, back"),
        ):
            closed = np.concatenate([tips[k], tips[k][:1]])
            across.plot(closed[:, 1], closed[:, 2], color=colour, lw=1.2, label=name if label else None)
            along.plot(closed[:, 0], closed[:, 1], color=colour, lw=1.2)
    across.set(xlabel="tip y, mm", ylabel="tip z, mm", aspect="equal", title="seen along the tube")
    along.set(xlabel="tip x, mm", ylabel="tip y, mm", aspect="equal", title="from the side")
    figure.legend(loc="outside lower center", ncols=3, frameon=False)
    buffer = io.BytesIO()
    figure.savefig(buffer, dpi=110)
    return buffer.getvalue()
