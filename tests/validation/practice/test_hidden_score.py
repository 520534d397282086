"""The score of hidden changes goes on where an interrupted run has stopped."""

import json
from dataclasses import asdict, replace
from pathlib import Path
from types import SimpleNamespace

import pytest

from validation.practice.hidden import score
from validation.practice.hidden.score import HiddenOutcome, main

FOUND = HiddenOutcome(
    "hidden-7-000", "tendon-robot", "backlash", 3.0, "effect", ("backlash",), (), (), 0.9, 2.0, 0.7, 1.0, 0.6
)
MISSED = HiddenOutcome(
    "hidden-7-001", "tendon-robot", "leap", 3.0, "effect", ("time_delay",), (), (), None, 2.0, 0.7, 1.0, 0.6
)


def test_stored_cases_are_not_traced_again(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    file = tmp_path / "hidden.json"
    file.write_text(json.dumps({"seed": 7, "cases": [asdict(FOUND), asdict(MISSED)]}), encoding="utf-8")
    no_records = tmp_path / "nothing"  # any case that was traced would need them
    main(["--measured", str(no_records), "--seed", "7", "--count", "2", "--out", str(file)])
    text = capsys.readouterr().out
    assert "| backlash | 1 | 1 | 1 | 1 of 1 | 0 |" in text
    assert "| leap | 1 | - | - | - | 1 |" in text


def test_the_next_case_is_traced_and_stored(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    file = tmp_path / "hidden.json"
    file.write_text(json.dumps({"seed": 7, "cases": [asdict(FOUND)]}), encoding="utf-8")
    drawn = []

    def nth(folder: Path, seed: int, number: int) -> SimpleNamespace:
        drawn.append((folder, seed, number))
        return SimpleNamespace(control=())

    monkeypatch.setattr(score, "nth", nth)
    monkeypatch.setattr(score, "trace_records", lambda records, threads: None)
    monkeypatch.setattr(score, "outcome", lambda case, control: MISSED)
    main(["--measured", str(tmp_path), "--seed", "7", "--count", "2", "--out", str(file)])
    assert drawn == [(tmp_path, 7, 1)]
    stored = json.loads(file.read_text(encoding="utf-8"))
    assert [one["name"] for one in stored["cases"]] == [FOUND.name, MISSED.name]


@pytest.mark.parametrize("text", ["", "[]", '{"seed": 7, "cases": [{"name": "x"}]}'])
def test_another_file_is_refused_in_one_line(text: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    file = tmp_path / "hidden.json"
    file.write_text(text, encoding="utf-8")
    with pytest.raises(SystemExit):
        main(["--measured", str(tmp_path), "--seed", "7", "--count", "1", "--out", str(file)])
    assert "hidden.json: expected outcomes of this command" in capsys.readouterr().err
    assert file.read_text(encoding="utf-8") == text


def test_a_file_of_another_seed_is_refused_and_kept(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    file = tmp_path / "hidden.json"
    file.write_text(before := json.dumps({"seed": 8, "cases": [asdict(FOUND)]}), encoding="utf-8")
    with pytest.raises(SystemExit):
        main(["--measured", str(tmp_path), "--seed", "7", "--count", "1", "--out", str(file)])
    assert "seed = 8: expected 7" in capsys.readouterr().err
    assert file.read_text(encoding="utf-8") == before


def test_a_name_of_the_control_counts_only_where_its_constant_has_grown() -> None:
    of_both = replace(FOUND, of_control=("backlash",))
    assert of_both.in_set
    assert not replace(of_both, size=0.3).in_set
    assert not replace(of_both, size=-0.9).in_set  # as far off, the other way
