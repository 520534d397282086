"""Results that are kept: computed once, all forgotten where they are many, and never those of another key."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from hysteresis.records.record import Record
from validation.tracing.baseline import remembered
from validation.tracing.baseline.curve import curve_problem
from validation.tracing.baseline.remembered import Remembered
from validation.tracing.effect import catalogue


def test_a_result_is_computed_once() -> None:
    calls, memory = [], Remembered()
    for _ in range(3):
        assert memory.get("a", lambda: calls.append(1) or 7) == 7
    assert calls == [1]


def test_all_are_forgotten_where_they_are_too_many(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(remembered, "MOST", 2)
    calls, memory = list[str](), Remembered()
    for key in ("a", "b", "b", "c", "a"):
        assert memory.get(key, lambda key=key: calls.append(key) or key) == key
    assert calls == ["a", "b", "c", "a"]


def test_a_curve_predicts_the_same_after_other_predictions() -> None:
    """To the bit, for every form of every effect, whichever parameter was changed before."""
    time = np.linspace(0.0, 20.0, 160)
    records = [
        Record(
            drive=size * np.sin(0.9 * time),
            angle_deg=8.0 * size * np.sin(0.9 * time - 0.2),
            drive_unit="mm",
            time_s=time,
            cycle=1 + (0.9 * time / (2 * np.pi)).astype(np.int64),
            rig={"preload_N": preload},
        )
        for size, preload in ((2.0, 20.0), (1.5, 10.0))
    ]
    warm = curve_problem(records)
    forms = [form for effect in catalogue() for form in warm.forms(effect)]
    assert len(forms) > 20
    for form in forms:
        values, own = warm.start, form.starts[-1]
        near = [{**values, p.name: values[p.name] + 1e-3 * p.scale} for p in warm.parameters]
        for other in near:
            warm.predict(other, [(form, own)])
        fresh = replace(warm)  # with nothing remembered
        for expected, got in zip(
            fresh.predict(values, [(form, own)]), warm.predict(values, [(form, own)]), strict=True
        ):
            assert expected.tobytes() == got.tobytes(), form.form
        for other in near:
            again = replace(warm).predict(other, [(form, own)])
            assert [a.tobytes() for a in again] == [a.tobytes() for a in warm.predict(other, [(form, own)])], form.form
