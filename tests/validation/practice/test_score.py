"""Scores of the tracer: rates, intervals, stored outcomes, and the page."""

import json
from dataclasses import replace
from pathlib import Path

import pytest

from docs.make.practice import main as write_page
from docs.make.practice import put_section, tables
from hysteresis.plain import to_plain
from validation.practice import score
from validation.practice.outcome import Answer, Outcome
from validation.practice.score import Request
from validation.practice.summary import Spread, confusion, rate_of_hits, summary, wilson_interval

KEYS = [
    "label", "name", "truth", "numbers", "ratios", "beyond_curve", "engine", "rig", "noise_deg", "verdict", "message",
    "named", "confusable", "noise_floor_deg", "before_deg", "after_deg", "seconds", "describes",
]  # fmt: skip


def outcome(label: str, verdict: str, named: str = "", confusable: str = "", **more) -> Outcome:
    truth = () if label == "clean" else tuple(more.pop("truth", label).split())
    values = {"noise_deg": 0.05, "before_deg": 0.2, "after_deg": 0.06, "seconds": 2.0} | more
    names = {"named": tuple(named.split()), "confusable": tuple(confusable.split())}
    return Outcome(label=label, truth=truth, verdict=verdict, **names, **values)


TABLE = [
    outcome("backlash", "effect", "backlash", seconds=4.0),
    outcome("backlash", "ambiguous", "tendon_slack", "guide_friction backlash"),
    outcome("backlash", "ambiguous", "tendon_slack", "guide_friction time_delay backlash"),  # fourth: not in the set
    outcome("gravity", "none"),
    outcome("gravity", "effect", "gravity", after_deg=0.1),
    outcome("clean", "none"),
    outcome("clean", "unexplained"),
    outcome("clean", "effect", "gravity"),
    outcome("pair", "effect", "gravity backlash", truth="backlash gravity"),
    outcome("pair", "effect", "gravity", truth="backlash gravity"),
    outcome("pair", "effect", "time_delay backlash", truth="backlash time_delay"),
    outcome("lost_counts", "unexplained", "gravity"),
    outcome("lost_counts", "effect", "thermal_drift"),
]


def test_summary_of_a_table_made_by_hand() -> None:
    result = summary(TABLE)
    hits = {name: (rate.hits, rate.of) for name, rate in result.rates.items()}
    assert hits == {
        "first": (2, 5),
        "within set": (3, 5),
        "first, not of the angle alone": (1, 3),
        "within set, not of the angle alone": (2, 3),
        "nothing else named": (2, 5),
        "missed: none": (1, 5),
        "clean: no effect claimed": (2, 3),
        "clean: none": (1, 3),
        "clean: an effect named falsely": (1, 3),
        "dominant run-out: named, partial or effect": (0, 0),
        "pairs: both named": (2, 3),
        "pairs, neither of the angle alone: both named": (1, 1),
        "outside: unexplained": (1, 2),
        "outside: no effect claimed": (1, 2),
        "spoiled: an effect named falsely": (0, 0),
        "spoiled: none": (0, 0),
        "spoiled, without the lumped rigs: an effect named falsely": (0, 0),
        "spoiled, without the lumped rigs: none": (0, 0),
        "right: held-out error within 1.3 of the noise": (1, 2),  # 0.06/0.05 = 1.2 and 0.1/0.05 = 2
        "errors": (0, 13),
    }
    assert (result.after_over_noise.median, result.after_over_noise.largest) == pytest.approx((1.6, 2.0))
    assert (result.after_over_before.median, result.after_over_before.largest) == pytest.approx((0.4, 0.5))
    assert result.seconds == Spread(2.0, 4.0)
    assert confusion(TABLE)["backlash"] == {"backlash": 1, "tendon_slack": 2}
    assert confusion(TABLE)["lost_counts"] == {"unexplained": 1, "thermal_drift": 1}


def test_wilson_interval() -> None:
    """By hand from the formula: at p = 0 the upper bound is z^2/(n + z^2), at p = 1 the mirror image."""
    z2 = 1.959964**2
    assert wilson_interval(0, 10) == pytest.approx((0.0, z2 / (10 + z2)))
    assert wilson_interval(10, 10) == pytest.approx((10 / (10 + z2), 1.0))
    low, high = wilson_interval(5, 10)
    assert low + high == pytest.approx(1.0)
    assert to_plain(rate_of_hits([])) == {"hits": 0, "of": 0, "rate": None, "low": 0.0, "high": 1.0}


def names_backlash(records, seed):
    """A tracer that always names the same effect."""
    return Answer("effect", "", ("backlash",), ("tendon_slack",), 0.03, 0.1, 0.1)


def fails(records, seed):
    raise ValueError("no such thing")


