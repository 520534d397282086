"""Superelastic section of a joint under the thrust of both tendons, compiled: its two unknowns are solved locally.

Bending phi and elongation g of the section follow from the angle of the joint and the stretch of both tendons over the
pitch (static condensation): see :mod:`fem_models.joint.superelastic_section` for the equations. The chain sees
tensions and moment with their consistent slopes, and its band stays as it is. The temperature of a section that heats
itself is a third local unknown.
"""

from __future__ import annotations

import math
from typing import NamedTuple

from fem_models.chain.compiled import chain_njit
from fem_models.chain.laws import LOWER, UPPER, Flag, Span, flag_along, flag_branch, flag_moment, segment
from fem_models.chain.parameters import Memory, Pair, Parameters, SectionParameters
from hysteresis.arrays import Floats

BENT, LONGER, WARM = 0, 1, 11
"""Places of phi, g and temperature in a row of sections; the angle and both stretches follow g, then slopes of phi and
of g in them."""
ROW = 12
_ITERATIONS = 200
_HEAT_ITERATIONS, _SAME_K = 50, 1e-12
_UPHILL = 0.5  # slope of the potential at the end of a step, over that at its start, at most


class Sums(NamedTuple):
    """Pull and moment of all fibres, and their slopes in elongation and bending."""

    pull: float
    moment: float
    pull_by_longer: float
    pull_by_bent: float
    moment_by_bent: float


class Bend(NamedTuple):
    """What a section has to follow.

    The angle of the joint from rest, roots included; the stretch of the tendons if the section kept its length under
    preload; their levers; which tendons are taut, as of :func:`fem_models.chain.laws.segment`; the exchange of heat, as
    of :func:`heat_exchange`.
    """

    angle: float
    stretch: Pair
    lever: Pair
    taut: int
    exchange: Pair


@chain_njit(forceinline=True)
def heat_exchange(rate: float, rig: Parameters) -> Pair:
    """See :func:`fem_models.joint.superelastic_section.heat_exchange`; ``rate`` is 1/s of the step, 0 of a slow one."""
    if rig.section.heat == 0.0 or rate == 0.0:
        return 0.0, 0.0
    h = 1.0 / (rate * rig.section.heating_time)
    return math.exp(-h), -math.expm1(-h) / h


@chain_njit(forceinline=True)
def stress_law(section: SectionParameters, strain: float, shift: float) -> Flag:
    """Flag of a fibre on the side of a strain, stress over strain; ``shift`` raises both plateaus."""
    upper, lower = section.upper, section.lower
    if strain < 0.0:
        upper, lower = section.upper_pressed, section.lower_pressed
    return Flag(section.young, upper + shift, lower + shift, section.span, section.climb)


@chain_njit(forceinline=True)
def shift_of(warming: float, section: SectionParameters) -> float:
    """Rise of the plateaus with the temperature, MPa; none falls below 0 (runs that get there are refused)."""
    return max(section.rise * warming, -min(section.lower, section.lower_pressed))


@chain_njit(error_model="python")
def fibre_sums(
    bent: float, longer: float, section: SectionParameters, heights: Floats, areas: Floats, rests: Floats
) -> Sums:
    """Integrate the stress over a section.

    A fibre that has never transformed is elastic up to the plateau: most are.
    """
    young, by_length = section.young, 1.0 / section.length
    mean, curvature = longer * by_length, bent * by_length
    start, pressed = section.upper / young, -section.upper_pressed / young
    pull, moment, kpp, kpm, kmm = 0.0, 0.0, 0.0, 0.0, 0.0
    for j in range(rests.size):
        height, area, rest = heights[j], areas[j], rests[j]
        strain = mean + height * curvature
        if rest == 0.0 and pressed <= strain <= start:
            stress, slope = young * strain, young
        else:
            stress, slope = flag_moment(strain, rest, stress_law(section, strain, 0.0))
        force, stiffness = area * stress, area * slope
        pull += force
        moment += force * height
        kpp += stiffness
        kpm += stiffness * height
        kmm += stiffness * height * height
    elastic = section.elastic
    return Sums(pull + elastic * longer, moment, kpp * by_length + elastic, kpm * by_length, kmm * by_length)


