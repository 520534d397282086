"""The sidecar of a CSV from the bench: what is understood, what is refused, and that nothing is overwritten."""

import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from fem_models.analytic import theory_curve
from fem_models.rig import preset
from hysteresis.records.record_file import read_record
from studies.commands.cli import call
from studies.own_rig.loops import fatigue_amplitude_mm
from studies.own_rig.new_record import unlike_loops, without_geometry
from studies.own_rig.strain import drive_to_angle_mm

WAY = np.concatenate([np.linspace(0, 2, 21), *[np.linspace(2, -2, 41)[1:], np.linspace(-2, 2, 41)[1:]] * 2])
LAG = np.concatenate([np.full(21, -0.5), *[np.full(40, 0.5), np.full(40, -0.5)] * 2])


@pytest.fixture
def bench(tmp_path, monkeypatch):
    """A folder; and a function that writes a loop of the rig at 20 N there in the way of a logger."""
    monkeypatch.chdir(tmp_path)
    angle = theory_curve(preset("du2018"), WAY).angle_deg + LAG

    def write(name="bench.csv", *, header="drive_mm,angle_deg", sign=1.0, decimal=".", first="", factor=1.0):
        delimiter = ";" if ";" in header else ","
        values = zip(WAY, factor * sign * angle, strict=True)
        rows = [f"{x:.4f}{delimiter}{y:.4f}".replace(".", decimal) for x, y in values]
        (tmp_path / name).write_text(first + "\n".join([header, *rows]) + "\n")
        return name

    return write


def new(capsys, *arguments):
    """The JSON of a `record new` that must work."""
    assert call(["record", "new", *map(str, arguments), "--json"]) == 0, capsys.readouterr().err
    return json.loads(capsys.readouterr().out)


def complaint(capsys, *arguments):
    assert call(["record", "new", *map(str, arguments)]) == 2
    error = capsys.readouterr().err
    assert error.count("\n") == 1
    return error


def test_a_bare_csv_gets_a_sidecar_and_stays_as_it_is(bench, tmp_path, capsys):
    before = (tmp_path / bench()).read_bytes()
    found = new(capsys, "bench.csv", "--preset", "du2018", "--preload", 20)
    assert (tmp_path / "bench.csv").read_bytes() == before
    assert found["columns"] == {"drive": "drive_mm", "angle": "angle_deg"}
    assert (found["cycles"], found["approach"], found["samples"]) == (2, True, WAY.size)
    assert found["step"] == pytest.approx(0.1)
    assert found["loop_width_deg"] == pytest.approx(1.0, abs=1e-3)  # twice the lag
    full = theory_curve(preset("du2018"), [2.0]).angle_deg[0]
    assert found["rig_angle_range_deg"] == pytest.approx([-full, full])
    assert found["remarks"] == []
    record = read_record("bench.csv")
    assert record.rig == {"preset": "du2018", "preload_N": 20.0}
    assert record.kind == "measured"


def test_a_sidecar_that_exists_is_kept(bench, tmp_path, capsys):
    bench()
    (tmp_path / "bench.toml").write_text("schema = 1\n")
    assert "bench.toml: exists" in complaint(capsys, "bench.csv")
    assert (tmp_path / "bench.toml").read_text() == "schema = 1\n"
    bench("other.csv")
    (tmp_path / "copy.csv").write_text("mine")
    assert "copy.csv: exists" in complaint(capsys, "other.csv", "--out", "copy.csv")
    assert (tmp_path / "copy.csv").read_text() == "mine"


def test_semicolons_comments_and_decimal_commas_get_a_clean_copy(bench, tmp_path, capsys):
    bench(header="stage travel [mm];theta (deg)", decimal=",", first="# logger 3\n% of the bench\n")
    before = (tmp_path / "bench.csv").read_bytes()
    found = new(capsys, "bench.csv")
    assert (tmp_path / "bench.csv").read_bytes() == before
    assert sorted(path.name for path in tmp_path.iterdir()) == ["bench-record.csv", "bench-record.toml", "bench.csv"]
    assert (found["record"], found["copied"]) == ("bench-record.csv", True)
    assert found["columns"] == {"drive": "stage travel [mm]", "angle": "theta (deg)"}
    assert (found["delimiter"], found["comment_lines"], found["decimal_comma"]) == ("semicolon", 2, True)
    np.testing.assert_allclose(read_record("bench-record.csv").drive, WAY, atol=5e-5)
    assert "bench-record.toml: exists" in complaint(capsys, "bench.csv")
    assert new(capsys, "bench.csv", "--out", "other.csv")["record"] == "other.csv"


