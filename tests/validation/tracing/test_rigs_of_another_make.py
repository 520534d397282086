"""Rigs that are not declared, and of another make: what their baselines leave is no effect."""

from __future__ import annotations

import math
from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest

from fem_models.rig import RigError
from fem_models.rig.checks import SolverError
from validation.tracing import trace as tracing
from validation.tracing import verdict
from validation.tracing.baseline.curve import CurveProblem
from validation.tracing.baseline.equivalent_rig import EquivalentRigProblem
from validation.tracing.baseline.known_rig import KnownRigProblem
from validation.tracing.baseline.play_operators import PlayProblem
from validation.tracing.search import detection, final_fit
from validation.tracing.search.search import Search
from validation.tracing.settings import EQUIVALENT_RIG, KNOWN_RIG, NEAR_NOISE, SIGNIFICANT

from .test_verdict_rules import Found, fitted, near


def left(over: float, *names: str, samples: int = 10_000) -> SimpleNamespace:
    """A fit that leaves a multiple of the noise."""
    error = np.zeros(samples)
    return SimpleNamespace(names=names, rmse_deg=over * 0.1, heldout_rmse_deg=over * 0.1, error_deg=error)


def of_an_equivalent_rig(verdict: str, baseline: SimpleNamespace, augmented: SimpleNamespace, **more) -> Found:
    return Found(verdict, baseline, augmented, model=EQUIVALENT_RIG.name, **more)


def with_friction(before: float, after: float) -> Found:
    return of_an_equivalent_rig("ambiguous", left(before), left(after, "guide_friction"), effects=("guide_friction",))


@pytest.mark.parametrize(
    ("before", "after", "kept"),
    [
        (0.999 * NEAR_NOISE, 1.001 * SIGNIFICANT, False),
        (0.999 * NEAR_NOISE, 0.999 * SIGNIFICANT, True),
        (1.001 * NEAR_NOISE, 1.3, True),
    ],
)
def test_near_the_noise_an_effect_of_an_unknown_rig_must_leave_noise(before, after, kept):
    """Friction of another law leaves 1.4 times the noise, and friction of the guides takes that to 1.16 times."""
    found = with_friction(before, after)
    judged = verdict.above_noise(found)
    assert verdict.is_too_little(found) is not kept
    if kept:
        assert judged is found
        return
    assert (judged.verdict, judged.augmented, judged.confusable) == ("none", found.baseline, ())
    assert judged.words == ("the error of 0.14 deg is 1.4 times the noise: too little to be named",)
    known = replace(found, model=KNOWN_RIG.name)
    assert verdict.above_noise(known) is known


def test_of_few_samples_noise_may_be_more():
    """100 samples tell a level to 1 + 3 / 10."""
    few = replace(with_friction(1.4, 1.29), augmented=left(1.29, "guide_friction", samples=100))
    assert not verdict.is_too_little(few)
    assert verdict.is_too_little(replace(few, augmented=left(1.31, "guide_friction", samples=100)))


def test_near_the_noise_an_unknown_rig_without_an_effect_is_not_unexplained():
    near, far = (
        of_an_equivalent_rig("unexplained", left(f * NEAR_NOISE), left(f * NEAR_NOISE)) for f in (0.999, 1.001)
    )
    assert verdict.above_noise(near).verdict == "none"
    assert verdict.above_noise(far) is far
    none = replace(near, verdict="none")
    assert verdict.above_noise(none) is none


def fits(monkeypatch, square: float | Exception) -> list[list[float]]:
    """Let every final fit have a mean square, or no solution; the list gets the starts."""
    starts: list[list[float]] = []

    def fit(model, holdout, x, **given):
        starts.append(list(x))
        if isinstance(square, Exception):
            raise square
        return SimpleNamespace(train_square=square)

    monkeypatch.setattr(final_fit, "fit", fit)
    return starts


