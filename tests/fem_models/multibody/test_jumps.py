"""Multibody model where no equilibrium is near: jumps, slack tendons, next to rigid tendons."""

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
from validation.engines.checks.workshop_rigs import workshop_rig

STIFFNESS, PITCH, ARM, FORCE = 100.0, 10.0, 2.0, 24.0
TENDON = Tendon(EA_N=5000.0, moment_arm_mm=ARM, free_length_mm=10_990.0)  # so soft by its length: rings are rigid
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


@pytest.mark.slow
def test_a_buckled_joint_snaps_through_where_its_moment_has_a_fold(snapped):
    angle = snapped.record.angle_deg
    np.testing.assert_allclose(angle, buckled_angles_deg(TO_AND_FRO.drive_mm), atol=0.1)
    changes = np.abs(np.diff(angle, prepend=angle[0]))
    np.testing.assert_array_equal(np.flatnonzero(snapped.jump), np.flatnonzero(changes > 20))
    assert snapped.jump.sum() == 2


@pytest.mark.slow
def test_a_jump_loses_the_work_of_the_wheel_over_a_closed_loop(snapped):
    work, jump = (values[-1] - values[0] for values in (snapped.wheel_work_mJ, snapped.jump_loss_mJ))
    assert work > 1.0
    assert jump == pytest.approx(work, rel=0.01)
    assert np.all(np.diff(snapped.jump_loss_mJ) >= -1e-9)


@pytest.mark.slow
def test_where_a_jump_ends_does_not_depend_on_the_viscosity(snapped):
    half = solve_multibody(BUCKLED, TO_AND_FRO, MultibodySettings(pseudo_viscosity=0.5))
    np.testing.assert_allclose(half.record.angle_deg, snapped.record.angle_deg, atol=1e-3)
    assert half.jump_loss_mJ[-1] == pytest.approx(snapped.jump_loss_mJ[-1], rel=0.01)


def tube(name, size, notch, young_GPa, loop, tendon, preload_N, friction):
    tendon = Tendon(*tendon)
    return Rig(
        name=name,
        joint=NotchedTube(Tube(*size), notch),
        material=Material(young_GPa, 0.33, *loop),
        tendon_a=tendon,
        tendon_b=tendon,
        wheel=Wheel(10.0),
        preload_N=preload_N,
        friction=friction,
    )


@pytest.mark.parametrize(
    ("rig", "reach_mm"),
    [
        pytest.param(
            tube(
                "slots",
                (3.6849, 2.7517),
                Notch("rectangular_pair", 19, 1.5819, 0.7322, 1.4325),
                47.7,
                (0.375, 2.97),
                (9974.7, 1.2426, 543.51),
                4.6061,
                Friction(capstan_coefficient=0.05, sheath_N=0.4606),
            ),
            1.2421,
            marks=pytest.mark.slow,
        ),
        (
            tube(
                "vees",
                (7.318, 5.4436),
                Notch("v_pair", 10, 3.1277, 1.9384, 2.2119, 0.7237),
                31.11,
                (0.083, 2.925),
                (23843.8, 2.6365, 53.52),
                3.659,
                Friction(capstan_coefficient=0.3, sheath_N=0.3659),
            ),
            1.5389,
        ),
    ],
)
def test_a_tendon_falls_slack_and_becomes_taut_again_as_in_the_chain(rig, reach_mm):
    program = triangle(reach_mm, step_mm=reach_mm / 22)
    solution = solve_multibody(rig, program)
    assert (solution.segment_tensions_N.max(axis=(0, 2)) > 0).all()
    assert (np.abs(solution.segment_tensions_N).max(axis=2).min(axis=0) < 1e-3).all()
    chain = simulate_chain(rig, program).angle_deg
    assert np.abs(solution.record.angle_deg - chain).max() < 2e-3 * np.abs(chain).max()
    assert not solution.jump.any()


@pytest.mark.parametrize("EA_N", [1e6, 1e7])
def test_tendons_that_hardly_stretch_leave_an_answer(EA_N):
    rig = tube(
        "stiff tendons",
        (6.0, 5.4),
        Notch("rectangular_pair", 10, 2.6, 0.8, 1.2),
        60.0,
        (0.0,),
        (EA_N, 2.5, 120.0),
        15.0,
        Friction(sheath_N=0.5),
    )
    program = triangle(1.5, step_mm=0.3)
    np.testing.assert_allclose(
        simulate_multibody(rig, program).angle_deg, simulate_chain(rig, program).angle_deg, atol=2e-3
    )


def test_one_tendon_draws_metal_with_a_flat_plateau_to_the_rest_of_the_chain():
    """Friction holds it in many places: Newton's method from the straight tube had gone to 82 deg in place of 50."""
    rig, program = workshop_rig((228097, 80))
    first = LoadProgram(program.drive_mm[:2])
    bodies, chain = (solve(rig, first).angle_deg for solve in (simulate_multibody, simulate_chain))
    np.testing.assert_allclose(bodies, chain, rtol=1e-3)
