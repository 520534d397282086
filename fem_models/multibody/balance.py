"""Newton's method with friction inside, for steps at which Exudyn's own finds no end.

Exudyn gives the forces of an assembled rig and their slopes, without its guides. Friction is added here as it depends
on the present tensions and angles, with its slopes:

    f = k (s - s_rest), at most c + tanh(mu wrap/2) (T_wheel + T_tip)

with the slip s and the tensions T on both sides, where they pull. So is what resists a change from one pseudo-time to
the next (:class:`Viscosity`). A step of Newton's method turns stiff rings without strain (:meth:`Model.with_chords`).
It is shortened where it leads beyond the least energy on its way: friction apart, forces have a potential, with kinks
where guides slide and tendons become taut.
"""

from __future__ import annotations

from typing import Any, NamedTuple

import exudyn as exu
import numpy as np
from scipy.sparse import csc_matrix
from scipy.sparse.linalg import splu

from fem_models.joint.friction import guide_wrap_rad
from fem_models.multibody.assembly import Model
from fem_models.multibody.dry_elements import Guides
from fem_models.rig import Rig
from fem_models.rig.rig import Friction
from hysteresis.arrays import Floats, Ints

LARGEST_STEP = 0.3
"""Largest change in a step of Newton's method, mm; of rotations times the moment arm."""
SMALL_STEP = 1e-7
"""The last step of Newton's method, in the same measure."""
SHORTER_STEPS = 12
"""How often a step of Newton's method is shortened."""
NEAR = 1e-4
"""Part of a step over which the direction of the path is taken."""


class Viscosity(NamedTuple):
    """What resists a change of coordinates since the last pseudo time: forces over changes, shape (n, n)."""

    matrix: Floats
    start: Floats

    def force(self, q: Floats) -> Floats:
        """Force at coordinates, shape (n,)."""
        return np.asarray(self.matrix @ (q - self.start))


class Found(NamedTuple):
    """Coordinates of an equilibrium, states of its guides (0 where they stick, else the sign), limits of friction."""

    q: Floats
    sliding: Floats
    limit: Floats


class _Forces(NamedTuple):
    """Forces that are not in balance, shape (n,); tensions (tendons, N+1); of the guides: limits, states, ratios."""

    off: Floats
    tension: Floats
    limit: Floats
    sliding: Floats
    ratio: Floats


