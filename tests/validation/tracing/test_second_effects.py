"""Second effects of a rig that is not declared: beside which first ones they are tried, and from where."""

from __future__ import annotations

from dataclasses import replace
from types import SimpleNamespace

import pytest

from validation.practice import draw_case
from validation.tracing.baseline.equivalent_rig import equivalent_rig_problem
from validation.tracing.effect import catalogue
from validation.tracing.fitting import Model, fit
from validation.tracing.fitting.holdout import divide_records
from validation.tracing.problem import AddedEffect
from validation.tracing.search import stepwise
from validation.tracing.search.search import Search
from validation.tracing.settings import CURVE, EQUIVALENT_RIG, KNOWN_RIG

SLACK, PLAY = "tendon_slack", "backlash"


def model(*names: str, over: float = 1.0) -> SimpleNamespace:
    """A fit that leaves a multiple of the noise."""
    return SimpleNamespace(
        names=names, rmse_deg=over, square=over**2, samples=100.0, noise=SimpleNamespace(deg=1.0),
        error_deg=SimpleNamespace(size=10**6), bic=lambda samples: over,
    )  # fmt: skip


def test_where_the_best_read_alike_one_that_does_not_gets_a_second_effect_too():
    weight, load, slack, creep = model("gravity"), model("tip_load"), model(SLACK), model("tendon_creep")
    assert stepwise._extended([weight, load, slack, creep], EQUIVALENT_RIG) == [weight, load, slack]
    assert stepwise._extended([weight, slack, load, creep], EQUIVALENT_RIG) == [weight, slack]
    assert stepwise._extended([weight, load], EQUIVALENT_RIG) == [weight, load]
    assert stepwise._extended([weight], EQUIVALENT_RIG) == [weight]
    for policy in (KNOWN_RIG, CURVE):
        assert stepwise._extended([weight, load, slack], policy) == [weight, load]
    both = [model(SLACK, PLAY), model("guide_friction", SLACK), model("tip_load", SLACK)]
    assert stepwise._extended(both, EQUIVALENT_RIG) == both
    assert not stepwise._read_alike(model("gravity", PLAY), both[2])  # they differ by two effects each
    assert not stepwise._read_alike(weight, both[2])


@pytest.mark.slow
def test_a_play_is_found_beside_slack_that_had_absorbed_it():
    """Pair 1 of the retired set *score-31*: beside the parameters of the slack alone the play came to 1.3 times."""
    problem = equivalent_rig_problem(draw_case("score-31", "unknown", "pair", 1).records)
    effects = {e.name: e for e in catalogue() if e.name in (SLACK, PLAY)}
    assert set(effects) == {SLACK, PLAY}
    search = Search(problem, EQUIVALENT_RIG, list(effects.values()), 1, lambda *_: None)
    holdout, alone = divide_records(problem.records).everything(), Model(problem)
    baseline = fit(alone, holdout, alone.coordinates(problem.start, []), threads=1)
    form = max(problem.forms(effects[SLACK]), key=lambda one: len(one.parameters))
    with_slack, (start, *_) = Model(problem, (AddedEffect(effects[SLACK], form),)), problem.starts(form)
    slack = fit(with_slack, holdout, with_slack.coordinates(alone.values(baseline.x)[0], [start]), threads=1)
    assert slack.rmse_deg > 1.3 * slack.noise.deg
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(stepwise, "best_from_start", lambda search, fitted: fitted)
        without, *_ = stepwise._with_one_more(search, [slack], [slack])
    assert without.rmse_deg > 1.1 * without.noise.deg
    best, *_ = stepwise._with_one_more(search, [slack], [slack])
    assert set(best.names) == {SLACK, PLAY}
    assert best.rmse_deg < 1.05 * best.noise.deg


@pytest.fixture
def tried(monkeypatch) -> list[list[tuple[str, ...]]]:
    """Models beside which a second effect was tried; a play is found beside the last one, and beyond chance."""
    fronts: list[list[tuple[str, ...]]] = []

    def with_one_more(search, front, smaller):
        fronts.append([one.names for one in front])
        return [model(*front[-1].names, PLAY)]

    monkeypatch.setattr(stepwise, "_with_one_more", with_one_more)
    monkeypatch.setattr(
        stepwise, "smooth_functions", lambda fitted: SimpleNamespace(names=() if PLAY in fitted.names else ("time",))
    )
    monkeypatch.setattr(stepwise, "is_beyond_chance", lambda before, after, policy: True)
    monkeypatch.setattr(stepwise, "ranked_models", lambda models: models)
    monkeypatch.setattr(stepwise, "exchanged", lambda search, best, most: [])
    monkeypatch.setattr(stepwise, "pruned", lambda search, best: best)
    monkeypatch.setattr(stepwise, "implausible", lambda fitted: [])
    monkeypatch.setattr(stepwise, "_restarted", lambda search, best, stages: (best, stages))
    return fronts


SEARCH = Search(None, EQUIVALENT_RIG, (), 1, lambda *_: None)
DELAY, DRAG = model("time_delay", over=1.02), model("viscous_drag", over=1.12)
CREEP, WEIGHT = model("tendon_creep", over=5.0), model("gravity", over=1.2)


def test_a_first_effect_that_leaves_structure_near_the_noise_gets_a_second_one(tried):
    """A delay left 1.02 times the noise of drag with a play, the drag 1.12: a play was beside the drag."""
    both = model("time_delay", "tendon_creep")
    best, stages = stepwise._with_second_near_noise(SEARCH, DELAY, [[DELAY, DRAG, CREEP], [both]])
    assert tried == [[("time_delay",), ("viscous_drag",)]]
    assert best.names == ("viscous_drag", PLAY)
    assert stages == [[DELAY, DRAG, CREEP], [best, both]]


@pytest.mark.parametrize("first", [[], [CREEP], [CREEP, WEIGHT, DRAG, DELAY]])
def test_the_best_model_is_among_those_that_get_a_second_effect(tried, first):
    """One that was found by leaving an effect out is in no stage, and one that was fitted again may stand last."""
    best, _ = stepwise._with_second_near_noise(SEARCH, DELAY, [first] if first else [])
    assert tried[0][0] == DELAY.names
    assert tried[0][1:] == ([DRAG.names] if DRAG in first else [])
    assert best.names[-1] == PLAY


@pytest.mark.parametrize("change", ["structure", "chance", "senseless", "left", "far", "two", "one alone", "known"])
def test_without_structure_or_within_chance_the_first_effect_stays(monkeypatch, tried, change):
    best, search = DELAY, SEARCH
    if change in ("structure", "left"):  # none is left by the first effect; some by both
        names = () if change == "structure" else ("time",)
        monkeypatch.setattr(stepwise, "smooth_functions", lambda fitted: SimpleNamespace(names=names))
    if change == "chance":
        monkeypatch.setattr(stepwise, "is_beyond_chance", lambda before, after, policy: False)
    if change == "senseless":
        monkeypatch.setattr(stepwise, "implausible", lambda fitted: ["only with a width of 1 km"])
    if change == "far":
        best = model("time_delay", over=1.16)  # the search itself has tried second ones
    if change == "two":
        best = model("time_delay", PLAY)
    if change == "one alone":
        search = replace(SEARCH, most_effects=1)
    if change == "known":
        search = replace(SEARCH, policy=KNOWN_RIG)
    assert stepwise._with_second_near_noise(search, best, [[best]]) == (best, [[best]])
    assert bool(tried) is (change in ("chance", "senseless", "left"))
