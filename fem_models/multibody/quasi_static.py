"""The manipulator as an Exudyn flexible multibody system, quasi-static: without inertia.

Flexures are two-node geometrically exact beams (Simo and Vu-Quoc, doi 10.1115/1.3171870) of the length over which a
notch bends; rings are such beams, nearly rigid. What a ring gives in bending is in series with the elastic part of its
joint. Each tendon is a row of elastic segments. Its slip at every guide is a coordinate with dry friction. The wheel
drives both tendons.

One element a flexure is enough: it has one integration point, so its only compliances are those of its mid-point frame,
uncoupled. So are those of a notch between stiff rings, which is symmetric about its middle. An element with the notch's
mid-point stiffnesses is therefore exact for small strain. Friction is a spring with a slipping rest point, because a
velocity law never slips in a static solution.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np

from fem_models.joint import joint_row
from fem_models.joint.contact import require_open
from fem_models.joint.possible import require_possible, require_strain
from fem_models.joint.strain import peak_strain, thrust_N
from fem_models.joint.superelastic_section import require_warm
from fem_models.load import LoadProgram
from fem_models.load.run_record import simulated_record
from fem_models.load.schedule import Schedule, force_schedule, schedule, snap_hint
from fem_models.load.stepping import Load
from fem_models.multibody.stepper import MultibodySettings, Stepper
from fem_models.rig import Rig
from fem_models.rig.checks import SolverError
from hysteresis.arrays import Floats, Mask
from hysteresis.records.record import Record

Count = Callable[[int, int], None]


@dataclass(frozen=True)
class MultibodySolution:
    """A record, and what only the model knows. Arrays follow the samples of the record, shape (m, ...).

    ``segment_tensions_N`` has shape (m, 2, N+1): tendon a and b, from the wheel to the tip. ``peak_strain``, shape
    (m, N), is that of :func:`fem_models.joint.strain.peak_strain`. ``wheel_work_mJ`` and the losses to friction, the
    material and drag are cumulative from the start of the program. ``jump`` says whether the rig jumped to another
    equilibrium on the way to a sample. ``jump_loss_mJ``, cumulative too, is the energy lost in jumps: a real tube loses
    it in vibrations. ``warming_K``, shape (m, N), is the temperature of joints that heat themselves above that of the
    surroundings; None of a rig whose joints do not.
    """

    record: Record
    segment_tensions_N: Floats
    peak_strain: Floats
    wheel_work_mJ: Floats
    friction_loss_mJ: Floats
    material_loss_mJ: Floats
    viscous_loss_mJ: Floats
    jump: Mask
    jump_loss_mJ: Floats
    warming_K: Floats | None = None


def solve_multibody(
    rig: Rig,
    program: LoadProgram,
    settings: MultibodySettings | None = None,
    *,
    progress: Count = lambda done, of: None,
) -> MultibodySolution:
    """Run a load program quasi-statically; times matter for creep, drag and self-heating only.

    Drag is of first order in the time between samples (implicit Euler). A first sample away from zero drive is reached
    slowly, without drag. ``progress`` is called with the number of samples that are done, and of all.

    Raises
    ------
    SolverError
        When a step does not converge even after ``max_halvings`` halvings, with long leads of the tendons and short.
    RigError
        From :func:`fem_models.load.schedule.schedule`.
    """
    return _run_with_either_lead(rig, settings or MultibodySettings(), schedule(rig, program), program, progress)


def solve_multibody_by_force(rig: Rig, force_N: Floats, settings: MultibodySettings | None = None) -> MultibodySolution:
    """Run a rig of one tendon under load control: tensions at the wheel, shape (m,), in order.

    The drive of the record is in N.

    Raises
    ------
    SolverError
        As :func:`solve_multibody`.
    RigError
        From :func:`fem_models.load.schedule.force_schedule`.
    """
    plan = force_schedule(rig, force_N)
    return _run_with_either_lead(rig, settings or MultibodySettings(), plan, plan.drive_mm, load_control=True)


def _run_with_either_lead(
    rig: Rig,
    settings: MultibodySettings,
    plan: Schedule,
    program: LoadProgram | Floats,
    progress: Count = lambda done, of: None,
    *,
    load_control: bool = False,
) -> MultibodySolution:
    """Run with long leads of the tendons, which are nearer to their law; where no step is found, with short ones."""
    joints = joint_row(rig)
    if load_control:
        require_strain(rig)
    else:
        require_possible(rig, joints)
    try:
        return _run(Stepper(rig, joints, settings, load_control=load_control), plan, program, progress)
    except SolverError:
        if settings.short_lead_pitches >= settings.lead_pitches:
            raise
    short = replace(settings, lead_pitches=settings.short_lead_pitches)
    return _run(Stepper(rig, joints, short, load_control=load_control), plan, program, progress)


def _run(
    stepper: Stepper, plan: Schedule, program: LoadProgram | Floats, progress: Count = lambda done, of: None
) -> MultibodySolution:
    rig, joints, m = stepper.rig, stepper.rig.joints, plan.drive_mm.size
    rotation, tip = np.empty((m, joints + 1)), np.empty((m, 2))
    tension, energy = np.zeros((m, 2, joints + 1)), np.empty((m, 5))
    longer, warming = np.empty((m, stepper.model.longer.size)), np.empty((m, joints))
    work, crept, jump = 0.0, np.zeros(2), np.zeros(m, dtype=bool)
    for k in range(m):
        load = load_of(plan, k, plan.slack_mm[k] + crept, plan.time_s[k])
        jumps = stepper.jumps
        try:
            if k == 0:
                stepper.settle()
            work += stepper.move(load)
        except SolverError as error:
            hint = snap_hint(rig, load_control=stepper.load_control)
            raise SolverError(f"rig {rig.name}, sample {k} of {m}: {error}{hint}") from None
        tension[k, : len(rig.tendons)] = stepper.found
        if k + 1 < m:  # until the next sample, at these tensions
            crept += plan.creep[k + 1] * (creep_goal_mm(rig, tension[k, :, 0]) - crept)
        q = stepper.coordinates()
        rotation[k] = q[stepper.model.rotation]
        longer[k], warming[k] = q[stepper.model.longer], stepper.material.heat.last
        tip[k] = stepper.tip_mm()
        progress(k + 1, m)
        lost, jump[k] = stepper.losses, stepper.jumps > jumps
        energy[k] = work, lost.friction, lost.material, lost.drag, lost.jump
    angles = np.diff(rotation, axis=1)
    require_open(rig, stepper.joints, angles)
    require_warm(rig, stepper.joints.first.section, stepper.material.heat.coldest[None])
    record = simulated_record(
        "multibody",
        rig,
        program,
        angle_deg=np.degrees(rotation[:, -1]),
        joint_angles_rad=angles,
        tension_N=tension[:, :, 0],
        tip_mm=tip,
        jump=jump,
    )
    lengthened = longer if stepper.joints.first.section else None
    strain = peak_strain(stepper.joints, angles, lengthened, thrust_N=thrust_N(tension))
    heats = stepper.material.heat.heating is not None
    worked, friction, material, drag, jumping = energy.T
    warmed = warming if heats else None
    return MultibodySolution(record, tension, strain, worked, friction, material, drag, jump, jumping, warmed)


def load_of(plan: Schedule, sample: int, slack_mm: Floats, time_s: float) -> Load:
    """Load at a sample; ``slack_mm``, shape (2,), includes the creep."""
    slack_a, slack_b = slack_mm.tolist()
    return Load(
        drive=float(plan.drive_mm[sample]),
        slack=(slack_a, slack_b),
        loop_scale=float(plan.loop_scale[sample]),
        friction_scale=float(plan.friction_scale[sample]),
        rest_angle=float(plan.residual_rad[sample]),
        time=float(time_s),
        dead=1.0,
    )


def creep_goal_mm(rig: Rig, tension_N: Floats) -> Floats:
    """How far the tendons creep in the end at tensions at the wheel, shape (2,); 0 for a tendon that is not there."""
    fraction, goal = rig.creep.fraction if rig.creep else 0.0, np.zeros(2)
    for side, tendon in enumerate(rig.tendons):
        goal[side] = fraction * tendon.free_length_mm / tendon.EA_N * (tension_N[side] - rig.preload_N)
    return goal


def simulate_multibody(rig: Rig, program: LoadProgram) -> Record:
    """Engine ``multibody``: the record alone. See :func:`solve_multibody`."""
    return solve_multibody(rig, program).record
