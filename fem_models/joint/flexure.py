"""Analytic single notched ring (SNR): Timoshenko beams between two rigid rings.

Axes of one notch: z along the tube with z = 0 in the middle of the notch, x in the bending plane, the tendons at
+-x. Both cut faces are normal to x. Linear elasticity, small strain. The equations stand in
``docs/theory/analytic-model.md``; the paper is Mech. Sci. 9 (2018), "Hysteresis analysis of a notched continuum manipulator
driven by tendon", section 2.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import lru_cache, wraps
from itertools import pairwise
from typing import TypeVar

import numpy as np

from fem_models.joint.roots import root_length
from fem_models.joint.section import cut_height_mm, moduli, section
from fem_models.rig.joints import MeasuredJoint, NotchedTube
from fem_models.rig.rig import Material, Rig, Tendon, Wheel, notched_tube
from hysteresis.arrays import Floats

T = TypeVar("T")

BENCH_GAP = 0.2
"""Assumed opening between the rings of measured joints, of the pitch: small, so that the path is nearly r theta."""


@dataclass(frozen=True)
class Flexure:
    """Stiffness of one joint, referred to the middle of its notch, between rings that are rigid.

    Parameters
    ----------
    bending_Nmm_per_rad
        Moment per relative rotation of the two rings.
    shear_N_per_mm
        Lateral force through the mid-point per lateral displacement of one mid-frame against the other. The bending
        part is in it: for a uniform flexure 1/k = w^3/(12 E I) + w/(kappa G A). None where the joint was measured
        on a bench and its shear compliance is not known: treat such a joint as rigid in shear.
    axial_N_per_mm
        Axial force at the neutral axis per elongation; None as for shear.
    neutral_offset_mm
        Distance of the neutral axis from the tube axis, away from a one-sided notch; 0 for pairs and bench joints.
    """

    bending_Nmm_per_rad: float
    shear_N_per_mm: float | None
    axial_N_per_mm: float | None
    neutral_offset_mm: float


def _kinks(rig: Rig) -> list[float]:
    """Where the section changes abruptly for z > 0: the edge of a V's root, and where its two arcs meet."""
    joint = notched_tube(rig)
    tube, notch = joint.tube, joint.notch
    if notch.shape != "v_pair":
        return []
    half, root = notch.width_mm / 2, (notch.root_width_mm or 0.0) / 2
    to_mid_wall = (tube.outer_diameter_mm - tube.inner_diameter_mm) / 4
    return [z for z in (root, half - (half - root) * to_mid_wall / notch.depth_mm) if 0 < z < half]


def _graded_gauss(kinks: list[float]) -> tuple[Floats, Floats]:
    """Points and weights for integrands that are smooth between kinks but steep after them, as 1/I of a V.

    Each piece is cut at halves of halves towards both of its ends, with Gauss points on every cut.
    """
    nodes, weights = np.polynomial.legendre.leggauss(12)
    edges = [kinks[0]]
    for a, b in pairwise(kinks):
        edges += [a + (b - a) * 0.5**k for k in range(12, 0, -1)]
        edges += [b - (b - a) * 0.5**k for k in range(2, 25)] + [b]
    low, length = np.array(edges[:-1]), np.diff(edges)
    return (
        (low[:, None] + 0.5 * length[:, None] * (1 + nodes)).ravel(),
        (0.5 * length[:, None] * weights).ravel(),
    )


def root_length_mm(rig: Rig) -> float:
    """Length by which a flexure seems longer at each of its two ends when it bends, mm; sharp corners.

    The ring turns where an arc is rooted in it: :mod:`fem_models.joint.roots`.

    Raises
    ------
    RigError
        As :func:`section`.
    """
    joint = notched_tube(rig)
    wall = (joint.tube.outer_diameter_mm - joint.tube.inner_diameter_mm) / 2
    arc = float(section(rig, 0.0).area_mm2) / wall / (1 if joint.one_sided else 2)
    return arc * float(root_length(joint.notch.spacing_mm / 2 / arc))


