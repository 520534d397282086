"""Dead loads in space, and the Newton step of a wrist that carries them, compiled.

Weight turns every joint as any joint beyond or before it turns: by the rotation vectors of the joints the tangent is
full. By the spins alpha of the rings in space it has neighbours only. The moment of a joint in space is
m = B Jl^-T(phi) g, with B the frame before it, g the gradient in phi and Jl the left Jacobian of the rotation, and
delta phi = Jl^-1 B^T (alpha of the ring beyond less alpha of the ring before).
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from fem_models.spatial.blocks import Blocks, solve_blocks
from fem_models.spatial.compiled import spatial_njit
from fem_models.spatial.guides import Guides
from fem_models.spatial.joint import Joints
from fem_models.spatial.parameters import Parameters
from fem_models.spatial.vectors import (
    Vector,
    add_one,
    add_outer,
    cross,
    dot,
    put,
    scaled,
    three,
    times,
    times_t,
    turn_by,
    two,
    vector,
    vector_at,
)
from hysteresis.arrays import Floats


class Rings(NamedTuple):
    """Rings in space under dead loads."""

    frame: Floats  # (N + 1, 3, 3): of the rings, the base first
    before: Floats  # (N, 3, 3): frame of a notch on the ring before it, B
    spin: Floats  # (N, 3, 3): delta phi by the spins, Jl^-1 B^T
    moment: Floats  # (N, 3): of the joints, in space
    weight_arm: Floats  # (N, 3): arm of one ring's weight on the ring beyond a joint
    tip_arm: Floats  # (N, 3): of the force at the tip
    full: Floats  # (3, 3) scratch
    half: Floats  # (3, 3)


@spatial_njit(allocates=True)
def rings_space(n: int) -> Rings:
    """Arrays for N joints; the base is the frame of the tube."""
    frame = np.zeros((n + 1, 3, 3))
    frame[:] = np.eye(3)
    cube = (n, 3, 3)
    return Rings(
        frame=frame,
        before=np.zeros(cube),
        spin=np.zeros(cube),
        moment=np.zeros((n, 3)),
        weight_arm=np.zeros((n, 3)),
        tip_arm=np.zeros((n, 3)),
        full=np.zeros((3, 3)),
        half=np.zeros((3, 3)),
    )


@spatial_njit()
def jacobian_terms(angle_2: float) -> tuple[float, float]:
    """Coefficient c of Jl^-1 = 1 - [phi]x/2 + c [phi]x^2, and its derivative in phi.phi.

    c = (1 - (t/2) cot(t/2))/t^2, t = |phi| (Bullo and Murray 1995).
    """
    if angle_2 < 4e-3:
        y = angle_2
        return 1 / 12 + y * (1 / 720 + y * (1 / 30240 + y / 1209600)), 1 / 720 + y * (2 / 30240 + y * 3 / 1209600)
    half = 0.5 * math.sqrt(angle_2)
    cot = math.cos(half) / math.sin(half)
    c = (1.0 - half * cot) / angle_2
    by_half = half / math.sin(half) ** 2 - cot  # slope of 1 - h cot h in h
    return c, (by_half / (8.0 * half) - c) / angle_2


@spatial_njit()
def place_rings(x: Floats, rig: Parameters, joints: Joints, rings: Rings) -> None:
    """Fill frames of rings and notches, and the moments of the joints in space."""
    frame, before = rings.frame, rings.before
    for k in range(rig.turning.size):
        cs, sn = rig.turn[k, 0], rig.turn[k, 1]
        for i in range(3):
            before[k, i, 0] = frame[k, i, 0]
            before[k, i, 1] = cs * frame[k, i, 1] + sn * frame[k, i, 2]
            before[k, i, 2] = cs * frame[k, i, 2] - sn * frame[k, i, 1]
        phi = x[k, 0], x[k, 1], x[k, 2]
        turn = turn_by(phi)
        c, _ = jacobian_terms(turn.s)
        for i in range(3):  # row i of B times the rotation: the row turned back
            row = before[k, i, 0], before[k, i, 1], before[k, i, 2]
            around = cross(phi, row)
            bent = three(1.0 - turn.b * turn.s, row, -turn.a, around, turn.b * dot(phi, row), phi)
            frame[k + 1, i, 0] = bent[0]
            frame[k + 1, i, 1] = cs * bent[1] - sn * bent[2]
            frame[k + 1, i, 2] = cs * bent[2] + sn * bent[1]
            # column i of Jl^-1 B^T: Jl^-1 times row i of B
            spun = three(1.0 - c * turn.s, row, -0.5, around, c * dot(phi, row), phi)
            rings.spin[k, 0, i], rings.spin[k, 1, i], rings.spin[k, 2, i] = spun
        put(rings.moment, k, times_t(rings.spin[k], vector(joints.moment, k)))


@spatial_njit()
def balance_rings(rig: Parameters, dead: float, rings: Rings, blocks: Blocks) -> float:
    """Fill residuals of all rings as right-hand sides, and return the largest moment of a joint that is off, Nmm."""
    n = rig.turning.size
    carried, largest = (0.0, 0.0, 0.0), 0.0
    weight, tip = (rig.weight[0], rig.weight[1], rig.weight[2]), (rig.tip[0], rig.tip[1], rig.tip[2])
    for k in range(n - 1, -1, -1):
        beyond, step, half = float(n - 1 - k), vector(rig.step, k), vector(rig.half, k)
        arm = times(rings.frame[k + 1], two(1.0, half, beyond, step))
        reach = times(rings.frame[k + 1], step if k < n - 1 else half)
        put(rings.weight_arm, k, arm)
        put(rings.tip_arm, k, reach)
        own = two(dead, cross(arm, weight), dead, cross(reach, tip))
        carried = two(1.0, carried, 1.0, own)
        off = two(1.0, vector(rings.moment, k), -1.0, carried)
        largest = max(largest, math.sqrt(dot(off, off)))
        missing = two(1.0, own, -1.0, vector(rings.moment, k))
        if k < n - 1:
            missing = two(1.0, missing, 1.0, vector(rings.moment, k + 1))
        for i in range(3):
            blocks.right[k + 1, i] = missing[i]
    return largest


@spatial_njit()
def load_slopes(k: int, dead: float, rig: Parameters, rings: Rings, blocks: Blocks) -> None:
    """Add the slope of the loads' moment on the ring beyond joint k in its spin: -(a W^T - (a.W) 1)."""
    for pair in range(2):
        arm = vector(rings.tip_arm, k) if pair == 1 else vector(rings.weight_arm, k)
        force = (rig.tip[0], rig.tip[1], rig.tip[2])
        if pair == 0:
            force = (rig.weight[0], rig.weight[1], rig.weight[2])
        along = dead * dot(arm, force)
        for i in range(3):
            for l in range(3):
                blocks.diagonal[k + 1, i, l] -= dead * arm[i] * force[l]
            blocks.diagonal[k + 1, i, i] += along


