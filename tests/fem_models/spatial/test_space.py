"""Wrists that bend in two planes: frames, energy, exact tangents, closed forms, and the circle of the tip."""

import math
from dataclasses import replace

import numpy as np
import pytest

from fem_models.rig import preset
from fem_models.rig.joints import MeasuredJoint, Notch
from fem_models.rig.rig import Friction, Material, Tendon, with_notch
from fem_models.spatial import (
    DeadLoads,
    SpatialProgram,
    SpatialSettings,
    SpatialTendon,
    solve_spatial,
    spatial_rig,
    wheel_drives,
    with_masses,
)
from fem_models.spatial.kernels.history import motion_at_rest
from fem_models.spatial.kernels.joint import follow_displacements, work_space
from fem_models.spatial.kernels.loaded import step_by_spins
from fem_models.spatial.kernels.newton import balance_at
from fem_models.spatial.kernels.settle import step_with_states
from fem_models.spatial.kernels.slips import step_by_slips
from fem_models.spatial.parameters import memory_at_rest, spatial_parameters
from fem_models.spatial.place import rotation
from fem_models.spatial.tables import MOMENT, NEXT_DRIVE, OFF, SLOPE, THERE, UNBALANCED

RIG = preset("du2018")
ONE_SIDED = with_notch(RIG, Notch("rectangular", 14, depth_mm=4.5, width_mm=1.5, spacing_mm=1.2))


def two_planes(rig=RIG, *, turn_deg=0.0, count=14, tendons=4):
    """Notches turned by 90 degrees in turn, and tendons round the tube."""
    rig = with_notch(rig, replace(rig.joint.notch, count=count))
    turns = [turn_deg + 90.0 * (k % 2) for k in range(count)]
    angles = [0.0, 180.0, 90.0, 270.0] if tendons == 4 else [360.0 * j / tendons for j in range(tendons)]
    return spatial_rig(rig, turns_deg=turns, tendons_deg=[turn_deg + angle for angle in angles])


