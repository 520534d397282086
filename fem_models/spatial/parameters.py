"""A wrist in space as the kernels take it: N joints, m tendons; N, mm, rad.

Vectors of a joint are in its own frame, those of a ring and of the loads in the frame of the tube.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from fem_models.joint.friction import jenkins_elements
from fem_models.rig.rig import Material
from fem_models.spatial.rig import SpatialJoint, SpatialRig, SpatialTendon
from hysteresis.arrays import Floats

ELEMENTS = 3
"""Jenkins elements of a bending axis, those of :data:`fem_models.joint.friction.MATERIAL_ELEMENTS`."""


@dataclass(frozen=True)
class SpatialSettings:
    """Numerical settings, those of :class:`fem_models.chain.ChainSettings`.

    ``max_step_N`` bounds a step of a tension, over the force scale of the rig.
    """

    bristle_ratio: float = 20.0
    max_step_mm: float = 0.1
    max_force_step: float = 0.25
    max_halvings: int = 20
    newton_iterations: int = 40
    tolerance: float = 1e-10


class Parameters(NamedTuple):
    """Constants of a run."""

    turn: Floats  # (N, 2): cosine and sine of a notch's angle about the tube axis
    spring: Floats  # (N, 3): torsion, strong and weak bending, without the loop; each joint's rotations 1, 2, 3
    rest: Floats  # (N, 3): rotation vector without load
    give: Floats  # (N, 3): compliance along the tube and in both shears
    thrust: Floats  # (N, 3): force of the tendons at which a notch has its length
    turning: Floats  # (N,): length that lies along the mean direction of the rings
    carried: Floats  # (N, m, 3): what the rings carry of the way from hole to hole
    arm: Floats  # (N, m, 3): middle of the two holes of a tendon, from the centre of the joint
    inward: Floats  # (N, m, 3): direction of a tendon in the ring before
    onward: Floats  # (N, m, 3): direction in the ring beyond
    length: Floats  # (N, m): way over the notch at rest
    segment: Floats  # (N, m): EA over pitch
    bristle: Floats  # (N, m): stiffness of a sticking guide
    free: Floats  # (m,): EA over the length between wheel and base
    toe: Floats  # (m,)
    preload: Floats  # (m,)
    by_force: Floats  # (m,): 1 where the drive is a tension
    step: Floats  # (N, 3): from a joint to the next one, in the ring between
    half: Floats  # (N, 3): from a joint to the middle of its ring
    weight: Floats  # (3,): of one ring
    tip: Floats  # (3,)
    loop: Floats  # (N, 2, e): stiffness of Jenkins elements, strong and weak axis
    slip: Floats  # (N, 2, e): their slip moments
    contact: Floats  # (N, 3): angle of closure, stiffness, 1 where both sides close
    capstan: float
    guide: float
    sheath: float
    rest_wrap: float
    by_arm: float  # 1/mm: a moment over the longest arm of a tendon is a force
    scale: float  # of the forces
    stiffest: float  # segment, N/mm
    tolerance: float  # of the residual, N
    loaded: bool  # whether there are dead loads


class Memory(NamedTuple):
    """Dry elements: rest points of guides (N, m) and of Jenkins elements (N, 2, e)."""

    guides: Floats
    jenkins: Floats


def spatial_parameters(
    rig: SpatialRig, by_force: tuple[bool, ...], settings: SpatialSettings
) -> Parameters:
    """Reduce a rig to what the kernels need."""
    joints, tendons, dry = rig.joints, rig.tendons, rig.friction
    holes = _holes(rig)
    segment = np.array([[_taut_N_per_mm(tendon, joint) for tendon in tendons] for joint in joints])
    spring, loop, slip = zip(*(_springs(joint, rig.material) for joint in joints), strict=True)
    give = np.array([[1 / joint.stiffness.axial, *_shears(joint)] for joint in joints])
    scale = _force_scale_N(rig)
    stiffest = max(1.0, settings.bristle_ratio) * max(one.tendon.EA_N for one in tendons)
    step, half = _rings(rig)
    parameters = Parameters(
        turn=np.array([[math.cos(math.radians(j.turn_deg)), math.sin(math.radians(j.turn_deg))] for j in joints]),
        spring=np.array(spring),
        rest=np.array([[0.0, 0.0, joint.mechanics.rest_angle_rad] for joint in joints]),
        give=give,
        thrust=np.zeros((len(joints), 3)),
        turning=np.array([joint.mechanics.turning_length_mm for joint in joints]),
        carried=holes.carried,
        arm=holes.arm,
        inward=holes.inward,
        onward=holes.onward,
        length=_lengths_at_rest(joints, holes),
        segment=segment,
        bristle=1 / (1 / (settings.bristle_ratio * segment) + dry.stick_compliance_mm_per_N),
        free=np.array([one.tendon.EA_N / one.tendon.free_length_mm for one in tendons]),
        toe=np.array([float(one.tendon.toe_N) for one in tendons]),
        preload=np.full(len(tendons), float(rig.preload_N)),
        by_force=np.array([float(force) for force in by_force]),
        step=step,
        half=half,
        weight=np.array(rig.loads.ring_weight_N, dtype=float),
        tip=np.array(rig.loads.tip_N, dtype=float),
        loop=np.array(loop),
        slip=np.array(slip),
        contact=np.array([_contact(rig, joint) for joint in joints]),
        capstan=float(dry.capstan_coefficient),
        guide=float(dry.guide_N),
        sheath=float(dry.sheath_N),
        rest_wrap=math.radians(dry.rest_wrap_deg),
        by_arm=float(1 / np.linalg.norm(holes.arm, axis=2).max()),
        scale=scale,
        stiffest=float(segment.max()),
        tolerance=max(settings.tolerance * scale, 1e-14 * stiffest),
        loaded=any(rig.loads.ring_weight_N) or any(rig.loads.tip_N),
    )
    parameters.thrust[:, 0] = _thrust_N(parameters)
    return parameters


def memory_at_rest(parameters: Parameters) -> Memory:
    """Dry elements of a rig that has not moved yet."""
    jenkins = np.zeros_like(parameters.loop)
    jenkins[:] = parameters.rest[:, 1:, None]
    return Memory(np.zeros_like(parameters.bristle), jenkins)


def _taut_N_per_mm(tendon: SpatialTendon, joint: SpatialJoint) -> float:
    winds = tendon.tendon.moment_arm_mm * math.radians(tendon.twist_deg_per_mm)
    return tendon.tendon.EA_N / (joint.pitch_mm * math.hypot(1.0, winds))


def _shears(joint: SpatialJoint) -> tuple[float, float]:
    return 1 / joint.stiffness.shear_in, 1 / joint.stiffness.shear_across


def _springs(joint: SpatialJoint, material: Material) -> tuple[list[float], Floats, Floats]:
    """Springs of the three rotations, and the loop of both bending axes, (2, e) each; the ring is in series."""
    (bends, twists), six = joint.ring, joint.stiffness
    strong, weak = jenkins_elements(material, six.strong), jenkins_elements(material, six.weak)
    loop = np.zeros((2, 2, ELEMENTS))
    if material.loop_share > 0:
        loop[0] = strong.stiffness, weak.stiffness
        loop[1] = strong.slip_moment_Nmm, weak.slip_moment_Nmm
    springs = [(six.torsion, twists), (strong.elastic_Nmm_per_rad, bends), (weak.elastic_Nmm_per_rad, bends)]
    return [spring * ring / (ring + spring) for spring, ring in springs], loop[0], loop[1]


def _contact(rig: SpatialRig, joint: SpatialJoint) -> tuple[float, float, float]:
    stiff, ring = rig.contact_Nmm_per_rad, joint.ring[0]
    return joint.mechanics.contact_angle_rad, ring * stiff / (ring + stiff), float(not joint.mechanics.one_sided)


def _force_scale_N(rig: SpatialRig) -> float:
    if len(rig.tendons) > 1 and rig.preload_N > 0:
        return float(rig.preload_N)
    arm = max(tendon.tendon.moment_arm_mm for tendon in rig.tendons)
    degree = math.radians(1.0) * min(joint.stiffness.weak for joint in rig.joints)
    return max(float(rig.preload_N), *(degree / (arm + joint.mechanics.flexure.neutral_offset_mm) for joint in rig.joints))


class _Holes(NamedTuple):
    carried: Floats
    arm: Floats
    inward: Floats
    onward: Floats


def _holes(rig: SpatialRig) -> _Holes:
    """Where the tendons run, in the frames of the notches, shapes (N, m, 3).

    A hole ends at either edge of a notch, and a tendon is straight between two holes. The first ring is as long as the
    others, and so is the one that would follow the last.
    """
    joints, n, m = rig.joints, len(rig.joints), len(rig.tendons)
    centre = np.cumsum([0.0, *(joint.pitch_mm for joint in joints[1:])])
    gap = np.array([joint.mechanics.turning_length_mm + joint.mechanics.rigid_gap_mm for joint in joints])
    edges = np.stack([centre - gap / 2, centre + gap / 2], axis=1)  # (N, 2)
    at = np.concatenate([[edges[0] - joints[0].pitch_mm], edges, [edges[-1] + joints[-1].pitch_mm]])
    holes = np.zeros((n + 2, 2, m, 3))  # in the frame of the tube
    holes[..., 0] = at[..., None]
    for j, one in enumerate(rig.tendons):
        angle = np.radians(one.angle_deg + one.twist_deg_per_mm * at)
        holes[:, :, j, 1] = one.tendon.moment_arm_mm * np.cos(angle)
        holes[:, :, j, 2] = one.tendon.moment_arm_mm * np.sin(angle)
    out = _Holes(*(np.zeros((n, m, 3)) for _ in range(4)))
    for k, joint in enumerate(joints):
        frame = _frame(joint)
        proximal, distal = holes[k + 1] @ frame
        offset = np.array([0.0, joint.mechanics.flexure.neutral_offset_mm, 0.0])  # from the neutral axis
        out.carried[k] = distal - proximal - [joint.mechanics.turning_length_mm, 0.0, 0.0]
        out.arm[k] = [0.0, 1.0, 1.0] * (0.5 * (proximal + distal) + offset)
        out.inward[k] = _unit((holes[k + 1, 0] - holes[k, 1]) @ frame)
        out.onward[k] = _unit((holes[k + 2, 0] - holes[k + 1, 1]) @ frame)
    return out


def _frame(joint: SpatialJoint) -> Floats:
    """Axes of a notch as columns, in the frame of the tube."""
    cs, sn = math.cos(math.radians(joint.turn_deg)), math.sin(math.radians(joint.turn_deg))
    return np.array([[1.0, 0.0, 0.0], [0.0, cs, -sn], [0.0, sn, cs]])


def _unit(vectors: Floats) -> Floats:
    return np.asarray(vectors / np.linalg.norm(vectors, axis=-1, keepdims=True))


def _lengths_at_rest(joints: tuple[SpatialJoint, ...], holes: _Holes) -> Floats:
    """Length of the chords of bare notches, shape (N, m): :mod:`fem_models.spatial.joint` in the plane of axis 2."""
    out = np.zeros(holes.arm.shape[:2])
    for k, joint in enumerate(joints):
        half = 0.5 * joint.mechanics.rest_angle_rad
        cs, sn = math.cos(half), math.sin(half)
        chord = holes.carried[k] * [cs, cs, 1.0] + 2 * sn * np.cross([0.0, 0.0, 1.0], holes.arm[k])
        out[k] = np.linalg.norm(chord + [joint.mechanics.turning_length_mm, 0.0, 0.0], axis=1)
    return out


def neutral_mm(rig: SpatialRig) -> Floats:
    """Place of the neutral axis of every notch in its section of the tube, shape (N, 3)."""
    offset = [[0.0, -joint.mechanics.flexure.neutral_offset_mm, 0.0] for joint in rig.joints]
    return np.array([_frame(joint) @ place for joint, place in zip(rig.joints, offset, strict=True)])


def _rings(rig: SpatialRig) -> tuple[Floats, Floats]:
    """Ways from a joint to the next and to the middle of its ring, shapes (N, 3).

    A ring is loaded at the level of its joint's neutral axis, as in the planar chain.
    """
    pitch = np.array([[joint.pitch_mm, 0.0, 0.0] for joint in rig.joints])
    neutral = neutral_mm(rig)
    step = pitch.copy()
    step[:-1] += np.diff(neutral, axis=0)
    return step, 0.5 * pitch


def _thrust_N(parameters: Parameters) -> Floats:
    """Pull of all tendons along the tube at rest, shape (N,)."""
    chord = parameters.carried + [1.0, 0.0, 0.0] * parameters.turning[:, None, None]
    return np.asarray((_unit(chord)[..., 0] * parameters.preload).sum(axis=1))
