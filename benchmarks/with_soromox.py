"""The task in soromox: an articulated robot with a tendon on each side; elastic tendons and Newton written here."""

from __future__ import annotations

from collections.abc import Callable

import jax
import jax.numpy as jnp
import numpy as np
from soromox import ArticulatedSoftRobot, ArticulatedSoftRobotParams, ArticulatedTendonActuator
from task import Floats, Task

DIFFERENCE = "the moment arm of an articulated tendon is constant: path r theta in place of chords"
CLOSED_FORM = "constant arm"
LACKS = "static solver (Newton written here); friction of tendons; tendons that depend on each other in one element"
NEWTON = 2  # steps from the last pose: the residual is 1e-12 N mm

jax.config.update("jax_enable_x64", True)


def _robot(task: Task) -> ArticulatedSoftRobot:
    n = task.joints
    tip = jnp.tile(jnp.array([task.pitch, 0.0, 0.0]), (n, 1))
    params = ArticulatedSoftRobotParams(
        joint_screw=jnp.tile(jnp.array([0.0, 0.0, 1.0, 0.0, 0.0, 0.0]), (n, 1)),
        parent_to_joint_transform=jnp.broadcast_to(jnp.eye(4), (n, 4, 4)),
        tip_position=tip,
        center_of_mass_position=tip / 2,
        mass=jnp.ones(n),
        center_of_mass_inertia=jnp.broadcast_to(jnp.eye(3), (n, 3, 3)),
        gravity=jnp.zeros(3),
        joint_stiffness=task.hinge_stiffness * jnp.eye(n),
        joint_damping=jnp.eye(n),
        joint_rest_configuration=jnp.zeros(n),
        radius=jnp.ones(n),
    )
    # two elements, because one element refuses tendons whose rows are linearly dependent, as a pair's are
    sides = [ArticulatedTendonActuator.from_routing(jnp.full((1, n), y)) for y in (task.arm, -task.arm)]
    return ArticulatedSoftRobot(params, actuators=tuple(sides))


def prepare(task: Task, drive_mm: Floats) -> Callable[[], Floats]:
    """Return a function that runs the loop without friction: angles in deg."""
    robot = _robot(task)

    def unbalance(q: jax.Array, wheel: jax.Array) -> jax.Array:
        tension = jnp.maximum(task.preload + task.tendon_stiffness * (wheel - robot.actuator_coordinates(q)), 0.0)
        return robot.elastic_force(q) - robot.actuation_force(q, tension)

    def pose(q: jax.Array, x: jax.Array) -> tuple[jax.Array, jax.Array]:
        wheel = jnp.array([x, -x])
        for _ in range(NEWTON):
            q -= jnp.linalg.solve(jax.jacfwd(unbalance)(q, wheel), unbalance(q, wheel))
        return q, jnp.degrees(q.sum())

    loop = jax.jit(lambda drive: jax.lax.scan(pose, jnp.zeros(task.joints), drive)[1])
    return lambda: np.asarray(loop(jnp.asarray(drive_mm)))
