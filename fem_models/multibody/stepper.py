"""Moves the assembled rig quasi-statically from load to load in bounded steps."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass, replace
from itertools import product
from typing import Any, NamedTuple

import exudyn as exu
import numpy as np

from fem_models.joint import JointRow
from fem_models.joint.friction import friction_limits_N, guide_wrap_rad, scaled_friction
from fem_models.load.stepping import (
    LEAST_LENGTH,
    Load,
    StepControl,
    at_rest,
    between,
    drive_control,
    force_control,
    front,
    front_speed,
    jumped,
    next_step,
    reach_after_success,
    too_short,
)
from fem_models.multibody.assembly import MASSLESS, RIGID_RINGS, SLACK, RingInertia, assemble, keeps_tension
from fem_models.multibody.balance import Balance, Viscosity
from fem_models.multibody.dry_elements import Dashpots, Guides, Losses, Material, set_each
from fem_models.rig import Rig
from fem_models.rig.checks import SolverError
from fem_models.rig.rig import Friction
from fem_models.rig.tendon_law import tendon_stretch_mm
from hysteresis.arrays import Floats


@dataclass(frozen=True)
class MultibodySettings:
    """Numerical settings; the tests verify the defaults.

    ``bristle_ratio`` is the stiffness of a sticking guide over EA/pitch: at 20 close to its limit, no give at all.
    ``friction_tolerance`` ends the fixed point between tensions and friction limits, and
    ``newton_tolerance`` Newton's method, over the force scale of
    :class:`fem_models.joint.mechanics.JointMechanics`. ``max_step_mm`` bounds a step of the drive whatever the
    sampling, ``max_force_step`` that of a force, over the same scale. ``max_halvings`` is how often a step that fails
    is halved. ``max_friction_iterations`` also bounds how often guides may change between sticking and sliding in a
    step. ``lead_pitches`` is how far before a notch the connector of a tendon starts, over the pitch. What slides into
    a segment, at most some 5 % of a pitch, changes its stiffness by 0.05 % at 100. With a longer one Newton's method
    finds the end of slack less often: a run that ends so is taken up with ``short_lead_pitches``.
    ``pseudo_viscosity`` scales what holds a jump back; its end does not depend on it.
    """

    bristle_ratio: float = 20.0
    friction_tolerance: float = 1e-6
    max_friction_iterations: int = 40
    max_step_mm: float = 0.1
    max_force_step: float = 0.25
    max_halvings: int = 12
    newton_tolerance: float = 5e-5
    newton_iterations: int = 15
    lead_pitches: float = 100.0
    short_lead_pitches: float = 10.0
    pseudo_viscosity: float = 1.0


PLAIN, KEPT = 2, 6
"""Limits of friction that are put in as they come out, before they are mixed; how many of the last ones are mixed."""


AT_REST = 20
"""Iterations of Newton's method at rest over those of a step."""
NO_ROOM = 0.98
"""Part of the length between two rings that a tendon has lost where they meet."""
MOST_SLID_PITCHES = 1.0
"""Most tendon that enters or leaves a segment, over the pitch: a joint that bends by 1 rad takes in half of that."""
LEAST_PART = 1e-3
"""Smallest step of the way to the equilibrium at rest."""
PSEUDO_ROTATION = 2e-3
"""Largest rotation of a joint in a step in pseudo-time, rad."""
FIRST_PSEUDO_STEP, LEAST_PSEUDO_STEP, MOST_PSEUDO_STEPS = 1e-3, 1e-9, 2000
INSTANT_S = 1e-12
"""Time over which a section gives off no heat."""
TOE_SLACK = 1e-6
"""Tension over the force scale at which a tendon with a toe region, which always has some, counts as slack."""
SLACK_TURNS = 4
"""How often tendons may become slack or taut in the search for an equilibrium."""
ALL_AT_ONCE = 20
"""Solves of a step in which all guides may change their state; beyond them they could take turns for ever."""


