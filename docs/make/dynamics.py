"""Writes ``docs/validation/dynamics.md``: ``python -m docs.make.dynamics``."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from docs.make.pages import DOCS, table, template
from hysteresis.files import write_files
from validation.engines.checks.dynamics import AMPLITUDE_MM, DRAG, DynamicComparison, comparisons

PAGE = DOCS / "validation" / "dynamics.md"
_HEAD = [
    "preload, N", "rate, Hz", "drag", "loop width, deg: static", "dynamic", "delay, ms: best shift", "fundamental",
    "largest difference, deg", "step, ms", "width at half the step, %", "energy gap, %",
]  # fmt: skip


def page(rows: Sequence[DynamicComparison]) -> str:
    """Markdown of the page."""
    peak_N = DRAG.sheath_N_s_per_mm * 2 * np.pi * AMPLITUDE_MM  # at 1 Hz; the tendon is as fast as the wheel
    return template("dynamics").format(
        table=table(_HEAD, [_row(row) for row in rows]), sheath=DRAG.sheath_N_s_per_mm, peak=peak_N
    )


def _row(r: DynamicComparison) -> list[str]:
    return [
        f"{r.preload_N:g}",
        f"{r.rate_Hz:g}",
        "yes" if r.drag else "no",
        f"{r.width_static_deg:.3f}",
        f"{r.width_dynamic_deg:.3f}",
        f"{1e3 * r.delay.shift_s:.3f}",
        f"{1e3 * r.delay.fundamental_s:.3f}",
        f"{r.largest_difference_deg:.3f}",
        f"{1e3 * r.step_s:.2f}",
        f"{r.halved_step_percent:.3f}",
        f"{abs(r.energy_gap_percent):.2f}",
    ]


if __name__ == "__main__":
    write_files({PAGE: page(comparisons())})
