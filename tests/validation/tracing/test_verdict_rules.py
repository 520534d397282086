"""Rules of the verdict just within and just beyond their thresholds, on traces with errors that are set by hand."""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from types import SimpleNamespace

import numpy as np
import pytest

from validation.tracing import cross_validated, verdict
from validation.tracing.fitting.noise import NOT_KNOWN, NoiseFloor
from validation.tracing.fitting.ranking import ranked_models
from validation.tracing.settings import (
    AT_FLOOR,
    AT_NOISE,
    FAR_ABOVE,
    MISFIT_ALIKE,
    NEAR_NOISE,
    SIGNIFICANT,
    SIGNIFICANT_LOOSE,
)
from validation.tracing.trace import _confirmed

NOISE = NoiseFloor(local_deg=0.1, repeats_deg=None)
SMOOTH = SimpleNamespace(names=("time",), bic=lambda samples: 0.0)


def fitted(rmse: float, heldout: float = 0.0, *, names: tuple[str, ...] = (), bic: float = 0.0) -> SimpleNamespace:
    return SimpleNamespace(
        names=names, rmse_deg=rmse, mean_square=rmse**2, train_rmse_deg=rmse, train_square=rmse**2,
        heldout_rmse_deg=heldout, heldout_errors=[np.full(50, heldout)], samples=100.0, bic=lambda samples: bic,
        fold_errors=None,
    )  # fmt: skip


@dataclass(frozen=True)
class Found:
    """What the rules read of a trace."""

    verdict: str
    baseline: SimpleNamespace
    augmented: SimpleNamespace
    effects: tuple[str, ...] = ()
    floor: NoiseFloor = NOISE
    words: tuple[str, ...] = ("before",)
    confusable: tuple[tuple[str, ...], ...] = ((),)
    known: bool = False
    smooth: SimpleNamespace = field(default_factory=lambda: SMOOTH)
    candidates: tuple[SimpleNamespace, ...] = ()
    model: str = "rig"

    @property
    def names(self) -> tuple[str, ...]:
        return self.augmented.names


def named(before: float, after: float, *, heldout: tuple[float, float] = (0.0, 0.0), say: str = "effect") -> Found:
    effect = fitted(after, heldout[1], names=("gravity",))
    return Found(say, fitted(before, heldout[0]), effect, effects=("gravity",))


def test_what_predicts_better_has_the_lower_heldout_error():
    low, high = named(1, 1, heldout=(1, 0.2)), named(1, 1, heldout=(1, 0.3))
    assert verdict.predicts_better(low, high)
    assert not verdict.predicts_better(high, low)
    assert not verdict.predicts_better(low, low)


def test_effects_that_are_taken_back_predict_no_better_than_play_operators_with_theirs():
    """Three effects of an equivalent rig had come below a delay beside play operators, and nothing was named."""
    by_folds = named(3.2, 0.6, heldout=(3.2, 0.7), say="partial")
    several = named(3.7, 0.5, heldout=(3.7, 0.6))
    several = replace(several, augmented=fitted(0.5, 0.6, names=("time_delay", "tip_contact")), model="equivalent rig")
    assert not verdict.predicts_better(by_folds, several)
    assert _confirmed(several).verdict == "unexplained"
    assert verdict.predicts_better(by_folds, _confirmed(several))


@pytest.mark.parametrize(("say", "expected"), [("effect", "partial"), ("ambiguous", "partial"), ("none", "none")])
def test_effects_that_leave_more_than_the_floor_explain_a_part(say: str, expected: str):
    assert verdict.partial_above_floor(named(1, 1, heldout=(1, 1.01 * AT_FLOOR * 0.1), say=say)).verdict == expected
    assert verdict.partial_above_floor(named(1, 1, heldout=(1, 0.99 * AT_FLOOR * 0.1), say=say)).verdict == say


