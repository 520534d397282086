"""Laws of the chain's parts, compiled: tendon, guide, joint."""

from __future__ import annotations

import math
from typing import NamedTuple

from fem_models.chain.compiled import chain_njit
from fem_models.chain.parameters import Memory, Pair, Parameters

SLACK_STIFFNESS = 1e-6
"""Stiffness of a slack segment over that of a taut one, in the tangent only.

With it the guides of a slack tendon move with the joints. Without it they stay behind, a stiff tendon with next to no
slack becomes taut here and there at random, and Newton's method finds no end. It is as small as it can be, because the
steps are no longer Newton's own.
"""


NEITHER, ONLY_A, ONLY_B, BOTH = range(4)
"""Tendons that are taut along a segment."""
BY_TENSION = -1
"""Those that pull."""


class Crossing(NamedTuple):
    """Paths of both tendons over one notch: length, slope and half the curvature by the joint's angle."""

    length: Pair
    lever: Pair
    bow: Pair


class Span(NamedTuple):
    """Tensions of both tendons over a length, and their slopes.

    ``own`` is by the stretch of the same tendon, ``cross`` by that of the other one, ``by_angle`` by the angle of the
    joint that the tendons cross.
    """

    tension: Pair
    own: Pair
    cross: float
    by_angle: Pair


class Guide(NamedTuple):
    """One guide as both tendons meet it."""

    number: int  # from the base, 0
    near: Span  # towards the wheel
    far: Span
    constant: float  # friction that does not depend on the tensions, N
    ratio: float  # of friction to the sum of the tensions on both sides, tanh(mu wrap/2)
    capstan: float
    drag: float  # N/mm of a step


class GuideForce(NamedTuple):
    """Friction of a guide, and its slopes in the slip, in either tension and in the wrap."""

    force: float
    by_slip: float
    by_tension: float
    by_wrap: float


ELASTIC, UNTRANSFORMED, LOWER, UPPER, TRANSFORMED = range(5)
"""Branches of a flag element: the elastic line from its rest angle, that from no angle, the plateaus of unloading and
loading, and the line beyond the span of the transformation."""


class Flag(NamedTuple):
    """Parameters of one flag element; see :class:`fem_models.joint.superelastic.FlagFibres`."""

    stiffness: float
    upper: float
    lower: float
    span: float
    climb: float


@chain_njit(forceinline=True)
def free_tension(stretch: float, side: int, rig: Parameters, guess: float, taut: int) -> tuple[float, float]:
    """Tension and its slope of a tendon between wheel and base; unilateral where it has no toe region.

    ``taut`` as of :func:`segment`.
    """
    stiffness, toe, preload = rig.free[side], rig.toe[side], rig.preload[side]
    if toe == 0.0:
        tension = preload + stiffness * stretch
        pulls = tension > 0.0 if taut == BY_TENSION else (taut >> side) & 1 == 1
        return (tension, stiffness) if pulls else (0.0, 0.0)
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


@chain_njit(forceinline=True)
def crossing(theta: float, rig: Parameters) -> Crossing:
    """Paths over a notch that is bent by theta."""
    return crossing_at(math.sin(0.5 * theta), math.cos(0.5 * theta), rig)


@chain_njit(forceinline=True)
def crossing_at(sn: float, cs: float, rig: Parameters) -> Crossing:
    """Paths over a notch, by sine and cosine of half its angle.

    The rigid gap moves with the rings, and the tendon takes the chord.
    """
    gap, a, b = rig.half_gap, rig.arm[0], rig.arm[1]
    return Crossing(
        length=(2.0 * (gap * (1.0 - cs) + a * sn), 2.0 * (gap * (1.0 - cs) + b * sn)),
        lever=(gap * sn + a * cs, gap * sn + b * cs),
        bow=(0.5 * (gap * cs - a * sn), 0.5 * (gap * cs - b * sn)),
    )


@chain_njit(forceinline=True)
def segment(stretch_a: float, stretch_b: float, lever: Pair, rig: Parameters, taut: int) -> Span:
    """Tensions over one pitch, from guide to guide.

    The flexure shortens by q (Ta + Tb - T0a - T0b) and both tendons with it. A slack tendon has no tension, and no
    stiffness but :data:`SLACK_STIFFNESS`. ``taut`` says which tendons are, :data:`BY_TENSION` those that pull.
    """
    q, ka, kb = rig.axial, rig.segment[0], rig.segment[1]
    preload_a, preload_b = rig.preload[0], rig.preload[1]
    thrust = preload_a + preload_b
    target_a = preload_a + ka * (stretch_a + q * thrust)
    target_b = preload_b + kb * (stretch_b + q * thrust)
    by_d = 1.0 / (1.0 + (ka + kb) * q)
    ta = ((1.0 + kb * q) * target_a - ka * q * target_b) * by_d
    tb = ((1.0 + ka * q) * target_b - kb * q * target_a) * by_d
    cross = 0.0
    if taut == BOTH or (taut == BY_TENSION and ta > 0.0 and tb > 0.0):
        cross = -ka * kb * q * by_d
        own_a, own_b = (1.0 + kb * q) * ka * by_d, (1.0 + ka * q) * kb * by_d
    else:
        ta, tb = target_a / (1.0 + ka * q), target_b / (1.0 + kb * q)
        own_a, own_b = SLACK_STIFFNESS * ka, SLACK_STIFFNESS * kb
        if taut == ONLY_A or (taut == BY_TENSION and ta > 0.0 and ta >= tb):
            tb, own_a = 0.0, ka / (1.0 + ka * q)
        elif taut == ONLY_B or (taut == BY_TENSION and tb > 0.0):
            ta, own_b = 0.0, kb / (1.0 + kb * q)
        else:
            ta = tb = 0.0
    by_angle = (-(own_a * lever[0] + cross * lever[1]), -(cross * lever[0] + own_b * lever[1]))
    return Span(tension=(ta, tb), own=(own_a, own_b), cross=cross, by_angle=by_angle)


