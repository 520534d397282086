"""The compiled chain in space, quasi-static: rings between flexures of six stiffnesses, tendons with dry friction.

Unknowns are a rotation vector and a displacement of each notch, and the slip of every tendon at every guide. The
displacements are condensed in each Newton step. Without dead loads so are the rotations, and what remains is a block
for the slips at each guide; with them the spins of the rings stand beside the slips
(:mod:`fem_models.spatial.kernels.loaded`). Either way the time of a step is linear in the number of joints.

A planar rig gives what :mod:`fem_models.chain` gives. Equations, sources and limits: docs/theory/three-dimensions.md.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from fem_models.load.stepping import StepControl
from fem_models.rig.checks import SolverError, require
from fem_models.spatial.drives import SpatialProgram
from fem_models.spatial.kernels.follow import Path, Run, follow
from fem_models.spatial.kernels.history import ENERGIES, motion_at_rest
from fem_models.spatial.kernels.joint import work_space
from fem_models.spatial.parameters import Parameters, SpatialSettings, force_scale_N, memory_at_rest, spatial_parameters
from fem_models.spatial.place import bending_deg, tip_and_frame
from fem_models.spatial.rig import SpatialRig
from hysteresis.arrays import Floats, Mask


@dataclass(frozen=True, eq=False)
class SpatialSolution:
    """A run of s samples; N joints, m tendons.

    Parameters
    ----------
    drives
        Shape (s, m), mm or N.
    bending_deg
        Shape (s, 2), bending of the tip towards y and towards z: the shortest rotation that takes the tube's axis into
        that of the last ring, up to 180 degrees in all.
    torsion_deg
        Shape (s,), rotation of the last ring about its axis, besides.
    tip_mm
        Shape (s, 3), middle of the last ring from the middle of the ring before the first notch; x, y, z.
    notches_deg
        Shape (s, N, 3), rotation vectors of the notches in their frames: torsion, strong and weak bending.
    tensions_N
        Shape (s, m, N + 1), from the wheel to the tip.
    work_mJ, friction_mJ, material_mJ, jump_loss_mJ
        Shape (s,), from the start: work of the drives, losses at guides, in the material and in jumps.
    stored_mJ
        Shape (s,), elastic energy above that at rest, without that of weights.
    jump
        Shape (s,), whether the wrist jumped to another equilibrium on the way to a sample.
    steps, failed_steps, iterations
        What the run took.
    """

    drives: Floats
    bending_deg: Floats
    torsion_deg: Floats
    tip_mm: Floats
    notches_deg: Floats
    tensions_N: Floats
    work_mJ: Floats
    friction_mJ: Floats
    material_mJ: Floats
    stored_mJ: Floats
    jump_loss_mJ: Floats
    jump: Mask
    steps: int
    failed_steps: int
    iterations: int


def solve_spatial(
    rig: SpatialRig, program: SpatialProgram | Floats, settings: SpatialSettings | None = None
) -> SpatialSolution:
    """Run a program quasi-statically, from the rig at rest. An array (steps, tendons) is displacements in mm.

    Weights come on on the way to the first sample.

    Raises
    ------
    RigError
        A program of another number of tendons, or a closed notch without contact.
    SolverError
        A step that does not converge even after ``max_halvings`` halvings.
    """
    program = program if isinstance(program, SpatialProgram) else SpatialProgram(program)
    settings = settings or SpatialSettings()
    given = program.drives.shape[1]
    require(given == len(rig.tendons), "drives", f"{given} columns", f"one for each of {len(rig.tendons)} tendons")
    parameters = spatial_parameters(rig, program.by_force, settings)
    run, counts = followed(rig, program, parameters, settings)
    require_open(rig, run.joints[:, :, 2])
    tip, frame = tip_and_frame(rig, parameters, run.joints)
    bending, torsion = bending_deg(frame)
    work, friction, material, lost, stored = run.energies.T
    return SpatialSolution(
        drives=program.drives,
        bending_deg=bending,
        torsion_deg=torsion,
        tip_mm=tip,
        notches_deg=np.degrees(run.joints[:, :, :3]),
        tensions_N=run.tensions,
        work_mJ=work,
        friction_mJ=friction,
        material_mJ=material,
        stored_mJ=stored,
        jump_loss_mJ=lost,
        jump=run.jumps,
        steps=int(counts[0]),
        failed_steps=int(counts[1]),
        iterations=int(counts[2]),
    )


def followed(
    rig: SpatialRig, program: SpatialProgram, parameters: Parameters, settings: SpatialSettings
) -> tuple[Run, Floats]:
    """Follow a program with the kernels; returns counts of steps, failed steps and iterations, too.

    Raises
    ------
    SolverError
        As :func:`solve_spatial`.
    """
    path, samples = path_of(rig, program, parameters, settings), len(program.drives)
    run, motion, work = empty_run(parameters, samples), motion_at_rest(parameters), work_space(parameters)
    failed, reached = follow(path, parameters, memory_at_rest(parameters), run, motion, work)
    if failed >= 0:
        before = program.drives[max(failed - 1, 0)] if failed else np.zeros(len(rig.tendons))
        ends = " and ".join(
            "(" + ", ".join(f"{x:.6g}" for x in drives) + ")" for drives in (before, program.drives[failed])
        )
        raise SolverError(
            f"rig {rig.name}, sample {failed} of {samples}: no equilibrium between drives {ends}, "
            f"{100 * reached:.3g} % of the way"
        )
    return run, motion.counts


def empty_run(parameters: Parameters, samples: int) -> Run:
    """Arrays for the results of a run."""
    n, m = parameters.crossings.shape[:2]
    tables = np.empty((samples, n, 6)), np.empty((samples, m, n + 1)), np.empty((samples, ENERGIES))
    return Run(*tables, np.zeros(samples, dtype=bool))


def path_of(rig: SpatialRig, program: SpatialProgram, parameters: Parameters, settings: SpatialSettings) -> Path:
    """Give the samples of a program, and how to follow them."""
    control, longest = step_control(rig, program.by_force, 1 / parameters.by_arm, settings)
    return Path(np.array(program.drives, order="C"), longest, control, settings.newton_iterations)


def step_control(
    rig: SpatialRig, by_force: tuple[bool, ...], lever_mm: float, settings: SpatialSettings
) -> tuple[StepControl, Floats]:
    """Bound the steps as :mod:`fem_models.load.stepping`, lengths over the longest step of a drive, (tendons,).

    ``lever_mm`` is that of the tendons about the joints.
    """
    forces = np.array(by_force)
    longest = np.where(forces, settings.max_force_step * force_scale_N(rig), settings.max_step_mm)
    arm = min(one.tendon.moment_arm_mm for one in rig.tendons)
    rotation, least, slide, least_slide = 5 / arm * settings.max_step_mm, 2e-3, 5.0 * settings.max_step_mm, 0.02
    if forces.any():  # joints and tendons a hundred times softer than elastic
        length = sum(joint.pitch_mm for joint in rig.joints)
        weak = min(joint.stiffness.weak for joint in rig.joints)
        step, stretch = float(longest[forces].max()), 100 * length / min(one.tendon.EA_N for one in rig.tendons)
        rotation, least, least_slide = max(rotation, 100 * step * lever_mm / weak), 0.05, 0.1
        slide = max(slide, len(rig.joints) * rotation * lever_mm + step * stretch)
    return StepControl(1.0, settings.max_halvings, rotation, least, slide, least_slide), longest.astype(float)


def require_open(rig: SpatialRig, weak_rad: Floats) -> None:
    """Refuse weak bending, shape (s, N), past the closure of a notch, on a rig without contact of the edges.

    Raises
    ------
    SolverError
        With joint, sample and angles.
    """
    if rig.contact_Nmm_per_rad > 0:
        return
    for k, joint in enumerate(rig.joints):
        angle, limit = weak_rad[:, k], joint.mechanics.closure_angle_rad
        past = np.flatnonzero((angle if joint.mechanics.one_sided else np.abs(angle)) > limit)
        if past.size:
            raise SolverError(
                f"rig {rig.name}, sample {past[0]} of {len(angle)}: joint {k + 1} at "
                f"{np.degrees(angle[past[0]]):.1f} deg, but its notch closes at {np.degrees(limit):.1f} deg: "
                "expected a smaller drive, or a rig with [closure]"
            )