def test_several_effects_of_an_unknown_rig_are_named_at_the_noise_only():
    both = named(1, 1, heldout=(1, 0.2))
    both.augmented.names = ("gravity", "tip_load")
    taken = verdict.partial_above_floor(both)
    assert (taken.verdict, taken.augmented) == ("unexplained", both.baseline)
    assert taken.words[0] == "gravity + tip_load leave 2 times the noise of an unknown rig: too much for several"
    assert verdict.partial_above_floor(replace(both, known=True)).verdict == "partial"
    many = replace(named(1, 1, heldout=(1, 0.2)), known=True, confusable=(("a", "b"), ("c", "d", "e")))
    assert verdict.partial_above_floor(many).words[0] == "gravity explains a part, and 3 others do as well"
    few = replace(many, confusable=(("a", "b"),))
    assert verdict.partial_above_floor(few).verdict == "partial"
    at_noise = named(1, 1, heldout=(1, 0.14))
    at_noise.augmented.names = both.augmented.names
    assert verdict.partial_above_floor(at_noise) is at_noise


@pytest.mark.parametrize(
    ("left", "first_alike", "known", "verdict_of", "said"),
    [
        (0.2, ("a", "b"), True, "partial", ("gravity",)),
        (0.2, ("a", "b"), False, "unexplained", ()),  # of an unknown rig several are not named in part at all
        (0.2, ("a", "b", "c"), True, "unexplained", ()),  # what it is itself is open
        (0.636, (), True, "partial", ("gravity",)),  # 0.6 of 1 - 0.1^2 are taken at sqrt(1 - 0.594) = 0.637
        (0.638, (), True, "unexplained", ()),
    ],
)
def test_a_first_effect_stays_where_only_the_second_is_open(monkeypatch, left, first_alike, known, verdict_of, said):
    """A loss of preload took 6.4 times the noise to 2.3, and was taken back with a second effect, one of five alike."""
    monkeypatch.setattr(verdict, "implausible", lambda one: ())
    monkeypatch.setattr(verdict, "remarks", lambda one: ())
    both = replace(named(1, 1, heldout=(1, 0.19)), known=known, confusable=(first_alike, ("c", "d", "e")))
    both.augmented.names = ("gravity", "time_delay")
    alone, worse = fitted(left, 0.3, names=("gravity",)), fitted(0.7, 0.7, names=("gravity",))
    near = fitted(1.02 * left, 0.3, names=("tip_load",))
    other = replace(both, candidates=tuple(SimpleNamespace(names=g.names, fitted=g) for g in (worse, alone, near)))
    found = verdict.partial_above_floor(other)
    assert found.verdict == verdict_of
    assert found.augmented.names == said
    if said:
        assert found.augmented is alone
        assert found.confusable == (("tip_load",),)
        monkeypatch.setattr(verdict, "implausible", lambda one: ("no sense",) if one.names == said else ())
        assert verdict.partial_above_floor(other).verdict == "unexplained"


@pytest.mark.parametrize("say", ["effect", "ambiguous", "partial"])
def test_effects_that_take_less_than_a_third_of_the_heldout_error_are_not_named(say: str):
    """Of the mean square above the noise: 0.49 from 1 leaves 0.52 of 0.99, 0.81 leaves 0.81."""
    assert verdict.partial_above_floor(named(1, 1, heldout=(1, 0.7), say=say)).verdict == "partial"
    for after, expected in ((0.818, "partial"), (0.820, "unexplained")):  # 1 - 0.33 * 0.99 is 0.819 squared
        assert verdict.partial_above_floor(named(1, 1, heldout=(1, after), say=say)).verdict == expected
    for before, after, expected in ((0.2, 0.195, "partial"), (0.2, 0.205, "unexplained"), (0.23, 0.205, "unexplained")):
        off = replace(named(1, 1, heldout=(before, after), say=say), known=True)  # a known rig may be off by 2
        assert verdict.partial_above_floor(off).verdict == expected
    taken = verdict.partial_above_floor(named(1, 1, heldout=(1, 0.9), say=say))
    assert (taken.augmented, taken.confusable) == (taken.baseline, ())
    assert taken.words == (
        "gravity takes 19 % of the held-out error above the noise", "the residual depends on time",
    )  # fmt: skip


