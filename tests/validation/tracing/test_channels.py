"""Notch angles and tensions fitted together with the angle, and the one bar for names and free functions."""

from dataclasses import replace
from functools import cache

import numpy as np
import pytest

from fem_models.chain.solve import solve_chain
from fem_models.joint import joint_mechanics
from fem_models.load import sine
from fem_models.load_control import run_load_control
from fem_models.rig import preset
from hysteresis.records.record import Record
from validation.tracing.baseline.known_rig import known_rig_problem, rig_under_tendon_force
from validation.tracing.baseline.runs import _reach_deg
from validation.tracing.effect import catalogue
from validation.tracing.fitting import Model, fit
from validation.tracing.fitting.evidence import beats_smooth_functions, curve_does_as_well
from validation.tracing.fitting.holdout import divide_records
from validation.tracing.fitting.smooth import Smooth
from validation.tracing.inference import ALPHA, learnt_prior, times_needed
from validation.tracing.problem import AddedEffect
from validation.tracing.result import in_words, trace_report
from validation.tracing.search import detection
from validation.tracing.search.detection import action_deg, detection_limits
from validation.tracing.settings import VERY_STRONG_EVIDENCE
from validation.tracing.trace import trace_records

TUBE = {"outer_diameter_mm": 1.62, "inner_diameter_mm": 1.40}
NOTCH = {"shape": "rectangular", "count": 5, "depth_mm": 1.40, "width_mm": 0.5, "spacing_mm": 1.5}
NOISE_DEG = 0.2


@cache
def wrist(trials: int = 3) -> Record:
    """Trials of the wrist of the preset, with a plateau and notches that close, from rest; noise on every notch."""
    force = np.linspace(0.0, 1.6, 22)
    run = run_load_control(preset("notched-wrist-90"), force)
    rng = np.random.default_rng(3)
    notches = np.concatenate([run.notches_deg + rng.normal(0, NOISE_DEG, run.notches_deg.shape) for _ in range(trials)])
    return Record(
        drive=np.tile(force, trials), angle_deg=notches.sum(axis=1), drive_unit="N", notches_deg=notches,
        cycle=np.repeat(np.arange(1, trials + 1), force.size), tube=TUBE, notch=NOTCH,
    )  # fmt: skip


def driven(**known) -> Record:
    """Three equal cycles of the default rig with all that a chain run gives."""
    run = solve_chain(preset("du2018"), sine(2.2, 0.1, cycles=3, samples_per_cycle=40)).record
    return replace(run, rig={"preset": "du2018", "preload_N": 20.0}, **known)


def test_a_record_under_force_shows_its_whole_angle_and_starts_at_the_closure_by_geometry():
    record = wrist()
    problem = known_rig_problem([record])
    assert problem.scale.joint_deg == pytest.approx(record.angle_deg.max() / 5, rel=1e-9)
    (closure,) = [effect for effect in catalogue() if effect.name == "notch_closure"]
    angles = [start["angle_deg"] for form in problem.forms(closure) for start in problem.starts(form)]
    # width over (outer radius + neutral offset), York et al. 2015: 19.0 deg, measured 19.1 (docs/validation/wrists.md)
    assert min(abs(angle - 18.95) for angle in angles) < 0.01


def test_a_drive_that_goes_one_way_from_zero_shows_its_whole_angle():
    angle = np.linspace(7.0, 47.0, 41)
    assert _reach_deg(Record(drive=np.linspace(0.0, 2.2, 41), angle_deg=angle)) == 40.0
    assert _reach_deg(Record(drive=np.linspace(-2.2, 2.2, 41), angle_deg=angle)) == 20.0  # its zero may be anywhere
    assert _reach_deg(Record(drive=np.linspace(1.0, 2.2, 41), angle_deg=angle)) == 20.0


def test_channels_are_what_the_chain_gives_at_their_weights():
    """By a second way: the chain itself, run outside of the problem; cycles that repeat are run once in the problem."""
    record = driven()
    problem = known_rig_problem([record])
    names = [channel.name for channel in problem.channels]
    assert names == [f"notch_{k}" for k in range(1, 15)] + ["tension_a", "tension_b", "tip_along", "tip_across"]
    series = problem.predict_series(problem.start, ())
    rig = problem.rig(problem.runs[0][0], problem.start, ())
    whole = solve_chain(rig, sine(2.2, 0.1, cycles=3, samples_per_cycle=40)).record
    wanted = [whole.angle_deg, *whole.notches_deg.T, whole.tension_a_N, whole.tension_b_N, *whole.tip_mm.T]
    for own, there in zip(series, wanted, strict=True):
        assert np.abs(own - there).max() < 1e-6
    assert np.abs(series[0] - problem.predict(problem.start, ())[0]).max() < 1e-9
    model = Model(problem)
    errors = model.errors(model.coordinates(problem.start, []))
    weight = float(np.ptp(record.angle_deg) / np.ptp(record.tension_a_N))
    assert np.abs(errors[15] - weight * (whole.tension_a_N - record.tension_a_N)).max() < 1e-5
    assert np.abs(errors[1] - (whole.notches_deg[:, 0] - record.notches_deg[:, 0])).max() < 1e-6


