"""The benchmark: blind cases, sealed answers, and scores of anyone's answers."""

import json
import shutil
from pathlib import Path

import pytest

from docs.make.benchmark import tables
from hysteresis import read_record
from hysteresis.records.record import RecordError
from studies.commands.cli import call
from validation.measured import measured_folder
from validation.practice.benchmark.answering import answer_all
from validation.practice.benchmark.answers import CaseAnswer, NamedEffect, answer_of
from validation.practice.benchmark.scoring import judge, score_answers
from validation.practice.benchmark.sealed import SealedCase, read_list, read_sealed, records_of
from validation.practice.benchmark.sizes import size_of
from validation.practice.benchmark.sources import draw_source
from validation.practice.catalogue import CATALOGUE
from validation.practice.hidden.changes import CHANGES
from validation.practice.spoiled import PLANS, SENSORS
from validation.tracing import catalogue

FOLDER, SEALED = "cases", "cases-ANSWERS.json"


@pytest.fixture(scope="module")
def exported(tmp_path_factory):
    """Five cases of each source that is simulated quickly."""
    folder = tmp_path_factory.mktemp("benchmark")
    sources = ["--sources", "other,sensors,protocols"]
    assert (
        call(["practice", "export", "--seed", "7", "--count", "5", "--out", str(folder / FOLDER), *sources, "--quiet"])
        == 0
    )
    return folder


@pytest.fixture
def copy(exported, tmp_path):
    return Path(shutil.copytree(exported, tmp_path / "copy"))


def sealed_case(effects=(), **values):
    given = {"outside": False, "describes": (), "size": None, "control": None, "source": "real", "rig": "unknown"}
    given |= {"label": "", "counts": True, "noise_deg": 0.1, "sha256": {}}
    return SealedCase(name="case-001", effects=tuple(effects), **(given | values))


def named(*effects, verdict="effect"):
    """Answer from names, or from names with parameters and what they may be confused with."""
    each = [one if isinstance(one, NamedEffect) else NamedEffect(one, (), {}) for one in effects]
    return CaseAnswer(1, verdict, tuple(each))


def perfect(folder: Path) -> None:
    """Answer all cases with the truth."""
    for case in read_sealed(folder / FOLDER, folder / SEALED).cases:
        key = {"backlash": "width_mm", "time_delay": "delay_s", "thermal_drift": "deg_per_s"}
        size = {} if case.size is None or not case.effects else {key.get(case.effects[0], "x"): {"value": case.size}}
        effects = [{"name": name, "parameters": size} for name in case.effects]
        verdict = "effect" if effects else "unexplained" if case.outside else "none"
        answer = {"schema": 1, "verdict": verdict, "effects": effects, "heldout_rmse_deg": case.noise_deg}
        path = folder / FOLDER / "answers" / f"{case.name}.json"
        path.parent.mkdir(exist_ok=True)
        path.write_text(json.dumps(answer))


def test_cases_tell_nothing_of_their_answers(exported):
    names = read_list(exported / FOLDER).cases
    sealed = read_sealed(exported / FOLDER, exported / SEALED)
    assert len(names) == 15
    assert [case.source for case in sealed.cases] != sorted(case.source for case in sealed.cases)
    hints = {*CATALOGUE, *CHANGES, *SENSORS, *PLANS, "clean", "lumped", "own", "spoiled", "hidden"}
    texts = [path.read_text() for path in (exported / FOLDER).rglob("*") if path.suffix in (".toml", ".json")]
    assert len(texts) > 30
    for text in texts:
        assert not any(hint in text for hint in hints)
    assert len({path.stat().st_mtime_ns for path in (exported / FOLDER).rglob("*")}) == 1
    for name in names:
        for number, path in enumerate(records_of(exported / FOLDER, name), start=1):
            record = read_record(path)
            assert record.title.startswith(f"Benchmark {name}, record {number} of ")
            assert record.angle_deg.round(5).tolist() == record.angle_deg.tolist()
            assert record.time_s[0] == 0.0


def test_same_seed_gives_the_same_cases_and_another_one_others(exported, tmp_path):
    common = ["--count", "2", "--sources", "other", "--quiet"]
    for name, seed in (("a", "7"), ("b", "7"), ("c", "8")):
        assert call(["practice", "export", "--seed", seed, "--out", str(tmp_path / name), *common]) == 0
    a, b, c = (json.loads((tmp_path / f"{name}-ANSWERS.json").read_text())["cases"] for name in "abc")
    assert a == b
    assert a != c


def test_perfect_answers_are_scored_as_such(copy):
    perfect(copy)
    found = score_answers(copy / FOLDER, copy / SEALED, copy / FOLDER / "answers")
    assert found.cases == found.answered == 15
    rates = found.rates["all"]
    assert rates["first"].of > 5
    for name in ("first", "in the set", "clean: none", "outside: abstained", "size within 25 %"):
        assert rates[name].hits == rates[name].of, name
    for name in ("wrong name", "missed: none", "undecided", "clean: false alarm"):
        assert rates[name].hits == 0, name
    assert found.heldout_over_noise["all"].largest == pytest.approx(1.0)


