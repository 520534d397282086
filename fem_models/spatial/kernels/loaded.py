"""Dead loads in space, and the Newton step of a wrist that carries them, compiled.

Weight turns every joint as any joint beyond or before it turns: by the rotation vectors of the joints the tangent is
full. By the spins alpha of the rings in space it has neighbours only. The moment of a joint in space is
m = B Jl^-T(phi) g, with B the frame before it, g the gradient in phi and Jl the left Jacobian of the rotation, and
delta phi = Jl^-1 B^T (alpha of the ring beyond less alpha of the ring before).
"""

from __future__ import annotations

import math

from fem_models.spatial.kernels.blocks import solve_blocks
from fem_models.spatial.kernels.compiled import spatial_njit
from fem_models.spatial.kernels.joint import Work
from fem_models.spatial.kernels.vectors import (
    Vector,
    add_one,
    add_outer,
    cross,
    dot,
    put,
    scaled,
    take,
    take_at,
    three,
    turn_by,
    two,
)
from fem_models.spatial.parameters import Parameters
from fem_models.spatial.tables import (
    BEFORE,
    BEND,
    BY_SLIP,
    BY_TENSION,
    BY_WRAP,
    FRAME,
    HALF,
    INVERSE,
    MOMENT,
    PULL,
    SHEARS,
    SHIFT,
    SLIPS,
    SOLVE,
    SPIN,
    STEP,
    TENSION,
    TIGHTENS,
    TIP_ARM,
    TURNS,
    UNBALANCED,
    WEIGHT_ARM,
    WRAP_AHEAD,
    WRAP_BEND,
    WRAPS,
)
from hysteresis.arrays import Floats


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


@spatial_njit(forceinline=True)
def by_spins(work: Work, k: int, p: Vector) -> Vector:
    """Slope by the spins of what has a slope p in the rotation vector of joint k: B Jl^-T p."""
    at = work.rings
    return three(p[0], take(at, k, SPIN), p[1], take(at, k, SPIN + 3), p[2], take(at, k, SPIN + 6))


@spatial_njit()
def place_rings(x: Floats, rig: Parameters, dead: float, work: Work) -> None:
    """Fill frames of rings and notches, and the moments of the joints in space.

    A notch twists about its shear centre: the loads beyond it that act across, at its neutral axis, have an arm.
    """
    frames, rings, n = work.frames, work.rings, rig.joints.shape[0]
    for k in range(n):
        cs, sn = rig.joints[k, FRAME], rig.joints[k, FRAME + 1]
        phi = take(x, k, 0)
        turn = turn_by(phi)
        c, _ = jacobian_terms(turn.s)
        for i in range(3):  # row i of B times the rotation: the row turned back
            f = take_at(frames, k, i, 0)
            row = f[0], cs * f[1] + sn * f[2], cs * f[2] - sn * f[1]
            put(rings, k, BEFORE + 3 * i, row)
            around = cross(phi, row)
            bent = three(1.0 - turn.b * turn.s, row, -turn.a, around, turn.b * dot(phi, row), phi)
            frames[k + 1, i, 0] = bent[0]
            frames[k + 1, i, 1] = cs * bent[1] - sn * bent[2]
            frames[k + 1, i, 2] = cs * bent[2] + sn * bent[1]
            # column i of Jl^-1 B^T: Jl^-1 times row i of B
            spun = three(1.0 - c * turn.s, row, -0.5, around, c * dot(phi, row), phi)
            rings[k, SPIN + i], rings[k, SPIN + 3 + i], rings[k, SPIN + 6 + i] = spun
        beyond, across = _beyond(n - k, rig, dead), _across(work, k)
        work.bent[k, MOMENT] += rig.joints[k, SHEARS] * dot(beyond, across)
        put(rings, k, TURNS, by_spins(work, k, take(work.bent, k, MOMENT)))


@spatial_njit(forceinline=True)
def _beyond(rings: int, rig: Parameters, dead: float) -> Vector:
    """Dead loads on so many last rings."""
    return two(dead * rings, rig.weight, dead, rig.tip)


@spatial_njit(forceinline=True)
def _across(work: Work, k: int) -> Vector:
    """Axis 3 of notch k in space, on the ring before it."""
    return work.rings[k, BEFORE + 2], work.rings[k, BEFORE + 5], work.rings[k, BEFORE + 8]


@spatial_njit(forceinline=True)
def in_space(work: Work, k: int, p: Vector) -> Vector:
    """Turn a vector from ring k into space."""
    at = work.frames
    return dot(take_at(at, k, 0, 0), p), dot(take_at(at, k, 1, 0), p), dot(take_at(at, k, 2, 0), p)


