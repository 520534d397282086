"""A wrist in space as the kernels take it: N joints, m tendons; N, mm, rad.

Vectors of a joint are in its own frame, those of a ring and of the loads in the frame of the tube.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from fem_models.joint.friction import jenkins_elements
from fem_models.rig.layout import Space
from fem_models.rig.rig import Material
from fem_models.spatial.rig import SpatialJoint, SpatialRig, SpatialTendon
from fem_models.spatial.tables import (
    ARM,
    BRISTLE,
    BY_FORCE,
    CARRIED,
    CONTACT,
    CROSSING,
    ELEMENTS,
    FRAME,
    FREE,
    GIVE,
    HALF,
    INWARD,
    JOINT,
    LENGTH,
    LOOP,
    ONWARD,
    PRELOAD,
    REST,
    SEGMENT,
    SHEARS,
    SLIP,
    SPRING,
    STEP,
    TENDON,
    THRUST,
    TOE,
    TURNING,
)
from hysteresis.arrays import Floats


@dataclass(frozen=True)
class SpatialSettings:
    """Numerical settings, those of :class:`fem_models.chain.ChainSettings` but for the iterations.

    Guides find their states within an iteration, and few steps take more than five: one that takes twenty will fail.

    ``max_force_step`` bounds a step of a tension, over the force scale of the rig. ``viscosity`` scales the viscous
    forces of a jump; where a jump ends does not depend on it.
    """

    bristle_ratio: float = 20.0
    max_step_mm: float = 0.1
    max_force_step: float = 0.25
    max_halvings: int = 20
    newton_iterations: int = 20
    tolerance: float = 1e-10
    viscosity: float = 1.0


class Parameters(NamedTuple):
    """Constants of a run; columns of the tables are in :mod:`fem_models.spatial.tables`."""

    joints: Floats  # (N, JOINT)
    crossings: Floats  # (N, m, CROSSING)
    tendons: Floats  # (m, TENDON)
    capstan: float
    guide: float
    sheath: float
    rest_wrap: float
    weight: Space  # of one ring
    tip: Space
    loaded: bool  # whether there are dead loads
    by_arm: float  # 1/mm: a moment over the longest arm of a tendon is a force
    scale: float  # of the forces
    stiffest: float  # segment, N/mm
    tolerance: float  # of the residual, N
    viscosity: float  # of a jump: of a joint, Nmm/rad


class Memory(NamedTuple):
    """Dry elements: rest points of guides (N, m) and of Jenkins elements (N, 2 ELEMENTS)."""

    guides: Floats
    jenkins: Floats


def spatial_parameters(rig: SpatialRig, by_force: tuple[bool, ...], settings: SpatialSettings) -> Parameters:
    """Reduce a rig to what the kernels need."""
    dry, scale = rig.friction, force_scale_N(rig)
    crossings, tendons = _crossings(rig, settings), np.zeros((len(rig.tendons), TENDON))
    for row, one, force in zip(tendons, rig.tendons, by_force, strict=True):
        row[FREE], row[TOE] = one.tendon.EA_N / one.tendon.free_length_mm, one.tendon.toe_N
        row[PRELOAD], row[BY_FORCE] = rig.preload_N, force
    joints = _joints(rig)
    joints[:, THRUST] = _thrust_N(joints, crossings, rig.preload_N)
    stiffest = max(1.0, settings.bristle_ratio) * max(one.tendon.EA_N for one in rig.tendons)
    weight, tip = (tuple(float(part) for part in load) for load in (rig.loads.ring_weight_N, rig.loads.tip_N))
    return Parameters(
        joints=joints,
        crossings=crossings,
        tendons=tendons,
        capstan=float(dry.capstan_coefficient),
        guide=float(dry.guide_N),
        sheath=float(dry.sheath_N),
        rest_wrap=math.radians(dry.rest_wrap_deg),
        weight=weight,  # type: ignore[arg-type]
        tip=tip,  # type: ignore[arg-type]
        loaded=any(weight) or any(tip),
        by_arm=float(1 / np.linalg.norm(crossings[..., ARM : ARM + 3], axis=2).max()),
        scale=scale,
        stiffest=float(crossings[..., SEGMENT].max()),
        # rounding of a slip times the stiffest spring is the least residual there can be
        tolerance=max(settings.tolerance * scale, 1e-14 * stiffest),
        viscosity=settings.viscosity * min(float(joint.stiffness.weak) for joint in rig.joints),
    )


def memory_at_rest(parameters: Parameters) -> Memory:
    """Dry elements of a rig that has not moved yet."""
    rest = parameters.joints[:, REST + 1 : REST + 3]
    return Memory(np.zeros(parameters.crossings.shape[:2]), np.repeat(rest, ELEMENTS, axis=1))


def _joints(rig: SpatialRig) -> Floats:
    """Rows of :attr:`Parameters.joints`, but for the thrust."""
    out = np.zeros((len(rig.joints), JOINT))
    for row, joint, (step, half) in zip(out, rig.joints, _rings(rig), strict=True):
        turn, six = math.radians(joint.turn_deg), joint.stiffness
        spring, loop, slip = _springs(joint, rig.material)
        row[FRAME : FRAME + 2] = math.cos(turn), math.sin(turn)
        row[SPRING : SPRING + 3] = spring
        row[REST + 2] = joint.mechanics.rest_angle_rad
        row[GIVE : GIVE + 3] = 1 / six.axial, 1 / six.shear_in, 1 / six.shear_across
        row[TURNING] = joint.mechanics.turning_length_mm
        row[STEP : STEP + 3], row[HALF : HALF + 3] = step, half
        row[CONTACT : CONTACT + 3] = _contact(rig, joint)
        row[SHEARS] = joint.shear_centre_mm
        row[LOOP : LOOP + 2 * ELEMENTS], row[SLIP : SLIP + 2 * ELEMENTS] = loop.ravel(), slip.ravel()
    return out


def _crossings(rig: SpatialRig, settings: SpatialSettings) -> Floats:
    """Rows of :attr:`Parameters.crossings`."""
    holes, give = _holes(rig), rig.friction.stick_compliance_mm_per_N
    segment = np.array([[_taut_N_per_mm(tendon, joint.pitch_mm) for tendon in rig.tendons] for joint in rig.joints])
    bristle = np.array([_taut_N_per_mm(tendon, rig.mean_pitch_mm) for tendon in rig.tendons])
    out = np.zeros((*segment.shape, CROSSING))
    for at, vectors in zip((CARRIED, ARM, INWARD, ONWARD), holes, strict=True):
        out[..., at : at + 3] = vectors
    out[..., LENGTH] = _lengths_at_rest(rig.joints, holes)
    out[..., SEGMENT] = segment
    out[..., BRISTLE] = 1 / (1 / (settings.bristle_ratio * bristle) + give)
    return out


def _taut_N_per_mm(tendon: SpatialTendon, length_mm: float) -> float:
    winds = tendon.tendon.moment_arm_mm * math.radians(tendon.twist_deg_per_mm)
    return tendon.tendon.EA_N / (length_mm * math.hypot(1.0, winds))


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


def force_scale_N(rig: SpatialRig) -> float:
    """Scale of the forces of a rig: its preload, or what bends a joint by a degree where that may be little."""
    if len(rig.tendons) > 1 and rig.preload_N > 0:
        return float(rig.preload_N)
    arm = max(tendon.tendon.moment_arm_mm for tendon in rig.tendons)
    degree = math.radians(1.0) * min(joint.stiffness.weak for joint in rig.joints)
    return max(
        float(rig.preload_N), *(degree / (arm + joint.mechanics.flexure.neutral_offset_mm) for joint in rig.joints)
    )


class _Holes(NamedTuple):
    carried: Floats
    arm: Floats
    inward: Floats
    onward: Floats


def _holes(rig: SpatialRig) -> _Holes:
    """Where the tendons run, in the frames of the notches, shapes (N, m, 3).

    A hole ends at either edge of a notch, and a tendon is straight between two holes. The ring before the first notch
    is as long as that beyond it, and what would follow the last ring is like the last notch.
    """
    joints, n, m = rig.joints, len(rig.joints), len(rig.tendons)
    centre = np.cumsum([0.0, *(joint.beyond_mm for joint in joints[:-1])])
    gap = np.array([joint.mechanics.turning_length_mm + joint.mechanics.rigid_gap_mm for joint in joints])
    edges = np.stack([centre - gap / 2, centre + gap / 2], axis=1)  # (N, 2)
    at = np.concatenate([[edges[0] - joints[0].pitch_mm], edges, [edges[-1] + joints[-1].beyond_mm]])
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
    """Length of the chords at rest, shape (N, m), as of :mod:`fem_models.spatial.kernels.joint`, in its plane."""
    out = np.zeros(holes.arm.shape[:2])
    for k, joint in enumerate(joints):
        half = 0.5 * joint.mechanics.rest_angle_rad
        cs, sn = math.cos(half), math.sin(half)
        chord = holes.carried[k] * [cs, cs, 1.0] + 2 * sn * np.cross([0.0, 0.0, 1.0], holes.arm[k])
        out[k] = np.linalg.norm(chord + np.array([joint.mechanics.turning_length_mm, 0.0, 0.0]), axis=1)
    return out


def neutral_mm(rig: SpatialRig) -> Floats:
    """Place of the neutral axis of every notch in its section of the tube, shape (N, 3)."""
    offset = [[0.0, -joint.mechanics.flexure.neutral_offset_mm, 0.0] for joint in rig.joints]
    return np.array([_frame(joint) @ place for joint, place in zip(rig.joints, offset, strict=True)])


def _rings(rig: SpatialRig) -> list[tuple[Floats, Floats]]:
    """Ways from each joint to the next and to the middle of its ring, vectors (3,).

    A ring is loaded at the level of its joint's neutral axis, as in the planar chain.
    """
    neutral = neutral_mm(rig)
    beyond = np.concatenate([np.diff(neutral, axis=0), np.zeros((1, 3))])
    x = np.array([1.0, 0.0, 0.0])
    return [
        (joint.beyond_mm * x + aside, joint.to_ring_mm * x) for joint, aside in zip(rig.joints, beyond, strict=True)
    ]


def _thrust_N(joints: Floats, crossings: Floats, preload_N: float) -> Floats:
    """Pull of all tendons along the tube at rest, shape (N,)."""
    chord = crossings[..., CARRIED : CARRIED + 3] + [1.0, 0.0, 0.0] * joints[:, TURNING, None, None]
    return np.asarray(preload_N * _unit(chord)[..., 0].sum(axis=1))
