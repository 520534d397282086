"""Guides and the free span of the tendons, compiled: tensions, dry friction, its states.

The laws are those of the planar chain: a bristle that carries up to the capstan's force and a constant one, with return
mapping (docs/theory/multibody.md). The wrap of a tendon is its turn in space.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from fem_models.spatial.compiled import spatial_njit
from fem_models.spatial.joint import Joints
from fem_models.spatial.parameters import Memory, Parameters
from hysteresis.arrays import Floats

OPEN_STIFFNESS = 1e-9  # of EA/pitch, in the tangent only: a slack tendon past a sliding guide leaves the slip open


class Load(NamedTuple):
    """What acts at one point of the path."""

    drive: Floats  # (m,), mm or N
    dead: float  # of weights and force at the tip


class Guides(NamedTuple):
    """Guides at one place of the unknowns; guide k is on the ring before joint k."""

    state: Floats  # (N, m): 0 sticks, 1 or -1 slides, the sign being that of the friction
    limit: Floats  # (N, m)
    off: Floats  # (N, m), residual: tension before less tension beyond less friction, N
    by_tension: Floats  # (N, m), slopes of the friction: in both tensions,
    by_slip: Floats  # (N, m) in the slip,
    by_wrap: Floats  # (N, m) in the wrap
    free: Floats  # (m,), slopes of the tensions between wheel and base in what is wound in
    guess: Floats  # (m,), tensions between wheel and base to start from


@spatial_njit(allocates=True)
def guides_space(rig: Parameters) -> Guides:
    """Arrays for the guides of a rig; its tensions are guessed to be the preload."""
    shape = rig.bristle.shape
    return Guides(
        state=np.zeros(shape),
        limit=np.zeros(shape),
        off=np.zeros(shape),
        by_tension=np.zeros(shape),
        by_slip=np.zeros(shape),
        by_wrap=np.zeros(shape),
        free=np.zeros(shape[1]),
        guess=rig.preload.copy(),
    )


@spatial_njit()
def free_tension(j: int, stretch: float, rig: Parameters, guess: float) -> tuple[float, float]:
    """Tension and slope of tendon j between wheel and base; unilateral where it has no toe region."""
    stiffness, toe, preload = rig.free[j], rig.toe[j], rig.preload[j]
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
def free_spans(x: Floats, load: Load, rig: Parameters, joints: Joints, guides: Guides) -> None:
    """Fill the tensions between wheel and base: given, or of what the wheel winds in."""
    for j in range(rig.free.size):
        if rig.by_force[j] == 1.0:
            joints.tension[j, 0], guides.free[j] = load.drive[j], 0.0
        else:
            start = max(joints.tension[j, 0], 0.01 * guides.guess[j])
            tension, slope = free_tension(j, load.drive[j] - x[0, 6 + j], rig, start)
            joints.tension[j, 0], guides.free[j] = tension, slope


@spatial_njit()
def balance_guides(
    x: Floats, rig: Parameters, memory: Memory, joints: Joints, guides: Guides, settle: bool
) -> float:
    """Fill residuals and slopes of all guides, and return the largest residual.

    With ``settle`` a guide sticks or slides first, by its force. A state that contradicts the force even so counts as
    a residual above the tolerance.
    """
    n, m = rig.bristle.shape
    largest, half_mu = 0.0, 0.5 * rig.capstan
    for k in range(n):
        constant = rig.guide + rig.sheath if k == 0 else rig.guide
        for j in range(m):
            near, far, ratio = joints.tension[j, k], joints.tension[j, k + 1], 0.0
            if rig.capstan > 0.0:
                wrap = joints.wrap[k, j, 0] + (joints.wrap[k - 1, j, 1] if k > 0 else rig.rest_wrap)
                ratio = math.tanh(half_mu * wrap)
            total, bristle = near + far, rig.bristle[k, j]
            force, limit = bristle * (x[k, 6 + j] - memory.guides[k, j]), constant + total * ratio
            if rig.capstan == 0.0 and constant == 0.0:  # without friction it neither sticks nor slides
                bristle = force = 0.0
            state = guides.state[k, j]
            if settle:
                state = next_state(state, force, limit, rig.tolerance)
                guides.state[k, j] = state
            guides.limit[k, j] = limit
            slides = state != 0.0
            guides.by_tension[k, j] = state * ratio
            guides.by_slip[k, j] = OPEN_STIFFNESS * rig.segment[k, j] + (0.0 if slides else bristle)
            guides.by_wrap[k, j] = state * total * half_mu * (1.0 - ratio * ratio)
            off = near - far - (state * limit if slides else force)
            guides.off[k, j] = off
            largest = max(largest, abs(off))
            if next_state(state, force, limit, rig.tolerance) != state:
                largest = max(largest, 2.0 * rig.tolerance)
    return largest
