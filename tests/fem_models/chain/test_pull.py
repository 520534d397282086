"""One tendon, load control, precurvature, strain limits: both engines, and formulas where there are some."""

from __future__ import annotations

import math
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from fem_models.analytic.kinematics import simulate_analytic
from fem_models.chain.solve import ChainSettings, solve_chain, solve_pulled_chain
from fem_models.joint import joint_mechanics
from fem_models.joint.flexure import flexure
from fem_models.joint.section import section, section_fibres
from fem_models.joint.strain import FATIGUE, StrainLimit, limits_passed, peak_strain, strain_limits
from fem_models.load.program import LoadProgram
from fem_models.load_control import run_load_control
from fem_models.multibody.dynamic import solve_dynamic
from fem_models.multibody.quasi_static import solve_multibody, solve_pulled_multibody
from fem_models.rig.checks import RigError, SolverError
from fem_models.rig.effects import Closure, Creep, Drag, Superelastic
from fem_models.rig.presets import preset
from fem_models.rig.rig import Friction
from fem_models.rig.rig_file import read_rig
from fem_models.view.manipulator import tendon_lines
from hysteresis.record_file import read_record, write_record
from studies.commands.first_report import strain_summary

WRIST = preset("notched-wrist-150")
NEVER = Closure(1000.0, angle_deg=1e3)
LINEAR = replace(WRIST, superelastic=None, friction=Friction(), closure=NEVER)
STAGES = {
    "linear": LINEAR,
    "friction": replace(LINEAR, friction=WRIST.friction),
    "superelastic": replace(WRIST, friction=Friction(), closure=NEVER),
    "closure": replace(LINEAR, closure=WRIST.closure),
    "all": WRIST,
    "all of the 90 deg tube": preset("notched-wrist-90"),
}
UP_AND_BACK = np.concatenate([[0.0], np.linspace(0.1, 1.9, 10), np.linspace(1.7, 0.0, 8)])


@pytest.mark.parametrize("name", STAGES)
def test_both_engines_agree_notch_by_notch_on_the_way_up_and_back(name):
    # without closure the softened notches fold up near 1.6 N: the measured wrists' loads there end at 1.2 N
    force = UP_AND_BACK * (0.6 if name == "superelastic" else 1.0)
    chain, multibody = run_load_control(STAGES[name], force), run_load_control(STAGES[name], force, "multibody")
    # what is left is the ring's compliance, in series with every joint in one engine only: docs/validation/wrists.md
    assert np.abs(chain.notches_deg - multibody.notches_deg).max() <= 0.1
    assert np.abs(chain.angle_deg - multibody.angle_deg).max() <= 0.0025 * np.abs(chain.angle_deg).max()
    assert np.abs(chain.tip_mm - multibody.tip_mm).max() <= 0.03
    np.testing.assert_allclose(chain.peak_strain, multibody.peak_strain, atol=4e-4)  # 0.06 deg


def test_a_small_force_bends_each_joint_by_force_times_arm_over_stiffness():
    force, rest = 0.01, np.radians(LINEAR.precurvature_deg)
    arm, k = joint_mechanics(LINEAR).arms_mm.a, flexure(LINEAR).bending_Nmm_per_rad
    for engine in ("chain", "multibody"):
        turned = np.radians(run_load_control(LINEAR, [0.0, force], engine).notches_deg[-1]) - rest
        # first order in the angle, but for the arm's cos and the ring in series: 2 %
        np.testing.assert_allclose(turned, force * arm / k, rtol=0.02)


def test_without_load_the_rig_stands_at_its_precurvature():
    for engine in ("chain", "multibody"):
        still = run_load_control(WRIST, [0.0], engine)
        np.testing.assert_allclose(still.notches_deg, WRIST.precurvature_deg, atol=1e-6)
        np.testing.assert_allclose(still.peak_strain, 0.0, atol=1e-8)


