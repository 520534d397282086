"""Where no equilibrium is near, the wrist jumps: it relaxes in pseudo-time to the next one, compiled.

The method is that of the planar chain (:mod:`fem_models.chain.jump`): viscous forces on the rotations of every joint
and on the slip of every tendon at every guide, implicit Euler at constant drives, dry elements that move on with each
pseudo step. Steps are bounded by how far the wrist moves in them.
"""

from __future__ import annotations

from fem_models.load.stepping import StepControl, jumped
from fem_models.spatial.kernels.compiled import spatial_njit
from fem_models.spatial.kernels.history import JUMP, Motion, accept, largest_change
from fem_models.spatial.kernels.joint import Work
from fem_models.spatial.kernels.newton import Attempt, newton
from fem_models.spatial.parameters import Memory, Parameters
from fem_models.spatial.tables import GUESS, SLIPS
from hysteresis.arrays import Floats

FIRST, LARGEST, LEAST = 1e-2, 1e12, 1e-14
"""Lengths of pseudo steps, over that in which a joint relaxes: of the first one, and where they end."""
LONGER, SHORTER = 2.0, 0.25
"""Factors on the length of a pseudo step after one that was accepted, and after one that was not."""
MOST_STEPS = 20_000


@spatial_njit()
def viscous_loss(x: Floats, rig: Parameters, work: Work, relax: float, lag: Floats) -> float:
    """Note the viscous forces of a pseudo step, and return what they lose, mJ."""
    lost, turning = 0.0, relax * rig.viscosity
    sliding = turning * rig.by_arm**2
    for k in range(x.shape[0] - 1):
        for i in range(x.shape[1]):
            if i < 3 or i >= SLIPS:
                moved, last = x[k, i] - work.before[k, i], lag[k, i]
                lag[k, i] = (turning if i < 3 else sliding) * moved
                lost += 0.5 * (last + lag[k, i]) * moved
    return lost


@spatial_njit()
def largest_force(rig: Parameters, lag: Floats) -> float:
    """Largest viscous force, N."""
    most = 0.0
    for k in range(lag.shape[0]):
        for i in range(lag.shape[1]):
            most = max(most, abs(lag[k, i]) * (rig.by_arm if i < 3 else 1.0))
    return most


@spatial_njit(forceinline=True)
def copy(values: Floats, out: Floats) -> None:
    """Copy a table."""
    for k in range(out.shape[0]):
        for i in range(out.shape[1]):
            out[k, i] = values[k, i]


@spatial_njit()
def relax(
    rig: Parameters,
    memory: Memory,
    work: Work,
    motion: Motion,
    dead: float,
    iterations: int,
    control: StepControl,
) -> bool:
    """Move the wrist to the next equilibrium under the drives that it goes to; return whether there is one.

    ``dead`` is the part of weights and force at the tip, ``iterations`` the most of Newton's method in a pseudo step.
    """
    x, trial, lag, tendons = motion.x, motion.trial, motion.lag, motion.tendons
    length = FIRST
    for k in range(lag.shape[0]):
        for i in range(lag.shape[1]):
            lag[k, i] = 0.0
    for _ in range(MOST_STEPS):
        copy(x, work.before)
        copy(x, trial)
        copy(motion.state, work.state)
        slow = 1.0 / length
        found = newton(trial, tendons, rig, memory, work, motion.state, Attempt(dead, iterations, True, slow))
        motion.counts[2] += abs(found)
        rotation, slide = largest_change(x, trial)
        if found < 0 or jumped(rotation, slide, 0.0, control):
            length *= SHORTER
            if length < LEAST:
                return False
            continue
        motion.energy[JUMP] += viscous_loss(trial, rig, work, slow, lag)
        copy(trial, x)
        copy(work.state, motion.state)
        for j in range(work.tension.shape[0]):
            tendons[GUESS, j] = work.tension[j, 0]
        accept(rig, memory, work, motion)
        if largest_force(rig, lag) <= rig.tolerance or length >= LARGEST:
            return True
        length *= LONGER
    return False
