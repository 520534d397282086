"""Charts as JSON for plotly.js. Colours are names of the page's style (``$blue``), so that they follow its theme."""

from __future__ import annotations

import base64
import json
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from studies.report.charts import Bars, Chart, Heat, Line, Mark

_DASHES = {"solid": "solid", "dash": "dash", "dot": "dot"}


def packed(values: ArrayLike, dtype: str = "f4") -> dict[str, Any]:
    """Give an array as plotly.js reads it: base64 of little-endian numbers, of any shape."""
    array = np.ascontiguousarray(values, dtype="<" + dtype)
    out: dict[str, Any] = {"dtype": dtype, "bdata": base64.b64encode(array.tobytes()).decode()}
    return out | ({"shape": ",".join(map(str, array.shape))} if array.ndim > 1 else {})


def chart_json(chart: Chart) -> str:
    """Give the traces and the layout of a chart."""
    bars = [mark for mark in chart.marks if isinstance(mark, Bars)]
    named = [mark for mark in chart.marks if isinstance(mark, Line | Bars)]
    layout: dict[str, Any] = {
        "xaxis": _axis(chart.x_label),
        "yaxis": _axis(chart.y_label),
        "showlegend": len(named) > 1,
        "hovermode": "closest",
    }
    if bars:
        layout |= {"barmode": "group", "bargap": 0.25}
        layout["yaxis"] |= {"autorange": "reversed", "type": "category", "ticklabelstandoff": 6}
    return as_json([_trace(mark) for mark in chart.marks], layout)


def as_json(traces: list[dict[str, Any]], layout: dict[str, Any], **more: Any) -> str:
    """Give JSON that may stand in a script element of a page."""
    text = json.dumps({"data": traces, "layout": layout, **more}, allow_nan=False, separators=(",", ":"))
    return text.replace("<", "\\u003c")  # no </script> inside


def _axis(label: str) -> dict[str, Any]:
    return {
        "title": {"text": label, "standoff": 8},
        "gridcolor": "$line",
        "zerolinecolor": "$line",
        "automargin": True,
    }


def _trace(mark: Mark) -> dict[str, Any]:
    if isinstance(mark, Line):
        points = mark.style == "points"
        how: dict[str, Any] = (
            {"mode": "markers", "marker": {"size": 4, "color": f"${mark.tone}"}}
            if points
            else {"mode": "lines", "line": {"width": 1.8, "color": f"${mark.tone}", "dash": _DASHES[mark.style]}}
        )
        return {"type": "scatter", "x": packed(mark.x), "y": packed(mark.y), "name": mark.name, **how}
    if isinstance(mark, Bars):
        return _bars(mark)
    if isinstance(mark, Heat):
        shades = {"colorscale": "Cividis", "colorbar": _colour_bar(mark.label)}
        return {"type": "heatmap", "x": packed(mark.x), "y": packed(mark.y), "z": packed(mark.z), **shades}
    marker = {"size": 7, "color": packed(mark.value), "colorscale": "Cividis", "showscale": True}
    marker["colorbar"] = _colour_bar(mark.label)
    hover = {"text": list(mark.notes), "hovertemplate": "%{text}<extra></extra>"} if mark.notes else {}
    dots = {"mode": "markers", "x": packed(mark.x), "y": packed(mark.y), "marker": marker}
    return {"type": "scatter", **dots, **hover}


def _bars(mark: Bars) -> dict[str, Any]:
    out: dict[str, Any] = {
        "type": "bar",
        "orientation": "h",
        "y": list(mark.categories),
        "x": packed(mark.values),
        "name": mark.name,
        "marker": {"color": f"${mark.tone}"},
    }
    if mark.low is not None and mark.high is not None:
        ends = {"array": packed(mark.high - mark.values), "arrayminus": packed(mark.values - mark.low)}
        out["error_x"] = {"type": "data", "symmetric": False, "color": "$ink", "thickness": 1, "width": 3, **ends}
    return out


def _colour_bar(label: str) -> dict[str, Any]:
    return {"title": {"text": label, "side": "right"}, "thickness": 12, "outlinewidth": 0, "len": 1.0}