def test_tension_falls_along_the_notches_as_the_capstan_equation_says():
    rig = STAGES["friction"]
    solution = solve_pulled_chain(rig, np.array([0.0, 0.8]))
    turn = np.abs(np.radians(solution.record.notches_deg[-1]))
    wrap = 0.5 * (turn + np.concatenate([[0.0], turn[:-1]]))
    expected = 0.8 * np.exp(-rig.friction.capstan_coefficient * np.cumsum(wrap))
    np.testing.assert_allclose(solution.segment_tensions_N[-1, 0, 1:], expected, rtol=1e-7)
    np.testing.assert_array_equal(solution.segment_tensions_N[:, 1], 0.0)


@pytest.mark.parametrize("name", ["linear", "friction", "all"])
def test_winding_by_a_drive_gives_the_same_angles_at_the_same_tensions(name):
    rig = STAGES[name]
    drive = np.concatenate([np.linspace(0.0, 2.5, 26), np.linspace(2.4, 0.2, 23)])
    for solve in (solve_chain, solve_multibody):
        wound = solve(rig, LoadProgram(drive)).record
        pulled = run_load_control(
            rig, np.maximum(wound.tension_a_N, 0.0), "chain" if solve is solve_chain else "multibody"
        )
        # the chain to rounding; the multibody model's friction ends at a tolerance
        atol = 1e-6 if solve is solve_chain else 0.01
        np.testing.assert_allclose(pulled.angle_deg, wound.angle_deg, atol=atol)
        assert wound.tension_b_N is None


def test_a_smaller_step_of_the_force_changes_nothing_to_speak_of():
    coarse = solve_pulled_chain(WRIST, UP_AND_BACK).record.angle_deg
    fine = solve_pulled_chain(WRIST, UP_AND_BACK, ChainSettings(max_pull=0.02)).record.angle_deg
    assert np.abs(coarse - fine).max() < 0.02


def test_unloading_stays_above_loading_and_comes_home():
    run = run_load_control(WRIST, UP_AND_BACK)
    up = np.interp([0.7, 1.1, 1.5], run.force_N[:11], run.angle_deg[:11])
    back = np.interp([0.7, 1.1, 1.5], run.force_N[:9:-1], run.angle_deg[:9:-1])
    assert (back > up + 2).all()
    assert run.angle_deg[-1] == pytest.approx(run.angle_deg[0], abs=1e-3)


LOOP = np.concatenate([np.linspace(0.0, 1.9, 60), np.linspace(1.9, 0.0, 60)])


@pytest.mark.parametrize("solve", [solve_pulled_chain, solve_pulled_multibody])
def test_the_wheels_work_on_a_closed_loop_is_what_friction_and_material_take(solve):
    solution = solve(WRIST, LOOP)
    lost = solution.friction_loss_mJ[-1] + solution.material_loss_mJ[-1]
    assert lost > 0.1
    assert solution.wheel_work_mJ[-1] == pytest.approx(lost, rel=0.02)


def test_the_gap_of_the_energies_closes_at_first_order_in_the_step_of_the_force():
    gaps = []
    for step in (0.04, 0.02, 0.01):
        s = solve_pulled_chain(WRIST, LOOP, ChainSettings(max_pull=step))
        gaps.append(s.friction_loss_mJ[-1] + s.material_loss_mJ[-1] - s.wheel_work_mJ[-1])
    orders = np.log2(np.abs(np.array(gaps[:-1]) / np.array(gaps[1:])))
    assert (orders > 0.8).all()


@settings(max_examples=25)
@given(
    force=st.floats(0.05, 2.0),
    mu=st.floats(0.0, 0.4),
    plateau=st.floats(150.0, 500.0),
    rest=st.floats(-3.0, 3.0),
)
def test_more_force_bends_more_and_friction_lets_no_notch_bend_more_than_the_one_before(force, mu, plateau, rest):
    law = replace(WRIST.superelastic, plateau_MPa=plateau, unloading_plateau_MPa=0.4 * plateau)
    rig = replace(WRIST, superelastic=law, friction=Friction(capstan_coefficient=mu), precurvature_deg=rest)
    run = run_load_control(rig, [0.5 * force, force])
    assert (np.diff(run.angle_deg) > 0).all()
    assert (np.diff(run.notches_deg, axis=1) <= 1e-6).all()


