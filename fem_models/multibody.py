"""The manipulator as an Exudyn flexible multibody system, quasi-static.

Flexures are two-node geometrically exact beams (Simo and Vu-Quoc, doi 10.1115/1.3171870) of the length over which a
notch bends; rings are such beams with the section of the uncut tube, far stiffer. Each tendon is a row of elastic
segments whose slip past every guide is a coordinate held by dry friction. The wheel drives both tendons.

Why one element a flexure is enough: it has one integration point, so its only compliances are those of its mid-point
frame, uncoupled. So are those of a notch between stiff rings, which is symmetric about its middle. Giving the element
the notch's mid-point stiffnesses is therefore exact for small strain. Why friction is a spring with a slipping rest
point: a velocity law never slips in a static solution.
"""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from itertools import pairwise
from typing import Any

import exudyn as exu
import exudyn.itemInterface as items
import numpy as np
from exudyn.utilities import CreateSymbolicUserFunction
from numpy.typing import NDArray

from fem_models.friction import friction_limits_N, guide_wrap_rad, jenkins_elements
from fem_models.presets import sidecar_table
from fem_models.rig import LoadProgram, Rig, Tendon
from fem_models.snr import flexure, moment_arms_mm, section
from hysteresis.record import Record

COMPRESSION_N = 0.01  # a slack segment pushes with no more than this, which keeps the tangent regular
FRICTIONLESS_BRISTLE = 1e-8  # of EA/pitch: keeps the slip coordinate determined where nothing holds it


BENCH_GAP = 0.2
"""Assumed opening between the rings of measured joints, of the pitch: small, so that the path is nearly r theta."""


class SolverError(RuntimeError):
    """The static solver did not converge; the message says at which sample and drive."""


@dataclass(frozen=True)
class MultibodySettings:
    """Numerical settings; the defaults are those the tests verify.

    ``bristle_ratio`` is the stiffness of a sticking guide over EA/pitch; ``friction_tolerance`` ends the fixed
    point between tensions and friction limits (relative to the preload); ``max_step_mm`` bounds the drive
    increment whatever the sampling, ``max_halvings`` how often a step that fails is halved.
    """

    bristle_ratio: float = 0.02
    friction_tolerance: float = 1e-6
    max_friction_iterations: int = 20
    max_step_mm: float = 0.1
    max_halvings: int = 8
    newton_relative_tolerance: float = 1e-7
    newton_absolute_tolerance_N: float = 1e-7
    newton_iterations: int = 15


@dataclass(frozen=True)
class MultibodySolution:
    """A record with what only the model knows. Arrays follow the samples of the record, shape (m, ...).

    ``segment_tensions_N`` has shape (m, 2, N+1): tendon a and b, from the wheel to the tip. ``wheel_work_mJ``,
    ``friction_loss_mJ`` and ``material_loss_mJ`` are cumulative from the start of the program.
    """

    record: Record
    segment_tensions_N: NDArray[np.float64]
    wheel_work_mJ: NDArray[np.float64]
    friction_loss_mJ: NDArray[np.float64]
    material_loss_mJ: NDArray[np.float64]


@dataclass(frozen=True)
class _Ring:
    """One ring: its body, whose node stands at an end of it, and the way along x from there to its centre."""

    node: int
    body: int
    centre_mm: float


@dataclass(frozen=True)
class _Model:
    """Item numbers and coordinate indices of an assembled system."""

    mbs: Any
    wheel: int
    free_spans: list[int]  # one connector a tendon: wheel to base
    segments: list[int]  # tendon a then b, base to tip
    guides: list[int]  # friction connectors, the same order
    jenkins: list[int]  # element by element, joint by joint
    slip: NDArray[np.int64]  # coordinates of the guides
    rotation: NDArray[np.int64]  # coordinates of ring rotations, base first
    near_rotation: NDArray[np.int64]  # of the near end of each flexure
    tip: _Ring


@dataclass
class _State:
    """History of the dry elements: rest points of the bristles and of the Jenkins elements, friction limits."""

    rest: NDArray[np.float64]
    limit: NDArray[np.float64]
    jenkins_rest: NDArray[np.float64]
    friction_loss: float = 0.0
    material_loss: float = 0.0


def _stick_slip(mbs: Any, t: Any, i: Any, u: Any, v: Any, k: Any, d: Any, rest: Any, vo: Any, fd: Any, limit: Any,
                ve: Any, fv: Any, rv: Any) -> Any:  # fmt: skip
    return exu.symbolic.min(exu.symbolic.max(k * (u - rest), -limit), limit)


