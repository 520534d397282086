"""The chain's parameters and the memory of its dry elements, as the kernels take them.

Arrays of shape (2,) or (2, ...) are of tendons a and b; a tendon that is not there has zeros.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from fem_models.joint import JointMechanics, JointRow
from fem_models.joint.contact import ring_weight_N, tip_force_N
from fem_models.joint.hardening import Hardening
from fem_models.joint.superelastic_section import Heating, SuperelasticSection, elongation_under_mm
from fem_models.rig import Rig
from hysteresis.arrays import Floats

Pair = tuple[float, float]
"""Of tendons a and b. Tuples, because a kernel counts references each time it takes an array from a NamedTuple."""


@dataclass(frozen=True)
class ChainSettings:
    """Numerical settings.

    ``bristle_ratio`` is the stiffness of a sticking guide over EA/pitch: at 20 close to its limit, no give at all.
    ``max_step_mm`` bounds a step of the drive, ``max_force_step`` that of a force, over the force scale of
    :class:`fem_models.joint.mechanics.JointMechanics`. ``max_halvings`` is how often a step that fails is halved.
    ``tolerance`` is that of the residual, over the same force. ``viscosity`` scales the viscous forces of a jump
    (:mod:`fem_models.chain.jump`); where a jump ends does not depend on it.
    """

    bristle_ratio: float = 20.0
    max_step_mm: float = 0.1
    max_force_step: float = 0.25
    max_halvings: int = 20
    newton_iterations: int = 40
    tolerance: float = 1e-10
    viscosity: float = 1.0


class SectionParameters(NamedTuple):
    """Scalars of a superelastic section: :class:`fem_models.joint.superelastic_section.SuperelasticSection`."""

    length: float
    root: float  # compliance of the roots
    elastic: float  # axial stiffness in addition to the fibres
    rest: float  # elongation under preload, where the tendons have their lengths
    young: float
    upper: float
    lower: float
    span: float
    climb: float


class NitinolParameters(NamedTuple):
    """The same of a section that differs between tension and compression, or heats itself."""

    length: float
    root: float
    elastic: float
    rest: float
    young: float
    upper: float
    lower: float
    span: float
    climb: float
    upper_pressed: float  # in compression
    lower_pressed: float
    heat: float  # of the transformed strain, K/mm^2; 0 for a section that does not heat itself
    rise: float  # of the plateaus, MPa/K
    heating_time: float


NO_SECTION = SectionParameters(1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 0.0)


class Parameters(NamedTuple):
    """A rig as the kernels see it; N, mm, rad, s.

    Of joints that differ, what is a joint's own is here that of the first one, and in ``each`` that of all.
    """

    preload: Pair
    arm: Pair  # negative of tendon b
    segment: Pair  # EA over pitch
    free: Pair  # EA over the free length between wheel and base
    toe: Pair
    bristle: Pair  # stiffness of a sticking guide
    creep: Pair  # stretch that comes with time, mm per N above the preload
    load_control: bool  # the drive is the tension of tendon a at the wheel, N, in place of a displacement, mm
    rest: float  # angle of every joint without load
    scale: float  # of the forces
    bending: float  # stiffness of a joint
    elastic: float  # of its spring part, straight
    hardening: Hardening
    hardened: float  # stiffness that grows
    half_gap: float  # of the even part of the path over a notch
    axial: float  # compliance of a joint in compression; with a superelastic section, of what is in series
    capstan: float
    guide: float
    sheath: float
    rest_wrap: float
    contact_angle: float
    contact_stiffness: float
    contact_both: bool  # in both directions; else for positive angles only
    weight_x: float  # of a ring, along the straight tube
    weight_y: float
    tip_x: float  # dead force on the tip, along the straight tube
    tip_y: float
    stop_y: float
    stop_stiffness: float
    pitch: float
    drag_sheath: float  # N s/mm
    drag_joint: float  # Nmm s/rad
    tolerance: float  # of the residual, N
    viscosity: float  # of a jump: of a joint, Nmm/rad
    section: SectionParameters | NitinolParameters  # of a rig whose memory has fibres
    each: Floats | tuple[()] = ()  # (N, COLUMNS) of joints that differ, else empty: see fem_models.chain.each


class Memory(NamedTuple):
    """Dry elements: rest points of guides (2, N), Jenkins (j, N), flags (k, N), fibres (N, f); and their parameters.

    With :class:`NitinolParameters` the fibres of a joint have one more column: its temperature above the surroundings.
    The parameters are those of all joints, of Jenkins elements those of the first. Fibres have one row of heights and
    areas for each joint, or one for all equal ones.
    """

    guides: Floats
    jenkins: Floats
    jenkins_stiffness: Floats  # (j,)
    slip_moment: Floats  # (j,)
    flags: Floats
    flag_stiffness: Floats  # (k,)
    flag_upper: Floats  # (k,)
    flag_lower: Floats  # (k,)
    flag_span: Floats  # (k,)
    flag_climb: Floats  # (k,)
    fibres: Floats
    fibre_height: Floats  # (1, f) or (N, f)
    fibre_area: Floats


def _pair(values: list[float]) -> Pair:
    """Of tendons a and b; zero for a tendon that is not there."""
    a, b = [float(value) for value in values] + [0.0] * (2 - len(values))
    return a, b


def chain_parameters(rig: Rig, joints: JointRow, settings: ChainSettings, *, load_control: bool = False) -> Parameters:
    """Reduce a rig to what the kernels need, but for ``each`` (:func:`fem_models.chain.each.with_each`)."""
    joint, pitch = joints.first, rig.mean_pitch_mm
    flexure, arms, dry, tendons = joint.flexure, joint.arms_mm, rig.friction, rig.tendons
    scale, spring = joints.force_scale_N, joint.elastic_Nmm_per_rad
    stop, weight, tip = rig.tip_stop, ring_weight_N(rig), tip_force_N(rig)
    segment = _pair([tendon.EA_N / pitch for tendon in tendons])
    creep = rig.creep.fraction if rig.creep else 0.0
    stiffest = max(1.0, settings.bristle_ratio) * max(tendon.EA_N for tendon in tendons)
    return Parameters(
        preload=_pair([rig.preload_N] * len(tendons)),
        arm=(arms.a, -arms.b),
        segment=segment,
        free=_pair([tendon.EA_N / tendon.free_length_mm for tendon in tendons]),
        toe=_pair([tendon.toe_N for tendon in tendons]),
        bristle=_pair(
            [
                1 / (1 / (settings.bristle_ratio * one) + dry.stick_compliance_mm_per_N) if one else 0.0
                for one in segment
            ]
        ),
        creep=_pair([creep * tendon.free_length_mm / tendon.EA_N for tendon in tendons]),
        load_control=load_control,
        rest=joint.rest_angle_rad,
        scale=float(scale),
        bending=float(flexure.bending_Nmm_per_rad),
        elastic=joint.spring_Nmm_per_rad,
        hardening=joint.hardening,
        hardened=spring,
        half_gap=0.5 * joint.rigid_gap_mm,
        axial=joint.axial_compliance,
        capstan=float(dry.capstan_coefficient),
        guide=float(dry.guide_N),
        sheath=float(dry.sheath_N),
        rest_wrap=math.radians(dry.rest_wrap_deg),
        contact_angle=min(float(one.contact_angle_rad) for one in joints.each[: None if not joints.alike else 1]),
        contact_stiffness=contact_spring(rig, joint),
        contact_both=not joint.one_sided,
        weight_x=weight[0],
        weight_y=weight[1],
        tip_x=tip[0],
        tip_y=tip[1],
        stop_y=float(stop.y_mm) if stop else math.inf,
        stop_stiffness=float(stop.stiffness_N_per_mm) if stop else 0.0,
        pitch=float(pitch),
        drag_sheath=float(rig.drag.sheath_N_s_per_mm) if rig.drag else 0.0,
        drag_joint=float(rig.drag.joint_Nmm_s_per_rad) if rig.drag else 0.0,
        # rounding of a slip times the stiffest spring is the least residual there can be
        tolerance=max(settings.tolerance * scale, 1e-14 * stiffest),
        viscosity=settings.viscosity * float(flexure.bending_Nmm_per_rad),
        section=section_parameters(rig, joint),
    )


def contact_spring(rig: Rig, joint: JointMechanics) -> float:
    """Stiffness of the edges of a notch that touch, with the ring in series, Nmm/rad; 0 without closure."""
    return joint.with_ring(rig.closure.stiffness_Nmm_per_rad) if rig.closure else 0.0


def is_nitinol(section: SuperelasticSection) -> bool:
    """Whether a section has :class:`NitinolParameters`."""
    return section.heating is not None or section.upper_pressed != section.upper


def section_parameters(rig: Rig, joint: JointMechanics) -> SectionParameters | NitinolParameters:
    """Scalars of a joint's superelastic section; :data:`NO_SECTION` without one."""
    if (section := joint.section) is None:
        return NO_SECTION
    alike = (  # in the order of the fields; a kernel is compiled anew for integers
        section.length_mm,
        section.root_compliance,
        section.elastic_N_per_mm,
        elongation_under_mm(section, len(rig.tendons) * rig.preload_N),
        section.young,
        section.upper,
        section.lower,
        section.span,
        section.climb,
    )
    if not is_nitinol(section):
        return SectionParameters(*map(float, alike))
    heating = section.heating or Heating(0.0, 0.0, 1.0)
    return NitinolParameters(*map(float, (*alike, section.upper_pressed, section.lower_pressed, *heating)))


