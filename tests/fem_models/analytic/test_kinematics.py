"""Kinematics and theoretical curve, against closed forms and explicit geometry."""

from dataclasses import replace
from itertools import pairwise

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from fem_models.analytic import simulate_analytic, theory_curve
from fem_models.analytic.kinematics import (
    angle_for_drive_rad,
    chain_transforms,
    drive_for_angle_mm,
    equal_joints,
    inverse_tip,
    path_shortening_mm,
    tip_pose,
)
from fem_models.chain.solve import solve_chain
from fem_models.joint import joint_mechanics
from fem_models.joint.flexure import flexure
from fem_models.load import LoadProgram, sine, triangle
from fem_models.rig import Rig, RigError, preset
from fem_models.rig.effects import Gravity
from fem_models.rig.joints import MeasuredJoint, Notch, NotchedTube, Tube
from fem_models.rig.rig import Friction, Material, Tendon, Wheel

TENDON = Tendon(EA_N=9000.0, moment_arm_mm=2.62, free_length_mm=150.0)
V = Rig(
    name="test",
    material=Material(youngs_modulus_GPa=60.0, poissons_ratio=0.33),
    tendon_a=TENDON,
    tendon_b=TENDON,
    wheel=Wheel(10.0),
    preload_N=20.0,
    joint=NotchedTube(
        Tube(6.0, 5.4), Notch("v_pair", count=14, depth_mm=2.72, width_mm=1.2, spacing_mm=1.4, root_width_mm=0.6)
    ),
)
MEASURED = replace(V, joint=MeasuredJoint(joints=14, pitch_mm=2.6, flexure_stiffness_Nmm_per_rad=520.0))
THIN = replace(TENDON, moment_arm_mm=0.6)
WRIST = replace(  # the '150' wrist of the measured records
    V, joint=NotchedTube(Tube(1.62, 1.40), Notch("rectangular", 5, 1.40, 0.8, 1.2)), tendon_a=THIN, tendon_b=THIN
)
LENGTH = 14 * 2.6
PAPER_DRIVE = np.linspace(-2.2, 2.2, 45)


def with_tendons(rig: Rig, **fields: float) -> Rig:
    return replace(rig, tendon_a=replace(rig.tendon_a, **fields), tendon_b=replace(rig.tendon_b, **fields))


def test_tip_of_the_straight_tube():
    tip = tip_pose(V, np.zeros(14))
    assert (tip.x_mm, tip.y_mm, tip.angle_rad) == (pytest.approx(LENGTH), 0.0, 0.0)


@given(st.floats(-0.3, 0.3).filter(lambda t: abs(t) > 1e-3))
def test_equal_angles_give_the_polygon_of_a_geometric_series(t):
    # links at headings t, 2 t, ..., N t: H (q + ... + q^(N-1)) + H/2 (1 + q^N), q = exp(i t)
    q = np.exp(1j * t)
    expected = 2.6 * (q - q**14) / (1 - q) + 1.3 * (1 + q**14)
    tip = tip_pose(V, equal_joints(V, 14 * t))
    assert complex(tip.x_mm, tip.y_mm) == pytest.approx(expected, abs=1e-9)
    assert tip.angle_rad == pytest.approx(14 * t)


def test_many_short_links_approach_the_arc():
    # constant curvature: tip at L (sin T / T, (1 - cos T) / T); the polygon is of second order in the pitch
    theta = 1.0
    gaps = []
    for n in (8, 16, 32):
        rig = replace(MEASURED, joint=MeasuredJoint(n, LENGTH / n, 520.0))
        x, y, _ = tip_pose(rig, equal_joints(rig, theta))
        gaps.append(abs(complex(x, y) - LENGTH * complex(np.sin(theta), 1 - np.cos(theta)) / theta))
    np.testing.assert_allclose(np.log2(np.divide(gaps[:-1], gaps[1:])), 2, atol=0.05)