def test_the_reader_says_how_such_a_file_becomes_a_record(bench, capsys):
    for text, way in (
        ({"header": "drive_mm;angle_deg"}, "has no commas: `notchbend record new bench.csv --out NEW.csv`"),
        ({"first": "# logger\n"}, "begins with a comment: `notchbend record new bench.csv --out NEW.csv`"),
        ({"header": "x,a"}, "`notchbend record new bench.csv --drive-column NAME --angle-column NAME`"),
    ):
        bench(**text)
        assert call(["identify", "bench.csv", "--out", "fit"]) == 2
        assert way in capsys.readouterr().err


def test_columns_of_other_names_are_named_by_options(bench, capsys):
    bench(header="u,v")
    error = complaint(capsys, "bench.csv")
    assert "no column is named as the drive: the columns are u, v: expected --drive-column NAME" in error
    assert "column 'w' missing" in complaint(capsys, "bench.csv", "--drive-column", "w", "--angle-column", "v")
    found = new(capsys, "bench.csv", "--drive-column", "u", "--angle-column", "v")
    assert found["columns"] == {"drive": "u", "angle": "v"}
    np.testing.assert_allclose(read_record("bench.csv").drive, WAY, atol=5e-5)


@pytest.mark.parametrize(
    ("header", "words"),
    [
        ("motor_a_mm,motor_b_mm", "columns 'motor_a_mm', 'motor_b_mm': any of them may be the drive"),
        (
            "drive_mm,theta_ticks",
            "column 'theta_ticks': expected degrees, not counts of a converter or encoder; convert",
        ),
        ("drive_mm,tau_Nm", "no column is named as the angle: the columns are drive_mm, tau_Nm: expected --angle-col"),
        ("0.0,1.0", "bench.csv:1: numbers in place of names"),
        ("drive_mm,drive_mm", "bench.csv:1: column 'drive_mm' occurs twice"),
    ],
)
def test_what_cannot_be_understood_is_named(header, words, bench, tmp_path, capsys):
    bench(header=header)
    assert words in complaint(capsys, "bench.csv")
    assert not (tmp_path / "bench.toml").exists()


@pytest.mark.parametrize(
    ("header", "options"),
    [
        ("stroke_mm angle_deg,reading", []),
        ("drive_mm,angle_deg", ["--drive-column", "angle_deg"]),
        ("drive_mm,angle_deg", ["--angle-column", "drive_mm"]),
    ],
)
def test_one_column_is_not_drive_and_angle_at_once(header, options, bench, tmp_path, capsys):
    """Found by the guided fuzzer: the angle was left out without a word, and the record failed without it."""
    words = complaint(capsys, bench(header=header), *options)
    assert "drive and angle at once" in words
    assert "expected --drive-column NAME and --angle-column NAME" in words
    assert [path.name for path in tmp_path.iterdir()] == ["bench.csv"]


def test_a_row_that_is_cut_off_is_named_with_its_line(bench, tmp_path, capsys):
    bench(first="# one\n")
    lines = (tmp_path / "bench.csv").read_text().splitlines()
    (tmp_path / "bench.csv").write_text("\n".join([*lines[:5], "0.3", *lines[5:]]) + "\n")
    assert "bench.csv:6: 1 fields: expected 2" in complaint(capsys, "bench.csv", "--out", "new.csv")


