"""Mechanics of a rig's joints, derived once: stiffnesses, lengths, moment arms, closure angle, material elements."""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import lru_cache
from typing import NamedTuple

from scipy.optimize import brentq

from fem_models.joint.flexure import Elasticity, Flexure, beam_of_notch, elasticity, flexure_of_notch
from fem_models.joint.friction import JenkinsElements, jenkins_elements
from fem_models.joint.hardening import Hardening
from fem_models.joint.section import root_section
from fem_models.joint.superelastic import FlagFibres, flag_fibres
from fem_models.joint.superelastic_section import SuperelasticSection, superelastic_section
from fem_models.rig import Rig
from fem_models.rig.joints import MeasuredJoint, NotchedTube

MEASURED_BENDING_SHARE = 0.2
"""Part of the pitch over which a measured joint is assumed to bend: small, so that the path is nearly r theta."""
RIGID = 1e2
"""Stiffness of the rings between measured joints, over that of a tendon along a pitch: part of the joint, not known."""


class RingStiffness(NamedTuple):
    """Stiffness of the uncut tube between two flexures, at its middle."""

    bending_Nmm_per_rad: float
    axial_N_per_mm: float
    shear_N_per_mm: float


class Arms(NamedTuple):
    """Moment arms of the two tendons about the neutral axis, mm, each positive on its own side."""

    a: float
    b: float


@dataclass(frozen=True)
class JointMechanics:
    """Mechanics of one joint of a rig, the same for all engines. Make it once by :func:`joint_mechanics`, pass it on.

    Parameters
    ----------
    flexure
        Bending, shear and axial stiffness, and the offset of the neutral axis.
    hardening
        Growth of the bending stiffness with the angle from rest; nothing for notches, which are linear but for their
        superelastic law.
    ring
        Stiffness of the uncut tube between two flexures. Of measured joints it is part of the joint: far stiffer here.
    bending_length_mm
        Length over which a notch bends: E I of its root over the beam's bending stiffness, the width for a slot. It
        places the flexure; what the rings give at its roots makes the joint softer, not the notch wider.
    turning_length_mm
        Length of the part of a notch that the engines rotate by half the joint's angle, the rest moving with the rings.
        A slot bends to a circular arc, with the chord w (1 - t^2/24 + ...) at the angle t. Rigid ends of w/6 and two
        thirds of w along the mean direction have the same: w/3 cos(t/2) + 2 w/3. A V bends close to its root, over
        the bending length, and so do measured joints.
    rigid_gap_mm
        Length of a notch outside that part, both ends together: it moves with the rings, and the tendon crosses it.
    arms_mm
        Pairs of notches and measured joints: ``Tendon.moment_arm_mm`` as it stands. One-sided notches:
        ``moment_arm_mm`` counts from the tube axis; tendon a runs on the notched side and gains the neutral offset,
        tendon b loses it (York et al., ICRA 2015, "A wrist for needle-sized surgical robots"). The arm of tendon b may
        come out at or below 0: it then cannot bend the manipulator towards itself. Without a tendon b it is 0.
    closure_angle_rad
        Angle of the joint at which the edges of its notch meet at the outer surface; inf for measured joints
        (:func:`closing_angle_rad`): a V bends to an arc over its bending length and has straight faces beyond it, a
        slot bends along its whole width.
    contact_angle_rad
        Angle at which the closure of the rig starts to carry load; inf for a rig without.
    one_sided
        Whether notches are on one side only, which positive bending closes.
    rest_angle_rad
        Angle without load.
    force_scale_N
        Tension that small forces are compared with: the preload; of one tendon at least what bends a joint by a degree.
    jenkins
        Elements of the material loop.
    fibres
        Elements of the superelastic law of measured joints; none where the rig has no such law.
    section
        Superelastic section of a notched tube, which the tendons press together; None where the rig has no such law.
    peak_strain_per_rad
        Strain of the outermost fibre at the root of the notch per radian of the joint, linear elastic: k e/(E I_root)
        of the beam, as if the notch alone bent. The rings take part of the angle, and at a sharp root the strain is
        higher than the section's: the solid of the default rig, filleted, has more (docs/validation/notches.md). e is
        the larger distance from the neutral axis: the cut face, or the outer surface opposite a one-sided notch. NaN
        for measured joints, whose section is not known.
    outer_fibres_per_rad
        The same of both outer fibres, on the side of tendon a and opposite; the larger one is the peak.
    axial_strain_per_N
        Strain of the root of the notch per newton of thrust, 1/(E A); NaN for measured joints.
    """

    flexure: Flexure
    hardening: Hardening
    ring: RingStiffness
    bending_length_mm: float
    turning_length_mm: float
    rigid_gap_mm: float
    arms_mm: Arms
    closure_angle_rad: float
    contact_angle_rad: float
    one_sided: bool
    rest_angle_rad: float
    force_scale_N: float
    jenkins: JenkinsElements
    fibres: FlagFibres
    section: SuperelasticSection | None
    peak_strain_per_rad: float
    outer_fibres_per_rad: tuple[float, float]
    axial_strain_per_N: float

    @property
    def axial_compliance(self) -> float:
        """Of the flexure, mm/N; with a superelastic section, of what is in series with it. 0 for measured joints."""
        if self.section is not None:
            return self.section.axial_compliance
        return 1 / self.flexure.axial_N_per_mm if self.flexure.axial_N_per_mm else 0.0

    @property
    def spring_Nmm_per_rad(self) -> float:
        """Bending stiffness of the spring: that of the elastic part, 0 where flags or a section take its place."""
        return 0.0 if self.fibres.stiffness.size or self.section is not None else self.elastic_Nmm_per_rad

    @property
    def elastic_Nmm_per_rad(self) -> float:
        """Bending stiffness of the elastic part, without the loop of the material, with the ring in series."""
        return self.with_ring(self.jenkins.elastic_Nmm_per_rad)

    def with_ring(self, bending_Nmm_per_rad: float) -> float:
        """Stiffness of a part of the joint with the ring in series, Nmm/rad."""
        ring = self.ring.bending_Nmm_per_rad
        return float(bending_Nmm_per_rad * ring / (ring + bending_Nmm_per_rad))


