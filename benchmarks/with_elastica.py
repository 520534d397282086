"""The task in PyElastica: a Cosserat rod with as many inner nodes as joints; the tendons are forces written here.

PyElastica integrates explicitly and has no statics: the rod moves with damping until it is at rest. Its masses do not
matter and are as small as the time step allows. Stretch and shear cannot be switched off: their stiffness is a
compromise between error and time step.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import NamedTuple

import elastica as ea
import numpy as np
from numba import njit
from task import Floats, Task

DIFFERENCE = "the rod also stretches and shears; pitch and chords as ours"
CLOSED_FORM = None
LACKS = "tendons (written here, from forces on rings); static solver; joints (a coarse rod in their place); friction"
TIME_STEP = 1e-3
STRETCH = 3e3  # N/mm a pitch, in stretch and in shear
DAMPING = 5.0  # 1/s: near critical for the slowest mode
SETTLE = 3_000  # steps a sample


class _Simulator(ea.BaseSystemCollection, ea.Constraints, ea.Forcing, ea.Damping):
    """The simulator that PyElastica has a user compose."""


class _Tendon(NamedTuple):
    """A tendon: tension at chords of zero length, stiffness, distance from the axis, half the length of a ring."""

    slack_tension: float
    stiffness: float
    arm: float
    half_ring: float


@njit(cache=True)
def _add_tendon(
    centre: Floats, axis: Floats, tendon: _Tendon, wound: float, force: Floats, moment: Floats
) -> None:  # fmt: skip
    """Add the force (2, n) and moment (n,) of a tendon on the rings; ``wound`` is its length on the wheel."""
    n, arm, half = axis.shape[1], tendon.arm, tendon.half_ring
    tangent = np.empty((2, n - 1))
    length = 0.0
    for i in range(n - 1):
        out = centre[:, i] + axis[:, i] * half
        out[0] -= axis[1, i] * arm
        out[1] += axis[0, i] * arm
        into = centre[:, i + 1] - axis[:, i + 1] * half
        into[0] -= axis[1, i + 1] * arm
        into[1] += axis[0, i + 1] * arm
        chord = into - out
        size = np.hypot(chord[0], chord[1])
        tangent[:, i] = chord / size
        length += size
    tension = max(tendon.slack_tension + tendon.stiffness * (wound + length), 0.0)
    for i in range(n - 1):
        for ring, sign in ((i, 1.0), (i + 1, -1.0)):
            x = sign * half * axis[0, ring] - arm * axis[1, ring]
            y = sign * half * axis[1, ring] + arm * axis[0, ring]
            f = sign * tension * tangent[:, i]
            force[:, ring] += f
            moment[ring] += x * f[1] - y * f[0]


class _Tendons(ea.NoForces):
    """Both tendons on one wheel."""

    def __init__(self, task: Task, wheel: Floats) -> None:
        super().__init__()
        self.task, self.wheel = task, wheel
        chords = task.joints * (task.pitch - 2 * task.half_ring)
        shortening = (
            task.joints * 2 * task.preload / STRETCH
        )  # of the rod under the preload, so that the preload is kept
        self.slack_tension = task.preload - task.tendon_stiffness * (chords - shortening)

    def apply_forces(self, system: ea.CosseratRod, time: float = 0.0) -> None:
        """Add the forces of the tendons to the nodes and their moments, in ring frames, to the elements."""
        task = self.task
        centre = 0.5 * (system.position_collection[:2, 1:] + system.position_collection[:2, :-1])
        force, moment = np.zeros(centre.shape), np.zeros(centre.shape[1])
        axis = np.ascontiguousarray(system.director_collection[2, :2])
        for side in (1.0, -1.0):
            tendon = _Tendon(self.slack_tension, task.tendon_stiffness, side * task.arm, task.half_ring)
            _add_tendon(centre, axis, tendon, side * self.wheel[0], force, moment)
        system.external_forces[:2, 1:] += 0.5 * force
        system.external_forces[:2, :-1] += 0.5 * force
        system.external_torques[:] += system.director_collection[:, 2] * moment


def _rod(task: Task) -> ea.CosseratRod:
    n = task.joints + 1  # the first element is the base
    rod = ea.CosseratRod.straight_rod(
        n, np.zeros(3), np.array([1.0, 0.0, 0.0]), np.array([0.0, 1.0, 0.0]), n * task.pitch,
        base_radius=1.0, density=1e-3, youngs_modulus=1.0, shear_modulus=1.0,
    )  # fmt: skip
    inertia = TIME_STEP**2 * (task.bending_stiffness + 0.5 * STRETCH * task.pitch**2)
    rod.mass[:] = 2 * STRETCH * TIME_STEP**2
    for i in range(3):
        rod.bend_matrix[i, i] = task.hinge_stiffness * task.pitch
        rod.shear_matrix[i, i] = STRETCH * task.pitch
        rod.mass_second_moment_of_inertia[i, i] = inertia
        rod.inv_mass_second_moment_of_inertia[i, i] = 1 / inertia
    return rod


def prepare(task: Task, drive_mm: Floats) -> Callable[[], Floats]:
    """Return a function that runs the loop without friction: angles in deg."""

    def loop() -> Floats:
        simulator, rod, wheel = _Simulator(), _rod(task), np.zeros(1)
        simulator.append(rod)
        simulator.constrain(rod).using(ea.OneEndFixedBC, constrained_position_idx=(0,), constrained_director_idx=(0,))
        simulator.add_forcing_to(rod).using(_Tendons, task, wheel)
        simulator.dampen(rod).using(ea.AnalyticalLinearDamper, uniform_damping_constant=DAMPING, time_step=TIME_STEP)
        simulator.finalize()
        stepper, time, angle = ea.PositionVerlet(), 0.0, np.empty(drive_mm.size)
        for k, wheel[0] in enumerate(drive_mm):
            for _ in range(SETTLE):
                time = stepper.step(simulator, time, TIME_STEP)
            angle[k] = np.arctan2(rod.director_collection[2, 1, -1], rod.director_collection[2, 0, -1])
        return np.degrees(angle)

    return loop
