"""The picture of a bent wrist for a report: a view in three dimensions, and a still image."""

from __future__ import annotations

import io
from pathlib import Path

import numpy as np

from fem_models.rig import Rig
from hysteresis.arrays import Floats
from hysteresis.attempts import attempt
from hysteresis.files import write_files
from hysteresis.own import marked_png
from hysteresis.records.record import Record
from studies.notebook.in_space import wrist_figure
from studies.report.tube import wrist_tube, write_stored
from studies.results.run import Picture

_DPI = 150


def draw_wrist(rig: Rig, record: Record, out: Path) -> Picture:
    """Draw the wrist where it bends most in both planes, else in one; ``tube.json`` and ``tube.png``.

    Where that cannot be done there is no picture, and the result says why.
    """
    assert record.angle_2_deg is not None
    assert record.notches_deg is not None
    both = np.minimum(record.angle_deg, record.angle_2_deg)
    total = np.hypot(record.angle_deg, record.angle_2_deg)
    at = int((both if both.max() > 1.0 else total).argmax())
    angles = record.notches_deg[at]
    caption, failed = (
        f"{rig.name}, bent by {record.angle_deg[at]:.1f} deg towards y and {record.angle_2_deg[at]:.1f} deg towards z",
        list[str](),
    )
    picture = attempt("not drawn", lambda: _draw(rig, angles, caption, out), None, failed)
    return Picture(caption=caption, missing=failed[0]) if picture is None else picture


def _draw(rig: Rig, angles: Floats, caption: str, out: Path) -> Picture:
    picture = io.BytesIO()
    wrist_figure(rig, angles).savefig(picture, format="png", dpi=_DPI)
    write_stored(wrist_tube(rig, angles), out / "tube.json")
    write_files({out / "tube.png": marked_png(picture.getvalue())})
    return Picture(tube="tube.json", caption=caption, file="tube.png")
