"""Formulas of the tracer's fits against values by hand: noise, whiteness, independent samples, steps, folds."""

from __future__ import annotations

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest
from scipy.stats import chi2

from fem_models.rig.checks import SolverError
from hysteresis.records.record import Record
from validation.tracing.fitting.criterion import independent_samples, lag_one_correlation
from validation.tracing.fitting.dependence import _portmanteau
from validation.tracing.fitting.evidence import is_beyond_chance
from validation.tracing.fitting.folds import _draws, folds_of
from validation.tracing.fitting.holdout import Holdout, Protocol, _most_covered, divide_records
from validation.tracing.fitting.least_squares import _Evaluations, differentiate
from validation.tracing.fitting.noise import (
    NoiseFloor,
    _third_difference_deg,
    correlated_noise_deg,
    estimate_noise_floor,
)
from validation.tracing.prepared import PreparedRecord, prepared
from validation.tracing.search.by_folds import _fits_best, _named, either_sign
from validation.tracing.settings import FAR_BEYOND_CHANCE, INFEASIBLE_DEG

BRANCH = 60


def there_and_back(branches: int = 4) -> PreparedRecord:
    """Branches of 60 steps, with an angle whose digits are fine."""
    k = np.arange(branches * BRANCH + 1)
    drive = np.abs((k / BRANCH) % 2 - 1)
    return prepared(Record(drive=drive, angle_deg=np.sin(3.7 * k) * 10), k)


def test_local_noise_is_the_third_difference_over_the_norm_of_its_coefficients():
    """Of a residual that alternates by a every third difference is 8 a; the median of a normal is 1/1.4826 of sigma."""
    one = there_and_back()
    residual = 2.0 * (-1.0) ** np.arange(one.kept.size)
    floor = estimate_noise_floor([one], [residual])
    assert floor.local_deg == pytest.approx(1.4826 * 16.0 / np.sqrt(1 + 9 + 9 + 1), rel=1e-12)
    twice = estimate_noise_floor([one, one], [residual, 3 * residual])
    assert twice.local_deg == pytest.approx(floor.local_deg * np.sqrt(5.0), rel=1e-12)  # mean of 1 and 9


def test_third_differences_of_samples_apart():
    """Of the cube of the place along a branch with samples j apart the third difference is 6 j^3."""
    k = np.arange(BRANCH + 1)
    one = prepared(Record(drive=k / BRANCH, angle_deg=np.sin(3.7 * k)), k)
    for apart in (1, 2, 4):
        found = _third_difference_deg([one], [k.astype(float) ** 3], apart)
        assert found == pytest.approx(1.4826 * 6 * apart**3 / np.sqrt(20), rel=1e-6)


@pytest.mark.parametrize("correlation", [0.6, 0.8])
def test_correlated_noise_is_found_with_its_size(correlation: float):
    """First-order autoregression of standard deviation 1 in 12,000 samples; white noise is not correlated."""
    k = np.arange(12_001)
    white = np.random.default_rng(4).normal(size=k.size)
    noise, step = np.empty(k.size), np.sqrt(1 - correlation**2)
    noise[0] = white[0]
    for i in range(1, k.size):
        noise[i] = correlation * noise[i - 1] + step * white[i]
    one = prepared(Record(drive=np.abs((k / 500) % 2 - 1), angle_deg=white), k)
    assert correlated_noise_deg([one], [noise]) == pytest.approx(1.0, rel=0.12)
    assert correlated_noise_deg([one], [white]) is None


def test_the_floor_is_the_smaller_estimate_unless_repeats_are_the_floor():
    floor = NoiseFloor(local_deg=0.1, repeats_deg=0.3)
    assert (floor.deg, replace(floor, by_repeats=True).deg, replace(floor, reference_deg=0.2).deg) == (0.1, 0.3, 0.2)
    assert floor.how == "neighbouring samples"
    assert replace(floor, by_repeats=True).how == "cycles or trials that repeat each other"
    assert replace(floor, reference_deg=0.2).how == "the residual that the reference leaves"
    unknown = replace(floor, local_known=False)
    assert (floor.known, unknown.known, replace(unknown, by_repeats=True).known) == (True, False, True)
    assert replace(unknown, reference_deg=0.2).known
    assert not replace(unknown, reference_deg=0.05).known


def test_portmanteau_of_two_equal_errors_three_samples_apart():
    """Two ones in m samples, 3 apart: r_3 = 1/2 and all else 0, so that Q = m (m + 2)/(4 (m - 3)), of ten lags."""
    m = 40
    error = np.zeros(m)
    error[[8, 11]] = 1.0
    Q = m * (m + 2) / (4 * (m - 3))
    assert _portmanteau([error]) == pytest.approx(chi2.sf(Q, 10), rel=1e-12)
    assert _portmanteau([error, np.zeros(50), error]) == pytest.approx(chi2.sf(2 * Q, 20), rel=1e-12)
    assert _portmanteau([error[:39]]) == 1.0  # fewer than four samples a lag


