"""Writes the rates of each effect into ``docs/validation/practice.md``: ``python -m docs.make.effect_rates``.

The counts are those of ``docs/archive/practice-2026.md``, where ``docs.make.practice`` keeps the scores of the sets.
"""

from __future__ import annotations

import re
from collections.abc import Mapping

from docs.make.pages import DOCS, put_between_marks, table

PAGE = DOCS / "validation" / "practice.md"
ARCHIVE = DOCS / "archive" / "practice-2026.md"
COMMAND = "docs.make.effect_rates"
SECTIONS: Mapping[str, str] = {
    "Known rig": "package rig, declared",
    "Unknown geometry": "package rig, unknown",
    "Known rig, records from another generator": "foreign rig, declared",
}
"""Sections of the archive with counts by effect, and the name of their column."""


def section(heading: str) -> str:
    """Text of a section of the archive."""
    return ARCHIVE.read_text(encoding="utf-8").partition(f"\n## {heading}\n")[2].partition("\n## ")[0]


def counts(text: str) -> dict[str, tuple[str, str]]:
    """By effect: how often it was named first, and how often it was in the set, as ``hits/cases``."""
    rows = re.findall(r"^\| `(\w+)` \| (\d+/\d+) \| [^|]* \| (\d+/\d+) \|", text, re.M)
    return {name: (first, in_set) for name, first, in_set in rows}


def seed_set(text: str) -> str:
    """Name of the set that was scored."""
    found = re.search(r"--set (score-\d+)", text)
    if found is None:
        raise ValueError(f"{ARCHIVE}: expected the command with its --set in each section")
    return found[1]


def text() -> str:
    """Markdown of the table: a row for each effect, two columns for each section."""
    found = {column: (seed_set(section(heading)), counts(section(heading))) for heading, column in SECTIONS.items()}
    head = ["effect"]
    for column, (name, _) in found.items():
        head += [f"{column} (*{name}*): first", "in the set"]
    effects = dict.fromkeys(name for _, counted in found.values() for name in counted)
    rows = [[f"`{name}`", *_cells(name, [counted for _, counted in found.values()])] for name in effects]
    return table(head, rows)


def _cells(name: str, columns: list[dict[str, tuple[str, str]]]) -> list[str]:
    return [cell for counted in columns for cell in counted.get(name, ("-", "-"))]


if __name__ == "__main__":
    put_between_marks(PAGE, COMMAND, f"\n{text()}\n")
