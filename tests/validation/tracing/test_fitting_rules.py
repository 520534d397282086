"""Rules of the tracer's fits and folds by definition, on few samples that are counted by hand."""

from __future__ import annotations

import math
from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest
from made_fits import made, one_record

from fem_models.rig.checks import SolverError
from hysteresis.records.record import Record
from validation.tracing.effect import SampleInputs
from validation.tracing.fitting import evidence, folds
from validation.tracing.fitting.criterion import bic, independent_samples, lag_one_correlation
from validation.tracing.fitting.fitted import rms
from validation.tracing.fitting.folds import Fold, folds_of, gain, has_folds, log_score, mean_square, share
from validation.tracing.fitting.holdout import Holdout, _same, divide_records, protocol
from validation.tracing.fitting.least_squares import differentiate, fit, solve
from validation.tracing.fitting.noise import NoiseFloor
from validation.tracing.fitting.regressors import direction, distance_since_reversal, even, odd, rate, spline
from validation.tracing.prepared import prepared
from validation.tracing.settings import AT_NOISE

NOISE = NoiseFloor(local_deg=0.1, repeats_deg=None)


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


def test_a_reference_has_no_part_in_what_is_traced():
    """New records at 1.5 times the noise beside three at 1 are not at 1.15 times: there is something to explain."""
    signs = (-1.0) ** np.arange(100)
    rows = [1.5 * signs, *[signs] * 3]
    train = tuple(np.arange(100) < 70 for _ in rows)
    alone, beside = made(rows[:1], train=train[:1]), made(rows, train=train)
    assert beside.rmse_deg == pytest.approx(1.3125**0.5)
    compared = replace(beside, holdout=replace(beside.holdout, reference=3))
    assert compared.rmse_deg == alone.rmse_deg == 1.5
    assert compared.heldout_rmse_deg == alone.heldout_rmse_deg == 1.5
    assert compared.train_rmse_deg == beside.train_rmse_deg  # all of them are fitted
    assert compared.mean_square == beside.mean_square


def test_channels_belong_to_the_records_of_their_runs():
    masks = tuple(np.arange(10) < n for n in (10, 4, 3))
    each = Holdout(masks, "by")
    assert [each.record_of(i) for i in range(9)] == [0, 1, 2] * 3
    assert len(each.series_masks(2)) == 9
    runs = Holdout(masks, "by", with_channels=(0, 2))
    assert [runs.record_of(i) for i in range(7)] == [0, 1, 2, 0, 2, 0, 2]
    assert [int(mask.sum()) for mask in runs.series_masks(2)] == [10, 4, 3, 10, 3, 10, 3]
    assert [each.is_held_out(i) for i in range(3)] == [False, False, False]
    each, runs = (replace(one, whole=frozenset({2})) for one in (each, runs))
    assert [each.is_held_out(i) for i in range(3)] == [False, False, True]
    assert [each.everything().is_held_out(i) for i in range(3)] == [False, False, False]
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

    def followed(self, x, threads):
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


@pytest.mark.parametrize(
    ("gained", "ratio", "of_angle", "worth"),
    [(1.01, 0.89, 0.91, True), (1.01, 0.91, 0.89, True), (0.99, 0.89, 0.89, False), (1.01, 0.91, 0.91, False)],
)
def test_a_further_effect_pays_for_itself_and_for_being_the_best_of_many(gained, ratio, of_angle, worth):
    least = 10 + 2 * math.log(7)

    def criterion(samples: float) -> float:
        return gained * least if samples == 50.0 else math.nan

    before = SimpleNamespace(bic=criterion, square=1.0, mean_square=1.0)
    after = SimpleNamespace(bic=lambda samples: 0.0, square=ratio**2, mean_square=of_angle**2, samples=50.0)
    before.angle_bic = after.angle_bic = lambda samples: 0.0
    after.angle_samples = 30.0
    assert evidence.is_worth_adding(before, after, 7) is worth


@pytest.mark.parametrize(
    ("gained", "of_angle", "worth"), [(1.01, 0.89, True), (0.99, 0.89, False), (1.01, 0.91, False)]
)
def test_an_effect_pays_by_the_angle_alone_beside_a_channel_that_the_model_misses(gained, of_angle, worth):
    """A tension that is off by a third leaves so much that a drift of five times the noise gains little of all."""
    least = 10 + 2 * math.log(7)
    before = SimpleNamespace(bic=lambda samples: 0.1, square=1.0, mean_square=1.0)
    before.angle_bic = lambda samples: gained * least if samples == 30.0 else math.nan
    after = SimpleNamespace(bic=lambda samples: 0.0, square=0.99, mean_square=of_angle**2, samples=50.0)
    after.angle_bic, after.angle_samples = (lambda samples: 0.0), 30.0
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