def test_a_channel_that_the_rig_does_not_give_is_left_out_with_a_word():
    few = driven(notches_deg=np.zeros((driven().drive.size, 3)), tension_b_N=None, tip_mm=None)
    problem = known_rig_problem([few])
    assert [channel.name for channel in problem.channels] == ["tension_a"]
    assert problem.channel_words == ("notch angles are not fitted: the records have 3, the rig has 14 joints",)
    both = known_rig_problem([driven(), replace(driven(), tension_a_N=None, tip_mm=None)])
    assert "tension_a is not fitted: not all records have it" in both.channel_words
    bare = driven(notches_deg=None, tension_a_N=None, tension_b_N=None, tip_mm=None)
    assert known_rig_problem([bare]).channels == ()


def test_tensions_of_a_record_reach_the_fit():
    """A tension that another friction made moves the parameters; the angle alone leaves them."""
    record = driven(notches_deg=None, tension_b_N=None, tip_mm=None)
    rig = replace(preset("du2018"), friction=replace(preset("du2018").friction, capstan_coefficient=0.2))
    other = solve_chain(rig, sine(2.2, 0.1, cycles=3, samples_per_cycle=40)).record
    rubbed = replace(record, tension_a_N=other.tension_a_N)

    def capstan(one: Record) -> float:
        problem = known_rig_problem([one])
        model = Model(problem)
        found = fit(model, divide_records(problem.records), model.coordinates(problem.start, []), threads=1)
        return model.values(found.x)[0]["capstan_coefficient"]

    alone, together = capstan(replace(record, tension_a_N=None)), capstan(rubbed)
    assert together > alone + 0.02


def test_the_action_of_an_effect_is_that_on_the_angle_where_channels_are_fitted_too():
    """Simulated records have tensions and notch angles; the part that parameters absorb by least squares of numpy."""
    problem = known_rig_problem([driven(notches_deg=None, tip_mm=None)])
    model = Model(problem)
    holdout = divide_records(problem.records).everything()
    found = fit(model, holdout, model.coordinates(problem.start, []), threads=1)
    backlash = next(effect for effect in catalogue() if effect.name == "backlash")
    added = AddedEffect(backlash, problem.forms(backlash)[0])
    values = problem.starts(added.form)[0]
    with_it = Model(problem, (added,))
    change = holdout.stacked(with_it.errors(with_it.coordinates(model.values(found.x)[0], [values])))
    change = change - holdout.stacked(model.errors(found.x))
    jacobian = np.vstack([found.jacobian, found.channels.jacobian])
    absorbed = jacobian @ np.linalg.lstsq(jacobian, change, rcond=None)[0]
    angle = (change - absorbed)[: problem.records[0].angle_deg.size]
    assert action_deg(found, added, values) == pytest.approx(np.sqrt(np.mean(angle**2)), rel=0.02)


def drifting(rate_deg_s: float, tension_noise_N: float) -> Record:
    """Cycles of the default rig with both tensions, in a sensor of the angle that drifts."""
    run = solve_chain(preset("du2018"), sine(1.5, 0.1, cycles=3, samples_per_cycle=64)).record
    rng = np.random.default_rng(1)
    tensions = {f"tension_{k}_N": getattr(run, f"tension_{k}_N") + rng.normal(0, tension_noise_N, run.drive.size)
                for k in "ab"}  # fmt: skip
    angle = run.angle_deg + rng.normal(0, 0.05, run.drive.size) + rate_deg_s * run.time_s
    rig = {"preset": "du2018", "preload_N": 20.0}
    return replace(run, angle_deg=angle, notches_deg=None, tip_mm=None, rig=rig, **tensions)


def test_noise_of_a_channel_counts_no_more_than_that_of_the_angle():
    """By its range a tension of 0.2 N noise would count as 2 deg, beside 0.05 of the angle."""
    weights = [known_rig_problem([drifting(0.0, noise)]).channels[0].weight for noise in (0.2, 0.1, 1e-3)]
    assert weights[0] == pytest.approx(0.05 / 0.2, rel=0.3)
    assert weights[1] == pytest.approx(0.05 / 0.1, rel=0.3)
    record = drifting(0.0, 1e-3)
    assert weights[2] == pytest.approx(np.ptp(record.angle_deg) / np.ptp(record.tension_a_N))


def test_an_angle_in_coarse_digits_does_not_take_the_weight_from_its_channels():
    """Neighbours are equal in most samples: the digit is the noise, and tensions of as much count as they are."""
    run = solve_chain(preset("du2018"), sine(0.4, 0.1, cycles=2, samples_per_cycle=600)).record
    rng = np.random.default_rng(2)
    coarse = 0.5 * np.round((run.angle_deg + rng.normal(0, 0.05, run.drive.size)) / 0.5)
    tension = run.tension_a_N + rng.normal(0, 0.02, run.drive.size)
    rig = {"preset": "du2018", "preload_N": 20.0}
    one = replace(run, angle_deg=coarse, tension_a_N=tension, tension_b_N=None, notches_deg=None, tip_mm=None, rig=rig)
    (channel,) = known_rig_problem([one]).channels
    assert channel.weight == pytest.approx(np.ptp(coarse) / np.ptp(tension), rel=0.05)