def _toe(mbs: Any, t: Any, i: Any, u: Any, v: Any, k: Any, d: Any, preload: Any, vo: Any, fd: Any, limit: Any,
         ve: Any, fv: Any, rv: Any) -> Any:  # fmt: skip
    return preload * exu.symbolic.exp(k * u)


def _tension_only(mbs: Any, t: Any, i: Any, u: Any, v: Any, k: Any, d: Any, rest: Any, vo: Any, fd: Any, limit: Any,
                  ve: Any, fv: Any, rv: Any) -> Any:  # fmt: skip
    return exu.symbolic.max(k * (u - rest), 0.0)


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


def _ring(mbs: Any, x_mm: float, moved_mm: float, centre_mm: float) -> _Ring:
    node = mbs.AddNode(items.NodeRigidBody2D(referenceCoordinates=[x_mm, 0, 0], initialCoordinates=[moved_mm, 0, 0]))
    return _Ring(node, mbs.AddObject(items.ObjectRigidBody2D(mass=0.0, inertia=0.0, nodeNumber=node)), centre_mm)


def bending_length_mm(rig: Rig) -> float:
    """Length over which a notch bends: E I of its root over its bending stiffness, the width itself for a slot."""
    if rig.notch is None:
        return BENCH_GAP * rig.pitch_mm
    root = rig.material.youngs_modulus_GPa * 1e3 * float(section(rig, 0.0).second_moment_mm4)
    return min(root / flexure(rig).bending_Nmm_per_rad, rig.notch.width_mm)


def _add_beam(mbs: Any, ends: list[int], length_mm: float, bending: float, axial: float, shear: float) -> None:
    """Element with given mid-point stiffnesses: Nmm/rad, N/mm, N/mm."""
    beam = items.ObjectBeamGeometricallyExact2D(
        nodeNumbers=ends,
        length=length_mm,
        bendingStiffness=bending * length_mm,
        axialStiffness=axial * length_mm,
        shearStiffness=shear * length_mm,
    )
    mbs.AddObject(beam)


def _ring_stiffness(rig: Rig, length_mm: float) -> tuple[float, float, float]:
    """Mid-point stiffnesses of the uncut tube over a ring; of measured joints it is in the joint: far stiffer."""
    if rig.tube is None:
        rigid = 1e2 * max(rig.tendon_a.EA_N, rig.tendon_b.EA_N) / rig.pitch_mm
        return rigid * rig.pitch_mm**2, rigid, rigid
    outer, inner = rig.tube.outer_diameter_mm / 2, rig.tube.inner_diameter_mm / 2
    young = rig.material.youngs_modulus_GPa * 1e3
    area, second = np.pi * (outer**2 - inner**2), np.pi / 4 * (outer**4 - inner**4)
    # kappa = 1/2 of a thin round tube (Cowper 1966, doi 10.1115/1.3625046, for zero Poisson's ratio)
    shear = length_mm**3 / (12 * young * second) + length_mm * 4 * (1 + rig.material.poissons_ratio) / (young * area)
    return young * second / length_mm, young * area / length_mm, 1 / shear


@dataclass(frozen=True)
class _Backbone:
    """Rings from base to tip; nodes and shortening of the pitches under preload; Jenkins connectors."""

    rings: list[_Ring]
    near_nodes: list[int]  # of each flexure, towards the base; the far one is its ring's
    shortening_mm: list[float]
    jenkins: list[int]  # element by element, joint by joint


def _add_backbone(mbs: Any, rig: Rig, ground: int) -> _Backbone:
    joint = flexure(rig)
    p, bend = rig.pitch_mm, bending_length_mm(rig)
    length = p - bend
    ring_bending, ring_axial, ring_shear = _ring_stiffness(rig, length)
    axial, shear = joint.axial_N_per_mm or ring_axial, joint.shear_N_per_mm or ring_shear
    elastic, stiffness, _ = jenkins_elements(rig.material, joint.bending_Nmm_per_rad)
    thrust = rig.preload_N * (_taut(rig, rig.tendon_a) + _taut(rig, rig.tendon_b))
    rings = [_ring(mbs, length / 2, 0.0, -length / 2)]
    for axis in range(3):
        fixed = mbs.AddMarker(items.MarkerNodeCoordinate(nodeNumber=rings[0].node, coordinate=axis))
        mbs.AddObject(items.ObjectConnectorCoordinate(markerNumbers=[ground, fixed]))
    near, moved = [rings[0].node], 0.0
    for i in range(1, rig.joints + 1):
        moved -= thrust / axial
        rings.append(_ring(mbs, i * p - length / 2, moved, length / 2))
        _add_beam(mbs, [near[-1], rings[-1].node], bend, elastic, axial, shear)
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
    return _Backbone(
        rings=rings,
        near_nodes=near,
        shortening_mm=[thrust / axial] + [thrust / axial + thrust / ring_axial] * (rig.joints - 1),
        jenkins=[_nonlinear_spring(mbs, _stick_slip, markerNumbers=m, stiffness=k) for k in stiffness for m in turn],
    )


