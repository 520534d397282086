"""Fibres of a superelastic section, compiled: pull and moment at a bending and an elongation, and what transforms.

There are two kinds of section, each compiled for itself, because most rigs have the first one:
:class:`fem_models.chain.parameters.SectionParameters` is the same in tension and compression,
:class:`fem_models.chain.parameters.NitinolParameters` is not, and may heat itself. Its temperature follows from the
strains (:mod:`fem_models.joint.superelastic_section`): a third unknown of the section, solved for here.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Any, NamedTuple

from numba.extending import overload

from fem_models.chain.compiled import chain_njit
from fem_models.chain.each import fibre_row
from fem_models.chain.laws import ELASTIC, LOWER, UPPER, Flag, flag_along, flag_branch, flag_moment
from fem_models.chain.parameters import Memory, NitinolParameters, Parameters, SectionParameters
from hysteresis.arrays import Floats

AnySection = SectionParameters | NitinolParameters

_HEAT_ITERATIONS, _SAME_K = 50, 1e-12


class Sums(NamedTuple):
    """Pull and moment of all fibres, and their slopes in elongation and bending."""

    pull: float
    moment: float
    pull_by_longer: float
    pull_by_bent: float
    moment_by_bent: float


@chain_njit(forceinline=True)
def stress_law(section: SectionParameters) -> Flag:
    """Flag of a fibre, stress over strain."""
    return Flag(section.young, section.upper, section.lower, section.span, section.climb)


@chain_njit(error_model="python")
def fibre_sums(
    bent: float, longer: float, section: SectionParameters, heights: Floats, areas: Floats, rests: Floats
) -> Sums:
    """Integrate the stress over a section.

    A fibre that has never transformed is elastic up to the plateau: most are.
    """
    law, by_length = stress_law(section), 1.0 / section.length
    mean, curvature, start = longer * by_length, bent * by_length, law.upper / law.stiffness
    pull, moment, kpp, kpm, kmm = 0.0, 0.0, 0.0, 0.0, 0.0
    for j in range(rests.size):
        height, area, rest = heights[j], areas[j], rests[j]
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
    elastic = section.elastic
    return Sums(pull + elastic * longer, moment, kpp * by_length + elastic, kpm * by_length, kmm * by_length)


@chain_njit()
def _transform_alike(i: int, bent: float, longer: float, section: SectionParameters, memory: Memory) -> float:
    """:func:`transform` of a section that is the same in tension and compression."""
    law, rests, loss = stress_law(section), memory.fibres[i], 0.0
    heights, areas = memory.fibre_height[fibre_row(memory, i)], memory.fibre_area[fibre_row(memory, i)]
    climb = law.climb / (1.0 - law.climb / law.stiffness)
    for j in range(rests.size):
        strain = (longer + heights[j] * bent) / section.length
        if rests[j] != 0.0 or abs(strain) * law.stiffness > law.upper:
            stress, _ = flag_moment(strain, rests[j], law)
            rest = strain - stress / law.stiffness
            moved = rest - rests[j]
            loss += areas[j] * (stress - 0.5 * climb * moved) * moved
            rests[j] = rest
    return loss * section.length


@chain_njit(forceinline=True)
def side_law(section: NitinolParameters, strain: float, shift: float) -> Flag:
    """Flag of a fibre on the side of a strain, stress over strain; ``shift`` raises both plateaus."""
    if strain < 0.0:
        upper, lower = section.upper_pressed, section.lower_pressed
    else:
        upper, lower = section.upper, section.lower
    return Flag(section.young, upper + shift, lower + shift, section.span, section.climb)


@chain_njit(forceinline=True)
def shift_of(warming: float, section: NitinolParameters) -> float:
    """Rise of the plateaus with the temperature, MPa; none falls below 0 (runs that get there are refused)."""
    return max(section.rise * warming, -min(section.lower, section.lower_pressed))


@chain_njit(forceinline=True)
def heat_exchange(rate: float, section: NitinolParameters) -> tuple[float, float]:
    """See :func:`fem_models.joint.superelastic_section.heat_exchange`; ``rate`` is 1/s of the step, 0 of a slow one."""
    if section.heat == 0.0 or rate == 0.0:
        return 0.0, 0.0
    h = 1.0 / (rate * section.heating_time)
    return math.exp(-h), -math.expm1(-h) / h


@chain_njit(error_model="python")
def heated_sums(
    bent: float, longer: float, section: NitinolParameters, heights: Floats, areas: Floats, rests: Floats, rate: float
) -> tuple[Sums, float]:
    """Integrate the stress over a section, and find its temperature; the last one is the last of ``rests``.

    The heat that is set free falls as the plateaus rise with the temperature: one equation, piecewise linear, whose
    slope hardly varies. The slopes of the sums include how the temperature follows the strains, a matrix of rank one.
    """
    young, by_length = section.young, 1.0 / section.length
    mean, curvature, share = longer * by_length, bent * by_length, 1.0 - section.climb / section.young
    left, gained = heat_exchange(rate, section)
    gain, start, before = gained * section.heat, left * rests[-1], 0.0
    for j in range(areas.size):
        before += areas[j] * abs(rests[j])
    pull = moment = kpp = kpm = kmm = by_mean = by_bend = follow = rise = 0.0
    pressed = -section.upper_pressed
    warming = rests[-1] if gain > 0.0 else start
    for _ in range(_HEAT_ITERATIONS):
        pull = moment = kpp = kpm = kmm = by_mean = by_bend = 0.0
        shift, after, softer = shift_of(warming, section), 0.0, 0.0
        for j in range(areas.size):
            height, area = heights[j], areas[j]
            strain = mean + height * curvature
            if rests[j] == 0.0 and pressed - shift <= young * strain <= section.upper + shift:
                branch, stress, slope = ELASTIC, young * strain, young
            else:
                law = side_law(section, strain, shift)
                branch = flag_branch(strain, rests[j], law)
                stress, slope = flag_along(branch, strain, rests[j], law)
                after += area * abs(strain - stress / young)
            force, stiffness = area * stress, area * slope
            pull += force
            moment += force * height
            kpp += stiffness
            kpm += stiffness * height
            kmm += stiffness * height * height
            if branch in (LOWER, UPPER):
                transforming = math.copysign(area * share, strain)
                by_mean += transforming
                by_bend += transforming * height
                softer += area * share
        rise = section.rise if shift == section.rise * warming else 0.0
        off, slope = warming - start - gain * (after - before), 1.0 + gain * softer * rise / young
        follow = gain / slope
        if abs(off) <= _SAME_K * (1.0 + abs(warming)):
            break
        warming -= off / slope
    stiffer, elastic = rise * follow, section.elastic
    kpp += stiffer * by_mean * by_mean
    kpm += stiffer * by_mean * by_bend
    kmm += stiffer * by_bend * by_bend
    sums = Sums(pull + elastic * longer, moment, kpp * by_length + elastic, kpm * by_length, kmm * by_length)
    return sums, warming


@chain_njit()
def _transform_heated(
    i: int, bent: float, longer: float, section: NitinolParameters, memory: Memory, rate: float
) -> float:
    """:func:`transform` of a section that heats itself."""
    heights, areas = memory.fibre_height[fibre_row(memory, i)], memory.fibre_area[fibre_row(memory, i)]
    rests, loss = memory.fibres[i], 0.0
    last, (_, warming) = rests[-1], heated_sums(bent, longer, section, heights, areas, rests, rate)
    shift, climb = shift_of(warming, section), section.climb / (1.0 - section.climb / section.young)
    risen = shift - shift_of(last, section)
    for j in range(areas.size):
        strain = (longer + heights[j] * bent) / section.length
        stress, _ = flag_moment(strain, rests[j], side_law(section, strain, shift))
        rest = strain - stress / section.young
        moved = rest - rests[j]
        mean = stress - 0.5 * (climb * moved + (risen if strain >= 0.0 else -risen))
        loss += areas[j] * mean * moved
        rests[j] = rest
    rests[-1] = warming
    return loss * section.length


def sums_of(
    bent: float, longer: float, section: AnySection, heights: Floats, areas: Floats, rests: Floats, rate: float
) -> Sums:
    """Integrate the stress over a section of either kind."""
    if isinstance(section, NitinolParameters):
        return heated_sums(bent, longer, section, heights, areas, rests, rate)[0]
    return fibre_sums(bent, longer, section, heights, areas, rests)


def _transform(i: int, bent: float, longer: float, section: AnySection, memory: Memory, rate: float) -> float:
    """:func:`transform` of a section of either kind."""
    if isinstance(section, NitinolParameters):
        return _transform_heated(i, bent, longer, section, memory, rate)
    return _transform_alike(i, bent, longer, section, memory)


# In a kernel the kind of the section is known when it is compiled: the other branch is not. numba's strict overloads
# compare annotations, too.
@overload(sums_of, inline="always", strict=False)
def _choose_sums(
    bent: Any, longer: Any, section: Any, heights: Any, areas: Any, rests: Any, rate: Any
) -> Callable[..., Any]:
    if section.instance_class is NitinolParameters:
        return lambda bent, longer, section, heights, areas, rests, rate: heated_sums(
            bent, longer, section, heights, areas, rests, rate
        )[0]
    return lambda bent, longer, section, heights, areas, rests, rate: fibre_sums(
        bent, longer, section, heights, areas, rests
    )


@overload(_transform, inline="always", strict=False)
def _choose_moved(i: Any, bent: Any, longer: Any, section: Any, memory: Any, rate: Any) -> Callable[..., Any]:
    if section.instance_class is NitinolParameters:
        return lambda i, bent, longer, section, memory, rate: _transform_heated(i, bent, longer, section, memory, rate)
    return lambda i, bent, longer, section, memory, rate: _transform_alike(i, bent, longer, section, memory)


@chain_njit()
def transform(i: int, bent: float, longer: float, rig: Parameters, memory: Memory, rate: float) -> float:
    """Move the rest strains of joint i's fibres, and its temperature, to where they are at a solution; return the loss.

    In mJ; see :func:`fem_models.joint.superelastic_section.transformation_loss_mJ`. ``rig`` are the parameters of the
    joint, ``rate`` is 1/s of the step.
    """
    return _transform(i, bent, longer, rig.section, memory, rate)
