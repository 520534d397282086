"""Writes the tables of ``docs/guide/compensation.md``: ``python -m docs.make.compensation``."""

from __future__ import annotations

from collections.abc import Sequence

from docs.make.pages import DOCS, put_between_marks, table
from validation.layer.compensation import DisturbedTrial, Tracking, Trial, disturbed_trials, trials

PAGE = DOCS / "guide" / "compensation.md"


def trial_table(found: Sequence[Trial]) -> str:
    """Format the trials as Markdown, a row per layer and reference."""
    rows = [[one.loops_of, str(one.elements), one.reference, *_errors(one.tracking)] for one in found]
    return table(["loops of", "elements of h", "reference", "without, deg", "with, deg", "ratio"], rows)


def disturbed_table(found: Sequence[DisturbedTrial]) -> str:
    """Format the disturbed trials as Markdown, a row per disturbance and reference."""
    rows = [[one.disturbance, one.reference, *_errors(one.tracking)] for one in found]
    return table(["disturbance", "reference", "without, deg", "with, deg", "ratio"], rows)


def _errors(tracking: Tracking) -> list[str]:
    return [f"{tracking.without_deg:.3f}", f"{tracking.with_deg:.3f}", f"{tracking.ratio:.1f}"]


if __name__ == "__main__":
    tables = trial_table(trials()), disturbed_table(disturbed_trials())
    put_between_marks(PAGE, "docs.make.compensation", "\n\n".join(tables))
