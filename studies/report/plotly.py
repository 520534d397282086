"""What plotly's own objects lack to stand as JSON in a page.

A colour such as ``var(--blue)`` is a name of the page's style, so that charts follow its theme.
"""

from __future__ import annotations

import base64
import json
from collections.abc import Iterable, Mapping

import numpy as np
from numpy.typing import ArrayLike
from plotly.basedatatypes import BasePlotlyType

from hysteresis.plain import to_plain

FIELD_SCALE = "Cividis"
"""Colours of fields. The page's plotly.js knows the scale by its name; plotly's objects would put other stops there."""


def packed(values: ArrayLike, dtype: str = "f4") -> dict[str, str]:
    """Pack an array of any shape: base64 of little-endian numbers, and the shape for more than one dimension."""
    array = np.ascontiguousarray(values, dtype="<" + dtype)
    flat = {"dtype": dtype, "bdata": base64.b64encode(array.tobytes()).decode()}
    return {**flat, "shape": ",".join(map(str, array.shape))} if array.ndim > 1 else flat


def tone(name: str) -> str:
    """Give a colour of the page's style."""
    return f"var(--{name})"


def colour_bar(kind: type[BasePlotlyType], label: str, length: float = 1.0) -> BasePlotlyType:
    """Give a colour scale with its label beside it; ``length`` is a share of the height of the chart."""
    return kind(title={"text": label, "side": "right"}, thickness=12, outlinewidth=0, len=length)


def as_json(traces: Iterable[BasePlotlyType], layout: BasePlotlyType, views: Mapping[str, object] | None = None) -> str:
    """Give JSON that is safe inside a script element of a page; ``views`` are cameras that a reader can choose."""
    data = [trace.to_plotly_json() for trace in traces]
    for trace in data:
        part = trace.get("marker", trace)
        if "colorbar" in part or "showscale" in part:
            part.setdefault("colorscale", FIELD_SCALE)
    spec = {"data": data, "layout": layout.to_plotly_json(), **({} if views is None else {"views": views})}
    text = json.dumps(to_plain(spec), allow_nan=False, separators=(",", ":"))
    return text.replace("<", "\\u003c")  # no </script> inside