def test_transforms_agree_with_the_tip_and_are_rigid():
    angles = np.random.default_rng(1).uniform(-0.2, 0.2, (3, 5, 14))
    frames = chain_transforms(V, angles)
    assert frames.shape == (3, 5, 16, 4, 4)
    tip = tip_pose(V, angles)
    np.testing.assert_allclose(frames[..., -1, 0, 3], tip.x_mm, atol=1e-12)
    np.testing.assert_allclose(frames[..., -1, 1, 3], tip.y_mm, atol=1e-12)
    np.testing.assert_allclose(np.arctan2(frames[..., -1, 1, 0], frames[..., -1, 0, 0]), tip.angle_rad, atol=1e-12)
    turn = frames[..., :3, :3]
    np.testing.assert_allclose(turn @ np.swapaxes(turn, -1, -2), np.broadcast_to(np.eye(3), turn.shape), atol=1e-12)
    # origins: joint i + 1 for frame i, the last joint again for frame N, the tip
    steps = np.linalg.norm(np.diff(frames[..., :3, 3], axis=-2), axis=-1)
    np.testing.assert_allclose(steps, np.broadcast_to([2.6] * 13 + [0.0, 1.3], steps.shape), atol=1e-12)


def test_a_wrong_number_of_joints_is_refused():
    for call in (tip_pose, chain_transforms):
        with pytest.raises(ValueError, match=r"joint_angles_rad: shape \(13,\): expected \(..., 14\)"):
            call(V, np.zeros(13))


def test_inverse_fit_returns_the_angle_within_a_hundredth_of_a_degree():
    fit = inverse_tip(V, limit_deg=60)
    theta = np.radians(np.linspace(-60, 60, 777))
    back = fit(tip_pose(V, equal_joints(V, theta)).y_mm)
    worst = np.degrees(np.abs(back - theta).max())
    assert worst <= 0.01
    assert worst < 1e-4  # docs/theory/analytic-model.md
    assert worst <= fit.max_residual_deg * (1 + 1e-6)
    assert fit.max_residual_deg == pytest.approx(worst, rel=0.05)


def test_inverse_fit_improves_with_the_degree():
    residuals = [inverse_tip(V, degree=d).max_residual_deg for d in (3, 5, 7, 9, 11)]
    assert all(b < 0.2 * a for a, b in pairwise(residuals))  # geometric: y(theta) is analytic


def test_inverse_fit_refuses_values_outside_its_range():
    fit = inverse_tip(V, limit_deg=60)
    with pytest.raises(ValueError, match=r"y_mm = 30: expected within \+-17"):
        fit([0.0, 30.0])
    with pytest.raises(ValueError, match="y_mm = nan"):
        fit(np.nan)
    with pytest.raises(ValueError, match="limit_deg = 150: expected a range in which"):
        inverse_tip(V, limit_deg=150)
    with pytest.raises(ValueError, match="degree = 4: expected an odd number"):
        inverse_tip(V, degree=4)


@pytest.mark.parametrize("rig", [V, WRIST])
@given(share=st.floats(-0.99, 0.99))
def test_path_is_that_of_explicit_ring_edges(rig, share):
    theta = share * rig.joints * joint_mechanics(rig).closure_angle_rad
    gap, spacing = rig.joint.notch.width_mm / 2, rig.joint.notch.spacing_mm
    frames = chain_transforms(rig, equal_joints(rig, theta))
    # ring i reaches from its joint's edge (gap, r) to the next joint's (gap + spacing, r), in the frame of its joint
    base = np.eye(4)
    base[0, 3] = frames[0, 0, 3]
    origin = [base] + [f.copy() for f in frames[1:-1]]
    for i, frame in enumerate(origin[1:], start=1):
        frame[:3, 3] = frames[i - 1][:3, 3]  # turned with ring i, standing on joint i
    for arm, sign, angle in ((joint_mechanics(rig).arms_mm.a, 1, theta), (joint_mechanics(rig).arms_mm.b, -1, -theta)):
        length = 0.0
        for i in range(rig.joints):
            leave = -gap if i == 0 else gap + spacing
            start = origin[i] @ [leave, sign * arm, 0, 1]
            end = origin[i + 1] @ [gap, sign * arm, 0, 1]
            length += np.linalg.norm(end - start)
        straight = rig.joints * rig.joint.notch.width_mm
        assert path_shortening_mm(rig, angle, arm) == pytest.approx(straight - length, abs=1e-9)