def test_a_slot_closes_where_the_chord_of_its_arc_has_turned_its_edges_together():
    rig = WRIST
    turn = joint_mechanics(rig).closure_angle_rad
    lever = rig.joint.tube.outer_diameter_mm / 2 + float(section(rig.joint, 0.0).neutral_offset_mm)
    chord = 2 * rig.joint.notch.width_mm / turn * math.sin(turn / 2)
    assert chord == pytest.approx(2 * lever * math.sin(turn / 2))
    # measured: 30.7 and 19.1 deg, both tubes with the same lever
    assert math.degrees(turn) == pytest.approx(30.7, abs=0.5)
    assert math.degrees(joint_mechanics(preset("notched-wrist-90")).closure_angle_rad) == pytest.approx(19.1, abs=0.3)


def test_fibres_of_a_one_sided_notch_have_the_moments_of_the_tube_cut_by_a_plane():
    distance, area = section_fibres(WRIST.joint, 8)
    outer, inner, cut = 0.81, 0.70, 1.40 - 0.81
    x, y = np.meshgrid(np.linspace(0, 0.85, 3401), np.linspace(0, 0.85, 3401))
    height = x[(np.hypot(x, y) < outer) & (np.hypot(x, y) > inner) & (x > cut)]
    cell = 2 * 0.00025**2
    offset = height.mean()
    assert area.sum() * 1.0 <= cell * height.size  # classes merge fibres: the moments are kept, the area is not
    assert (area * distance).sum() == pytest.approx(cell * np.abs(height - offset).sum(), rel=3e-3)
    assert (area * distance**2).sum() == pytest.approx(cell * ((height - offset) ** 2).sum(), rel=3e-3)
    assert 0.85 * (outer - offset) < distance.max() <= max(outer - offset, offset - cut)


def test_a_climbing_plateau_has_its_slope():
    law = Superelastic(200.0, 100.0, transformation_strain=0.5, plateau_modulus_GPa=4.0)
    rig = replace(LINEAR, superelastic=law)
    # far past the start every fibre is on its plateau: the joint has E2/E of its elastic stiffness
    run = solve_pulled_chain(rig, np.array([0.0, 2.6, 2.61]))
    turn = np.radians(run.record.notches_deg)
    arm, half = joint_mechanics(rig).arms_mm.a, 0.5 * turn
    lever = arm * np.cos(half) + rig.joint.notch.width_mm / 6 * np.sin(half)
    moment = run.segment_tensions_N[:, 0, 1:] * lever
    slope = (np.diff(moment, axis=0)[-1] / np.diff(turn, axis=0)[-1])[0]
    expected = flexure(rig).bending_Nmm_per_rad * 4.0 / rig.material.youngs_modulus_GPa
    assert slope == pytest.approx(expected, rel=0.03)
    with pytest.raises(RigError, match=r"plateau_modulus_GPa = 90.0: expected below"):
        run_load_control(replace(rig, superelastic=replace(law, plateau_modulus_GPa=90.0)), [0.1])


def test_peak_strain_is_counted_from_rest():
    strain = peak_strain(joint_mechanics(WRIST), np.radians([WRIST.precurvature_deg, WRIST.precurvature_deg + 10.0]))
    np.testing.assert_allclose(strain, [0.0, np.radians(10.0) * joint_mechanics(WRIST).peak_strain_per_rad], atol=1e-12)