@spatial_njit()
def balance_rings(rig: Parameters, dead: float, work: Work) -> float:
    """Fill residuals of all rings as right-hand sides, and return the largest moment of a joint that is off, Nmm."""
    rings, blocks, n, last = work.rings, work.blocks, rig.joints.shape[0], work.blocks.shape[2] - 1
    carried, largest = (0.0, 0.0, 0.0), 0.0
    for k in range(n - 1, -1, -1):
        beyond, step, half = float(n - 1 - k), take(rig.joints, k, STEP), take(rig.joints, k, HALF)
        arm = in_space(work, k + 1, two(1.0, half, beyond, step))
        reach = in_space(work, k + 1, step if k < n - 1 else half)
        put(rings, k, WEIGHT_ARM, arm)
        put(rings, k, TIP_ARM, reach)
        own = two(dead, cross(arm, rig.weight), dead, cross(reach, rig.tip))
        carried = two(1.0, carried, 1.0, own)
        moment = take(rings, k, TURNS)
        off = two(1.0, moment, -1.0, carried)
        largest = max(largest, math.sqrt(dot(off, off)))
        missing = two(1.0, own, -1.0, moment)
        if k < n - 1:
            missing = two(1.0, missing, 1.0, take(rings, k + 1, TURNS))
        for i in range(3):
            blocks[k + 1, i, last] = missing[i]
    return largest


@spatial_njit()
def load_slopes(k: int, dead: float, rig: Parameters, work: Work, size: int) -> None:
    """Add the slope of the loads' moment on the ring beyond joint k in its spin: -(a W^T - (a.W) 1)."""
    weights, reach = take(work.rings, k, WEIGHT_ARM), take(work.rings, k, TIP_ARM)
    along = dead * (dot(weights, rig.weight) + dot(reach, rig.tip))
    for i in range(3):
        for col in range(3):
            work.blocks[k + 1, i, size + col] -= dead * (weights[i] * rig.weight[col] + reach[i] * rig.tip[col])
        work.blocks[k + 1, i, size + i] += along


@spatial_njit()
def joint_slopes(k: int, x: Floats, work: Work) -> None:
    """Fill the slope of the moment of joint k, in space, in the spin of the ring beyond it less that before: INVERSE.

    delta m = alpha x m + B (D + Jl^-T H) delta phi, with D = d(Jl^-T g)/d phi at a fixed g and H the slope of g.
    """
    scratch, rings, bent = work.scratch, work.rings, work.bent
    phi, g = take(x, k, 0), take(bent, k, MOMENT)
    c, slope = jacobian_terms(dot(phi, phi))
    around = cross(phi, g)
    for i in range(3):
        put(scratch, SOLVE + i, 0, (0.0, 0.0, 0.0))
        put(scratch, INVERSE + i, 0, (0.0, 0.0, 0.0))
    add_one(scratch, SOLVE, c * dot(phi, g))
    add_outer(scratch, SOLVE, c, phi, g)
    add_outer(scratch, SOLVE, 1.0, two(-2.0 * c, g, 2.0 * slope, cross(phi, around)), phi)
    scratch[SOLVE, 1] += 0.5 * g[2]  # -[g]x/2
    scratch[SOLVE, 2] -= 0.5 * g[1]
    scratch[SOLVE + 1, 0] -= 0.5 * g[2]
    scratch[SOLVE + 1, 2] += 0.5 * g[0]
    scratch[SOLVE + 2, 0] += 0.5 * g[1]
    scratch[SOLVE + 2, 1] -= 0.5 * g[0]
    for i in range(3):
        row = (0.0, 0.0, 0.0)
        for h in range(3):  # B D + (Jl^-1 B^T)^T H
            row = two(1.0, row, rings[k, BEFORE + 3 * i + h], take(scratch, SOLVE + h, 0))
            row = two(1.0, row, rings[k, SPIN + 3 * h + i], take(bent, k, BEND + 3 * h))
        put(scratch, INVERSE + i, 0, by_spins(work, k, row))


