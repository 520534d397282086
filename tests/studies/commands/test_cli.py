"""The command line: results where asked for; bad input ends with one line and exit 2, nothing half-written."""

import functools
import io
import json
import re
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
from how_made import printed
from rich.console import Console

from fem_models.rig import preset
from hysteresis.laws.bouc_wen import BoucWen, hysteresis
from hysteresis.plain import from_plain
from hysteresis.records.record import Record
from hysteresis.records.record_file import read_record, write_record
from studies import engines
from studies.commands import comparison, tables
from studies.commands.cli import call
from studies.fetch import CATALOGUE
from studies.report import write_report
from validation.joints import models

SIDE = 'schema = 1\ntitle = "t"\nkind = "measured"\n[columns]\ndrive = "x"\nangle = "a"\n'
LOOP = "x,a\n" + "".join(f"{x},{20 * x + s}\n" for s, way in ((-1, 1), (1, -1)) for x in np.arange(-2, 2.1, 0.2)[::way])
WAY = [*np.arange(-2, 2, 0.2), *np.arange(2, -2, -0.2)]
STUCK = "x,a\n" + "".join(f"{x},{20 * x if cycle < 2 else 7}\n" for cycle in range(3) for x in WAY)
FAINT = "x,a\n" + "".join(f"{x},{x * 1e-200}\n" for _ in range(3) for x in WAY)
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
    "beyond all measure": ("x,a\n0,0\n1,-2e9\n0,0\n", SIDE, ["loop.csv:3", "'a' = -2e9", "1e+09"]),
    "sensor stuck in the last cycle": (STUCK, SIDE, ["loop.csv", "angle = 7 deg", "held out", "changes"]),
    "angle beyond all sensors": (FAINT, SIDE, ["loop.csv", "angle = ", "changes"]),
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
    "line",
    [
        "identify circle.csv --out out",
        "trace circle.csv --out out",
        "trace loop.csv --reference circle.csv --out out",
        "separate circle.csv --out out",
        "compensate circle.csv --reference loop.csv --out out.csv",
        "compensate loop.csv --reference circle.csv --out out.csv",
        "simulate --preset du2018 --program circle.csv --out out.csv",
    ],
)
def test_a_file_that_is_a_link_in_a_circle_is_named(line, tmp_path, capsys, monkeypatch):
    """Its place is compared with those of other files before it is read; ``Path.resolve`` made that a traceback."""
    monkeypatch.chdir(tmp_path)
    Path("loop.csv").write_text(LOOP.replace("x,a", "drive_mm,angle_deg"))
    Path("circle.csv").symlink_to("circle.csv")
    assert "circle.csv: Too many levels of symbolic links: expected " in complaint(capsys, *line.split())
    assert sorted(path.name for path in tmp_path.iterdir()) == ["circle.csv", "loop.csv"]


