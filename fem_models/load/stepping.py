"""Step control of both engines: how a path from sample to sample is cut into steps, and which steps are accepted.

The multibody model calls these functions as Python, the chain compiles them (``register_jitable``).
"""

from __future__ import annotations

import math
from typing import NamedTuple

from numba.extending import register_jitable

from fem_models.rig import Rig
from hysteresis.arrays import Floats

FINE = 0.2501  # of the longest step: a quarter, but for rounding
LEAST_LENGTH = 1e-12  # of a step, where something is divided by it


class Load(NamedTuple):
    """What acts at one point of the path: one sample of a :class:`fem_models.load.schedule.Schedule`."""

    drive: float  # mm, or N of a rig under load control
    slack: tuple[float, float]  # mm, of tendons a and b
    loop_scale: float  # of the slip moments of the Jenkins elements
    friction_scale: float  # of all guides
    rest_angle: float  # rad, of every joint without load
    time: float  # s
    dead: float  # of the weight of the rings and the load on the tip


class StepControl(NamedTuple):
    """Bounds of the steps. The length of a step is in mm of tendon, or in N under load control.

    A joint that rotates, or a tendon that slides at a guide, by more than so much per length of the step plus a least
    amount has jumped to another equilibrium.
    """

    max_step: float
    max_halvings: int
    rotation_per_length: float  # rad
    least_rotation: float
    slide_per_length: float  # mm
    least_slide: float


class Step(NamedTuple):
    """The next step on a path: where it ends, as a part of the path and as a load, and its length.

    ``fine`` steps are no longer than a quarter of the longest one.
    """

    part: float
    load: Load
    length: float
    fine: bool


def drive_control(rig: Rig, max_step_mm: float, max_halvings: int) -> StepControl:
    """Bound the steps of a rig whose wheel is driven.

    All of the tendon that a step winds in, five times over, may go into one joint, or past one guide. The least amounts
    are for what moves without the drive.
    """
    arm = min(tendon.moment_arm_mm for tendon in rig.tendons)
    return StepControl(
        max_step=max_step_mm,
        max_halvings=max_halvings,
        rotation_per_length=5 / arm,
        least_rotation=2e-3,
        slide_per_length=5.0,
        least_slide=0.02,
    )


def force_control(
    rig: Rig, arm_mm: float, bending_Nmm_per_rad: float, max_step_N: float, max_halvings: int
) -> StepControl:
    """Bound the steps of a rig under load control, by joints and a tendon a hundred times softer than elastic.

    What slides at a guide is drawn in by all joints together and by the stretch of the tendon.
    """
    rotation = 100 * arm_mm / bending_Nmm_per_rad
    return StepControl(
        max_step=max_step_N,
        max_halvings=max_halvings,
        rotation_per_length=rotation,
        least_rotation=0.05,
        slide_per_length=rig.joints * rotation * arm_mm + 100 * rig.length_mm / rig.tendon_a.EA_N,
        least_slide=0.1,
    )


@register_jitable
def at_rest(rest_angle: float) -> Load:
    """Load of the rig before its program starts, without weight or tip load: they come on the way to sample 0."""
    return Load(
        drive=0.0,
        slack=(0.0, 0.0),
        loop_scale=1.0,
        friction_scale=1.0,
        rest_angle=rest_angle,
        time=0.0,
        dead=0.0,
    )


@register_jitable
def between(start: Load, end: Load, part: float) -> Load:
    """Load at a part of the path from one to another; all quantities move in proportion."""
    return Load(
        drive=start.drive + part * (end.drive - start.drive),
        slack=(
            start.slack[0] + part * (end.slack[0] - start.slack[0]),
            start.slack[1] + part * (end.slack[1] - start.slack[1]),
        ),
        loop_scale=start.loop_scale + part * (end.loop_scale - start.loop_scale),
        friction_scale=start.friction_scale + part * (end.friction_scale - start.friction_scale),
        rest_angle=start.rest_angle + part * (end.rest_angle - start.rest_angle),
        time=start.time + part * (end.time - start.time),
        dead=start.dead + part * (end.dead - start.dead),
    )


@register_jitable
def distance(start: Load, end: Load) -> float:
    """Length of the path between two loads: the largest change of drive and slack."""
    return max(abs(end.drive - start.drive), abs(end.slack[0] - start.slack[0]), abs(end.slack[1] - start.slack[1]))


@register_jitable
def next_part(done: float, reach: float, length: float, max_step: float) -> float:
    """Part of a path at which the next step ends, ``done`` being the part behind it and ``reach`` the step's length.

    The path is cut into equal pieces of at most ``max_step``. No step goes past the end of a piece, however the last
    ones were halved, so that a program and its resampling visit the same points. Rounding leaves no step of next to
    nothing.
    """
    pieces = math.ceil(length / max_step - 1e-6)
    if pieces <= 1 and length <= 1.000001 * reach:
        return 1.0
    end = (math.floor(done * pieces + 1e-6) + 1) / pieces if pieces > 1 else 1.0
    part = done + reach / length
    return min(end, 1.0) if part > end - 1e-6 * reach / length else part


@register_jitable
def next_step(start: Load, end: Load, done: float, reach: float, control: StepControl) -> Step:
    """Choose the next step from one load to another; arguments as of :func:`next_part`.

    A dwell, in which drag relaxes, counts as one longest step, so that it can be halved. So does a path on which the
    weight comes on, however little the drive moves.
    """
    length = distance(start, end)
    if length == 0.0 or end.dead != start.dead:
        length = max(length, control.max_step)
    part = next_part(done, reach, length, control.max_step)
    load = between(start, end, part) if part < 1.0 else end
    step = (part - done) * length
    return Step(part=part, load=load, length=step, fine=step <= FINE * control.max_step)


@register_jitable
def jumped(rotation: float, slide: float, length: float, control: StepControl) -> bool:
    """Whether the largest rotation of a joint (rad) or slide at a guide (mm) is more than a step explains."""
    return (
        rotation > control.rotation_per_length * length + control.least_rotation
        or slide > control.slide_per_length * length + control.least_slide
    )


@register_jitable
def reach_after_success(reach: float, control: StepControl) -> float:
    """Length of the next step after one that was accepted: twice as long, up to the longest."""
    return min(control.max_step, 2.0 * reach)


@register_jitable
def too_short(reach: float, control: StepControl) -> bool:
    """Whether a step has been halved too often."""
    return reach < control.max_step * 0.5**control.max_halvings


@register_jitable
def front(states: Floats) -> int:
    """How many guides of a tendon, counted from the wheel, are in the state of the first; shape (N,)."""
    for i in range(states.size):
        if states[i] != states[0]:
            return i
    return states.size


@register_jitable
def front_speed(before: float, reached: float, direction: float, last_direction: float, length: float) -> float:
    """Guides per length that the front of sliding guides ran through in a step, for the next step's first guess.

    After a reversal the front starts anew: guides that slide at once count half. After a failed step, when the last
    direction is not known (nan), no guess is safe.
    """
    length = max(length, LEAST_LENGTH)
    if direction == last_direction:
        return max(0.0, reached - before) / length
    return 0.5 * reached / length if direction == -last_direction else 0.0
