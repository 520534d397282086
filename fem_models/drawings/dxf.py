"""A flat pattern as DXF: layers, units in the header, dimensions, and what the drawing alone does not say.

Layers: CUT has the path of the beam, NOTCH the edges of the notches where a kerf moves the path, SHEET the edge of the
unrolled tube, SEAM its two long sides, which are one line on the tube, AXIS the middles of notches, TENDON the tendons,
DIM dimensions, NOTES words.
"""

from __future__ import annotations

import io
from typing import Any, Final

from fem_models.drawings.pattern import FlatPattern, flat_pattern
from fem_models.rig import Rig
from fem_models.rig.joints import Notch
from fem_models.rig.rig import notched_tube
from hysteresis.extras import require_extra
from hysteresis.own import MAKER

MILLIMETRES: Final = 4
"""Value of $INSUNITS."""
CUT, NOTCH, SHEET, SEAM, AXIS, TENDON, DIM, NOTES = (
    "CUT", "NOTCH", "SHEET", "SEAM", "AXIS", "TENDON", "DIM", "NOTES",
)  # fmt: skip
_COLOURS = {CUT: 1, NOTCH: 8, SHEET: 7, SEAM: 4, AXIS: 8, TENDON: 3, DIM: 5, NOTES: 7}
_DASHED = {SEAM: "DASHED", AXIS: "CENTER", TENDON: "DASHED"}
COMMENT: Final = f"999\nmade by {MAKER}\n"
"""Head of the file: a comment, as the format allows them."""


def pattern_dxf(rig: Rig, pattern: FlatPattern) -> str:
    """Write a flat pattern of a rig as DXF (R2010), in mm.

    The numbers that importing needs are custom properties of the header: diameters, kerf, beam and the angle of the
    seam.

    Raises
    ------
    MissingError
        Without the extra ``drawing``.
    """
    require_extra("drawing", "drawings in DXF")
    import ezdxf
    from ezdxf import options

    before = options.write_fixed_meta_data_for_testing
    options.write_fixed_meta_data_for_testing = True  # no times: the same rig gives the same file
    try:
        drawing = ezdxf.new("R2010", setup=True, units=MILLIMETRES)
        for name, value in _properties(pattern).items():
            drawing.header.custom_vars.append(name, value)
        for name, colour in _COLOURS.items():
            drawing.layers.add(name, color=colour, linetype=_DASHED.get(name, "Continuous"))
        _draw(drawing.modelspace(), rig, pattern)
        text = io.StringIO()
        drawing.write(text)
    finally:
        options.write_fixed_meta_data_for_testing = before
    return COMMENT + text.getvalue()


def _properties(pattern: FlatPattern) -> dict[str, str]:
    """Give the custom properties of the drawing."""
    return {
        "NOTCHBEND_PATTERN": "1",
        "OUTER_DIAMETER_MM": repr(pattern.tube.outer_diameter_mm),
        "INNER_DIAMETER_MM": repr(pattern.tube.inner_diameter_mm),
        "KERF_MM": repr(float(pattern.kerf_mm)),
        "BEAM": pattern.beam,
        "SEAM_DEG": repr(float(pattern.seam_deg)),
    }


def _draw(space: Any, rig: Rig, pattern: FlatPattern) -> None:
    long, wide = pattern.length_mm, pattern.round_mm
    height = min(wide, long) / 28
    for one in pattern.outlines:
        space.add_lwpolyline(one.points_mm.tolist(), close=True, dxfattribs={"layer": CUT})
    drawn = pattern
    if pattern.kerf_mm > 0:
        drawn = flat_pattern(rig, beam=pattern.beam, seam_deg=pattern.seam_deg)
        for one in drawn.outlines:
            space.add_lwpolyline(one.points_mm.tolist(), close=True, dxfattribs={"layer": NOTCH})
    for end in (0.0, long):
        space.add_line((end, 0.0), (end, wide), dxfattribs={"layer": SHEET})
    for side in (0.0, wide):
        space.add_line((0.0, side), (long, side), dxfattribs={"layer": SEAM})
    for place in sorted({round(one.middle_mm[1], 9) for one in pattern.outlines}):
        space.add_line((-height, place), (long + height, place), dxfattribs={"layer": AXIS})
    for number, angle in enumerate(pattern.tendons_deg):
        place = pattern.round_of(angle)
        space.add_line((0.0, place), (long, place), dxfattribs={"layer": TENDON})
        words = f"tendon {'abcd'[number]}, {angle:g} deg"
        _words(space, words, (long + 1.5 * height, place - height / 2), height)
    _dimensions(space, notched_tube(rig).notch, drawn, height)
    for row, words in enumerate(_notes(pattern)):
        _words(space, words, (0.0, wide + (9.5 + 1.7 * (len(_notes(pattern)) - row)) * height), height)


