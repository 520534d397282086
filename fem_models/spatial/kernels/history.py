"""The wrist at its last equilibrium: what it carries on from step to step, and what a step loses, compiled."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from fem_models.spatial.kernels.compiled import spatial_njit
from fem_models.spatial.kernels.joint import Work
from fem_models.spatial.parameters import Memory, Parameters
from fem_models.spatial.tables import (
    BRISTLE,
    BY_FORCE,
    DRIVE,
    ELEMENTS,
    FREE,
    GUESS,
    LIMIT,
    LOOP,
    NEXT_DRIVE,
    PRELOAD,
    REST,
    SLIP,
    SLIPS,
    TENDON_ROWS,
    TENSE,
    TOE,
    WOUND,
)
from hysteresis.arrays import Floats

WORK, FRICTION, MATERIAL, JUMP, STORED = range(5)  # places of the energies
ENERGIES = 5


class Motion(NamedTuple):
    """The wrist at its last equilibrium, and what the last step changed per length."""

    x: Floats  # (N + 1, 6 + m)
    trial: Floats  # the next equilibrium, first guessed, then found
    increment: Floats  # of x per length
    state: Floats  # (N, m) of the guides
    limit: Floats  # (N, m) of their friction
    lag: Floats  # (N + 1, 6 + m), viscous forces of a jump
    tendons: Floats  # (TENDON_ROWS, m): drives and where they go to, tensions, fronts of sliding guides
    energy: Floats  # (ENERGIES,)
    counts: Floats  # (3,): steps that were accepted, that failed, iterations


def motion_at_rest(rig: Parameters) -> Motion:
    """Every joint as it is without load."""
    n, m = rig.crossings.shape[:2]
    shape, tendons = (n + 1, SLIPS + m), np.zeros((TENDON_ROWS, m))
    x = np.zeros(shape)
    x[:n, :3] = rig.joints[:, REST : REST + 3]
    tendons[DRIVE] = tendons[NEXT_DRIVE] = rig.tendons[:, PRELOAD] * rig.tendons[:, BY_FORCE]
    tendons[GUESS] = rig.tendons[:, PRELOAD]
    trial, increment, lag = np.zeros(shape), np.zeros(shape), np.zeros(shape)
    state, limit = np.zeros((n, m)), np.zeros((n, m))
    return Motion(x, trial, increment, state, limit, lag, tendons, np.zeros(ENERGIES), np.zeros(3))


@spatial_njit()
def accept(rig: Parameters, memory: Memory, work: Work, motion: Motion) -> None:
    """Move the rest points of what has slipped, and book work and losses of the step, mJ.

    The force of a sliding guide changes from its limit at the last equilibrium to the present one, and the tension at
    the wheel likewise: their means are booked.
    """
    x, tendons, own, (n, m) = motion.x, motion.tendons, rig.joints, motion.state.shape
    lost = material = 0.0
    for j in range(m):
        for k in range(n):
            stiffness, limit = rig.crossings[k, j, BRISTLE], work.guides[k, j, LIMIT]
            force = stiffness * (x[k, SLIPS + j] - memory.guides[k, j])
            if abs(force) > limit:
                slid = math.copysign((abs(force) - limit) / stiffness, force)
                memory.guides[k, j] += slid
                lost += 0.5 * (limit + motion.limit[k, j]) * abs(slid)
            motion.limit[k, j] = limit
        tension, wound = work.tension[j, 0], tendons[NEXT_DRIVE, j]
        if rig.tendons[j, BY_FORCE] == 1.0:
            free, toe, preload = rig.tendons[j, FREE], rig.tendons[j, TOE], rig.tendons[j, PRELOAD]
            wound = x[0, SLIPS + j] + (tension - preload) / free
            if toe > 0.0:
                wound += toe / free * math.log(max(tension, 1e-300) / preload)
        motion.energy[WORK] += 0.5 * (tendons[TENSE, j] + tension) * (wound - tendons[WOUND, j])
        tendons[TENSE, j], tendons[WOUND, j] = tension, wound
    for k in range(n):
        for e in range(2 * ELEMENTS):
            stiffness, limit = own[k, LOOP + e], own[k, SLIP + e]
            moment = stiffness * (x[k, 1 + e // ELEMENTS] - memory.jenkins[k, e])
            if abs(moment) > limit:
                slid = math.copysign((abs(moment) - limit) / stiffness, moment)
                memory.jenkins[k, e] += slid
                material += limit * abs(slid)
    motion.energy[FRICTION] += lost
    motion.energy[MATERIAL] += material


@spatial_njit()
def largest_change(x: Floats, y: Floats) -> tuple[float, float]:
    """Largest rotation of a joint and slide at a guide between two states."""
    rotation = slide = 0.0
    for k in range(x.shape[0]):
        turned = 0.0
        for i in range(3):
            turned += (y[k, i] - x[k, i]) ** 2
        rotation = max(rotation, turned)
        for j in range(SLIPS, x.shape[1]):
            slide = max(slide, abs(y[k, j] - x[k, j]))
    return math.sqrt(rotation), slide
