"""The search for the smallest size that is found, with a tracer whose threshold is known."""

from pathlib import Path

import pytest

from docs.make.benchmark.smallest import figure, tables
from validation.practice.draw import Case
from validation.practice.outcome import Answer
from validation.practice.smallest.score import FalseAlarms, effects_of, main
from validation.practice.smallest.search import LADDER, NEEDED, find_smallest


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
        (0.1, 0.5, [2.0, 1.0, 0.71, 0.5]),
        (0.9, 1.0, [2.0, 1.0, 0.71]),
        (1.6, 2.0, [2.0, 1.0, 1.41]),
        (3.0, 4.0, [2.0, 5.66, 4.0, 2.83]),
        (6.0, 8.0, [2.0, 5.66, 8.0]),
    ],
)
def test_the_ladder_is_halved_to_the_smallest_size_that_is_found(
    threshold: float, expected: float, order: list[float]
) -> None:
    found = find_smallest("time_delay", "known", 11, finds_from(threshold))
    assert [one.ratio for one in found.tried] == order
    assert found.ratio == expected
    tried = {one.ratio: one for one in found.tried}
    assert tried[expected].found == tried[expected].cases == NEEDED  # enough of ten
    assert found.constant > 0  # s, of the delay
    if expected > LADDER[0]:
        below = tried[LADDER[LADDER.index(expected) - 1]]
        assert below.cases == 2  # two misses decide
        assert below.found == 0


def test_page_and_figure_say_what_was_not_found() -> None:
    never = find_smallest("time_delay", "known", 11, lambda case: Answer("none"))
    assert never.ratio is None
    assert [one.cases for one in never.tried] == [2] * 3
    found = {("known", "time_delay"): never}
    text = tables(found, {"known": FalseAlarms("known", 11, 1, 40)})
    assert "| `time_delay` | not at 8 | - |" in text
    assert "named: 1 of 40 (known rig)." in text
    assert figure(found).axes[0].get_yticklabels()[0].get_text() == "time_delay"


def test_unknown_effects_are_refused(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert "drive_gain" in effects_of("known")
    assert "drive_gain" not in effects_of("unknown")
    assert "gravity" in effects_of("unknown")
    with pytest.raises(SystemExit):
        main(["--seed", "1", "--kind", "unknown", "--effects", "drive_gain", "--out", str(tmp_path)])
    assert "drive_gain" in capsys.readouterr().err