def _taut(rig: Rig, tendon: Tendon) -> float:
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
    half_hole = 0.5 * (rig.notch.spacing_mm if rig.notch else (1 - BENCH_GAP) * rig.pitch_mm)
    taut = _taut(rig, tendon)
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
            coordinateFactors=[-1 / taut, 1 / taut],
            stiffnessPerLength=taut * tendon.EA_N,
            referenceLength=(rig.pitch_mm - backbone.shortening_mm[i]) / taut,
            regularizationForce=COMPRESSION_N,
            sheavesAxes=exu.Vector3DList([[0, 0, 1]] * len(path)),
            sheavesRadii=[0.0] * len(path),
        )
        out.append(int(mbs.AddObject(segment)))
    return out


def _assemble(rig: Rig, settings: MultibodySettings) -> _Model:
    mbs = exu.SystemContainer().AddSystem()
    ground = mbs.AddMarker(items.MarkerNodeCoordinate(nodeNumber=mbs.AddNode(items.NodePointGround()), coordinate=0))
    backbone = _add_backbone(mbs, rig, ground)
    _, wheel_marker = _scalar_node(mbs)
    wheel = mbs.AddObject(items.ObjectConnectorCoordinate(markerNumbers=[ground, wheel_marker]))
    free_spans, segments, guides, slip_nodes = [], [], [], []
    for side, tendon, arm in zip((1, -1), (rig.tendon_a, rig.tendon_b), moment_arms_mm(rig), strict=True):
        slip = [_scalar_node(mbs) for _ in range(rig.joints)]
        markers = [m for _, m in slip]
        free_spans.append(
            _add_free_span(mbs, tendon, rig.preload_N, markers[0], wheel_marker, side * rig.wheel.radius_mm)
        )
        segments += _add_segments(mbs, rig, tendon, side * arm, backbone, [*markers, ground])
        bristle = _bristle_N_per_mm(rig, tendon, settings)
        guides += [_nonlinear_spring(mbs, _stick_slip, markerNumbers=[ground, m], stiffness=bristle) for m in markers]
        slip_nodes += [n for n, _ in slip]
    mbs.Assemble()
    first = np.array([mbs.GetNodeODE2Index(ring.node) for ring in backbone.rings])
    return _Model(
        mbs=mbs,
        wheel=int(wheel),
        free_spans=free_spans,
        segments=segments,
        guides=guides,
        jenkins=backbone.jenkins,
        slip=np.array([mbs.GetNodeODE2Index(n) for n in slip_nodes]),
        rotation=first + 2,
        near_rotation=np.array([mbs.GetNodeODE2Index(n) + 2 for n in backbone.near_nodes]),
        tip=backbone.rings[-1],
    )


def _bristle_N_per_mm(rig: Rig, tendon: Tendon, settings: MultibodySettings) -> float:
    dry = rig.friction.guide_N or rig.friction.sheath_N or rig.friction.capstan_coefficient
    return (settings.bristle_ratio if dry else FRICTIONLESS_BRISTLE) * tendon.EA_N / rig.pitch_mm


@contextmanager
def _quiet() -> Iterator[None]:
    """Keep Exudyn from reporting a failed Newton step that is about to be halved."""
    before = exu.config.printToConsole
    exu.config.printToConsole = False
    try:
        yield
    finally:
        exu.config.printToConsole = before


