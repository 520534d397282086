"""The tube for the page: a coarse mesh that is stored with a run, and its view to turn."""

from __future__ import annotations

import json
from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from fem_models.rig.rig import Rig
from fem_models.view.manipulator import tendon_lines, tube_mesh
from hysteresis.arrays import Floats, Ints
from hysteresis.files import write_files
from studies.report.live import as_json, packed

if TYPE_CHECKING:
    import pyvista as pv


DETAIL = 0.35
"""Detail of :func:`fem_models.view.manipulator.tube_mesh`: 26,000 triangles for the default rig, which a browser
rotates without effort."""
HEAT = ("#b9c0c9", "#f2c14e", "#e4572e", "#8c1c13")
"""From unstrained to most strained, as in :mod:`fem_models.view.manipulator`."""
LIGHT = np.array([-0.35, 0.75, 0.75])
VIEWS = {
    "Oblique": {"eye": {"x": -0.3, "y": 0.35, "z": 0.9}, "up": {"x": 0, "y": 1, "z": 0}},
    "Side": {"eye": {"x": 0, "y": 0, "z": 1.0}, "up": {"x": 0, "y": 1, "z": 0}},
    "From the tip": {"eye": {"x": 0.85, "y": 0.45, "z": 0.25}, "up": {"x": 0, "y": 1, "z": 0}},
}


def surface_to_turn(rig: Rig, joint_angles_deg: ArrayLike) -> pv.PolyData:
    """Triangles of the bent tube; points at sharp edges are doubled, so that either side has its own normal.

    Raises
    ------
    SceneError, RigError
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
    SceneError, RigError
        As :func:`fem_models.view.manipulator.tube_mesh`.
    """
    surface = surface_to_turn(rig, joint_angles_deg)
    stored = {
        "schema": 1,
        "points_mm": np.round(surface.points.astype(float), 4).tolist(),
        "triangles": surface.faces.reshape(-1, 4)[:, 1:].tolist(),
        "strain_percent": np.round(np.asarray(surface["strain_percent"], dtype=float), 4).tolist(),
        "tendons_mm": {name: line.tolist() for name, line in tendon_lines(rig, joint_angles_deg).items()},
    }
    write_files({path: json.dumps(stored, separators=(",", ":")) + "\n"})


def tube_view(stored: Mapping[str, Any]) -> str:
    """Give the JSON of a three-dimensional view of a stored tube.

    Raises
    ------
    KeyError, ValueError, TypeError
        Something else than what :func:`write_tube` wrote.
    """
    points = np.asarray(stored["points_mm"], dtype=float)
    triangles = np.asarray(stored["triangles"], dtype=np.int64)
    strain = np.asarray(stored["strain_percent"], dtype=float)
    top = float(strain.max()) or 1.0
    wall: dict[str, Any] = {
        "type": "mesh3d",
        "name": "tube",
        **{name: packed(values) for name, values in zip("xyz", points.T, strict=True)},
        **{name: packed(values, "i4") for name, values in zip("ijk", triangles.T, strict=True)},
        # plotly.js lights meshes by halves only, depending on the projection: the light is in the colours instead
        "vertexcolor": [f"#{r:02x}{g:02x}{b:02x}" for r, g, b in shaded(points, triangles, strain, top)],
        "lighting": {"ambient": 1.0, "diffuse": 0.0, "specular": 0.0, "fresnel": 0.0},
        "customdata": packed(strain),
        "hovertemplate": "strain %{customdata:.2f} %<extra></extra>",
    }
    scale: dict[str, Any] = {
        "type": "scatter3d",
        "mode": "markers",
        "hoverinfo": "skip",
        **{axis: [float(value)] for axis, value in zip("xyz", points[0], strict=True)},
        "marker": {
            "size": 0.01,  # it is here for its colour bar
            "color": [0.0],
            "cmin": 0.0,
            "cmax": top,
            "colorscale": [[i / (len(HEAT) - 1), colour] for i, colour in enumerate(HEAT)],
            "showscale": True,
            "colorbar": {
                "title": {"text": "bending strain, %", "side": "right"},
                "thickness": 12,
                "len": 0.7,
                "outlinewidth": 0,
            },
        },
    }
    ropes = [
        {
            "type": "scatter3d",
            "mode": "lines",
            "name": f"tendon {name}",
            **{axis: packed(values) for axis, values in zip("xyz", np.asarray(line, dtype=float).T, strict=True)},
            "line": {"width": 5, "color": f"${tone}"},
            "hoverinfo": "name",
        }
        for (name, line), tone in zip(sorted(stored["tendons_mm"].items()), ("blue", "green"), strict=False)
    ]
    scene = {
        **{axis: {"visible": False} for axis in ("xaxis", "yaxis", "zaxis")},
        "aspectmode": "data",
        "camera": {**VIEWS["Oblique"], "projection": {"type": "orthographic"}},
        "dragmode": "orbit",
    }
    return as_json([wall, scale, *ropes], {"scene": scene, "showlegend": False}, views=VIEWS)


def shaded(points: Floats, triangles: Ints, strain: Floats, top: float) -> NDArray[np.uint8]:
    """Colour of every point, shape (n, 3): that of its strain, darker where the wall turns away from a still light.

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


def read_tube(path: Path) -> str:
    """Read a stored tube and give its view.

    Raises
    ------
    OSError, ValueError
        No such file, or not a tube.
    """
    try:
        return tube_view(json.loads(path.read_text(encoding="utf-8")))
    except (KeyError, TypeError) as error:
        raise ValueError(f"not a tube: {error}") from None
