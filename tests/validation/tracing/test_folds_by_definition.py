"""Folds, held-out samples, channels and ranks at their thresholds, and what folds name, by hand."""

from __future__ import annotations

import math
from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest
from made_fits import made, one_record

from fem_models.rig.checks import SolverError
from hysteresis.records.record import Record
from validation.tracing.effect import FreeParameter
from validation.tracing.fitting import folds, holdout, ranking
from validation.tracing.fitting.channel_errors import channel_table, channel_words
from validation.tracing.fitting.fitted import ChannelErrors
from validation.tracing.fitting.folds import Fold, folds_of, gain, has_folds, share
from validation.tracing.fitting.holdout import Holdout, Protocol, _most_covered, divide_records
from validation.tracing.fitting.model import Model
from validation.tracing.fitting.noise import NoiseFloor
from validation.tracing.prepared import prepared
from validation.tracing.search import by_folds
from validation.tracing.search.by_folds import FoldFits


class Hashed(SimpleNamespace):
    """A stand-in that may be a key, as fits are."""

    __hash__ = object.__hash__


# --- where a floor is from -----------------------------------------------------------------------------------------


def test_a_reference_below_the_noise_does_not_tell_it():
    """It leaves 0.05 deg, cycles differ by 0.1 deg, and neighbours by 0.2 deg, or else by what is not known."""
    cycles = NoiseFloor(0.2, 0.1, reference_deg=0.05)
    assert (cycles.deg, cycles.how) == (0.1, "cycles or trials that repeat each other")
    unknown = NoiseFloor(0.2, 0.1, reference_deg=0.05, local_known=False)
    assert (unknown.known, unknown.how) == (False, "cycles or trials that repeat each other, by noise or by a drift")
    neighbours = NoiseFloor(0.2, None, reference_deg=0.05)
    assert (neighbours.deg, neighbours.how) == (0.2, "neighbouring samples")
    assert NoiseFloor(0.2, None, reference_deg=0.3).how == "the residual that the reference leaves"


# --- folds -------------------------------------------------------------------------------------------------------


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


def test_the_score_of_a_fold_has_the_square_of_the_noise_beside_that_of_its_errors():
    """Three errors of mean square 3, and a noise of 0.5 deg: -3/2 log(3.25)."""
    errors = [np.array([1.0, 2.0]), np.array([-2.0])]
    assert folds.log_score(errors, 0.5) == pytest.approx(-1.5 * math.log(3.25))


def test_all_is_taken_of_a_square_within_the_noise_however_small_it_is():
    assert folds._part(1e-10, 0.5e-10, 1.0) == 1.0
    assert folds._part(0.5e-10, 1e-10, 1.0) == 0.0
    assert folds._part(0.0, 0.0, 0.0) == 0.0


# --- held-out samples --------------------------------------------------------------------------------------------


@pytest.mark.parametrize(("trials", "first"), [(2, 2), (3, 3), (5, 5), (6, 5), (9, 7)])
def test_the_last_third_of_trials_under_a_force_is_held_out(trials, first):
    cycle = np.repeat(np.arange(1, trials + 1), 10)
    force = np.tile(np.linspace(0.0, 3.0, 10), trials)
    one = prepared(Record(force, 2 * force, drive_unit="N", cycle=cycle), np.arange(force.size))
    found = divide_records([one])
    assert found.by == f"trials from {first} on"
    assert found.train[0].tolist() == (cycle < first).tolist()


def test_a_record_that_is_held_out_begins_in_training():
    """Another one, of few training samples, such as two cycles before a long dwell, has the zero of those."""
    few = Holdout((np.arange(10) < 1,), "n")
    assert not few.is_held_out(0)
    assert few.offset_deg(0, np.arange(10.0)) == 0.0
    assert Holdout((np.zeros(10, dtype=bool),), "n").offset_deg(0, np.arange(10.0)) == 4.5
    rows = [one_record(20, rig={"preload_N": 2.0}) for _ in range(3)]
    assert [int(mask.sum()) for mask in divide_records(rows).train] == [20, 20, 1]  # a twentieth; of equals the last
    assert divide_records(rows).whole == {2}
    many = [one_record(45, rig={"preload_N": 2.0}) for _ in range(3)]
    assert int(divide_records(many).train[2].sum()) == 3  # samples 0, 1 and 2 are before 2.25
    assert divide_records(many[:2]).whole == set()