def mixed(tried: list[tuple[Floats, Floats]]) -> Floats:
    """Limits to try next, shape (guides,), by what limits gave what tensions would allow.

    Soft joints turn far for little friction, and friction grows with their wrap: limits put in as they come out then
    swing about the solution, wider and wider on a flat plateau of the material. Their differences show how they swing
    (Anderson 1965, doi 10.1145/321296.321305).
    """
    given = np.array([limit for limit, _ in tried[-KEPT:]])
    found = np.array([update for _, update in tried[-KEPT:]])
    off = found - given
    weights = np.linalg.lstsq(np.diff(off, axis=0).T, off[-1], rcond=1e-10)[0]
    return np.asarray(np.maximum(found[-1] - np.diff(found, axis=0).T @ weights, 0.0))


class FrictionState(NamedTuple):
    """Which guides slide, and the limits of their friction, N; shapes (guides,)."""

    sliding: Floats
    limit: Floats


@contextmanager
def quiet() -> Iterator[None]:
    """Keep Exudyn from printing what ends in an error of ours, or in a halved step."""
    before = exu.config.printToConsole
    exu.config.printToConsole = False
    try:
        yield
    finally:
        exu.config.printToConsole = before


class Stepper:
    """Moves an assembled rig along its load program, with the history of its dry elements."""

    def __init__(
        self,
        rig: Rig,
        joints: JointRow,
        settings: MultibodySettings,
        inertia: RingInertia = MASSLESS,
        *,
        load_control: bool = False,
    ) -> None:
        self.rig, self.joints, self.settings, self.load_control = rig, joints, settings, load_control
        self.control = _step_control(rig, joints, settings, load_control=load_control)
        self.model = assemble(
            rig,
            joints,
            settings.bristle_ratio,
            inertia,
            load_control=load_control,
            lead_pitches=settings.lead_pitches,
        )
        # The force scale of stiff joints has no bound: a share of it is no tolerance beyond 1 % of strain.
        self.scale_N = min(joints.force_scale_N, *(1e-2 * tendon.EA_N for tendon in rig.tendons))
        self.guides = Guides(self.model, rig, settings.bristle_ratio, self.scale_N)
        self.material = Material(self.model, rig, joints)
        self.dashpots = Dashpots(self.model, rig)
        self.losses, self.jumps = Losses(), 0
        self.solver = _static_solver(rig, joints, settings)
        self.balance = Balance(self.model, rig, self.guides, self.solver, load_control=load_control)
        self.load, self.reach = at_rest(joints.first.rest_angle_rad), self.control.max_step
        self._set_rest_angle(joints.first.rest_angle_rad)
        # of the last step: direction of the drive, and changes of Model.with_chords, friction limits, fronts per length
        self.direction, self.increment = 0.0, 0.0 * self.coordinates()
        self.limit_slope, self.front_speed = 0.0 * self.guides.limit, np.zeros(len(rig.tendons))
        self.guides.limit = self.limits()

    def coordinates(self) -> Floats:
        """All coordinates of the system."""
        return np.asarray(self.model.mbs.systemData.GetODE2Coordinates())

    def tensions(self) -> Floats:
        """Shape (tendons, N+1), wheel to tip."""
        return self.model.tensions(self.load.drive if self.load_control else None)

    def tip_mm(self) -> Floats:
        """Centre of the last ring, shape (2,).

        The model has all neutral axes on one line. The steps between them move the tip as in the chain.
        """
        ring = self.model.tip
        position = self.model.mbs.GetObjectOutputBody(
            ring.body, exu.OutputVariableType.Position, localPosition=[ring.centre_mm, 0, 0]
        )
        if self.joints.alike:
            return np.asarray(position)[:2]
        heading, aside = self.coordinates()[self.model.rotation[1:]], self.joints.lengths.aside
        steps = [-aside @ np.sin(heading), aside @ (np.cos(heading) - 1.0)]
        return np.asarray(position)[:2] + steps

    def limits(self) -> Floats:
        """Greatest friction of each guide at the present tensions and angles, N; the tensions are kept as ``found``."""
        tension = self.found = self.tensions()
        wrap = guide_wrap_rad(self.rig.friction, np.diff(self.coordinates()[self.model.rotation]))
        dry = scaled_friction(self.rig.friction, self.load.friction_scale)
        limit = friction_limits_N(dry, tension[:, :-1], tension[:, 1:], wrap)
        return np.where(self.guides.loose, 0.0, limit.ravel())

    def slack_by_tension(self) -> tuple[bool, ...]:
        """Which tendons are slack by the present tensions of their segments, ``found``.

        Capstan friction alone leaves no tension anywhere where there is none at one place. Constant friction of the
        guides may hold slack between them: such a tendon is slack segment by segment.
        """
        if self.rig.friction.guide_N > 0.0:
            return self.guides.slack
        scale, tolerance = self.scale_N, self.solver.staticSolver.newton.absoluteTolerance
        least = [TOE_SLACK * scale if keeps_tension(self.rig, t) else SLACK * tolerance for t in self.rig.tendons]
        return tuple(
            bool(np.all(row[1:] <= (most if slack else most - SLACK * tolerance)))
            for slack, row, most in zip(self.guides.slack, self.found, least, strict=True)
        )

    def set_load(self, load: Load) -> None:
        """Bring wheel, free tendon and material to a load; what has not changed is left."""
        put, rig, now = self.model.mbs.SetObjectParameter, self.rig, self.load
        if self.load_control:
            self.model.mbs.SetLoadParameter(self.model.forces[0], "load", load.drive)
        else:
            put(self.model.wheel, "offset", load.drive / rig.wheel.radius_mm)
        if not self.load_control and load.slack != now.slack:
            pairs = zip(load.slack, rig.tendons, strict=False)
            offset = [slack - rig.preload_N * tendon.free_length_mm / tendon.EA_N for slack, tendon in pairs]
            set_each(self.model.mbs, self.model.free_spans, "offset", offset)
        if load.loop_scale != now.loop_scale:
            self.material.scale_loop(load.loop_scale)
        if load.dead != now.dead:
            for number, (x, y) in self.model.dead:
                self.model.mbs.SetLoadParameter(number, "loadVector", [load.dead * x, load.dead * y, 0.0])
        if load.rest_angle != now.rest_angle:
            self._set_rest_angle(load.rest_angle)
        self.load = load

    def _set_rest_angle(self, angle_rad: float) -> None:
        """Give every joint the angle it has without load."""
        self.material.set_rest_angle(angle_rad)
        set_each(
            self.model.mbs, self.model.beams, "referenceCurvature", angle_rad / self.joints.of("turning_length_mm")
        )
        set_each(self.model.mbs, self.model.hardening, "offset", [angle_rad] * len(self.model.hardening))

    def _solve(self, load: Load) -> bool:
        self.set_load(load)
        try:
            with quiet():
                solved = self.model.mbs.SolveStatic(self.solver, updateInitialValues=True)
        except (RuntimeError, ValueError):
            return False
        return bool(solved) and self._slid_mm() < MOST_SLID_PITCHES * self.rig.mean_pitch_mm

    def _slid_mm(self) -> float:
        """Most tendon that has left or entered a segment.

        While a tendon is slack nothing holds its slip: Newton's method may end where more than all of a segment has
        left it, and Exudyn's connector takes what is stretched there for slack.
        """
        slip = self.coordinates()[self.model.slip].reshape(len(self.rig.tendons), -1)
        return float(np.abs(np.diff(slip, append=0.0)).max())

    def _start_from(self, q: Floats) -> None:
        self.model.mbs.systemData.SetODE2Coordinates(q)
        self.model.mbs.systemData.SetODE2Coordinates(q, configuration=exu.ConfigurationType.Initial)

    def _predicted(self, length: float) -> FrictionState:
        """Carry on the fronts of sliding guides and the limits of friction, for a step in the same direction."""
        sliding = self.guides.sliding.reshape(len(self.rig.tendons), -1).copy()
        for row, speed in zip(sliding, self.front_speed, strict=True):
            reached = front(row)
            row[reached : reached + int(length * speed)] = row[0]
        return FrictionState(
            self.guides.unheld(sliding.ravel()), np.maximum(self.guides.limit + length * self.limit_slope, 0.0)
        )

    def _equilibrium(self, load: Load, guess: FrictionState, *, fine: bool = True) -> FrictionState | None:
        """Find friction that agrees with the tensions; None where the solver fails.

        None, too, where a tendon begins to slide at the base in a step that is not ``fine``: the work of the wheel has
        a corner there, and a quarter of the longest step keeps the balance of energies.
        """
        (sliding, limit), tried, turns = guess, list[tuple[Floats, Floats]](), 0
        for k in range(self.settings.max_friction_iterations):
            self.guides.fix(sliding, limit)
            if not self._solve(load):
                return None
            update = self.limits()
            slack = self.slack_by_tension()
            if slack != self.guides.slack:
                self.guides.make_slack(slack)
                turns, tried, sliding, limit = turns + 1, [], self.guides.unheld(sliding), self.limits()
                if turns > SLACK_TURNS:
                    return None
                continue
            states = self.guides.next_states(self.coordinates(), sliding, update)
            if not fine and self.guides.base_slides(states):
                return None
            near = np.abs(update - limit).max() <= self.settings.friction_tolerance * self.scale_N
            warm = not self.model.heat or self.material.temperatures_agree(self.coordinates(), load)
            if near and warm and np.array_equal(states, sliding):
                return FrictionState(sliding, limit)
            if k >= ALL_AT_ONCE:  # limits settle first; then the guide next to the wheel changes, alone
                states = np.where(np.arange(states.size) == np.argmax(states != sliding), states, sliding)
                states = states if near else sliding
            tried = [*tried, (limit, update)] if np.array_equal(states, sliding) else []
            sliding, limit = states, mixed(tried) if len(tried) > PLAIN else update
        return None

    def _carefully(
        self, load: Load, q: Floats, *, viscosity: Viscosity | None = None, iterations: int = 40
    ) -> FrictionState | None:
        """Find an equilibrium by Newton's method with friction inside; None where there is none near coordinates."""
        self.set_load(load)
        dry = scaled_friction(self.rig.friction, load.friction_scale)
        tolerance = self.solver.staticSolver.newton.absoluteTolerance
        first = self.guides.slack
        found = self._slack_balance(load, q, dry, tolerance, viscosity, iterations)
        self.guides.make_slack(first if found is None else self.guides.slack)
        return found

    def _slack_balance(
        self,
        load: Load,
        q: Floats,
        dry: Friction,
        tolerance_N: float,
        viscosity: Viscosity | None,
        iterations: int,
    ) -> FrictionState | None:
        """Find which tendons are slack: those that an equilibrium leaves so, then the others in turn."""
        first, known = self.guides.slack, self.rig.friction.guide_N == 0.0
        tried = set[tuple[bool, ...]]()
        for start in product((False, True), repeat=len(first)) if known else [first]:
            slack, at = tuple(a != b for a, b in zip(first, start, strict=True)), q
            while slack not in tried:
                tried.add(slack)
                self.guides.make_slack(slack, known=known)
                found = self._warm_balance(load, at, dry, tolerance_N, viscosity, iterations)
                if found is None:
                    break
                slack, at = self.slack_by_tension(), self.coordinates()
                if slack == self.guides.slack:
                    return found
        return None

    def _warm_balance(
        self,
        load: Load,
        q: Floats,
        dry: Friction,
        tolerance_N: float,
        viscosity: Viscosity | None,
        iterations: int,
    ) -> FrictionState | None:
        for _ in range(self.settings.max_friction_iterations):
            self.balance.start()
            found = self.balance.solve(q, dry, load.drive, tolerance_N, viscosity=viscosity, iterations=iterations)
            if found is None:
                return None
            q = found.q
            self._start_from(q)
            self.limits()
            if not self.model.heat or self.material.temperatures_agree(q, load):
                return FrictionState(found.sliding, found.limit)
        return None

    def accept(self, q: Floats, velocities: Floats, limit: Floats) -> None:
        """Move the rest points of what has slipped, and book the losses."""
        self._book(q, limit)
        self.losses = replace(self.losses, drag=self.losses.drag + self.dashpots.accept(q, velocities))

    def _book(self, q: Floats, limit: Floats) -> None:
        """:meth:`accept` without drag."""
        friction, material = self.losses.friction + self.guides.accept(q, limit), self.losses.material
        for loss in self.material.accept(q, self.load):
            material += loss
        self.losses = replace(self.losses, friction=friction, material=material)

    def relax(self, load: Load, q: Floats, *, books: bool = True) -> FrictionState | None:
        """Jump to another equilibrium at a load, as a real tube does where it finds none near; None where it fails.

        The rig moves in pseudo-time (implicit Euler), held back by viscosity: of each joint its bending stiffness, of
        each guide EA/pitch, both times a unit of that time. Steps are so short that joints and guides hardly move, and
        what slips is booked in each; only the energy goes to the viscosity that a real tube would lose in vibrations.
        It ends where an equilibrium without viscosity is next to no motion away.
        """
        slack, heats = self.guides.slack, bool(self.model.heat)
        viscosity = self._viscosity()
        step, tried_at, force = FIRST_PSEUDO_STEP, 0.0, np.zeros(q.size)
        for _ in range(MOST_PSEUDO_STEPS):
            found = self._carefully(load, q, viscosity=Viscosity(viscosity / step, q), iterations=20)
            after = self.coordinates()
            motion = self._motion(after - q)
            if found is None or motion > 2.0:
                self._start_from(q)
                self.guides.make_slack(slack)
                step *= 0.25
                if step < LEAST_PSEUDO_STEP:
                    return None
                continue
            last, force = force, viscosity @ (after - q) / step
            if books:
                self.losses = replace(self.losses, jump=self.losses.jump + 0.5 * float((last + force) @ (after - q)))
                self._book(after, found.limit)
                if heats:
                    self.material.begin(INSTANT_S, after)
            q, slack = after, self.guides.slack
            if motion < 0.25 and step >= 4.0 * tried_at:
                found, tried_at = self._carefully(load, q, iterations=30), step
                if found is not None and self._motion(self.coordinates() - q) <= 1.0:
                    return found
                self._start_from(q)
                self.guides.make_slack(slack)
            step *= 2.0 if motion < 1.0 else 0.7
        return None

    def _viscosity(self) -> Floats:
        """Work out forces over speeds in pseudo-time, shape (n, n)."""
        model, joints = self.model, np.arange(self.rig.joints)
        matrix, turn = np.zeros((model.size, model.size)), np.zeros((joints.size, model.size))
        turn[joints, model.rotation[1:]] += 1.0
        turn[joints, model.near_rotation] -= 1.0
        matrix += turn.T @ (self.joints.of("flexure.bending_Nmm_per_rad")[:, None] * turn)
        if model.longer.size:  # a section on its plateau gives way to thrust as to bending
            arm = self.joints.softest.arms_mm.a
            matrix[model.longer, model.longer] += self.joints.of("flexure.bending_Nmm_per_rad") / arm**2
        slide = [tendon.EA_N / self.rig.mean_pitch_mm for tendon in self.rig.tendons]
        matrix[model.slip, model.slip] += np.repeat(slide, self.rig.joints)
        return matrix * self.settings.pseudo_viscosity

    def _motion(self, change: Floats) -> float:
        """Largest motion of joints and guides over what a step in pseudo-time may bring."""
        rotation = np.abs(np.diff(change[self.model.rotation])).max() / PSEUDO_ROTATION
        return float(max(rotation, np.abs(change[self.model.slip]).max() / self.control.least_slide))

    def _released_mm(self) -> float:
        """Tendon that may come free without the drive when the dashpots relax."""
        if not self.dashpots.force.size:
            return 0.0
        force, tendon = np.abs(self.dashpots.force), self.rig.tendon_a
        sides = len(self.rig.tendons)
        tension = np.maximum(self.tensions()[:, 0], 0.1 * self.joints.force_scale_N)
        stretch = force[:sides] * tendon.free_length_mm / tendon.EA_N * (1 + tendon.toe_N / tension)
        rotation = force[sides:].max() / self.joints.of("flexure.bending_Nmm_per_rad").min()
        return float(stretch.max() + rotation * tendon.moment_arm_mm)

    def jumped(self, change: Floats, length: float) -> bool:
        """Whether coordinates have changed by more than a step of the drive can explain."""
        rotation = np.abs(np.diff(change[self.model.rotation])).max()
        slide = np.abs(change[self.model.slip]).max()
        if not self.load_control:
            length += self._released_mm()
        return bool(jumped(rotation, slide, length, self.control))

    def _without_room(self) -> str:
        """Say which measured joint has no tendon left between its rings; nothing where none is bent so far.

        The rings meet along a tendon where twice its arm times the sine of half the angle is the length between them.
        Notches close before.
        """
        for number, (joint, angle) in enumerate(
            zip(self.joints.each, self.model.joint_angles(self.coordinates()).tolist(), strict=True), start=1
        ):
            length = joint.turning_length_mm + joint.rigid_gap_mm
            taken = 2.0 * (joint.arms_mm.a if angle > 0 else joint.arms_mm.b) * math.sin(0.5 * abs(angle))
            if math.isinf(joint.closure_angle_rad) and taken > NO_ROOM * length:
                return (
                    f": joint {number} is bent to {math.degrees(angle):.3g} deg, where its rings meet along the "
                    f"tendon, {length:.3g} mm between them at rest: expected a smaller drive, or a longer "
                    "rig.rigid_gap_mm"
                )
        return ""

    def settle(self) -> None:
        """Find the equilibrium at rest, where unequal arms may bend the preloaded rig.

        A single tendon bends it far, and a tendon without tension is taut and slack in turns on the way there. What
        takes more iterations than a step may is tried again with more, and then on a way of small steps.
        """
        newton, start = self.solver.staticSolver.newton, FrictionState(self.guides.sliding, self.guides.limit)
        rest = self.load  # other loads are tried on the way
        q = self.model.bent_to(self.joints.first.rest_angle_rad)
        if self.load_control:  # no force at rest: what preload has stretched has slid towards the tip
            stretch = self.rig.preload_N * self.joints.lengths.segments / self.rig.tendon_a.EA_N
            q[self.model.slip] = -np.cumsum(stretch[::-1])[::-1]
            start = FrictionState(np.sign(q[self.model.slip]), 0.0 * start.limit)
        self._start_from(q)
        found = self._drawn(start) if self._is_drawn() else None
        if found is None:
            self._start_from(q)
            found = self._equilibrium(rest, start)
        if found is None:
            self._start_from(q)
            newton.maxIterations = AT_REST * self.settings.newton_iterations
            found = self._equilibrium(rest, start)
            newton.maxIterations = self.settings.newton_iterations
        if found is None:
            self._start_from(q)
            found = self._released(start)
        if found is None:
            found = self._carefully(rest, q)
        if found is None:
            self._start_from(q)
            found = self.relax(rest, q, books=False)
        if found is None:
            raise SolverError("no equilibrium at rest")
        q = self.coordinates()
        self.accept(q, 0.0 * q, found.limit)

    def _is_drawn(self) -> bool:
        """Whether one tendon bends metal with plateaus: friction holds it in many places, and one step goes too far."""
        return not self.joints.first.spring_Nmm_per_rad and self.rig.tendon_b is None and not self.load_control

    def _drawn(self, state: FrictionState) -> FrictionState | None:
        """Find the equilibrium at rest while the wheel draws a single tendon from no tension to its preload."""
        length = float(self.joints.lengths.segments.sum())
        slack = float(tendon_stretch_mm(self.rig.tendon_a, 0.0, self.rig.preload_N, length))  # less than nothing
        return self._in_steps(state, lambda done: self.load._replace(drive=(1.0 - done) * slack))

    def _released(self, state: FrictionState) -> FrictionState | None:
        """Find the equilibrium at rest from the shape at rest under preload, where joints bent the other way hold it.

        They are let go step by step, with all tendons taut.
        """
        soft, rest = self.joints.softest, self.load.rest_angle
        moment = self.rig.preload_N * (soft.arms_mm.a - (soft.arms_mm.b if self.rig.tendon_b else 0.0))
        held = moment / soft.flexure.bending_Nmm_per_rad
        return self._in_steps(state, lambda done: self.load._replace(rest_angle=rest - (1.0 - done) * held))

    def _in_steps(self, state: FrictionState, load_at: Callable[[float], Load]) -> FrictionState | None:
        """Go through loads from 0 to 1; friction acts as in a single step: nothing is accepted."""
        done, part = 0.0, 0.0625
        while done < 1.0:
            q, goal = self.coordinates(), min(done + part, 1.0)
            found = self._equilibrium(load_at(goal), state)
            if found is not None:
                state, done, part = found, goal, 2.0 * part
                continue
            self._start_from(q)
            part *= 0.5
            if part < LEAST_PART:
                return None
        return state

    def move(self, end: Load) -> float:
        """Go to a load in bounded steps; return the work of the wheel, mJ (N mm).

        The first guess of a step carries the last increment on. A step that fails is halved, and the halved length is
        kept until steps succeed again.
        """
        start, done, work, force, wound = self.load, 0.0, 0.0, wheel_force_N(self.found), self._wound_mm()
        direction = np.sign(end.drive - start.drive)
        while done < 1:
            step = next_step(start, end, done, self.reach, self.control)
            before, slack = self.coordinates(), self.guides.slack
            time_s = (step.part - done) * (end.time - start.time)
            self.dashpots.damp_over(time_s)
            self.material.begin(time_s, before)
            if direction == self.direction:
                carried_on = self.model.with_chords(before) + step.length * self.increment
                self._start_from(self.model.with_places(carried_on))
                guess = self._predicted(step.length)
            else:  # after a reversal or a failure: every guide sticks until its force says otherwise
                self._start_from(before)
                guess = FrictionState(self.guides.unheld(0.0 * self.guides.sliding), self.guides.limit)
            relaxed, lost = False, self.losses.jump
            found = self._equilibrium(step.load, guess, fine=step.fine)
            if found is None and step.fine:
                found = self._carefully(step.load, before)
            if found is None or self.jumped(self.coordinates() - before, step.length):
                self.direction, self.reach = self.direction if not step.fine else math.nan, 0.5 * step.length
                self._start_from(before)
                self.guides.make_slack(slack)
                if not too_short(self.reach, self.control):
                    continue
                closed = self._without_room()
                found = None if closed else self.relax(step.load, before)
                if found is None:
                    at, unit = between(start, end, done), "N" if self.load_control else "mm"
                    words = f"no equilibrium between drives {at.drive:.6g} and {step.load.drive:.6g} {unit}"
                    raise SolverError(words + closed)
                relaxed = True
            after = self.coordinates()
            if relaxed:
                self.guides.sliding = found.sliding
                if self.jumped(after - before, step.length):
                    self.jumps += 1
                else:  # the next equilibrium was near, and only hard to find
                    self.losses = replace(self.losses, jump=lost)
            else:
                change = self.model.with_chords(after) - self.model.with_chords(before)
                self._learn(found, change, step.length, direction)
            velocities = (after - before) / time_s if time_s > 0 else 0.0 * after
            self.accept(after, velocities, found.limit)
            last, force, last_wound, wound = force, wheel_force_N(self.found), wound, self._wound_mm()
            work += 0.5 * (last + force) * (wound - last_wound)
            done, self.reach = step.part, reach_after_success(self.reach, self.control)
        return work

    def _learn(self, found: FrictionState, change: Floats, length: float, direction: float) -> None:
        """Note what a step changed per length, for the next one to start from."""
        before, after = (rows.reshape(len(self.rig.tendons), -1) for rows in (self.guides.sliding, found.sliding))
        self.front_speed = np.array(
            [
                front_speed(front(a), front(b), direction, self.direction, length)
                for a, b in zip(before, after, strict=True)
            ]
        )
        length = max(length, LEAST_LENGTH)
        self.increment, self.limit_slope = change / length, (found.limit - self.guides.limit) / length
        self.guides.sliding, self.direction = found.sliding, direction

    def _wound_mm(self) -> float:
        """Tendon a that the wheel has wound in: the drive; under load control the slip at the base and the stretch."""
        if not self.load_control:
            return self.load.drive
        slip, tendon = float(self.coordinates()[self.model.slip[0]]), self.rig.tendon_a
        return slip + float(tendon_stretch_mm(tendon, self.load.drive, self.rig.preload_N, 0.0))


