"""Six stiffnesses of a notch, in its own frame: two bending axes, torsion, axial force and two shears.

Axes of a notch: 1 along the tube, 2 in its bending plane, towards the notched side, 3 across. The weak bending, axial
and in-plane shear stiffnesses are those of :mod:`fem_models.joint.flexure`. The others are Timoshenko's beam about the
other axis, two webs that twist and bend between their rings (a pair of notches), or Vlasov's torsion of a thin open arc
(one-sided notches): docs/theory/three-dimensions.md.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from fem_models.joint.flexure import Elasticity, beam_of_notch, flexure_of_notch, root_length_mm
from fem_models.joint.section import cut_height_mm, section
from fem_models.rig.joints import NotchedTube
from hysteresis.arrays import Floats

WEB_SHEAR = 5 / 6
"""Timoshenko's coefficient of a web across its wall: a rectangle."""
ARC_SHEAR = 0.5
"""The same of a thin arc or tube (Cowper 1966, doi 10.1115/1.3625046)."""
POINTS = 40


class NotchStiffness(NamedTuple):
    """Stiffness of one notch between its rings, at the middle of the notch and its neutral axis.

    ``weak`` and ``strong`` bending are about the axes 3 and 2, ``torsion`` is about 1, Nmm/rad. ``axial`` is along 1,
    ``shear_in`` along 2 in the bending plane, ``shear_across`` along 3, N/mm.
    """

    weak: float
    strong: float
    torsion: float
    axial: float
    shear_in: float
    shear_across: float


def notch_stiffness(joint: NotchedTube, metal: Elasticity) -> NotchStiffness:
    """Six stiffnesses of one notch.

    Flexures are longer at either root by the length of :func:`fem_models.joint.flexure.root_length_mm`, which was
    derived for weak bending, in all of them but the axial one: that is the planar chain's.
    """
    flexure = flexure_of_notch(joint, metal)
    assert flexure.axial_N_per_mm is not None
    assert flexure.shear_N_per_mm is not None
    z, weights = _half_notch(joint)
    across, area = second_moment_across_mm4(joint, z), np.asarray(section(joint, z).area_mm2)
    at_root = section(joint, 0.0)
    rigidity = metal.young * float(at_root.second_moment_mm4)
    bends = rigidity / beam_of_notch(joint, metal).bending_Nmm_per_rad  # length over which the notch bends
    root = 0.0 if joint.cut.rigid_roots else root_length_mm(joint)
    leans = 2 * root * (0.5 * min(bends, joint.cut.width_mm)) ** 2  # of roots under a lateral force
    shear_in = 1 / (1 / flexure.shear_N_per_mm + leans / rigidity)
    if joint.one_sided:
        own, shear, torsion = across, ARC_SHEAR, _arc_torsion(joint, metal, joint.cut.width_mm + 2 * root)
    else:
        own, shear, torsion = _own_moment(joint, z), WEB_SHEAR, _web_torsion(joint, metal, shear_in)
    give = z**2 / (metal.young * own) + 1 / (shear * metal.shear * area)
    return NotchStiffness(
        weak=flexure.bending_Nmm_per_rad,
        strong=1 / (2 * float((1 / (metal.young * across)) @ weights) + 2 * root / (metal.young * float(across[0]))),
        torsion=torsion,
        axial=flexure.axial_N_per_mm,
        shear_in=shear_in,
        shear_across=1 / (2 * float(give @ weights) + leans / (metal.young * float(own[0]))),
    )


def shear_centre_mm(joint: NotchedTube) -> float:
    """Distance from the tube's axis to the shear centre of a one-sided notch, away from the cut; 0 of a pair.

    That of a thin arc of the section at the root, 2 R (sin a - a cos a)/(a - sin a cos a) (Vlasov 1961).
    """
    if not joint.one_sided:
        return 0.0
    a = float(_half_angle(joint, np.zeros(1))[0])
    return 2 * _mean_radius(joint) * (math.sin(a) - a * math.cos(a)) / (a - math.sin(a) * math.cos(a))


def stiffness_of_solid(stiffness: Floats) -> NotchStiffness:
    """Six stiffnesses from those of a solid notch, shape (6, 6): :class:`fem_models.solid.linear.SnrStiffness`.

    Axial force acts at the neutral axis of weak bending, shear across at the shear centre.
    """
    give = np.linalg.inv(stiffness)  # u_x, u_y, u_z, r_x, r_y, r_z; z along the tube, x in the bending plane
    return NotchStiffness(
        weak=float(1 / give[4, 4]),
        strong=float(1 / give[3, 3]),
        torsion=float(1 / give[5, 5]),
        axial=float(1 / (give[2, 2] - give[2, 4] ** 2 / give[4, 4])),
        shear_in=float(1 / give[0, 0]),
        shear_across=float(1 / (give[1, 1] - give[1, 5] ** 2 / give[5, 5])),
    )


