"""The sentences of a trace: what they claim, and how names, units and shares are written."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from hysteresis.fitting.uncertainty import Parameter
from hysteresis.records.metrics import leap_between_cycles
from hysteresis.records.record import Record
from validation.tracing.effect import catalogue
from validation.tracing.fitting.folds import Estimate, share
from validation.tracing.fitting.smooth import Smooth
from validation.tracing.outcome import Trace
from validation.tracing.result import (
    CandidateReport,
    DetectionLimit,
    LeapReport,
    TraceReport,
    in_words,
    share_words,
    trace_report,
)
from validation.tracing.trace import trace_records
from validation.tracing.verdict import confirmed_on_heldout


def record(leap_deg: float, name: str = "ratchet.csv", at: float = 2.25) -> Record:
    """Four cycles after a quarter; a leap at 2.25 is between two of them."""
    phase = np.arange(5 * 40 + 1) / 40
    drive = 2.0 * np.sin(2 * np.pi * phase)
    noise = np.random.default_rng(3).normal(0, 0.03, drive.size)
    angle = 10.0 * drive + noise + np.where(phase > at, leap_deg, 0.0)
    return Record(drive=drive, angle_deg=angle, time_s=10.0 * phase, source=name)


@pytest.fixture(scope="module")
def leaping() -> Trace:
    return trace_records([record(0.8)], effects=[effect for effect in catalogue() if effect.name == "thermal_drift"])


@pytest.fixture(scope="module")
def report(leaping: Trace) -> TraceReport:
    return trace_report(leaping)


def test_a_leap_is_told_before_the_effect_that_it_may_have_been_taken_for(leaping: Trace, report: TraceReport) -> None:
    found = leap_between_cycles(leaping.records[0])
    assert found is not None
    assert report.leaps == (LeapReport("ratchet.csv", abs(found.size_deg), taken_out=False),)
    named = replace(leaping, verdict="effect", augmented=leaping.candidates[0].fitted, confusable=((),))
    effects = trace_report(named).effects
    first = in_words(replace(report, verdict="effect", effects=effects))[0]
    assert first.startswith("A leap in ratchet.csv may have been taken for this effect. The residual is traced to")
    assert in_words(replace(report, verdict="effect", effects=effects, leaps=()))[0].startswith(
        "The residual is traced"
    )
    quiet = replace(leaping, floor=replace(leaping.floor, local_deg=2.0, repeats_deg=None))
    assert trace_report(quiet).leaps == ()


def test_a_leap_amid_a_cycle_is_taken_out_and_no_effect_is_named_for_it() -> None:
    """A drift explains most of such a leap, where nothing else is tried."""
    trace = trace_records([record(0.8, at=2.6)], effects=[e for e in catalogue() if e.name == "thermal_drift"])
    report = trace_report(trace)
    assert trace.verdict == "unexplained"
    assert trace.baseline.heldout_rmse_deg < 0.04  # the noise is 0.03
    assert [leap.taken_out for leap in report.leaps] == [True]
    assert report.leaps[0].size_deg == pytest.approx(0.8, rel=0.05)
    assert in_words(report)[0].startswith("Beside a leap, which was taken out, these records show no missing effect.")
    assert any(said.startswith("ratchet.csv is off by 0.") for said in in_words(report))


def test_a_sentence_that_begins_with_a_name_keeps_it(report: TraceReport) -> None:
    words = ("ratchet.csv is off", "notch_closure stiffness is at its bound", "the residual depends on time")
    said = in_words(replace(report, words=words))
    assert said[-3:] == [
        "ratchet.csv is off.",
        "notch_closure stiffness is at its bound.",
        "The residual depends on time.",
    ]


def test_none_claims_no_more_than_the_records_show(report: TraceReport) -> None:
    limit = DetectionLimit("drive_gain", "gain", 0.015, "-")
    said = in_words(replace(report, verdict="none", effects=(), detection_limits=(limit,)))
    assert said[0].startswith("These records show no missing effect.")
    assert "drive_gain from 0.015." in said[1]
    assert str(Parameter(0.015, None, None, "-")) == "0.015"
    assert str(Parameter(0.015, 0.01, 0.02, "-")) == "0.015 (0.01 to 0.02)"


def test_a_candidate_that_predicts_no_better_explains_nothing(report: TraceReport) -> None:
    error = report.before.heldout.rmse_deg
    unexplained = replace(report, verdict="unexplained", effects=(), explained_share=Estimate(0.0, 0.0, 0.02))
    for size in (1.1 * error, error):
        said = " ".join(in_words(replace(unexplained, candidates=(CandidateReport("run_in", size, 0.0),))))
        assert "No candidate predicts better than the baseline model." in said
        assert "explains 0 %" not in said


def test_a_residual_that_follows_nothing_is_said_to_be_left(leaping: Trace) -> None:
    errors = [np.full(error.size, 9.0) for error in leaping.baseline.errors]
    worse = replace(leaping.candidates[0].fitted, fold_errors=tuple(errors))
    named = replace(leaping, smooth=Smooth((), 1.0, 1, ()), verdict="effect", augmented=worse)
    doubted = confirmed_on_heldout(replace(named, floor=replace(named.floor, local_deg=1e-6, repeats_deg=None)))
    assert doubted.verdict == "unexplained"
    assert doubted.words[-1] == "the remaining residual follows none of the quantities that were tested"


def test_a_share_is_100_percent_only_where_nothing_is_left_above_the_noise() -> None:
    above = share([np.full(400, 100.0)], [np.full(400, 3.3)], 1.0)  # 3.3 times the noise is left
    assert above.value == pytest.approx((100.0**2 - 3.3**2) / (100.0**2 - 1.0))
    assert share_words(above).startswith("99.9 % (99.9 to 99.9 %) of the squared")
    within = share([np.full(400, 100.0)], [np.full(400, 0.9)], 1.0)
    assert share_words(within) == "all of the squared held-out error above the noise"
