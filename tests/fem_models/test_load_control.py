"""Load control, single tendons and precurvature: both engines, and formulas where there are some."""

import math
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from fem_models.chain.solve import ChainSettings, solve_chain, solve_chain_by_force
from fem_models.joint import joint_mechanics
from fem_models.joint.flexure import flexure
from fem_models.load import LoadProgram
from fem_models.load_control import run_load_control
from fem_models.multibody.dynamic import solve_dynamic
from fem_models.multibody.quasi_static import solve_multibody, solve_multibody_by_force
from fem_models.rig import RigError, preset
from fem_models.rig.checks import SolverError
from fem_models.rig.effects import Closure, Creep, Drag, Superelastic
from fem_models.rig.rig import Friction
from fem_models.rig.rig_file import read_rig
from hysteresis.records.record_file import read_record, write_record

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
def test_both_engines_agree_notch_by_notch_in_loading_and_unloading(name):
    # without closure the softened notches fold up near 1.6 N: the measured wrists' loads there end at 1.2 N
    force = UP_AND_BACK * (0.6 if name == "superelastic" else 1.0)
    chain, multibody = run_load_control(STAGES[name], force), run_load_control(STAGES[name], force, "multibody")
    # the difference is the ring's compliance, in series with every joint in one engine only: docs/validation/wrists.md
    assert np.abs(chain.notches_deg - multibody.notches_deg).max() <= 0.1
    assert np.abs(chain.angle_deg - multibody.angle_deg).max() <= 0.0025 * np.abs(chain.angle_deg).max()
    assert np.abs(chain.tip_mm - multibody.tip_mm).max() <= 0.03
    np.testing.assert_allclose(chain.peak_strain, multibody.peak_strain, atol=4e-4)  # 0.06 deg


def test_a_small_force_bends_each_joint_by_force_times_arm_over_stiffness():
    force, rest = 0.01, np.radians(LINEAR.precurvature_deg)
    arm, k = joint_mechanics(LINEAR).arms_mm.a, flexure(LINEAR).bending_Nmm_per_rad
    for engine in ("chain", "multibody"):
        bent = np.radians(run_load_control(LINEAR, [0.0, force], engine).notches_deg[-1]) - rest
        # first order in the angle, but for the arm's cos and the ring in series: 2 %
        np.testing.assert_allclose(bent, force * arm / k, rtol=0.02)


def test_without_load_the_rig_stands_at_its_precurvature():
    for engine in ("chain", "multibody"):
        still = run_load_control(WRIST, [0.0], engine)
        np.testing.assert_allclose(still.notches_deg, WRIST.precurvature_deg, atol=1e-6)
        np.testing.assert_allclose(still.peak_strain, 0.0, atol=1e-8)


def test_tension_falls_along_the_notches_as_the_capstan_equation_says():
    rig = STAGES["friction"]
    solution = solve_chain_by_force(rig, np.array([0.0, 0.8]))
    angle = np.abs(np.radians(solution.record.notches_deg[-1]))
    wrap = 0.5 * (angle + np.concatenate([[0.0], angle[:-1]]))
    expected = 0.8 * np.exp(-rig.friction.capstan_coefficient * np.cumsum(wrap))
    np.testing.assert_allclose(solution.segment_tensions_N[-1, 0, 1:], expected, rtol=1e-7)
    np.testing.assert_array_equal(solution.segment_tensions_N[:, 1], 0.0)


@pytest.mark.parametrize("name", ["linear", "friction", "all"])
def test_drive_control_gives_the_same_angles_at_the_same_tensions(name):
    rig = STAGES[name]
    drive = np.concatenate([np.linspace(0.0, 2.5, 26), np.linspace(2.4, 0.2, 23)])
    for solve in (solve_chain, solve_multibody):
        driven = solve(rig, LoadProgram(drive)).record
        loaded = run_load_control(
            rig, np.maximum(driven.tension_a_N, 0.0), "chain" if solve is solve_chain else "multibody"
        )
        # the chain to rounding; the multibody model's friction ends at a tolerance
        atol = 1e-6 if solve is solve_chain else 0.01
        np.testing.assert_allclose(loaded.angle_deg, driven.angle_deg, atol=atol)
        assert driven.tension_b_N is None


def test_a_smaller_step_of_the_force_hardly_changes_the_result():
    coarse = solve_chain_by_force(WRIST, UP_AND_BACK).record.angle_deg
    fine = solve_chain_by_force(WRIST, UP_AND_BACK, ChainSettings(max_force_step=0.02)).record.angle_deg
    assert np.abs(coarse - fine).max() < 0.02


def test_unloading_stays_above_loading_and_ends_at_rest():
    run = run_load_control(WRIST, UP_AND_BACK)
    up = np.interp([0.7, 1.1, 1.5], run.force_N[:11], run.angle_deg[:11])
    back = np.interp([0.7, 1.1, 1.5], run.force_N[:9:-1], run.angle_deg[:9:-1])
    assert (back > up + 2).all()
    assert run.angle_deg[-1] == pytest.approx(run.angle_deg[0], abs=1e-3)


LOOP = np.concatenate([np.linspace(0.0, 1.9, 60), np.linspace(1.9, 0.0, 60)])