def test_effects_that_do_not_lower_the_heldout_error_are_taken_back():
    """At 0.9 of the error before they stay, and so they do at the floor."""
    far, worth = named(1, 1, heldout=(1.0, 0.91)), named(1, 1, heldout=(1.0, 0.89))
    assert verdict.confirmed_on_heldout(worth) is worth
    taken = verdict.confirmed_on_heldout(far)
    assert (taken.verdict, taken.augmented) == ("unexplained", far.baseline)
    assert taken.words == (
        "with gravity the held-out error is 0.91 deg, that of the baseline model is 1 deg",
        "the residual depends on time",
    )
    at_floor = named(1, 1, heldout=(0.12, 0.99 * AT_FLOOR * 0.1))
    assert verdict.confirmed_on_heldout(at_floor) is at_floor
    nothing = replace(far, effects=())
    assert verdict.confirmed_on_heldout(nothing) is nothing


@pytest.mark.parametrize(("effects", "over"), [(("gravity",), SIGNIFICANT), ((), SIGNIFICANT_LOOSE)])
def test_nothing_is_missing_where_the_baseline_comes_to_the_noise(effects: tuple[str, ...], over: float):
    within = replace(named(0.999 * over * 0.1, 0.1, say="unexplained"), effects=effects)
    beyond = replace(named(1.001 * over * 0.1, 0.1, say="unexplained"), effects=effects)
    assert verdict.above_noise(beyond) is beyond
    found = verdict.above_noise(within)
    assert (found.verdict, found.augmented) == ("none", within.baseline)
    assert found.words[0].startswith("gravity is not needed: without it, the error" if effects else "the error")
    assert f"{over:.2g} times the noise" in found.words[0]


def test_nothing_is_claimed_without_knowing_the_noise():
    none = named(0.1, 0.1, say="none")
    unknown = replace(none, floor=replace(NOISE, local_known=False))
    assert verdict.doubted_without_noise(none) is none
    assert verdict.doubted_without_noise(unknown).verdict == "unexplained"
    assert verdict.doubted_without_noise(unknown).words == (NOT_KNOWN, "before")
    assert verdict.doubted_without_noise(replace(unknown, verdict="effect")).verdict == "effect"


def test_nothing_is_claimed_where_the_heldout_error_is_far_above_the_fitted_one():
    far, near = (named(0.15, 0.1, heldout=(f * FAR_ABOVE * 0.15, 0), say="none") for f in (1.01, 0.99))
    assert verdict.doubted_on_heldout(near) is near
    assert verdict.doubted_on_heldout(replace(far, known=True)).verdict == "none"
    doubted = verdict.doubted_on_heldout(far)
    assert doubted.verdict == "unexplained"
    assert doubted.words[0] == "the held-out error of the baseline model is 0.3 deg, 3 times the noise"


def test_models_are_as_good_up_to_twice_the_misfit_or_fifteen_percent_of_rms():
    """Of errors near the noise the misfit counts, far above it the ratio; the noise of fits is 1.05 of the floor."""
    near = fitted(0.11)
    misfit = 0.11**2 - (AT_NOISE * 0.1) ** 2
    for part, good in ((0.99, True), (1.01, False)):
        assert verdict.is_as_good(fitted((0.11**2 + part * misfit) ** 0.5), near, NOISE) is good
        assert verdict.is_as_good(fitted(part * MISFIT_ALIKE * 1.0), fitted(1.0), NOISE) is good
    assert not verdict.is_as_good(fitted(0.1), fitted(0.1), NOISE)  # at the noise there is no misfit to share


def test_the_best_trace_has_the_lowest_criterion_and_one_without_a_name_that_of_its_smooth_functions():
    effect = Found("effect", fitted(1), fitted(0.2, names=("gravity",), bic=-50.0))
    plain = Found("unexplained", fitted(1), fitted(0.3, bic=-90.0))
    assert verdict.best_of([effect, plain]) is effect  # smooth functions: 0, not -90
    smooth = replace(plain, smooth=SimpleNamespace(names=("time",), bic=lambda samples: -60.0))
    assert verdict.best_of([effect, smooth]) is smooth
    assert verdict.is_explained(replace(effect, augmented=fitted(0.99 * SIGNIFICANT_LOOSE * 0.1)))
    assert not verdict.is_explained(effect)
    assert not verdict.is_explained(replace(plain, augmented=fitted(0.1)))


