"""The tube for the page: a coarse mesh that is stored with a run, and its view in three dimensions."""

from __future__ import annotations

import json
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
import plotly.graph_objects as go
from numpy.typing import ArrayLike, NDArray

from fem_models.rig import Rig
from fem_models.rig.checks import MOST_MM
from fem_models.view.manipulator import tendon_lines, tube_mesh
from fem_models.view.wrist import wrist_surface
from hysteresis.arrays import Floats, Ints
from hysteresis.files import RecordError, write_files
from hysteresis.own import marked_values
from hysteresis.plain import to_plain
from studies.report.plotly import as_json, colour_bar, packed, tone
from studies.results import read_result

if TYPE_CHECKING:
    import pyvista as pv


DETAIL = 0.35
"""Detail of :func:`fem_models.view.manipulator.tube_mesh`: 26,000 triangles for the default rig, which a browser
rotates without effort."""
HEAT = ("#b9c0c9", "#f2c14e", "#e4572e", "#8c1c13")
"""Colours from no strain to the largest strain, as in :mod:`fem_models.view.manipulator`."""
LIGHT = np.array([-0.35, 0.75, 0.75])
TENDON_TONES = ("blue", "green", "orange", "purple")
UP = {"x": 0, "y": 1, "z": 0}
VIEWS = {
    "Oblique": {"eye": {"x": -0.3, "y": 0.35, "z": 0.9}, "up": UP},
    "Side": {"eye": {"x": 0, "y": 0, "z": 1.0}, "up": UP},
    "From the tip": {"eye": {"x": 0.85, "y": 0.45, "z": 0.25}, "up": UP},
}


@dataclass(frozen=True, eq=False)
class StoredTube:
    """The surface of the bent tube and its tendons.

    ``points_mm``, shape (n, 3), ``triangles``, shape (m, 3), ``strain_percent``, shape (n,); a line of shape (k, 3) for
    each tendon.
    """

    schema: int
    points_mm: Floats
    triangles: Ints
    strain_percent: Floats
    tendons_mm: Mapping[str, Floats]


def coarse_surface(rig: Rig, joint_angles_deg: ArrayLike) -> pv.PolyData:
    """Mesh the bent tube with triangles; points at sharp edges are doubled, so that each side has its own normal.

    Raises
    ------
    SceneError, RigError, MissingError
        As :func:`fem_models.view.manipulator.tube_mesh`.
    """
    surface = tube_mesh(rig, joint_angles_deg, detail=DETAIL).triangulate()
    return surface.compute_normals(
        cell_normals=False, split_vertices=True, feature_angle=30.0, consistent_normals=False
    )


def write_tube(rig: Rig, joint_angles_deg: ArrayLike, path: Path) -> None:
    """Write the surface of the bent tube and its tendons as JSON: mm, and strain in percent.

    Raises
    ------
    SceneError, RigError, MissingError
        As :func:`fem_models.view.manipulator.tube_mesh`.
    """
    surface = coarse_surface(rig, joint_angles_deg)
    stored = StoredTube(
        schema=1,
        points_mm=np.round(surface.points.astype(float), 4),
        triangles=surface.faces.reshape(-1, 4)[:, 1:],
        strain_percent=np.round(np.asarray(surface["strain_percent"], dtype=float), 4),
        tendons_mm=tendon_lines(rig, joint_angles_deg),
    )
    write_stored(stored, path)


def wrist_tube(rig: Rig, joint_angles_deg: ArrayLike) -> StoredTube:
    """Give the surface of a bent wrist in space and its tendons, coloured by the strain of the weak bending.

    Raises
    ------
    SceneError
        As :func:`fem_models.view.wrist.wrist_surface`.
    """
    found = wrist_surface(rig, joint_angles_deg)
    used, numbers = np.unique(found.quads, return_inverse=True)
    corners = numbers.reshape(-1, 4)
    return StoredTube(
        schema=1,
        points_mm=np.round(found.points[used], 4),
        triangles=np.concatenate([corners[:, [0, 2, 1]], corners[:, [0, 3, 2]]]),  # outwards
        strain_percent=np.round(found.strain_percent[used], 4),
        tendons_mm=dict(zip("abcd", found.lines, strict=False)),
    )


def write_stored(stored: StoredTube, path: Path) -> None:
    """Write a surface as JSON: mm, and strain in percent."""
    write_files({path: json.dumps(marked_values(to_plain(stored)), separators=(",", ":")) + "\n"})