def test_command_scores_and_refuses_in_one_line(copy, capsys):
    folder, sealed = str(copy / FOLDER), str(copy / SEALED)
    assert call(["practice", "score", folder, sealed]) == 2
    assert "no answer: expected case-001.json or case-001/trace.json" in capsys.readouterr().err
    perfect(copy)
    assert call(["practice", "score", folder, sealed, "--json", "--out", str(copy / "score.json")]) == 0
    assert json.loads(capsys.readouterr().out) == json.loads((copy / "score.json").read_text())
    changed = copy / FOLDER / "case-003" / "record-1.csv"
    changed.write_text(changed.read_text().replace("0.0", "0.1", 1))
    assert call(["practice", "score", folder, sealed]) == 2
    error = capsys.readouterr().err
    assert error.count("\n") == 1
    assert "case-003/record-1.csv: SHA-256" in error
    assert "the case was changed" in error
    (copy / SEALED).write_text((copy / SEALED).read_text().replace("true", "false", 1))
    assert call(["practice", "score", folder, sealed]) == 2
    assert f"expected {read_list(copy / FOLDER).answers_sha256[:12]}" in capsys.readouterr().err


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("[" * 100_000 + "]" * 100_000, "nested too deep"),
        (
            '{"schema": 1, "verdict": "effect", "effects": [{"name": "a", "parameters": {"x": 1' + "0" * 400 + "}}]}",
            "x = 1",
        ),
        ('{"schema": 1, "verdict": "a\\nb"}', "expected one of"),
        ('{"schema": 1, "verdict": ' + '"x' * 1 + "x" * 5_000 + '"}', "expected one of"),
        ('"two\\nlines"', "an answer"),
    ],
    ids=["deep", "a number of 400 digits", "two lines", "long", "no object"],
)
def test_a_malformed_answer_is_one_line(text, words, copy, capsys):
    perfect(copy)
    answer = next((copy / FOLDER / "answers").glob("*.json"))
    answer.write_text(text)
    assert call(["practice", "score", str(copy / FOLDER), str(copy / SEALED)]) == 2
    error = capsys.readouterr().err
    assert (error.count("\n"), len(error) < 300) == (1, True)
    assert words in error
    assert answer.name in error


def test_export_keeps_answers_apart(tmp_path, capsys):
    inside = ["--answers", str(tmp_path / "new" / "a.json")]
    assert call(["practice", "export", "--out", str(tmp_path / "new"), *inside]) == 2
    assert "expected the answers apart from the cases" in capsys.readouterr().err
    assert call(["practice", "export", "--out", str(tmp_path / "new"), "--sources", "real"]) == 2
    assert "--measured = missing" in capsys.readouterr().err
    assert call(["practice", "export", "--out", str(tmp_path / "new"), "--sources", "own,theirs"]) == 2
    assert "--sources theirs" in capsys.readouterr().err
    assert call(["practice", "export", "--out", str(tmp_path / "new"), "--measured", str(tmp_path)]) == 2
    assert f"{tmp_path}: no measured records" in capsys.readouterr().err
    assert not (tmp_path / "new").exists()


def test_trace_and_its_folder_are_answers():
    effect = {"name": "backlash", "parameters": {"width_mm": {"value": 0.1, "low": 0.0, "high": 0.2, "unit": "mm"}}}
    trace = {"schema": 1, "verdict": "effect", "effects": [effect], "after": {"heldout": {"rmse_deg": 0.06}}}
    answer = answer_of(trace, "trace.json")
    assert answer.named[0].parameters == {"width_mm": 0.1}
    assert answer.heldout_rmse_deg == 0.06
    assert answer_of({"schema": 1, "verdict": "none"}, "x").named == ()


@pytest.mark.parametrize(
    ("values", "expected"),
    [
        ([], "expected an answer"),
        ({"schema": 2}, "schema = 2: expected 1"),
        ({"schema": True}, "schema = True: expected 1"),
        ({"schema": 1, "verdict": "yes"}, "verdict = 'yes': expected one of effect, partial"),
        ({"schema": 1, "verdict": "effect"}, "effects: none with the verdict effect"),
        ({"schema": 1, "verdict": "effect", "effects": [{}]}, r"effects\[0\]: {}: expected an object with a name"),
        (
            {"schema": 1, "verdict": "effect", "effects": [{"name": "x", "parameters": {"a_mm": "1"}}]},
            "a_mm = '1': expected a number",
        ),
    ],
)
def test_malformed_answers_are_refused(values, expected):
    with pytest.raises(RecordError, match=expected):
        answer_of(values, "case-001.json")


