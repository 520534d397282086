"""One equilibrium of a wrist in space by Newton's method, compiled: the method of the planar chain.

Guides stick or slide. The first step keeps that, and from then on guides change within the steps
(:mod:`fem_models.spatial.kernels.settle`).
"""

from __future__ import annotations

import math
from typing import NamedTuple

from fem_models.spatial.kernels.compiled import spatial_njit
from fem_models.spatial.kernels.guides import balance_guides, free_spans
from fem_models.spatial.kernels.joint import Work, bend_joint, follow_displacements
from fem_models.spatial.kernels.loaded import balance_rings, place_rings
from fem_models.spatial.kernels.settle import step_with_states
from fem_models.spatial.kernels.vectors import LARGEST_TURN, dot, take
from fem_models.spatial.parameters import Memory, Parameters
from fem_models.spatial.tables import MOMENT, OFF, SLOPE
from hysteresis.arrays import Floats

LARGEST_ROTATION = 0.02  # rad of a joint in a step of Newton's method, lest tendons fall slack meanwhile


class Attempt(NamedTuple):
    """How Newton's method tries a step.

    ``dead``: part of weights and force at the tip. ``fine``: a step that is not may not let a tendon begin to slide at
    the base. ``relax``: over the pseudo-time of a step of a jump, else 0 (:mod:`fem_models.spatial.kernels.jump`).
    """

    dead: float
    iterations: int
    fine: bool
    relax: float


@spatial_njit()
def base_slides(before: Floats, state: Floats) -> bool:
    """Whether a tendon has begun to slide at the base, or to slide in the other direction; states (N, m)."""
    for j in range(state.shape[1]):  # noqa: SIM110 - compiled
        if state[0, j] != 0.0 and state[0, j] != before[0, j]:
            return True
    return False


@spatial_njit()
def balance_at(
    x: Floats, tendons: Floats, rig: Parameters, memory: Memory, work: Work, dead: float, settle: bool, relax: float
) -> float:
    """Fill forces and slopes at x, and return the largest residual, N; nan where there is none.

    ``tendons`` as of :func:`fem_models.spatial.kernels.guides.free_spans`, ``settle`` as of
    :func:`fem_models.spatial.kernels.guides.balance_guides`; ``dead`` and ``relax`` as of :class:`Attempt`.
    """
    n, bent = rig.joints.shape[0], work.bent
    free_spans(x, tendons, rig, work.tension)
    largest, total, turns = 0.0, 0.0, 0.0
    for k in range(n):
        bend_joint(k, x, rig, memory, work, relax)
        for i in range(3):
            largest = max(largest, abs(bent[k, OFF + i]) * rig.stiffest)
            turns = max(turns, abs(bent[k, MOMENT + i]))
            total += bent[k, OFF + i] + bent[k, MOMENT + i]
    if rig.loaded:
        place_rings(x, rig, dead, work)
        turns = balance_rings(rig, dead, work)
    largest = max(largest, rig.by_arm * turns, balance_guides(x, rig, memory, work, settle, relax))
    return largest if total == total else math.nan  # a maximum does not see nan


@spatial_njit()
def newton(
    x: Floats, tendons: Floats, rig: Parameters, memory: Memory, work: Work, before: Floats, attempt: Attempt
) -> int:
    """Solve for the equilibrium from x, and return the iterations it took, below 0 without one; x changes either way.

    ``before`` are the states of the guides, (N, m), at the last equilibrium. In the first iteration the guides keep
    the states they come with, which x may not agree with yet. A step that is not fine is given up where a tendon
    begins to slide at the base: the work of the drive has a corner there.
    """
    (n, m), step = work.state.shape, work.step
    for iteration in range(attempt.iterations):
        largest = balance_at(x, tendons, rig, memory, work, attempt.dead, iteration > 0, attempt.relax)
        if iteration > 0 and not attempt.fine and base_slides(before, work.state):
            return -iteration
        if largest <= rig.tolerance:
            return iteration
        if not largest < 1e9 * rig.scale:
            return -iteration - 1
        step_with_states(x, tendons[SLOPE], rig, attempt.dead, work, iteration > 0)
        follow_displacements(work, n, m)
        most = 0.0
        for k in range(n):
            most = max(most, dot(take(step, k, 0), take(step, k, 0)))
        most = math.sqrt(most)
        part = min(1.0, LARGEST_ROTATION / most) if most > 0.0 else 1.0
        for k in range(n):
            for i in range(x.shape[1]):
                x[k, i] += part * step[k, i]
            if dot(take(x, k, 0), take(x, k, 0)) > LARGEST_TURN**2:
                return -iteration - 1
    return -attempt.iterations
