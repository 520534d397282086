"""Writes the table of ``docs/guide/compensation.md``: ``python -m docs.make.compensation``."""

from __future__ import annotations

from collections.abc import Sequence

from docs.make.pages import DOCS, put_between_marks, table
from validation.layer.compensation import Trial, trials

PAGE = DOCS / "guide" / "compensation.md"


def trial_table(found: Sequence[Trial]) -> str:
    """Format the trials as Markdown, a row per layer and reference."""
    rows = []
    for trial in found:
        t = trial.tracking
        errors = [f"{t.without_deg:.3f}", f"{t.with_deg:.3f}", f"{t.ratio:.1f}"]
        rows.append([trial.loops_of, str(trial.elements), trial.reference, *errors])
    return table(["loops of", "elements of h", "reference", "without, deg", "with, deg", "ratio"], rows)


if __name__ == "__main__":
    put_between_marks(PAGE, "docs.make.compensation", trial_table(trials()))
