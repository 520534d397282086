"""The path of a wrist in space from sample to sample, compiled: steps, history of the dry elements, energies.

The steps are those of the planar chain (:mod:`fem_models.load.stepping`), in units of the longest step of each drive.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from fem_models.load.stepping import (
    FINE,
    LEAST_LENGTH,
    StepControl,
    front_speed,
    jumped,
    next_part,
    reach_after_success,
    too_short,
)
from fem_models.spatial.kernels.compiled import spatial_njit
from fem_models.spatial.kernels.history import (
    ENERGIES,
    JUMP,
    STORED,
    Motion,
    accept,
    largest_change,
)
from fem_models.spatial.kernels.joint import Work
from fem_models.spatial.kernels.jump import copy, relax
from fem_models.spatial.kernels.newton import Attempt, newton
from fem_models.spatial.kernels.stored import stored_energy
from fem_models.spatial.parameters import Memory, Parameters
from fem_models.spatial.tables import (
    BY_FORCE,
    DRIVE,
    FRONT,
    GUESS,
    HEADING,
    LIMIT,
    NEXT_DRIVE,
    NEXT_HEADING,
    SLIPS,
    SPEED,
    TENSE,
    WOUND,
)
from hysteresis.arrays import Floats, Mask

SHORT, PATIENCE = 0.1, 4
"""Of the longest step: a shorter one has so many times the iterations, because halving it has not helped."""
JUMP_LENGTH = 2.0**-6  # of the longest step: how far beyond the last equilibrium a jump is sought


class Path(NamedTuple):
    """Samples, and how to follow them."""

    drives: Floats  # (s, m)
    longest: Floats  # (m,): longest step of each drive, mm or N
    control: StepControl
    iterations: int  # of Newton's method


class Run(NamedTuple):
    """Results at the samples."""

    joints: Floats  # (s, N, 6): rotation vectors, then displacements, in the frames of the notches
    tensions: Floats  # (s, m, N + 1)
    energies: Floats  # (s, ENERGIES)
    jumps: Mask  # (s,): whether the wrist jumped on the way to a sample


@spatial_njit()
def guess(motion: Motion, state: Floats, length: float) -> None:
    """Fill the first guess of a step: the last one carried on, with the guides' states and their fronts.

    A tendon whose drive turns back, or whose last step failed, sticks at all its guides until the forces say otherwise.
    Where that is so of all drives, nothing is carried on.
    """
    (n, m), tendons, carried = state.shape, motion.tendons, False
    for j in range(m):
        same = tendons[NEXT_HEADING, j] == tendons[HEADING, j]
        carried = carried or same
        for k in range(n):
            state[k, j] = motion.state[k, j] if same else 0.0
        if same:
            start = int(tendons[FRONT, j])
            for k in range(start, min(start + int(length * tendons[SPEED, j]), n)):
                state[k, j] = state[0, j]
    for i in range(SLIPS + m):
        on = carried and (i < SLIPS or tendons[NEXT_HEADING, i - SLIPS] == tendons[HEADING, i - SLIPS])
        for k in range(n + 1):
            motion.trial[k, i] = motion.x[k, i] + (length * motion.increment[k, i] if on else 0.0)


@spatial_njit()
def learn(motion: Motion, work: Work, length: float) -> None:
    """Take up the equilibrium that was found, and what the step changed per length."""
    state, tendons, by_length = work.state, motion.tendons, 1.0 / max(length, LEAST_LENGTH)
    n, m = state.shape
    for j in range(m):
        reached = n
        for k in range(n - 1, -1, -1):
            if state[k, j] != state[0, j]:
                reached = k
            motion.state[k, j] = state[k, j]
        heading = tendons[NEXT_HEADING, j]
        tendons[SPEED, j] = front_speed(tendons[FRONT, j], reached, heading, tendons[HEADING, j], length)
        tendons[FRONT, j], tendons[HEADING, j], tendons[GUESS, j] = reached, heading, work.tension[j, 0]
    for k in range(n + 1):
        for i in range(SLIPS + m):
            motion.increment[k, i] = (motion.trial[k, i] - motion.x[k, i]) * by_length
            motion.x[k, i] = motion.trial[k, i]


@spatial_njit()
def forget(motion: Motion) -> None:
    """Carry nothing on from the last step."""
    tendons = motion.tendons
    for j in range(tendons.shape[1]):
        tendons[FRONT, j] = tendons[SPEED, j] = 0.0
        tendons[HEADING, j] = math.nan
    for k in range(motion.increment.shape[0]):
        for i in range(motion.increment.shape[1]):
            motion.increment[k, i] = 0.0


@spatial_njit()
def note(s: int, rig: Parameters, memory: Memory, work: Work, motion: Motion, run: Run) -> None:
    """Write the results of sample s."""
    n, m = motion.state.shape
    for k in range(n):
        for i in range(SLIPS):
            run.joints[s, k, i] = motion.x[k, i]
    for j in range(m):
        for k in range(n + 1):
            run.tensions[s, j, k] = work.tension[j, k]
    motion.energy[STORED] = stored_energy(motion.x, work.tension, rig, memory)
    for i in range(ENERGIES):
        run.energies[s, i] = motion.energy[i]


@spatial_njit()
def path_length(s: int, path: Path, tendons: Floats) -> float:
    """Length of the way to sample s in longest steps; notes the direction of every drive."""
    length = 0.0
    for j in range(path.longest.size):
        change = path.drives[s, j] - tendons[DRIVE, j]
        tendons[NEXT_HEADING, j] = np.sign(change)
        length = max(length, abs(change) / path.longest[j])
    return length


@spatial_njit()
def set_drives(s: int, part: float, path: Path, tendons: Floats) -> None:
    """Let the drives go to a part of the way to sample s."""
    for j in range(path.longest.size):
        start, end = tendons[DRIVE, j], path.drives[s, j]
        tendons[NEXT_DRIVE, j] = end if part == 1.0 else start + part * (end - start)


@spatial_njit()
def leap(
    dead: float, size: float, path: Path, rig: Parameters, memory: Memory, motion: Motion, work: Work
) -> tuple[bool, bool]:
    """Relax to the next equilibrium in a step of a size; returns whether there is one, and whether the wrist jumped.

    It did where it moved by more than a step of that size explains. Where it did not, the last equilibrium was only
    hard to leave.
    """
    before, lost = motion.increment, motion.energy[JUMP]
    copy(motion.x, before)
    if not relax(rig, memory, work, motion, dead, PATIENCE * path.iterations, path.control):
        return False, False
    rotation, slide = largest_change(before, motion.x)
    has_jumped = jumped(rotation, slide, size, path.control)
    if not has_jumped:
        motion.energy[JUMP] = lost
    forget(motion)
    return True, has_jumped


@spatial_njit()
def walk(
    s: int, path: Path, rig: Parameters, memory: Memory, run: Run, motion: Motion, work: Work, reach: float
) -> tuple[float, float]:
    """Go to sample s in steps that are halved where they fail; where that does not help, the wrist relaxes.

    Returns the part of the way that was reached and the length of the next step, ``reach`` being that of the first.
    """
    control, tendons = path.control, motion.tendons
    length, done = path_length(s, path, tendons), 0.0
    if length == 0.0 or s == 0:  # weights come on on the way to the first sample
        length = max(length, control.max_step)
    while done < 1.0:
        part = next_part(done, reach, length, control.max_step)
        set_drives(s, part, path, tendons)
        size = (part - done) * length
        fine = size <= FINE * control.max_step
        guess(motion, work.state, size)
        patience = 1 if size > SHORT * control.max_step else PATIENCE
        attempt = Attempt(part if s == 0 else 1.0, patience * path.iterations, fine, 0.0)
        iterations = newton(motion.trial, tendons, rig, memory, work, motion.state, attempt)
        rotation, slide = largest_change(motion.x, motion.trial)
        motion.counts[2] += abs(iterations)
        if iterations < 0 or jumped(rotation, slide, size, control):
            reach = 0.5 * size
            motion.counts[1] += 1.0
            if fine:
                tendons[HEADING] = math.nan
            if too_short(reach, control):
                reach = max(reach, JUMP_LENGTH * control.max_step)
                part = next_part(done, reach, length, control.max_step)
                set_drives(s, part, path, tendons)
                dead, size = part if s == 0 else 1.0, (part - done) * length
                found, has_jumped = leap(dead, size, path, rig, memory, motion, work)
                if not found:
                    return done, reach
                run.jumps[s] = run.jumps[s] or has_jumped
                motion.counts[0] += 1.0
                done = part
            continue
        motion.counts[0] += 1.0
        learn(motion, work, size)
        accept(rig, memory, work, motion)
        reach, done = reach_after_success(reach, control), part
    for j in range(path.longest.size):
        tendons[DRIVE, j] = path.drives[s, j]
    return 1.0, reach


@spatial_njit(nogil=True)
def follow(path: Path, rig: Parameters, memory: Memory, run: Run, motion: Motion, work: Work) -> tuple[int, float]:
    """Visit the samples from rest and fill the results.

    Returns the sample that has no equilibrium and the part of the way to it that was reached, or -1.
    """
    n, m = motion.state.shape
    start = Attempt(0.0, 10 * path.iterations, True, 0.0)
    copy(motion.x, motion.trial)
    relaxes = newton(motion.trial, motion.tendons, rig, memory, work, motion.state, start) < 0
    if not relaxes:
        copy(motion.trial, motion.x)
    elif not relax(rig, memory, work, motion, 0.0, start.iterations, path.control):
        return 0, 0.0
    for j in range(m):
        motion.tendons[TENSE, j] = work.tension[j, 0]
        motion.tendons[WOUND, j] = motion.x[0, SLIPS + j] if rig.tendons[j, BY_FORCE] == 1.0 else 0.0
        for k in range(n):
            motion.limit[k, j], motion.state[k, j] = work.guides[k, j, LIMIT], work.state[k, j]
    if relaxes:
        forget(motion)
        for i in range(ENERGIES):
            motion.energy[i] = 0.0
    else:
        accept(rig, memory, work, motion)
    reach = path.control.max_step
    for s in range(path.drives.shape[0]):
        reached, reach = walk(s, path, rig, memory, run, motion, work, reach)
        if reached < 1.0:
            return s, reached
        note(s, rig, memory, work, motion, run)
    return -1, 0.0


@spatial_njit(nogil=True)
def go_on(path: Path, rig: Parameters, memory: Memory, run: Run, motion: Motion, work: Work) -> float:
    """Go on from an equilibrium to the samples after the first one, which is not visited, and fill their results.

    Returns the part of the way to a sample that has no equilibrium, or 1.
    """
    reach = path.control.max_step
    for s in range(1, path.drives.shape[0]):
        reached, reach = walk(s, path, rig, memory, run, motion, work, reach)
        if reached < 1.0:
            return reached
        note(s, rig, memory, work, motion, run)
    return 1.0
