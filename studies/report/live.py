"""Charts as JSON for plotly.js. Colours are names of the page's style (``$blue``), so that they follow its theme."""

from __future__ import annotations

from dataclasses import replace

from studies.report.charts import Bars, Chart, Dots, Heat, Line, Mark
from studies.report.plotly import (
    Axis,
    BarTrace,
    ColorBar,
    Figure,
    HeatMap,
    Layout,
    Marker,
    Scatter,
    Stroke,
    Title,
    Whiskers,
    as_json,
    packed,
)

_DASHES = {"solid": "solid", "dash": "dash", "dot": "dot"}


def chart_json(chart: Chart) -> str:
    """Give the traces and the layout of a chart."""
    has_bars = any(isinstance(mark, Bars) for mark in chart.marks)
    in_legend = [mark for mark in chart.marks if isinstance(mark, Line | Bars)]
    layout = Layout(_axis(chart.x_label), _axis(chart.y_label), showlegend=len(in_legend) > 1)
    if has_bars:
        categories = replace(layout.yaxis, autorange="reversed", type="category", ticklabelstandoff=6)
        layout = replace(layout, yaxis=categories, barmode="group", bargap=0.25)
    return as_json(Figure(tuple(_trace(mark) for mark in chart.marks), layout))


def _axis(label: str) -> Axis:
    return Axis(Title(label, standoff=8))


def _trace(mark: Mark) -> Scatter | BarTrace | HeatMap:
    if isinstance(mark, Line):
        return _line(mark)
    if isinstance(mark, Bars):
        return _bars(mark)
    if isinstance(mark, Heat):
        return HeatMap(packed(mark.x), packed(mark.y), packed(mark.z), _colour_bar(mark.label))
    return _dots(mark)


def _line(mark: Line) -> Scatter:
    x, y = packed(mark.x), packed(mark.y)
    if mark.style == "points":
        return Scatter(x, y, "markers", name=mark.name, marker=Marker(f"${mark.tone}", size=4))
    return Scatter(x, y, "lines", name=mark.name, line=Stroke(1.8, f"${mark.tone}", _DASHES[mark.style]))


def _dots(mark: Dots) -> Scatter:
    marker = Marker(packed(mark.value), size=7, colorscale="Cividis", showscale=True, colorbar=_colour_bar(mark.label))
    dots = Scatter(packed(mark.x), packed(mark.y), "markers", marker=marker)
    return replace(dots, text=mark.notes, hovertemplate="%{text}<extra></extra>") if mark.notes else dots


def _bars(mark: Bars) -> BarTrace:
    bars = BarTrace(mark.categories, packed(mark.values), mark.name, Marker(f"${mark.tone}"))
    if mark.low is None or mark.high is None:
        return bars
    return replace(bars, error_x=Whiskers(packed(mark.high - mark.values), packed(mark.values - mark.low)))


def _colour_bar(label: str) -> ColorBar:
    return ColorBar(Title(label, side="right"))
