"""Rules of the tracer's fits and folds by definition, on few samples that are counted by hand."""

from __future__ import annotations

import math
from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest

from fem_models.rig.checks import SolverError
from hysteresis.records.record import Record
from validation.tracing import verdict
from validation.tracing.effect import SampleInputs
from validation.tracing.fitting import dependence, evidence, folds, noise, ranking, smooth
from validation.tracing.fitting.channel_errors import (
    ChannelFit,
    _errors,
    channel_table,
    channel_words,
    with_channel_fits,
)
from validation.tracing.fitting.criterion import bic, independent_samples, lag_one_correlation
from validation.tracing.fitting.fitted import ChannelErrors, Fitted, rms
from validation.tracing.fitting.folds import Fold, folds_of, gain, has_folds, log_score, mean_square, share
from validation.tracing.fitting.holdout import Holdout, _same, divide_records, protocol
from validation.tracing.fitting.least_squares import differentiate, fit, solve
from validation.tracing.fitting.noise import NoiseFloor, estimate_noise_floor
from validation.tracing.fitting.regressors import direction, distance_since_reversal, even, odd, rate, spline
from validation.tracing.prepared import prepared
from validation.tracing.search import by_folds, still_zone
from validation.tracing.search.by_folds import FoldFits
from validation.tracing.settings import AT_FLOOR, AT_NOISE, SIGNIFICANT

NOISE = NoiseFloor(local_deg=0.1, repeats_deg=None)


