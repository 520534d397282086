"""The rig as Exudyn items: rings, flexures, ropes, guides, wheel.

:mod:`fem_models.multibody.quasi_static` moves them step by step, :mod:`fem_models.multibody.dynamic` in time.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from itertools import pairwise
from typing import Any

import exudyn as exu
import exudyn.itemInterface as items
import numpy as np
from exudyn.utilities import CreateSymbolicUserFunction
from numpy.typing import NDArray

from fem_models.joint.contact import closes_one_way, contact_angle_rad, ring_weight_N
from fem_models.joint.flexure import (
    flexure,
    force_scale_N,
    moment_arms_mm,
    rigid_gap_mm,
    ring_stiffness,
    turning_length_mm,
)
from fem_models.joint.friction import jenkins_elements
from fem_models.joint.superelastic import flag_fibres
from fem_models.rig.rig import Rig, Tendon

COMPRESSION = 0.00025  # of the preload: a slack segment pushes with no more, which keeps the tangent regular
OPEN_STIFFNESS = 1e-9  # of EA/pitch: keeps a slip coordinate determined where rope is slack and nothing holds it


@dataclass(frozen=True)
class Ring:
    """One ring: its body, whose node stands at an end of it, and the way along x from there to its centre."""

    node: int
    body: int
    centre_mm: float


@dataclass(frozen=True)
class RingInertia:
    """Mass of a ring, tonnes, and its moment of inertia about the centre, tonne mm^2."""

    mass_t: float
    about_centre_t_mm2: float


MASSLESS = RingInertia(0.0, 0.0)


@dataclass(frozen=True)
class Model:
    """Item numbers and coordinate indices of an assembled system."""

    mbs: Any
    wheel: int
    free_spans: list[int]  # one connector a tendon: wheel to base; none where forces pull
    pulls: list[int]  # those forces, one a tendon
    segments: list[int]  # tendon a then b, base to tip
    guides: list[int]  # friction connectors, the same order
    beams: list[int]  # flexures, base to tip
    jenkins: list[int]  # element by element, joint by joint
    flags: list[int]  # the same
    dashpots: list[int]  # of tendon a and b at the base, then joint by joint; none where the rig has no drag
    slip: NDArray[np.int64]  # coordinates of the guides
    rings: NDArray[np.int64]  # first coordinates (x, y, turn) of the rings, base first
    rotation: NDArray[np.int64]  # coordinates of ring rotations, base first
    near_rotation: NDArray[np.int64]  # of the near end of each flexure
    centre_mm: NDArray[np.float64]  # of the rings, from their nodes along x
    tip: Ring


def _stick_slip(mbs: Any, t: Any, i: Any, u: Any, v: Any, k: Any, open_stiffness: Any, rest: Any, vo: Any, fd: Any,
                limit: Any, ve: Any, fv: Any, rv: Any) -> Any:  # fmt: skip
    return exu.symbolic.min(exu.symbolic.max(k * (u - rest), -limit), limit) + open_stiffness * u


def _toe(mbs: Any, t: Any, i: Any, u: Any, v: Any, k: Any, d: Any, preload: Any, vo: Any, fd: Any, limit: Any,
         ve: Any, fv: Any, rv: Any) -> Any:  # fmt: skip
    return preload * exu.symbolic.exp(k * u)


def _tension_only(mbs: Any, t: Any, i: Any, u: Any, v: Any, k: Any, d: Any, rest: Any, vo: Any, fd: Any, limit: Any,
                  ve: Any, fv: Any, rv: Any) -> Any:  # fmt: skip
    return exu.symbolic.max(k * (u - rest), OPEN_STIFFNESS * k * (u - rest))


def _flag(mbs: Any, t: Any, i: Any, u: Any, v: Any, k: Any, climb: Any, rest: Any, residual: Any, lower: Any,
          upper: Any, ve: Any, span: Any, rv: Any) -> Any:  # fmt: skip
    """Elastic line from the rest angle, between the loading and the unloading branch of the flag, on either side.

    ``lower`` and ``upper`` are where the plateaus' lines would start at no angle; they climb by ``climb``.
    """
    low, high = exu.symbolic.min, exu.symbolic.max
    x = u - residual
    ahead, back = high(x, 0.0), high(-x, 0.0)
    line = k * (x - rest)

    def held(line: Any, x: Any) -> Any:
        full = k * (x - span)
        return low(high(line, high(low(k * x, climb * x + lower), full)), high(low(k * x, climb * x + upper), full))

    return high(held(line, ahead), 0.0) - high(held(-line, back), 0.0)


def _closed_both_ways(mbs: Any, t: Any, i: Any, u: Any, v: Any, k: Any, d: Any, angle: Any, vo: Any, fd: Any, fs: Any,
                      ve: Any, fv: Any, rv: Any) -> Any:  # fmt: skip
    return k * (exu.symbolic.max(u - angle, 0.0) - exu.symbolic.max(-u - angle, 0.0))


def _closed_one_way(mbs: Any, t: Any, i: Any, u: Any, v: Any, k: Any, d: Any, angle: Any, vo: Any, fd: Any, fs: Any,
                    ve: Any, fv: Any, rv: Any) -> Any:  # fmt: skip
    return k * exu.symbolic.max(u - angle, 0.0)


def _stop(mbs: Any, t: Any, i: Any, u: Any, v: Any, k: Any, d: Any, offset: Any) -> Any:
    # u comes with the offset already taken off (seen in Exudyn 1.13.6; its documentation says otherwise)
    return [0.0 * u[0], k[1] * exu.symbolic.max(u[1], 0.0), 0.0 * u[2]]


def _stop_below(mbs: Any, t: Any, i: Any, u: Any, v: Any, k: Any, d: Any, offset: Any) -> Any:
    return [0.0 * u[0], -k[1] * exu.symbolic.max(-u[1], 0.0), 0.0 * u[2]]


def _nonlinear_spring(mbs: Any, law: Any, **fields: Any) -> int:
    spring = mbs.AddObject(items.ObjectConnectorCoordinateSpringDamperExt(**fields))
    symbolic = CreateSymbolicUserFunction(mbs, law, "springForceUserFunction", spring)
    mbs.SetObjectParameter(spring, "springForceUserFunction", symbolic)
    return int(spring)


def _scalar_node(mbs: Any) -> tuple[int, int]:
    node = mbs.AddNode(items.Node1D())
    mbs.AddObject(items.ObjectMass1D(mass=0.0, nodeNumber=node))
    return node, mbs.AddMarker(items.MarkerNodeCoordinate(nodeNumber=node, coordinate=0))


def _add_free_span(mbs: Any, tendon: Tendon, preload_N: float, base: int, wheel: int, radius_mm: float) -> int:
    """Rope between wheel and base; the toe region is an exponential spring in series with the linear rope.

    Integrating dT/ds = k T / (T + toe) gives s = [(T - T0) + toe ln(T/T0)] / k: two springs in series.
    """
    k = tendon.EA_N / tendon.free_length_mm
    if tendon.toe_N == 0:
        return _nonlinear_spring(
            mbs, _tension_only, markerNumbers=[base, wheel], factor1=radius_mm, stiffness=k, offset=-preload_N / k
        )
    _, knot = _scalar_node(mbs)
    _nonlinear_spring(mbs, _toe, markerNumbers=[base, knot], stiffness=k / tendon.toe_N, offset=preload_N)
    linear = items.ObjectConnectorCoordinateSpringDamperExt(
        markerNumbers=[knot, wheel], factor1=radius_mm, stiffness=k, offset=-preload_N / k
    )
    return int(mbs.AddObject(linear))


def _ring(mbs: Any, x_mm: float, moved_mm: float, centre_mm: float, inertia: RingInertia) -> Ring:
    node = mbs.AddNode(items.NodeRigidBody2D(referenceCoordinates=[x_mm, 0, 0], initialCoordinates=[moved_mm, 0, 0]))
    body = items.ObjectRigidBody2D(
        mass=inertia.mass_t,
        inertia=inertia.about_centre_t_mm2 + inertia.mass_t * centre_mm**2,  # Exudyn takes it about the node
        centerOfMass=[centre_mm, 0],
        nodeNumber=node,
    )
    return Ring(node, mbs.AddObject(body), centre_mm)


def _add_beam(mbs: Any, ends: list[int], length_mm: float, bending: float, axial: float, shear: float) -> int:
    """Element with given mid-point stiffnesses: Nmm/rad, N/mm, N/mm."""
    beam = items.ObjectBeamGeometricallyExact2D(
        nodeNumbers=ends,
        length=length_mm,
        bendingStiffness=bending * length_mm,
        axialStiffness=axial * length_mm,
        shearStiffness=shear * length_mm,
    )
    return int(mbs.AddObject(beam))


@dataclass(frozen=True)
class _Backbone:
    """Rings from base to tip; nodes and shortening of the pitches under preload; Jenkins connectors."""

    rings: list[Ring]
    near_nodes: list[int]  # of each flexure, towards the base; the far one is its ring's
    shortening_mm: list[float]
    beams: list[int]
    jenkins: list[int]  # element by element, joint by joint
    flags: list[int]
    dashpots: list[int]  # joint by joint


def _dashpot(mbs: Any, markers: list[int]) -> int:
    """Linear connector whose constants are put by whoever moves the rig."""
    return int(mbs.AddObject(items.ObjectConnectorCoordinateSpringDamper(markerNumbers=markers)))


def _add_backbone(mbs: Any, rig: Rig, ground: int, inertia: RingInertia) -> _Backbone:
    joint = flexure(rig)
    p, bend = rig.pitch_mm, turning_length_mm(rig)
    length = p - bend
    ring_bending, ring_axial, ring_shear = ring_stiffness(rig)
    axial, shear = joint.axial_N_per_mm or ring_axial, joint.shear_N_per_mm or ring_shear
    elastic, stiffness, _ = jenkins_elements(rig.material, joint.bending_Nmm_per_rad)
    thrust = rig.preload_N * sum(taut(rig, rope) for rope in rig.tendons)
    rings = [_ring(mbs, length / 2, 0.0, -length / 2, MASSLESS)]
    for axis in range(3):
        fixed = mbs.AddMarker(items.MarkerNodeCoordinate(nodeNumber=rings[0].node, coordinate=axis))
        mbs.AddObject(items.ObjectConnectorCoordinate(markerNumbers=[ground, fixed]))
    near, beams, moved = [rings[0].node], [], 0.0
    bending = 0.0 if rig.superelastic else elastic  # flags take the place of the spring
    for i in range(1, rig.joints + 1):
        moved -= thrust / axial
        rings.append(_ring(mbs, i * p - length / 2, moved, length / 2, inertia))
        beams.append(_add_beam(mbs, [near[-1], rings[-1].node], bend, bending, axial, shear))
        if i == rig.joints:
            break
        moved -= thrust / ring_axial
        end = items.NodeRigidBody2D(referenceCoordinates=[i * p + length / 2, 0, 0], initialCoordinates=[moved, 0, 0])
        near.append(mbs.AddNode(end))
        _add_beam(mbs, [rings[-1].node, near[-1]], length, ring_bending, ring_axial, ring_shear)
    turn = [
        [mbs.AddMarker(items.MarkerNodeCoordinate(nodeNumber=n, coordinate=2)) for n in (a, ring.node)]
        for a, ring in zip(near, rings[1:], strict=True)
    ]
    fibres, share = flag_fibres(rig).stiffness, 1 - rig.material.loop_share
    if rig.closure is not None:
        law = _closed_one_way if closes_one_way(rig) else _closed_both_ways
        for m in turn:
            _nonlinear_spring(
                mbs, law, markerNumbers=m, stiffness=rig.closure.stiffness_Nmm_per_rad, offset=contact_angle_rad(rig)
            )
    return _Backbone(
        rings=rings,
        near_nodes=near,
        shortening_mm=[thrust / axial] + [thrust / axial + thrust / ring_axial] * (rig.joints - 1),
        beams=beams,
        jenkins=[_nonlinear_spring(mbs, _stick_slip, markerNumbers=m, stiffness=k) for k in stiffness for m in turn],
        flags=[_nonlinear_spring(mbs, _flag, markerNumbers=m, stiffness=share * k) for k in fibres for m in turn],
        dashpots=[_dashpot(mbs, m) for m in turn] if rig.drag else [],
    )


def taut(rig: Rig, tendon: Tendon) -> float:
    """Length of the preloaded rope over its length at rest.

    Slip at a guide counts stretched rope, a segment's reference length unstretched rope: without the factor a rope
    that only slides would change its tension by T0/EA of the slip. The segments' forces carry the factor too, so
    that what acts on the slip is the tension itself (the rings feel T0/EA too much: 1e-3).
    """
    return 1 + rig.preload_N / tendon.EA_N


def _add_segments(mbs: Any, rig: Rig, tendon: Tendon, y_mm: float, backbone: _Backbone, slip: list[int]) -> list[int]:
    """Rope from guide to guide: through the ring's hole, across the notch, into the next ring's hole.

    ``y_mm`` is where the rope runs, from the neutral axis of the flexures, on which the ring nodes lie. ``slip`` are
    the markers of the rope's way past each guide towards the wheel, the anchor at the tip last.
    """
    stretched, half_turn = taut(rig, tendon), 0.5 * math.radians(rig.precurvature_deg)
    half_gap = 0.5 * rigid_gap_mm(rig)  # at either end of a notch
    half_hole = 0.5 * (rig.pitch_mm - turning_length_mm(rig)) - half_gap
    shorter = 2 * (y_mm * math.sin(half_turn) + half_gap * (1 - math.cos(half_turn)))  # the path, at rest
    out = []
    for i, (near, far) in enumerate(pairwise(backbone.rings)):
        points = [(near, 0.0), (near, half_hole), (far, -half_hole), (far, 0.0)]
        path = [
            mbs.AddMarker(items.MarkerBodyRigid(bodyNumber=ring.body, localPosition=[ring.centre_mm + x, y_mm, 0]))
            for ring, x in points
        ]
        segment = items.ObjectConnectorReevingSystemSprings(
            markerNumbers=[*path, slip[i], slip[i + 1]],
            hasCoordinateMarkers=True,
            coordinateFactors=[-1 / stretched, 1 / stretched],
            stiffnessPerLength=stretched * tendon.EA_N,
            referenceLength=(rig.pitch_mm - backbone.shortening_mm[i] - shorter) / stretched,
            regularizationForce=COMPRESSION * force_scale_N(rig),
            sheavesAxes=exu.Vector3DList([[0, 0, 1]] * len(path)),
            sheavesRadii=[0.0] * len(path),
        )
        out.append(int(mbs.AddObject(segment)))
    return out


def _add_surroundings(mbs: Any, rig: Rig, rings: list[Ring]) -> None:
    """Weight of the rings, and the stop at the tip."""
    if rig.gravity is not None:
        for ring in rings[1:]:
            centre = mbs.AddMarker(items.MarkerBodyPosition(bodyNumber=ring.body, localPosition=[ring.centre_mm, 0, 0]))
            mbs.AddLoad(items.LoadForceVector(markerNumber=centre, loadVector=[*ring_weight_N(rig), 0.0]))
    if rig.tip_stop is not None:
        tip = items.MarkerBodyPosition(bodyNumber=rings[-1].body, localPosition=[rings[-1].centre_mm, 0, 0])
        origin = mbs.AddObject(items.ObjectGround())
        markers = [mbs.AddMarker(items.MarkerBodyPosition(bodyNumber=origin)), mbs.AddMarker(tip)]
        stop = mbs.AddObject(
            items.ObjectConnectorCartesianSpringDamper(
                markerNumbers=markers,
                stiffness=[0, rig.tip_stop.stiffness_N_per_mm, 0],
                offset=[0, rig.tip_stop.y_mm, 0],
            )
        )
        push = _stop if rig.tip_stop.y_mm >= 0 else _stop_below
        law = CreateSymbolicUserFunction(mbs, push, "springForceUserFunction", stop)
        mbs.SetObjectParameter(stop, "springForceUserFunction", law)


def assemble(rig: Rig, bristle_ratio: float, inertia: RingInertia = MASSLESS, *, pulled: bool = False) -> Model:
    """Build the system of a rig, straight and preloaded; ``bristle_ratio`` as in :func:`bristle_N_per_mm`.

    ``inertia`` is that of every ring that moves; all other coordinates have no mass. ``pulled``: forces pull the
    tendons at the base, in place of the wheel.
    """
    mbs = exu.SystemContainer().AddSystem()
    ground = mbs.AddMarker(items.MarkerNodeCoordinate(nodeNumber=mbs.AddNode(items.NodePointGround()), coordinate=0))
    backbone = _add_backbone(mbs, rig, ground, inertia)
    _, wheel_marker = _scalar_node(mbs)
    wheel = mbs.AddObject(items.ObjectConnectorCoordinate(markerNumbers=[ground, wheel_marker]))
    free_spans, pulls, segments, guides, slip_nodes, dashpots = [], [], [], [], [], []
    for side, tendon, arm in zip((1, -1), rig.tendons, moment_arms_mm(rig), strict=False):
        slip = [_scalar_node(mbs) for _ in range(rig.joints)]
        markers = [m for _, m in slip]
        if pulled:
            pulls.append(int(mbs.AddLoad(items.LoadCoordinate(markerNumber=markers[0], load=rig.preload_N))))
        else:
            free_spans.append(
                _add_free_span(mbs, tendon, rig.preload_N, markers[0], wheel_marker, side * rig.wheel.radius_mm)
            )
        segments += _add_segments(mbs, rig, tendon, side * arm, backbone, [*markers, ground])
        bristle = bristle_N_per_mm(rig, tendon, bristle_ratio)
        open_stiffness = OPEN_STIFFNESS * tendon.EA_N / rig.pitch_mm
        guides += [
            _nonlinear_spring(mbs, _stick_slip, markerNumbers=[ground, m], stiffness=bristle, damping=open_stiffness)
            for m in markers
        ]
        slip_nodes += [n for n, _ in slip]
        dashpots += [_dashpot(mbs, [ground, markers[0]])] if rig.drag else []
    _add_surroundings(mbs, rig, backbone.rings)
    mbs.Assemble()
    first = np.array([mbs.GetNodeODE2Index(ring.node) for ring in backbone.rings])
    return Model(
        mbs=mbs,
        wheel=int(wheel),
        free_spans=free_spans,
        pulls=pulls,
        segments=segments,
        guides=guides,
        beams=backbone.beams,
        jenkins=backbone.jenkins,
        flags=backbone.flags,
        dashpots=dashpots + backbone.dashpots,
        slip=np.array([mbs.GetNodeODE2Index(n) for n in slip_nodes]),
        rings=first,
        rotation=first + 2,
        near_rotation=np.array([mbs.GetNodeODE2Index(n) + 2 for n in backbone.near_nodes]),
        centre_mm=np.array([ring.centre_mm for ring in backbone.rings]),
        tip=backbone.rings[-1],
    )


def bristle_N_per_mm(rig: Rig, tendon: Tendon, bristle_ratio: float) -> float:
    """Stiffness of a sticking guide: ``bristle_ratio`` times EA/pitch."""
    return bristle_ratio * tendon.EA_N / rig.pitch_mm
