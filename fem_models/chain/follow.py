"""The path of the chain from sample to sample, compiled: steps, history of the dry elements, losses.

See :mod:`fem_models.chain.solve`. After a reversal the guides begin to slide one after the other. Where a step starts,
the front of those that slide is carried on as far as it ran in the step before.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from fem_models.chain.compiled import chain_njit
from fem_models.chain.each import joint_at
from fem_models.chain.equations import Pace, Work, copy, copy_both, copy_rows, work_space
from fem_models.chain.history import (
    DRAG,
    FRICTION,
    JUMP,
    MATERIAL,
    WHEEL,
    Motion,
    accept,
    largest_change,
    motion_at_rest,
)
from fem_models.chain.jump import relax
from fem_models.chain.newton import Attempt, newton
from fem_models.chain.parameters import Memory, Parameters
from fem_models.chain.section import LONGER
from fem_models.load.stepping import (
    LEAST_LENGTH,
    Load,
    StepControl,
    at_rest,
    front,
    front_speed,
    jumped,
    next_step,
    reach_after_success,
)
from hysteresis.arrays import Floats, Ints, Mask

MOST_LEAPS = 40_000  # over the number of joints, in a run: so long it takes to give a path up
JUMP_LENGTH = 2.0**-5  # of the longest step: how far beyond the last equilibrium a jump is sought
HALVINGS_SINCE = 5  # of a step, once the chain has relaxed on its way: a shorter one seldom ends the trouble


class Path(NamedTuple):
    """Samples of a :class:`fem_models.load.schedule.Schedule`, and how to follow them."""

    drive: Floats  # (m,), mm; N under load control
    slack: Floats  # (m, 2)
    loop_scale: Floats  # (m,)
    friction_scale: Floats  # (m,)
    rest_angle: Floats  # (m,)
    time: Floats  # (m,)
    creep: Floats  # (m,)
    control: StepControl
    iterations: int  # of Newton's method


class Run(NamedTuple):
    """Results: angles (m, N), tensions (m, 2, N + 1), energies (m, 5): wheel, friction, material, drag, jumps.

    ``jumps`` (m,) says whether the chain jumped on the way to a sample.
    ``longer`` (m, N) is the elongation of superelastic sections, ``warming`` (m, N) the temperature above the
    surroundings of those that heat themselves; (m, 0) where there are none. ``coldest`` (N,) is the lowest temperature
    at any step.
    """

    angles: Floats
    tensions: Floats
    energies: Floats
    jumps: Mask
    longer: Floats
    warming: Floats
    coldest: Floats


class Tape(NamedTuple):
    """Steps that were accepted, shapes (s, ...), for :mod:`fem_models.chain.moved`; the first is the rig at rest."""

    sample: Ints  # (s,), that the step leads to
    part: Floats  # (s,) of the path to it
    x: Floats  # (s, 3 N + 3)
    state: Floats  # (s, 2, N) of the guides


class Failure(NamedTuple):
    """The sample that has no equilibrium, or -1, and the drives between which it has none."""

    sample: int
    start: float
    end: float


@chain_njit()
def released_mm(rig: Parameters, work: Work, drag: Floats) -> float:
    """Tendon that may come free without the drive when the dashpots relax."""
    by_joints = by_tendons = 0.0
    for i in range(3, drag.size, 3):
        own = joint_at(rig, i // 3 - 1)
        by_joints = max(by_joints, abs(drag[i]) / own.bending * max(own.arm[0], -own.arm[1]))
    for side in range(2):
        if rig.free[side] > 0.0:
            softer = 1.0 + rig.toe[side] / max(work.guess[side], 0.1 * rig.scale)
            by_tendons = max(by_tendons, abs(drag[1 + side]) / rig.free[side] * softer)
    return by_joints + by_tendons


@chain_njit()
def wound_in(x: Floats, rig: Parameters, work: Work) -> float:
    """Tendon a that the wheel has wound in under load control, mm: its slip at the base and its stretch."""
    tension = work.tension[0, 0]
    stretch = (tension - rig.preload[0]) / rig.free[0]
    if rig.toe[0] > 0.0:
        stretch += rig.toe[0] / rig.free[0] * math.log(max(tension, 1e-300) / rig.preload[0])
    return x[1] + stretch


@chain_njit()
def guess(motion: Motion, work: Work, length: float, same_direction: bool) -> None:
    """Fill the first guess of a step: the last step carried on, states of the guides and their fronts too.

    After a reversal or a failure nothing is carried on: every guide sticks until its force says otherwise.
    """
    x, trial, increment, state = motion.x, motion.trial, motion.increment, work.state
    copy(x, work.x_before)
    if not same_direction:
        copy(x, trial)
        state[:] = 0.0
        return
    for i in range(x.size):
        trial[i] = x[i] + length * increment[i]
    copy_both(motion.state, state)
    for side in range(2):
        start = int(motion.front[side])
        ahead = int(length * motion.front_speed[side])
        for i in range(start, min(start + ahead, state.shape[1])):
            state[side, i] = state[side, 0]


@chain_njit()
def learn(motion: Motion, work: Work, length: float, direction: float, last_direction: float) -> None:
    """Take up the equilibrium that was found, and what the step changed per length."""
    x, trial, increment = motion.x, motion.trial, motion.increment
    for side in range(2):
        reached = front(work.state[side])
        motion.front_speed[side] = front_speed(motion.front[side], reached, direction, last_direction, length)
        motion.front[side] = reached
    by_length = 1.0 / max(length, LEAST_LENGTH)
    for i in range(x.size):
        increment[i] = (trial[i] - x[i]) * by_length
        x[i] = trial[i]
    copy_both(work.state, motion.state)
    work.guess[0], work.guess[1] = work.tension[0, 0], work.tension[1, 0]


@chain_njit()
def forget(motion: Motion) -> None:
    """Carry nothing on from the last step."""
    for i in range(motion.increment.size):
        motion.increment[i] = 0.0
    for side in range(2):
        motion.front[side] = motion.front_speed[side] = 0.0


@chain_njit()
def load_at(k: int, path: Path, crept: Floats) -> Load:
    """Load at a sample, the creep so far in its slack."""
    return Load(
        drive=path.drive[k],
        slack=(path.slack[k, 0] + crept[0], path.slack[k, 1] + crept[1]),
        loop_scale=path.loop_scale[k],
        friction_scale=path.friction_scale[k],
        rest_angle=path.rest_angle[k],
        time=path.time[k],
        dead=1.0,
    )


@chain_njit()
def creep_on(part: float, rig: Parameters, tension: Floats, crept: Floats) -> None:
    """Let the tendons creep by a part of the remaining creep, at tensions (2, N + 1)."""
    for side in range(2):
        goal = rig.creep[side] * (tension[side, 0] - rig.preload[side])
        crept[side] += part * (goal - crept[side])


@chain_njit()
def note(k: int, path: Path, rig: Parameters, memory: Memory, work: Work, motion: Motion, run: Run) -> None:
    """Write the results of sample k, and let the tendons creep until the next one, at these tensions."""
    if k + 1 < path.creep.size:
        creep_on(path.creep[k + 1], rig, work.tension, motion.crept)
    angles, tensions = run.angles, run.tensions
    for i in range(angles.shape[1]):
        angles[k, i] = motion.x[3 * i + 3]
    for i in range(run.longer.shape[1]):
        run.longer[k, i] = work.sections[i, LONGER]
    for i in range(run.warming.shape[1]):
        run.warming[k, i] = memory.fibres[i, -1]
    for side in range(2):
        for i in range(tensions.shape[2]):
            tensions[k, side, i] = work.tension[side, i]
    energy = motion.energy
    run.energies[k, 0], run.energies[k, 1] = energy[WHEEL], energy[FRICTION]
    run.energies[k, 2], run.energies[k, 3] = energy[MATERIAL], energy[DRAG]
    run.energies[k, 4] = energy[JUMP]


@chain_njit(allocates=True)
def tape_of(steps: int, joints: int) -> Tape:
    """Make an empty tape for a number of steps; for none it is not written on."""
    return Tape(
        sample=np.full(steps, -1, dtype=np.int64),
        part=np.zeros(steps),
        x=np.zeros((steps, 3 * joints + 3)),
        state=np.zeros((steps, 2, joints)),
    )


@chain_njit(allocates=True)
def cut(tape: Tape, steps: int, length: int) -> Tape:
    """Copy the first steps of a tape to one of another length."""
    out = tape_of(length, tape.state.shape[2])
    for s in range(min(steps, length, tape.part.size)):
        out.sample[s], out.part[s] = tape.sample[s], tape.part[s]
        copy(tape.x[s], out.x[s])
        copy_both(tape.state[s], out.state[s])
    return out


@chain_njit()
def note_step(tape: Tape, step: int, k: int, part: float, motion: Motion) -> None:
    """Write a step on a tape that has room for it."""
    tape.sample[step], tape.part[step] = k, part
    for i in range(motion.x.size):
        tape.x[step, i] = motion.x[i]
    for side in range(2):
        for i in range(motion.state.shape[1]):
            tape.state[step, side, i] = motion.state[side, i]


class Place(NamedTuple):
    """How far along a path a run is."""

    sample: int  # that it is on the way to
    done: float  # part of the way to it
    here: Load  # at the sample before
    at: Load
    reach: float  # length of the next step
    direction: float  # of the last step: 1, -1, or 0 at rest; nan where it is not known
    wheel_force: float
    wound: float
    steps: int
    failed: bool  # no step leads on, even to ``reached``
    reached: float
    halvings: int  # of a step, at most
    leaps: int  # so far


@chain_njit()
def walk(
    path: Path, rig: Parameters, memory: Memory, run: Run, tape: Tape, motion: Motion, work: Work, start: Place
) -> Place:
    """Go on along a path to its end, to where there is no equilibrium, or until the tape is full."""
    k, done, here, at, reach, last_direction = start[:6]
    wheel_force, wound, steps = start.wheel_force, start.wound, start.steps
    control, room, failed, reached = path.control, tape.part.size, False, at.drive
    while k < path.drive.size and not failed and (steps < room or room == 0):
        goal = load_at(k, path, motion.crept)
        direction = np.sign(goal.drive - here.drive)
        step = next_step(here, goal, done, reach, control)
        load = step.load
        rate = 1.0 / (load.time - at.time) if load.time > at.time else 0.0
        guess(motion, work, step.length, direction == last_direction)
        attempt = Attempt(load=load, pace=Pace(rate, rate, 0.0), iterations=path.iterations, fine=step.fine)
        found = newton(motion.trial, rig, memory, work, motion.state, attempt) >= 0
        rotation, slide = largest_change(motion.x, motion.trial)
        bound = step.length + released_mm(rig, work, motion.drag)
        if not found or jumped(rotation, slide, bound, control):
            reach, reached = 0.5 * step.length, load.drive
            if step.fine:
                last_direction = math.nan
            failed = reach < control.max_step * 0.5**start.halvings
            continue
        learn(motion, work, step.length, direction, last_direction)
        accept(rig, memory, work, motion, load, rate)
        if run.longer.shape[1] > 0:
            copy_rows(work.sections, motion.sections)
        for i in range(run.coldest.size):
            run.coldest[i] = min(run.coldest[i], memory.fibres[i, -1])
        if room > 0:
            note_step(tape, steps, k, step.part, motion)
        steps += 1
        now = work.tension[0, 0] - work.tension[1, 0]
        winding = wound_in(motion.x, rig, work) if rig.load_control else load.drive
        motion.energy[WHEEL] += 0.5 * (wheel_force + now) * (winding - wound)
        wheel_force, wound, at, done, last_direction = now, winding, load, step.part, direction
        reach = reach_after_success(reach, control)
        if done == 1.0:
            note(k, path, rig, memory, work, motion, run)
            here, done, k = goal, 0.0, k + 1
    last = reach, last_direction, wheel_force, wound, steps, failed, reached, start.halvings, start.leaps
    return Place(k, done, here, at, *last)


@chain_njit()
def leap(path: Path, rig: Parameters, memory: Memory, run: Run, motion: Motion, work: Work, stuck: Place) -> Place:
    """Relax to the next equilibrium, a little beyond the last one, and go on from there; ``failed`` if there is none.

    A sample is marked where the chain moved by more than a step of that length explains. Where it did not, the last
    equilibrium was only hard to leave.
    """
    k, control, before = stuck.sample, path.control, motion.increment
    goal = load_at(k, path, motion.crept)
    step = next_step(stuck.here, goal, stuck.done, max(stuck.reach, JUMP_LENGTH * control.max_step), control)
    load, at = step.load, stuck.at
    rate = 1.0 / (load.time - at.time) if load.time > at.time else 0.0
    copy(motion.x, before)
    lost, bound = motion.energy[JUMP], step.length + released_mm(rig, work, motion.drag)
    attempt = Attempt(load=load, pace=Pace(rate, rate, 0.0), iterations=path.iterations, fine=True)
    many = (stuck.leaps + 1) * run.angles.shape[1] > MOST_LEAPS
    if many or not relax(rig, memory, work, motion, attempt, control):
        return stuck
    rotation, slide = largest_change(before, motion.x)
    if jumped(rotation, slide, bound, control):
        run.jumps[k] = True
    else:
        motion.energy[JUMP] = lost
    forget(motion)
    for i in range(run.coldest.size):
        run.coldest[i] = min(run.coldest[i], memory.fibres[i, -1])
    now = work.tension[0, 0] - work.tension[1, 0]
    winding = wound_in(motion.x, rig, work) if rig.load_control else load.drive
    motion.energy[WHEEL] += 0.5 * (stuck.wheel_force + now) * (winding - stuck.wound)
    here, done = stuck.here, step.part
    if done == 1.0:
        note(k, path, rig, memory, work, motion, run)
        here, done, k = goal, 0.0, k + 1
    steps, leaps = stuck.steps + 1, stuck.leaps + 1
    return Place(
        k, done, here, load, step.length, math.nan, now, winding, steps, False, load.drive, HALVINGS_SINCE, leaps
    )


@chain_njit(nogil=True, allocates=True)  # batches run in threads
def follow(path: Path, rig: Parameters, memory: Memory, run: Run, tape: Tape) -> tuple[Failure, Tape]:
    """Visit the samples from rest and fill the results; between samples everything moves in proportion.

    The tape that is returned holds the steps, unless the one given is empty, or the chain relaxed on its way.
    """
    joints, samples, taped = run.angles.shape[1], path.drive.size, tape.part.size > 0
    motion, work = motion_at_rest(rig, joints), work_space(rig, joints)
    here = at_rest(rig.rest)
    start = Attempt(load=here, pace=Pace(0.0, 0.0, 0.0), iterations=10 * path.iterations, fine=True)
    straight = motion_at_rest(rig, joints)
    if newton(motion.x, rig, memory, work, work.state, start) >= 0:
        copy_both(work.limit, motion.limit)
        copy_both(work.state, motion.state)
        accept(rig, memory, work, motion, here, 0.0)
        copy_rows(work.sections, motion.sections)
    else:  # it is let go slowly
        copy(straight.x, motion.x)
        if not relax(rig, memory, work, motion, start, path.control):
            return Failure(sample=0, start=0.0, end=0.0), tape
        forget(motion)
        motion.energy[:] = 0.0
        taped, tape = False, cut(tape, 0, 0)
    if taped:
        note_step(tape, 0, -1, 1.0, motion)
    wheel_force = work.tension[0, 0] - work.tension[1, 0]
    wound = wound_in(motion.x, rig, work) if rig.load_control else 0.0
    halvings = path.control.max_halvings
    place = Place(0, 0.0, here, here, path.control.max_step, 0.0, wheel_force, wound, 1, False, 0.0, halvings, 0)
    while place.sample < samples and not place.failed:
        if taped and place.steps == tape.part.size:
            tape = cut(tape, place.steps, 2 * place.steps)
        place = walk(path, rig, memory, run, tape, motion, work, place)
        if place.failed:
            if taped:
                taped, tape = False, cut(tape, 0, 0)
            place = leap(path, rig, memory, run, motion, work, place)
    if place.failed:
        return Failure(sample=place.sample, start=place.at.drive, end=place.reached), tape
    return Failure(sample=-1, start=0.0, end=0.0), cut(tape, place.steps, min(place.steps, tape.part.size))
