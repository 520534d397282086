"""The wrist in space as an Exudyn multibody system, quasi-static: the second engine beside the chain in space.

It takes the same rig and program as :func:`fem_models.spatial.solve_spatial` and gives the same solution. Rings are
rigid bodies of Exudyn with Euler parameters, in absolute coordinates. Tendons are Exudyn's connectors between points of
neighbouring rings. What it shares with the chain are the constants of the rig and the laws of friction and material:
docs/theory/three-dimensions.md compares both.
"""

from __future__ import annotations

import numpy as np
from threadpoolctl import threadpool_limits

from fem_models.multibody.spatial.flexures import rotate
from fem_models.multibody.spatial.stepper import Stepper
from fem_models.rig.checks import SolverError, require
from fem_models.spatial import SpatialProgram, SpatialRig, SpatialSettings, SpatialSolution
from fem_models.spatial.place import bending_deg
from fem_models.spatial.solve import require_open
from hysteresis.arrays import Floats

MULTIBODY_SETTINGS = SpatialSettings(max_halvings=6, newton_iterations=20, tolerance=1e-7)
"""Numerical settings of this engine."""


def solve_spatial_multibody(
    rig: SpatialRig, program: SpatialProgram | Floats, settings: SpatialSettings | None = None
) -> SpatialSolution:
    """Run a program quasi-statically, from the rig at rest. An array (steps, tendons) is displacements in mm.

    Weights come on on the way to the first sample. ``iterations`` of the solution counts those of Newton's method.

    Raises
    ------
    RigError
        A program of another number of tendons.
    SolverError
        A step that does not converge even after ``max_halvings`` halvings, or a closed notch without contact.
    """
    program = program if isinstance(program, SpatialProgram) else SpatialProgram(program)
    with threadpool_limits(1, user_api="blas"):  # matrices are small: its threads would wait for each other
        return _run(rig, program, settings or MULTIBODY_SETTINGS)


def _run(rig: SpatialRig, program: SpatialProgram, settings: SpatialSettings) -> SpatialSolution:
    given, samples = program.drives.shape[1], len(program.drives)
    require(given == len(rig.tendons), "drives", f"{given} columns", f"one for each of {len(rig.tendons)} tendons")
    stepper = Stepper(rig, program, settings)
    n, m = len(rig.joints), given
    rotation, tension, energy = np.empty((samples, n, 3)), np.empty((samples, m, n + 1)), np.empty((samples, 5))
    last, jump = np.empty((samples, 7)), np.zeros(samples, dtype=bool)
    for s, drives in enumerate(program.drives):
        reached = stepper.move(drives, first=s == 0)
        if reached < 1.0:
            ends = " and ".join(
                "(" + ", ".join(f"{x:.6g}" for x in at) + ")" for at in (program.drives[max(s - 1, 0)], drives)
            )
            raise SolverError(
                f"rig {rig.name}, sample {s} of {samples}: no equilibrium between drives {ends}, "
                f"{100 * reached:.3g} % of the way"
            )
        jump[s] = stepper.jumped
        rotation[s] = stepper.strains(stepper.now.q).rotation
        tension[s] = np.maximum(stepper.now.forces.tension, 0.0)
        last[s] = stepper.solver.rings(stepper.now.q)[-1]
        booked = stepper.energies
        energy[s] = booked.work, booked.friction, booked.material, stepper.stored_mJ(), booked.jump
    require_open(rig, rotation[..., 2])
    frame = np.stack([rotate(last[:, 3:], np.eye(3)[i]) for i in range(3)], axis=2)
    bending, torsion = bending_deg(frame)
    place = stepper.model.layout
    return SpatialSolution(
        drives=program.drives,
        bending_deg=bending,
        torsion_deg=torsion,
        tip_mm=last[:, :3] + frame @ (place.tip - place.far[-1]),
        notches_deg=np.degrees(rotation),
        tensions_N=tension,
        work_mJ=energy[:, 0],
        friction_mJ=energy[:, 1],
        material_mJ=energy[:, 2],
        stored_mJ=energy[:, 3],
        jump_loss_mJ=energy[:, 4],
        jump=jump,
        steps=stepper.counts.steps,
        failed_steps=stepper.counts.failed,
        iterations=stepper.counts.iterations,
    )
