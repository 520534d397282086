"""Charts as JSON for plotly.js. Colours are names of the page's style, so that they follow its theme."""

from __future__ import annotations

import plotly.graph_objects as go
from plotly.basedatatypes import BasePlotlyType

from studies.report.charts import Bars, Chart, Dots, Heat, Line, Span
from studies.report.plotly import as_json, colour_bar, packed, tone

_SYMBOLS = {"dots": ("circle", 9), "crosses": ("x", 8), "star": ("star", 16)}
_DASHES = {"solid": "solid", "dash": "dash", "dot": "dot"}


def chart_json(chart: Chart) -> str:
    """Give the traces and the layout of a chart."""
    in_legend = [mark for mark in chart.marks if isinstance(mark, Line | Bars)]
    layout = go.Layout(
        xaxis=_axis(go.layout.XAxis, chart.x_label, chart.x_range),
        yaxis=_axis(go.layout.YAxis, chart.y_label, chart.y_range),
        showlegend=chart.legend and len(in_legend) > 1,
        hovermode="closest",
        shapes=[_shape(mark) for mark in chart.marks if isinstance(mark, Span)],
    )
    if chart.equal:
        layout.yaxis.scaleanchor = "x"
    if any(isinstance(mark, Bars) for mark in chart.marks):
        layout.yaxis.update(autorange="reversed", type="category", ticklabelstandoff=6)
        layout.update(barmode="group", bargap=0.25)
    return as_json((_trace(mark) for mark in chart.marks if not isinstance(mark, Span)), layout)


def _axis(kind: type[BasePlotlyType], label: str, within: tuple[float, float] | None) -> BasePlotlyType:
    lines = {"gridcolor": tone("line"), "zerolinecolor": tone("line")}
    return kind(title={"text": label, "standoff": 8}, automargin=True, range=within, **lines)


def _shape(span: Span) -> go.layout.Shape:
    """Give a band or a line from end to end of the chart; a line stands before the marks."""
    is_line = span.low == span.high
    ends = {"x0": span.low, "x1": span.high, "y0": 0.0, "y1": 1.0, "xref": "x", "yref": "paper"}
    if span.along == "y":
        ends = {"x0": 0.0, "x1": 1.0, "y0": span.low, "y1": span.high, "xref": "paper", "yref": "y"}
    return go.layout.Shape(
        type="line" if is_line else "rect",
        layer="above" if is_line else "below",
        line={"width": 1.2 if is_line else 0.0, "color": tone("ink"), "dash": "dot"},
        fillcolor=tone("line"),
        opacity=1.0,
        **ends,
    )


def _trace(mark: Line | Bars | Heat | Dots) -> go.Scatter | go.Bar | go.Heatmap:
    if isinstance(mark, Line):
        return _line(mark)
    if isinstance(mark, Bars):
        return _bars(mark)
    if isinstance(mark, Heat):
        low, high = mark.scale or (None, None)
        x, y, z = packed(mark.x), packed(mark.y), packed(mark.z)
        return go.Heatmap(x=x, y=y, z=z, colorbar=colour_bar(go.heatmap.ColorBar, mark.label), zmin=low, zmax=high)
    return _dots(mark)


def _line(mark: Line) -> go.Scatter:
    line = go.Scatter(x=packed(mark.x), y=packed(mark.y), mode="markers", name=mark.name)
    colour = tone(mark.tone)
    if mark.style == "points":
        line.marker = {"color": colour, "size": 4 if mark.spread is None else 7}
        if mark.spread is not None:
            line.error_y = {"array": packed(mark.spread), "color": colour, "type": "data", "thickness": 1, "width": 0}
    elif mark.style in _SYMBOLS:
        symbol, size = _SYMBOLS[mark.style]
        line.marker = {"color": colour, "size": size, "symbol": symbol, "line": {"width": 1.0, "color": tone("card")}}
    else:
        line.update(mode="lines", line={"width": 1.8, "color": colour, "dash": _DASHES[mark.style]})
    return line


def _dots(mark: Dots) -> go.Scatter:
    bar = colour_bar(go.scatter.marker.ColorBar, mark.label)
    marker = {"color": packed(mark.value), "size": 7, "showscale": True, "colorbar": bar}
    dots = go.Scatter(x=packed(mark.x), y=packed(mark.y), mode="markers", marker=marker)
    return dots.update(text=mark.notes, hovertemplate="%{text}<extra></extra>") if mark.notes else dots


def _bars(mark: Bars) -> go.Bar:
    colour = [tone(one) for one in mark.tones] or tone(mark.tone)
    bars = go.Bar(y=mark.categories, x=packed(mark.values), name=mark.name, marker={"color": colour}, orientation="h")
    if mark.low is not None and mark.high is not None:
        ends = {"array": packed(mark.high - mark.values), "arrayminus": packed(mark.values - mark.low)}
        style = {"type": "data", "symmetric": False, "color": tone("ink"), "thickness": 1, "width": 3}
        bars.error_x = {**ends, **style}
    return bars