def test_a_record_with_a_preload_of_its_own_is_held_out_only_where_that_may_be():
    rows = [one_record(40, 2, rig={"preload_N": p}) for p in (1.0, 2.0, 4.0)]
    assert [mask.mean() for mask in divide_records(rows).train] == [1.0, 1.0, 0.05]
    assert [mask.mean() for mask in divide_records(rows, own_preload=False).train] == [0.5, 0.5, 0.5]
    shared = [one_record(40, 2, rig={"preload_N": p}) for p in (1.0, 4.0, 4.0)]
    assert [mask.mean() for mask in divide_records(shared, own_preload=False).train] == [1.0, 1.0, 0.05]


@pytest.mark.parametrize("order", [(0, 1, 2, 3), (1, 0, 2, 3), (3, 2, 1, 0), (2, 0, 3, 1)])
def test_of_four_records_the_smallest_of_a_shared_preload_is_held_out_wherever_it_stands(order):
    small, large, alone, other = (
        prepared(Record(size * one.record.drive, one.record.angle_deg, rig={"preload_N": preload}), one.kept)
        for one in [one_record(40, 2)]
        for size, preload in ((0.5, 4.0), (1.0, 4.0), (1.0, 1.0), (1.0, 9.0))
    )
    rows = [(small, large, alone, other)[i] for i in order]
    found = divide_records(rows, own_preload=False)
    assert [mask.mean() for mask in found.train] == [0.05 if one is small else 1.0 for one in rows]


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


# --- channels ----------------------------------------------------------------------------------------------------


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


# --- the search by folds -----------------------------------------------------------------------------------------


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
    found = by_folds.find_by_folds([base], [SimpleNamespace(name="a")], fits, lambda *_: None)
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
    found = by_folds.find_by_folds([worse, predicts, fits_], [], fits, lambda *_: None)
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
    assert by_folds._front_runner(best, SimpleNamespace(name="drag"), lambda said, ahead: words.append(said)) == (
        "own",
        2,
    )
    assert words == ["own + drag"] * 2


def test_a_fold_without_a_solution_has_large_errors_in_the_records_that_it_has():
    none = FoldFits((), {})
    object.__setattr__(none, "fitted", lambda *given: None)
    fold = Fold((np.array([True, True, False]), np.zeros(2, dtype=bool), np.array([False, True])), "f")
    assert [e.tolist() for e in none.errors(None, fold)] == [[1e3, 1e3], [1e3]]


# --- ranks -------------------------------------------------------------------------------------------------------


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


class OfTwoFolds(FoldFits):
    def __init__(self):
        super().__init__(tuple(Fold((np.arange(4) < 2,), str(i)) for i in range(2)))

    def errors(self, candidate, fold, *also):
        return [np.zeros(2)]


FOUR, ONES = np.ones(4, dtype=bool), np.ones(4)


@pytest.mark.parametrize(
    "call",
    [
        lambda: folds.fold_errors(SimpleNamespace(errors=[ONES, ONES]), Fold((FOUR,), "f")),
        lambda: Fold((FOUR, FOUR), "a").training(Fold((FOUR,), "b")),
        lambda: folds._blocks([ONES, ONES], [ONES]),
        lambda: OfTwoFolds().heldout([None]),
        lambda: OfTwoFolds().with_fold_errors(made([ONES]), [None]),
        lambda: OfTwoFolds().with_fold_errors(made([ONES, ONES]), [None, None]),
    ],
)
def test_rows_of_different_records_or_folds_are_refused(call):
    with pytest.raises(ValueError, match=r"zip\(\)"):
        call()
