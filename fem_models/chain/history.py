"""The chain at its last equilibrium: what it carries on from step to step, and what a step loses, compiled."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from fem_models.chain.compiled import chain_njit
from fem_models.chain.each import joint_at, loop_part
from fem_models.chain.equations import Work
from fem_models.chain.fibres import transform
from fem_models.chain.laws import flag_element, flag_moment
from fem_models.chain.parameters import Memory, Parameters
from fem_models.chain.section import BENT, LONGER, ROW
from fem_models.load.stepping import Load
from hysteresis.arrays import Floats

FRICTION, MATERIAL, DRAG, JUMP, WHEEL = range(5)  # places of the energies while they are summed


class Motion(NamedTuple):
    """The chain at its last equilibrium, and what the last step changed per length."""

    x: Floats  # (3 N + 3,)
    trial: Floats  # (3 N + 3,): the next equilibrium, first guessed, then found
    increment: Floats  # (3 N + 3,) of x per length
    state: Floats  # (2, N) of the guides
    limit: Floats  # (2, N) of their friction
    front: Floats  # (2,)
    front_speed: Floats  # (2,)
    drag: Floats  # (3 N + 3,), forces of the dashpots
    lag: Floats  # (3 N + 3,), viscous forces of a jump
    sections: Floats  # (N, ROW), those of the work
    crept: Floats  # (2,)
    energy: Floats  # (5,), by what took it


@chain_njit(allocates=True)
def motion_at_rest(rig: Parameters, joints: int) -> Motion:
    """Every joint at the angle it has without load."""
    size = 3 * (joints + 1)
    x = np.zeros(size)
    for i in range(joints):
        x[3 * i + 3] = rig.rest
    return Motion(
        x=x,
        trial=np.zeros(size),
        increment=np.zeros(size),
        state=np.zeros((2, joints)),
        limit=np.zeros((2, joints)),
        front=np.zeros(2),
        front_speed=np.zeros(2),
        drag=np.zeros(size),
        lag=np.zeros(size),
        sections=np.zeros((joints, ROW)),
        crept=np.zeros(2),
        energy=np.zeros(5),
    )


@chain_njit()
def drag_loss(i: int, viscous: float, x: Floats, work: Work, drag: Floats) -> float:
    """Note the force of a dashpot over a step, and return its loss, mJ."""
    moved, last = x[i] - work.x_before[i], drag[i]
    drag[i] = viscous * moved
    return 0.5 * (last + drag[i]) * moved


@chain_njit()
def accept(rig: Parameters, memory: Memory, work: Work, motion: Motion, load: Load, rate: float) -> None:
    """Take up a step: what has slipped, and the losses in guides, material and by drag, mJ; ``rate`` is 1/s of it."""
    move_on(rig, memory, work, motion, load, rate)
    book_drag(rig, work, motion, rate)


@chain_njit()
def book_drag(rig: Parameters, work: Work, motion: Motion, rate: float) -> None:
    """Note the forces of the dashpots since ``Work.x_before``, and book their losses."""
    x, drag, viscous = motion.x, motion.drag, 0.0
    for side in range(2):
        viscous += drag_loss(1 + side, rate * rig.drag_sheath, x, work, drag)
    for i in range(3, x.size, 3):
        viscous += drag_loss(i, rate * rig.drag_joint, x, work, drag)
    motion.energy[DRAG] += viscous


@chain_njit()
def move_on(rig: Parameters, memory: Memory, work: Work, motion: Motion, load: Load, rate: float) -> None:
    """Move the rest points of what has slipped, and book the losses in guides and material, mJ.

    The force of a sliding guide changes from its limit at the last equilibrium to the present one; the mean is booked.
    A flag gives back less on unloading than it takes at its plateau. ``rate`` is 1/s, for heat.
    """
    x, n = motion.x, memory.guides.shape[1]
    lost = material = 0.0
    for side in range(2):
        stiffness = rig.bristle[side]
        for i in range(n):
            force, limit = stiffness * (x[3 * i + 1 + side] - memory.guides[side, i]), work.limit[side, i]
            if abs(force) > limit:
                slid = math.copysign((abs(force) - limit) / stiffness, force)
                memory.guides[side, i] += slid
                lost += 0.5 * (limit + motion.limit[side, i]) * abs(slid)
            motion.limit[side, i] = limit
    for i in range(n):
        theta = x[3 * i + 3]
        for j in range(memory.slip_moment.size):
            stiffness = loop_part(rig, i) * memory.jenkins_stiffness[j]
            limit = loop_part(rig, i) * (load.loop_scale * memory.slip_moment[j])
            moment = stiffness * (theta - memory.jenkins[j, i])
            if abs(moment) > limit:
                slid = math.copysign((abs(moment) - limit) / stiffness, moment)
                memory.jenkins[j, i] += slid
                material += limit * abs(slid)
        for j in range(memory.flag_stiffness.size):
            bent, flag = theta - load.rest_angle, flag_element(j, memory)
            moment, _ = flag_moment(bent, memory.flags[j, i], flag)
            rest = bent - moment / flag.stiffness
            material += moment * (rest - memory.flags[j, i])
            memory.flags[j, i] = rest
        if memory.fibre_area.size > 0:
            material += transform(i, work.sections[i, BENT], work.sections[i, LONGER], joint_at(rig, i), memory, rate)
    motion.energy[FRICTION] += lost
    motion.energy[MATERIAL] += material


@chain_njit()
def largest_change(x: Floats, y: Floats) -> tuple[float, float]:
    """Largest rotation of a joint and slide at a guide between two states."""
    rotation = slide = 0.0
    for i in range(0, x.size, 3):
        rotation = max(rotation, abs(y[i] - x[i]))
        slide = max(slide, abs(y[i + 1] - x[i + 1]), abs(y[i + 2] - x[i + 2]))
    return rotation, slide
