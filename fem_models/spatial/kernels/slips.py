"""One Newton step of a wrist without dead loads, compiled: rotations condensed, then blocks of the tendons' slips.

A joint sees the stretches of the tendons that cross it alone. Its balance gives its rotation by them, and the balances
of the guides are a block tridiagonal system, with a block of m x m for m tendons.
"""

from __future__ import annotations

from fem_models.spatial.kernels.blocks import solve_blocks
from fem_models.spatial.kernels.compiled import spatial_njit
from fem_models.spatial.kernels.joint import Work
from fem_models.spatial.kernels.vectors import dot, invert, put, put_at, scaled, take, take_at, times, two
from fem_models.spatial.parameters import Parameters
from fem_models.spatial.tables import (
    AHEAD,
    BEND,
    BY_SLIP,
    BY_TENSION,
    BY_WRAP,
    FOLLOW,
    INVERSE,
    MOMENT,
    PULL,
    SHIFT,
    SLIPS,
    SOLVE,
    TENSION,
    TIGHTENS,
    UNBALANCED,
    WRAP_AHEAD,
    WRAP_BEND,
    WRAPS,
)
from hysteresis.arrays import Floats


@spatial_njit()
def condense_rotation(k: int, rig: Parameters, work: Work) -> None:
    """Let the rotation of joint k follow the stretches, and the tensions and wraps with it."""
    m, pulled, scratch = rig.tendons.shape[0], work.pulled, work.scratch
    for i in range(3):
        put(scratch, SOLVE + i, 0, take(work.bent, k, BEND + 3 * i))
    invert(scratch, SOLVE, INVERSE)
    moment = two(1.0, take(work.bent, k, MOMENT), 1.0, take(work.bent, k, SHIFT))
    ahead = scaled(-1.0, times(scratch, INVERSE, moment))
    put(work.bent, k, AHEAD, ahead)
    for j in range(m):
        put_at(pulled, k, j, FOLLOW, scaled(-1.0, times(scratch, INVERSE, take_at(pulled, k, j, PULL))))
    for j in range(m):
        for part in range(3 if rig.capstan > 0.0 else 1):  # a tension, and its wraps before and beyond
            slope = take_at(pulled, k, j, PULL if part == 0 else WRAP_BEND + 3 * (part - 1))
            for col in range(m):
                work.pairs[k, part, j, col] += dot(slope, take_at(pulled, k, col, FOLLOW))
            pulled[k, j, TIGHTENS if part == 0 else WRAP_AHEAD + part - 1] += dot(slope, ahead)


@spatial_njit()
def step_by_slips(tendons: Floats, rig: Parameters, work: Work) -> None:
    """Fill the step of rotations and slips, where no dead load couples the joints.

    ``tendons``: slopes of the tensions between wheel and base, (m,).
    """
    for k in range(work.state.shape[0]):
        condense_rotation(k, rig, work)
    solve_slips(tendons, work)


@spatial_njit()
def solve_slips(tendons: Floats, work: Work) -> None:
    """Fill the step of rotations, which are condensed, and slips with guides in their states."""
    m = work.state.shape[1]
    if m == 4:  # a number that is compiled: half the time
        fill_blocks(tendons, work, 4)
    elif m == 2:
        fill_blocks(tendons, work, 2)
    else:
        fill_blocks(tendons, work, m)
    solve_blocks(work.blocks, m)
    follow_slips(work)


@spatial_njit(forceinline=True)
def fill_blocks(tendons: Floats, work: Work, m: int) -> None:
    """Write the equations of the slips, m at each guide."""
    guides, pairs, pulled, blocks = work.guides, work.pairs, work.pulled, work.blocks
    for k in range(work.state.shape[0]):
        for j in range(m):
            by_wrap = guides[k, j, BY_WRAP]
            into, out, right = 1.0 - guides[k, j, BY_TENSION], 1.0 + guides[k, j, BY_TENSION], guides[k, j, UNBALANCED]
            right -= out * pulled[k, j, TIGHTENS] + by_wrap * pulled[k, j, WRAP_AHEAD]
            for col in range(m):
                beyond = out * pairs[k, TENSION, j, col] + by_wrap * pairs[k, WRAPS, j, col]
                blocks[k, j, col] = 0.0
                blocks[k, j, m + col] = beyond
                blocks[k, j, 2 * m + col] = -beyond
            if k > 0:
                right += into * pulled[k - 1, j, TIGHTENS] - by_wrap * pulled[k - 1, j, WRAP_AHEAD + 1]
                for col in range(m):
                    before = by_wrap * pairs[k - 1, WRAPS + 1, j, col] - into * pairs[k - 1, TENSION, j, col]
                    blocks[k, j, col] = before
                    blocks[k, j, m + col] -= before
            else:
                blocks[k, j, m + j] += into * tendons[j]
            blocks[k, j, m + j] += guides[k, j, BY_SLIP]
            blocks[k, j, 3 * m] = right


@spatial_njit(forceinline=True)
def follow_slips(work: Work) -> None:
    """Take the slips from the blocks, and let the rotations follow."""
    (n, m), blocks, step = work.state.shape, work.blocks, work.step
    for k in range(n - 1, -1, -1):
        bent = take(work.bent, k, AHEAD)
        for j in range(m):
            step[k, SLIPS + j] = blocks[k, j, 3 * m]
            bent = two(1.0, bent, step[k, SLIPS + j] - step[k + 1, SLIPS + j], take_at(work.pulled, k, j, FOLLOW))
        put(step, k, 0, bent)
