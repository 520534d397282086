"""Stiffness of one single notched ring (SNR): a Timoshenko beam between two rings, and the rings' compliance.

Axes as in :mod:`fem_models.joint.section`. Linear elasticity, small strain. The equations stand in
``docs/theory/analytic-model.md``; the paper is Mech. Sci. 9 (2018), "Hysteresis analysis of a notched continuum
manipulator driven by tendon", section 2.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property, lru_cache
from itertools import pairwise
from typing import NamedTuple

import numpy as np

from fem_models.joint.half_notch import LEFT, NODES, RIGHT, WEIGHTS, half_notch
from fem_models.joint.roots import root_length_of_one
from fem_models.joint.section import root_section, section
from fem_models.rig import Rig
from fem_models.rig.joints import MeasuredJoint, NotchedTube
from fem_models.rig.rig import Material, notched_tube
from hysteresis.arrays import Floats


@dataclass(frozen=True)
class Flexure:
    """Stiffness of one joint, referred to the middle of its notch, between rings that are rigid.

    Parameters
    ----------
    bending_Nmm_per_rad
        Moment per relative rotation of the two rings.
    shear_N_per_mm
        Lateral force through the mid-point per lateral displacement of one mid-frame against the other. The bending
        part is in it: for a uniform flexure 1/k = w^3/(12 E I) + w/(kappa G A). None for measured joints, whose shear
        compliance is not known: treat such a joint as rigid in shear.
    axial_N_per_mm
        Axial force at the neutral axis per elongation; None as for shear.
    neutral_offset_mm
        Distance of the neutral axis from the tube axis, away from a one-sided notch; 0 for pairs and measured joints.
    """

    bending_Nmm_per_rad: float
    shear_N_per_mm: float | None
    axial_N_per_mm: float | None
    neutral_offset_mm: float


class Elasticity(NamedTuple):
    """Elastic constants of the metal: Young's and shear modulus in N/mm^2, and Poisson's ratio."""

    young: float
    shear: float
    poissons_ratio: float


def elasticity(material: Material) -> Elasticity:
    """Elastic constants of a material."""
    young = material.youngs_modulus_GPa * 1e3
    return Elasticity(young, young / (2 * (1 + material.poissons_ratio)), material.poissons_ratio)


def _kinks(joint: NotchedTube) -> list[float]:
    """Positions z > 0 at which the section changes abruptly: the edge of a V's root, and where it leaves the bore."""
    tube, notch = joint.tube, joint.cut
    if notch.shape != "v_pair":
        return []
    half, root = notch.width_mm / 2, (notch.root_width_mm or 0.0) / 2
    wall = (tube.outer_diameter_mm - tube.inner_diameter_mm) / 2
    bore = half - (half - root) * wall / notch.depth_mm  # before the root where the notch ends within the wall
    return [z for z in (root, max(bore, root)) if 0 < z < half]


def _graded_gauss(kinks: list[float]) -> tuple[Floats, Floats]:
    """Points and weights for integrands that are smooth between kinks but steep after them, as 1/I of a V.

    Each interval is halved repeatedly towards both of its ends, with Gauss points on every part.
    """
    edges = [kinks[0]]
    for a, b in pairwise(kinks):
        edges += [a + (b - a) * 0.5**k for k in range(LEFT, 0, -1)]
        edges += [b - (b - a) * 0.5**k for k in range(2, RIGHT + 1)] + [b]
    low, length = np.array(edges[:-1]), np.diff(edges)
    return (
        (low[:, None] + 0.5 * length[:, None] * (1 + NODES)).ravel(),
        (0.5 * length[:, None] * WEIGHTS).ravel(),
    )


def root_length_mm(joint: NotchedTube) -> float:
    """Apparent extra length of a flexure in bending at each of its two ends, mm; sharp corners.

    The ring deforms where an arc is rooted in it: :mod:`fem_models.joint.roots`. Where the plane of the cut runs
    through the wall, the arc counts as long as a whole wall of the same area.
    """
    wall = (joint.tube.outer_diameter_mm - joint.tube.inner_diameter_mm) / 2
    arc = root_section(joint).area_mm2 / wall / (1 if joint.one_sided else 2)
    return arc * root_length_of_one(joint.cut.spacing_mm / 2 / arc)


