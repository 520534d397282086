"""The multibody model in space: planar rigs, frames, energy, and the chain in space, which has other mechanics."""

import math
from dataclasses import replace

import numpy as np
import pytest

from fem_models.chain.solve import solve_chain
from fem_models.load import LoadProgram, triangle
from fem_models.multibody import solve_multibody
from fem_models.multibody.spatial import MULTIBODY_SETTINGS, solve_spatial_multibody
from fem_models.multibody.spatial.flexures import NODE, Flexures, laws_of
from fem_models.rig import RigError, preset
from fem_models.rig.checks import SolverError
from fem_models.rig.effects import Closure, Gravity, Superelastic, TipStop
from fem_models.rig.joints import MeasuredJoint, Notch
from fem_models.rig.presets_in_space import any_preset
from fem_models.rig.rig import Friction, Material, Rig, Tendon, Wheel, with_notch
from fem_models.spatial import (
    SpatialProgram,
    SpatialSettings,
    WheelProgram,
    of_rig_in_space,
    solve_spatial,
    spatial_rig,
    wheel_drives,
    with_masses,
)
from validation.engines.checks.workshop_rigs import workshop_wrist

RIG = preset("du2018")
CAPSTAN = replace(RIG, friction=Friction(0.1, 0.05, 0.2))
ONE_SIDED = with_notch(RIG, Notch("rectangular", 8, depth_mm=4.5, width_mm=1.5, spacing_mm=1.2))
SINGLE = replace(preset("notched-wrist-90"), superelastic=None, closure=Closure(1000.0, 8.0))


def two_planes(rig=RIG, *, turn_deg=0.0, count=14):
    """Every second notch turned by 90 degrees, and four tendons."""
    rig = with_notch(rig, replace(rig.joint.notch, count=count))
    turns = [turn_deg + 90.0 * (k % 2) for k in range(count)]
    return spatial_rig(rig, turns_deg=turns, tendons_deg=[turn_deg + angle for angle in (0, 180, 90, 270)])