def _words(space: Any, words: str, place: tuple[float, float], height: float) -> None:
    space.add_text(words, height=height, dxfattribs={"layer": NOTES, "insert": place})


def _dimensions(space: Any, notch: Notch, pattern: FlatPattern, height: float) -> None:
    """Dimensions of the sheet, of the first notch and of the ring beyond it."""
    long, wide = pattern.length_mm, pattern.round_mm
    first = pattern.outlines[0].points_mm
    (left, low), (right, high) = first.min(axis=0), first.max(axis=0)
    middle = pattern.outlines[0].middle_mm[1]
    ring = right + notch.at(0).spacing_mm
    style = {
        "dimtxt": height, "dimasz": 0.8 * height, "dimexe": 0.5 * height, "dimexo": 0.3 * height,
        "dimgap": 0.3 * height,
        "dimdec": 3, "dimzin": 8, "dimtad": 1, "dimlfac": 1.0,
    }  # fmt: skip

    def along(start: tuple[float, float], end: tuple[float, float], row: float) -> None:
        dimension = space.add_linear_dim(
            base=(0, row), p1=start, p2=end, dimstyle="EZDXF", override=style, dxfattribs={"layer": DIM}
        )
        dimension.render()

    def around(start: tuple[float, float], end: tuple[float, float], row: float) -> None:
        dimension = space.add_linear_dim(
            base=(row, 0), p1=start, p2=end, angle=90, dimstyle="EZDXF", override=style, dxfattribs={"layer": DIM}
        )
        dimension.render()

    below = min(0.0, low)
    along((0.0, 0.0), (long, 0.0), below - 9 * height)
    along((0.0, middle), (left, middle), below - 3 * height)
    along((left, middle), (right, middle), below - 6 * height)
    along((right, middle), (ring, middle), below - 3 * height)
    around((0.0, 0.0), (0.0, wide), -9 * height)
    around((right, low), (right, high), -5 * height)
    root = notch.at(0).root_width_mm
    if root:
        ends = (left + right - root) / 2, (left + right + root) / 2
        along((ends[0], high), (ends[1], high), wide + 4 * height)


def _notes(pattern: FlatPattern) -> list[str]:
    tube = pattern.tube
    joints = max(one.joint for one in pattern.outlines)
    path = f"CUT is the path of a beam of {pattern.kerf_mm:g} mm, half of it inside the notch"
    beams = {
        "plane": "edges as planes cut them, on the outer surface",
        "radial": "arcs of a beam that points at the axis, for the same bending stiffness as planes",
    }
    rows = [
        f"{pattern.name}: flat pattern of the outer surface, seen from outside; mm",
        f"tube {tube.outer_diameter_mm:g} x {tube.inner_diameter_mm:g} mm; {joints} notches, "
        f"{len(pattern.outlines)} cuts",
        f"x from the base to the tip; seam at {pattern.seam_deg:g} deg; angles run down the sheet",
        beams[pattern.beam],
        path if pattern.kerf_mm else "CUT is the edge of the notch: no kerf",
    ]
    crossing = sum(one.crosses_seam for one in pattern.outlines)
    return rows + ([f"{crossing} cuts cross the seam; they are drawn whole, past the sheet"] if crossing else [])
