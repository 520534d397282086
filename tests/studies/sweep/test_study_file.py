"""Study files: a wrong one is refused in one line with file, field and value."""

from pathlib import Path

import pytest
from small_study import GRID, HEAD, PROGRAM, study_file

from studies.commands import call
from studies.sweep import read_study
from studies.sweep.cases import evaluate
from studies.sweep.plan import Grid, cases, plan_of
from studies.sweep.study_file import ready_studies

VALUES = "[10, 15, 20, 30]"
BAD_FILES = {
    "schema": (GRID.replace("schema = 1", "schema = 2"), ["schema = 2", "expected 1"]),
    "schema that is true": (GRID.replace("schema = 1", "schema = true"), ["schema = True", "expected 1"]),
    "empty vary": (HEAD + PROGRAM + "[vary]\n", ["[vary]", "at least one field"]),
    "vary with an empty table": (HEAD + PROGRAM + "[vary]\nnotch = {}\n", ["[vary]: 0 fields", "at least one"]),
    "amplitude below 0": (GRID.replace("amplitude_mm = 2.2", "amplitude_mm = -1"), ["program.amplitude_mm = -1"]),
    "step of 0": (GRID.replace("cycles = 2", "step_mm = 0"), ["program.step_mm = 0", "above 0"]),
    "step of 0 on an axis": (
        GRID.replace('"notch.depth_mm" = [2.8', '"program.step_mm" = [0.0'), ["vary.program.step_mm = 0", "above 0"]),
    "step beyond the amplitude": (GRID.replace("cycles = 2", "step_mm = 9"), ["program.step_mm = 9", "amplitude_mm"]),
    "rig that is in no case": (
        GRID.replace('preset = "du2018"', 'preset = "du2018"\nfriction.sheath_N = -1'),
        ["friction.sheath_N = -1", "at least 0", "all other cases"]),
    "notch that no case has": (
        GRID.replace('preset = "du2018"', 'preset = "du2018"\nnotch.count = 0'), ["notch.count = 0", "at least 1"]),
    "rig outside": (GRID.replace('preset = "du2018"', 'file = "../rig.toml"'), ["rig.file = '../rig.toml'", "outside"]),
    "program outside": (
        GRID.replace(PROGRAM, '[program]\nfile = "/etc/passwd"\n'), ["program.file = '/etc/passwd'", "outside"]),
    "too many cases": (
        GRID.replace(VALUES, "{from = 1, to = 2, count = 1001}").replace(
            "[2.8, 2.825, 3.2]", "{from = 2, to = 2.9, count = 1001}"), ["1,002,001 cases", "at most 1,000,000"]),
    "too many values": (
        GRID.replace(VALUES, "{from = 1, to = 2, count = 1000000000}"), ["preload_N.count", "1,000,000"]),
    "too many points": (
        GRID.replace(VALUES, "{from = 1, to = 2}").replace("[2.8, 2.825, 3.2]", "{from = 2, to = 2.9}")
        + '[sample]\nmethod = "sobol"\ncount = 1073741824\n', ["sample.count = 1073741824", "10,000,000"]),
    "too many cycles": (GRID.replace("cycles = 2", "cycles = 20000"), ["program.cycles = 20000", "10,000"]),
    "too many samples": (GRID.replace("cycles = 2", "step_mm = 1e-9"), ["step_mm", "at most 2,000,000 samples"]),
    "too many designs": (
        GRID + "[pareto]\npopulation = 10000\ngenerations = 100000\n"
        "[pareto.objectives]\nfull_scale_angle_deg = 'max'\npeak_strain_percent = 'min'\n", ["designs", "1,000,000"]),
    "too many cases of a sensitivity": (GRID + "[sensitivity]\ncount = 524288\n", ["sensitivity.count", "1,000,000"]),
    "long text": (GRID.replace('"chain"', '"' + "x" * 5000 + '"'), ["engine = 'xxx", "...: expected one of"]),
    "deep": ("a." * 9999 + "b = 1", ["expected at most 16 parts"]),
    "unknown table": (GRID + "[varry]\nx = 1\n", ["varry", "expected one of"]),
    "unknown engine": (GRID.replace('"chain"', '"chian"'), ["engine = 'chian'", "chain"]),
    "unknown field": (GRID.replace("notch.depth_mm", "notch.deep_mm"), ["vary.notch.deep_mm", "notch.depth_mm"]),
    "no axis": (HEAD + PROGRAM, ["[vary]", "missing"]),
    "text for a number": (GRID.replace("[10, 15", "['ten', 15"), ["vary.preload_N = 'ten'", "a finite number"]),
    "half a notch": (GRID.replace('"notch.depth_mm" = [2.8', '"notch.count" = [2.5'), ["notch.count = 2.5", "whole"]),
    "twice the same": (GRID.replace("[10, 15", "[10, 10"), ["preload_N", "different"]),
    "range without count": (GRID.replace(VALUES, "{from = 1, to = 2}"), ["vary.preload_N.count", "missing"]),
    "range upside down": (GRID.replace(VALUES, "{from = 2, to = 1, count = 3}"), ["preload_N.to = 1", "above"]),
    "list beside a sample": (GRID + '[sample]\nmethod = "sobol"\ncount = 8\n', ["vary.preload_N", "[sample]"]),
    "unknown method": (GRID + '[sample]\nmethod = "random"\ncount = 8\n', ["sample.method = 'random'", "sobol"]),
    "unknown preset": (GRID.replace("du2018", "du2019"), ["du2019", "du2018"]),
    "no rig": (GRID.replace('preset = "du2018"', ""), ["[rig]", "preset or file"]),
    "no amplitude": (GRID.replace("amplitude_mm = 2.2", ""), ["program.amplitude_mm", "missing"]),
    "group of another engine": (
        GRID.replace('"chain"', '"analytic"') + '[quantities]\ngroups = ["bouc-wen"]\n', ["bouc-wen", "analytic"]),
    "list with a number of 6,000 digits": (
        GRID + "[quantities]\ngroups = [0x" + "f" * 5000 + "]\n", ["quantities.groups = ", "expected one of"]),
    "no power of two": (GRID + "[sensitivity]\ncount = 100\n", ["sensitivity.count = 100", "power of two"]),
    "one objective": (GRID + "[pareto.objectives]\nfull_scale_angle_deg = 'max'\n", ["objectives", "two"]),
    "unknown objective": (GRID + "[pareto.objectives]\nx = 'max'\ny = 'min'\n", ["pareto.objectives.x", "full_scale"]),
    "wall and inner diameter": (
        GRID.replace("preload_N", '"tube.wall_mm"').replace("notch.depth_mm", "tube.inner_diameter_mm"),
        ["vary.tube.wall_mm", "tube.inner_diameter_mm"]),
    "not TOML": ("schema = = 1", ["not TOML"]),
}  # fmt: skip


