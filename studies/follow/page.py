"""The page of a device that is followed: one HTML file that a service engineer reads, a chart for each number."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from studies.follow.result import FollowedNumber, FollowReport
from studies.report.charts import Chart, Line, Mark, Plate, Span, finite
from studies.report.plots import Drawn, draw
from studies.report.templates import environment
from validation.tracing import catalogue
from validation.tracing.effect import Effect

HERE = Path(__file__).parent
CAPTION = (
    "Points: the number in each record, with the 95 % interval of the record alone. Line: moving average of the "
    "control chart, with the band in which it stays if the device does not change. Dashed: a limit that was given."
)


def follow_page(report: FollowReport) -> str:
    """Give the HTML page of a report."""
    return (
        environment(HERE)
        .get_template("follow.html")
        .render(
            f=report,
            made=report.made,
            effects=effects_of(report),
            plates=plates_of(report),
        )
    )


def effects_of(report: FollowReport) -> tuple[Effect, ...]:
    """Give the effects that are named, and those that are not distinguished from them."""
    names = set(report.cause.effects) | set(report.cause.alike) if report.cause else set()
    return tuple(effect for effect in catalogue() if effect.name in names)


def plates_of(report: FollowReport) -> tuple[Drawn, ...]:
    """Draw the charts of all numbers."""
    return (draw(plate_of(report)),)


def plate_of(report: FollowReport) -> Plate:
    """Give the charts of all numbers."""
    limits = {one.name: one.limit for one in report.limits}
    return Plate(tuple(_chart(one, report, limits.get(one.name)) for one in report.parameters), CAPTION, columns=2)


def _chart(one: FollowedNumber, report: FollowReport, limit: float | None) -> Chart:
    at, values = np.array(report.axis.values), np.array(one.values)
    marks: list[Mark] = [Span("y", one.chart_low, one.chart_high)]
    half = 0.5 * (np.array(one.high) - np.array(one.low))
    marks.append(Line(at, values, "record", "grey", spread=half))
    marks.append(Line(at, finite(one.average), "average", "blue"))
    if limit is not None:
        marks.append(Line(at[[0, -1]], np.array([limit, limit]), "limit", "orange", "dash"))
    marks += [Span("x", change.at, change.at) for change in report.changes]
    outside = "stays within" if one.alarm is None else f"leaves at {report.axis.name} {at[one.alarm - 1]:g}"
    unit = "" if one.unit == "1" else f", {one.unit}"
    alt = f"{one.words}: from {values[0]:.3g} to {values[-1]:.3g}; the average {outside} its limits."
    title = f"{one.words[:1].upper()}{one.words[1:]}"
    return Chart(title, report.axis.name, f"{one.name}{unit}", tuple(marks), alt)
