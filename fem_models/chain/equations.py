"""Residual and tangent of the chain's equations, compiled. See :mod:`fem_models.chain.solve`.

The unknowns x, shape (3 N + 3,), are the angle of a joint and the slips of tendons a and b at the guide beyond it, from
the base (whose angle is 0) to the tip (whose slips are 0, the anchors).
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from fem_models.chain.compiled import chain_njit
from fem_models.chain.laws import (
    BY_TENSION,
    Guide,
    Span,
    crossing,
    free_tension,
    friction,
    guide_at,
    joint_moment,
    next_state,
    segment,
)
from fem_models.chain.parameters import Memory, Parameters
from fem_models.chain.section import ROW, Bend, with_section
from fem_models.load.stepping import Load
from hysteresis.arrays import Floats

BAND = 5  # half width of the tangent by the headings of the rings; it is stored as tangent[i, j - i + BAND]
BAND_OF_JOINTS = 4  # the same by the angles of the joints
BY_DEPTH = -1  # whether the tip touches its stop
OPEN_STIFFNESS = 1e-9  # of EA/pitch, in the tangent only: a slack tendon past a sliding guide leaves the slip open


class Work(NamedTuple):
    """Scratch and results of one equilibrium."""

    tangent: Floats  # (3 N + 3, 2 BAND + 1)
    residual: Floats  # (3 N + 3,)
    lever: Floats  # dy_tip by the headings in the rows of the joints, (3 N + 3,)
    external: Floats  # moments of weight and stop on the joints, (N,)
    restoring: Floats  # what weight and stop add to the tangent by the headings, (N,)
    tension: Floats  # (2, N + 1)
    limit: Floats  # (2, N)
    state: Floats  # (2, N) of the guides: 0 sticks, 1 or -1 slides, the sign being that of the friction
    x_before: Floats  # (3 N + 3,) at the last equilibrium
    guess: Floats  # (2,) tension between wheel and base to start from
    sections: Floats  # (N, ROW), see :func:`fem_models.chain.section.with_section`


class Balance(NamedTuple):
    """How far x is from equilibrium.

    ``outside``: there is weight, a tip load or a touched stop, and the tangent is by the headings of the rings.
    """

    largest: float  # residual, N
    stop_stiffness: float  # of a touched tip stop, N/mm, else 0
    outside: bool


@chain_njit()
def work_space(rig: Parameters, joints: int) -> Work:
    """Arrays for a chain; the tensions are guessed to be the preload."""
    size = 3 * (joints + 1)
    return Work(
        tangent=np.zeros((size, 2 * BAND + 1)),
        residual=np.zeros(size),
        lever=np.zeros(size),
        external=np.zeros(joints),
        restoring=np.zeros(joints),
        tension=np.zeros((2, joints + 1)),
        limit=np.zeros((2, joints)),
        state=np.zeros((2, joints)),
        x_before=np.zeros(size),
        guess=np.array(rig.preload),
        sections=np.zeros((joints, ROW)),
    )


@chain_njit(forceinline=True)
def add(band: Floats, row: int, column: int, value: float) -> None:
    """Add to an entry of a matrix that is stored as a band."""
    band[row, column - row + BAND] += value


@chain_njit(forceinline=True)
def loaded(rig: Parameters) -> bool:
    """Whether rings have weight or the tip a load."""
    return rig.weight_x != 0.0 or rig.weight_y != 0.0 or rig.tip_x != 0.0 or rig.tip_y != 0.0


@chain_njit()
def external_moments(x: Floats, rig: Parameters, load: Load, work: Work, touched: int) -> float:
    """Fill the moments of weight, tip load and tip stop on every joint, their slopes and the tip's levers.

    Returns the stiffness of the stop, N/mm, where the tip touches it. Ring i hangs at its centre, half a pitch beyond
    joint i, and carries the joints of those beyond. What a joint has more than the next one depends on the heading of
    its own ring alone, and on the push of the stop. A dead force on the tip acts on the same levers as the stop.
    ``touched`` is 1 or 0 where it is given whether the tip touches, else :data:`BY_DEPTH`.
    """
    n = work.external.size
    work.external[:] = 0.0
    if not loaded(rig) and rig.stop_stiffness == 0.0:
        return 0.0
    heading, tip_y = 0.0, 0.0
    for i in range(n):
        heading += x[3 * i + 3]
        tip_y += (rig.pitch if i < n - 1 else 0.5 * rig.pitch) * math.sin(heading)
    side = 1.0 if rig.stop_y >= 0.0 else -1.0
    depth = side * (tip_y - rig.stop_y)
    touches = depth > 0.0 if touched == BY_DEPTH else touched == 1
    push = side * rig.stop_stiffness * depth if touches else 0.0
    weight_x, weight_y = load.dead * rig.weight_x, load.dead * rig.weight_y
    tip_x, tip_load = load.dead * rig.tip_x, load.dead * rig.tip_y
    moment = 0.0
    for i in range(n - 1, -1, -1):
        cs, sn = math.cos(heading), math.sin(heading)
        length = rig.pitch if i < n - 1 else 0.5 * rig.pitch
        rings = (n - 0.5 - i) * rig.pitch
        moment += rings * (weight_y * cs - weight_x * sn) - push * length * cs
        moment += length * (tip_load * cs - tip_x * sn)
        work.external[i] = moment
        work.restoring[i] = rings * (weight_y * sn + weight_x * cs) - push * length * sn
        work.restoring[i] += length * (tip_load * sn + tip_x * cs)
        work.lever[3 * i + 3] = length * cs
        heading -= x[3 * i + 3]
    return rig.stop_stiffness if touches else 0.0


@chain_njit()
def by_headings(work: Work) -> None:
    """Change tangent and residual from joints to headings, and add what weight and stop do.

    Weight loads every joint as any joint beyond or before it bends: a full matrix. By the headings of the rings, joint
    less next joint, it is a diagonal: its potential is a sum over the rings (virtual work; the sparse form of absolute
    coordinates). The band is wider by one.
    """
    band, b, n = work.tangent, work.residual, work.external.size
    for row in range(b.size):
        for column in range(max(3, row - 2 + (2 - row) % 3), min(row + 3, b.size), 3):  # of joints in this row
            add(band, row, column - 3, -band[row, column - row + BAND])
    for row in range(3, 3 * n, 3):
        for offset in range(BAND + 1):
            band[row, offset + BAND] -= band[row + 3, offset - 3 + BAND]
        b[row] -= b[row + 3]
    for i in range(n):
        add(band, 3 * i + 3, 3 * i + 3, work.restoring[i])


@chain_njit(forceinline=True)
def free_span(x: Floats, load: Load, rig: Parameters, work: Work, taut: int) -> Span:
    """Tensions between wheel and base: given under load control, else of what the wheel winds in.

    ``taut`` as of :func:`fem_models.chain.laws.segment`.
    """
    if rig.load_control:
        return Span(tension=(load.drive, 0.0), own=(0.0, 0.0), cross=0.0, by_angle=(0.0, 0.0))
    a, slope_a = free_tension(load.drive - x[1] - load.slack[0], 0, rig, work.guess[0], taut)
    b, slope_b = free_tension(-load.drive - x[2] - load.slack[1], 1, rig, work.guess[1], taut)
    return Span(tension=(a, b), own=(slope_a, slope_b), cross=0.0, by_angle=(0.0, 0.0))


@chain_njit()
def guide_row(side: int, x: Floats, rig: Parameters, memory: Memory, work: Work, guide: Guide, settle: bool) -> float:
    """Fill the row of one guide and tendon: tension before less tension beyond less friction; return its residual, N.

    With ``settle`` the guide sticks or slides first, by its force. A state that contradicts the force even so counts as
    a residual above the tolerance.
    """
    i, near, far = guide.number, guide.near, guide.far
    band, residual = work.tangent, work.residual
    joint = 3 * i  # place of the joint before the guide; the one beyond is at joint + 3
    row, other = joint + 1 + side, joint + 2 - side
    bristle, stiffness = rig.bristle[side], rig.segment[side]
    total, force = near.tension[side] + far.tension[side], bristle * (x[row] - memory.guides[side, i])
    limit = guide.constant + total * guide.ratio
    if rig.capstan == 0.0 and guide.constant == 0.0:  # without friction it neither sticks nor slides
        bristle = force = 0.0
    state = work.state[side, i]
    if settle:
        state = next_state(state, force, limit, rig.tolerance)
        work.state[side, i] = state
    work.limit[side, i] = limit
    dry = friction(state, force, bristle, total, guide)
    work.residual[row] = near.tension[side] - far.tension[side] - dry.force - guide.drag * (x[row] - work.x_before[row])
    band, into, out = work.tangent, 1.0 - dry.by_tension, 1.0 + dry.by_tension
    if i > 0:
        add(band, row, joint, into * near.by_angle[side])
        add(band, row, row - 3, into * near.own[side])
        add(band, row, other - 3, into * near.cross)
    add(band, row, row, -into * near.own[side])
    add(band, row, other, -into * near.cross)
    open_stiffness = OPEN_STIFFNESS * (stiffness if stiffness > 0.0 else rig.segment[0])
    add(band, row, row, -(out * far.own[side] + dry.by_slip + guide.drag + open_stiffness))
    add(band, row, other, -out * far.cross)
    add(band, row, row + 3, out * far.own[side])
    add(band, row, other + 3, out * far.cross)
    add(band, row, joint, -dry.by_wrap * guide.wrap_by_angle[0])
    add(band, row, joint + 3, -(out * far.by_angle[side] + dry.by_wrap * guide.wrap_by_angle[1]))
    if next_state(state, force, limit, rig.tolerance) != state:
        return max(abs(residual[row]), 2.0 * rig.tolerance)
    return abs(residual[row])


@chain_njit()
def assemble(x: Floats, rig: Parameters, memory: Memory, load: Load, work: Work, rate: float, settle: bool) -> Balance:
    """Fill tangent and residual at x, guide by guide.

    Row by row: the base does not rotate; each guide's balance of tensions; each joint's balance of moments; the tendons
    are anchored at the tip. ``rate`` is 1/s of the step for drag and heat, 0 without; ``settle`` as in
    :func:`guide_row`.
    """
    band, b, n = work.tangent, work.residual, memory.guides.shape[1]
    band[:] = 0.0
    for row in (0, 3 * n + 1, 3 * n + 2):
        add(band, row, row, 1.0)
        b[row] = 0.0
    stop = external_moments(x, rig, load, work, BY_DEPTH)
    near = free_span(x, load, rig, work, BY_TENSION)
    rest = crossing(rig.rest, rig).length  # where the tendons have their lengths
    work.tension[0, 0], work.tension[1, 0] = near.tension
    largest = 0.0
    for i in range(n):  # guide i, and the segment and joint i + 1 beyond it
        u = 3 * i + 1  # slips at this guide are at u and u + 1, at the next one at v and v + 1; the joint is at row
        v, row = u + 3, u + 2
        theta = x[row]
        path = crossing(theta, rig)
        lever_a, lever_b = path.lever
        stretch = x[u] - x[v] - path.length[0] + rest[0], x[u + 1] - x[v + 1] - path.length[1] + rest[1]
        moment, slope = joint_moment(theta, i, rig, memory, load)
        if memory.fibre_area.size > 0:
            bend = Bend(theta - load.rest_angle, stretch, path.lever, BY_TENSION, rate)
            far, bent, stiff = with_section(i, bend, rig, memory, work.sections[i])
            moment, slope = moment + bent, slope + stiff
        else:
            far = segment(stretch[0], stretch[1], path.lever, rig, BY_TENSION)
        ta, tb = far.tension
        work.tension[0, i + 1], work.tension[1, i + 1] = ta, tb
        drag = rate * rig.drag_joint
        b[row] = moment + drag * (theta - work.x_before[row]) - ta * lever_a - tb * lever_b - work.external[i]
        largest = max(largest, abs(b[row]) / rig.arm[0])
        add(
            band, row, row,
            slope + drag - ta * path.bow[0] - tb * path.bow[1] - lever_a * far.by_angle[0] - lever_b * far.by_angle[1],
        )  # fmt: skip
        by_a, by_b = -far.by_angle[0], -far.by_angle[1]  # slopes of the moment in the stretch: the same by symmetry
        add(band, row, u, -by_a)
        add(band, row, u + 1, -by_b)
        add(band, row, v, by_a)
        add(band, row, v + 1, by_b)
        guide = guide_at(i, x[u - 1], theta, near, far, rig, load.friction_scale, rate)
        largest = max(
            largest,
            guide_row(0, x, rig, memory, work, guide, settle),
            guide_row(1, x, rig, memory, work, guide, settle),
        )
        near = far
    outside = stop > 0.0 or loaded(rig)
    if outside:
        by_headings(work)
    return Balance(largest=largest, stop_stiffness=stop, outside=outside)
