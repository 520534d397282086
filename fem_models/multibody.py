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

import exudyn as exu
import numpy as np
from numpy.typing import NDArray

from fem_models.assembly import assemble, bristle_N_per_mm, taut
from fem_models.friction import friction_limits_N, guide_wrap_rad, jenkins_elements
from fem_models.presets import sidecar_table
from fem_models.program import LoadProgram, SolverError
from fem_models.rig import Rig
from fem_models.snr import flexure
from hysteresis.record import Record


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


@dataclass
class _State:
    """History of the dry elements: rest points of the bristles and of the Jenkins elements, friction limits."""

    rest: NDArray[np.float64]
    limit: NDArray[np.float64]
    jenkins_rest: NDArray[np.float64]
    friction_loss: float = 0.0
    material_loss: float = 0.0


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
        self.model = assemble(rig, settings.bristle_ratio)
        ropes, n = (rig.tendon_a, rig.tendon_b), rig.joints
        self.taut = np.array([taut(rig, rope) for rope in ropes])
        self.bristle = np.repeat(
            [bristle_N_per_mm(rig, t, settings.bristle_ratio) for t in (rig.tendon_a, rig.tendon_b)], n
        )
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