@spatial_njit()
def joint_slopes(k: int, x: Floats, joints: Joints, rings: Rings) -> None:
    """Fill the slope of the moment of joint k, in space, in the spin of the ring beyond it less that before: ``full``.

    delta m = alpha x m + B (D + Jl^-T H) delta phi, with D = d(Jl^-T g)/d phi at a fixed g and H the slope of g.
    """
    full, half = rings.full, rings.half
    phi, g = (x[k, 0], x[k, 1], x[k, 2]), vector(joints.moment, k)
    c, slope = jacobian_terms(dot(phi, phi))
    around = cross(phi, g)
    for i in range(3):
        for l in range(3):
            half[i, l] = 0.0
    add_one(half, c * dot(phi, g))
    add_outer(half, 1.0, phi, two(c, g, 0.0, g))
    add_outer(half, 1.0, two(-2.0 * c, g, 2.0 * slope, cross(phi, around)), phi)
    half[0, 1] += 0.5 * g[2]  # -[g]x/2
    half[0, 2] -= 0.5 * g[1]
    half[1, 0] -= 0.5 * g[2]
    half[1, 2] += 0.5 * g[0]
    half[2, 0] += 0.5 * g[1]
    half[2, 1] -= 0.5 * g[0]
    for i in range(3):
        for l in range(3):  # B D + (Jl^-1 B^T)^T H
            full[i, l] = 0.0
            for c_ in range(3):
                full[i, l] += rings.before[k, i, c_] * half[c_, l] + rings.spin[k, c_, i] * joints.bend[k, c_, l]
    for i in range(3):
        row = full[i, 0], full[i, 1], full[i, 2]
        for l in range(3):
            half[i, l] = row[0] * rings.spin[k, 0, l] + row[1] * rings.spin[k, 1, l] + row[2] * rings.spin[k, 2, l]
    for i in range(3):
        for l in range(3):
            full[i, l] = half[i, l]


