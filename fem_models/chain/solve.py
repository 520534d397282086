"""The compiled twin of the multibody model: the same rig as a chain of joints and rope segments, quasi-static.

Unknowns are the joint angles and the slip of either tendon at every guide. A joint sees only the rope segments that
cross its notch, and a guide only its two neighbouring segments, so the tangent is a band of half width 4, and a Newton
step costs time linear in the number of joints; their number hardly grows (:mod:`fem_models.chain.newton`). Weight and a
touched tip stop reach all joints: the tangent is written by the headings of the rings then, and its half width is 5.
Friction, material and their histories follow the same laws as in the multibody model (:mod:`fem_models.joint.friction`), with
exact tangents, the dependence of a sliding guide's friction on tensions and wrap included.

What it lacks beside the multibody model: shear of the flexures, and the rings' compliance but for that in series with
the elastic part of a joint and with a closed notch.
"""

from __future__ import annotations

import math
import os
from collections.abc import Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass

import numpy as np

from fem_models.chain.equations import Constants, History
from fem_models.chain.newton import follow
from fem_models.joint.contact import closes_one_way, contact_angle_rad, require_open, ring_weight_N
from fem_models.joint.flexure import (
    flexure,
    force_scale_N,
    moment_arms_mm,
    rigid_gap_mm,
    ring_stiffness,
    turning_length_mm,
)
from fem_models.joint.friction import jenkins_elements
from fem_models.joint.strain import peak_strain
from fem_models.joint.superelastic import flag_fibres
from fem_models.load.program import LoadProgram
from fem_models.load.run_record import simulated_record
from fem_models.load.schedule import Schedule, force_schedule, schedule
from fem_models.load.stepping import StepControl, drive_control, force_control
from fem_models.rig.checks import RigError, SolverError
from fem_models.rig.rig import Rig
from hysteresis.arrays import Floats
from hysteresis.record import Record


@dataclass(frozen=True)
class ChainSettings:
    """Numerical settings. ``tolerance`` is of the residual, over :func:`fem_models.joint.flexure.force_scale_N`.

    ``max_pull`` bounds the step of a force, over the same; the rest as in the multibody model.
    """

    bristle_ratio: float = 0.02
    max_step_mm: float = 0.1
    max_pull: float = 0.25
    max_halvings: int = 20
    newton_iterations: int = 40
    tolerance: float = 1e-10


@dataclass(frozen=True)
class ChainSolution:
    """A record with what only the model knows; fields as in :class:`fem_models.multibody.quasi_static.MultibodySolution`."""

    record: Record
    segment_tensions_N: Floats
    peak_strain: Floats
    wheel_work_mJ: Floats
    friction_loss_mJ: Floats
    material_loss_mJ: Floats
    viscous_loss_mJ: Floats


