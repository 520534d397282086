"""The charts of a run: loops, fits, parts of a loop, and figures of a trace."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import cycle

import numpy as np

from hysteresis.arrays import Floats, Mask
from hysteresis.attempts import attempt
from hysteresis.records.metrics import loop_width
from hysteresis.records.record import Record
from studies.report.charts import Bars, Chart, Line, Plate, Tone, finite
from studies.report.live import chart_json
from studies.report.still import chart_svg
from studies.results.separation import Separation

ANGLE = "bending angle, deg"
DRIVE = "drive, mm"
LESS = "angle less backbone, deg"
_WIDTH_IN = {1: 9.4, 2: 4.7, 3: 3.4}  # width of a chart on paper, by the number of charts in a row
PRELOADS: tuple[Tone, ...] = ("orange", "blue", "green", "purple")


@dataclass(frozen=True)
class Series:
    """A fit sample by sample, as stored next to its JSON; shapes (m,)."""

    drive: Floats
    angle_deg: Floats
    base_deg: Floats
    predicted_deg: Floats
    heldout: Mask


@dataclass(frozen=True)
class DrawnChart:
    """A chart as the page takes it: SVG for paper, JSON for the screen, and a text in place of both.

    A chart that cannot be drawn has a text that says why, and no SVG.
    """

    title: str
    alt: str
    svg: str
    json: str


@dataclass(frozen=True)
class Drawn:
    """A plate as the page takes it."""

    charts: tuple[DrawnChart, ...]
    caption: str
    columns: int
    heading: str


def draw(plate: Plate) -> Drawn:
    """Draw a plate for paper and for the screen; a chart that cannot be drawn is a line."""
    width = _WIDTH_IN[plate.columns]
    charts = tuple(_drawn(chart, width) for chart in plate.charts)
    return Drawn(charts, plate.caption, plate.columns, plate.heading)


def _drawn(chart: Chart, width: float) -> DrawnChart:
    failed = list[str]()
    svg, json = attempt("not drawn", lambda: (chart_svg(chart, width), chart_json(chart)), ("", ""), failed)
    return DrawnChart(chart.title, failed[0] if failed else chart.alt, svg, json)


LOOPS_CAPTION = (
    "Multibody model; its difference from the analytic curve, which has no friction; vertical width of the closed loop."
)
TOE_CAPTION = (
    f"{LOOPS_CAPTION} A higher preload narrows the loop because the tendon is soft at low tension (toe region): the "
    "friction in the sheath, which does not depend on the tension, stretches a stiffer tendon less. With the material "
    "loop the largest width is at zero drive."
)
"""Caption for the preset of the paper."""


def loops_plate(
    records: Sequence[Record], labels: Sequence[str], theories: Sequence[Record], caption: str = LOOPS_CAPTION
) -> Plate:
    """Chart the angle over the drive, its difference from the analytic curve of the rig, and the loop width."""
    loops, against = [], []
    width, widest = width_chart(records, labels)
    for record, theory, label, tone in zip(records, theories, labels, cycle(PRELOADS), strict=False):
        loops.append(Line(record.drive, record.angle_deg, label, tone))
        against.append(Line(record.drive, less_curve(record, theory), label, tone))
    return Plate(
        (
            Chart("Bending angle", DRIVE, ANGLE, tuple(loops), f"Loops of the angle; widest {', '.join(widest)}."),
            Chart(
                "Difference from the analytic curve",
                DRIVE,
                "multibody - analytic, deg",
                tuple(against),
                "The same loops minus the curve of the model without friction: the difference is the hysteresis.",
            ),
            width,
        ),
        caption,
        columns=3,
    )


def less_curve(record: Record, theory: Record) -> Floats:
    """Angle of a record less that of a curve without hysteresis at the same drive, shape (m,), deg."""
    order = np.argsort(theory.drive, kind="stable")
    return record.angle_deg - np.interp(record.drive, theory.drive[order], theory.angle_deg[order])


def width_chart(records: Sequence[Record], labels: Sequence[str]) -> tuple[Chart, list[str]]:
    """Chart the vertical width of loops over the drive; the widest of each in words, too."""
    widths, widest = [], []
    for record, label, tone in zip(records, labels, cycle(PRELOADS), strict=False):
        width = loop_width(record.drive, record.angle_deg, record.cycle)
        widths.append(Line(width.drive, width.width_deg, label, tone))
        widest.append(f"{width.max_deg:.3g} deg at {label}")
    alt = f"Vertical width of the loop over the drive: {', '.join(widest)}."
    return Chart("Width of the loop", DRIVE, "loop width, deg", tuple(widths), alt), widest


def fit_plate(series: Series, unit: str, name: str) -> Plate:
    """Chart the measured and the predicted loop, and the residual without and with the layer."""
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
            Chart("Residual", drive, "residual, deg", residual, f"{name}, residual. {most}."),
        ),
        f"Record and prediction; residual without and with the layer. {most}.",
    )


MEASURES = {"share": "of the energy", "width_share": "of the width"}


def parts_plate(result: Separation) -> Plate | None:
    """Chart the shares of the parts of a loop; None if there is no loop."""
    parts = result.contributions
    names = tuple(part.replace("_", " ") for part in parts)
    bars = []
    for (key, label), tone in zip(MEASURES.items(), ("blue", "orange"), strict=True):
        values = finite([row.share_of(key) for row in parts.values()])
        if np.isnan(values).all():
            continue
        limits = [row.interval(key) or (np.nan, np.nan) for row in parts.values()]
        low, high = 100 * finite([a for a, _ in limits]), 100 * finite([b for _, b in limits])
        known = None if np.isnan(low).all() else low
        bars.append(Bars(names, 100 * values, label, tone, known, None if known is None else high))  # type: ignore[arg-type]
    if not bars:
        return None
    alt = "; ".join(
        f"{name} " + ", ".join(f"{np.round(bar.values[i]) + 0.0:.0f} % {bar.name}" for bar in bars)
        for i, name in enumerate(names)
    )
    ends = _shown(bars)
    beyond = " Intervals that leave the chart are in the table: these records do not fix them." if ends else ""
    chart = Chart("Shares of the loop", "share of the whole loop, %", "", tuple(bars), f"{alt}.", x_range=ends)
    return Plate(
        (chart,),
        "Each source is switched on and off in the model. Energy is the loss of a cycle; width is the largest vertical "
        f"width of the loop of the angle. Shares add up to 100 %; the interaction belongs to no single source.{beyond}",
        columns=1,
    )


def _shown(bars: Sequence[Bars]) -> tuple[float, float] | None:
    """Give the ends of the axis where intervals are so wide that bars could not be seen; None where they are not."""
    values = np.concatenate([bar.values for bar in bars])
    low, high = min(0.0, float(np.nanmin(values))), max(100.0, float(np.nanmax(values)))
    reach = 0.5 * (high - low)
    intervals = [ends for bar in bars for ends in (bar.low, bar.high) if ends is not None]
    widest = np.concatenate([*intervals, values])
    fits = np.nanmin(widest) >= low - reach and np.nanmax(widest) <= high + reach
    return None if fits else (low - reach, high + reach)


def columns_plate(table: Floats, names: Sequence[str], caption: str) -> Plate:
    """Chart the first column against the others; ``table`` of shape (m, columns)."""
    tones: tuple[Tone, ...] = ("blue", "orange", "green", "purple", "grey")
    lines = tuple(
        Line(table[:, 0], column, name, tones[i % len(tones)])
        for i, (column, name) in enumerate(zip(table[:, 1:].T, names[1:], strict=True))
    )
    alone = names[1] if len(lines) == 1 else ""
    return Plate((Chart("", names[0], alone, lines, caption),), caption, columns=1)