def wheel_force_N(tension_N: Floats) -> float:
    """Torque of the wheel over its radius, by the tensions of the tendons, shape (tendons, N+1)."""
    return float(tension_N[0, 0] - tension_N[1:, 0].sum())


def _step_control(rig: Rig, joints: JointRow, settings: MultibodySettings, *, load_control: bool) -> StepControl:
    if not load_control:
        return drive_control(rig, settings.max_step_mm, settings.max_halvings)
    max_step, soft = settings.max_force_step * joints.force_scale_N, joints.softest
    return force_control(rig, soft.arms_mm.a, soft.flexure.bending_Nmm_per_rad, max_step, settings.max_halvings)


def _static_solver(rig: Rig, joints: JointRow, settings: MultibodySettings) -> Any:
    solver = exu.SimulationSettings()
    solver.solution.file.write = False
    solver.linearSolver.solverType = exu.LinearSolverType.EigenSparse
    static = solver.staticSolver
    static.numberOfLoadSteps, static.adaptiveStep, static.verboseMode = 1, False, 0
    static.newton.relativeTolerance = 1e-12  # a slack tendon may start far off: a part of that residual proves nothing
    # Rounding of a coordinate times the stiffest spring is the least residual there can be; a ring has two ends.
    bristle = max(1.0, settings.bristle_ratio) * max(tendon.EA_N for tendon in rig.tendons) / rig.mean_pitch_mm
    stiffest = max(bristle, 2 * RIGID_RINGS * joints.of("ring.axial_N_per_mm").max())
    # The force scale of a single tendon has no bound where joints are stiff: not beyond 0.1 % of strain.
    scale = min(joints.force_scale_N, *(1e-3 * tendon.EA_N for tendon in rig.tendons))
    static.newton.absoluteTolerance = max(settings.newton_tolerance * scale, 1e-12 * stiffest)
    static.newton.maxIterations = settings.newton_iterations
    # Differences that reach across the kink of a guide that sticks or slips spoil the tangent: keep them tiny.
    static.newton.numericalDifferentiation.relativeEpsilon = 1e-9
    return solver
