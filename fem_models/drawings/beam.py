"""How far round the tube a notch reaches, for planes that cut it and for a beam that points at the tube axis.

The rig's notches are cut by planes (:func:`fem_models.joint.section.cut_height_mm`): a plane at the distance c from the
tube axis leaves the outer surface at the angle acos(c/R) on either side of the middle of the notch. The walls of a
laser's cut are radial. Of all radial cuts the one of a notch here is that whose root has the same second moment about
its neutral axis, so that it bends as the rig does.
"""

from __future__ import annotations

import math
from typing import Literal

from scipy.optimize import brentq

from fem_models.joint.segments import below_cut_moments, between_cuts_moments
from fem_models.rig.joints import Tube

Beam = Literal["plane", "radial"]
BEAMS: tuple[Beam, ...] = ("plane", "radial")


def half_angle_rad(tube: Tube, cut_mm: float, *, one_sided: bool, beam: Beam = "plane") -> float:
    """Half of the angle that a notch spans at the outer surface, from the distance of its cut face from the axis."""
    outer, inner = tube.outer_diameter_mm / 2, tube.inner_diameter_mm / 2
    if cut_mm >= outer:
        return 0.0
    if beam == "plane":
        return math.acos(cut_mm / outer)
    left = _planes(outer, inner, cut_mm, one_sided)
    return float(brentq(lambda half: _arcs(outer, inner, half, one_sided) - left, 0.0, _most(one_sided), xtol=1e-12))


def cut_height_of_angle_mm(tube: Tube, half_rad: float, *, one_sided: bool, beam: Beam = "plane") -> float:
    """Distance of the cut face from the axis, mm, from half of the angle: the inverse of :func:`half_angle_rad`."""
    outer, inner = tube.outer_diameter_mm / 2, tube.inner_diameter_mm / 2
    if half_rad <= 0:
        return outer
    if beam == "plane":
        return outer * math.cos(half_rad)
    left = _arcs(outer, inner, half_rad, one_sided)
    low = -outer if one_sided else 0.0
    return float(brentq(lambda cut: _planes(outer, inner, cut, one_sided) - left, low, outer, xtol=1e-12))


def _most(one_sided: bool) -> float:
    return math.pi if one_sided else math.pi / 2


def _planes(outer: float, inner: float, cut: float, one_sided: bool) -> float:
    """Second moment that planes leave, about the neutral axis, mm^4."""
    if not one_sided:
        return float(between_cuts_moments(outer, inner, cut)[2])
    area, first, second = (float(one) for one in below_cut_moments(outer, inner, cut)[:3])
    return second - first**2 / area if area > 0 else 0.0


def _arcs(outer: float, inner: float, half_rad: float, one_sided: bool) -> float:
    """Second moment of the arc, or of the two arcs, that radial cuts leave, about the neutral axis, mm^4."""
    rest = _most(one_sided) - half_rad
    fourth = (outer**4 - inner**4) / 4
    if not one_sided:
        return 2 * fourth * (rest - math.sin(rest) * math.cos(rest))
    area, first = rest * (outer**2 - inner**2), 2 / 3 * (outer**3 - inner**3) * math.sin(rest)
    second = fourth * (rest + math.sin(rest) * math.cos(rest))
    return second - first**2 / area if area > 0 else 0.0
