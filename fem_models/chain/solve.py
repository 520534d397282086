"""The compiled chain of joints and tendon segments, quasi-static: the fast engine, next to the multibody model.

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
from functools import cache

import numpy as np

from fem_models.chain.each import with_each
from fem_models.chain.follow import Path, Run, Tape, follow, tape_of
from fem_models.chain.parameters import ChainSettings, Parameters, chain_parameters, memory_at_rest
from fem_models.chain.turns import tip_reach
from fem_models.joint import JointRow, joint_row
from fem_models.joint.contact import require_open
from fem_models.joint.possible import require_possible, require_strain
from fem_models.joint.strain import peak_strain, thrust_N
from fem_models.joint.superelastic_section import elongation_under_mm, require_warm
from fem_models.load import LoadProgram
from fem_models.load.run_record import simulated_record
from fem_models.load.schedule import force_schedule, schedule, snap_hint
from fem_models.load.stepping import drive_control, force_control
from fem_models.rig import Rig, RigError
from fem_models.rig.checks import SolverError
from fem_models.rig.rig import require_planar
from hysteresis.arrays import Floats, Mask
from hysteresis.records.record import Record


@dataclass(frozen=True)
class ChainSolution:
    """A record, and what only the model knows. Arrays follow the samples of the record, shape (m, ...).

    ``segment_tensions_N`` has shape (m, 2, N+1): tendons a and b, from the wheel to the tip. ``peak_strain``, shape
    (m, N), is that of :func:`fem_models.joint.strain.peak_strain`. The work of the wheel and the losses to friction,
    material, drag and jumps are cumulative from the start of the program; ``jump``, shape (m,), says whether the tube
    jumped on the way to a sample (:mod:`fem_models.chain.jump`). ``warming_K``, shape (m, N), is the temperature of
    joints that heat themselves above that of the surroundings; None of a rig whose joints do not.
    """

    record: Record
    segment_tensions_N: Floats
    peak_strain: Floats
    wheel_work_mJ: Floats
    friction_loss_mJ: Floats
    material_loss_mJ: Floats
    viscous_loss_mJ: Floats
    jump_loss_mJ: Floats
    jump: Mask
    warming_K: Floats | None = None


def solve_chain(rig: Rig, program: LoadProgram, settings: ChainSettings | None = None) -> ChainSolution:
    """Run a load program quasi-statically; times matter for creep, drag and self-heating only.

    Raises
    ------
    SolverError
        When a step does not converge even after ``max_halvings`` halvings.
    RigError
        From :func:`fem_models.load.schedule.schedule`.
    """
    case = chain_case(rig, program, settings)
    return _solution(rig, case.joints, program, followed(rig, case)[0])


def chain_angle_deg(rig: Rig, program: LoadProgram, settings: ChainSettings | None = None) -> Floats:
    """Angle alone of :func:`solve_chain`, shape (m,), for searches that run it thousands of times.

    Raises
    ------
    SolverError, RigError
        As :func:`solve_chain`.
    """
    run, _ = followed(rig, chain_case(rig, program, settings))
    return tip_angle_deg(run)


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
    case = chain_case(rig, force_N, settings)
    return _solution(rig, case.joints, case.path.drive, followed(rig, case)[0])


@dataclass(frozen=True, eq=False)
class ChainCase:
    """A rig and the path that it is to follow, as the kernels take them."""

    joints: JointRow
    path: Path
    parameters: Parameters


def chain_case(
    rig: Rig,
    load: LoadProgram | Floats,
    settings: ChainSettings | None = None,
    path: Path | None = None,
    like: ChainCase | None = None,
) -> ChainCase:
    """Derive what the kernels take of a rig and a load program, or of a rig and tendon forces in N, shape (m,).

    Parameters
    ----------
    path
        The path of that load, where it is known.
    like
        The same rig through another load of that kind, with those settings, where it is known; only the path differs.

    Raises
    ------
    RigError
        From :mod:`fem_models.load.schedule` and :mod:`fem_models.joint.possible`.
    """
    settings = settings or ChainSettings()
    if like is not None:
        return ChainCase(like.joints, path or _path(rig, load, like.joints, settings), like.parameters)
    joints = joint_row(require_planar(rig))
    if isinstance(load, LoadProgram):
        require_possible(rig, joints)
    else:
        require_strain(rig)
    parameters = chain_parameters(rig, joints, settings, load_control=not isinstance(load, LoadProgram))
    return ChainCase(joints, path or _path(rig, load, joints, settings), with_each(parameters, rig, joints))


def _path(rig: Rig, load: LoadProgram | Floats, joints: JointRow, settings: ChainSettings) -> Path:
    if isinstance(load, LoadProgram):
        plan, control = schedule(rig, load), drive_control(rig, settings.max_step_mm, settings.max_halvings)
    else:
        plan, soft, longest = force_schedule(rig, load), joints.softest, settings.max_force_step * joints.force_scale_N
        arm, bending = soft.arms_mm.a, soft.flexure.bending_Nmm_per_rad
        control = force_control(rig, arm, bending, longest, settings.max_halvings)
    return Path(
        drive=_own(plan.drive_mm),
        slack=_own(plan.slack_mm),
        loop_scale=_own(plan.loop_scale),
        friction_scale=_own(plan.friction_scale),
        rest_angle=_own(plan.residual_rad),
        time=_own(plan.time_s),
        creep=_own(plan.creep),
        control=control,
        iterations=settings.newton_iterations,
    )


def _own(values: Floats) -> Floats:
    """Copy of an array: a kernel is compiled anew for arrays that are read-only or not contiguous."""
    return np.array(values, dtype=float, order="C")


def run_space(case: ChainCase, joints: int) -> Run:
    """Arrays for the results of a run."""
    section = case.joints.first.section
    m, sections = case.path.drive.size, joints if section else 0
    heated = joints if section and section.heating else 0
    return Run(
        angles=np.empty((m, joints)),
        tensions=np.empty((m, 2, joints + 1)),
        energies=np.empty((m, 5)),
        jumps=np.zeros(m, dtype=bool),
        longer=np.empty((m, sections)),
        warming=np.empty((m, heated)),
        coldest=np.zeros(heated),
    )


@cache
def _no_tape(joints: int) -> Tape:
    """Tape that no step is written on: without room there is nothing in it to change."""
    return tape_of.py_func(0, joints)  # by Python: compiled for Python alone it would take long


def followed(rig: Rig, case: ChainCase, *, taped: bool = False) -> tuple[Run, Tape]:
    """Follow the path; the tape of the steps is empty unless it is asked for.

    Raises
    ------
    SolverError, RigError
        As :func:`solve_chain`.
    """
    joints, path, parameters = case.joints, case.path, case.parameters
    n, m, unit = rig.joints, path.drive.size, "N" if parameters.load_control else "mm"
    run, tape = run_space(case, n), tape_of.py_func(2 * m + 1, n) if taped else _no_tape(n)
    try:
        failed, tape = follow(path, parameters, memory_at_rest(rig, joints), run, tape)
    except ZeroDivisionError:
        raise SolverError(f"rig {rig.name}: a tangent without stiffness in the path of {m} samples") from None
    if failed.sample >= 0:
        between = f"between drives {failed.start:.6g} and {failed.end:.6g} {unit}"
        hint = snap_hint(rig, load_control=parameters.load_control)
        raise SolverError(f"rig {rig.name}, sample {failed.sample} of {m}: no equilibrium {between}{hint}")
    require_open(rig, joints, run.angles)
    require_warm(rig, joints.first.section, run.coldest[None])
    return run, tape


def _solution(rig: Rig, joints: JointRow, program: LoadProgram | Floats, run: Run) -> ChainSolution:
    record = simulated_record(
        "chain",
        rig,
        program,
        angle_deg=tip_angle_deg(run),
        joint_angles_rad=run.angles,
        tension_N=run.tensions[:, :, 0],
        tip_mm=tip_mm(rig, joints, run),
        jump=run.jumps,
    )
    strain = strain_of_run(joints, run)
    wheel, friction, material, drag, jump = run.energies.T
    warming = run.warming if run.warming.size else None
    return ChainSolution(record, run.tensions, strain, wheel, friction, material, drag, jump, run.jumps, warming)


def strain_of_run(joints: JointRow, run: Run) -> Floats:
    """Peak strain of every joint, shape (m, N), with that of the tendons' thrust."""
    longer = run.longer if joints.first.section else None
    return peak_strain(joints, run.angles, longer, thrust_N=thrust_N(run.tensions))


