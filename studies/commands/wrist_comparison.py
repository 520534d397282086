"""``notchbend validate`` of a rig in space: section and solid of every notch, and the wrist bent in every model."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

from rich.table import Table

from fem_models.rig import Rig
from fem_models.spatial.stiffness import NotchStiffness
from hysteresis.plain import optional
from studies.commands.options import Common, Overwrite
from studies.commands.tables import below, spaced_table
from studies.own_rig.strain import drive_to_angle_mm
from studies.progress import steps
from studies.results import write_result
from studies.results.made import Made, made_now
from studies.results.validation import FILE_IN_SPACE
from validation.joints.six_stiffnesses import BentWrist, NotchInBoth, SixStiffnesses, compare_in_space

ANGLE_DEG = 20.0
"""Bending of one plane that the default amplitude aims at."""


@dataclass(frozen=True)
class WristComparison:
    """What ``six-stiffnesses.json`` holds; fields as of :class:`validation.joints.six_stiffnesses.SixStiffnesses`."""

    schema: int
    rig: str
    notches: tuple[NotchInBoth, ...]
    drives_mm: tuple[tuple[float, ...], ...]
    bent: tuple[tuple[BentWrist, ...], ...]
    notes: tuple[str, ...]
    made: Made | None = optional()


def validate_in_space(rig: Rig, amplitude_mm: float | None, out: Path, replacing: Overwrite, common: Common) -> None:
    """Compare the models of a rig in space, and write and print the result.

    Raises
    ------
    RigError, SolverError
        From the models.
    """
    target, made = out / FILE_IN_SPACE, made_now(common.command)
    replacing.allow([target])
    amplitude = amplitude_mm or drive_to_angle_mm(rig.in_plane, ANGLE_DEG)
    with steps(common.shows_progress, total=rig.joints + 2) as step:
        found = compare_in_space(rig, amplitude_mm=amplitude, progress=step)
    result = WristComparison(1, **vars(found), made=made)
    write_result(target, result)
    notes = [f"note: {words}" for words in found.notes]
    common.show(result, stiffness_table(found), bent_table(found), *notes, f"wrote {target}")


def stiffness_table(found: SixStiffnesses) -> Table:
    """Make one row for each notch: stiffnesses of the solid, and those of the section over them."""
    units = {name: "Nmm/rad" if name in ("weak", "strong", "torsion") else "N/mm" for name in NotchStiffness._fields}
    table = spaced_table("notch", "depth, mm", *(f"{name.replace('_', ' ')}, {unit}" for name, unit in units.items()))
    for one in found.notches:
        values = [below(one.solid[name], 100 * (one.ratio[name] - 1)) for name in units]
        table.add_row(str(one.number), f"{one.depth_mm:.4g}", *values)
    table.caption = "of the solid; below it the difference of the section from it"
    return table


def bent_table(found: SixStiffnesses) -> Table:
    """Make one row for each motion and model."""
    table = spaced_table("wheels, mm", "model", "towards y, deg", "towards z, deg", "torsion, deg", "tip, mm")
    for drives, models in zip(found.drives_mm, found.bent, strict=True):
        for model in models:
            tip = ", ".join(f"{round(place, 3) + 0.0:.3f}" for place in model.tip_mm)
            angles = [f"{round(angle, 4) + 0.0:.4f}" for angle in (*model.bending_deg, model.torsion_deg)]
            table.add_row(", ".join(f"{drive:.3g}" for drive in drives), model.name, *angles, tip)
    return table