def test_what_looks_wrong_is_said(bench, capsys):
    bench("falls.csv", sign=-1.0)
    assert any("the angle falls as the drive rises" in words for words in new(capsys, "falls.csv")["remarks"])
    bench("radians.csv", factor=np.pi / 180)
    remarks = new(capsys, "radians.csv", "--preset", "du2018")["remarks"]
    assert any("by the rig: expected degrees and mm" in words for words in remarks)
    bench("steps.csv", header="motor_steps,angle_deg")
    found = new(capsys, "steps.csv")
    assert found["drive_unit"] == read_record("steps.csv").drive_unit == "step"
    assert any("no rig: the geometry is unknown" in words for words in found["remarks"])


def test_unknown_geometry_is_said_aloud(bench, capsys):
    bench()
    assert call(["identify", "bench.csv", "--out", "fit", "--law", "bouc-wen", "--json"]) == 0
    shown = capsys.readouterr()
    assert json.loads(shown.out)["kinematics"] == "fitted"
    assert "bench.csv: no sidecar bench.toml: its geometry is unknown" in shown.err
    assert "notchbend record new bench.csv --rig RIG.toml --preload N" in shown.err
    new(capsys, "bench.csv", "--preset", "du2018", "--preload", 20)
    assert without_geometry([read_record("bench.csv")], beside_rig=True) == []
    bench("other.csv")
    new(capsys, "other.csv", "--preload", 20)
    other = [read_record("other.csv")]
    assert without_geometry(other) == []  # its sidecar says so
    (words,) = without_geometry(other, beside_rig=True)
    assert words.startswith("other.csv: its sidecar other.toml names no rig: its geometry is unknown")


def test_a_record_of_a_tube_alone_is_said_not_to_take_the_rig(tmp_path):
    """Beside `run --rig` it would look as if the effects of the rig file were missing in it."""
    (tmp_path / "wrist.csv").write_text(TRIALS)
    columns = 'force = "tendon_force_N"\nangle = "tip_deg"\ncycle = "trial"'
    tube = "[tube]\nouter_diameter_mm = 1.62\ninner_diameter_mm = 1.4"
    notch = '[notch]\nshape = "rectangular"\ncount = 2\ndepth_mm = [1.36, 1.45]\nwidth_mm = 0.5\nspacing_mm = 1.5'
    (tmp_path / "wrist.toml").write_text(f"schema = 1\n[columns]\n{columns}\n{tube}\n{notch}\n")
    record = [read_record(tmp_path / "wrist.csv")]
    assert without_geometry(record) == []
    (words,) = without_geometry(record, beside_rig=True)
    assert "wrist.toml has tube and notches and names no rig" in words


def test_an_angle_in_another_unit_than_that_of_the_rig_is_said(bench, capsys):
    """Radians under a declared rig read as "no hysteresis", without a word."""
    bench("degrees.csv")
    bench("radians.csv", factor=np.pi / 180)
    for name in ("degrees.csv", "radians.csv"):
        new(capsys, name, "--preset", "du2018", "--preload", 20)
    assert unlike_loops([read_record("degrees.csv")]) == []
    (words,) = unlike_loops([read_record("radians.csv")])
    assert words.startswith("radians.csv: the angle covers 1.49 deg, and 86.1 deg")
    assert "by its rig: expected degrees and mm" in words
    assert call(["identify", "radians.csv", "--out", "fit", "--law", "bouc-wen"]) == 0
    assert words in capsys.readouterr().err


def test_an_angle_of_the_other_sense_than_that_of_the_rig_is_said(bench, capsys):
    """Compensation of such a record drives the rig the other way."""
    bench("other.csv", factor=-1.0)
    new(capsys, "other.csv", "--preset", "du2018", "--preload", 20)
    (words,) = unlike_loops([read_record("other.csv")])
    assert words.startswith("other.csv: angle_deg: falls as drive_mm rises: expected the signs of the rig")
    Path("wanted.csv").write_text("angle_deg\n0\n2\n5\n2\n0\n")
    assert call(["compensate", "other.csv", "--reference", "wanted.csv", "--out", "drive.csv", "--json"]) == 0
    assert words in json.loads(capsys.readouterr().out)["warnings"]