def test_cases_are_traced_stored_and_read(tmp_path: Path) -> None:
    todo = score.jobs("work", "known", 1, ["backlash", "clean"], tmp_path)
    fewer = score.jobs("work", "known", 3, ["backlash", "clean", "pair", "lost_counts"], tmp_path, others=1)
    assert [job.label for job in fewer] == ["backlash"] * 3 + ["clean"] * 6 + ["pair"] * 2 + ["lost_counts"]
    assert [(job.label, job.number) for job in todo] == [("backlash", 0), ("clean", 0), ("clean", 1)]
    for job in todo[:2]:
        score.run_job(job, names_backlash)
    score.run_job(todo[2], fails)
    stored = json.loads(todo[2].file.read_text())
    assert list(stored) == KEYS
    assert stored["verdict"] == "error"
    assert "no such thing" in stored["message"]
    assert [score.finished(job) for job in todo] == [True, True, False]  # an error is traced again
    before = [job.file.stat().st_mtime_ns for job in todo[:2]]
    score.run_all(todo[:2], 1, quiet=True)  # finished cases are not traced again
    assert [job.file.stat().st_mtime_ns for job in todo[:2]] == before
    first, clean, failed = score.read_outcomes(todo)
    assert first.first_right
    assert (clean.column, failed.column) == ("backlash", "error")


def test_page_keeps_prose_and_the_other_kind(tmp_path: Path) -> None:
    page = tmp_path / "practice.md"
    page.write_text("# Practice\n\nProse.\n\n## Known rig\n\nold\n\n## Unknown geometry\n\nkept\n")
    request, result = Request(1, "score", "known", None, None, None), summary(TABLE)
    text = tables(request, result)
    put_section(page, request, text)
    put_section(page, request, text)  # again: the same page
    new = page.read_text()
    assert new.startswith("# Practice\n\nProse.\n\n## Known rig\n")
    assert "old" not in new
    assert new.endswith("## Unknown geometry\n\nkept\n")
    assert new.count("Confusion matrix") == 1
    assert "| first | 2 | 5 | 40.0 | 12 to 77 |" in text  # Wilson, 2 of 5: 0.118 to 0.769
    pairs = replace(request, effects="pair,lost_counts")
    put_section(page, pairs, tables(pairs, result))
    heading = "## Known rig, pairs and effects outside the catalogue"
    assert page.read_text() == f"{new.rstrip()}\n\n{heading}\n\n{tables(pairs, result)}"


def test_page_is_written_from_the_stored_score(tmp_path: Path) -> None:
    request, result = Request(1, "score", "known", None, None, None), summary(TABLE)
    stored, page = tmp_path / "score.json", tmp_path / "practice.md"
    stored.write_text(json.dumps({**to_plain(request), **to_plain(result)}))
    write_page([str(stored), "--page", str(page)])
    assert page.read_text() == f"# Practice score\n\n## Known rig\n\n{tables(request, result)}"


def test_page_leaves_out_rates_of_no_case() -> None:
    clean = [one for one in TABLE if one.label == "clean"]
    text = tables(Request(1, "score", "known", None, None, None), summary(clean))
    assert "| clean: none |" in text
    assert not any(part in text for part in ("| first", "pairs", "over the noise"))


@pytest.mark.parametrize("given", [["--effects", "backlsh"], ["--source", "lumped", "--effects", "held,pair"]])
def test_unknown_label_is_refused(given: list[str]) -> None:
    with pytest.raises(SystemExit, match=r"--effects: '(backlsh|held)': expected some of backlash, "):
        score.main(given)


def test_cases_of_other_sources_are_scored(tmp_path: Path) -> None:
    """A leap of the lumped rig is outside of the catalogue; a drive gain describes the sensor that has one."""
    todo = [
        *score.jobs("work", "unknown", 1, ["leap"], tmp_path, source="lumped"),
        *score.jobs("work", "unknown", 1, ["drive_gain", "outliers"], tmp_path, source="sensors"),
    ]
    assert [job.label for job in todo] == ["leap", "drive_gain", "outliers"]
    for job in todo:
        score.run_job(job, lambda records, seed: Answer("effect", "", ("drive_gain",), (), 0.03, 0.1, 0.1))
    leap, gain, outliers = score.read_outcomes(todo)
    assert (leap.names_falsely, gain.names_falsely, outliers.names_falsely) == (True, False, True)
    rates = summary([leap, gain, outliers]).rates
    assert (rates["spoiled: an effect named falsely"].hits, rates["outside: unexplained"].hits) == (1, 0)
    assert rates["spoiled: an effect named falsely"].of == 2  # a gain of the sensor is no injected effect
    assert rates["first"].of == 0
    lumped = replace(outliers, engine="lumped")
    rates = summary([gain, lumped]).rates
    assert rates["spoiled: an effect named falsely"].hits == 1
    assert rates["spoiled, without the lumped rigs: an effect named falsely"].hits == 0
    request = Request(1, "work", "unknown", 1, None, None, "sensors")
    assert "| outliers | 0 | 0 | 0 | `drive_gain` 1 |" in tables(request, summary([gain, outliers]))
