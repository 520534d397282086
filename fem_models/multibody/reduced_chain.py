"""Chains of single notched rings (SNR) loaded in the bending plane: reduced flexible bodies, and beams for comparison.

A reduced body is one SNR from plate to plate as Exudyn's ``ObjectFFRFreducedOrder`` (Zwoelfer and Gerstmayr, Acta
Mechanica 232(3), 2021, p. 835) with the Hurty-Craig-Bampton modes of :mod:`fem_models.multibody.reduced_body`. Its
floating frame moves midway between the plates, each of which makes half of their relative motion. Rigid rings stand
between the bodies and have the holes of the tendon. The beam chain has the joints of the multibody model: one
geometrically exact beam a joint, with given mid-point stiffnesses.

The rotation from body to body is exact, by the floating frames; within a body everything is linear. A plate that
rotates by t/2 about the middle of the notch on an arm of half a pitch P should come nearer by P t^2/16, which a linear
body leaves out: 0.9 % of a tendon's moment at 45 degrees over 14 joints. A ring is therefore tied where the flexure
ends, to points that move with its plate. Then only the chord of a flexure is taken as straight, as in a beam of one
element. Neither chain has superelasticity, closure or friction.

Axes as in :mod:`fem_models.analytic.kinematics`: x along the straight tube from its base, y across towards tendon a.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from itertools import pairwise
from typing import Any

import exudyn as exu
import exudyn.itemInterface as items
import numpy as np
from exudyn.FEM import FEMinterface, ObjectFFRFreducedOrderInterface
from numpy.typing import NDArray
from scipy import sparse
from scipy.sparse.linalg import splu

from fem_models.joint import joint_mechanics
from fem_models.joint.flexure import Flexure
from fem_models.multibody.assembly import NITINOL_T_PER_MM3
from fem_models.multibody.reduced_body import ReducedBody
from fem_models.multibody.stepper import quiet
from fem_models.rig import Rig
from fem_models.rig.checks import SolverError
from fem_models.rig.rig import notched_tube
from fem_models.solid.linear import Solid, as_flexure, mass_matrix, rigid_motions
from hysteresis.arrays import Floats

LARGEST_STEP_RAD = 0.1
"""Largest bending of the whole chain in one load step, as the linear chain predicts it."""
LEAST_STEP = 1e-3
"""Smallest step, as a part of the path from load to load: a step that fails is not halved further."""

FIXED, FIXED_IN_PLANE = (1, 1, 1, 1, 1, 1), (1, 1, 0, 0, 0, 1)
"""Axes that a joint constrains: of bodies in space, and in the plane."""

TIES = 4
"""Points that stand for a plate."""

NEWTON_ITERATIONS = 15
DIFFERENCE = 1e-7
"""Step of a coordinate, mm or of a rotation: rounding and curvature then cost the tangent about the same."""
NEAR = 1e-4
"""Change of a coordinate below which the tangent is used again."""
TOLERANCE = 1e-8
"""Last change of a coordinate, mm or of a rotation."""

TO_RIG = np.array([[0.0, 0.0, 1.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]])
"""Axes of the solid (z along the tube, x in the bending plane) in those of the rig."""


@dataclass(frozen=True)
class PlaneLoad:
    """Loads in the bending plane; forces keep their direction, the tendon follows.

    ``moment_Nmm``, ``lateral_N`` (towards y) and ``axial_N`` (towards x) act on the middle of the last ring, on the
    tube axis. ``tendon_N`` is the tension of tendon a, anchored at the last ring, free of friction and straight from
    the edge of a hole to that of the next.
    """

    moment_Nmm: float = 0.0
    lateral_N: float = 0.0
    axial_N: float = 0.0
    tendon_N: float = 0.0


@dataclass(frozen=True)
class ChainPose:
    """Rotation of the rings, rad, shape (N + 1,), base first; middle of the last ring on the tube axis, shape (2,)."""

    rotation_rad: Floats
    tip_mm: Floats

    @property
    def angle_rad(self) -> float:
        """Bending of the whole chain."""
        return float(self.rotation_rad[-1])


@dataclass(frozen=True)
class _Chain:
    """An Exudyn system; ``bodies`` are the rings, base first, ``axis_mm`` the y of the tube axis in their frames."""

    mbs: Any
    bodies: list[int]
    axis_mm: float


def solve_reduced_chain(rig: Rig, solid: Solid, body: ReducedBody, loads: Sequence[PlaneLoad]) -> list[ChainPose]:
    """Equilibria of the rig's chain of reduced bodies, one load after the other from the straight chain.

    Parameters
    ----------
    solid, body
        One SNR of the rig and its reduction.

    Raises
    ------
    SolverError
        A load without an equilibrium.
    """
    mbs = exu.SystemContainer().AddSystem()
    ground = mbs.AddObject(items.ObjectGround())
    rings = [ground, *(_rigid_ring(mbs, (i + 1) * rig.pitch_mm) for i in range(rig.joints))]
    joint, half = as_flexure(relative_motion(body)[0][:6, :6]), joint_mechanics(rig).bending_length_mm / 2
    one, reach = floating_body(solid, body, _tie_points(solid, half, joint)), rig.pitch_mm / 2 - half
    for i, (near, far) in enumerate(pairwise(rings)):
        plates = _add_floating(mbs, one, (i + 0.5) * rig.pitch_mm, len(solid.points_mm))
        for plate, ring, x in zip(plates, (near, far), (reach, -reach), strict=True):
            _tie(mbs, ring, (x, -joint.neutral_offset_mm), plate, TO_RIG, FIXED)
    chain = _Chain(mbs, rings, 0.0)
    return _follow(chain, rig, loads, bending_Nmm_per_rad=joint.bending_Nmm_per_rad)


def solve_beam_chain(rig: Rig, joint: Flexure, loads: Sequence[PlaneLoad]) -> list[ChainPose]:
    """Equilibria of the same chain as geometrically exact beams that have the stiffnesses of one whole SNR.

    Raises
    ------
    SolverError
        A load without an equilibrium.
    ValueError
        A joint whose axial or shear stiffness is not known.
    """
    if joint.axial_N_per_mm is None or joint.shear_N_per_mm is None:
        raise ValueError(f"joint = {joint}: expected axial and shear stiffness")
    mbs = exu.SystemContainer().AddSystem()
    pitch, length, y = rig.pitch_mm, joint_mechanics(rig).bending_length_mm, -joint.neutral_offset_mm
    rings = [int(mbs.AddObject(items.ObjectGround(referencePosition=[0, y, 0])))]
    reach = (pitch - length) / 2

    def end(x: float) -> tuple[int, int]:
        node = mbs.AddNode(items.NodeRigidBody2D(referenceCoordinates=[x, y, 0.0]))
        return node, int(mbs.AddObject(items.ObjectRigidBody2D(mass=0.0, inertia=0.0, nodeNumber=node)))

    for i in range(rig.joints):
        (near, near_body), (far, far_body) = end(i * pitch + reach), end((i + 1) * pitch - reach)
        rings.append(end((i + 1) * pitch)[1])
        for ring, x, body in ((rings[-2], reach, near_body), (rings[-1], -reach, far_body)):
            _tie(mbs, ring, (x, 0.0), mbs.AddMarker(items.MarkerBodyRigid(bodyNumber=body)), np.eye(3), FIXED_IN_PLANE)
        beam = items.ObjectBeamGeometricallyExact2D(
            nodeNumbers=[near, far],
            length=length,
            bendingStiffness=joint.bending_Nmm_per_rad * length,
            axialStiffness=joint.axial_N_per_mm * length,
            shearStiffness=joint.shear_N_per_mm * length,
        )
        mbs.AddObject(beam)
    chain = _Chain(mbs, rings, joint.neutral_offset_mm)
    return _follow(chain, rig, loads, bending_Nmm_per_rad=joint.bending_Nmm_per_rad)


def relative_motion(body: ReducedBody) -> tuple[Floats, Floats]:
    """Stiffness (6 + m, 6 + m) of the plates' relative motion and the modes, and the change of coordinates.

    The change has the shape (12 + m, 6 + m). Its columns and the six rigid motions span all coordinates of the body, so
    that nothing is lost with a frame that moves freely.
    """
    modes = len(body.frequencies_Hz)
    change = np.zeros((12 + modes, 6 + modes))
    change[:6, :6], change[6:12, :6], change[12:, 6:] = -np.eye(6) / 2, np.eye(6) / 2, np.eye(modes)
    return change.T @ body.stiffness @ change, change


def floating_body(
    solid: Solid,
    body: ReducedBody,
    ties_mm: Floats | None = None,
    *,
    rotation: str = "NodeType.RotationEulerParameters",
    density_t_per_mm3: float = NITINOL_T_PER_MM3,
) -> ObjectFFRFreducedOrderInterface:
    """Hand mesh, matrices and modes of one SNR to Exudyn, which adds the inertia of a moving frame.

    Parameters
    ----------
    ties_mm
        Shape (2 k, 3): points without mass that follow the nodes of the mesh, the first half moving with the proximal
        plate, the other with the distal one.
    rotation
        Exudyn's node type of the floating frame.
    density_t_per_mm3
        The density with which ``body`` was reduced.
    """
    change = relative_motion(body)[1]
    fields, places = body.fields_mm @ change, solid.points_mm
    matrices = [mass_matrix(solid.mesh, density_t_per_mm3), solid.stiffness]
    by_node = _node_by_node(len(places))
    fields, matrices = fields[by_node], [matrix[by_node][:, by_node] for matrix in matrices]
    if ties_mm is not None:
        half = len(ties_mm) // 2
        for plate, points in enumerate((ties_mm[:half], ties_mm[half:])):
            motion = rigid_motions(points)[_node_by_node(half)] @ change[6 * plate : 6 * plate + 6]
            fields, places = np.vstack([fields, motion]), np.vstack([places, points])
        empty = sparse.csr_matrix((3 * len(ties_mm),) * 2)
        matrices = [sparse.block_diag([matrix, empty]) for matrix in matrices]
    fem = FEMinterface()
    fem.nodes = {"Position": places}
    fem.massMatrix, fem.stiffnessMatrix = (sparse.csr_matrix(matrix) for matrix in matrices)
    fem.modeBasis = {"matrix": fields, "type": "HCBmodes"}
    # rounded against the largest entry, that of a mode in the square of its frequency, plates would lose theirs
    return ObjectFFRFreducedOrderInterface(fem, rotation, roundMassMatrix=0.0, roundStiffnessMatrix=0.0)


def _node_by_node(nodes: int) -> NDArray[np.int64]:
    """Order in which Exudyn counts components: x, y, z of a node, then the next."""
    return np.arange(3 * nodes).reshape(3, nodes).T.ravel()


def _tie_points(solid: Solid, reach_mm: float, joint: Flexure) -> Floats:
    """Points that stand for a plate, shape (8, 3): four about the neutral axis at -reach, proximal, then at +reach."""
    radius = float(np.abs(solid.points_mm[:, 0]).max())
    around = radius * np.array([[1.0, 0.0], [0.0, 1.0], [-1.0, 0.0], [0.0, -1.0]]) - [joint.neutral_offset_mm, 0.0]
    return np.vstack([np.column_stack([around, np.full(TIES, z)]) for z in (-reach_mm, reach_mm)])


def _add_floating(mbs: Any, one: ObjectFFRFreducedOrderInterface, middle_mm: float, nodes: int) -> list[int]:
    """Add a body with its notch at ``middle_mm``; the markers of its plates' points, which follow ``nodes`` others."""
    with quiet():
        added = one.AddObjectFFRFreducedOrder(mbs, positionRef=[middle_mm, 0.0, 0.0], rotationMatrixRef=TO_RIG)
    number, weights = int(added["oFFRFreducedOrder"]), [1 / TIES] * TIES
    markers = []
    for first in (nodes, nodes + TIES):
        points = list(range(first, first + TIES))
        marker = items.MarkerSuperElementRigid(bodyNumber=number, meshNodeNumbers=points, weightingFactors=weights)
        markers.append(int(mbs.AddMarker(marker)))
    return markers


