"""The multibody model in time: inertia of the rings, viscous drag, friction and all else of the quasi-static one.

One run of Exudyn's implicit generalized-alpha integrator (Chung and Hulbert 1993, doi 10.1115/1.2900803; for multibody
systems Arnold and Bruls 2007, doi 10.1007/s11044-007-9084-0). It solves the equations of motion at the end of a step,
so tendons, slips and wheel need no mass: they are in equilibrium there. The limits of friction are those of the present
tensions in every Newton iteration, without lag; rest points of what slipped are moved after each step.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from scipy.interpolate import PchipInterpolator

from fem_models.joint import joint_row
from fem_models.joint.contact import require_open
from fem_models.joint.possible import require_possible
from fem_models.joint.section import section
from fem_models.joint.superelastic_section import require_warm
from fem_models.load import LoadProgram
from fem_models.load.run_record import simulated_record
from fem_models.load.schedule import Schedule, schedule
from fem_models.load.stepping import Load, distance
from fem_models.multibody.assembly import NITINOL_T_PER_MM3, RingInertia, tip_inertia
from fem_models.multibody.quasi_static import creep_goal_mm, load_of
from fem_models.multibody.stepper import MultibodySettings, Stepper, quiet, wheel_force_N
from fem_models.rig import Rig, RigError
from fem_models.rig.checks import SolverError
from fem_models.rig.joints import NotchedTube
from hysteresis.arrays import Floats
from hysteresis.records.record import Record


@dataclass(frozen=True)
class DynamicSettings:
    """Numerical settings; the tests verify the defaults.

    ``max_step_mm`` is how far the drive goes in one time step where it is fastest; a step is never longer than the
    shortest time between samples. ``spectral_radius`` is the share of a vibration far faster than the step that
    remains after one step: at 0 it vanishes at once, towards 1 it rings. Steps that fail are halved, up to
    ``max_halvings`` times.
    """

    max_step_mm: float = 0.05
    spectral_radius: float = 0.0
    newton_iterations: int = 25
    max_halvings: int = 8
    statics: MultibodySettings = field(default_factory=MultibodySettings)


@dataclass(frozen=True)
class DynamicSolution:
    """A record, and what only the model knows. Arrays follow the samples of the record, shape (m, ...).

    ``segment_tensions_N`` has shape (m, 2, N+1): tendon a and b, from the wheel to the tip. Work of the wheel and
    losses are cumulative from the start of the program; ``kinetic_mJ`` is that of the rings and of a mass at the tip.
    ``step_s`` is the step of the integration, ``step_mm`` how far the drive goes in it where it is fastest.
    """

    record: Record
    segment_tensions_N: Floats
    wheel_work_mJ: Floats
    friction_loss_mJ: Floats
    material_loss_mJ: Floats
    viscous_loss_mJ: Floats
    kinetic_mJ: Floats
    step_s: float
    step_mm: float


def ring_inertia(rig: Rig) -> RingInertia:
    """Inertia of one ring of the tube, from the middle of a notch to that of the next.

    The mass is ``gravity.ring_mass_g`` where the rig has one, else what the notch leaves of a Nitinol tube. The moment
    of inertia is that of a round tube of that mass: m (R_o^2 + R_i^2)/4 + m p^2/12; measured joints have the tendon's
    arm for both radii.

    Raises
    ------
    RigError
        Measured joints without a mass.
    """
    mass = 1e-6 * rig.gravity.ring_mass_g if rig.gravity else 0.0
    if isinstance(rig.joint, NotchedTube):
        tube, notch = rig.joint.tube, rig.joint.cut
        outer, inner = tube.outer_diameter_mm / 2, tube.inner_diameter_mm / 2
        middles = (np.arange(200) + 0.5) / 200 * notch.width_mm / 2
        volume = math.pi * (outer**2 - inner**2) * notch.spacing_mm
        volume += notch.width_mm * float(section(rig.joint, middles).area_mm2.mean())
        mass = mass or NITINOL_T_PER_MM3 * volume
    else:
        outer = inner = rig.tendon_a.moment_arm_mm
    if mass == 0:
        raise RigError(f"rig {rig.name}: measured joints: expected gravity.ring_mass_g above 0 for a dynamic run")
    return RingInertia(mass, mass * ((outer**2 + inner**2) / 4 + rig.pitch_mm**2 / 12))


class _Motion:
    """What happens at each step of the integrator; keeps a row of results a step."""

    def __init__(self, stepper: Stepper, plan: Schedule, inertia: RingInertia, work_mJ: float) -> None:
        self.stepper, self.plan, self.inertia = stepper, plan, inertia
        columns = np.column_stack(
            [plan.drive_mm, plan.slack_mm, plan.loop_scale, plan.friction_scale, plan.residual_rad]
        )
        # A sample at rest ahead of the first makes the wheel start without a jump of speed. Monotone between samples:
        # the path gets no reversals that the program does not have.
        time = np.concatenate([[plan.time_s[0] - (plan.time_s[1] - plan.time_s[0])], plan.time_s])
        self.course = PchipInterpolator(time, np.vstack([columns[:1], columns]))
        self.crept, self.work, self.force = np.zeros(2), work_mJ, wheel_force_N(stepper.tensions())
        self.sliding = stepper.guides.sliding
        self.rows: list[tuple[float, ...]] = []
        self.tensions: list[Floats] = []
        self.rotations: list[Floats] = []
        self._keep(0.0, stepper.coordinates(), 0.0 * stepper.coordinates())

    def before_step(self, mbs: Any, time_s: float) -> bool:
        """Bring the drive to where it is at the end of the step."""
        drive, slack_a, slack_b, scale, dry, residual = self.course(min(time_s, self.plan.time_s[-1])).tolist()
        a, b = self.crept.tolist()
        self.sliding = self.stepper.guides.sliding
        self.stepper.set_load(Load(drive, (slack_a + a, slack_b + b), scale, dry, residual, time_s, 1.0))
        return True

    def before_residual(self, mbs: Any, time_s: float, newton: int, discontinuous: int) -> None:
        """Bound the friction by the present tensions, and let guides stick or slide by their forces.

        Within an iteration of Newton's method nothing has a kink. In the first one guides keep the states of the last
        step.
        """
        guides, limit = self.stepper.guides, self.stepper.limits()
        if newton > 0:
            self.sliding = guides.next_states(self.stepper.coordinates(), self.sliding, limit)
        guides.fix(self.sliding, limit)

    def after_newton(self, mbs: Any, time_s: float) -> list[float]:
        """Refuse a step that jumped to another equilibrium: an error above Exudyn's limit of 1, half the step."""
        step_s, stepper = time_s - self.rows[-1][0], self.stepper
        change = stepper.coordinates() - self.here
        if stepper.jumped(change, distance(self.load, stepper.load)):
            return [2.0, 0.5 * step_s]
        return [0.0, -1.0]

    def after_step(self, mbs: Any, time_s: float) -> bool:
        """Book the step, and move what slipped."""
        stepper, last = self.stepper, self.rows[-1]
        if time_s <= last[0]:  # Exudyn calls it once before the first step
            return True
        q, velocities = stepper.coordinates(), np.asarray(mbs.systemData.GetODE2Coordinates_t())
        stepper.guides.sliding = self.sliding
        stepper.material.begin(time_s - last[0], q)
        stepper.accept(q, velocities, stepper.limits())
        stepper.material.begin(0.0, q)  # plateaus of the next step have the temperatures at the end of this one
        before, self.force = self.force, wheel_force_N(stepper.tensions())
        self.work += 0.5 * (before + self.force) * (stepper.load.drive - last[1])
        if self.stepper.rig.creep is not None:
            part = -math.expm1(-(time_s - last[0]) / self.stepper.rig.creep.time_s)
            tension = np.resize(stepper.tensions()[:, 0], 2)  # of one tendon twice: the second is not used
            self.crept += part * (creep_goal_mm(stepper.rig, tension) - self.crept)
        self._keep(time_s, q, velocities)
        return True

    def _keep(self, time_s: float, q: Floats, velocities: Floats) -> None:
        stepper = self.stepper
        self.here, self.load = q, stepper.load
        lost = stepper.losses
        energies = (self.work, lost.friction, lost.material, lost.drag, self._kinetic_mJ(q, velocities))
        self.rows.append((time_s, stepper.load.drive, *energies, *stepper.tip_mm().tolist()))
        tension = stepper.tensions()
        self.tensions.append(np.vstack([tension, np.zeros((2 - len(tension), tension.shape[1]))]))
        self.rotations.append(q[stepper.model.rotation])

    def _kinetic_mJ(self, q: Floats, velocities: Floats) -> float:
        rings, arm = self.stepper.model.rings[1:], self.stepper.model.centre_mm[1:]
        angle, speed = q[rings + 2], velocities[rings + 2]
        vx = velocities[rings] - arm * speed * np.sin(angle)
        vy = velocities[rings + 1] + arm * speed * np.cos(angle)
        mass = np.full(speed.size, self.inertia.mass_t)
        mass[-1] = tip_inertia(self.stepper.rig, self.inertia).mass_t
        return float(0.5 * (mass * (vx**2 + vy**2) + self.inertia.about_centre_t_mm2 * speed**2).sum())

    def at_samples(self, rows: list[Any]) -> Floats:
        """Values at the samples' times, on the line between steps, shape (m, ...)."""
        values = np.array(rows)
        time, flat = np.array([row[0] for row in self.rows]), values.reshape(len(values), -1)
        out = np.column_stack([np.interp(self.plan.time_s, time, column) for column in flat.T])
        return out.reshape(-1, *values.shape[1:])


