"""Which models the next record is to decide between, and that the best one is refined."""

from __future__ import annotations

from types import SimpleNamespace

import numpy as np
import pytest

from hysteresis.records.record import Record
from validation.tracing.cross_validated import play_baselines
from validation.tracing.outcome import competitors_of
from validation.tracing.search import stepwise
from validation.tracing.settings import EQUIVALENT_RIG, KNOWN_RIG


def candidate(gain: float, *names: str) -> SimpleNamespace:
    return SimpleNamespace(names=names, fitted=f"{gain:g} {' + '.join(names)}", delta_bic=gain)


def trace_of(names, confusable, *candidates) -> SimpleNamespace:
    """The model that is named is a copy of its candidate, as folds and refits make it."""
    return SimpleNamespace(augmented=SimpleNamespace(names=names), candidates=candidates, confusable=confusable)


def compared(trace) -> list[str]:
    first, *others = competitors_of(trace)
    assert first is trace.augmented
    return others


def test_an_effect_that_folds_do_not_distinguish_is_a_competitor_however_little_it_gains():
    delay, drift, drag = candidate(90, "delay"), candidate(80, "drift"), candidate(10, "drag")
    assert compared(trace_of(("delay",), (("drag",),), delay, drift, drag)) == ["10 drag"]
    assert compared(trace_of(("delay",), ((),), delay, drift, drag)) == ["80 drift"]


def test_of_each_effect_the_best_model_of_no_more_effects_is_a_competitor():
    both = candidate(90, "slack", "drift")
    others = [
        candidate(95, "delay", "drift", "fatigue"), candidate(70, "delay", "drift"), candidate(30, "delay"),
        candidate(50, "gravity", "drift"), candidate(60, "drift"),
    ]  # fmt: skip
    trace = trace_of(("slack", "drift"), (("delay", "gravity"), ()), both, *others)
    assert compared(trace) == ["70 delay + drift", "50 gravity + drift"]


def test_a_competitor_that_wins_at_the_end_is_refined_as_the_first_one_was(monkeypatch):
    monkeypatch.setattr(stepwise, "refined", lambda fitted, report, threads: f"{fitted.names} refined")
    best, other = (SimpleNamespace(names=(n,), samples=9.0, bic=lambda s, b=b: b) for n, b in (("a", 5.0), ("b", 1.0)))
    search = SimpleNamespace(policy=KNOWN_RIG, report=None, threads=1)
    found, stages = stepwise._best_after_restarts(search, best, [[best, other]])
    assert found == "('b',) refined"
    assert stages == [[best, found]]
    assert stepwise._best_after_restarts(search, best, [[best]]) == (best, [[best]])
    search.policy = EQUIVALENT_RIG
    assert stepwise._best_after_restarts(search, best, [[best, other]])[0] is best


@pytest.mark.parametrize("still", [True, False])
def test_an_angle_that_stands_still_after_the_first_stroke_has_no_baseline(still):
    """So has a tendon that goes slack; the trace ended with a division by zero."""
    turn = np.sin(np.linspace(0.0, 8 * np.pi, 400))
    value = np.where(np.arange(400) < 20, 2.0 - turn, 1.0) if still else 2.0 - turn
    assert (play_baselines([Record(turn, value)]) is None) is still