def _rigid_ring(mbs: Any, x_mm: float) -> int:
    node = mbs.AddNode(items.NodeRigidBodyEP(referenceCoordinates=[x_mm, 0, 0, 1, 0, 0, 0]))
    return int(mbs.AddObject(items.ObjectRigidBody(nodeNumber=node, mass=0.0, inertia=[0.0] * 6)))


def _tie(
    mbs: Any, ring: int, place_mm: tuple[float, float], marker: int, rotation: Floats, axes: Sequence[int]
) -> None:
    """Tie a marker to a place on a ring, where its axes have the given rotation."""
    frame = exu.HT(rotation=rotation, translation=[*place_mm, 0])
    on_ring = mbs.AddMarker(items.MarkerBodyRigid(bodyNumber=ring, localHT=frame))
    mbs.AddObject(items.ObjectJointGeneric(markerNumbers=[on_ring, marker], constrainedAxes=list(axes)))


@dataclass(frozen=True)
class _Loading:
    """Items that carry the loads: spans of the tendon, one a joint, and what acts on the last ring."""

    spans: list[int]
    force: int
    torque: int


def _add_loading(chain: _Chain, rig: Rig) -> _Loading:
    mbs, hole = chain.mbs, _half_hole_mm(rig)
    y = chain.axis_mm + rig.tendon_a.moment_arm_mm

    def marker(body: int, x: float, y: float) -> int:
        return int(mbs.AddMarker(items.MarkerBodyRigid(bodyNumber=body, localPosition=[x, y, 0])))

    spans = []
    for near, far in pairwise(chain.bodies):
        ends = [marker(near, hole, y), marker(far, -hole, y)]
        length = rig.pitch_mm - 2 * hole
        span = items.ObjectConnectorSpringDamper(markerNumbers=ends, referenceLength=length)
        spans.append(int(mbs.AddObject(span)))
    tip = marker(chain.bodies[-1], 0.0, chain.axis_mm)
    force = mbs.AddLoad(items.LoadForceVector(markerNumber=tip))
    torque = mbs.AddLoad(items.LoadTorqueVector(markerNumber=tip))
    return _Loading(spans, int(force), int(torque))


