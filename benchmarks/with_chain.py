"""The task in this package's compiled chain."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np
from task import HOLD_STEPS, Floats, Task

from fem_models.chain.solve import ChainSettings, solve_chain
from fem_models.load import LoadProgram
from fem_models.rig.rig import Friction

DIFFERENCE = "flexures also shorten under thrust, and bend over their length"
CLOSED_FORM = None
LACKS = "motion out of the plane; inertia; flexible rings"
FRICTION_VARIANTS = ("sheath_N",)
WHEEL_SIDE = 100.0  # factor of the stiffness in the tube: the tendon stretches ahead of the friction, as in MuJoCo


def prepare(task: Task, drive_mm: Floats) -> Callable[[], Floats]:
    """Return a function that runs the loop without friction: angles in deg."""
    return lambda: solve_chain(task.rig, LoadProgram(drive_mm)).record.angle_deg


def friction_loop(task: Task, drive_mm: Floats, friction_N: float, variant: str) -> tuple[Floats, float]:
    """Loop with constant friction at the base, and the drift in deg over further samples at constant drive."""
    tendon = replace(task.rig.tendon_a, EA_N=WHEEL_SIDE * task.rig.tendon_a.EA_N)
    tendon = replace(tendon, free_length_mm=tendon.EA_N / task.tendon_stiffness)
    rig = replace(task.rig, tendon_a=tendon, tendon_b=tendon, friction=Friction(sheath_N=friction_N))
    settings = ChainSettings(bristle_ratio=ChainSettings.bristle_ratio / WHEEL_SIDE)  # the same spring as without
    held = LoadProgram(np.append(drive_mm, np.full(HOLD_STEPS, drive_mm[-1])))
    angle = solve_chain(rig, held, settings).record.angle_deg
    return angle[: drive_mm.size], float(angle[-1] - angle[drive_mm.size - 1])
