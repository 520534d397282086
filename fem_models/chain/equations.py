"""The chain's equations, compiled: laws of its parts, residual and tangent. See :mod:`fem_models.chain.solve`."""

from __future__ import annotations

import math
from typing import NamedTuple

from fem_models.chain.compiled import chain_njit
from fem_models.load.stepping import Load
from hysteresis.arrays import Floats

BAND = 5  # half width of the tangent in the headings; it is stored as a[i, j - i + BAND]
BAND_OF_JOINTS = 4  # the same in the angles of the joints
SLACK_STIFFNESS = 1e-6
"""Of a slack piece of rope over that of a taut one, in the tangent only, so that its guides go with the joints as they
turn: left where they are, a stiff rope with next to no slack pulls taut here and there at random, and Newton's steps
find no end. No more than it takes, for the steps are no longer Newton's own."""
OPEN_STIFFNESS = 1e-9  # of EA/pitch, in the tangent only: a slack rope past a sliding guide leaves the slip open


class Constants(NamedTuple):
    """A rig as the kernels see it; N, mm, rad. Pairs are of tendons a and b; one that is not there has zeros."""

    preload_a: float
    preload_b: float
    pulled: float  # 1: the drive is the tension of rope a at the wheel, in N; 0: rope wound in
    rest: float  # angle of every joint without load
    scale: float  # of the forces, N
    bending: float  # stiffness of a joint
    elastic: float  # of its spring part
    arm_a: float
    arm_b: float
    half_gap: float  # of the even part of the path over a notch
    rope_a: float  # EA over pitch
    rope_b: float
    free_a: float  # EA over free length
    free_b: float
    toe_a: float
    toe_b: float
    axial: float  # compliance of a joint in compression
    mu: float
    guide: float
    sheath: float
    rest_wrap: float
    bristle_a: float
    bristle_b: float
    close_angle: float
    close_stiffness: float
    close_both: float  # 1: both ways, 0: positive angles only
    weight_x: float  # of a ring, along the straight tube
    weight_y: float
    stop_y: float
    stop_stiffness: float
    pitch: float
    creep_a: float  # stretch that comes with time, mm per N above the preload
    creep_b: float
    drag_sheath: float  # N s/mm
    drag_joint: float  # Nmm s/rad
    tolerance: float  # of the residual, N


class History(NamedTuple):
    """Memory of the dry elements: rest points, shapes (2, N) guides, (j, N) Jenkins, (k, N) flags; their constants."""

    guides: Floats
    jenkins: Floats
    jenkins_stiffness: Floats
    slip_moment: Floats
    flags: Floats
    flag_stiffness: Floats
    flag_upper: Floats
    flag_lower: Floats
    flag_span: Floats
    flag_climb: Floats


class Work(NamedTuple):
    """Scratch and results of one equilibrium."""

    a: Floats  # tangent, (3 N + 3, 2 BAND + 1)
    b: Floats  # residual, (3 N + 3,)
    lever: Floats  # dy_tip by the headings in the rows of the joints, (3 N + 3,)
    external: Floats  # moments of weight and stop on the joints, (N,)
    restoring: Floats  # what weight and stop add to the tangent by the headings, (N,)
    tension: Floats  # (2, N + 1)
    limit: Floats  # (2, N)
    state: Floats  # (2, N) of the guides: 0 sticks, 1 or -1 slides, the sign being that of the friction
    x_before: Floats  # (3 N + 3,) at the last equilibrium
    guess: Floats  # (2,) tension between wheel and base to start from


@chain_njit()
def free_tension(stretch: float, k: float, toe: float, preload: float, guess: float) -> tuple[float, float]:
    """Tension and its slope of the rope between wheel and base; unilateral if linear."""
    if toe == 0.0:
        tension = preload + k * stretch
        return (tension, k) if tension > 0.0 else (0.0, 0.0)
    target = preload + toe * math.log(preload) + k * stretch
    y = math.log(max(guess, 1e-300))
    for _ in range(100):  # Newton on exp(y) + toe y, convex and increasing
        e = math.exp(min(y, 700.0))
        step = max((e + toe * y - target) / (e + toe), -2.0)
        y -= step
        if abs(step) < 1e-15 * (1.0 + abs(y)):
            break
    tension = math.exp(y)
    return tension, k * tension / (tension + toe)