@chain_njit(error_model="python")
def heated_sums(
    i: int, bent: float, longer: float, section: SectionParameters, memory: Memory, exchange: Pair, warming: float
) -> tuple[Sums, float]:
    """Integrate the stress over section i, which heats itself, and find its temperature from a first guess.

    The heat that is set free falls as the plateaus rise with the temperature: one equation, piecewise linear, whose
    slope hardly varies. The slopes of the sums include how the temperature follows the strains, a matrix of rank one.
    """
    young, by_length, rests = section.young, 1.0 / section.length, memory.fibres[i]
    mean, curvature, share = longer * by_length, bent * by_length, 1.0 - section.climb / section.young
    gain, start, before = exchange[1] * section.heat, exchange[0] * memory.warming[i], 0.0
    for j in range(rests.size):
        before += memory.fibre_area[j] * abs(rests[j])
    pull = moment = kpp = kpm = kmm = by_mean = by_bend = follow = 0.0
    for _ in range(_HEAT_ITERATIONS):
        pull = moment = kpp = kpm = kmm = by_mean = by_bend = 0.0
        shift, after, softer = shift_of(warming, section), 0.0, 0.0
        for j in range(rests.size):
            height, area, rest = memory.fibre_height[j], memory.fibre_area[j], rests[j]
            strain = mean + height * curvature
            law = stress_law(section, strain, shift)
            branch = flag_branch(strain, rest, law)
            stress, slope = flag_along(branch, strain, rest, law)
            force, stiffness = area * stress, area * slope
            pull += force
            moment += force * height
            kpp += stiffness
            kpm += stiffness * height
            kmm += stiffness * height * height
            after += area * abs(strain - stress / young)
            if branch == UPPER or branch == LOWER:
                transforming = math.copysign(area * share, strain)
                by_mean += transforming
                by_bend += transforming * height
                softer += area * share
        rise = section.rise if shift == section.rise * warming else 0.0
        off, follow = warming - start - gain * (after - before), gain / (1.0 + gain * softer * rise / young)
        if abs(off) <= _SAME_K * (1.0 + abs(warming)):
            break
        warming -= off / (1.0 + gain * softer * rise / young)
    stiffer, elastic = rise * follow, section.elastic
    kpp += stiffer * by_mean * by_mean
    kpm += stiffer * by_mean * by_bend
    kmm += stiffer * by_bend * by_bend
    sums = Sums(pull + elastic * longer, moment, kpp * by_length + elastic, kpm * by_length, kmm * by_length)
    return sums, warming


@chain_njit()
def bend_on(row: Floats, angle: float, stretch: Pair) -> None:
    """Change a solution to first order by changes of the angle and of both stretches."""
    row[BENT] += row[5] * angle + row[6] * stretch[0] + row[7] * stretch[1]
    row[LONGER] += row[8] * angle + row[9] * stretch[0] + row[10] * stretch[1]


@chain_njit(error_model="python")
def with_section(i: int, bend: Bend, rig: Parameters, memory: Memory, row: Floats) -> tuple[Span, float, float]:
    """Tensions over joint i, its moment, and the slope of the moment by the angle, slips held.

    The last solution in ``row``, carried on to first order, is where Newton's method starts: laws are linear between
    events, and without one it lands on the solution. The potential is convex. A step that leads beyond its least value
    is shortened. The moment is infinite where there is no solution.
    """
    root, least = rig.section.root, 0.1 * rig.tolerance
    to_moment = 1.0 / root if root > 0.0 else 0.0
    angle, stretch, lever = bend.angle - row[2], (bend.stretch[0] - row[3], bend.stretch[1] - row[4]), bend.lever
    bend_on(row, angle, stretch)
    bent, longer = row[BENT] if root > 0.0 else bend.angle, row[LONGER]
    to_force, heights, areas, rests = rig.bending / rig.arm[0], memory.fibre_height, memory.fibre_area, memory.fibres[i]
    start_bent, start_longer, turn, reach, downhill, part = bent, longer, 0.0, 0.0, 0.0, 1.0
    found = False
    for _ in range(_ITERATIONS):
        shift = longer - rig.section.rest
        span = segment(bend.stretch[0] + shift, bend.stretch[1] + shift, lever, rig, bend.taut)
        if rig.section.heat > 0.0:
            sums, row[WARM] = heated_sums(i, bent, longer, rig.section, memory, bend.exchange, row[WARM])
        else:
            sums = fibre_sums(bent, longer, rig.section, heights, areas, rests)
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


@chain_njit()
def transform(i: int, bent: float, longer: float, rig: Parameters, memory: Memory, exchange: Pair) -> float:
    """Move the rest strains of joint i's fibres, and its temperature, to where they are at a solution; return the loss.

    In mJ; see :func:`fem_models.joint.superelastic_section.transformation_loss_mJ`.
    """
    section, rests, loss, shift, risen = rig.section, memory.fibres[i], 0.0, 0.0, 0.0
    climb = section.climb / (1.0 - section.climb / section.young)
    if section.heat > 0.0:
        last = memory.warming[i]
        _, memory.warming[i] = heated_sums(i, bent, longer, section, memory, exchange, last)
        shift = shift_of(memory.warming[i], section)
        risen = shift - shift_of(last, section)
    start, pressed = (section.upper + shift) / section.young, -(section.upper_pressed + shift) / section.young
    for j in range(rests.size):
        strain = (longer + memory.fibre_height[j] * bent) / section.length
        if rests[j] != 0.0 or not pressed <= strain <= start:
            stress, _ = flag_moment(strain, rests[j], stress_law(section, strain, shift))
            rest = strain - stress / section.young
            moved = rest - rests[j]
            mean = stress - 0.5 * (climb * moved + (risen if strain >= 0.0 else -risen))
            loss += memory.fibre_area[j] * mean * moved
            rests[j] = rest
    return loss * section.length
