"""The task in MuJoCo: hinges with springs, spatial tendons over sites, position actuators that only pull.

MuJoCo has no static solver: it runs its dynamics until the model is at rest. Inertia and damping do not matter, so both
are set on the joints, as armature and damping, such that an equal rotation of all joints is critically damped.
"""

from __future__ import annotations

import math
from collections.abc import Callable

import mujoco
import numpy as np
from task import HOLD_STEPS, Floats, Task

DIFFERENCE = "none: same hinges, same chords"
CLOSED_FORM = "chords"
LACKS = (
    "static solver; capstan friction (one yield force a tendon); tendons with a toe region; stiffness from the notch"
)
TIME_STEP = 1e-3
SETTLE = 10  # steps a sample without friction, with a time scale of one step
FRICTION_SETTLE = 200  # with friction and a time scale of ten steps: the friction constraint needs several

FRICTION_VARIANTS = {  # steps a sample, noslip_iterations, attributes of the tendon
    "frictionloss, default solver": (FRICTION_SETTLE, 0, ""),
    "frictionloss, default solver, four times slower": (4 * FRICTION_SETTLE, 0, ""),
    "frictionloss, noslip_iterations=5": (FRICTION_SETTLE, 5, ""),
    "frictionloss, noslip_iterations=5, solreffriction=0.002": (FRICTION_SETTLE, 5, 'solreffriction="0.002 1"'),
}


def _model(task: Task, time_scale: float, friction: str = "", noslip: int = 0) -> mujoco.MjModel:
    """Model whose bending has the given time scale, in steps."""
    armature = task.bending_stiffness * (time_scale * TIME_STEP) ** 2
    damping = 2 * math.sqrt(armature * task.bending_stiffness)
    p, h, n = task.pitch, task.half_ring, task.joints
    hinge, stiffness = task.hinge_stiffness, task.tendon_stiffness
    sides = {"a": task.arm, "b": -task.arm}
    rings = "".join(
        f'<body pos="{p if i else p / 2} 0 0"><inertial pos="0 0 0" mass="1e-8" diaginertia="1e-8 1e-8 1e-8"/>'
        f'<joint type="hinge" axis="0 0 1" stiffness="{hinge}" damping="{damping}" armature="{armature}"/>'
        + "".join(
            f'<site name="{s}{i}in" pos="{p / 2 - h} {y} 0"/><site name="{s}{i}out" pos="{p / 2 + h} {y} 0"/>'
            for s, y in sides.items()
        )
        for i in range(n)
    )
    base = "".join(f'<site name="{s}" pos="{h} {y} 0"/>' for s, y in sides.items())
    tendons = "".join(
        f'<spatial name="{s}" {friction}><site site="{s}"/>'
        + "".join(f'<site site="{s}{i}in"/><site site="{s}{i}out"/>' for i in range(n))
        + "</spatial>"
        for s in sides
    )
    actuators = "".join(
        f'<general tendon="{s}" biastype="affine" gainprm="{stiffness}" biasprm="0 {-stiffness} 0" '
        'forcelimited="true" forcerange="-1e6 0"/>'
        for s in sides
    )
    return mujoco.MjModel.from_xml_string(
        f'<mujoco><option timestep="{TIME_STEP}" gravity="0 0 0" integrator="implicitfast" '
        f'noslip_iterations="{noslip}"><flag contact="disable"/></option>'
        f"<worldbody>{base}{rings}{'</body>' * n}</worldbody>"
        f"<tendon>{tendons}</tendon><actuator>{actuators}</actuator></mujoco>"
    )


def _follow(task: Task, model: mujoco.MjModel, data: mujoco.MjData, drive_mm: Floats, steps: int) -> Floats:
    mujoco.mj_resetData(model, data)
    mujoco.mj_forward(model, data)
    free = data.ten_length - task.preload / task.tendon_stiffness
    angle = np.empty(drive_mm.size)
    for k, x in enumerate(drive_mm):
        data.ctrl[:] = free + np.array([-x, x])
        mujoco.mj_step(model, data, steps)
        angle[k] = data.qpos.sum()
    return np.degrees(angle)


def prepare(task: Task, drive_mm: Floats) -> Callable[[], Floats]:
    """Return a function that runs the loop without friction: angles in deg."""
    model = _model(task, 1.0)
    data = mujoco.MjData(model)
    return lambda: _follow(task, model, data, drive_mm, SETTLE)


def friction_loop(task: Task, drive_mm: Floats, friction_N: float, variant: str) -> tuple[Floats, float]:
    """Loop with ``frictionloss`` on the tendons, and the drift in deg over further steps at constant drive."""
    steps, noslip, constraint = FRICTION_VARIANTS[variant]
    model = _model(task, 10.0, f'frictionloss="{friction_N}" {constraint}', noslip)
    data = mujoco.MjData(model)
    angle = _follow(task, model, data, drive_mm, steps)
    mujoco.mj_step(model, data, HOLD_STEPS)
    return angle, math.degrees(data.qpos.sum()) - float(angle[-1])