@chain_njit()
def segment(
    ea: float, eb: float, ca: float, cb: float, q: float, preload_a: float, preload_b: float
) -> tuple[float, float, float, float, float, float]:
    """Tensions of both ropes over one pitch, and dTa/dea, dTa/deb, dTb/dea, dTb/deb.

    The flexure shortens by q (Ta + Tb - T0a - T0b) and both ropes with it; a slack rope has no tension, and no
    stiffness but :data:`SLACK_STIFFNESS`.
    """
    thrust = preload_a + preload_b
    target_a = preload_a + ca * (ea + q * thrust)
    target_b = preload_b + cb * (eb + q * thrust)
    d = 1.0 + (ca + cb) * q
    ta = ((1.0 + cb * q) * target_a - ca * q * target_b) / d
    tb = ((1.0 + ca * q) * target_b - cb * q * target_a) / d
    if ta > 0.0 and tb > 0.0:
        cross = -ca * cb * q / d
        return ta, tb, (1.0 + cb * q) * ca / d, cross, cross, (1.0 + ca * q) * cb / d
    ta, tb = target_a / (1.0 + ca * q), target_b / (1.0 + cb * q)
    if ta > 0.0 and ta >= tb:
        return ta, 0.0, ca / (1.0 + ca * q), 0.0, 0.0, SLACK_STIFFNESS * cb
    if tb > 0.0:
        return 0.0, tb, SLACK_STIFFNESS * ca, 0.0, 0.0, cb / (1.0 + cb * q)
    return 0.0, 0.0, SLACK_STIFFNESS * ca, 0.0, 0.0, SLACK_STIFFNESS * cb


@chain_njit()
def settled(state: float, force: float, limit: float, tolerance: float) -> float:
    """State of a guide whose bristle would carry a force: a guide that slides sticks before it slides the other way.

    Without that stop between, a guide goes to and fro between both signs, and the front of sliding guides that runs
    along a tendon after a reversal is lost.
    """
    if state == 0.0:
        return math.copysign(1.0, force) if abs(force) > limit + tolerance else 0.0
    return 0.0 if force * state < limit - tolerance else state


@chain_njit()
def friction(
    state: float, force: float, stiffness: float, limit: float, ratio: float, mu: float, total: float
) -> tuple[float, float, float, float]:
    """Friction of a guide in a state, and its slopes in the slip, in either tension and in the wrap.

    ``force`` is that of the bristle, ``total`` the sum of the tensions on both sides, ``ratio`` tanh(mu wrap/2).
    """
    if state == 0.0:
        return force, stiffness, 0.0, 0.0
    return state * limit, 0.0, state * ratio, state * total * 0.5 * mu * (1.0 - ratio * ratio)


@chain_njit()
def flag(
    theta: float, rest: float, k: float, upper: float, lower: float, span: float, climb: float
) -> tuple[float, float]:
    """Moment and slope of a flag element; both branches are bounds of the elastic line from the rest angle."""
    sign = 1.0 if theta >= 0.0 else -1.0
    u, moment, slope = abs(theta), k * (theta - rest) * sign, k
    full = k * (u - span)
    back, ahead = climb * u + (1.0 - climb / k) * lower, climb * u + (1.0 - climb / k) * upper  # the plateaus
    low, high = max(min(k * u, back), full), max(min(k * u, ahead), full)
    if moment < low:
        moment, slope = low, k if (k * u < back or full > back) else climb
    if moment > high:
        moment, slope = high, k if (k * u < ahead or full > ahead) else climb
    return sign * moment, slope


