"""The table of the gate, and which cases it asks for."""

from dataclasses import replace

import pytest
from scipy.stats import binomtest

from validation.practice.gate import ROWS, Asked, Line, table
from validation.practice.kept_lines import append, read_lines
from validation.practice.outcome import Outcome


def outcome(truth, named, verdict="effect", confusable=()):
    return Outcome(
        label="x", truth=truth, noise_deg=0.05, verdict=verdict, named=named, confusable=confusable,
        before_deg=1.0, after_deg=0.1, seconds=1.0,
    )  # fmt: skip


def line(number, truth, rules, test):
    return Line("own", 3, number, outcome(truth, rules), outcome(truth, test), 0.01, (), (), 1.0, 1.0)


def test_each_label_of_a_row_comes_once_before_any_comes_again():
    for row, asked in ROWS.items():
        count = len(asked.labels)
        labels = [Asked(3, row, number).label for number in range(2 * count)]
        assert sorted(labels[:count]) == sorted(asked.labels)
        assert labels[:count] == labels[count:]
    assert [Asked(3, "own", n).label for n in range(8)] != [Asked(4, "own", n).label for n in range(8)]


def test_the_table_counts_both_verdicts_on_the_same_cases():
    truth = ("gravity",)
    lines = [line(n, truth, truth, ("tip_load",)) for n in range(2)]
    lines += [line(2, truth, ("tip_load",), truth), line(3, truth, truth, truth)]
    rows = {row.split("|")[3].strip(): row.split("|") for row in table(lines)[2:]}
    cells = [cell.strip() for cell in rows["named first"]]
    assert cells[4].startswith("3 of 4")
    assert cells[5].startswith("2 of 4")
    assert cells[6] == "2, 1"
    assert float(cells[7]) == pytest.approx(binomtest(1, 3).pvalue, rel=0.01)
    assert rows["a false name"][4].strip().startswith("1 of 4")


def test_a_case_that_the_test_does_not_decide_keeps_the_verdict_of_the_rules():
    one = replace(line(0, (), ("gravity",), ()), test=None)
    assert one.decided is one.rules


def test_lines_are_read_back(tmp_path):
    lines = [line(n, ("gravity",), ("gravity",), ()) for n in range(2)]
    for one in lines:
        append(tmp_path / "gate.jsonl", one)
    assert read_lines(tmp_path / "gate.jsonl", Line) == lines
