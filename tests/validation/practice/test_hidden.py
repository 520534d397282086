"""Changes hidden in labels: each is what a rig with the effect would have logged, exactly."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from hysteresis import Record
from hysteresis.laws.prandtl_ishlinskii import plays
from hysteresis.records.record import RecordError
from hysteresis.records.record_file import read_record
from validation.measured import measured_folder
from validation.practice.hidden import GROUPS, draw_hidden_case
from validation.practice.hidden.changes import CHANGES, OUTSIDE
from validation.practice.hidden.curve_with_plays import change_beyond_curve, fit_curve_with_plays
from validation.practice.hidden.draw import RATIOS, groups_of, nth, sized
from validation.practice.hidden.labels import STEADY, delayed, drifted, leapt, lost, run_out, with_play
from validation.tracing.baseline.play_operators import play_problem
from validation.tracing.cross_validated import play_baselines, trace_by_folds
from validation.tracing.effect import catalogue
from validation.tracing.fitting import Model
from validation.tracing.search.by_folds import fit_all, front_runners


def rig_angle(drive):
    """A rig with friction: half a curve, half a play through one."""
    return 8.0 * drive + 0.3 * drive**2 + 6.0 * plays(drive, [0.25 * np.ptp(drive) / 2])[0]


@pytest.fixture
def record():
    time = np.linspace(0.0, 40.0, 1601)
    drive = (2.0 - 0.02 * time) * np.sin(2 * np.pi * 0.1 * time)
    noise = np.random.default_rng(1).normal(0.0, 0.05, time.size)
    return Record(drive=drive, angle_deg=rig_angle(drive) + noise, time_s=time, tension_a_N=5 + drive)


def test_delay_puts_an_angle_beside_a_later_drive(record):
    late = delayed(record, 0.5)
    steps = 20  # of 0.025 s
    np.testing.assert_array_equal(late.angle_deg, record.angle_deg[:-steps])
    np.testing.assert_allclose(late.drive, record.drive[steps:], atol=1e-9)
    np.testing.assert_allclose(late.tension_a_N, record.tension_a_N[steps:], atol=1e-9)  # it has the drive's clock
    np.testing.assert_array_equal(late.time_s, record.time_s[:-steps])
    with pytest.raises(RecordError, match="expected a record with times"):
        delayed(replace(record, time_s=None), 0.5)


def test_drift_leap_and_loss_add_what_they_say(record):
    np.testing.assert_allclose(drifted(record, 0.2).angle_deg - record.angle_deg, 0.2 * record.time_s, atol=1e-12)
    leap = leapt(record, 0.5, -3.0).angle_deg - record.angle_deg
    np.testing.assert_allclose(leap[[0, 800, 801, -1]], [0.0, 0.0, -3.0, -3.0], atol=1e-12)
    loss = lost(record, 0.25, 0.1)
    np.testing.assert_allclose((loss.drive - record.drive)[[400, 401]], [0.0, 0.1], atol=1e-12)
    np.testing.assert_array_equal(loss.angle_deg, record.angle_deg)


def test_wheel_that_runs_out_winds_what_the_tendon_moved(record):
    changed = run_out(record, 0.2, 0.5, 0.7)
    x = changed.drive
    wound = x + 0.2 * (np.sin(x / 0.5 + 0.7) - np.sin(0.7))
    np.testing.assert_allclose(wound, record.drive, atol=1e-12)
    assert np.abs(x - record.drive).max() > 0.2
    with pytest.raises(ValueError, match="less than the radius"):
        run_out(record, 0.6, 0.5, 0.0)


def test_play_hands_on_the_drive_that_was_measured(record):
    width = 0.3
    changed = with_play(record, width)
    handed_on = plays(changed.drive, [width / 2], start=[record.drive[0]])[0]
    # every measured sample is there, in its order, and the play hands on its drive
    own = np.flatnonzero(np.diff(changed.angle_deg, prepend=np.nan) != 0)
    np.testing.assert_array_equal(changed.angle_deg[own], record.angle_deg)
    kept = np.isin(changed.angle_deg, record.angle_deg)
    assert kept.all()
    np.testing.assert_allclose(handed_on[own][1:], record.drive[1:], atol=STEADY * np.ptp(record.drive))
    assert (np.diff(changed.time_s) > 0).all()
    reversals = 8
    put_in = changed.drive.size - record.drive.size
    assert reversals * 5 < put_in < reversals * 60
    assert np.ptp(changed.drive) == pytest.approx(np.ptp(record.drive) + width, abs=1e-9)


def test_size_beyond_a_curve_is_that_of_the_change(record):
    baseline = fit_curve_with_plays([record])
    assert baseline.level_deg == pytest.approx(0.05, rel=0.1)  # nothing but the noise is left
    # steady drift over a decaying sine: its own deviation, as a curve of the drive takes little of it
    drift = change_beyond_curve(baseline, [drifted(record, 0.05)])
    assert drift == pytest.approx(0.05 * 40 / np.sqrt(12), rel=0.1)
    # a play shifts the angle by half its width on either way, at the slope of the curve
    line = replace(record, angle_deg=8.0 * record.drive + (record.angle_deg - rig_angle(record.drive)))
    play = change_beyond_curve(fit_curve_with_plays([line]), [with_play(line, 0.04)])
    assert play == pytest.approx(8.0 * 0.02, rel=0.1)
    assert change_beyond_curve(baseline, [record]) == pytest.approx(0.0, abs=1e-6)


@pytest.mark.parametrize("name", CHANGES)
def test_sizes_are_those_that_were_asked_for(record, name):
    baseline, rng = fit_curve_with_plays([record]), np.random.default_rng(3)
    change, ratio = sized([record], CHANGES[name]([record], rng), 3.0, baseline)
    assert ratio == pytest.approx(3.0, rel=0.06)
    found = change_beyond_curve(baseline, change.records([record])) / baseline.level_deg
    assert found == pytest.approx(ratio, rel=1e-9)


def test_folder_without_records_is_refused(tmp_path: Path):
    with pytest.raises(RecordError, match="no measured records"):
        groups_of(tmp_path)
    with pytest.raises(RecordError, match="no record of the group davinci"):
        draw_hidden_case(tmp_path, 1, "davinci", "leap", 0)


@pytest.mark.skipif(not measured_folder().is_dir(), reason="no measured records")
def test_measured_records_get_forty_cases_of_all_kinds():
    assert groups_of(measured_folder()) == [*GROUPS]
    drawn = [nth(measured_folder(), 5, number) for number in range(0, 40, 7)]
    assert len({one.group for one in drawn}) == 5
    for one in drawn:
        assert RATIOS[0] * 0.9 <= one.case.truth.ratios[0] <= RATIOS[1] * 1.1
        assert one.case.truth.effects == (() if one.change in OUTSIDE else (one.change,))
        assert any(a != b for a, b in zip(one.case.records, one.control, strict=True))
    again = nth(measured_folder(), 5, 7)
    assert again.case.records == drawn[1].case.records


@pytest.mark.slow
@pytest.mark.skipif(not measured_folder().is_dir(), reason="no measured records")
def test_drift_hides_which_baseline_predicts_best_and_is_named_beside_it():
    """Plays whose width varies along the stroke predict this record; with the drift, constant ones seem to."""
    case = draw_hidden_case(measured_folder(), 9351, "manipulator", "thermal_drift", 19).case
    baselines = play_baselines(case.records)
    assert baselines is not None
    trace = trace_by_folds(baselines, catalogue(), lambda *_: None)
    rate = trace.augmented.model.values(trace.augmented.x)[1][0]["deg_per_s"]
    assert trace.names == ("thermal_drift",)
    assert rate == pytest.approx(case.truth.numbers["thermal_drift"]["deg_per_s"], rel=0.25)
    assert trace.augmented.heldout_rmse_deg < 0.3 * trace.baseline.heldout_rmse_deg


@pytest.mark.skipif(not measured_folder().is_dir(), reason="no measured records")
def test_steady_drift_is_not_lost_to_one_towards_a_limit_that_makes_no_sense():
    """Of these records the best start is that of a drift towards 43 deg: more than the whole motion."""
    paths = sorted(measured_folder().glob("catheter-taut-*.csv"))
    records = [drifted(read_record(path), 0.184) for path in paths]
    baseline = fit_all(Model(play_problem(records, powers=1, curve=12)))
    effects = [effect for effect in catalogue() if effect.name == "thermal_drift"]
    (found,) = front_runners(baseline, effects, lambda *_: None)
    assert found.model.values(found.x)[1][0]["deg_per_s"] == pytest.approx(0.184, rel=0.1)
