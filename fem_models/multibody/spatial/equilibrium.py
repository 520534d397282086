"""Equilibrium of an assembled wrist: forces of Exudyn, dry friction and the drives, by Newton's method.

Exudyn gives forces and tangent of rings, flexures, tendons and weights. Rings turn by spins, 7 coordinates being 6
unknowns. The tensions follow from the forces on the slips: what pulls at guide k is the tension before it less that
beyond it. Friction is that of the planar model; its limits need no iteration of their own here.
"""

from __future__ import annotations

from typing import NamedTuple

import exudyn as exu
import numpy as np

from fem_models.joint.friction import friction_limits_N
from fem_models.multibody.spatial.assembly import SpatialModel
from fem_models.multibody.spatial.flexures import NODE, NUDGE, UPRIGHT, Strains, conjugate, cross, rotate
from fem_models.multibody.spatial.settle import SLACK, Guides, Step, Tangent, next_states, parts_of, settle
from fem_models.rig.tendon_law import tendon_stretch_mm, tendon_tension_N
from hysteresis.arrays import Floats, Mask

UNKNOWNS = 6  # of a ring: place and spin
LARGEST_ROTATION = 0.02  # rad of a joint in an iteration, lest tendons fall slack meanwhile
LARGEST_SLIDE = 0.2  # mm of a tendon in an iteration: what is slack resists no further slide
STALE = 0.25  # a residual that has fallen to no less needs a new tangent


class Drive(NamedTuple):
    """What acts on a wrist: drives of the tendons, mm or N, shape (m,), and the part of weights and tip force."""

    tendons: Floats
    dead: float


class Forces(NamedTuple):
    """Of a wrist at coordinates; N joints, m tendons."""

    rings: Floats  # (6 N,): what is out of balance at the rings
    tension: Floats  # (m, N + 1), from the wheel to the tip
    limit: Floats  # (m, N) of friction
    ratio: Floats  # (m, N): its slope in the sum of the tensions before and beyond
    bristle: Floats  # (m, N): force of a bristle that sticks
    viscous: Floats  # (m, N): force that resists a slip in a jump

    def residual(self, state: Floats) -> Floats:
        """Take guides in given states, and return what is out of balance, shape (6 N + m N,)."""
        friction = np.where(state == 0, self.bristle, state * self.limit)
        pull = self.tension[:, :-1] - self.tension[:, 1:]
        return np.concatenate([self.rings, (pull - friction - self.viscous).ravel()])


class Balance(NamedTuple):
    """An equilibrium: coordinates, forces, and states of the guides."""

    q: Floats
    forces: Forces
    state: Floats  # (m, N): 0 sticks, 1 or -1 slides


class Attempt(NamedTuple):
    """How to look for an equilibrium.

    ``before``, shape (m, N), are the states of the guides at the last one, for a step that is given up where a tendon
    begins to slide at the base: the work of its drive has a corner there. None allows it.
    """

    iterations: int
    before: Floats | None = None