def _of_metal(function: Callable[[Rig], T]) -> Callable[[Rig], T]:
    """Remember a function of a rig that looks at the tube, the notch and the elastic constants alone."""

    @lru_cache(maxsize=1024)
    def known(joint: NotchedTube, young_GPa: float, poissons_ratio: float, /) -> T:
        rope = Tendon(1.0, 0.5 * joint.tube.inner_diameter_mm, 1.0)
        metal = Material(young_GPa, poissons_ratio)
        return function(Rig("", metal, rope, None, Wheel(1.0), preload_N=0.0, joint=joint))

    @wraps(function)
    def of(rig: Rig) -> T:
        if not isinstance(rig.joint, NotchedTube):
            return function(rig)
        return known(rig.joint, rig.material.youngs_modulus_GPa, rig.material.poissons_ratio)

    return of


@_of_metal
def flexure(rig: Rig) -> Flexure:
    """Stiffness of one joint: the analytic beam of :func:`beam`, longer in bending by its root length at either end.

    The beam alone is 10 to 300 % too stiff in bending; with the roots most notches are within 5 % of solid finite
    elements (docs/validation/notches.md, which also says where not). A bench rig gives its measured bending stiffness only.

    Raises
    ------
    RigError
        As :func:`section`.
    """
    if isinstance(rig.joint, MeasuredJoint):
        return Flexure(rig.joint.flexure_stiffness_Nmm_per_rad, None, None, 0.0)
    between = beam(rig)
    if notched_tube(rig).notch.rigid_roots:
        return between
    rigidity = moduli(rig)[0] * float(section(rig, 0.0).second_moment_mm4)
    bending = 1 / (1 / between.bending_Nmm_per_rad + 2 * root_length_mm(rig) / rigidity)
    return replace(between, bending_Nmm_per_rad=bending)


@_of_metal
def beam(rig: Rig) -> Flexure:
    """Stiffness of a notch between rigid rings by quadrature of the closed-form sections: the paper's analytic model.

    1/k_bending = int dz/(E I), 1/k_shear = int z^2/(E I) dz + int dz/(kappa G A), 1/k_axial = int dz/(E A).
    Moment, lateral and axial force at the mid-point do not couple because the notch is symmetric about z = 0 (and
    the axial force is taken at the neutral axis).

    Raises
    ------
    RigError
        As :func:`section`.
    """
    young, shear_modulus = moduli(rig)

    z, weights = _graded_gauss([0.0, *_kinks(rig), notched_tube(rig).notch.width_mm / 2])
    s = section(rig, z)
    bend = 1 / (young * s.second_moment_mm4)
    shear = 1 / (s.shear_coefficient * shear_modulus * s.area_mm2)
    half_notch = np.array([bend, z**2 * bend + shear, 1 / (young * s.area_mm2)]) @ weights
    bending, lateral, axial = (0.5 / half_notch).tolist()
    return Flexure(bending, lateral, axial, float(section(rig, 0.0).neutral_offset_mm))


@_of_metal
def bending_length_mm(rig: Rig) -> float:
    """Length over which a notch bends: E I of its root over the beam's bending stiffness, the width for a slot.

    It places the flexure; what the rings give at its roots makes the joint softer, not the notch wider.
    """
    if isinstance(rig.joint, MeasuredJoint):
        return BENCH_GAP * rig.pitch_mm
    root = moduli(rig)[0] * float(section(rig, 0.0).second_moment_mm4)
    return min(root / beam(rig).bending_Nmm_per_rad, rig.joint.notch.width_mm)


def turning_length_mm(rig: Rig) -> float:
    """Length of the part of a notch that both engines turn by half the joint's angle, the rest going with the rings.

    A slot bends to a circular arc, with the chord w (1 - t^2/24 + ...) at the angle t. Rigid ends of w/6 and
    two thirds of w along the mean direction have the same: w/3 cos(t/2) + 2 w/3. A V bends close to its root, over
    :func:`bending_length_mm`, and so do measured joints.
    """
    length = bending_length_mm(rig)
    slot = isinstance(rig.joint, NotchedTube) and rig.joint.notch.shape != "v_pair"
    return 2 / 3 * length if slot else length


def rigid_gap_mm(rig: Rig) -> float:
    """Length of a notch beside the part that bends, both ends together: it turns with the rings."""
    if isinstance(rig.joint, MeasuredJoint):
        return rig.joint.rigid_gap_mm
    return rig.joint.notch.width_mm - turning_length_mm(rig)