def _fastest_mm_per_s(plan: Schedule) -> float:
    return float((np.abs(np.diff(plan.drive_mm)) / np.diff(plan.time_s)).max())


def _steps(plan: Schedule, settings: DynamicSettings) -> int:
    """Equal steps of a run; of a program of equal times a whole number a sample."""
    interval, fastest = np.diff(plan.time_s), _fastest_mm_per_s(plan)
    longest = min(float(interval.min()), settings.max_step_mm / fastest if fastest > 0 else math.inf)
    mean = float(plan.time_s[-1]) / interval.size
    return interval.size * math.ceil(mean / longest - 1e-6)


def _integrator(stepper: Stepper, end_s: float, steps: int, settings: DynamicSettings) -> Any:
    """Set Exudyn's integrator, its Newton as that of the static solver."""
    solver = stepper.solver
    course, static = solver.timeIntegration, solver.staticSolver.newton
    course.endTime, course.numberOfSteps, course.verboseMode = end_s, steps, 0
    course.minimumStepSize = end_s / steps * 0.5**settings.max_halvings
    course.adaptiveStepRecoverySteps = 2
    course.generalizedAlpha.spectralRadius = settings.spectral_radius
    course.generalizedAlpha.computeInitialAccelerations = False  # at rest they are zero; massless coordinates have none
    course.newton.useModifiedNewton = False
    course.newton.relativeTolerance = static.relativeTolerance
    course.newton.absoluteTolerance = static.absoluteTolerance
    course.newton.maxIterations = settings.newton_iterations
    course.newton.numericalDifferentiation.relativeEpsilon = static.numericalDifferentiation.relativeEpsilon
    return solver


