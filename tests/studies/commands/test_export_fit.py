"""``notchbend export FIT``: the files, and what is refused."""

import json
import math

import numpy as np
import pytest
from firmware_fits import stored_fit

import notchbend as nb
from hysteresis.own import is_own
from studies.commands.cli import call

C = ["export", "--to", "c", "--quiet", "--out"]


@pytest.fixture
def fit(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    return stored_fit(tmp_path / "fit/identify.json")


def test_writes_the_files_of_a_folder_or_a_file(fit, capsys):
    assert call([*C, "made", "fit"]) == 0
    assert call([*C, "again", "fit/identify.json", "--json"]) == 0
    said = json.loads(capsys.readouterr().out)
    assert said["files"] == [f"again/compensator{end}" for end in (".c", ".h", "_test.csv")]
    for name in ("compensator.c", "compensator.h", "compensator_test.csv"):
        made, again = (fit.parents[1] / folder / name for folder in ("made", "again"))
        assert made.read_bytes() == again.read_bytes()
        assert is_own(made)


def test_name_is_that_of_files_and_functions(fit):
    assert call([*C, "made", "fit", "--name", "Wrist_2"]) == 0
    made = fit.parents[1] / "made"
    assert sorted(one.name for one in made.iterdir()) == ["Wrist_2.c", "Wrist_2.h", "Wrist_2_test.csv"]
    text = (made / "Wrist_2.c").read_text()
    assert "Wrist_2_step(Wrist_2_state *state, Wrist_2_real reference_deg)" in text
    assert "#ifdef WRIST_2_MAIN" in text
    assert "notchbend_" not in text
    assert call([*C, "made", "fit", "--name", "NOTCHBEND_x"]) == 0  # one that holds the name in the templates
    assert "NOTCHBEND_x_step(NOTCHBEND_x_state *state," in (made / "NOTCHBEND_x.c").read_text()


def test_writes_a_table(fit):
    assert call(["export", "fit", "--to", "table", "--out", "made", "--quiet"]) == 0
    (made,) = (fit.parents[1] / "made").iterdir()
    assert made.name == "compensator_table.csv"
    assert is_own(made)


def test_files_of_another_hand_are_kept(fit, capsys):
    (fit.parents[1] / "made").mkdir()
    mine = fit.parents[1] / "made/compensator.h"
    mine.write_text("/* compensator: made by hand */\n")
    assert call([*C, "made", "fit"]) == 2
    assert "compensator.h: not written by notchbend" in capsys.readouterr().err
    assert [one.name for one in mine.parent.iterdir()] == ["compensator.h"]
    assert call([*C, "made", "fit", "--force"]) == 0
    assert call([*C, "made", "fit"]) == 0


def put(path, keys, value):
    values = json.loads(path.read_text())
    inner = values
    for key in keys[:-1]:
        inner = inner[key]
    inner[keys[-1]] = value
    path.write_text(json.dumps(values))


STRAIGHT = [float(k) for k in range(257)]


@pytest.mark.parametrize(
    ("keys", "value", "said"),
    [
        (("law", "f", "angle_deg"), [*STRAIGHT[:-1], 3.0], "flat or reverses"),
        (("law", "f", "angle_deg"), [*STRAIGHT[:-1], math.nan], "identify.json"),
        (("law", "f", "drive"), STRAIGHT[::-1], "identify.json"),
        (("law", "values"), [[0.0, 0.0]], "expected rows of 5 numbers"),
        (("law", "values"), [[0.0, 0.0, 0.0, -3.0, 0.0]], "identify.json"),
        (("law", "values"), [[0.0, 0.0, 2000.0, 0.0, 0.0]], "identify.json"),
        (("law", "values"), [], "identify.json"),
        (("law", "name"), "preisach", "name: 'preisach': expected one of"),
        (("first_drive",), 17.0, "first_drive = 17: expected within f"),
        (("drive_unit",), "inch", "drive_unit: 'inch'"),
        (("schema",), 2, "schema = 2: expected 1"),
        (("records",), 3, "records: 3: expected a list"),
    ],
)
def test_a_spoiled_fit_is_refused_in_one_line(fit, capsys, keys, value, said):
    put(fit, keys, value)
    refused([*C, "made", "fit"], said, fit, capsys)


@pytest.mark.parametrize(
    ("command", "said"),
    [
        ([*C, "made"], "--to c: fit missing: expected the identify.json"),
        ([*C, "made", "none.json"], "none.json: No such file or directory"),
        ([*C, "made", "."], "identify.json: No such file"),
        ([*C, "made", "fit", "--preset", "du2018"], "--preset du2018: with --to c: of a rig"),
        ([*C, "made", "fit", "--amplitude", "2"], "--amplitude 2.0: with --to c: of a rig"),
        ([*C, "made", "fit", "--name", "2nd"], "--name '2nd': expected a letter"),
        ([*C, "made", "fit", "--name", "a/b"], "--name 'a/b': expected a letter"),
        ([*C, "fit/identify.json", "fit"], "identify.json: is a file: expected a folder"),
        (["export", "--to", "mujoco", "--out", "a.xml", "fit"], "FIT fit: with --to mujoco: of a fit"),
        (["export", "--to", "mujoco", "--out", "a.xml", "--name", "b"], "--name b: with --to mujoco"),
    ],
)
def test_a_command_that_makes_no_sense_is_refused(fit, capsys, command, said):
    refused(command, said, fit, capsys)


def refused(command, said, fit, capsys):
    before = fit.read_bytes()
    assert call(command) == 2
    error = capsys.readouterr().err
    assert said in error
    assert error.startswith("notchbend: ")
    assert error.count("\n") == 1
    assert [one.name for one in fit.parents[1].iterdir()] == ["fit"]
    assert fit.read_bytes() == before


def test_of_a_record_it_is_identified_first(tmp_path, monkeypatch, capsys):
    """The fit is quick here: what a record is identified by is tested with ``identify``."""
    from hysteresis.fitting.settings import IdentifySettings

    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr(
        "studies.export.IdentifySettings", lambda **given: IdentifySettings(population=8, generations=3)
    )
    drive = np.concatenate([np.linspace(0, 2, 30), np.linspace(2, -2, 60)[1:], np.linspace(-2, 2, 60)[1:]])
    angle = 10 * drive - np.sign(np.gradient(drive)) * 0.3
    (tmp_path / "bench.csv").write_text(
        "drive_mm,angle_deg\n" + "".join(f"{x:.6f},{y:.6f}\n" for x, y in zip(drive, angle, strict=True))
    )
    assert call(["export", "bench.csv", "--to", "c", "--out", "made", "--quiet"]) == 0
    names = {"compensator.c", "compensator.h", "compensator_test.csv", "identify.json", "identify.csv"}
    assert {one.name for one in (tmp_path / "made").iterdir()} == names
    assert "bench.csv" in (tmp_path / "made/compensator.h").read_text()
    files = nb.export(nb.identify("bench.csv", settings=IdentifySettings(population=8, generations=3)), "again", to="c")
    assert {one.name for one in files} == names
    for rig, to in (("du2018", "c"), (nb.read_record("bench.csv"), "mujoco")):
        with pytest.raises(ValueError, match="expected a"):
            nb.export(rig, "none", to=to)