class _Elastic(NamedTuple):
    """Fields of :class:`JointMechanics` that depend on the joint and its elastic constants alone."""

    flexure: Flexure
    hardening: Hardening
    ring: RingStiffness
    bending_length_mm: float
    turning_length_mm: float
    rigid_gap_mm: float
    closure_angle_rad: float
    one_sided: bool
    peak_strain_per_rad: float
    outer_fibres_per_rad: tuple[float, float]
    axial_strain_per_N: float


def joint_mechanics(rig: Rig) -> JointMechanics:
    """Derive the mechanics of a rig's joints; what depends on the notched tube alone is remembered.

    Raises
    ------
    RigError
        A superelastic plateau as steep as the elastic law.
    """
    match rig.joint:
        case NotchedTube() as tube:
            elastic = _of_notch(tube, elasticity(rig.material))
        case MeasuredJoint() as measured:
            elastic = _of_measured(measured, max(tendon.EA_N for tendon in rig.tendons))
    flexure, closure = elastic.flexure, rig.closure
    arms = _arms(rig, flexure)
    contact = math.inf
    if closure is not None:
        contact = elastic.closure_angle_rad if closure.angle_deg is None else math.radians(closure.angle_deg)
    return JointMechanics(
        flexure=flexure,
        hardening=elastic.hardening,
        ring=elastic.ring,
        bending_length_mm=elastic.bending_length_mm,
        turning_length_mm=elastic.turning_length_mm,
        rigid_gap_mm=elastic.rigid_gap_mm,
        arms_mm=arms,
        closure_angle_rad=elastic.closure_angle_rad,
        contact_angle_rad=contact,
        one_sided=elastic.one_sided,
        rest_angle_rad=math.radians(rig.precurvature_deg),
        force_scale_N=_force_scale_N(rig, flexure, arms),
        jenkins=jenkins_elements(rig.material, flexure.bending_Nmm_per_rad),
        fibres=flag_fibres(rig),
        section=superelastic_section(rig),
        peak_strain_per_rad=elastic.peak_strain_per_rad,
        outer_fibres_per_rad=elastic.outer_fibres_per_rad,
        axial_strain_per_N=elastic.axial_strain_per_N,
    )