def tip_angle_deg(run: Run) -> Floats:
    """Bending at the tip, shape (m,): the angles of the joints, added from the base."""
    return np.degrees(np.cumsum(run.angles, axis=1)[:, -1])


def tip_mm(rig: Rig, joints: JointRow, run: Run) -> Floats:
    """Centre of the last ring, shape (m, 2).

    The turning length of a notch lies along the mean of the headings before and beyond it, the rest along the rings.
    """
    lengths, turning = joints.lengths, joints.of("turning_length_mm")
    tip = np.empty((len(run.angles), 2))
    tip_reach(run.angles, lengths.stiff, lengths.aside, turning, tip)
    thrust = len(rig.tendons) * rig.preload_N
    if joints.alike:
        compliance, n = joints.first.axial_compliance, rig.joints
        shortening = compliance * (run.tensions[:, :, 1:].sum(axis=(1, 2)) - n * thrust)
    else:
        shortening = (run.tensions[:, :, 1:].sum(axis=1) - thrust) @ joints.of("axial_compliance")
    if joints.first.section is not None:
        each = joints.each[:1] if joints.alike else joints.each
        rest = np.array([elongation_under_mm(joint.section, thrust) for joint in each if joint.section])
        shortening += (rest - run.longer).sum(axis=1)
    tip[:, 0] += lengths.base - shortening
    return tip


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
            run, _ = followed(rig, chain_case(rig, program, settings))
        except (SolverError, RigError) as error:
            return np.full(m, np.nan), np.full((m, 2), np.nan), str(error)
        return tip_angle_deg(run), run.tensions[:, :, 0], ""

    m = program.drive_mm.size
    with ThreadPoolExecutor(threads or os.cpu_count()) as pool:
        rows = list(pool.map(one, rigs))
    return BatchSolution(np.array([r[0] for r in rows]), np.array([r[1] for r in rows]), tuple(r[2] for r in rows))


def simulate_chain(rig: Rig, program: LoadProgram) -> Record:
    """Engine ``chain``: the record alone. See :func:`solve_chain`."""
    return solve_chain(rig, program).record