def _half_hole_mm(rig: Rig) -> float:
    return notched_tube(rig).cut.spacing_mm / 2


def _follow(chain: _Chain, rig: Rig, loads: Sequence[PlaneLoad], *, bending_Nmm_per_rad: float) -> list[ChainPose]:
    loading = _add_loading(chain, rig)
    chain.mbs.Assemble()
    residual, state, count = _residual(chain.mbs)
    last, out = np.zeros(4), []
    for load in loads:
        goal = np.array([load.moment_Nmm, load.lateral_N, load.axial_N, load.tendon_N])
        done, rate = 0.0, np.zeros_like(state)
        step = min(1.0, LARGEST_STEP_RAD / max(_linear_bending_rad(goal - last, rig, bending_Nmm_per_rad), 1e-12))
        while done < 1:
            part = min(done + step, 1.0)
            _put(chain.mbs, loading, last + part * (goal - last))
            found = _balance(residual, state + rate * (part - done), count)
            if found is None:
                step, rate = step / 2, 0.0 * rate
                if step < LEAST_STEP:
                    raise SolverError(f"rig {rig.name}: no equilibrium of the chain at {load}")
                continue
            state, rate, done = found, (found - state) / (part - done), part
        last = goal
        residual(state)
        out.append(_pose(chain))
    return out