@chain_njit()
def joint_moment(theta: float, i: int, c: Constants, h: History, load: Load) -> tuple[float, float]:
    """Moment that bends a joint to an angle, and its slope: spring, Jenkins and flag elements, closed notch."""
    moment, slope = c.elastic * (theta - load.rest_angle), c.elastic
    for j in range(h.slip_moment.size):
        part, top = h.jenkins_stiffness[j] * (theta - h.jenkins[j, i]), load.loop_scale * h.slip_moment[j]
        if abs(part) <= top:
            moment += part
            slope += h.jenkins_stiffness[j]
        else:
            moment += math.copysign(top, part)
    for j in range(h.flag_stiffness.size):
        part, tangent = flag(
            theta - load.rest_angle, h.flags[j, i], h.flag_stiffness[j], h.flag_upper[j], h.flag_lower[j],
            h.flag_span[j], h.flag_climb[j],
        )  # fmt: skip
        moment += part
        slope += tangent
    beyond = abs(theta) - c.close_angle
    if beyond > 0.0 and (theta > 0.0 or c.close_both > 0.0):
        moment += math.copysign(c.close_stiffness * beyond, theta)
        slope += c.close_stiffness
    return moment, slope


@chain_njit()
def external_moments(x: Floats, c: Constants, w: Work) -> float:
    """Fill the moments of weight and tip stop on every joint, their slopes and the tip's levers; the stop's N/mm.

    Ring i hangs at its centre, half a pitch beyond joint i, and carries the joints of those beyond. What a joint has
    more than the next one depends on the heading of its own ring alone, and on the push of the stop.
    """
    n = w.external.size
    w.external[:] = 0.0
    if c.weight_x == 0.0 and c.weight_y == 0.0 and c.stop_stiffness == 0.0:
        return 0.0
    heading, tip_y = 0.0, 0.0
    for i in range(n):
        heading += x[3 * i + 3]
        tip_y += (c.pitch if i < n - 1 else 0.5 * c.pitch) * math.sin(heading)
    side = 1.0 if c.stop_y >= 0.0 else -1.0
    push = side * c.stop_stiffness * max(0.0, side * (tip_y - c.stop_y))
    moment = 0.0
    for i in range(n - 1, -1, -1):
        cs, sn = math.cos(heading), math.sin(heading)
        length = c.pitch if i < n - 1 else 0.5 * c.pitch
        rings = (n - 0.5 - i) * c.pitch
        moment += rings * (c.weight_y * cs - c.weight_x * sn) - push * length * cs
        w.external[i] = moment
        w.restoring[i] = rings * (c.weight_y * sn + c.weight_x * cs) - push * length * sn
        w.lever[3 * i + 3] = length * cs
        heading -= x[3 * i + 3]
    return c.stop_stiffness if push != 0.0 else 0.0


@chain_njit()
def by_headings(w: Work) -> None:
    """Turn tangent and residual from joints to headings, and add what weight and stop do.

    Weight turns every joint as any joint beyond or before it bends: a full matrix. By the headings of the rings, joint
    less next joint, it is a diagonal: its potential is a sum over the rings (virtual work; the sparse form of absolute
    coordinates). The band is wider by one.
    """
    a, b, n = w.a, w.b, w.external.size
    for row in range(b.size):
        for column in range(max(3, row - 2 + (2 - row) % 3), min(row + 3, b.size), 3):  # of joints in this row
            a[row, column - 3 - row + BAND] -= a[row, column - row + BAND]
    for row in range(3, 3 * n, 3):
        for offset in range(BAND + 1):
            a[row, offset + BAND] -= a[row + 3, offset - 3 + BAND]
        b[row] -= b[row + 3]
    for i in range(n):
        a[3 * i + 3, BAND] += w.restoring[i]


