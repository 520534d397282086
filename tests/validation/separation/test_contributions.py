"""Contributions to the loop: sums, energy balance, limit cases, calibration, and the command."""

import json
import math
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from fem_models.chain import simulate_chain, solve_chain
from fem_models.joint import joint_row
from fem_models.load import triangle
from fem_models.rig import Rig, RigError, preset
from fem_models.rig.checks import SolverError
from fem_models.rig.effects import Backlash, Fatigue
from fem_models.rig.joints import Notch, NotchedTube, Tube
from fem_models.rig.of_record import rig_of
from fem_models.rig.rig import Friction, Material, Tendon, Wheel
from hysteresis import Record
from hysteresis.records.record_file import write_record
from studies.commands.cli import call
from validation.separation import calibrate_rig, loop_program, separate
from validation.separation.contributions import SETS, SOURCES, closed_loop, divide, shapley, shapley_shares, switched
from validation.separation.priors import PRIORS, stated_values, with_values

RIG = preset("du2018-full-widths")
PRESET = preset("du2018", preload_N=20.0)
PROGRAM = loop_program(-2.2, 2.2)
NO_MATERIAL = replace(RIG, material=replace(RIG.material, loop_share=0.0))
NO_FRICTION = replace(RIG, friction=Friction())
TRUTH = {
    "sheath_N": 4.5,
    "capstan_coefficient": 0.03,
    "loop_share": 0.3,
    "loop_angle_deg": 1.55,
    "EA_N": 19_000.0,
    "toe_N": 32.5,
}


@pytest.fixture(scope="module")
def found():
    return separate(RIG, PROGRAM)


def measured_loop(preload: float, seed: int, amplitude: float = 2.2) -> Record:
    """Simulate a measured loop: the preset with the parameters TRUTH, and noise of 0.02 deg."""
    rig = with_values(replace(PRESET, preload_N=preload), TRUTH)
    run = simulate_chain(rig, triangle(amplitude, cycles=2))
    angle = run.angle_deg + 0.02 * np.random.default_rng(seed).standard_normal(run.drive.size)
    return Record(drive=run.drive, angle_deg=angle, rig={"preset": "du2018", "preload_N": preload}, title="bench")


@given(st.lists(st.floats(-10, 10), min_size=8, max_size=8))
def test_parts_and_shapley_values_add_up_to_the_total(values):
    v = dict(zip(SETS, values, strict=True))
    whole = v[SETS[-1]] - v[SETS[0]]
    assert sum(divide(v).values()) == pytest.approx(whole, abs=1e-12)
    assert sum(shapley(v).values()) == pytest.approx(whole, abs=1e-12)


def test_shapley_value_of_a_game_solved_by_hand():
    # friction and elasticity together are worth 1, half each; material always adds 2
    v = {on: float({"friction", "tendon_elasticity"} <= on) + 2.0 * ("material" in on) for on in SETS}
    assert shapley(v) == pytest.approx({"friction": 0.5, "tendon_elasticity": 0.5, "material": 2.0})
    assert divide(v) == pytest.approx(shapley(v) | {"interaction": 0.0})


@pytest.mark.parametrize("measure", ["width_deg", "area", "dissipated_mJ"])
def test_shares_are_parts_of_the_whole_loop(found, measure):
    """What the loops with everything on and with everything off differ by, taken from the loops themselves."""
    whole, nothing = (getattr(found.loops[frozenset(on)], measure) for on in (SOURCES, ()))
    for shares, parts in ((found.shares(measure), found.parts(measure)), (shapley_shares(found, measure), None)):
        own = shapley(found.values(measure)) if parts is None else parts
        assert sum(shares.values()) == pytest.approx(1, abs=1e-12)
        assert {name: share * (whole - nothing) for name, share in shares.items()} == pytest.approx(own, rel=1e-9)


def test_parts_agree_with_the_energy_balance_of_the_engine(found):
    assert abs(found.closure_percent) < 1  # required
    energy = divide(found.values("dissipated_mJ"))
    # elasticity and interaction dissipate nothing; they change what the two losses dissipate
    assert energy["friction"] == pytest.approx(found.whole.friction_mJ, rel=0.1)
    assert energy["material"] == pytest.approx(found.whole.material_mJ, rel=0.1)


