"""Fits, folds, noise and the verdict at their thresholds and by closed forms that are worked out by hand."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from types import SimpleNamespace

import numpy as np
import pytest
from made_fits import made, one_record
from scipy.stats import chi2

from fem_models.rig.checks import SolverError
from hysteresis.records.record import Record
from validation.tracing import verdict
from validation.tracing.effect import FreeParameter, SampleInputs
from validation.tracing.fitting import dependence, evidence, folds, holdout, least_squares, noise, ranking, smooth
from validation.tracing.fitting.channel_errors import channel_table, channel_words
from validation.tracing.fitting.fitted import ChannelErrors, Rows
from validation.tracing.fitting.folds import Fold, folds_of, gain, has_folds, share
from validation.tracing.fitting.holdout import Holdout, Protocol, _most_covered, divide_records
from validation.tracing.fitting.model import Model
from validation.tracing.fitting.noise import NoiseFloor, estimate_noise_floor, repeatability_deg
from validation.tracing.fitting.uncertainty import covariance, rise_without
from validation.tracing.prepared import prepared
from validation.tracing.search import by_folds
from validation.tracing.search.by_folds import FoldFits

UNIT = NoiseFloor(local_deg=1.0, repeats_deg=None)


class Hashed(SimpleNamespace):
    """A stand-in that may be a key, as fits are."""

    __hash__ = object.__hash__


TIME = Hashed(names=("time",), competitor=None, bic=lambda samples: 0.0)


# --- a model and its coordinates -----------------------------------------------------------------------------------


def two_effects() -> Model:
    """A baseline of two parameters, an effect of one and an effect of two, on two records with one channel."""
    gap, rate = FreeParameter("gap", "mm", 0.0, 3.0, 0.5), FreeParameter("rate", "1", 1.0, 9.0, 0.25, log=True)
    stiff = FreeParameter("stiff", "N", 1.0, 100.0, 0.5, log=True)
    slope = FreeParameter("slope", "deg", -4.0, 8.0, 2.0)
    added = tuple(
        SimpleNamespace(effect=SimpleNamespace(name=name), form=SimpleNamespace(parameters=parameters))
        for name, parameters in (("backlash", (gap,)), ("drag", (rate, gap)))
    )
    seen = []

    def predict(baseline, effects):
        seen.append((baseline, effects))
        return [np.array([5.0, 6.0]), np.array([7.0]), np.array([9.0, 9.5]), np.array([11.0])]

    tension = SimpleNamespace(weight=4.0, measured=(np.array([8.0, 9.0]), np.array([10.5])))
    problem = SimpleNamespace(
        parameters=(stiff, slope), predict_series=predict, seen=seen, channels=(tension,),
        observed=(np.array([4.0, 4.5]), np.array([10.0])),
        records=[SimpleNamespace(filled=lambda e: e + 100.0), SimpleNamespace(filled=lambda e: e + 200.0)],
    )  # fmt: skip
    return Model(problem, added)


def test_coordinates_are_parameters_over_their_scales_the_baseline_first():
    model = two_effects()
    assert [p.name for p in model.parameters] == ["stiff", "slope", "gap", "rate", "gap"]
    assert (model.baseline_size, model.names) == (2, ("backlash", "drag"))
    baseline, own = {"slope": 6.0, "stiff": math.e}, [{"gap": 1.5}, {"gap": 2.0, "rate": math.exp(0.5)}]
    x = model.coordinates(baseline, own)
    assert x.tolist() == pytest.approx([2.0, 3.0, 3.0, 2.0, 4.0])
    back, effects = model.values(x)
    assert back == pytest.approx(baseline)
    assert [list(values) for values in effects] == [["gap"], ["rate", "gap"]]
    assert effects[0] == pytest.approx(own[0])
    assert effects[1] == pytest.approx(own[1])
    low, high = model.bounds()
    assert low.tolist() == pytest.approx([0.0, -2.0, 0.0, 0.0, 0.0])
    assert high.tolist() == pytest.approx([2 * math.log(100), 4.0, 6.0, 4 * math.log(9), 6.0])


def test_errors_of_a_model_are_predicted_less_measured_and_those_of_channels_in_their_weight():
    """Errors of the angle between readings are filled, here by 100 and 200; those of channels are not."""
    model = two_effects()
    errors = model.errors(np.array([2.0, 3.0, 3.0, 2.0, 4.0]))
    assert [e.tolist() for e in errors] == [[101.0, 101.5], [197.0], [4.0, 2.0], [2.0]]
    (baseline, effects), forms = model.problem.seen[0], [added.form for added in model.added]
    assert baseline == pytest.approx({"stiff": math.e, "slope": 6.0})
    assert [form for form, _ in effects] == forms
    assert effects[0][1] == pytest.approx({"gap": 1.5})
    same, followed = model.followed(np.array([2.0, 3.0, 3.0, 2.0, 4.0]))
    assert followed is None  # the problem is run once for each derivative
    assert [e.tolist() for e in same] == [e.tolist() for e in errors]


# --- noise ---------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("step", [100, 120, 140])
def test_correlated_noise_has_the_standard_deviation_of_its_autoregression(monkeypatch, step):
    """Of correlations 1, C, C^2, C^3 the difference 1, -3, 3, -1 has the mean square 20 - 30 C + 12 C^2 - 2 C^3."""
    c = 0.99 * step / 199

    def size(records, residuals, apart):
        lag = c**apart
        return 0.7 * math.sqrt((20 - 30 * lag + 12 * lag**2 - 2 * lag**3) / 20)

    monkeypatch.setattr(noise, "_third_difference_deg", size)
    assert noise.correlated_noise_deg([], []) == pytest.approx(0.7, rel=1e-9)


def test_sizes_that_grow_by_just_the_limits_are_correlated_noise(monkeypatch):
    sizes = {1: 1.0, 2: noise.CORRELATED, 4: 1.3, 8: 1.3}
    monkeypatch.setattr(noise, "_third_difference_deg", lambda records, residuals, apart: sizes[apart])
    assert noise.correlated_noise_deg([], []) is not None
    sizes.update({2: noise.MOST_CORRELATED, 4: 2.0, 8: 2.0})
    assert noise.correlated_noise_deg([], []) is not None
    sizes.update({2: 1.5, 4: 1.5, 8: 0.0})
    assert noise.correlated_noise_deg([], []) is None


@pytest.mark.parametrize("apart", [1, 2, 4])
def test_third_differences_are_of_samples_some_apart_inside_each_branch(apart):
    rng = np.random.default_rng(2)
    ends, rows = [[(0, 9), (8, 25)], [(0, 14)]], [rng.normal(size=25), rng.normal(size=14)]
    records = [SimpleNamespace(branches=[slice(a, b) for a, b in own]) for own in ends]
    third = [
        abs(row[i + 3 * apart] - 3 * row[i + 2 * apart] + 3 * row[i + apart] - row[i])
        for row, own in zip(rows, ends, strict=True)
        for a, b in own
        for i in range(a, b - 3 * apart)
    ]
    expected = 1.4826 * float(np.median(third)) / 20**0.5
    assert noise._third_difference_deg(records, rows, apart) == pytest.approx(expected, rel=1e-12)


def test_branches_without_a_third_difference_say_nothing_of_correlated_noise():
    short = [SimpleNamespace(branches=[slice(0, 3), slice(2, 5)])]
    assert math.isnan(noise._third_difference_deg(short, [np.arange(5.0)], 1))


def raw(branches, *, angle=(0.0, 1.0), rounding=0.0, steps=0.0, repeat=False) -> SimpleNamespace:
    return SimpleNamespace(
        branches=branches, rounding_deg=rounding, drive_step_deg=steps, cycles_repeat=repeat,
        record=SimpleNamespace(angle_deg=np.array(angle)),
    )  # fmt: skip


def test_the_local_noise_of_records_is_their_mean_square_weighted_by_samples():
    """Alternating errors of a have third differences of 8 a. Branches are not joined: no difference is across them."""
    signs = (-1.0) ** np.arange(30)
    parts = [slice(0, 10), slice(9, 30)]
    found = estimate_noise_floor([raw(parts), raw([slice(0, 10)])], [0.1 * signs, 0.3 * signs[:10]])
    size = 1.4826 * 8 / 20**0.5
    assert found.local_deg == pytest.approx(size * math.sqrt((30 * 0.01 + 10 * 0.09) / 40), rel=1e-12)
    step = np.r_[np.zeros(10), np.full(10, 5.0)]
    assert estimate_noise_floor([raw([slice(0, 10), slice(10, 20)])], [step]).local_deg == 1e-5  # of a range of 1 deg


@pytest.mark.parametrize(
    ("more", "expected"),
    [
        ({"angle": (-3.0, 4.0)}, 7e-5),
        ({"rounding": 0.02}, 0.02),
        ({"steps": 0.03, "rounding": 0.02}, 0.03),
    ],
)
def test_noise_is_no_less_than_a_sensor_resolves(more, expected):
    assert estimate_noise_floor([raw([slice(0, 20)], **more)], [np.zeros(20)]).local_deg == pytest.approx(expected)


def test_repeats_are_no_less_than_rounding_and_steps_of_the_drive_add_to_them(monkeypatch):
    monkeypatch.setattr(noise, "noise_floor", lambda record: record)
    monkeypatch.setattr(noise.metrics, "repeatability_deg", lambda record: record)
    monkeypatch.setattr(noise, "_residual_record", lambda one, residual: float(residual[0]))
    rows = [raw([slice(0, 20)], steps=4.0, repeat=True), raw([slice(0, 20)], rounding=12.0, steps=5.0, repeat=True)]
    rows.append(raw([slice(0, 20)], steps=40.0))  # without cycles that repeat
    residuals = [np.full(20, 3.0), np.full(20, 1.0), np.full(20, 99.0)]
    expected = math.sqrt((5.0**2 + 13.0**2) / 2)
    assert estimate_noise_floor(rows, residuals).repeats_deg == pytest.approx(expected)
    assert repeatability_deg(rows, residuals) == pytest.approx(expected)
    assert repeatability_deg(rows[2:], residuals[2:]) is None
    short = [replace_in(one, branches=[slice(0, 2)]) for one in rows[:2]]
    floor = estimate_noise_floor(short, residuals[:2])
    assert (floor.local_known, floor.local_deg, floor.repeats_deg) == (False, *[pytest.approx(expected)] * 2)


def replace_in(one: SimpleNamespace, **changes) -> SimpleNamespace:
    return SimpleNamespace(**{**vars(one), **changes})


def test_without_branches_the_floor_is_the_rms_of_all_residuals_less_their_means():
    floor = estimate_noise_floor([raw([])] * 2, [np.array([1.0, 3.0]), np.array([10.0, 10.0, 13.0, 7.0])])
    assert not floor.local_known
    assert floor.local_deg == pytest.approx(math.sqrt((1 + 1 + 9 + 9) / 6))


@pytest.mark.parametrize(("rms", "said"), [(3.0, 0.5), (3.1, None)])
def test_cycles_tell_the_noise_up_to_three_times_that_of_neighbours(monkeypatch, rms, said):
    monkeypatch.setattr(noise, "estimate_noise_floor", lambda *given: NoiseFloor(1.0, None))
    monkeypatch.setattr(noise, "correlated_noise_deg", lambda *given: None)
    monkeypatch.setattr(noise, "repeatability_deg", lambda *given: 0.5)
    assert noise.sensor_noise_deg([], [np.array([5 + rms, 5 - rms])]) == said


# --- dependence ----------------------------------------------------------------------------------------------------


def test_whiteness_is_the_test_of_ljung_and_box_over_all_records_that_are_long_enough():
    """Ten lags: m (m + 2) sum of r_k^2 / (m - k), with as many degrees of freedom for every record."""
    rng = np.random.default_rng(11)
    rows = [rng.normal(size=39), rng.normal(size=45), np.zeros(50), rng.normal(size=60)]
    total = 0.0
    for row in (rows[1], rows[3]):
        m = row.size
        for k in range(1, 11):
            r = sum(row[i] * row[i + k] for i in range(m - k)) / sum(v * v for v in row)
            total += m * (m + 2) * r * r / (m - k)
    expected = float(chi2.sf(total, 20))
    assert 0.01 < expected < 0.99
    assert dependence._portmanteau(rows) == pytest.approx(expected, rel=1e-9)
    assert dependence._portmanteau(rows[::-1]) == pytest.approx(expected, rel=1e-9)
    assert dependence._portmanteau(rows[:1]) == 1.0


def residual_of(rows: list[SampleInputs], errors: list[np.ndarray]) -> SimpleNamespace:
    record = SimpleNamespace(record=SimpleNamespace(tension_a_N=None), kept=None)
    problem = SimpleNamespace(inputs=rows, observed=[-e for e in errors], preloads_N=[], records=[record] * len(rows))
    return SimpleNamespace(errors=errors, error_deg=np.concatenate(errors), model=SimpleNamespace(problem=problem))


def test_a_constant_quantity_and_a_residual_of_nothing_are_not_tested():
    drive = np.r_[np.linspace(0, 1, 20), np.linspace(1, 0, 20)]
    one = SampleInputs(drive, np.arange(40.0), np.ones(40, dtype=int), False)
    names = [each.on for each in dependence.dependences(residual_of([one], [np.sin(np.arange(40.0))]))]
    assert names == ["neighbours", "drive", "direction", "distance since reversal", "time"]  # no angle, no cycle
    nothing = dependence.dependences(residual_of([one], [np.zeros(40)]))
    assert [(each.on, each.part, each.p) for each in nothing] == [("neighbours", 0.0, 1.0)]


def test_a_residual_that_a_spline_of_the_drive_makes_depends_on_it_wholly():
    """A straight line is in the span of the splines. Whether some 1e-30 is left or none: no part is above 1."""
    drive = np.linspace(-1, 1, 41)
    one = SampleInputs(drive, np.arange(41.0) ** 2, np.ones(41, dtype=int), False)
    found = {each.on: each for each in dependence.dependences(residual_of([one], [drive]))}
    assert found["drive"].part == pytest.approx(1.0)
    assert found["drive"].part <= 1.0
    assert found["neighbours"].part == pytest.approx(float(drive[1:] @ drive[:-1] / (drive @ drive)))


# --- folds ---------------------------------------------------------------------------------------------------------


def test_a_record_of_one_or_two_cycles_is_divided_into_four_blocks():
    """Of 42 samples the blocks begin at 0, 10.5, 21 and 31.5."""
    for one in (one_record(42), one_record(21, 2)):
        found = folds_of([one])
        assert [fold.name for fold in found] == [f"block {k} of 4" for k in (1, 2, 3, 4)]
        assert [np.flatnonzero(fold.test[0])[[0, -1]].tolist() for fold in found] == [
            [0, 10], [11, 20], [21, 31], [32, 41],
        ]  # fmt: skip
        assert not has_folds([one])


def test_each_of_three_or_four_cycles_is_a_fold_and_more_share_four_folds():
    """The approach, cycle 0, goes with the first one."""
    for count, names in ((3, ["1", "2", "3"]), (4, ["1", "2", "3", "4"]), (6, ["1, cycle 2", "3, cycle 4", "5", "6"])):
        one = one_record(10, count)
        cycle = one.inputs.cycle.copy()
        cycle[:4] = 0
        one = replace(one, inputs=replace(one.inputs, cycle=cycle))
        assert has_folds([one])
        found = folds_of([one])
        assert [fold.name for fold in found] == [f"cycle {name}" for name in names]
        sizes = [10 * (1 + name.count(",")) for name in names]
        assert [int(fold.test[0].sum()) for fold in found] == sizes
        assert found[0].test[0][:10].all()


def test_the_approach_is_no_cycle_of_its_own():
    one = one_record(10, 3)
    two = replace(one, inputs=replace(one.inputs, cycle=one.inputs.cycle - 1))
    assert folds._cycles(two).tolist() == [1, 2]
    assert (has_folds([one]), has_folds([two])) == (True, False)


def test_a_record_without_cycles_is_halved_in_its_middle():
    assert folds._half(one_record(9)).tolist() == [0] * 4 + [1] * 5
    late = one_record(10)
    late = replace(late, inputs=replace(late.inputs, cycle=np.r_[np.zeros(7, dtype=int), np.ones(3, dtype=int)]))
    assert folds._half(late).tolist() == [0] * 7 + [1] * 3


def test_training_masks_leave_out_all_folds_that_are_named():
    k = np.arange(6)
    a, b, c = (Fold((k == i, k == i + 3), str(i)) for i in range(3))
    assert a.training(b, c).by == "0"
    assert [np.flatnonzero(mask).tolist() for mask in a.training(c).train] == [[1, 3, 4, 5], [0, 1, 2, 4]]
    assert [np.flatnonzero(mask).tolist() for mask in a.training().train] == [[1, 2, 3, 4, 5], [0, 1, 2, 4, 5]]


def test_a_bootstrap_draws_whole_blocks_of_both_models_together():
    """Three blocks whose gains are 3, 6 and 12 by one sample each: the means of three draws of them with return."""
    before = [np.sqrt([4.0]), np.sqrt([8.0]), np.sqrt([16.0])]
    after = [np.ones(1), np.sqrt([2.0]), np.full(1, 2.0)]
    found = gain(before, after)
    assert found.value == pytest.approx(7.0)
    assert (found.low, found.high) == pytest.approx((3.0, 12.0))  # each has the probability 1/27, more than 2.5 %
    assert found.is_positive
    part = share(before, after, 1.0)
    assert part.value == pytest.approx(21 / 25)  # 28 - 7 of 28 - 3


def test_a_share_is_drawn_from_the_same_blocks_as_its_gain():
    """Blocks of 1 and 3 samples: squares 5 to 1 a sample, and 2 to 2. With a noise of 1 the parts are 1 and 0."""
    found = share([np.full(1, 5.0**0.5), np.full(3, 2.0**0.5)], [np.ones(1), np.full(3, 2.0**0.5)], 1.0)
    assert found.value == pytest.approx((11 - 7) / (11 - 4))
    assert (found.low, found.high) == pytest.approx((0.0, 1.0))  # both blocks alike by a quarter of the draws each


# --- held-out samples ----------------------------------------------------------------------------------------------


@pytest.mark.parametrize(("trials", "first"), [(2, 2), (3, 3), (5, 5), (6, 5), (9, 7)])
def test_the_last_third_of_trials_under_a_force_is_held_out(trials, first):
    cycle = np.repeat(np.arange(1, trials + 1), 10)
    force = np.tile(np.linspace(0.0, 3.0, 10), trials)
    one = prepared(Record(force, 2 * force, drive_unit="N", cycle=cycle), np.arange(force.size))
    found = divide_records([one])
    assert found.by == f"trials from {first} on"
    assert found.train[0].tolist() == (cycle < first).tolist()


def test_a_record_is_held_out_up_to_three_tenths_of_training_samples_and_begins_in_training():
    assert Holdout((np.arange(10) < 3,), "n").is_held_out(0)
    assert not Holdout((np.arange(10) < 4,), "n").is_held_out(0)
    rows = [one_record(20, rig={"preload_N": 2.0}) for _ in range(3)]
    assert [int(mask.sum()) for mask in divide_records(rows).train] == [20, 20, 1]  # a twentieth; of equals the last
    many = [one_record(45, rig={"preload_N": 2.0}) for _ in range(3)]
    assert int(divide_records(many).train[2].sum()) == 3  # samples 0, 1 and 2 are before 2.25


def test_a_record_with_a_preload_of_its_own_is_held_out_only_where_that_may_be():
    rows = [one_record(40, 2, rig={"preload_N": p}) for p in (1.0, 2.0, 4.0)]
    assert [mask.mean() for mask in divide_records(rows).train] == [1.0, 1.0, 0.05]
    assert [mask.mean() for mask in divide_records(rows, own_preload=False).train] == [0.5, 0.5, 0.5]
    shared = [one_record(40, 2, rig={"preload_N": p}) for p in (1.0, 4.0, 4.0)]
    assert [mask.mean() for mask in divide_records(shared, own_preload=False).train] == [1.0, 1.0, 0.05]


@pytest.mark.parametrize(
    ("rows", "out"),
    [
        ([(1, 5, 1), (1, 3, 1), (1, 4, 1)], 1),  # the smallest amplitude
        ([(1, 3, 1), (1, 3, 1), (1, 4, 1)], 1),  # of two the last
        ([(1, 3, 9), (1, 5, 1), (1, 4, 1)], 2),  # one with a rate of its own is not covered
        ([(7, 3, 1), (1, 5, 1), (1, 4, 1)], 2),
        ([(7, 3, 1), (1, 4, 9), (1, 5, 9), (1, 6, 1)], 1),
        ([(7, 3, 9), (6, 4, 1), (5, 5, 1)], 1),  # two new things are more than one
    ],
)
def test_the_record_that_the_others_cover_best(rows, out):
    assert _most_covered([Protocol(*map(float, row)) for row in rows]) == out


def test_two_numbers_of_a_protocol_are_the_same_up_to_a_tenth_of_the_larger():
    assert holdout._same(10.0, 9.0)
    assert not holdout._same(10.0, 8.9)
    assert holdout._same(0.0, 0.0)
    assert not holdout._same(math.nan, 1.0)


def test_a_rate_is_of_whole_cycles_without_the_approach():
    k = np.arange(60)
    one = one_record(20, 3, time_s=5.0 + 0.5 * k)
    one = replace(one, inputs=replace(one.inputs, cycle=np.maximum(one.inputs.cycle - 1, 0)))
    assert holdout.protocol(one).rate_Hz == pytest.approx(2 / 29.5)


# --- least squares and uncertainty ---------------------------------------------------------------------------------


class Plane:
    """Errors of two records and of a channel of each, linear in two coordinates; the runs are counted."""

    A = np.arange(20.0).reshape(10, 2) % 7
    sizes = (2, 3, 2, 3)

    def __init__(self, weight=0.0):
        self.problem = SimpleNamespace(channels=("tension",), prior_weight_deg=weight)
        self.baseline_size, self.points = 1, []

    def bounds(self):
        return np.array([-1.0, 0.0]), np.array([1.0, 4.0])

    def errors(self, x):
        self.points.append(x)
        return np.split(self.A @ x, np.cumsum(self.sizes)[:-1])

    def followed(self, x):
        return self.errors(x), None


ALL = Holdout((np.ones(2, dtype=bool), np.ones(3, dtype=bool)), "n")


def test_derivatives_are_taken_away_from_the_nearer_bound_and_up_in_the_middle():
    for x, signs in (([0.0, 2.0], [1, 1]), ([0.1, 1.9], [-1, 1]), ([-1.0, 4.0], [1, -1])):
        model = Plane()
        start = np.array(x)
        errors = ALL.stacked(model.errors(start))
        found = least_squares.differentiate(model, ALL, start, errors, 1)
        moved = [point - start for point in model.points if not np.array_equal(point, start)]
        assert [np.flatnonzero(step).tolist() for step in moved] == [[0], [1]]
        assert [float(step.sum()) for step in moved] == pytest.approx([1e-3 * sign for sign in signs])
        parts = np.split(Plane.A, np.cumsum(Plane.sizes)[:-1])
        np.testing.assert_allclose(found, np.concatenate([a - a.mean(axis=0) for a in parts]), atol=1e-9)


def test_known_columns_come_first_and_the_others_are_differentiated():
    model, x = Plane(), np.array([0.0, 2.0])
    errors, known = ALL.stacked(model.errors(x)), np.full((10, 1), 7.0)
    found = least_squares.differentiate(model, ALL, x, errors, 1, known)
    assert found[:, 0].tolist() == [7.0] * 10
    part = Plane.A[:2, 1]
    assert found[:2, 1] == pytest.approx(part - part.mean())


def test_errors_and_derivatives_of_a_fit_are_those_of_its_records_then_those_of_its_channels():
    model, jacobian = Plane(), np.arange(20.0).reshape(10, 2)
    found = least_squares.fitted_at(model, ALL, np.zeros(2), np.arange(10.0), jacobian, 3)
    assert [e.tolist() for e in found.errors] == [[0, 1], [2, 3, 4]]
    assert [e.tolist() for e in found.channels.errors] == [[5, 6], [7, 8, 9]]
    assert (found.jacobian.tolist(), found.channels.jacobian.tolist()) == (jacobian[:5].tolist(), jacobian[5:].tolist())
    assert found.evaluations == 3
    model.problem.channels = ()
    assert least_squares.fitted_at(model, ALL, np.zeros(2), np.arange(5.0), jacobian[:5], 3).channels is None


@pytest.mark.parametrize(("last", "passed"), [(0.0, "run at 0"), (1.0, None)])
def test_derivatives_go_on_from_the_run_at_their_own_point_alone(monkeypatch, last, passed):
    given = []
    monkeypatch.setattr(least_squares, "differentiate", lambda *args: given.append(args) or np.zeros((5, 1)))
    model = SimpleNamespace(
        followed=lambda x: ([np.zeros(2), np.zeros(3)], f"run at {x[0]:.0f}"), problem=SimpleNamespace(channels=())
    )
    runs = least_squares._Evaluations(model, ALL, 1, None)
    runs.errors(np.zeros(1))
    runs.errors(np.array([last]))
    runs.jacobian(np.zeros(1))
    assert given[0][-1] == passed


def test_a_point_without_a_solution_is_far_off_in_every_sample():
    def none(x):
        raise SolverError("no equilibrium")

    model = SimpleNamespace(followed=none, problem=SimpleNamespace(channels=("tension",)))
    errors = least_squares._Evaluations(model, ALL, 1, None).errors(np.zeros(1))
    assert errors.tolist() == [1e3] * 10  # two records, and a channel of each


def test_columns_without_slope_do_not_spoil_a_solution():
    flat = least_squares.solve(np.array([[0.0, 2.0], [0.0, 2.0]]), np.array([3.0, 5.0]))
    assert flat.tolist() == pytest.approx([0.0, 2.0])
    tiny = 1e-10 * np.array([[1.0, 0.0], [1.0, 0.0], [0.0, 1e10]])
    found = least_squares.solve(tiny, np.array([1.0, 3.0, 5.0]))
    assert found.tolist() == pytest.approx([2e10, 5.0])


def test_a_covariance_is_of_the_training_samples_and_of_parameters_of_any_size():
    """Orthogonal columns of 2 and 2e-10: s^2 = 12/(4 - 2), with 4 of 8 samples and so 3 of 6 independent ones."""
    J = np.array([[1, 1], [1, -1], [1, 1], [1, -1]]) * np.array([1.0, 1e-10])
    rows = Rows(np.r_[3.0, 1.0, -1.0, 1.0, [50.0] * 4], np.vstack([J, np.full((4, 2), 9.0)]), np.arange(8) < 4)
    found = covariance(SimpleNamespace(rows=rows, samples=6.0))
    s2 = 12 / 2 * 4 / 3
    assert (found.freedom, found.variance) == (1.0, pytest.approx(s2))
    np.testing.assert_allclose(found.matrix * np.array([[1, 1e-10], [1e-10, 1e-20]]), np.eye(2) * s2 / 4, atol=1e-9)
    few = covariance(SimpleNamespace(rows=rows._replace(train=np.arange(8) < 2), samples=40.0))
    assert (few.freedom, few.variance) == (pytest.approx(8.0), pytest.approx(10 * 2 / 10))  # 10/1, not 10/0


def linear(x, low, high) -> SimpleNamespace:
    """A fit with columns (1, 1, 0) and (0, 1, 1), errors (0, 0, 1), and a held-out sample."""
    J = np.array([[1.0, 0.0], [1.0, 1.0], [0.0, 1.0], [7.0, 5.0]])
    rows = Rows(np.array([0.0, 0.0, 1.0, 9.0]), J, np.arange(4) < 3)
    bounds = np.array([-9.0, low]), np.array([9.0, high])
    return SimpleNamespace(rows=rows, x=np.array(x), model=SimpleNamespace(bounds=lambda: bounds))


@pytest.mark.parametrize(
    ("x", "low", "high", "shape", "rise"),
    [
        ([2.0, 3.0], -9.0, 9.0, [], 7.5),  # (-2, -2, 1) + 1/2 (0, 1, 1)
        ([2.0, 3.0], -9.0, 3.25, [], 7.625),  # a quarter only
        ([2.0, 3.0], -9.0, 3.0, [], 8.0),
        ([-2.0, 3.0], -9.0, 9.0, [], 3.5),  # (2, 2, 1) - 3/2 (0, 1, 1)
        ([-2.0, 3.0], 2.0, 9.0, [], 4.0),
        ([-2.0, 3.0], 3.0, 9.0, [], 8.0),
        ([-2.0, 3.0], -9.0, 9.0, [1], 8.0),
        ([0.0, 3.0], -9.0, 9.0, [], 0.0),  # an amount of nothing
    ],
)
def test_what_the_squares_rise_by_without_an_amount_where_the_others_follow_within_their_bounds(
    x, low, high, shape, rise
):
    assert rise_without(linear(x, low, high), [0], shape) == pytest.approx(rise, abs=1e-6)


# --- smooth functions ----------------------------------------------------------------------------------------------


def test_records_that_only_load_have_no_functions_of_direction_and_compete_without_those_of_the_drive(monkeypatch):
    asked = []

    def selected(fitted, samples, bases):
        asked.append((samples, set(bases)))
        return smooth.Smooth((str(len(asked)),), 1.0, 1, ())

    own, other = {"an odd function of the drive", "an even function of the drive", "the drive"}, {"time", "the cycle"}
    turned = {"the drive and its direction", "the distance since the last reversal"}
    monkeypatch.setattr(smooth, "_selected", selected)
    monkeypatch.setattr(smooth, "_bases", lambda problem: dict.fromkeys([*own, *other, *turned]))

    def one(*loads):
        records = [SimpleNamespace(only_loads=each) for each in loads]
        return SimpleNamespace(angle_samples=50.0, model=SimpleNamespace(problem=SimpleNamespace(records=records)))

    found = smooth.smooth_functions(one(True, True))
    assert asked == [(50.0, own | other), (50.0, other)]
    assert (found.names, found.competitor.names) == (("1",), ("2",))
    assert smooth.smooth_functions(one(True, False), 7.0).competitor is None
    assert asked[2] == (7.0, own | other | turned)


def test_functions_of_five_cycles_are_splines_from_the_first_to_the_last_and_the_preload_is_taken_at_its_mean():
    """Five cubics with one knot amid: at the ends the outer one is 1, in the middle (1, 2, 1)/4."""
    drive = np.array([0.0, 1.0, 0.0, 1.0, 0.0])
    one = SampleInputs(drive, np.arange(5.0), np.arange(5), False)
    found = smooth._bases(SimpleNamespace(inputs=[one], preloads_N=[]))
    expected = np.array([[1, 0, 0, 0, 0], [0] * 5, [0, 0.25, 0.5, 0.25, 0], [0] * 5, [0, 0, 0, 0, 1]])
    x = np.array([0.25, 0.75])  # cubic between the knots 0, 0, 0, 0, 1/2, 1, 1, 1, 1
    expected[1] = [0.125, 0.59375, 0.25, 0.03125, 0]
    expected[3] = expected[1][::-1]
    assert x.sum() == 1.0
    np.testing.assert_allclose(found["the cycle"], expected - expected.mean(axis=0), atol=1e-12)
    signs = np.array([1, 1, -1, 1, -1])[:, None]  # each sample after the first by the way that led to it
    turned = expected * signs
    np.testing.assert_allclose(
        found["the cycle and the direction of the drive"], turned - turned.mean(axis=0), atol=1e-12
    )


@pytest.mark.parametrize(("over", "names"), [(1e-9, ()), (-1e-9, ("a",))])
def test_a_smooth_function_must_lower_the_criterion_by_six(over, names):
    """A column that takes the part 1 - exp(-g/n): the criterion falls by g less log n, 6 at g = 6 + log n."""
    m, n = 64, 100.0
    left = math.exp(-(6.0 + math.log(n) - over * n) / n)
    a, b = (-1.0) ** np.arange(m), (-1.0) ** (np.arange(m) // 2)
    fit = SimpleNamespace(
        holdout=SimpleNamespace(train_mask=np.ones(m, dtype=bool)), jacobian=np.zeros((m, 0)), mean_square=1.0,
        error_deg=math.sqrt(1 - left) * a + math.sqrt(left) * b,
    )  # fmt: skip
    found = smooth._selected(fit, n, {"a": a[:, None]})
    assert found.names == names
    assert found.square == pytest.approx(left if names else 1.0)


def test_smooth_functions_are_fitted_to_training_samples_and_scored_on_all():
    """A constant fitted to errors of 1 leaves those of 3 at 2."""
    train = np.arange(8) < 6
    error = np.where(train, 1.0, 3.0)
    assert smooth._mean_square(error, np.ones((8, 1)), train) == pytest.approx(4 * 2 / 8)


# --- channels ------------------------------------------------------------------------------------------------------


def test_each_channel_has_the_errors_and_the_masks_of_its_own_records():
    """Channels of the second and the third of three records, of weights 1 and 10."""
    masks = tuple(np.arange(4) < n for n in (4, 3, 2))
    angle = [np.full(4, 1.0), np.full(4, 2.0), np.array([3.0, 3.0, 3.0, -5.0])]
    rows = [np.array([1.0, 1, 1, 2]), np.array([1.0, 1, 3, 4]), 10 * np.array([0.0, 0, 0, 7]), 10 * np.arange(4.0)]
    one = made(angle, channels=rows, train=masks)
    one = replace(
        one, holdout=Holdout(masks, "n", with_channels=(1, 2)), channels=ChannelErrors(tuple(rows), one.jacobian)
    )
    ramp = np.arange(4.0)
    one.model.problem.observed = (ramp, 2 * ramp, 3 * ramp)
    one.model.problem.channels = tuple(
        SimpleNamespace(name=name, unit=unit, weight=weight, measured=(ramp, 10 * ramp))
        for name, unit, weight in (("notch_1", "deg", 1.0), ("tension_a", "N", 10.0))
    )
    found = channel_table(one, one)
    assert found["angle"]["rmse_deg"] == pytest.approx(math.sqrt((4 + 9 + 25) / 3))
    assert found["angle"]["max_abs_deg"] == 5.0
    assert found["angle"]["max_rel_percent"] == pytest.approx(100 * 5 / 3)  # held out: 6, 6 and 9 deg
    assert found["notch_1"]["rmse_deg"] == pytest.approx(math.sqrt((4 + 9 + 16) / 3))  # 2; 3 and 4
    assert found["tension_a"]["rmse_N"] == pytest.approx(math.sqrt((49 + 4 + 9) / 3))
    assert found["tension_a"]["max_rel_percent"] == pytest.approx(100 * 7 / 27)  # 3, 20 and 30 N
    train = found["tension_a"]["before"]["train"]
    assert train["rmse_N"] == pytest.approx(math.sqrt(1 / 5))
    assert train["normalised"] == pytest.approx(math.sqrt(1 / 5) / 10)


def test_words_of_channels_have_the_figure_before_only_where_it_changes():
    def own(before, after, unit="N"):
        errors = {"before": {"heldout": {f"rmse_{unit}": before}}, "after": {"heldout": {f"rmse_{unit}": after}}}
        return {f"rmse_{unit}": after, f"max_abs_{unit}": 9.0, **errors}

    table = {"angle": own(1, 2, "deg"), "notch_1": own(0.25, 0.125, "deg"), "tip_along": own(0.5, 0.5, "mm")}
    words = "Beside the angle, rms on held-out data: notch 1 0.25 -> 0.125 deg, tip along 0.5 mm."
    assert channel_words(table) == [words]
    many = {f"notch_{k}": own(0.1 * k, 0.1 * k if k < 7 else 0.5, "deg") for k in range(1, 8)}
    assert channel_words(many) == ["Beside the angle, rms on held-out data: 7 notches 0.1 to 0.7 -> 0.1 to 0.6 deg."]


# --- evidence ------------------------------------------------------------------------------------------------------


def test_thresholds_of_the_evidence_belong_to_the_noise_and_not_to_the_finding():
    policy = SimpleNamespace(significant=1.25, absorbs_effects=True)
    plain = SimpleNamespace(error_deg=np.zeros(10000), rmse_deg=1.25, noise=UNIT)
    assert evidence.nothing_to_explain(plain, policy)
    assert evidence.is_noise(SimpleNamespace(rmse_deg=evidence.AT_NOISE, noise=UNIT))
    few = SimpleNamespace(error_deg=np.zeros(16))
    assert evidence.significant_ratio(few, policy) == 1.75  # 1 + 3/4


@pytest.mark.parametrize(
    ("gained", "absorbs", "names", "beyond"),
    [
        (30.5, True, ("play",), True),
        (30.0, True, ("play",), False),
        (30.5, False, ("play",), False),
        (30.5, True, (), False),
    ],
)
def test_what_is_beyond_chance_gains_more_than_thirty_of_the_criterion(gained, absorbs, names, beyond):
    """Of the training samples, as many as those of the model with the effect are worth."""
    before = SimpleNamespace(train_bic=lambda samples: gained + samples, train_samples=3.0)
    after = SimpleNamespace(train_bic=lambda samples: samples, train_samples=60.0, names=names)
    policy = SimpleNamespace(absorbs_effects=absorbs)
    assert evidence.is_beyond_chance(before, after, policy) is beyond


def test_an_effect_at_the_threshold_is_not_worth_adding_and_a_curve_at_it_is_no_better():
    before = SimpleNamespace(bic=lambda samples: 10.0, square=1.0)
    after = SimpleNamespace(bic=lambda samples: 0.0, square=0.5, samples=1.0)
    assert not evidence.is_worth_adding(before, after, 1)
    more = SimpleNamespace(bic=lambda samples: 11.0, square=0.5 / evidence.WORTH_NAMING**2)
    assert evidence.is_worth_adding(replace_in(more, square=1.0), after, 1)
    assert not evidence.is_worth_adding(replace_in(more, square=0.25), replace_in(after, square=0.25), 1)
    effect = SimpleNamespace(angle_samples=50.0, angle_bic=lambda samples: 0.0)
    for value, beats in ((-10.0, False), (-9.0, True)):
        curve = SimpleNamespace(names=("time",), competitor=None, bic=lambda samples, value=value: value)
        assert evidence.beats_smooth_functions(effect, curve) is beats
    for value, alike in ((10.0, False), (9.0, True)):
        curve = SimpleNamespace(names=("time",), competitor=None, bic=lambda samples, value=value: value)
        assert evidence.curve_does_as_well(effect, curve) is alike


def test_models_are_ranked_for_the_samples_of_the_one_with_the_least_square():
    """With 4 samples b leads by its few parameters, with 400 a by its square."""

    def one(name, square, samples, parameters):
        return SimpleNamespace(names=(name,), square=square, samples=samples, bic=lambda n: n * square + parameters)

    for samples, order in ((4.0, ["b", "a"]), (400.0, ["a", "b"])):
        rows = [one("a", 1.0, samples, 9.0), one("b", 1.5, 404.0 - samples, 0.0)]
        assert [g.names[0] for g in evidence.ranked_models(rows)] == order


# --- the verdict at its thresholds ---------------------------------------------------------------------------------


def fitted(rmse, *names, bic=0.0, heldout=None, train=None, **more) -> SimpleNamespace:
    held = rmse if heldout is None else heldout
    own = rmse if train is None else train
    return SimpleNamespace(**{
        "names": names, "rmse_deg": rmse, "mean_square": rmse**2, "heldout_rmse_deg": held, "train_rmse_deg": own,
        "train_square": own**2, "heldout_errors": [held * (-1.0) ** np.arange(100)], "samples": 100.0, "train_samples": 100.0,
        "bic": lambda samples: bic, "train_bic": lambda samples: own**2, "fold_errors": None, "noise": UNIT,
        "residuals": [], "model": SimpleNamespace(problem=SimpleNamespace(records=[])), **more,
    })  # fmt: skip


@dataclass(frozen=True)
class Found:
    """What the rules read of a trace; the noise is 1 deg."""

    verdict: str
    baseline: SimpleNamespace
    augmented: SimpleNamespace
    floor: NoiseFloor = UNIT
    words: tuple[str, ...] = ("before",)
    confusable: tuple[tuple[str, ...], ...] = ((),)
    known: bool = False
    smooth: SimpleNamespace = TIME
    candidates: tuple[SimpleNamespace, ...] = ()
    model: str = "rig"
    records: tuple[SimpleNamespace, ...] = (SimpleNamespace(drive_unit="mm"),)

    @property
    def names(self) -> tuple[str, ...]:
        return self.augmented.names

    @property
    def effects(self) -> tuple[str, ...]:
        return self.augmented.names


def tried(*models: SimpleNamespace) -> tuple[SimpleNamespace, ...]:
    return tuple(SimpleNamespace(names=one.names, fitted=one) for one in models)


@pytest.fixture
def sensible(monkeypatch):
    monkeypatch.setattr(verdict, "implausible", lambda one: ("no sense",) if "odd" in one.names else ())
    monkeypatch.setattr(verdict, "remarks", lambda one: [f"of {' + '.join(one.names)}"])


def test_a_residual_at_the_ratio_is_noise_and_an_effect_at_its_limits_is_named(monkeypatch):
    monkeypatch.setattr(verdict, "significant_ratio", lambda *given: 1.25)
    monkeypatch.setattr(verdict, "is_beyond_chance", lambda *given: False)
    monkeypatch.setattr(verdict, "beats_smooth_functions", lambda *given: True)
    monkeypatch.setattr(verdict, "curve_does_as_well", lambda *given: False)
    found = lambda before, after: verdict._verdict(None, before, after, TIME, UNIT)  # noqa: E731
    assert found(fitted(1.25), fitted(1.0, "drag")) == ("none", [])
    weak = fitted(17**0.5, mean_square=17.0)
    assert found(weak, fitted(5**0.5, "drag", mean_square=5.0)) == ("effect", [])  # 12 of 16
    low = fitted(2**0.5, mean_square=2.0)
    assert found(low, fitted(1.5, "drag", mean_square=2.0)) == ("effect", [])  # at the floor nothing need be taken
    words = "drag + creep explains 50 % of the mean square above the noise"
    assert found(weak, fitted(3.0, "drag", "creep", mean_square=9.0)) == ("unexplained", [words])


def test_noise_of_a_sensor_is_the_lesser_of_both_residuals_and_counts_up_to_the_ratio(monkeypatch):
    sizes = {"before": 2.0, "after": 0.8}
    monkeypatch.setattr(verdict, "significant_ratio", lambda *given: 1.25)
    monkeypatch.setattr(verdict, "is_beyond_chance", lambda *given: False)
    monkeypatch.setattr(verdict, "sensor_noise_deg", lambda records, residuals: sizes[residuals])
    small = replace(UNIT, local_deg=0.125)
    after = fitted(0.1, "drag", residuals="after")
    floor, words = verdict._is_noise(None, fitted(1.0, residuals="before"), after, small)
    assert (floor.local_deg, floor.by_repeats) == (0.8, True)
    assert words == ["the error of 1 deg is correlated noise of the sensor, 0.8 deg"]
    assert verdict._is_noise(None, fitted(1.01, residuals="before"), after, small) is None
    sizes["after"] = None
    assert verdict._is_noise(None, fitted(2.5, residuals="before"), after, small)[0].local_deg == 2.0


def test_too_little_to_be_named_is_up_to_the_root_of_two_of_a_known_rig_without_a_name(monkeypatch):
    monkeypatch.setattr(verdict, "significant_ratio", lambda *given: 1.25)
    monkeypatch.setattr(verdict, "is_beyond_chance", lambda *given: False)
    monkeypatch.setattr(verdict, "sensor_noise_deg", lambda records, residuals: None)
    baseline, after = fitted(verdict.NEAR_NOISE), fitted(1.0, "drag")
    floor, words = verdict._is_noise(verdict.KNOWN_RIG, baseline, baseline, UNIT)
    assert (floor, words) == (UNIT, ["the error of 1.4 deg is 1.4 times the noise: too little to be named"])
    assert verdict._is_noise(verdict.KNOWN_RIG, baseline, after, UNIT) is None
    assert verdict._is_noise(replace(verdict.KNOWN_RIG), baseline, baseline, UNIT) is None
    monkeypatch.setattr(verdict, "_is_measured", lambda baseline: True)
    assert verdict._is_noise(verdict.KNOWN_RIG, baseline, after, UNIT)[0] is UNIT
    # an effect beyond chance stays beside a baseline at the noise
    monkeypatch.setattr(verdict, "is_beyond_chance", lambda *given: True)
    monkeypatch.setattr(verdict, "sensor_noise_deg", lambda records, residuals: 9.0)
    assert verdict._is_noise(verdict.KNOWN_RIG, fitted(1.25), after, UNIT) is None
    assert verdict._is_noise(verdict.KNOWN_RIG, fitted(1.5), after, UNIT)[0].local_deg == 9.0


def test_models_at_the_limits_of_the_misfit_are_not_as_good():
    """Of a noise of 0 the whole square is misfit; 1.15^2 - 1 of it is less. Near the noise the misfit is less."""
    none = replace(UNIT, local_deg=0.0)
    part = verdict.MISFIT_ALIKE**2 - 1.0
    assert not verdict._leaves_as_little(1.0 + part, 1.0, none)
    assert verdict._leaves_as_little(1.0 + 0.999 * part, 1.0, none)
    misfit = 1.25 - verdict.AT_NOISE**2
    assert verdict._leaves_as_little(1.25 + 0.999 * misfit, 1.25, UNIT)
    assert not verdict._leaves_as_little(1.25 + 1.001 * misfit, 1.25, UNIT)
    assert verdict._leaves_as_little(0.99, 1.0, UNIT)  # a lower error is as good, even within the noise


def test_a_model_is_as_good_within_the_evidence_alone_and_with_as_many_effects(monkeypatch, sensible):
    monkeypatch.setattr(verdict, "is_as_good", lambda *given: False)
    best = fitted(1.0, "drag", bic=-100.0)
    at, within = fitted(2.0, "creep", bic=-90.0), fitted(2.0, "wheel", bic=-91.0)
    odd, both = fitted(1.0, "odd", bic=-100.0), fitted(1.0, "drag", "creep", bic=-120.0)
    assert verdict._as_good(best, [[best, at, within], [odd, both]], 10.0, UNIT) == [within, odd]
    assert verdict._confusable(best, [[best, at, within, odd]], 10.0, UNIT) == (("wheel",),)


def test_other_effects_stand_beside_the_rest_of_the_best_model_or_alone_where_there_is_none(monkeypatch, sensible):
    monkeypatch.setattr(verdict, "is_as_good", lambda *given: True)
    best = fitted(1.0, "a", "b")
    rows = [fitted(1.0, *names) for names in (("a", "c"), ("d", "b"), ("c", "a"), ("e", "f"), ("a", "g"))]
    assert verdict._confusable(best, [rows], 0.0, UNIT) == (("d",), ("c", "g"))


def test_what_a_first_effect_may_leave_is_explained(monkeypatch):
    loose = verdict.SIGNIFICANT_LOOSE
    assert verdict.is_explained(Found("effect", fitted(9.0), fitted(loose)))
    assert not verdict.is_explained(Found("unexplained", fitted(9.0), fitted(loose)))
    monkeypatch.setattr(verdict, "significant_ratio", lambda *given: 1.5)
    found = Found("effect", fitted(9.0), fitted(9.0), candidates=tried(fitted(9.0), fitted(1.5)))
    assert verdict.ended_above_noise(found, None)
    assert not verdict.ended_above_noise(replace(found, candidates=tried(fitted(9.0))), None)


def test_effects_at_the_limit_of_the_heldout_error_stay():
    at = Found("effect", fitted(9.0, heldout=10.0), fitted(1.0, "drag", heldout=9.0))
    assert verdict.confirmed_on_heldout(at) is at
    floor = Found("effect", fitted(9.0, heldout=1.0), fitted(1.0, "drag", heldout=1.5))
    assert verdict.confirmed_on_heldout(floor) is floor
    assert verdict.partial_above_floor(floor) is floor


@pytest.mark.parametrize(("names", "over"), [(("drag",), 1.15), ((), 1.3)])
def test_a_baseline_at_the_limit_leaves_no_more_than_noise(names, over):
    found = verdict.above_noise(Found("effect" if names else "unexplained", fitted(over), fitted(0.9, *names)))
    assert (found.verdict, found.augmented, found.confusable) == ("none", found.baseline, ())
    beyond = Found("effect", fitted(over * 1.01), fitted(0.9, *names))
    assert verdict.above_noise(beyond) is beyond
    none = Found("none", fitted(1.0), fitted(0.9))
    assert verdict.above_noise(none) is none


@pytest.mark.parametrize(
    ("after", "beyond", "kept"), [(0.9, True, True), (1.0, True, False), (1.1, True, False), (0.9, False, False)]
)
def test_an_effect_beyond_chance_that_predicts_better_stays_beside_a_baseline_at_the_noise(
    monkeypatch, after, beyond, kept
):
    monkeypatch.setattr(verdict, "is_beyond_chance", lambda *given: beyond)
    found = Found("effect", fitted(1.1, heldout=1.0), fitted(0.9, "drag", heldout=after))
    assert (verdict.above_noise(found) is found) is kept


@pytest.mark.parametrize(
    ("heldout", "train", "doubted"), [(2.0, 0.5, False), (2.5, 0.5, True), (2.5, 1.5, False), (3.5, 1.5, True)]
)
def test_a_baseline_is_doubted_beyond_twice_the_noise_and_twice_its_own_fit(heldout, train, doubted):
    found = Found("none", fitted(1.0, heldout=heldout, train=train), fitted(1.0))
    assert (verdict.doubted_on_heldout(found) is not found) is doubted
    other = replace(found, verdict="effect")
    assert verdict.doubted_on_heldout(other) is other


def test_lost_counts_are_said_where_nothing_is_missing():
    problem = SimpleNamespace(records=[SimpleNamespace(readings=None)])
    traced = SimpleNamespace(model=SimpleNamespace(problem=problem))

    @dataclass(frozen=True)
    class WithReference(Found):
        reference: int = 0

    none = WithReference("none", traced, fitted(1.0))
    assert verdict.doubted_with_leap(none) is none
    found = verdict.doubted_with_leap(none, lost=True)
    assert (found.verdict, found.words) == ("unexplained", (verdict.LEAPT, "before"))
    effect = replace(none, verdict="effect")
    assert verdict.doubted_with_leap(effect, lost=True) is effect


def by_inner_folds(monkeypatch, *, taken: float, sure: bool) -> None:
    monkeypatch.setattr(verdict, "inner_fold_errors", lambda one, threads: one.names)
    monkeypatch.setattr(verdict, "share", lambda before, after, floor_deg: SimpleNamespace(value=taken))
    monkeypatch.setattr(verdict, "gain", lambda before, after: SimpleNamespace(is_positive=sure))


@pytest.mark.parametrize(
    ("taken", "sure", "heldout", "say"),
    [
        (0.6, True, 1.5, "effect"),
        (0.6, True, 1.6, "partial"),
        (0.59, True, 1.5, "unexplained"),
        (0.6, False, 1.5, "unexplained"),
    ],
)
def test_one_effect_is_named_that_takes_six_tenths_beyond_its_interval(
    monkeypatch, sensible, taken, sure, heldout, say
):
    by_inner_folds(monkeypatch, taken=taken, sure=sure)
    alone, twice = fitted(1.0, "drag", heldout=heldout), fitted(0.5, "drag", "creep")
    odd = fitted(0.1, "odd")
    trace = Found("effect", fitted(1.75), twice, candidates=tried(odd, fitted(5.0, "creep"), alone, twice))
    found = verdict.named_in_part(trace)
    assert found.verdict == say
    if say == "unexplained":
        share_of = f"drag takes {100 * taken:.0f} % of the error above the noise"
        assert found.words == (share_of, "the residual depends on time")
        far = replace(trace, baseline=fitted(2.0))  # at twice the noise it stays as it is
        assert verdict.named_in_part(far) is far
    else:
        assert (found.augmented, found.confusable, found.words) == (alone, ((),), ("of drag",))
    bare = replace(trace, augmented=fitted(1.75))
    assert verdict.named_in_part(bare) is bare  # near the noise, and nothing was named
    senseless = replace(trace, candidates=tried(odd, twice))
    assert verdict.named_in_part(senseless) is senseless


@pytest.mark.parametrize(("others", "say"), [(0, "effect"), (1, "ambiguous"), (2, "ambiguous"), (3, "unexplained")])
def test_an_effect_in_part_may_have_two_others_that_do_as_well(monkeypatch, sensible, others, say):
    by_inner_folds(monkeypatch, taken=0.9, sure=True)
    best = fitted(2.0, "drag", heldout=1.0)
    rows = [fitted(2.0 + 0.01 * k, name) for k, name in enumerate("abc"[:others], 1)]
    again = fitted(2.001, "drag")  # another form of it
    trace = Found("unexplained", fitted(9.0), fitted(9.0), candidates=tried(*rows[::-1], again, best))
    found = verdict.named_in_part(trace)
    assert found.verdict == say
    if say == "unexplained":
        assert found.words[0] == "drag takes 90 % of the error above the noise, and 3 others do as well"
    else:
        assert found.confusable == (tuple("abc"[:others]),)


def test_the_remaining_error_is_said_of_effects_above_the_floor(monkeypatch):
    monkeypatch.setattr(verdict, "smooth_functions", lambda one: TIME)
    trace = Found("effect", fitted(9.0), fitted(2.5, "drag"), floor=replace(UNIT, local_deg=0.5))
    words = "the remaining error is 2.5 deg rms, 5 times the noise; it depends on time"
    assert verdict.with_remaining_error(trace).words == ("before", words)
    for same in (
        replace(trace, augmented=trace.baseline),
        replace(trace, augmented=fitted(2.5, "drag", fold_errors=())),
        replace(trace, augmented=fitted(0.75, "drag")),
        replace(trace, augmented=fitted(0.5, "drag")),
    ):
        assert verdict.with_remaining_error(same) is same
    above = replace(trace, augmented=fitted(0.76, "drag"))
    assert verdict.with_remaining_error(above) is not above


@pytest.mark.parametrize(
    ("taken", "known", "before", "after", "say"),
    [
        (1 / 3, False, 9.0, 3.0, "partial"),
        (0.33, False, 9.0, 3.0, "unexplained"),
        (0.33, True, 9.0, 2.0, "partial"),  # a known rig may be off by twice the noise
        (0.33, True, 9.0, 2.1, "unexplained"),
        (0.33, True, 1.75, 1.75, "partial"),
        (0.33, True, 1.75, 1.8, "unexplained"),  # but not where the effect raises the error
    ],
)
def test_an_effect_in_part_takes_a_third_of_the_heldout_error(monkeypatch, taken, known, before, after, say):
    monkeypatch.setattr(verdict, "share", lambda *given: SimpleNamespace(value=taken))
    trace = Found("effect", fitted(9.0, heldout=before), fitted(1.0, "drag", heldout=after), known=known)
    found = verdict.partial_above_floor(trace)
    assert found.verdict == say
    assert found.words[0] == ("before" if say == "partial" else "drag takes 33 % of the held-out error above the noise")


def test_a_trace_without_confusable_effects_explains_a_part():
    trace = Found("effect", fitted(9.0, heldout=9.0), fitted(1.0, "drag", heldout=3.0), confusable=())
    assert verdict.partial_above_floor(trace).verdict == "partial"


@pytest.mark.parametrize(
    ("left", "names", "first_alike", "stays"),
    [
        (5.0, ("drag", "creep"), (), True),  # 16 - 5 is 11, and 0.6 of 16 - 1 is 9
        (7.0, ("drag", "creep"), ("a", "b"), True),  # just 9
        (7.1, ("drag", "creep"), (), False),
        (5.0, ("drag", "creep"), ("a", "b", "c"), False),
        (5.0, ("drag",), (), False),
        (5.0, ("creep", "drag"), (), False),  # the first one was not fitted by itself
    ],
)
def test_the_first_of_two_effects_stays_where_it_takes_most_by_itself(sensible, left, names, first_alike, stays):
    alone = fitted(left**0.5, "drag", train_square=left)
    rows = tried(fitted(3.9, "drag"), alone, fitted(0.1, "drag", "creep"), fitted(0.1, "odd"), fitted(1.0, "aaa"))
    trace = Found("effect", fitted(4.0), fitted(0.1, *names), candidates=rows, confusable=(first_alike, ()))
    found = verdict._first_alone(trace)
    if stays:
        assert (found.augmented, found.words) == (alone, ("of drag",))
        assert found.confusable == (("aaa",),)  # it leaves less
    else:
        assert found is None


@pytest.mark.parametrize(("heldout", "say"), [(1.5, "ambiguous"), (1.6, "partial")])
@pytest.mark.parametrize(("names", "same"), [(("drag",), ("guide_friction",)), (("guide_friction",), ())])
def test_a_still_zone_is_named_beside_the_effects_and_never_told_from_friction(heldout, say, names, same):
    best = fitted(1.0, *names, "backlash", bic=-40.0, heldout=heldout)
    trace = Found("effect", fitted(9.0, bic=-10.0), fitted(2.0, *names), candidates=("first",), confusable=(("x",),))
    zone = SimpleNamespace(fitted=best, width=0.25, refuted_deg=0.125)
    found = verdict.with_still_zone(trace, zone)
    assert (found.verdict, found.augmented) == (say, best)
    assert found.candidates[0] == "first"
    assert [(c.fitted, c.delta_bic) for c in found.candidates[1:]] == [(best, 30.0)]
    assert found.confusable == (("x",), same)
    assert found.words[0].startswith("after every reversal the angle stands still for 0.25 mm of the drive; a model")
    assert "for twice as far leaves 0.125 deg." in found.words[0]
    assert found.words[1:] == ("before",)


@pytest.mark.parametrize(
    ("before", "after", "taken", "say"),
    [
        (1.15, 0.5, 0.9, "none"),  # no more than noise
        (1.2, 0.5, 0.9, "effect"),
        (1.5, 1.4, 0.3, "none"),
        (1.6, 1.4, 0.3, "unexplained"),
        (9.0, 1.5, 1 / 3, "effect"),
        (9.0, 1.6, 1 / 3, "partial"),
        (9.0, 1.5, 0.33, "unexplained"),
    ],
)
def test_folds_judge_at_their_thresholds(monkeypatch, sensible, before, after, taken, say):
    monkeypatch.setattr(verdict, "smooth_functions", lambda one: TIME)
    monkeypatch.setattr(verdict, "share", lambda *given: SimpleNamespace(value=taken))
    best, other = fitted(after, "drag", bic=-20.0), fitted(after, "creep", bic=-5.0)
    found = SimpleNamespace(baseline=fitted(before), best=best, candidates=(best, other), alike=((),))
    trace = verdict.judge_by_folds(found, ("word",), floor=UNIT)
    assert trace.verdict == say
    named = say in ("effect", "partial")
    assert (trace.augmented is best) is named
    assert trace.alike == (21.0 if named else 10.0)
    part = [f"drag takes {100 * taken:.0f} % of the error above the noise"]
    first = {"none": part if before > 1.15 else [], "effect": [], "partial": ["the remaining residual depends on time"]}
    expected = [*first.get(say, ["the residual depends on time", *part]), "word", *(["of drag"] if named else [])]
    assert trace.words == tuple(expected)


# --- the search by folds -------------------------------------------------------------------------------------------


def test_starts_of_either_sign_are_tried_where_the_bounds_allow_one():
    def amount(name, low, high, **more):
        return FreeParameter(name, "1", low, high, 1.0, **more)

    both, up, shape = amount("a", -2.0, 2.0, linear=True), amount("b", 0.0, 2.0, linear=True), amount("c", -1.0, 1.0)
    down = amount("d", -2.0, 0.0, amount=True)
    form = SimpleNamespace(parameters=(both, up, shape, down))
    start = {"a": 1.0, "b": 1.0, "c": 0.5, "d": -1.0}
    assert by_folds.either_sign(form, [start]) == [start, {**start, "a": -1.0}]
    two = [{"a": 1.0}, {"a": -1.0}, {"a": 0.5}]
    assert by_folds.either_sign(SimpleNamespace(parameters=(both,)), two) == [*two, {"a": -0.5}]
    assert by_folds.either_sign(SimpleNamespace(parameters=(up, shape, down)), [start]) == [start]


class Chosen:
    """Fits of folds whose choices are given; errors are alternating, so that their size is their rms."""

    def __init__(self, choices, errors):
        self.choices, self.sizes, self.folds = choices, errors, tuple(range(len(choices)))

    def chosen(self, models):
        return self.choices

    def heldout(self, models):
        return [self.sizes[one.names] * (-1.0) ** np.arange(120) for one in models]

    def everywhere(self, one):
        return self.heldout([one] * len(self.folds))

    def best(self, models):
        return min(models, key=lambda one: self.sizes[one.names])


@pytest.mark.parametrize(("count", "named"), [(2, False), (3, True)])
def test_more_than_half_of_the_folds_must_choose_an_effect(count, named):
    plain, drag, other = (SimpleNamespace(names=names) for names in ((), ("drag",), ("x",)))
    sizes = {(): 1.0, ("drag",): 0.25, ("x",): 2.0}
    fits = Chosen([drag] * count + [plain] * (4 - count), sizes)
    step = by_folds._named(fits, plain, [plain] * 4, [plain], [drag])
    assert (step is not None) is named
    further = SimpleNamespace(names=("x", "y"))
    fits = Chosen([drag] * 4, sizes | {("x", "y"): 0.5})
    assert by_folds._named(fits, other, [other] * 4, [other], [further]) is None  # no longer than what was named


@pytest.mark.parametrize(("rms", "named"), [(0.89, True), (0.91, False)])
def test_the_error_must_fall_by_a_tenth(rms, named):
    plain, drag = SimpleNamespace(names=()), SimpleNamespace(names=("drag",))
    fits = Chosen([drag] * 2, {(): 1.0, ("drag",): rms})
    assert (by_folds._named(fits, plain, [plain] * 2, [plain], [drag]) is not None) is named


def test_what_a_fold_chose_is_alike_though_it_leaves_more():
    """Two folds chose creep, which all folds leave behind; wheel is as far, and no fold chose it."""
    plain, drag, creep, wheel = (SimpleNamespace(names=names) for names in ((), ("drag",), ("creep",), ("wheel",)))
    fits = Chosen([drag, creep, creep], {(): 1.0, ("drag",): 0.25, ("creep",): 0.5, ("wheel",): 0.5})
    step = by_folds._named(fits, plain, [plain] * 3, [plain], [wheel, creep, drag])
    assert (step.fitted, step.alike) == (drag, ("creep",))
    assert step.chosen == [drag, creep, creep]


@pytest.mark.parametrize(("alike", "count"), [((), 2), (("x",), 2), (("x", "y"), 1)])
def test_a_further_effect_is_named_with_one_other_at_most(monkeypatch, alike, count):
    base, first, second = (Hashed(names=names, mean_square=1.0) for names in ((), ("a",), ("a", "b")))
    steps = iter([SimpleNamespace(fitted=first, chosen=["c"], alike=("v", "w", "u")),
                  SimpleNamespace(fitted=second, chosen=["d"], alike=alike)])  # fmt: skip
    monkeypatch.setattr(by_folds, "front_runners", lambda before, effects, report: [first])
    monkeypatch.setattr(by_folds, "_named", lambda *given: next(steps))
    monkeypatch.setattr(by_folds, "_taken", lambda *given: by_folds.NOT_TOLD)
    monkeypatch.setattr(by_folds, "_square", lambda *given: 1.0)
    fits = SimpleNamespace(folds=(0,), chosen=lambda models: ["o"], best=lambda models: base,
                           with_fold_errors=lambda one, chosen: (one, chosen))  # fmt: skip
    found = by_folds.find_by_folds([base], [SimpleNamespace(name="a")], fits, lambda words: None)
    assert found.baseline == (base, ["o"])
    assert found.best == ((second, ["d"]) if count == 2 else (first, ["c"]))
    assert len(found.alike) == count
    assert len(found.candidates) == 2


def test_effects_are_tried_beside_the_baseline_that_predicts_best_and_beside_the_one_that_fits_best(monkeypatch):
    predicts, fits_, worse = (Hashed(names=(), mean_square=m) for m in (2.0, 1.0, 3.0))
    asked = []
    monkeypatch.setattr(by_folds, "front_runners", lambda before, effects, report: asked.append(before) or [])
    fits = SimpleNamespace(folds=(0,), chosen=lambda models: ["o"], best=lambda models: predicts,
                           with_fold_errors=lambda one, chosen: one)  # fmt: skip
    found = by_folds.find_by_folds([worse, predicts, fits_], [], fits, lambda words: None)
    assert asked == [predicts, fits_]
    assert (found.baseline, found.best, found.candidates, found.alike) == (predicts, predicts, (), ())


def test_a_fit_to_all_starts_at_the_start_of_the_problem_which_is_its_prior_mean_too(monkeypatch):
    given = []
    monkeypatch.setattr(by_folds, "fit", lambda *args, **more: given.append((args, more)) or "fit")
    stiff, gap = FreeParameter("stiff", "N", 0.0, 9.0, 0.5), FreeParameter("gap", "mm", 0.0, 9.0, 0.25)
    added = (SimpleNamespace(effect=None, form=SimpleNamespace(parameters=(gap,))),)
    records = [SimpleNamespace(kept=np.arange(n)) for n in (3, 2)]
    model = Model(SimpleNamespace(parameters=(stiff,), start={"stiff": 2.0}, records=records), added)
    assert by_folds.fit_all(model, [{"gap": 1.0}]) == "fit"
    (fitted_model, everything, start), more = given[0]
    assert fitted_model is model
    assert [mask.tolist() for mask in everything.train] == [[True] * 3, [True] * 2]
    assert start.tolist() == [4.0, 4.0]
    assert more["prior_mean"].tolist() == [4.0]


def test_a_start_without_a_solution_gives_way_to_the_next_one(monkeypatch):
    starts = {1: SimpleNamespace(gain=50.0, added=1, x=1), 2: SimpleNamespace(gain=40.0, added=2, x=2)}
    monkeypatch.setattr(by_folds, "linearised_gain", lambda best, added, values: starts[values])
    monkeypatch.setattr(by_folds, "either_sign", lambda form, values: values)
    monkeypatch.setattr(by_folds, "AddedEffect", lambda effect, form: None)
    monkeypatch.setattr(by_folds, "Model", lambda problem, added: added)
    monkeypatch.setattr(by_folds, "implausible", lambda one: ())

    def fit_to_all(model, x):
        if x == 1:
            raise SolverError("no equilibrium")
        return model

    monkeypatch.setattr(by_folds, "fit_to_all", fit_to_all)
    problem = SimpleNamespace(forms=lambda effect: [2, 1], starts=lambda form: [form])
    best = SimpleNamespace(model=SimpleNamespace(problem=problem, added=("own",)), names=("own",))
    words = []
    assert by_folds._front_runner(best, SimpleNamespace(name="drag"), words.append) == ("own", 2)
    assert words == ["own + drag"] * 2


def test_a_fold_without_a_solution_has_large_errors_in_the_records_that_it_has():
    none = FoldFits((), {})
    object.__setattr__(none, "fitted", lambda *given: None)
    fold = Fold((np.array([True, True, False]), np.zeros(2, dtype=bool), np.array([False, True])), "f")
    assert [e.tolist() for e in none.errors(None, fold)] == [[1e3, 1e3], [1e3]]


# --- ranks ---------------------------------------------------------------------------------------------------------


def test_a_ranked_model_is_named_without_what_a_reference_has():
    def one(value, *names):
        errors = [value * (-1.0) ** np.arange(8)]
        return SimpleNamespace(names=names, heldout_rmse_deg=value, heldout_errors=errors, heldout_error_deg=errors[0],
                               fold_errors=None)  # fmt: skip

    best = one(0.5, "known", "drag", "creep")
    trace = SimpleNamespace(candidates=[SimpleNamespace(names=best.names, fitted=best, delta_bic=12.0)],
                            baseline=one(2.0, "known"), augmented=best, names=("drag", "creep"))  # fmt: skip
    first, alone = ranking.ranked_models(trace)
    assert (first.name, first.chosen, alone.name, alone.chosen) == ("drag + creep", True, "", False)
    assert (first.bic_above_best, alone.bic_above_best) == (0.0, 12.0)
    assert (first.low_deg, first.high_deg) == pytest.approx((0.5 - 0.245, 0.5 + 0.245))  # 1.96 * 0.5 / 4


# --- rows that belong together -------------------------------------------------------------------------------------


def rows_of_two(n=2):
    return [np.ones(4) for _ in range(n)]


@pytest.mark.parametrize(
    "call",
    [
        lambda: folds.fold_errors(SimpleNamespace(errors=rows_of_two()), Fold((np.ones(4, dtype=bool),), "f")),
        lambda: Fold((np.ones(4, dtype=bool),) * 2, "a").training(Fold((np.ones(4, dtype=bool),), "b")),
        lambda: folds._blocks(rows_of_two(2), rows_of_two(1)),
        lambda: estimate_noise_floor([raw([slice(0, 4)])] * 2, rows_of_two(1)),
        lambda: repeatability_deg([raw([slice(0, 4)])] * 2, rows_of_two(1)),
        lambda: noise._third_difference_deg([raw([slice(0, 4)])] * 2, rows_of_two(1), 1),
        lambda: dependence._quantities(
            replace_in(residual_of([inputs_of_four()], [np.ones(4)]),
                       errors=rows_of_two(2))
        ),
        lambda: made(rows_of_two(2), train=(np.ones(4, dtype=bool),)).heldout_errors,
        lambda: two_effects().coordinates({"stiff": 1.0, "slope": 1.0}, [{"gap": 1.0}]),
        lambda: two_effects().values(np.zeros(4)),
        lambda: two_effects()._errors_of([np.zeros(2), np.zeros(1), np.zeros(2)]),
        lambda: OfTwoFolds().heldout([None]),
        lambda: OfTwoFolds().with_fold_errors(made(rows_of_two(1)), [None]),
    ],
)  # fmt: skip
def test_rows_of_different_records_are_refused(call):
    with pytest.raises(ValueError, match=r"zip\(\)"):
        call()


def inputs_of_four() -> SampleInputs:
    return SampleInputs(np.arange(4.0), np.arange(4.0), np.ones(4, dtype=int), False)


class OfTwoFolds(FoldFits):
    def __init__(self):
        super().__init__(tuple(Fold((np.arange(4) < 2,), str(i)) for i in range(2)))

    def errors(self, candidate, fold, *also):
        return [np.zeros(2)]