def test_sets_false_alarms_and_abstentions():
    case = sealed_case(["backlash"], size=0.2)
    both = NamedEffect("guide_friction", ("backlash",), {})
    assert judge(case, named(both, verdict="ambiguous")).within_set
    assert not judge(case, named(both, verdict="ambiguous")).first
    assert judge(case, named("backlash", verdict="unexplained")).named == ()  # no verdict that names
    far = NamedEffect("gravity", ("tip_contact", "unequal_tendons", "backlash"), {})
    assert not judge(case, named(far)).within_set  # the fourth of a set
    assert judge(sealed_case(describes=("drive_gain",)), named("drive_gain")).named == ()
    found = judge(case, named(NamedEffect("backlash", (), {"width_deg": 0.23})))
    assert found.size_over_true == pytest.approx(1.15)


def test_names_of_the_control_count_only_where_they_have_grown():
    case = sealed_case(["time_delay"], size=0.1, control="case-002")
    control = named("gravity", NamedEffect("time_delay", (), {"delay_s": 0.03}))
    grown = named("gravity", NamedEffect("time_delay", (), {"delay_s": 0.125}))
    judged = judge(case, grown, control)
    assert judged.named == ("time_delay",)
    assert judged.size_over_true == pytest.approx(0.95)
    same = named(NamedEffect("time_delay", (), {"delay_s": 0.04}))
    assert judge(case, same, control).named == ()
    less = named(NamedEffect("time_delay", (), {"delay_s": -0.07}))  # as far from the control, the other way
    assert judge(case, less, control).named == ()
    leap = sealed_case(outside=True, label="leap", control="case-002")
    assert judge(leap, control, control).named == ()
    assert judge(leap, named("gravity", "thermal_drift"), control).named == ("thermal_drift",)


def test_sizes_of_effects_that_the_tracer_has():
    names = {effect.name for effect in catalogue()}
    assert {"backlash", "time_delay", "thermal_drift", "wheel_eccentricity", "preload_loss"} <= names
    assert size_of("wheel_eccentricity", {"sine_mm": 0.3, "cosine_mm": -0.4, "radius_mm": 9.0}, "known") == 0.5
    assert size_of("wheel_eccentricity", {"amplitude_deg": 0.2}, "unknown") == 0.2
    assert size_of("thermal_drift", {"drift_deg": 2.0, "time_s": 40.0, "saturates": 0.0}, "known") == 0.05
    assert size_of("thermal_drift", {"size_deg": 2.0, "time_s": 40.0}, "known") is None
    assert size_of("notch_closure", {"angle_deg": 3.0}, "unknown") is None
    assert size_of("gravity", {"ring_mass_g": 3.0}, "known") is None


def test_answers_are_resumed_and_errors_are_tried_again(copy):
    folder, into = copy / FOLDER, copy / "mine"
    cases = read_list(folder).cases

    def fails(records):
        raise ValueError("no angle")

    def clean(records):
        assert len(records) >= 1
        return CaseAnswer(1, "none")

    assert answer_all(folder, into, fails, 1) == len(cases)
    assert "ValueError at fails: no angle" in (into / "case-001.json").read_text()
    assert answer_all(folder, into, clean, 1) == len(cases)
    assert answer_all(folder, into, fails, 1) == 0
    found = score_answers(folder, copy / SEALED, into)
    assert found.rates["all"]["missed: none"].rate == 1.0


@pytest.mark.skipif(not measured_folder().is_dir(), reason="no measured records")
def test_measured_cases_come_with_their_controls():
    drawn = draw_source("real", 3, 10, measured_folder())
    hidden, controls = drawn[:10], drawn[10:]
    assert all(one.counts for one in hidden)
    assert not any(one.counts for one in controls)
    assert {one.control_of for one in hidden} == {one.control_of for one in controls}
    assert {*CHANGES} - {"wheel_eccentricity"} <= {one.label for one in hidden} <= {*CHANGES}
    with pytest.raises(RecordError, match="expected the folder of the measured records"):
        draw_source("real", 3, 8)


def test_page_has_a_column_for_each_way(copy, tmp_path):
    folder, sealed, page = str(copy / FOLDER), str(copy / SEALED), tmp_path / "page.md"
    mark = f"<!-- table of `python -m {tables.COMMAND}` -->"
    page.write_text(f"# Page\n\n{mark}\n{mark}\n\nprose\n")
    perfect(copy)
    ways = [str(tmp_path / f"{name}.json") for name in ("tracer", "classifier")]
    for way in ways:
        assert call(["practice", "score", folder, sealed, "--out", way, "--quiet"]) == 0
    tables.main([*ways, "--page", str(page)])
    text = page.read_text()
    assert "|  | tracer | classifier |" in text
    assert "**sensors**: 5 cases." in text
    assert text.endswith(f"{mark}\n\nprose\n")
    assert text.count("| clean: none | ") == 4
    score = json.loads(Path(ways[1]).read_text())
    score["each"][0]["case"] = "case-999"
    Path(ways[1]).write_text(json.dumps(score))
    with pytest.raises(RecordError, match="scores of different cases"):
        tables.main([*ways, "--page", str(page)])
