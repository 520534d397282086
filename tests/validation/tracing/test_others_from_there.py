"""Effects that are tried from the baseline beside the one that was found, where the rig is known."""

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest

from validation.tracing.effect import catalogue
from validation.tracing.fitting import Fitted, Model, fit
from validation.tracing.fitting.smooth import smooth_functions
from validation.tracing.problem import AddedEffect
from validation.tracing.search import stepwise
from validation.tracing.search.exchange import from_every_start
from validation.tracing.search.search import Search
from validation.tracing.search.stepwise import READ_ALIKE, _from_there
from validation.tracing.settings import CURVE, EQUIVALENT_RIG, KNOWN_RIG

EFFECTS = {effect.name: effect for effect in catalogue()}
SLACK, PLAY = "tendon_slack", "preloaded_play"


@pytest.fixture(scope="module")
def baseline(play_called_slack) -> Fitted:
    return play_called_slack


@pytest.fixture(scope="module")
def search(baseline) -> Search:
    return Search(baseline.model.problem, KNOWN_RIG, [EFFECTS[SLACK], EFFECTS[PLAY]], 1, lambda *_: None)


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
    assert smooth_functions(slack).names  # the structure that the wrong effect leaves
    (play,) = _from_there(search, slack, [])
    assert play.names == (PLAY,)
    assert play.rmse_deg < play.noise.deg
    assert not smooth_functions(play).names
    assert not _from_there(search, play, [[slack]])  # the right effect leaves none, and slack reads otherwise


def test_effects_are_tried_near_the_noise_and_beside_one_effect(search, baseline, slack):
    size, inputs = 5 * slack.noise.deg, search.problem.inputs
    bent = tuple(e + size * np.cos(one.drive) for e, one in zip(slack.errors, inputs, strict=True))
    far = replace(slack, errors=bent)
    assert not _from_there(search, far, [])
    assert not _from_there(search, baseline, [])
    assert not _from_there(replace(search, policy=CURVE), slack, [])
    assert _from_there(replace(search, policy=EQUIVALENT_RIG), far, [])


def test_an_effect_that_reads_nearly_the_same_is_tried_from_every_start_unless_it_is_as_good(
    monkeypatch, search, slack
):
    tried = []

    def record(_, fitted, effect):
        tried.append((fitted.names, effect.name))
        return []

    monkeypatch.setattr(stepwise, "from_every_start", record)
    monkeypatch.setattr(stepwise, "smooth_functions", lambda fitted: SimpleNamespace(names=()))
    every = replace(search, effects=catalogue())
    _from_there(every, slack, [])
    assert tried == [((SLACK,), "tendon_stiffening")]
    as_good = SimpleNamespace(names=("tendon_stiffening",), bic=lambda samples: slack.bic(samples) + 49.0)
    behind = SimpleNamespace(names=("tendon_stiffening",), bic=lambda samples: slack.bic(samples) + 51.0)
    _from_there(every, slack, [[as_good]])
    assert len(tried) == 1
    _from_there(every, slack, [[behind]])
    assert len(tried) == 2
    assert {name for names in READ_ALIKE for name in names} <= set(EFFECTS)


def test_the_best_two_of_all_starts_are_fitted_to_the_end(search, slack):
    found = from_every_start(search, slack, EFFECTS[PLAY])
    assert len(found) == 2
    assert min(one.rmse_deg for one in found) < slack.noise.deg