@_of_metal
def ring_stiffness(rig: Rig) -> tuple[float, float, float]:
    """Bending, axial and shear stiffness of the uncut tube between two flexures, at its middle: Nmm/rad, N/mm, N/mm.

    Of measured joints it is part of the joint: far stiffer here.
    """
    length_mm = rig.pitch_mm - bending_length_mm(rig)
    if isinstance(rig.joint, MeasuredJoint):
        rigid = 1e2 * max(rope.EA_N for rope in rig.tendons) / rig.pitch_mm
        return rigid * rig.pitch_mm**2, rigid, rigid
    tube = rig.joint.tube
    outer, inner = tube.outer_diameter_mm / 2, tube.inner_diameter_mm / 2
    young = moduli(rig)[0]
    area, second = math.pi * (outer**2 - inner**2), math.pi / 4 * (outer**4 - inner**4)
    # kappa = 1/2 of a thin round tube (Cowper 1966, doi 10.1115/1.3625046, for zero Poisson's ratio)
    shear = length_mm**3 / (12 * young * second) + length_mm * 4 * (1 + rig.material.poissons_ratio) / (young * area)
    return young * second / length_mm, young * area / length_mm, 1 / shear


def moment_arms_mm(rig: Rig) -> tuple[float, float]:
    """Moment arms of tendon a and tendon b about the neutral axis, each positive on its own side.

    Pairs of notches and bench joints: ``moment_arm_mm`` as it stands. One-sided notches: ``moment_arm_mm`` counts
    from the tube axis; tendon a runs on the notched side and gains the neutral offset, tendon b loses it (York et
    al., ICRA 2015, "A wrist for needle-sized surgical robots"). The arm of tendon b may come out at or below 0: it
    then cannot bend the manipulator its way. A tendon b that is not there has the arm 0.

    Raises
    ------
    RigError
        As :func:`section`.
    """
    offset = 0.0 if isinstance(rig.joint, MeasuredJoint) else float(section(rig, 0.0).neutral_offset_mm)
    arm_b = 0.0 if rig.tendon_b is None else rig.tendon_b.moment_arm_mm - offset
    return rig.tendon_a.moment_arm_mm + offset, arm_b


def force_scale_N(rig: Rig) -> float:
    """Tension that small forces are measured by: the preload; of one tendon at least what bends a joint by a degree."""
    if rig.tendon_b is not None:
        return rig.preload_N
    return max(rig.preload_N, math.radians(1.0) * flexure(rig).bending_Nmm_per_rad / moment_arms_mm(rig)[0])


def closure_angle_rad(rig: Rig) -> float:
    """Angle of one joint at which the edges of its notch meet at the outer surface; inf for a bench rig.

    Of a V 2 atan(w/2 / (R_o + neutral offset)): the rings turn about the neutral axis at mid-notch. A slot bends all
    the way, to a circular arc whose chord its edges have to pass: w / (R_o + neutral offset).

    Raises
    ------
    RigError
        As :func:`section`.
    """
    if isinstance(rig.joint, MeasuredJoint):
        return math.inf
    tube, notch = rig.joint.tube, rig.joint.notch
    lever = tube.outer_diameter_mm / 2 + float(section(rig, 0.0).neutral_offset_mm)
    return 2 * math.atan2(notch.width_mm / 2, lever) if notch.shape == "v_pair" else notch.width_mm / lever


@_of_metal
def peak_strain_per_rad(rig: Rig) -> float:
    """Strain of the outermost fibre at the root of the notch per radian of one joint, linear elastic.

    k e/(E I_root) of the :func:`beam`, as if the notch alone bent. The rings take part of the angle, and at a sharp
    root the strain is higher than the section's: the solid of the default rig, filleted, has more (docs/validation/notches.md).
    e is the larger distance from the neutral axis: the cut face, or the outer surface opposite a one-sided notch.

    Raises
    ------
    RigError
        As :func:`section`.
    """
    joint = notched_tube(rig)
    root = section(rig, 0.0)
    offset = float(root.neutral_offset_mm)
    fibre = float(cut_height_mm(rig, 0.0)) + offset
    if joint.one_sided:
        fibre = max(fibre, joint.tube.outer_diameter_mm / 2 - offset)
    return beam(rig).bending_Nmm_per_rad * fibre / (moduli(rig)[0] * float(root.second_moment_mm4))
