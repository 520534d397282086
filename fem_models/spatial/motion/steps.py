"""A wrist in space step by step: an equilibrium that can be left on trial, and taken up."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from fem_models.rig.checks import SolverError
from fem_models.spatial.drives import SpatialProgram
from fem_models.spatial.kernels.follow import Run, follow, go_on
from fem_models.spatial.kernels.history import Motion, motion_at_rest
from fem_models.spatial.kernels.joint import work_space
from fem_models.spatial.parameters import Memory, Parameters, SpatialSettings, memory_at_rest, spatial_parameters
from fem_models.spatial.place import bending_deg, tip_and_frame
from fem_models.spatial.rig import SpatialRig
from fem_models.spatial.solve import empty_run, path_of
from hysteresis.arrays import Floats


@dataclass(frozen=True, eq=False)
class Equilibrium:
    """A wrist at rest somewhere, with all that it remembers. Steps from it leave it as it is.

    Parameters
    ----------
    drives
        Shape (m,), mm: what is wound in of each tendon.
    bending_deg
        Shape (2,), towards y and z.
    tip_mm
        Shape (3,).
    tensions_N
        Shape (m,), at the wheels.
    """

    rig: SpatialRig
    parameters: Parameters
    drives: Floats
    bending_deg: Floats
    tip_mm: Floats
    tensions_N: Floats
    motion: Motion
    memory: Memory


def at_rest(rig: SpatialRig) -> Equilibrium:
    """Give the equilibrium of a rig before its tendons are moved, under its dead loads.

    Raises
    ------
    SolverError
        Loads for which none was found.
    """
    tendons = len(rig.tendons)
    parameters, settings = spatial_parameters(rig, (False,) * tendons, SpatialSettings()), SpatialSettings()
    path = path_of(rig, SpatialProgram(np.zeros((1, tendons))), parameters, settings)
    run, motion, memory = empty_run(parameters, 1), motion_at_rest(parameters), memory_at_rest(parameters)
    failed, _ = follow(path, parameters, memory, run, motion, work_space(parameters))
    if failed >= 0:
        raise SolverError(f"rig {rig.name}: no equilibrium at rest")
    return _taken(rig, parameters, path.drives[-1], run, motion, memory)


def moved_to(start: Equilibrium, drives: Floats, tip_N: Floats | None = None) -> Equilibrium:
    """Go from an equilibrium to other drives, shape (m,), mm, straight; ``tip_N`` replaces the force at the tip.

    Raises
    ------
    SolverError
        A step without equilibrium.
    """
    parameters = start.parameters
    if tip_N is not None:
        x, y, z = (float(part) for part in tip_N)
        parameters = parameters._replace(tip=(x, y, z), loaded=True)
    program = SpatialProgram(np.array([start.drives, drives]))
    path, run = path_of(start.rig, program, parameters, SpatialSettings()), empty_run(parameters, 2)
    motion, memory = _copied(start.motion), Memory(*(part.copy() for part in start.memory))
    reached = go_on(path, parameters, memory, run, motion, work_space(parameters))
    if reached < 1.0:
        ends = ", ".join(f"{drive:.6g}" for drive in drives)
        raise SolverError(f"rig {start.rig.name}: no equilibrium on the way to drives ({ends})")
    return _taken(start.rig, parameters, path.drives[-1], run, motion, memory)


def _copied(motion: Motion) -> Motion:
    return Motion(*(part.copy() for part in motion))


def _taken(
    rig: SpatialRig, parameters: Parameters, drives: Floats, run: Run, motion: Motion, memory: Memory
) -> Equilibrium:
    tip, frame = tip_and_frame(rig, parameters, run.joints[-1:])
    bending, _ = bending_deg(frame)
    return Equilibrium(rig, parameters, drives, bending[0], tip[0], run.tensions[-1, :, 0].copy(), motion, memory)