def constants(rig: Rig, settings: ChainSettings, *, pulled: bool = False) -> Constants:
    """Reduce a rig to what the kernels need; ``pulled`` by a force in place of the wheel."""
    joint, arms, dry = flexure(rig), moment_arms_mm(rig), rig.friction
    elastic, _, _ = jenkins_elements(rig.material, joint.bending_Nmm_per_rad)
    bristle = settings.bristle_ratio
    ropes, absent, scale = rig.tendons, [0.0] * (2 - len(rig.tendons)), force_scale_N(rig)
    preload_a, preload_b = [float(rig.preload_N)] * len(ropes) + absent
    rope_a, rope_b = [rope.EA_N / rig.pitch_mm for rope in ropes] + absent
    free_a, free_b = [rope.EA_N / rope.free_length_mm for rope in ropes] + absent
    toe_a, toe_b = [float(rope.toe_N) for rope in ropes] + absent
    stop, weight, ring = rig.tip_stop, ring_weight_N(rig), ring_stiffness(rig)[0]  # the ring is in series
    contact = rig.closure.stiffness_Nmm_per_rad if rig.closure else 0.0
    creep = [rig.creep.fraction * rope.free_length_mm / rope.EA_N if rig.creep else 0.0 for rope in ropes] + absent
    return Constants(
        preload_a=preload_a,
        preload_b=preload_b,
        pulled=float(pulled),
        rest=math.radians(rig.precurvature_deg),
        scale=scale,
        bending=joint.bending_Nmm_per_rad,
        elastic=0.0 if rig.superelastic else elastic * ring / (ring + elastic),
        arm_a=arms[0],
        arm_b=arms[1],
        half_gap=0.5 * rigid_gap_mm(rig),
        rope_a=rope_a,
        rope_b=rope_b,
        free_a=free_a,
        free_b=free_b,
        toe_a=toe_a,
        toe_b=toe_b,
        axial=1 / joint.axial_N_per_mm if joint.axial_N_per_mm else 0.0,
        mu=float(dry.capstan_coefficient),
        guide=float(dry.guide_N),
        sheath=float(dry.sheath_N),
        rest_wrap=math.radians(dry.rest_wrap_deg),
        bristle_a=bristle * rope_a,
        bristle_b=bristle * rope_b,
        close_angle=contact_angle_rad(rig),
        close_stiffness=ring * contact / (ring + contact),
        close_both=0.0 if closes_one_way(rig) else 1.0,
        weight_x=weight[0],
        weight_y=weight[1],
        stop_y=float(stop.y_mm) if stop else math.inf,
        stop_stiffness=float(stop.stiffness_N_per_mm) if stop else 0.0,
        pitch=rig.pitch_mm,
        creep_a=creep[0],
        creep_b=creep[1],
        drag_sheath=float(rig.drag.sheath_N_s_per_mm) if rig.drag else 0.0,
        drag_joint=float(rig.drag.joint_Nmm_s_per_rad) if rig.drag else 0.0,
        # rounding of a slip times the stiffest segment is the least residual there can be
        tolerance=max(settings.tolerance * scale, 1e-14 * max(rope.EA_N for rope in ropes)),
    )


def _history(rig: Rig) -> History:
    n = rig.joints
    _, stiffness, slip_moment = jenkins_elements(rig.material, flexure(rig).bending_Nmm_per_rad)
    fibres = flag_fibres(rig)
    share = 1 - rig.material.loop_share  # what the Jenkins elements leave
    return History(
        guides=np.zeros((2, n)),
        jenkins=np.full((stiffness.size, n), math.radians(rig.precurvature_deg)),
        jenkins_stiffness=stiffness,
        slip_moment=slip_moment,
        flags=np.zeros((fibres.stiffness.size, n)),
        flag_stiffness=share * fibres.stiffness,
        flag_upper=share * fibres.upper_Nmm,
        flag_lower=share * fibres.lower_Nmm,
        flag_span=fibres.span_rad,
        flag_climb=share * fibres.slope,
    )


def solve_chain(rig: Rig, program: LoadProgram, settings: ChainSettings | None = None) -> ChainSolution:
    """Run a load program quasi-statically; of the times only creep and drag take note.

    Raises
    ------
    SolverError
        When a step does not converge even after ``max_halvings`` halvings.
    RigError
        From :func:`fem_models.load.schedule.schedule`.
    """
    angles, tensions, energies = _wound(rig, program, settings or ChainSettings())
    return _solution(rig, program, angles, tensions, energies)


def chain_angle_deg(rig: Rig, program: LoadProgram, settings: ChainSettings | None = None) -> Floats:
    """Angle alone of :func:`solve_chain`, shape (m,), for searches that run it thousands of times.

    Raises
    ------
    SolverError, RigError
        As :func:`solve_chain`.
    """
    angles, _, _ = _wound(rig, program, settings or ChainSettings())
    return np.degrees(np.cumsum(angles, axis=1)[:, -1])


