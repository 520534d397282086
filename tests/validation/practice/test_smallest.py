"""The search for the smallest size that is found, with a tracer whose threshold is known."""

from pathlib import Path

import pytest

from docs.make.benchmark.smallest import figure, tables
from validation.practice.draw import Case
from validation.practice.outcome import Answer, Outcome
from validation.practice.protocols import Kind
from validation.practice.smallest import search
from validation.practice.smallest.score import FalseAlarms, effects_of, main
from validation.practice.smallest.search import CASES, NEEDED, Tried, find_smallest


def finds_from(least: float):
    """A tracer that names a delay from a size on."""

    def tracer(case: Case) -> Answer:
        assert len(case.records) == 4
        ratio = case.truth.ratios[0]
        return Answer("effect", "", ("time_delay",)) if ratio > least else Answer("none")

    return tracer


@pytest.mark.parametrize(
    ("threshold", "expected", "order"),
    [
        (0.1, 0.5, [1.0, 0.71, 0.5]),
        (0.6, 0.71, [1.0, 0.71, 0.5]),
        (0.9, 1.0, [1.0, 0.71]),
        (1.6, 2.0, [1.0, 1.41, 2.0]),
        (6.0, 8.0, [1.0, 1.41, 2.0, 2.83, 4.0, 5.66, 8.0]),
        (9.0, None, [1.0, 1.41, 2.0, 2.83, 4.0, 5.66, 8.0]),
    ],
)
def test_the_ladder_is_gone_up_or_halved_below(
    threshold: float, expected: float | None, order: list[float], monkeypatch: pytest.MonkeyPatch
) -> None:
    def tried(effect: str, kind: Kind, seed: int, ratio: float, tracer: object) -> Tried:
        found = NEEDED if ratio > threshold else 0
        return Tried(ratio, CASES, found, found, ())

    monkeypatch.setattr(search, "_try", tried)
    found = find_smallest("time_delay", "known", 11, lambda case: Answer("none"))
    assert found.ratio == expected
    assert [one.ratio for one in found.tried] == order


def test_no_size_is_tried_above_one_that_the_bounds_do_not_reach(monkeypatch: pytest.MonkeyPatch) -> None:
    """Above three times the noise one case of ten can be drawn; below, nothing is found."""

    def outcome(label: str, kind: Kind, seed: int, number: int, ratio: float, tracer: object) -> Outcome | None:
        if ratio > 3.0 and number:
            return None
        return Outcome(
            label=label,
            truth=("time_delay",),
            noise_deg=0.02,
            verdict="none",
            named=(),
            confusable=(),
            before_deg=0.03,
            after_deg=None,
            seconds=0.0,
        )

    monkeypatch.setattr(search, "_outcome", outcome)
    found = find_smallest("time_delay", "known", 11, lambda case: Answer("none"))
    assert found.ratio is None
    tried = [(one.ratio, one.cases, one.is_missed) for one in found.tried]
    assert tried == [(1.0, 2, True), (1.41, 2, True), (2.0, 2, True), (2.83, 2, True), (4.0, 1, False)]
    assert found.tried[0].left == (1.5, 1.5)
    assert "| not at 1 to 2.83; the baseline's error is 1.5 times" in tables({("known", "time_delay"): found}, {})


@pytest.mark.slow
def test_nine_found_or_two_missed_decide() -> None:
    found = find_smallest("time_delay", "known", 11, finds_from(1.6))
    cases = {one.ratio: (one.cases, one.found) for one in found.tried}
    assert cases == {1.0: (2, 0), 1.41: (2, 0), 2.0: (NEEDED, NEEDED)}
    assert found.constant > 0  # s, of the delay


def test_page_and_figure_say_what_was_not_found() -> None:
    def misses(case: Case) -> Answer:
        return Answer("none", before_deg=3.0 * case.truth.noise_deg)

    never = find_smallest("time_delay", "known", 11, misses)
    assert never.ratio is None
    assert [one.cases for one in never.tried] == [2] * 7
    found = {("known", "time_delay"): never}
    text = tables(found, {"known": FalseAlarms("known", 11, 1, 40)})
    assert "| `time_delay` | not at 1 to 8; the baseline's error is 3 times the noise there | - |" in text
    assert "named: 1 of 40 (known rig)." in text
    assert figure(found).axes[0].get_yticklabels()[0].get_text() == "time_delay"


def test_unknown_effects_are_refused(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert "drive_gain" in effects_of("known")
    assert "drive_gain" not in effects_of("unknown")
    assert "gravity" in effects_of("unknown")
    with pytest.raises(SystemExit):
        main(["--seed", "1", "--kind", "unknown", "--effects", "drive_gain", "--out", str(tmp_path)])
    assert "drive_gain" in capsys.readouterr().err
