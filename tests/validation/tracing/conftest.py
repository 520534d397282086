"""Shared fixtures of the tracer."""

import pytest

from validation.practice import draw_case
from validation.tracing import trace_records
from validation.tracing.baseline.known_rig import known_rig_problem
from validation.tracing.fitting import Fitted, Model, fit
from validation.tracing.fitting.holdout import divide_records


@pytest.fixture(autouse=True, scope="session")
def _one_thread():
    """Each worker of the tests has one core: a second thread would wait for it."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setitem(trace_records.__kwdefaults__, "threads", 1)
        yield


@pytest.fixture(scope="session")
def play_called_slack() -> Fitted:
    """Fitted baseline of a case of the retired set *score-26*: it has a play, and was called slack, as ``effect``."""
    problem = known_rig_problem(draw_case("score-26", "known", "preloaded_play", 0).records)
    model = Model(problem)
    return fit(model, divide_records(problem.records), model.coordinates(problem.start, []), threads=1)
