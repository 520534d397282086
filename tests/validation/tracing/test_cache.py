"""Results that are kept: computed once, all forgotten where they are many, and never those of another key."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace
from functools import partial

import numpy as np
import pytest

from hysteresis.records.record import Record
from validation.tracing.baseline.cache import Cache
from validation.tracing.baseline.curve import CurveProblem, curve_problem
from validation.tracing.baseline.curve_scale import PlacedForm
from validation.tracing.baseline.play_operators import PlayProblem, play_problem
from validation.tracing.effect import Values, catalogue


def test_a_result_is_computed_once() -> None:
    calls, kept = list[str](), Cache()

    def nothing() -> None:
        calls.append("a")

    for _ in range(3):
        assert kept.get("a", nothing) is None  # None is a result, too
    assert calls == ["a"]


def test_all_are_forgotten_where_they_are_too_many() -> None:
    calls, kept = list[str](), Cache(most=2)

    def noted(key: str) -> str:
        calls.append(key)
        return key

    for key in ("a", "b", "b", "c", "a"):
        assert kept.get(key, partial(noted, key)) == key
    assert calls == ["a", "b", "c", "a"]


TIME = np.linspace(0.0, 20.0, 160)
RECORDS = [
    Record(
        drive=size * np.sin(0.9 * TIME),
        angle_deg=8.0 * size * np.sin(0.9 * TIME - 0.2),
        drive_unit="mm",
        time_s=TIME,
        cycle=1 + (0.9 * TIME / (2 * np.pi)).astype(np.int64),
        rig={"preload_N": preload},
    )
    for size, preload in ((2.0, 20.0), (1.5, 10.0))
]


def curve() -> CurveProblem:
    return curve_problem(RECORDS)


def plays() -> PlayProblem:
    return play_problem(RECORDS)


def compared() -> PlayProblem:
    """The second record is a reference, on which the shared form of a backlash acts, too."""
    shared = next(form for effect in catalogue() if effect.name == "backlash" for form in effect.curve_forms)
    assert shared.drive is not None
    return play_problem(RECORDS[:1], reference=RECORDS[1:], shared=(shared,))


@pytest.mark.parametrize("made", [curve, plays, compared])
def test_a_prediction_is_the_same_after_others(made: Callable[[], CurveProblem | PlayProblem]) -> None:
    """To the bit: whichever parameter, of the baseline or of an effect, and whichever effect was changed before."""
    warm = made()
    forms = [form for effect in catalogue() for form in warm.forms(effect)]
    assert len(forms) > 20
    other = next(form for effect in catalogue() if effect.name == "time_delay" for form in warm.forms(effect))

    def agree(values: Values, added: Sequence[tuple[PlacedForm, Values]]) -> bool:
        fresh = replace(warm).predict(values, added)  # with nothing kept
        return [a.tobytes() for a in fresh] == [a.tobytes() for a in warm.predict(values, added)]

    rng = np.random.default_rng(5)  # all plays have a part in it
    start = {p.name: warm.start[p.name] + 0.3 * p.scale * rng.uniform() for p in warm.parameters}
    baseline = [start, *({**start, p.name: start[p.name] + 1e-3 * p.scale} for p in warm.parameters)]
    for form in forms:
        own = form.starts[-1]
        mine = [own, *({**own, p.name: own[p.name] * 1.01 + 1e-3 * p.scale} for p in form.parameters)]
        assert all(agree(values, [(form, own)]) for values in baseline), form.form
        assert all(agree(start, [(form, values)]) for values in mine), form.form
        assert agree(start, [(form, own), (other, other.starts[0])]), form.form
        assert agree(start, [(other, other.starts[0]), (form, mine[-1])]), form.form
        copy = warm.scale.placed(replace(form.form))  # acts on the same operators, but on no reference
        assert agree(start, [(copy, own)]), form.form