@chain_njit(forceinline=True)
def next_state(state: float, force: float, limit: float, tolerance: float) -> float:
    """State of a guide whose bristle would carry a force: 0 sticks, 1 or -1 slides.

    A guide that slides sticks before it slides in the other direction. Otherwise a guide would alternate between both
    signs, and the front of sliding guides that runs along a tendon after a reversal would be lost.
    """
    if state == 0.0:
        return math.copysign(1.0, force) if abs(force) > limit + tolerance else 0.0
    return 0.0 if force * state < limit - tolerance else state


@chain_njit(forceinline=True)
def wrap(i: int, before: float, theta: float, rig: Parameters) -> float:
    """Angle that tendons turn at guide i, rad, between joints at the angles ``before`` and ``theta``."""
    angle = 0.5 * (abs(theta) + abs(before))
    return angle + rig.rest_wrap if i == 0 else angle


@chain_njit(forceinline=True)
def guide_at(i: int, ratio: float, near: Span, far: Span, rig: Parameters, scale: float, rate: float) -> Guide:
    """Guide i; ``scale`` is the factor of its friction, ``rate`` is 1/s of the step, 0 without drag."""
    constant, drag = rig.guide, 0.0
    if i == 0:
        constant += rig.sheath
        drag = rate * rig.drag_sheath
    return Guide(
        number=i, near=near, far=far, constant=scale * constant, ratio=ratio, capstan=scale * rig.capstan, drag=drag
    )


@chain_njit(forceinline=True)
def friction(state: float, force: float, bristle: float, total: float, guide: Guide) -> GuideForce:
    """Friction of a guide in a state; ``force`` is that of its bristle, ``total`` the sum of both tensions."""
    if state == 0.0:
        return GuideForce(force=force, by_slip=bristle, by_tension=0.0, by_wrap=0.0)
    limit = guide.constant + total * guide.ratio
    return GuideForce(
        force=state * limit,
        by_slip=0.0,
        by_tension=state * guide.ratio,
        by_wrap=state * total * 0.5 * guide.capstan * (1.0 - guide.ratio * guide.ratio),
    )


@chain_njit(forceinline=True)
def flag_element(j: int, memory: Memory) -> Flag:
    """Parameters of flag element j."""
    return Flag(
        stiffness=memory.flag_stiffness[j],
        upper=memory.flag_upper[j],
        lower=memory.flag_lower[j],
        span=memory.flag_span[j],
        climb=memory.flag_climb[j],
    )


@chain_njit(forceinline=True)
def flag_branch(theta: float, rest: float, flag: Flag) -> int:
    """Where a flag element is: on the elastic line from its rest angle, or at a bound of it."""
    k, climb = flag.stiffness, flag.climb
    sign = 1.0 if theta >= 0.0 else -1.0
    u, moment = abs(theta), k * (theta - rest) * sign
    full = k * (u - flag.span)
    lower, upper = climb * u + (1.0 - climb / k) * flag.lower, climb * u + (1.0 - climb / k) * flag.upper
    least, most = max(min(k * u, lower), full), max(min(k * u, upper), full)
    if least <= moment <= most:
        return ELASTIC
    plateau, other = (lower, LOWER) if moment < least else (upper, UPPER)
    if full > plateau:
        return TRANSFORMED
    return UNTRANSFORMED if k * u < plateau else other


@chain_njit(forceinline=True)
def flag_along(branch: int, theta: float, rest: float, flag: Flag) -> tuple[float, float]:
    """Moment and slope of a flag element on one of its branches, straight lines."""
    k, climb = flag.stiffness, flag.climb
    sign = 1.0 if theta >= 0.0 else -1.0
    if branch == ELASTIC:
        return k * (theta - rest), k
    if branch == UNTRANSFORMED:
        return k * theta, k
    if branch == TRANSFORMED:
        return k * (theta - sign * flag.span), k
    plateau = flag.lower if branch == LOWER else flag.upper
    return climb * theta + sign * (1.0 - climb / k) * plateau, climb


@chain_njit(forceinline=True)
def flag_moment(theta: float, rest: float, flag: Flag) -> tuple[float, float]:
    """Moment and slope of a flag element; both branches are bounds of the elastic line from the rest angle."""
    return flag_along(flag_branch(theta, rest, flag), theta, rest, flag)


@chain_njit(forceinline=True)
def spring(bent: float, rig: Parameters) -> tuple[float, float]:
    """Moment of a flexure's spring that is bent from its rest, and its slope.

    See :class:`fem_models.rig.joints.MeasuredJoint`.
    """
    slope, limit, angle = rig.hardening
    if slope == 0.0 and limit == 0.0:
        return rig.elastic * bent, rig.elastic
    u = abs(bent) / angle
    beyond = 0.5 * slope * math.log1p(u * u) + limit * (u - math.atan(u))
    growth = u * (slope + limit * u) / (1.0 + u * u)
    moment = rig.elastic * bent + math.copysign(1.0, bent) * rig.hardened * angle * beyond
    return moment, rig.elastic + rig.hardened * growth


@chain_njit(forceinline=True)
def closed(theta: float, rig: Parameters) -> bool:
    """Whether the edges of a notch touch."""
    return abs(theta) > rig.contact_angle and (theta > 0.0 or rig.contact_both)
