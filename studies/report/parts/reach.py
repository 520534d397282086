"""``workspace.json`` for the page: what the tip of a rig in space reaches, and what force moves it."""

from __future__ import annotations

import shlex
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from hysteresis.files import inside, present
from hysteresis.records.record import RecordError
from hysteresis.records.record_file import read_columns
from studies.report.plots import Drawn, draw
from studies.report.summary import Verdict
from studies.report.templates import significant
from studies.report.wrist_plots import reach_plate
from studies.results import read_result
from studies.results.workspace import FILES, WAYS, WHAT, ComplianceAt, WorkspaceSummary

MOST_TIPS = 100 * 360
"""Most rows of a table: the limits of circles and directions."""
_CIRCLES = "Tips for drives on circles of all wheels, up to the amplitude; the wheels go round forth, and back."
_CURVE = "Tips for the drives of the only wheel, up and down."


@dataclass(frozen=True)
class ReachSection:
    """A workspace with its chart."""

    result: WorkspaceSummary
    plate: Drawn
    command: str


def read_reach(folder: Path) -> ReachSection | None:
    """Read ``workspace.json`` and its table; None if there is no such file.

    Raises
    ------
    RecordError
        One line with the file, the field and what was expected.
    """
    path = folder / FILES[0]
    if not present(path):
        return None
    found = read_result(WorkspaceSummary, path, WHAT)
    shape = found.circles, found.directions
    if min(shape) < 1 or shape[0] * shape[1] > MOST_TIPS:
        raise RecordError(f"{path}: circles, directions = {shape}: expected at least 1, at most {MOST_TIPS} tips")
    table = inside(path, "file", found.file, [".csv"])
    names = [f"{way}_{axis}_mm" for way in WAYS for axis in "xyz"]
    columns = read_columns(table, names)
    if columns[names[0]].size != shape[0] * shape[1]:
        raise RecordError(f"{table}: {columns[names[0]].size} rows: expected {shape[0]} circles of {shape[1]} tips")
    tips = {way: np.stack([columns[f"{way}_{axis}_mm"] for axis in "xyz"], axis=-1).reshape(*shape, 3) for way in WAYS}
    is_curve = found.area_mm2 is None
    if not is_curve:
        tips = {way: np.concatenate([places, places[:, :1]], axis=1) for way, places in tips.items()}
    plate = draw(reach_plate(tips, _CURVE if is_curve else _CIRCLES))
    options = f"--preset {shlex.quote(found.rig)} --amplitude {found.amplitude_mm:g}"
    command = f"notchbend workspace {options} --out DIR" if found.made is None else found.made.command
    return ReachSection(found, plate, command)


def reach_verdict(section: ReachSection) -> Verdict:
    """Give the size of what the tip reaches, and what friction leaves open."""
    r = section.result
    if r.area_mm2 is not None:
        size = f"{significant(r.area_mm2)} mm^2"
        without = (
            ""
            if r.area_without_friction_mm2 is None
            else f", {significant(r.area_without_friction_mm2)} without friction"
        )
        words = f"area that the tip reaches, seen along the tube{without}"
    else:
        size, words = f"{significant(r.length_mm)} mm", "length of the curve that the tip reaches with its only wheel"
    words += f", at {r.amplitude_mm:g} mm and {r.preload_N:g} N"
    words += f"; forth and back up to {significant(r.largest_spread_mm, 2)} mm apart"
    return Verdict("note", "Workspace", size, words, "workspace", section.command)


def compliance_verdict(compliance: Sequence[ComplianceAt], command: str) -> Verdict:
    """Give the largest motion of the straight tip by a force in any direction."""
    held, sliding = (
        float(np.linalg.norm(np.array(rows), ord=2))
        for rows in (compliance[0].held_mm_per_N, compliance[0].sliding_mm_per_N)
    )
    words = "of the straight wrist by a force in any direction: where guides stick, and without friction"
    value = f"{significant(held)} to {significant(sliding)} mm/N"
    return Verdict("note", "Tip compliance", value, words, "stiffness", command)
