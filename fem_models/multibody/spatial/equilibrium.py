"""Equilibrium of an assembled wrist: forces of Exudyn, dry friction and the drives, by Newton's method.

Exudyn gives forces and tangent of rings, flexures, tendons and weights. Rings turn by spins, 7 coordinates being 6
unknowns. The tensions follow from the forces on the slips: what pulls at guide k is the tension before it less that
beyond it. Friction is that of the planar model; its limits need no iteration of their own here.
"""

from __future__ import annotations

from typing import Any, NamedTuple

import exudyn as exu
import numpy as np
from scipy.linalg import lu_factor, lu_solve

from fem_models.joint.friction import friction_limits_N
from fem_models.multibody.assembly import COMPRESSION
from fem_models.multibody.spatial.assembly import SpatialModel
from fem_models.multibody.spatial.flexures import NODE, NUDGE, Strains, cross, rotate
from fem_models.rig.tendon_law import tendon_stretch_mm, tendon_tension_N
from hysteresis.arrays import Floats

UNKNOWNS = 6  # of a ring: place and spin
LARGEST_ROTATION = 0.02  # rad of a joint in an iteration, lest tendons fall slack meanwhile
SETTLES = 0.05  # residual over the scale of forces, below which guides may change between sticking and sliding
SLACK = 0.1  # of the stiffness of a segment that is slack, in the tangent only: it bounds what slides into it
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
    bristle: Floats  # (m, N): force of a bristle that sticks

    def residual(self, state: Floats) -> Floats:
        """Take guides in given states, and return what is out of balance, shape (6 N + m N,)."""
        friction = np.where(state == 0, self.bristle, state * self.limit)
        return np.concatenate([self.rings, (self.tension[:, :-1] - self.tension[:, 1:] - friction).ravel()])


class Balance(NamedTuple):
    """An equilibrium: coordinates, forces, and states of the guides."""

    q: Floats
    forces: Forces
    state: Floats  # (m, N): 0 sticks, 1 or -1 slides