def read_tube(path: Path) -> str:
    """Read a stored tube and give its view.

    Raises
    ------
    RecordError
        No such file, or not a tube.
    """
    stored = read_result(StoredTube, path, "the tube of `notchbend run`")
    shapes = {"points_mm": stored.points_mm, "triangles": stored.triangles, **stored.tendons_mm}
    for name, rows in shapes.items():
        if rows.ndim != 2 or rows.shape[1] != 3:
            raise RecordError(f"{path}: {name}: shape {rows.shape}: expected rows of three numbers")
    count = len(stored.points_mm)
    if not count or not np.isfinite(stored.points_mm).all() or np.abs(stored.points_mm).max() > MOST_MM:
        raise RecordError(f"{path}: points_mm: expected finite points within {MOST_MM:g} mm")
    if stored.triangles.size and not 0 <= stored.triangles.min() <= stored.triangles.max() < count:
        raise RecordError(f"{path}: triangles: expected numbers of its {count} points")
    if stored.strain_percent.shape != stored.points_mm.shape[:1]:
        raise RecordError(f"{path}: strain_percent: shape {stored.strain_percent.shape}: expected one for each point")
    if not np.isfinite(stored.strain_percent).all() or not (stored.strain_percent >= 0).all():
        raise RecordError(f"{path}: strain_percent: expected finite numbers of at least 0")
    return tube_view(stored)


def tube_view(stored: StoredTube) -> str:
    """Give the JSON of a three-dimensional view of a stored tube."""
    top = float(stored.strain_percent.max()) or 1.0
    lines = zip(sorted(stored.tendons_mm.items()), TENDON_TONES, strict=False)
    tendons = (_tendon(name, line, tone) for (name, line), tone in lines)
    hidden = {"visible": False}
    camera = {**VIEWS["Oblique"], "projection": {"type": "orthographic"}}
    axes = {"xaxis": hidden, "yaxis": hidden, "zaxis": hidden}
    scene = go.layout.Scene(camera=camera, aspectmode="data", dragmode="orbit", **axes)
    traces = (_wall(stored, top), _strain_scale(stored.points_mm[0], top), *tendons)
    return as_json(traces, go.Layout(scene=scene, showlegend=False), VIEWS)


def _tendon(name: str, line_mm: Floats, colour: str) -> go.Scatter3d:
    x, y, z = (packed(values) for values in line_mm.T)
    line = {"width": 5, "color": tone(colour)}
    return go.Scatter3d(x=x, y=y, z=z, mode="lines", hoverinfo="name", name=f"tendon {name}", line=line)


def _wall(stored: StoredTube, top: float) -> go.Mesh3d:
    """Give the tube, coloured by strain up to ``top``."""
    x, y, z = (packed(values) for values in stored.points_mm.T)
    i, j, k = (packed(values, "i4") for values in stored.triangles.T)
    colours = shaded(stored.points_mm, stored.triangles, stored.strain_percent, top)
    return go.Mesh3d(
        x=x,
        y=y,
        z=z,
        i=i,
        j=j,
        k=k,
        name="tube",
        # the light of plotly.js depends on the projection: here it is in the colours instead
        vertexcolor=tuple(f"#{r:02x}{g:02x}{b:02x}" for r, g, b in colours),
        customdata=packed(stored.strain_percent),
        hovertemplate="strain %{customdata:.2f} %<extra></extra>",
        lighting={"ambient": 1.0, "diffuse": 0.0, "specular": 0.0, "fresnel": 0.0},
    )


def _strain_scale(at_mm: Floats, top: float) -> go.Scatter3d:
    """Give an invisible point that carries the colour bar."""
    x, y, z = ([float(value)] for value in at_mm)
    marker = go.scatter3d.Marker(
        color=[0.0],
        size=0.01,
        cmin=0.0,
        cmax=top,
        colorscale=[(i / (len(HEAT) - 1), colour) for i, colour in enumerate(HEAT)],
        showscale=True,
        colorbar=colour_bar(go.scatter3d.marker.ColorBar, "bending strain, %", 0.7),
    )
    return go.Scatter3d(x=x, y=y, z=z, mode="markers", hoverinfo="skip", marker=marker)


def shaded(points: Floats, triangles: Ints, strain: Floats, top: float) -> NDArray[np.uint8]:
    """Colour every point by its strain, darker if the wall faces away from a fixed light; shape (n, 3).

    Parameters
    ----------
    points, triangles, strain
        Shapes (n, 3), (m, 3) and (n,).
    top
        Strain at the end of the scale.
    """
    a, b, c = (points[triangles[:, i]] for i in range(3))
    across = np.cross(b - a, c - a)
    normal = np.zeros_like(points)
    for i in range(3):
        np.add.at(normal, triangles[:, i], across)
    normal /= np.maximum(np.linalg.norm(normal, axis=1, keepdims=True), 1e-12)
    lit = 0.5 + 0.5 * normal @ (LIGHT / np.linalg.norm(LIGHT))  # half Lambert: no side is black
    stops = np.array([[int(colour[i : i + 2], 16) for i in (1, 3, 5)] for colour in HEAT], dtype=float)
    at = np.clip(strain / top, 0.0, 1.0) * (len(HEAT) - 1)
    colour = np.column_stack([np.interp(at, np.arange(len(HEAT)), channel) for channel in stops.T])
    return np.clip(colour * (0.5 + 0.62 * lit**1.5)[:, None], 0, 255).round().astype(np.uint8)
