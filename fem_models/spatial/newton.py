"""One equilibrium of a wrist in space by Newton's method, compiled: the method of the planar chain.

Guides stick or slide, and a Newton step keeps that; states follow from the forces between the steps.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from fem_models.spatial.blocks import Blocks, blocks_space
from fem_models.spatial.compiled import spatial_njit
from fem_models.spatial.guides import Guides, Load, balance_guides, free_spans, guides_space
from fem_models.spatial.joint import Joints, bend_joint, joints_space
from fem_models.spatial.loaded import Rings, balance_rings, place_rings, rings_space, step_by_spins
from fem_models.spatial.parameters import Memory, Parameters
from fem_models.spatial.slips import follow_displacements, step_by_slips
from fem_models.spatial.vectors import LARGEST_TURN, dot, vector
from hysteresis.arrays import Floats

LARGEST_ROTATION = 0.02  # rad of a joint in a step of Newton's method, lest tendons fall slack meanwhile


class Work(NamedTuple):
    """Scratch and results of one equilibrium."""

    joints: Joints
    guides: Guides
    rings: Rings
    blocks: Blocks
    step: Floats  # (N + 1, 6 + m)


class Attempt(NamedTuple):
    """How Newton's method tries a step.

    ``fine``: a step that is not may not let a tendon begin to slide at the base.
    """

    iterations: int
    fine: bool


@spatial_njit(allocates=True)
def work_space(rig: Parameters) -> Work:
    """Arrays for a rig."""
    n, m = rig.bristle.shape
    blocks = blocks_space(n + 1, 3 + m) if rig.loaded else blocks_space(n, m)
    return Work(joints_space(n, m), guides_space(rig), rings_space(n), blocks, np.zeros((n + 1, 6 + m)))


@spatial_njit()
def base_slides(before: Floats, state: Floats) -> bool:
    """Whether a tendon has begun to slide at the base, or to slide in the other direction; states (N, m)."""
    for j in range(state.shape[1]):  # noqa: SIM110 - compiled
        if state[0, j] != 0.0 and state[0, j] != before[0, j]:
            return True
    return False


@spatial_njit()
def balance_at(x: Floats, rig: Parameters, memory: Memory, load: Load, work: Work, settle: bool) -> float:
    """Fill forces and slopes at x, and return the largest residual, N; nan where there is none.

    ``settle`` as of :func:`fem_models.spatial.guides.balance_guides`.
    """
    n, joints = rig.turning.size, work.joints
    free_spans(x, load, rig, joints, work.guides)
    largest, total = 0.0, 0.0
    for k in range(n):
        bend_joint(k, x, rig, memory, joints)
        for i in range(3):
            largest = max(largest, abs(joints.off[k, i]) * rig.stiffest)
            total += joints.off[k, i] + joints.moment[k, i]
    if rig.loaded:
        place_rings(x, rig, joints, work.rings)
        largest = max(largest, rig.by_arm * balance_rings(rig, load.dead, work.rings, work.blocks))
    else:
        for k in range(n):
            for i in range(3):
                largest = max(largest, rig.by_arm * abs(joints.moment[k, i]))
    largest = max(largest, balance_guides(x, rig, memory, joints, work.guides, settle))
    return largest if total == total else np.nan  # a maximum does not see nan


@spatial_njit(error_model="python")  # a zero pivot raises ZeroDivisionError
def newton(
    x: Floats, rig: Parameters, memory: Memory, load: Load, work: Work, before: Floats, attempt: Attempt
) -> int:
    """Solve for the equilibrium from x, and return the iterations it took, or -1; x is changed in either case.

    ``before`` are the states of the guides, (N, m), at the last equilibrium. In the first iteration the guides keep
    the states they come with, which x may not agree with yet. A step that is not fine is given up where a tendon
    begins to slide at the base: the work of the drive has a corner there.
    """
    n, m = rig.bristle.shape
    step = work.step
    for iteration in range(attempt.iterations):
        largest = balance_at(x, rig, memory, load, work, iteration > 0)
        if iteration > 0 and not attempt.fine and base_slides(before, work.guides.state):
            return -1
        if largest <= rig.tolerance:
            return iteration
        if not largest < 1e9 * rig.scale:
            return -1
        if rig.loaded:
            step_by_spins(x, step, rig, load.dead, work.joints, work.guides, work.rings, work.blocks)
        else:
            step_by_slips(step, rig, work.joints, work.guides, work.blocks)
        follow_displacements(step, work.joints, n, m)
        most = 0.0
        for k in range(n):
            most = max(most, dot(vector(step, k), vector(step, k)))
        most = np.sqrt(most)
        part = min(1.0, LARGEST_ROTATION / most) if most > 0.0 else 1.0
        for k in range(n):
            for i in range(6 + m):
                x[k, i] += part * step[k, i]
            if dot(vector(x, k), vector(x, k)) > LARGEST_TURN**2:
                return -1
    return -1