def second_moment_across_mm4(joint: NotchedTube, z_mm: Floats) -> Floats:
    """Second moment of the section about its axis of symmetry in the bending plane, of the shape of ``z_mm``.

    With F(R, x) = int (2/3) (R^2 - x^2)^(3/2) dx in closed form, of the outer circle less the inner one.
    """
    cut = cut_height_mm(joint, z_mm)
    outer, inner = joint.tube.outer_diameter_mm / 2, joint.tube.inner_diameter_mm / 2
    if joint.one_sided:
        return _up_to(outer, cut) - _up_to(inner, cut) - _up_to(outer, -outer) + _up_to(inner, -outer)
    return 2 * (_up_to(outer, cut) - _up_to(inner, cut))


def _up_to(radius: float, x: Floats | float) -> Floats:
    """F(R, x), 0 at x = 0."""
    at = np.clip(np.asarray(x, dtype=float), -radius, radius)
    root = np.sqrt(np.maximum(radius**2 - at**2, 0.0))
    return np.asarray(
        2 / 3 * (at / 8 * (5 * radius**2 - 2 * at**2) * root + 3 / 8 * radius**4 * np.arcsin(at / radius))
    )


def _half_notch(joint: NotchedTube) -> tuple[Floats, Floats]:
    """Gauss points and weights of half a notch, shapes (k,): cut where its section has a kink."""
    half = joint.cut.width_mm / 2
    root = (joint.cut.root_width_mm or 0.0) / 2
    edges = {0.0, root, half}
    if joint.cut.shape == "v_pair":
        outer, inner = joint.tube.outer_diameter_mm / 2, joint.tube.inner_diameter_mm / 2
        level = 1 - (outer - inner) / joint.cut.depth_mm  # of the depth, where the cut leaves the bore
        edges |= {root + part * (half - root) for part in (0.02, 0.1, 0.3, level) if 0 < part < 1}
    ends = np.array(sorted(edges))
    node, weight = np.polynomial.legendre.leggauss(POINTS)
    low, length = ends[:-1, None], np.diff(ends)[:, None]
    return (low + 0.5 * length * (1 + node)).ravel(), (0.5 * length * weight).ravel()


def _half_angle(joint: NotchedTube, z_mm: Floats) -> Floats:
    """Half the angle of the arc, or of one of both arcs, at the mean radius; a quarter turn of a pair is the tube."""
    mean = _mean_radius(joint)
    part = np.clip(cut_height_mm(joint, z_mm) / mean, -1.0, 1.0)
    return np.arccos(-part) if joint.one_sided else np.arcsin(part)


def _mean_radius(joint: NotchedTube) -> float:
    return (joint.tube.outer_diameter_mm + joint.tube.inner_diameter_mm) / 4


def _wall(joint: NotchedTube) -> float:
    return (joint.tube.outer_diameter_mm - joint.tube.inner_diameter_mm) / 2


def _own_moment(joint: NotchedTube, z: Floats) -> Floats:
    """Second moment of both webs of a pair, each about its own axis along the cut: they bend across their walls."""
    half, mean, wall = _half_angle(joint, z), _mean_radius(joint), _wall(joint)
    centroid = mean * np.sinc(half / math.pi) * (1 + wall**2 / (12 * mean**2))
    area = np.asarray(section(joint, z).area_mm2)
    # thin webs: the difference is small, and at least that of a rectangle
    return np.maximum(second_moment_across_mm4(joint, z) - area * centroid**2, area * wall**2 / 12)


def _thin_torsion(length: Floats, wall: float) -> Floats:
    """Saint-Venant's torsion constant of a rectangle (Timoshenko and Goodier 1970, section 109: within 0.5 %)."""
    long, short = np.maximum(length, wall), np.minimum(length, wall)
    ratio = short / long
    return np.asarray(long * short**3 * (1 / 3 - 0.21 * ratio * (1 - ratio**4 / 12)))


def _web_torsion(joint: NotchedTube, metal: Elasticity, shear_in: float) -> float:
    """Torsion of a pair: both webs shear at the radius of their shear centres, and twist."""
    z, weights = _half_notch(joint)
    half, mean, wall = _half_angle(joint, z), _mean_radius(joint), _wall(joint)
    lever = 2 * mean * (math.sin(half[0]) - half[0] * math.cos(half[0]))  # of the root's shear centre
    lever /= half[0] - math.sin(half[0]) * math.cos(half[0])
    webs = 2 * _thin_torsion(2 * half * mean, wall)
    closed = 2 * math.pi * mean**3 * wall  # where the cut is outside the wall, the tube is whole
    constant = np.where(half < 0.5 * math.pi, webs, closed)
    return float(lever**2 * shear_in + 0.5 * metal.shear / float((1 / constant) @ weights))


def _arc_torsion(joint: NotchedTube, metal: Elasticity, width: float) -> float:
    """Torsion of a thin arc whose ends cannot warp (Vlasov 1961): G J/w/(1 - tanh(k)/k), k^2 = G J w^2/(4 E C)."""
    mean, wall = _mean_radius(joint), _wall(joint)
    a = float(_half_angle(joint, np.zeros(1))[0])
    constant = metal.shear * float(_thin_torsion(np.array(2 * a * mean), wall))
    lever = (math.sin(a) - a * math.cos(a)) ** 2 / (a - math.sin(a) * math.cos(a))
    warping = metal.young * 2 / 3 * wall * mean**5 * (a**3 - 6 * lever)
    k = 0.5 * width * math.sqrt(constant / warping)
    return constant / width / (1 - math.tanh(k) / k)
