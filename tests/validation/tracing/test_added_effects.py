"""Later effects of the catalogue: closed forms, effects that are one operator for some records, and traces."""

from dataclasses import replace

import numpy as np
import pytest

from fem_models.chain.solve import simulate_chain
from fem_models.joint.flexure import flexure
from fem_models.load import LoadProgram, sine
from fem_models.rig import preset
from fem_models.rig.effects import Backlash, DriveGain, PositionFriction, Stribeck, TipLoad
from fem_models.rig.rig import Friction, Material
from hysteresis.records.record import Record
from validation.practice.draw import draw_case
from validation.tracing.baseline.curve import curve_problem
from validation.tracing.baseline.curve_kernels import play
from validation.tracing.baseline.known_rig import known_rig_problem
from validation.tracing.baseline.motor_drive import motor_drive_problem
from validation.tracing.effect import catalogue
from validation.tracing.effects.tip_load import levers
from validation.tracing.trace import trace_records


def effect(name):
    return next(effect for effect in catalogue() if effect.name == name)


def some(*names):
    return [effect(name) for name in names]


def named(trace):
    """All names of a verdict: those of the augmented model, and those that explain as well."""
    return {*trace.augmented.names, *(name for names in trace.confusable for name in names)}


def records_of(drives, preload_N=None):
    """Records for their drive alone."""
    rigs = [{} if preload_N is None else {"preload_N": preload} for preload in preload_N or drives]
    return [
        Record(drive=x, angle_deg=20.0 * x, time_s=np.arange(x.size) * 0.1, rig=rig)
        for x, rig in zip(drives, rigs, strict=True)
    ]


def records_with(**on):
    """Records of a known rig with effects that it does not declare: two preloads and rates, short."""
    rng, records = np.random.default_rng(4), []
    for preload, amplitude, rate in ((20.0, 2.0, 0.1), (10.0, 1.5, 0.5)):
        rig = preset("du2018", preload_N=preload)
        run = simulate_chain(replace(rig, **on), sine(amplitude, rate, cycles=2, samples_per_cycle=60))
        angle = run.angle_deg + rng.normal(0, 0.04, run.angle_deg.size)
        told = {"preset": "du2018", "preload_N": preload}
        records.append(replace(run, angle_deg=angle, rig=told))
    return records


SWING = 2.0 * np.sin(np.linspace(0.0, 6 * np.pi, 300))


def angle_of(problem, name, number, values):
    """Angles of the first record by a baseline with a loop, and one form of an effect."""
    form = problem.scale.placed(effect(name).curve_forms[number])
    names = {c.name.removesuffix("_mm"): c.name for c in form.parameters}
    given = {names[name]: value for name, value in values.items()}
    base = {
        **problem.start,
        "slope": 20.0,
        "even": 0.0,
        "odd": 0.0,
        "A": -0.6,
        "reach": 2.0,
        "n": 1.0,
        "bend_loop": 0.0,
    }
    return problem.predict(base, [(form, given)])[0]


# --- closed forms ----------------------------------------------------------------------------------------------------


def test_levers_are_the_derivatives_of_the_tips_place():
    h = np.linspace(-2.0, 2.0, 40)  # 0 is not among them
    step = 1e-4

    def place(h):
        return np.sin(h) / h, (1 - np.cos(h)) / h

    along, across = ((b - a) / (2 * step) for a, b in zip(place(h - step), place(h + step), strict=True))
    np.testing.assert_allclose(levers(h), (along, across), atol=1e-7)
    np.testing.assert_allclose(np.array(levers(np.array([9.99e-4]))), np.array(levers(np.array([1.01e-3]))), atol=1e-4)


@pytest.mark.parametrize("direction_deg", [90.0, 180.0])
def test_a_load_on_the_tip_acts_by_its_levers(direction_deg):
    """The chain under a small load against the closed form: k_total dtheta = F L lever(theta)."""
    soft = replace(preset("du2018").tendon_a, EA_N=100.0, free_length_mm=1e3, toe_N=0.0)  # holds by a force, nearly
    rig = replace(
        preset("du2018"),
        name="soft",
        friction=Friction(),
        material=Material(60.0, 0.33),
        tendon_a=soft,
        tendon_b=None,
        preload_N=0.0,
    )
    program = LoadProgram(np.linspace(0.0, 150.0, 31))
    force = 1e-3
    bare = simulate_chain(rig, program).angle_deg
    loaded = simulate_chain(replace(rig, tip_load=TipLoad(force, direction_deg)), program).angle_deg
    along, across = levers(np.radians(bare))
    lever = along * np.cos(np.radians(direction_deg)) + across * np.sin(np.radians(direction_deg))
    n, joint = rig.joints, flexure(rig).bending_Nmm_per_rad
    expected = force * n * rig.pitch_mm * lever / (joint / n)
    assert bare.max() > 40.0
    assert np.radians(loaded - bare) == pytest.approx(expected, rel=0.15, abs=0.05 * np.abs(expected).max())