def test_a_drive_in_jumps_is_said_and_has_no_loop(tmp_path, capsys):
    """The transients of three commands had been called a loop of 5.89 deg."""
    drive = np.repeat([0.0, 2.0, 0.0, -2.0, 0.0, 2.0], 60)
    angle, last = np.empty(360), 0.0
    for k, x in enumerate(drive):
        last += 0.1 * (20 * x - last)
        angle[k] = last
    path = tmp_path / "steps.csv"
    path.write_text("drive_mm,angle_deg\n" + "".join(f"{x},{a:.4f}\n" for x, a in zip(drive, angle, strict=True)))
    found = new(capsys, path)
    assert found["loop_width_deg"] is None
    (words,) = unlike_loops([read_record(path)])
    assert f"{path}: 90 % of the angle's travel is while the drive stands still: a drive in jumps" in words
    fine = tmp_path / "fine.csv"  # settled at each of many values: a quasi-static record
    fine.write_text("drive_mm,angle_deg\n" + "".join(f"{x},{20 * x}\n" * 5 for x in WAY))
    assert unlike_loops([read_record(fine)]) == []


def test_a_record_of_another_rig_is_refused(bench, tmp_path, capsys):
    bench()
    new(capsys, "bench.csv", "--preset", "du2018", "--preload", 20)
    assert call(["run", "--preset", "notched-wrist-90", "bench.csv", "--out", "design"]) == 2
    assert "bench.csv: its sidecar names another rig, du2018" in capsys.readouterr().err
    assert not (tmp_path / "design").exists()


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (["--preload", "10"], "--preload: of which rig?"),
        (["bench.csv"], "bench.csv: of which rig?"),
        (["--rig", "a.toml", "--preset", "du2018"], "--rig a.toml and --preset du2018: expected one of the two"),
        (["--preset", "du2018", "--preload", "10", "--preload", "10"], "--preload 10: given twice"),
        (["--preset", "du2018", "--amplitude", "-1"], "--amplitude = -1"),
        (["--preset", "notched-wrist-90", "--ensemble"], "ensemble of notched-wrist-90"),
    ],
)
def test_options_of_run_that_do_not_fit_are_named(arguments, words, tmp_path, capsys, monkeypatch):
    monkeypatch.chdir(tmp_path)
    assert call(["run", *arguments, "--out", "design"]) == 2
    error = capsys.readouterr().err
    assert words in error
    assert error.count("\n") == 1
    assert list(tmp_path.iterdir()) == []


TRIALS = """trial,tendon_force_N,notch_1_deg,notch_2_deg,room_C,tip_deg
1,0.0,1,2,20,3
1,0.5,2,4,20,6
1,1.0,3,6,20,9
2,0.1,1,2,20,3
2,0.6,2,4,20,6
2,1.1,3,6,,9
"""
"""Two trials that only load, of a wrist with two notches and one tendon."""


def test_a_force_is_the_drive_where_nothing_else_is_and_notches_are_kept(tmp_path, capsys, monkeypatch):
    """A force that is taken for millimetres would be a wrong number that nobody sees."""
    monkeypatch.chdir(tmp_path)
    for header, options in (("tendon_force_N", []), ("load cell [N]", ["--drive-column", "load cell [N]"])):
        (tmp_path / "wrist.csv").write_text(TRIALS.replace("tendon_force_N", header))
        found = new(capsys, "wrist.csv", "--preset", "notched-wrist-90", *options)
        assert found["columns"] == {
            "force": header,
            "angle": "tip_deg",
            "cycle": "trial",
            "notches": ["notch_1_deg", "notch_2_deg"],
        }
        assert (found["drive_unit"], found["unused_columns"]) == ("N", ["room_C"])
        assert any("the force only rises in every trial" in words for words in found["remarks"])
        record = read_record("wrist.csv")
        assert record.drive_unit == "N"
        np.testing.assert_array_equal(record.notches_deg[:, 1], [2, 4, 6] * 2)
        (tmp_path / "wrist.toml").unlink()
    (tmp_path / "wrist.csv").write_text(TRIALS.replace("tendon_force_N", "force_gf"))
    found = new(capsys, "wrist.csv", "--out", "gf.csv")
    assert "'force_gf' in gf: times 0.00980665, to N" in found["understood"]
    np.testing.assert_allclose(read_record("gf.csv").drive, 9.80665e-3 * np.array([0, 0.5, 1, 0.1, 0.6, 1.1]))
    (tmp_path / "wrist.csv").write_text(
        TRIALS.replace("notch_1_deg", "tension_b_N").replace("tendon_force", "tension_a")
    )
    assert "any of them may be the force: expected --drive-column NAME" in complaint(capsys, "wrist.csv")