class Attempt(NamedTuple):
    """How to look for an equilibrium.

    ``before``, shape (m, N), are the states of the guides at the last one, for a step that is given up where a tendon
    begins to slide at the base: the work of its drive has a corner there. None allows it. ``smooth`` leaves friction
    out: all tendons slide as they are drawn.
    """

    iterations: int
    before: Floats | None = None
    smooth: bool = False


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
        rings = model.rings.shape[0]
        self.slips = UNKNOWNS * rings + np.arange(self.rest.size).reshape(self.rest.shape)
        self.tangent: Floats | None = None  # of the elastic parts in the unknowns, and its factors with the guides
        self.factors: Any = None

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
        self.solver.ComputeODE2RHS(self.model.mbs)
        acting = np.array(self.solver.GetSystemResidual())[: q.size]
        slip, pulls = q[self.model.slip].reshape(self.rest.shape), acting[self.model.slip].reshape(self.rest.shape)
        free = self.free_tensions(slip[:, 0], drive)
        tension = np.concatenate([free[:, None], -np.cumsum(pulls, axis=1)], axis=1)
        dry, wrap = self.model.rig.friction, np.zeros_like(slip)
        if dry.capstan_coefficient > 0:
            wrap = self.wraps(q)
        limit = friction_limits_N(dry, tension[:, :-1], tension[:, 1:], wrap)
        rings = acting[self.model.rings]
        turning = self._spun(self.rings(q)[:, 3:]) @ rings[:, 3:, None]
        rings = np.concatenate([rings[:, :3], turning[..., 0]], axis=1).ravel()
        return Forces(rings, tension, limit, self.bristle * (slip - self.rest))

    def smooth(self, q: Floats, drive: Drive) -> Forces:
        """Work out the forces at coordinates without friction of guides that slide."""
        forces = self.forces(q, drive)
        return forces._replace(limit=0.0 * forces.limit)

    def free_tensions(self, slip: Floats, drive: Drive) -> Floats:
        """Tensions between the drives and the base, shape (m,).

        What is slack there pushes as little as Exudyn's segments do: between both a slack tendon may lie anywhere.
        """
        rig, model, least = self.model.rig, self.model, COMPRESSION * self.scale
        out = drive.tendons.copy()
        for j, (one, force, slid) in enumerate(zip(rig.tendons, model.by_force, slip, strict=True)):
            if not force:
                out[j] = tendon_tension_N(one.tendon, drive.tendons[j] - slid, rig.preload_N, 0.0)
                if out[j] == 0.0:
                    beyond = tendon_stretch_mm(one.tendon, 0.0, rig.preload_N, 0.0) - (drive.tendons[j] - slid)
                    out[j] = -least * np.tanh(one.tendon.EA_N / one.tendon.free_length_mm * beyond / least)
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

    def _take_tangent(self, q: Floats, drive: Drive) -> None:
        """Tangent of Exudyn in the unknowns, at the coordinates that were set last."""
        self.solver.ComputeJacobianODE2RHS(self.model.mbs, 1.0, 0.0, 0.0)
        full = np.array(self.solver.GetSystemJacobian())[: q.size, : q.size]
        self.tangent, self.factors = self._in_unknowns(self._in_unknowns(full, q).T, q).T, None

    def _in_unknowns(self, rows: Floats, q: Floats) -> Floats:
        """Columns of the unknowns from those of the coordinates, shape (..., all) to (..., 6 N + m N)."""
        rings = rows[:, self.model.rings]
        spins = np.einsum("rkc,ksc->rks", rings[..., 3:], self._spun(self.rings(q)[:, 3:]))
        rings = np.concatenate([rings[..., :3], spins], axis=2).reshape(len(rows), -1)
        return np.concatenate([rings, rows[:, self.model.slip]], axis=1)

    def _factor(self, forces: Forces, q: Floats, state: Floats, drive: Drive) -> None:
        """Add drives and guides to the tangent, and factor it."""
        assert self.tangent is not None
        whole, n = self.tangent.copy(), state.shape[1]
        slip = q[self.model.slip].reshape(state.shape)
        stiff = (self.free_tensions(slip[:, 0] - 1e-6, drive) - self.free_tensions(slip[:, 0] + 1e-6, drive)) / 2e-6
        total = np.maximum(forces.tension[:, :-1], 0) + np.maximum(forces.tension[:, 1:], 0)
        constant = np.full(n, self.model.rig.friction.guide_N)
        constant[0] += self.model.rig.friction.sheath_N
        ratio = state * np.maximum(forces.limit - constant, 0.0) / np.maximum(total, 1e-300)
        for j, slips in enumerate(self.slips):
            pulls = np.cumsum(self.tangent[slips], axis=0)  # of the tensions beyond, but for their sign
            before = np.concatenate([np.zeros((1, pulls.shape[1])), -pulls[:-1]])
            before[0, slips[0]] = -stiff[j]
            whole[slips[0], slips[0]] -= stiff[j]
            whole[slips] -= ratio[j, :, None] * (before - pulls)
            soft = np.where(state[j] == 0, self.bristle[j], 1e-9 * self.model.segment[j])
            loose = np.where(
                forces.tension[j, 1:] < -0.5 * COMPRESSION * self.scale, SLACK * self.model.segment[j], 0.0
            )
            whole[slips, slips] -= soft + loose
            whole[slips[1:], slips[1:]] -= loose[:-1]
            whole[slips[1:], slips[:-1]] += loose[:-1]
            whole[slips[:-1], slips[1:]] += loose[:-1]
        self.factors = lu_factor(whole, check_finite=False)

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
        out[self.model.slip] += step[self.slips].ravel()
        out[self.model.rings] = flexures.placed(new).reshape(-1, NODE)
        return out

    def _largest(self, residual: Floats) -> float:
        """Largest residual, moments over the arm of the tendons."""
        size = np.abs(residual)
        size[: self.slips.min()].reshape(-1, UNKNOWNS)[:, 3:] /= self.arm
        return float(size.max())

    def next_states(self, forces: Forces, state: Floats) -> Floats:
        """States by the forces; a guide that slides sticks before it slides in the other direction."""
        off, force = 2 * self.tolerance, forces.bristle
        loose = np.where(np.abs(force) > forces.limit + off, np.sign(force), 0.0)
        return np.where(state == 0, loose, np.where(force * state < forces.limit - off, 0.0, state))

    def find(self, q: Floats, drive: Drive, state: Floats, attempt: Attempt) -> Balance | None:
        """Look for the equilibrium under a drive from coordinates; None where there is none near them."""
        found = self._find(q, drive, state, attempt)
        if found is None:  # where the search went astray the tangent is of no use
            self.tangent = None
        return found

    def _find(self, q: Floats, drive: Drive, state: Floats, attempt: Attempt) -> Balance | None:
        before, fresh, last = np.inf, False, state if attempt.before is None else attempt.before
        acting = self.smooth if attempt.smooth else self.forces
        forces = acting(q, drive)
        for self.iterations in range(1, attempt.iterations + 1):
            residual = forces.residual(state)
            largest = self._largest(residual)
            if not largest < 1e9 * self.scale:
                return None
            if largest < SETTLES * self.scale:
                settled = state if attempt.smooth else self.next_states(forces, state)
                if attempt.before is not None and base_slides(last, settled):
                    return None
                if np.array_equal(settled, state):
                    if largest <= self.tolerance:
                        return Balance(q, forces, state)
                else:
                    state, self.factors, before = settled, None, np.inf
                    residual = forces.residual(state)
                    largest = self._largest(residual)
            fresh = self.tangent is None or (largest > STALE * before and not fresh)
            if fresh:
                self._take_tangent(q, drive)
            if self.factors is None:
                self._factor(forces, q, state, drive)
            step = -lu_solve(self.factors, residual, check_finite=False)
            q, before = self._moved(q, step), largest
            forces = acting(q, drive)
        return None


def base_slides(before: Floats, state: Floats) -> bool:
    """Whether a tendon has begun to slide at the base, or to slide in the other direction; states (m, N)."""
    now = state[:, 0]
    return bool(np.any((now != 0) & (now != before[:, 0])))


def _angle(a: Floats, b: Floats) -> Floats:
    """Angle between vectors, shape (...,)."""
    return np.asarray(np.arctan2(np.linalg.norm(cross(a, b), axis=-1), np.sum(a * b, axis=-1)))