def test_path_beyond_closure_is_refused():
    with pytest.raises(ValueError, match=r"theta = 400 deg: expected within \+-318\.\d+ deg, where the notches"):
        path_shortening_mm(V, np.radians(400.0), 2.62)


def test_path_is_r_theta_to_first_order():
    theta = np.array([0.1, 0.05, 0.025])
    assert path_shortening_mm(MEASURED, 0.3, 2.62) == pytest.approx(2.62 * 0.3, rel=1e-15)
    rest = path_shortening_mm(V, theta, 2.62) - 2.62 * theta
    np.testing.assert_allclose(np.log2(rest[:-1] / rest[1:]), 2, atol=0.01)  # N g t^2 / 4


def test_with_rigid_tendons_the_drive_is_the_path():
    theta = np.linspace(-0.8, 0.8, 9)
    bench = with_tendons(MEASURED, EA_N=1e12)
    np.testing.assert_allclose(drive_for_angle_mm(bench, theta), 2.62 * theta, atol=1e-9)
    np.testing.assert_allclose(angle_for_drive_rad(bench, 2.62 * theta), theta, atol=1e-9)
    # Across real notches both paths get shorter by 2 N g (1 - cos(t/2)), so the released tendon falls slack and the
    # drive is the exact path of the pulled one: 2 N r sin(t/2) and that even part, which changes sign with the side.
    tube = with_tendons(V, EA_N=1e12)
    odd, even = 2 * 14 * 2.62 * np.sin(theta / 28), 2 * 14 * 0.6 * (1 - np.cos(theta / 28))
    expected = odd + np.sign(theta) * even
    np.testing.assert_allclose(drive_for_angle_mm(tube, theta), expected, atol=1e-7)  # K theta/r over 1e12 N/186 mm
    curve = theory_curve(tube, expected)
    np.testing.assert_allclose(np.radians(curve.angle_deg), theta, atol=1e-7)
    assert (np.minimum(curve.tension_a_N, curve.tension_b_N)[theta != 0] == 0).all()


def test_with_flexures_without_stiffness_the_drive_is_the_path():
    soft = replace(MEASURED, joint=MeasuredJoint(14, 2.6, 1e-9))
    theta = np.linspace(-0.8, 0.8, 9)
    np.testing.assert_allclose(drive_for_angle_mm(soft, theta), 2.62 * theta, atol=1e-9)


def test_taut_linear_tendons_meet_the_closed_form():
    # derived: r (T_a - T_b) = K theta and T_a - T_b = 2 k (x - r theta), K and k of the whole chain
    k, chain, r = 9000 / (150 + LENGTH), 520 / 14, 2.62
    drive = np.linspace(-1, 1, 11)
    curve = theory_curve(MEASURED, drive)
    expected = r * drive / (r**2 + chain / (2 * k))
    np.testing.assert_allclose(np.radians(curve.angle_deg), expected, atol=1e-14)
    np.testing.assert_allclose(curve.tension_a_N, 20 + k * (drive - r * expected), atol=1e-11)
    np.testing.assert_allclose(curve.tension_a_N + curve.tension_b_N, 40, atol=1e-11)
    np.testing.assert_allclose(drive_for_angle_mm(MEASURED, expected), drive, atol=1e-12)


def test_slack_tendon_meets_the_closed_form():
    # derived: T_b = 0 and r (T0 + k (x - r theta)) = K theta
    rig = replace(MEASURED, preload_N=2.0)
    k, chain, r = 9000 / (150 + LENGTH), 520 / 14, 2.62
    drive = np.array([1.0, 1.5, 2.2])
    curve = theory_curve(rig, drive)
    expected = r * (2.0 + k * drive) / (chain + k * r**2)
    np.testing.assert_allclose(np.radians(curve.angle_deg), expected, atol=1e-14)
    assert (curve.tension_b_N == 0).all()
    np.testing.assert_allclose(drive_for_angle_mm(rig, expected), drive, atol=1e-12)


