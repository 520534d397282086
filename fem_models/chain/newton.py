"""The chain's solution, compiled: Newton's method, history, path. See :mod:`fem_models.chain.solve`.

Each guide has a state, stuck or sliding one way or the other, that a Newton step keeps: within it all is smooth. States
follow from the forces between the steps: a primal-dual active set (Hintermueller, Ito and Kunisch 2002, doi
10.1137/S1052623401383558), but that a guide sticks before it slides the other way. After a reversal the guides let go
one after the other; where a step starts, the front of those that slide is carried on as far as it ran in the step
before.
"""

from __future__ import annotations

import math

import numpy as np

from fem_models.chain.compiled import chain_njit
from fem_models.chain.equations import BAND, BAND_OF_JOINTS, Constants, History, Work, assemble, flag
from fem_models.load.stepping import (
    Load,
    StepControl,
    at_rest,
    front,
    front_speed,
    jumped,
    next_step,
    reach_after_success,
    too_short,
)
from hysteresis.arrays import Floats

LARGEST_TURN = 0.02  # rad a joint in a step of Newton's method, lest ropes go slack on its way


@chain_njit()
def eliminate(a: Floats, b: Floats, z: Floats, both: bool, reach: int) -> None:
    """Solve the band of half width ``reach`` for b, and for z if ``both``, in place, without pivoting; a is lost."""
    n = b.size
    for i in range(n):
        pivot = 1.0 / a[i, BAND]
        for r in range(i + 1, min(i + reach + 1, n)):
            factor = a[r, i - r + BAND] * pivot
            if factor != 0.0:
                for k in range(1, min(reach, n - 1 - i) + 1):
                    a[r, i + k - r + BAND] -= factor * a[i, BAND + k]
                b[r] -= factor * b[i]
                if both:
                    z[r] -= factor * z[i]
    for i in range(n - 1, -1, -1):
        total, second = b[i], z[i]
        for k in range(1, min(reach, n - 1 - i) + 1):
            total -= a[i, BAND + k] * b[i + k]
            if both:
                second -= a[i, BAND + k] * z[i + k]
        b[i] = total / a[i, BAND]
        if both:
            z[i] = second / a[i, BAND]


@chain_njit()
def base_let_go(held: Floats, state: Floats) -> bool:
    """Whether rope has begun to slide past the base, or to slide the other way."""
    for side in range(2):  # noqa: SIM110 - compiled
        if state[side, 0] != 0.0 and state[side, 0] != held[side, 0]:
            return True
    return False


@chain_njit()
def newton(
    x: Floats, c: Constants, h: History, load: Load, w: Work, rate: float, iterations: int, held: Floats, fine: bool
) -> int:
    """Solve for the equilibrium from x, and return the steps it took, or -1; x is changed in either case.

    It gives up, too, where a step that is not ``fine`` lets rope begin to slide past the base, past the states
    ``held``: that is the corner of the wheel's work, and half the step keeps the energy's balance. The guides keep the
    states they come with for the first step, which x may not agree with yet. A touched tip stop adds k l l^T to the
    tangent, l being the tip's levers: Sherman-Morrison with a second solution.
    """
    z = np.empty(x.size)
    for turn in range(iterations):
        worst, stop, outside = assemble(x, c, h, load, w, rate, turn > 0)
        if turn > 0 and not fine and base_let_go(held, w.state):
            return -1
        if worst <= c.tolerance:
            return turn
        if not worst < 1e9 * c.scale:
            return -1
        if stop > 0.0:
            z[:] = w.lever
        eliminate(w.a, w.b, z, stop > 0.0, BAND if outside else BAND_OF_JOINTS)
        if stop > 0.0:
            by_b = by_z = 0.0
            for i in range(x.size):
                by_b += w.lever[i] * w.b[i]
                by_z += w.lever[i] * z[i]
            scale = stop * by_b / (1.0 + stop * by_z)
            for i in range(x.size):
                w.b[i] -= scale * z[i]
        if outside:
            for i in range(x.size - 3, 3, -3):  # joints from headings
                w.b[i] -= w.b[i - 3]
        most = 0.0
        for i in range(3, x.size, 3):
            most = max(most, abs(w.b[i]))
        part = min(1.0, LARGEST_TURN / most) if most > 0.0 else 1.0
        for i in range(x.size):
            x[i] -= part * w.b[i]
    return -1