@pytest.mark.parametrize("command", ["identify", "trace", "separate"])
def test_a_record_that_is_given_twice_is_refused(command, tmp_path, capsys):
    (tmp_path / "loop.csv").write_text(LOOP)
    (tmp_path / "loop.toml").write_text(SIDE)
    again = tmp_path / ".." / tmp_path.name / "loop.csv"
    error = complaint(capsys, command, tmp_path / "loop.csv", again, "--out", tmp_path / "out")
    assert "loop.csv: given twice: expected different records" in error
    assert not (tmp_path / "out").exists()


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (["--preset", "du2019", "--amplitude", 2.2], ["preset = du2019", "du2018"]),
        (["--preset", "du2018", "--preload", -5, "--amplitude", 2.2], ["preload_N = -5"]),
        (["--preset", "du2018", "--preload", 1400, "--amplitude", 2.2], ["below 1315", "tube buckles"]),
        (["--preset", "zhang2026", "--preload", 600, "--amplitude", 1], ["at most 550", "stretched by 10 %"]),
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
        (["--preset", "du2018", "--amplitude", "1e9"], ["amplitude_mm, step_mm, cycles = 1e+09, 0.1, 1", "2,000,000"]),
        (["--preset", "du2018", "--amplitude", "1e300"], ["amplitude_mm", "2,000,000"]),
        (["--preset", "du2018", "--amplitude", "1e300", "--step", "1e-300"], ["step_mm", "2,000,000"]),
        (["--preset", "du2018", "--amplitude", 2, "--step", "1e-9"], ["step_mm", "1e-09", "2,000,000"]),
        (["--preset", "du2018", "--amplitude", 2, "--cycles", 100_000_000], ["cycles", "100000000", "2,000,000"]),
        (["--preset", "du2018", "--amplitude", 2, "--rate", 1, "--cycles", 10**400], ["cycles", "2,000,000"]),
        (["--preset", "du2018", "--amplitude", 2, "--rate", 1, "--step", 0.1], ["--rate 1", "--step 0.1"]),
        *(
            (["--preset", "du2018", "--program", "drive.csv", option, 1], [f"{option} 1", "--program drive.csv"])
            for option in ("--amplitude", "--rate", "--step", "--cycles")
        ),
        (["--preset", "du2018", "--amplitude", "1e300", "--step", "1e300"], ["drive_mm = 1e+300", "1e+09"]),
        (["--preset", "du2018", "--amplitude", "1e300", "--rate", 1], ["drive_mm = 1e+300", "1e+09"]),
        (["--preset", "du2018", "--amplitude", 2, "--rate", "1e-320"], ["rate_Hz = ", "1e-9"]),
        *(
            (["--preset", "du2018", "--amplitude", "1e4", "--step", "1e4", "--engine", engine], ["du2018"])
            for engine in ("multibody", "chain", "analytic")
        ),
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
        ("drive_mm\n0\n\n1\n", ["program.csv:3", "0 fields"]),
        ("drive_mm\n0\n-2e9\n", ["program.csv:3", "'drive_mm' = -2e9", "1e+09"]),
        ("drive_mm,drive_mm\n0,0\n1,1\n", ["program.csv:1", "'drive_mm' occurs twice"]),
        ("drive_mm\n0\n", ["program.csv", "at least 2"]),
    ):
        program.write_text(text)
        error = complaint(
            capsys, "simulate", "--preset", "du2018", "--program", program, "--out", tmp_path / "loop.csv"
        )
        assert all(word in error for word in words), error
    assert not (tmp_path / "loop.csv").exists()


def test_a_binary_program_file_is_named(tmp_path, capsys):
    (tmp_path / "program.csv").write_bytes(b"drive_mm\n\xff\xfe\n")
    program = ["--program", tmp_path / "program.csv"]
    error = complaint(capsys, "simulate", "--preset", "du2018", *program, "--out", tmp_path / "loop.csv")
    assert "program.csv: byte 9 is not UTF-8" in error


def first_steps_rig(folder: Path, text: str = "") -> Path:
    docs = (Path(__file__).parents[3] / "docs" / "guide" / "first-steps.md").read_text()
    (folder / "mine.toml").write_text(docs.split("```toml\n")[1].split("```")[0] + text)
    return folder / "mine.toml"


@pytest.mark.parametrize("key", ["tendon", "tendon_a", "tendon_b", "tube", "preload_N", "name"])
@pytest.mark.parametrize("value", ["-3", "[]", "1979-05-27", "true", "1" + "0" * 400])
def test_odd_values_in_a_rig_file_are_named(key, value, tmp_path, capsys):
    rig = first_steps_rig(tmp_path)
    table = r"(?ms)^\[" + key + r"\].*?(?=^\[|\Z)|^" + key + r" = .*?$"
    rig.write_text(f"{key} = {value}\n" + re.sub(table, "", rig.read_text()))
    error = complaint(capsys, "simulate", "--rig", rig, "--amplitude", 1, "--out", tmp_path / "loop.csv")
    assert "mine.toml" in error
    assert key in error


