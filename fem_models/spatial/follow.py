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
from fem_models.spatial.compiled import spatial_njit
from fem_models.spatial.guides import Load
from fem_models.spatial.newton import Attempt, Work, newton, work_space
from fem_models.spatial.parameters import Memory, Parameters
from fem_models.spatial.stored import stored_energy
from hysteresis.arrays import Floats

WORK, FRICTION, MATERIAL, STORED = range(4)  # places of the energies


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
    energies: Floats  # (s, 4)


class Motion(NamedTuple):
    """The wrist at its last equilibrium, and what the last step changed per length."""

    x: Floats  # (N + 1, 6 + m)
    before: Floats  # the same a step ago
    increment: Floats
    state: Floats  # (N, m)
    limit: Floats  # (N, m)
    front: Floats  # (m,)
    front_speed: Floats  # (m,)
    drive: Floats  # (m,)
    wound: Floats  # (m,), mm
    pull: Floats  # (m,), tension at the wheel
    heading: Floats  # (m,): direction of each drive: 1, -1, 0; nan where it is not known
    energy: Floats  # (4,)


@spatial_njit(allocates=True)
def motion_at_rest(rig: Parameters) -> Motion:
    """Every joint as it is without load."""
    n, m = rig.bristle.shape
    shape = (n + 1, 6 + m)
    x = np.zeros(shape)
    x[:n, :3] = rig.rest
    drive = rig.preload * rig.by_force
    row = np.zeros((7, m))
    return Motion(
        x=x,
        before=np.zeros(shape),
        increment=np.zeros(shape),
        state=np.zeros((n, m)),
        limit=np.zeros((n, m)),
        front=row[0],
        front_speed=row[1],
        drive=drive,
        wound=row[2],
        pull=row[3],
        heading=row[4],
        energy=np.zeros(4),
    )


@spatial_njit()
def accept(rig: Parameters, memory: Memory, work: Work, motion: Motion, load: Load) -> None:
    """Move the rest points of what has slipped, and book work and losses of the step, mJ.

    The force of a sliding guide changes from its limit at the last equilibrium to the present one, and the tension at
    the wheel likewise: their means are booked.
    """
    x, (n, m) = motion.x, rig.bristle.shape
    lost = material = 0.0
    for j in range(m):
        for k in range(n):
            stiffness, limit = rig.bristle[k, j], work.guides.limit[k, j]
            force = stiffness * (x[k, 6 + j] - memory.guides[k, j])
            if abs(force) > limit:
                slid = math.copysign((abs(force) - limit) / stiffness, force)
                memory.guides[k, j] += slid
                lost += 0.5 * (limit + motion.limit[k, j]) * abs(slid)
            motion.limit[k, j] = limit
        tension, wound = work.joints.tension[j, 0], load.drive[j]
        if rig.by_force[j] == 1.0:
            wound = x[0, 6 + j] + (tension - rig.preload[j]) / rig.free[j]
            if rig.toe[j] > 0.0:
                wound += rig.toe[j] / rig.free[j] * math.log(max(tension, 1e-300) / rig.preload[j])
        motion.energy[WORK] += 0.5 * (motion.pull[j] + tension) * (wound - motion.wound[j])
        motion.pull[j], motion.wound[j] = tension, wound
    for k in range(n):
        for axis in range(2):
            for e in range(rig.loop.shape[2]):
                stiffness, limit = rig.loop[k, axis, e], rig.slip[k, axis, e]
                moment = stiffness * (x[k, 1 + axis] - memory.jenkins[k, axis, e])
                if abs(moment) > limit:
                    slid = math.copysign((abs(moment) - limit) / stiffness, moment)
                    memory.jenkins[k, axis, e] += slid
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
        for j in range(6, x.shape[1]):
            slide = max(slide, abs(y[k, j] - x[k, j]))
    return math.sqrt(rotation), slide


@spatial_njit()
def guess(trial: Floats, headings: Floats, motion: Motion, work: Work, length: float) -> None:
    """Fill the first guess of a step: the last one carried on, with the guides' states and their fronts.

    A tendon whose drive turns back, or whose last step failed, sticks at all its guides until the forces say otherwise.
    Where that is so of all drives, nothing is carried on.
    """
    rows, columns = trial.shape
    state, n = work.guides.state, rows - 1
    carried = False
    for j in range(columns - 6):
        carried = carried or headings[j] == motion.heading[j]
        for k in range(n):
            state[k, j] = motion.state[k, j] if headings[j] == motion.heading[j] else 0.0
        if headings[j] == motion.heading[j]:
            start = int(motion.front[j])
            ahead = int(length * motion.front_speed[j])
            for k in range(start, min(start + ahead, n)):
                state[k, j] = state[0, j]
    for k in range(rows):
        for i in range(columns):
            on = carried and (i < 6 or headings[i - 6] == motion.heading[i - 6])
            trial[k, i] = motion.x[k, i] + (length * motion.increment[k, i] if on else 0.0)


