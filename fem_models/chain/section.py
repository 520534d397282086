"""Superelastic section of a joint under the thrust of both tendons, compiled: its two unknowns are solved locally.

Bending phi and elongation g of the section follow from the angle of the joint and the stretch of both tendons over the
pitch (static condensation): see :mod:`fem_models.joint.superelastic_section` for the equations. The chain sees
tensions and moment with their consistent slopes, and its band stays as it is.
"""

from __future__ import annotations

import math
from typing import NamedTuple

from fem_models.chain.compiled import chain_njit
from fem_models.chain.laws import Flag, Span, flag_moment, segment
from fem_models.chain.parameters import Memory, Pair, Parameters
from hysteresis.arrays import Floats

BENT, LONGER = 0, 1
"""Places of phi and g in a row of sections; the angle and both stretches follow, then slopes of phi and of g in
them."""
ROW = 11
_ITERATIONS = 60
_FULL_STEPS = 10  # later steps are halved, lest Newton's method alternates between branches


class Sums(NamedTuple):
    """Pull and moment of all fibres, and their slopes in elongation and bending."""

    pull: float
    moment: float
    pull_by_longer: float
    pull_by_bent: float
    moment_by_bent: float


@chain_njit(forceinline=True)
def stress_law(rig: Parameters) -> Flag:
    """Flag of a fibre, stress over strain."""
    law = rig.section
    return Flag(stiffness=law.young, upper=law.upper, lower=law.lower, span=law.span, climb=law.climb)


@chain_njit(error_model="python")
def fibre_sums(i: int, bent: float, longer: float, rig: Parameters, memory: Memory) -> Sums:
    """Integrate the stress over the section of joint i.

    A fibre that has never transformed is elastic up to the plateau: most are.
    """
    law, rests, elastic = stress_law(rig), memory.fibres[i], rig.section.elastic
    mean, curvature, start = longer / rig.section.length, bent / rig.section.length, law.upper / law.stiffness
    pull, moment, kpp, kpm, kmm = 0.0, 0.0, 0.0, 0.0, 0.0
    for j in range(rests.size):
        height, area, rest = memory.fibre_height[j], memory.fibre_area[j], rests[j]
        strain = mean + height * curvature
        if rest == 0.0 and abs(strain) <= start:
            stress, slope = law.stiffness * strain, law.stiffness
        else:
            stress, slope = flag_moment(strain, rest, law)
        force, stiffness = area * stress, area * slope
        pull += force
        moment += force * height
        kpp += stiffness
        kpm += stiffness * height
        kmm += stiffness * height * height
    by_length = 1.0 / rig.section.length
    return Sums(pull + elastic * longer, moment, kpp * by_length + elastic, kpm * by_length, kmm * by_length)


@chain_njit()
def with_section(
    i: int, angle: float, stretch: Pair, lever: Pair, rig: Parameters, memory: Memory, places: Floats, taut: int
) -> tuple[Span, float, float]:
    """Tensions over joint i, its moment, and the slope of the moment by the angle, slips held.

    ``angle`` is from rest, roots included; ``stretch`` that of the tendons if the section kept its length under
    preload; ``places`` has a row for each joint, where the last solution starts the next one. Laws are linear
    between events: it lands on the solution if there is none. ``taut`` as of :func:`fem_models.chain.laws.segment`.
    The moment is NaN where there is no solution.
    """
    row, root = places[i], rig.section.root
    d, a, b = angle - row[2], stretch[0] - row[3], stretch[1] - row[4]
    bent = row[BENT] + row[5] * d + row[6] * a + row[7] * b
    longer = row[LONGER] + row[8] * d + row[9] * a + row[10] * b
    to_force = rig.bending / rig.arm[0]
    least, found = 0.1 * rig.tolerance, False
    for iteration in range(_ITERATIONS):
        shift = longer - rig.section.rest
        span = segment(stretch[0] + shift, stretch[1] + shift, lever, rig, taut)
        sums = fibre_sums(i, bent, longer, rig, memory)
        by_a, by_b = span.own[0] + span.cross, span.own[1] + span.cross  # slopes of the thrust
        kpp, soft = sums.pull_by_longer + by_a + by_b, 1.0 + root * sums.moment_by_bent
        determinant = soft * kpp - root * sums.pull_by_bent * sums.pull_by_bent
        off_angle = bent + root * sums.moment - angle
        off_thrust = sums.pull + span.tension[0] + span.tension[1]
        found = abs(off_angle) * to_force <= least and abs(off_thrust) <= least
        if found:
            break
        part = 1.0 if iteration < _FULL_STEPS else 0.5
        bent -= part * (kpp * off_angle - root * sums.pull_by_bent * off_thrust) / determinant
        longer -= part * (soft * off_thrust - sums.pull_by_bent * off_angle) / determinant
    row[BENT], row[LONGER], row[2], row[3], row[4] = bent, longer, angle, stretch[0], stretch[1]
    kpm = sums.pull_by_bent
    row[5], row[6], row[7] = kpp / determinant, root * kpm * by_a / determinant, root * kpm * by_b / determinant
    row[8], row[9], row[10] = -kpm / determinant, -soft * by_a / determinant, -soft * by_b / determinant
    own_a, own_b, cross = span.own[0] + by_a * row[9], span.own[1] + by_b * row[10], span.cross + by_a * row[10]
    turn_a, turn_b = by_a * row[8], by_b * row[8]  # tensions by the angle, stretch held; moment by the stretch
    moved = Span(
        tension=span.tension,
        own=(own_a, own_b),
        cross=cross,
        by_angle=(turn_a - own_a * lever[0] - cross * lever[1], turn_b - cross * lever[0] - own_b * lever[1]),
    )
    slope = sums.moment_by_bent * row[5] + kpm * row[8] - turn_a * lever[0] - turn_b * lever[1]
    return moved, sums.moment if found else math.nan, slope


@chain_njit()
def bend_on(row: Floats, angle: float, stretch: Pair) -> None:
    """Change a solution to first order by changes of the angle and of both stretches."""
    row[BENT] += row[5] * angle + row[6] * stretch[0] + row[7] * stretch[1]
    row[LONGER] += row[8] * angle + row[9] * stretch[0] + row[10] * stretch[1]


@chain_njit()
def transform(i: int, bent: float, longer: float, rig: Parameters, memory: Memory) -> float:
    """Move the rest strains of joint i's fibres to where they are at a solution; return the loss, mJ."""
    law, rests, loss = stress_law(rig), memory.fibres[i], 0.0
    for j in range(rests.size):
        strain = (longer + memory.fibre_height[j] * bent) / rig.section.length
        if rests[j] != 0.0 or abs(strain) * law.stiffness > law.upper:
            stress, _ = flag_moment(strain, rests[j], law)
            rest = strain - stress / law.stiffness
            loss += memory.fibre_area[j] * stress * (rest - rests[j])
            rests[j] = rest
    return loss * rig.section.length
