"""Joints that differ along the tube, compiled: what the kernels take of one joint, and from where.

A kernel that is at joint i takes its parameters from :func:`joint_at`. Where all joints are equal these are the rig's,
and nothing is read or copied: the kind of rig is known when a kernel is compiled. Where they differ, they are the
rig's with the joint's own numbers in their places, read from a row of ``Parameters.each``.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Any

import numpy as np
from numba import types
from numba.extending import overload

from fem_models.chain.compiled import chain_njit
from fem_models.chain.parameters import (
    Memory,
    NitinolParameters,
    Pair,
    Parameters,
    SectionParameters,
    contact_spring,
    section_parameters,
)
from fem_models.joint import JointMechanics, JointRow
from fem_models.rig import Rig
from hysteresis.arrays import Floats

ARM, SEGMENT, REST = 0, 2, 4  # pairs, of tendons a and b
BENDING, ELASTIC, HALF_GAP, AXIAL, CONTACT_ANGLE, CONTACT_STIFFNESS, LOOP = range(6, 13)
BEYOND, TO_RING, ASIDE, SECTION = range(13, 17)
COLUMNS = SECTION + len(NitinolParameters._fields)
"""Places in a row of ``Parameters.each``: arms; EA over the length of tendon across the notch; lengths of the paths at
rest; what :class:`Parameters` has by these names; the slip moments and stiffnesses of the Jenkins elements over those
of the first joint; lengths to the next joint and to the middle of the ring, and the way across to the neutral axis of
the next joint; and the section."""


def with_each(parameters: Parameters, rig: Rig, joints: JointRow) -> Parameters:
    """Add what is a joint's own to the parameters of a rig; unchanged where all joints are equal."""
    return parameters if joints.alike else parameters._replace(each=each_joint(rig, joints))


def each_joint(rig: Rig, joints: JointRow) -> Floats:
    """Rows of ``Parameters.each``, shape (N, COLUMNS)."""
    rows, lengths = np.zeros((rig.joints, COLUMNS)), joints.lengths
    for row, joint, segment in zip(rows, joints.each, lengths.segments, strict=True):
        row[ARM], row[ARM + 1] = joint.arms_mm.a, -joint.arms_mm.b
        for side, tendon in enumerate(rig.tendons):
            row[SEGMENT + side] = tendon.EA_N / segment
        row[REST], row[REST + 1] = _rest_path(joint)
        row[BENDING] = joint.flexure.bending_Nmm_per_rad
        row[ELASTIC] = joint.spring_Nmm_per_rad
        row[HALF_GAP], row[AXIAL] = 0.5 * joint.rigid_gap_mm, joint.axial_compliance
        row[CONTACT_ANGLE], row[CONTACT_STIFFNESS] = joint.contact_angle_rad, contact_spring(rig, joint)
        row[LOOP] = joint.flexure.bending_Nmm_per_rad / joints.first.flexure.bending_Nmm_per_rad
        section = section_parameters(rig, joint)
        row[SECTION : SECTION + len(section)] = section
    rows[:, BEYOND], rows[:, TO_RING], rows[:, ASIDE] = lengths.beyond, lengths.to_ring, lengths.aside
    return rows


def _rest_path(joint: JointMechanics) -> Pair:
    """Lengths of both tendons over a notch at rest: :func:`fem_models.chain.laws.crossing_at`."""
    half, gap, (a, b) = 0.5 * joint.rest_angle_rad, 0.5 * joint.rigid_gap_mm, joint.arms_mm
    even, sine = gap * (1.0 - math.cos(half)), math.sin(half)
    return 2.0 * (even + a * sine), 2.0 * (even - b * sine)


def _differ(rig: Any) -> bool:
    """Whether joints differ, by numba's type of the parameters."""
    return isinstance(rig.types[rig.fields.index("each")], types.Array)


def _section_of(rig: Any, i: int) -> Any:
    """Parameters of the section of joint i."""
    return type(rig.section)(*rig.each[i, SECTION : SECTION + len(rig.section)])


@overload(_section_of, inline="always", strict=False)
def _choose_section(rig: Any, i: Any) -> Callable[..., Any]:
    if rig.types[rig.fields.index("section")].instance_class is NitinolParameters:
        return lambda rig, i: NitinolParameters(
            rig.each[i, SECTION],
            rig.each[i, SECTION + 1],
            rig.each[i, SECTION + 2],
            rig.each[i, SECTION + 3],
            rig.each[i, SECTION + 4],
            rig.each[i, SECTION + 5],
            rig.each[i, SECTION + 6],
            rig.each[i, SECTION + 7],
            rig.each[i, SECTION + 8],
            rig.each[i, SECTION + 9],
            rig.each[i, SECTION + 10],
            rig.each[i, SECTION + 11],
            rig.each[i, SECTION + 12],
            rig.each[i, SECTION + 13],
        )
    return lambda rig, i: SectionParameters(
        rig.each[i, SECTION],
        rig.each[i, SECTION + 1],
        rig.each[i, SECTION + 2],
        rig.each[i, SECTION + 3],
        rig.each[i, SECTION + 4],
        rig.each[i, SECTION + 5],
        rig.each[i, SECTION + 6],
        rig.each[i, SECTION + 7],
        rig.each[i, SECTION + 8],
    )


