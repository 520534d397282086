"""The equivalent rig of records of unknown geometry: what it explains, and which effects are found beside it."""

from dataclasses import astuple, replace
from functools import partial
from types import SimpleNamespace

import numpy as np
import pytest

from fem_models.chain.solve import simulate_chain
from fem_models.load import sine
from fem_models.rig import Rig, preset
from fem_models.rig.checks import SolverError
from fem_models.rig.effects import Backlash, Closure, Drag, Fatigue, Gravity
from fem_models.rig.joints import MeasuredJoint
from fem_models.rig.rig import Friction, Material, Tendon, Wheel
from hysteresis.records.record import Record, RecordError
from validation.tracing import trace_records
from validation.tracing.baseline.equivalent_rig import divided, equivalent_rig_problem, refined_problem
from validation.tracing.effect import catalogue
from validation.tracing.figures import candidates_figure
from validation.tracing.fitting import Holdout, Model, fit
from validation.tracing.fitting.holdout import divide_records
from validation.tracing.outcome import Candidate
from validation.tracing.plausibility import remarks
from validation.tracing.problem import AddedEffect
from validation.tracing.result import CandidateReport, in_words, nearest_candidate, trace_report
from validation.tracing.search.detection import absorbed_effects, detection_limits
from validation.tracing.search.final_fit import _Refit
from validation.tracing.settings import EQUIVALENT_JOINTS, EQUIVALENT_RIG

PLAN = ((20.0, 1.0, 0.1), (10.0, 1.0, 0.1), (20.0, 0.5, 1.0))  # preload, part of the amplitude, rate
NOISE_DEG = 0.03
TENDON = Tendon(EA_N=11_000.0, moment_arm_mm=1.9, free_length_mm=140.0)
MEASURED = Rig(
    name="measured",
    material=Material(60.0, 0.33, loop_share=0.3, loop_angle_deg=1.0),
    tendon_a=TENDON,
    tendon_b=TENDON,
    wheel=Wheel(10.0),
    preload_N=20.0,
    friction=Friction(capstan_coefficient=0.04, sheath_N=0.9),
    joint=MeasuredJoint(joints=17, pitch_mm=3.3, flexure_stiffness_Nmm_per_rad=475.0),
)


SOFT_START = replace(TENDON, toe_N=40.0, EA_N=3 * TENDON.EA_N)  # as stiff at 20 N
WITH_PLAY = replace(MEASURED, tendon_a=SOFT_START, tendon_b=SOFT_START, backlash=Backlash(width_mm=0.09))
THREE_PRELOADS = (*PLAN, (5.0, 1.0, 0.1))


def records_of(rig, amplitude_mm, *, unit="mm", per_mm=1.0, seed=0, plan=PLAN):
    """Records that state nothing of the rig but the preload."""
    rng, out = np.random.default_rng(seed), []
    for preload, part, rate in plan:
        program = sine(part * amplitude_mm, rate, cycles=2, samples_per_cycle=60)
        angle = simulate_chain(replace(rig, preload_N=preload), program).angle_deg
        out.append(
            Record(
                drive=per_mm * program.drive_mm,
                angle_deg=angle + rng.normal(0, NOISE_DEG, angle.size),
                drive_unit=unit,
                time_s=program.time_s,
                cycle=program.cycle,
                rig={"preload_N": preload},
            )
        )
    return out


def fitted(records, added=()):
    problem = equivalent_rig_problem(records)
    model = Model(problem, added)
    starts = [problem.starts(one.form)[0] for one in added]
    holdout = divide_records(problem.records)
    everything = Holdout(tuple(np.ones_like(mask) for mask in holdout.train), holdout.by)
    return fit(model, everything, model.coordinates(problem.start, starts), threads=1)


WITH_GUIDES = replace(MEASURED, friction=replace(MEASURED.friction, guide_N=0.02))


