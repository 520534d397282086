"""One Newton step of a wrist without dead loads, compiled: rotations condensed, then blocks of the tendons' slips.

A joint sees the stretches of the tendons that cross it alone. Its balance gives its rotation by them, and the balances
of the guides are a block tridiagonal system, with a block of m x m for m tendons.
"""

from __future__ import annotations

from fem_models.spatial.blocks import Blocks, solve_blocks
from fem_models.spatial.compiled import spatial_njit
from fem_models.spatial.guides import Guides
from fem_models.spatial.joint import Joints
from fem_models.spatial.parameters import Parameters
from fem_models.spatial.vectors import dot, inverse, put, put_at, scaled, times, two, vector, vector_at
from hysteresis.arrays import Floats


@spatial_njit()
def condense_rotation(k: int, rig: Parameters, joints: Joints) -> None:
    """Let the rotation of joint k follow the stretches; ``bend`` and ``pull`` turn into its slopes."""
    m = rig.free.size
    for i in range(3):
        for l in range(3):
            joints.solve[i, l] = joints.bend[k, i, l]
    inverse(joints.solve, joints.inverse)
    moment = two(1.0, vector(joints.moment, k), 1.0, vector(joints.moved, k))
    ahead = scaled(-1.0, times(joints.inverse, moment))
    put(joints.follow_ahead, k, ahead)
    for l in range(m):
        turned = scaled(-1.0, times(joints.inverse, vector_at(joints.pull, k, l)))
        put_at(joints.follow, k, l, turned)
        for j in range(m):
            joints.pair[k, j, l] += dot(vector_at(joints.pull, k, j), turned)
            if rig.capstan > 0.0:
                for side in range(2):
                    w = joints.wrap_bend
                    slope = w[k, j, side, 0], w[k, j, side, 1], w[k, j, side, 2]
                    joints.wrap_pull[k, j, side, l] += dot(slope, turned)
    for j in range(m):
        joints.ahead[k, j] += dot(vector_at(joints.pull, k, j), ahead)
        if rig.capstan > 0.0:
            for side in range(2):
                w = joints.wrap_bend
                joints.wrap_ahead[k, j, side] += dot((w[k, j, side, 0], w[k, j, side, 1], w[k, j, side, 2]), ahead)


@spatial_njit()
def step_by_slips(step: Floats, rig: Parameters, joints: Joints, guides: Guides, blocks: Blocks) -> None:
    """Fill the step of all unknowns, shape (N + 1, 6 + m), where no dead load couples the joints."""
    n, m = rig.bristle.shape
    for k in range(n):
        condense_rotation(k, rig, joints)
    for k in range(n):
        for j in range(m):
            slides, by_wrap = guides.by_tension[k, j], guides.by_wrap[k, j]
            into, out, right = 1.0 - slides, 1.0 + slides, guides.off[k, j]
            right -= out * joints.ahead[k, j] + by_wrap * joints.wrap_ahead[k, j, 0]
            for l in range(m):
                beyond = out * joints.pair[k, j, l] + by_wrap * joints.wrap_pull[k, j, 0, l]
                before = 0.0
                if k > 0:
                    before = -into * joints.pair[k - 1, j, l] + by_wrap * joints.wrap_pull[k - 1, j, 1, l]
                blocks.lower[k, j, l] = before
                blocks.upper[k, j, l] = -beyond
                blocks.diagonal[k, j, l] = beyond - before
            blocks.diagonal[k, j, j] += guides.by_slip[k, j]
            if k > 0:
                right += into * joints.ahead[k - 1, j] - by_wrap * joints.wrap_ahead[k - 1, j, 1]
            else:
                blocks.diagonal[k, j, j] += into * guides.free[j]
            blocks.right[k, j] = right
    solve_blocks(blocks)
    for k in range(n):
        for j in range(m):
            step[k, 6 + j] = blocks.right[k, j]
    for k in range(n):
        bent = vector(joints.follow_ahead, k)
        for j in range(m):
            bent = two(1.0, bent, step[k, 6 + j] - step[k + 1, 6 + j], vector_at(joints.follow, k, j))
        step[k, 0], step[k, 1], step[k, 2] = bent


@spatial_njit()
def follow_displacements(step: Floats, joints: Joints, n: int, m: int) -> None:
    """Fill the step of the notches' displacements by those of rotations and slips."""
    for k in range(n):
        bent = step[k, 0], step[k, 1], step[k, 2]
        for i in range(3):
            moved = joints.loose[k, i]
            for l in range(3):
                moved += joints.by_bend[k, i, l] * bent[l]
            for j in range(m):
                moved += joints.by_pull[k, j, i] * (step[k, 6 + j] - step[k + 1, 6 + j])
            step[k, 3 + i] = moved
