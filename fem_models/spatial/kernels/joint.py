"""One joint and the tendons that cross it, compiled: forces and their slopes, the displacement of the notch condensed.

Between two rings the hole of a tendon ends at p before and at q beyond the notch. With phi the rotation vector of the
joint, eta = phi/2, and in the frame half way between both rings, a tendon takes the chord

    v = t e1 + d + c + b eta x (eta x c) + 2 a eta x r,

t being the length that lies along the mean direction, d the displacement of the notch, c what the rings carry of the
way, r the middle of the holes; a and b as in :mod:`fem_models.spatial.kernels.vectors`. Its potential is the tendon's.
In the unknowns stands the displacement of the shear centre, s e2 from the neutral axis: d = x - s phi_1 e3. That is one
of a spring under the force of all chords, F: x = -C (F - F0). See docs/theory/three-dimensions.md.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from fem_models.spatial.kernels.compiled import spatial_njit
from fem_models.spatial.kernels.vectors import (
    Turn,
    add_one,
    cross,
    dot,
    invert,
    put,
    put_at,
    scaled,
    take,
    take_at,
    three,
    times,
    times_t,
    turn_by,
    turned,
    turned_slope,
    two,
)
from fem_models.spatial.parameters import Memory, Parameters
from fem_models.spatial.tables import (
    ALONG,
    ARM,
    BEND,
    BENT,
    BY_BEND,
    BY_PULL,
    CARRIED,
    CONTACT,
    ELEMENTS,
    GIVE,
    GUIDE,
    INVERSE,
    INWARD,
    KDD,
    KDP,
    KPP,
    LENGTH,
    LEVER,
    LOOP,
    LOOSE,
    MOMENT,
    MOVED,
    OFF,
    ONWARD,
    PRELOAD,
    PULL,
    PULLED,
    REST,
    RING,
    ROWS,
    SCRATCH,
    SEGMENT,
    SHEARS,
    SHIFT,
    SLIP,
    SLIPS,
    SOLVE,
    SPRING,
    STIFF,
    TENSION,
    THRUST,
    TIGHTENS,
    TURNING,
    UNIT,
    WRAP,
    WRAP_AHEAD,
    WRAP_BEND,
    WRAP_MOVED,
    WRAPS,
)
from hysteresis.arrays import Floats

SLACK_STIFFNESS = 1e-6
"""Stiffness of a slack segment over that of a taut one, in the tangent only, as in the planar chain."""
LEAST_SINE = 1e-12
"""Turn of a tendon below which it counts as straight: its slope has no direction there."""


class Work(NamedTuple):
    """Scratch and results of one equilibrium; columns are in :mod:`fem_models.spatial.tables`."""

    tension: Floats  # (m, N + 1), from the wheel to the tip
    bent: Floats  # (N, BENT)
    pulled: Floats  # (N, m, PULLED)
    pairs: Floats  # (N, 3, m, m), slopes in the stretches: of the tensions, and of the wraps before and beyond
    guides: Floats  # (N, m, GUIDE)
    state: Floats  # (N, m) of the guides: 0 sticks, 1 or -1 slides, the sign being that of the friction
    frames: Floats  # (N + 1, 3, 3) of the rings, the base first
    rings: Floats  # (N, RING)
    blocks: Floats  # see :func:`fem_models.spatial.kernels.blocks.solve_blocks`
    step: Floats  # (N + 1, 6 + m) of the unknowns
    scratch: Floats  # (SCRATCH, 3)
    along: Floats  # (N, m, ALONG)
    kept: Floats  # (N + 1, 6 + m), a part of the step
    before: Floats  # (N + 1, 6 + m): the unknowns before a step of a jump


def work_space(rig: Parameters) -> Work:
    """Arrays for a rig; the base is the frame of the tube."""
    n, m = rig.crossings.shape[:2]
    count, size = (n + 1, 3 + m) if rig.loaded else (n, m)
    frames = np.zeros((n + 1, 3, 3))
    frames[:] = np.eye(3)
    return Work(
        tension=np.zeros((m, n + 1)),
        bent=np.zeros((n, BENT)),
        pulled=np.zeros((n, m, PULLED)),
        pairs=np.zeros((n, 3, m, m)),
        guides=np.zeros((n, m, GUIDE)),
        state=np.zeros((n, m)),
        frames=frames,
        rings=np.zeros((n, RING)),
        blocks=np.zeros((count, size, 3 * size + 1)),
        step=np.zeros((n + 1, SLIPS + m)),
        scratch=np.zeros((SCRATCH, 3)),
        along=np.zeros((n, m, ALONG)),
        kept=np.zeros((n + 1, SLIPS + m)),
        before=np.zeros((n + 1, SLIPS + m)),
    )


@spatial_njit()
def bend_joint(k: int, x: Floats, rig: Parameters, memory: Memory, work: Work, relax: float) -> None:
    """Fill all that belongs to joint k at the unknowns x, shape (N + 1, 6 + m); ``relax`` as of an attempt."""
    m, bent, scratch = rig.tendons.shape[0], work.bent, work.scratch
    turn = turn_by((0.5 * x[k, 0], 0.5 * x[k, 1], 0.5 * x[k, 2]))
    for i in range(KDD, KPP + 3):
        for col in range(3):
            scratch[i, col] = 0.0
    force = moment = (0.0, 0.0, 0.0)
    for j in range(m):
        tension = cross_notch(k, j, turn, x, rig, work)
        force = two(1.0, force, tension, take_at(work.pulled, k, j, UNIT))
        moment = two(1.0, moment, tension, take_at(work.pulled, k, j, LEVER))
    put(bent, k, MOMENT, moment)
    for i in range(3):
        bent[k, OFF + i] = x[k, MOVED + i] + rig.joints[k, GIVE + i] * (force[i] - rig.joints[k, THRUST + i])
    condense(k, rig, work)
    springs(k, x, rig, memory, work)
    if relax > 0.0:
        for i in range(3):
            bent[k, MOMENT + i] += relax * rig.viscosity * (x[k, i] - work.before[k, i])
            bent[k, BEND + 4 * i] += relax * rig.viscosity


@spatial_njit(forceinline=True)
def cross_notch(k: int, j: int, turn: Turn, x: Floats, rig: Parameters, work: Work) -> float:
    """Add the slopes of tendon j over joint k, and return its tension."""
    e, s, a, b, scratch = turn.eta, turn.s, turn.a, turn.b, work.scratch
    r, c = take_at(rig.crossings, k, j, ARM), take_at(rig.crossings, k, j, CARRIED)
    ec = dot(e, c)
    to_axis, aside = two(ec, e, -s, c), cross(e, r)
    way = three(1.0, c, b, to_axis, 2.0 * a, aside)
    by_twist = 2.0 * rig.joints[k, SHEARS]  # of half the rotation vector: about the shear centre
    v = (
        way[0] + rig.joints[k, TURNING] + x[k, MOVED],
        way[1] + x[k, MOVED + 1],
        way[2] + x[k, MOVED + 2] - by_twist * e[0],
    )
    length = math.sqrt(dot(v, v))
    u = scaled(1.0 / length, v)
    # slope of the chord in eta: b (eta.c) 1 + b eta c^T + z eta^T - 2 a [r]x
    z = three(-2.0 * b, c, 2.0 * turn.b1, to_axis, 4.0 * turn.a1, aside)
    f, g = b * ec, 2.0 * a
    for i in range(3):
        put(scratch, ROWS + i, 0, two(b * e[i], c, z[i], e))
    add_one(scratch, ROWS, f)
    scratch[ROWS, 1] += g * r[2]
    scratch[ROWS, 2] -= g * r[1]
    scratch[ROWS + 1, 0] -= g * r[2]
    scratch[ROWS + 1, 2] += g * r[0]
    scratch[ROWS + 2, 0] += g * r[1] - by_twist
    scratch[ROWS + 2, 1] -= g * r[0]
    lever = scaled(0.5, times_t(scratch, ROWS, u))  # in phi
    taut, slips = rig.crossings[k, j, SEGMENT], x[k, SLIPS + j] - x[k + 1, SLIPS + j]
    tension = rig.tendons[j, PRELOAD] + taut * (slips + length - rig.crossings[k, j, LENGTH])
    stiff = taut if tension > 0.0 else SLACK_STIFFNESS * taut
    tension = max(tension, 0.0)
    work.tension[j, k + 1], work.pulled[k, j, STIFF] = tension, stiff
    put_at(work.pulled, k, j, UNIT, u)
    put_at(work.pulled, k, j, LEVER, lever)
    # curvature of the length: that of u.v at a fixed u, and the turn of the chord
    uc, eu, w = dot(u, c), dot(e, u), cross(r, u)
    q, ew = eu * ec - s * uc, dot(e, w)
    p = three(ec, u, eu, c, -2.0 * uc, e)
    y, quarter, turns = two(2.0 * turn.b1, p, 4.0 * turn.a1, w), 0.25 * tension, tension / length
    along = two(4.0 * turn.b2 * q + 8.0 * turn.a2 * ew, e, 1.0, y)
    near, lean, unity = stiff - turns, 0.5 * turns, quarter * (-2.0 * b * uc + 2.0 * turn.b1 * q + 4.0 * turn.a1 * ew)
    for i in range(3):
        row = take(scratch, ROWS + i, 0)
        for col in range(3):
            kpp = (
                quarter * (e[i] * along[col] + y[i] * e[col] + b * (u[i] * c[col] + c[i] * u[col]))
                + near * lever[i] * lever[col]
            )
            for h in range(3):
                kpp += 0.25 * turns * scratch[ROWS + h, i] * scratch[ROWS + h, col]
            scratch[KPP + i, col] += kpp
            scratch[KDD + i, col] += near * u[i] * u[col]
            scratch[KDP + i, col] += near * u[i] * lever[col] + lean * row[col]
    add_one(scratch, KPP, unity)
    add_one(scratch, KDD, turns)
    if rig.capstan > 0.0:
        wrap_at(k, j, turn, length, rig, work)
    return tension


@spatial_njit()
def wrap_at(k: int, j: int, turn: Turn, length: float, rig: Parameters, work: Work) -> None:
    """Fill the angles between the chord of tendon j and its ways in both rings, with their slopes."""
    u = take_at(work.pulled, k, j, UNIT)
    for side in range(2):
        sense = 2.0 * side - 1.0
        straight = take_at(rig.crossings, k, j, ONWARD if side == 1 else INWARD)
        way = turned(turn, straight, sense)
        aside, along = cross(u, way), dot(u, way)
        sine = math.sqrt(dot(aside, aside))
        work.pulled[k, j, WRAP + side] = math.atan2(sine, along)
        slope = by_d = (0.0, 0.0, 0.0)
        if sine >= LEAST_SINE:
            to_way, to_chord = two(1.0 / sine, way, -along / sine, u), two(1.0 / sine, u, -along / sine, way)
            by_d = scaled(-1.0 / length, to_way)
            turns = turned_slope(turn, to_chord, straight, scaled(0.5 * sense, cross(straight, to_chord)))
            slope = two(0.5, times_t(work.scratch, ROWS, by_d), -0.5, turns)
        put_at(work.pulled, k, j, WRAP_BEND + 3 * side, slope)
        put_at(work.pulled, k, j, WRAP_MOVED + 3 * side, by_d)


@spatial_njit(forceinline=True)
def condense(k: int, rig: Parameters, work: Work) -> None:
    """Let the displacement of the notch follow, and fill the slopes that remain: in rotation and stretches."""
    m, scratch, bent, pulled = rig.tendons.shape[0], work.scratch, work.bent, work.pulled
    give = take(rig.joints, k, GIVE)
    for i in range(3):
        for col in range(3):
            scratch[SOLVE + i, col] = give[i] * scratch[KDD + i, col]
    add_one(scratch, SOLVE, 1.0)
    invert(scratch, SOLVE, INVERSE)
    loose = scaled(-1.0, times(scratch, INVERSE, take(bent, k, OFF)))
    put(bent, k, LOOSE, loose)
    put(bent, k, SHIFT, times_t(scratch, KDP, loose))
    for col in range(3):
        into = give[0] * scratch[KDP, col], give[1] * scratch[KDP + 1, col], give[2] * scratch[KDP + 2, col]
        column = scaled(-1.0, times(scratch, INVERSE, into))
        moment = times_t(scratch, KDP, column)
        for i in range(3):
            bent[k, BY_BEND + 3 * i + col] = column[i]
            bent[k, BEND + 3 * i + col] = scratch[KPP + i, col] + moment[i]
    for j in range(m):
        u, stiff = take_at(pulled, k, j, UNIT), pulled[k, j, STIFF]
        moves = scaled(-stiff, times(scratch, INVERSE, (give[0] * u[0], give[1] * u[1], give[2] * u[2])))
        put_at(pulled, k, j, BY_PULL, moves)
        put_at(pulled, k, j, PULL, two(stiff, take_at(pulled, k, j, LEVER), 1.0, times_t(scratch, KDP, moves)))
        pulled[k, j, TIGHTENS] = stiff * dot(u, loose)
        for col in range(m):
            work.pairs[k, TENSION, col, j] = pulled[k, col, STIFF] * dot(take_at(pulled, k, col, UNIT), moves)
        work.pairs[k, TENSION, j, j] += stiff
    if rig.capstan > 0.0:
        condense_wraps(k, m, work)


@spatial_njit()
def condense_wraps(k: int, m: int, work: Work) -> None:
    """Let the wraps follow the displacement of the notch."""
    pulled, bent = work.pulled, work.bent
    for j in range(m):
        for side in range(2):
            by_d, at = take_at(pulled, k, j, WRAP_MOVED + 3 * side), WRAP_BEND + 3 * side
            pulled[k, j, WRAP_AHEAD + side] = dot(by_d, take(bent, k, LOOSE))
            for i in range(3):
                pulled[k, j, at + i] += dot(
                    by_d, (bent[k, BY_BEND + i], bent[k, BY_BEND + 3 + i], bent[k, BY_BEND + 6 + i])
                )
            for col in range(m):
                work.pairs[k, WRAPS + side, j, col] = dot(by_d, take_at(pulled, k, col, BY_PULL))


@spatial_njit(forceinline=True)
def springs(k: int, x: Floats, rig: Parameters, memory: Memory, work: Work) -> None:
    """Add the notch's own moments: springs, the loop of both bending axes, edges that touch."""
    bent, own = work.bent, rig.joints
    for i in range(3):
        bent[k, MOMENT + i] += own[k, SPRING + i] * (x[k, i] - own[k, REST + i])
        bent[k, BEND + 4 * i] += own[k, SPRING + i]
    for e in range(2 * ELEMENTS):
        i = 1 + e // ELEMENTS
        stiffness, limit = own[k, LOOP + e], own[k, SLIP + e]
        part = stiffness * (x[k, i] - memory.jenkins[k, e])
        bent[k, MOMENT + i] += min(max(part, -limit), limit)
        bent[k, BEND + 4 * i] += stiffness if abs(part) <= limit else 0.0
    angle, closes = x[k, 2], own[k, CONTACT]
    if abs(angle) > closes and (angle > 0.0 or own[k, CONTACT + 2] == 1.0):
        bent[k, MOMENT + 2] += math.copysign(own[k, CONTACT + 1] * (abs(angle) - closes), angle)
        bent[k, BEND + 8] += own[k, CONTACT + 1]


@spatial_njit()
def follow_displacements(work: Work, n: int, m: int) -> None:
    """Fill the step of the notches' displacements by those of rotations and slips."""
    bent, step = work.bent, work.step
    for k in range(n):
        turned_by = take(step, k, 0)
        moved = take(bent, k, LOOSE)
        moved = two(
            1.0,
            moved,
            1.0,
            (
                dot(take(bent, k, BY_BEND), turned_by),
                dot(take(bent, k, BY_BEND + 3), turned_by),
                dot(take(bent, k, BY_BEND + 6), turned_by),
            ),
        )
        for j in range(m):
            moved = two(1.0, moved, step[k, SLIPS + j] - step[k + 1, SLIPS + j], take_at(work.pulled, k, j, BY_PULL))
        put(step, k, MOVED, moved)
