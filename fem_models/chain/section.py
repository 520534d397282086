"""Superelastic section of a joint under the thrust of both tendons, compiled: its two unknowns are solved locally.

Bending phi and elongation g of the section follow from the angle of the joint and the stretch of both tendons over the
pitch (static condensation): see :mod:`fem_models.joint.superelastic_section` for the equations. The chain sees
tensions and moment with their consistent slopes, and its band stays as it is. What the fibres do is in
:mod:`fem_models.chain.fibres`.
"""

from __future__ import annotations

import math
from typing import NamedTuple

from fem_models.chain.compiled import chain_njit
from fem_models.chain.each import fibre_row
from fem_models.chain.fibres import sums_of
from fem_models.chain.laws import Span, segment
from fem_models.chain.parameters import Memory, Pair, Parameters
from hysteresis.arrays import Floats

BENT, LONGER = 0, 1
"""Places of phi and g in a row of sections; the angle and both stretches follow, then slopes of phi and of g in
them."""
ROW = 11
_ITERATIONS = 200
_UPHILL = 0.5  # slope of the potential at the end of a step, over that at its start, at most


class Bend(NamedTuple):
    """What a section has to follow.

    The angle of the joint from rest, roots included; the stretch of the tendons if the section kept its length under
    preload; their levers; which tendons are taut, as of :func:`fem_models.chain.laws.segment`; 1/s of the step, 0 of a
    slow one.
    """

    angle: float
    stretch: Pair
    lever: Pair
    taut: int
    rate: float


@chain_njit()
def bend_on(row: Floats, angle: float, stretch: Pair) -> None:
    """Change a solution to first order by changes of the angle and of both stretches."""
    row[BENT] += row[5] * angle + row[6] * stretch[0] + row[7] * stretch[1]
    row[LONGER] += row[8] * angle + row[9] * stretch[0] + row[10] * stretch[1]


@chain_njit(error_model="python")
def with_section(i: int, bend: Bend, rig: Parameters, memory: Memory, row: Floats) -> tuple[Span, float, float]:
    """Tensions over joint i of parameters ``rig``, its moment, and the slope of the moment by the angle, slips held.

    The last solution in ``row``, carried on to first order, is where Newton's method starts: laws are linear between
    events, and without one it lands on the solution. The potential is convex. A step that leads beyond its least value
    is shortened. The moment is infinite where there is no solution.
    """
    root, least = rig.section.root, 0.1 * rig.tolerance
    to_moment = 1.0 / root if root > 0.0 else 0.0
    angle, stretch, lever = bend.angle - row[2], (bend.stretch[0] - row[3], bend.stretch[1] - row[4]), bend.lever
    bend_on(row, angle, stretch)
    bent, longer = row[BENT] if root > 0.0 else bend.angle, row[LONGER]
    to_force, rests = rig.bending / rig.arm[0], memory.fibres[i]
    heights, areas = memory.fibre_height[fibre_row(memory, i)], memory.fibre_area[fibre_row(memory, i)]
    start_bent, start_longer, turn, reach, downhill, part = bent, longer, 0.0, 0.0, 0.0, 1.0
    found = False
    for _ in range(_ITERATIONS):
        shift = longer - rig.section.rest
        span = segment(bend.stretch[0] + shift, bend.stretch[1] + shift, lever, rig, bend.taut)
        sums = sums_of(bent, longer, rig.section, heights, areas, rests, bend.rate)
        off_angle, off_thrust = bent + root * sums.moment - bend.angle, sums.pull + span.tension[0] + span.tension[1]
        own, cross, kpm = span.own, span.cross, sums.pull_by_bent
        by_a, by_b = own[0] + cross, own[1] + cross  # slopes of the thrust
        kpp, soft = sums.pull_by_longer + by_a + by_b, 1.0 + root * sums.moment_by_bent
        determinant = soft * kpp - root * kpm * kpm
        found = abs(off_angle) * to_force <= least and abs(off_thrust) <= least
        if found:
            break
        uphill = off_angle * to_moment * turn + off_thrust * reach
        if uphill > -_UPHILL * downhill:
            part *= min(max(downhill / (downhill - uphill), 0.1), 0.9)
        else:
            start_bent, start_longer, part = bent, longer, 1.0
            turn = -(kpp * off_angle - root * kpm * off_thrust) / determinant
            reach = -(soft * off_thrust - kpm * off_angle) / determinant
            downhill = off_angle * to_moment * turn + off_thrust * reach
        bent, longer = start_bent + part * turn, start_longer + part * reach
    row[BENT], row[LONGER], row[2], row[3], row[4] = bent, longer, bend.angle, bend.stretch[0], bend.stretch[1]
    row[5], row[6], row[7] = kpp / determinant, root * kpm * by_a / determinant, root * kpm * by_b / determinant
    row[8], row[9], row[10] = -kpm / determinant, -soft * by_a / determinant, -soft * by_b / determinant
    own_a, own_b, cross = own[0] + by_a * row[9], own[1] + by_b * row[10], cross + by_a * row[10]
    turn_a, turn_b = by_a * row[8], by_b * row[8]  # tensions by the angle, stretch held; moment by the stretch
    moved = Span(
        tension=span.tension,
        own=(own_a, own_b),
        cross=cross,
        by_angle=(turn_a - own_a * lever[0] - cross * lever[1], turn_b - cross * lever[0] - own_b * lever[1]),
    )
    slope = sums.moment_by_bent * row[5] + kpm * row[8] - turn_a * lever[0] - turn_b * lever[1]
    return moved, sums.moment if found else math.inf, slope
