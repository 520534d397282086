"""Jumps of wrists in space to another equilibrium, and wrists drawn at random, all of which have an answer."""

import numpy as np
import pytest

from fem_models.chain.solve import solve_chain
from fem_models.joint import joint_row
from fem_models.load import triangle
from fem_models.rig.joints import MeasuredJoint
from fem_models.rig.rig import Material, Rig, Tendon, Wheel
from fem_models.spatial import SpatialSettings, WheelProgram, of_rig_in_space, solve_spatial, spatial_rig, wheel_drives
from fem_models.spatial.motion.steps import at_rest, moved_to
from validation.engines.checks.workshop_rigs import workshop_wrist

ARM, GAP, PRELOAD, STIFF, REST_DEG = 2.0, 10.0, 18.0, 1.0, 5.0
TENDON = Tendon(EA_N=2000.0, moment_arm_mm=ARM, free_length_mm=2000.0)
BISTABLE = Rig(
    name="a joint that the thrust of its tendons pushes aside",
    joint=MeasuredJoint(1, 20.0, 50.0, rigid_gap_mm=GAP),
    material=Material(),
    tendon_a=TENDON,
    tendon_b=TENDON,
    wheel=Wheel(10.0),
    preload_N=PRELOAD,
    precurvature_deg=REST_DEG,
)
LOOP = triangle(12.0, step_mm=0.25, cycles=2)


def drive_of_the_bistable_joint(angle_deg):
    """Closed form, drive at an angle: the moment of the joint is that of its tendons, and a slack one has none.

    The way of tendon s = 1, -1 over the gap is l = 2 (g/2 (1 - cos t/2) + s r sin t/2); its tension is
    T = P + k (s x - l + l0).
    """
    theta, rest = np.radians(angle_deg), np.radians(REST_DEG)
    joint = joint_row(BISTABLE).first.elastic_Nmm_per_rad
    k = 1 / (2000.0 / TENDON.EA_N + 20.0 / TENDON.EA_N)

    def way(side, t):
        return 2 * (0.5 * GAP * (1 - np.cos(t / 2)) + side * ARM * np.sin(t / 2))

    def lever(side):
        return 0.5 * GAP * np.sin(theta / 2) + side * ARM * np.cos(theta / 2)

    longer = [way(side, theta) - way(side, rest) for side in (1, -1)]
    a, b, moment = lever(1), lever(-1), joint * (theta - rest)
    both = (moment - PRELOAD * (a + b) + k * (longer[0] * a + longer[1] * b)) / (k * (a - b))
    drives = [both, (moment / a - PRELOAD) / k + longer[0], -(moment / b - PRELOAD) / k - longer[1]]
    tensions = [(PRELOAD + k * (x - longer[0]), PRELOAD + k * (-x - longer[1])) for x in drives]
    taut = [(True, True), (True, False), (False, True)]
    fits = [all((t > 0) == on for t, on in zip(ts, ons, strict=True)) for ts, ons in zip(tensions, taut, strict=True)]
    return [x for x, fit in zip(drives, fits, strict=True) if fit]


@pytest.mark.parametrize("turn_deg", [0.0, 37.0])
def test_a_jump_is_that_of_the_planar_chain_and_of_the_closed_form(turn_deg):
    planar = solve_chain(BISTABLE, LOOP)
    space = solve_spatial(spatial_rig(BISTABLE, turns_deg=turn_deg), wheel_drives(LOOP.drive_mm))
    cs, sn = np.cos(np.radians(turn_deg)), np.sin(np.radians(turn_deg))
    jumps = np.flatnonzero(space.jump)
    assert jumps.size == 5
    np.testing.assert_array_equal(space.jump, planar.jump)
    np.testing.assert_allclose(space.bending_deg @ [cs, sn], planar.record.angle_deg, atol=1e-6)
    np.testing.assert_allclose(space.jump_loss_mJ, planar.jump_loss_mJ, rtol=1e-2)  # pseudo steps differ
    for sample in np.concatenate([jumps - 1, jumps]):
        angle = float(space.bending_deg[sample] @ [cs, sn])
        drives = np.array([x for at in angle + np.linspace(-0.1, 0.1, 41) for x in drive_of_the_bistable_joint(at)])
        assert drives.min() <= LOOP.drive_mm[sample] <= drives.max(), f"sample {sample} at {angle} deg"


def test_energy_closes_over_jumps_and_does_not_depend_on_the_viscosity():
    """Work = stored + friction + material + jumps."""
    runs = [
        solve_spatial(spatial_rig(BISTABLE), wheel_drives(LOOP.drive_mm), SpatialSettings(viscosity=viscosity))
        for viscosity in (1.0, 0.5)
    ]
    for s in runs:
        gap = s.work_mJ - s.friction_mJ - s.material_mJ - s.stored_mJ - s.jump_loss_mJ
        assert np.abs(gap).max() < 3e-3 * s.work_mJ.max()  # pseudo steps are of 0.1 deg
    np.testing.assert_allclose(runs[1].bending_deg, runs[0].bending_deg, atol=1e-6)
    np.testing.assert_allclose(runs[1].jump_loss_mJ, runs[0].jump_loss_mJ, rtol=1e-6)
    assert runs[0].jump_loss_mJ[-1] > 100.0


def test_a_step_from_an_equilibrium_jumps_too():
    """Those of a run, past the jump and before it."""
    drives = wheel_drives([0.0, 5.0, 7.0])
    run, state = solve_spatial(spatial_rig(BISTABLE), drives), at_rest(spatial_rig(BISTABLE))
    for s in (1, 2):
        state = moved_to(state, drives[s])
        np.testing.assert_allclose(state.bending_deg, run.bending_deg[s], atol=0.01)
    assert np.diff(run.bending_deg[:, 0])[1] > 100.0


def wrists(count):
    for number in range(count):
        wrist, wheels = workshop_wrist((72, number))
        yield wrist, np.array(wheels)


@pytest.mark.parametrize("count", [30, pytest.param(300, marks=pytest.mark.slow)])
def test_wrists_drawn_at_random_have_an_answer(count):
    for wrist, wheels in wrists(count):
        run = solve_spatial(of_rig_in_space(wrist), WheelProgram(wheels).of_tendons(wrist))
        assert np.isfinite(run.bending_deg).all()
        assert not run.jump.any()


def test_the_relaxation_alone_finds_what_newtons_method_finds():
    """Hardly any iterations, and the wrist relaxes in many steps: to the same places, by the friction on the way."""
    for wrist, wheels in wrists(4):
        rig, program = of_rig_in_space(wrist), WheelProgram(wheels[:16]).of_tendons(wrist)
        run = solve_spatial(rig, program)
        relaxed = solve_spatial(rig, program, SpatialSettings(newton_iterations=3, max_halvings=5))
        assert relaxed.failed_steps > run.failed_steps
        np.testing.assert_allclose(relaxed.bending_deg, run.bending_deg, atol=0.02 * np.abs(run.bending_deg).max())