def test_independent_samples_of_a_first_order_autoregression():
    """Their number is m (1 - r)/(1 + r), at least eight a branch and at most as many as there are."""
    assert independent_samples(300, 0.5, 1) == pytest.approx(100.0)
    assert independent_samples(300, 0.5, 20) == 160
    assert independent_samples(10, 0.99, 10) == 10
    assert lag_one_correlation([np.array([1.0, 1.0, 1.0]), np.array([1.0, -1.0])]) == pytest.approx((2 - 1) / 5)
    assert lag_one_correlation([np.array([1.0, -1.0])]) == 0.0
    assert lag_one_correlation([np.ones(1000)]) == 0.99


def test_steps_of_derivatives_stay_within_the_bounds():
    """A model with no solution beyond its bounds has the derivatives 1 and 2 at either end."""
    low, high = np.array([0.0, 0.0]), np.array([1.0, 1.0])

    def errors(x: np.ndarray) -> list[np.ndarray]:
        assert np.all(x >= low)
        assert np.all(x <= high)
        return [np.array([0.0, 1.0, -1.0]) * x[0] + np.array([2.0, -1.0, -1.0]) * x[1]]

    model = SimpleNamespace(bounds=lambda: (low, high), errors=errors, followed=lambda x, threads: (errors(x), None))
    holdout = Holdout((np.ones(3, dtype=bool),), "nothing")
    for x in (low, high, np.array([0.0, 1.0])):
        found = differentiate(model, holdout, x, holdout.stacked(errors(x)), 1)
        np.testing.assert_allclose(found, [[0, 2], [1, -1], [-1, -1]], atol=1e-9)


def test_a_single_cycle_has_four_folds_of_equal_length():
    k = np.arange(81)
    one = prepared(Record(drive=np.abs(k / 40 - 1), angle_deg=np.sin(k)), k)
    folds = folds_of([one])
    assert [fold.name for fold in folds] == [f"block {i} of 4" for i in (1, 2, 3, 4)]
    assert [int(fold.test[0].sum()) for fold in folds] == [21, 20, 20, 20]


def test_each_cycle_is_a_fold_and_the_approach_is_in_the_first_one():
    k = np.arange(141)
    drive = np.abs(((k + 20) / 20) % 2 - 1)  # an approach of one branch, then three cycles of two
    cycle = np.r_[np.zeros(21, dtype=int), np.repeat([1, 2, 3], 40)]
    one = prepared(Record(drive=drive, angle_deg=np.sin(k), cycle=cycle), k)
    folds = folds_of([one])
    assert [fold.name for fold in folds] == ["cycle 1", "cycle 2", "cycle 3"]
    assert [int(fold.test[0].sum()) for fold in folds] == [61, 40, 40]
    assert not folds[0].training().train[0][:61].any()
    assert folds[0].training(folds[1]).train[0].sum() == 40


def test_a_new_rate_counts_as_much_as_a_new_preload():
    """Each record has a preload or a rate of its own; the smallest amplitude decides."""
    assert _most_covered([Protocol(20, 1, 0.1), Protocol(10, 2, 0.1), Protocol(5, 2, 1.0), Protocol(5, 2, 2.0)]) == 0
    assert _most_covered([Protocol(20, 2, 0.1), Protocol(10, 2, 0.1), Protocol(5, 1, 1.0), Protocol(5, 2, 2.0)]) == 2


def test_of_protocols_that_differ_in_amplitude_only_the_smallest_is_held_out_and_the_last_of_equals():
    def of(*amplitudes: float) -> int:
        return _most_covered([Protocol(20, one, 0.1) for one in amplitudes])

    assert [of(2, 2, 1), of(1, 2, 3), of(3, 2, 1), of(2, 1, 1), of(1, 1, 1)] == [2, 0, 2, 2, 2]
    unknown = [Protocol(np.nan, one, np.nan) for one in (2.0, 1.0, 3.0)]
    assert _most_covered(unknown) == 1


def test_an_effect_is_tried_beside_the_baseline_with_the_lowest_error():
    near, far = SimpleNamespace(mean_square=0.1), SimpleNamespace(mean_square=0.3)
    assert _fits_best([far, near]) is near
    assert _fits_best([near, far]) is near


@pytest.mark.parametrize(("ratio", "folds", "named"), [(0.89, 3, True), (0.91, 3, False), (0.89, 2, False)])
def test_folds_name_an_effect_that_takes_a_tenth_of_the_error_where_most_of_them_choose_it(ratio, folds, named):
    """The rms of what is held out falls to the ratio; so many of four folds choose the effect."""
    old = [np.resize([1.0, -1.0], 200)]
    new = [ratio * old[0]]
    plain, effect = (SimpleNamespace(names=names) for names in ((), ("drag",)))
    fits = SimpleNamespace(
        chosen=lambda models: [effect] * folds + [plain] * (4 - folds),
        heldout=lambda chosen: old if chosen == "before" else new,
        best=lambda front: front[0], everywhere=lambda one: new,
    )  # fmt: skip
    step = _named(fits, plain, "before", [plain], [effect])
    assert (step is not None) is named
    if step is not None:
        assert (step.fitted, step.alike) == (effect, ())