@pytest.mark.parametrize("toe", [0.0, 30.0])
@pytest.mark.parametrize("rig", [V, MEASURED])
def test_work_of_the_wheel_is_stored_as_elastic_energy(rig, toe):
    # independent of the moment balance: the work of (T_a - T_b) dx is the change of flexure and tendon energies; with
    # a T + b ln T the elongation of a tendon (docs), its energy is a T^2/2 + b T. Trapezium rule: second order.
    rig = replace(with_tendons(rig, toe_N=toe), preload_N=5.0)
    a, b = (150 + LENGTH) / 9000, 150 * toe / 9000
    gaps = []
    for n in (50, 100, 200):
        drive = np.linspace(0, 2.2, n + 1)
        theta = angle_for_drive_rad(rig, drive)
        _, pull_a, pull_b = theory_curve(rig, drive)
        work = np.trapezoid(pull_a - pull_b, drive)
        tendons = sum(a * (t[-1] ** 2 - 25) / 2 + b * (t[-1] - 5) for t in (pull_a, pull_b))
        stored = flexure(rig).bending_Nmm_per_rad / 14 * theta[-1] ** 2 / 2 + tendons
        gaps.append(abs(work - stored) / stored)
    assert gaps[-1] < 1e-4
    assert gaps[2] < 0.3 * gaps[1] < 0.1 * gaps[0] or max(gaps) < 2e-5


tendons = st.builds(
    Tendon,
    EA_N=st.floats(1e3, 1e5),
    moment_arm_mm=st.floats(1.5, 2.7),
    free_length_mm=st.floats(20, 500),
    toe_N=st.one_of(st.just(0.0), st.floats(0.1, 100)),
)


@settings(max_examples=40)
@given(tendons, tendons, st.floats(1, 40), st.sampled_from([V, MEASURED]))
def test_angle_grows_with_the_drive_and_is_inverted_by_it(a, b, preload, rig):
    rig = replace(rig, tendon_a=a, tendon_b=b, preload_N=preload)
    drive = np.linspace(-2.5, 2.5, 26)
    theta = angle_for_drive_rad(rig, drive)
    assert (np.diff(theta) > 0).all()
    np.testing.assert_allclose(drive_for_angle_mm(rig, theta), drive, atol=1e-9)


@settings(max_examples=20)
@given(tendons, st.floats(1, 40))
def test_equal_tendons_bend_alike_in_both_directions(tendon, preload):
    curve = theory_curve(replace(V, tendon_a=tendon, tendon_b=tendon, preload_N=preload), PAPER_DRIVE)
    np.testing.assert_allclose(curve.angle_deg, -curve.angle_deg[::-1], atol=1e-9)
    np.testing.assert_allclose(curve.tension_a_N, curve.tension_b_N[::-1], atol=1e-8)
    assert curve.angle_deg[22] == pytest.approx(0, abs=1e-9)


def test_preload_softens_the_bending_of_a_tube():
    # the tendons' chords push the rings apart in rotation: -(T_a + T_b) g/2 joins the stiffness of a joint; with
    # equal linear tendons dtheta/dx at rest is r / (r^2 + (K - T0 g / N) / (2 k))
    for preload in (10.0, 40.0):
        rig = replace(V, preload_N=preload)
        k, chain = 9000 / (150 + LENGTH), (flexure(rig).bending_Nmm_per_rad - preload * 0.6) / 14
        slope = (angle_for_drive_rad(rig, 1e-3) - angle_for_drive_rad(rig, -1e-3)) / 2e-3
        assert slope == pytest.approx(2.62 / (2.62**2 + chain / (2 * k)), rel=1e-6)