def memory_at_rest(rig: Rig, joints: JointRow) -> Memory:
    """Dry elements of a rig that has not moved yet."""
    n, joint = rig.joints, joints.first
    jenkins = joint.jenkins
    fibres, share = joint.fibres, 1 - rig.material.loop_share  # the share that the Jenkins elements leave
    sections = [one.section for one in (joints.each[:1] if joints.alike else joints.each) if one.section is not None]
    count = sections[0].area_mm2.size if sections else 0
    return Memory(
        guides=np.zeros((2, n)),
        jenkins=np.full((jenkins.stiffness.size, n), joint.rest_angle_rad),
        jenkins_stiffness=jenkins.stiffness,
        slip_moment=jenkins.slip_moment_Nmm,
        flags=np.zeros((fibres.stiffness.size, n)),
        flag_stiffness=share * fibres.stiffness,
        flag_upper=share * fibres.upper_Nmm,
        flag_lower=share * fibres.lower_Nmm,
        flag_span=fibres.span_rad,
        flag_climb=share * fibres.slope,
        fibres=np.zeros((n, count + (joint.section is not None and is_nitinol(joint.section)))),
        fibre_height=np.array([section.height_mm for section in sections]).reshape(len(sections), count),
        fibre_area=np.array([section.area_mm2 for section in sections]).reshape(len(sections), count),
    )