@pytest.mark.parametrize(("square", "better"), [(0.9, True), (1.1, False), (SolverError("-"), False)])
def test_the_final_baseline_is_fitted_from_the_model_with_effects_too(monkeypatch, square, better):
    """What a baseline leaves that missed its optimum is no evidence for an effect."""
    monkeypatch.setattr(final_fit._Refit, "prior_mean", np.zeros(2))
    starts = fits(monkeypatch, square)
    refit = final_fit._Refit(None, None, 1, lambda *_: None)
    baseline = SimpleNamespace(model=SimpleNamespace(baseline_size=2), train_square=1.0)
    augmented = SimpleNamespace(names=("guide_friction",), x=np.array([3.0, 4.0, 5.0]))
    found = refit.baseline_beside(baseline, augmented)
    assert starts == [[3.0, 4.0]]
    assert (found is not baseline) is better
    assert refit.baseline_beside(baseline, SimpleNamespace(names=(), x=augmented.x)) is baseline
    assert len(starts) == 1


def test_the_search_for_an_equivalent_rig_ends_with_its_better_baseline(monkeypatch):
    found, other = with_friction(2.0, 1.0), of_an_equivalent_rig("none", left(1.0), left(1.0))
    problem = SimpleNamespace(scale=SimpleNamespace(angle_deg=10.0))
    monkeypatch.setattr(tracing, "equivalent_rig_problem", lambda records: problem)
    monkeypatch.setattr(tracing, "_beside", lambda search, competitors: search)
    monkeypatch.setattr(
        tracing, "Search", lambda *given: SimpleNamespace(problem=problem, is_far_behind=lambda one: False)
    )
    monkeypatch.setattr(tracing, "replace", lambda search, **given: search)
    baseline = SimpleNamespace(square=4.0, rmse_deg=0.2, noise=SimpleNamespace(deg=1.0))
    monkeypatch.setattr(tracing, "_baseline_of_all_samples", lambda *given: baseline)
    monkeypatch.setattr(tracing, "find_effects", lambda *given: found)
    monkeypatch.setattr(tracing, "_with_better_baseline", lambda search, trace: {id(found): other}[id(trace)])
    records = [SimpleNamespace(drive_unit="mm")]
    assert tracing._trace_equivalent_rig(records, (), 1, print, (1.0, 1.0, 1.0))[1] is other


@pytest.mark.parametrize(("early", "beside"), [(2.21, True), (2.19, False)])
def test_effects_are_started_beside_an_early_baseline_only_if_it_absorbed_something_after(monkeypatch, early, beside):
    """Of the tendon robot the baseline left as much after four steps as in the end: half a minute for nothing."""
    problem = SimpleNamespace(scale=SimpleNamespace(angle_deg=100.0))
    monkeypatch.setattr(tracing, "equivalent_rig_problem", lambda records: problem)
    noise = SimpleNamespace(deg=1.0)
    squares = iter([SimpleNamespace(square=early), SimpleNamespace(square=2.0, rmse_deg=1.4, noise=noise)])
    monkeypatch.setattr(tracing, "_baseline_of_all_samples", lambda *given: next(squares))
    monkeypatch.setattr(tracing, "find_effects", lambda search, baseline: search)
    monkeypatch.setattr(tracing, "_with_better_baseline", lambda search, trace: trace)
    search, _ = tracing._trace_equivalent_rig([SimpleNamespace(drive_unit="mm")], (), 1, print, (math.inf,) * 3)
    assert (search.early is not None) is beside


@pytest.mark.parametrize(("noise", "gives_up"), [(0.2, False), (0.15, True)])
def test_a_search_is_given_up_by_the_noise_of_all_samples(noise, gives_up):
    """Neighbours of thinned samples are further apart: their noise was 0.23 deg, that of all samples 0.17."""
    search = Search(None, EQUIVALENT_RIG, (), 1, print, competitor_deg=0.6, explained_deg=0.6, noise_deg=noise)
    assert search.gives_up(SimpleNamespace(rmse_deg=0.56, noise=SimpleNamespace(deg=0.23))) is gives_up
    assert not search.is_far_behind(SimpleNamespace(rmse_deg=1.0, noise=SimpleNamespace(deg=0.23)))


@pytest.mark.parametrize(("hidden", "noise"), [(None, 0.02), (0.09, 0.09), (0.08, 0.02), (0.01, 0.02)])
def test_noise_that_neighbours_hide_counts_where_it_is_all_that_is_left(monkeypatch, hidden, noise):
    """A filtered sensor hides its noise from neighbours; of the tendon robot structure looks like such noise, too."""
    monkeypatch.setattr(tracing, "sensor_noise_deg", lambda records, residuals: hidden)
    model = SimpleNamespace(problem=SimpleNamespace(records=()))
    plays = SimpleNamespace(model=model, residuals=(), rmse_deg=0.1, noise=SimpleNamespace(deg=0.02))
    assert tracing._noise_of_competitor(plays) == noise