def flexure(rig: Rig) -> Flexure:
    """Stiffness of one joint: the analytic beam of :func:`beam`, longer in bending by its root length at either end.

    The beam alone is 1 to 220 % too stiff in bending. With the roots most notches are within 5 % of solid finite
    elements; docs/validation/notches.md lists the exceptions. A measured joint has its bending stiffness only.
    """
    match rig.joint:
        case MeasuredJoint(flexure_stiffness_Nmm_per_rad=bending):
            return Flexure(bending, None, None, 0.0)
        case NotchedTube() as joint:
            return flexure_of_notch(joint, elasticity(rig.material))


def beam(rig: Rig) -> Flexure:
    """Stiffness of a notch between rigid rings by quadrature of the closed-form sections: the paper's analytic model.

    1/k_bending = int dz/(E I), 1/k_shear = int z^2/(E I) dz + int dz/(kappa G A), 1/k_axial = int dz/(E A).
    Moment, lateral and axial force at the mid-point do not couple because the notch is symmetric about z = 0 (and
    the axial force is taken at the neutral axis).

    Raises
    ------
    RigError
        Measured joints.
    """
    return beam_of_notch(notched_tube(rig), elasticity(rig.material))


@lru_cache(maxsize=1024)
def flexure_of_notch(joint: NotchedTube, metal: Elasticity) -> Flexure:
    """Stiffness of one notch as :func:`flexure` has it."""
    between = beam_of_notch(joint, metal)
    if joint.notch.rigid_roots:
        return between
    rigidity = metal.young * root_section(joint).second_moment_mm4
    bending = 1 / (1 / between.bending_Nmm_per_rad + 2 * root_length_mm(joint) / rigidity)
    assert between.axial_N_per_mm is not None
    return _FlexureOfNotch(joint, metal, bending, between.axial_N_per_mm)


@lru_cache(maxsize=1024)
def beam_of_notch(joint: NotchedTube, metal: Elasticity) -> Flexure:
    """Stiffness of one notch as :func:`beam` has it."""
    tube, notch = joint.tube, joint.cut
    half = notch.width_mm / 2
    if notch.shape == "v_pair":
        radii = (tube.outer_diameter_mm / 2, tube.inner_diameter_mm / 2)
        root = (notch.root_width_mm or 0.0) / 2
        bends, gives = half_notch(radii, float(notch.depth_mm), float(root), float(half), NODES, WEIGHTS)
    else:
        at_root = root_section(joint)
        bends, gives = half / at_root.second_moment_mm4, half / at_root.area_mm2
    return _FlexureOfNotch(joint, metal, 0.5 * metal.young / bends, 0.5 * metal.young / gives)


class _FlexureOfNotch(Flexure):
    """Stiffness of a notch; that in shear is worked out when it is first asked for: the chain in the plane has none."""

    def __init__(self, joint: NotchedTube, metal: Elasticity, bending: float, axial: float) -> None:
        offset, own = root_section(joint).neutral_offset_mm, self.__dict__  # the fields are frozen
        own |= {"bending_Nmm_per_rad": bending, "axial_N_per_mm": axial, "neutral_offset_mm": offset}
        own |= {"joint": joint, "metal": metal}

    @cached_property
    def shear_N_per_mm(self) -> float:
        return _shear_N_per_mm(self.__dict__["joint"], self.__dict__["metal"])


@lru_cache(maxsize=1024)
def _shear_N_per_mm(joint: NotchedTube, metal: Elasticity) -> float:
    z, weights = _graded_gauss([0.0, *_kinks(joint), joint.cut.width_mm / 2])
    s = section(joint, z)
    bend = 1 / (metal.young * s.second_moment_mm4)
    shear = 1 / (s.shear_coefficient * metal.shear * s.area_mm2)
    return float(0.5 / ((z**2 * bend + shear) @ weights))
