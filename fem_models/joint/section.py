"""Cross-section of a flexure: the part of the tube that a notch leaves.

Axes of one notch: z along the tube with z = 0 in the middle of the notch, x in the bending plane, the tendons at
+-x. Both cut faces are normal to x. The equations stand in ``docs/theory/analytic-model.md``.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, fields
from functools import lru_cache
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from fem_models.joint.half_notch import between_cuts
from fem_models.joint.segments import below_cut_moments, between_cuts_moments, moments_about
from fem_models.joint.shear import level_energy, wall_energy
from fem_models.rig.joints import NotchedTube
from hysteresis.arrays import Floats

STRIP_POINTS = 2
"""Fibres of a strip of the section: as many as keep its moments up to the third."""


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


class Root(NamedTuple):
    """Cross-section at the root of a notch; fields as of :class:`Section`."""

    area_mm2: float
    second_moment_mm4: float
    neutral_offset_mm: float


def cut_height_mm(joint: NotchedTube, z_mm: ArrayLike) -> Floats:
    """Distance of the cut face from the tube axis at z, the shape of ``z_mm``.

    A V has its flat root over ``root_width_mm`` and rises linearly to the outer surface at ``width_mm``; a slot is
    constant. A pair of notches leaves |x| <= c, a one-sided notch x <= c (c is negative for a cut beyond the axis).
    """
    tube, notch = joint.tube, joint.cut
    z = np.abs(np.asarray(z_mm, dtype=float))
    outer = tube.outer_diameter_mm / 2
    if notch.shape != "v_pair":
        return np.full_like(z, outer - notch.depth_mm)
    root = notch.root_width_mm or 0.0
    return outer - notch.depth_mm * np.clip((notch.width_mm / 2 - z) / ((notch.width_mm - root) / 2), 0.0, 1.0)


def section(joint: NotchedTube, z_mm: ArrayLike) -> Section:
    """Cross-section of the flexure at z, arrays of the shape of ``z_mm``: the tube cut by planes.

    Area, neutral axis and second moment are exact (:mod:`fem_models.joint.segments`). The shear coefficient is
    approximate (:mod:`fem_models.joint.shear`): at most 5 % low, if the wall is up to an eighth of the outer diameter.
    """
    cut = cut_height_mm(joint, z_mm)
    different, where = np.unique(cut, return_inverse=True)  # a slot has one section, and so has the root of a V
    outer, inner = joint.tube.outer_diameter_mm / 2, joint.tube.inner_diameter_mm / 2
    sections = (_one_sided if joint.one_sided else _between_pair)(outer, inner, different)
    return Section(*(getattr(sections, field.name)[where].reshape(cut.shape) for field in fields(Section)))


@lru_cache(maxsize=1024)
def root_section(joint: NotchedTube) -> Root:
    """Cross-section at the root of a notch without its shear coefficient, which costs far more than the rest."""
    outer, inner = joint.tube.outer_diameter_mm / 2, joint.tube.inner_diameter_mm / 2
    cut = outer - joint.cut.depth_mm
    if not joint.one_sided:
        area, second = between_cuts(outer, inner, float(cut))
        return Root(area, second, 0.0)
    area, first, second = below_cut_moments(outer, inner, cut)[:3].tolist()
    depth = first / area
    return Root(area, second - depth * first, depth - cut)


def _one_sided(outer: float, inner: float, cut: Floats) -> Section:
    """Sections {x <= cut}, arrays of shape (m,)."""
    area, first, second = below_cut_moments(outer, inner, cut)[:3]
    depth = first / area  # of the centroid below the cut
    central = second - depth * first
    energy = 2 * wall_energy(outer, inner, cut, cut - depth, 0.0)
    return Section(area, central, central**2 / (area * energy), depth - cut)


def _between_pair(outer: float, inner: float, cut: Floats) -> Section:
    """Sections {|x| <= cut}, arrays of shape (m,)."""
    area, _, second = between_cuts_moments(outer, inner, cut)[:3]
    axis = np.zeros_like(cut)
    energy = wall_energy(outer, inner, cut, axis, math.pi / 2)
    level = level_energy(outer, inner, np.minimum(cut, inner / 2))  # low strips; higher ones are nearer to arcs
    energy = 4 * np.where(cut < inner / 2, np.minimum(energy, level), energy)
    return Section(area, second, second**2 / (area * energy), axis)


def section_fibres(joint: NotchedTube, count: int) -> tuple[Floats, Floats]:
    """Distances from the neutral axis (mm) and areas (mm^2) of fibres at the root of a notch, shapes (2 ``count``,).

    The distances ascend. They are below 0 away from a one-sided notch, above 0 towards it; a pair of notches has both
    sides equal. Either side is cut into strips of equal height, parallel to the neutral axis, with two fibres each.
    These keep the area of the strip and its first, second and third moment. The whole section therefore has its exact
    area and second moment, and no first moment.

    Raises
    ------
    ValueError
        If ``count`` is not an even number of at least 2.
    """
    if count < STRIP_POINTS or count % STRIP_POINTS:
        raise ValueError(f"count = {count}: expected an even number of at least {STRIP_POINTS}")
    outer, inner = joint.tube.outer_diameter_mm / 2, joint.tube.inner_diameter_mm / 2
    cut, strips = float(cut_height_mm(joint, 0.0)), count // STRIP_POINTS
    if not joint.one_sided:
        moments = 0.5 * between_cuts_moments(outer, inner, np.linspace(0.0, cut, strips + 1))
        distance, area = _strip_fibres(np.diff(moments))
        return np.concatenate([-distance[::-1], distance]), np.concatenate([area[::-1], area])
    neutral = -float(section(joint, 0.0).neutral_offset_mm)
    edges = np.concatenate([np.linspace(-outer, neutral, strips + 1), np.linspace(neutral, cut, strips + 1)[1:]])
    return _strip_fibres(np.diff(moments_about(outer, inner, edges, neutral)))


def _strip_fibres(moments: Floats) -> tuple[Floats, Floats]:
    """Two fibres for each strip with the moments of orders 0 to 3 about the neutral axis, shape (4, n)."""
    area, first, second, third = moments
    mean = first / area
    spread = np.sqrt(second / area - mean**2)
    skew = (third / area - 3 * mean * spread**2 - mean**3) / spread**3
    # two-point Gauss rule: roots of t^2 - skew t - 1, weights that leave no first moment
    root = np.sqrt(skew**2 + 4)
    low, high = 0.5 * (skew - root), 0.5 * (skew + root)
    distance = mean + spread * np.stack([low, high])
    return distance.T.ravel(), (area * np.stack([high, -low]) / root).T.ravel()
