"""Table of the tension at every guide, by which other codes can test their tendon friction."""

from __future__ import annotations

import csv
import io
import math

import numpy as np

from fem_models.export.loop import STEPS_OF_AMPLITUDE, GuideLoop

COLUMNS = (
    "drive_mm",
    "branch",
    "angle_deg",
    "tendon",
    "guide",
    "wrap_deg",
    "tension_before_N",
    "tension_beyond_N",
    "friction_limit_N",
)
BRANCHES = ("first", "down", "up")
"""From rest to full drive, on to the other end, and up again."""


def guide_table(loop: GuideLoop) -> str:
    """Write tensions and friction of every guide as CSV, at five drives a way.

    Guide 0 is the base and guide i the ring beyond joint i. ``tension_before_N`` is on the side of the wheel,
    ``tension_beyond_N`` on that of the tip. Their difference is at most ``friction_limit_N`` in size, and as large as
    that where the tendon slides: guide_N, at the base with sheath_N, plus (before + beyond) tanh(mu wrap / 2), which is
    the capstan equation.
    """
    out = io.StringIO()
    writer = csv.writer(out, lineterminator="\n")
    writer.writerow(COLUMNS)
    for k in range(0, loop.drive_mm.size, STEPS_OF_AMPLITUDE // 2):
        for side, tendon in enumerate("ab"[: loop.before_N.shape[1]]):
            for guide, wrap in enumerate(np.degrees(loop.wrap_rad[k])):
                at = (k, side, guide)
                numbers = (wrap, loop.before_N[at], loop.beyond_N[at], loop.limit_N[at])
                where = (_plain(loop.drive_mm[k]), BRANCHES[loop.branch[k]], _plain(loop.angle_deg[k]))
                writer.writerow([*where, tendon, guide, *map(_plain, numbers)])
    return out.getvalue()


def _plain(value: float) -> str:
    """Nine digits, and no minus before a zero."""
    return f"{0.0 if math.isclose(value, 0.0, abs_tol=1e-12) else value:.9g}"