@spatial_njit()
def add_joint(k: int, x: Floats, rig: Parameters, joints: Joints, rings: Rings, blocks: Blocks) -> None:
    """Add joint k to the rows of both its rings: moments by spins and slips."""
    m, moment = rig.free.size, vector(rings.moment, k)
    joint_slopes(k, x, joints, rings)
    lower, diagonal, upper, right = blocks.lower, blocks.diagonal, blocks.upper, blocks.right
    moved = times_t(rings.spin[k], vector(joints.moved, k))
    for i in range(3):
        unit = (1.0 if i == 0 else 0.0), (1.0 if i == 1 else 0.0), (1.0 if i == 2 else 0.0)
        turned = cross(moment, unit)  # row i of -[m]x, by the spin of the ring before
        right[k + 1, i] -= moved[i]
        right[k, i] += moved[i]
        for l in range(3):
            slope = rings.full[i, l]
            diagonal[k + 1, i, l] += slope
            lower[k + 1, i, l] += turned[l] - slope
            diagonal[k, i, l] += slope - turned[l]
            upper[k, i, l] -= slope
    for j in range(m):
        pull = times_t(rings.spin[k], vector_at(joints.pull, k, j))
        for i in range(3):
            lower[k + 1, i, 3 + j] += pull[i]
            diagonal[k + 1, i, 3 + j] -= pull[i]
            diagonal[k, i, 3 + j] -= pull[i]
            upper[k, i, 3 + j] += pull[i]


@spatial_njit()
def add_guide(k: int, j: int, rig: Parameters, joints: Joints, guides: Guides, rings: Rings, blocks: Blocks) -> None:
    """Write the row of tendon j at guide k."""
    slides, by_wrap, row = guides.by_tension[k, j], guides.by_wrap[k, j], 3 + j
    into, out, right = 1.0 - slides, 1.0 + slides, guides.off[k, j]
    lower, diagonal, upper = blocks.lower, blocks.diagonal, blocks.upper
    w = joints.wrap_bend
    for near in range(2):
        if near == 1 and k == 0:
            diagonal[k, row, row] += into * guides.free[j]
            continue
        at, side = k - near, near
        factor = -into if near == 1 else out
        right -= factor * joints.ahead[at, j] + by_wrap * joints.wrap_ahead[at, j, side]
        bends = two(factor, vector_at(joints.pull, at, j), by_wrap, (w[at, j, side, 0], w[at, j, side, 1], w[at, j, side, 2]))
        spins = times_t(rings.spin[at], bends)
        for i in range(3):
            if near == 1:
                diagonal[k, row, i] += spins[i]
                lower[k, row, i] -= spins[i]
            else:
                upper[k, row, i] += spins[i]
                diagonal[k, row, i] -= spins[i]
        for l in range(rig.free.size):
            pulls = factor * joints.pair[at, j, l] + by_wrap * joints.wrap_pull[at, j, side, l]
            if near == 1:
                lower[k, row, 3 + l] += pulls
                diagonal[k, row, 3 + l] -= pulls
            else:
                diagonal[k, row, 3 + l] += pulls
                upper[k, row, 3 + l] -= pulls
    diagonal[k, row, row] += guides.by_slip[k, j]
    blocks.right[k, row] = right


@spatial_njit()
def step_by_spins(
    x: Floats, step: Floats, rig: Parameters, dead: float, joints: Joints, guides: Guides, rings: Rings, blocks: Blocks
) -> None:
    """Fill the step of all unknowns, shape (N + 1, 6 + m), by spins of the rings and slips.

    The right-hand sides of the rings are those of :func:`balance_rings`.
    """
    n, m = rig.bristle.shape
    blocks.lower[:] = 0.0
    blocks.diagonal[:] = 0.0
    blocks.upper[:] = 0.0
    for k in range(n):
        add_joint(k, x, rig, joints, rings, blocks)
        load_slopes(k, dead, rig, rings, blocks)
        for j in range(m):
            add_guide(k, j, rig, joints, guides, rings, blocks)
    for i in range(3 + m):  # the base does not turn, the tendons are anchored at the tip
        at = 0 if i < 3 else n
        for l in range(3 + m):
            blocks.lower[at, i, l] = blocks.upper[at, i, l] = blocks.diagonal[at, i, l] = 0.0
        blocks.diagonal[at, i, i] = 1.0
        blocks.right[at, i] = 0.0
    solve_blocks(blocks)
    right = blocks.right
    for k in range(n):
        spin = (right[k + 1, 0] - right[k, 0], right[k + 1, 1] - right[k, 1], right[k + 1, 2] - right[k, 2])
        put(step, k, times(rings.spin[k], spin))
        for j in range(m):
            step[k, 6 + j] = right[k, 3 + j]