def test_of_several_amounts_the_first_one_that_acts_has_the_limit(monkeypatch):
    """Fatigue of a metal without a loop loses none of it, but keeps an angle."""
    problem = known_rig_problem([replace(driven(), notches_deg=None, tension_a_N=None, tension_b_N=None, tip_mm=None)])
    model = Model(problem)
    holdout = divide_records(problem.records).everything()
    found = fit(model, holdout, model.coordinates(problem.start, []), threads=1, most_steps=2)
    (fatigue,) = [e for e in catalogue() if e.name == "functional_fatigue"]

    def of_angle_alone(fitted, added, values):
        return np.full(found.rows.errors.size, abs(values["residual_deg"]))

    monkeypatch.setattr(detection, "_change", of_angle_alone)
    monkeypatch.setattr(detection, "_action", lambda fitted, change: detection._Action(*2 * (10.0 * change[0],)))
    (limit,) = detection_limits(found, [fatigue], 0.05)
    assert limit.parameter == "residual_deg"


@pytest.mark.parametrize("noise_N", [0.05, 0.2])
def test_an_effect_of_the_angle_s_sensor_is_named_beside_tensions_with_noise(noise_N):
    """The drift makes twice the noise; what was measured beside the angle must not hide it."""
    tried = [e for e in catalogue() if e.name in ("thermal_drift", "time_delay")]
    trace = trace_records([drifting(0.0084, noise_N)], threads=1, effects=tried)
    assert (trace.verdict, trace.names) == ("effect", ("thermal_drift",))


def test_a_detection_limit_of_the_angle_s_sensor_holds_beside_tensions():
    """A record with a third more than the limit has the effect named, one with a third of it has not."""
    tried = [e for e in catalogue() if e.name == "thermal_drift"]
    clean = trace_records([drifting(0.0, 0.05)], threads=1, effects=tried, alpha=ALPHA)
    assert clean.verdict == "none"
    needed = times_needed(clean.augmented, tried, learnt_prior(clean), ALPHA)
    (limit,) = detection_limits(clean.augmented, tried, clean.floor.deg, needed)
    above, below = (
        trace_records([drifting(k * limit.size, 0.05)], threads=1, effects=tried, alpha=ALPHA) for k in (1.35, 0.35)
    )
    assert above.names == ("thermal_drift",)
    assert not below.names


def test_plateau_and_closure_of_a_wrist_are_named_and_every_notch_has_its_figure():
    """Both laws are in the preset; the notches of this geometry close at 18.97 deg."""
    record = wrist()
    tried = ("camera_misalignment", "gravity", "notch_closure", "superelastic_plateau")
    trace = trace_records([record], threads=1, effects=[e for e in catalogue() if e.name in tried])
    assert trace.verdict == "effect"
    assert set(trace.augmented.names) == {"superelastic_plateau", "notch_closure"}
    report = trace_report(trace)
    (angle,) = [e.parameters["angle_deg"].value for e in report.effects if e.name == "notch_closure"]
    closes = np.degrees(joint_mechanics(rig_under_tendon_force(record)).closure_angle_rad)
    assert abs(angle - closes) < 0.5
    assert list(report.channels) == ["angle", *(f"notch_{k}" for k in range(1, 6))]
    assert report.channels["angle"]["after"]["heldout"] == pytest.approx(report.after.heldout.to_dict())
    for name in list(report.channels)[1:]:
        own = report.channels[name]
        assert own["rmse_deg"] < 1.5 * NOISE_DEG < own["before"]["heldout"]["rmse_deg"]
    assert any("notch 5" in sentence for sentence in in_words(report))
    assert type(report).from_dict(report.to_dict()).channels == report.channels


def test_a_curve_of_the_only_input_of_records_that_load_does_not_veto():
    problem = known_rig_problem([wrist()])
    assert all(one.only_loads for one in problem.records)
    assert not any(one.only_loads for one in known_rig_problem([driven()]).records)
    model = Model(problem)
    found = fit(model, divide_records(problem.records), model.coordinates(problem.start, []), threads=1)
    n, square = found.angle_samples, found.mean_square
    best = Smooth(("the drive",), 0.1 * square, 12, (0.9,))
    assert not beats_smooth_functions(found, best)
    assert beats_smooth_functions(found, replace(best, competitor=Smooth((), square, 2, ())))
    # a free function vetoes where it is better by what also separates names
    same = found.x.size
    for margin, stands in ((0.9, True), (1.1, False)):
        near = Smooth(("time",), square * float(np.exp(-margin * VERY_STRONG_EVIDENCE / n)), same, (0.1,))
        assert beats_smooth_functions(found, near) is stands
        assert curve_does_as_well(found, near)
