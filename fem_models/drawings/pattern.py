"""The flat pattern of a notched tube: its outer surface unrolled, with the outline of every notch.

The sheet is seen from outside, as the cutting head sees the tube: x from the base to the tip, y round the tube, in mm
of arc at the outer surface. An angle from the rig's y towards its z runs down the sheet, y = R (seam - angle), modulo
the circumference. x = 0 is the end of the uncut tube before the first notch, which is as long as the ring beyond it.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Final

import numpy as np

from fem_models.drawings.beam import Beam, half_angle_rad
from fem_models.rig import Rig, RigError
from fem_models.rig.checks import require
from fem_models.rig.joints import Cut, Tube
from fem_models.rig.rig import notched_tube
from hysteresis.arrays import Floats

FINE: Final = 513
"""Points of a flank on which it is offset and trimmed; every 16th is drawn."""
_DRAWN = 16


@dataclass(frozen=True)
class NotchOutline:
    """One cut of the beam: the closed outline of a notch on the sheet.

    Parameters
    ----------
    joint
        Number of the notch from the base, 1.
    side
        1, and 2 for the opposite cut of a pair.
    angle_deg
        Angle of its middle round the tube, from y towards z.
    middle_mm
        Its middle on the sheet: along, round.
    points_mm
        Vertices on the sheet, shape (m, 2), anticlockwise; the last is joined to the first.
    crosses_seam
        Whether it reaches beyond the seam; it is drawn whole, past the edge of the sheet.
    """

    joint: int
    side: int
    angle_deg: float
    middle_mm: tuple[float, float]
    points_mm: Floats
    crosses_seam: bool


@dataclass(frozen=True)
class FlatPattern:
    """The unrolled tube. ``kerf_mm`` is the width of the beam: outlines are its path, half a kerf inside the notch.

    ``first_mm`` is the length of uncut tube before the first notch.
    """

    name: str
    tube: Tube
    length_mm: float
    first_mm: float
    kerf_mm: float
    beam: Beam
    seam_deg: float
    tendons_deg: tuple[float, ...]
    outlines: tuple[NotchOutline, ...]

    @property
    def round_mm(self) -> float:
        """Circumference of the outer surface."""
        return math.pi * self.tube.outer_diameter_mm

    def round_of(self, angle_deg: float) -> float:
        """Give the place on the sheet, mm, from 0 to below the circumference, of an angle round the tube."""
        return self.round_mm * (((self.seam_deg - angle_deg) / 360.0) % 1.0)


def flat_pattern(rig: Rig, *, kerf_mm: float = 0.0, beam: Beam = "plane", seam_deg: float | None = None) -> FlatPattern:
    """Unroll the tube of a rig.

    Parameters
    ----------
    kerf_mm
        Width of the cutting beam; 0 draws the notches themselves.
    beam
        ``plane``: outlines as planes leave them on the outer surface, the depth being measured from the outer surface
        at the middle of the notch. ``radial``: as a beam that points at the tube axis has to cut for the same bending
        stiffness (:mod:`fem_models.drawings.beam`).
    seam_deg
        Angle at which the tube is opened; by default where the fewest notches are cut, and farthest from them.

    Raises
    ------
    RigError
        Measured joints, a notch that does not go through the wall, a kerf that does not fit a notch, notches of a pair
        that meet.
    """
    joint, turns = notched_tube(rig), rig.turns_deg
    places = joint.places()
    first = joint.notch.at(0).spacing_mm
    cuts = [joint.notch.at(k) for k in range(joint.joints)]
    shapes: dict[Cut, Floats] = {}
    for k, cut in enumerate(cuts):
        if cut not in shapes:
            shapes[cut] = _outline(joint.tube, cut, _label(joint.notch.alike, k), kerf_mm, beam)
    angles = [(k, side, turns[k] + 180.0 * side) for k in range(joint.joints) for side in range(2 - joint.one_sided)]
    outer = joint.tube.outer_diameter_mm / 2
    spans = [(angle, math.degrees(float(shapes[cuts[k]][:, 1].max()) / outer)) for k, _, angle in angles]
    seam = _seam_deg(spans) if seam_deg is None else seam_deg
    beyond = cuts[-1].spacing_mm
    empty = FlatPattern(
        name=rig.name,
        tube=joint.tube,
        length_mm=places.centres[-1] + first / 2 + beyond / 2,
        first_mm=first,
        kerf_mm=kerf_mm,
        beam=beam,
        seam_deg=seam,
        tendons_deg=rig.angles_deg,
        outlines=(),
    )
    outlines = []
    for k, side, angle in angles:
        middle = (places.middles[k] + first / 2, empty.round_of(angle))
        points = shapes[cuts[k]] + np.array(middle)
        crosses = bool(points[:, 1].min() < 0 or points[:, 1].max() > empty.round_mm)
        outlines.append(NotchOutline(k + 1, side + 1, angle % 360.0, middle, points, crosses))
    return FlatPattern(**{**vars(empty), "outlines": tuple(outlines)})


def _label(alike: bool, number: int) -> str:
    return "" if alike else f" of notch {number + 1}"


def _outline(tube: Tube, cut: Cut, label: str, kerf_mm: float, beam: Beam) -> Floats:
    """Path of the beam round a notch, shape (m, 2): along and round, from its middle."""
    outer, one_sided = tube.outer_diameter_mm / 2, cut.shape == "rectangular"
    wall = outer - tube.inner_diameter_mm / 2
    require(cut.depth_mm > wall, f"notch.depth_mm{label}", cut.depth_mm, f"above the wall of {wall:g} mm, to be a cut")
    if not (math.isfinite(kerf_mm) and 0 <= kerf_mm < cut.width_mm):
        raise RigError(f"kerf_mm = {kerf_mm:g}: expected at least 0, below notch.width_mm{label} = {cut.width_mm:g}")
    half = outer * half_angle_rad(tube, outer - cut.depth_mm, one_sided=one_sided, beam=beam)
    if kerf_mm >= 2 * half:
        raise RigError(f"kerf_mm = {kerf_mm:g}: expected below {2 * half:.4g} mm, the arc of the notch{label}")
    if cut.shape == "v_pair":
        quarter = v_flank(tube, cut, kerf_mm, beam)
    else:
        quarter = np.array([[cut.width_mm / 2, half]]) - kerf_mm / 2
    return _all_around(quarter)


def v_flank(tube: Tube, cut: Cut, kerf_mm: float, beam: Beam) -> Floats:
    """Path along a quarter of a V, shape (m, 2): along and round, from the middle of its edge to its root.

    At the share t of the depth the V is w - t (w - w_root) wide, and reaches as far round as planes of that depth do;
    for a radial beam all arcs are stretched alike, so that the root has its own. The path is the flank moved inwards
    along its normal, up to where it meets the path along the root, or its mirror image.
    """
    outer, root = tube.outer_diameter_mm / 2, cut.root_width_mm or 0.0
    place = np.linspace(0.0, 1.0, FINE)  # the arc grows with the root of a small depth
    share = place**2
    along = cut.width_mm / 2 - share * (cut.width_mm - root) / 2
    cuts = outer - cut.depth_mm * share
    planes = np.arccos(cuts / outer)
    around = outer * planes * half_angle_rad(tube, float(cuts[-1]), one_sided=False, beam=beam) / planes[-1]
    d_along, d_around = np.gradient(along, place, edge_order=2), np.gradient(around, place, edge_order=2)
    length = np.hypot(d_along, d_around)
    path = np.stack([along - 0.5 * kerf_mm * d_around / length, around + 0.5 * kerf_mm * d_along / length], axis=1)
    ends = [_first_above(path[:, 1] - (around[-1] - 0.5 * kerf_mm)), _first_above(-path[:, 0])]
    end = min(ends)
    whole = int(end)
    if end >= FINE - 1:
        return np.concatenate([path[:-1:_DRAWN], path[-1:]])
    last = path[whole] + (end - whole) * (path[whole + 1] - path[whole])
    return np.concatenate([path[: whole + 1 : _DRAWN], last[None]])


def _first_above(values: Floats) -> float:
    """Place, in samples, at which values first rise to 0; the last one if they do not before."""
    above = np.flatnonzero(values >= 0)
    if not above.size or above[0] == 0:
        return float(len(values) - 1)
    k = int(above[0])
    return k - 1 + float(-values[k - 1] / (values[k] - values[k - 1]))


def _all_around(quarter: Floats) -> Floats:
    """Close a quarter of an outline to the whole, anticlockwise, without double points."""
    x, y = quarter[:, 0], quarter[:, 1]
    right = np.stack([np.concatenate([x[::-1], x]), np.concatenate([-y[::-1], y])], axis=1)
    whole = np.concatenate([right, -right])
    far = np.linalg.norm(whole - np.roll(whole, 1, axis=0), axis=1) > 1e-9
    return np.asarray(whole[far])


def _seam_deg(spans: list[tuple[float, float]]) -> float:
    """Angle that the fewest notches reach, and then the farthest from their ends; of equal ones that nearest 180."""
    grid = np.arange(0.0, 360.0, 0.5)
    off = np.stack([np.abs((grid - angle + 180.0) % 360.0 - 180.0) - half for angle, half in set(spans)])
    weights = np.array([spans.count(one) for one in set(spans)])
    crossed, clear = weights @ (off < 0), np.abs(off).min(axis=0)
    order = np.lexsort((np.abs(grid - 180.0), -np.round(clear, 6), crossed))
    return float(grid[order[0]])
