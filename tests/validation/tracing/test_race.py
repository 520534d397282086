"""The race of effects beside a fitted baseline, on cases that a search by first steps has missed."""

import numpy as np
import pytest

from validation.practice import draw_case
from validation.tracing.baseline.known_rig import known_rig_problem
from validation.tracing.effect import catalogue
from validation.tracing.fitting import Fitted, Model, fit
from validation.tracing.fitting.holdout import divide_records
from validation.tracing.inference.shapes import with_fits
from validation.tracing.search.race import raced

EFFECTS = {effect.name: effect for effect in catalogue()}
SLACK, PLAY = "tendon_slack", "preloaded_play"


@pytest.fixture(scope="module")
def baseline() -> Fitted:
    """Baseline of a case of the retired set *score-26* that was called slack, as ``effect``."""
    problem = known_rig_problem(draw_case("score-26", "known", PLAY, 0).records)
    model = Model(problem)
    return fit(model, divide_records(problem.records), model.coordinates(problem.start, []), threads=1)


@pytest.fixture(scope="module")
def found(baseline) -> list[Fitted]:
    return raced(baseline, [EFFECTS[SLACK], EFFECTS[PLAY]], 1, lambda words, ahead: None)


def test_the_effect_that_made_the_records_wins(found):
    first, second = found
    assert (first.names, second.names) == ((PLAY,), (SLACK,))
    assert first.rmse_deg < first.noise.deg


def test_what_a_fit_changes_is_a_shape_of_its_effect(baseline, found):
    """The residual falls by it from that of the baseline to that of the fit."""
    (shape,) = with_fits([], baseline, found[:1])
    train = baseline.rows.train
    left = baseline.rows.errors[train] + shape.columns[:, 0]
    assert shape.effect == PLAY
    assert np.allclose(left, found[0].rows.errors[train])