@chain_njit()
def slow(i: int, viscous: float, x: Floats, w: Work, drag: Floats) -> float:
    """Note the force of a dashpot over a step, and return its loss, mJ."""
    moved, last = x[i] - w.x_before[i], drag[i]
    drag[i] = viscous * moved
    return 0.5 * (last + drag[i]) * moved


@chain_njit()
def held_mm(c: Constants, w: Work, drag: Floats) -> float:
    """Rope that may come free without the drive when the dashpots let go of what they hold."""
    held = 0.0
    for i in range(3, drag.size, 3):
        held = max(held, abs(drag[i]) / c.bending * max(c.arm_a, c.arm_b))
    slack_a = abs(drag[1]) / c.free_a * (1.0 + c.toe_a / max(w.guess[0], 0.1 * c.scale))
    slack_b = 0.0
    if c.free_b > 0.0:
        slack_b = abs(drag[2]) / c.free_b * (1.0 + c.toe_b / max(w.guess[1], 0.1 * c.scale))
    return held + max(slack_a, slack_b)


@chain_njit()
def accept(
    x: Floats, c: Constants, h: History, load: Load, w: Work, rate: float, before: Floats, drag: Floats
) -> tuple[float, float, float]:
    """Move the rest points of what has slipped; return the losses in guides, material and by drag, mJ.

    A sliding guide's force changes from the limit ``before`` to the present one, a dashpot's from ``drag``: their mean
    is booked. What a flag takes at its plateau it gives back, less, on the way back.
    """
    lost = material = viscous = 0.0
    n = h.guides.shape[1]
    for side in range(2):
        stiffness = c.bristle_a if side == 0 else c.bristle_b
        for i in range(n):
            force = stiffness * (x[3 * i + 1 + side] - h.guides[side, i])
            if abs(force) > w.limit[side, i]:
                slid = math.copysign((abs(force) - w.limit[side, i]) / stiffness, force)
                h.guides[side, i] += slid
                lost += 0.5 * (w.limit[side, i] + before[side, i]) * abs(slid)
            before[side, i] = w.limit[side, i]
        viscous += slow(1 + side, rate * c.drag_sheath, x, w, drag)
    for i in range(n):
        theta = x[3 * i + 3]
        viscous += slow(3 * i + 3, rate * c.drag_joint, x, w, drag)
        for j in range(h.slip_moment.size):
            moment, top = h.jenkins_stiffness[j] * (theta - h.jenkins[j, i]), load.loop_scale * h.slip_moment[j]
            if abs(moment) > top:
                slid = math.copysign((abs(moment) - top) / h.jenkins_stiffness[j], moment)
                h.jenkins[j, i] += slid
                material += top * abs(slid)
        for j in range(h.flag_stiffness.size):
            k, u = h.flag_stiffness[j], theta - load.rest_angle
            moment, _ = flag(u, h.flags[j, i], k, h.flag_upper[j], h.flag_lower[j], h.flag_span[j], h.flag_climb[j])
            rest = u - moment / k
            material += moment * (rest - h.flags[j, i])
            h.flags[j, i] = rest
    return lost, material, viscous


@chain_njit()
def largest_change(x: Floats, y: Floats) -> tuple[float, float]:
    """Largest rotation of a joint and slide at a guide between two states."""
    rotation = slide = 0.0
    for i in range(x.size):
        if i % 3 == 0:
            rotation = max(rotation, abs(y[i] - x[i]))
        else:
            slide = max(slide, abs(y[i] - x[i]))
    return rotation, slide


@chain_njit()
def wound_in(x: Floats, c: Constants, w: Work) -> float:
    """Rope a that the wheel has wound in under a given tension, mm: its slip at the base and its stretch."""
    tension = w.tension[0, 0]
    stretch = (tension - c.preload_a) / c.free_a
    if c.toe_a > 0.0:
        stretch += c.toe_a / c.free_a * math.log(max(tension, 1e-300) / c.preload_a)
    return x[1] + stretch


@chain_njit()
def advance(held: Floats, w: Work, fronts: Floats, run: Floats) -> None:
    """Start the guides from the states held, the front of either tendon carried on as far as it ran before."""
    w.state[:] = held
    for side in range(2):
        start = int(fronts[side])
        for i in range(start, min(start + int(run[side]), held.shape[1])):
            w.state[side, i] = held[side, 0]


