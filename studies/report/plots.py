"""The charts of a run: loops, fits, parts of a loop, and what stands beside a trace."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from hysteresis.arrays import Floats
from hysteresis.metrics import loop_width
from hysteresis.record import Record
from studies.report.charts import Bars, Chart, Line, Plate, Tone, finite
from studies.report.live import chart_json
from studies.report.still import chart_svg

ANGLE = "bending angle, deg"
_WIDTH_IN = {1: 9.4, 2: 4.7, 3: 3.4}  # of a chart on paper, by the charts in a row
_PRELOADS: tuple[Tone, ...] = ("orange", "blue", "green", "purple")


@dataclass(frozen=True)
class Series:
    """A fit sample by sample, as stored beside its JSON; shapes (m,)."""

    drive: Floats
    angle_deg: Floats
    base_deg: Floats
    predicted_deg: Floats
    heldout: NDArray[np.bool_]


@dataclass(frozen=True)
class Drawn:
    """A plate as the page takes it: of each chart its title, words, SVG and JSON."""

    charts: tuple[dict[str, str], ...]
    caption: str
    columns: int


def draw(plate: Plate) -> Drawn:
    """Draw a plate for paper and for the screen."""
    width = _WIDTH_IN[plate.columns]
    charts = (
        {"title": chart.title, "alt": chart.alt, "svg": chart_svg(chart, width), "json": chart_json(chart)}
        for chart in plate.charts
    )
    return Drawn(tuple(charts), plate.caption, plate.columns)


def loops_plate(records: Sequence[Record], labels: Sequence[str], theories: Sequence[Record]) -> Plate:
    """Angle over drive, the angle against the analytic curve of the same rig, and the width of the loop."""
    loops, against, widths, widest = [], [], [], []
    for record, theory, label, tone in zip(records, theories, labels, _PRELOADS, strict=False):
        order = np.argsort(theory.drive, kind="stable")
        curve = np.interp(record.drive, theory.drive[order], theory.angle_deg[order])
        width = loop_width(record.drive, record.angle_deg, record.cycle)
        loops.append(Line(record.drive, record.angle_deg, label, tone))
        against.append(Line(record.drive, record.angle_deg - curve, label, tone))
        widths.append(Line(width.drive, width.width_deg, label, tone))
        widest.append(f"{width.max_deg:.3g} deg at {label}")
    drive = "drive, mm"
    return Plate(
        (
            Chart("Bending angle", drive, ANGLE, tuple(loops), f"Loops of the angle; widest {', '.join(widest)}."),
            Chart(
                "Less the analytic curve",
                drive,
                "multibody - analytic, deg",
                tuple(against),
                "The same loops less the curve of the model without friction: what is left is the hysteresis.",
            ),
            Chart(
                "Width of the loop",
                drive,
                "loop width, deg",
                tuple(widths),
                f"Vertical width over the drive: {', '.join(widest)}.",
            ),
        ),
        "Multibody model; the same less the analytic curve, which has no friction; vertical width of the closed loop. "
        "More preload narrows the loop because the rope is soft at low tension (toe region): the friction in the "
        "sheath, which does not depend on the tension, stretches it less. The material loop puts the widest place at "
        "zero drive.",
        columns=3,
    )


def fit_plate(series: Series, unit: str, name: str) -> Plate:
    """Measured and predicted loop, and the residual without and with the layer."""
    s, drive = series, f"drive, {unit}"
    before, after, held = s.angle_deg - s.base_deg, s.angle_deg - s.predicted_deg, s.heldout
    loop = (
        Line(s.drive, s.angle_deg, "record", "grey", "points"),
        Line(s.drive, s.base_deg, "f alone", "orange", "dash"),
        Line(s.drive, s.predicted_deg, "f + Bouc-Wen", "blue"),
    )
    residual = (
        Line(s.drive, before, "f alone", "orange", "dash"),
        Line(s.drive, after, "f + Bouc-Wen", "blue"),
        Line(s.drive[held], after[held], "held out", "green", "points"),
    )
    most = f"At most {np.abs(before).max():.3g} deg without the layer and {np.abs(after).max():.3g} deg with it"
    return Plate(
        (
            Chart("Record and prediction", drive, ANGLE, loop, f"{name}: record, f alone, f with the layer."),
            Chart("What is left", drive, "residual, deg", residual, f"{name}, residual. {most}."),
        ),
        f"Record and prediction; what is left without and with the layer. {most}.",
    )


MEASURES = {"share": "of the energy", "width_share": "of the width"}


def parts_plate(result: Mapping[str, Any]) -> Plate | None:
    """Shares of the parts of a loop; None where there is no loop to share."""
    parts = result["contributions"]
    names = tuple(part.replace("_", " ") for part in parts)
    bars = []
    for (key, label), tone in zip(MEASURES.items(), ("blue", "orange"), strict=True):
        values = finite([row[key] for row in parts.values()])
        if np.isnan(values).all():
            continue
        limits = [row.get("intervals", {}).get(key) or (np.nan, np.nan) for row in parts.values()]
        low, high = 100 * finite([a for a, _ in limits]), 100 * finite([b for _, b in limits])
        known = None if np.isnan(low).all() else low
        bars.append(Bars(names, 100 * values, label, tone, known, None if known is None else high))  # type: ignore[arg-type]
    if not bars:
        return None
    said = "; ".join(
        f"{name} " + ", ".join(f"{bar.values[i]:.0f} % {bar.name}" for bar in bars) for i, name in enumerate(names)
    )
    return Plate(
        (Chart("Shares of the loop", "share of the whole loop, %", "", tuple(bars), f"{said}."),),
        "Each source is switched in the mechanics. Energy is what a cycle loses; width is the largest vertical width "
        "of the angle's loop. Shares add up to 100 %; the interaction is what no source makes alone.",
        columns=1,
    )


def columns_plate(table: Floats, names: Sequence[str], caption: str) -> Plate:
    """First column against the others, as they stand beside a trace; ``table`` of shape (m, columns)."""
    tones: tuple[Tone, ...] = ("blue", "orange", "green", "purple", "grey")
    lines = tuple(
        Line(table[:, 0], column, name, tones[i % len(tones)])
        for i, (column, name) in enumerate(zip(table[:, 1:].T, names[1:], strict=True))
    )
    alone = names[1] if len(lines) == 1 else ""
    return Plate((Chart("", names[0], alone, lines, caption),), caption, columns=1)