def better_baseline(monkeypatch, found, square: float, *, noise: bool = False, pays: bool = True):
    """The trace beside a baseline that is fitted again and has a square."""
    again = SimpleNamespace(square=square)
    monkeypatch.setattr(tracing, "Model", lambda problem: SimpleNamespace(baseline_size=2))
    monkeypatch.setattr(tracing, "fit", lambda *given, **more: again)
    monkeypatch.setattr(tracing, "smooth_functions", lambda baseline: "smooth")
    monkeypatch.setattr(tracing, "is_worth_adding", lambda *given: pays)
    monkeypatch.setattr(tracing, "beats_smooth_functions", lambda *given: True)
    monkeypatch.setattr(tracing, "nothing_to_explain", lambda *given: noise)
    monkeypatch.setattr(tracing, "find_effects", lambda search, baseline: ("searched again", baseline))
    monkeypatch.setattr(tracing, "judge", lambda *given: ("judged again", given))
    search = SimpleNamespace(problem=None, threads=1, effects=(), policy=EQUIVALENT_RIG)
    return again, tracing._with_better_baseline(search, found)


def test_effects_are_judged_again_beside_a_better_baseline(monkeypatch):
    """Verdict, words and what is not distinguished belong to the baseline beside which they were found."""
    baseline = SimpleNamespace(square=1.0, holdout=None)
    augmented = SimpleNamespace(x=np.zeros(3), names=("guide_friction",))
    tried = (SimpleNamespace(fitted="one"), SimpleNamespace(fitted="other"))
    found = of_an_equivalent_rig("effect", baseline, augmented, effects=("guide_friction",), candidates=tried)
    again, (what, given) = better_baseline(monkeypatch, found, 0.9)
    assert what == "judged again"
    policy, other, smooth, selection = given
    assert (policy, other, smooth) == (EQUIVALENT_RIG, again, "smooth")
    assert (selection.best, selection.stages) == (augmented, [["one", "other"]])
    assert better_baseline(monkeypatch, found, 1.0)[1] is found
    for case in ({"noise": True}, {"pays": False}):
        again, answer = better_baseline(monkeypatch, found, 0.9, **case)
        assert answer == ("searched again", again)
    without = replace(found, effects=())
    assert better_baseline(monkeypatch, without, 0.9)[1] is without


def test_a_rig_without_an_equilibrium_is_no_baseline(monkeypatch):
    def none(records):
        raise RigError("no rig")

    monkeypatch.setattr(tracing, "equivalent_rig_problem", none)
    assert tracing._trace_equivalent_rig([SimpleNamespace(drive_unit="mm")], (), 1, print, (1.0, 1.0)) == (None, None)


@pytest.mark.parametrize(("over", "limited"), [(1.0, False), (1.14, False), (1.16, True), (1.41, True), (1.42, False)])
def test_a_detection_limit_of_an_unknown_rig_is_beyond_too_little(over, limited):
    """Residual and action together make sqrt(2) times the noise, with a margin for nine of ten."""
    problem = object.__new__(EquivalentRigProblem)
    fitted = SimpleNamespace(model=SimpleNamespace(problem=problem), error_deg=np.zeros(10_000), samples=400.0)
    needed = detection._beyond_noise_deg(fitted, over * 0.1, 0.1)
    margin = detection.NINE_OF_TEN * over * 0.1 / 20
    assert needed == pytest.approx((0.02 - (over * 0.1) ** 2) ** 0.5 + margin if limited else 0.0)