@pytest.mark.parametrize("solve", [solve_chain_by_force, solve_multibody_by_force])
def test_work_of_the_tendon_force_over_a_closed_loop_is_lost_to_friction_and_material(solve):
    solution = solve(WRIST, LOOP)
    lost = solution.friction_loss_mJ[-1] + solution.material_loss_mJ[-1]
    assert lost > 0.1
    assert solution.wheel_work_mJ[-1] == pytest.approx(lost, rel=0.02)


def test_the_gap_of_the_energies_closes_at_first_order_in_the_step_of_the_force():
    gaps = []
    for step in (0.04, 0.02, 0.01):
        s = solve_chain_by_force(WRIST, LOOP, ChainSettings(max_force_step=step))
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
def test_more_force_bends_more_and_friction_reduces_the_bending_from_notch_to_notch(force, mu, plateau, rest):
    law = replace(WRIST.superelastic, plateau_MPa=plateau, unloading_plateau_MPa=0.4 * plateau)
    rig = replace(WRIST, superelastic=law, friction=Friction(capstan_coefficient=mu), precurvature_deg=rest)
    run = run_load_control(rig, [0.5 * force, force])
    assert (np.diff(run.angle_deg) > 0).all()
    assert (np.diff(run.notches_deg, axis=1) <= 1e-6).all()


def test_a_slow_dynamic_run_of_a_single_tendon_agrees_with_the_static_one():
    drive = 0.5 * (1 - np.cos(np.linspace(0.0, np.pi, 21)))
    program = LoadProgram(drive, time_s=np.linspace(0.0, 2.0, 21))
    # slowly enough that inertia does not matter: rings of milligrams
    moved, still = solve_dynamic(WRIST, program).record, solve_multibody(WRIST, program).record
    np.testing.assert_allclose(moved.angle_deg, still.angle_deg, atol=0.3)


def test_a_run_under_load_control_is_a_record(tmp_path: Path):
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
def test_impossible_rigs_and_forces_are_refused(rig, force, message):
    with pytest.raises(RigError) as caught:
        run_load_control(rig, force)
    assert message in str(caught.value)
    assert "\n" not in str(caught.value)


def test_without_contact_closed_notches_are_refused():
    with pytest.raises(SolverError, match=r"its notch closes at 30\.\d deg"):
        run_load_control(replace(WRIST, closure=None), UP_AND_BACK)


def test_single_tendon_under_drive_control_with_creep_and_drag():
    rig = replace(WRIST, creep=Creep(0.3, 5.0), drag=Drag(0.1, 0.1))
    drive = np.linspace(0.0, 1.5, 16)
    program = LoadProgram(drive, time_s=np.arange(16.0))
    chain, multibody = solve_chain(rig, program).record, solve_multibody(rig, program).record
    np.testing.assert_allclose(chain.angle_deg, multibody.angle_deg, atol=0.3)


def test_precurvature_bends_a_two_tendon_rig_alike_in_both_engines():
    rig = replace(preset("du2018"), precurvature_deg=1.0)
    program = LoadProgram(np.array([0.0, 0.5, 1.0, 0.5, 0.0, -0.5]))
    chain, multibody = solve_chain(rig, program).record, solve_multibody(rig, program).record
    assert chain.angle_deg[0] == pytest.approx(14.0, abs=0.5)
    np.testing.assert_allclose(chain.angle_deg, multibody.angle_deg, atol=0.05)


def flat(slope_GPa):
    rig = read_rig(Path(__file__).parents[2] / "docs/validation/york2015.toml")
    return replace(rig, superelastic=replace(rig.superelastic, plateau_modulus_GPa=slope_GPa))


@pytest.mark.parametrize("slope_GPa", [0.0, 0.1])
def test_both_engines_follow_a_flat_plateau(slope_GPa):
    """On it joints turn far for little friction, which depends on their wrap: the guides' limits swing if put in
    plainly."""
    force = np.linspace(0.0, 4.2, 43)
    chain, multibody = (run_load_control(flat(slope_GPa), force, engine).angle_deg for engine in ("chain", "multibody"))
    assert chain[-1] > 110
    np.testing.assert_allclose(multibody, chain, atol=0.1)


@pytest.mark.slow
def test_a_tube_that_snaps_back_jumps_alike_in_both_engines():
    """Unloading of a flat plateau: both lose the equilibrium at the same force, and find the same one after it."""
    force = np.concatenate([np.linspace(0.0, 4.2, 43), np.linspace(4.1, 0.0, 42)])
    chain, multibody = (run_load_control(flat(0.0), force, engine) for engine in ("chain", "multibody"))
    for run in (chain, multibody):
        assert np.flatnonzero(run.record.jump).tolist() == [74]
    assert chain.angle_deg[73] - chain.angle_deg[74] > 50
    np.testing.assert_allclose(multibody.angle_deg, chain.angle_deg, atol=0.05)


def test_a_tendon_without_tension_finds_its_rest():
    """Bent at rest, with dry guides that stick: the tendon is taut and slack in turns until it lies still."""
    law = Superelastic(263.0, 132.0, 0.06, 2.82)
    rig = replace(WRIST, precurvature_deg=2.59, superelastic=law, friction=Friction(capstan_coefficient=0.178))
    forces = np.linspace(0.0, 1.2, 5)
    multibody, chain = (
        solve(rig, forces).record.angle_deg for solve in (solve_multibody_by_force, solve_chain_by_force)
    )
    assert np.abs(multibody - chain).max() < 0.3