def test_inputs_are_never_replaced(tmp_path, capsys, monkeypatch):
    monkeypatch.chdir(tmp_path)
    rig = first_steps_rig(tmp_path)
    Path("drive.csv").write_text("drive_mm\n0\n1\n0\n")
    Path("linked.toml").hardlink_to(rig)
    Path("other.toml").write_text(rig.read_text())
    before = {path.name: path.read_bytes() for path in tmp_path.iterdir()}
    calls = [
        (["--rig", "mine.toml", "--amplitude", 1, "--out", "mine.csv"], ["mine.csv", "input mine.toml"]),
        (["--rig", "mine.toml", "--amplitude", 1, "--out", tmp_path / "mine.csv"], ["mine.csv", "input mine.toml"]),
        (["--rig", "mine.toml", "--amplitude", 1, "--out", "linked.csv"], ["linked.csv", "input mine.toml"]),
        (["--rig", "mine.toml", "--amplitude", 1, "--out", "other.csv"], ["other.toml", "not the sidecar of a record"]),
        (["--preset", "du2018", "--program", "drive.csv", "--out", "drive.csv"], ["drive.csv", "input drive.csv"]),
    ]
    for arguments, words in calls:
        error = complaint(capsys, "simulate", *arguments, "--engine", "analytic")
        assert all(word in error for word in words), error
    Path("identify.csv").write_text("drive_mm,angle_deg\n0,0\n1,1\n0,0\n")
    assert "identify.csv" in complaint(capsys, "identify", "identify.csv", "--out", ".")
    Path("identify.csv").unlink()
    assert {path.name: path.read_bytes() for path in tmp_path.iterdir()} == before


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
    first_steps_rig(tmp_path)
    (tmp_path / "drive.csv").write_text("time_s,drive_mm\n0,0\n1,0.5\n2,-0.5\n3,0.5\n")
    out = tmp_path / "results" / "loop.csv"
    arguments = ["simulate", "--rig", str(tmp_path / "mine.toml"), "--program", str(tmp_path / "drive.csv")]
    assert call([*arguments, "--engine", "analytic", "--out", str(out), "--quiet"]) == 0
    record = read_record(out)
    assert record.time_s.tolist() == [0, 1, 2, 3]
    assert Path(record.rig["file"]).read_bytes() == (tmp_path / "mine.toml").read_bytes()
    assert Path(record.rig["file"]).parent == out.parent.resolve()
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
    page = write_report(tmp_path / "fit").read_text()
    given = ["identify", tmp_path / "loop.csv", "--out", tmp_path / "fit"]
    printed(tmp_path / "fit" / "identify.json", page, given)


@pytest.mark.slow
def test_identify_takes_several_records(tmp_path, capsys):
    x = np.concatenate([np.linspace(-2, 2, 41), np.linspace(2, -2, 41)[1:]] * 2)
    for name, zero in (("a", 0.0), ("b", 0.5)):
        angle = 20 * x + hysteresis(20 * x, BoucWen(-0.9, 0.3, 0.1, 1.5)) + zero
        write_record(Record(drive=x, angle_deg=angle), tmp_path / f"{name}.csv")
    files = [str(tmp_path / f"{name}.csv") for name in "ab"]
    assert call(["identify", *files, "--out", str(tmp_path / "fit"), "--method", "cma", "--json"]) == 0
    stored = json.loads((tmp_path / "fit" / "identify.json").read_text())
    assert stored["records"] == files
    assert stored["method"] == "cma"
    assert stored["parameters"]["zero_deg_record_2"]["value"] == pytest.approx(0.5, abs=0.01)
    assert sorted(file.name for file in (tmp_path / "fit").iterdir()) == [
        "identify-2.csv", "identify.csv", "identify.json", "identify.png"
    ]  # fmt: skip
    capsys.readouterr()
    (tmp_path / "identify-2.csv").write_text((tmp_path / "b.csv").read_text())
    error = complaint(capsys, "identify", files[0], tmp_path / "identify-2.csv", "--out", tmp_path)
    assert "would replace it" in error


def test_identify_runs_as_its_page_prints_it(tmp_path):
    (tmp_path / "my loop.csv").write_text(LOOP.replace("x,a", "drive_mm,angle_deg"))
    out = tmp_path / "fit"
    given = ["identify", tmp_path / "my loop.csv", "--law", "bouc-wen", "--method", "least-squares", "--out", out]
    assert call([*map(str, given), "--quiet"]) == 0
    stored = json.loads((out / "identify.json").read_text())
    words = printed(out / "identify.json", write_report(out).read_text(), given)
    assert call([*words, "--quiet"]) == 0
    again = json.loads((out / "identify.json").read_text())
    assert {**again, "seconds": 0, "made": 0} == {**stored, "seconds": 0, "made": 0}


