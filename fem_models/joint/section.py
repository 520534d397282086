"""Cross-section of a flexure: the part of the tube that a notch leaves.

Axes of one notch: z along the tube with z = 0 in the middle of the notch, x in the bending plane, the tendons at
+-x. Both cut faces are normal to x. The equations stand in ``docs/theory/analytic-model.md``.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from fem_models.rig import RigError
from fem_models.rig.joints import NotchedTube
from hysteresis.arrays import Floats

_ARC_NODES, _ARC_WEIGHTS = np.polynomial.legendre.leggauss(12)


@dataclass(frozen=True)
class Section:
    """Cross-section of a flexure; each field has the shape of the z at which it was evaluated.

    ``second_moment_mm4`` is about the neutral axis, which lies ``neutral_offset_mm`` from the tube axis, away from a
    one-sided notch (0 for pairs). ``shear_coefficient`` is Timoshenko's kappa for shear in the bending plane.
    """

    area_mm2: Floats
    second_moment_mm4: Floats
    shear_coefficient: Floats
    neutral_offset_mm: Floats


def cut_height_mm(joint: NotchedTube, z_mm: ArrayLike) -> Floats:
    """Distance of the cut face from the tube axis at z, the shape of ``z_mm``.

    A V has its flat root over ``root_width_mm`` and rises linearly to the outer surface at ``width_mm``; a slot is
    constant. A pair of notches leaves |x| <= c, a one-sided notch x <= c (c is negative for a cut beyond the axis).
    """
    tube, notch = joint.tube, joint.notch
    z = np.abs(np.asarray(z_mm, dtype=float))
    outer = tube.outer_diameter_mm / 2
    if notch.shape != "v_pair":
        return np.full_like(z, outer - notch.depth_mm)
    root = notch.root_width_mm or 0.0
    return outer - notch.depth_mm * np.clip((notch.width_mm / 2 - z) / ((notch.width_mm - root) / 2), 0.0, 1.0)


def section(joint: NotchedTube, z_mm: ArrayLike) -> Section:
    """Cross-section of the flexure at z, arrays of the shape of ``z_mm``.

    The planar cut is replaced by a radial one through the same point of the mid-wall: annular sectors of half angle
    arcsin(c/R_m) each (a pair of notches), or arccos(-c/R_m) (one-sided). ``docs/theory/analytic-model.md`` gives the
    error of this approximation. Where c reaches R_m the pair of arcs is the full tube.

    Raises
    ------
    RigError
        A one-sided notch that leaves nothing of the tube.
    """
    outer, inner = joint.tube.outer_diameter_mm / 2, joint.tube.inner_diameter_mm / 2
    ratio = cut_height_mm(joint, z_mm) / ((outer + inner) / 2)
    if not joint.one_sided:
        return _two_arcs(outer, inner, np.arcsin(np.minimum(ratio, 1.0)))
    if ratio.size and ratio.min() <= -1:
        raise RigError(
            f"notch.depth_mm = {joint.notch.depth_mm}: expected below {outer + (outer + inner) / 2:g} mm, "
            "or nothing is left of the wall"
        )
    return _one_arc(outer, inner, np.arccos(np.maximum(-ratio, -1.0)))


def _two_arcs(outer: float, inner: float, angle: Floats) -> Section:
    """Two annular sectors of half angle ``angle`` at +-90 deg from the bending plane, x = r sin(phi)."""
    radius, wall = (outer + inner) / 2, outer - inner
    area = 2 * angle * (outer**2 - inner**2)
    second = (outer**4 - inner**4) / 2 * (angle - np.sin(2 * angle) / 2)
    phi = angle[..., None] * _ARC_NODES
    # first moment of the arc beyond phi, cos(phi) - cos(a) written so that it does not cancel for small arcs
    beyond = 2 * radius**2 * wall * np.sin((angle[..., None] + phi) / 2) * np.sin((angle[..., None] - phi) / 2)
    shear = _shear_coefficient(area, second, 2 * radius * angle, wall, beyond, np.sin(phi))
    return Section(area, second, shear, np.zeros_like(angle))


def _one_arc(outer: float, inner: float, angle: Floats) -> Section:
    """One annular sector of half angle ``angle`` around the side away from the notch, -x = r cos(phi)."""
    radius, wall = (outer + inner) / 2, outer - inner
    area = angle * (outer**2 - inner**2)
    offset = 2 * np.sin(angle) * (outer**3 - inner**3) / (3 * angle * (outer**2 - inner**2))
    second = (outer**4 - inner**4) / 4 * (angle + np.sin(2 * angle) / 2) - area * offset**2
    phi = angle[..., None] * _ARC_NODES
    beyond = radius**2 * wall * (phi * (np.sin(angle) / angle)[..., None] - np.sin(phi))
    shear = _shear_coefficient(area, second, radius * angle, wall, beyond, np.cos(phi))
    return Section(area, second, shear, offset)


def _shear_coefficient(
    area: Floats, second: Floats, half_length: Floats, wall: float, beyond: Floats, slope: Floats
) -> Floats:
    """Kappa from the energy of the shear flow along the arcs (Jourawski) and of the shear across their wall.

    1/kappa = A/I^2 * integral of (Q^2/t + 6/5 (t^3/12 dx/dr)^2/t) ds, Q (``beyond``) being the first moment of the
    arc beyond a point and dx/dr (``slope``) the part of the linear stress that bends the wall. ``half_length`` is
    half the length of all arcs together; ``beyond`` and ``slope`` have the Gauss points of one arc on the last axis.
    """
    energy = (beyond**2 / wall + 1.2 * (wall**3 / 12 * slope) ** 2 / wall) @ _ARC_WEIGHTS
    return second**2 / (area * half_length * energy)


def section_fibres(joint: NotchedTube, count: int) -> tuple[Floats, Floats]:
    """Distances from the neutral axis (mm, above 0) and areas (mm^2) of fibres at the root, shapes (k,).

    A pair of notches has Gauss points over the arcs at the mid-wall, ``count`` on either side of the neutral axis. The
    two sides are equal, so their areas are added. A one-sided notch leaves a strip hardly higher than the wall is
    thick. Its points cover the thickness of the wall, too, up to the flat face of the cut, and are binned into
    ``count`` classes of distance, both sides together. A class keeps the first moment of its area, which sets the
    moment of a flat plateau, and the second, which sets the elastic stiffness.
    """
    outer, inner = joint.tube.outer_diameter_mm / 2, joint.tube.inner_diameter_mm / 2
    radius, per_angle = (outer + inner) / 2, (outer**2 - inner**2) / 2
    ratio = float(cut_height_mm(joint, 0.0)) / radius
    nodes, weights = np.polynomial.legendre.leggauss(count)
    if not joint.one_sided:
        angle = math.asin(min(ratio, 1.0))
        phi = 0.5 * angle * (1 + nodes)
        return radius * np.sin(phi), 4 * per_angle * 0.5 * angle * weights
    cells = 100 * count  # over the angle; the midpoint rule leaves 1e-5 of the moments
    across, thick = np.polynomial.legendre.leggauss(6)
    r = radius + 0.5 * (outer - inner) * across
    open_to = np.arccos(np.clip(-float(cut_height_mm(joint, 0.0)) / r, -1.0, 1.0))  # to the cut face, which is flat
    height = r[:, None] * np.cos(open_to[:, None] * (np.arange(cells) + 0.5) / cells)
    area = np.broadcast_to((0.5 * thick * (outer - inner) * 2 * r * open_to / cells)[:, None], height.shape)
    distance = np.abs(height - (area * height).sum() / area.sum())
    kind = np.minimum((count * distance / distance.max()).astype(int), count - 1).ravel()
    first = np.bincount(kind, (area * distance).ravel(), count)
    second = np.bincount(kind, (area * distance**2).ravel(), count)
    return second / first, first**2 / second