def _linear_bending_rad(change: Floats, rig: Rig, bending_Nmm_per_rad: float) -> float:
    """Angle by which a change of the loads bends the linear chain."""
    moment, lateral, _, tendon = np.abs(change)
    arm = lateral * rig.joints * rig.pitch_mm / 2 + tendon * rig.tendon_a.moment_arm_mm
    return float(rig.joints * (moment + arm) / bending_Nmm_per_rad)


def _put(mbs: Any, loading: _Loading, values: Floats) -> None:
    moment, lateral, axial, tendon = values.tolist()
    mbs.SetLoadParameter(loading.force, "loadVector", [axial, lateral, 0.0])
    mbs.SetLoadParameter(loading.torque, "loadVector", [0.0, 0.0, moment])
    for span in loading.spans:
        mbs.SetObjectParameter(span, "force", tendon)


def _residual(mbs: Any) -> tuple[Callable[[Floats], Floats], Floats, int]:
    """Exudyn's static residual of an assembled system, its present state, and how many coordinates come first."""
    settings, solver, data = exu.SimulationSettings(), exu.MainSolverStatic(), mbs.systemData
    settings.solution.file.write = False
    settings.staticSolver.verboseMode = 0
    with quiet():
        solver.InitializeSolver(mbs, settings)
    count = len(data.GetODE2Coordinates())

    def residual(state: Floats) -> Floats:
        data.SetODE2Coordinates(state[:count])
        data.SetAECoordinates(state[count:])
        solver.ComputeNewtonResidual(mbs, settings)
        return np.array(solver.GetSystemResidual())

    return residual, np.concatenate([data.GetODE2Coordinates(), data.GetAECoordinates()]), count