def test_fetching_an_unknown_record_is_named(tmp_path, capsys):
    assert "nothing-of-that-name" in complaint(capsys, "data", "fetch", "nothing-of-that-name", "--out", tmp_path)


def test_report_without_results_is_named(tmp_path, capsys):
    assert "run.json" in complaint(capsys, "report", tmp_path)


def test_help_lists_the_commands(capsys):
    assert call(["--help"]) == 0
    text = capsys.readouterr().out
    assert all(name in text for name in ("run", "simulate", "validate", "identify", "report", "data"))


RATE = ["simulate", "--preset", "du2018", "--amplitude", "1", "--rate", "2", "--engine", "chain"]
NOTE = "quasi-static: the rate sets the times only"


def test_a_rate_that_sets_the_times_only_is_said(tmp_path, capsys):
    out = ["--out", str(tmp_path / "loop.csv")]
    assert call([*RATE, *out]) == 0
    assert NOTE in capsys.readouterr().out.splitlines()
    assert call([*RATE, *out, "--quiet"]) == 0
    assert capsys.readouterr().out == ""
    assert call([*RATE, *out, "--json"]) == 0
    json.loads(capsys.readouterr().out)
    assert call([*RATE[:5], "--engine", "chain", *out]) == 0
    assert NOTE not in capsys.readouterr().out


@pytest.mark.parametrize("timed", ["[drag]\njoint_Nmm_s_per_rad = 1.0", "[superelastic]\nheating_time_s = 1.0"])
def test_a_rate_that_matters_is_not_said_to_set_the_times_only(tmp_path, capsys, timed):
    tables = preset("du2018").to_dict()
    lines = [f"preload_N = {tables['preload_N']}"]
    for name in ("tube", "notch", "material", "tendon_a", "tendon_b", "wheel", "friction"):
        lines += [f"[{name}]", *(f"{key} = {json.dumps(value)}" for key, value in tables[name].items())]
    (tmp_path / "timed.toml").write_text("\n".join([*lines, timed]))
    given = ["simulate", "--rig", str(tmp_path / "timed.toml"), "--amplitude", "1", "--engine", "chain"]
    assert call([*given, "--rate", "2", "--out", str(tmp_path / "loop.csv")]) == 0
    assert NOTE not in capsys.readouterr().out
    assert call([*given, "--out", str(tmp_path / "other.csv")]) != 0  # without times
    assert "expected a load program with time_s" in capsys.readouterr().err


def test_chain_and_multibody_give_the_same_loop(tmp_path):
    angle = {}
    for engine in ("chain", "multibody"):
        out = tmp_path / f"{engine}.csv"
        arguments = ["--preset", "du2018", "--amplitude", "2.2", "--step", "0.2", "--engine", engine]
        assert call(["simulate", *arguments, "--out", str(out), "--quiet"]) == 0
        angle[engine] = read_record(out).angle_deg
    assert np.abs(angle["chain"] - angle["multibody"]).max() < 0.05 * 2.2  # 5 % of the loop's width of 2.2 deg


@pytest.mark.slow
def test_identify_shows_the_fit_in_words(tmp_path, capsys):
    (tmp_path / "loop.csv").write_text(LOOP.replace("x,a", "drive_mm,angle_deg"))
    assert call(["identify", str(tmp_path / "loop.csv"), "--out", str(tmp_path / "fit")]) == 0
    shown = capsys.readouterr().out
    title, rest = shown.split("kinematics fitted\n", 1)
    assert " ".join(title.split()).startswith("asymmetric Bouc-Wen on ")
    assert "law: asymmetric Bouc-Wen: it " in rest  # the reason is a matter of rounding: the loop has no noise
    words = [line for line in rest.splitlines() if str(tmp_path) not in line]
    assert max(map(len, words)) <= 80  # no tables of f


