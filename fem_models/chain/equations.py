"""Residual and tangent of the chain's equations, compiled. See :mod:`fem_models.chain.solve`.

The unknowns x, shape (3 N + 3,), are the angle of a joint and the slips of tendons a and b at the guide beyond it, from
the base (whose angle is 0) to the tip (whose slips are 0, the anchors).
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from fem_models.chain.compiled import chain_njit
from fem_models.chain.each import aside, beyond, joint_at, loop_part, rest_path, ring_lever
from fem_models.chain.laws import (
    BY_TENSION,
    Guide,
    Span,
    closed,
    crossing,
    crossing_at,
    flag_element,
    flag_moment,
    free_tension,
    friction,
    guide_at,
    next_state,
    segment,
    spring,
)
from fem_models.chain.parameters import Memory, Pair, Parameters
from fem_models.chain.section import ROW, Bend, with_section
from fem_models.chain.turns import friction_ratios, half_turns
from fem_models.load.stepping import Load
from hysteresis.arrays import Floats

BAND = 5  # half width of the tangent by the headings of the rings; it is stored as tangent[i, j - i + BAND]
BAND_OF_JOINTS = 4  # the same by the angles of the joints
BY_DEPTH = -1  # whether the tip touches its stop
ROWS = 17
ANGLE, SINE, COSINE, MOMENT, STIFF, RATIO, CROSS = range(7)
OWN, TURN, SLIDES, HOLDS, BY_WRAP = range(7, ROWS, 2)
"""Places in the rows of :class:`Work`. Of a joint: its angle, sine and cosine of half of it, its moment; slope of the
whole moment in the angle; friction of the guide before it to the sum of the tensions. Of the segment that crosses it:
slopes of the tensions in the other's stretch; and from here on in pairs, of tendons a and b: in the own stretch and in
the angle; slopes of the friction of the guide in the tensions, in the slip and in the wrap."""
SWEPT = 9
"""What :func:`fem_models.chain.sweep.sweep` keeps of a joint: slips by those at the next guide (2 x 2) and without
them, angle by the stretch of either tendon and without it."""
OPEN_STIFFNESS = 1e-9  # of EA/pitch, in the tangent only: a slack tendon past a sliding guide leaves the slip open


class Work(NamedTuple):
    """Scratch and results of one equilibrium."""

    tangent: Floats  # (3 N + 3, 2 BAND + 1)
    residual: Floats  # (3 N + 3,)
    lever: Floats  # dy_tip by the headings in the rows of the joints, (3 N + 3,)
    behind: Floats  # the tangent's solution for it
    external: Floats  # moments of weight and stop on the joints, (N,)
    restoring: Floats  # what weight and stop add to the tangent by the headings, (N,)
    tension: Floats  # (2, N + 1)
    limit: Floats  # (2, N)
    state: Floats  # (2, N) of the guides: 0 sticks, 1 or -1 slides, the sign being that of the friction
    x_before: Floats  # (3 N + 3,) at the last equilibrium
    x_last: Floats  # (3 N + 3,) at the last pseudo step of a jump
    guess: Floats  # (2,) tension between wheel and base to start from
    rows: Floats  # (ROWS, N), of every joint and of the guide before it
    swept: Floats  # (N, SWEPT)
    sections: Floats  # (N, ROW), see :func:`fem_models.chain.section.with_section`


class Pace(NamedTuple):
    """How fast a step is, 1/s, 0 without: for drag, for the heat of superelastic sections, in a jump's pseudo-time.

    Drag counts from ``Work.x_before``, the viscous forces of a jump from ``Work.x_last``.
    """

    drag: float
    heat: float
    relax: float


class Balance(NamedTuple):
    """How far x is from equilibrium.

    ``outside``: there is weight, a tip load or a touched stop, and the tangent is by the headings of the rings.
    """

    largest: float  # residual, N
    stop_stiffness: float  # of a touched tip stop, N/mm, else 0
    outside: bool
    free: Pair  # slopes of the tensions between wheel and base


@chain_njit(allocates=True)
def work_space(rig: Parameters, joints: int) -> Work:
    """Arrays for a chain; the tensions are guessed to be the preload."""
    size = 3 * (joints + 1)
    return Work(
        tangent=np.zeros((size, 2 * BAND + 1)),
        residual=np.zeros(size),
        lever=np.zeros(size),
        behind=np.zeros(size),
        external=np.zeros(joints),
        restoring=np.zeros(joints),
        tension=np.zeros((2, joints + 1)),
        limit=np.zeros((2, joints)),
        state=np.zeros((2, joints)),
        x_before=np.zeros(size),
        x_last=np.zeros(size),
        guess=np.array(rig.preload),
        rows=np.zeros((ROWS, joints)),
        swept=np.zeros((joints, SWEPT)),
        sections=np.zeros((joints, ROW)),
    )


@chain_njit(forceinline=True)
def copy(values: Floats, out: Floats) -> None:
    """Copy a row; an assignment of slices takes many times as long for rows as short as these."""
    for i in range(out.size):
        out[i] = values[i]


@chain_njit(forceinline=True)
def copy_rows(values: Floats, out: Floats) -> None:
    """Copy an array of two dimensions."""
    for i in range(out.shape[0]):
        for j in range(out.shape[1]):
            out[i, j] = values[i, j]


@chain_njit(forceinline=True)
def copy_both(values: Floats, out: Floats) -> None:
    """Copy an array of tendons a and b, shape (2, n)."""
    for side in range(2):
        for i in range(out.shape[1]):
            out[side, i] = values[side, i]


@chain_njit(forceinline=True)
def add(band: Floats, row: int, column: int, value: float) -> None:
    """Add to an entry of a matrix that is stored as a band."""
    band[row, column - row + BAND] += value


@chain_njit(forceinline=True)
def loaded(rig: Parameters) -> bool:
    """Whether rings have weight or the tip a load."""
    return rig.weight_x != 0.0 or rig.weight_y != 0.0 or rig.tip_x != 0.0 or rig.tip_y != 0.0


@chain_njit(forceinline=True)
def viscous_of(place: int, rig: Parameters) -> float:
    """Viscous coefficient of a coordinate in a jump: of a joint, Nmm/rad, at places 0, 3, ...; of a slip, N/mm."""
    return rig.viscosity if place % 3 == 0 else rig.viscosity / (rig.arm[0] * rig.arm[0])


@chain_njit()
def external_moments(x: Floats, rig: Parameters, load: Load, work: Work, touched: int) -> float:
    """Fill the moments of weight, tip load and tip stop on every joint, their slopes and the tip's levers.

    Returns the stiffness of the stop, N/mm, where the tip touches it. Ring i hangs at its centre beyond joint i, and
    carries the joints of those beyond. What a joint has more than the next one depends on the heading of its own ring
    alone, and on the push of the stop. A dead force on the tip acts on the same levers as the stop. Where the neutral
    axes of neighbours differ, the way from joint to joint has a step across the ring. The tip's height counts from that
    of the straight tube.
    ``touched`` is 1 or 0 where it is given whether the tip touches, else :data:`BY_DEPTH`.
    """
    n = work.external.size
    work.external[:] = 0.0
    if not loaded(rig) and rig.stop_stiffness == 0.0:
        return 0.0
    heading, tip_y = 0.0, 0.0
    for i in range(n):
        heading += x[3 * i + 3]
        tip_y += beyond(rig, i, n) * math.sin(heading) + aside(rig, i) * (math.cos(heading) - 1.0)
    side = 1.0 if rig.stop_y >= 0.0 else -1.0
    depth = side * (tip_y - rig.stop_y)
    touches = depth > 0.0 if touched == BY_DEPTH else touched == 1
    push = side * rig.stop_stiffness * depth if touches else 0.0
    weight_x, weight_y = load.dead * rig.weight_x, load.dead * rig.weight_y
    tip_x, tip_load = load.dead * rig.tip_x, load.dead * rig.tip_y
    moment = 0.0
    for i in range(n - 1, -1, -1):
        cs, sn = math.cos(heading), math.sin(heading)
        length, rings, step = beyond(rig, i, n), ring_lever(rig, i, n), aside(rig, i)
        steps = (n - 1 - i) * step  # of all rings beyond
        moment += rings * (weight_y * cs - weight_x * sn) - push * (length * cs - step * sn)
        moment += length * (tip_load * cs - tip_x * sn)
        moment -= steps * (weight_y * sn + weight_x * cs) + step * (tip_load * sn + tip_x * cs)
        work.external[i] = moment
        work.restoring[i] = rings * (weight_y * sn + weight_x * cs) - push * (length * sn + step * cs)
        work.restoring[i] += length * (tip_load * sn + tip_x * cs)
        work.restoring[i] += steps * (weight_y * cs - weight_x * sn) + step * (tip_load * cs - tip_x * sn)
        work.lever[3 * i + 3] = length * cs - step * sn
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
def free_span(x: Floats, load: Load, rig: Parameters, guess: Pair, taut: int) -> Span:
    """Tensions between wheel and base: given under load control, else of what the wheel winds in.

    ``guess`` is where the search for the tensions of a toe region starts; ``taut`` is as of
    :func:`fem_models.chain.laws.segment`.
    """
    if rig.load_control:
        return Span(tension=(load.drive, 0.0), own=(0.0, 0.0), cross=0.0, by_angle=(0.0, 0.0))
    a, slope_a = free_tension(load.drive - x[1] - load.slack[0], 0, rig, guess[0], taut)
    b, slope_b = free_tension(-load.drive - x[2] - load.slack[1], 1, rig, guess[1], taut)
    return Span(tension=(a, b), own=(slope_a, slope_b), cross=0.0, by_angle=(0.0, 0.0))


@chain_njit(forceinline=True)
def bend_joints(x: Floats, rig: Parameters, memory: Memory, load: Load, rows: Floats) -> None:
    """Fill what depends on a joint's angle alone: half its sine and cosine, its moment with slope, the wrap's ratio.

    Loops of one operation over all joints: a compiler does several joints at a time.
    """
    n, steepest = rows.shape[1], 0.0
    for i in range(n):
        rows[ANGLE, i] = x[3 * i + 3]
        steepest = max(steepest, abs(x[3 * i + 3]))
    half_turns(rows[ANGLE], steepest, rows[SINE], rows[COSINE])
    if rig.hardening[0] == 0.0 and rig.hardening[1] == 0.0:
        for i in range(n):
            elastic = joint_at(rig, i).elastic
            rows[MOMENT, i], rows[STIFF, i] = elastic * (rows[ANGLE, i] - load.rest_angle), elastic
    else:
        for i in range(n):
            rows[MOMENT, i], rows[STIFF, i] = spring(rows[ANGLE, i] - load.rest_angle, rig)
    jenkins = memory.jenkins
    for j in range(memory.slip_moment.size):
        first, most = memory.jenkins_stiffness[j], load.loop_scale * memory.slip_moment[j]
        for i in range(n):
            stiffness, limit = loop_part(rig, i) * first, loop_part(rig, i) * most
            part = stiffness * (rows[ANGLE, i] - jenkins[j, i])
            rows[MOMENT, i] += min(max(part, -limit), limit)
            rows[STIFF, i] += stiffness if abs(part) <= limit else 0.0
    for j in range(memory.flag_stiffness.size):
        flag, rest = flag_element(j, memory), memory.flags[j]
        for i in range(n):
            part, tangent = flag_moment(rows[ANGLE, i] - load.rest_angle, rest[i], flag)
            rows[MOMENT, i] += part
            rows[STIFF, i] += tangent
    if steepest > rig.contact_angle:
        for i in range(n):
            theta, own = rows[ANGLE, i], joint_at(rig, i)
            if closed(theta, own):
                rows[MOMENT, i] += math.copysign(own.contact_stiffness * (abs(theta) - own.contact_angle), theta)
                rows[STIFF, i] += own.contact_stiffness
    friction_ratios(rows[ANGLE], steepest, load.friction_scale * rig.capstan, rig.rest_wrap, rows[RATIO])


@chain_njit(forceinline=True)
def guide_balance(
    side: int, x: Floats, rig: Parameters, memory: Memory, work: Work, guide: Guide, ease: float, settle: bool
) -> float:
    """Fill residual and slopes of one guide and tendon: tension before less tension beyond less friction, N.

    With ``settle`` the guide sticks or slides first, by its force. A state that contradicts the force even so counts as
    a residual above the tolerance. ``ease`` is the viscous coefficient of a jump, N/mm. Returns the residual's size.
    """
    i, near, far, rows = guide.number, guide.near.tension[side], guide.far.tension[side], work.rows
    at = 3 * i + 1 + side
    bristle, total = rig.bristle[side], near + far
    force, limit = bristle * (x[at] - memory.guides[side, i]), guide.constant + total * guide.ratio
    if rig.capstan == 0.0 and guide.constant == 0.0:  # without friction it neither sticks nor slides
        bristle = force = 0.0
    state = work.state[side, i]
    if settle:
        state = next_state(state, force, limit, rig.tolerance)
        work.state[side, i] = state
    work.limit[side, i] = limit
    dry = friction(state, force, bristle, total, guide)
    off = near - far - dry.force - guide.drag * (x[at] - work.x_before[at]) - ease * (x[at] - work.x_last[at])
    stiffness = rig.segment[side] if rig.segment[side] > 0.0 else rig.segment[0]
    work.residual[at] = off
    rows[SLIDES + side, i] = dry.by_tension
    rows[HOLDS + side, i] = dry.by_slip + guide.drag + ease + OPEN_STIFFNESS * stiffness
    rows[BY_WRAP + side, i] = dry.by_wrap
    if next_state(state, force, limit, rig.tolerance) != state:
        return max(abs(off), 2.0 * rig.tolerance)
    return abs(off)


@chain_njit(forceinline=True)
def balance_at(x: Floats, rig: Parameters, memory: Memory, load: Load, work: Work, pace: Pace, settle: bool) -> Balance:
    """Fill residuals at x, and the slopes of which a tangent is made.

    Row by row: the base does not rotate; each guide's balance of tensions; each joint's balance of moments; the tendons
    are anchored at the tip. ``settle`` as in :func:`guide_balance`.
    """
    b, n, rows, tension = work.residual, memory.guides.shape[1], work.rows, work.tension
    outside = loaded(rig) or rig.stop_stiffness != 0.0
    stop = external_moments(x, rig, load, work, BY_DEPTH) if outside else 0.0
    bend_joints(x, rig, memory, load, rows)
    last = max(tension[0, 0], 0.01 * work.guess[0]), max(tension[1, 0], 0.01 * work.guess[1])
    near = free = free_span(x, load, rig, last, BY_TENSION)
    tension[0, 0], tension[1, 0] = near.tension
    alike, drag, largest = (
        crossing(rig.rest, rig).length,
        pace.drag * rig.drag_joint,
        0.0,
    )  # where tendons have their lengths
    turning, ease = pace.relax * viscous_of(0, rig), pace.relax * viscous_of(1, rig)
    for i in range(n):  # guide i, and the segment and joint i + 1 beyond it
        own, rest = joint_at(rig, i), rest_path(rig, i, alike)
        u = 3 * i + 1  # slips at this guide are at u and u + 1, at the next one at v and v + 1; the joint is at row
        v, row = u + 3, u + 2
        theta, moment = rows[ANGLE, i], rows[MOMENT, i]
        path = crossing_at(rows[SINE, i], rows[COSINE, i], own)
        stretch = x[u] - x[v] - path.length[0] + rest[0], x[u + 1] - x[v + 1] - path.length[1] + rest[1]
        if memory.fibre_area.size > 0:
            bend = Bend(theta - load.rest_angle, stretch, path.lever, BY_TENSION, pace.heat)
            far, bent, stiff = with_section(i, bend, own, memory, work.sections[i])
            moment += bent
            rows[STIFF, i] += stiff
        else:
            far = segment(stretch[0], stretch[1], path.lever, own, BY_TENSION)
        ta, tb = far.tension
        tension[0, i + 1], tension[1, i + 1] = ta, tb
        off = moment - ta * path.lever[0] - tb * path.lever[1]
        if drag > 0.0:
            off += drag * (theta - work.x_before[row])
        if turning > 0.0:
            off += turning * (theta - work.x_last[row])
        if outside:
            off -= work.external[i]
        b[row] = off
        largest = max(largest, abs(off) * (1.0 / own.arm[0]))
        rows[STIFF, i] += drag + turning - ta * path.bow[0] - tb * path.bow[1]
        rows[STIFF, i] -= path.lever[0] * far.by_angle[0] + path.lever[1] * far.by_angle[1]
        rows[OWN, i], rows[OWN + 1, i] = far.own
        rows[CROSS, i] = far.cross
        rows[TURN, i], rows[TURN + 1, i] = far.by_angle
        guide = guide_at(i, rows[RATIO, i], near, far, rig, load.friction_scale, pace.drag)
        largest = max(
            largest,
            guide_balance(0, x, rig, memory, work, guide, ease, settle),
            guide_balance(1, x, rig, memory, work, guide, ease, settle),
        )
        near = far
    return Balance(largest=largest, stop_stiffness=stop, outside=stop > 0.0 or loaded(rig), free=free.own)


@chain_njit(forceinline=True)
def half_sign(angle: float) -> float:
    """Slope of half the size of an angle; 0 at no angle."""
    return 0.5 if angle > 0.0 else (-0.5 if angle < 0.0 else 0.0)


@chain_njit()
def fill_tangent(x: Floats, work: Work, balance: Balance) -> None:
    """Write the tangent as a band, of the slopes at x; where there are loads from outside, by headings."""
    band, rows, n = work.tangent, work.rows, work.rows.shape[1]
    band[:] = 0.0
    for row in (0, 3 * n + 1, 3 * n + 2):
        add(band, row, row, 1.0)
        work.residual[row] = 0.0
    for i in range(n):
        u, row = 3 * i + 1, 3 * i + 3
        add(band, row, row, rows[STIFF, i])
        for side in range(2):
            at, other = u + side, u + 1 - side
            turn, cross, slides = rows[TURN + side, i], rows[CROSS, i], rows[SLIDES + side, i]
            into, out, by_wrap = 1.0 - slides, 1.0 + slides, rows[BY_WRAP + side, i]
            add(band, row, at, turn)
            add(band, row, at + 3, -turn)
            before = balance.free[side]
            if i > 0:
                before = rows[OWN + side, i - 1]
                add(band, at, row - 3, into * rows[TURN + side, i - 1])
                add(band, at, at - 3, into * before)
                add(band, at, other - 3, into * rows[CROSS, i - 1])
                add(band, at, other, -into * rows[CROSS, i - 1])
            add(band, at, at, -(into * before + out * rows[OWN + side, i] + rows[HOLDS + side, i]))
            add(band, at, other, -out * cross)
            add(band, at, at + 3, out * rows[OWN + side, i])
            add(band, at, other + 3, out * cross)
            add(band, at, row - 3, -by_wrap * half_sign(x[row - 3]))
            add(band, at, row, -(out * turn + by_wrap * half_sign(x[row])))
    if balance.outside:
        by_headings(work)


@chain_njit()
def assemble(x: Floats, rig: Parameters, memory: Memory, load: Load, work: Work, rate: float, settle: bool) -> Balance:
    """Fill residual and tangent at x; ``rate`` is 1/s of the step, 0 without, the rest as of :func:`balance_at`."""
    balance = balance_at(x, rig, memory, load, work, Pace(rate, rate, 0.0), settle)
    fill_tangent(x, work, balance)
    return balance
