"""The compiled chain of joints and tendon segments, quasi-static: the fast engine beside the multibody model.

Unknowns are the joint angles and the slip of either tendon at every guide. A joint sees only the tendon segments that
cross its notch, and a guide only its two neighbouring segments. The tangent is therefore a band of half width 4, and
the time of a Newton step is linear in the number of joints; the number of steps hardly grows
(:mod:`fem_models.chain.newton`). Weight, a tip load and a touched tip stop reach all joints: the tangent is then
written by the headings of the rings, and its half width is 5. Friction, material and their histories follow the same
laws as in the multibody model (:mod:`fem_models.joint.friction`), with exact tangents, which include how the friction
of a sliding guide depends on tensions and wrap.

Unlike the multibody model it has no shear of the flexures. Of the rings' compliance it has only the part in series with
the elastic part of a joint and with a closed notch.
"""

from __future__ import annotations

import os
from collections.abc import Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass

import numpy as np

from fem_models.chain.follow import Path, Run, follow
from fem_models.chain.parameters import ChainSettings, Parameters, chain_parameters, memory_at_rest
from fem_models.joint import JointMechanics, joint_mechanics
from fem_models.joint.contact import require_open
from fem_models.joint.strain import peak_strain
from fem_models.load import LoadProgram
from fem_models.load.run_record import simulated_record
from fem_models.load.schedule import Schedule, force_schedule, schedule
from fem_models.load.stepping import StepControl, drive_control, force_control
from fem_models.rig import Rig, RigError
from fem_models.rig.checks import SolverError
from hysteresis.arrays import Floats
from hysteresis.record import Record


@dataclass(frozen=True)
class ChainSolution:
    """A record, and what only the model knows. Arrays follow the samples of the record, shape (m, ...).

    ``segment_tensions_N`` has shape (m, 2, N+1): tendons a and b, from the wheel to the tip. ``peak_strain``, shape
    (m, N), is that of :func:`fem_models.joint.strain.peak_strain`. The work of the wheel and the losses to friction,
    material and drag are cumulative from the start of the program.
    """

    record: Record
    segment_tensions_N: Floats
    peak_strain: Floats
    wheel_work_mJ: Floats
    friction_loss_mJ: Floats
    material_loss_mJ: Floats
    viscous_loss_mJ: Floats


def solve_chain(rig: Rig, program: LoadProgram, settings: ChainSettings | None = None) -> ChainSolution:
    """Run a load program quasi-statically; times matter for creep and drag only.

    Raises
    ------
    SolverError
        When a step does not converge even after ``max_halvings`` halvings.
    RigError
        From :func:`fem_models.load.schedule.schedule`.
    """
    joint = joint_mechanics(rig)
    return _solution(rig, joint, program, _driven(rig, joint, program, settings or ChainSettings()))


def chain_angle_deg(rig: Rig, program: LoadProgram, settings: ChainSettings | None = None) -> Floats:
    """Angle alone of :func:`solve_chain`, shape (m,), for searches that run it thousands of times.

    Raises
    ------
    SolverError, RigError
        As :func:`solve_chain`.
    """
    run = _driven(rig, joint_mechanics(rig), program, settings or ChainSettings())
    return np.degrees(np.cumsum(run.angles, axis=1)[:, -1])


def solve_chain_by_force(rig: Rig, force_N: Floats, settings: ChainSettings | None = None) -> ChainSolution:
    """Run a rig of one tendon under load control: tensions at the wheel, shape (m,), in order.

    The drive of the record is in N.

    Raises
    ------
    SolverError
        As :func:`solve_chain`.
    RigError
        From :func:`fem_models.load.schedule.force_schedule`.
    """
    settings, plan, joint = settings or ChainSettings(), force_schedule(rig, force_N), joint_mechanics(rig)
    arm, bending = joint.arms_mm.a, joint.flexure.bending_Nmm_per_rad
    control = force_control(rig, arm, bending, settings.max_force_step * joint.force_scale_N, settings.max_halvings)
    path = _path(plan, control, settings)
    run = _followed(rig, joint, path, chain_parameters(rig, joint, settings, load_control=True))
    return _solution(rig, joint, plan.drive_mm, run)


def _driven(rig: Rig, joint: JointMechanics, program: LoadProgram, settings: ChainSettings) -> Run:
    """Follow a program whose wheel winds in tendon."""
    control = drive_control(rig, settings.max_step_mm, settings.max_halvings)
    path = _path(schedule(rig, program), control, settings)
    return _followed(rig, joint, path, chain_parameters(rig, joint, settings))


