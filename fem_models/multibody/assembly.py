"""The rig as Exudyn items: rings, flexures, tendons, guides, wheel.

:mod:`fem_models.multibody.stepper` moves them step by step, :mod:`fem_models.multibody.dynamic` in time.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from itertools import pairwise
from typing import Any, NamedTuple

import exudyn as exu
import exudyn.itemInterface as items
import numpy as np

import fem_models.multibody.connector_laws as laws
from fem_models.joint import JointRow
from fem_models.joint.contact import ring_weight_N, tip_force_N
from fem_models.joint.mechanics import RingStiffness
from fem_models.multibody.section import Sections, add_sections, shortening_mm
from fem_models.rig import Rig
from fem_models.rig.rig import Tendon
from hysteresis.arrays import Floats, Ints

COMPRESSION = 0.00025  # of the preload: a slack segment pushes with no more, which keeps the tangent regular

SLACK = laws.OPEN_STIFFNESS
"""Stiffness of the segments of a slack tendon over that of taut ones: as of its free length."""

Spring = items.ObjectConnectorCoordinateSpringDamperExt


@dataclass(frozen=True)
class Ring:
    """One ring: its body, whose node stands at one end of it, and the distance along x from there to its centre."""

    node: int
    body: int
    centre_mm: float


@dataclass(frozen=True)
class RingInertia:
    """Mass of a ring, tonnes, and its moment of inertia about the centre, tonne mm^2."""

    mass_t: float
    about_centre_t_mm2: float


NITINOL_T_PER_MM3 = 6.45e-9
"""Density of Nitinol, 6450 kg/m^3 (Duerig and Pelton, Materials Properties Handbook: Titanium Alloys, ASM 1994)."""

RIGID_RINGS = 1000.0
"""Stiffness of a ring between two notches over that of its section.