def test_starts_are_mirrored_where_the_bounds_allow_both_signs():
    def form(low: float):
        size = SimpleNamespace(name="size", acts_from_zero=True, low=low, high=1.0)
        return SimpleNamespace(parameters=[size, SimpleNamespace(name="rate", acts_from_zero=False, low=-1, high=1)])

    start = {"size": 0.5, "rate": 0.2}
    assert either_sign(form(-1.0), [start]) == [start, {"size": -0.5, "rate": 0.2}]
    assert either_sign(form(0.0), [start]) == [start]


def test_the_first_branch_tells_the_noise_too():
    one = there_and_back(1)
    floor = estimate_noise_floor([one], [(-1.0) ** np.arange(one.kept.size)])
    assert floor.local_known
    assert floor.local_deg == pytest.approx(1.4826 * 8.0 / np.sqrt(20), rel=1e-12)


def test_noise_is_at_least_a_part_of_the_angle_s_range_that_no_sensor_resolves():
    """A residual of 0 on an angle of 2,000 deg: 1e-5 of that, or the error of its digits, or of the drive's steps."""
    for digits, steps in ((0.0, 0.0), (0.5, 0.0), (0.0, 0.7)):
        one = SimpleNamespace(
            rounding_deg=digits, drive_step_deg=steps, branches=[slice(0, 20)], cycles_repeat=False,
            record=SimpleNamespace(angle_deg=np.array([-500.0, 1500.0])),
        )  # fmt: skip
        found = estimate_noise_floor([one], [np.zeros(20)])
        assert found.local_deg == pytest.approx(max(0.02, digits, steps), rel=1e-12)


def test_a_baseline_that_absorbs_effects_lacks_one_that_gains_far_more_than_chance():
    cases = [(1.01, True, ("play",), True), (0.99, True, ("play",), False), (9.0, False, ("play",), False)]
    for margin, absorbs, names, expected in [*cases, (9.0, True, (), False)]:
        after = SimpleNamespace(
            train_bic=lambda samples, m=margin: 50.0 - m * FAR_BEYOND_CHANCE, train_samples=9.0, names=names
        )
        before = SimpleNamespace(train_bic=lambda samples: 50.0)
        assert is_beyond_chance(before, after, SimpleNamespace(absorbs_effects=absorbs)) is expected


def test_a_bootstrap_draws_every_block_alike():
    draws = _draws(7)
    assert np.unique(draws).tolist() == list(range(7))
    share = np.bincount(draws.ravel()) / draws.size
    assert share == pytest.approx(1 / 7, abs=4 * np.sqrt(1 / 7 / draws.size))  # four standard errors


def test_the_last_third_of_trials_under_a_force_is_held_out():
    force, trial = np.tile(np.linspace(0.0, 3.0, 20), 6), np.repeat(np.arange(1, 7), 20)
    record = Record(drive=force, angle_deg=force, drive_unit="N", cycle=trial)
    holdout = divide_records([prepared(record, np.arange(force.size))])
    assert holdout.by == "trials from 5 on"
    np.testing.assert_array_equal(holdout.train[0], trial < 5)


@pytest.mark.parametrize(("own_preload", "whole"), [(True, True), (False, False)])
def test_a_record_of_its_own_preload_is_held_out_only_where_the_preload_acts(own_preload: bool, whole: bool):
    """Three records of three preloads: the narrowest is held out, or the last cycles of each."""
    k = np.arange(241)
    drive = np.abs(((k + 40) / 40) % 2 - 1)
    records = [
        prepared(Record(drive=size * drive, angle_deg=np.sin(k), rig={"preload_N": preload}), k)
        for size, preload in ((2.0, 20.0), (1.0, 10.0), (2.0, 5.0))
    ]
    holdout = divide_records(records, own_preload=own_preload)
    assert [holdout.is_held_out(i) for i in range(3)] == [False, whole, False]
    assert ("whose protocol differs" in holdout.by) is whole


def test_points_without_a_solution_count_as_far_off_in_every_channel():
    def none(x: np.ndarray, threads: int) -> None:
        raise SolverError("no equilibrium")

    model = SimpleNamespace(followed=none, problem=SimpleNamespace(channels=(1, 2)))
    holdout = Holdout((np.ones(3, dtype=bool), np.ones(2, dtype=bool)), "nothing")
    errors = _Evaluations(model, holdout, 1, None).errors(np.zeros(1))
    assert errors.tolist() == [INFEASIBLE_DEG] * 15
    model.problem.channels = ()
    assert _Evaluations(model, holdout, 1, None).errors(np.zeros(1)).size == 5