def _integrate(motion: _Motion, solver: Any) -> None:
    """Run from rest to the end.

    Raises
    ------
    SolverError
        With the sample and the drive at which a step failed.
    """
    stepper = motion.stepper
    mbs = stepper.model.mbs
    mbs.SetPreStepUserFunction(motion.before_step)
    mbs.SetPreNewtonResidualUserFunction(motion.before_residual)
    mbs.SetPostNewtonUserFunction(motion.after_newton)
    mbs.SetPostStepUserFunction(motion.after_step)
    try:
        with quiet():
            done = mbs.SolveDynamic(solver, showHints=False)
    except (RuntimeError, ValueError):
        done = False
    finally:  # what they refer to would otherwise never be freed
        for erase in (
            mbs.SetPreStepUserFunction,
            mbs.SetPreNewtonResidualUserFunction,
            mbs.SetPostNewtonUserFunction,
            mbs.SetPostStepUserFunction,
        ):
            erase(0)
    if not done:
        time_s, drive = motion.rows[-1][:2]
        sample, size = int(np.searchsorted(motion.plan.time_s, time_s, side="right")), motion.plan.time_s.size
        raise SolverError(
            f"rig {stepper.rig.name}, sample {sample} of {size}: no step in time from drive {drive:.6g} mm "
            f"at {time_s:.6g} s"
        )


def solve_dynamic(rig: Rig, program: LoadProgram, settings: DynamicSettings | None = None) -> DynamicSolution:
    """Run a load program in time, from rest, with the inertia of the rings and the drag of the rig.

    The wheel follows a smooth curve through the samples. A first sample away from zero drive is reached slowly, before
    the time starts. Vibrations that the step does not resolve are damped; those that it does resolve have no damping
    but drag and friction. The error is of second order in the step where nothing slips, of first order at the steps in
    which something starts to slip.

    Raises
    ------
    RigError
        A program without times; measured joints without a mass; from :func:`fem_models.load.schedule.schedule`.
    SolverError
        When a step does not converge even after ``max_halvings`` halvings.
    """
    settings = settings or DynamicSettings()
    if program.time_s is None:
        raise RigError(f"rig {rig.name}: expected a load program with time_s for a dynamic run")
    plan, inertia, joints = schedule(rig, program), ring_inertia(rig), joint_row(rig)
    require_possible(rig, joints)
    stepper = Stepper(rig, joints, settings.statics, inertia)
    try:
        stepper.settle()
        work = stepper.move(load_of(plan, 0, plan.slack_mm[0], 0.0))
    except SolverError as error:
        raise SolverError(f"rig {rig.name}, sample 0 of {plan.time_s.size}: {error}") from None
    stepper.dashpots.damp_by_speed()
    stepper.guides.make_slack([False] * len(rig.tendons))  # in time their own law says which tendons pull
    end, steps = float(plan.time_s[-1]), _steps(plan, settings)
    motion = _Motion(stepper, plan, inertia, work)
    _integrate(motion, _integrator(stepper, end, steps, settings))
    rotation, tension = motion.at_samples(motion.rotations), motion.at_samples(motion.tensions)
    _, _, worked, friction, material, viscous, kinetic, *tip = motion.at_samples(motion.rows).T
    require_open(rig, joints, np.diff(rotation, axis=1))
    require_warm(rig, joints.first.section, stepper.material.heat.coldest[None])
    record = simulated_record(
        "dynamic multibody",
        rig,
        program,
        angle_deg=np.degrees(rotation[:, -1]),
        joint_angles_rad=np.diff(rotation, axis=1),
        tension_N=tension[:, :, 0],
        tip_mm=np.column_stack(tip),
    )
    step_s = end / steps
    return DynamicSolution(
        record, tension, worked, friction, material, viscous, kinetic, step_s, step_s * _fastest_mm_per_s(plan)
    )


def simulate_dynamic(rig: Rig, program: LoadProgram) -> Record:
    """Engine ``dynamic``: the record alone. See :func:`solve_dynamic`."""
    return solve_dynamic(rig, program).record
