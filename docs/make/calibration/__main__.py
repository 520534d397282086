"""Writes the table of ``docs/validation/calibration.md``: ``python -m docs.make.calibration``."""

from __future__ import annotations

from docs.make.pages import DOCS, put_between_marks, table
from validation.measured.preset_du2018 import Calibration, alternatives, calibrate

PAGE = DOCS / "validation" / "calibration.md"
_HEAD = [
    "fixed", "EA, N", "toe, N", "sheath, N", "full scale, deg", "width 10 / 20 N, deg", "widest at, mm", "facts met",
]  # fmt: skip


def row(name: str, c: Calibration) -> list[str]:
    """Format one calibration."""
    return [
        name,
        f"{c.EA_N:,.0f}",
        f"{c.toe_N:.1f}",
        f"{c.sheath_N:.2f}",
        f"{c.full_scale_deg:.2f}",
        f"{c.widths_deg[0]:.2f} / {c.widths_deg[1]:.2f}",
        f"{c.widest_at_mm[0]:.1f} / {c.widest_at_mm[1]:.1f}",
        "yes" if c.meets_the_facts else "no",
    ]


if __name__ == "__main__":
    rows = [row(name, calibrate(rig)) for name, rig in alternatives().items()]
    put_between_marks(PAGE, "docs.make.calibration", table(_HEAD, rows))
