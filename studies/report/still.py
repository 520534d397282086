"""Charts as SVG text, for paper and for browsers without scripts."""

from __future__ import annotations

import io
import warnings
from typing import Any

import matplotlib
import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from studies.report.charts import Bars, Chart, Dots, Heat, Line, Span

INK = {"blue": "#1f5fa8", "orange": "#c8641e", "green": "#1b8070", "purple": "#7a4fa3", "grey": "#8a8f98"}
STYLE: dict[Any, Any] = {
    "font.size": 8.5,
    "axes.spines.top": False,
    "axes.spines.right": False,
    "axes.edgecolor": "#8a8f98",
    "axes.labelcolor": "#3a4352",
    "xtick.color": "#596273",
    "ytick.color": "#596273",
    "axes.grid": True,
    "axes.axisbelow": True,
    "grid.color": "#e8eaee",
    "lines.linewidth": 1.3,
    "legend.frameon": False,
    "svg.hashsalt": "notchbend",  # makes the text reproducible
    "svg.fonttype": "path",
}
_SYMBOLS = {"dots": ("o", 5.5), "crosses": ("X", 6.5), "star": ("*", 11)}
_DASHES = {"solid": "-", "dash": "--", "dot": ":"}
HEIGHT = 2.9
_MOST_VECTORS = 800  # points of a line; more of them are drawn as pixels, which keeps the text short


def chart_svg(chart: Chart, width: float) -> str:
    """Draw a chart ``width`` inches wide."""
    with matplotlib.rc_context(STYLE):
        figure = Figure(figsize=(width, HEIGHT), layout="constrained")
        draw_chart(figure, figure.subplots(), chart)
        return _text(figure)


def draw_chart(figure: Figure, axes: Axes, chart: Chart) -> None:
    """Draw the marks of a chart, its labels and its legend on axes of a figure; the title is left to the caller."""
    lines = [mark for mark in chart.marks if isinstance(mark, Line)]
    bars = [mark for mark in chart.marks if isinstance(mark, Bars)]
    for line in lines:
        _line(axes, line)
    for i, bar in enumerate(bars):
        _bar(axes, bar, i, len(bars))
    for mark in chart.marks:
        if isinstance(mark, Heat):
            _heat(figure, axes, mark)
        elif isinstance(mark, Dots):
            shown = axes.scatter(mark.x, mark.y, c=mark.value, cmap="cividis", s=14, lw=0)
            figure.colorbar(shown, ax=axes, label=mark.label)
        elif isinstance(mark, Span):
            _span(axes, mark)
    if chart.x_range is not None:
        axes.set_xlim(*chart.x_range)
    if chart.y_range is not None:
        axes.set_ylim(*chart.y_range)
    if chart.equal:
        axes.set_aspect("equal", adjustable="datalim")
    axes.set_xlabel(chart.x_label)
    axes.set_ylabel(chart.y_label)
    if has_legend_above(chart):
        count = len(bars) or len(lines)
        axes.legend(loc="lower left", bbox_to_anchor=(0.0, 1.0), ncols=count, fontsize=7.5, borderaxespad=0.2)
    elif not chart.legend:
        return
    elif len(lines) > 1:
        axes.legend(loc="best", fontsize=7.5)


def has_legend_above(chart: Chart) -> bool:
    """Tell whether the legend stands above the chart: bars and fields fill it and leave no room."""
    lines, bars, fields = (sum(isinstance(mark, kind) for mark in chart.marks) for kind in (Line, Bars, Heat))
    return chart.legend and (bars > 1 or (fields > 0 and lines > 1))


def _line(axes: Axes, line: Line) -> None:
    if line.spread is not None:
        axes.errorbar(line.x, line.y, line.spread, fmt=".", ms=6, lw=1, color=INK[line.tone], label=line.name)
    elif line.style == "points":
        many = line.x.size > _MOST_VECTORS
        axes.plot(line.x, line.y, ".", ms=3, color=INK[line.tone], label=line.name, rasterized=many)
    elif line.style in _SYMBOLS:
        form, size = _SYMBOLS[line.style]
        axes.plot(line.x, line.y, form, ms=size, mec="white", mew=0.4, color=INK[line.tone], label=line.name)
    else:
        axes.plot(line.x, line.y, ls=_DASHES[line.style], color=INK[line.tone], label=line.name)


def _bar(axes: Axes, bar: Bars, index: int, count: int) -> None:
    height = 0.8 / count
    y = np.arange(len(bar.categories))[::-1] + (count - 1) * height / 2 - index * height
    ends = None if bar.low is None or bar.high is None else np.abs([bar.values - bar.low, bar.high - bar.values])
    colour = [INK[tone] for tone in bar.tones] or INK[bar.tone]
    axes.barh(y, bar.values, 0.9 * height, color=colour, label=bar.name, xerr=ends, ecolor="#1c2330")
    axes.set_yticks(np.arange(len(bar.categories))[::-1], bar.categories)
    axes.axvline(0, color="#8a8f98", lw=0.8)
    axes.grid(False, axis="y")


def _span(axes: Axes, span: Span) -> None:
    band, line = (axes.axvspan, axes.axvline) if span.along == "x" else (axes.axhspan, axes.axhline)
    if span.low == span.high:
        line(span.low, color="#1c2330", lw=1, ls=":")
    else:
        band(span.low, span.high, color="#e8eaee", lw=0, zorder=0)


def _heat(figure: Figure, axes: Axes, heat: Heat) -> None:
    low, high = heat.scale or (None, None)
    field = np.ma.masked_invalid(heat.z)
    shown = axes.pcolormesh(heat.x, heat.y, field, cmap="cividis", shading="nearest", vmin=low, vmax=high)
    shown.set_rasterized(True)
    figure.colorbar(shown, ax=axes, label=heat.label)
    axes.grid(False)


def _text(figure: Figure) -> str:
    stream = io.StringIO()
    with warnings.catch_warnings():  # about characters that the font lacks: titles of users may have any
        warnings.filterwarnings("ignore", message="Glyph", category=UserWarning)
        warnings.filterwarnings("ignore", message="constrained_layout not applied", category=UserWarning)  # long names
        figure.savefig(stream, format="svg", metadata={"Date": None}, dpi=150)
    text = stream.getvalue()
    return text[text.index("<svg") :]  # without the XML head, which is not allowed inside a page