def one_record(samples=40, cycles=1, **more):
    """A record of triangles from 0 to 1 and back, so many samples a cycle."""
    k = np.arange(samples * cycles)
    drive = 1 - np.abs((k % samples) / (samples / 2) - 1)
    return prepared(Record(drive=drive, angle_deg=10 * drive + 0.01 * (k % 3), cycle=1 + k // samples, **more), k)


# --- criterion -----------------------------------------------------------------------------------------------------


def test_the_criterion_and_the_samples_that_it_counts():
    assert bic(math.e, 3, 100.0) == pytest.approx(100 + 3 * math.log(100))
    assert bic(0.0, 0, 1.0) == pytest.approx(math.log(1e-300))
    assert lag_one_correlation([np.array([1.0, 1.0]), np.array([1.0, 1.0, 0.0])]) == 0.5
    assert lag_one_correlation([np.ones(1000)]) == 0.99
    assert lag_one_correlation([np.array([1.0, -1.0])]) == 0.0
    assert lag_one_correlation([np.zeros(3)]) == 0.0
    assert independent_samples(90, 0.5, 2) == 30.0
    assert independent_samples(90, 0.5, 5) == 40.0  # eight a branch
    assert independent_samples(20, 0.5, 5) == 20.0


# --- folds ---------------------------------------------------------------------------------------------------------


def test_of_three_records_or_more_each_is_a_fold_and_a_reference_is_never_held_out():
    records = [one_record(source=f"folder/{name}.csv") for name in "abcde"]
    found = folds_of(records[:3])
    assert [one.name for one in found] == ["a.csv", "b.csv", "c.csv"]
    assert [[int(mask.sum()) for mask in one.test] for one in found] == [[40, 0, 0], [0, 40, 0], [0, 0, 40]]
    five = folds_of(records)
    assert [one.name for one in five] == ["a.csv, b.csv", "c.csv", "d.csv", "e.csv"]
    assert [int(mask.sum()) for mask in five[0].test] == [40, 40, 0, 0, 0]
    reference = folds_of(records[:4], traced=3)
    assert [[int(mask.sum()) for mask in one.test] for one in reference][2] == [0, 0, 40, 0]
    unnamed = folds_of([one_record(), one_record(), one_record()])
    assert [one.name for one in unnamed] == ["record 1", "record 2", "record 3"]


def test_of_two_records_each_half_is_a_fold_divided_between_cycles():
    """45 samples: the middle one is 22. Of three cycles of 40 the nearest start to 60 is the first of two as near."""
    whole, cut = one_record(45), one_record(40, 3)
    found = folds_of([whole, cut])
    names = ["first half of record 1", "second half of record 1", "first half of record 2", "second half of record 2"]
    assert [one.name for one in found] == names
    assert [[int(mask.sum()) for mask in one.test] for one in found] == [[22, 0], [23, 0], [0, 40], [0, 80]]
    first = found[0].training(found[3])
    assert [int(mask.sum()) for mask in first.train] == [23, 40]
    assert first.by == names[0]
    assert (has_folds([whole]), has_folds([whole, cut]), has_folds([cut]), has_folds([one_record(40, 2)])) == (
        False, True, True, False,
    )  # fmt: skip


def test_scores_of_a_fold():
    errors = [np.array([1.0, 2.0]), np.array([2.0])]
    assert mean_square(errors) == 3.0
    assert log_score(errors, 1.0) == pytest.approx(-1.5 * math.log(4.0))
    assert log_score([np.zeros(2)], 0.0) == pytest.approx(-math.log(1e-300))
    fold = Fold((np.array([True, False]), np.array([False, False])), "f")
    assert [e.tolist() for e in folds.fold_errors(SimpleNamespace(errors=[errors[0], np.zeros(2)]), fold)] == [[1.0]]


def test_gains_are_of_blocks_of_forty_samples():
    """Two blocks, one 3 deg^2 better and one 1 deg^2 worse: by two of four draws of two each. The interval is all."""
    before = [np.r_[np.full(40, 2.0), np.full(40, 1.0)]]
    after = [np.r_[np.full(40, 1.0), np.full(40, 2.0**0.5)]]
    found = gain(before, after)
    assert (found.value, found.low, found.high) == pytest.approx((1.0, -1.0, 3.0))
    assert not found.is_positive
    a, b, counts = folds._blocks([np.ones(59), np.ones(100)], [np.zeros(59), np.full(100, 2.0)])
    assert (counts.tolist(), a.tolist(), b.tolist()) == ([59, 50, 50], [59, 50, 50], [0, 200, 200])  # 100/40 is 2.5: 2
    assert folds._blocks([np.ones(19)], [np.ones(19)])[2].tolist() == [19]
    assert gain([np.ones(40)], [np.zeros(40)]).is_positive


def test_a_share_is_of_what_is_above_the_noise():
    before, after = [np.full(80, 2.0)], [np.full(80, 2.0**0.5)]
    found = share(before, after, 1.0)
    assert (found.value, found.low, found.high) == pytest.approx((2 / 3,) * 3)
    assert share(after, before, 1.0).value == 0.0
    assert share(before, after, 3.0).value == 1.0  # nothing above the noise
    assert folds._part(4.0, 4.0, 3.0) == 0.0
    low, high = folds._estimate(0.0, np.arange(1001.0)).low, folds._estimate(0.0, np.arange(1001.0)).high
    assert (low, high) == pytest.approx((25.0, 975.0))
    assert not folds.Estimate(1.0, 0.0, 2.0).is_positive


# --- held-out samples ----------------------------------------------------------------------------------------------


def test_channels_belong_to_the_records_of_their_runs():
    masks = tuple(np.arange(10) < n for n in (10, 4, 3))
    each = Holdout(masks, "by")
    assert [each.record_of(i) for i in range(9)] == [0, 1, 2] * 3
    assert len(each.series_masks(2)) == 9
    runs = Holdout(masks, "by", with_channels=(0, 2))
    assert [runs.record_of(i) for i in range(7)] == [0, 1, 2, 0, 2, 0, 2]
    assert [int(mask.sum()) for mask in runs.series_masks(2)] == [10, 4, 3, 10, 3, 10, 3]
    assert [each.is_held_out(i) for i in range(3)] == [False, False, True]  # up to 0.3
    assert runs.offset_deg(1, np.arange(10.0)) == 1.5
    assert runs.offset_deg(2, np.arange(10.0)) == 4.5
    taken = runs.without_offsets([np.arange(10.0)] * 5)
    assert [float(e[0]) for e in taken] == [-4.5, -1.5, -4.5, -4.5, -4.5]
    assert runs.everything().by == "by"


def test_a_protocol_is_preload_half_the_range_and_rate():
    timed = one_record(40, 3, time_s=10 + 0.25 * np.arange(120), rig={"preload_N": 2.5})
    found = protocol(timed)
    assert (found.preload_N, found.amplitude, found.rate_Hz) == pytest.approx((2.5, 0.5, 3 / (0.25 * 119)))
    assert math.isnan(protocol(one_record()).rate_Hz)
    approach = one_record(40, 1, time_s=np.arange(40.0))
    inputs = replace(approach.inputs, cycle=np.zeros(40, dtype=int))
    assert protocol(replace(approach, inputs=inputs)).rate_Hz == pytest.approx(1 / 39)
    for other, same in ((1.1, True), (1.12, False), (math.nan, False)):
        assert _same(1.0, other) is (_same(other, 1.0)) is same
    assert _same(math.nan, math.nan)
    assert _same(-1.0, -1.1)


def test_of_three_records_one_is_held_out_but_for_its_beginning():
    records = [one_record(40, 2, rig={"preload_N": 2.0}, source=f"x/{name}.csv") for name in "ab"]
    small = prepared(
        Record(0.5 * records[0].record.drive, records[0].record.angle_deg, rig={"preload_N": 2.0}), np.arange(80)
    )
    found = divide_records([records[0], small, records[1]])
    assert [int(mask.sum()) for mask in found.train] == [80, 4, 80]  # 5 % of 80
    assert found.train[1][:4].all()
    assert found.by.startswith("record 2, whose protocol differs from those fitted; its first 5 % (its initial state)")
    two = divide_records(records)
    assert [int(mask.sum()) for mask in two.train] == [40, 40]
    assert two.by == "cycle 2, predicted by continuing the path from the start of the record"


# --- regressors ----------------------------------------------------------------------------------------------------


def test_regressors_by_definition():
    x = np.array([-2.0, 1.0])
    assert odd(x).tolist() == [[-2, -8, -32], [1, 1, 1]]
    assert even(x).tolist() == [[4, 16], [1, 1]]
    drive = np.array([0.0, 1, 2, 1, 0, 1])
    assert direction(drive).tolist() == [1, 1, 1, -1, -1, 1]
    assert distance_since_reversal(drive).tolist() == [0, 1, 2, 1, 2, 1]
    assert rate(SampleInputs(drive, 0.5 * np.arange(6.0), np.ones(6, dtype=int), True)).tolist() == [2, 2, 0, -2, 0, 2]
    two = spline(np.array([0.0, 0.25, 1.0, 9.0]), 0, 1, 2)
    assert two.tolist() == [[1, 0], [0.75, 0.25], [0, 1], [0, 1]]  # lines
    assert spline(np.array([0.5]), 0, 1, 4).tolist() == [[0.125, 0.375, 0.375, 0.125]]  # Bernstein polynomials
    five = spline(np.array([0.0, 0.5, 1.0]), 0, 1, 5)
    assert five.shape == (3, 5)
    assert five[1].tolist() == [0, 0.25, 0.5, 0.25, 0]  # a cubic with one knot amid


# --- least squares -------------------------------------------------------------------------------------------------


class Straight:
    """Angles a + b k of one record, errors less their mean; a channel 3 b k where it is wanted. No rig."""

    def __init__(self, slope=2.0, weight=0.0, channel=False, low=-9.0, high=9.0):
        self.k = np.arange(4.0)
        self.slope, self.channel, self.low, self.high = slope, channel, low, high
        names = ("tension",) if channel else ()
        self.problem = SimpleNamespace(channels=names, prior_weight_deg=weight)
        self.baseline_size, self.runs = 1, 0

    def bounds(self):
        return np.array([self.low]), np.array([self.high])

    def errors(self, x):
        if x[0] > 8:
            raise SolverError("no equilibrium")
        own = (x[0] - self.slope) * self.k
        return [own, 3 * own] if self.channel else [own]

    def followed(self, x):
        self.runs += 1
        return self.errors(x), None


@pytest.mark.parametrize(("weight", "expected"), [(0.0, 2.0), (5**0.5, 2.0 * 5 / (5 + 5) + 0.5 * 5 / (5 + 5))])
def test_a_prior_counts_as_an_error_from_its_mean(weight, expected):
    """Offsets taken out, the squares are 5 (b - 2)^2; the prior adds weight^2 (b - 1/2)^2."""
    model = Straight(weight=weight)
    found = fit(model, Holdout((np.ones(4, dtype=bool),), "n"), np.array([1.0]), threads=1, prior_mean=np.array([0.5]))
    assert found.x[0] == pytest.approx(expected, abs=1e-4)
    if weight:
        start = fit(model, Holdout((np.ones(4, dtype=bool),), "n"), np.array([1.0]), threads=1)
        assert start.x[0] == pytest.approx(1.5, abs=1e-4)  # the mean is the start


def test_a_fit_starts_inside_its_bounds_and_has_its_channels_apart():
    model = Straight(channel=True, low=-1.0, high=1.0)
    found = fit(model, Holdout((np.arange(4) < 3,), "n"), np.array([-5.0]), threads=1)
    assert found.x[0] == pytest.approx(1.0, abs=1e-3)
    assert (len(found.errors), len(found.channels.errors)) == (1, 1)
    np.testing.assert_allclose(found.errors[0], (found.x[0] - 2.0) * (np.arange(4.0) - 1.0), atol=1e-9)
    np.testing.assert_allclose(found.channels.errors[0], 3 * found.errors[0], atol=1e-9)
    np.testing.assert_allclose(found.jacobian[:, 0], np.arange(4.0) - 1.0, atol=1e-6)
    np.testing.assert_allclose(found.channels.jacobian[:, 0], 3 * (np.arange(4.0) - 1.0), atol=1e-6)
    with pytest.raises(SolverError):
        fit(Straight(low=8.5), Holdout((np.ones(4, dtype=bool),), "n"), np.array([8.6]), threads=1)


def test_known_columns_are_not_computed_again_and_one_without_a_solution_is_zero():
    model, holdout = Straight(), Holdout((np.ones(4, dtype=bool),), "n")
    x = np.array([1.0])
    errors = holdout.stacked(model.errors(x))
    assert differentiate(model, holdout, x, errors, 1, np.full((4, 1), 7.0)).tolist() == [[7.0]] * 4
    assert model.runs == 0
    edge = Straight(low=7.0)
    at = np.array([7.9999])  # nearer to 9 than to 7 is false: the step goes up, where there is no solution
    edge.high = 9.5
    assert differentiate(edge, holdout, at, errors, 1).tolist() == [[0.0]] * 4


def test_columns_of_any_size_are_solved_together():
    columns = np.array([[1e8, 0, 0], [0, 1e-8, 0], [0, 1e-8, 0]])
    found = solve(columns, np.array([3.0, 1.0, 2.0]))
    assert found.tolist() == pytest.approx([3e-8, 1.5e8, 0.0])


# --- a fit and its figures -----------------------------------------------------------------------------------------


def made(errors, *, channels=None, train=None, branch_counts=None, size=2, **more):
    rows = tuple(np.asarray(e, dtype=float) for e in errors)
    counts = branch_counts or [1] * len(rows)
    records = [SimpleNamespace(branch_count=n) for n in counts]
    names = () if channels is None else ("tension",)
    model = SimpleNamespace(problem=SimpleNamespace(records=records, channels=names), names=())
    masks = tuple(np.ones(e.size, dtype=bool) for e in rows) if train is None else train
    total = sum(e.size for e in rows)
    own = None
    if channels is not None:
        own = ChannelErrors(tuple(np.asarray(e, dtype=float) for e in channels), np.full((total, size), 3.0))
    return Fitted(model, Holdout(masks, "n"), np.zeros(size), rows, np.ones((total, size)), 1, own, **more)


def test_figures_of_a_fit():
    train = (np.array([True, True, False]), np.array([True, False, False]))
    one = made([[1.0, 2.0, 3.0], [4.0, -5.0, 6.0]], train=train)
    assert one.train_error_deg.tolist() == [1, 2, 4]
    assert [e.tolist() for e in one.heldout_errors] == [[3], [-5, 6]]
    assert one.heldout_error_deg.tolist() == [3, -5, 6]
    assert one.train_rmse_deg == pytest.approx(7**0.5)
    assert one.heldout_rmse_deg == pytest.approx((70 / 3) ** 0.5)
    assert (one.mean_square, one.square, one.train_square) == pytest.approx((91 / 6, 91 / 6, 7.0))
    assert one.rmse_deg == pytest.approx((91 / 6) ** 0.5)
    assert [r.tolist() for r in one.residuals][1] == [-4, 5, -6]
    assert one.bic(10.0) == pytest.approx(bic(91 / 6, 2, 10.0)) == one.angle_bic(10.0)
    assert one.train_bic(10.0) == pytest.approx(bic(7.0, 2, 10.0))
    by_folds_ = replace(one, fold_errors=(np.array([np.nan, 1.0, 2.0]), np.full(3, np.nan)))
    assert [e.tolist() for e in by_folds_.heldout_errors] == [[1, 2], []]
    assert rms(np.zeros(0)) == 0.0


def test_samples_are_counted_by_branches_of_each_series():
    """Errors that alternate are not correlated; equal ones are: (1 - r)/(1 + r) of them, or eight a branch."""
    alternating, equal = np.resize([1.0, -1.0], 100), np.ones(100)
    one = made([alternating, alternating], branch_counts=[2, 3])
    assert (one.samples, one.angle_samples, one.train_samples) == (200, 200, 200)
    half = (np.arange(100) < 50,) * 2
    same = made([equal, equal], branch_counts=[2, 3], train=half)
    assert same.samples == pytest.approx(40.0)
    # half of 5 branches are 2.5, the even number next to it 2
    assert same.train_samples == pytest.approx(16.0)
    both = made([equal], channels=[equal], branch_counts=[3], train=(np.arange(100) < 50,))
    assert (both.samples, both.angle_samples, both.train_samples) == pytest.approx((48.0, 24.0, 24.0))
    assert both.rows.errors.size == both.rows.train.size == 200
    assert both.rows.jacobian[[0, 100], 0].tolist() == [1, 3]
    assert both.square == 1.0
    assert made([[0.0, 2.0]], channels=[[4.0, 6.0]], train=(np.array([True, False]),)).train_square == 8.0


# --- evidence ------------------------------------------------------------------------------------------------------


def test_ratios_from_which_there_is_something_to_explain():
    """1.15, or 1 + 3/sqrt(m) with few samples: at 100 samples 1.3."""
    policy = SimpleNamespace(significant=1.15)
    for m, ratio in ((100, 1.3), (400, 1.15), (10000, 1.15)):
        baseline = SimpleNamespace(error_deg=np.zeros(m), rmse_deg=0.0, noise=NOISE)
        assert evidence.significant_ratio(baseline, policy) == pytest.approx(ratio)
        for part, nothing in ((0.999, True), (1.001, False)):
            baseline.rmse_deg = part * ratio * 0.1
            assert evidence.nothing_to_explain(baseline, policy) is nothing
    for part, noise_ in ((0.999, True), (1.001, False)):
        assert evidence.is_noise(SimpleNamespace(rmse_deg=part * AT_NOISE * 0.1, noise=NOISE)) is noise_


@pytest.mark.parametrize(("gained", "ratio", "worth"), [(1.01, 0.89, True), (0.99, 0.89, False), (1.01, 0.91, False)])
def test_a_further_effect_pays_for_itself_and_for_being_the_best_of_many(gained, ratio, worth):
    least = 10 + 2 * math.log(7)
    before = SimpleNamespace(bic=lambda samples: gained * least if samples == 50.0 else math.nan, square=1.0)
    after = SimpleNamespace(bic=lambda samples: 0.0, square=ratio**2, samples=50.0)
    assert evidence.is_worth_adding(before, after, 7) is worth


def test_smooth_functions_are_beaten_by_very_strong_evidence():
    effect = SimpleNamespace(angle_samples=50.0, angle_bic=lambda samples: 0.0)

    def curve(value, names=("time",), competitor=None):
        return SimpleNamespace(names=names, competitor=competitor, bic=lambda samples: value)

    assert evidence.beats_smooth_functions(effect, curve(-9.9))
    assert not evidence.beats_smooth_functions(effect, curve(-10.1))
    assert evidence.beats_smooth_functions(effect, curve(-10.1, competitor=curve(-9.9)))
    assert evidence.curve_does_as_well(effect, curve(9.9))
    assert not evidence.curve_does_as_well(effect, curve(10.1))
    assert not evidence.curve_does_as_well(effect, curve(9.9, names=()))


def test_the_best_form_of_each_set_of_effects_is_kept():
    def one(value, square, *names):
        return SimpleNamespace(names=names, square=square, samples=square, bic=lambda samples: value * samples)

    rows = [one(3, 2.0, "a", "b"), one(1, 4.0, "c"), one(2, 5.0, "b", "a")]
    assert [g.names for g in evidence.ranked_models(rows)] == [("c",), ("b", "a")]
    assert evidence.ranked_models([]) == []


# --- noise ---------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(("branch", "count", "known"), [(3, 9, False), (4, 4, False), (4, 5, True), (5, 3, True)])
def test_noise_is_known_from_five_third_differences_in_branches_of_four_samples(branch, count, known):
    """So many branches of so many samples: a branch of four has one third difference, one of five has two."""
    step = branch - 1
    k = np.arange(step * count + 1)
    drive = np.abs((k / step + 1) % 2 - 1)
    one = prepared(Record(drive=drive, angle_deg=np.sin(3.7 * k) * 10, cycle=np.ones(k.size, dtype=int)), k)
    residual = 2.0 * (-1.0) ** k
    floor = estimate_noise_floor([one], [residual])
    assert floor.local_known is known
    row = residual - residual.mean()
    expected = 1.4826 * 16 / 20**0.5 if known else (row @ row / row.size) ** 0.5
    assert floor.local_deg == pytest.approx(expected, rel=1e-9)


def test_what_the_floor_is_and_where_it_is_from():
    known = NoiseFloor(0.2, 0.1)
    assert (known.deg, known.sensor_deg) == (0.1, 0.2)
    assert known.how == "cycles or trials that repeat each other"
    assert replace(known, by_repeats=True, repeats_deg=0.3).deg == 0.3
    assert replace(known, reference_deg=0.15).deg == 0.15
    assert replace(known, reference_deg=0.15).how == "the residual that the reference leaves"
    assert replace(known, reference_deg=0.05).deg == 0.1
    unknown = replace(known, local_known=False)
    assert (unknown.known, unknown.sensor_deg) == (False, None)
    assert unknown.how == "cycles or trials that repeat each other, by noise or by a drift"
    assert replace(unknown, by_repeats=True).known
    assert replace(unknown, reference_deg=0.1).known
    assert not replace(unknown, reference_deg=0.09).known
    assert not replace(unknown, by_repeats=True, repeats_deg=None).known
    assert replace(unknown, repeats_deg=None).how == "the whole residual: the noise is not known"
    assert NOISE.how == "neighbouring samples"


@pytest.mark.parametrize(
    ("found", "repeats", "local", "known", "expected"),
    [
        (None, 0.7, 0.34, True, 0.7),  # the residual, 1 deg, is within 3 times the noise of neighbours
        (None, 0.7, 0.33, True, None),
        (None, 0.7, 0.34, False, None),
        (0.9, 0.7, 0.1, True, 0.7),
        (1.29, None, 0.1, True, 1.29),
        (1.31, None, 0.1, True, None),  # more than 1.3 times the residual is structure
        (1.31, 0.7, 0.1, True, None),
        (None, None, 0.9, True, None),
    ],
)
def test_noise_of_a_sensor_is_what_cycles_differ_by_where_it_wanders_or_is_correlated(
    monkeypatch, found, repeats, local, known, expected
):
    monkeypatch.setattr(noise, "estimate_noise_floor", lambda *given: NoiseFloor(local, None, local_known=known))
    monkeypatch.setattr(noise, "correlated_noise_deg", lambda *given: found)
    monkeypatch.setattr(noise, "repeatability_deg", lambda *given: repeats)
    assert noise.sensor_noise_deg([], [np.array([3.0, 1.0]), np.array([-4.0, -6.0])]) == expected


@pytest.mark.parametrize(
    ("sizes", "found"), [((1.0, 1.21, 1.3, 1.4), True), ((1.0, 1.19, 1.3, 1.4), False), ((1, 1.3, 2.48, 2.5), False),
                         ((1, 1.3, 2.46, 2.5), True), ((1, 1.89, 2, 2.1), True), ((1, 1.91, 2, 2.1), False),
                         ((1, 1.3, math.nan, 1.4), False)],
)  # fmt: skip
def test_noise_is_correlated_between_white_and_smooth(monkeypatch, sizes, found):
    """By samples twice as far apart, the third differences grow by 1.2 at first, and by 1.9 at most."""
    of = dict(zip((1, 2, 4, 8), sizes, strict=True))
    monkeypatch.setattr(noise, "_third_difference_deg", lambda records, residuals, apart: of[apart])
    assert (noise.correlated_noise_deg([], []) is not None) is found


# --- dependence and smooth functions -------------------------------------------------------------------------------


def test_whiteness_counts_records_of_forty_samples():
    """Of errors that alternate, r_k^2 is (1 - k/m)^2 for each of ten lags."""
    for m, counted in ((40, True), (39, False)):
        row = np.resize([1.0, -1.0], m)
        k = np.arange(1, 11)
        total = m * (m + 2) * np.sum((1 - k / m) ** 2 / (m - k))
        expected = 1.0
        if counted:  # the chi square law of ten degrees: exp(-x/2) sum of (x/2)^j / j!
            half = total / 2
            expected = math.exp(-half) * sum(half**j / math.factorial(j) for j in range(5))
        assert dependence._portmanteau([row]) == pytest.approx(expected, rel=1e-6)
    assert dependence._portmanteau([np.zeros(50)]) == 1.0


def inputs_of(drive, *, timed=True, cycle=None, step=1.0):
    number = np.ones(drive.size, dtype=int) if cycle is None else cycle
    return SampleInputs(drive, step * np.arange(float(drive.size)), number, timed)


def test_quantities_that_a_residual_may_depend_on():
    drive = np.r_[np.linspace(-1, 2, 7), np.linspace(2, -1, 7)[1:]]
    tension = np.arange(13.0)
    records = [SimpleNamespace(record=SimpleNamespace(tension_a_N=tension), kept=np.arange(13))] * 2
    problem = SimpleNamespace(
        observed=[drive, 2 * drive], inputs=[inputs_of(drive), inputs_of(drive, step=0.5)], preloads_N=[1.0, 3.0],
        records=records,
    )  # fmt: skip
    fit_ = SimpleNamespace(model=SimpleNamespace(problem=problem), errors=[np.ones(13), np.zeros(13)])
    found = dependence._quantities(fit_)
    assert list(found) == ["drive", "angle", "direction", "distance since reversal", "cycle", "time", "rate", "tension",
                           "drive by preload"]  # fmt: skip
    assert found["angle"][0].tolist() == (drive + 1).tolist()
    assert found["distance since reversal"][0][[0, 6, 7, 12]].tolist() == [0, 3, -0.5, -3]
    assert (found["rate"][0][1], found["rate"][1][1]) == (0.5, 1.0)
    assert found["drive by preload"][0].tolist() == (-drive / 2).tolist()
    assert found["drive by preload"][1].tolist() == (drive / 2).tolist()
    problem.inputs[1] = inputs_of(drive, timed=False)
    problem.preloads_N = [2.0, 2.0]
    problem.records = [records[0], SimpleNamespace(record=SimpleNamespace(tension_a_N=None), kept=np.arange(13))]
    assert set(dependence._quantities(fit_)) == {
        "drive",
        "angle",
        "direction",
        "distance since reversal",
        "cycle",
        "time",
    }


def test_bases_of_smooth_functions_and_when_they_are_there():
    up = np.linspace(-2, 2, 41)
    drive = np.r_[up, up[::-1][1:]]
    three = np.repeat([0, 1, 2], 27)

    def names(*inputs, preloads=()):
        return set(smooth._bases(SimpleNamespace(inputs=inputs, preloads_N=list(preloads))))

    always = {"an odd function of the drive", "an even function of the drive", "the drive",
              "the drive and its direction", "the distance since the last reversal", "time"}  # fmt: skip
    assert names(inputs_of(drive, timed=False)) == always
    assert names(inputs_of(drive)) - always == {"the rate"}
    cycles = names(inputs_of(drive, timed=False, cycle=three)) - always
    assert cycles == {"the cycle", "the cycle and the direction of the drive"}
    for second, there in ((1.06, True), (1.04, False)):  # 5 % of the mean
        found = names(*[inputs_of(drive, timed=False)] * 2, preloads=(1.0, second))
        assert bool(found - always) is there
    both = smooth._bases(SimpleNamespace(inputs=[inputs_of(drive), inputs_of(0.5 * drive)], preloads_N=[1.0, 3.0]))
    sizes = {name: basis.shape[1] for name, basis in both.items()}
    assert list(sizes.values()) == [3, 2, 10, 8, 8, 6, 5, 8, 6]
    x = drive / 2  # over the largest drive of all records
    expected = np.column_stack([x, x**3, x**5])
    np.testing.assert_allclose(both["an odd function of the drive"][:81], expected - expected.mean(axis=0), atol=1e-12)
    half = np.column_stack([x**2 / 4, x**4 / 16])
    np.testing.assert_allclose(both["an even function of the drive"][81:], half - half.mean(axis=0), atol=1e-12)
    for rows, preload in ((slice(0, 81), -0.5), (slice(81, 162), 0.5)):
        by = both["the direction of the drive, by preload"][rows].sum(axis=1)  # splines add up to 1
        sign = direction(drive) * preload
        np.testing.assert_allclose(by, sign - sign.mean(), atol=1e-12)
    for basis in both.values():
        np.testing.assert_allclose(basis[:81].mean(axis=0), 0, atol=1e-12)


def test_smooth_functions_are_added_while_the_criterion_falls():
    """Orthogonal columns a, b, c take 0.5, 0.3 and 0.001 of the square. The first counts 1 parameter of the model."""
    m = 64
    walsh = np.array([[(-1.0) ** bin(i & j).count("1") for i in range(m)] for j in range(5)])
    error = 0.5**0.5 * walsh[1] + 0.3**0.5 * walsh[2] + 0.001**0.5 * walsh[3] + 0.199**0.5 * walsh[4]
    one = SimpleNamespace(
        holdout=SimpleNamespace(train_mask=np.ones(m, dtype=bool)), jacobian=np.ones((m, 1)), mean_square=1.0,
        error_deg=error,
    )  # fmt: skip
    bases = {name: walsh[j][:, None] for name, j in (("b", 2), ("a", 1), ("c", 3))}
    found = smooth._selected(one, 64.0, bases)
    assert (found.names, found.parameters) == (("a", "b"), 3)
    assert found.square == pytest.approx(0.2)
    assert found.gains == pytest.approx((0.5, 0.6))
    assert found.bic(64.0) == pytest.approx(bic(0.2, 3, 64.0))
    # a falls by n log 2 less log n, which must be more than 6: 6.4 of 13 samples, 5.8 of 12
    for n, names in ((13.0, ("a",)), (12.0, ())):
        assert smooth._selected(one, n, {"a": bases["a"]}).names == names


# --- channels and ranks --------------------------------------------------------------------------------------------


def test_errors_of_channels_are_in_their_units_and_of_their_records():
    """Weights of 2 deg/N: errors of 1 deg are 0.5 N. The angle's held-out sample is the last one."""
    measured = (np.array([0.0, 1.0, 2.0, 5.0]),)
    channel = SimpleNamespace(name="tension_a", unit="N", weight=2.0, measured=(np.array([10.0, 20.0, 30.0, 30.0]),))
    train = (np.array([True, True, False, False]),)
    one = made([[1.0, -1.0, 0.5, 1.5]], channels=[[1.0, -1.0, 2.0, 3.0]], train=train)
    one.model.problem.observed, one.model.problem.channels = measured, (channel,)
    other = replace(one, channels=ChannelErrors((np.array([2.0, 2.0, 2.0, 2.0]),), np.zeros((4, 2))))
    table = channel_table(one, other)
    assert table["angle"]["rmse_deg"] == pytest.approx((2.5 / 2) ** 0.5)
    assert (table["angle"]["max_abs_deg"], table["angle"]["max_rel_percent"]) == (1.5, 50.0)
    assert table["angle"]["normalised"] == pytest.approx((2.5 / 2) ** 0.5 / 3)
    assert table["tension_a"] == {
        "rmse_N": 1.0, "max_abs_N": 1.0,  # the tension does not change there
        "before": {"train": {"rmse_N": 0.5, "max_abs_N": 0.5, "max_rel_percent": 5.0, "normalised": 0.05},
                   "heldout": {"rmse_N": pytest.approx((13 / 8) ** 0.5), "max_abs_N": 1.5}},
        "after": {"train": {"rmse_N": 1.0, "max_abs_N": 1.0, "max_rel_percent": 10.0, "normalised": 0.1},
                  "heldout": {"rmse_N": 1.0, "max_abs_N": 1.0}},
    }  # fmt: skip
    assert channel_words(table) == ["Beside the angle, rms on held-out data: tension a 1.27 -> 1 N."]
    folded = replace(one, fold_errors=(np.array([np.nan, np.nan, np.nan, 0.25]),))
    assert channel_table(folded, folded)["angle"]["rmse_deg"] == 0.25
    alone = with_channel_fits({}, [ChannelFit("angle_2", "deg", one)])
    assert alone["angle_2"]["before"] == alone["angle_2"]["after"]
    assert channel_words(alone) == [f"Beside the angle, rms on held-out data: angle 2 {(2.5 / 2) ** 0.5:.3g} deg."]
    assert _errors("deg", measured, [np.ones(4)], [slice(None)])["normalised"] == 0.2


@pytest.mark.parametrize(("count", "words"), [(6, "notch 1 0.1 deg, notch 2"), (7, "7 notches 0.1 to 0.7 deg")])
def test_each_of_six_notches_has_its_figure_and_of_more_the_range(count, words):
    def own(k):
        return {when: {"heldout": {"rmse_deg": 0.1 * k}} for when in ("before", "after")}

    table = {f"notch_{k}": {"rmse_deg": 0.1 * k, **own(k)} for k in range(1, count + 1)}
    assert words in channel_words(table)[0]
    assert channel_words({"angle": own(1)}) == []


def test_ten_candidates_are_ranked_and_the_best_criterion_is_that_of_the_baseline_where_none_gains():
    signs = (-1.0) ** np.arange(10)

    def one(value, *names):
        return SimpleNamespace(names=names, heldout_rmse_deg=value, heldout_errors=[value * signs, np.zeros(0)],
                               heldout_error_deg=value * signs, fold_errors=None)  # fmt: skip

    gains = [-float(k) for k in range(1, 13)]
    candidates = [SimpleNamespace(names=("known", f"e{k}"), fitted=one(1.0, "known", f"e{k}"), delta_bic=g)
                  for k, g in enumerate(gains)]  # fmt: skip
    trace = SimpleNamespace(candidates=candidates[::-1], baseline=one(2.0, "known"), augmented=candidates[3].fitted,
                            names=("e3",))  # fmt: skip
    rows = ranking.ranked_models(trace)
    assert [row.name for row in rows] == [f"e{k}" for k in range(10)] + [""]
    assert [row.bic_above_best for row in rows] == [float(k) for k in range(1, 11)] + [0.0]
    assert [row.name for row in rows if row.chosen] == ["e3"]
    value, half = ranking.with_interval(one(1.0))
    assert (value, half) == pytest.approx((1.0, 1.96 / 20**0.5))
    few = SimpleNamespace(heldout_rmse_deg=1.0, heldout_errors=[np.ones(1)], heldout_error_deg=np.ones(1))
    assert ranking.with_interval(few)[1] == pytest.approx(1.96 / 2)  # two samples at least


# --- the verdict ---------------------------------------------------------------------------------------------------


def fitted(rmse, *names, bic_=0.0, heldout=None):
    signs = (-1.0) ** np.arange(100)
    return SimpleNamespace(
        names=names, rmse_deg=rmse, mean_square=rmse**2, heldout_rmse_deg=rmse if heldout is None else heldout,
        heldout_errors=[rmse * signs], samples=100.0, bic=lambda samples: bic_, fold_errors=None, noise=NOISE,
        train_rmse_deg=rmse, residuals=[rmse * signs],
    )  # fmt: skip


def test_the_verdict_before_competitors(monkeypatch):
    """In order: noise, nothing found, smooth functions, a part only, a curve that does as well."""
    say = {"beyond": False, "beats": True, "curve": False}
    monkeypatch.setattr(verdict, "significant_ratio", lambda *given: 1.2)
    monkeypatch.setattr(verdict, "is_beyond_chance", lambda *given: say["beyond"])
    monkeypatch.setattr(verdict, "beats_smooth_functions", lambda *given: say["beats"])
    monkeypatch.setattr(verdict, "curve_does_as_well", lambda *given: say["curve"])
    curve = SimpleNamespace(names=("time",), competitor=SimpleNamespace(names=("rate", "cycle")))
    found = lambda baseline, best: verdict._verdict(None, baseline, best, curve, NOISE)  # noqa: E731
    best = fitted(0.1, "drag")
    assert found(fitted(0.119), best) == ("none", [])
    assert found(fitted(0.121), best) == ("effect", [])
    say["beyond"] = True
    assert found(fitted(0.119), best) == ("effect", [])
    plain = fitted(0.5)
    assert found(plain, plain) == ("unexplained", [])
    say["curve"] = True
    assert found(plain, best) == ("effect", ["a free curve (time) does as well as drag, and names no cause"])
    say["beats"] = False
    assert found(plain, best) == ("unexplained", ["smooth functions of rate, cycle fit better than drag"])
    say.update(beats=True, curve=False)
    weak = fitted(1.01 * AT_FLOOR * 0.1, "drag")
    assert found(fitted(0.2), weak)[0] == "unexplained"
    assert found(fitted(0.2), fitted(0.99 * AT_FLOOR * 0.1, "drag"))[0] == "effect"


def test_models_of_no_more_effects_within_the_evidence_are_as_good(monkeypatch):
    best = fitted(0.1, "drag", "creep", bic_=-100.0)
    near, far = fitted(0.3, "wheel", "creep", bic_=-90.1), fitted(0.3, "wheel", "creep", bic_=-89.9)
    many = fitted(0.3, "a", "b", "c", bic_=-100.0)
    monkeypatch.setattr(verdict, "is_as_good", lambda one, *given: one.names == ("other",))
    other = fitted(0.3, "other", bic_=0.0)
    assert verdict._as_good(best, [[best, near], [far, many, other]], 10.0, NOISE) == [near, other]
    monkeypatch.setattr(verdict, "implausible", lambda one: one.names[0] == "bad")
    rows = [near, fitted(0.3, "drag", "gravity", bic_=-100.0), fitted(0.3, "bad", "creep", bic_=-100.0)]
    assert verdict._confusable(best, [rows], 10.0, NOISE) == (("wheel",), ("gravity",))


@pytest.mark.parametrize(
    ("error", "noise_", "expected"),
    [
        (0.119, None, "none"),
        (0.1204, 0.1009, "noise"),
        (0.1204, 0.1, "near"),
        (0.143, 0.1, None),
        (0.1204, None, "near"),
    ],
)
def test_noise_that_neighbouring_samples_do_not_show(monkeypatch, error, noise_, expected):
    """The ratio is 1.2; of a known rig, what is up to sqrt(2) of the noise is too little to be named."""
    monkeypatch.setattr(verdict, "significant_ratio", lambda *given: 1.2)
    monkeypatch.setattr(verdict, "is_beyond_chance", lambda *given: expected == "none")
    monkeypatch.setattr(verdict, "sensor_noise_deg", lambda records, residuals: noise_)
    baseline = fitted(error)
    baseline.model = SimpleNamespace(problem=SimpleNamespace(records=[]))
    found = verdict._is_noise(verdict.KNOWN_RIG, baseline, baseline, NOISE)
    if expected in (None, "none"):
        assert found is None
    elif expected == "noise":
        assert (found[0].local_deg, found[0].by_repeats) == (noise_, True)
    else:
        assert found[0] is NOISE
        assert found[1] == ["the error of 0.12 deg is 1.2 times the noise: too little to be named"]


def test_a_search_may_have_ended_early(monkeypatch):
    monkeypatch.setattr(verdict, "significant_ratio", lambda *given: 1.4)
    for error, early in ((0.139, True), (0.141, False)):
        trace = SimpleNamespace(baseline=None, candidates=[SimpleNamespace(fitted=fitted(error))])
        assert verdict.ended_above_noise(trace, None) is early
    monkeypatch.setattr(verdict, "significant_ratio", lambda *given: 1.0)
    for error, early in ((0.129, True), (0.131, False)):
        trace = SimpleNamespace(baseline=None, candidates=[SimpleNamespace(fitted=fitted(error))])
        assert verdict.ended_above_noise(trace, None) is early


def test_what_the_rest_depends_on_in_words():
    nothing, time = SimpleNamespace(names=()), SimpleNamespace(names=("time", "rate"))
    assert verdict._depends_on(time) == "the residual depends on time, rate"
    assert verdict._depends_on(time, "it") == "it depends on time, rate"
    assert verdict._depends_on(nothing, "it") == "it follows none of the quantities that were tested"
    assert verdict._depends_on(nothing) == "the remaining residual follows none of the quantities that were tested"


@pytest.mark.parametrize(("leap", "reference", "said"), [(0.5, 0, "unexplained"), (None, 0, "none"), (0.5, 1, "none")])
def test_a_leap_of_a_record_that_is_traced_is_said(leap, reference, said):
    readings = [None, SimpleNamespace(leap_deg=leap)]
    records = [SimpleNamespace(readings=one) for one in readings]
    trace = SimpleNamespace(
        verdict="none", baseline=SimpleNamespace(model=SimpleNamespace(problem=SimpleNamespace(records=records))),
        reference=reference, words=("before",),
    )  # fmt: skip
    verdict_of = lambda one, **change: SimpleNamespace(**{**vars(one), **change})  # noqa: E731
    original, verdict.replace = verdict.replace, verdict_of
    try:
        found = verdict.doubted_with_leap(trace)
    finally:
        verdict.replace = original
    assert found.verdict == said
    assert found.words == ((verdict.LEAPT, "before") if said == "unexplained" else ("before",))


@pytest.mark.parametrize(
    ("before", "after", "expected"),
    [
        (1.01 * SIGNIFICANT * 0.1, 0.05, "effect"),
        (0.99 * SIGNIFICANT * 0.1, 0.05, "none"),
        (1.0, 0.99 * AT_FLOOR * 0.1, "effect"),
        (1.0, 1.01 * AT_FLOOR * 0.1, "partial"),
        (1.0, (1 - 0.99 * 0.34) ** 0.5, "partial"),
        (1.0, (1 - 0.99 * 0.32) ** 0.5, "unexplained"),
    ],
)
def test_folds_name_what_takes_a_third_of_the_error_above_the_noise(monkeypatch, before, after, expected):
    monkeypatch.setattr(verdict, "smooth_functions", lambda fit: SimpleNamespace(names=("time",)))
    monkeypatch.setattr(verdict, "remarks", lambda fit: ["remark"])
    baseline, best = fitted(before), fitted(after, "drag", bic_=-50.0)
    other = fitted(after, "creep", bic_=-30.0)
    found = SimpleNamespace(baseline=baseline, best=best, candidates=(best, other), alike=((),))
    trace = verdict.judge_by_folds(found, ("word",), floor=NOISE, reference=2)
    assert (trace.verdict, trace.reference) == (expected, 2)
    assert [c.delta_bic for c in trace.candidates] == [50.0, 30.0]
    named = expected in ("effect", "partial")
    assert trace.augmented is (best if named else baseline)
    assert trace.confusable == (((),) if named else ())
    part = f"drag takes {100 * (1 - after**2) / 0.99:.0f} % of the error above the noise"
    words = {
        "none": ("word",), "effect": ("word", "remark"),
        "partial": ("the remaining residual depends on time", "word", "remark"),
        "unexplained": ("the residual depends on time", part, "word"),
    }  # fmt: skip
    assert trace.words == words[expected]
    assert trace.alike == (51.0 if named else 10.0)
    confused = verdict.judge_by_folds(
        SimpleNamespace(**{**vars(found), "alike": (("creep",),)}), ("word",), floor=NOISE
    )
    assert confused.verdict == ("ambiguous" if expected == "effect" else expected)
    assert confused.alike == (21.0 if named else 10.0)  # 50 - 30, and one more


# --- the search by folds -------------------------------------------------------------------------------------------


def test_fits_of_folds_are_made_once_and_errors_are_large_without_a_solution(monkeypatch):
    made_ = []

    def fit_(model, holdout, start):
        made_.append((model, [mask.tolist() for mask in holdout.train]))
        if model == "none":
            raise SolverError("no equilibrium")
        return SimpleNamespace(errors=[np.arange(4.0) + start])

    monkeypatch.setattr(by_folds, "_fit", fit_)
    parts = tuple(Fold((np.arange(4) == i,), str(i)) for i in range(4))
    fits = FoldFits(parts)
    one, none = SimpleNamespace(model="one", x=10.0), SimpleNamespace(model="none", x=0.0)
    assert fits.errors(one, parts[1])[0].tolist() == [11]
    assert fits.errors(one, parts[1])[0].tolist() == [11]
    assert made_ == [("one", [[True, False, True, True]])]
    assert fits.errors(one, parts[1], parts[3])[0].tolist() == [11]
    assert made_[1] == ("one", [[True, False, True, False]])
    fits.errors(one, parts[3], parts[1])
    assert len(made_) == 2  # the same samples are left out
    assert fits.errors(none, parts[0])[0].tolist() == [1e3]
    assert [e.tolist() for e in fits.everywhere(one)] == [[10], [11], [12], [13]]
    assert [e.tolist() for e in fits.heldout([one, none, one, one])] == [[10], [1e3], [12], [13]]


def test_each_fold_chooses_by_the_others_and_all_by_all():
    """Scores of a and b on each fold; a fold's own score does not count. Of equals the first."""
    parts = tuple(Fold((np.array([True]),), str(i)) for i in range(3))
    rows = {"a": [1.0, 1.0, 9.0], "b": [2.0, 2.0, 1.0]}
    a, b = (SimpleNamespace(name=name, noise=NOISE, errors=(np.zeros(3),)) for name in "ab")

    class Fits(FoldFits):
        def errors(self, candidate, fold, *also):
            assert fold not in also
            return [np.array([rows[candidate.name][int(fold.name)]])]

    fits = Fits(parts)
    # log errors: a 0, 0, 2.2; b 0.7, 0.7, 0
    assert [one.name for one in fits.chosen([a, b])] == ["b", "b", "a"]
    assert fits.best([a, b]) is b
    assert fits.best([a, a]) is a
    assert fits.chosen_without([a, b], 2) is a


def test_errors_of_folds_are_put_where_their_samples_are():
    tests = [np.array([True, False, False, True]), np.array([False, True, False, False])]
    parts = tuple(Fold((mask, np.zeros(2, dtype=bool)), str(i)) for i, mask in enumerate(tests))

    class Fits(FoldFits):
        def errors(self, candidate, fold, *also):
            return [np.array([candidate, -candidate])[: int(fold.test[0].sum())]]

    one = made([np.zeros(4), np.zeros(2)])
    found = Fits(parts).with_fold_errors(one, [5.0, 7.0])
    np.testing.assert_array_equal(found.fold_errors[0], [5.0, 7.0, np.nan, -5.0])
    assert np.isnan(found.fold_errors[1]).all()


def test_the_five_effects_of_least_error_are_candidates(monkeypatch):
    rows = {name: SimpleNamespace(mean_square=k) for name, k in zip("gfedcba", range(7), strict=True)}
    rows["d"] = None
    monkeypatch.setattr(by_folds, "_front_runner", lambda best, effect, report: rows[effect.name])
    effects = [SimpleNamespace(name=name) for name in "abcdefg"]
    found = by_folds.front_runners(SimpleNamespace(names=("g",)), effects, None)
    assert [one.mean_square for one in found] == [1, 2, 4, 5, 6]
    rows["d"] = SimpleNamespace(mean_square=3)
    assert [one.mean_square for one in by_folds.front_runners(SimpleNamespace(names=()), effects, None)] == list(
        range(5)
    )


@pytest.mark.parametrize(("gained", "tried"), [(1.01, ["drag"]), (0.99, [])])
def test_a_start_must_promise_a_gain(monkeypatch, gained, tried):
    words = []
    start = SimpleNamespace(gain=gained * by_folds.LEAST_GAIN, added="added", x=None)
    monkeypatch.setattr(by_folds, "linearised_gain", lambda *given: start)
    monkeypatch.setattr(by_folds, "either_sign", lambda form, starts: starts)
    monkeypatch.setattr(by_folds, "AddedEffect", lambda effect, form: None)
    monkeypatch.setattr(by_folds, "Model", lambda problem, added: None)
    monkeypatch.setattr(by_folds, "fit_to_all", lambda model, x: "fit")
    monkeypatch.setattr(by_folds, "implausible", lambda one: False)
    problem = SimpleNamespace(forms=lambda effect: [1], starts=lambda form: [1])
    best = SimpleNamespace(model=SimpleNamespace(problem=problem, added=()), names=())
    found = by_folds._front_runner(best, SimpleNamespace(name="drag"), words.append)
    assert (found, words) == ("fit" if tried else None, tried)


@pytest.mark.parametrize(
    ("ratio", "sure", "worse", "alike"),
    [
        (1.04, True, 1.0, ("creep",)),  # within 5 % of rms
        (1.06, True, 1.0, ()),
        (1.06, True, 0.0, ("creep",)),  # no worse beyond its interval
        (1.04, False, 1.0, ()),  # no better than before beyond its own
    ],
)
def test_effects_that_folds_do_not_tell_from_the_best(monkeypatch, ratio, sure, worse, alike):
    old = [np.full(100, 3.0)]
    drag, creep, plain = (SimpleNamespace(names=names) for names in (("drag",), ("creep",), ()))
    errors = {"drag": [np.full(100, 1.0)], "creep": [np.full(100, ratio)]}

    def gain_(before, after):
        if before is old:
            return SimpleNamespace(is_positive=sure or after is not errors["creep"])
        return SimpleNamespace(is_positive=worse > 0)

    monkeypatch.setattr(by_folds, "gain", gain_)
    fits = SimpleNamespace(
        chosen=lambda models: [drag] * 4, heldout=lambda chosen: old if chosen == "before" else errors["drag"],
        best=lambda front: drag, everywhere=lambda one: errors[one.names[-1]],
    )  # fmt: skip
    step = by_folds._named(fits, plain, "before", [plain], [drag, creep])
    assert step.alike == alike


def test_an_effect_that_leaves_a_hundredth_of_what_the_best_takes_is_alike(monkeypatch):
    """Squares of 101 before and 1 after: a hundredth of 100 more is 2, beyond 1.05^2."""
    old = [np.full(100, 101**0.5)]
    drag, creep, plain = (SimpleNamespace(names=names) for names in (("drag",), ("creep",), ()))
    monkeypatch.setattr(by_folds, "gain", lambda before, after: SimpleNamespace(is_positive=True))
    for square, alike in ((1.99, ("creep",)), (2.01, ())):
        errors = {"drag": [np.full(100, 1.0)], "creep": [np.full(100, square**0.5)]}
        fits = SimpleNamespace(
            chosen=lambda models: [drag] * 4,
            heldout=lambda chosen, errors=errors: old if chosen == "before" else errors["drag"],
            best=lambda front: drag, everywhere=lambda one, errors=errors: errors[one.names[-1]],
        )  # fmt: skip
        assert by_folds._named(fits, plain, "before", [plain], [drag, creep]).alike == alike


def test_a_step_takes_the_lesser_of_two_gains(monkeypatch):
    monkeypatch.setattr(by_folds, "_square", lambda fits, chosen: {"p": 5.0, "q": 2.0, "b": 4.0, "n": 1.5}[chosen[0]])
    fits = SimpleNamespace(folds=(0, 1))
    step = SimpleNamespace(fitted="n", chosen=["q", "q"])
    assert by_folds._taken(fits, "b", ["p", "p"], step) == 2.5


@pytest.mark.parametrize(("alike", "named"), [(("x",), 2), (("x", "y"), 1)])
def test_a_further_effect_is_confused_with_one_other_at_most(monkeypatch, alike, named):
    class Hashed(SimpleNamespace):
        __hash__ = object.__hash__

    base, first, second = (Hashed(names=names, mean_square=1.0) for names in ((), ("a",), ("a", "b")))
    steps = iter([SimpleNamespace(fitted=first, chosen=[first], alike=("w", "v")),
                  SimpleNamespace(fitted=second, chosen=[second], alike=alike)])  # fmt: skip
    asked = []

    def front(before, effects, report):
        asked.append((before, [e.name for e in effects]))
        return [first]

    monkeypatch.setattr(by_folds, "front_runners", front)
    monkeypatch.setattr(by_folds, "_named", lambda *given: next(steps))
    monkeypatch.setattr(by_folds, "_taken", lambda *given: 1.0)
    monkeypatch.setattr(by_folds, "_square", lambda *given: 1.0)
    fits = SimpleNamespace(folds=(0,), chosen=lambda models: [base], best=lambda models: base,
                           with_fold_errors=lambda one, chosen: one)  # fmt: skip
    effects = [SimpleNamespace(name=name) for name in "abwv"]
    found = by_folds.find_by_folds([base, base], effects, fits, lambda words: None)
    assert len(found.best.names) == named
    assert len(found.alike) == named
    assert asked == [(base, list("abwv")), (first, list("ab"))]  # those that are alike share the size of the first


# --- the still zone ------------------------------------------------------------------------------------------------


def test_a_still_zone_is_as_wide_as_where_the_error_begins_to_rise(monkeypatch):
    """Errors by width over the range of drives, 10: the least, then a rise; between two widths by straight lines."""
    monkeypatch.setattr(still_zone, "PlayProblem", SimpleNamespace)
    problem = SimpleNamespace(range=(-3.0, 7.0))
    best = SimpleNamespace(model=SimpleNamespace(problem=problem))
    widths = 10 * np.geomspace(still_zone.STILL_LEAST, still_zone.STILL_MOST, still_zone.STILL_WIDTHS)
    limit = still_zone.STILL_RISE
    table = {}
    monkeypatch.setattr(still_zone, "_fitted", lambda best, added, width: table[round(width, 9)])

    def edge(errors):
        rows = [None if e is None else SimpleNamespace(rmse_deg=e) for e in errors]
        table.update(zip([round(w, 9) for w in widths.tolist()], rows, strict=True))
        return still_zone._edge(best, None)

    count = widths.size
    rising = [1.2, 1.0, 1.0] + [1.0 + 2 * (limit - 1.0)] * (count - 3)
    assert edge(rising) == pytest.approx(0.5 * (widths[2] + widths[3]))
    assert edge([1.2] + [1.0] * (count - 1)) is None  # no rise
    assert edge([None] * count) is None
    assert edge([1.2, 1.0, 1.0] + [None] * (count - 3)) is None  # where it rises there is no solution
