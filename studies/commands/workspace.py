"""``notchbend workspace``: what the tip of a rig in space reaches, and what force moves it."""

from __future__ import annotations

import io
from pathlib import Path
from typing import Annotated

import numpy as np
import typer

from fem_models.rig import Rig, RigError
from fem_models.spatial.motion.workspace import TipCompliance, Workspace, tip_compliance, workspace
from hysteresis.arrays import Floats
from hysteresis.attempts import attempt
from hysteresis.files import write_files
from hysteresis.own import marked_png
from studies.commands.options import Common, Out, Overwrite, RigChoice
from studies.commands.tables import values_table
from studies.own_rig.wheels import motions_of
from studies.progress import counted
from studies.results import write_result
from studies.results.made import Made, made_now
from studies.results.workspace import FILES, WAYS, ComplianceAt, Matrix, WorkspaceSummary


def workspace_of_rig(
    *,
    out: Out,
    rig: RigChoice,
    amplitude: Annotated[float, typer.Option("--amplitude", help="Largest drive of the wheels, mm.")],
    circles: Annotated[int, typer.Option("--circles", help="Circles of the drives, up to the amplitude.")] = 4,
    directions: Annotated[
        int, typer.Option("--directions", help="Directions on each circle; of one wheel the places on its way.")
    ] = 36,
    replacing: Overwrite,
    common: Common,
) -> None:
    """Find what the tip of a rig in space reaches, with friction and without, and what force moves it."""
    chosen = rig.read_any()
    if chosen.is_planar:
        raise RigError(f"rig {chosen.name} bends in one plane: expected a rig in space, whose notches are turned")
    targets = [out / name for name in FILES]
    replacing.allow(targets)
    made = made_now(common.command)
    with counted(common.shows_progress, f"workspace of {chosen.name}") as count:
        found = workspace(chosen, amplitude, circles=circles, directions=directions, progress=count)
    failed = list[str]()
    summary = write_workspace(chosen, amplitude, found, compliance_of(chosen, amplitude), out, made, failed)
    numbers = {name: value for name, value in vars(summary).items() if isinstance(value, str | int | float)}
    wrote = f"wrote {', '.join(str(path) for path in targets if path.exists())}"
    common.show(summary, values_table(numbers), *map(_line, summary.compliance), wrote, *failed)


def compliance_of(rig: Rig, amplitude_mm: float) -> tuple[ComplianceAt, ...]:
    """Give the tip compliance of the straight wrist, and bent by each motion of its wheels at an amplitude.

    Raises
    ------
    SolverError
        A drive without equilibrium.
    """
    places = [np.zeros(rig.wheel_count), *(amplitude_mm * motion.unit for motion in motions_of(rig))]
    return tuple(_compliance(tip_compliance(rig, place)) for place in places)


def write_workspace(
    rig: Rig,
    amplitude_mm: float,
    found: Workspace,
    compliance: tuple[ComplianceAt, ...],
    out: Path,
    made: Made | None,
    failed: list[str],
) -> WorkspaceSummary:
    """Write a workspace as numbers, table and picture: the files of :data:`studies.results.workspace.FILES`.

    ``failed`` takes a line where the picture cannot be drawn.

    Raises
    ------
    RecordError
        A folder that cannot be written to.
    """
    curve = found.is_curve
    summary = WorkspaceSummary(
        schema=1,
        rig=rig.name,
        preload_N=rig.preload_N,
        amplitude_mm=amplitude_mm,
        file=FILES[1],
        circles=found.wheels_mm.shape[0],
        directions=found.wheels_mm.shape[1],
        largest_bending_deg=float(np.linalg.norm(found.forth_deg, axis=2).max()),
        reach_y_mm=float(np.abs(found.forth_mm[..., 1]).max()),
        reach_z_mm=float(np.abs(found.forth_mm[..., 2]).max()),
        least_x_mm=float(found.forth_mm[..., 0].min()),
        area_mm2=None if curve else found.area_mm2(found.forth_mm),
        area_without_friction_mm2=None if curve else found.area_mm2(found.smooth_mm),
        length_mm=found.length_mm(found.forth_mm) if curve else None,
        largest_spread_mm=float(found.spread_mm.max()),
        mean_spread_mm=float(found.spread_mm.mean()),
        least_tension_N=found.least_tension_N,
        largest_tension_N=found.largest_tension_N,
        compliance=compliance,
        made=made,
    )
    write_files({out / FILES[1]: _table(found)})
    write_result(out / FILES[0], summary)
    (out / FILES[2]).unlink(missing_ok=True)  # of an earlier workspace
    png = attempt(f"no {FILES[2]}", lambda: marked_png(_figure(found)), None, failed)
    if png is not None:
        write_files({out / FILES[2]: png})
    return summary


def _compliance(one: TipCompliance) -> ComplianceAt:
    drives = {f"drive_{k + 1}_mm": drive for k, drive in enumerate(one.wheels_mm.tolist())}
    return ComplianceAt(**drives, held_mm_per_N=_rows(one.held), sliding_mm_per_N=_rows(one.sliding))


def _rows(matrix: Floats) -> Matrix:
    first, second, third = ((float(x), float(y), float(z)) for x, y, z in matrix)
    return first, second, third


def _line(one: ComplianceAt) -> str:
    held, sliding = (np.linalg.norm(np.array(rows), ord=2) for rows in (one.held_mm_per_N, one.sliding_mm_per_N))
    return (
        f"at drives ({', '.join(f'{drive:g}' for drive in one.drives_mm)}) mm the tip gives at most {held:.3g} mm/N "
        f"where guides stick, {sliding:.3g} mm/N without friction"
    )


def _table(found: Workspace) -> str:
    """Rows of all circles and directions as CSV: drives, and tips without friction, forth and back."""
    names = [f"drive_{k + 1}_mm" for k in range(found.wheels_mm.shape[2])]
    names += [f"{way}_{axis}_mm" for way in WAYS for axis in "xyz"]
    values = np.concatenate([found.wheels_mm, found.smooth_mm, found.forth_mm, found.back_mm], axis=2)
    rows = values.reshape(-1, len(names)).tolist()
    return "\n".join([",".join(names), *(",".join(map(repr, row)) for row in rows)]) + "\n"


def _figure(found: Workspace) -> bytes:
    from matplotlib.figure import Figure  # half a second, and only this needs it

    figure = Figure(figsize=(8.4, 4.2), layout="constrained")
    across, along = figure.subplots(1, 2)
    for k in range(len(found.wheels_mm)):
        label = k == 0
        for (way, name), colour in zip(WAYS.items(), ("0.6", "tab:blue", "tab:orange"), strict=True):
            tips = getattr(found, f"{way}_mm")[k]
            drawn = tips if found.is_curve else np.concatenate([tips, tips[:1]])
            across.plot(drawn[:, 1], drawn[:, 2], color=colour, lw=1.2, label=name if label else None)
            along.plot(drawn[:, 0], drawn[:, 1], color=colour, lw=1.2)
    across.set(xlabel="tip y, mm", ylabel="tip z, mm", title="seen along the tube")
    along.set(xlabel="tip x, mm", ylabel="tip y, mm", title="from the side")
    for axes in (across, along):
        axes.set_aspect("equal", adjustable="datalim")  # a curve in one plane has no height
    figure.legend(loc="outside lower center", ncols=3, frameon=False)
    buffer = io.BytesIO()
    figure.savefig(buffer, dpi=110)
    return buffer.getvalue()