@chain_njit()
def guide_row(
    side: int, i: int, x: Floats, c: Constants, h: History, w: Work, grip: tuple[float, float, float],
    by_angles: tuple[float, float], before: tuple[float, float, float, float, float],
    beyond: tuple[float, float, float], settle: bool,
) -> float:  # fmt: skip
    """Fill the row of one guide and tendon: tension before less tension beyond less friction; its residual, N.

    ``grip``: constant friction, tanh(mu wrap/2) and drag, N/mm. ``by_angles``: slopes of the wrap in the joints before
    and beyond.
    ``before``: slopes of the tension before in (joint before, slips a and b at the last guide, slips a and b here).
    ``beyond``: slopes of the tension beyond in this tendon's slip, in the other's, and in the joint beyond.
    ``settle``: let the guide stick or slide first; a state that contradicts its force even so counts as a residual.
    """
    u = 3 * i + 1
    row, across = u + side, u + 1 - side  # the other tendon at this guide
    a, proximal, distal = w.a, w.tension[side, i], w.tension[side, i + 1]
    bristle, rope = (c.bristle_a, c.rope_a) if side == 0 else (c.bristle_b, c.rope_b)
    total, pull = proximal + distal, bristle * (x[row] - h.guides[side, i])
    limit, viscous = grip[0] + total * grip[1], grip[2]
    if c.mu == 0.0 and grip[0] == 0.0:  # nothing rubs: it neither sticks nor slides
        bristle = pull = 0.0
    if settle:
        w.state[side, i] = settled(w.state[side, i], pull, limit, c.tolerance)
    w.limit[side, i] = limit
    force, by_slip, by_tension, by_wrap = friction(w.state[side, i], pull, bristle, limit, grip[1], c.mu, total)
    w.b[row] = proximal - distal - force - viscous * (x[row] - w.x_before[row])
    into, out = 1.0 - by_tension, 1.0 + by_tension
    if i > 0:
        a[row, u - 1 - row + BAND] += into * before[0]
        a[row, u - 3 - row + BAND] += into * before[1]
        a[row, u - 2 - row + BAND] += into * before[2]
    a[row, u - row + BAND] += into * before[3]
    a[row, u + 1 - row + BAND] += into * before[4]
    a[row, BAND] -= out * beyond[0] + by_slip + viscous + OPEN_STIFFNESS * (rope if rope > 0.0 else c.rope_a)
    a[row, across - row + BAND] -= out * beyond[1]
    a[row, 3 + BAND] += out * beyond[0]
    a[row, across + 3 - row + BAND] += out * beyond[1]
    a[row, u - 1 - row + BAND] -= by_wrap * by_angles[0]
    a[row, u + 2 - row + BAND] -= out * beyond[2] + by_wrap * by_angles[1]
    if settled(w.state[side, i], pull, limit, c.tolerance) != w.state[side, i]:
        return max(abs(w.b[row]), 2.0 * c.tolerance)
    return abs(w.b[row])