@pytest.mark.parametrize(
    ("rig", "amplitude"), [(MEASURED, 1.2), (preset("du2018", preload_N=20.0), 2.0), (WITH_GUIDES, 1.2)]
)
def test_rigs_with_more_joints_are_explained_to_the_noise(rig, amplitude):
    """14 and 17 joints, a soft and a linear tendon, guides with some friction, by six joints."""
    assert rig.joints > EQUIVALENT_JOINTS
    found = fitted(records_of(rig, amplitude))
    assert found.train_rmse_deg < 1.08 * NOISE_DEG


def test_two_preloads_identify_the_toe_of_the_tendon():
    """The tendon of the preset has a toe region of 40 N, the other one has none."""
    soft = fitted(records_of(preset("du2018", preload_N=20.0), 2.0))
    linear = fitted(records_of(MEASURED, 1.2))
    assert soft.model.values(soft.x)[0]["toe_N"] == pytest.approx(preset("du2018").tendon_a.toe_N, rel=0.15)
    assert linear.model.values(linear.x)[0]["toe_N"] < 1.0


def test_tendons_are_as_stiff_at_the_preload_whatever_their_toe():
    """k(T) = k_inf T / (T + toe): at the largest preload it is the parameter over the length."""
    problem = equivalent_rig_problem(records_of(MEASURED, 1.2))
    for toe in (0.0, 13.0, 44.0):
        tendon = problem.rig(problem.runs[0][0], {**problem.start, "toe_N": toe}, ()).tendon_a
        assert tendon.EA_N * 20.0 / (20.0 + tendon.toe_N) == pytest.approx(problem.start["EA_at_preload_N"])


def test_play_before_tendons_without_a_toe_region_is_friction_at_the_base():
    """Friction F keeps the manipulator still over 2 F / k of the drive, k being the free tendon's: as a play does."""
    played = fitted(records_of(replace(MEASURED, backlash=Backlash(width_mm=0.09)), 1.2))
    assert played.rmse_deg < 1.05 * NOISE_DEG
    values = played.model.values(played.x)[0]
    in_equivalent_mm = 2 * values["sheath_N"] * values["free_length_mm"] / values["EA_at_preload_N"]
    still = in_equivalent_mm / played.model.problem.mm_per_unit
    by_friction = 2 * MEASURED.friction.sheath_N * TENDON.free_length_mm / TENDON.EA_N
    assert still - by_friction == pytest.approx(0.09, rel=0.1)


@pytest.mark.slow
def test_play_is_named_with_its_width_in_the_drive_s_unit():
    """In steps of 1 um of tendon, on a wheel that turns in the other direction.

    The tendons are softer at a lower preload. So friction keeps the manipulator still for longer there, but play not.
    """
    near = {"backlash", "preloaded_play", "guide_friction", "tendon_slack", "tendon_stiffening"}
    records = records_of(WITH_PLAY, 1.2, unit="step", per_mm=-1000.0, plan=THREE_PRELOADS)
    trace = trace_records(records, effects=[effect for effect in catalogue() if effect.name in near])
    assert (trace.verdict, trace.model, trace.known) == ("effect", EQUIVALENT_RIG.name, False)
    assert [added.effect.name for added in trace.effects] == ["backlash"]
    width = trace.augmented.model.values(trace.augmented.x)[1][0]
    assert list(width) == ["width_step"]
    assert width["width_step"] == pytest.approx(90.0, rel=0.1)
    assert trace.augmented.heldout_rmse_deg < 1.3 * NOISE_DEG


def numbers(row):
    """Numbers of nested tuples, one after the other."""
    return [x for one in row for x in (numbers(one) if isinstance(one, tuple) else [one]) if isinstance(x, float)]


