"""The task of every engine: 14 joints, two elastic tendons on one wheel, one triangle of the drive."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

import numpy as np

from fem_models.analytic import theory_curve
from fem_models.joint import joint_mechanics
from fem_models.joint.flexure import flexure
from fem_models.load import LoadProgram, triangle
from fem_models.rig import Rig, preset
from fem_models.rig.rig import Friction, notched_tube
from hysteresis.arrays import Floats

AMPLITUDE_MM = 2.2
STEP_MM = 0.1
FRICTION_N = 1.73
"""Friction of each tendon in its sheath, as in the default rig."""
HOLD_STEPS = 10_000


@dataclass(frozen=True)
class Task:
    """The rig as the other codes model it; mm, N, rad.

    Joints are hinges with springs in the middle of the notches, ``pitch`` apart; rings are rigid and extend
    ``half_ring`` to either side of their centre. A tendon runs at ``arm`` from the axis, in the holes of the rings and
    straight across the notches; it is linear, with ``tendon_stiffness`` from the wheel to the tip.
    """

    rig: Rig
    joints: int
    pitch: float
    half_ring: float
    arm: float
    hinge_stiffness: float
    tendon_stiffness: float
    preload: float

    @property
    def bending_stiffness(self) -> float:
        """Stiffness of one joint if all joints rotate alike and the wheel is fixed."""
        return self.hinge_stiffness + 2 * self.tendon_stiffness * self.arm**2 * self.joints

    def exact_deg(self, drive_mm: Floats) -> Floats:
        """Bending angle without friction: closed form for tendons straight across the notches."""
        return theory_curve(self.rig, drive_mm).angle_deg

    def constant_arm_deg(self, drive_mm: Floats) -> Floats:
        """Bending angle with the tendon path r theta: theta = 2 k r x / (c/N + 2 k r^2), while both are taut."""
        return np.degrees(2 * self.tendon_stiffness * self.arm * self.joints * drive_mm / self.bending_stiffness)

    def friction_width_deg(self) -> float:
        """Width of the loop with constant friction f on both tendons and constant arm: 4 f r / (c/N + 2 k r^2)."""
        return math.degrees(4 * FRICTION_N * self.arm * self.joints / self.bending_stiffness)


def loop_without_friction() -> LoadProgram:
    """Load program 0, +A, -A, 0 in 88 steps of 0.1 mm."""
    return LoadProgram(triangle(AMPLITUDE_MM, step_mm=STEP_MM).drive_mm[1:89])


def loop_with_friction() -> LoadProgram:
    """Load program 0, +A, and from there one closed loop of 88 steps."""
    return triangle(AMPLITUDE_MM, step_mm=STEP_MM)


def frictionless() -> Task:
    """Preset du2018 with linear tendons and neither friction nor a material loop."""
    rig = preset("du2018", preload_N=20.0)
    tendon = replace(rig.tendon_a, toe_N=0.0)
    rig = replace(
        rig, tendon_a=tendon, tendon_b=tendon, friction=Friction(), material=replace(rig.material, loop_share=0.0)
    )
    return Task(
        rig=rig,
        joints=rig.joints,
        pitch=rig.pitch_mm,
        half_ring=notched_tube(rig).cut.spacing_mm / 2,
        arm=joint_mechanics(rig).arms_mm.a,
        hinge_stiffness=flexure(rig).bending_Nmm_per_rad,
        tendon_stiffness=tendon.EA_N / (tendon.free_length_mm + rig.joints * rig.pitch_mm),
        preload=rig.preload_N,
    )