def circle(amplitude_mm, samples):
    """Drives of two wheels: out along the first plane, then round."""
    lead, angle = np.linspace(0, 1, 1 + samples // 6), 2 * np.pi * np.arange(1, samples + 1) / samples
    out = np.stack([lead, 0 * lead], axis=1)
    return wheel_drives(amplitude_mm * np.concatenate([out, np.stack([np.cos(angle), np.sin(angle)], axis=1)]))


@pytest.mark.parametrize(
    ("rig", "turn_deg"),
    [
        (RIG, 0.0),
        (replace(RIG, friction=Friction(0.2, 0.05, rest_wrap_deg=20.0)), 0.0),
        (replace(RIG, gravity=Gravity(1.0, -60.0)), 37.0),
        (replace(ONE_SIDED, closure=Closure(1000.0, 0.4)), 0.0),
    ],
)
def test_a_planar_rig_is_that_of_the_planar_multibody(rig, turn_deg):
    """At any angle about the axis."""
    program = triangle(1.2, step_mm=0.2)
    planar, chain = solve_multibody(rig, program), solve_chain(rig, program)
    space = solve_spatial_multibody(spatial_rig(rig, turns_deg=turn_deg), wheel_drives(program.drive_mm))
    cs, sn = math.cos(math.radians(turn_deg)), math.sin(math.radians(turn_deg))
    np.testing.assert_allclose(space.bending_deg @ [cs, sn], planar.record.angle_deg, atol=8e-4)
    np.testing.assert_allclose(planar.record.angle_deg, chain.record.angle_deg, atol=8e-4)
    np.testing.assert_allclose(space.bending_deg @ [cs, sn], chain.record.angle_deg, atol=5e-4)
    assert np.abs(space.bending_deg @ [-sn, cs]).max() < 1e-6
    assert np.abs(space.torsion_deg).max() < 1e-6
    for here, there in ((space.work_mJ, planar.wheel_work_mJ), (space.friction_mJ, planar.friction_loss_mJ)):
        np.testing.assert_allclose(here, there, atol=2e-3 * planar.wheel_work_mJ[-1])


def test_a_planar_wrist_of_one_tendon_is_that_of_the_planar_multibody():
    """Without preload, to 42 deg; the tendon presses all rings by as much as it pulls."""
    program = LoadProgram(np.linspace(0, 1, 21))
    planar = solve_multibody(SINGLE, program).record.angle_deg
    space = solve_spatial_multibody(spatial_rig(SINGLE), program.drive_mm[:, None])
    np.testing.assert_allclose(space.bending_deg[:, 0], planar, atol=1e-3)


CASES = {
    "two planes": (two_planes(), circle(1.0, 18), 3e-3),
    "capstan": (two_planes(CAPSTAN), circle(0.5, 24), 1e-3),
    # under a tip weight notches shear and stretch, and their tendons with them, which the chain leaves out
    "tip weight": (with_masses(two_planes(), (0.3, -1.0, 0.4), ring_g=0.2, tip_g=50.0), circle(0.7, 12), 2e-3),
    "helix": (
        spatial_rig(
            replace(ONE_SIDED, friction=Friction(0.1, 0.02, 0.2)),
            turns_deg=[45.0 * k for k in range(8)],
            tendons_deg=[0, 180, 90, 270],
        ),
        circle(0.4, 24),
        3e-3,
    ),
    "shear centres": (
        spatial_rig(ONE_SIDED, turns_deg=[90.0 * (k % 2) for k in range(8)], tendons_deg=[30, 210, 120, 300]),
        circle(0.4, 24),
        3e-3,
    ),
    "shear centres, tip weight": (
        with_masses(spatial_rig(ONE_SIDED, tendons_deg=[30, 210]), (0.2, -0.3, 1.0), tip_g=5.0),
        wheel_drives(np.linspace(0.0, 0.4, 9)),
        2e-3,
    ),
    "uneven pitch": (
        spatial_rig(
            with_notch(
                CAPSTAN,
                Notch("rectangular_pair", 4, (2.6, 2.65, 2.7, 2.7), (1.5, 1.2, 1.8, 1.3), (1.0, 1.5, 0.8, 2.0)),
            ),
            turns_deg=[0, 90, 0, 90],
            tendons_deg=[0, 180, 90, 270],
        ),
        circle(0.15, 24),
        1e-3,
    ),
    "one tendon, closing notches": (spatial_rig(SINGLE, turns_deg=37.0), np.linspace(0, 1, 21)[:, None], 1e-3),
}


@pytest.mark.parametrize("name", CASES)
def test_both_engines_agree_in_space(name):
    """Issue 24 wants 0.1 deg. With samples so far apart guides slide in steps of other lengths."""
    rig, drives, tolerance = CASES[name]
    multibody, chain = solve_spatial_multibody(rig, drives), solve_spatial(rig, drives)
    assert np.abs(chain.bending_deg).max() > 1.0
    np.testing.assert_allclose(multibody.bending_deg, chain.bending_deg, atol=tolerance)
    np.testing.assert_allclose(multibody.torsion_deg, chain.torsion_deg, atol=tolerance)
    np.testing.assert_allclose(multibody.tip_mm, chain.tip_mm, atol=2 * tolerance)
    np.testing.assert_allclose(multibody.notches_deg, chain.notches_deg, atol=tolerance)
    np.testing.assert_allclose(multibody.tensions_N, chain.tensions_N, atol=0.06)  # where a guide slides a step later
    assert multibody.work_mJ[-1] == pytest.approx(chain.work_mJ[-1], rel=5e-3)
    assert multibody.friction_mJ[-1] == pytest.approx(chain.friction_mJ[-1], rel=2e-2)
    assert multibody.material_mJ[-1] == pytest.approx(chain.material_mJ[-1], rel=2e-3)


@pytest.mark.parametrize(
    ("wheel_1_mm", "least_N"),
    [
        pytest.param([*np.linspace(0, 0.8, 9), *np.linspace(0.7, 0, 8)], 0.2, id="out and back"),
        pytest.param(np.linspace(0, 1.3, 9), 0.0, id="until a tendon is slack"),
    ],
)
def test_a_wrist_whose_friction_is_that_of_wraps_alone(wheel_1_mm, least_N):
    """Straight, it has no friction at all, and guides could take turns to stick and slide for ever."""
    rig = any_preset("zhang2026")
    drives = WheelProgram(np.column_stack([wheel_1_mm, np.zeros(len(wheel_1_mm))])).of_tendons(rig)
    wrist = of_rig_in_space(rig)
    # at 0.1 mm this engine halves steps on the way back that the chain takes whole: 1.5e-3 N, here 3e-4
    multibody = solve_spatial_multibody(wrist, drives, replace(MULTIBODY_SETTINGS, max_step_mm=0.05))
    chain = solve_spatial(wrist, drives, SpatialSettings(max_step_mm=0.05))
    assert chain.tensions_N.min() == pytest.approx(least_N, abs=0.05)
    np.testing.assert_allclose(multibody.bending_deg, chain.bending_deg, atol=1e-3)
    np.testing.assert_allclose(multibody.tensions_N, chain.tensions_N, atol=1e-3)


def test_tendons_that_do_not_balance_each_other_bend_the_wrist_at_rest():
    """Two at a right angle, 12 N of preload: from the straight wrist Newton's method finds nothing."""
    published = any_preset("zhang2026").in_plane
    rig = with_notch(replace(published, preload_N=12.0, tendon_b=None), replace(published.joint.notch, count=8))
    wrist = spatial_rig(rig, turns_deg=[90.0 * (k % 2) for k in range(8)], tendons_deg=[0, 90])
    wound = np.column_stack([np.linspace(0, 0.2, 5), np.linspace(0, 0.1, 5)])
    chain, multibody = solve_spatial(wrist, wound), solve_spatial_multibody(wrist, wound)
    assert np.hypot(*chain.bending_deg[0]) > 12.0
    np.testing.assert_allclose(multibody.bending_deg, chain.bending_deg, atol=5e-4)
    np.testing.assert_allclose(multibody.tensions_N, chain.tensions_N, atol=5e-3)


def test_a_wrist_turned_about_its_axis_with_gravity_gives_the_same():
    def run(turn_deg):
        cs, sn = math.cos(math.radians(turn_deg)), math.sin(math.radians(turn_deg))
        turn = np.array([[1, 0, 0], [0, cs, -sn], [0, sn, cs]])
        rig = with_masses(two_planes(CAPSTAN, turn_deg=turn_deg, count=6), turn @ [0.3, -1.0, 0.4], tip_g=50.0)
        solution = solve_spatial_multibody(rig, circle(0.4, 18))
        return solution, solution.tip_mm @ turn

    (one, tip), (other, tip_turned) = run(0.0), run(57.0)
    np.testing.assert_allclose(tip_turned, tip, atol=5e-4)
    np.testing.assert_allclose(other.torsion_deg, one.torsion_deg, atol=5e-4)


def test_energy_closes():
    """Work = elastic energy + friction + material, at better than the first order of the step."""
    gaps = []
    for samples in (40, 160):
        s = solve_spatial_multibody(two_planes(CAPSTAN, count=4), circle(0.3, samples))
        gap = s.work_mJ - s.friction_mJ - s.material_mJ - s.stored_mJ
        gaps.append(np.abs(gap).max() / s.work_mJ[-1])
    assert gaps[1] < 1e-3
    assert gaps[1] < 0.25 * gaps[0]


def test_prescribed_tensions():
    rig = two_planes(CAPSTAN, count=6)
    force = 20 + np.linspace(0, 6, 7)[:, None] * [1.0, -1.0, 0.5, -0.5]
    program = SpatialProgram(np.concatenate([force, force[::-1]]), (True,) * 4)
    multibody, chain = solve_spatial_multibody(rig, program), solve_spatial(rig, program)
    np.testing.assert_allclose(multibody.bending_deg, chain.bending_deg, atol=0.01)
    assert multibody.work_mJ[-1] == pytest.approx(chain.work_mJ[-1], rel=0.02)


def test_forces_of_the_flexures_are_the_slopes_of_their_energy():
    """By central differences, at ends anywhere: all loops stick, some edges touch."""
    rig = replace(two_planes(turn_deg=7.0, count=5), contact_Nmm_per_rad=300.0)
    laws, rng = laws_of(rig, np.full(5, 40.0)), np.random.default_rng(0)
    laws = laws._replace(slip=1e6 * laws.slip, closes=np.full(5, 0.02))
    straight = np.tile([1.5, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0], (5, 1))
    flexures = Flexures(laws, np.tile([0.8, 0.0, 0.1], (5, 1)), straight)
    base = np.array([0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0])
    ends = np.concatenate([np.tile(base, (5, 1)), straight], axis=1) + 0.1 * rng.normal(size=(5, 2 * NODE))
    forces = flexures.forces(ends)
    for i, nudge in enumerate(1e-5 * np.eye(2 * NODE)):
        for k in range(5):
            there, back = ends.copy(), ends.copy()
            there[k] += nudge
            back[k] -= nudge
            slope = (
                flexures.stored_mJ(flexures.strains(there)[0]) - flexures.stored_mJ(flexures.strains(back)[0])
            ) / 2e-5
            assert slope == pytest.approx(forces[k, i], abs=1e-6 * np.abs(forces).max())


def test_what_the_chain_refuses_is_refused_alike():
    for effect in ({"superelastic": Superelastic()}, {"tip_stop": TipStop(1.0, 10.0)}):
        with pytest.raises(RigError, match="expected none in space"):
            spatial_rig(replace(RIG, **effect))
    with pytest.raises(RigError, match="drives = 3 columns: expected one for each of 4 tendons"):
        solve_spatial_multibody(two_planes(), np.zeros((2, 3)))


def test_no_equilibrium_raises_with_sample_and_drives():
    with pytest.raises(SolverError, match=r"closes at|no equilibrium between drives"):
        solve_spatial_multibody(two_planes(count=2), wheel_drives([[0.0, 0.0], [60.0, 0.0]]))


def test_a_slack_tendon_is_drawn_taut_again():
    published = any_preset("zhang2026")
    rig = with_notch(published.in_plane, replace(published.joint.notch, count=4))
    wrist = spatial_rig(rig, turns_deg=published.turns_deg[:4], tendons_deg=[0, 180, 90, 270])
    drives = wheel_drives(np.array([[0.0, 0.0], [0.15, 0.0], [0.3, 0.0], [0.2, 0.0]]))
    chain, multibody = solve_spatial(wrist, drives), solve_spatial_multibody(wrist, drives)
    assert chain.tensions_N[2, 1].min() < 1e-3
    np.testing.assert_allclose(multibody.bending_deg, chain.bending_deg, atol=0.02)
    np.testing.assert_allclose(multibody.tensions_N, chain.tensions_N, atol=0.02)


def test_a_jump_is_that_of_the_chain_in_space():
    """A joint that the thrust of its tendons pushes aside."""
    tendon = Tendon(EA_N=2000.0, moment_arm_mm=2.0, free_length_mm=2000.0)
    bistable = Rig(
        name="bistable",
        joint=MeasuredJoint(1, 20.0, 50.0, rigid_gap_mm=10.0),
        material=Material(),
        tendon_a=tendon,
        tendon_b=tendon,
        wheel=Wheel(10.0),
        preload_N=18.0,
        precurvature_deg=5.0,
    )
    wrist, drives = spatial_rig(bistable, turns_deg=37.0), wheel_drives([*np.arange(0.0, 9.0), 7.0, 6.0])
    chain, multibody = solve_spatial(wrist, drives), solve_spatial_multibody(wrist, drives)
    assert np.count_nonzero(chain.jump) == 1
    np.testing.assert_array_equal(multibody.jump, chain.jump)
    np.testing.assert_allclose(multibody.bending_deg, chain.bending_deg, atol=2e-3)
    np.testing.assert_allclose(multibody.jump_loss_mJ, chain.jump_loss_mJ, rtol=2e-3)


def test_wrists_whose_tendons_are_slack_in_part_follow_the_chain():
    """Friction of wraps alone, tendons with a toe region: segments beside each other are slack and taut."""
    for number in (28, 51):
        rig, wheels = workshop_wrist((71, number))
        wrist, program = of_rig_in_space(rig), WheelProgram(np.array(wheels)).of_tendons(rig)
        chain, multibody = solve_spatial(wrist, program), solve_spatial_multibody(wrist, program)
        np.testing.assert_allclose(
            multibody.bending_deg, chain.bending_deg, atol=2e-3 * np.abs(chain.bending_deg).max()
        )