def test_a_stiffened_tendon_has_a_negligible_loop(found):
    assert found.residual_percent < 0.1
    stiff = switched(RIG, frozenset({"friction", "material"}))
    other = loop_program(-2.2, 2.2)
    twice = [replace(tendon, EA_N=2 * tendon.EA_N) for tendon in stiff.tendons]
    stiffer = simulate_chain(replace(stiff, tendon_a=twice[0], tendon_b=twice[1]), other)
    assert simulate_chain(stiff, other).angle_deg == pytest.approx(stiffer.angle_deg, abs=0.01)  # converged


@pytest.mark.parametrize("preload", [5.0, 6.0])
def test_a_stiffened_tendon_may_go_slack(preload):
    # bending to 45 deg releases more than the preload of an inextensible tendon; the rig's own tendons keep 2 N
    rig = replace(RIG, preload_N=preload)
    found = separate(rig, PROGRAM)
    assert min(tension.min() for tension in tensions(found.loops[frozenset()])) == 0
    assert min(tension.min() for tension in tensions(found.whole)) > 2
    assert abs(found.closure_percent) < 1
    # half the stiffness gives the same result: converged
    stiff = switched(rig, frozenset())
    half = [replace(tendon, EA_N=0.5 * tendon.EA_N) for tendon in stiff.tendons]
    softer = closed_loop(replace(stiff, tendon_a=half[0], tendon_b=half[1]), PROGRAM)
    angle = found.loops[frozenset()].record.angle_deg
    assert softer.record.angle_deg == pytest.approx(angle, abs=0.01)


def tensions(loop):
    return loop.record.tension_a_N, loop.record.tension_b_N


def test_solver_error_names_the_sources_that_were_off():
    def fails(rig, program):
        raise SolverError("no equilibrium")

    with pytest.raises(SolverError, match=r"no equilibrium \(with friction, material switched off"):
        separate(RIG, PROGRAM, fails)


@pytest.mark.parametrize(
    ("rig", "only"),
    [
        (NO_MATERIAL, "friction"),
        (switched(NO_MATERIAL, frozenset({"friction"})), "friction"),
        (NO_FRICTION, "material"),
        (switched(NO_FRICTION, frozenset({"material"})), "material"),
    ],
    ids=["friction", "friction, rigid tendons", "material", "material, rigid tendons"],
)
def test_a_single_loss_has_all_the_energy(rig, only):
    shares = separate(rig, PROGRAM).shares("dissipated_mJ")
    assert shares[only] >= 0.98
    assert shares["interaction"] == pytest.approx(0, abs=1e-9)


def test_width_of_a_single_loss_is_shared_equally_with_elasticity():
    # with rigid tendons the wheel prescribes the angle: neither makes a loop alone, so Shapley halves it
    shares = separate(NO_MATERIAL, PROGRAM).shares("width_deg")
    assert shares["friction"] == pytest.approx(0.5, abs=1e-3)
    assert shares["tendon_elasticity"] == pytest.approx(0.5, abs=1e-3)


def test_elasticity_alone_has_no_loop():
    found = separate(replace(NO_MATERIAL, friction=Friction()), PROGRAM)
    assert found.whole.is_lossless
    assert found.shares("dissipated_mJ") is None
    assert found.shares("width_deg") is None


def test_an_effect_with_a_loop_of_its_own_is_refused():
    with pytest.raises(RigError, match="fatigue"):
        separate(replace(RIG, fatigue=Fatigue(0.1, 0.1, 5.0)), PROGRAM)


def test_play_is_a_part_of_its_own():
    """Without friction and with rigid tendons the angle follows the rim: play of w is w over the moment arm wide."""
    play, arm = 0.1, RIG.tendon_a.moment_arm_mm
    found = separate(replace(RIG, backlash=Backlash(play)), PROGRAM)
    without = separate(RIG, PROGRAM)
    width = found.parts("width_deg")
    assert width["play"] == pytest.approx(np.degrees(play / arm), rel=0.02)
    assert sum(width.values()) == pytest.approx(found.whole.width_deg, rel=1e-9)
    assert sum(found.shares("width_deg").values()) == pytest.approx(1.0)
    # the rim comes as far as it does in a rig without play that is driven by half the play less
    less = separate(RIG, loop_program(-2.2 + play / 2, 2.2 - play / 2))
    assert abs(found.parts("dissipated_mJ")["play"]) < 1e-4 * found.whole.dissipated_mJ
    assert found.whole.dissipated_mJ == pytest.approx(less.whole.dissipated_mJ, rel=0.01)
    assert "play" not in without.parts("width_deg")
    assert found.residual_percent == pytest.approx(without.residual_percent, abs=0.5)  # the play is no such residual