def test_limits_are_passed_on_the_line_between_samples():
    limits = (StrainLimit("a", 0.015, "peak", "test"), StrainLimit("b", 0.015, "alternating", "test"))
    drive, strain = np.array([1.0, 2.0, 3.0, 4.0]), np.array([[0.0, 0.01], [0.0, 0.02], [0.0, -0.01], [0.0, -0.02]])
    peak, alternating = limits_passed(drive, strain, limits)
    assert (peak.drive, peak.joint, peak.largest) == (1.5, 2, 0.02)
    # half the range is 0.010 at the second sample, 0.015 at the third, 0.020 at the last
    assert (alternating.joint, alternating.largest) == (2, 0.02)
    assert alternating.drive == pytest.approx(3.0)
    assert limits_passed(drive, strain, (FATIGUE,))[0].drive == 1.0  # 1 % at the first sample: half of it is 0.5 %
    assert limits_passed(drive, 0.1 * strain, (FATIGUE,))[0].drive is None
    with pytest.raises(RigError, match="not known"):
        limits_passed(drive, np.full((4, 2), np.nan), limits)


def test_limits_of_a_wrist_come_in_their_order():
    fatigue, start, end = limits_passed(
        UP_AND_BACK[:11], run_load_control(WRIST, UP_AND_BACK[:11]).peak_strain, strain_limits(WRIST)
    )
    assert fatigue.drive < start.drive < end.drive
    assert start.limit.strain == pytest.approx(WRIST.superelastic.plateau_MPa / WRIST.material.youngs_modulus_GPa / 1e3)
    assert all(p.joint == 1 for p in (fatigue, start, end))  # friction: the first notch bends most
    assert all(p.limit.source for p in (fatigue, start, end))


def test_the_study_says_how_far_its_run_strains_the_metal():
    rig = preset("du2018")
    solution = solve_multibody(rig, LoadProgram(np.linspace(0.0, 2.2, 12)))
    summary = strain_summary(rig, solution)
    turn = np.radians(np.abs(solution.record.notches_deg).max())
    assert summary["peak_strain_percent"] == pytest.approx(100 * turn * joint_mechanics(rig).peak_strain_per_rad)
    at = [limit["passed_at_mm"] for limit in summary["strain_limits"]]
    assert 0 < at[0] < at[1] < 2.2  # 0.4 % alternating, then 1 %; 2.5 % at 45 deg stays below 6 %
    assert at[2] is None


def test_one_tendon_moves_in_time():
    drive = 0.5 * (1 - np.cos(np.linspace(0.0, np.pi, 21)))
    program = LoadProgram(drive, time_s=np.linspace(0.0, 2.0, 21))
    # slowly enough that inertia has no say: rings of milligrams
    moved, still = solve_dynamic(WRIST, program).record, solve_multibody(WRIST, program).record
    np.testing.assert_allclose(moved.angle_deg, still.angle_deg, atol=0.3)


def test_a_run_by_force_is_a_record(tmp_path: Path):
    run = run_load_control(WRIST, UP_AND_BACK)
    write_record(run.record, tmp_path / "run.csv")
    again = read_record(tmp_path / "run.csv")
    assert again.drive_unit == "N"
    np.testing.assert_allclose(again.drive, run.force_N)
    np.testing.assert_allclose(again.notches_deg, run.notches_deg, rtol=1e-6)


@pytest.mark.parametrize(
    ("rig", "force", "message"),
    [
        (preset("du2018"), [0.0, 1.0], "rig du2018: two tendons: expected a rig of one"),
        (WRIST, [0.0, -1.0], "force_N = -1: expected at least 0"),
        (WRIST, [0.0, math.nan], "force_N = nan: expected at least 0"),
        (WRIST, [], "expected a row of forces"),
        (replace(WRIST, drag=Drag(1.0)), [0.0, 1.0], "drag: expected a rig without"),
    ],
)
def test_what_cannot_be_pulled_is_refused(rig, force, message):
    with pytest.raises(RigError) as caught:
        run_load_control(rig, force)
    assert message in str(caught.value)
    assert "\n" not in str(caught.value)