@lru_cache(maxsize=1024)
def _of_notch(joint: NotchedTube, metal: Elasticity) -> _Elastic:
    tube, notch = joint.tube, joint.cut
    flexure, between, root = flexure_of_notch(joint, metal), beam_of_notch(joint, metal), root_section(joint)
    rigidity, offset = metal.young * root.second_moment_mm4, root.neutral_offset_mm
    v_shaped, lever = notch.shape == "v_pair", tube.outer_diameter_mm / 2 + offset
    bending_length = min(rigidity / between.bending_Nmm_per_rad, notch.width_mm)
    turning_length = bending_length if v_shaped else 2 / 3 * bending_length
    fibre = opposite = tube.outer_diameter_mm / 2 - notch.depth_mm + offset
    if joint.one_sided:
        opposite = tube.outer_diameter_mm / 2 - offset
    return _Elastic(
        flexure=flexure,
        hardening=Hardening(),
        ring=ring_stiffness(joint, metal, joint.pitch_mm - bending_length),
        bending_length_mm=bending_length,
        turning_length_mm=turning_length,
        rigid_gap_mm=notch.width_mm - turning_length,
        closure_angle_rad=closing_angle_rad(notch.width_mm, bending_length if v_shaped else notch.width_mm, lever),
        one_sided=joint.one_sided,
        peak_strain_per_rad=between.bending_Nmm_per_rad * max(fibre, opposite) / rigidity,
        outer_fibres_per_rad=(
            between.bending_Nmm_per_rad * fibre / rigidity,
            between.bending_Nmm_per_rad * opposite / rigidity,
        ),
        axial_strain_per_N=1 / (metal.young * root.area_mm2),
    )


def closing_angle_rad(width_mm: float, bending_length_mm: float, lever_mm: float) -> float:
    """Angle t at which the edges of a notch of width w meet; its neutral line bends to an arc of length L at mid-notch.

    The straight faces beyond the arc turn by t/2 either way, and an edge lies at the lever h from the neutral line: it
    is at mid-notch where L/t sin(t/2) + (w - L)/2 cos(t/2) = h sin(t/2). A hinge, L = 0, gives 2 atan(w/(2 h)), and a
    slot that bends along its whole width, L = w, gives w/h.
    """
    straight = 0.5 * (width_mm - bending_length_mm)

    def apart(angle: float) -> float:
        half = 0.5 * angle
        return (0.5 * bending_length_mm / half - lever_mm) * math.sin(half) + straight * math.cos(half)

    low, high = 2 * math.atan2(width_mm / 2, lever_mm), width_mm / lever_mm
    if high - low < 1e-12 or bending_length_mm >= width_mm:
        return high
    return float(brentq(apart, low, high, xtol=1e-12))


def ring_stiffness(joint: NotchedTube, metal: Elasticity, length_mm: float) -> RingStiffness:
    """Stiffness of the uncut tube over a length between two flexures."""
    outer, inner = joint.tube.outer_diameter_mm / 2, joint.tube.inner_diameter_mm / 2
    area, second = math.pi * (outer**2 - inner**2), math.pi / 4 * (outer**4 - inner**4)
    # kappa = 1/2 of a thin round tube (Cowper 1966, doi 10.1115/1.3625046, for zero Poisson's ratio)
    shear = length_mm**3 / (12 * metal.young * second) + length_mm * 4 * (1 + metal.poissons_ratio) / (
        metal.young * area
    )
    return RingStiffness(metal.young * second / length_mm, metal.young * area / length_mm, 1 / shear)


def _of_measured(joint: MeasuredJoint, EA_N: float) -> _Elastic:
    rigid = RIGID * EA_N / joint.pitch_mm
    bending_length = MEASURED_BENDING_SHARE * joint.pitch_mm
    return _Elastic(
        flexure=Flexure(joint.flexure_stiffness_Nmm_per_rad, None, None, 0.0),
        hardening=Hardening(joint.hardening_slope, joint.hardening_limit, math.radians(joint.hardening_angle_deg)),
        ring=RingStiffness(rigid * joint.pitch_mm**2, rigid, rigid),
        bending_length_mm=bending_length,
        turning_length_mm=bending_length,
        rigid_gap_mm=joint.rigid_gap_mm,
        closure_angle_rad=math.inf,
        one_sided=False,
        peak_strain_per_rad=math.nan,
        outer_fibres_per_rad=(math.nan, math.nan),
        axial_strain_per_N=math.nan,
    )


def _arms(rig: Rig, flexure: Flexure) -> Arms:
    offset = flexure.neutral_offset_mm
    arm_b = 0.0 if rig.tendon_b is None else rig.tendon_b.moment_arm_mm - offset
    return Arms(rig.tendon_a.moment_arm_mm + offset, arm_b)


def _force_scale_N(rig: Rig, flexure: Flexure, arms: Arms) -> float:
    if rig.tendon_b is not None:
        return rig.preload_N
    return max(rig.preload_N, math.radians(1.0) * flexure.bending_Nmm_per_rad / arms.a)