def test_a_loop_of_play_alone_has_shares_of_its_width():
    smooth = replace(RIG, friction=Friction(), material=replace(RIG.material, loop_share=0.0), backlash=Backlash(0.1))
    found = separate(smooth, PROGRAM)
    assert found.shares("dissipated_mJ") is None
    assert found.shares("width_deg")["play"] == pytest.approx(1, abs=0.2)  # elastic tendons narrow it


def test_an_angle_of_noise_alone_is_refused():
    one = measured_loop(20.0, 1)
    noise = np.random.default_rng(0).normal(0, 0.05, one.drive.size)
    with pytest.raises(ValueError, match="times the noise"):
        calibrate_rig([replace(one, angle_deg=noise)])


@pytest.mark.slow
def test_multibody_model_agrees(monkeypatch):
    pytest.importorskip("exudyn", reason="Exudyn cannot be imported here: its library libGL.so.1 is missing?")
    from fem_models.multibody import solve_multibody

    monkeypatch.setattr("validation.separation.contributions.STEPS", 22)  # 0.1 mm in both engines is faster
    program = loop_program(-1.1, 1.1, cycles=1)
    chain, bodies = (separate(RIG, program, solve, softer=10.0) for solve in (solve_chain, solve_multibody))
    assert bodies.shares("dissipated_mJ") == pytest.approx(chain.shares("dissipated_mJ"), abs=0.01)
    assert bodies.shares("width_deg") == pytest.approx(chain.shares("width_deg"), abs=0.01)


@pytest.fixture(scope="module")
def of_one():
    return calibrate_rig([measured_loop(20.0, 1)])


@pytest.fixture(scope="module")
def of_both():
    return calibrate_rig([measured_loop(20.0, 1), measured_loop(10.0, 2)])


def test_parameters_are_recovered_from_noisy_loops_within_their_intervals(of_both):
    assert of_both.rmse_deg == pytest.approx(0.02, rel=0.1)  # the noise of the record
    stated = stated_values(PRESET)  # arm, depth, modulus and free length are as stated
    assert set(of_both.parameters) == set(stated) - {"backlash_takes_up_N"}  # the likeliest rig has no play
    for name, parameter in of_both.parameters.items():
        half, true = 0.5 * (parameter.high - parameter.low), TRUTH.get(name, stated[name])
        assert abs(parameter.value - true) < 2 * half, name
    assert of_both.laws["linear"] == pytest.approx(1.0, abs=1e-3)
    assert of_both.effective_draws > 20


def test_what_the_records_do_not_tell_is_as_open_as_its_tolerance(of_both):
    length = of_both.parameters["free_length_mm"]  # it acts as EA does
    expected = 2 * 1.96 * PRIORS["free_length_mm"].spread * PRESET.tendon_a.free_length_mm
    assert length.high - length.low == pytest.approx(expected, rel=0.35)


def test_the_next_experiment_gains_what_was_predicted(of_one, of_both):
    best = of_one.experiments[0]
    again = next(e for e in of_one.experiments if e.what == "the same again")
    assert best.gain > again.gain > 0
    assert best.preload_N == 10  # a compliant tendon shows at low tension
    before, after = (c.parameters["toe_N"] for c in (of_one, of_both))
    assert (before.high - before.low) / (after.high - after.low) > 2


def test_command_writes_the_documented_json(tmp_path):
    assert call(["separate", "--preset", "du2018", "--preload", "20", "--out", str(tmp_path), "--quiet"]) == 0
    result = json.loads((tmp_path / "separate.json").read_text())
    assert set(result["contributions"]) == {*SOURCES, "interaction"}
    for row in result["contributions"].values():
        assert {"width_deg", "area", "share", "dissipated_mJ"} <= set(row)
    assert sum(row["share"] for row in result["contributions"].values()) == pytest.approx(1)
    assert len(result["combinations"]) == 8
    laws = result["bouc_wen"]
    assert laws["tendon_elasticity"] is None
    for name in ("all", "friction", "material"):
        assert laws[name]["parameters"]["A"]["value"] < 0  # they lag
    # the saturation is half of the loop width, as far as one element can represent it
    assert 2 * laws["all"]["saturation_deg"]["value"] == pytest.approx(result["total"]["width_deg"], rel=0.3)


