"""Guides and the free span of the tendons, compiled: tensions, dry friction, its states.

The laws are those of the planar chain: a bristle that carries up to the capstan's force and a constant one, with return
mapping (docs/theory/multibody.md). The wrap of a tendon is its turn in space. Guide k is on the ring before joint k.
"""

from __future__ import annotations

import math

from fem_models.spatial.kernels.compiled import spatial_njit
from fem_models.spatial.kernels.joint import Work
from fem_models.spatial.parameters import Memory, Parameters
from fem_models.spatial.tables import (
    BRISTLE,
    BY_FORCE,
    BY_SLIP,
    BY_TENSION,
    BY_WRAP,
    FORCE,
    FREE,
    GUESS,
    HELD,
    LIMIT,
    NET,
    NEXT_DRIVE,
    OPEN,
    PRELOAD,
    RATIO,
    SEGMENT,
    SLIPS,
    SLOPE,
    TOE,
    UNBALANCED,
    VISCOUS,
    WRAP,
    WRAPPED,
)
from hysteresis.arrays import Floats

OPEN_STIFFNESS = 1e-9  # of EA/pitch, in the tangent only: a slack tendon past a sliding guide leaves the slip open


@spatial_njit()
def free_tension(stretch: float, stiffness: float, toe: float, preload: float, guess: float) -> tuple[float, float]:
    """Tension and slope of a tendon between wheel and base; unilateral where it has no toe region."""
    if toe == 0.0:
        tension = preload + stiffness * stretch
        return (tension, stiffness) if tension > 0.0 else (0.0, 0.0)
    target = preload + toe * math.log(preload) + stiffness * stretch
    y = math.log(max(guess, 1e-300))
    for _ in range(100):  # Newton on exp(y) + toe y, convex and increasing
        e = math.exp(min(y, 700.0))
        step = max((e + toe * y - target) / (e + toe), -2.0)
        y -= step
        if abs(step) < 1e-15 * (1.0 + abs(y)):
            break
    tension = math.exp(y)
    return tension, stiffness * tension / (tension + toe)


@spatial_njit(forceinline=True)
def next_state(state: float, force: float, limit: float, tolerance: float) -> float:
    """State of a guide whose bristle would carry a force; one that slides sticks before it slides the other way."""
    if state == 0.0:
        return math.copysign(1.0, force) if abs(force) > limit + tolerance else 0.0
    return 0.0 if force * state < limit - tolerance else state


@spatial_njit()
def free_spans(x: Floats, tendons: Floats, rig: Parameters, tension: Floats) -> None:
    """Fill the tensions between wheel and base: given, or of what the wheel winds in.

    ``tendons`` are those of :class:`fem_models.spatial.kernels.follow.Motion`: drives, and slopes of the tensions.
    """
    own = rig.tendons
    for j in range(own.shape[0]):
        drive = tendons[NEXT_DRIVE, j]
        if own[j, BY_FORCE] == 1.0:
            tension[j, 0], tendons[SLOPE, j] = drive, 0.0
        else:
            start = max(tension[j, 0], 0.01 * tendons[GUESS, j])
            wound = drive - x[0, SLIPS + j]
            tension[j, 0], tendons[SLOPE, j] = free_tension(wound, own[j, FREE], own[j, TOE], own[j, PRELOAD], start)


@spatial_njit(forceinline=True)
def take_state(k: int, j: int, work: Work) -> None:
    """Fill what is out of balance at a guide in its state, and the slopes."""
    guides, state = work.guides, work.state[k, j]
    slides = state != 0.0
    guides[k, j, UNBALANCED] = guides[k, j, NET] - (state * guides[k, j, LIMIT] if slides else guides[k, j, FORCE])
    guides[k, j, BY_TENSION] = state * guides[k, j, RATIO]
    guides[k, j, BY_SLIP] = guides[k, j, OPEN] + (0.0 if slides else guides[k, j, HELD])
    guides[k, j, BY_WRAP] = state * guides[k, j, WRAPPED]


@spatial_njit()
def balance_guides(x: Floats, rig: Parameters, memory: Memory, work: Work, settle: bool, relax: float) -> float:
    """Fill residuals and slopes of all guides, and return the largest residual.

    With ``settle`` a guide sticks or slides first, by its force. A state that contradicts the force even so counts as
    a residual above the tolerance. Viscous forces of a jump, ``relax`` as of an attempt, take part of the tension.
    """
    n, m = work.state.shape
    largest, half_mu, guides = 0.0, 0.5 * rig.capstan, work.guides
    viscous = relax * rig.viscosity * rig.by_arm**2
    for k in range(n):
        constant = rig.guide + rig.sheath if k == 0 else rig.guide
        for j in range(m):
            near, far, ratio = work.tension[j, k], work.tension[j, k + 1], 0.0
            if rig.capstan > 0.0:
                before = work.pulled[k - 1, j, WRAP + 1] if k > 0 else rig.rest_wrap
                ratio = math.tanh(half_mu * (work.pulled[k, j, WRAP] + before))
            total, bristle = near + far, rig.crossings[k, j, BRISTLE]
            force, limit = bristle * (x[k, SLIPS + j] - memory.guides[k, j]), constant + total * ratio
            if rig.capstan == 0.0 and constant == 0.0:  # without friction it neither sticks nor slides
                bristle = force = 0.0
            state = work.state[k, j]
            if settle:
                state = next_state(state, force, limit, rig.tolerance)
                work.state[k, j] = state
            guides[k, j, LIMIT], guides[k, j, NET], guides[k, j, VISCOUS] = limit, near - far, viscous
            if viscous > 0.0:
                guides[k, j, NET] -= viscous * (x[k, SLIPS + j] - work.before[k, SLIPS + j])
            guides[k, j, FORCE], guides[k, j, HELD] = force, bristle
            guides[k, j, RATIO], guides[k, j, WRAPPED] = ratio, total * half_mu * (1.0 - ratio * ratio)
            guides[k, j, OPEN] = OPEN_STIFFNESS * rig.crossings[k, j, SEGMENT] + viscous
            take_state(k, j, work)
            largest = max(largest, abs(guides[k, j, UNBALANCED]))
            if next_state(state, force, limit, rig.tolerance) != state:
                largest = max(largest, 2.0 * rig.tolerance)
    return largest
