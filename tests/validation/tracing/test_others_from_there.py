"""Effects that are tried from the baseline beside the one that was found, where the rig is known."""

from dataclasses import replace

import numpy as np
import pytest

from validation.practice import draw_case
from validation.tracing.baseline.known_rig import known_rig_problem
from validation.tracing.effect import catalogue
from validation.tracing.fitting import Fitted, Model, fit
from validation.tracing.fitting.holdout import divide_records
from validation.tracing.problem import AddedEffect
from validation.tracing.search.search import Search
from validation.tracing.search.stepwise import _looks_from_there, _with_others_from_there
from validation.tracing.settings import CURVE, EQUIVALENT_RIG, KNOWN_RIG

EFFECTS = {effect.name: effect for effect in catalogue()}
SLACK, PLAY = "tendon_slack", "preloaded_play"


@pytest.fixture(scope="module")
def search() -> Search:
    """A case of the retired set *score-26* that was called slack, as ``effect``."""
    problem = known_rig_problem(draw_case("score-26", "known", PLAY, 0).records)
    return Search(problem, KNOWN_RIG, [EFFECTS[SLACK], EFFECTS[PLAY]], 1, lambda words: None)


@pytest.fixture(scope="module")
def baseline(search) -> Fitted:
    model = Model(search.problem)
    start = model.coordinates(search.problem.start, [])
    return fit(model, divide_records(search.problem.records), start, threads=1)


@pytest.fixture(scope="module")
def slack(search, baseline) -> Fitted:
    declared, found = search.problem.start, []
    for form in search.problem.forms(EFFECTS[SLACK]):
        model = Model(search.problem, (AddedEffect(EFFECTS[SLACK], form),))
        found += [
            fit(model, baseline.holdout, model.coordinates(declared, [values]), threads=1)
            for values in search.problem.starts(form)
        ]
    return min(found, key=lambda one: one.square)


def test_a_play_is_found_from_the_baseline_beside_slack(search, slack):
    """From the fitted baseline it was behind after its first steps, and was never fitted to the end."""
    assert slack.rmse_deg < 1.03 * slack.noise.deg
    assert _looks_from_there(search, slack)
    best, stages = _with_others_from_there(search, slack, [])
    assert best.names == (PLAY,)
    assert best.rmse_deg < 1.0 * best.noise.deg
    assert [one.names for one in stages[0]] == [(PLAY,), (SLACK,)]
    assert not _looks_from_there(search, best)  # the right effect leaves no structure


def test_they_are_tried_near_the_noise_and_beside_one_effect(search, baseline, slack):
    size, inputs = 5 * slack.noise.deg, search.problem.inputs
    bent = tuple(e + size * np.cos(one.drive) for e, one in zip(slack.errors, inputs, strict=True))
    assert not _looks_from_there(search, replace(slack, errors=bent))
    assert not _looks_from_there(search, baseline)
    assert not _looks_from_there(replace(search, policy=CURVE), slack)
    assert _looks_from_there(replace(search, policy=EQUIVALENT_RIG), replace(slack, errors=bent))