def test_a_late_tendon_stands_still_below_its_engagement():
    problem = curve_problem(records_of([SWING]))
    angle = angle_of(problem, "tendon_engagement", 0, {"engages_above": -1.0})
    loose = SWING < -1.0
    assert np.ptp(angle[loose][5:]) < 1e-9
    assert np.ptp(angle[~loose]) > 40.0


# --- one operator ----------------------------------------------------------------------------------------------------


def test_play_at_one_preload_is_one_operator_whatever_takes_it_up():
    problem = curve_problem(records_of([SWING]))
    taken_up = angle_of(problem, "preloaded_play", 1, {"preloaded_width": 0.3})
    np.testing.assert_array_equal(taken_up, angle_of(problem, "backlash", 0, {"width": 0.3}))


def test_play_that_the_preload_takes_up_has_a_width_of_its_own_in_every_record():
    """w / (1 + T/T0): 0.6 mm is 0.2 mm at T = 2 T0."""
    problem = curve_problem(records_of([SWING, SWING], [20.0, 10.0]))
    form = problem.scale.placed(effect("preloaded_play").curve_forms[0])
    drives = [
        form.form.drive(SWING, problem._context(i, problem.start), {"free_width": 0.6, "takes_up": 0.5}) for i in (0, 1)
    ]
    states = [problem.start[f"state_{i}"] for i in (0, 1)]
    for x, width, state in zip(drives, (0.2, 0.3), states, strict=True):
        np.testing.assert_allclose(x, play(SWING, width, state), atol=1e-12)


def test_run_in_is_fatigue_of_the_loop_without_a_residual_angle():
    """1 + e exp(-c/c0) = (1 + e)(1 - e/(1 + e) (1 - exp(-c/c0)))."""
    inputs = curve_problem(records_of([SWING])).inputs[0]
    problem = curve_problem(records_of([SWING]))
    context = problem._context(0, problem.start)
    excess, cycles = 0.5, 1.3
    size = effect("run_in").curve_forms[0].loop_size(SWING, context, {"excess": excess, "cycles": cycles})
    tired = (
        effect("functional_fatigue")
        .curve_forms[0]
        .loop_size(SWING, context, {"loop_loss": excess / (1 + excess), "cycles": cycles})
    )
    assert inputs.cycle.max() >= 2
    np.testing.assert_allclose(size, (1 + excess) * tired, rtol=1e-12)


def test_play_of_one_preload_is_named_with_what_may_take_it_up():
    """Records of one preload: whichever is named, the other one explains them as well."""
    trace = trace_records(records_with(backlash=Backlash(0.15))[:1], effects=some("backlash", "preloaded_play"))
    assert trace.verdict == "ambiguous"
    assert named(trace) == {"backlash", "preloaded_play"}


# --- hidden, and found -----------------------------------------------------------------------------------------------


@pytest.mark.slow
def test_a_drive_that_winds_five_per_cent_more_is_named():
    """It used to be called a wheel that runs out, or a camera."""
    records = records_with(drive_gain=DriveGain(0.05))
    trace = trace_records(records, effects=some("drive_gain", "camera_misalignment"))
    assert "drive_gain" in named(trace)
    assert trace.augmented.heldout_rmse_deg < 1.3 * trace.floor.deg


def test_a_gain_of_the_drive_is_no_candidate_where_it_is_free():
    (form,) = effect("drive_gain").rig_forms
    case = draw_case("work", "known", "clean", 0)
    assert known_rig_problem(case.records).forms(effect("drive_gain")) == (form,)
    turned = [replace(record, drive=100.0 * record.drive, drive_unit="deg") for record in case.records]
    assert motor_drive_problem(turned).forms(effect("drive_gain")) == ()
    assert [form.needs for form in effect("drive_gain").curve_forms] == [{"reference"}]


HIDDEN = {
    "tip_load": ("gravity", {"tip_load": TipLoad(0.4, -60.0)}),
    "stribeck_friction": ("viscous_drag", {"stribeck": Stribeck(0.8, 0.5)}),
    "position_friction": ("unequal_tendons", {"position_friction": PositionFriction(0.3)}),
}
"""Neighbour that an effect is tried with, and the rig's table."""


@pytest.mark.slow
@pytest.mark.parametrize("name", HIDDEN)
def test_an_added_effect_is_told_from_its_neighbour(name):
    neighbour, on = HIDDEN[name]
    trace = trace_records(records_with(**on), effects=some(name, neighbour))
    assert trace.augmented.names == (name,)
    assert trace.verdict == "effect"
    assert trace.augmented.heldout_rmse_deg < 1.3 * trace.floor.deg
