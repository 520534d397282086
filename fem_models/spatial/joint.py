"""One joint and the tendons that cross it, compiled: forces and their slopes, the displacement of the notch condensed.

Between two rings the hole of a tendon ends at p before and at q beyond the notch. With phi the rotation vector of the
joint, eta = phi/2, and in the frame half way between both rings, a tendon takes the chord

    v = t e1 + d + c + b eta x (eta x c) + 2 a eta x r,

t being the length that lies along the mean direction, d the displacement of the notch, c what the rings carry of the
way, r the middle of the holes (a, b: :mod:`fem_models.spatial.vectors`). Its potential is the tendon's; d is that of a
spring under the force of all chords, F: d = -C (F - F0). See docs/theory/three-dimensions.md.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from fem_models.spatial.compiled import spatial_njit
from fem_models.spatial.parameters import Memory, Parameters
from fem_models.spatial.vectors import (
    Turn,
    Vector,
    add_one,
    add_outer,
    cross,
    dot,
    inverse,
    put,
    put_at,
    scaled,
    three,
    times,
    times_t,
    turn_by,
    turned,
    turned_slope,
    two,
    vector,
    vector_at,
)
from hysteresis.arrays import Floats

SLACK_STIFFNESS = 1e-6
"""Stiffness of a slack segment over that of a taut one, in the tangent only, as in the planar chain."""


LEAST_SINE = 1e-12
"""Turn of a tendon below which it counts as straight: its slope has no direction there."""


class Joints(NamedTuple):
    """What the joints do at one place of the unknowns, and scratch; m tendons.

    Slopes are with the displacement d of the notch condensed: it follows to first order, from ``loose`` on.
    """

    tension: Floats  # (m, N + 1), from the wheel to the tip
    moment: Floats  # (N, 3), gradient of the energy in the rotation vector
    off: Floats  # (N, 3), residual of d
    bend: Floats  # (N, 3, 3), slope of the moment in the rotation
    pull: Floats  # (N, m, 3), slopes of the tensions in the rotation, and of the moment in the stretches
    pair: Floats  # (N, m, m), slopes of the tensions in the stretches
    ahead: Floats  # (N, m), change of the tensions as d goes to its place
    moved: Floats  # (N, 3), change of the moment by that
    by_bend: Floats  # (N, 3, 3), d by the rotation
    by_pull: Floats  # (N, m, 3), d by the stretches
    loose: Floats  # (N, 3), step of d to its place
    follow: Floats  # (N, m, 3), rotation by the stretches, where no dead load holds it
    follow_ahead: Floats  # (N, 3), its step to its place
    wrap: Floats  # (N, m, 2), turn of a tendon at the ring before and beyond
    wrap_bend: Floats  # (N, m, 2, 3), its slopes in the rotation
    wrap_pull: Floats  # (N, m, 2, m), in the stretches
    wrap_ahead: Floats  # (N, m, 2), its change as d goes to its place
    kdd: Floats  # (3, 3) scratch: slopes of F by d,
    kdp: Floats  # (3, 3) by the rotation
    kpp: Floats  # (3, 3) of the moment of the tendons by the rotation
    solve: Floats  # (3, 3)
    inverse: Floats  # (3, 3)
    rows: Floats  # (3, 3): slope of a chord in eta
    wrap_d: Floats  # (m, 2, 3): slopes of the wraps in d
    unit: Floats  # (m, 3): direction of a chord
    lever: Floats  # (m, 3): slope of its length in the rotation
    stiff: Floats  # (m,): slope of its tension


@spatial_njit(allocates=True)
def joints_space(n: int, m: int) -> Joints:
    """Arrays for N joints and m tendons."""
    return Joints(
        tension=np.zeros((m, n + 1)),
        moment=np.zeros((n, 3)),
        off=np.zeros((n, 3)),
        bend=np.zeros((n, 3, 3)),
        pull=np.zeros((n, m, 3)),
        pair=np.zeros((n, m, m)),
        ahead=np.zeros((n, m)),
        moved=np.zeros((n, 3)),
        by_bend=np.zeros((n, 3, 3)),
        by_pull=np.zeros((n, m, 3)),
        loose=np.zeros((n, 3)),
        follow=np.zeros((n, m, 3)),
        follow_ahead=np.zeros((n, 3)),
        wrap=np.zeros((n, m, 2)),
        wrap_bend=np.zeros((n, m, 2, 3)),
        wrap_pull=np.zeros((n, m, 2, m)),
        wrap_ahead=np.zeros((n, m, 2)),
        kdd=np.zeros((3, 3)),
        kdp=np.zeros((3, 3)),
        kpp=np.zeros((3, 3)),
        solve=np.zeros((3, 3)),
        inverse=np.zeros((3, 3)),
        rows=np.zeros((3, 3)),
        wrap_d=np.zeros((m, 2, 3)),
        unit=np.zeros((m, 3)),
        lever=np.zeros((m, 3)),
        stiff=np.zeros(m),
    )


@spatial_njit()
def bend_joint(k: int, x: Floats, rig: Parameters, memory: Memory, joints: Joints) -> None:
    """Fill all that belongs to joint k at the unknowns x, shape (N + 1, 6 + m)."""
    m = rig.free.size
    turn = turn_by((0.5 * x[k, 0], 0.5 * x[k, 1], 0.5 * x[k, 2]))
    joints.kdd[:] = 0.0
    joints.kdp[:] = 0.0
    joints.kpp[:] = 0.0
    force = moment = (0.0, 0.0, 0.0)
    for j in range(m):
        tension = cross_notch(k, j, turn, x, rig, joints)
        force = two(1.0, force, tension, vector(joints.unit, j))
        moment = two(1.0, moment, tension, vector(joints.lever, j))
    put(joints.moment, k, moment)
    for i in range(3):
        joints.off[k, i] = x[k, 3 + i] + rig.give[k, i] * (force[i] - rig.thrust[k, i])
    condense(k, rig, joints)
    springs(k, x, rig, memory, joints)


@spatial_njit()
def cross_notch(k: int, j: int, turn: Turn, x: Floats, rig: Parameters, joints: Joints) -> float:
    """Add the slopes of tendon j over joint k, and return its tension."""
    e, s, a, b = turn.eta, turn.s, turn.a, turn.b
    r, c = vector_at(rig.arm, k, j), vector_at(rig.carried, k, j)
    ec = dot(e, c)
    to_axis, aside = two(ec, e, -s, c), cross(e, r)
    way = three(1.0, c, b, to_axis, 2.0 * a, aside)
    v = way[0] + x[k, 3] + rig.turning[k], way[1] + x[k, 4], way[2] + x[k, 5]
    length = math.sqrt(dot(v, v))
    u = scaled(1.0 / length, v)
    # slope of the chord in eta, row by row: b (eta.c) 1 + b eta c^T + z eta^T - 2 a [r]x
    z = three(-2.0 * b, c, 2.0 * turn.b1, to_axis, 4.0 * turn.a1, aside)
    f, g = b * ec, 2.0 * a
    row_1 = two(b * e[0], c, z[0], e)
    row_2 = two(b * e[1], c, z[1], e)
    row_3 = two(b * e[2], c, z[2], e)
    row_1 = row_1[0] + f, row_1[1] + g * r[2], row_1[2] - g * r[1]
    row_2 = row_2[0] - g * r[2], row_2[1] + f, row_2[2] + g * r[0]
    row_3 = row_3[0] + g * r[1], row_3[1] - g * r[0], row_3[2] + f
    put(joints.rows, 0, row_1)
    put(joints.rows, 1, row_2)
    put(joints.rows, 2, row_3)
    lever = three(0.5 * u[0], row_1, 0.5 * u[1], row_2, 0.5 * u[2], row_3)  # in phi
    taut = rig.segment[k, j]
    tension = rig.preload[j] + taut * (x[k, 6 + j] - x[k + 1, 6 + j] + length - rig.length[k, j])
    stiff = taut if tension > 0.0 else SLACK_STIFFNESS * taut
    tension = max(tension, 0.0)
    joints.tension[j, k + 1], joints.stiff[j] = tension, stiff
    put(joints.unit, j, u)
    put(joints.lever, j, lever)
    # curvature of the length: that of u.v at a fixed u, and the turn of the chord
    w, p = cross(r, u), three(ec, u, dot(e, u), c, -2.0 * dot(u, c), e)
    q, ew = dot(e, u) * ec - s * dot(u, c), dot(e, w)
    y, quarter, turns = two(2.0 * turn.b1, p, 4.0 * turn.a1, w), 0.25 * tension, tension / length
    kpp = joints.kpp
    add_one(kpp, quarter * (-2.0 * b * dot(u, c) + 2.0 * turn.b1 * q + 4.0 * turn.a1 * ew))
    add_outer(kpp, quarter, e, two(4.0 * turn.b2 * q + 8.0 * turn.a2 * ew, e, 1.0, y))
    add_outer(kpp, quarter, y, e)
    add_outer(kpp, quarter * b, u, c)
    add_outer(kpp, quarter * b, c, u)
    add_outer(kpp, stiff - turns, lever, lever)
    add_outer(kpp, 0.25 * turns, row_1, row_1)
    add_outer(kpp, 0.25 * turns, row_2, row_2)
    add_outer(kpp, 0.25 * turns, row_3, row_3)
    add_outer(joints.kdd, stiff - turns, u, u)
    add_one(joints.kdd, turns)
    add_outer(joints.kdp, stiff - turns, u, lever)
    add_outer(joints.kdp, 0.5 * turns, (1.0, 0.0, 0.0), row_1)
    add_outer(joints.kdp, 0.5 * turns, (0.0, 1.0, 0.0), row_2)
    add_outer(joints.kdp, 0.5 * turns, (0.0, 0.0, 1.0), row_3)
    if rig.capstan > 0.0:
        wrap_at(k, j, turn, length, rig, joints)
    return tension


@spatial_njit()
def wrap_at(k: int, j: int, turn: Turn, length: float, rig: Parameters, joints: Joints) -> None:
    """Fill the angles between the chord of tendon j and its ways in both rings, with their slopes."""
    u = vector(joints.unit, j)
    for side in range(2):
        sense = 2.0 * side - 1.0
        straight = vector_at(rig.onward, k, j) if side == 1 else vector_at(rig.inward, k, j)
        way = turned(turn, straight, sense)
        aside, along = cross(u, way), dot(u, way)
        sine = math.sqrt(dot(aside, aside))
        joints.wrap[k, j, side] = math.atan2(sine, along)
        if sine < LEAST_SINE:
            slope = by_d = (0.0, 0.0, 0.0)
        else:
            to_way, to_chord = two(1.0 / sine, way, -along / sine, u), two(1.0 / sine, u, -along / sine, way)
            by_d = scaled(-1.0 / length, to_way)
            turns = turned_slope(turn, to_chord, straight, scaled(0.5 * sense, cross(straight, to_chord)))
            slope = two(0.5, times_t(joints.rows, by_d), -0.5, turns)
        for i in range(3):
            joints.wrap_bend[k, j, side, i] = slope[i]
            joints.wrap_d[j, side, i] = by_d[i]


@spatial_njit()
def condense(k: int, rig: Parameters, joints: Joints) -> None:
    """Let the displacement of the notch follow, and fill the slopes of what is left: rotation and stretches."""
    m, kdp, solve = rig.free.size, joints.kdp, joints.solve
    give = vector(rig.give, k)
    for i in range(3):
        for l in range(3):
            solve[i, l] = give[i] * joints.kdd[i, l]
        solve[i, i] += 1.0
    inverse(solve, joints.inverse)
    inv = joints.inverse
    loose = scaled(-1.0, times(inv, vector(joints.off, k)))
    put(joints.loose, k, loose)
    put(joints.moved, k, times_t(kdp, loose))
    for i in range(3):
        column = scaled(-1.0, times(inv, (give[0] * kdp[0, i], give[1] * kdp[1, i], give[2] * kdp[2, i])))
        bent = times_t(kdp, column)
        for l in range(3):
            joints.by_bend[k, l, i] = column[l]
            joints.bend[k, l, i] = joints.kpp[l, i] + bent[l]
    for j in range(m):
        u, stiff = vector(joints.unit, j), joints.stiff[j]
        pulled = scaled(-stiff, times(inv, (give[0] * u[0], give[1] * u[1], give[2] * u[2])))
        put_at(joints.by_pull, k, j, pulled)
        put_at(joints.pull, k, j, two(stiff, vector(joints.lever, j), 1.0, times_t(kdp, pulled)))
        joints.ahead[k, j] = stiff * dot(u, loose)
        for l in range(m):
            joints.pair[k, l, j] = joints.stiff[l] * dot(vector(joints.unit, l), pulled)
        joints.pair[k, j, j] += stiff
    if rig.capstan > 0.0:
        condense_wraps(k, m, loose, joints)


@spatial_njit()
def condense_wraps(k: int, m: int, loose: Vector, joints: Joints) -> None:
    """Let the wraps follow the displacement of the notch."""
    for j in range(m):
        for side in range(2):
            by_d = vector_at(joints.wrap_d, j, side)
            joints.wrap_ahead[k, j, side] = dot(by_d, loose)
            for i in range(3):
                for l in range(3):
                    joints.wrap_bend[k, j, side, i] += by_d[l] * joints.by_bend[k, l, i]
            for l in range(m):
                joints.wrap_pull[k, j, side, l] = dot(by_d, vector_at(joints.by_pull, k, l))


@spatial_njit()
def springs(k: int, x: Floats, rig: Parameters, memory: Memory, joints: Joints) -> None:
    """Add the notch's own moments: springs, the loop of both bending axes, edges that touch."""
    for i in range(3):
        joints.moment[k, i] += rig.spring[k, i] * (x[k, i] - rig.rest[k, i])
        joints.bend[k, i, i] += rig.spring[k, i]
    for axis in range(2):
        i = axis + 1
        for e in range(rig.loop.shape[2]):
            stiffness, limit = rig.loop[k, axis, e], rig.slip[k, axis, e]
            part = stiffness * (x[k, i] - memory.jenkins[k, axis, e])
            joints.moment[k, i] += min(max(part, -limit), limit)
            joints.bend[k, i, i] += stiffness if abs(part) <= limit else 0.0
    angle = x[k, 2]
    if abs(angle) > rig.contact[k, 0] and (angle > 0.0 or rig.contact[k, 2] == 1.0):
        joints.moment[k, 2] += math.copysign(rig.contact[k, 1] * (abs(angle) - rig.contact[k, 0]), angle)
        joints.bend[k, 2, 2] += rig.contact[k, 1]
