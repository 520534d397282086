"""The race of effects beside a fitted baseline, on cases that a search by first steps has missed."""

import numpy as np
import pytest

from validation.tracing.effect import catalogue
from validation.tracing.fitting import Fitted
from validation.tracing.inference.shapes import with_fits
from validation.tracing.search.race import raced

EFFECTS = {effect.name: effect for effect in catalogue()}
SLACK, PLAY = "tendon_slack", "preloaded_play"


@pytest.fixture(scope="module")
def found(play_called_slack) -> list[Fitted]:
    return raced(play_called_slack, [EFFECTS[SLACK], EFFECTS[PLAY]], 1, lambda words, ahead: None)


def test_the_effect_that_made_the_records_wins(found):
    first, second = found
    assert (first.names, second.names) == ((PLAY,), (SLACK,))
    assert first.rmse_deg < first.noise.deg


def test_what_a_fit_changes_is_a_shape_of_its_effect(play_called_slack, found):
    """The residual falls by it from that of the baseline to that of the fit."""
    (shape,) = with_fits([], play_called_slack, found[:1])
    train = play_called_slack.rows.train
    left = play_called_slack.rows.errors[train] + shape.columns[:, 0]
    assert shape.effect == PLAY
    assert np.allclose(left, found[0].rows.errors[train])