def _balance(residual: Callable[[Floats], Floats], guess: Floats, count: int) -> Floats | None:
    """State of equilibrium from a guess; None where Newton's method finds none.

    The tangent is taken by differences, because Exudyn's leaves out how the reactions of a joint rotate with its
    bodies: over 14 joints an iteration with that tangent gains a quarter a step under 1 N at the tip and fails under
    2 N.
    """
    state, at = guess, residual(guess)
    factor, before = _tangent(residual, state, at), np.inf
    for _ in range(NEWTON_ITERATIONS):
        if factor is None:
            return None
        change = factor.solve(at)
        state, moved = state - change, float(np.abs(change[:count]).max())
        at = residual(state)
        if moved < TOLERANCE:  # of coordinates, not the residual, which mixes N, Nmm and mm
            return state
        if not moved < 10 * before or not np.isfinite(at).all():
            return None
        if moved > NEAR:
            factor = _tangent(residual, state, at)
        before = moved
    return None


def _tangent(residual: Callable[[Floats], Floats], state: Floats, at: Floats) -> Any:
    """Factors of the tangent at a state whose residual is ``at``; None where it is singular."""
    columns = [(residual(state + unit) - at) / DIFFERENCE for unit in DIFFERENCE * np.eye(state.size)]
    try:
        return splu(sparse.csc_matrix(np.column_stack(columns)))
    except RuntimeError:
        return None


def _pose(chain: _Chain) -> ChainPose:
    kind, read = exu.OutputVariableType, chain.mbs.GetObjectOutputBody
    rotation = [0.0]
    for body in chain.bodies[1:]:
        matrix = np.reshape(read(body, kind.RotationMatrix, localPosition=[0, 0, 0]), (3, 3))
        rotation.append(float(np.arctan2(matrix[1, 0], matrix[0, 0])))
    tip = read(chain.bodies[-1], kind.Position, localPosition=[0, chain.axis_mm, 0])
    return ChainPose(np.unwrap(rotation), np.asarray(tip)[:2].astype(float))
