"""Writes how often the ranges of the ensemble hold a hidden rig: ``python -m docs.make.calibration.recovery``.

The rigs are those of ``recovery.jsonl`` beside the page, which ``python -m benchmarks.recovered_rigs`` makes.
"""

from __future__ import annotations

from benchmarks.recovered_rigs import MODEL, Hidden, table
from docs.make.pages import DOCS, put_between_marks
from validation.measured.ensemble.recovery import DRAWS
from validation.practice.kept_lines import read_lines

PAGE = DOCS / "validation" / "calibration.md"
LINES = DOCS / "validation" / "recovery.jsonl"


def main() -> None:
    """Put the count on the page."""
    lines = read_lines(LINES, Hidden)
    seeds = ", ".join(str(seed) for seed in sorted({one.seed for one in lines}))
    words = f'Model "{MODEL}", {len(lines)} hidden rigs of seed {seeds}, {DRAWS} draws each, 95 % ranges.'
    put_between_marks(PAGE, "docs.make.calibration.recovery", "\n".join([words, "", *table(lines)]))


if __name__ == "__main__":
    main()