@chain_njit(forceinline=True)
def _own(rig: Parameters, i: int) -> Parameters:
    """Parameters of a rig whose joints are all as joint i."""
    each: Any = rig.each
    return Parameters(
        preload=rig.preload,
        arm=(each[i, ARM], each[i, ARM + 1]),
        segment=(each[i, SEGMENT], each[i, SEGMENT + 1]),
        free=rig.free,
        toe=rig.toe,
        bristle=rig.bristle,
        creep=rig.creep,
        load_control=rig.load_control,
        rest=rig.rest,
        scale=rig.scale,
        bending=each[i, BENDING],
        elastic=each[i, ELASTIC],
        hardening=rig.hardening,
        hardened=rig.hardened,
        half_gap=each[i, HALF_GAP],
        axial=each[i, AXIAL],
        capstan=rig.capstan,
        guide=rig.guide,
        sheath=rig.sheath,
        rest_wrap=rig.rest_wrap,
        contact_angle=each[i, CONTACT_ANGLE],
        contact_stiffness=each[i, CONTACT_STIFFNESS],
        contact_both=rig.contact_both,
        weight_x=rig.weight_x,
        weight_y=rig.weight_y,
        tip_x=rig.tip_x,
        tip_y=rig.tip_y,
        stop_y=rig.stop_y,
        stop_stiffness=rig.stop_stiffness,
        pitch=rig.pitch,
        drag_sheath=rig.drag_sheath,
        drag_joint=rig.drag_joint,
        tolerance=rig.tolerance,
        viscosity=rig.viscosity,
        section=_section_of(rig, i),
        each=(),
    )


def joint_at(rig: Parameters, i: int) -> Parameters:
    """Parameters of joint i."""
    return _own(rig, i) if len(rig.each) else rig


@overload(joint_at, inline="always", strict=False)
def _choose_joint(rig: Any, i: Any) -> Callable[..., Any]:
    return (lambda rig, i: _own(rig, i)) if _differ(rig) else (lambda rig, i: rig)


def rest_path(rig: Parameters, i: int, rest: Pair) -> Pair:
    """Paths over notch i at rest; ``rest`` are those of equal joints."""
    each: Any = rig.each
    return (each[i, REST], each[i, REST + 1]) if len(each) else rest


@overload(rest_path, inline="always", strict=False)
def _choose_rest(rig: Any, i: Any, rest: Any) -> Callable[..., Any]:
    if _differ(rig):
        return lambda rig, i, rest: (rig.each[i, REST], rig.each[i, REST + 1])
    return lambda rig, i, rest: rest


def loop_part(rig: Parameters, i: int) -> float:
    """Stiffness of the Jenkins elements of joint i over those of the first joint."""
    each: Any = rig.each
    return each[i, LOOP] if len(each) else 1.0


@overload(loop_part, inline="always", strict=False)
def _choose_loop(rig: Any, i: Any) -> Callable[..., Any]:
    return (lambda rig, i: rig.each[i, LOOP]) if _differ(rig) else (lambda rig, i: 1.0)


@chain_njit(forceinline=True)
def _even_beyond(rig: Parameters, i: int, n: int) -> float:
    return rig.pitch if i < n - 1 else 0.5 * rig.pitch


def beyond(rig: Parameters, i: int, n: int) -> float:
    """Length from joint i to the next one of n, and from the last to the tip."""
    each: Any = rig.each
    return each[i, BEYOND] if len(each) else _even_beyond(rig, i, n)


@overload(beyond, inline="always", strict=False)
def _choose_beyond(rig: Any, i: Any, n: Any) -> Callable[..., Any]:
    if _differ(rig):
        return lambda rig, i, n: rig.each[i, BEYOND]
    return lambda rig, i, n: _even_beyond(rig, i, n)


def ring_lever(rig: Parameters, i: int, n: int) -> float:
    """Lever of the heading of ring i for the weights of one ring each, its own and all beyond."""
    each: Any = rig.each
    return each[i, TO_RING] + (n - 1 - i) * each[i, BEYOND] if len(each) else (n - 0.5 - i) * rig.pitch


@overload(ring_lever, inline="always", strict=False)
def _choose_lever(rig: Any, i: Any, n: Any) -> Callable[..., Any]:
    if _differ(rig):
        return lambda rig, i, n: rig.each[i, TO_RING] + (n - 1 - i) * rig.each[i, BEYOND]
    return lambda rig, i, n: (n - 0.5 - i) * rig.pitch


def aside(rig: Parameters, i: int) -> float:
    """Way across ring i from the neutral axis of joint i to that of the next one."""
    each: Any = rig.each
    return each[i, ASIDE] if len(each) else 0.0


@overload(aside, inline="always", strict=False)
def _choose_aside(rig: Any, i: Any) -> Callable[..., Any]:
    return (lambda rig, i: rig.each[i, ASIDE]) if _differ(rig) else (lambda rig, i: 0.0)


@chain_njit(forceinline=True)
def fibre_row(memory: Memory, i: int) -> int:
    """Row of the fibres of joint i in ``Memory.fibre_height`` and ``fibre_area``."""
    return min(i, memory.fibre_height.shape[0] - 1)