What the ring gives is in series with the elastic part of the bending of its joint, as in the chain and in space."""

SMOOTH_RATIO = 0.02
"""Spring of a guide without friction, over EA/pitch."""

MASSLESS = RingInertia(0.0, 0.0)


def tip_inertia(rig: Rig, ring: RingInertia) -> RingInertia:
    """Inertia of the last ring, with the mass at its centre; statics know no mass."""
    if rig.tip_mass is None or ring == MASSLESS:
        return ring
    return RingInertia(ring.mass_t + 1e-6 * rig.tip_mass.mass_g, ring.about_centre_t_mm2)


class DeadLoad(NamedTuple):
    """A load of Exudyn that keeps its direction, and its force in the bending plane, N."""

    number: int
    force_N: tuple[float, float]


class SegmentLaws(NamedTuple):
    """Parameters of the connector of a segment by what is known of its tendon.

    ``pulls`` is the law of a segment, ``taut`` that of one known to be taut: it would push as it pulls, and has no
    kink. ``slack`` is nearly nothing, in both directions; as stiff as before where :func:`keeps_tension`.
    """

    pulls: dict[str, float]
    taut: dict[str, float]
    slack: dict[str, float]


@dataclass(frozen=True)
class Model:
    """Item numbers and coordinate indices of an assembled system."""

    mbs: Any
    wheel: int
    free_spans: list[int]  # one connector a tendon, wheel to base; none under load control
    forces: list[int]  # under load control, one a tendon
    dead: list[DeadLoad]  # weight of the rings, load on the tip; none before the stepper sets them
    segments: list[int]  # tendon a then b, base to tip
    segment_laws: list[SegmentLaws]  # the same order
    guides: list[int]  # friction connectors, the same order
    beams: list[int]  # flexures, base to tip
    jenkins: list[int]  # element by element, joint by joint
    flags: list[int]  # the same
    hardening: list[int]  # joint by joint; none where flexures are linear
    fibres: list[int]  # of superelastic sections, the same
    heat: list[int]  # springs of sections that heat themselves, joint by joint
    bent: Ints  # coordinates of the sections: bending, and elongation
    longer: Ints
    dashpots: list[int]  # of tendon a and b at the base, then joint by joint; none where the rig has no drag
    slip: Ints  # coordinates of the guides
    rings: Ints  # first coordinates (x, y, rotation) of the rings, base first
    rotation: Ints  # coordinates of ring rotations, base first
    near_rotation: Ints  # of the near end of each flexure
    nodes: Ints  # first coordinates of the ends of all flexures, base to tip
    reference_mm: Floats  # their places in the straight rig without preload, shape (2, 2 N)
    centre_mm: Floats  # of the rings, from their nodes along x
    tip: Ring

    @property
    def size(self) -> int:
        """Number of coordinates."""
        return int(self.mbs.systemData.ODE2Size())

    def tensions(self, pull_N: float | None) -> Floats:
        """Shape (tendons, N+1), wheel to tip, at present; the pull is that of load control."""
        output, kind = self.mbs.GetObjectOutput, exu.OutputVariableType
        free = [output(i, kind.Force) for i in self.free_spans] if pull_N is None else [pull_N]
        segments = np.reshape([output(i, kind.ForceLocal) for i in self.segments], (len(free), -1))
        return np.column_stack([free, segments])

    def joint_angles(self, q: Floats) -> Floats:
        """Angle of each flexure at coordinates q, shape (N,); or its speed, at velocities."""
        return np.asarray(q[self.rotation[1:]] - q[self.near_rotation])

    def bent_to(self, angle_rad: float) -> Floats:
        """Coordinates of the assembled, straight rig with every joint bent to an angle."""
        q = self.with_chords(np.array(self.mbs.systemData.GetODE2Coordinates()))
        turned = angle_rad * np.arange(self.near_rotation.size)
        q[self.near_rotation], q[self.rotation[1:]] = turned, turned + angle_rad
        q[self.bent] = angle_rad
        return self.with_places(q)

    def with_chords(self, q: Floats) -> Floats:
        """Coordinates in which each node but the first has its element's chord in place of its own place.

        A chord is seen from half way between the rotations of its ends. Stiff rings keep it, however the rig turns:
        what is carried on in these coordinates does not strain them.
        """
        nodes, q = self.nodes, q.copy()
        dx, dy = np.diff(q[nodes] + self.reference_mm[0]), np.diff(q[nodes + 1] + self.reference_mm[1])
        middle = 0.5 * (q[nodes[1:] + 2] + q[nodes[:-1] + 2])
        cosine, sine = np.cos(middle), np.sin(middle)
        q[nodes[1:]], q[nodes[1:] + 1] = cosine * dx + sine * dy, cosine * dy - sine * dx
        return q

    def chord_speeds(self, q: Floats, speeds: Floats) -> Floats:
        """Speeds of :meth:`with_chords` at coordinates and their speeds."""
        nodes, out = self.nodes, speeds.copy()
        dx, dy = np.diff(q[nodes] + self.reference_mm[0]), np.diff(q[nodes + 1] + self.reference_mm[1])
        middle, turning = (0.5 * (v[nodes[1:] + 2] + v[nodes[:-1] + 2]) for v in (q, speeds))
        cosine, sine = np.cos(middle), np.sin(middle)
        vx, vy = np.diff(speeds[nodes]), np.diff(speeds[nodes + 1])
        along, across = cosine * dx + sine * dy, cosine * dy - sine * dx
        out[nodes[1:]] = cosine * vx + sine * vy + across * turning
        out[nodes[1:] + 1] = cosine * vy - sine * vx - along * turning
        return out

    def with_places(self, q: Floats) -> Floats:
        """Coordinates of the system from those of :meth:`with_chords`."""
        nodes, q = self.nodes, q.copy()
        along, across = q[nodes[1:]], q[nodes[1:] + 1]
        middle = 0.5 * (q[nodes[1:] + 2] + q[nodes[:-1] + 2])
        cosine, sine = np.cos(middle), np.sin(middle)
        steps = cosine * along - sine * across, sine * along + cosine * across
        for axis, (step, reference) in enumerate(zip(steps, self.reference_mm, strict=True)):
            first = q[nodes[0] + axis] + reference[0]
            q[nodes[1:] + axis] = first + np.cumsum(step) - reference[1:]
        return q


def _scalar_node(mbs: Any) -> tuple[int, int]:
    node = mbs.AddNode(items.Node1D())
    mbs.AddObject(items.ObjectMass1D(mass=0.0, nodeNumber=node))
    return node, mbs.AddMarker(items.MarkerNodeCoordinate(nodeNumber=node, coordinate=0))


def _add_free_span(mbs: Any, rig: Rig, side: int, base: int, wheel: int) -> int:
    """Tendon a (side 1) or b (-1) between wheel and base; the toe region is an exponential spring in series with it.

    Integrating dT/ds = k T / (T + toe) gives s = [(T - T0) + toe ln(T/T0)] / k: two springs in series.
    """
    tendon, preload_N, radius_mm = rig.tendons[0 if side > 0 else 1], rig.preload_N, side * rig.wheel.radius_mm
    k = tendon.EA_N / tendon.free_length_mm
    if tendon.toe_N == 0:
        span = Spring(markerNumbers=[base, wheel], factor1=radius_mm, stiffness=k, offset=-preload_N / k)
        return laws.add_with_law(mbs, span, laws.tension_only)
    _, knot = _scalar_node(mbs)
    toe = Spring(markerNumbers=[base, knot], stiffness=k / tendon.toe_N, offset=preload_N)
    laws.add_with_law(mbs, toe, laws.toe)
    linear = Spring(markerNumbers=[knot, wheel], factor1=radius_mm, stiffness=k, offset=-preload_N / k)
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
    """Rings from base to tip; nodes and shortening of the pitches under preload; connectors of the joints."""

    rings: list[Ring]
    near_nodes: list[int]  # of each flexure, towards the base; the far one is its ring's
    shortening_mm: list[float]
    beams: list[int]
    jenkins: list[int]  # element by element, joint by joint
    flags: list[int]
    hardening: list[int]
    sections: Sections
    dashpots: list[int]  # joint by joint


def _dashpot(mbs: Any, markers: list[int]) -> int:
    """Linear connector; the stepper sets its constants."""
    return int(mbs.AddObject(items.ObjectConnectorCoordinateSpringDamper(markerNumbers=markers)))


class _Line(NamedTuple):
    """Where the ends of rings stand in the straight tube without load, mm; rings base first.

    ``far`` are the ends beyond the notches, where the nodes of rings are, of the base too; ``near`` those before the
    second notch and all further ones; ``centres`` lead from the nodes to the middles of the rings. ``between`` are the
    lengths of the rings between two notches.
    """

    far: list[float]
    near: list[float]
    centres: list[float]
    between: list[float]


def _line(rig: Rig, joints: JointRow) -> _Line:
    n, bend = rig.joints, joints.of("turning_length_mm").tolist()
    if joints.alike:
        p, length = rig.pitch_mm, rig.pitch_mm - bend[0]
        far = [length / 2] + [i * p - length / 2 for i in range(1, n + 1)]
        near = [i * p + length / 2 for i in range(1, n)]
        return _Line(far, near, [-length / 2] + [length / 2] * n, [length] * (n - 1))
    middles, centres = joints.places
    ends = [(middle - turn / 2, middle + turn / 2) for middle, turn in zip(middles, bend, strict=True)]
    far = [ends[0][0], *(after for _, after in ends)]
    to_middle = [-far[0], *(centre - x for centre, x in zip(centres, far[1:], strict=True))]
    near = [before for before, _ in ends[1:]]
    return _Line(far, near, to_middle, [end - start for start, end in zip(far[1:], near, strict=False)])


def _add_backbone(mbs: Any, rig: Rig, joints: JointRow, ground: int, inertia: RingInertia) -> _Backbone:
    line, thrust = _line(rig, joints), rig.preload_N * len(rig.tendons)
    rings = [_ring(mbs, line.far[0], 0.0, line.centres[0], MASSLESS)]
    for axis in range(3):
        fixed = mbs.AddMarker(items.MarkerNodeCoordinate(nodeNumber=rings[0].node, coordinate=axis))
        mbs.AddObject(items.ObjectConnectorCoordinate(markerNumbers=[ground, fixed]))
    near, beams, shortening, moved, pressed = [rings[0].node], [], [], 0.0, 0.0
    for i, joint in enumerate(joints.each, start=1):
        flexure, ring = joint.flexure, joint.ring
        bending = joint.spring_Nmm_per_rad  # flags take the place of the spring
        axial, shear = flexure.axial_N_per_mm or ring.axial_N_per_mm, flexure.shear_N_per_mm or ring.shear_N_per_mm
        shorter = thrust / axial
        if joint.section is not None:  # the beam leaves bending and thrust to it
            axial, shorter = 0.0, shortening_mm(joint.section, thrust)
        moved -= shorter
        shortening.append(shorter + pressed)
        mass = inertia if i < rig.joints else tip_inertia(rig, inertia)
        rings.append(_ring(mbs, line.far[i], moved, line.centres[i], mass))
        beams.append(_add_beam(mbs, [near[-1], rings[-1].node], joint.turning_length_mm, bending, axial, shear))
        if i == rig.joints:
            break
        ring = RingStiffness(*(RIGID_RINGS * stiffness for stiffness in joints.ring_beyond(i - 1)))
        pressed = thrust / ring.axial_N_per_mm
        moved -= pressed
        end = items.NodeRigidBody2D(referenceCoordinates=[line.near[i - 1], 0, 0], initialCoordinates=[moved, 0, 0])
        near.append(mbs.AddNode(end))
        _add_beam(mbs, [rings[-1].node, near[-1]], line.between[i - 1], *ring)
    jenkins, flags, hardening, dashpots = _add_material(mbs, rig, joints, near, rings)
    return _Backbone(
        rings=rings,
        near_nodes=near,
        shortening_mm=shortening,
        beams=beams,
        jenkins=jenkins,
        flags=flags,
        hardening=hardening,
        sections=add_sections(
            mbs, joints, [(a, ring.node) for a, ring in zip(near, rings[1:], strict=True)], thrust, ground
        ),
        dashpots=dashpots,
    )


def _add_material(
    mbs: Any, rig: Rig, joints: JointRow, near: list[int], rings: list[Ring]
) -> tuple[list[int], list[int], list[int], list[int]]:
    """Add what acts by the angle of a flexure, besides its beam: contact of the edges, material, hardening, drag."""
    ends = [
        [mbs.AddMarker(items.MarkerNodeCoordinate(nodeNumber=n, coordinate=2)) for n in (a, ring.node)]
        for a, ring in zip(near, rings[1:], strict=True)
    ]
    if rig.closure is not None:
        law = laws.closed_in_one_direction if joints.first.one_sided else laws.closed_in_both_directions
        for m, joint in zip(ends, joints.each, strict=True):
            edges = joint.with_ring(rig.closure.stiffness_Nmm_per_rad)
            contact = Spring(markerNumbers=m, stiffness=edges, offset=joint.contact_angle_rad)
            laws.add_with_law(mbs, contact, law)
    share, first = 1 - rig.material.loop_share, joints.first
    jenkins = [
        laws.add_with_law(mbs, Spring(markerNumbers=m, stiffness=k), laws.stick_slip)
        for element in joints.of("jenkins.stiffness").T.tolist()
        for m, k in zip(ends, element, strict=True)
    ]
    flags = [
        laws.add_with_law(mbs, Spring(markerNumbers=m, stiffness=share * k), laws.flag)
        for k in first.fibres.stiffness
        for m in ends
    ]
    hardening = [
        laws.add_with_law(mbs, Spring(markerNumbers=m, stiffness=first.jenkins.elastic_Nmm_per_rad), laws.hardening)
        for m in (ends if not first.hardening.is_linear else [])
    ]
    return jenkins, flags, hardening, [_dashpot(mbs, m) for m in ends] if rig.drag else []


def keeps_tension(rig: Rig, tendon: Tendon) -> bool:
    """Whether a slack tendon always has some tension, however little: by its toe region, with no sheath."""
    return tendon.toe_N > 0 and rig.friction.sheath_N == 0


def _add_segments(
    mbs: Any,
    rig: Rig,
    joints: JointRow,
    side: int,
    backbone: _Backbone,
    slip: list[int],
    lead_pitches: float,
) -> list[tuple[int, SegmentLaws]]:
    """Tendon from guide to guide: through the ring's hole, across the notch, into the next ring's hole.

    Exudyn's connector divides by its present length at rest, which slip changes, so that its force would grow with the
    square of the slip. Here it starts ``lead_pitches`` before the notch, on the line of the ring's hole. There it
    pulls the ring as much forwards as back: the force on ring and tendon is the same, and nearly linear.

    Tendon a is on the side 1, tendon b on -1. The tendon lies at its arm from the neutral axis of a flexure, on which
    the ring nodes lie; of joints that differ it steps from arm to arm in the rings. ``slip`` are the markers of the
    tendon's slip at each guide towards the wheel, the anchor at the tip last.
    """
    tendon, half_angle = rig.tendons[0 if side > 0 else 1], 0.5 * joints.first.rest_angle_rad
    out, lengths, before = list[tuple[int, SegmentLaws]](), joints.lengths.segments.tolist(), 0.0
    for i, (near, far) in enumerate(pairwise(backbone.rings)):
        joint, pitch = joints.each[i], lengths[i]
        y_mm, half_gap = side * (joint.arms_mm.a if side > 0 else joint.arms_mm.b), 0.5 * joint.rigid_gap_mm
        half_notch = 0.5 * joint.turning_length_mm + half_gap
        if joints.alike:
            holes = [0.5 * (pitch - joint.turning_length_mm) - half_gap] * 2
        else:
            middle, centre = joints.places.middles[i], joints.places.centres[i]
            holes, before = [middle - before - half_notch, centre - middle - half_notch], centre
        shorter = 2 * (y_mm * math.sin(half_angle) + half_gap * (1 - math.cos(half_angle)))  # the path, at rest
        stretch, lead = rig.preload_N * pitch / tendon.EA_N, lead_pitches * pitch
        points = [(near, holes[0] - lead), (near, holes[0]), (far, -holes[1])]
        path = [
            mbs.AddMarker(items.MarkerBodyRigid(bodyNumber=ring.body, localPosition=[ring.centre_mm + x, y_mm, 0]))
            for ring, x in points
        ]
        preloaded = lead + pitch - backbone.shortening_mm[i] - shorter - sum(holes)
        segment = items.ObjectConnectorReevingSystemSprings(
            markerNumbers=[*path, slip[i], slip[i + 1]],
            hasCoordinateMarkers=True,
            coordinateFactors=[-1, 1],
            stiffnessPerLength=(preloaded - stretch) * tendon.EA_N / pitch,
            referenceLength=preloaded - stretch,
            regularizationForce=COMPRESSION * joints.force_scale_N,
            sheavesAxes=exu.Vector3DList([[0, 0, 1]] * len(path)),
            sheavesRadii=[0.0] * len(path),
        )
        stiffness, part = segment.stiffnessPerLength, 1.0 if keeps_tension(rig, tendon) else SLACK
        law = SegmentLaws(
            pulls={"stiffnessPerLength": stiffness, "regularizationForce": segment.regularizationForce},
            taut={"stiffnessPerLength": stiffness, "regularizationForce": -1.0},
            slack={"stiffnessPerLength": part * stiffness, "regularizationForce": -1.0},
        )
        out.append((int(mbs.AddObject(segment)), law))
    return out


def _add_surroundings(mbs: Any, rig: Rig, joints: JointRow, rings: list[Ring]) -> list[DeadLoad]:
    """Weight of the rings, and load, weight and stop at the tip; return the dead loads, which the stepper sets."""
    dead = _add_steps(mbs, rig, joints, rings)
    if rig.gravity is not None:
        for ring in rings[1:]:
            centre = mbs.AddMarker(items.MarkerBodyPosition(bodyNumber=ring.body, localPosition=[ring.centre_mm, 0, 0]))
            dead.append(DeadLoad(int(mbs.AddLoad(items.LoadForceVector(markerNumber=centre))), ring_weight_N(rig)))
    tip = items.MarkerBodyPosition(bodyNumber=rings[-1].body, localPosition=[rings[-1].centre_mm, 0, 0])
    if rig.tip_load is not None or rig.tip_mass is not None:
        load = items.LoadForceVector(markerNumber=mbs.AddMarker(tip))
        dead.append(DeadLoad(int(mbs.AddLoad(load)), tip_force_N(rig)))
    if rig.tip_stop is not None:
        origin = mbs.AddObject(items.ObjectGround())
        markers = [mbs.AddMarker(items.MarkerBodyPosition(bodyNumber=origin)), mbs.AddMarker(tip)]
        stop = items.ObjectConnectorCartesianSpringDamper(
            markerNumbers=markers,
            stiffness=[0, rig.tip_stop.stiffness_N_per_mm, 0],
            offset=[0, rig.tip_stop.y_mm, 0],
        )
        laws.add_with_law(mbs, stop, laws.stop_above if rig.tip_stop.y_mm >= 0 else laws.stop_below)
    return dead


def _add_steps(mbs: Any, rig: Rig, joints: JointRow, rings: list[Ring]) -> list[DeadLoad]:
    """Add what dead loads turn by the steps of the neutral axis, which the model has on one line.

    What acts beyond a ring has its lever longer by the step across that ring. It is a couple that turns with the ring:
    all that acts beyond, at the end of the step, and the same back at its beginning.
    """
    loads, (weight_x, weight_y) = list[DeadLoad](), ring_weight_N(rig)
    tip_x, tip_y = tip_force_N(rig)
    for beyond, (ring, aside) in enumerate(zip(rings[:0:-1], joints.lengths.aside[::-1].tolist(), strict=True)):
        x, y = beyond * weight_x + tip_x, beyond * weight_y + tip_y
        if aside == 0.0 or (x, y) == (0.0, 0.0):
            continue
        for across, force in ((aside, (x, y)), (0.0, (-x, -y))):
            point = items.MarkerBodyPosition(bodyNumber=ring.body, localPosition=[ring.centre_mm, across, 0])
            loads.append(DeadLoad(int(mbs.AddLoad(items.LoadForceVector(markerNumber=mbs.AddMarker(point)))), force))
    return loads


def _add_wheel(mbs: Any, ground: int) -> tuple[int, int]:
    """Constraint that drives the wheel, and the marker of its coordinate."""
    _, marker = _scalar_node(mbs)
    return int(mbs.AddObject(items.ObjectConnectorCoordinate(markerNumbers=[ground, marker]))), marker


def assemble(
    rig: Rig,
    joints: JointRow,
    bristle_ratio: float,
    inertia: RingInertia = MASSLESS,
    *,
    load_control: bool = False,
    lead_pitches: float = 100.0,
) -> Model:
    """Build the system of a rig, straight and preloaded; ``bristle_ratio`` as in :func:`bristle_N_per_mm`.

    ``inertia`` is that of every ring that moves; nothing else has mass. Under load control forces act at the base.
    """
    mbs = exu.SystemContainer().AddSystem()
    ground = mbs.AddMarker(items.MarkerNodeCoordinate(nodeNumber=mbs.AddNode(items.NodePointGround()), coordinate=0))
    backbone = _add_backbone(mbs, rig, joints, ground, inertia)
    wheel, wheel_marker = _add_wheel(mbs, ground)
    free_spans, forces, segments, guides, slip_nodes, dashpots = [], [], [], [], [], []
    for side, tendon in zip((1, -1), rig.tendons, strict=False):
        nodes, markers = map(list, zip(*(_scalar_node(mbs) for _ in range(rig.joints)), strict=True))
        if load_control:
            forces.append(int(mbs.AddLoad(items.LoadCoordinate(markerNumber=markers[0], load=rig.preload_N))))
        else:
            free_spans.append(_add_free_span(mbs, rig, side, markers[0], wheel_marker))
        segments += _add_segments(mbs, rig, joints, side, backbone, [*markers, ground], lead_pitches)
        guides += _add_guides(mbs, rig, tendon, bristle_ratio, ground, markers)
        slip_nodes += nodes
        dashpots += [_dashpot(mbs, [ground, markers[0]])] if rig.drag else []
    dead = _add_surroundings(mbs, rig, joints, backbone.rings)
    mbs.Assemble()
    bent, longer = backbone.sections.coordinates(mbs)
    first, near = (_first_coordinates(mbs, n) for n in ([ring.node for ring in backbone.rings], backbone.near_nodes))
    ends = np.stack([near, first[1:]], axis=1).ravel()
    return Model(
        mbs=mbs,
        wheel=wheel,
        free_spans=free_spans,
        forces=forces,
        dead=dead,
        segments=[number for number, _ in segments],
        segment_laws=[law for _, law in segments],
        guides=guides,
        beams=backbone.beams,
        jenkins=backbone.jenkins,
        flags=backbone.flags,
        hardening=backbone.hardening,
        fibres=backbone.sections.fibres,
        heat=backbone.sections.heat,
        bent=bent,
        longer=longer,
        dashpots=dashpots + backbone.dashpots,
        slip=_first_coordinates(mbs, slip_nodes),
        rings=first,
        rotation=first + 2,
        near_rotation=near + 2,
        nodes=ends,
        reference_mm=np.array(mbs.systemData.GetODE2Coordinates(exu.ConfigurationType.Reference))[[ends, ends + 1]],
        centre_mm=np.array([ring.centre_mm for ring in backbone.rings]),
        tip=backbone.rings[-1],
    )


def _first_coordinates(mbs: Any, nodes: list[int]) -> Ints:
    return np.array([mbs.GetNodeODE2Index(n) for n in nodes])


def _add_guides(mbs: Any, rig: Rig, tendon: Tendon, bristle_ratio: float, ground: int, markers: list[int]) -> list[int]:
    """Bristles between the ground and the slip of a tendon at its guides."""
    open_stiffness = laws.OPEN_STIFFNESS * tendon.EA_N / rig.mean_pitch_mm
    bristles = bristle_N_per_mm(rig, tendon, bristle_ratio).tolist()
    guides = [
        Spring(markerNumbers=[ground, marker], stiffness=bristle, damping=open_stiffness)
        for marker, bristle in zip(markers, bristles, strict=True)
    ]
    return [laws.add_with_law(mbs, guide, laws.stick_slip) for guide in guides]


def bristle_N_per_mm(rig: Rig, tendon: Tendon, bristle_ratio: float) -> Floats:
    """Stiffness of each guide of a tendon while it sticks, shape (N,): ``bristle_ratio`` times EA/pitch.

    A guide without friction carries nothing. Its spring only leads the search for the slip, best a soft one.
    """
    dry, ratio = rig.friction, np.full(rig.joints, bristle_ratio)
    if dry.capstan_coefficient == 0 and dry.guide_N == 0:
        ratio[int(dry.sheath_N > 0) :] = min(bristle_ratio, SMOOTH_RATIO)
    return np.asarray(1 / (rig.mean_pitch_mm / (ratio * tendon.EA_N) + dry.stick_compliance_mm_per_N))