@pytest.mark.parametrize(
    ("kind", "bar"), [("rig", 1.15), ("few", 1.3), ("joints", 2**0.5), ("curve", 1.3), ("plays", 1.15)]
)
@pytest.mark.parametrize("over", [1.0, 1.1, 1.29, 1.6])
def test_a_detection_limit_is_beyond_what_counts_as_noise(monkeypatch, kind, bar, over):
    """Residual and action together make the bar of the verdict: 1 + 3/10 of 100 samples, sqrt(2) of measured joints.

    A known rig that leaves more than noise is given no effect that does so, too, up to twice the noise.
    """
    made_of = {"curve": CurveProblem, "plays": PlayProblem}.get(kind, KnownRigProblem)
    monkeypatch.setattr(detection, "is_of_measured_joints", lambda problem: kind == "joints")
    error = np.zeros(100 if kind == "few" else 10_000)
    fitted = SimpleNamespace(model=SimpleNamespace(problem=object.__new__(made_of)), error_deg=error, samples=400.0)
    if kind in ("rig", "joints", "few") and over > (1.3 if kind == "few" else 1.15):
        bar = 2.0
    expected = (bar**2 - over**2) ** 0.5 + detection.NINE_OF_TEN * over / 20 if over < bar else 0.0
    assert detection._beyond_noise_deg(fitted, over * 0.1, 0.1) == pytest.approx(0.1 * expected)


@pytest.mark.parametrize(
    ("made_of", "factor"),
    [(KnownRigProblem, 1.5), (PlayProblem, 0.5), (EquivalentRigProblem, 3.0), (CurveProblem, 3.0)],
)
def test_a_detection_limit_is_a_large_part_of_an_error_above_the_noise(made_of, factor):
    """a^2 of s^2 + a^2 - 1 is 0.6, a third or three quarters: a^2 is 1.5, 0.5 or 3 times s^2 - 1."""
    problem = object.__new__(made_of)
    if made_of is PlayProblem:
        object.__setattr__(problem, "changed", (True,))
    fitted = SimpleNamespace(model=SimpleNamespace(problem=problem), samples=400.0)
    assert detection._large_part_deg(fitted, 0.15, 0.1) == 0.0
    margin = detection.NINE_OF_TEN * 0.3 / 20
    assert detection._large_part_deg(fitted, 0.3, 0.1) == pytest.approx((factor * 0.08) ** 0.5 + margin)
    if made_of is PlayProblem:  # a change since a reference: half of all that is left
        object.__setattr__(problem, "changed", (True, False))
        assert detection._large_part_deg(fitted, 0.3, 0.25) == pytest.approx((0.5 * 0.09) ** 0.5 + margin)


def test_play_operators_answer_where_a_rig_has_no_equilibrium_without_the_held_out_samples(monkeypatch):
    """One fit without a solution had ended the whole trace."""
    error = SimpleNamespace(rmse_deg=0.1, heldout_rmse_deg=0.1)
    rig = SimpleNamespace(model="equivalent rig", effects=(), augmented=error, verdict="none")
    plays = SimpleNamespace(heldout_deg=0.1, fitted=[SimpleNamespace(noise=SimpleNamespace(deg=0.1))])
    monkeypatch.setattr(tracing, "_noise_of_competitor", lambda fitted: 0.1)

    def no_solution(*given):
        raise SolverError("no equilibrium")

    monkeypatch.setattr(tracing, "_trace_equivalent_rig", lambda *given: (None, rig))
    monkeypatch.setattr(tracing, "is_explained", lambda one: True)
    monkeypatch.setattr(tracing, "best_of", lambda traces: traces[0])
    monkeypatch.setattr(tracing, "refit_without_heldout", no_solution)
    monkeypatch.setattr(tracing, "trace_by_folds", lambda *given: "by folds")
    monkeypatch.setattr(tracing, "play_baselines", lambda records: plays)
    assert tracing._trace_unknown_geometry([], [], 1, lambda *_: None) == "by folds"
    monkeypatch.setattr(tracing, "play_baselines", lambda records: None)
    with pytest.raises(SolverError):
        tracing._trace_unknown_geometry([], [], 1, lambda *_: None)


def test_flexures_may_vary_where_an_effect_beside_declared_ones_leaves_more_than_noise(monkeypatch):
    """Such an effect is taken back; it had been returned before flexures that vary were tried."""
    search = Search(object.__new__(KnownRigProblem), KNOWN_RIG, (), 1, lambda *_: None)
    none = Found("none", fitted(0.1), fitted(0.1), known=True)
    monkeypatch.setattr(tracing, "with_varied_flexures", lambda problem: problem)
    for held, expected in ((1.2, none), (1.1, None)):
        declared = near(1.8, 1.05, held)
        traces = iter([declared, none])
        monkeypatch.setattr(tracing, "_trace_as_declared", lambda search, traces=traces: next(traces))
        assert tracing._trace_known_rig(search) is (expected or declared)
