"""The verdict, the search by folds and the still zone, by definition."""

from __future__ import annotations

from types import SimpleNamespace

import numpy as np
import pytest
from made_fits import made

from fem_models.rig.checks import SolverError
from validation.tracing import cross_validated, verdict
from validation.tracing.fitting.folds import Fold
from validation.tracing.fitting.noise import NoiseFloor
from validation.tracing.search import by_folds, still_zone
from validation.tracing.search.by_folds import FoldFits
from validation.tracing.settings import AT_FLOOR, SIGNIFICANT

NOISE = NoiseFloor(local_deg=0.1, repeats_deg=None)


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
    assert verdict.depends_on(time) == "the residual depends on time, rate"
    assert verdict.depends_on(time, "it") == "it depends on time, rate"
    assert verdict.depends_on(nothing, "it") == "it follows none of the quantities that were tested"
    assert verdict.depends_on(nothing) == "the remaining residual follows none of the quantities that were tested"


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
        (0.14, 0.116, "none"),  # of a reference: two thirds of what is above the noise, and less than a third of all
        (0.14, 0.114, "effect"),
    ],
)
def test_folds_name_what_takes_a_third_of_the_error_above_the_noise(monkeypatch, before, after, expected):
    monkeypatch.setattr(cross_validated, "smooth_functions", lambda fit: SimpleNamespace(names=("time",)))
    monkeypatch.setattr(cross_validated, "remarks", lambda fit: ["remark"])
    baseline, best = fitted(before), fitted(after, "drag", bic_=-50.0)
    other = fitted(after, "creep", bic_=-30.0)
    found = SimpleNamespace(baseline=baseline, best=best, candidates=(best, other), alike=((),))
    trace = cross_validated.judge_by_folds(found, ("word",), floor=NOISE, reference=2)
    assert (trace.verdict, trace.reference) == (expected, 2)
    assert [c.delta_bic for c in trace.candidates] == [50.0, 30.0]
    named = expected in ("effect", "partial")
    assert trace.augmented is (best if named else baseline)
    assert trace.confusable == (((),) if named else ())
    part = f"drag takes {100 * (before**2 - after**2) / (before**2 - 0.01):.0f} % of the error above the noise"
    whole = 100 * (1 - (after / before) ** 2)
    of_all = f"drag takes {whole:.0f} % of the error, too little of what the reference leaves"
    words = {
        "none": ("word",) if before < 0.12 else (of_all, "word"), "effect": ("word", "remark"),
        "partial": ("the remaining residual depends on time", "word", "remark"),
        "unexplained": ("the residual depends on time", part, "word"),
    }  # fmt: skip
    assert trace.words == words[expected]
    assert trace.alike == 10.0  # nothing is alike
    confused = cross_validated.judge_by_folds(
        SimpleNamespace(**{**vars(found), "alike": (("creep",),)}), ("word",), floor=NOISE, reference=2
    )
    assert confused.verdict == ("ambiguous" if expected == "effect" else expected)
    assert confused.alike == (21.0 if named else 10.0)  # 50 - 30, and one more


# --- the search by folds -------------------------------------------------------------------------------------------


class StandIn(SimpleNamespace):
    """Stands for a fitted model, which is the same as no other one."""

    __hash__ = object.__hash__
    __eq__ = object.__eq__


def test_fits_of_folds_are_made_once_and_errors_are_large_without_a_solution(monkeypatch):
    made_ = []

    def fit_(model, holdout, start):
        made_.append((model.name, [mask.tolist() for mask in holdout.train]))
        if model.name == "none":
            raise SolverError("no equilibrium")
        return SimpleNamespace(errors=[np.arange(4.0) + start])

    monkeypatch.setattr(by_folds, "_fit", fit_)
    parts = tuple(Fold((np.arange(4) == i,), str(i)) for i in range(4))
    fits = FoldFits(parts)
    of_one, of_none = SimpleNamespace(name="one", problem=None), SimpleNamespace(name="none", problem=None)
    one, none = StandIn(model=of_one, x=10.0), StandIn(model=of_none, x=0.0)
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


def test_a_model_does_not_get_the_fit_of_one_that_is_no_longer_there(monkeypatch):
    """Its number, which Python gives again, is not what tells models apart."""
    monkeypatch.setattr(by_folds, "_fit", lambda model, holdout, start: SimpleNamespace(errors=[np.full(2, start)]))
    parts = tuple(Fold((np.arange(2) == i,), str(i)) for i in range(2))
    fits, model = FoldFits(parts), SimpleNamespace(problem=None)
    for x in np.arange(50.0):
        assert fits.errors(StandIn(model=model, x=x), parts[0])[0].tolist() == [x]