@pytest.mark.slow
def test_command_on_a_record_gives_intervals(tmp_path):
    path = tmp_path / "bench.csv"
    write_record(measured_loop(20.0, 1), path)
    assert call(["separate", str(path), "--out", str(tmp_path / "out"), "--quiet"]) == 0
    result = json.loads((tmp_path / "out" / "separate.json").read_text())
    true = separate(with_values(rig_of(measured_loop(20.0, 1)), TRUTH), PROGRAM).shares("dissipated_mJ")
    for name, share in true.items():
        low, high = result["contributions"][name]["intervals"]["share"]
        assert low - (high - low) < share < high + (high - low), name
    assert result["calibration"]["next_experiments"][0]["gain"] > 0


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (["{record}"], ["bench.csv", "rig", "preset"]),
        (["--preset", "du2018", "--amplitude", "-1"], ["--amplitude", "-1", "above 0"]),
        (["{record}", "--preload", "20"], ["--preload 20", "with records"]),
        ([], ["--preset", "--rig"]),
    ],
)
def test_bad_input_ends_with_one_line(arguments, words, tmp_path, capsys):
    path = tmp_path / "bench.csv"
    write_record(replace(measured_loop(20.0, 1), rig={}), path)
    given = [a.format(record=path) for a in arguments]
    assert call(["separate", *given, "--out", str(tmp_path / "out")]) == 2
    error = capsys.readouterr().err
    assert error.count("\n") == 1
    assert all(word in error for word in words), error
    assert not (tmp_path / "out").exists()


V_PAIR = Rig(
    name="V pair",
    joint=NotchedTube(Tube(5.0, 4.4), Notch("v_pair", 12, 2.0, 0.8, 1.2, 0.3)),
    material=Material(60.0, 0.33),
    tendon_a=Tendon(9000.0, 2.2, 120.0),
    tendon_b=Tendon(9000.0, 2.2, 120.0),
    wheel=Wheel(8.0),
    preload_N=15.0,
    friction=Friction(capstan_coefficient=0.2, sheath_N=0.5),
)


@pytest.mark.parametrize("preload", [2.0, 10.0, 15.0, 20.0])
def test_capstan_friction_at_low_preload_is_divided(preload):
    """Inextensible tendons lose their preload as deep notches bend; a tube without a loss but friction has it all."""
    found = separate(replace(V_PAIR, preload_N=preload), loop_program(-1.0, 1.0))
    shares = found.shares("dissipated_mJ")
    assert found.is_balanced
    assert shares["friction"] + shares["tendon_elasticity"] == pytest.approx(1, abs=1e-6)
    assert shares["material"] == pytest.approx(0, abs=1e-6)


def test_a_notch_may_close_with_a_source_switched_off():
    """With all sources it stays open by a little; inextensible tendons bend it by the whole drive."""
    soft = replace(V_PAIR, tendon_a=Tendon(2000.0, 2.2, 400.0), tendon_b=Tendon(2000.0, 2.2, 400.0))
    bent = np.abs(simulate_chain(soft, triangle(1.0)).notches_deg).max()
    high = 0.9 * joint_closure_deg(soft) / bent  # nearly in proportion
    found = separate(soft, loop_program(-high, high))
    rigid = found.loops[frozenset({"friction", "material"})].record.notches_deg
    assert np.abs(rigid).max() > joint_closure_deg(soft) > np.abs(found.whole.record.notches_deg).max()
    assert np.isfinite(list(found.shares("dissipated_mJ").values())).all()


def joint_closure_deg(rig):
    return math.degrees(joint_row(rig).first.closure_angle_rad)


def test_tendons_that_jam_say_how_much_their_shares_still_move():
    """One-sided notches: the wheel pays out as much of the tendon with the short arm as it winds in of the other."""
    tube = NotchedTube(Tube(2.0, 1.7), Notch("rectangular", 8, 1.5, 0.4, 0.6))
    rig = replace(V_PAIR, joint=tube, tendon_a=Tendon(9000.0, 0.8, 120.0), tendon_b=Tendon(9000.0, 0.8, 120.0))
    found = separate(replace(rig, preload_N=2.0), loop_program(-0.3, 0.3))
    assert found.moved > 0.02
    assert np.isfinite(list(found.shares("dissipated_mJ").values())).all()