def test_a_drive_that_the_rig_cannot_follow_is_named_with_its_record(tmp_path, capsys):
    (tmp_path / "loop.csv").write_text(
        "x,a\n" + "".join(f"{x},{x / 2}\n" for x in [*range(-66, 67), *range(65, -67, -1)])
    )
    (tmp_path / "loop.toml").write_text(SIDE + '[rig]\npreset = "du2018"\n')
    error = complaint(capsys, "identify", tmp_path / "loop.csv", "--out", tmp_path / "out")
    assert f"{tmp_path / 'loop.csv'}: drive_mm = -66: expected" in error
    assert not (tmp_path / "out").exists()


def test_errors_of_the_program_do_not_pass_for_bad_input(tmp_path, monkeypatch):
    def broken(rig, program):
        raise ValueError("a bug")

    monkeypatch.setitem(engines.ENGINES, "chain", broken)
    with pytest.raises(ValueError, match="a bug"):
        call([*RATE, "--out", str(tmp_path / "loop.csv")])


def test_interruption_is_one_line(tmp_path, capsys, monkeypatch):
    def interrupted(rig, program):
        raise KeyboardInterrupt

    monkeypatch.setitem(engines.ENGINES, "chain", interrupted)
    assert call([*RATE, "--out", str(tmp_path / "loop.csv")]) == 130
    said = "notchbend: interrupted: no file is half-written, the same command starts again\n"
    assert capsys.readouterr().err == said
    assert list(tmp_path.iterdir()) == []


def test_every_command_takes_seed_quiet_and_json(capsys):
    commands = [["run"], ["simulate"], ["validate"], ["identify"], ["report"], ["data", "list"], ["data", "fetch"]]
    for command in commands:
        assert call([*command, "--help"]) == 0
        text = capsys.readouterr().out
        assert all(option in text for option in ("--seed", "--quiet", "--json")), command


def test_validate_puts_models_side_by_side(tmp_path, capsys, monkeypatch):
    coarse = functools.partial(models.compare_models, angles_deg=(5.0, 10.0), refinement=0.4)
    monkeypatch.setattr(comparison, "compare_models", coarse)
    monkeypatch.setattr(comparison, "PRELOADS_N", (20.0,))
    assert call(["validate", "--out", str(tmp_path), "--json", "--seed", "1"]) == 0
    shown = json.loads(capsys.readouterr().out)
    assert shown == json.loads((tmp_path / "validate.json").read_text())
    assert shown["schema"] == 1
    assert shown["rigs"][0]["preload_N"] == 20.0
    names = ["solid", "beam", "beam with roots", "reduced bodies", "beams", "multibody", "chain"]
    assert [row["name"] for row in shown["models"]["models"]] == names
    for row in shown["models"]["models"]:
        assert [bent["angle_deg"] > 0 for bent in row["bent"]] == [True, True]
        assert row["seconds"] > 0
    printed(
        tmp_path / "validate.json", write_report(tmp_path).read_text(), ["validate", "--out", tmp_path, "--seed", 1]
    )
    found = from_plain(comparison.Models, shown["models"])
    for table in (tables.models_table(found), tables.bent_table(found)):
        text = on_terminal(table)
        assert all(re.search(rf"^{name} ", text, re.M) for name in names)
        assert len(text.splitlines()) == 2 + len(names)  # no cell needs a second line
    engines = from_plain(comparison.Validation, shown).rigs
    assert "element_error_percent" in on_terminal(tables.engines_table(engines, of_the_paper=True))
    assert "element_error_percent" not in on_terminal(tables.engines_table(engines, of_the_paper=False))


def on_terminal(table) -> str:
    """A table on a terminal of 80 columns: no cell of it is cut."""
    console = Console(file=io.StringIO(), width=80)
    console.print(table)
    text = console.file.getvalue()
    assert "…" not in text
    assert max(map(len, text.splitlines())) <= 80
    return text


