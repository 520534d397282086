"""Multibody model: limits with a known answer, energy balance, convergence, the paper's trend."""

from dataclasses import replace

import numpy as np
import pytest

from fem_models.analytic import theory_curve
from fem_models.analytic.kinematics import angle_for_drive_rad, tip_pose
from fem_models.chain import simulate_chain
from fem_models.joint import joint_mechanics
from fem_models.joint.flexure import flexure
from fem_models.load import LoadProgram, triangle
from fem_models.multibody.quasi_static import simulate_multibody, solve_multibody
from fem_models.multibody.stepper import MultibodySettings, Stepper
from fem_models.rig import Rig, preset
from fem_models.rig.checks import SolverError
from fem_models.rig.effects import Gravity
from fem_models.rig.joints import MeasuredJoint, Notch, NotchedTube, Tube
from fem_models.rig.rig import Friction, with_notch
from hysteresis.records.metrics import loop_width

LOSSLESS = replace(preset("du2018").material, loop_share=0.0)


def linear(rig: Rig, **changed: float) -> Rig:
    """The rig without friction, material loop and toe region."""
    tendon = replace(rig.tendon_a, toe_N=0.0, **changed)
    return replace(rig, friction=Friction(), material=LOSSLESS, tendon_a=tendon, tendon_b=tendon)


@pytest.fixture(scope="module")
def loops():
    """The default rig at both preloads of the paper."""
    return {p: solve_multibody(preset("du2018", preload_N=p), triangle(2.2, cycles=2)) for p in (10.0, 20.0)}


def test_without_friction_there_is_no_loop_and_the_angle_is_the_analytic_one():
    rig = replace(preset("du2018"), friction=Friction(), material=LOSSLESS)
    record = simulate_multibody(rig, triangle(2.2))
    width = loop_width(record.drive, record.angle_deg, record.cycle)
    assert abs(width.max_deg) < 1e-3  # Newton's tolerance; a dry loop of this rig is 2 deg wide
    theory, tension_a, tension_b = theory_curve(rig, record.drive)
    np.testing.assert_allclose(record.angle_deg, theory, atol=0.05)
    np.testing.assert_allclose(record.tension_a_N, tension_a, atol=0.5)
    np.testing.assert_allclose(record.tension_b_N, tension_b, atol=0.5)


def test_rigid_tendons_leave_only_the_path():
    # EA/L = 5,400 N/mm: the 2 N that bend the chain stretch it by 4e-4 mm. Not stiffer: both sides of the path
    # get shorter by the chords across the notches, 2e-3 mm here, which preload must take up or the tendon falls slack.
    rig = linear(preset("du2018"), EA_N=1e6)
    record = simulate_multibody(rig, triangle(1.0, step_mm=0.25))
    expected = angle_for_drive_rad(rig, record.drive)
    np.testing.assert_allclose(np.radians(record.angle_deg), expected, atol=2e-4 / rig.tendon_a.moment_arm_mm)
    arm = rig.tendon_a.moment_arm_mm
    np.testing.assert_allclose(record.drive, arm * np.radians(record.angle_deg), atol=2e-3)


def test_measured_joints_meet_the_closed_form_of_taut_linear_tendons():
    # theta = r x / (r^2 + K / (2 k)), K and k of the whole chain (derived: moment balance r (Ta - Tb) = K theta)
    known = MeasuredJoint(joints=14, pitch_mm=2.6, flexure_stiffness_Nmm_per_rad=520.0)
    base = linear(preset("du2018"), EA_N=9000.0)
    rig = replace(base, name="measured", joint=known, preload_N=30.0)
    record = simulate_multibody(rig, triangle(1.0, step_mm=0.5))
    tendon = rig.tendon_a
    k = tendon.EA_N / (tendon.free_length_mm + known.joints * known.pitch_mm)
    chain = known.flexure_stiffness_Nmm_per_rad / known.joints
    r = tendon.moment_arm_mm
    expected = np.degrees(r * record.drive / (r**2 + chain / (2 * k)))
    np.testing.assert_allclose(record.angle_deg, expected, rtol=2e-3, atol=1e-6)


@pytest.mark.parametrize("preload", [10.0, 20.0])
def test_work_of_the_wheel_over_a_closed_loop_is_what_was_dissipated(loops, preload):
    solution = loops[preload]
    last = solution.record.cycle == 2
    first, end = np.flatnonzero(last)[0] - 1, np.flatnonzero(last)[-1]
    work, friction, material = (
        e[end] - e[first] for e in (solution.wheel_work_mJ, solution.friction_loss_mJ, solution.material_loss_mJ)
    )
    assert work > 5
    assert friction + material == pytest.approx(work, rel=0.002)


