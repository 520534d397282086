"""``notchbend design``: tubes that meet a requirement, the same whatever the workers, and the files of them."""

import csv
import json

import numpy as np
import pytest
from page_links import dead_references

from fem_models.rig import read_rig
from hysteresis.records.record_file import read_record
from studies.commands import call
from studies.design.design_file import read_design
from studies.design.evaluation import Task, evaluate, evaluate_robust
from studies.design.run import run_design
from studies.design.search import Search, best, search
from studies.design.space import Candidate
from studies.design.stock import TUBES, WIRES
from studies.design.workers import crew
from studies.report.page import write_report
from studies.results.page_one import read_page_one

TEXT = """\
schema = 1
title = "Needle"
[require]
bend_deg = { min = 60, confidence = 0.9 }
tension_N = { max = 4, confidence = 0.9 }
outer_diameter_mm = { max = 1.2 }
length_mm = { max = 8 }
notch_angle_deg = { max = 31 }
[design]
count = [3, 8]
[search]
explore = 64
population = 8
generations = 4
robust_generations = 2
draws = 50
shown = 2
"""
TOLERANCE = "[tolerance]\ndepth_mm = { sd = 0.01 }\nplateau_MPa = { plus_minus_percent = 10 }\n"
YORK = Candidate(TUBES[1], WIRES[0], 5, 0.979, 0.508, 0.51, 0.0)


@pytest.fixture
def file(tmp_path):
    def write(text=TEXT):
        path = tmp_path / "require.toml"
        path.write_text(text)
        return path

    return write


def task_of(design):
    return Task(design.space, design.requirements, design.use, design.tolerances)


def test_geometry_refuses_before_the_chain(file):
    task = task_of(read_design(file()))
    wide = Candidate(TUBES[-1], WIRES[0], 5, 2.0, 0.5, 0.5, 0.0)
    assert evaluate(task, wide).shortfalls.keys() == {"outer_diameter_mm"}
    few = Candidate(TUBES[1], WIRES[0], 1, 0.979, 0.508, 0.51, 0.0)
    assert "bend_deg" in evaluate(task, few).shortfalls  # its only slot closes far below 60 deg
    thin = Candidate(TUBES[1], WIRES[0], 5, 1.13, 0.508, 0.51, 0.0)
    assert evaluate(task, thin).shortfalls.keys() == {"least bridge"}


def test_bound_by_geometry_refuses_no_slot_that_reaches_the_bend(file):
    """N w/depth is beyond any closing angle: what the chain reaches is never refused."""
    task = task_of(read_design(file(TEXT.replace("min = 60", "min = 97"))))
    found = evaluate(task, YORK)
    assert found.bent
    assert found.measured.closing_bend_deg < np.degrees(5 * 0.508 / 0.979)


def test_yorks_tube_meets_what_it_is_known_for(file):
    assert evaluate(task_of(read_design(file())), YORK).shortfalls == {}


def test_reliability_falls_with_the_tolerance(file):
    loose, tight = (
        evaluate_robust(task_of(read_design(file(TEXT + TOLERANCE.replace("0.01", sd)))), YORK).reliability
        for sd in ("0.02", "0.005")
    )
    assert loose[0] < tight[0]


def test_numbers_of_a_tube_can_be_bought_and_cut(file):
    space = read_design(file()).space
    for unit in np.random.default_rng(0).random((50, space.size)):
        one = space.candidate(unit)
        assert one.tube in TUBES
        assert one.wire in WIRES
        assert 3 <= one.count <= 8
        for length in (one.depth_mm, one.width_mm, one.spacing_mm):
            assert length / 0.005 == pytest.approx(round(length / 0.005), abs=1e-6)


@pytest.mark.slow
def test_workers_change_nothing(file, tmp_path):
    found = []
    for workers in (1, 2):
        out = tmp_path / str(workers)
        run_design(read_design(file(TEXT + TOLERANCE)), out, workers=workers)
        found.append({k: v for k, v in json.loads((out / "design.json").read_text()).items() if k != "seconds"})
    assert found[0] == found[1]


def test_search_trades_only_among_tubes_that_meet_all(file):
    design = read_design(file())
    with crew(1) as team:
        found = search(task_of(design), Search(8, 4, 0, design.trade, 64), team)
    assert found.feasible
    front = best(found.feasible, design.trade, 2)
    lengths = [one.measured.length_mm for one in front]
    assert min(one.measured.length_mm for one in found.feasible) == lengths[0] <= lengths[-1]


@pytest.mark.slow
def test_command_writes_designs_and_their_rigs(file, tmp_path, capsys):
    out = tmp_path / "out"
    assert call(["design", str(file(TEXT + TOLERANCE)), "--out", str(out), "--workers", "1"]) == 0
    printed = capsys.readouterr().out
    assert "tubes meet all requirements" in printed
    assert "tighten" in printed
    result = json.loads((out / "design.json").read_text())
    names = [one["name"] for one in result["designs"]]
    assert {"nominal-1", "robust-1"} <= set(names)
    with (out / "designs.csv").open() as table:
        assert [row["design"] for row in csv.DictReader(table)] == names
    for one in result["designs"]:
        rig = read_rig(out / one["rig"])
        assert rig.joints == one["values"]["notch.count"]
        assert one["p_all"]["draws"] == 50
    page = (out / "report.html").read_text()
    assert page.index('id="design"') < page.index('id="summary"') < page.index('id="designs"')
    assert "P(all met)" in page
    assert dead_references(page) == []


@pytest.mark.slow
def test_first_page_is_that_of_the_first_robust_design(file, tmp_path):
    out = tmp_path / "out"
    summary = run_design(read_design(file(TEXT + TOLERANCE)), out, workers=1)
    chosen, page = summary.chosen, read_page_one(out)
    assert chosen.kind == "robust"
    varied = {one.quantity for one in chosen.influences}
    assert "bend_deg" in varied
    for row, verdict in zip(page.rows, chosen.verdicts, strict=False):
        assert (row.value, row.met, row.margin) == (verdict.value, verdict.decision, pytest.approx(verdict.margin))
        known = (verdict.p_met.value, verdict.confidence) if verdict.quantity in varied else (None, None)
        assert (row.p_met, row.p_asked) == known
    rest = {row.name for row in page.rows if row.met is None}
    assert {"Tip force", "Tip stiffness", "Closing bend", "Loop width", "Cycles"} <= rest
    assert page.costs[0].given == summary.tolerances[page.costs[0].name]
    assert any("capstan_coefficient" in words for words in page.rests_on)  # it has no tolerance
    loop = read_record(out / page.loop)
    assert loop.angle_deg.max() == pytest.approx(60, abs=0.2)
    for path in (out / "design.json", out / "designs.csv"):
        path.unlink()
    assert "By the model, cut a first tube" in write_report(out).read_text()  # page one alone is enough for a report


@pytest.mark.slow
def test_command_replaces_its_own_files(file, tmp_path):
    asked = ["design", str(file(TEXT)), "--out", str(tmp_path / "out"), "--workers", "1", "--quiet"]
    assert [call(asked), call(asked)] == [0, 0]


@pytest.mark.slow
def test_requirement_that_nothing_meets_is_told(file, tmp_path):
    design = read_design(file(TEXT.replace("max = 8", "max = 0.9").replace("count = [3, 8]", "count = [3, 3]")))
    summary = run_design(design, tmp_path / "out", workers=1)
    assert summary.feasible == 0
    assert "the nearest one misses" in summary.warnings[0]
    assert summary.designs[0].verdicts