@chain_njit()
def assemble(
    x: Floats, c: Constants, h: History, load: Load, w: Work, rate: float, settle: bool
) -> tuple[float, float, bool]:
    """Fill tangent and residual at x = (theta_i, slip a, slip b) guide by guide.

    Returns the largest residual, the stiffness of a touched stop, and whether there is weight or a touched stop: the
    tangent is by headings then. Row by row: the base does not turn; each guide's balance of tensions; each joint's
    balance of moments; the ropes are anchored at the tip. ``rate`` is 1/s of the step for drag, 0 without; ``settle``
    as in :func:`guide_row`.
    """
    a, b = w.a, w.b
    n = h.guides.shape[1]
    a[:] = 0.0
    for row in (0, 3 * n + 1, 3 * n + 2):
        a[row, BAND] = 1.0
        b[row] = 0.0
    stop = external_moments(x, c, w)
    outside = stop > 0.0 or c.weight_x != 0.0 or c.weight_y != 0.0
    tp_a, k_a, tp_b, k_b = load.drive, 0.0, 0.0, 0.0
    if c.pulled == 0.0:
        tp_a, k_a = free_tension(load.drive - x[1] - load.slack[0], c.free_a, c.toe_a, c.preload_a, w.guess[0])
        tp_b, k_b = free_tension(-load.drive - x[2] - load.slack[1], c.free_b, c.toe_b, c.preload_b, w.guess[1])
    start_sn, start_cs = math.sin(0.5 * c.rest), math.cos(0.5 * c.rest)
    start_even = 2.0 * c.half_gap * (1.0 - start_cs)  # of the paths at rest, where the ropes have their lengths
    start_a, start_b = start_even + 2.0 * c.arm_a * start_sn, start_even - 2.0 * c.arm_b * start_sn
    w.tension[0, 0], w.tension[1, 0] = tp_a, tp_b
    # slopes of the proximal tensions in (theta_i, slip a and b of the last guide, slip a and b of this guide)
    pa = (0.0, 0.0, 0.0, -k_a, 0.0)
    pb = (0.0, 0.0, 0.0, 0.0, -k_b)
    worst = 0.0
    for i in range(n):  # guide i, and the segment and joint i + 1 beyond it
        u = 3 * i + 1
        v = u + 3
        theta = x[u + 2]
        sn, cs = math.sin(0.5 * theta), math.cos(0.5 * theta)
        ra, rb, gap = c.arm_a, c.arm_b, c.half_gap  # path of either rope over the notch, its slope and curvature
        path_a, arm_a, bow_a = 2.0 * (gap * (1.0 - cs) + ra * sn), gap * sn + ra * cs, 0.5 * (gap * cs - ra * sn)
        path_b, arm_b, bow_b = 2.0 * (gap * (1.0 - cs) - rb * sn), gap * sn - rb * cs, 0.5 * (gap * cs + rb * sn)
        ta, tb, aa, ab, ba, bb = segment(
            x[u] - x[v] - path_a + start_a, x[u + 1] - x[v + 1] - path_b + start_b, c.rope_a, c.rope_b, c.axial,
            c.preload_a, c.preload_b,
        )  # fmt: skip
        w.tension[0, i + 1], w.tension[1, i + 1] = ta, tb
        a_theta, b_theta = -(aa * arm_a + ab * arm_b), -(ba * arm_a + bb * arm_b)
        moment, slope = joint_moment(theta, i, c, h, load)
        row = u + 2
        viscous_joint = rate * c.drag_joint
        b[row] = moment + viscous_joint * (theta - w.x_before[row]) - ta * arm_a - tb * arm_b - w.external[i]
        worst = max(worst, abs(b[row]) / ra)
        a[row, BAND] = slope + viscous_joint - ta * bow_a - tb * bow_b - arm_a * a_theta - arm_b * b_theta
        by_a, by_b = arm_a * aa + arm_b * ba, arm_a * ab + arm_b * bb
        a[row, u - row + BAND] = -by_a
        a[row, u + 1 - row + BAND] = -by_b
        a[row, v - row + BAND] = by_a
        a[row, v + 1 - row + BAND] = by_b
        before = x[u - 1]
        wrap, constant = 0.5 * (abs(theta) + abs(before)), c.guide
        drag = 0.0
        if i == 0:
            wrap += c.rest_wrap
            constant += c.sheath
            drag = rate * c.drag_sheath
        grip = (constant, math.tanh(0.5 * c.mu * wrap), drag)
        half_before = 0.5 if before > 0.0 else (-0.5 if before < 0.0 else 0.0)
        half_theta = 0.5 if theta > 0.0 else (-0.5 if theta < 0.0 else 0.0)
        halves = (half_before, half_theta)
        worst = max(
            worst,
            guide_row(0, i, x, c, h, w, grip, halves, pa, (aa, ab, a_theta), settle),
            guide_row(1, i, x, c, h, w, grip, halves, pb, (bb, ba, b_theta), settle),
        )
        pa = (a_theta, aa, ab, -aa, -ab)
        pb = (b_theta, ba, bb, -ba, -bb)
    if outside:
        by_headings(w)
    return worst, stop, outside
