"""Moves a wrist in space from sample to sample in bounded steps, with the history of its dry elements."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from fem_models.load.stepping import (
    FINE,
    LEAST_LENGTH,
    front,
    front_speed,
    next_part,
    reach_after_success,
    too_short,
)
from fem_models.load.stepping import jumped as has_jumped
from fem_models.multibody.assembly import COMPRESSION
from fem_models.multibody.spatial.assembly import SpatialModel, assemble
from fem_models.multibody.spatial.equilibrium import Attempt, Balance, Drive, Equilibrium
from fem_models.multibody.spatial.flexures import NODE, Strains
from fem_models.multibody.spatial.jump import relax
from fem_models.rig.checks import SolverError
from fem_models.rig.tendon_law import tendon_stretch_mm
from fem_models.spatial import SpatialProgram, SpatialRig
from fem_models.spatial.parameters import SpatialSettings, force_scale_N
from fem_models.spatial.solve import step_control
from hysteresis.arrays import Floats

AT_REST = 10
"""Iterations at rest over those of a step."""
JUMP_LENGTH = 2.0**-6
"""Of the longest step: how far beyond the last equilibrium a jump is sought, as in the chain in space."""


@dataclass
class Energies:
    """Since the start, mJ."""

    work: float = 0.0
    friction: float = 0.0
    material: float = 0.0
    jump: float = 0.0


@dataclass
class Counts:
    """Steps that were accepted, that failed, and iterations of all of them."""

    steps: int = 0
    failed: int = 0
    iterations: int = 0


@dataclass(frozen=True)
class Change:
    """What the last step changed over its length: strains, slips, and fronts of sliding guides."""

    strains: Strains
    slip: Floats  # (m, N)
    front_speed: Floats  # (m,)


class Stepper:
    """A wrist at its last equilibrium. Lengths of steps are over the longest step of every drive.

    ``jumped``: on the way to the last sample. ``relaxed``: length of the next step by relaxation; it grows from one to
    the next while no step without it is found, and the wrist does not jump.
    """

    def __init__(self, rig: SpatialRig, program: SpatialProgram, settings: SpatialSettings) -> None:
        self.rig, self.settings, scale = rig, settings, force_scale_N(rig)
        self.model: SpatialModel = assemble(rig, program.by_force, settings.bristle_ratio)
        stiffest = max(1.0, settings.bristle_ratio) * max(one.tendon.EA_N for one in rig.tendons)
        # rounding of a length times the stiffest spring is the least residual there can be
        self.solver = Equilibrium(self.model, scale, max(settings.tolerance * scale, 1e-12 * stiffest))
        self.control, self.longest = step_control(rig, program.by_force, self.solver.arm, settings)
        self.energies, self.counts, self.reach = Energies(), Counts(), self.control.max_step
        self.headings, self.jumped, self.relaxed = np.zeros(len(rig.tendons)), False, 0.0
        self.drive = Drive(np.where(program.by_force, rig.preload_N, 0.0), 0.0)
        self.now, self.change = self._straight(), self._no_change()
        self._take_up(self.now)
        self._find_rest()

    def strains(self, q: Floats) -> Strains:
        """Of the flexures at coordinates."""
        return self.model.flexures.strains(self.model.flexures.ends(q[self.model.rings].ravel()))[0]

    def slips(self, q: Floats) -> Floats:
        """Of the tendons at their guides, shape (m, N)."""
        return np.asarray(q[self.model.slip].reshape(self.model.segment.shape))

    def _with(self, strains: Strains, slip: Floats) -> Floats:
        q = self.now.q.copy() if hasattr(self, "now") else self.solver.coordinates()
        q[self.model.rings] = self.model.flexures.placed(strains).reshape(-1, NODE)
        q[self.model.slip] = slip.ravel()
        return q

    def _straight(self) -> Balance:
        """Give the rig as it is without load: no equilibrium where tendons do not balance each other."""
        m, n = self.model.segment.shape
        state = np.zeros((m, n))
        q = self._with(Strains(np.zeros((n, 3)), self.model.flexures.laws.rest.copy()), state)
        return Balance(q, self.solver.forces(q, self.drive), state)

    def _find_rest(self) -> None:
        """Go to the equilibrium without drive, where energies count from."""
        attempt = Attempt(AT_REST * self.settings.newton_iterations)
        found = self.solver.find(self.now.q, self.drive, self.now.state, attempt)
        if found is not None:
            self._take_up(found)
            self.accept(found, self.drive)
        elif relax(self, self.drive):
            self._take_up(self.now)
            self.energies = Energies()
        else:
            raise SolverError(f"rig {self.rig.name}: no equilibrium at rest")

    def _take_up(self, found: Balance) -> None:
        """Count friction and work from an equilibrium on."""
        self.now, self.limit, self.wound = found, found.forces.limit, self._wound(found, self.drive)

    def move(self, drives: Floats, *, first: bool) -> float:
        """Go to the drives of a sample; returns the part of the way that was reached. Weights come on to the first."""
        start, done, self.jumped = self.drive.tendons, 0.0, False
        headings = np.sign(drives - start)
        length = float((np.abs(drives - start) / self.longest).max())
        if length == 0.0 or first:
            length = max(length, self.control.max_step)
        while done < 1.0:
            part = next_part(done, self.reach, length, self.control.max_step)
            goal = drives if part == 1.0 else start + part * (drives - start)
            load, size = Drive(goal, part if first else 1.0), (part - done) * length
            fine = size <= FINE * self.control.max_step
            found = self._try(load, size, headings, fine=fine)
            if found is None:
                self.reach = 0.5 * size
                self.counts.failed += 1
                if fine:
                    self.headings = np.full_like(headings, np.nan)
                if too_short(self.reach, self.control) or self.reach < self.relaxed:
                    self.reach = self.relaxed = max(self.relaxed, JUMP_LENGTH * self.control.max_step)
                    part = next_part(done, self.reach, length, self.control.max_step)
                    goal = drives if part == 1.0 else start + part * (drives - start)
                    jumped = self._leap(Drive(goal, part if first else 1.0), (part - done) * length)
                    if jumped is None:
                        return done
                    self.relaxed = 0.0 if jumped else min(2 * self.relaxed, FINE * self.control.max_step)
                    self.jumped, done = self.jumped or jumped, part
                    self.counts.steps += 1
                continue
            self._learn(found, size, headings)
            self.accept(found, load)
            self.counts.steps += 1
            self.relaxed = 0.5 * self.relaxed if self.relaxed > JUMP_LENGTH * self.control.max_step else 0.0
            self.reach, done = reach_after_success(self.reach, self.control), part
        return 1.0

    def _leap(self, load: Drive, size: float) -> bool | None:
        """Relax to the next equilibrium in a step of a size; whether the wrist jumped, None where it finds none.

        It jumped where it moved by more than a step of that size explains.
        """
        start, slip, lost = self.strains(self.now.q).rotation, self.slips(self.now.q), self.energies.jump
        if not relax(self, load):
            return None
        self.headings = np.full_like(self.headings, np.nan)
        self.change = self._no_change()
        jumped = self._moved_far(start, slip, self.now, size)
        if not jumped:
            self.energies.jump = lost
        return jumped

    def _moved_far(self, rotation: Floats, slip: Floats, found: Balance, size: float) -> bool:
        """Whether an equilibrium is further from rotations and slips than a step of a size explains."""
        turned = np.linalg.norm(self.strains(found.q).rotation - rotation, axis=1).max()
        slid = np.abs(self.slips(found.q) - slip).max()
        return bool(has_jumped(float(turned), float(slid), size, self.control))

    def _no_change(self) -> Change:
        m, n = self.model.segment.shape
        return Change(Strains(np.zeros((n, 3)), np.zeros((n, 3))), np.zeros((m, n)), np.zeros(m))

    def _try(self, load: Drive, size: float, headings: Floats, *, fine: bool) -> Balance | None:
        """Find the next equilibrium; None where there is none, where it is elsewhere, or a corner is passed."""
        same = headings == self.headings
        state = np.where(same[:, None], self.now.state, 0.0)
        slack = self.now.forces.tension.max(axis=1) <= COMPRESSION * self.solver.scale
        state[slack] = headings[slack, None]  # what is drawn taut slides at all guides, where sticking would stretch it
        for row, speed, on in zip(state, self.change.front_speed, same, strict=True):
            if on:
                reached = front(row)
                row[reached : reached + int(size * speed)] = row[0]
        here, slip = self.strains(self.now.q), self.slips(self.now.q)
        q = self.now.q
        if same.any():
            guess = Strains(*(a + size * change for a, change in zip(here, self.change.strains, strict=True)))
            q = self._with(guess, slip + size * same[:, None] * self.change.slip)
        attempt = Attempt(self.settings.newton_iterations, None if fine else self.now.state)
        found = self.solver.find(q, load, state, attempt)
        self.counts.iterations += self.solver.iterations
        if found is None:
            return None
        return None if self._moved_far(here.rotation, slip, found, size) else found

    def _learn(self, found: Balance, size: float, headings: Floats) -> None:
        """Note what a step changed, for the next one to start from."""
        speeds = [
            front_speed(front(before), front(after), heading, last, size)
            for before, after, heading, last in zip(self.now.state, found.state, headings, self.headings, strict=True)
        ]
        by = 1.0 / max(size, LEAST_LENGTH)
        pairs = zip(self.strains(found.q), self.strains(self.now.q), strict=True)
        strains = Strains(*(by * (after - before) for after, before in pairs))
        self.change = Change(strains, by * (self.slips(found.q) - self.slips(self.now.q)), np.array(speeds))
        self.headings = headings

    def _wound(self, found: Balance, load: Drive) -> Floats:
        """How much of every tendon is wound in, mm; of a prescribed tension by its slip and stretch, shape (m,)."""
        wound, slip = load.tendons.copy(), self.slips(found.q)[:, 0]
        for j, force in enumerate(self.model.by_force):
            if force:
                tension = max(float(load.tendons[j]), 1e-300)
                stretch = tendon_stretch_mm(self.rig.tendons[j].tendon, tension, self.rig.preload_N, 0.0)
                wound[j] = slip[j] + float(stretch)
        return wound

    def accept(self, found: Balance, load: Drive) -> None:
        """Move the rest points of what has slipped, and book work and losses."""
        forces, slip = found.forces, self.slips(found.q)
        force = np.clip(forces.bristle, -forces.limit, forces.limit)
        rest = slip - force / self.solver.bristle
        self.energies.friction += float((0.5 * (self.limit + forces.limit) * np.abs(rest - self.solver.rest)).sum())
        self.solver.rest, self.limit = rest, forces.limit
        wound = self._wound(found, load)
        pull = 0.5 * (self.now.forces.tension[:, 0] + forces.tension[:, 0])
        self.energies.work += float(pull @ (wound - self.wound))
        self.energies.material += self.model.flexures.slip(self.strains(found.q).rotation)
        self.now, self.drive, self.wound = found, load, wound

    def stored_mJ(self) -> float:
        """Elastic energy above that at rest, without that of weights."""
        tension, preload, total = np.maximum(self.now.forces.tension, 0.0), self.rig.preload_N, 0.0
        for one, here in zip(self.rig.tendons, tension[:, 0].tolist(), strict=True):
            free, toe = one.tendon.EA_N / one.tendon.free_length_mm, one.tendon.toe_N
            total += (here**2 - preload**2 + 2 * toe * (here - preload)) / (2 * free)
        total += float(((tension[:, 1:] ** 2 - preload**2) / (2 * self.model.segment)).sum())
        total += float((0.5 * self.solver.bristle * (self.slips(self.now.q) - self.solver.rest) ** 2).sum())
        return total + self.model.flexures.stored_mJ(self.strains(self.now.q))