def test_candidates_are_ranked_with_their_intervals():
    """Half an interval is 1.96 of the standard error of an rms, rms/sqrt(2 n), of n samples that are independent."""
    signs = (-1.0) ** np.arange(200)  # neighbours are not correlated

    def one(rmse: float, *names: str) -> SimpleNamespace:
        return SimpleNamespace(
            names=names, heldout_rmse_deg=rmse, heldout_errors=[rmse * signs], heldout_error_deg=rmse * signs,
            fold_errors=None,
        )  # fmt: skip

    best, second, lost = one(0.1, "drag"), one(0.2, "creep"), one(np.inf, "wheel")
    rows = ((second, 30.0), (lost, 90.0), (best, 50.0))
    candidates = [SimpleNamespace(names=c.names, fitted=c, delta_bic=gain) for c, gain in rows]
    trace = SimpleNamespace(candidates=candidates, baseline=one(0.4), augmented=best, names=("drag",))
    first, other, alone = ranked_models(trace)
    assert [first.name, other.name, alone.name] == ["drag", "creep", ""]
    assert [first.chosen, other.chosen, alone.chosen] == [True, False, False]
    assert [first.bic_above_best, other.bic_above_best, alone.bic_above_best] == [0.0, 20.0, 50.0]
    assert first.high_deg - 0.1 == pytest.approx(1.96 * 0.1 / np.sqrt(400), rel=1e-9)
    assert first.low_deg == pytest.approx(0.2 - first.high_deg, rel=1e-9)
    assert ranked_models(SimpleNamespace(candidates=[], baseline=trace.baseline)) == ()
    nothing = replace_names(trace, ())
    assert not any(row.chosen for row in ranked_models(nothing))


@pytest.mark.parametrize(("folds", "order"), [(None, ["creep", "drag", ""]), ((), ["drag", "creep", ""])])
def test_candidates_are_ranked_by_folds_where_there_are_any_else_by_the_criterion(folds, order):
    signs = (-1.0) ** np.arange(200)

    def one(rmse: float, *names: str) -> SimpleNamespace:
        return SimpleNamespace(
            names=names, heldout_rmse_deg=rmse, heldout_errors=[rmse * signs], heldout_error_deg=rmse * signs,
            fold_errors=folds,
        )  # fmt: skip

    rows = ((one(0.1, "drag"), 30.0), (one(0.2, "creep"), 50.0))
    candidates = [SimpleNamespace(names=c.names, fitted=c, delta_bic=gain) for c, gain in rows]
    trace = SimpleNamespace(candidates=candidates, baseline=one(0.4), augmented=rows[0][0], names=("drag",))
    ranked = ranked_models(trace)
    assert [row.name for row in ranked] == order
    assert [row.bic_above_best for row in ranked] == ([None] * 3 if folds is not None else [0.0, 20.0, 50.0])


@pytest.mark.parametrize("gain", [0.0, 1000.0, 4000.0])
def test_what_counts_as_alike_grows_with_what_the_best_model_gains(monkeypatch: pytest.MonkeyPatch, gain: float):
    """It is a share of the gain over the baseline, and never below very strong evidence (Kass and Raftery 1995: 10)."""
    problem = SimpleNamespace(records=[SimpleNamespace(only_loads=False)])
    baseline = SimpleNamespace(**vars(fitted(1.0, bic=-1000.0)), noise=NOISE, model=SimpleNamespace(problem=problem))
    best = SimpleNamespace(**vars(fitted(0.2, names=("gravity",), bic=-1000.0 - gain)), noise=NOISE, residuals=[])
    monkeypatch.setattr(verdict, "_verdict", lambda *given: ("unexplained", []))
    monkeypatch.setattr(verdict, "_is_noise", lambda *given: None)
    for policy in verdict.POLICIES.values():
        found = verdict.judge(policy, baseline, SMOOTH, SimpleNamespace(best=best, stages=[[best]]))
        assert found.alike == max(10.0, policy.distinct_share * gain)
        assert [one.delta_bic for one in found.candidates] == [gain]
    assert any(policy.distinct_share * 4000.0 > 10.0 for policy in verdict.POLICIES.values())


def replace_names(trace: SimpleNamespace, names: tuple[str, ...]) -> SimpleNamespace:
    return SimpleNamespace(**{**vars(trace), "names": names, "augmented": trace.baseline})


