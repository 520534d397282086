"""Which guides stick and which slide, found within one Newton step, compiled.

The equations of joints and tendons at x are kept, linear; only guides change between sticking and sliding, until their
states agree with the forces at the end of the step. While the limits stay, this is the least of a convex function that
is quadratic in pieces: elastic energy, and that of bristles which give way at their limits. So it can be found. The
step by the states of a point leads down from there, and is taken as far as it leads down: a semi-smooth Newton method
with a line search (Qi and Sun 1993, doi 10.1007/BF01581275). Without the line search, guides of several tendons that
load each other through the joints take turns without end. It has to be exact, because bristles are a thousand times
stiffer than the bending of a joint: where it ends at half of the slope it fails at 28 joints.
"""

from __future__ import annotations

import math

from fem_models.spatial.kernels.compiled import spatial_njit
from fem_models.spatial.kernels.guides import next_state, take_state
from fem_models.spatial.kernels.joint import Work
from fem_models.spatial.kernels.loaded import balance_rings, step_by_spins
from fem_models.spatial.kernels.slips import solve_slips, step_by_slips
from fem_models.spatial.kernels.vectors import dot, take, take_at
from fem_models.spatial.parameters import Parameters
from fem_models.spatial.tables import (
    FORCE,
    HELD,
    HERE,
    LIMIT,
    NET,
    PULL,
    RATIO,
    SLIPS,
    TENSION,
    THERE,
    TIGHTENS,
    VISCOUS,
    WRAP_AHEAD,
    WRAP_BEND,
    WRAPPED,
    WRAPS,
)
from hysteresis.arrays import Floats

TURNS = 40  # how often guides change in one Newton step, at most
LEVEL, TRIALS = 1e-4, 40
"""Of the slope at the start of a step: where the line search ends, after so many trials at most."""


@spatial_njit(forceinline=True)
def change_at(k: int, j: int, part: int, rig: Parameters, work: Work) -> float:
    """Change of a tension of tendon j over joint k in the step, or of its wrap before or beyond."""
    pulled, step = work.pulled, work.step
    change = pulled[k, j, TIGHTENS if part == TENSION else WRAP_AHEAD + part - 1]
    for col in range(work.state.shape[1]):
        change += work.pairs[k, part, j, col] * (step[k, SLIPS + col] - step[k + 1, SLIPS + col])
    if rig.loaded:  # else the rotations are condensed
        slope = take_at(pulled, k, j, PULL if part == TENSION else WRAP_BEND + 3 * (part - 1))
        change += dot(slope, take(step, k, 0))
    return change


@spatial_njit()
def foresee(tendons: Floats, rig: Parameters, work: Work) -> None:
    """Fill net tensions, forces and limits of all guides where the step would end."""
    (n, m), guides, along = work.state.shape, work.guides, work.along
    for j in range(m):
        near = -tendons[j] * work.step[0, SLIPS + j]
        beyond = 0.0
        for k in range(n):
            far, wraps = change_at(k, j, TENSION, rig, work), 0.0
            if rig.capstan > 0.0:
                wraps = change_at(k, j, WRAPS, rig, work) + beyond
                beyond = change_at(k, j, WRAPS + 1, rig, work)
            limit = guides[k, j, LIMIT] + guides[k, j, RATIO] * (near + far) + guides[k, j, WRAPPED] * wraps
            along[k, j, THERE] = guides[k, j, NET] + near - far - guides[k, j, VISCOUS] * work.step[k, SLIPS + j]
            along[k, j, THERE + 1] = guides[k, j, FORCE] + guides[k, j, HELD] * work.step[k, SLIPS + j]
            along[k, j, THERE + 2] = max(limit, 0.0)
            near = far


@spatial_njit()
def agrees(rig: Parameters, work: Work) -> bool:
    """Whether all states are those of the forces at the end of the step."""
    along, state = work.along, work.state
    for k in range(state.shape[0]):
        for j in range(state.shape[1]):
            if next_state(state[k, j], along[k, j, THERE + 1], along[k, j, THERE + 2], rig.tolerance) != state[k, j]:
                return False
    return True


