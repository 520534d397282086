"""The bent tube and its tendons as one coloured surface, as vtk.js draws it in the browser."""

from __future__ import annotations

import base64
from collections.abc import Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from hysteresis.arrays import Floats, Ints
from studies.report.tube import shaded

if TYPE_CHECKING:
    import pyvista as pv

TOP_STRAIN_PERCENT = 6.0
"""End of the colour scale: the strain of the test for superelasticity (ASTM F2516)."""
OBLIQUE = np.array([[0.93, 0.0, 0.37], [-0.13, 0.94, 0.32], [-0.35, -0.35, 0.87]])
"""Rotation to an oblique view, as in the pictures of :mod:`fem_models.view.manipulator`: about x, then about y."""
TENDON_COLOURS = {"a": (47, 111, 184), "b": (58, 145, 92), "c": (200, 100, 30), "d": (134, 96, 176)}
"""Red, green and blue of the tendons; they stand out from a light and a dark background, and from the wall."""
TENDON_RADIUS = 0.028
"""Radius of a drawn tendon, in lengths of the tube's diameter."""


@dataclass(frozen=True)
class PackedArray:
    """An array as vtk.js reads it: base64 of its bytes."""

    bvals: str
    dtype: str
    shape: tuple[int, ...]


@dataclass(frozen=True)
class MeshPoints:
    """Points of a surface, mm, and its triangles."""

    points: PackedArray
    polys: PackedArray


@dataclass(frozen=True)
class MeshColour:
    """Red, green and blue of every point."""

    values: PackedArray
    name: str = "colour"
    numberOfComponents: int = 3
    type: str = "Uint8Array"
    location: str = "PointData"
    dataRange: tuple[int, int] = (0, 255)


@dataclass(frozen=True)
class MeshState:
    """A coloured surface as vtk.js reads it."""

    mesh: MeshPoints
    field: MeshColour


def mesh_of(tube: pv.PolyData, tendons_mm: Mapping[str, Floats], outer_mm: float) -> MeshState:
    """Give the surface of a tube with the colour of its strain, and its tendons, lines of shape (k, 3), as tubes."""
    return mesh_of_parts(*_triangles(tube), np.asarray(tube["strain_percent"]), tendons_mm, outer_mm)


def mesh_of_parts(
    points_mm: Floats, triangles: Ints, strain_percent: Floats, tendons_mm: Mapping[str, Floats], outer_mm: float
) -> MeshState:
    """Give the same of a surface with points of shape (n, 3), triangles, (m, 3), and strains, (n,)."""
    import pyvista as pv

    colours = [shaded(points_mm, triangles, strain_percent, TOP_STRAIN_PERCENT)]
    parts = [(points_mm, triangles)]
    for name, line in tendons_mm.items():
        drawn = pv.lines_from_points(line).tube(radius=TENDON_RADIUS * outer_mm, n_sides=8).triangulate()
        parts.append(_triangles(drawn))
        colours.append(np.tile(np.array(TENDON_COLOURS[name], dtype=np.uint8), (drawn.n_points, 1)))
    before = np.cumsum([0, *(len(points) for points, _ in parts)])
    cells_of = np.concatenate([part[1] + start for part, start in zip(parts, before[:-1], strict=True)])
    points = np.concatenate([part[0] for part in parts])
    cells = np.column_stack([np.full(len(cells_of), 3), cells_of])
    return MeshState(
        MeshPoints(
            points=_packed((points @ OBLIQUE.T).astype(np.float32)), polys=_packed(cells.ravel().astype(np.uint32))
        ),
        MeshColour(_packed(np.concatenate(colours))),
    )


def _triangles(surface: pv.PolyData) -> tuple[Floats, NDArray[Any]]:
    return surface.points.astype(float), surface.faces.reshape(-1, 4)[:, 1:]


def _packed(values: NDArray[Any]) -> PackedArray:
    array = np.ascontiguousarray(values)
    return PackedArray(base64.b64encode(array.tobytes()).decode(), str(array.dtype), array.shape)