def test_trials_of_two_samples_are_refused(tmp_path, capsys):
    """Beyond a force, which need not reverse, nothing had counted them: the noise of two samples was a traceback."""
    (tmp_path / "pull.csv").write_text("force_N,angle_deg\n0,0\n1,2\n")
    assert call(["record", "new", str(tmp_path / "pull.csv")]) == 2
    error = capsys.readouterr().err
    assert error == f"notchbend: {tmp_path / 'pull.csv'}: 2 samples: expected at least 3\n"
    assert [path.name for path in tmp_path.iterdir()] == ["pull.csv"]


def test_all_channels_of_a_wrist_in_space_are_kept(tmp_path, capsys, monkeypatch):
    """Both angles, all tensions, notches and the tip: what `simulate` writes, without its sidecar."""
    from fem_models.load import triangle
    from fem_models.rig.presets_in_space import any_preset
    from fem_models.spatial import simulate_in_space
    from fem_models.spatial.drives import first_wheel
    from hysteresis.records.record_file import write_record

    monkeypatch.chdir(tmp_path)
    rig = any_preset("zhang2026", preload_N=3.0)
    record = simulate_in_space(rig, first_wheel(triangle(0.5, step_mm=0.1), rig))
    write_record(record, "simulated.csv")
    (tmp_path / "bench.csv").write_bytes((tmp_path / "simulated.csv").read_bytes())
    found = new(capsys, "bench.csv", "--preset", "zhang2026", "--preload", 3)
    assert found["columns"] == record.column_names()
    assert found["unused_columns"] == []
    copy = read_record("bench.csv")
    assert copy == replace(record, title="bench", kind="measured")
    assert copy.rig == {"preset": "zhang2026", "preload_N": 3.0}


def test_a_channel_without_a_number_in_every_row_is_left_out(bench, tmp_path, capsys):
    bench()
    lines = (tmp_path / "bench.csv").read_text().splitlines()
    rows = [f"{line},{'' if k == 3 else 1.0}" for k, line in enumerate(lines[1:])]
    (tmp_path / "bench.csv").write_text("\n".join([lines[0] + ",tension_a_N", *rows]) + "\n")
    found = new(capsys, "bench.csv", "--preset", "du2018")
    assert found["columns"] == {"drive": "drive_mm", "angle": "angle_deg"}
    assert found["unused_columns"] == ["tension_a_N"]


def test_the_drive_to_an_angle_follows_from_the_moment_arm():
    """x = r theta, if the tendons do not stretch."""
    rig = preset("du2018")
    assert drive_to_angle_mm(rig) == pytest.approx(2.58 * np.pi / 4, abs=0.05)
    wide = replace(rig.tendon_a, moment_arm_mm=5.16)
    assert drive_to_angle_mm(replace(rig, tendon_a=wide)) == pytest.approx(5.16 * np.pi / 4, abs=0.05)


def test_the_amplitude_of_fatigue_is_that_of_a_closed_cycle():
    """Strain of 1 % a mm: 0.4 % alternating in cycles of +-0.4 mm, and of a single tendon from 0 to 0.8 mm."""
    drive = np.concatenate([np.linspace(0, 1, 11), np.linspace(1, -1, 21), np.linspace(-1, 1, 21)])
    strain = 0.01 * np.column_stack([0.5 * drive, drive])
    assert fatigue_amplitude_mm(drive, strain, both_ways=True) == pytest.approx(0.4, abs=0.005)
    one = np.concatenate([np.linspace(0, 1, 11), np.linspace(1, 0, 11), np.linspace(0, 1, 11)])
    assert fatigue_amplitude_mm(one, 0.01 * one[:, None], both_ways=False) == pytest.approx(0.8, abs=0.005)
    assert fatigue_amplitude_mm(drive, 0.3 * strain, both_ways=True) is None
    assert fatigue_amplitude_mm(drive, np.nan * strain, both_ways=True) is None


