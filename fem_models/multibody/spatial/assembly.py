"""A wrist in space as Exudyn items: rings with Euler parameters, one object for their flexures, tendons, guides.

:mod:`fem_models.multibody.spatial.stepper` moves them step by step.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any, NamedTuple

import exudyn as exu
import exudyn.itemInterface as items
import numpy as np

from fem_models.multibody.assembly import SMOOTH_RATIO
from fem_models.multibody.spatial.flexures import NODE, UPRIGHT, Flexures, Strains, laws_of, notch_frames, rotate
from fem_models.spatial import SpatialRig
from hysteresis.arrays import Floats, Ints

LEAD_PITCHES = 1000
"""How far before a notch the connector of a tendon starts, over the pitch: as in the plane, and further."""


@dataclass(frozen=True)
class Layout:
    """Where everything is in the straight tube, mm: x along its axis from the middle of the ring before the notches.

    ``notches`` (N, 3) are the middles of the notches at their neutral axes. ``near`` and ``far`` (N, 3) are the ends of
    the flexures there, ``centres`` (N, 3) where rings are loaded. A tendon is straight from ``before`` to ``beyond``
    (N, m, 3) over a notch. It is straight in a ring, too: from ``base`` (m, 3) in the first one, and to ``next_before``
    (N, m, 3) in the others. ``tip`` (3,) is the middle of the last ring.
    """

    notches: Floats
    near: Floats
    far: Floats
    centres: Floats
    before: Floats
    beyond: Floats
    next_before: Floats
    base: Floats
    tip: Floats


def layout(rig: SpatialRig) -> Layout:
    """Lay the rig out straight."""
    mechanics = [joint.mechanics for joint in rig.joints]
    first, beyond = rig.joints[0].pitch_mm, np.array([joint.beyond_mm for joint in rig.joints])
    to_ring = np.array([joint.to_ring_mm for joint in rig.joints])
    middle = 0.5 * first + np.concatenate([[0.0], np.cumsum(beyond[:-1])])
    down = -np.array([one.flexure.neutral_offset_mm for one in mechanics])
    notches = notch_frames(rig)[:, :, 1] * down[:, None]
    notches[:, 0] = middle
    bends = 0.5 * np.array([one.turning_length_mm for one in mechanics])
    opens = bends + 0.5 * np.array([one.rigid_gap_mm for one in mechanics])
    along = np.array([1.0, 0.0, 0.0])
    before = np.stack([_holes(rig, x, middle[0]) for x in middle - opens])
    return Layout(
        notches=notches,
        near=notches - bends[:, None] * along,
        far=notches + bends[:, None] * along,
        centres=notches + to_ring[:, None] * along,
        before=before,
        beyond=np.stack([_holes(rig, x, middle[0]) for x in middle + opens]),
        next_before=np.concatenate([before[1:], _holes(rig, middle[-1] - opens[-1] + beyond[-1], middle[0])[None]]),
        base=_holes(rig, middle[0] + opens[0] - first, middle[0]),
        tip=(middle[-1] + to_ring[-1]) * along,
    )


def _holes(rig: SpatialRig, x_mm: float, first_mm: float) -> Floats:
    """Places of the tendons in a section of the tube, shape (m, 3); a helix counts from the first notch."""
    angle = np.radians([one.angle_deg + one.twist_deg_per_mm * (x_mm - first_mm) for one in rig.tendons])
    arm = np.array([one.tendon.moment_arm_mm for one in rig.tendons])
    return np.stack([np.full(arm.size, x_mm), arm * np.cos(angle), arm * np.sin(angle)], axis=1)


@dataclass(frozen=True)
class SpatialModel:
    """Item numbers and coordinate indices of an assembled system; tendon by tendon, base to tip."""

    mbs: Any
    rig: SpatialRig
    layout: Layout
    flexures: Flexures
    by_force: tuple[bool, ...]
    segments: Ints  # connectors, shape (m, N)
    pulls: Floats  # their stiffness where they are taut, as Exudyn takes it, (m, N)
    loads: list[DeadLoad]
    slip: Ints  # coordinates of the guides, shape (m N,)
    rings: Ints  # coordinates of the rings, shape (N, 7)
    bristle: Floats  # of the guides, shape (m, N)
    segment: Floats  # of the tendons, shape (m, N)


class DeadLoad(NamedTuple):
    """A load that keeps its direction, and its force, N."""

    number: int
    force_N: tuple[float, float, float]


def assemble(rig: SpatialRig, by_force: tuple[bool, ...], bristle_ratio: float) -> SpatialModel:
    """Build the system of a rig, straight and preloaded."""
    place, mbs = layout(rig), exu.SystemContainer().AddSystem()
    ground = mbs.AddMarker(items.MarkerNodeCoordinate(nodeNumber=mbs.AddNode(items.NodePointGround()), coordinate=0))
    straight = np.zeros((len(rig.joints), NODE))
    straight[:, :3], straight[:, 3] = place.far, 1.0
    nodes = [mbs.AddNode(items.NodeRigidBodyEP(referenceCoordinates=row)) for row in straight]
    bodies = [mbs.AddObject(items.ObjectGround())]
    bodies += [mbs.AddObject(items.ObjectRigidBody(mass=0.0, inertia=[0.0] * 6, nodeNumber=node)) for node in nodes]
    thrust = rig.preload_N * _directions(place)[..., 0].sum(axis=1)
    origins = np.concatenate([np.zeros((1, 3)), place.far])
    flexures = Flexures(laws_of(rig, thrust), place.near - origins[:-1], straight)
    mbs.AddObject(
        items.ObjectGenericODE2(
            nodeNumbers=nodes, forceUserFunction=flexures.acting, jacobianUserFunction=flexures.slopes
        )
    )
    segment, bristle = _stiffnesses(rig, bristle_ratio)
    segments, slips = list[list[int]](), list[int]()
    pulls = np.zeros(segment.T.shape)
    for j in range(len(rig.tendons)):
        own = [mbs.AddNode(items.Node1D()) for _ in rig.joints]
        for node in own:
            mbs.AddObject(items.ObjectMass1D(mass=0.0, nodeNumber=node))
        slip = [mbs.AddMarker(items.MarkerNodeCoordinate(nodeNumber=node, coordinate=0)) for node in own]
        length = _lengths_at_rest(place, flexures, j) - rig.preload_N / segment[:, j]
        numbers, pulls[j] = _add_segments(mbs, rig, place, j, (length, segment[:, j]), bodies, [*slip, ground])
        segments.append(numbers)
        slips += own
    loads = _add_loads(mbs, rig, place, bodies[1:])
    mbs.Assemble()
    rings = np.array([mbs.GetNodeODE2Index(node) for node in nodes])[:, None] + np.arange(NODE)
    return SpatialModel(
        mbs=mbs,
        rig=rig,
        layout=place,
        flexures=flexures,
        by_force=by_force,
        segments=np.array(segments),
        pulls=pulls,
        loads=loads,
        slip=np.array([mbs.GetNodeODE2Index(node) for node in slips]),
        rings=rings,
        bristle=bristle.T,
        segment=segment.T,
    )


def _directions(place: Layout) -> Floats:
    """Directions of the tendons over the notches of the straight tube, shape (N, m, 3)."""
    way = place.beyond - place.before
    return np.asarray(way / np.linalg.norm(way, axis=-1, keepdims=True))


def _stiffnesses(rig: SpatialRig, bristle_ratio: float) -> tuple[Floats, Floats]:
    """Of the tendons over the pitches and of guides that stick, shapes (N, m), N/mm.

    A sticking guide is 20 times as stiff as the tendon beside it, or gives way besides; without friction it is soft.

    A tendon is as long as its helix.
    """
    dry = rig.friction
    winds = [one.tendon.moment_arm_mm * math.radians(one.twist_deg_per_mm) for one in rig.tendons]
    strong = np.array([one.tendon.EA_N for one in rig.tendons]) / np.hypot(1.0, winds)
    segment = strong / np.array([[joint.pitch_mm] for joint in rig.joints])
    ratio = np.full_like(segment, bristle_ratio)
    if dry.capstan_coefficient == 0 and dry.guide_N == 0:
        ratio[int(dry.sheath_N > 0) :] = min(bristle_ratio, SMOOTH_RATIO)
    return segment, 1 / (rig.mean_pitch_mm / (ratio * strong) + dry.stick_compliance_mm_per_N)


def _lengths_at_rest(place: Layout, flexures: Flexures, j: int) -> Floats:
    """Lengths of a tendon over the notches as they are without load, shape (N,)."""
    rest = flexures.laws.rest
    rings = flexures.placed(Strains(np.zeros_like(rest), rest)).reshape(-1, NODE) + flexures.straight
    rings = np.concatenate([UPRIGHT[None], rings])
    origins = np.concatenate([np.zeros((1, 3)), place.far])
    before = rings[:-1, :3] + rotate(rings[:-1, 3:], place.before[:, j] - origins[:-1])
    beyond = rings[1:, :3] + rotate(rings[1:, 3:], place.beyond[:, j] - origins[1:])
    return np.asarray(np.linalg.norm(beyond - before, axis=1))


def _add_segments(
    mbs: Any,
    rig: SpatialRig,
    place: Layout,
    j: int,
    tendon: tuple[Floats, Floats],
    bodies: list[int],
    slip: list[int],
) -> tuple[list[int], list[float]]:
    """Tendon over the notches, between points of neighbouring rings; returns the connectors and their stiffness.

    It starts :data:`LEAD_PITCHES` before the notch, on the ring, where it pulls the ring as much forwards as back:
    Exudyn divides by the present length, which slip changes.

    Connectors are linear; :mod:`fem_models.multibody.spatial.equilibrium` knows which ones are slack.

    ``tendon``: length without tension over each notch, and stiffness.
    """
    origins = np.concatenate([np.zeros((1, 3)), place.far])
    numbers, pulls = list[int](), list[float]()
    for k, (length, stiff) in enumerate(zip(*tendon, strict=True)):
        before, beyond = place.before[k, j] - origins[k], place.beyond[k, j] - origins[k + 1]
        lead = LEAD_PITCHES * rig.joints[k].pitch_mm
        points = [(k, before - [lead, 0.0, 0.0]), (k, before), (k + 1, beyond)]
        path = [mbs.AddMarker(items.MarkerBodyRigid(bodyNumber=bodies[i], localPosition=at)) for i, at in points]
        unstretched = lead + length
        one = items.ObjectConnectorReevingSystemSprings(
            markerNumbers=[*path, slip[k], slip[k + 1]],
            hasCoordinateMarkers=True,
            coordinateFactors=[-1, 1],
            stiffnessPerLength=unstretched * stiff,
            referenceLength=unstretched,
            regularizationForce=-1.0,  # none
            sheavesAxes=exu.Vector3DList([[0, 0, 1]] * len(path)),
            sheavesRadii=[0.0] * len(path),
        )
        numbers.append(int(mbs.AddObject(one)))
        pulls.append(unstretched * stiff)
    return numbers, pulls


def _add_loads(mbs: Any, rig: SpatialRig, place: Layout, bodies: list[int]) -> list[DeadLoad]:
    """Weights of the rings and the force at the tip, at first without force."""
    out, at = [], place.centres - place.far
    for k, body in enumerate(bodies):
        force = np.array(rig.loads.ring_weight_N)
        if k == len(bodies) - 1:
            force = force + rig.loads.tip_N
        if force.any():
            marker = mbs.AddMarker(items.MarkerBodyPosition(bodyNumber=body, localPosition=at[k]))
            x, y, z = force.tolist()
            out.append(DeadLoad(int(mbs.AddLoad(items.LoadForceVector(markerNumber=marker))), (x, y, z)))
    return out