@pytest.mark.parametrize("heldout", [0.1, 0.3])
def test_an_effect_in_part_is_named_with_all_that_are_as_good(monkeypatch: pytest.MonkeyPatch, heldout: float):
    """Those whose names come before its own in the alphabet, too; the best of them first."""
    rows = {"b": 0.5, "a": 0.51, "c": 0.505, "d": 0.9}
    single = {name: fitted(rms, heldout, names=(name,)) for name, rms in rows.items()}
    for one in single.values():
        one.train_square, one.train_bic = one.mean_square, lambda samples, square=one.mean_square: square
    candidates = [SimpleNamespace(fitted=one, names=one.names) for one in single.values()]
    noise = np.random.default_rng(1).normal(size=400)
    monkeypatch.setattr(verdict, "implausible", lambda one: False)
    monkeypatch.setattr(verdict, "remarks", lambda one: ["remark"])
    monkeypatch.setattr(verdict, "inner_fold_errors", lambda one, threads: [one.rmse_deg * noise])

    @dataclass(frozen=True)
    class WithCandidates(Found):
        candidates: tuple[SimpleNamespace, ...] = ()

    trace = WithCandidates("unexplained", fitted(2.0), fitted(2.0), candidates=tuple(candidates))
    found = verdict.named_in_part(trace)
    assert (found.augmented, found.confusable, found.words) == (single["b"], (("c", "a"),), ("remark",))
    assert found.verdict == ("partial" if heldout > AT_FLOOR * 0.1 else "ambiguous")
    third = fitted(0.502, heldout, names=("e",))
    third.train_square, third.train_bic = third.mean_square, lambda samples: third.mean_square
    more = replace(trace, candidates=(*candidates, SimpleNamespace(fitted=third, names=third.names)))
    words = "b takes 94 % of the error above the noise, and 3 others do as well"  # 4 - 0.25 of 4 - 0.01
    assert (verdict.named_in_part(more).verdict, verdict.named_in_part(more).words[0]) == ("unexplained", words)
    # it must take 0.6 of the mean square above the noise
    for before, is_named in ((0.80, True), (0.77, False)):  # 1 - 0.24/0.63 is 0.62, 1 - 0.24/0.583 is 0.59
        near = replace(trace, baseline=fitted(before))
        assert (verdict.named_in_part(near) is not near) is is_named
    assert verdict.named_in_part(replace(trace, candidates=())).verdict == "unexplained"
    # beside a baseline that leaves less than twice the noise, what was named is taken back where none takes most of it
    floor = NoiseFloor(local_deg=0.4, repeats_deg=None)
    for before, expected in ((0.56, "unexplained"), (0.60, "named")):  # 0.52 and 0.65 of what is above the noise
        named_there = replace(trace, verdict="effect", effects=("a", "b"), floor=floor, baseline=fitted(before))
        back = verdict.named_in_part(named_there)
        assert (back.verdict == "unexplained") is (expected == "unexplained")


@pytest.mark.parametrize(
    ("before", "expected", "words"),
    [(0.99 * AT_FLOOR * 0.1, "none", ("before",)), (0.3, "unexplained", ("the residual depends on time", "before"))],
)
def test_what_the_residual_depends_on_is_said_where_it_is_above_the_noise(monkeypatch, before, expected, words):
    monkeypatch.setattr(cross_validated, "smooth_functions", lambda fit: SMOOTH)
    alone = fitted(before, before)
    alone.heldout_errors = [np.full(50, before)]
    found = SimpleNamespace(baseline=alone, best=alone, candidates=(), alike=())
    trace = cross_validated.judge_by_folds(found, ("before",), floor=NOISE)
    assert (trace.verdict, trace.words) == (expected, words)


