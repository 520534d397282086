"""The command line: results where asked for; bad input ends with one line and exit 2, nothing half-written."""

import json
from pathlib import Path

import numpy as np
import pytest

from hysteresis.record import Record, read_record, write_record
from studies.cli import call

SIDE = 'schema = 1\ntitle = "t"\nkind = "measured"\n[columns]\ndrive = "x"\nangle = "a"\n'
LOOP = "x,a\n" + "".join(f"{x},{20 * x + s}\n" for s, way in ((-1, 1), (1, -1)) for x in np.arange(-2, 2.1, 0.2)[::way])
TUBE = "[tube]\nouter_diameter_mm = 1.62\ninner_diameter_mm = 1.4\n"
NOTCH = '[notch]\nshape = "rectangular"\ncount = 5\ndepth_mm = 1.4\nwidth_mm = 0.8\nspacing_mm = 1.2\n'
BENCH = (
    "[rig]\njoints = 14\nmoment_arm_mm = 2.62\nflexure_stiffness_Nmm_per_rad = 520.0\ntendon_EA_N = 9000.0\n"
    "tendon_free_length_mm = 150.0\npitch_mm = 2.6\npreload_N = 20.0\n"
)


def complaint(capsys: pytest.CaptureFixture[str], *arguments: object) -> str:
    """The one line of a call that must fail."""
    assert call([str(a) for a in arguments]) == 2
    captured = capsys.readouterr()
    assert captured.err.startswith("notchbend: ")
    assert captured.err.count("\n") == 1
    assert "Traceback" not in captured.err
    return captured.err


BAD_RECORDS = {
    "no reversal": ("x,a\n0,0\n1,1\n2,2\n3,3\n", SIDE, ["loop.csv", "'x'", "never reverses"]),
    "missing column": ("x,b\n0,0\n1,1\n0,0\n", SIDE, ["loop.", "a", "b"]),
    "text in a number column": ("x,a\n0,0\n1,one\n0,0\n", SIDE, ["loop.csv:3", "a", "one"]),
    "NaN": ("x,a\n0,0\n1,nan\n0,0\n", SIDE, ["loop.csv:3", "a", "nan"]),
    "one sample": ("x,a\n0,0\n", SIDE, ["loop.csv", "one sample", "at least 3"]),
    "empty": ("", SIDE, ["loop.csv"]),
    "unknown unit": (LOOP, SIDE + '[drive]\nunit = "inch"\n', ["loop.toml", "unit", "inch", "mm"]),
    "not TOML": (LOOP, "schema = = 1", ["loop.toml"]),
    "inner above outer": (LOOP, SIDE + TUBE.replace("1.4", "1.7") + NOTCH, ["inner_diameter_mm", "1.7", "1.62"]),
    "notch deeper than the tube": (LOOP, SIDE + TUBE + NOTCH.replace("= 1.4", "= 1.7"), ["depth_mm", "1.7", "1.62"]),
    "negative stiffness": (LOOP, SIDE + BENCH.replace("520.0", "-520.0"), ["flexure_stiffness_Nmm_per_rad", "-520"]),
    "unknown preset": (LOOP, SIDE + '[rig]\npreset = "du2019"\n', ["du2019", "du2018"]),
    "missing theory": (LOOP, SIDE + '[kinematics]\nfile = "theory.csv"\n', ["theory.csv"]),
}


@pytest.mark.parametrize("case", BAD_RECORDS)
def test_bad_records_are_named_and_leave_nothing(case, tmp_path, capsys):
    csv, toml, words = BAD_RECORDS[case]
    (tmp_path / "loop.csv").write_text(csv)
    (tmp_path / "loop.toml").write_text(toml)
    error = complaint(capsys, "identify", tmp_path / "loop.csv", "--out", tmp_path / "out")
    assert all(word in error for word in words), error
    assert not (tmp_path / "out").exists()


def test_a_missing_record_is_named(tmp_path, capsys):
    error = complaint(capsys, "identify", tmp_path / "none.csv", "--out", tmp_path / "out")
    assert "none.csv" in error
    assert not (tmp_path / "out").exists()


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (["--preset", "du2019", "--amplitude", 2.2], ["preset = du2019", "du2018"]),
        (["--preset", "du2018", "--preload", -5, "--amplitude", 2.2], ["preload_N = -5"]),
        (["--preset", "du2018", "--preload", "taut", "--amplitude", 2.2], ["--preload", "taut"]),
        (["--preset", "du2018", "--amplitude", -1], ["amplitude_mm = -1"]),
        (["--preset", "du2018", "--amplitude", "nan"], ["amplitude_mm = nan"]),
        (["--preset", "du2018"], ["--amplitude", "--program"]),
        (["--amplitude", 2.2], ["--preset", "--rig"]),
        (["--preset", "du2018", "--amplitude", 2.2, "--engine", "magic"], ["magic", "multibody"]),
        (["--preset", "du2018", "--amplitude", 2.2, "--colour", "red"], ["--colour"]),
        (["--rig", "nowhere.toml", "--amplitude", 2.2], ["nowhere.toml"]),
        (["--preset", "du2018", "--program", "nowhere.csv"], ["nowhere.csv"]),
        (["--preset", "du2018", "--amplitude", 60, "--engine", "analytic"], ["du2018"]),
    ],
)
def test_bad_simulations_are_named_and_leave_nothing(arguments, words, tmp_path, capsys, monkeypatch):
    monkeypatch.chdir(tmp_path)
    error = complaint(capsys, "simulate", *arguments, "--out", tmp_path / "loop.csv")
    assert all(word in error for word in words), error
    assert list(tmp_path.iterdir()) == []