@pytest.mark.parametrize("name", BAD_FILES)
def test_bad_file_is_one_line_with_file_field_and_value(name, tmp_path, capsys):
    text, words = BAD_FILES[name]
    assert call(["study", str(study_file(tmp_path, text)), "--out", str(tmp_path / "out")]) == 2
    error = capsys.readouterr().err
    assert error.startswith(f"notchbend: {tmp_path / 's.toml'}: ")
    assert error.count("\n") == 1
    assert all(word in error for word in words), error
    assert not (tmp_path / "out").exists()


def test_missing_file_names_the_ready_studies(tmp_path, capsys):
    assert call(["study", str(tmp_path / "none.toml"), "--out", str(tmp_path / "out")]) == 2
    error = capsys.readouterr().err
    assert all(name in error for name in ("none.toml", "preload", "notch-geometry"))


@pytest.mark.parametrize("name", ["preload", "notch-geometry"])
def test_ready_studies_are_read_by_name(name):
    asked = read_study(Path(name))
    assert isinstance(plan_of(asked), Grid)
    assert asked.path == ready_studies()[name]
    assert evaluate("k", next(cases(asked, plan_of(asked).points())).inputs).status == "ok"


def test_nested_and_quoted_fields_are_the_same(tmp_path):
    plain = read_study(study_file(tmp_path, GRID.replace('"notch.depth_mm"', "notch.depth_mm")))
    assert plain.axes == read_study(study_file(tmp_path, GRID)).axes
