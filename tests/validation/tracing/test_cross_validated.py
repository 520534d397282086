"""Play operators, folds and references, on loops by stop operators that no model of the tracer has exactly."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest
from threadpoolctl import threadpool_limits

from hysteresis.arrays import Floats
from hysteresis.records.record import Record, RecordError
from validation.tracing import trace_records
from validation.tracing.baseline.curve import curve_problem
from validation.tracing.baseline.play_operators import play_problem, spline_columns
from validation.tracing.cross_validated import play_baselines, trace_by_folds, trace_change
from validation.tracing.effect import Effect, catalogue
from validation.tracing.fitting import Model
from validation.tracing.fitting.folds import folds_of, gain, mean_square, share
from validation.tracing.next_experiment import _angle_of_curve, _most_different
from validation.tracing.result import in_words, trace_report
from validation.tracing.search.by_folds import FoldFits, fit_all
from validation.tracing.search.detection import detection_limits

NOISE_DEG = 0.02
STOPS_MM = (0.13, 0.37, 0.6, 0.9)  # limits of the stops; none is a radius of the model


def angle_of(drive: Floats) -> Floats:
    """Angle of a curve with stop operators (Iwan 1966): s moves with the drive within its limits."""
    out = 9.0 * drive + 0.5 * drive**2 - 0.25 * drive**3
    for limit in STOPS_MM:
        s, last = 0.0, drive[0]
        row = np.empty(drive.size)
        for i, x in enumerate(drive):
            s = min(limit, max(-limit, s + x - last))
            last, row[i] = x, s
        out = out + 1.5 * row
    return out


def record(name: str, seed: int, *, rate_Hz: float = 0.1, delay_s: float = 0.0, cycles: int = 5) -> Record:
    """Record of cycles of decaying amplitude, which nest."""
    time = np.arange(0.0, cycles / rate_Hz, 1.0 / (90 * rate_Hz))
    drive = 2.0 * np.exp(-0.12 * time * rate_Hz) * np.sin(2 * np.pi * rate_Hz * time)
    angle = angle_of(drive)
    noise = NOISE_DEG * np.random.default_rng(seed).normal(size=time.size)
    late = np.interp(time - delay_s, time, angle)
    return Record(drive=drive, angle_deg=late + noise, drive_unit="mm", time_s=time, source=name)


COMPETITORS = (
    "viscous_drag",
    "tendon_creep",
    "tendon_slack",
    "wheel_eccentricity",
    "thermal_drift",
    "stribeck_friction",
)
"""Effects of the time and of the loops. The whole catalogue is tried in the scores."""


@pytest.fixture(autouse=True)
def one_blas_thread() -> Iterator[None]:
    """As in ``trace_records``: the matrices are small, and threads would wait for each other."""
    with threadpool_limits(1, user_api="blas"):
        yield


def some(*names: str) -> list[Effect]:
    return [effect for effect in catalogue() if effect.name in names]


@pytest.fixture(scope="module")
def slow_and_fast() -> list[Record]:
    return [record("slow", 1), record("faster", 2, rate_Hz=0.2), record("fast", 3, rate_Hz=0.4)]


def test_loops_that_nest_are_predicted_by_plays_and_not_by_bouc_wen(slow_and_fast: list[Record]) -> None:
    plays = play_baselines(slow_and_fast)
    assert plays is not None
    span = float(np.ptp(slow_and_fast[0].angle_deg))
    assert plays.heldout_deg < 0.005 * span
    bouc_wen = fit_all(Model(curve_problem(slow_and_fast, elements=1)))
    assert bouc_wen.rmse_deg > 2 * plays.heldout_deg  # though of samples that it was fitted to


def test_no_sample_of_a_fold_is_fitted(slow_and_fast: list[Record]) -> None:
    problem = play_problem(slow_and_fast, powers=0)
    fitted, folds = fit_all(Model(problem)), folds_of(problem.records)
    assert np.all(sum(fold.test[0].astype(int) for fold in folds) == 1)
    spoiled = [one if i != 1 else replace(one, angle_deg=-one.angle_deg) for i, one in enumerate(slow_and_fast)]
    other = fit_all(Model(play_problem(spoiled, powers=0)))
    start = replace(other, x=fitted.x)
    mine = FoldFits(folds).fitted(fitted, folds[1])
    with_spoiled = FoldFits(folds).fitted(start, folds[1])
    assert mine is not None
    assert with_spoiled is not None
    # the scale of the coefficients is the largest range of all records, which the sign does not change
    assert with_spoiled.x == pytest.approx(mine.x, abs=1e-6)


def again() -> list[Record]:
    """Two records of the same curve and loop, at other rates than those of the reference."""
    return [record("again", 21), record("again fast", 22, rate_Hz=0.4)]


def test_a_delay_is_named_with_its_size(slow_and_fast: list[Record]) -> None:
    late = [
        record(f"{one.source} late", 10 + i, rate_Hz=0.1 * 2**i, delay_s=0.05) for i, one in enumerate(slow_and_fast)
    ]
    plays = play_baselines(late)
    assert plays is not None
    trace = trace_by_folds(plays, some("time_delay", *COMPETITORS), lambda *_: None)
    assert "time_delay" in {*trace.names, *(name for names in trace.confusable for name in names)}
    report = trace_report(trace)
    assert report.explained_share is not None
    assert report.explained_share.value > 0.8
    assert report.after.heldout.rmse_deg < 0.5 * report.before.heldout.rmse_deg
    assert trace.names == ("time_delay",)
    assert report.effects[0].parameters["delay_s"].value == pytest.approx(0.05, rel=0.15)


@pytest.mark.slow
def test_no_change_is_none(slow_and_fast: list[Record]) -> None:
    same = trace_change(again(), slow_and_fast, some("time_delay", "backlash", *COMPETITORS), lambda *_: None)
    assert same.verdict == "none"
    assert in_words(trace_report(same))[0].startswith("Nothing has changed")


@pytest.mark.slow
def test_a_change_is_found(slow_and_fast: list[Record]) -> None:
    width = 0.15
    loose = [replace(one, angle_deg=angle_of(_play(one.drive, width / 2)) + _noise(one, 5)) for one in again()]
    shown = some("backlash", "preloaded_play", "viscous_drag", "wheel_eccentricity")
    changed = trace_records(loose, reference=slow_and_fast, effects=shown)
    report = trace_report(changed)
    assert report.reference == ("slow", "faster", "fast")
    assert report.records == ("again", "again fast")
    assert "backlash" in {*changed.names, *(name for names in changed.confusable for name in names)}
    assert changed.names == ("backlash",)
    (found,) = report.effects[0].parameters.values()
    assert found.value == pytest.approx(width, rel=0.2)


@pytest.mark.slow
def test_what_the_reference_shows_as_well_is_no_change() -> None:
    late = [record("a", 31, delay_s=0.05), record("b", 32, rate_Hz=0.2, delay_s=0.05)]
    fast = [record("c", 33, rate_Hz=0.8, delay_s=0.05)]
    near = some("time_delay", "viscous_drag", "tendon_creep", "backlash", "tendon_slack", "drive_gain")
    trace = trace_change(fast, late, near, lambda *_: None)
    assert "time_delay" not in trace.names
    assert trace.verdict == "none"


@pytest.mark.slow
def test_a_reference_under_a_force_is_refused(slow_and_fast: list[Record]) -> None:
    under_force = replace(slow_and_fast[0], drive_unit="N")
    with pytest.raises(RecordError, match=r"drive.unit = N"):
        trace_records([under_force], reference=[under_force])
    with pytest.raises(RecordError, match="expected mm"):
        trace_records([slow_and_fast[0]], reference=[replace(slow_and_fast[1], drive_unit="deg")])


def test_the_spline_goes_on_straight() -> None:
    x = np.linspace(-3.0, 3.0, 61)
    columns = spline_columns(x, -1.0, 1.0, 8)
    assert columns.sum(axis=1) == pytest.approx(1.0)  # partition of unity
    outside = columns[x >= 1.0 - 1e-9]
    assert np.abs(np.diff(outside, 2, axis=0)).max() < 1e-9


def test_the_largest_of_several_amplitudes_is_predicted_by_a_straight_curve() -> None:
    """A spline over the whole range would have coefficients there that no training sample tells: 5.8 deg."""
    time = np.arange(0.0, 20.0, 0.02)
    records = []
    for seed, amplitude in enumerate((1.0, 1.4, 1.8)):
        drive = amplitude * np.sin(2 * np.pi * 0.1 * time)
        noise = NOISE_DEG * np.random.default_rng(seed).normal(size=time.size)
        angle = angle_of(drive) + 0.3 * np.sin(4.0 * drive)
        records.append(Record(drive=drive, angle_deg=angle + noise, drive_unit="mm", time_s=time, source=str(seed)))
    plays = play_baselines(records)
    assert plays is not None
    largest = plays.fits.folds[-1]
    for shape in plays.fitted:
        errors = np.concatenate(plays.fits.errors(shape, largest))
        assert np.sqrt(np.mean(errors**2)) < 0.6


def test_models_of_other_columns_are_compared_at_a_program() -> None:
    """Where one beside constant widths competes with one beside widths that depend on the position."""
    records = [record("a", 0), record("b", 1, rate_Hz=0.2)]
    fitted = [fit_all(Model(play_problem(records, powers=powers, curve=curve))) for powers, curve in ((0, 6), (1, 12))]
    for first, other in (fitted, fitted[::-1]):
        found = _most_different(SimpleNamespace(baseline=first, records=records, reference=0), [first, other])  # type: ignore[arg-type]
        assert found is not None
        trial, (difference,) = found
        for one in fitted:
            off = _angle_of_curve(one, 0, trial) - angle_of(trial.drive)
            assert off[off.size // 2 :].std() < 0.3  # once the start is forgotten, but for a zero
        assert 0.0 < difference < 1.0


def test_gain_and_share_by_hand() -> None:
    before, after = [np.full(400, 0.5)], [np.full(400, 0.3)]
    better = gain(before, after)
    assert (better.value, better.low, better.high) == pytest.approx((0.16, 0.16, 0.16))
    assert not gain(before, before).is_positive
    part = share(before, after, 0.1)
    assert part.value == pytest.approx((0.25 - 0.09) / (0.25 - 0.01))
    assert mean_square([np.array([3.0, 4.0])]) == 12.5


def _play(drive: Floats, radius: float) -> Floats:
    out, p = np.empty(drive.size), drive[0]
    for i, x in enumerate(drive):
        p = max(x - radius, min(x + radius, p))
        out[i] = p
    return out


def _noise(one: Record, seed: int) -> Floats:
    return NOISE_DEG * np.random.default_rng(seed).normal(size=one.drive.size)


@pytest.mark.slow
def test_a_detection_limit_is_where_an_effect_begins_to_be_named(slow_and_fast: list[Record]) -> None:
    plays = play_baselines(slow_and_fast)
    assert plays is not None
    effects = some("time_delay", "viscous_drag", "thermal_drift", "backlash", "tendon_slack")
    clean = trace_by_folds(plays, effects, lambda *_: None)
    limits = {one.name: one for one in detection_limits(clean.augmented, effects, clean.floor.deg)}
    delay_s = limits["time_delay"].size
    assert limits["time_delay"].parameter == "delay_s"

    def names(size_s: float) -> set[str]:
        late = [record(f"{i}", 40 + i, rate_Hz=0.1 * 2**i, delay_s=size_s) for i in range(3)]
        baselines = play_baselines(late)
        assert baselines is not None
        trace = trace_by_folds(baselines, effects, lambda *_: None)
        return {*trace.names, *(name for near in trace.confusable for name in near)}

    assert "time_delay" in names(2.0 * delay_s)
    assert "time_delay" not in names(0.25 * delay_s)


@pytest.mark.slow
@pytest.mark.parametrize(("name", "change"), [
    ("camera_misalignment", lambda one: replace(one, angle_deg=1.05 * one.angle_deg)),
    ("drive_gain", lambda one: replace(one, drive=one.drive / 1.05)),
])  # fmt: skip
def test_a_gain_that_changed_is_found_against_a_reference_alone(name, change, slow_and_fast: list[Record]) -> None:
    again = [change(record("again", 21)), change(record("again fast", 22, rate_Hz=0.4))]
    tried = some("camera_misalignment", "drive_gain", "gravity", "tip_load", "preload_loss")
    trace = trace_change(again, slow_and_fast, tried, lambda *_: None)
    assert name in {*trace.names, *(one for names in trace.confusable for one in names)}
    alone = play_problem(again)
    (effect,) = some(name)
    needs = [form.form.needs for form in alone.forms(effect)]
    assert frozenset({"reference"}) not in needs


@pytest.mark.slow
def test_constants_without_sense_are_no_candidates(slow_and_fast: list[Record]) -> None:
    """A camera that reads a third more is shown by no fold: a gain of 1.3 is another unit, not a camera."""
    again = [replace(one, angle_deg=1.3 * one.angle_deg) for one in slow_and_fast[:2]]
    trace = trace_change(again, slow_and_fast, some("camera_misalignment"), lambda *_: None)
    assert trace.names == ()


@pytest.mark.slow
def test_a_channel_that_is_logged_too_slowly_is_left_out_in_a_word():
    """Readings that are held are thinned to their updates; one of six is too few of these."""
    slow = record("slow", 1, cycles=6)
    tension = 10.0 + 3.0 * slow.drive + 0.05 * np.random.default_rng(4).normal(size=slow.drive.size)
    held = tension[np.arange(tension.size) // 6 * 6]
    plays = play_baselines([slow])
    assert plays is not None
    trace = trace_by_folds(plays, some("thermal_drift"), print)
    assert not trace.channel_fits
    trace = trace_by_folds(play_baselines([replace(slow, tension_a_N=held)]), some("thermal_drift"), print)
    assert not trace.channel_fits
    assert any(words.startswith("tension_a is not fitted: too few readings or cycles") for words in trace.words)
    plays = play_baselines([replace(slow, tension_a_N=tension)])
    (fit,) = trace_by_folds(plays, some("thermal_drift"), print).channel_fits
    assert fit.fitted.rmse_deg < 1.2 * fit.fitted.heldout_rmse_deg  # of the model that the folds chose


def test_the_program_to_distinguish_is_that_of_a_new_record_though_the_reference_is_wider(monkeypatch):
    """A change does not act on the reference: its program distinguishes nothing."""
    seen = []

    def altered(problem, widest):
        seen.append(widest)
        return iter(())

    monkeypatch.setattr("validation.tracing.next_experiment._altered", altered)
    narrow, wide = record("new", 1), record("old", 2)
    narrow = replace(narrow, drive=0.9 * narrow.drive)
    plays = play_baselines([narrow, wide])
    assert plays is not None
    trace = SimpleNamespace(records=[narrow, wide], reference=1, baseline=plays.fitted[0])
    assert _most_different(trace, [plays.fitted[0]]) is None
    assert seen == [0]


def test_words_on_the_sensor_are_there_with_a_reference(monkeypatch):
    monkeypatch.setattr("validation.tracing.trace.sensor_words", lambda records, noise: (f"{len(records)} seen",))
    trace = trace_records([record("new", 1)], reference=[record("old", 2)], effects=some("thermal_drift"), threads=1)
    assert trace.words[-1] == "2 seen"