def test_unequal_arms_bend_the_rig_at_zero_drive():
    rig = replace(MEASURED, tendon_b=replace(TENDON, moment_arm_mm=2.5))
    k, chain = 9000 / (150 + LENGTH), 520 / 14
    # derived: T0 (r_a - r_b) = (K + k (r_a^2 + r_b^2)) theta
    assert angle_for_drive_rad(rig, 0.0) == pytest.approx(20 * 0.12 / (chain + k * (2.62**2 + 2.5**2)), rel=1e-9)


def test_results_have_the_shape_of_the_argument():
    drive = np.linspace(-1, 1, 6).reshape(2, 3)
    assert angle_for_drive_rad(V, drive).shape == (2, 3)
    assert drive_for_angle_mm(V, np.zeros((2, 3))).shape == (2, 3)
    assert angle_for_drive_rad(V, 0.5).shape == ()


@pytest.mark.parametrize("drive", [100.0, -100.0, np.nan])
def test_a_drive_that_closes_the_notches_is_refused(drive):
    with pytest.raises(ValueError, match=f"drive_mm = {drive:g}: expected a drive that bends rig test within"):
        angle_for_drive_rad(V, [0.0, drive])


def test_an_angle_that_closes_the_notches_is_refused():
    with pytest.raises(ValueError, match="theta = 400 deg: expected within"):
        drive_for_angle_mm(V, np.radians(400.0))


def test_a_tendon_without_an_arm_has_no_drive_for_every_angle():
    with pytest.raises(RigError, match=r"moment arms about the neutral axis 1.30166 and -0.101661 mm: expected both"):
        drive_for_angle_mm(WRIST, 0.1)


def test_record_of_the_analytic_engine():
    program = triangle(2.2)
    record = simulate_analytic(V, program)
    curve = theory_curve(V, program.drive_mm)
    np.testing.assert_array_equal(record.angle_deg, curve.angle_deg)
    np.testing.assert_array_equal(record.cycle, program.cycle)
    assert record.time_s is None
    assert (record.kind, record.drive_unit, record.rig) == ("simulated", "mm", {"preload_N": 20.0})
    assert "analytic" in record.title
    assert record.notches_deg.shape == (program.drive_mm.size, 14)
    np.testing.assert_allclose(record.notches_deg.sum(axis=1), record.angle_deg, atol=1e-12)
    tip = tip_pose(V, np.radians(record.notches_deg))
    np.testing.assert_allclose(record.tip_mm, np.column_stack([tip.x_mm, tip.y_mm]), atol=1e-12)


def test_record_has_no_hysteresis_and_no_rate():
    slow, fast = (simulate_analytic(V, sine(2.0, rate, cycles=2)) for rate in (0.1, 10.0))
    np.testing.assert_array_equal(slow.angle_deg, fast.angle_deg)
    order = np.argsort(slow.drive, kind="stable")
    assert (np.diff(slow.angle_deg[order]) >= -1e-9).all()  # one angle a drive


def test_record_names_its_preset():
    program = LoadProgram(np.array([0.0, 0.5]))
    rig = preset("du2018", preload_N=10.0)
    assert simulate_analytic(rig, program).rig == {"preset": "du2018", "preload_N": 10.0}


def test_effects_that_the_analytic_model_lacks_are_refused():
    rig = replace(V, gravity=Gravity(ring_mass_g=1.0))
    with pytest.raises(RigError, match=r"\[gravity\]: not part of the analytic model"):
        simulate_analytic(rig, triangle(1.0))


def test_theory_of_a_single_tendon_starts_at_rest_and_agrees_with_the_chain():
    rig = replace(preset("notched-wrist-150"), superelastic=None, friction=Friction(), closure=None)
    drive = np.linspace(0.0, 1.0, 6)
    theory, engine = simulate_analytic(rig, LoadProgram(drive)), solve_chain(rig, LoadProgram(drive)).record
    assert theory.angle_deg[0] == pytest.approx(rig.joints * rig.precurvature_deg)
    np.testing.assert_allclose(theory.angle_deg, engine.angle_deg, rtol=0.02)
    assert theory.tension_b_N is None