def test_the_energy_gap_closes_with_the_step():
    # losses by the mean of old and new limit, wheel's work by the trapezium: the remainder are kinks within a step
    rig = preset("du2018")
    gaps = []
    for step in (0.2, 0.1, 0.05):
        s = solve_multibody(rig, triangle(2.2, step_mm=step), MultibodySettings(max_step_mm=step))
        start = np.flatnonzero(s.record.cycle == 1)[0] - 1
        work = s.wheel_work_mJ[-1] - s.wheel_work_mJ[start]
        loss = (s.friction_loss_mJ + s.material_loss_mJ)[-1] - (s.friction_loss_mJ + s.material_loss_mJ)[start]
        gaps.append(abs(loss - work) / work)
    assert gaps[0] > gaps[1] > gaps[2]
    assert gaps[2] < 1e-3


def test_sliding_guides_obey_the_capstan_equation():
    # The wrap is derived here anew: a tendon is straight in ring i and along the chord of a notch (half of its angle).
    # It wraps the ring by half of either neighbour's angle, the base by the rest wrap of 20 deg and half an angle.
    rig = replace(linear(preset("du2018")), friction=Friction(capstan_coefficient=0.2, rest_wrap_deg=20.0))
    solution = solve_multibody(rig, LoadProgram(np.linspace(0, 2.2, 23)))
    heading = np.concatenate([[0.0], np.cumsum(np.radians(solution.record.notches_deg[-1]))])
    chord = 0.5 * (heading[1:] + heading[:-1])
    ring = heading[:-1]
    wrap = np.abs(chord - ring)  # into the notch beyond the ring
    wrap[1:] += np.abs(ring[1:] - chord[:-1])  # out of the notch before it
    wrap[0] += np.radians(20.0)
    pulled, released = solution.segment_tensions_N[-1]
    np.testing.assert_allclose(pulled[:-1] / pulled[1:], np.exp(0.2 * wrap), rtol=1e-5)
    np.testing.assert_allclose(released[1:] / released[:-1], np.exp(0.2 * wrap), rtol=1e-5)


def test_tensions_of_the_record_are_those_at_the_wheel():
    # wound in past a sheath of constant friction, the tendon is tighter before it by just that friction
    rig = replace(linear(preset("du2018")), friction=Friction(sheath_N=1.5))
    solution = solve_multibody(rig, LoadProgram(np.linspace(0, 1.5, 16)))
    assert solution.record.tension_a_N[-1] - solution.segment_tensions_N[-1, 0, 1] == pytest.approx(1.5, rel=1e-4)
    assert solution.segment_tensions_N[-1, 1, 1] - solution.record.tension_b_N[-1] == pytest.approx(1.5, rel=1e-4)


def test_whole_numbers_are_numbers():
    rig = preset("du2018")
    records = [
        simulate_multibody(replace(rig, friction=Friction(0, 0, s)), triangle(2.2, step_mm=0.2)) for s in (2, 2.0)
    ]
    np.testing.assert_array_equal(records[0].angle_deg, records[1].angle_deg)
    assert loop_width(records[0].drive, records[0].angle_deg, records[0].cycle).max_deg > 1


@pytest.mark.parametrize(("slope", "limit"), [(-0.6, -0.5), (0.8, -0.4), (-0.7, 1.5), (0.9, 2.0)])
def test_flexures_that_soften_or_harden_bend_as_in_the_chain(slope, limit):
    base = linear(preset("du2018"), EA_N=9000.0)
    joint = MeasuredJoint(
        joints=6,
        pitch_mm=2.6,
        flexure_stiffness_Nmm_per_rad=520.0,
        hardening_slope=slope,
        hardening_limit=limit,
        hardening_angle_deg=2.0,
    )
    rig = replace(base, name="measured", joint=joint)
    program = triangle(1.0, step_mm=0.25)
    record, linear_one = simulate_multibody(rig, program), replace(joint, hardening_slope=0.0, hardening_limit=0.0)
    np.testing.assert_allclose(record.angle_deg, simulate_chain(rig, program).angle_deg, atol=5e-3)
    straight = simulate_multibody(replace(rig, joint=linear_one), program)
    assert np.abs(record.angle_deg - straight.angle_deg).max() > 0.1


def test_a_one_sided_wrist_rotates_about_its_neutral_axis():
    # Tendon a runs on the notched side, its arm is that from the tube axis plus the neutral offset; tendon b falls
    # slack. Then dx/dtheta = arm + K/(N arm k), K of a joint and k of the tendon (moment balance T arm = K theta/N).
    base = linear(preset("du2018", preload_N=0.5), EA_N=5e4, moment_arm_mm=1.2)
    rig = replace(base, joint=NotchedTube(Tube(3.0, 2.4), Notch("rectangular", 6, 2.0, 0.8, 1.2)))
    joint, tendon = flexure(rig), rig.tendon_a
    arm = 1.2 + joint.neutral_offset_mm
    assert arm == pytest.approx(joint_mechanics(rig).arms_mm.a)
    k = tendon.EA_N / (tendon.free_length_mm + 6 * rig.pitch_mm)
    expected = arm + joint.bending_Nmm_per_rad / (6 * arm * k)
    record = simulate_multibody(rig, LoadProgram(np.linspace(0, 0.4, 5)))
    slope = np.diff(record.drive[1:]) / np.diff(np.radians(record.angle_deg[1:]))
    np.testing.assert_allclose(slope, expected, rtol=0.01)