def circle(amplitude_mm, samples, cycles=1):
    """Drives of two wheels: out along the first plane, then round."""
    lead = np.linspace(0, amplitude_mm, max(2, samples // 6))
    angle = 2 * np.pi * np.arange(1, cycles * samples + 1) / samples
    out = np.stack([lead, np.zeros_like(lead)], axis=1)
    return np.concatenate([out, amplitude_mm * np.stack([np.cos(angle), np.sin(angle)], axis=1)])


def soft(rig):
    """Tendons that do not hold the tube, without friction."""
    tendon = Tendon(EA_N=1e4, moment_arm_mm=2.64, free_length_mm=1e10)
    return replace(
        rig, tendon_a=tendon, tendon_b=None, preload_N=0.0, friction=Friction(), material=Material(60.0, 0.33)
    )


@pytest.mark.parametrize("loaded", [False, True])
def test_a_wrist_turned_about_its_axis_gives_the_same_circle(loaded):
    def run(turn_deg):
        cs, sn = math.cos(math.radians(turn_deg)), math.sin(math.radians(turn_deg))
        turn = np.array([[1, 0, 0], [0, cs, -sn], [0, sn, cs]])
        rig = two_planes(turn_deg=turn_deg)
        if loaded:
            rig = with_masses(rig, turn @ [0.3, -1.0, 0.4], ring_g=0.2, tip_g=3.0)
        solution = solve_spatial(rig, wheel_drives(circle(1.0, 36)))
        return solution, solution.tip_mm @ turn

    (one, tip), (other, tip_turned) = run(0.0), run(57.0)
    np.testing.assert_allclose(tip_turned, tip, atol=1e-8)
    np.testing.assert_allclose(other.torsion_deg, one.torsion_deg, atol=1e-8)
    np.testing.assert_allclose(other.tensions_N, one.tensions_N, atol=1e-7)


@pytest.mark.parametrize("notched", [RIG, ONE_SIDED], ids=["pairs", "one-sided"])
@pytest.mark.parametrize("loaded", [False, True])
def test_the_tangent_is_exact(loaded, notched):
    """By Newton's step d: R(x + e d) = (1 - e) R(x), to the order of e^2. Guides stick and slide, all joints bend."""
    tight = replace(notched, friction=Friction(0.2, 0.05, 0.5), preload_N=3000.0)  # no tendon is slack
    rig = two_planes(tight)
    if loaded:
        rig = replace(rig, loads=DeadLoads((0.01, -0.02, 0.03), (0.1, 0.2, -0.3)))
    parameters = spatial_parameters(rig, (False,) * 4, SpatialSettings())
    memory, work, motion = memory_at_rest(parameters), work_space(parameters), motion_at_rest(parameters)
    rng = np.random.default_rng(1)
    n, m = motion.state.shape
    x = np.concatenate([rng.normal(0, 0.03, (n + 1, 3)), rng.normal(0, 1e-4, (n + 1, 3 + m))], axis=1)
    x[n] = 0.0
    work.state[:] = rng.integers(-1, 2, (n, m))
    motion.tendons[NEXT_DRIVE] = 0.1

    def residual(at):
        balance_at(at, motion.tendons, parameters, memory, work, 1.0, False, 0.0)
        turns = work.blocks[1:, :3, -1] if loaded else work.bent[:, MOMENT : MOMENT + 3]
        return np.concatenate(
            [turns.ravel(), 1e3 * work.bent[:, OFF : OFF + 3].ravel(), work.guides[..., UNBALANCED].ravel()]
        )

    start = residual(x)
    if loaded:
        step_by_spins(x, motion.tendons[SLOPE], parameters, 1.0, work)
    else:
        step_by_slips(motion.tendons[SLOPE], parameters, work)
    follow_displacements(work, n, m)
    step = work.step.copy()
    off = [np.abs(residual(x + e * step) - (1 - e) * start).max() for e in (1e-4, 1e-5)]
    assert np.log10(off[0] / off[1]) == pytest.approx(2.0, abs=0.1)
    assert off[1] < 1e-5 * np.abs(start).max()


@pytest.mark.parametrize("loaded", [False, True])
def test_guides_find_their_states_within_a_newton_step(loaded):
    """What the linear equations leave of tension at a guide is its friction, by the law: one state has that.

    Both wheels turn from rest, one of them so little that its tendons slide at some guides only.
    """
    rig = two_planes(replace(RIG, friction=Friction(0.02, 0.01, 0.5), preload_N=300.0))  # no tendon is slack
    if loaded:
        rig = replace(rig, loads=DeadLoads((0.0, -2e-4, 3e-4), (0.0, 2e-3, -3e-3)))
    parameters = spatial_parameters(rig, (False,) * 4, SpatialSettings())
    memory, work, motion = memory_at_rest(parameters), work_space(parameters), motion_at_rest(parameters)
    x, tendons = motion.x, motion.tendons
    tendons[NEXT_DRIVE] = [0.1, -0.1, 0.02, -0.02]
    balance_at(x, tendons, parameters, memory, work, 1.0, True, 0.0)
    before = work.state.copy()
    solved = step_with_states(x, tendons[SLOPE], parameters, 1.0, work, True)
    net, force, limit = np.moveaxis(work.along[..., THERE : THERE + 3], 2, 0)
    assert solved >= 3
    assert (work.state != before).sum() > 20
    assert {*np.unique(work.state)} == {-1.0, 0.0, 1.0}
    np.testing.assert_allclose(net, np.clip(force, -limit, limit), atol=1e-6)


@pytest.mark.parametrize("loaded", [False, True])
def test_iterations_do_not_grow_with_the_number_of_joints(loaded):
    """What a step takes is linear in the number of joints, and no step is halved for the sake of its guides.

    Those that fail let a tendon begin to slide at the base, where a wheel turns back: only a short step may do that.
    """

    def run(joints):
        rig = two_planes(preset("du2018-full-widths"), count=joints)
        if loaded:
            rig = with_masses(rig, (0, -1, 0), ring_g=0.1, tip_g=2.0)
        return solve_spatial(rig, wheel_drives(circle(1.0, 72)))

    short, long = run(7), run(42)
    assert long.steps <= 1.1 * short.steps
    assert long.failed_steps <= 1.1 * short.failed_steps
    assert long.iterations < 1.3 * short.iterations


ASIDE = replace(two_planes(ONE_SIDED, count=6), tendons=two_planes(ONE_SIDED, turn_deg=30.0, count=6).tendons)


@pytest.mark.parametrize("rig", [two_planes(count=6), ASIDE], ids=["pairs", "one-sided, tendons aside"])
def test_energy_closes(rig):
    """Work of the wheels = elastic energy + friction + material, at better than the first order of the step.

    At rest, one-sided notches hold energy of the preload.
    """
    gaps = []
    for samples in (200, 800, 3200):
        s = solve_spatial(rig, wheel_drives(circle(0.5, samples)))
        gap = s.work_mJ - s.friction_mJ - s.material_mJ - s.stored_mJ
        gaps.append(np.abs(gap - gap[0]).max() / s.work_mJ[-1])
    assert gaps[-1] < 2e-5
    assert np.log(gaps[0] / gaps[-1]) / np.log(16) > 1.0


def test_energy_of_weights_is_given_back_without_friction():
    """Without friction and loop a closed path returns all work, weights and all."""
    rig = with_masses(two_planes(replace(RIG, friction=Friction(), material=Material(60.0))), (0, -1, 0.5), tip_g=10.0)
    s = solve_spatial(rig, wheel_drives(circle(1.0, 400)))
    start = 65  # end of the lead
    assert s.work_mJ[-1] == pytest.approx(s.work_mJ[start], abs=1e-4 * np.ptp(s.work_mJ))
    np.testing.assert_allclose(s.tip_mm[-1], s.tip_mm[start], atol=1e-9)


def test_a_helix_has_the_capstan_ratio_of_its_turning():
    """On a rigid tube: exp(mu r w^2/sqrt(1 + r^2 w^2) L), w being the twist; polygons approach it at second order."""
    off, twist, mu, length = [], 12.0, 0.3, 40.0
    tendon = Tendon(EA_N=1e4, moment_arm_mm=2.64, free_length_mm=100.0)
    plain = replace(RIG, tendon_a=tendon, tendon_b=tendon, preload_N=0.1, friction=Friction(mu))
    for count in (20, 40, 80):
        stiff = replace(plain, joint=MeasuredJoint(count, length / count, 1e7), material=Material())
        rig = spatial_rig(stiff, twist_deg_per_mm=twist)
        force = np.full((10, 2), 1.0) * np.linspace(0.11, 0.6, 10)[:, None]  # low: the tube twists
        tension = solve_spatial(rig, SpatialProgram(force, (True, True))).tensions_N[-1, 0]
        r, w = 2.64, math.radians(twist)
        turning = length * r * w**2 / math.hypot(1.0, r * w) * (1 - 0.5 / count)  # the last corner is the anchor's
        off.append(math.log(tension[0] / tension[-1]) / (mu * turning) - 1)
    assert abs(off[-1]) < 1e-3
    assert abs(off[0] / off[1]) == pytest.approx(4.0, rel=0.15)


def test_a_tip_load_on_a_straight_chain_is_that_of_the_matrix_of_springs():
    """Deflection by hand: levers^2 over both bending stiffnesses, and shear, notch by notch."""
    rig = soft(RIG)
    n, pitch, force = 14, rig.pitch_mm, 1e-4
    wrist = two_planes(rig, tendons=1)
    six, (ring, _) = wrist.joints[0].stiffness, wrist.joints[0].ring
    lever = (n - 0.5 - np.arange(n)) * pitch
    odd = np.arange(n) % 2 == 1
    weak, strong = 1 / six.weak + 1 / ring, 1 / six.strong + 1 / ring
    bend, shear = np.where(odd, strong, weak), np.where(odd, 1 / six.shear_across, 1 / six.shear_in)
    loads = {
        (0.0, force, 0.0): (1, lever**2 @ bend + shear.sum()),
        (0.0, 0.0, force): (
            2,
            lever**2 @ np.where(odd, weak, strong) + np.where(odd, 1 / six.shear_in, 1 / six.shear_across).sum(),
        ),
        (force, 0.0, 0.0): (0, n / six.axial),
    }
    rest = solve_spatial(wrist, np.zeros((1, 1))).tip_mm[0]
    for load, (axis, compliance) in loads.items():
        tip = solve_spatial(replace(wrist, loads=DeadLoads(tip_N=load)), np.zeros((1, 1))).tip_mm[0]
        assert tip[axis] - rest[axis] == pytest.approx(force * compliance, rel=2e-4)


def test_a_force_across_twists_one_sided_notches_about_their_shear_centres():
    """By hand: each twists by force times arm over its torsional stiffness, and what is beyond it swings about it."""
    wrist, force, n = spatial_rig(soft(ONE_SIDED)), 1e-4, 14
    one = wrist.joints[0]
    (bends, twists), six, arm = one.ring, one.stiffness, -one.shear_centre_mm
    assert arm == pytest.approx(0.90, abs=0.01)
    rest, loaded = (
        solve_spatial(replace(wrist, loads=DeadLoads(tip_N=(0.0, 0.0, load))), np.zeros((1, 1)))
        for load in (0.0, force)
    )
    twist = force * arm * (1 / six.torsion + 1 / twists)
    assert math.radians(loaded.torsion_deg[0]) == pytest.approx(n * twist, rel=1e-6)
    lever = (n - 0.5 - np.arange(n)) * one.pitch_mm
    bend = force * (lever @ lever * (1 / six.strong + 1 / bends) + n / six.shear_across)
    swing = n * twist * (arm + one.mechanics.flexure.neutral_offset_mm)  # of the axis of the tube
    assert loaded.tip_mm[0, 2] - rest.tip_mm[0, 2] == pytest.approx(bend + swing, rel=1e-5)


def test_torsion_and_both_bendings_of_one_notch_under_a_load_aside():
    """A force across a bent chain twists its first notch: K delta phi = Jl^T B^T (arm x F), Jl by its series."""
    bent = replace(soft(RIG), precurvature_deg=25.0, joint=replace(RIG.joint, notch=replace(RIG.joint.notch, count=3)))
    wrist, force = spatial_rig(bent), np.array([0.0, 0.0, 1e-3])
    phi = np.radians([0.0, 0.0, 25.0])
    ring = [rotation(np.array([(k + 1) * phi]))[0] @ [bent.pitch_mm, 0.0, 0.0] for k in range(3)]
    moment = np.cross(ring[0] + ring[1] + 0.5 * ring[2], force)
    around, angle = np.cross(np.eye(3), phi), np.linalg.norm(phi)
    jacobian = (
        np.eye(3) + (1 - np.cos(angle)) / angle**2 * around + (angle - np.sin(angle)) / angle**3 * around @ around
    )
    six, (bends, twists) = wrist.joints[0].stiffness, wrist.joints[0].ring
    give = [1 / six.torsion + 1 / twists, 1 / six.strong + 1 / bends, 1 / six.weak + 1 / bends]
    expected = np.degrees(phi + give * (jacobian.T @ moment))
    loaded = solve_spatial(replace(wrist, loads=DeadLoads(tip_N=tuple(force))), np.zeros((1, 1)))
    np.testing.assert_allclose(loaded.notches_deg[0, 0] - np.degrees(phi), expected - np.degrees(phi), atol=1e-9)
    assert abs(loaded.notches_deg[0, 0, 0]) > 1e-6


def test_friction_opens_the_circle_of_the_tip():
    """Without friction and loop the tip is a function of the drives, whatever way; with friction it lags."""
    there = circle(1.0, 72)
    back = np.concatenate([there, there[::-1]])

    def lag(rig):
        bending = solve_spatial(rig, wheel_drives(back)).bending_deg
        return np.abs(bending[12:84] - bending[::-1][12:84]).max()

    assert lag(two_planes(replace(RIG, friction=Friction(), material=Material(60.0)))) < 1e-7
    assert lag(two_planes()) > 1.0


@pytest.mark.parametrize("tendons", [3, 5])
def test_tendons_that_pull_alike_do_not_bend(tendons):
    rig = two_planes(tendons=tendons)
    s = solve_spatial(rig, SpatialProgram(np.full((3, tendons), 25.0), (True,) * tendons))
    assert np.abs(s.bending_deg).max() < 1e-6
    assert len(rig.tendons) == tendons
    assert isinstance(rig.tendons[0], SpatialTendon)