def solve_pulled_chain(rig: Rig, force_N: Floats, settings: ChainSettings | None = None) -> ChainSolution:
    """Run a rig of one tendon through tensions at the wheel, shape (m,), in order; the record's drive is in N.

    Raises
    ------
    SolverError
        As :func:`solve_chain`.
    RigError
        From :func:`fem_models.load.schedule.force_schedule`.
    """
    settings, plan = settings or ChainSettings(), force_schedule(rig, force_N)
    arm, bending, scale = moment_arms_mm(rig)[0], flexure(rig).bending_Nmm_per_rad, force_scale_N(rig)
    control = force_control(rig, arm, bending, settings.max_pull * scale, settings.max_halvings)
    angles, tensions, energies = _followed(rig, plan, settings, control, pulled=True)
    return _solution(rig, plan.drive_mm, angles, tensions, energies)


def _wound(rig: Rig, program: LoadProgram, settings: ChainSettings) -> tuple[Floats, Floats, Floats]:
    """Angles, tensions and energies of a rig whose rope is wound in; as :func:`_followed`."""
    control = drive_control(rig, settings.max_step_mm, settings.max_halvings)
    return _followed(rig, schedule(rig, program), settings, control, pulled=False)


def _followed(
    rig: Rig, plan: Schedule, settings: ChainSettings, control: StepControl, *, pulled: bool
) -> tuple[Floats, Floats, Floats]:
    """Angles (m, N), tensions (m, 2, N+1), energies (m, 4)."""
    n, m, unit = rig.joints, plan.drive_mm.size, "N" if pulled else "mm"
    angles, tensions, energies = np.empty((m, n)), np.empty((m, 2, n + 1)), np.empty((m, 4))
    try:
        failed, start, end = follow(
            plan.drive_mm, plan.slack_mm, plan.loop_scale, plan.residual_rad, plan.time_s, plan.creep,
            constants(rig, settings, pulled=pulled), _history(rig), control,
            settings.newton_iterations, angles, tensions, energies,
        )  # fmt: skip
    except ZeroDivisionError:
        raise SolverError(f"rig {rig.name}: a tangent without stiffness on the way through {m} samples") from None
    if failed >= 0:
        raise SolverError(
            f"rig {rig.name}, sample {failed} of {m}: no equilibrium between drives {start:.6g} and {end:.6g} {unit}"
        )
    require_open(rig, angles)
    return angles, tensions, energies


def _solution(
    rig: Rig, program: LoadProgram | Floats, angles: Floats, tensions: Floats, energies: Floats
) -> ChainSolution:
    n = rig.joints
    heading = np.cumsum(angles, axis=1)
    turning = turning_length_mm(rig)  # along the mean of the headings before and beyond; the rest goes with the rings
    reach = (rig.pitch_mm - turning) * np.append(np.ones(n - 1), 0.5)
    way = np.exp(1j * heading) @ reach + turning * np.exp(1j * (heading - 0.5 * angles)).sum(axis=1)
    compliance = 1 / k if (k := flexure(rig).axial_N_per_mm) else 0.0
    shortening = compliance * (tensions[:, :, 1:].sum(axis=(1, 2)) - len(rig.tendons) * n * rig.preload_N)
    tip = np.column_stack([0.5 * (rig.pitch_mm - turning) + way.real - shortening, way.imag])
    record = simulated_record(
        "chain",
        rig,
        program,
        angle_deg=np.degrees(heading[:, -1]),
        joint_angles_rad=angles,
        tension_N=tensions[:, :, 0],
        tip_mm=tip,
    )
    return ChainSolution(record, tensions, peak_strain(rig, angles), *energies.T)


@dataclass(frozen=True)
class BatchSolution:
    """Rigs of one program, one row a rig. A rig that did not converge has NaN and says why.

    ``angle_deg`` has shape (rigs, m), ``tension_N`` (rigs, m, 2): tendons a and b at the wheel. ``messages`` are
    empty where all went well.
    """

    angle_deg: Floats
    tension_N: Floats
    messages: tuple[str, ...]


def solve_batch(
    rigs: Sequence[Rig], program: LoadProgram, settings: ChainSettings | None = None, *, threads: int | None = None
) -> BatchSolution:
    """Run many rigs through one program, in threads: the kernels hold no lock. The order does not matter."""

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