def test_bad_program_files_are_named(tmp_path, capsys):
    program = tmp_path / "program.csv"
    for text, words in (
        ("time_s\n0\n1\n", ["program.csv", "drive_mm"]),
        ("drive_mm\n0\none\n", ["program.csv:3", "drive_mm", "'one'"]),
        ("drive_mm,time_s\n0,0\n1,0\n", ["program.csv", "strictly increasing"]),
        ("drive_mm,time_s\n0,0\n1\n", ["program.csv:3", "fields"]),
        ("drive_mm\n0\ninf\n", ["program.csv:3", "finite"]),
    ):
        program.write_text(text)
        error = complaint(
            capsys, "simulate", "--preset", "du2018", "--program", program, "--out", tmp_path / "loop.csv"
        )
        assert all(word in error for word in words), error
    assert not (tmp_path / "loop.csv").exists()


def test_simulate_writes_a_record_that_reads_back(tmp_path, capsys):
    path = tmp_path / "deep" / "loop.csv"
    arguments = ["simulate", "--preset", "du2018", "--preload", "20", "--amplitude", "2.2", "--step", "0.2"]
    assert call([*arguments, "--engine", "multibody", "--out", str(path), "--json"]) == 0
    summary = json.loads(capsys.readouterr().out)
    assert summary["full_scale_deg"] == pytest.approx(45, abs=1)
    record = read_record(path)
    assert record.rig == {"preset": "du2018", "preload_N": 20.0}
    assert record.kind == "simulated"
    assert record.notches_deg.shape == (record.drive.size, 14)
    assert record.tension_a_N[0] == pytest.approx(20.0, rel=1e-6)
    again = tmp_path / "again.csv"
    assert call([*arguments, "--out", str(again), "--quiet"]) == 0
    assert again.read_bytes() == path.read_bytes()


def test_simulate_a_rig_file_with_a_program_at_a_rate(tmp_path, capsys):
    docs = (Path(__file__).parents[1] / "docs" / "first-steps.md").read_text()
    (tmp_path / "mine.toml").write_text(docs.split("```toml\n")[1].split("```")[0])
    (tmp_path / "drive.csv").write_text("time_s,drive_mm\n0,0\n1,0.5\n2,-0.5\n3,0.5\n")
    out = tmp_path / "results" / "loop.csv"
    arguments = ["simulate", "--rig", str(tmp_path / "mine.toml"), "--program", str(tmp_path / "drive.csv")]
    assert call([*arguments, "--engine", "analytic", "--out", str(out), "--quiet"]) == 0
    record = read_record(out)
    assert record.time_s.tolist() == [0, 1, 2, 3]
    assert Path(record.rig["file"]).resolve() == (tmp_path / "mine.toml").resolve()
    assert call(["simulate", "--preset", "du2018", "--amplitude", "1", "--rate", "2", "--engine", "analytic",
                 "--out", str(out), "--quiet"]) == 0  # fmt: skip
    assert read_record(out).time_s[-1] == pytest.approx(0.625)  # a quarter and one cycle at 2 Hz


def test_identify_writes_the_contract(tmp_path, capsys):
    x = np.concatenate([np.linspace(-2, 2, 41), np.linspace(2, -2, 41)[1:]])
    angle = 20 * x - np.clip(np.concatenate([np.arange(41), 40 - np.arange(2.0, 82, 2)])[:81] - 1, -1, 1)
    write_record(Record(drive=x, angle_deg=angle), tmp_path / "loop.csv")
    assert call(["identify", str(tmp_path / "loop.csv"), "--out", str(tmp_path / "fit"), "--json"]) == 0
    shown = json.loads(capsys.readouterr().out)
    stored = json.loads((tmp_path / "fit" / "identify.json").read_text())
    assert shown == stored
    assert stored["schema"] == 1
    assert stored["kinematics"] in ("analytic", "chain", "fitted")
    assert stored["model"] == "bouc-wen"
    assert {"records", "parameters", "train", "heldout", "evaluations", "seconds", "warnings"} <= set(stored)
    assert set(stored["heldout"]) == {"rmse_deg", "max_abs_deg", "max_rel_percent", "normalised"}
    assert set(stored["parameters"]["A"]) == {"value", "low", "high", "unit"}


def test_fetching_an_unknown_record_is_named(tmp_path, capsys):
    assert "nothing-of-that-name" in complaint(capsys, "data", "fetch", "nothing-of-that-name", "--out", tmp_path)


def test_report_without_results_is_named(tmp_path, capsys):
    assert "run.json" in complaint(capsys, "report", tmp_path)


def test_help_lists_the_commands(capsys):
    assert call(["--help"]) == 0
    text = capsys.readouterr().out
    assert all(name in text for name in ("run", "simulate", "validate", "identify", "report", "data"))