@pytest.mark.parametrize(
    ("column", "factor", "unit"),
    [
        ("stage_um", 1e-3, "mm"),
        ("drive_inch", 25.4, "mm"),
        ("drive_cm", 10.0, "mm"),
        ("motor_rad", 180 / np.pi, "deg"),
        ("wheel_turns", 360.0, "deg"),
        ("motor_counts", 1.0, "step"),
    ],
)
def test_a_drive_in_another_unit_is_converted_and_not_taken_as_mm(bench, capsys, column, factor, unit):
    bench(header=f"{column},angle_deg")
    found = new(capsys, "bench.csv")
    record = read_record(found["record"])
    assert record.drive_unit == found["drive_unit"] == unit
    np.testing.assert_allclose(record.drive, factor * WAY, atol=1e-4 * factor)
    assert any(column in words for words in found["understood"])
    assert new(capsys, "bench.csv", "--drive-unit", "step", "--out", "steps.csv")["drive_unit"] == "step"


def test_a_current_is_no_drive_unless_it_is_said(bench, capsys):
    bench(header="motor_current_A,angle_deg")
    words = complaint(capsys, "bench.csv")
    assert "column 'motor_current_A': expected mm, deg, steps or N, not a current; convert it" in words
    assert new(capsys, "bench.csv", "--drive-unit", "step")["drive_unit"] == "step"


@pytest.mark.parametrize(("column", "unit"), [("motor_current_position_mm", "mm"), ("wheel_turn_deg", "deg")])
def test_a_drive_that_says_its_unit_is_taken_whatever_else_its_name_has(bench, capsys, column, unit):
    bench(header=f"{column},angle_deg")
    assert new(capsys, "bench.csv")["drive_unit"] == unit


@pytest.mark.parametrize("column", ["angle_rad", "theta_radians"])
def test_an_angle_in_radians_is_converted_where_its_column_is_given_too(bench, capsys, column):
    bench(header=f"drive_mm,{column}", factor=np.pi / 180)
    given = new(capsys, "bench.csv", "--angle-column", column, "--out", "given.csv")
    assert f"{column!r} in {column.split('_')[1]}: times 57.2958, to deg" in given["understood"]
    new(capsys, "bench.csv")
    np.testing.assert_array_equal(read_record("bench-record.csv").angle_deg, read_record("given.csv").angle_deg)
    expected = theory_curve(preset("du2018"), WAY).angle_deg + LAG
    np.testing.assert_allclose(read_record("given.csv").angle_deg, expected, atol=3e-3)


def test_points_for_thousands_beside_decimal_commas_are_refused(tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    rows = [f"{x};{str(y).replace('.', ',')}" for x, y in (("0", 0.5), ("1.500", 1.5), ("0", 0.7))]
    (tmp_path / "steps.csv").write_text("\n".join(["motor_steps;angle_deg", *rows]) + "\n")
    said = complaint(capsys, "steps.csv", "--out", "copy.csv")
    assert said.startswith("notchbend: steps.csv:3: column 'motor_steps' = 1.500: expected decimal commas")
    assert not (tmp_path / "copy.csv").exists()


def test_a_sample_that_was_logged_twice_counts_once(bench, tmp_path, capsys):
    bench(header="drive_mm,angle_deg")
    lines = (tmp_path / "bench.csv").read_text().splitlines()
    rows = [f"{line},{0.1 * k:.1f}" for k, line in enumerate(lines[1:])]
    rows.insert(5, rows[4])
    (tmp_path / "bench.csv").write_text("\n".join(["drive_mm,angle_deg,time_s", *rows]) + "\n")
    assert new(capsys, "bench.csv")["samples"] == WAY.size
    assert read_record(tmp_path / "bench.csv").drive.size == WAY.size
