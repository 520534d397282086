"""What ``help`` says of the front door, and a script that starts workers."""

import ast
import inspect
import os
import re
import subprocess
import sys
from pathlib import Path

import pytest

import notchbend as nb
from hysteresis.records.metrics import loop_width
from hysteresis.records.record import Record, RecordError

ROOT = Path(__file__).parents[1]
FUNCTIONS = {name: one for name in nb.__all__ if inspect.isfunction(one := getattr(nb, name))}
UNITS = re.compile(r"\b(mm|N|mJ|deg|s|Hz|unit|units)\b")
UNITLESS = {"plot", "study", "write_record"}  # neither take nor give a number with a unit; plot takes deg
QUICK = ("triangle", "sine", "preset", "ensemble", "simulate")  # their examples need no file and little time


def examples(function) -> list[str]:
    return re.findall(r"^ *(?:>>>|\.\.\.) (.*)$", inspect.getdoc(function) or "", re.M)


@pytest.mark.parametrize("name", FUNCTIONS)
def test_help_documents_every_parameter_units_and_an_example(name):
    """``help(nb.simulate)`` had been silent on the program."""
    text = inspect.getdoc(FUNCTIONS[name]) or ""
    body = text.partition("Parameters\n----------\n")[2]
    documented = {one for line in re.findall(r"^(\w[\w, ]*)$", body, re.M) for one in line.split(", ")}
    assert set(inspect.signature(FUNCTIONS[name]).parameters) <= documented
    assert UNITS.search(text) or name in UNITLESS
    assert examples(FUNCTIONS[name])
    ast.parse("\n".join(examples(FUNCTIONS[name])))


@pytest.mark.parametrize("name", QUICK)
def test_examples_of_help_give_what_they_show(name):
    import doctest

    found = doctest.DocTestFinder(recurse=False).find(FUNCTIONS[name], name, globs={"nb": nb})
    for one in found:
        assert doctest.DocTestRunner(verbose=False).run(one).failed == 0


def test_a_record_has_its_loop_width_and_full_scale():
    record = nb.simulate("du2018", nb.triangle(1.0, cycles=2), engine="chain")
    assert record.full_scale_deg == abs(record.angle_deg).max()
    assert record.loop_width_deg == loop_width(record.drive, record.angle_deg, record.cycle).max_deg > 0.1


def test_a_record_without_a_loop_says_so():
    with pytest.raises(RecordError, match=r"^record: no loop width: .*expected"):
        _ = Record(drive=[0.0, 1.0], angle_deg=[0.0, 20.0]).loop_width_deg


SCRIPT = """
import notchbend as nb
print("begun")
{guard}nb.study("two.toml", "out", workers=1)
"""
STUDY = """
schema = 1
title = "two"
engine = "chain"
[rig]
preset = "du2018"
[program]
amplitude_mm = 0.5
cycles = 1
[vary]
preload_N = [10.0, 20.0]
"""


@pytest.mark.parametrize(
    "guard", ["", "if nb.__name__:\n    ", "def main():\n    ", 'if __name__ == "__main__":\n    ']
)
def test_a_script_without_its_guard_is_refused_before_it_runs_again(guard, tmp_path):
    """Every worker had run the script again."""
    text = SCRIPT.format(guard=guard) + ("main()\n" if guard.startswith("def") else "")
    (tmp_path / "script.py").write_text(text)
    (tmp_path / "two.toml").write_text(STUDY)
    where = {**os.environ, "PYTHONPATH": str(ROOT)}
    command = [sys.executable, "script.py"]
    done = subprocess.run(command, cwd=tmp_path, env=where, capture_output=True, text=True, timeout=300, check=False)
    if "__main__" in guard:
        assert done.returncode == 0, done.stderr
        assert (tmp_path / "out" / "study.json").exists()
        return
    assert done.returncode == 1
    assert done.stdout == "begun\n"
    last = done.stderr.strip().splitlines()[-1]
    assert 'expected the call below `if __name__ == "__main__":`' in last
    assert "script.py:" in last
    assert not (tmp_path / "out").exists()
