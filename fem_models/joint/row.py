"""Mechanics of all joints of a rig, from the base to the tip: one and the same where notches are equal."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from operator import attrgetter
from typing import NamedTuple

import numpy as np

from fem_models.joint.flexure import elasticity
from fem_models.joint.mechanics import JointMechanics, RingStiffness, joint_mechanics, ring_stiffness
from fem_models.rig import Rig
from fem_models.rig.joints import Places
from fem_models.rig.rig import notched_tube, with_joint
from hysteresis.arrays import Floats


class Lengths(NamedTuple):
    """Lengths along the tube, mm, shapes (N,); the joints turn in the middle of their notches.

    ``segments`` are of tendon across each notch, from the middle of a ring to that of the next. ``beyond`` leads from a
    joint to the next one, at the last to the tip; ``to_ring`` to the middle of the ring beyond it. ``stiff`` is the
    part of ``beyond`` that lies along the ring; ``base`` is the part of the tube before the first joint that does.
    ``aside`` leads across the tube, towards tendon a, from the neutral axis of a notch to that of the next one: a ring
    and its tip are at the level of the notch before it, so at the last there is none.
    """

    segments: Floats
    beyond: Floats
    to_ring: Floats
    stiff: Floats
    base: float
    aside: Floats


@dataclass(frozen=True, eq=False)
class JointRow:
    """Mechanics of the joints of a rig, base first. Make it once by :func:`joint_row`, pass it on."""

    rig: Rig
    each: tuple[JointMechanics, ...]

    @property
    def alike(self) -> bool:
        """Whether all joints are equal."""
        return self.rig.joint.alike

    @property
    def first(self) -> JointMechanics:
        """Mechanics of the joint at the base: for what all joints share, such as the law of their metal."""
        return self.each[0]

    def of(self, name: str) -> Floats:
        """One value of each joint by its name, dotted for parts of a part; shape (N,), or (N, ...) of a tuple."""
        get = attrgetter(name)
        if self.alike:
            return np.array([get(self.first)] * len(self.each), dtype=float)
        return np.array([get(joint) for joint in self.each], dtype=float)

    @property
    def force_scale_N(self) -> float:
        """Tension that small forces are compared with: the least of the joints."""
        return self.first.force_scale_N if self.alike else min(joint.force_scale_N for joint in self.each)

    @property
    def softest(self) -> JointMechanics:
        """Mechanics of the joint that tendon a turns most."""
        if self.alike:
            return self.first
        return max(self.each, key=lambda joint: joint.arms_mm.a / joint.flexure.bending_Nmm_per_rad)

    @cached_property
    def places(self) -> Places:
        """Where notches and rings stand along the straight tube."""
        return self.rig.joint.places()

    @cached_property
    def lengths(self) -> Lengths:
        """Lengths along the tube."""
        turning = self.of("turning_length_mm")
        if self.alike:
            n, pitch = len(self.each), self.rig.pitch_mm
            beyond, half = np.full(n, pitch), 0.5 * (pitch - turning[0])
            beyond[-1] = 0.5 * pitch
            stiff = pitch - turning
            stiff[-1] *= 0.5
            return Lengths(np.full(n, pitch), beyond, np.full(n, 0.5 * pitch), stiff, float(half), np.zeros(n))
        middles, centres = map(np.array, self.places)
        neutral = -self.of("flexure.neutral_offset_mm")
        beyond = np.diff(middles, append=centres[-1])
        half = np.append(0.5 * (turning[:-1] + turning[1:]), 0.5 * turning[-1])
        return Lengths(
            segments=np.diff(centres, prepend=0.0),
            beyond=beyond,
            to_ring=centres - middles,
            stiff=beyond - half,
            base=float(middles[0] - 0.5 * turning[0]),
            aside=np.diff(neutral, append=neutral[-1]),
        )

    def ring_beyond(self, number: int) -> RingStiffness:
        """Stiffness of the ring between a joint, 0 at the base, and the next one."""
        near = self.each[number]
        if self.alike:
            return near.ring
        far, (middles, _) = self.each[number + 1], self.places
        length = middles[number + 1] - middles[number] - 0.5 * (near.bending_length_mm + far.bending_length_mm)
        return ring_stiffness(notched_tube(self.rig), elasticity(self.rig.material), length)


def joint_row(rig: Rig) -> JointRow:
    """Derive the mechanics of a rig's joints, once for equal notches.

    Raises
    ------
    RigError
        From :func:`fem_models.joint.mechanics.joint_mechanics`.
    """
    if rig.joint.alike:
        return JointRow(rig, (joint_mechanics(rig),) * rig.joints)
    joints = [rig.joint.of_joint(number) for number in range(rig.joints)]
    known = {joint: joint_mechanics(with_joint(rig, joints.index(joint))) for joint in dict.fromkeys(joints)}
    return JointRow(rig, tuple(known[joint] for joint in joints))