class Equilibrium:
    """Finds equilibria of a model. ``rest``, shape (m, N), are the rest points of the bristles."""

    def __init__(self, model: SpatialModel, scale_N: float, tolerance_N: float) -> None:
        self.model, self.scale, self.tolerance = model, scale_N, tolerance_N
        self.rest = np.zeros(model.segment.shape)
        self.bristle = model.bristle.reshape(self.rest.shape)
        self.arm = max(one.tendon.moment_arm_mm for one in model.rig.tendons)
        settings = exu.SimulationSettings()
        settings.solution.file.write = False
        settings.staticSolver.verboseMode = 0
        settings.staticSolver.newton.numericalDifferentiation.relativeEpsilon = 1e-7
        self.settings, self.solver = settings, exu.MainSolverStatic()
        self.solver.InitializeSolver(model.mbs, settings)
        self.dead, self.iterations = 0.0, 0  # of loads, and of the last search
        self.taut = np.ones(self.rest.shape, dtype=bool)  # segments
        self.drag, self.before = 0.0, self.rest  # N/mm of a jump, and the slips that it counts from
        rings = model.rings.shape[0]
        self.slips = UNKNOWNS * rings + np.arange(self.rest.size).reshape(self.rest.shape)
        self.tangent: Tangent | None = None

    def resist(self, viscous: float, rotation: Floats, slip: Floats) -> None:
        """Resist motion from rotations of the joints, shape (N, 3), and slips, (m, N), by so much, Nmm/rad; 0 ends it.

        A slip is resisted by as much over the square of the arm of the tendons.
        """
        self.drag, self.before, self.tangent = viscous / self.arm**2, slip, None
        self.model.flexures.viscous, self.model.flexures.before = viscous, rotation

    def coordinates(self) -> Floats:
        """Of the system of Exudyn."""
        return np.array(self.model.mbs.systemData.GetODE2Coordinates())

    def _set(self, q: Floats, drive: Drive) -> None:
        if drive.dead != self.dead:
            for number, force in self.model.loads:
                self.model.mbs.SetLoadParameter(number, "loadVector", [drive.dead * part for part in force])
            self.dead = drive.dead
        self.model.mbs.systemData.SetODE2Coordinates(q)

    def rings(self, q: Floats) -> Floats:
        """Places and Euler parameters of the rings, shape (N, 7)."""
        return np.asarray(q[self.model.rings] + self.model.flexures.straight)

    def forces(self, q: Floats, drive: Drive) -> Forces:
        """Work out the forces at coordinates."""
        self._set(q, drive)
        acting, beyond = self._acting(q)
        taut = beyond > 0.0
        if (taut != self.taut).any():
            self._draw(taut)
            acting, beyond = self._acting(q)
        slip = q[self.model.slip].reshape(self.rest.shape)
        tension = np.concatenate([self.free_tensions(slip[:, 0], drive)[:, None], beyond], axis=1)
        dry, wrap = self.model.rig.friction, np.zeros_like(slip)
        if dry.capstan_coefficient > 0:
            wrap = self.wraps(q)
        limit = friction_limits_N(dry, tension[:, :-1], tension[:, 1:], wrap)
        rings = acting[self.model.rings]
        turning = self._spun(self.rings(q)[:, 3:]) @ rings[:, 3:, None]
        rings = np.concatenate([rings[:, :3], turning[..., 0]], axis=1).ravel()
        return Forces(
            rings=rings,
            tension=tension,
            limit=limit,
            ratio=np.tanh(0.5 * dry.capstan_coefficient * wrap),
            bristle=self.bristle * (slip - self.rest),
            viscous=self.drag * (slip - self.before),
        )

    def _acting(self, q: Floats) -> tuple[Floats, Floats]:
        """Get the forces of Exudyn at the coordinates that were set, and tensions over the notches, shape (m, N)."""
        self.solver.ComputeODE2RHS(self.model.mbs)
        acting = np.array(self.solver.GetSystemResidual())[: q.size]
        return acting, -np.cumsum(acting[self.model.slip].reshape(self.rest.shape), axis=1)

    def _draw(self, taut: Mask) -> None:
        """Let other segments be taut, shape (m, N)."""
        for j, k in np.argwhere(taut != self.taut).tolist():
            pull = float(self.model.pulls[j, k]) * (1.0 if taut[j, k] else SLACK)
            self.model.mbs.SetObjectParameter(int(self.model.segments[j, k]), "stiffnessPerLength", pull)
        self.taut = taut

    def free_tensions(self, slip: Floats, drive: Drive) -> Floats:
        """Tensions between the drives and the base, shape (m,); slack tendon pushes as little there as elsewhere.

        With a toe region it never pushes: far out its tension is below the least of all numbers.
        """
        rig, model = self.model.rig, self.model
        out = drive.tendons.copy()
        for j, (one, force, slid) in enumerate(zip(rig.tendons, model.by_force, slip, strict=True)):
            if not force:
                out[j] = tendon_tension_N(one.tendon, drive.tendons[j] - slid, rig.preload_N, 0.0)
                beyond = tendon_stretch_mm(one.tendon, 0.0, rig.preload_N, 0.0) - (drive.tendons[j] - slid)
                if beyond > 0.0:
                    out[j] = -SLACK * one.tendon.EA_N / one.tendon.free_length_mm * beyond
        return out

    def wraps(self, q: Floats) -> Floats:
        """Turn of every tendon at every guide, shape (m, N): at both edges of the ring that it is on."""
        places, place = self.rings(q), self.model.layout
        holes = np.stack([place.beyond, place.next_before]) - self.model.flexures.straight[:, None, :3]
        out, leaves = places[:, None, :3] + rotate(places[:, None, 3:], holes)  # of a notch, and of the ring beyond it
        over = out - np.concatenate([place.before[:1], leaves[:-1]])
        inside = np.concatenate([[place.before[0] - place.base], leaves - out])
        before, beyond = _angle(np.stack([inside[:-1], inside[1:]]), over)
        before[1:] += beyond[:-1]
        before[0] += np.radians(self.model.rig.friction.rest_wrap_deg)
        return np.asarray(before.T)

    def _spun(self, q: Floats) -> Floats:
        """Half of G of Euler parameters, shape (N, 3, 4): dq = G^T/2 spin in the frames of the rings."""
        w, x, y, z = q.T
        return 0.5 * np.stack([-x, w, z, -y, -y, -z, w, x, -z, y, -x, w], axis=-1).reshape(-1, 3, 4)

    def _take_tangent(self, q: Floats) -> None:
        """Take the tangent of the rings from Exudyn, at the coordinates that were set last."""
        self.solver.ComputeJacobianODE2RHS(self.model.mbs, 1.0, 0.0, 0.0)
        full = np.array(self.solver.GetSystemJacobian())[: q.size, : q.size]
        rings = self._in_unknowns(self._in_unknowns(full, q).T, q).T
        self.tangent = Tangent(rings, self._paths(q), self.model.segment.ravel(), self.taut)

    def _in_unknowns(self, rows: Floats, q: Floats) -> Floats:
        """Columns of the unknowns of the rings from those of the coordinates, shape (..., all) to (..., 6 N)."""
        rings = rows[:, self.model.rings]
        spins = np.einsum("rkc,ksc->rks", rings[..., 3:], self._spun(self.rings(q)[:, 3:]))
        return np.concatenate([rings[..., :3], spins], axis=2).reshape(len(rows), -1)

    def _paths(self, q: Floats) -> Floats:
        """Slopes of the lengths of the tendons over the notches in the unknowns of the rings, shape (m N, 6 N)."""
        place, rings = self.model.layout, np.concatenate([UPRIGHT[None], self.rings(q)])
        m, n = self.model.segment.shape
        origins = np.concatenate([np.zeros((1, 3)), place.far])
        before, beyond = place.before - origins[:-1, None], place.beyond - origins[1:, None]
        turns = rings[:-1, None, 3:], rings[1:, None, 3:]
        way = rings[1:, None, :3] + rotate(turns[1], beyond) - rings[:-1, None, :3] - rotate(turns[0], before)
        way /= np.linalg.norm(way, axis=-1, keepdims=True)
        out, each = np.zeros((m, n, n + 1, UNKNOWNS)), np.arange(n)
        for ring, sign, at, turn in ((each, -1.0, before, turns[0]), (each + 1, 1.0, beyond, turns[1])):
            slope = np.concatenate([way, cross(at, rotate(conjugate(turn), way))], axis=-1)
            out[:, each, ring] = sign * np.moveaxis(slope, 1, 0)
        return out[:, :, 1:].reshape(m * n, -1)

    def _step(self, forces: Forces, q: Floats, state: Floats, drive: Drive, *, settles: bool) -> tuple[Floats, Floats]:
        """Solve for the step of all unknowns, and for the states of the guides where they may change."""
        tangent = self.tangent
        assert tangent is not None
        free, taut = self._free_stiffness(forces.tension[:, 0]), np.ones_like(forces.tension, dtype=bool)
        taut[:, 1:], taut[:, 0] = self.taut, forces.tension[:, 0] >= 0.0
        tension = forces.tension / parts_of(taut)
        total = np.maximum(forces.tension[:, :-1], 0.0) + np.maximum(forces.tension[:, 1:], 0.0)
        guides = Guides(
            rings=forces.rings + tangent.paths.T @ forces.tension[:, 1:].ravel(),
            tension=tension.ravel(),
            free=free,
            force=forces.bristle.ravel(),
            bristle=self.bristle.ravel(),
            limit=(forces.limit - forces.ratio * total).ravel(),
            ratio=forces.ratio.ravel(),
            viscous=forces.viscous.ravel(),
            drag=self.drag,
            open=1e-9 * self.model.segment.ravel(),
        )
        step = Step(tangent, guides)
        if settles:
            end, states = settle(step, state.ravel(), taut.ravel(), 2 * self.tolerance)
        else:
            end, states = step.solve(state.ravel(), taut.ravel()), state
        return np.concatenate([end.rings, end.slips]), states.reshape(state.shape)

    def _free_stiffness(self, tension: Floats) -> Floats:
        """Of the tendons between wheel and base, where they are taut, shape (m,)."""
        free = np.array([one.tendon.EA_N / one.tendon.free_length_mm for one in self.model.rig.tendons])
        toe, pull = np.array([one.tendon.toe_N for one in self.model.rig.tendons]), np.maximum(tension, 0.0)
        share = np.divide(pull, pull + toe, out=np.ones_like(pull), where=toe > 0.0)
        return np.where(self.model.by_force, 0.0, free * share)

    def _moved(self, q: Floats, step: Floats) -> Floats:
        """Coordinates after a step of the unknowns, or a part of it, of first order in the strains of the flexures.

        A step along the unknowns themselves would stretch flexures that turn, at second order, and they are stiff.
        """
        flexures, rings = self.model.flexures, step[: self.slips.min()].reshape(-1, UNKNOWNS)
        part = NUDGE / max(float(np.abs(rings).max()), NUDGE)
        places = self.rings(q)
        spins = part * (rings[:, None, 3:] @ self._spun(places[:, 3:]))[:, 0]
        nudged = places + np.concatenate([part * rings[:, :3], spins], axis=1)
        both = np.stack([flexures.ends((at - flexures.straight).ravel()) for at in (places, nudged)])
        moved, phi = flexures.strains(both)[0]
        turned = float(np.linalg.norm(phi[1] - phi[0], axis=1).max()) / part
        share = min(1.0, LARGEST_ROTATION / max(turned, 1e-300))
        new = Strains(*(one[0] + share / part * (one[1] - one[0]) for one in (moved, phi)))
        out = q.copy()
        slides = step[self.slips]
        most = np.abs(slides).max(axis=1, keepdims=True)
        out[self.model.slip] += (np.minimum(1.0, LARGEST_SLIDE / np.maximum(most, LARGEST_SLIDE)) * slides).ravel()
        out[self.model.rings] = flexures.placed(new).reshape(-1, NODE)
        return out

    def _largest(self, residual: Floats) -> float:
        """Largest residual, moments over the arm of the tendons."""
        size = np.abs(residual)
        size[: self.slips.min()].reshape(-1, UNKNOWNS)[:, 3:] /= self.arm
        return float(size.max())

    def find(self, q: Floats, drive: Drive, state: Floats, attempt: Attempt) -> Balance | None:
        """Look for the equilibrium under a drive from coordinates; None where there is none near them."""
        found = self._find(q, drive, state, attempt)
        if found is None:  # where the search went astray the tangent is of no use
            self.tangent = None
        return found

    def _find(self, q: Floats, drive: Drive, state: Floats, attempt: Attempt) -> Balance | None:
        before, fresh = np.inf, False
        forces = self.forces(q, drive)
        for self.iterations in range(1, attempt.iterations + 1):
            settles = self.iterations > 1
            if settles:
                flat = state.ravel(), forces.bristle.ravel(), forces.limit.ravel()
                state = next_states(*flat, 2 * self.tolerance).reshape(state.shape)
                if attempt.before is not None and base_slides(attempt.before, state):
                    return None
            largest = self._largest(forces.residual(state))
            if not largest < 1e9 * self.scale:
                return None
            if settles and largest <= self.tolerance:
                return Balance(q, forces, state)
            fresh = self.tangent is None or (largest > STALE * before and not fresh)
            if fresh:
                self._take_tangent(q)
            step, state = self._step(forces, q, state, drive, settles=settles)
            q, before = self._moved(q, step), largest
            forces = self.forces(q, drive)
        return None


def base_slides(before: Floats, state: Floats) -> bool:
    """Whether a tendon has begun to slide at the base, or to slide in the other direction; states (m, N)."""
    now = state[:, 0]
    return bool(np.any((now != 0) & (now != before[:, 0])))


def _angle(a: Floats, b: Floats) -> Floats:
    """Angle between vectors, shape (...,)."""
    return np.asarray(np.arctan2(np.linalg.norm(cross(a, b), axis=-1), np.sum(a * b, axis=-1)))