@pytest.mark.parametrize("per_mm", [-1000.0, 1 / 0.63])
def test_no_quantity_of_the_drive_stays_in_mm(per_mm):
    """Rigs by parameters in the drive's unit are those by parameters in mm, whichever way the wheel turns."""
    problem = equivalent_rig_problem(records_of(MEASURED, 1.2, unit="step", per_mm=per_mm))
    of_tendon = {"backlash", "preloaded_play", "tendon_engagement", "position_friction", "viscous_drag", "tendon_slack"}
    rig, mm = problem.runs[0][0].rig, problem.mm_per_unit
    for effect in (effect for effect in catalogue() if effect.name in of_tendon):
        for plain, form in zip(effect.rig_forms, problem.forms(effect), strict=False):
            assert not [p.name for p in form.parameters if "mm" in p.name.replace("Nmm", "")]
            assert not [p.name for p in form.parameters if "mm" in p.unit.replace("Nmm", "")]
            there, here = plain.starts(problem.scale, rig)[0], form.starts(problem.scale, rig)[0]
            assert numbers(astuple(form.rig(rig, here))) == pytest.approx(numbers(astuple(plain.rig(rig, there))))
            for (name, value), other in zip(there.items(), here.values(), strict=True):
                power = {"growth_per_mm": -1, "sheath_N_s_per_mm": -1}.get(name, int(name.endswith("_mm")))
                size = mm if name in ("growth_per_mm", "centre_mm") else abs(mm)
                assert other == pytest.approx(value / size**power)


def test_amounts_to_which_an_equivalent_rig_gives_no_scale_have_no_limit_and_a_word():
    """Its forces are in proportion to a preload and lengths that are assumed."""
    records = [replace(record, rig={}) for record in records_of(MEASURED, 1.2)]
    effects = [effect for effect in catalogue() if effect.name in ("gravity", "tip_load", "backlash")]
    limits = detection_limits(fitted(records), effects, NOISE_DEG)
    assert {one.name for one in limits} == {"backlash"}
    assert absorbed_effects(fitted(records), effects, limits) == ()  # a size without a scale is not absorbed
    problem = equivalent_rig_problem(records)
    gravity = next(effect for effect in effects if effect.name == "gravity")
    loaded = fitted(records, (AddedEffect(gravity, problem.forms(gravity)[0]),))
    assert any("gravity in g is in proportion to the preload" in words for words in remarks(loaded))


@pytest.mark.slow
def test_a_candidate_without_an_equilibrium_at_the_end_has_no_error_there(monkeypatch):
    """The effect that was found stays; the candidate has no number (a case of a retired set broke on one)."""
    monkeypatch.setattr("validation.tracing.baseline.equivalent_rig.REFINED_SAMPLES", 100)
    monkeypatch.setattr("validation.tracing.baseline.equivalent_rig.REFINED_PARTS", 1)

    def failing(model, *given, **more):
        if more.get("most_steps") == 3:  # the few steps of candidates that are not named
            raise SolverError("no equilibrium")
        return fit(model, *given, **more)

    monkeypatch.setattr("validation.tracing.search.final_fit.fit", failing)
    shown = {"backlash", "time_delay", "guide_friction"}
    records = records_of(WITH_PLAY, 1.2, plan=THREE_PRELOADS)
    trace = trace_records(records, effects=[effect for effect in catalogue() if effect.name in shown])
    assert trace.augmented.names == ("backlash",)
    result = trace_report(trace)
    assert result.verdict == "effect"
    errors = {c.name: c.heldout_rmse_deg for c in result.candidates}
    assert set(errors) == shown
    assert sorted(error is None for error in errors.values()) == [
        False,
        False,
        True,
    ]  # one competitor is fitted in full
    assert candidates_figure(trace)[:4] == b"\x89PNG"
    assert in_words(replace(result, verdict="unexplained", candidates=(CandidateReport("x", None, 0.0),)))


@pytest.mark.slow
def test_the_nearest_candidate_has_a_share_where_the_last_fits_have_more_samples(monkeypatch):
    """A loop that no effect makes; the baseline is fitted to more samples at the end than in the search."""
    monkeypatch.setattr("validation.tracing.cross_validated.LEAST_PLAY_SAMPLES", 10**6)
    few = partial(equivalent_rig_problem, samples=60)
    monkeypatch.setattr("validation.tracing.trace.equivalent_rig_problem", few)
    effects = [effect for effect in catalogue() if effect.name in ("thermal_drift", "time_delay")]
    records = [
        replace(one, angle_deg=one.angle_deg + 0.8 * np.sin(5.0 * one.drive) * np.sign(np.gradient(one.drive)))
        for one in records_of(MEASURED, 1.2, plan=PLAN[:2])
    ]
    report = trace_report(trace_records(records, effects=effects, threads=1))
    assert (report.verdict, report.model) == ("unexplained", EQUIVALENT_RIG.name)
    assert report.explained_share is not None
    assert report.explained_share.value < 0.2