class Balance:
    """Forces and slopes of an assembled rig at any coordinates, at the load that it has."""

    def __init__(self, model: Model, rig: Rig, guides: Guides, settings: Any, *, load_control: bool) -> None:
        self.model, self.rig, self.guides, self.load_control = model, rig, guides, load_control
        self.settings = settings
        self.solver = exu.MainSolverStatic()
        self.weight = np.ones(model.size)
        arm = max(tendon.moment_arm_mm for tendon in rig.tendons)
        for turned in (model.rotation, model.near_rotation, model.bent):
            self.weight[turned] = arm

    def start(self) -> None:
        """Make the solver ready for what has been set, and leave friction to this module."""
        self.guides.let_go()
        self.solver.InitializeSolver(self.model.mbs, self.settings)
        self.solver.ComputeJacobianODE2RHS(self.model.mbs, 0.0, 0.0, 0.0)
        self.solver.ComputeJacobianAE(self.model.mbs, 1.0, 0.0, 0.0)
        n = self.model.size
        links = np.asarray(self.solver.GetSystemJacobian())[n:, :n]  # constraints of single coordinates
        self.fixed: Ints = np.abs(links).argmax(axis=1)
        self.link = links[np.arange(self.fixed.size), self.fixed]
        self.free = np.setdiff1d(np.arange(n), self.fixed)

    def placed(self, q: Floats) -> Floats:
        """Coordinates with those that the base and the wheel prescribe."""
        self.model.mbs.systemData.SetODE2Coordinates(q)
        self.solver.ComputeAlgebraicEquations(self.model.mbs)
        out = q.copy()
        out[self.fixed] -= np.asarray(self.solver.GetSystemResidual())[self.model.size :] / self.link
        return out

    def forces(self, q: Floats, friction: Friction, drive_N: float, viscosity: Viscosity | None) -> _Forces:
        """Work out the forces at coordinates."""
        model = self.model
        model.mbs.systemData.SetODE2Coordinates(q)
        self.solver.ComputeODE2RHS(model.mbs)
        off = -np.array(self.solver.GetSystemResidual())[: model.size]
        tension = model.tensions(drive_N if self.load_control else None)
        wrap = guide_wrap_rad(friction, np.diff(q[model.rotation]))
        ratio = np.tanh(0.5 * friction.capstan_coefficient * wrap)
        constant = np.full(wrap.size, float(friction.guide_N))
        constant[0] += friction.sheath_N
        pull = np.maximum(tension, 0.0)
        loose = self.guides.loose
        limit = np.where(loose, 0.0, (constant + ratio * (pull[:, :-1] + pull[:, 1:])).ravel())
        stuck = self.guides.bristle * (q[model.slip] - self.guides.rest)
        sliding = self.guides.unheld(np.where(np.abs(stuck) > limit, np.sign(stuck), 0.0))
        off[model.slip] += np.where(sliding == 0.0, stuck, sliding * limit)
        if viscosity is not None:
            off += viscosity.force(q)
        return _Forces(off, tension, limit, sliding, ratio)

    def slopes(self, q: Floats, at: _Forces, friction: Friction, viscosity: Viscosity | None) -> Floats:
        """Slopes of :meth:`forces` in the coordinates, shape (n, n)."""
        model, n = self.model, self.model.size
        model.mbs.systemData.SetODE2Coordinates(q)
        self.solver.ComputeJacobianODE2RHS(model.mbs, -1.0, 0.0, 0.0, int(bool(model.dead)))
        slopes = np.array(self.solver.GetSystemJacobian())[:n, :n]
        by_q = self._tension_slopes(slopes, at.tension)
        by_q[at.tension <= 0.0] = 0.0
        by_wrap = 0.5 * friction.capstan_coefficient * (1.0 - at.ratio**2)
        turned = np.sign(np.diff(q[model.rotation]))
        pull, joints = np.maximum(at.tension, 0.0), turned.size
        for side in range(len(self.rig.tendons)):
            for i in range(joints):
                number = side * joints + i
                row = slopes[model.slip[number]]
                if self.guides.loose[number]:
                    continue
                if at.sliding[number] == 0.0:
                    row[model.slip[number]] += self.guides.bristle[number]
                    continue
                rise = at.ratio[i] * (by_q[side, i] + by_q[side, i + 1])
                for joint in (i - 1, i) if i else (0,):
                    slope = 0.5 * by_wrap[i] * turned[joint] * (pull[side, i] + pull[side, i + 1])
                    rise[model.rotation[joint + 1]] += slope
                    rise[model.rotation[joint]] -= slope
                row += at.sliding[number] * rise
        slopes[model.slip, model.slip] += np.where(self.guides.loose, 0.0, self.guides.open)
        if viscosity is not None:
            slopes += viscosity.matrix
        return slopes

    def _tension_slopes(self, slopes: Floats, tension: Floats) -> Floats:
        """Slopes of all tensions in the coordinates, shape (tendons, N+1, n): each row of a slip is a difference."""
        model, n = self.model, self.model.size
        out = np.zeros((*tension.shape, n))
        for side, tendon in enumerate(self.rig.tendons):
            slip = model.slip.reshape(len(self.rig.tendons), -1)[side]
            if not self.load_control and tension[side, 0] > 0.0:
                part = tension[side, 0] / (tension[side, 0] + tendon.toe_N)
                out[side, 0, slip[0]] = -part * tendon.EA_N / tendon.free_length_mm
            out[side, 1:] = out[side, 0] + np.cumsum(slopes[slip], axis=0)
        return out

    def solve(
        self,
        q: Floats,
        friction: Friction,
        drive_N: float,
        tolerance_N: float,
        *,
        viscosity: Viscosity | None = None,
        iterations: int = 40,
    ) -> Found | None:
        """Find coordinates in balance, from given ones; None where there are none near."""
        model, free = self.model, self.free
        q = self.placed(q)
        at = self.forces(q, friction, drive_N, viscosity)
        for _ in range(iterations):
            try:
                factors = splu(csc_matrix(self.slopes(q, at, friction, viscosity)[np.ix_(free, free)]))
            except RuntimeError:  # singular
                return None
            step = np.zeros(model.size)
            step[free] = factors.solve(-at.off[free])
            speed = model.chord_speeds(q, step)
            size = float(np.abs(self.weight * speed).max())
            if not np.isfinite(size):
                return None
            if size <= SMALL_STEP and np.abs(at.off[model.slip]).max() <= tolerance_N:
                return Found(q, at.sliding, at.limit)
            downhill = float(at.off[free] @ step[free])
            part, chords = min(1.0, LARGEST_STEP / size), model.with_chords(q)
            for _ in range(SHORTER_STEPS):
                tried = model.with_places(chords + part * speed)
                then = self.forces(tried, friction, drive_N, viscosity)
                ahead, behind = (model.with_places(chords + (part + d) * speed) for d in (NEAR, -NEAR))
                slope = float(then.off[free] @ (ahead - behind)[free]) / (2 * NEAR)
                if size <= SMALL_STEP or downhill >= 0.0 or slope <= -0.5 * downhill:
                    break
                part *= min(max(downhill / (downhill - slope), 0.1), 0.9)
            q, at = tried, then
        return None
