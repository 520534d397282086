"""Figures of the report, as SVG text to stand in the page."""

from __future__ import annotations

import io
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import matplotlib
import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from numpy.typing import NDArray

from hysteresis.metrics import loop_width
from hysteresis.record import Record

Array = NDArray[np.float64]
BLUE, ORANGE, GREY, GREEN = "#1f5fa8", "#c8641e", "#8a8f98", "#2f7d4f"
STYLE: dict[Any, Any] = {
    "font.size": 9.0,
    "axes.spines.top": False,
    "axes.spines.right": False,
    "axes.grid": True,
    "grid.color": "#e4e6ea",
    "lines.linewidth": 1.3,
    "legend.frameon": False,
    "svg.hashsalt": "notchbend",  # the same figure gives the same text
    "svg.fonttype": "path",
}


@dataclass(frozen=True)
class Series:
    """A fit sample by sample, as stored beside its JSON; shapes (m,)."""

    drive: Array
    angle_deg: Array
    base_deg: Array
    predicted_deg: Array
    heldout: NDArray[np.bool_]


def loops_figure(records: Sequence[Record], labels: Sequence[str], theories: Sequence[Record]) -> str:
    """Angle over drive, the angle against the analytic curve of the same rig, and the width of the loop."""
    with matplotlib.rc_context(STYLE):
        figure = Figure(figsize=(9.6, 3.3), layout="constrained")
        loops, against, widths = figure.subplots(1, 3)
        for record, theory, label, colour in zip(records, theories, labels, (ORANGE, BLUE), strict=False):
            order = np.argsort(theory.drive, kind="stable")
            curve = np.interp(record.drive, theory.drive[order], theory.angle_deg[order])
            loops.plot(record.drive, record.angle_deg, color=colour, label=label)
            against.plot(record.drive, record.angle_deg - curve, color=colour, label=label)
            width = loop_width(record.drive, record.angle_deg, record.cycle)
            widths.plot(width.drive, width.width_deg, color=colour, label=label)
        _label(loops, "drive, mm", "bending angle, deg")
        _label(against, "drive, mm", "angle - analytic curve, deg")
        _label(widths, "drive, mm", "loop width, deg")
        loops.legend(loc="upper left")
        return _svg(figure)


def fit_figure(series: Series, unit: str) -> str:
    """Measured and predicted loop, and the residual without and with the layer."""
    with matplotlib.rc_context(STYLE):
        figure = Figure(figsize=(9.6, 3.6), layout="constrained")
        left, right = figure.subplots(1, 2)
        left.plot(series.drive, series.angle_deg, ".", ms=2.5, color=GREY, label="record")
        left.plot(series.drive, series.base_deg, color=ORANGE, lw=1.0, ls="--", label="f alone")
        left.plot(series.drive, series.predicted_deg, color=BLUE, label="f + Bouc-Wen")
        _label(left, f"drive, {unit}", "bending angle, deg")
        left.legend(loc="upper left")
        right.plot(series.drive, series.angle_deg - series.base_deg, color=ORANGE, lw=0.8, label="f alone")
        residual = series.angle_deg - series.predicted_deg
        right.plot(series.drive, residual, color=BLUE, lw=0.8, label="f + Bouc-Wen")
        held = series.heldout
        right.plot(series.drive[held], residual[held], ".", ms=3, color=GREEN, label="held out")
        _label(right, f"drive, {unit}", "residual, deg")
        right.legend(loc="best")
        return _svg(figure)


def _label(axes: Axes, x: str, y: str) -> None:
    axes.set_xlabel(x)
    axes.set_ylabel(y)


def _svg(figure: Figure) -> str:
    stream = io.StringIO()
    figure.savefig(stream, format="svg", metadata={"Date": None})
    text = stream.getvalue()
    return text[text.index("<svg") :]  # without the XML head, which has no place inside a page
