"""The first page of a design report: requirement, value, margin, P(met) and verdict; drawing; what to tighten."""

from __future__ import annotations

import base64
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

from hysteresis.files import MB, inside, read_bytes
from studies.results.page_one import FILE, KeyNumber, PageOne, read_page_one

MOST_DRAWING_BYTES = 16 * MB


@dataclass(frozen=True)
class PageOneSection:
    """The rows of a first page, a sentence that sums them up, and the drawing as base64 text.

    ``judged`` is whether there is a requirement, ``drawn_odds`` whether there are probabilities.
    """

    result: PageOne
    verdict: str
    good: bool
    judged: bool
    has_odds: bool
    drawing: str | None


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
    return page_one_section(found, drawing)


def page_one_section(page: PageOne, drawing: str | None) -> PageOneSection:
    """Make the section of rows, such as those of a requirement, and a drawing, SVG as base64 text."""
    judged = [row for row in page.rows if row.met is not None]
    missed = [row for row in judged if row.met != "met"]
    return PageOneSection(
        result=page,
        verdict=_verdict(judged, missed),
        good=not missed,
        judged=bool(judged),
        has_odds=any(row.p_met is not None for row in page.rows),
        drawing=drawing,
    )


def _verdict(judged: Sequence[KeyNumber], missed: Sequence[KeyNumber]) -> str:
    if not judged:
        return ""
    if not missed:
        return f"All {len(judged)} requirements are met."
    names = ", ".join(f"{row.name} ({row.met})" for row in missed)
    return f"{len(judged) - len(missed)} of {len(judged)} requirements are met. Look at: {names}."
