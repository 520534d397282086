"""Where no equilibrium is near, the tube jumps: the chain relaxes in pseudo-time to the next one, compiled.

A viscous force on every joint, and on the slip of both tendons at every guide, resists the motion. A pseudo step is a
step of implicit Euler at a constant load (pseudo-transient continuation; Kelley and Keyes 1998, doi
10.1137/S0036142996304796). Dry elements move on with each step, so that friction and material lose what they lose on
the way; what the viscous forces lose is the energy that a real tube would lose in vibrating. Steps are bounded by how
far the chain moves in them, so that the path does not depend on the viscosity, which is only the scale of the
pseudo-time.
"""

from __future__ import annotations

from fem_models.chain.compiled import chain_njit
from fem_models.chain.equations import Pace, Work, copy, copy_both, copy_rows, viscous_of
from fem_models.chain.history import JUMP, Motion, book_drag, largest_change, move_on
from fem_models.chain.newton import Attempt, newton
from fem_models.chain.parameters import Memory, Parameters
from fem_models.load.stepping import StepControl, jumped
from hysteresis.arrays import Floats

FIRST, LARGEST, LEAST = 1e4, 1e12, 1e-14
"""Lengths of pseudo steps, over that in which a joint relaxes: of the first one, and where they end."""
LONGER, SHORTER, CAREFUL = 4.0, 0.125, 1.5
"""Factors on the length of a pseudo step: after one that was accepted, after one that was not, and soon after that."""
MOST_STEPS = 60_000
"""Pseudo steps of a jump."""
INSTANT = 1e12  # 1/s: no heat is exchanged in a jump, but for what the step itself took


@chain_njit()
def viscous_loss(x: Floats, rig: Parameters, work: Work, relax: float, lag: Floats) -> float:
    """Note the viscous forces of a pseudo step, and return what they lose, mJ."""
    lost = 0.0
    for i in range(x.size):
        moved, last = x[i] - work.x_last[i], lag[i]
        lag[i] = relax * viscous_of(i, rig) * moved
        lost += 0.5 * (last + lag[i]) * moved
    return lost


@chain_njit()
def largest_force(rig: Parameters, lag: Floats) -> float:
    """Largest viscous force, N."""
    most = 0.0
    for i in range(lag.size):
        most = max(most, abs(lag[i]) / (rig.arm[0] if i % 3 == 0 else 1.0))
    return most


@chain_njit()
def relax(
    rig: Parameters,
    memory: Memory,
    work: Work,
    motion: Motion,
    attempt: Attempt,
    control: StepControl,
) -> bool:
    """Move the chain to the next equilibrium at the load of an attempt; return whether there is one.

    The real time of the step passes once: drag counts from where the chain started, and heat is exchanged in the first
    pseudo step.
    """
    x, trial, lag, load, rate = motion.x, motion.trial, motion.lag, attempt.load, attempt.pace.drag
    length, longer, heat = FIRST, LONGER, attempt.pace.heat
    for i in range(lag.size):
        lag[i] = 0.0
    copy(x, work.x_before)
    copy_rows(motion.sections, work.sections)
    for _ in range(MOST_STEPS):
        copy(x, work.x_last)
        copy(x, trial)
        copy_both(motion.state, work.state)
        slow = 1.0 / length
        step = Attempt(load=load, pace=Pace(rate, heat, slow), iterations=attempt.iterations // 2, fine=True)
        found = newton(trial, rig, memory, work, motion.state, step) >= 0
        rotation, slide = largest_change(x, trial)
        if not found or jumped(rotation, slide, 0.0, control):
            copy_rows(motion.sections, work.sections)
            length, longer = SHORTER * length, CAREFUL
            if length < LEAST:
                return False
            continue
        motion.energy[JUMP] += viscous_loss(trial, rig, work, slow, lag)
        copy(trial, x)
        copy_both(work.state, motion.state)
        copy_rows(work.sections, motion.sections)
        work.guess[0], work.guess[1] = work.tension[0, 0], work.tension[1, 0]
        move_on(rig, memory, work, motion, load, heat)
        heat = INSTANT if heat > 0.0 else 0.0
        if largest_force(rig, lag) <= rig.tolerance or length >= LARGEST:
            book_drag(rig, work, motion, rate)
            return True
        length *= longer
        longer = min(LONGER, CAREFUL * longer)
    return False
