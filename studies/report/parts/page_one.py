"""The first page of a design report: requirement, value, margin, P(met) and verdict; drawing; what to tighten."""

from __future__ import annotations

import base64
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

from hysteresis.files import MB, inside, read_bytes
from hysteresis.records.record import Record
from hysteresis.records.record_file import read_record
from studies.report.charts import Chart, Line, Plate
from studies.report.plots import ANGLE, DRIVE, Drawn, draw
from studies.results.page_one import FILE, KeyNumber, PageOne, read_page_one

MOST_DRAWING_BYTES = 16 * MB


@dataclass(frozen=True)
class PageOneSection:
    """The rows of a first page, a sentence that sums them up, the drawing as base64 text, and the loop.

    ``required`` are the rows with a requirement, ``others`` those without. ``judged`` is whether there is one,
    ``has_odds`` whether there are probabilities.
    """

    result: PageOne
    required: tuple[KeyNumber, ...]
    others: tuple[KeyNumber, ...]
    verdict: str
    good: bool
    judged: bool
    has_odds: bool
    drawing: str | None
    loop: Drawn | None = None


def read_page_one_section(folder: Path) -> PageOneSection | None:
    """Read the first page of a folder; None where it has none.

    Raises
    ------
    RecordError
        One line with the file that is missing, leads out of the folder or cannot be read.
    """
    found = read_page_one(folder)
    if found is None:
        return None
    drawing = None
    if found.drawing is not None:
        path = inside(folder / FILE, "drawing", found.drawing, [".svg"])
        content = read_bytes(path, "the drawing of the first page", most=MOST_DRAWING_BYTES)
        drawing = base64.b64encode(content).decode()
    loop = None
    if found.loop is not None:
        loop = read_record(inside(folder / FILE, "loop", found.loop, [".csv"]))
    return page_one_section(found, drawing, loop)


def page_one_section(page: PageOne, drawing: str | None, loop: Record | None = None) -> PageOneSection:
    """Make the section of rows, such as those of a requirement, a drawing, SVG as base64 text, and a cycle."""
    judged = [row for row in page.rows if row.met is not None]
    missed = [row for row in judged if row.met != "met"]
    return PageOneSection(
        result=page,
        required=tuple(judged),
        others=tuple(row for row in page.rows if row.met is None),
        verdict=_verdict(judged, missed, odds=any(row.p_met is not None for row in judged)),
        good=not missed,
        judged=bool(judged),
        has_odds=any(row.p_met is not None for row in page.rows),
        drawing=drawing,
        loop=None if loop is None else draw(_cycle(loop)),
    )


def _verdict(judged: Sequence[KeyNumber], missed: Sequence[KeyNumber], *, odds: bool) -> str:
    if not judged:
        return ""
    if missed:
        names = ", ".join(f"{row.name} ({row.met})" for row in missed)
        return f"Do not cut yet: {len(judged) - len(missed)} of {len(judged)} requirements are met. Look at: {names}."
    few = [row.name for row in judged if row.p_low is not None and row.p_low < (row.p_asked or 0.0)]
    if few:
        return (
            f"By the model, cut a first tube, but draw more before: all {len(judged)} requirements are met, and so few "
            f"draws (draws in [search]) leave open how surely of: {', '.join(few)}."
        )
    if odds:
        return f"By the model, cut a first tube: all {len(judged)} requirements are met, each as surely as was asked."
    return f"All {len(judged)} requirements are met as drawn; how surely is not known without tolerances."


def _cycle(record: Record) -> Plate:
    """Chart a cycle: angle and tension over the drive."""
    charts = [
        Chart("Bending angle", DRIVE, ANGLE, (Line(record.drive, record.angle_deg, "chain"),), "A cycle of the angle."),
    ]
    if record.tension_a_N is not None:
        line = Line(record.drive, record.tension_a_N, "tendon a", "orange")
        charts.append(Chart("Tension at the wheel", DRIVE, "tension, N", (line,), "A cycle of the tension."))
    return Plate(tuple(charts), "A cycle to the required bend and back, after the first way there.")
