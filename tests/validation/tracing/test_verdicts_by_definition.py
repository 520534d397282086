"""Evidence and verdict just at their thresholds, on traces with errors that are set by hand; the noise is 1 deg."""

from __future__ import annotations

from dataclasses import dataclass, replace
from types import SimpleNamespace

import numpy as np
import pytest

from validation.tracing import cross_validated, verdict
from validation.tracing.fitting import evidence
from validation.tracing.fitting.noise import NoiseFloor

UNIT = NoiseFloor(local_deg=1.0, repeats_deg=None)


class Hashed(SimpleNamespace):
    """A stand-in that may be a key, as fits are."""

    __hash__ = object.__hash__


TIME = Hashed(names=("time",), competitor=None, bic=lambda samples: 0.0)


def replace_in(one: SimpleNamespace, **changes) -> SimpleNamespace:
    return SimpleNamespace(**{**vars(one), **changes})


# --- evidence ----------------------------------------------------------------------------------------------------


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
        (3.0, True, ("play",), False),
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
    before = SimpleNamespace(bic=lambda samples: 10.0, square=1.0, mean_square=1.0)
    after = SimpleNamespace(bic=lambda samples: 0.0, square=0.5, mean_square=0.5, samples=1.0, angle_samples=1.0)
    before.angle_bic = after.angle_bic = lambda samples: 0.0
    assert not evidence.is_worth_adding(before, after, 1)
    more = SimpleNamespace(bic=lambda samples: 11.0, square=0.5 / evidence.WORTH_NAMING**2, mean_square=0.5)
    more.angle_bic = before.angle_bic
    assert evidence.is_worth_adding(replace_in(more, square=1.0), after, 1)
    assert not evidence.is_worth_adding(replace_in(more, square=0.25), replace_in(after, square=0.25), 1)
    angle_alone = replace_in(more, square=0.25, mean_square=1.0)  # noise of the channels stays
    assert evidence.is_worth_adding(angle_alone, replace_in(after, square=0.25), 1)
    effect = SimpleNamespace(angle_samples=50.0, angle_bic=lambda samples: 0.0)
    for value, beats in ((-10.0, False), (-9.0, True)):
        curve = SimpleNamespace(names=("time",), competitor=None, bic=lambda samples, value=value: value)
        assert evidence.beats_smooth_functions(effect, curve) is beats
    for value, alike in ((10.0, False), (9.0, True)):
        curve = SimpleNamespace(names=("time",), competitor=None, bic=lambda samples, value=value: value)
        assert evidence.curve_does_as_well(effect, curve) is alike


def test_criteria_are_compared_by_their_difference_alone():
    """Far from zero as near it: 25 after 30 is too little, 110 after 150 is enough, and so is -90 after -50."""
    for before, after, worth in (
        (30.0, 25.0, False),
        (150.0, 110.0, True),
        (-50.0, -90.0, True),
        (-50.0, -55.0, False),
    ):
        one = SimpleNamespace(square=1.0, mean_square=1.0)
        one.bic = one.angle_bic = lambda samples, value=before: value
        other = SimpleNamespace(square=0.25, mean_square=0.25, samples=1.0, angle_samples=1.0)
        other.bic = other.angle_bic = lambda samples, value=after: value
        assert evidence.is_worth_adding(one, other, 1) is worth
    for effect, value, beats, alike in (
        (100.0, 95.0, True, True),
        (100.0, 85.0, False, True),
        (-100.0, -85.0, True, False),
    ):
        model = SimpleNamespace(angle_samples=50.0, angle_bic=lambda samples, own=effect: own)
        curve = SimpleNamespace(names=("time",), competitor=None, bic=lambda samples, own=value: own)
        assert evidence.beats_smooth_functions(model, curve) is beats
        assert evidence.curve_does_as_well(model, curve) is alike


def test_models_are_ranked_for_the_samples_of_the_one_with_the_least_square():
    """With 4 samples b leads by its few parameters, with 400 a by its square."""

    def one(name, square, samples, parameters):
        return SimpleNamespace(names=(name,), square=square, samples=samples, bic=lambda n: n * square + parameters)

    for samples, order in ((4.0, ["b", "a"]), (400.0, ["a", "b"])):
        rows = [one("a", 1.0, samples, 9.0), one("b", 1.5, 404.0 - samples, 0.0)]
        assert [g.names[0] for g in evidence.ranked_models(rows)] == order


# --- the verdict at its thresholds -------------------------------------------------------------------------------


def fitted(rmse, *names, bic=0.0, heldout=None, train=None, **more) -> SimpleNamespace:
    held = rmse if heldout is None else heldout
    own = rmse if train is None else train
    return SimpleNamespace(**{
        "names": names, "rmse_deg": rmse, "mean_square": rmse**2, "heldout_rmse_deg": held, "train_rmse_deg": own,
        "train_square": own**2, "heldout_errors": [held * (-1.0) ** np.arange(100)], "samples": 100.0,
        "bic": lambda samples: bic, "train_bic": lambda samples: own**2, "fold_errors": None, "noise": UNIT,
        "residuals": [], "train_samples": 100.0, "model": SimpleNamespace(problem=SimpleNamespace(records=[])), **more,
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
    for module in (verdict, cross_validated):
        monkeypatch.setattr(module, "remarks", lambda one: [f"of {' + '.join(one.names)}"])


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
    monkeypatch.setattr(verdict, "is_of_measured_joints", lambda problem: True)
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
    found = cross_validated.with_still_zone(trace, zone)
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
    monkeypatch.setattr(cross_validated, "smooth_functions", lambda one: TIME)
    monkeypatch.setattr(cross_validated, "share", lambda *given: SimpleNamespace(value=taken))
    best, other = fitted(after, "drag", bic=-20.0), fitted(after, "creep", bic=-5.0)
    found = SimpleNamespace(baseline=fitted(before), best=best, candidates=(best, other), alike=((),))
    trace = cross_validated.judge_by_folds(found, ("word",), floor=UNIT)
    assert trace.verdict == say
    named = say in ("effect", "partial")
    assert (trace.augmented is best) is named
    assert trace.alike == 10.0  # nothing is alike
    part = [f"drag takes {100 * taken:.0f} % of the error above the noise"]
    first = {"none": part if before > 1.15 else [], "effect": [], "partial": ["the remaining residual depends on time"]}
    expected = [*first.get(say, ["the residual depends on time", *part]), "word", *(["of drag"] if named else [])]
    assert trace.words == tuple(expected)


def test_how_far_effects_are_alike_counts_from_nothing_where_the_best_one_was_no_candidate(monkeypatch, sensible):
    """The criterion of creep is 30 above that of the baseline: 31 with one more."""
    monkeypatch.setattr(cross_validated, "smooth_functions", lambda one: TIME)
    best, other, third = fitted(0.5, "drag", bic=-20.0), fitted(0.5, "creep", bic=30.0), fitted(0.5, "wheel", bic=90.0)
    found = SimpleNamespace(baseline=fitted(9.0), best=best, candidates=(other, third), alike=(("creep",),))
    trace = cross_validated.judge_by_folds(found, (), floor=UNIT)
    assert (trace.verdict, trace.alike) == ("ambiguous", 31.0)
    alone = SimpleNamespace(baseline=fitted(9.0), best=best, candidates=(best,), alike=((),))
    assert cross_validated.judge_by_folds(alone, (), floor=UNIT).alike == 10.0
