"""The manipulator as an Exudyn flexible multibody system, quasi-static: without inertia.

Flexures are two-node geometrically exact beams (Simo and Vu-Quoc, doi 10.1115/1.3171870) of the length over which a
notch bends; rings are such beams with the section of the uncut tube, far stiffer. Each tendon is a row of elastic
segments whose slip past every guide is a coordinate held by dry friction. The wheel drives both tendons.

Why one element a flexure is enough: it has one integration point, so its only compliances are those of its mid-point
frame, uncoupled. So are those of a notch between stiff rings, which is symmetric about its middle. Giving the element
the notch's mid-point stiffnesses is therefore exact for small strain. Why friction is a spring with a slipping rest
point: a velocity law never slips in a static solution.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass

import exudyn as exu
import numpy as np

from fem_models.joint.contact import require_open
from fem_models.joint.flexure import flexure, force_scale_N, moment_arms_mm, turning_length_mm
from fem_models.joint.friction import friction_limits_N, guide_wrap_rad, jenkins_elements
from fem_models.joint.strain import peak_strain
from fem_models.joint.superelastic import FlagFibres, flag_fibres, flag_moment
from fem_models.load.program import LoadProgram
from fem_models.load.run_record import simulated_record
from fem_models.load.schedule import Schedule, force_schedule, schedule
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
from fem_models.multibody.assembly import MASSLESS, RingInertia, assemble, bristle_N_per_mm, taut
from fem_models.rig.checks import SolverError
from fem_models.rig.rig import Rig, Tendon
from fem_models.rig.tendon_law import tendon_stretch_mm
from hysteresis.arrays import Floats
from hysteresis.record import Record


@dataclass(frozen=True)
class MultibodySettings:
    """Numerical settings; the defaults are those the tests verify.

    ``bristle_ratio`` is the stiffness of a sticking guide over EA/pitch; ``friction_tolerance`` ends the fixed
    point between tensions and friction limits (relative to :func:`fem_models.joint.flexure.force_scale_N`); ``max_step_mm``
    bounds the drive increment whatever the sampling, ``max_pull`` that of a force (relative to the same),
    ``max_halvings`` how often a step that fails is halved. ``max_friction_iterations`` also bounds how often guides may
    change between sticking and sliding in a step.
    """

    bristle_ratio: float = 0.02
    friction_tolerance: float = 1e-6
    max_friction_iterations: int = 60
    max_step_mm: float = 0.1
    max_pull: float = 0.25
    max_halvings: int = 12
    newton_relative_tolerance: float = 1e-7
    newton_absolute_tolerance_N: float = 1e-7
    newton_iterations: int = 15


@dataclass(frozen=True)
class MultibodySolution:
    """A record with what only the model knows. Arrays follow the samples of the record, shape (m, ...).

    ``segment_tensions_N`` has shape (m, 2, N+1): tendon a and b, from the wheel to the tip. ``peak_strain``, shape
    (m, N), is that of :func:`fem_models.joint.strain.peak_strain`. ``wheel_work_mJ`` and the losses to friction, the material
    and drag are cumulative from the start of the program.
    """

    record: Record
    segment_tensions_N: Floats
    peak_strain: Floats
    wheel_work_mJ: Floats
    friction_loss_mJ: Floats
    material_loss_mJ: Floats
    viscous_loss_mJ: Floats


FAR_N = 1e6  # no friction comes near: a bristle that may carry this sticks, one drawn this far out slides


@dataclass
class _State:
    """History of the dry elements: rest points of the bristles and of the Jenkins elements, friction limits.

    ``sliding`` is 0 where a guide sticks, else the sign of its friction. Of the dashpots it is where they last stood,
    and their forces there.
    """

    rest: Floats
    limit: Floats
    sliding: Floats
    jenkins_rest: Floats
    flag_rest: Floats
    dashpot_way: Floats
    dashpot_force: Floats
    friction_loss: float = 0.0
    material_loss: float = 0.0
    viscous_loss: float = 0.0


@contextmanager
def quiet() -> Iterator[None]:
    """Keep Exudyn from reporting on the console what ends in an error of ours, or in a halved step."""
    before = exu.config.printToConsole
    exu.config.printToConsole = False
    try:
        yield
    finally:
        exu.config.printToConsole = before


class Stepper:
    """Moves an assembled rig along its load program; holds the history of the dry elements."""

    def __init__(
        self, rig: Rig, settings: MultibodySettings, inertia: RingInertia = MASSLESS, *, pulled: bool = False
    ) -> None:
        self.rig, self.settings, self.pulled, self.scale = rig, settings, pulled, force_scale_N(rig)
        self.control = _step_control(rig, settings, pulled=pulled)
        self.model = assemble(rig, settings.bristle_ratio, inertia, pulled=pulled)
        ropes, n = rig.tendons, rig.joints
        guides = len(ropes) * n
        self.taut = np.array([taut(rig, rope) for rope in ropes])
        self.bristle = np.repeat([bristle_N_per_mm(rig, t, settings.bristle_ratio) for t in ropes], n)
        _, stiffness, slip_moment = jenkins_elements(rig.material, flexure(rig).bending_Nmm_per_rad)
        self.jenkins_stiffness, self.slip_moment = np.repeat(stiffness, n), np.repeat(slip_moment, n)
        fibres, share = flag_fibres(rig), 1 - rig.material.loop_share
        self.fibres = FlagFibres(
            stiffness=np.repeat(share * fibres.stiffness, n),
            upper_Nmm=np.repeat(share * fibres.upper_Nmm, n),
            lower_Nmm=np.repeat(share * fibres.lower_Nmm, n),
            span_rad=np.repeat(fibres.span_rad, n),
            slope=np.repeat(share * fibres.slope, n),
        )
        from_rest = 1 - self.fibres.slope / self.fibres.stiffness  # of a plateau's line, at no angle
        self._put(self.model.jenkins, "staticFrictionOffsetForce", self.slip_moment)
        self._put(self.model.flags, "staticFrictionOffsetForce", from_rest * self.fibres.upper_Nmm)
        self._put(self.model.flags, "dynamicFrictionForce", from_rest * self.fibres.lower_Nmm)
        self._put(self.model.flags, "damping", self.fibres.slope)
        self._put(self.model.flags, "viscousFrictionFactor", self.fibres.span_rad)
        self.solver = exu.SimulationSettings()
        self.solver.solution.file.write = False
        self.solver.linearSolver.solverType = exu.LinearSolverType.EigenSparse
        static = self.solver.staticSolver
        static.numberOfLoadSteps, static.adaptiveStep, static.verboseMode = 1, False, 0
        static.newton.relativeTolerance = settings.newton_relative_tolerance
        # Rounding of a coordinate times the stiffest segment is the least residual there can be.
        stiffest = max(rope.EA_N for rope in ropes) / rig.pitch_mm
        static.newton.absoluteTolerance = max(settings.newton_absolute_tolerance_N, 1e-12 * stiffest)
        static.newton.maxIterations = settings.newton_iterations
        # Differences that reach across the kink of a guide that sticks or slips spoil the tangent: keep them tiny.
        static.newton.numericalDifferentiation.relativeEpsilon = 1e-9
        self.drag = _dashpot_constants(rig)
        rest = math.radians(rig.precurvature_deg)
        self.load, self.reach = at_rest(rest), self.control.max_step
        self._bend_at_rest(rest)
        # of the last step: way of the drive, and changes of coordinates, friction limits and fronts per mm of it
        self.heading, self.increment = 0.0, 0.0 * self.coordinates()
        self.climb, self.run = np.zeros(guides), np.zeros(len(ropes))
        self.state = _State(
            np.zeros(guides), np.zeros(guides), np.zeros(guides), np.full(len(self.model.jenkins), rest),
            np.zeros(len(self.model.flags)), 0.0 * self.drag, 0.0 * self.drag,
        )  # fmt: skip
        self._put(self.model.jenkins, "offset", self.state.jenkins_rest)
        self.state.limit = self.limits()
        self.set_friction(self.state.limit)

    def coordinates(self) -> Floats:
        """All coordinates of the system."""
        return np.asarray(self.model.mbs.systemData.GetODE2Coordinates())

    def tensions(self) -> Floats:
        """Shape (sides, N+1), wheel to tip; one side for each tendon."""
        output, kind = self.model.mbs.GetObjectOutput, exu.OutputVariableType
        free = [self.load.drive] if self.pulled else [output(i, kind.Force) for i in self.model.free_spans]
        rope = np.reshape([output(i, kind.ForceLocal) for i in self.model.segments], (self.taut.size, -1))
        return np.column_stack([free, rope / self.taut[:, None]])

    def tip_mm(self) -> Floats:
        """Centre of the last ring, shape (2,)."""
        ring = self.model.tip
        position = self.model.mbs.GetObjectOutputBody(
            ring.body, exu.OutputVariableType.Position, localPosition=[ring.centre_mm, 0, 0]
        )
        return np.asarray(position)[:2]

    def limits(self) -> Floats:
        """Greatest friction of each guide at the present tensions and angles, N."""
        tension = self.tensions()
        wrap = guide_wrap_rad(self.rig.friction, np.diff(self.coordinates()[self.model.rotation]))
        return friction_limits_N(self.rig.friction, tension[:, :-1], tension[:, 1:], wrap).ravel()

    def _put(self, connectors: list[int], field: str, values: Iterable[float]) -> None:
        put = self.model.mbs.SetObjectParameter
        for connector, value in zip(connectors, values, strict=True):
            put(connector, field, value)

    def set_friction(self, limit: Floats) -> None:
        """Bound the friction of each guide, N."""
        self._put(self.model.guides, "staticFrictionOffsetForce", limit)

    def _hold(self, sliding: Floats, limit: Floats) -> None:
        """Have each guide stick or slide for a whole solve, so that Newton's method meets no kink."""
        self._put(self.model.guides, "offset", np.where(sliding == 0, self.state.rest, -sliding * FAR_N))
        self.set_friction(np.where(sliding == 0, FAR_N, limit))

    def _settled(self, sliding: Floats, limit: Floats) -> Floats:
        """Let guides stick or slide by the forces of their bristles; what slides sticks before it slides back."""
        force = self.bristle * (self.coordinates()[self.model.slip] - self.state.rest)
        slack = 1e-9 * self.scale
        let_go = np.where(np.abs(force) > limit + slack, np.sign(force), 0.0)
        return np.where(sliding == 0, let_go, np.where(force * sliding < limit - slack, 0.0, sliding))

    def damp_by_speed(self) -> None:
        """Have the dashpots act by their speed, which only a time integration knows."""
        self._put(self.model.dashpots, "stiffness", 0.0 * self.drag)
        self._put(self.model.dashpots, "damping", self.drag)

    def _damp_over(self, time_s: float) -> None:
        """Implicit Euler: over a step a dashpot is a spring c/time from where it stood; none over no time."""
        self._put(self.model.dashpots, "stiffness", self.drag / time_s if time_s > 0 else 0.0 * self.drag)
        self._put(self.model.dashpots, "offset", self.state.dashpot_way)

    def _turns(self, q: Floats) -> Floats:
        """Turn of each flexure, shape (N,)."""
        return np.asarray(q[self.model.rotation[1:]] - q[self.model.near_rotation])

    def _dashpots(self, q: Floats) -> Floats:
        """Where the dashpots stand at coordinates, or how fast they move at velocities; none without drag."""
        at_base = q[self.model.slip[:: self.rig.joints]]
        return np.concatenate([at_base, self._turns(q)])[: self.drag.size]

    def set_load(self, load: Load) -> None:
        """Bring wheel, free rope and material to a load; what has not changed is left."""
        put, rig, now = self.model.mbs.SetObjectParameter, self.rig, self.load
        if self.pulled:
            self.model.mbs.SetLoadParameter(self.model.pulls[0], "load", load.drive)
        else:
            put(self.model.wheel, "offset", load.drive / rig.wheel.radius_mm)
        if not self.pulled and load.slack != now.slack:
            rest = [s - rig.preload_N * r.free_length_mm / r.EA_N for s, r in self._ropes(load)]
            self._put(self.model.free_spans, "offset", rest)
        if load.loop_scale != now.loop_scale:
            self._put(self.model.jenkins, "staticFrictionOffsetForce", load.loop_scale * self.slip_moment)
        if load.rest_angle != now.rest_angle:
            self._bend_at_rest(load.rest_angle)
        self.load = load

    def _bend_at_rest(self, angle_rad: float) -> None:
        """Give every joint the angle it has without load."""
        self._put(self.model.flags, "velocityOffset", [angle_rad] * len(self.model.flags))
        curvature = angle_rad / turning_length_mm(self.rig)
        self._put(self.model.beams, "referenceCurvature", [curvature] * len(self.model.beams))

    def _ropes(self, load: Load) -> list[tuple[float, Tendon]]:
        return list(zip(load.slack, self.rig.tendons, strict=False))

    def _solve(self, load: Load) -> bool:
        self.set_load(load)
        try:
            with quiet():
                return bool(self.model.mbs.SolveStatic(self.solver, updateInitialValues=True))
        except (RuntimeError, ValueError):
            return False

    def _start_from(self, q: Floats) -> None:
        self.model.mbs.systemData.SetODE2Coordinates(q)
        self.model.mbs.systemData.SetODE2Coordinates(q, configuration=exu.ConfigurationType.Initial)

    def _foreseen(self, step_mm: float) -> tuple[Floats, Floats]:
        """Which guides slide after a step on the same way, the fronts carried on; and the limits of friction."""
        sliding = self.state.sliding.reshape(self.taut.size, -1).copy()
        for row, run in zip(sliding, self.run, strict=True):
            reached = front(row)
            row[reached : reached + int(step_mm * run)] = row[0]
        return sliding.ravel(), np.maximum(self.state.limit + step_mm * self.climb, 0.0)

    def _equilibrium(
        self, load: Load, sliding: Floats, limit: Floats, *, fine: bool = True
    ) -> tuple[Floats, Floats] | None:
        """Which guides slide, and friction limits that agree with the tensions; None where the solver fails.

        None, too, where a step that is not ``fine`` lets rope begin to slide past the base, the corner of the wheel's
        work: half the step keeps the energy's balance.
        """
        for _ in range(self.settings.max_friction_iterations):
            self._hold(sliding, limit)
            if not self._solve(load):
                return None
            update = self.limits()
            settled = self._settled(sliding, update)
            if not fine and self._base_let_go(settled):
                return None
            near = np.abs(update - limit).max() <= self.settings.friction_tolerance * self.scale
            if near and np.array_equal(settled, sliding):
                return sliding, limit
            sliding, limit = settled, update
        return None

    def accept(self, q: Floats, limit: Floats) -> None:
        """Move the rest points of what has slipped, and book the loss.

        A sliding guide's force changes from the last limit to the present one: their mean is booked.
        """
        state = self.state
        slip = q[self.model.slip]
        force = np.clip(self.bristle * (slip - state.rest), -limit, limit)
        rest = slip - force / self.bristle
        state.friction_loss += float(0.5 * (state.limit + limit) @ np.abs(rest - state.rest))
        state.rest, state.limit = rest, limit
        self._put(self.model.guides, "offset", rest)
        self.set_friction(limit)
        turn = self._turns(q)
        if self.model.jenkins:
            bend, top = np.tile(turn, self.slip_moment.size // turn.size), self.load.loop_scale * self.slip_moment
            moment = np.clip(self.jenkins_stiffness * (bend - state.jenkins_rest), -top, top)
            state.jenkins_rest, lost = _slipped(bend, moment, self.jenkins_stiffness, state.jenkins_rest)
            state.material_loss += lost
            self._put(self.model.jenkins, "offset", state.jenkins_rest)
        if self.model.flags:
            bend = np.tile(turn - self.load.rest_angle, self.fibres.stiffness.size // turn.size)
            moment = flag_moment(bend, state.flag_rest, self.fibres)
            state.flag_rest, lost = _slipped(bend, moment, self.fibres.stiffness, state.flag_rest)
            state.material_loss += lost
            self._put(self.model.flags, "offset", state.flag_rest)

    def book_drag(self, q: Floats, velocities: Floats) -> None:
        """Book what the dashpots took on their way to here, by the mean of their last and present force."""
        state, way, force = self.state, self._dashpots(q), self.drag * self._dashpots(velocities)
        state.viscous_loss += float(0.5 * (state.dashpot_force + force) @ (way - state.dashpot_way))
        state.dashpot_way, state.dashpot_force = way, force

    def _held_mm(self) -> float:
        """Rope that may come free without the drive when the dashpots let go of what they hold."""
        if not self.drag.size:
            return 0.0
        force, rope = np.abs(self.state.dashpot_force), self.rig.tendon_a
        sides = self.taut.size
        tension = np.maximum(self.tensions()[:, 0], 0.1 * self.scale)
        stretch = force[:sides] * rope.free_length_mm / rope.EA_N * (1 + rope.toe_N / tension)
        turn = force[sides:].max() / flexure(self.rig).bending_Nmm_per_rad
        return float(stretch.max() + turn * rope.moment_arm_mm)

    def _base_let_go(self, sliding: Floats) -> bool:
        first, before = sliding[:: self.rig.joints], self.state.sliding[:: self.rig.joints]
        return bool(np.any((first != 0) & (first != before)))

    def jumped(self, change: Floats, step_mm: float) -> bool:
        """Whether coordinates have changed by more than a step of the drive can explain."""
        turn = np.abs(np.diff(change[self.model.rotation])).max()
        slide = np.abs(change[self.model.slip]).max()
        if not self.pulled:
            step_mm += self._held_mm()
        return bool(jumped(turn, slide, step_mm, self.control))

    def let_go(self) -> None:
        """Find the equilibrium at rest, where weight and unequal arms may turn the straight, preloaded rig."""
        found = self._equilibrium(self.load, self.state.sliding, self.state.limit)
        if found is None:
            raise SolverError("no equilibrium at rest")
        self.accept(self.coordinates(), found[1])
        self.book_drag(self.coordinates(), 0.0 * self.coordinates())

    def move(self, end: Load) -> float:
        """Go to a load in bounded steps; return the work of the wheel on the way, mJ (N mm).

        A step starts from the last increment carried on. One that fails is halved, and the halved length is kept until
        steps succeed again.
        """
        start, done, work, pull, wound = self.load, 0.0, 0.0, self.pull(), self._wound_mm()
        ahead = np.sign(end.drive - start.drive)
        while done < 1:
            part, load, step, fine = next_step(start, end, done, self.reach, self.control)
            before = self.coordinates()
            time_s = (part - done) * (end.time - start.time)
            self._damp_over(time_s)
            if ahead == self.heading:
                self._start_from(before + step * self.increment)
                found = self._equilibrium(load, *self._foreseen(step), fine=fine)
            else:  # turned round, or failed: every guide sticks until its force says otherwise
                self._start_from(before)
                found = self._equilibrium(load, 0.0 * self.state.sliding, self.state.limit, fine=fine)
            if found is None or self.jumped(self.coordinates() - before, step):
                self.heading, self.reach = self.heading if not fine else math.nan, 0.5 * step
                self._start_from(before)
                if too_short(self.reach, self.control):
                    at = between(start, end, done)
                    unit = "N" if self.pulled else "mm"
                    raise SolverError(f"no equilibrium between drives {at.drive:.6g} and {load.drive:.6g} {unit}")
                continue
            after = self.coordinates()
            self._learn(*found, (after - before), step, ahead)
            self.accept(after, found[1])
            self.book_drag(after, (after - before) / time_s if time_s > 0 else 0.0 * after)
            last, pull, before_mm, wound = pull, self.pull(), wound, self._wound_mm()
            work += 0.5 * (last + pull) * (wound - before_mm)
            done, self.reach = part, reach_after_success(self.reach, self.control)
        return work

    def _learn(
        self, sliding: Floats, limit: Floats, change: Floats, step_mm: float,
        ahead: float,
    ) -> None:  # fmt: skip
        """Note what a step changed per mm, for the next one to start from."""
        fronts = [[front(row) for row in rows.reshape(self.taut.size, -1)] for rows in (self.state.sliding, sliding)]
        self.run = np.array([front_speed(*ends, ahead, self.heading, step_mm) for ends in zip(*fronts, strict=True)])
        step_mm = max(step_mm, LEAST_LENGTH)
        self.increment, self.climb = change / step_mm, (limit - self.state.limit) / step_mm
        self.state.sliding, self.heading = sliding, ahead

    def losses(self) -> tuple[float, float, float]:
        """To friction, the material and drag since the start, mJ."""
        return self.state.friction_loss, self.state.material_loss, self.state.viscous_loss

    def pull(self) -> float:
        """Torque of the wheel over its radius, N."""
        at_wheel = self.tensions()[:, 0]
        return float(at_wheel[0] - at_wheel[1:].sum())

    def _wound_mm(self) -> float:
        """Rope a that the wheel has wound in: the drive or, under a given tension, slip at the base and stretch."""
        if not self.pulled:
            return self.load.drive
        slip, rope = float(self.coordinates()[self.model.slip[0]]), self.rig.tendon_a
        return slip + float(tendon_stretch_mm(rope, self.load.drive, self.rig.preload_N, 0.0))


def _step_control(rig: Rig, settings: MultibodySettings, *, pulled: bool) -> StepControl:
    if not pulled:
        return drive_control(rig, settings.max_step_mm, settings.max_halvings)
    arm, bending = moment_arms_mm(rig)[0], flexure(rig).bending_Nmm_per_rad
    return force_control(rig, arm, bending, settings.max_pull * force_scale_N(rig), settings.max_halvings)


def _dashpot_constants(rig: Rig) -> Floats:
    """Of the sheaths (N s/mm), then of the joints (Nmm s/rad), shape (sides+N,); shape (0,) without drag."""
    if rig.drag is None:
        return np.empty(0)
    return np.repeat([rig.drag.sheath_N_s_per_mm, rig.drag.joint_Nmm_s_per_rad], [len(rig.tendons), rig.joints])


def _slipped(bend: Floats, moment: Floats, stiffness: Floats, rest: Floats) -> tuple[Floats, float]:
    """Rest angles that agree with the moments, and what moving them took, mJ."""
    moved = bend - moment / stiffness
    return moved, float(moment @ (moved - rest))


def solve_multibody(rig: Rig, program: LoadProgram, settings: MultibodySettings | None = None) -> MultibodySolution:
    """Run a load program quasi-statically; of the times only creep and drag take note.

    Drag is of first order in the time between samples (implicit Euler). A first sample away from zero drive is gone to
    slowly, without drag.

    Raises
    ------
    SolverError
        When a step does not converge even after ``max_halvings`` halvings.
    RigError
        From :func:`fem_models.load.schedule.schedule`.
    """
    stepper = Stepper(rig, settings or MultibodySettings())
    return _run(stepper, schedule(rig, program), program)


def solve_pulled_multibody(rig: Rig, force_N: Floats, settings: MultibodySettings | None = None) -> MultibodySolution:
    """Run a rig of one tendon through tensions at the wheel, shape (m,), in order; the record's drive is in N.

    Raises
    ------
    SolverError
        As :func:`solve_multibody`.
    RigError
        From :func:`fem_models.load.schedule.force_schedule`.
    """
    plan = force_schedule(rig, force_N)
    return _run(Stepper(rig, settings or MultibodySettings(), pulled=True), plan, plan.drive_mm)


def _run(stepper: Stepper, plan: Schedule, program: LoadProgram | Floats) -> MultibodySolution:
    rig, joints, m = stepper.rig, stepper.rig.joints, plan.drive_mm.size
    rotation, tip = np.empty((m, joints + 1)), np.empty((m, 2))
    tension, energy = np.zeros((m, 2, joints + 1)), np.empty((m, 4))
    work, crept = 0.0, np.zeros(2)
    for k in range(m):
        load = load_of(plan, k, plan.slack_mm[k] + crept, plan.time_s[k])
        try:
            if k == 0:
                stepper.let_go()
            work += stepper.move(load)
        except SolverError as error:
            raise SolverError(f"rig {rig.name}, sample {k} of {m}: {error}") from None
        tension[k, : len(rig.tendons)] = stepper.tensions()
        crept += plan.creep[k] * (creep_goal_mm(rig, tension[k, :, 0]) - crept)
        q = stepper.coordinates()
        rotation[k] = q[stepper.model.rotation]
        tip[k] = stepper.tip_mm()
        energy[k] = work, *stepper.losses()
    require_open(rig, np.diff(rotation, axis=1))
    record = simulated_record(
        "multibody",
        rig,
        program,
        angle_deg=np.degrees(rotation[:, -1]),
        joint_angles_rad=np.diff(rotation, axis=1),
        tension_N=tension[:, :, 0],
        tip_mm=tip,
    )
    return MultibodySolution(record, tension, peak_strain(rig, np.diff(rotation, axis=1)), *energy.T)


def load_of(plan: Schedule, sample: int, slack_mm: Floats, time_s: float) -> Load:
    """Load at a sample; ``slack_mm``, shape (2,), has the creep in it."""
    slack_a, slack_b = slack_mm.tolist()
    return Load(
        drive=float(plan.drive_mm[sample]),
        slack=(slack_a, slack_b),
        loop_scale=float(plan.loop_scale[sample]),
        rest_angle=float(plan.residual_rad[sample]),
        time=float(time_s),
    )


def creep_goal_mm(rig: Rig, tension_N: Floats) -> Floats:
    """How far the ropes creep in the end at tensions at the wheel, shape (2,); a rope that is not there does not."""
    fraction, goal = rig.creep.fraction if rig.creep else 0.0, np.zeros(2)
    for side, rope in enumerate(rig.tendons):
        goal[side] = fraction * rope.free_length_mm / rope.EA_N * (tension_N[side] - rig.preload_N)
    return goal


def simulate_multibody(rig: Rig, program: LoadProgram) -> Record:
    """Engine ``multibody``: the record alone. See :func:`solve_multibody`."""
    return solve_multibody(rig, program).record