class _Stepper:
    """Moves an assembled rig along its load program; holds the history of the dry elements."""

    def __init__(self, rig: Rig, settings: MultibodySettings) -> None:
        self.rig, self.settings = rig, settings
        self.model = _assemble(rig, settings)
        self.taut = np.array([_taut(rig, tendon) for tendon in (rig.tendon_a, rig.tendon_b)])
        n = rig.joints
        self.bristle = np.repeat([_bristle_N_per_mm(rig, t, settings) for t in (rig.tendon_a, rig.tendon_b)], n)
        _, stiffness, slip_moment = jenkins_elements(rig.material, flexure(rig).bending_Nmm_per_rad)
        self.jenkins_stiffness, self.slip_moment = np.repeat(stiffness, n), np.repeat(slip_moment, n)
        for connector, moment in zip(self.model.jenkins, self.slip_moment, strict=True):
            self.model.mbs.SetObjectParameter(connector, "staticFrictionOffsetForce", moment)
        self.solver = exu.SimulationSettings()
        self.solver.solution.file.write = False
        self.solver.linearSolver.solverType = exu.LinearSolverType.EigenSparse
        static = self.solver.staticSolver
        static.numberOfLoadSteps, static.adaptiveStep, static.verboseMode = 1, False, 0
        static.newton.relativeTolerance = settings.newton_relative_tolerance
        # Rounding of a coordinate times the stiffest segment is the least residual there can be.
        stiffest = max(rig.tendon_a.EA_N, rig.tendon_b.EA_N) / rig.pitch_mm
        static.newton.absoluteTolerance = max(settings.newton_absolute_tolerance_N, 1e-12 * stiffest)
        static.newton.maxIterations = settings.newton_iterations
        self.state = _State(np.zeros(2 * n), np.zeros(2 * n), np.zeros(len(self.model.jenkins)))
        self.state.limit = self._limits(self.coordinates())
        self._set_friction(self.state.limit)

    def coordinates(self) -> NDArray[np.float64]:
        return np.asarray(self.model.mbs.systemData.GetODE2Coordinates())

    def tensions(self) -> NDArray[np.float64]:
        """Shape (2, N+1), wheel to tip."""
        output, kind = self.model.mbs.GetObjectOutput, exu.OutputVariableType
        free = [output(i, kind.Force) for i in self.model.free_spans]
        rope = np.reshape([output(i, kind.ForceLocal) for i in self.model.segments], (2, -1))
        return np.column_stack([free, rope / self.taut[:, None]])

    def tip_mm(self) -> NDArray[np.float64]:
        """Centre of the last ring, shape (2,)."""
        ring = self.model.tip
        position = self.model.mbs.GetObjectOutputBody(
            ring.body, exu.OutputVariableType.Position, localPosition=[ring.centre_mm, 0, 0]
        )
        return np.asarray(position)[:2]

    def _limits(self, q: NDArray[np.float64]) -> NDArray[np.float64]:
        tension = self.tensions()
        wrap = guide_wrap_rad(self.rig.friction, np.diff(q[self.model.rotation]))
        return friction_limits_N(self.rig.friction, tension[:, :-1], tension[:, 1:], wrap).ravel()

    def _set_friction(self, limit: NDArray[np.float64]) -> None:
        put = self.model.mbs.SetObjectParameter
        for connector, value in zip(self.model.guides, limit, strict=True):
            put(connector, "staticFrictionOffsetForce", value)

    def _solve(self, drive_mm: float) -> bool:
        self.model.mbs.SetObjectParameter(self.model.wheel, "offset", drive_mm / self.rig.wheel.radius_mm)
        try:
            with _quiet():
                return bool(self.model.mbs.SolveStatic(self.solver, updateInitialValues=True))
        except (RuntimeError, ValueError):
            return False

    def _restore(self, q: NDArray[np.float64]) -> None:
        self.model.mbs.systemData.SetODE2Coordinates(q)
        self.model.mbs.systemData.SetODE2Coordinates(q, configuration=exu.ConfigurationType.Initial)
        self._set_friction(self.state.limit)

    def _equilibrium(self, drive_mm: float) -> NDArray[np.float64] | None:
        """Friction limits that agree with the tensions they lead to, or None where the solver fails."""
        limit = self.state.limit
        for _ in range(self.settings.max_friction_iterations):
            if not self._solve(drive_mm):
                return None
            update = self._limits(self.coordinates())
            if np.abs(update - limit).max() <= self.settings.friction_tolerance * self.rig.preload_N:
                return limit
            limit = update
            self._set_friction(limit)
        return None

    def _advance(self, start_mm: float, end_mm: float, halvings: int) -> None:
        before = self.coordinates()
        limit = self._equilibrium(end_mm)
        if limit is None:
            if halvings == 0:
                raise SolverError(f"no equilibrium between drives {start_mm:.6g} and {end_mm:.6g} mm")
            self._restore(before)
            middle = 0.5 * (start_mm + end_mm)
            self._advance(start_mm, middle, halvings - 1)
            self._advance(middle, end_mm, halvings - 1)
            return
        self._accept(self.coordinates(), limit)

    def _accept(self, q: NDArray[np.float64], limit: NDArray[np.float64]) -> None:
        """Move the rest points of what has slipped, and book the loss (force times slip, backward Euler)."""
        state, put = self.state, self.model.mbs.SetObjectParameter
        slip = q[self.model.slip]
        force = np.clip(self.bristle * (slip - state.rest), -limit, limit)
        rest = slip - force / self.bristle
        state.friction_loss += float(force @ (rest - state.rest))
        state.rest, state.limit = rest, limit
        for connector, value in zip(self.model.guides, rest, strict=True):
            put(connector, "offset", value)
        if not self.model.jenkins:
            return
        turn = q[self.model.rotation[1:]] - q[self.model.near_rotation]
        bend = np.tile(turn, len(self.model.jenkins) // self.rig.joints)
        moment = np.clip(self.jenkins_stiffness * (bend - state.jenkins_rest), -self.slip_moment, self.slip_moment)
        jenkins_rest = bend - moment / self.jenkins_stiffness
        state.material_loss += float(moment @ (jenkins_rest - state.jenkins_rest))
        state.jenkins_rest = jenkins_rest
        for connector, value in zip(self.model.jenkins, jenkins_rest, strict=True):
            put(connector, "offset", value)

    def move(self, start_mm: float, end_mm: float) -> float:
        """Drive from start to end in bounded steps; return the work of the wheel on the way, mJ (N mm)."""
        steps = max(1, int(np.ceil(abs(end_mm - start_mm) / self.settings.max_step_mm - 1e-9)))
        path = np.linspace(start_mm, end_mm, steps + 1)
        work, pull = 0.0, self.pull()
        for a, b in pairwise(path):
            self._advance(a, b, self.settings.max_halvings)
            before, pull = pull, self.pull()
            work += 0.5 * (before + pull) * (b - a)
        return work

    def pull(self) -> float:
        """Torque of the wheel over its radius, N."""
        tension = self.tensions()
        return float(tension[0, 0] - tension[1, 0])


def solve_multibody(rig: Rig, program: LoadProgram, settings: MultibodySettings | None = None) -> MultibodySolution:
    """Run a load program quasi-statically; time, if the program has any, is only passed on.

    Raises
    ------
    SolverError
        When a step does not converge even after ``max_halvings`` halvings.
    """
    stepper = _Stepper(rig, settings or MultibodySettings())
    drive, joints = program.drive_mm, rig.joints
    m = drive.size
    rotation, tip = np.empty((m, joints + 1)), np.empty((m, 2))
    tension, energy = np.empty((m, 2, joints + 1)), np.empty((m, 3))
    at, work = 0.0, 0.0
    for k, target in enumerate(drive):
        try:
            work += stepper.move(at, float(target))
        except SolverError as error:
            raise SolverError(f"rig {rig.name}, sample {k} of {m}: {error}") from None
        at = float(target)
        q = stepper.coordinates()
        rotation[k] = q[stepper.model.rotation]
        tip[k] = stepper.tip_mm()
        tension[k] = stepper.tensions()
        energy[k] = work, stepper.state.friction_loss, stepper.state.material_loss
    record = Record(
        drive=drive,
        angle_deg=np.degrees(rotation[:, -1]),
        title=f"{rig.name}, preload {rig.preload_N:g} N, multibody",
        kind="simulated",
        time_s=program.time_s,
        cycle=program.cycle,
        tension_a_N=tension[:, 0, 0],
        tension_b_N=tension[:, 1, 0],
        notches_deg=np.degrees(np.diff(rotation, axis=1)),
        tip_mm=tip,
        rig=sidecar_table(rig),
    )
    return MultibodySolution(record, tension, energy[:, 0], energy[:, 1], energy[:, 2])


def simulate_multibody(rig: Rig, program: LoadProgram) -> Record:
    """Engine ``multibody``: the record alone. See :func:`solve_multibody`."""
    return solve_multibody(rig, program).record