def test_the_candidate_that_is_nearest_after_a_fit_to_more_samples_is_fitted_so_too():
    def candidate(name, heldout, samples="few"):
        return Candidate(SimpleNamespace(names=(name,), heldout_rmse_deg=heldout, samples=samples), 0.0)

    def thoroughly(one, *, from_other_loops):
        worse = {"first": 0.0503, "second": 0.0499}
        return candidate(one.names[0], worse[one.names[0]], "many").fitted

    coarse = (candidate("first", 0.05), candidate("second", 0.0501), candidate("third", 0.2))
    found = _Refit.with_nearest(SimpleNamespace(thoroughly=thoroughly), coarse)
    assert nearest_candidate(found).fitted.samples == "many"
    assert [one.fitted.samples for one in found] == ["many", "many", "few"]


@pytest.mark.slow
def test_records_without_an_effect_have_the_verdict_none():
    """Of the effects that such a rig absorbs most of; the practice cases have all."""
    absorbed = {"backlash", "preloaded_play", "guide_friction", "tendon_slack", "tendon_stiffening", "viscous_drag"}
    effects = [effect for effect in catalogue() if effect.name in absorbed]
    trace = trace_records(records_of(MEASURED, 1.2, seed=1), effects=effects)
    assert (trace.verdict, trace.model) == ("none", EQUIVALENT_RIG.name)


@pytest.mark.parametrize("unit", ["deg", "step"])
def test_forms_act_the_same_in_any_unit(unit):
    """Every form at its first start adds the same to the angle, in mm of tendon or in another unit."""
    mm = equivalent_rig_problem(records_of(MEASURED, 1.2))
    other = equivalent_rig_problem(records_of(MEASURED, 1.2, unit=unit, per_mm=57.3))
    assert np.allclose(mm.predict(mm.start, ())[0], other.predict(other.start, ())[0], atol=1e-6)
    for effect in catalogue():
        for here, there in zip(mm.forms(effect), other.forms(effect), strict=True):
            a, b = mm.starts(here)[0], other.starts(there)[0]
            assert set(b) == {c.name for c in there.parameters}
            ours, theirs = mm.predict(mm.start, [(here, a)]), other.predict(other.start, [(there, b)])
            assert np.allclose(ours[0], theirs[0], atol=1e-4), effect.name


def test_records_without_preload_have_one_group_and_no_toe():
    bare = [replace(record, rig={}) for record in records_of(MEASURED, 1.2)]
    problem = equivalent_rig_problem(bare)
    assert "toe_N" not in {p.name for p in problem.parameters}
    assert {run.rig.preload_N for runs in problem.runs for run in runs} == {20.0}


def test_the_prior_keeps_parameters_that_the_records_do_not_identify():
    """All forces in proportion, with linear tendons and no capstan, leave the angle as it is: it must not drift."""
    found = fitted([replace(record, rig={}) for record in records_of(MEASURED, 1.2)])
    start, end = found.model.problem.start, found.model.values(found.x)[0]
    free = [c for c in found.model.problem.parameters if c.unit in ("N", "Nmm/rad") and c.log]
    assert free
    assert all(0.1 < end[c.name] / start[c.name] < 10.0 for c in free)


def test_units_may_not_be_mixed():
    records = records_of(MEASURED, 1.2)
    with pytest.raises(RecordError, match=r"drive.unit = deg: expected mm, as of the first record"):
        equivalent_rig_problem([records[0], replace(records[1], drive_unit="deg")])