@spatial_njit()
def learn(trial: Floats, headings: Floats, motion: Motion, work: Work, length: float) -> None:
    """Take up the equilibrium that was found, and what the step changed per length."""
    state, by_length = work.guides.state, 1.0 / max(length, LEAST_LENGTH)
    n, m = state.shape
    for j in range(m):
        reached = n
        for k in range(n - 1, -1, -1):
            if state[k, j] != state[0, j]:
                reached = k
        motion.front_speed[j] = front_speed(motion.front[j], reached, headings[j], motion.heading[j], length)
        motion.front[j], motion.heading[j] = reached, headings[j]
        work.guides.guess[j] = work.joints.tension[j, 0]
        for k in range(n):
            motion.state[k, j] = state[k, j]
    for k in range(n + 1):
        for i in range(6 + m):
            motion.increment[k, i] = (trial[k, i] - motion.x[k, i]) * by_length
            motion.x[k, i] = trial[k, i]


@spatial_njit()
def note(s: int, rig: Parameters, memory: Memory, work: Work, motion: Motion, run: Run) -> None:
    """Write the results of sample s."""
    n, m = rig.bristle.shape
    for k in range(n):
        for i in range(6):
            run.joints[s, k, i] = motion.x[k, i]
    for j in range(m):
        for k in range(n + 1):
            run.tensions[s, j, k] = work.joints.tension[j, k]
    motion.energy[STORED] = stored_energy(motion.x, rig, memory, work.joints)
    for i in range(4):
        run.energies[s, i] = motion.energy[i]


@spatial_njit()
def path_length(s: int, path: Path, drive: Floats, headings: Floats) -> float:
    """Length of the way to sample s in longest steps, and the direction of every drive."""
    length = 0.0
    for j in range(drive.size):
        change = path.drives[s, j] - drive[j]
        headings[j] = np.sign(change)
        length = max(length, abs(change) / path.longest[j])
    return length


@spatial_njit()
def walk(s: int, path: Path, rig: Parameters, memory: Memory, motion: Motion, work: Work, scratch: Floats) -> float:
    """Go to sample s in steps that are halved where they fail; returns the part of the way that was reached."""
    control, n, m = path.control, motion.state.shape[0], motion.state.shape[1]
    headings, drive, trial = scratch[n + 1, :m], scratch[n + 2, :m], scratch[: n + 1]
    length = path_length(s, path, motion.drive, headings)
    dead = 0.0 if s == 0 else 1.0  # weights come on on the way to the first sample
    if length == 0.0 or s == 0:
        length = max(length, control.max_step)
    done = 0.0
    reach = scratch[n + 3, 0]
    while done < 1.0:
        part = next_part(done, reach, length, control.max_step)
        for j in range(m):
            end = path.drives[s, j]
            drive[j] = end if part == 1.0 else motion.drive[j] + part * (end - motion.drive[j])
        load, size = Load(drive, 1.0 if dead == 1.0 else part), (part - done) * length
        fine = size <= FINE * control.max_step
        guess(trial, headings, motion, work, size)
        attempt = Attempt(path.iterations, fine)
        found = newton(trial, rig, memory, load, work, motion.state, attempt) >= 0
        rotation, slide = largest_change(motion.x, trial)
        if not found or jumped(rotation, slide, size, control):
            reach = 0.5 * size
            if fine:
                motion.heading[:] = math.nan
            if too_short(reach, control):
                return done
            continue
        learn(trial, headings, motion, work, size)
        accept(rig, memory, work, motion, load)
        reach, done = reach_after_success(reach, control), part
    scratch[n + 3, 0] = reach
    for j in range(m):
        motion.drive[j] = path.drives[s, j]
    return 1.0


@spatial_njit(nogil=True, allocates=True)
def follow(path: Path, rig: Parameters, memory: Memory, run: Run) -> tuple[int, float]:
    """Visit the samples from rest and fill the results.

    Returns the sample that has no equilibrium and the part of the way to it that was reached, or -1.
    """
    motion, work = motion_at_rest(rig), work_space(rig)
    n, m = rig.bristle.shape
    scratch = np.zeros((n + 4, 6 + m))
    scratch[n + 3, 0] = path.control.max_step
    start = Load(motion.drive.copy(), 0.0)
    if newton(motion.x, rig, memory, start, work, work.guides.state, Attempt(10 * path.iterations, True)) < 0:
        return 0, 0.0
    motion.limit[:] = work.guides.limit
    motion.state[:] = work.guides.state
    motion.pull[:] = work.joints.tension[:, 0]
    motion.wound[:] = rig.by_force * motion.x[0, 6:]
    accept(rig, memory, work, motion, start)
    for s in range(path.drives.shape[0]):
        reached = walk(s, path, rig, memory, motion, work, scratch)
        if reached < 1.0:
            return s, reached
        note(s, rig, memory, work, motion, run)
    return -1, 0.0
