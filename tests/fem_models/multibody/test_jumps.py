"""Multibody model where no equilibrium is near: jumps, slack tendons, next to rigid tendons."""

from dataclasses import replace

import numpy as np
import pytest

from fem_models.chain import simulate_chain
from fem_models.load import LoadProgram, triangle
from fem_models.multibody.quasi_static import simulate_multibody, solve_multibody
from fem_models.multibody.stepper import MultibodySettings
from fem_models.rig import Rig
from fem_models.rig.effects import TipLoad
from fem_models.rig.joints import MeasuredJoint, Notch, NotchedTube, Tube
from fem_models.rig.rig import Friction, Material, Tendon, Wheel

STIFFNESS, PITCH, ARM, FORCE = 100.0, 10.0, 2.0, 24.0
TENDON = Tendon(EA_N=50.0, moment_arm_mm=ARM, free_length_mm=100.0)
BUCKLED = Rig(
    name="a joint that a load on its tip has buckled",
    joint=MeasuredJoint(joints=1, pitch_mm=PITCH, flexure_stiffness_Nmm_per_rad=STIFFNESS),
    material=Material(),
    tendon_a=TENDON,
    tendon_b=TENDON,
    wheel=Wheel(10.0),
    preload_N=5.0,
    friction=Friction(),
    tip_load=TipLoad(force_N=FORCE, direction_deg=180.0),
)
TO_AND_FRO = LoadProgram(np.concatenate([np.linspace(3, -3, 61), np.linspace(-2.9, 3, 60)]))


def buckled_angles_deg(drive_mm):
    """Balance of moments of the only joint: its spring, the load on the tip, tendons across the notch (by hand).

    A fifth of the pitch bends. It lies along the mean of both rings, so that the path of a tendon across it changes by
    2 r sin(theta/2). From each drive to the next the angle falls down the moment to the next root.
    """
    turning = 0.2 * PITCH
    k = TENDON.EA_N / (TENDON.free_length_mm + PITCH)

    def moment(theta, x):
        load = FORCE * (turning / 2 * np.sin(theta / 2) + (PITCH - turning) / 2 * np.sin(theta))
        return STIFFNESS * theta - load - 2 * k * (x - 2 * ARM * np.sin(theta / 2)) * ARM * np.cos(theta / 2)

    theta, out = 0.5, []
    for x in drive_mm:
        for _ in range(20_000):
            step = 0.01 * moment(theta, x)
            theta -= step
            if abs(step) < 1e-12:
                break
        out.append(np.degrees(theta))
    return np.array(out)


@pytest.fixture(scope="module")
def snapped():
    return solve_multibody(BUCKLED, TO_AND_FRO)


def test_a_buckled_joint_snaps_through_where_its_moment_has_a_fold(snapped):
    angle = snapped.record.angle_deg
    np.testing.assert_allclose(angle, buckled_angles_deg(TO_AND_FRO.drive_mm), atol=0.1)
    changes = np.abs(np.diff(angle, prepend=angle[0]))
    np.testing.assert_array_equal(np.flatnonzero(snapped.jump), np.flatnonzero(changes > 20))
    assert snapped.jump.sum() == 2


def test_a_jump_loses_the_work_of_the_wheel_over_a_closed_loop(snapped):
    work, jump = (values[-1] - values[0] for values in (snapped.wheel_work_mJ, snapped.jump_loss_mJ))
    assert work > 1.0
    assert jump == pytest.approx(work, rel=0.01)
    assert np.all(np.diff(snapped.jump_loss_mJ) >= -1e-9)


def test_where_a_jump_ends_does_not_depend_on_the_viscosity(snapped):
    half = solve_multibody(BUCKLED, TO_AND_FRO, MultibodySettings(pseudo_viscosity=0.5))
    np.testing.assert_allclose(half.record.angle_deg, snapped.record.angle_deg, atol=1e-3)
    assert half.jump_loss_mJ[-1] == pytest.approx(snapped.jump_loss_mJ[-1], rel=0.01)