def selected(monkeypatch, said: str, *, only_loads: bool = False, repeats: float = 0.5, senseless: str = "", noise=()):
    """Judge a selection whose verdict is given; return the trace, and the model whose noise was asked for.

    The baseline alone is noise for the reasons in ``noise``.
    """
    seen = []
    monkeypatch.setattr(verdict, "_verdict", lambda *given: (said, []))

    def is_noise(policy, baseline, named, floor):
        seen.append(named)
        return (floor, list(noise)) if noise and not named.names else None

    monkeypatch.setattr(verdict, "_is_noise", is_noise)
    beyond = (senseless,) if senseless else ()
    monkeypatch.setattr(verdict, "implausible", lambda fit: beyond if fit.names == ("gravity",) else ())
    monkeypatch.setattr(verdict, "remarks", lambda fit: [f"remark on {fit.names[0]}"])
    monkeypatch.setattr(verdict, "repeatability_deg", lambda records, residuals: repeats)
    baseline, best = fitted(1.0), fitted(0.2, names=("gravity",), bic=-50.0)
    for one in (baseline, best):
        one.noise, one.residuals = NOISE, []
        one.model = SimpleNamespace(problem=SimpleNamespace(records=[SimpleNamespace(only_loads=only_loads)]))
    policy = SimpleNamespace(name="known rig", distinct_share=0.1)
    trace = verdict.judge(policy, baseline, SMOOTH, SimpleNamespace(best=best, stages=()))
    return trace, seen, baseline, best


def test_the_noise_is_asked_of_the_model_that_is_named(monkeypatch):
    trace, seen, _, best = selected(monkeypatch, "effect")
    assert seen == [best]
    assert trace.words == ("remark on gravity",)
    trace, seen, baseline, _ = selected(monkeypatch, "unexplained")
    assert seen == [baseline]
    assert trace.words == ("the residual depends on time",)
    assert selected(monkeypatch, "none")[1] == []


def test_trials_that_only_load_have_the_noise_of_their_repeats(monkeypatch):
    floor = selected(monkeypatch, "effect", only_loads=True)[0].floor
    assert (floor.repeats_deg, floor.by_repeats) == (0.5, True)
    floor = selected(monkeypatch, "effect")[0].floor
    assert (floor.repeats_deg, floor.by_repeats) == (None, NOISE.by_repeats)


@pytest.mark.parametrize("repeats", [None, 0.05])
def test_noise_of_a_sensor_raises_the_floor_that_shows_it(monkeypatch, repeats):
    """Where cycles repeat it is what one differs from the next, else the noise of neighbouring samples."""
    monkeypatch.setattr(verdict, "sensor_noise_deg", lambda records, residuals: 0.9)
    monkeypatch.setattr(verdict, "is_beyond_chance", lambda *given: False)
    monkeypatch.setattr(verdict, "significant_ratio", lambda *given: 1.2)
    baseline = fitted(1.0)
    baseline.residuals, baseline.model = [], SimpleNamespace(problem=SimpleNamespace(records=[]))
    before = NoiseFloor(local_deg=0.1, repeats_deg=repeats)
    floor, words = verdict._is_noise(None, baseline, baseline, before)
    assert floor.by_repeats
    assert (floor.local_deg, floor.repeats_deg) == ((0.9, None) if repeats is None else (0.1, 0.9))
    assert words[0].endswith(f"{'correlated noise of the sensor' if repeats is None else 'the next'}, 0.9 deg")


@pytest.mark.parametrize(("others", "expected"), [((), "unexplained"), (("drag",), "effect")])
def test_a_constant_beyond_sense_is_not_named_but_the_best_that_makes_sense(monkeypatch, others, expected):
    good = [fitted(0.2, names=(name,), bic=-45.0) for name in others]
    monkeypatch.setattr(verdict, "_as_good", lambda *given: good)
    monkeypatch.setattr(verdict, "_confusable", lambda *given: ())
    trace, _, _, _ = selected(monkeypatch, "effect", senseless="a mass of 9 kg")
    assert trace.verdict == expected
    assert trace.words[0] == "gravity would explain the residual, but a mass of 9 kg"
    assert trace.augmented.names == others


def test_a_constant_beyond_sense_does_not_make_noise_unexplained(monkeypatch):
    """Near the noise `none` is found without any effect, and so with one that makes no sense."""
    monkeypatch.setattr(verdict, "_as_good", lambda *given: [])
    too_little = ("too little to be named",)
    trace, seen, baseline, best = selected(monkeypatch, "effect", senseless="a mass of 9 kg", noise=too_little)
    assert (trace.verdict, trace.words) == ("none", too_little)
    assert trace.augmented is baseline
    assert seen == [best, baseline]


