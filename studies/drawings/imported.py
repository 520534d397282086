"""A rig from a base rig and a drawing, or a table, of its notches."""

from __future__ import annotations

import csv
import io
from collections.abc import Mapping
from dataclasses import dataclass
from itertools import pairwise
from pathlib import Path
from typing import Any

from fem_models.drawings.beam import Beam
from fem_models.rig import Rig, RigError
from fem_models.rig.joints import NOTCH_SHAPES, Tube
from fem_models.rig.rig import notched_tube
from fem_models.rig.rig_file import any_rig_of_tables, notch_of_rows
from hysteresis.files import RecordError, read_text
from hysteresis.messages import as_given, listed, quoted
from hysteresis.own import MAKER
from hysteresis.records.sidecar import toml
from studies.drawings.written import DrawingChoice

_NUMBERS = ("depth_mm", "width_mm", "spacing_mm", "root_width_mm", "turn_deg", "middle_mm", "count")


@dataclass(frozen=True)
class Reading:
    """How a drawing is read: what is given stands above what its header says."""

    unit: str | None = None
    layer: str | None = None
    kerf_mm: float | None = None
    beam: str | None = None


def rig_of_drawing(path: Path, base: Rig, how: Reading) -> Rig:
    """Give a rig the notches of a flat pattern, DXF; the tube is that of the drawing's header, if it says one.

    Raises
    ------
    RigError
        One line: a file that is no such drawing, a base without a tube, notches that the tube cannot have.
    MissingError
        Without the extra ``drawing``.
    """
    from fem_models.drawings.notches import notch_table
    from fem_models.drawings.read_dxf import read_sheet

    sheet = read_sheet(path, unit=how.unit, layer=how.layer)
    tube = _tube(base, path)
    if {"OUTER_DIAMETER_MM", "INNER_DIAMETER_MM"} <= set(sheet.said):
        try:
            tube = Tube(sheet.said["OUTER_DIAMETER_MM"], sheet.said["INNER_DIAMETER_MM"])
        except RigError as error:
            raise RigError(f"{path}: {error}") from None
    beam: Beam = DrawingChoice(beam=how.beam or sheet.beam or None).read_beam()
    kerf = how.kerf_mm if how.kerf_mm is not None else sheet.said.get("KERF_MM", 0.0)
    if not 0 <= kerf < tube.outer_diameter_mm:
        raise RigError(f"kerf_mm = {kerf:g}: expected at least 0, below the outer diameter")
    return with_notches(base, tube, notch_table(sheet, tube, str(path), kerf_mm=kerf, beam=beam), path)


def rig_of_table(path: Path, base: Rig) -> Rig:
    """Give a rig the notches of a CSV table, one row a notch from the base.

    Columns ``depth_mm``, ``width_mm`` and either ``spacing_mm`` or ``middle_mm``, the place along the tube; of a V
    ``root_width_mm``; of turned notches ``turn_deg``; ``count`` of equal ones; ``shape``, by default that of the base.

    Raises
    ------
    RigError
        One line with file, row, column and what was expected.
    """
    rows = read_rows(path)
    tube, base_notch = _tube(base, path), notched_tube(base).notch
    shape = rows[0].get("shape", base_notch.shape)
    if shape not in NOTCH_SHAPES:
        raise RigError(f"{path}: shape = {quoted(shape)}: expected one of {listed(NOTCH_SHAPES)}")
    numbers = [_numbers_of(row, f"{path}: row {k}") for k, row in enumerate(rows, start=1)]
    if "middle_mm" in numbers[0]:
        numbers = _with_spacing(numbers, path)
    table = dict(notch_of_rows(numbers, str(path)))
    return with_notches(base, tube, {"shape": shape, **table}, path)


def read_rows(path: Path) -> list[dict[str, str]]:
    """Read the rows of a CSV, at least one, by the names of its columns.

    Raises
    ------
    RigError
        One line: a file that cannot be read, or has no row.
    """
    try:
        text = read_text(path, "a CSV table")
    except RecordError as error:
        raise RigError(str(error)) from None
    lines = [line for line in text.splitlines() if line.strip() and not line.lstrip().startswith("#")]
    rows = list(csv.DictReader(io.StringIO("\n".join(lines)), skipinitialspace=True))
    if not rows:
        raise RigError(f"{path}: expected a header and at least one row")
    return [{(key or "").strip(): value for key, value in row.items() if isinstance(value, str)} for row in rows]


def _numbers_of(row: Mapping[str, str], at: str) -> dict[str, float]:
    out: dict[str, float] = {}
    for key, text in row.items():
        if key == "shape":
            continue
        if key not in _NUMBERS:
            raise RigError(f"{at}: column {as_given(key)}: expected one of {listed([*_NUMBERS, 'shape'])}")
        try:
            out[key] = int(text) if key == "count" else float(text)
        except ValueError:
            raise RigError(f"{at}: {key} = {quoted(text)}: expected a number") from None
    return out


def _with_spacing(rows: list[dict[str, float]], path: Path) -> list[dict[str, float]]:
    """Give the rings between notches from their places along the tube; the last ring is as the one before it."""
    if "spacing_mm" in rows[0] or "count" in rows[0]:
        raise RigError(f"{path}: middle_mm: expected without spacing_mm and count, one row a notch")
    if "width_mm" not in rows[0] or len(rows) < 2:
        raise RigError(f"{path}: middle_mm: expected with width_mm, of two notches at least")
    gaps = [
        after["middle_mm"] - row["middle_mm"] - 0.5 * (row["width_mm"] + after["width_mm"])
        for row, after in pairwise(rows)
    ]
    return [
        {**{key: value for key, value in row.items() if key != "middle_mm"}, "spacing_mm": round(gap, 6)}
        for row, gap in zip(rows, [*gaps, gaps[-1]], strict=True)
    ]


def with_notches(base: Rig, tube: Tube, notch: Mapping[str, Any], path: Path) -> Rig:
    """Give a rig another tube and other notches; ``notch`` is the table of a rig file, ``path`` for messages.

    Raises
    ------
    RigError
        One line: what the rig cannot have.
    """
    tables: dict[str, Any] = base.to_dict()
    roots = {"rigid_roots": True} if tables.get("notch", {}).get("rigid_roots") else {}
    tables |= {"tube": vars(tube).copy(), "notch": {**notch, **roots}}
    return any_rig_of_tables(tables, str(path), base.name, in_space=not base.is_planar)


def _tube(base: Rig, path: Path) -> Tube:
    try:
        return notched_tube(base).tube
    except RigError as error:
        raise RigError(f"{path}: {error}") from None


def rig_file(rig: Rig, source: str) -> str:
    """Write a rig file, TOML, that says what it was imported from."""
    return f"# made by {MAKER}\n# from {source}\n{toml(rig.to_dict())}"
