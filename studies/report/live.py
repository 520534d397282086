"""Charts as JSON for plotly.js. Colours are names of the page's style (``$blue``), so that they follow its theme."""

from __future__ import annotations

from dataclasses import replace

from studies.report.charts import Bars, Chart, Dots, Heat, Line, Span
from studies.report.plotly import (
    Axis,
    BarTrace,
    ColorBar,
    Figure,
    HeatMap,
    Layout,
    Marker,
    Scatter,
    Shape,
    Spread,
    Stroke,
    Title,
    Whiskers,
    as_json,
    packed,
)

_SYMBOLS = {"dots": ("circle", 9), "crosses": ("x", 8), "star": ("star", 16)}
_DASHES = {"solid": "solid", "dash": "dash", "dot": "dot"}


def chart_json(chart: Chart) -> str:
    """Give the traces and the layout of a chart."""
    has_bars = any(isinstance(mark, Bars) for mark in chart.marks)
    in_legend = [mark for mark in chart.marks if isinstance(mark, Line | Bars)]
    layout = Layout(_axis(chart.x_label), _axis(chart.y_label), showlegend=chart.legend and len(in_legend) > 1)
    if chart.x_range is not None:
        layout = replace(layout, xaxis=replace(layout.xaxis, range=chart.x_range))
    if chart.y_range is not None:
        layout = replace(layout, yaxis=replace(layout.yaxis, range=chart.y_range))
    if chart.equal:
        layout = replace(layout, yaxis=replace(layout.yaxis, scaleanchor="x"))
    spans = [mark for mark in chart.marks if isinstance(mark, Span)]
    if spans:
        layout = replace(layout, shapes=tuple(map(_shape, spans)))
    if has_bars:
        categories = replace(layout.yaxis, autorange="reversed", type="category", ticklabelstandoff=6)
        layout = replace(layout, yaxis=categories, barmode="group", bargap=0.25)
    return as_json(Figure(tuple(_trace(mark) for mark in chart.marks if not isinstance(mark, Span)), layout))


def _axis(label: str) -> Axis:
    return Axis(Title(label, standoff=8))


def _shape(span: Span) -> Shape:
    """Give a band or a line from end to end of the chart; a line stands before the marks."""
    is_line, low, high = span.low == span.high, span.low, span.high
    kind, layer = ("line", "above") if is_line else ("rect", "below")
    stroke = Stroke(1.2 if is_line else 0.0, "$ink", "dot")
    if span.along == "x":
        return Shape(kind, "x", "paper", low, high, 0.0, 1.0, stroke, layer=layer)
    return Shape(kind, "paper", "y", 0.0, 1.0, low, high, stroke, layer=layer)


def _trace(mark: Line | Bars | Heat | Dots) -> Scatter | BarTrace | HeatMap:
    if isinstance(mark, Line):
        return _line(mark)
    if isinstance(mark, Bars):
        return _bars(mark)
    if isinstance(mark, Heat):
        low, high = mark.scale or (None, None)
        return HeatMap(packed(mark.x), packed(mark.y), packed(mark.z), _colour_bar(mark.label), low, high)
    return _dots(mark)


def _line(mark: Line) -> Scatter:
    x, y = packed(mark.x), packed(mark.y)
    if mark.style == "points":
        points = Scatter(x, y, "markers", name=mark.name, marker=Marker(f"${mark.tone}", size=4))
        if mark.spread is None:
            return points
        wide = replace(points, marker=Marker(f"${mark.tone}", size=7))
        return replace(wide, error_y=Spread(packed(mark.spread), f"${mark.tone}"))
    if mark.style in _SYMBOLS:
        symbol, size = _SYMBOLS[mark.style]
        marker = Marker(f"${mark.tone}", size=size, symbol=symbol, line=Stroke(1.0, "$card"))
        return Scatter(x, y, "markers", name=mark.name, marker=marker)
    return Scatter(x, y, "lines", name=mark.name, line=Stroke(1.8, f"${mark.tone}", _DASHES[mark.style]))


def _dots(mark: Dots) -> Scatter:
    marker = Marker(packed(mark.value), size=7, colorscale="Cividis", showscale=True, colorbar=_colour_bar(mark.label))
    dots = Scatter(packed(mark.x), packed(mark.y), "markers", marker=marker)
    return replace(dots, text=mark.notes, hovertemplate="%{text}<extra></extra>") if mark.notes else dots


def _bars(mark: Bars) -> BarTrace:
    colour = tuple(f"${tone}" for tone in mark.tones) or f"${mark.tone}"
    bars = BarTrace(mark.categories, packed(mark.values), mark.name, Marker(colour))
    if mark.low is None or mark.high is None:
        return bars
    return replace(bars, error_x=Whiskers(packed(mark.high - mark.values), packed(mark.values - mark.low)))


def _colour_bar(label: str) -> ColorBar:
    return ColorBar(Title(label, side="right"))