def test_friction_of_the_guides_is_that_of_the_effect_alone():
    """It stands in place of the parameter of the baseline: of a sum neither part can be identified."""
    problem = equivalent_rig_problem(records_of(MEASURED, 1.2))
    effect = next(e for e in catalogue() if e.name == "guide_friction")
    form = next(form for form in problem.forms(effect) if form.parameters[0].name == "guide_N")
    values = {**problem.start, "guide_N": 0.02}
    assert problem.rig(problem.runs[0][0], values, ()).friction.guide_N == 0.02
    assert problem.rig(problem.runs[0][0], values, [(form, {"guide_N": 0.05})]).friction.guide_N == 0.05


def test_an_effect_may_be_softer_than_the_baseline():
    """The toe of tendon_stiffening stands in place of that of the baseline, and has wider bounds."""
    problem = equivalent_rig_problem(records_of(MEASURED, 1.2))
    effect = next(e for e in catalogue() if e.name == "tendon_stiffening")
    (form,) = problem.forms(effect)
    model = Model(problem, (AddedEffect(effect, form),))
    assert max(c.high for c in form.parameters) > max(c.high for c in problem.parameters if c.name == "toe_N")
    rig = problem.rig(problem.runs[0][0], problem.start, [(form, {"toe_N": 90.0})])
    assert rig.tendon_a.toe_N == rig.tendon_b.toe_N == 90.0
    assert model.baseline_size == len(problem.parameters)


def test_a_divided_rig_moves_as_the_whole_one_does():
    """Joints in series share the angle without friction, and with it drag, loop, closure and fatigue."""
    gapped = replace(MEASURED.joint, rigid_gap_mm=0.3)
    smooth = replace(MEASURED, friction=Friction(), precurvature_deg=0.1, joint=gapped)
    odd = replace(smooth, closure=Closure(2e3, 0.9), drag=Drag(0.1, 20.0), fatigue=Fatigue(0.3, 0.2, 1.0))
    program = sine(1.2, 0.2, cycles=2, samples_per_cycle=60)
    whole, parted = (simulate_chain(divided(odd, parts), program).angle_deg for parts in (1, 2))
    assert np.abs(parted - whole).max() < 3e-4 * np.abs(whole).max()  # arcs of more joints are rounder
    assert np.abs(whole - simulate_chain(smooth, program).angle_deg).max() > 2.0
    heavy = divided(replace(WITH_GUIDES, gravity=Gravity(3.0)), 2)
    assert heavy.joints * heavy.gravity.ring_mass_g == pytest.approx(WITH_GUIDES.joints * 3.0)
    assert heavy.joints * heavy.friction.guide_N == pytest.approx(WITH_GUIDES.joints * WITH_GUIDES.friction.guide_N)


def test_the_refined_problem_has_more_samples_and_joints_and_one_parameter_more():
    records = records_of(MEASURED, 1.2)
    problem = equivalent_rig_problem(records, samples=60)
    finer = refined_problem(problem)
    assert finer.parameters[:-1] == problem.parameters
    assert finer.parameters[-1].name == "rigid_gap_mm"
    assert sum(map(len, finer.observed)) > sum(map(len, problem.observed))
    rigs = [p.rig(p.runs[0][0], p.start, []) for p in (problem, finer)]
    assert [rig.joints for rig in rigs] == [6, 12]
    assert [rig.joint.roots_share for rig in rigs] == [0.0, 1 / 3]
    hinged, gapped = (finer.predict({**finer.start, "rigid_gap_mm": gap}, [])[0] for gap in (0.0, 0.7))
    assert np.abs(gapped - hinged).max() > 0.01
    assert rigs[1].joints * rigs[1].pitch_mm == pytest.approx(rigs[0].joints * rigs[0].pitch_mm)


def test_an_angle_that_no_manipulator_bends_to_is_refused_with_its_record():
    """Counts of an encoder that were taken for degrees; it used to be a refusal of the equivalent rig's material."""
    drive = np.sin(np.linspace(0.0, 4 * np.pi, 60))
    for span, refused in ((9e4, False), (1.1e5, True)):
        record = Record(drive, span * (drive - drive.min()) / np.ptp(drive), source="counts.csv")
        if refused:
            with pytest.raises(RecordError, match=r"counts\.csv: angle = 110000 deg from end to end"):
                equivalent_rig_problem([record])
        else:
            assert equivalent_rig_problem([record]).records
