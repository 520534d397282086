"""Writes the table of ``docs/validation/twins.md``: ``python -m docs.make.chain_multibody``."""

from __future__ import annotations

from collections.abc import Sequence

from docs.make.pages import DOCS, put_between_marks, table
from validation.engines.checks.chain_multibody import ChainAgreement, comparisons

PAGE = DOCS / "validation" / "twins.md"
_HEAD = [
    "switched on", "preload, N", "largest difference, deg", "loop width, deg: multibody", "chain", "difference, %",
]  # fmt: skip


def agreement_table(rows: Sequence[ChainAgreement]) -> str:
    """Format the comparisons as Markdown."""
    return table(_HEAD, [_row(row) for row in rows])


def _row(a: ChainAgreement) -> list[str]:
    percent = a.width_difference_percent
    widths = [f"{a.width_multibody_deg:.3f}", f"{a.width_chain_deg:.3f}"]
    return [
        a.name,
        f"{a.preload_N:g}",
        f"{a.max_difference_deg:.3f}",
        *widths,
        "" if percent is None else f"{round(percent, 2) + 0.0:.2f}",  # without -0.00
    ]


if __name__ == "__main__":
    put_between_marks(PAGE, "docs.make.chain_multibody", agreement_table(comparisons()))
