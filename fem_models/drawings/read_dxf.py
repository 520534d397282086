"""Closed outlines of a DXF of a flat pattern, in mm, and what its header says of the tube."""

from __future__ import annotations

import contextlib
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Final

import numpy as np

from fem_models.drawings.dxf import CUT
from fem_models.rig import RigError
from hysteresis.arrays import Floats
from hysteresis.extras import require_extra
from hysteresis.files import RecordError, read_bytes
from hysteresis.messages import as_given, listed

UNITS: dict[str, float] = {"mm": 1.0, "inch": 25.4, "cm": 10.0, "um": 1e-3, "m": 1e3}
_OF_HEADER = {1: "inch", 4: "mm", 5: "cm", 6: "m", 13: "um"}
_SAGITTA_MM: Final = 1e-3
_JOINED_MM: Final = 1e-3
_NUMBERS = {"OUTER_DIAMETER_MM", "INNER_DIAMETER_MM", "KERF_MM", "SEAM_DEG"}
_MOST_BYTES = 50_000_000


@dataclass(frozen=True)
class Sheet:
    """Closed outlines of a drawing, each of shape (m, 2), mm: along and round.

    ``said`` has the numbers that a drawing of notchbend has in its header, by their names; ``beam`` is empty in others.
    ``ends_mm`` are the ends of the sheet along the tube, where it has a layer for its edge.
    """

    outlines: tuple[Floats, ...]
    said: dict[str, float]
    beam: str
    ends_mm: tuple[float, float] | None


def read_sheet(path: Path, *, unit: str | None = None, layer: str | None = None) -> Sheet:
    """Read the closed outlines of a layer.

    Polylines, splines, circles and ellipses are taken as they are, lines and arcs are joined at their ends; blocks are
    opened. By default the layer is CUT, or the only one with closed outlines.

    Raises
    ------
    RigError
        One line: a file that is no DXF, a drawing without a unit, a layer without closed outlines, or several.
    MissingError
        Without the extra ``drawing``.
    """
    require_extra("drawing", "drawings in DXF")
    drawing = _open(path)
    scale = _scale(path, int(drawing.header.get("$INSUNITS", 0)), unit)
    found: dict[str, list[Floats]] = {}
    for name, points, closed in _lines(drawing.modelspace(), _SAGITTA_MM / scale):
        found.setdefault(name, []).append(_Piece.of(points * scale, closed=closed))  # type: ignore[arg-type]
    outlines = {name: loops for name, pieces in found.items() if (loops := _loops(pieces))}  # type: ignore[arg-type]
    chosen = _layer(path, outlines, layer)
    said = dict(drawing.header.custom_vars.properties)
    numbers = dict[str, float]()
    for name in _NUMBERS & set(said):
        with contextlib.suppress(ValueError):
            numbers[name] = float(said[name])
    return Sheet(tuple(outlines[chosen]), numbers, said.get("BEAM", ""), _ends(found.get("SHEET", [])))


def _open(path: Path) -> Any:
    from ezdxf import DXFError, recover

    try:
        read_bytes(path, "a drawing in DXF", most=_MOST_BYTES)
    except RecordError as error:
        raise RigError(str(error)) from None
    try:
        return recover.readfile(path)[0]
    except (DXFError, OSError, ValueError, KeyError, IndexError, TypeError, AttributeError):
        raise RigError(f"{path}: expected a drawing in DXF") from None


def _scale(path: Path, header: int, unit: str | None) -> float:
    """Millimetres in a unit of the drawing; a given unit stands above that of the header."""
    name = unit if unit is not None else _OF_HEADER.get(header)
    if name is None:
        raise RigError(
            f"{path}: $INSUNITS = {header}: expected a unit in the header, or --unit, one of {listed(UNITS)}"
        )
    if name not in UNITS:
        raise RigError(f"unit = {as_given(name)}: expected one of {listed(UNITS)}")
    return UNITS[name]


@dataclass(frozen=True)
class _Piece:
    """A line of a drawing, points of shape (m, 2), mm."""

    points: Floats
    closed: bool

    @classmethod
    def of(cls, points: Floats, *, closed: bool) -> _Piece:
        """Make a piece; one that ends where it begins is closed."""
        ends = float(np.linalg.norm(points[0] - points[-1])) <= _JOINED_MM and len(points) > 3
        return cls(points[:-1] if ends else points, closed or ends)


def _lines(space: Any, sagitta: float) -> Iterator[tuple[str, Floats, bool]]:
    """Give the lines of a drawing with their layers, as points."""
    from ezdxf import disassemble, path

    kinds = {"LWPOLYLINE", "POLYLINE", "LINE", "ARC", "CIRCLE", "ELLIPSE", "SPLINE"}
    for entity in disassemble.recursive_decompose(space):
        if entity.dxftype() not in kinds:
            continue
        try:
            made = path.make_path(entity)
            points = np.array([(p.x, p.y) for p in made.flattening(sagitta)], dtype=float)
        except (ValueError, TypeError, ZeroDivisionError):
            continue
        if len(points) > 1 and np.isfinite(points).all():
            yield entity.dxf.layer.upper(), points, bool(made.is_closed)


def _loops(pieces: list[_Piece]) -> list[Floats]:
    """Give the closed outlines: those that are closed by themselves, and lines that join at their ends."""
    closed = [one.points for one in pieces if one.closed]
    loose = [one.points for one in pieces if not one.closed]
    while loose:
        line = loose.pop()
        grown = True
        while grown and np.linalg.norm(line[0] - line[-1]) > _JOINED_MM:
            grown = False
            for k, other in enumerate(loose):
                for way in (other, other[::-1]):
                    if np.linalg.norm(way[0] - line[-1]) <= _JOINED_MM:
                        line, grown = np.concatenate([line, way[1:]]), True
                        break
                if grown:
                    del loose[k]
                    break
        if len(line) > 3 and np.linalg.norm(line[0] - line[-1]) <= _JOINED_MM:
            closed.append(line[:-1])
    return closed


def _layer(path: Path, outlines: dict[str, list[Floats]], layer: str | None) -> str:
    if layer is not None:
        if layer.upper() not in outlines:
            expected = f"one with closed outlines: {listed(sorted(outlines))}" if outlines else "closed outlines on it"
            raise RigError(f"{path}: layer {as_given(layer)}: expected {expected}")
        return layer.upper()
    if CUT in outlines:
        return CUT
    if len(outlines) == 1:
        return next(iter(outlines))
    found = f"closed outlines on {listed(sorted(outlines))}" if outlines else "no closed outlines"
    raise RigError(f"{path}: {found}: expected a layer {CUT}, or --layer")


def _ends(pieces: list[Any]) -> tuple[float, float] | None:
    """Give the ends of the sheet along the tube, from the lines on its layer."""
    if not pieces:
        return None
    along = np.concatenate([one.points[:, 0] for one in pieces])
    return float(along.min()), float(along.max())