@spatial_njit()
def slope_at(part: float, work: Work) -> float:
    """Slope of the energy along the step from where it starts, at a part of it."""
    (n, m), along, total = work.state.shape, work.along, 0.0
    for k in range(n):
        for j in range(m):
            net = along[k, j, HERE] + part * (along[k, j, THERE] - along[k, j, HERE])
            force = along[k, j, HERE + 1] + part * (along[k, j, THERE + 1] - along[k, j, HERE + 1])
            limit = along[k, j, HERE + 2] + part * (along[k, j, THERE + 2] - along[k, j, HERE + 2])
            total -= (net - min(max(force, -limit), limit)) * (work.step[k, SLIPS + j] - work.kept[k, SLIPS + j])
    return total


@spatial_njit()
def part_down(work: Work) -> float:
    """Part of the step that leads down, to where the slope has become small (regula falsi, Illinois)."""
    start, end = slope_at(0.0, work), slope_at(1.0, work)
    if start >= 0.0 or end <= -LEVEL * start:
        return 1.0
    low, high, below, above, part, last = 0.0, 1.0, start, end, 1.0, 0.0
    for _ in range(TRIALS):
        part = (low * above - high * below) / (above - below)
        slope = slope_at(part, work)
        if abs(slope) <= -LEVEL * start:
            break
        if slope < 0.0:
            above *= 0.5 if last < 0.0 else 1.0
            low, below = part, slope
        else:
            below *= 0.5 if last > 0.0 else 1.0
            high, above = part, slope
        last = slope
    return part


@spatial_njit()
def go_part(part: float, work: Work) -> None:
    """Go a part of the step, and give every guide the state of its force there.

    The whole step does not depend on where it starts, which may be nowhere yet.
    """
    (n, m), along = work.state.shape, work.along
    for k in range(n):
        for i in range(SLIPS + m):
            start, end = work.kept[k, i], work.step[k, i]
            work.kept[k, i] = end if part == 1.0 else start + part * (end - start)
        for j in range(m):
            for i in range(3):
                start, end = along[k, j, HERE + i], along[k, j, THERE + i]
                along[k, j, HERE + i] = end if part == 1.0 else start + part * (end - start)
            force, limit = along[k, j, HERE + 1], along[k, j, HERE + 2]
            work.state[k, j] = math.copysign(1.0, force) if abs(force) > limit else 0.0
            take_state(k, j, work)


@spatial_njit()
def solve_again(x: Floats, tendons: Floats, rig: Parameters, dead: float, work: Work) -> None:
    """Solve once more, guides having changed."""
    if rig.loaded:
        balance_rings(rig, dead, work)  # writes the right-hand sides
        step_by_spins(x, tendons, rig, dead, work)
    else:
        solve_slips(tendons, work)
    foresee(tendons, rig, work)


@spatial_njit()
def settle(x: Floats, tendons: Floats, rig: Parameters, dead: float, work: Work) -> int:
    """Change states until they agree with the end of the step; returns how often.

    Where they do not, the step ends at the lowest point.
    """
    for turn in range(TURNS):
        if agrees(rig, work):
            return turn
        go_part(1.0 if turn == 0 else part_down(work), work)
        solve_again(x, tendons, rig, dead, work)
    if not agrees(rig, work):
        go_part(part_down(work), work)
        for k in range(work.state.shape[0]):
            for i in range(work.step.shape[1]):
                work.step[k, i] = work.kept[k, i]
    return TURNS


@spatial_njit()
def step_with_states(x: Floats, tendons: Floats, rig: Parameters, dead: float, work: Work, changes: bool) -> int:
    """Fill the Newton step of rotations and slips; if ``changes``, guides change until their states agree with it.

    ``tendons``: slopes of the tensions between wheel and base, (m,). Returns how often equations were solved.
    """
    if rig.loaded:
        step_by_spins(x, tendons, rig, dead, work)
    else:
        step_by_slips(tendons, rig, work)
    if not changes:
        return 1
    foresee(tendons, rig, work)
    return 1 + settle(x, tendons, rig, dead, work)