def test_the_loop_does_not_depend_on_the_internal_step():
    rig = preset("du2018")
    loops = [
        simulate_multibody(rig, triangle(2.0, step_mm=0.5)),
        solve_multibody(rig, triangle(2.0, step_mm=0.5), MultibodySettings(max_step_mm=0.02)).record,
    ]
    np.testing.assert_allclose(loops[0].angle_deg, loops[1].angle_deg, atol=3e-3)


def test_mirror_symmetry(loops):
    record = loops[20.0].record
    angle = record.angle_deg[22:]  # from +2.2 mm: the second half of a cycle mirrors the first
    np.testing.assert_allclose(angle[:44], -angle[44:88], atol=2e-3)


def test_preload_narrows_the_loop_and_it_is_widest_near_zero_drive(loops):
    widths = {p: loop_width(s.record.drive, s.record.angle_deg, s.record.cycle) for p, s in loops.items()}
    assert widths[10.0].max_deg > widths[20.0].max_deg > 0
    assert all(abs(w.at_drive) <= 0.5 for w in widths.values())
    assert all(w.at_zero_deg > 0.99 * w.max_deg for w in widths.values())
    # the paper's maxima, section 3.1, read as half widths; tolerances of the default calibration
    assert widths[10.0].max_deg == pytest.approx(7.04, abs=0.2)
    assert widths[20.0].max_deg == pytest.approx(4.42, abs=0.15)
    assert np.abs(loops[20.0].record.angle_deg).max() == pytest.approx(45, abs=1)


def test_the_toe_region_makes_the_trend_and_the_constant_friction_the_loop():
    # documented in docs/theory/multibody.md: without the toe region preload does not narrow the loop
    rig = preset("du2018")
    tendon = replace(rig.tendon_a, toe_N=0.0)
    linear_tendon = replace(rig, tendon_a=tendon, tendon_b=tendon)

    def width(rig: Rig, preload: float) -> float:
        record = simulate_multibody(replace(rig, preload_N=preload), triangle(2.2, step_mm=0.2))
        return loop_width(record.drive, record.angle_deg, record.cycle).max_deg

    assert width(linear_tendon, 10.0) <= 1.02 * width(linear_tendon, 20.0)
    dry = replace(rig, material=LOSSLESS)
    assert width(dry, 20.0) > 0.6 * width(rig, 20.0)
    record = simulate_multibody(dry, triangle(2.2, step_mm=0.2))  # the material loop puts the widest place at zero
    assert abs(loop_width(record.drive, record.angle_deg, record.cycle).at_drive) > 1.0


def test_tip_follows_from_the_joint_angles(loops):
    record = loops[20.0].record
    x, y, angle = tip_pose(preset("du2018"), np.radians(record.notches_deg))
    np.testing.assert_allclose(np.degrees(angle), record.angle_deg, atol=1e-9)
    # the D-H chain has no axial or shear compliance: 0.1 mm of 36
    np.testing.assert_allclose(np.column_stack([x, y]), record.tip_mm, atol=0.1)


def test_unequal_tendons_break_the_symmetry():
    rig = preset("du2018")
    rig = replace(rig, tendon_b=replace(rig.tendon_b, moment_arm_mm=0.95 * rig.tendon_b.moment_arm_mm))
    record = simulate_multibody(rig, triangle(2.2))
    ends = record.angle_deg[22], record.angle_deg[66]
    assert abs(ends[0] + ends[1]) > 0.1  # 50 times what the symmetric rig leaves, see above


def test_a_step_that_cannot_converge_raises_with_sample_and_drive(monkeypatch):
    monkeypatch.setattr(Stepper, "_carefully", lambda *args, **options: None)
    settings = MultibodySettings(newton_iterations=1, max_halvings=0)
    with pytest.raises(SolverError, match=r"rig du2018, sample \d+ of 111: no equilibrium between drives .* mm"):
        solve_multibody(preset("du2018"), triangle(2.2), settings)


def test_one_ring_sags_by_bending_and_shear():
    # By hand: a weight half a pitch from the flexure's middle rotates it by P (p/2)/c and shifts it by P/k_s; the
    # bending of the ring is 5e-4 of it. The tendons have next to no stiffness.
    one = with_notch(preset("du2018", preload_N=1e-2), replace(preset("du2018").joint.notch, count=1))
    rig = replace(linear(one, EA_N=1.0), gravity=Gravity(ring_mass_g=500.0, direction_deg=-90.0))
    record = solve_multibody(rig, LoadProgram(np.array([0.0, 1e-6]))).record
    assert record.tip_mm is not None
    joint, weight, lever = flexure(rig), 0.5 * 9.80665, 0.5 * rig.pitch_mm
    bending, shear = weight * lever**2 / joint.bending_Nmm_per_rad, weight / joint.shear_N_per_mm
    assert shear > 0.05 * bending
    assert record.tip_mm[0, 1] == pytest.approx(-(bending + shear), rel=2e-3)