def _path(plan: Schedule, control: StepControl, settings: ChainSettings) -> Path:
    return Path(
        drive=plan.drive_mm,
        slack=plan.slack_mm,
        loop_scale=plan.loop_scale,
        friction_scale=plan.friction_scale,
        rest_angle=plan.residual_rad,
        time=plan.time_s,
        creep=plan.creep,
        control=control,
        iterations=settings.newton_iterations,
    )


def _followed(rig: Rig, joint: JointMechanics, path: Path, parameters: Parameters) -> Run:
    n, m, unit = rig.joints, path.drive.size, "N" if parameters.load_control else "mm"
    run = Run(angles=np.empty((m, n)), tensions=np.empty((m, 2, n + 1)), energies=np.empty((m, 4)))
    try:
        failed = follow(path, parameters, memory_at_rest(rig, joint), run)
    except ZeroDivisionError:
        raise SolverError(f"rig {rig.name}: a tangent without stiffness in the path of {m} samples") from None
    if failed.sample >= 0:
        between = f"between drives {failed.start:.6g} and {failed.end:.6g} {unit}"
        raise SolverError(f"rig {rig.name}, sample {failed.sample} of {m}: no equilibrium {between}")
    require_open(rig, joint, run.angles)
    return run


def _solution(rig: Rig, joint: JointMechanics, program: LoadProgram | Floats, run: Run) -> ChainSolution:
    record = simulated_record(
        "chain",
        rig,
        program,
        angle_deg=np.degrees(np.cumsum(run.angles, axis=1)[:, -1]),
        joint_angles_rad=run.angles,
        tension_N=run.tensions[:, :, 0],
        tip_mm=_tip_mm(rig, joint, run),
    )
    return ChainSolution(record, run.tensions, peak_strain(joint, run.angles), *run.energies.T)


def _tip_mm(rig: Rig, joint: JointMechanics, run: Run) -> Floats:
    """Centre of the last ring, shape (m, 2).

    The turning length of a notch lies along the mean of the headings before and beyond it, the rest along the rings.
    """
    n, heading = rig.joints, np.cumsum(run.angles, axis=1)
    turning = joint.turning_length_mm
    reach = (rig.pitch_mm - turning) * np.append(np.ones(n - 1), 0.5)
    place = np.exp(1j * heading) @ reach + turning * np.exp(1j * (heading - 0.5 * run.angles)).sum(axis=1)
    compliance = 1 / k if (k := joint.flexure.axial_N_per_mm) else 0.0
    shortening = compliance * (run.tensions[:, :, 1:].sum(axis=(1, 2)) - len(rig.tendons) * n * rig.preload_N)
    return np.column_stack([0.5 * (rig.pitch_mm - turning) + place.real - shortening, place.imag])


@dataclass(frozen=True)
class BatchSolution:
    """Rigs of one program, one row a rig. A rig that did not converge has NaN and a message.

    ``angle_deg`` has shape (rigs, m), ``tension_N`` (rigs, m, 2): tendons a and b at the wheel. ``messages`` are
    empty where the rig converged.
    """

    angle_deg: Floats
    tension_N: Floats
    messages: tuple[str, ...]


def solve_batch(
    rigs: Sequence[Rig], program: LoadProgram, settings: ChainSettings | None = None, *, threads: int | None = None
) -> BatchSolution:
    """Run many rigs through one program, in threads: the kernels release the lock of the interpreter.

    The order of the rigs does not matter.
    """

    def one(rig: Rig) -> tuple[Floats, Floats, str]:
        try:
            solution = solve_chain(rig, program, settings)
        except (SolverError, RigError) as error:
            return np.full(m, np.nan), np.full((m, 2), np.nan), str(error)
        return solution.record.angle_deg, solution.segment_tensions_N[:, :, 0], ""

    m = program.drive_mm.size
    with ThreadPoolExecutor(threads or os.cpu_count()) as pool:
        rows = list(pool.map(one, rigs))
    return BatchSolution(np.array([r[0] for r in rows]), np.array([r[1] for r in rows]), tuple(r[2] for r in rows))


def simulate_chain(rig: Rig, program: LoadProgram) -> Record:
    """Engine ``chain``: the record alone. See :func:`solve_chain`."""
    return solve_chain(rig, program).record