def test_no_cell_of_a_table_is_cut():
    """Names of records and effects had ended in an ellipsis."""
    table = tables.spaced_table("name", *("value of some quantity" for _ in range(6)))
    table.add_row("surgical-manipulator-conf0-60deg-b", *("1234.5678" for _ in range(6)))
    assert "surgical-manipulator-conf0-60deg-b" in on_terminal(table)


def test_names_of_records_are_whole_where_they_are_piped(capsys):
    assert call(["data", "list"]) == 0
    rows = [line.split("\t") for line in capsys.readouterr().out.splitlines()]
    assert [row[0] for row in rows][: len(CATALOGUE)] == [*CATALOGUE]
    assert {len(row) for row in rows} == {3}


def test_names_of_records_are_whole_on_a_terminal(capsys, monkeypatch):
    monkeypatch.setattr(sys.stdout, "isatty", lambda: True)
    monkeypatch.setenv("COLUMNS", "80")
    assert call(["data", "list"]) == 0
    shown = capsys.readouterr().out
    assert all(re.search(rf"^{re.escape(name)}\b", shown, re.M) for name in CATALOGUE)
    assert all(entry.citation in shown for entry in CATALOGUE.values())


def test_a_missing_mesher_is_named(tmp_path, capsys, monkeypatch):
    (tmp_path / "gmsh.py").write_text("raise OSError('libGLU.so.1: cannot open shared object file')")
    monkeypatch.delitem(sys.modules, "gmsh", raising=False)
    monkeypatch.syspath_prepend(tmp_path)
    error = complaint(capsys, "validate", "--out", tmp_path / "out")
    assert "gmsh cannot be imported: libGLU.so.1" in error
    assert not (tmp_path / "out").exists()


def test_data_list_as_json_and_as_names(capsys):
    assert call(["data", "list", "--json", "--seed", "1"]) == 0
    assert [entry["name"] for entry in json.loads(capsys.readouterr().out)["records"]] == list(CATALOGUE)
    assert call(["data", "list", "--quiet"]) == 0
    assert capsys.readouterr().out.splitlines() == list(CATALOGUE)


@pytest.mark.slow
def test_only_the_multibody_engine_needs_exudyn(tmp_path):
    """A process in which neither Exudyn nor pyvista can be imported."""
    (tmp_path / "loop.csv").write_text(LOOP.replace("x,a", "drive_mm,angle_deg"))
    code = f"""
import sys
sys.modules["exudyn"] = sys.modules["pyvista"] = sys.modules["gmsh"] = None
from studies.commands.cli import call
assert call(["data", "list", "--quiet"]) == 0
assert call(["identify", "loop.csv", "--out", "fit", "--quiet"]) == 0
assert call({[*RATE, "--out", "chain.csv", "--quiet"]}) == 0
assert call(["report", "."]) == 2
assert call({[*RATE[:-1], "multibody", "--out", "multibody.csv"]}) == 2
assert call(["run", "--out", "run"]) == 2
"""
    root = str(Path(__file__).parents[3])
    done = subprocess.run(
        [sys.executable, "-c", f"import sys; sys.path.insert(0, {root!r})" + code],
        cwd=tmp_path, capture_output=True, text=True, check=False,
    )  # fmt: skip
    assert done.returncode == 0, done.stderr
    lines = done.stderr.splitlines()
    assert len(lines) == 3
    assert "run.json" in lines[0]
    assert all(line.startswith("notchbend: exudyn cannot be imported: ") for line in lines[1:])
    assert sorted(path.name for path in tmp_path.iterdir()) == ["chain.csv", "chain.toml", "fit", "loop.csv"]


def test_a_missing_system_library_is_named(tmp_path, capsys, monkeypatch):
    (tmp_path / "exudyn.py").write_text(  # what the real one says, shortened
        "raise ImportError('Tried, in order:\\n  .exudynCPP  ->  libGL.so.1: cannot open shared object file')"
    )
    monkeypatch.delitem(sys.modules, "exudyn", raising=False)
    monkeypatch.syspath_prepend(tmp_path)
    with pytest.raises(engines.MissingError, match=r"the system's libGL\.so\.1 is missing"):
        engines.require_exudyn()
    error = complaint(capsys, "validate", "--out", tmp_path / "out")
    assert "libGL.so.1" in error