def near(before: float, fit: float, held: float, *, heldout: float = 0.0, samples: int = 10_000, **more) -> Found:
    """A known rig whose baseline leaves multiples of the noise, with an effect that leaves others."""
    baseline, effect = fitted(0.1 * before, 0.1 * heldout), fitted(0.1 * fit, 0.1 * held, names=("functional_fatigue",))
    baseline.model = SimpleNamespace(problem=None)
    effect.error_deg, effect.heldout_error_deg = np.zeros(2 * samples), np.zeros(samples)
    return Found("effect", baseline, effect, effects=("functional_fatigue",), known=True, **more)


@pytest.mark.parametrize(
    ("before", "fit", "held", "says"),
    [
        (0.99 * FAR_ABOVE, 1.14, 1.14, "effect"),
        (0.99 * FAR_ABOVE, 1.16, 1.0, "unexplained"),
        (0.99 * FAR_ABOVE, 1.0, 1.16, "unexplained"),
        (1.01 * FAR_ABOVE, 1.3, 1.3, "effect"),
        (1.01 * NEAR_NOISE, 1.24, 1.0, "unexplained"),
        (0.99 * NEAR_NOISE, 1.24, 1.0, "none"),
    ],
)
def test_near_the_noise_an_effect_of_a_known_rig_must_leave_noise_of_both_samples(before, fit, held, says):
    """A clean rig of another make leaves 1.5 times the noise, and a loss of the loop took that to 1.24 times."""
    found = near(before, fit, held)
    judged = verdict.left_near_noise(found)
    assert judged.verdict == says
    if says == "effect":
        assert judged is found
        return
    assert judged.augmented is found.baseline
    which = "fitted" if fit > held else "held-out"
    (first, *others) = judged.words
    assert first.startswith(f"functional_fatigue leaves 1.2 times the noise on the {which} samples: too")
    assert bool(others) is (says == "unexplained")  # on what the residual depends


def test_a_known_rig_near_the_noise_is_far_from_it_on_held_out_samples():
    assert verdict.left_near_noise(near(1.3, 1.24, 1.0, heldout=1.01 * NEAR_NOISE)).verdict == "unexplained"
    assert verdict.left_near_noise(near(1.3, 1.24, 1.0, heldout=0.99 * NEAR_NOISE)).verdict == "none"
    other = near(0.99 * FAR_ABOVE, 1.24, 1.0)
    other.baseline.rmse_deg = 1.0  # all samples do not decide what is near
    assert verdict.left_near_noise(other).verdict == "unexplained"
    unknown = near(1.3, 1.24, 1.0, floor=NoiseFloor(local_deg=0.1, repeats_deg=None, local_known=False))
    assert verdict.left_near_noise(unknown) is unknown


def test_the_noise_of_few_samples_and_rigs_that_are_not_declared_have_rules_of_their_own():
    few = near(1.5, 1.0, 1.29, samples=100)  # 1 + 3 / 10
    assert verdict.left_near_noise(few) is few
    assert verdict.left_near_noise(near(1.5, 1.0, 1.31, samples=100)).verdict == "unexplained"
    for other in (replace(few, known=False), replace(few, effects=())):
        assert verdict.left_near_noise(other) is other


@pytest.mark.parametrize(
    ("before", "joints", "kept"),
    [(0.99 * NEAR_NOISE, True, False), (1.01 * NEAR_NOISE, True, True), (0.99 * NEAR_NOISE, False, True)],
)
def test_measured_joints_near_the_noise_of_the_fitted_samples_are_given_no_effect(monkeypatch, before, joints, kept):
    """Of a clean rig of another make a wheel of 0.4 mm took 2.2 times the noise of the held-out samples to 1.07."""
    monkeypatch.setattr(verdict, "is_of_measured_joints", lambda problem: joints)
    found = near(before, 1.06, 1.07, heldout=2.17)
    judged = verdict.left_near_noise(found)
    assert (judged is found) is kept
    if not kept:
        assert judged.verdict == "unexplained"
        assert (
            judged.words[0]
            == "of the fitted samples the error of 0.14 deg is 1.4 times the noise: too little to be named"
        )