@spatial_njit()
def add_joint(k: int, x: Floats, rig: Parameters, dead: float, work: Work) -> None:
    """Add joint k to the rows of both its rings: moments by spins and slips."""
    n, m = work.state.shape
    moment, blocks, size = take(work.rings, k, TURNS), work.blocks, 3 + m
    joint_slopes(k, x, work)
    shift, last = by_spins(work, k, take(work.bent, k, SHIFT)), 3 * size
    twists, across = by_spins(work, k, (1.0, 0.0, 0.0)), _across(work, k)
    leans = scaled(rig.joints[k, SHEARS], cross(across, _beyond(n - k, rig, dead)))
    for i in range(3):
        unit = (1.0 if i == 0 else 0.0), (1.0 if i == 1 else 0.0), (1.0 if i == 2 else 0.0)
        # row i of -[m]x, by the spin of the ring before, which leans the axis across under the loads, too
        turned = two(1.0, cross(moment, unit), twists[i], leans)
        blocks[k + 1, i, last] -= shift[i]
        blocks[k, i, last] += shift[i]
        for col in range(3):
            slope = work.scratch[INVERSE + i, col]
            blocks[k + 1, i, size + col] += slope
            blocks[k + 1, i, col] += turned[col] - slope
            blocks[k, i, size + col] += slope - turned[col]
            blocks[k, i, 2 * size + col] -= slope
    for j in range(m):
        pull = by_spins(work, k, take_at(work.pulled, k, j, PULL))
        for i in range(3):
            blocks[k + 1, i, 3 + j] += pull[i]
            blocks[k + 1, i, size + 3 + j] -= pull[i]
            blocks[k, i, size + 3 + j] -= pull[i]
            blocks[k, i, 2 * size + 3 + j] += pull[i]


@spatial_njit()
def add_guide(k: int, j: int, free: float, work: Work) -> None:
    """Write the row of tendon j at guide k; ``free`` is the slope of its tension between wheel and base."""
    guides, pulled, pairs, blocks, m = work.guides, work.pulled, work.pairs, work.blocks, work.state.shape[1]
    slides, by_wrap, row, size = guides[k, j, BY_TENSION], guides[k, j, BY_WRAP], 3 + j, 3 + m
    into, out, right = 1.0 - slides, 1.0 + slides, guides[k, j, UNBALANCED]
    for near in range(2 if k > 0 else 1):
        at, side = k - near, near
        factor = -into if near == 1 else out
        right -= factor * pulled[at, j, TIGHTENS] + by_wrap * pulled[at, j, WRAP_AHEAD + side]
        bends = two(factor, take_at(pulled, at, j, PULL), by_wrap, take_at(pulled, at, j, WRAP_BEND + 3 * side))
        spins = by_spins(work, at, bends)
        plus, minus = (size, 0) if near == 1 else (2 * size, size)  # columns of the ring beyond and before
        for i in range(3):
            blocks[k, row, plus + i] += spins[i]
            blocks[k, row, minus + i] -= spins[i]
        for col in range(m):
            pulls = factor * pairs[at, TENSION, j, col] + by_wrap * pairs[at, WRAPS + side, j, col]
            blocks[k, row, minus + 3 + col] += pulls
            blocks[k, row, plus + 3 + col] -= pulls
    blocks[k, row, size + row] += guides[k, j, BY_SLIP] + (into * free if k == 0 else 0.0)
    blocks[k, row, 3 * size] = right


@spatial_njit()
def step_by_spins(x: Floats, tendons: Floats, rig: Parameters, dead: float, work: Work) -> None:
    """Fill the step of rotations and slips, by spins of the rings and slips.

    The right-hand sides of the rings are those of :func:`balance_rings`. ``tendons``: slopes of the tensions between
    wheel and base, (m,).
    """
    (n, m), blocks, step = work.state.shape, work.blocks, work.step
    size = 3 + m
    for k in range(n + 1):
        for i in range(size):
            for col in range(3 * size):
                blocks[k, i, col] = 0.0
    for k in range(n):
        add_joint(k, x, rig, dead, work)
        load_slopes(k, dead, rig, work, size)
        for j in range(m):
            add_guide(k, j, tendons[j], work)
    for i in range(size):  # the base does not turn, the tendons are anchored at the tip
        at = 0 if i < 3 else n
        for col in range(3 * size + 1):
            blocks[at, i, col] = 1.0 if col == size + i else 0.0
    solve_blocks(blocks, size)
    for k in range(n):
        spin = (0.0, 0.0, 0.0)
        for i in range(3):
            turned = blocks[k + 1, i, 3 * size] - blocks[k, i, 3 * size]
            spin = two(
                1.0, spin, turned, (work.rings[k, SPIN + i], work.rings[k, SPIN + 3 + i], work.rings[k, SPIN + 6 + i])
            )
        put(step, k, 0, spin)
        for j in range(m):
            step[k, SLIPS + j] = blocks[k, 3 + j, 3 * size]