def stand_ins(drive):
    """Two models, a and b, of one record."""
    problem = SimpleNamespace(inputs=[SimpleNamespace(drive=np.array(drive))])
    return [
        SimpleNamespace(name=name, noise=NOISE, errors=(np.zeros(len(drive)),), model=SimpleNamespace(problem=problem))
        for name in "ab"
    ]


def fits_of(rows, folds):
    """Fits whose error of each model on each fold is given."""

    class Fits(FoldFits):
        def errors(self, candidate, fold, *also):
            assert fold not in also
            return [np.array(rows[candidate.name][int(fold.name)], dtype=float)]

    return Fits(folds)


def test_each_fold_chooses_by_the_others_and_all_by_all():
    """Scores of a and b on each fold; a fold's own score does not count. Of equals the first."""
    parts = tuple(Fold((np.arange(3) == i,), str(i)) for i in range(3))
    a, b = stand_ins([0.0, 0.0, 0.0])
    fits = fits_of({"a": [[1], [1], [9]], "b": [[2], [2], [1]]}, parts)
    # log errors: a 0, 0, 2.2; b 0.7, 0.7, 0
    assert [one.name for one in fits.chosen([a, b])] == ["b", "b", "a"]
    assert fits.best([a, b]) is b
    assert fits.best([a, a]) is a
    assert fits.chosen_without([a, b], 2) is a


@pytest.mark.parametrize(("top", "best"), [(1.1, "b"), (1.3, "a")])
def test_a_fold_that_reaches_further_does_not_choose(top, best):
    """Of three records from 0 on, two reach to 1 and one to ``top``, which is b's; beyond a tenth more it is left out.

    Left out itself, it reaches as far beyond: then the folds of both others choose, which a predicts better.
    """
    drive = [0.0, 0.5, 1.0, 0.0, 0.5, 1.0, 0.0, 0.5, top]
    parts = tuple(Fold((np.arange(9) // 3 == i,), str(i)) for i in range(3))
    a, b = stand_ins(drive)
    fits = fits_of({"a": [[1, 1, 1]] * 2 + [[20, 20, 20]], "b": [[2, 2, 2]] * 2 + [[1, 1, 1]]}, parts)
    assert fits.best([a, b]).name == best
    assert fits.chosen_without([a, b], 0).name == best
    assert fits.chosen_without([a, b], 2).name == "a"


def test_where_every_fold_reaches_further_all_choose():
    """Two records of one sample each, at other drives: neither has been where the other is."""
    parts = tuple(Fold((np.arange(2) == i,), str(i)) for i in range(2))
    a, b = stand_ins([0.0, 1.0])
    fits = fits_of({"a": [[2], [2]], "b": [[1], [1]]}, parts)
    assert fits.best([a, b]) is b


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
    monkeypatch.setattr(by_folds, "_front_runner", lambda best, effect, report, ahead: rows[effect.name])
    effects = [SimpleNamespace(name=name) for name in "abcdefg"]
    found = by_folds.front_runners(SimpleNamespace(names=("g",)), effects, None)
    assert [one.mean_square for one in found] == [1, 2, 4, 5, 6]
    rows["d"] = SimpleNamespace(mean_square=3)
    assert [one.mean_square for one in by_folds.front_runners(SimpleNamespace(names=()), effects, None)] == list(
        range(5)
    )


@pytest.mark.parametrize(("gained", "tried"), [(1.01, ["drag"]), (0.99, [])])
def test_a_start_must_have_a_linearised_gain(monkeypatch, gained, tried):
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
    found = by_folds._front_runner(best, SimpleNamespace(name="drag"), lambda said, ahead: words.append(said))
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
    asked, contained = [], []

    def name(fits, before, chosen, without, front):
        contained.append(without)
        return next(steps)

    def front(before, effects, report):
        asked.append((before, [e.name for e in effects]))
        return [first]

    monkeypatch.setattr(by_folds, "front_runners", front)
    monkeypatch.setattr(by_folds, "_named", name)
    monkeypatch.setattr(by_folds, "_taken", lambda *given: 1.0)
    monkeypatch.setattr(by_folds, "_square", lambda *given: 1.0)
    fits = SimpleNamespace(folds=(0,), chosen=lambda models: [base], best=lambda models: base,
                           with_fold_errors=lambda one, chosen: one)  # fmt: skip
    effects = [SimpleNamespace(name=name) for name in "abwv"]
    found = by_folds.find_by_folds([base, base], effects, fits, lambda *_: None)
    assert len(found.best.names) == named
    assert len(found.alike) == named
    assert asked == [(base, list("abwv")), (first, list("ab"))]  # those that are alike share the size of the first
    assert contained == [[base, base], [base, base, first]]  # what folds may choose without a further effect


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