def test_without_contact_closed_notches_are_refused():
    with pytest.raises(SolverError, match=r"its notch closes at 30\.\d deg"):
        run_load_control(replace(WRIST, closure=None), UP_AND_BACK)


def test_one_tendon_in_drive_control_with_the_other_effects_of_time():
    rig = replace(WRIST, creep=Creep(0.3, 5.0), drag=Drag(0.1, 0.1))
    drive = np.linspace(0.0, 1.5, 16)
    program = LoadProgram(drive, time_s=np.arange(16.0))
    chain, multibody = solve_chain(rig, program).record, solve_multibody(rig, program).record
    np.testing.assert_allclose(chain.angle_deg, multibody.angle_deg, atol=0.3)


def test_theory_of_one_tendon_starts_at_rest_and_follows_the_engine():
    rig = replace(LINEAR, closure=None)
    drive = np.linspace(0.0, 1.0, 6)
    theory, engine = simulate_analytic(rig, LoadProgram(drive)), solve_chain(rig, LoadProgram(drive)).record
    assert theory.angle_deg[0] == pytest.approx(rig.joints * rig.precurvature_deg)
    np.testing.assert_allclose(theory.angle_deg, engine.angle_deg, rtol=0.02)
    assert theory.tension_b_N is None


RIG_FILE = """
preload_N = 0
tendons = 1
precurvature_deg = 2.0
wheel = {radius_mm = 8.0}
tube = {outer_diameter_mm = 1.62, inner_diameter_mm = 1.40}
notch = {shape = "rectangular", count = 5, depth_mm = 1.40, width_mm = 0.8, spacing_mm = 1.2}
material = {youngs_modulus_GPa = 16.0, poissons_ratio = 0.33}
tendon = {EA_N = 5000.0, moment_arm_mm = 0.6, free_length_mm = 200.0}
"""


def test_a_rig_file_says_that_there_is_one_tendon(tmp_path: Path):
    path = tmp_path / "mine.toml"
    path.write_text(RIG_FILE)
    rig = read_rig(path)
    assert rig.tendon_b is None
    assert rig.tendons == (rig.tendon_a,)
    assert rig.precurvature_deg == 2.0
    assert rig.to_dict()["tendons"] == 1
    assert set(tendon_lines(rig, [1.0] * 5)) == {"a"}


@pytest.mark.parametrize(
    ("old", "new", "message"),
    [
        ("tendons = 1", "tendons = 3", "tendons = 3: expected 1 or 2"),
        ("tendons = 1", "", "preload_N = 0: expected above 0"),
        ("preload_N = 0", "preload_N = -1", "preload_N = -1: expected at least 0"),
        ("free_length_mm = 200.0", "free_length_mm = 200.0, toe_N = 5", "preload_N = 0: expected above 0"),
        ("tendon =", "tendon_b = {EA_N = 1.0}\ntendon =", "[tendon_b]: expected absent with tendons = 1"),
        ("precurvature_deg = 2.0", "precurvature_deg = 200.0", "precurvature_deg = 200.0: expected within +-90"),
    ],
)
def test_bad_files_of_one_tendon_are_named(tmp_path: Path, old, new, message):
    path = tmp_path / "mine.toml"
    path.write_text(RIG_FILE.replace(old, new, 1))
    with pytest.raises(RigError) as caught:
        read_rig(path)
    assert str(caught.value).startswith(str(path))
    assert message in str(caught.value)


def test_precurvature_turns_a_two_tendon_rig_alike_in_both_engines():
    rig = replace(preset("du2018"), precurvature_deg=1.0)
    program = LoadProgram(np.array([0.0, 0.5, 1.0, 0.5, 0.0, -0.5]))
    chain, multibody = solve_chain(rig, program).record, solve_multibody(rig, program).record
    assert chain.angle_deg[0] == pytest.approx(14.0, abs=0.5)
    np.testing.assert_allclose(chain.angle_deg, multibody.angle_deg, atol=0.05)
