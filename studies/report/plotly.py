"""The parts of plotly.js's JSON that the page uses. A colour such as ``$blue`` is a name of the page's style."""

from __future__ import annotations

import base64
import json
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import ArrayLike

from hysteresis.plain import optional, to_plain


@dataclass(frozen=True)
class Packed:
    """An array: base64 of little-endian numbers; ``shape`` as text for more than one dimension."""

    dtype: str
    bdata: str
    shape: str | None = optional()


@dataclass(frozen=True)
class Title:
    """A title of an axis or a colour bar."""

    text: str
    standoff: int | None = optional()
    side: str | None = optional()


@dataclass(frozen=True)
class Axis:
    """An axis of a plane chart."""

    title: Title
    gridcolor: str = "$line"
    zerolinecolor: str = "$line"
    automargin: bool = True
    autorange: str | None = optional()
    type: str | None = optional()
    ticklabelstandoff: int | None = optional()
    range: tuple[float, float] | None = optional()
    scaleanchor: str | None = optional()


@dataclass(frozen=True)
class Shape:
    """A band, or a line, across a plane chart; of the references one is the axis, the other the whole chart."""

    type: str
    xref: str
    yref: str
    x0: float
    x1: float
    y0: float
    y1: float
    line: Stroke
    fillcolor: str = "$line"
    opacity: float = 1.0
    layer: str = "below"


@dataclass(frozen=True)
class Layout:
    """Axes and legend of a plane chart."""

    xaxis: Axis
    yaxis: Axis
    showlegend: bool
    hovermode: str = "closest"
    barmode: str | None = optional()
    bargap: float | None = optional()
    shapes: tuple[Shape, ...] | None = optional()


@dataclass(frozen=True)
class ColorBar:
    """The colour scale of a chart."""

    title: Title
    thickness: int = 12
    outlinewidth: int = 0
    len: float = 1.0


@dataclass(frozen=True)
class Marker:
    """Points: one colour, or numbers with a scale."""

    color: str | Packed | Sequence[float] | Sequence[str]
    size: float | None = optional()
    symbol: str | None = optional()
    line: Stroke | None = optional()
    cmin: float | None = optional()
    cmax: float | None = optional()
    colorscale: str | Sequence[tuple[float, str]] | None = optional()
    showscale: bool | None = optional()
    colorbar: ColorBar | None = optional()


@dataclass(frozen=True)
class Stroke:
    """A line: width in pixels, colour and dashes."""

    width: float
    color: str
    dash: str | None = optional()


@dataclass(frozen=True)
class Scatter:
    """Lines or points in a plane; ``text`` is shown for the point under the cursor."""

    x: Packed
    y: Packed
    mode: str
    name: str | None = optional()
    marker: Marker | None = optional()
    line: Stroke | None = optional()
    text: tuple[str, ...] | None = optional()
    hovertemplate: str | None = optional()
    error_y: Spread | None = optional()
    type: str = "scatter"


@dataclass(frozen=True)
class Spread:
    """Lengths above and below points, the same on both sides."""

    array: Packed
    color: str
    type: str = "data"
    thickness: int = 1
    width: int = 0


@dataclass(frozen=True)
class HeatMap:
    """A field over two axes."""

    x: Packed
    y: Packed
    z: Packed
    colorbar: ColorBar
    zmin: float | None = optional()
    zmax: float | None = optional()
    colorscale: str = "Cividis"
    type: str = "heatmap"


@dataclass(frozen=True)
class Whiskers:
    """Intervals at the ends of bars: lengths above and below the value."""

    array: Packed
    arrayminus: Packed
    type: str = "data"
    symmetric: bool = False
    color: str = "$ink"
    thickness: int = 1
    width: int = 3


@dataclass(frozen=True)
class BarTrace:
    """Horizontal bars, one for each category."""

    y: tuple[str, ...]
    x: Packed
    name: str
    marker: Marker
    error_x: Whiskers | None = optional()
    orientation: str = "h"
    type: str = "bar"


@dataclass(frozen=True)
class Surface:
    """A field as a surface in three dimensions."""

    x: Packed
    y: Packed
    z: Packed
    name: str
    visible: bool
    hovertemplate: str
    colorscale: str = "Cividis"
    showscale: bool = False
    type: str = "surface"


@dataclass(frozen=True)
class Lighting:
    """Light on a mesh; by default there is none but the ambient light."""

    ambient: float = 1.0
    diffuse: float = 0.0
    specular: float = 0.0
    fresnel: float = 0.0


@dataclass(frozen=True)
class Mesh:
    """Triangles in three dimensions with a colour at each point: points x, y, z and their indices i, j, k."""

    x: Packed
    y: Packed
    z: Packed
    i: Packed
    j: Packed
    k: Packed
    name: str
    vertexcolor: tuple[str, ...]
    customdata: Packed
    hovertemplate: str
    lighting: Lighting = Lighting()
    type: str = "mesh3d"


@dataclass(frozen=True)
class Scatter3d:
    """Lines or points in three dimensions."""

    x: Packed | Sequence[float]
    y: Packed | Sequence[float]
    z: Packed | Sequence[float]
    mode: str
    hoverinfo: str
    name: str | None = optional()
    line: Stroke | None = optional()
    marker: Marker | None = optional()
    type: str = "scatter3d"


@dataclass(frozen=True)
class Point:
    """A point or a direction."""

    x: float
    y: float
    z: float


@dataclass(frozen=True)
class Projection:
    """Perspective, or orthographic."""

    type: str


@dataclass(frozen=True)
class Camera:
    """Where a scene is looked at from."""

    eye: Point
    up: Point | None = optional()
    center: Point | None = optional()
    projection: Projection | None = optional()


@dataclass(frozen=True)
class SceneAxis:
    """An axis of a scene, or none if ``visible`` is False."""

    visible: bool | None = optional()
    title: Title | None = optional()
    gridcolor: str | None = optional()
    backgroundcolor: str | None = optional()
    zerolinecolor: str | None = optional()


@dataclass(frozen=True)
class Scene:
    """Axes and camera in three dimensions."""

    xaxis: SceneAxis
    yaxis: SceneAxis
    zaxis: SceneAxis
    camera: Camera
    aspectmode: str | None = optional()
    dragmode: str | None = optional()


@dataclass(frozen=True)
class SceneLayout:
    """Layout of a chart in three dimensions."""

    scene: Scene
    showlegend: bool | None = optional()


@dataclass(frozen=True)
class Figure:
    """A chart as the page's script draws it; ``views`` are cameras that a reader can choose, by name."""

    data: tuple[object, ...]
    layout: Layout | SceneLayout
    views: Mapping[str, Camera] | None = optional()


def packed(values: ArrayLike, dtype: str = "f4") -> Packed:
    """Pack an array of any shape."""
    array = np.ascontiguousarray(values, dtype="<" + dtype)
    flat = Packed(dtype, base64.b64encode(array.tobytes()).decode())
    return replace(flat, shape=",".join(map(str, array.shape))) if array.ndim > 1 else flat


def as_json(figure: Figure) -> str:
    """Give JSON that is safe inside a script element of a page."""
    text = json.dumps(to_plain(figure), allow_nan=False, separators=(",", ":"))
    return text.replace("<", "\\u003c")  # no </script> inside