@chain_njit(nogil=True)  # batches run in threads
def follow(
    drives: Floats, slacks: Floats, loop_scales: Floats, residuals: Floats, times: Floats, creeps: Floats,
    c: Constants, h: History,
    control: StepControl, iterations: int,
    angles: Floats, tensions: Floats, energies: Floats,
) -> tuple[int, float, float]:  # fmt: skip
    """Visit the samples from rest; fill angles (m, N), tensions (m, 2, N+1), energies (m, 4).

    A pulled rig takes forces for drives, in N. The energies are the wheel's work and the losses by friction, material
    and drag. Between samples everything moves in proportion. Returns (-1, 0, 0), or the sample that did not converge
    and the drives between which it did not.
    """
    n = angles.shape[1]
    size = 3 * (n + 1)
    x, trial = np.zeros(size), np.zeros(size)
    for i in range(n):
        x[3 * i + 3] = c.rest
    w = Work(
        np.zeros((size, 2 * BAND + 1)), np.zeros(size), np.zeros(size), np.zeros(n), np.zeros(n),
        np.zeros((2, n + 1)), np.zeros((2, n)), np.zeros((2, n)), np.zeros(size), np.array([c.preload_a, c.preload_b]),
    )  # fmt: skip
    here = at = at_rest(c.rest)
    drag = np.zeros(size)
    crept_a = crept_b = work = lost = material = viscous = 0.0
    if newton(x, c, h, here, w, 0.0, 10 * iterations, w.state, True) < 0:
        return 0, 0.0, 0.0
    before, held, fronts, run = w.limit.copy(), w.state.copy(), np.zeros(2), np.zeros(2)
    pull, wound = w.tension[0, 0] - w.tension[1, 0], 0.0
    if c.pulled > 0.0:
        wound = wound_in(x, c, w)
    reach, heading, increment = (
        control.max_step,
        0.0,
        np.zeros(size),
    )
    for k in range(drives.size):
        goal = Load(drives[k], (slacks[k, 0] + crept_a, slacks[k, 1] + crept_b), loop_scales[k], residuals[k], times[k])
        ahead = np.sign(goal.drive - here.drive)
        done = 0.0
        while done < 1.0:
            part, load, step, fine = next_step(here, goal, done, reach, control)
            rate = 1.0 / (load.time - at.time) if load.time > at.time else 0.0
            w.x_before[:] = x
            trial[:] = x
            if ahead == heading:
                for i in range(size):
                    trial[i] += step * increment[i]
                advance(held, w, fronts, step * run)
            else:
                w.state[:] = 0.0  # turned round, or failed: every guide sticks until its force says otherwise
            took = newton(trial, c, h, load, w, rate, iterations, held, fine)
            rotation, slide = largest_change(x, trial)
            if took < 0 or jumped(rotation, slide, step + held_mm(c, w, drag), control):
                heading, reach = heading if not fine else math.nan, 0.5 * step
                if too_short(reach, control):
                    return k, at.drive, load.drive
                continue
            for side in range(2):
                reached = front(w.state[side])
                run[side] = front_speed(fronts[side], reached, ahead, heading, step)
                fronts[side] = reached
            for i in range(size):
                increment[i] = (trial[i] - x[i]) / max(step, 1e-12)
            heading, held[:], x[:] = ahead, w.state, trial
            losses = accept(x, c, h, load, w, rate, before, drag)
            lost += losses[0]
            material += losses[1]
            viscous += losses[2]
            w.guess[0], w.guess[1] = w.tension[0, 0], w.tension[1, 0]
            now = w.tension[0, 0] - w.tension[1, 0]
            winding = wound_in(x, c, w) if c.pulled > 0.0 else load.drive
            work += 0.5 * (pull + now) * (winding - wound)
            pull, wound, at, done = now, winding, load, part
            reach = reach_after_success(reach, control)
        here = goal
        crept_a += creeps[k] * (c.creep_a * (w.tension[0, 0] - c.preload_a) - crept_a)
        crept_b += creeps[k] * (c.creep_b * (w.tension[1, 0] - c.preload_b) - crept_b)
        for i in range(n):
            angles[k, i] = x[3 * i + 3]
        tensions[k] = w.tension
        energies[k, 0], energies[k, 1], energies[k, 2], energies[k, 3] = work, lost, material, viscous
    return -1, 0.0, 0.0
