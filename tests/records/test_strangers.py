"""Tables as strangers write them: each is read rightly by ``record new``, or refused in a line that says what to do."""

import importlib.util
import io
import json
import shutil
import sys
import time
from dataclasses import dataclass, field
from datetime import datetime, timedelta
from pathlib import Path

import numpy as np
import pytest

import hysteresis.extras
from hysteresis.records.record import RecordError
from hysteresis.records.record_file import read_record
from studies.commands.cli import call

HERE = Path(__file__).parent
_spec = importlib.util.spec_from_file_location("make_strangers", HERE / "make_strangers.py")
make = importlib.util.module_from_spec(_spec)
sys.modules["make_strangers"] = make
_spec.loader.exec_module(make)
FILES, WAY, ANGLE, TIME = make.files(), make.WAY, make.ANGLE, make.TIME
THIRD = np.arange(WAY.size) % 3 != 1
TRIALS = np.concatenate([TIME + 9.25 * k for k in range(3)])


@dataclass(frozen=True)
class Read:
    """Numbers that are read: drive, angle in deg, time in s (None where there is none), and words that are said."""

    drive: object = field(default_factory=lambda: WAY)
    angle: object = field(default_factory=lambda: ANGLE)
    time: object = field(default_factory=lambda: TIME)
    unit: str = "mm"
    cycle: object = None
    said: str = ""
    options: tuple[str, ...] = ()


READ = {
    "decimal-commas.csv": Read(),
    "preamble.csv": Read(said="2 lines above the names left out"),
    "preamble-with-numbers.csv": Read(said="3 lines above the names left out"),
    "units-below.csv": Read(said="Drive in mm"),
    "units-below-in-brackets.csv": Read(said="'Stage travel' in um: times 0.001, to mm"),
    "units-above.csv": Read(said="'Angle' in mrad"),
    "cp1252.csv": Read(said="'Weg [µm]' in µm"),
    "tabs-without-names.tsv": Read(
        said="'2' says no unit: taken as mm",
        options=("--drive-column", "2", "--angle-column", "3", "--time-column", "1"),
    ),
    "thousands-points.csv": Read(1000 * WAY, unit="step"),
    "thousands-commas.csv": Read(1000 * WAY, unit="step"),
    "names-again.csv": Read(np.tile(WAY, 2), np.tile(ANGLE, 2), TRIALS[: 2 * WAY.size], said="names that are repeated"),
    "footer.csv": Read(said="2 lines below the numbers left out"),
    "cut-off.csv": Read(WAY[:-1], ANGLE[:-1], TIME[:-1], said="line 38, which is cut off, left out"),
    "iso.csv": Read(said="'timestamp' is a clock"),
    "american-dates.csv": Read(time=0.2 * TIME, said="'Date Time' is a clock"),
    "milliseconds.csv": Read(said="'t_ms' in ms: times 0.001, to s"),
    "milliseconds-not-said.csv": Read(said="times 0.001", options=("--time-unit", "ms")),
    "minutes.csv": Read(said="in min"),
    "clock-in-ms.csv": Read(said="a clock in ms"),
    "clock-in-ns.csv": Read(said="a clock in ns"),
    "trials-restart.csv": Read(
        np.tile(WAY, 3), np.tile(ANGLE, 3), TRIALS, said="'trial' numbers 3 trials of several cycles"
    ),
    "trials-restart-without-numbers.csv": Read(
        np.tile(WAY, 3), np.tile(ANGLE, 3), TRIALS, said="begins anew at line 39, 76: 3 trials, one behind the other"
    ),
    "trials-of-one-cycle.csv": Read(
        np.tile(WAY[4:21], 3), np.tile(ANGLE[4:21], 3), None, cycle=np.repeat([1, 2, 3], 17)
    ),
    "newest-first.csv": Read(said="rows in reverse order"),
    "out-of-order.csv": Read(time=None, options=("--no-time",)),
    "whole-seconds.csv": Read(time=None, options=("--no-time",)),
    "hours-and-minutes.csv": Read(time=None, options=("--no-time",)),
    "cycle-falls.csv": Read(time=None, said="'cycle' has no whole numbers that never fall"),
    "steps-of-command.csv": Read(
        np.repeat([0, 2, 0, -2, 0, 2], 40), None, 0.01 * np.arange(240), said="drive stands still: a drive in jumps"
    ),
    "drive-wheel-turns.csv": Read(unit="deg", said="'wheel_turns' in turns: times 360, to deg"),
    "drive-motor-rad.csv": Read(unit="deg"),
    "drive-volt-V.csv": Read(unit="step", said="'volt_V' is in V: a drive in steps"),
    "drive-pwm.csv": Read(100 * WAY, unit="step", said="'pwm' is in pwm: a drive in steps"),
    "drive-enc-counts.csv": Read(1000 * WAY, unit="step", said="'enc_counts' is in counts: a drive in steps"),
    "encoder-alone.csv": Read(1000 * WAY, unit="step", said="'encoder' is in counts: a drive in steps"),
    "no-units-long.csv": Read(1000 * WAY, said="covers more than 200 mm and says no unit: of steps"),
    "drive-motor-steps.csv": Read(200 * WAY, unit="step"),
    "drive-stroke-in.csv": Read(said="'stroke_in' in inches: times 25.4, to mm"),
    "no-drive-motor-current-A.csv": Read(unit="step", options=("--drive-unit", "step")),
    "force-kN.csv": Read(np.abs(WAY), unit="N", said="in kN: times 1000"),
    "force-gf.csv": Read(np.abs(WAY), unit="N"),
    "load-cell-grams.csv": Read(np.abs(WAY), unit="N", said="'load cell [g]' in g: times 0.00980665, to N"),
    "wrapped-360.csv": Read(said="'angle_deg' is wrapped at a turn: put back at 5 places"),
    "wrapped-180.csv": Read(angle=ANGLE - 180),
    "wrapped-rad.csv": Read(said="is wrapped at a turn"),
    "no-units.csv": Read(said="'drive' says no unit: taken as mm"),
    "no-units-rad.csv": Read(options=("--angle-unit", "rad")),
    "two-drives.csv": Read(options=("--drive-column", "motor_a_mm")),
    "names-nobody-knows.csv": Read(options=("--drive-column", "b", "--angle-column", "c", "--time-column", "a")),
    "empty-angles.csv": Read(WAY[THIRD], ANGLE[THIRD], TIME[THIRD], said="12 rows without a number in 'angle_deg'"),
    "nan-words.csv": Read(WAY[THIRD], ANGLE[THIRD], TIME[THIRD], said="12 rows without a number in 'angle_deg'"),
    "na-words.csv": Read(WAY[THIRD], ANGLE[THIRD], TIME[THIRD], said="12 rows without a number in 'drive_mm'"),
    "labview.lvm": Read(said="lines above the names left out"),
    "keys-and-values.txt": Read(time=None, said="a label before each number: the names of the columns"),
    "labels-and-units.txt": Read(time=None, said="a label before each number"),
    "labels-cut-off.txt": Read(time=None, said="2 lines cut off at the ends left out"),
    "stamps-and-arrow.txt": Read(said="stamps before an arrow: the first column"),
    "means-above.csv": Read(said="2 lines above the names left out"),
    "means-below.csv": Read(time=None, said="1 line below the numbers left out"),
    "mean-without-a-word.csv": Read(time=None, said="1 row behind an empty line left out"),
    "zeros-at-the-end.csv": Read(said="of zeros at the end, the time too, left out: a buffer not filled"),
    "last-number-cut.csv": Read(WAY[:-1], ANGLE[:-1], TIME[:-1], said="line 38, which is cut off, left out"),
    "names-in-a-line-above.csv": Read(said="Drive in mm"),
    "r-numbers-of-rows.txt": Read(said="a first column without a name, which numbers the rows, left out"),
    "numbered-and-trailing.csv": Read(time=None),
    "overloads.csv": Read(WAY[THIRD], ANGLE[THIRD], TIME[THIRD], said="12 rows without a number in 'angle_deg'"),
    "fortran-stars.csv": Read(WAY[THIRD], ANGLE[THIRD], TIME[THIRD], said="12 rows without a number in 'angle_deg'"),
    "begun-anew.csv": Read(np.tile(WAY, 2), np.tile(ANGLE, 2), TRIALS[: 2 * WAY.size], said="repeated below left out"),
    "labview-units-above.lvm": Read(said="'Bend' in rad: times 57.2958, to deg"),
    "labview-without-times.lvm": Read(time=None, said="'X_Value' is empty: no times"),
    "labview-begun-anew.lvm": Read(said="names that are repeated below left out: 6 lines"),
    "dates-with-months.csv": Read(said="'Time' is a clock"),
    "dates-of-c.csv": Read(said="'Time' is a clock"),
    "dates-without-marks.csv": Read(said="'Time' is a clock"),
    "days.csv": Read(said="'Time' is a clock in days"),
    "drive-in-mil.csv": Read(said="'Drive [mil]' in mil: times 0.0254, to mm"),
    "drive-in-dm.csv": Read(said="'Drive [dm]' in dm: times 100, to mm"),
    "drive-in-furl.csv": Read(options=("--drive-unit", "mm")),
    "force-daN.csv": Read(np.abs(WAY), unit="N", said="in daN: times 10"),
    "angle-cdeg.csv": Read(said="'angle_cdeg' in cdeg: times 0.01, to deg"),
    "motor-angle-without-a-unit.csv": Read(10 * WAY, unit="deg", options=("--drive-unit", "deg")),
    "bend-of-the-motor.csv": Read(10 * WAY, unit="deg", options=("--drive-column", "theta_m", "--drive-unit", "deg")),
    "inches-or-input.csv": Read(options=("--drive-unit", "mm", "--angle-column", "angle_out")),
    "units-twice.csv": Read(options=("--drive-unit", "mm")),
    "servo-pulse.csv": Read(1500 + 100 * WAY, unit="step", said="a drive in steps, whose gain to mm is unknown"),
    "spanish-force.csv": Read(np.abs(WAY), unit="N"),
    "testing-machine.csv": Read(said="Extension in (mm)"),
    "rostopic-echo.csv": Read(said="'time' is a clock in ns"),
    "numbered-columns.csv": Read(said="a row that numbers the columns left out"),
    "trials-in-words.csv": Read(time=None, said="'trial' has words in it"),
    "spike-and-wrapped.csv": Read(angle=np.where(TIME == 5, 999, ANGLE), said="wrapped at a turn: put back at 5"),
    "gb18030.csv": Read(options=("--encoding", "gb18030")),
    "only-the-tip-moves.csv": Read(options=("--drive-column", "tip_position_mm")),
    "ros2-own-names.csv": Read(said="one clock, seconds from the first row"),
    "ros2-joint-states.csv": Read(
        said="one clock",
        options=("--drive-column", "/joint_states/position[0]", "--angle-column", "/joint_states/position[1]",
                 "--drive-unit", "mm", "--angle-unit", "rad"),
    ),
}  # fmt: skip
"""What is read otherwise than as two cycles after an approach, in mm, deg and s, or with words or options."""
REFUSED = {
    "decimal-commas-between-commas.csv": ":2: 6 fields: expected 3, one a column; where these are decimal com",
    "thousands-or-decimals.csv": "may be of decimals or of thousands: expected no marks of thousands",
    "quote-not-closed.csv": ":10: a quotation mark that is not closed",
    "short-row.csv": ":10: 2 fields: expected 3, one a column",
    "words-in-a-row.csv": ":10: column 'time_s' = stop: expected a number in every row; --no-time leaves it out",
    "names-twice.csv": ":1: column 'angle_deg' occurs twice: expected different names",
    "no-numbers.csv": "no rows of numbers: expected a header that names the columns, then rows",
    "empty.csv": "0 lines with values: expected a header that names the columns, then rows",
    "tabs-without-names.tsv": "numbers in place of names: expected --drive-column K and --angle-column K, numbers",
    "whole-seconds.csv": ":3: column 'timestamp' = 0 after 0: expected increasing time; --no-time leaves it out",
    "out-of-order.csv": ":12: column 'time_s' = 2.25 after 2.5: expected increasing time; --no-time leaves it out",
    "hours-and-minutes.csv": ":2: column 'time' = 12:00: expected a number in every row; --no-time leaves it out",
    "no-angle-tau-Nm.csv": "no column is named as the angle: the columns are time_s, drive_mm, tau_Nm: expected --a",
    "no-angle-angle-ticks.csv": "'angle_ticks': expected degrees, not counts of a converter or encoder; convert it",
    "no-angle-theta-dot.csv": "column 'theta_dot': expected degrees, not a rate; convert it",
    "no-drive-motor-torque-Nm.csv": "'motor_torque_Nm': expected mm, deg, steps or N, not a torque; convert it",
    "no-drive-motor-current-A.csv": "not a current; convert it, name another column, or --drive-unit step",
    "no-drive-wheel-speed-mm-s.csv": "no column is named as the drive: the columns are time_s, wheel_speed_mm_s",
    "two-drives.csv": "columns 'motor_a_mm', 'motor_b_mm': any of them may be the drive: expected --drive-column NAME",
    "names-nobody-knows.csv": "no column is named as the drive: the columns are a, b, c: expected --drive-column NAME",
    "two-rates-one-table.csv": "no row has numbers in 'drive_mm', 'angle_deg', 'time_s': expected all of them",
    "infinite.csv": ":11: column 'angle_deg' = inf: expected a number in every row",
    "text-in-a-cell.csv": ":11: column 'angle_deg' = error 3: expected a number in every row",
    "ros2-joint-states.csv": "any of them may be the drive: expected --drive-column NAME",
    "r-row-names.txt": ":2: 4 fields: expected 3, one a column",
    "units-in-cells.csv": "no rows of numbers: expected a header that names the columns, then rows",
    "labels-that-change.txt": ":21: 'speed: 3, angle: 4': expected pos [mm]: NUMBER, angle [deg]: NUMBER",
    "two-preloads.csv": "column 'preload_N' has 10, 20: a record is of one of them: expected a table of each",
    "second-table.csv": ":39: 'time_s' as in line 1, and not the same behind it: expected one table in a file",
    "begun-anew-otherwise.csv": "'Gain' as in line 2, and not the same behind it: expected one table in a file",
    "drive-in-0.01-mm.csv": "expected mm, deg, steps or N, not a multiple of a unit; convert it",
    "drive-in-mm-x10.csv": "expected mm, deg, steps or N, not a multiple of a unit; convert it",
    "drive-in-furl.csv": "'furl' is no known unit: expected --drive-unit UNIT, or a column in mm",
    "angle-in-pi.csv": "expected degrees, not a multiple of a unit; convert it",
    "tangent-of-angle.csv": "expected degrees, not a function of it; convert it",
    "motor-angle-without-a-unit.csv": "'motor_theta': an angle that says no unit: expected --drive-unit deg, rad",
    "bend-of-the-motor.csv": "expected --drive-column NAME",
    "inches-or-input.csv": "'drive_in': inches, or an input: expected --drive-unit in, mm, deg or step",
    "units-twice.csv": "'drive_mm': mm in its name, um in the row of units: expected one, or --drive-unit UNIT",
    "packed.csv.xz": "compressed: expected it unpacked (unxz)",
    "frame.pkl": "a pickle of Python: expected a CSV or parquet (DataFrame.to_csv)",
    "records.json": "JSON: expected a CSV (pandas.read_json and DataFrame.to_csv make one)",
    "page.xls": "XML or a page of the web: expected a table, saved as .xlsx or CSV",
    "yaw-pitch-roll.csv": "columns 'yaw_deg', 'pitch_deg', 'roll_deg': any of them may be the angle: expected --angle",
    "only-the-motor-turns.csv": "no column is named as the angle: the columns are t, stage_mm, motor_angle_deg",
    "only-the-tip-moves.csv": "no column is named as the drive: the columns are t, tip_position_mm, angle_deg",
    "drive-stands-still.csv": "column 'force_N' = 3.5 in all 37 samples: expected one that changes",
    "gb18030.csv": "expected --angle-column NAME, or another --encoding",
    "nul-bytes.csv": "has NUL in it: expected a table as text, or --encoding NAME",
    "old-spreadsheet.xls": "a spreadsheet of before 2007: expected it saved as .xlsx or CSV",
    "matlab-7.3.mat": "HDF5, as MATLAB 7.3 writes it: expected save('x.mat', '-v7'), or writetable to CSV",
    "labview.tdms": "a LabVIEW TDMS file: expected its channels exported as CSV",
    "bag.db3": "a database, as of a ROS 2 bag: expected its topics exported as CSV",
    "packed.csv.gz": "compressed: expected it unpacked (gunzip)",
}
"""What is refused as it is; the options of READ help where it is there, too."""
NO_ANGLES = [name for name in FILES if name.startswith("no-angle-") and name not in REFUSED]


@pytest.fixture
def put(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)

    def copy(name):
        shutil.copyfile(HERE / "strangers" / name, tmp_path / name)
        return name

    return copy


def new(capsys, *arguments):
    assert call(["record", "new", *map(str, arguments), "--json"]) == 0, capsys.readouterr().err
    return json.loads(capsys.readouterr().out)


def complaint(capsys, *arguments):
    assert call(["record", "new", *map(str, arguments)]) == 2
    error = capsys.readouterr().err
    assert error.count("\n") == 1
    assert len(error) < 300
    return error


def check(found, expected):
    record = read_record(found["record"])
    assert (record.drive_unit, found["drive_unit"]) == (expected.unit, expected.unit)
    np.testing.assert_allclose(record.drive, expected.drive, rtol=1e-8, atol=1e-8)
    if expected.angle is not None:
        np.testing.assert_allclose(record.angle_deg, expected.angle, rtol=1e-7, atol=1e-7)
    if expected.time is None:
        assert record.time_s is None
    else:
        np.testing.assert_allclose(record.time_s - record.time_s[0], expected.time, atol=1e-6)
    assert (record.cycle is None) if expected.cycle is None else record.cycle.tolist() == list(expected.cycle)
    assert any(expected.said in words for words in [*found["understood"], *found["remarks"]])


def test_there_are_many_and_the_script_writes_them():
    kept = {path.name: path.read_bytes() for path in (HERE / "strangers").iterdir()}
    assert kept == FILES
    assert len(kept) > 100
    assert set(READ) | set(REFUSED) <= set(FILES)


@pytest.mark.parametrize("name", [name for name in FILES if name in READ or name not in [*REFUSED, *NO_ANGLES]])
def test_a_table_is_read_rightly(name, put, tmp_path, capsys):
    expected = READ.get(name, Read())
    found = new(capsys, put(name), *expected.options)
    assert (tmp_path / name).read_bytes() == FILES[name]
    check(found, expected)


@pytest.mark.parametrize("name", [*REFUSED, *NO_ANGLES])
def test_a_table_is_refused_in_one_line(name, put, tmp_path, capsys):
    words = complaint(capsys, put(name))
    assert words.startswith(f"notchbend: {name}:")
    assert REFUSED.get(name, "no column is named as the angle") in words
    assert [path.name for path in tmp_path.iterdir()] == [name]


@pytest.mark.parametrize("name", FILES)
def test_the_reader_of_records_reads_the_same_or_refuses_in_one_line(name, put, capsys):
    """``identify`` and the others read a file as it is: the same numbers as those of ``record new``, or a refusal."""
    expected = READ.get(name, Read())
    record, words = None, name
    try:
        record = read_record(put(name))
    except RecordError as error:
        words = str(error)
    assert words.startswith(name)
    assert "\n" not in words
    if record is not None:
        np.testing.assert_allclose(record.drive, expected.drive, atol=1e-8)


@pytest.mark.parametrize(
    "name", ["tau_Nm", "force_N", "load_kN", "volt_V", "strain_pct", "enc_counts", "torque", "speed_deg_s"]
)
def test_what_is_no_angle_is_not_taken_as_one_though_it_is_named(name, tmp_path, capsys):
    path = tmp_path / "bench.csv"
    path.write_text(make.table(f"drive_mm,{name}", zip(WAY, ANGLE, strict=True)))
    assert "expected degrees, not" in complaint(capsys, path, "--angle-column", name)
    path.with_suffix(".toml").write_text(f'schema = 1\n[columns]\ndrive = "drive_mm"\nangle = "{name}"\n')
    with pytest.raises(RecordError, match=f"columns.angle = '{name}': expected degrees"):
        read_record(path)
    path.with_suffix(".toml").unlink()
    check(new(capsys, path, "--angle-column", name, "--angle-unit", "deg"), Read(time=None))


@pytest.mark.parametrize(("name", "expected"), [
    ("stroke_in", "expected mm, deg, steps or N"), ("volt_V", "expected mm, deg, steps or N"),
    ("pwm", "expected mm, deg, steps or N"), ("enc_counts", "expected mm, deg, steps or N"),
    ("wheel_deg", 'its name says deg: expected unit = "deg" in [drive]'),
    ("force_N", "its name says N: expected columns.force in place of columns.drive"),
])  # fmt: skip
def test_a_drive_of_a_sidecar_is_not_silently_mm(name, expected, tmp_path):
    path = tmp_path / "bench.csv"
    path.write_text(make.table(f"{name},angle_deg", zip(WAY, ANGLE, strict=True)))
    path.with_suffix(".toml").write_text(f'schema = 1\n[columns]\ndrive = "{name}"\nangle = "angle_deg"\n')
    with pytest.raises(RecordError) as error:
        read_record(path)
    assert f"columns.drive = '{name}': {expected}" in str(error.value)


# --- tables that are no text -----------------------------------------------------------------------------------------


HEAD = ["time_s", "drive_mm", "angle_deg"]


def workbook(path, **sheets):
    openpyxl = pytest.importorskip("openpyxl")
    book = openpyxl.Workbook()
    book.remove(book.active)
    for name, rows in sheets.items():
        sheet = book.create_sheet(name)
        for row in rows:
            sheet.append(list(row))
    book.save(path)
    return path


def grid():
    return [list(row) for row in zip(TIME.tolist(), WAY.tolist(), ANGLE.tolist(), strict=True)]


def test_a_spreadsheet(tmp_path, capsys):
    path = workbook(tmp_path / "bench.xlsx", Notes=[["Bench 3"]], Data=[HEAD, *grid()])
    found = new(capsys, path)
    assert (found["kind"], found["sheet"], found["record"]) == ("xlsx", "Data", str(tmp_path / "bench-record.csv"))
    check(found, Read())


def test_a_spreadsheet_with_a_preamble_units_dates_text_and_empty_cells(tmp_path, capsys):
    start = datetime(2026, 5, 3, 23, 59, 58)
    rows = [[start + timedelta(seconds=t), None, f"{1000 * x:.1f}".replace(".", ","), a if i % 3 != 1 else None]
            for i, (t, x, a) in enumerate(grid())]  # fmt: skip
    head = [["Bench 3"], ["run", 7], [], ["Time", None, "Travel", "Tip angle"], [None, None, "µm", "deg"]]
    found = new(capsys, workbook(tmp_path / "bench.xlsx", Data=[*head, *rows]))
    check(found, Read(WAY[THIRD], ANGLE[THIRD], TIME[THIRD], said="'Time' is a clock: seconds from the first row"))


def test_several_sheets_with_tables_are_named(tmp_path, capsys):
    path = workbook(tmp_path / "bench.xlsx", low=[HEAD, *grid()], high=[HEAD, *grid()[:20]])
    assert "sheets 'low', 'high' have tables: expected --sheet NAME" in complaint(capsys, path)
    assert "--sheet 'middle': expected one of 'low', 'high'" in complaint(capsys, path, "--sheet", "middle")
    check(new(capsys, path, "--sheet", "low"), Read())
    assert new(capsys, path, "--sheet", "2", "--out", tmp_path / "two.csv")["samples"] == 20
    plain = tmp_path / "plain.csv"
    plain.write_bytes(FILES["plain.csv"])
    assert "this is no spreadsheet: expected no --sheet" in complaint(capsys, plain, "--sheet", "1")


def test_an_archive_that_is_no_spreadsheet(tmp_path, capsys):
    import zipfile

    path = tmp_path / "bench.xlsx"
    with zipfile.ZipFile(path, "w") as archive:
        archive.writestr("content.xml", "<a/>")
    assert "an archive without a workbook: expected a spreadsheet saved as .xlsx, or a CSV" in complaint(capsys, path)
    path.write_bytes(path.read_bytes()[:40])
    assert "not a whole file" in complaint(capsys, path)


def arrow(path, **columns):
    pyarrow = pytest.importorskip("pyarrow")
    parquet = pytest.importorskip("pyarrow.parquet")
    parquet.write_table(pyarrow.table(columns), path)
    return path


def test_parquet(tmp_path, capsys):
    found = new(capsys, arrow(tmp_path / "bench.parquet", time_s=TIME, drive_mm=WAY, angle_deg=ANGLE))
    assert found["kind"] == "parquet"
    check(found, Read())


def test_parquet_with_dates_structures_and_holes(tmp_path, capsys):
    stamps = np.datetime64("2026-05-03T23:59:58", "ns") + (1e9 * TIME).astype("timedelta64[ns]")
    stage = [{"travel_um": 1000 * x, "name": "a"} for x in WAY]
    angle = [float(np.radians(a)) if keep else None for a, keep in zip(ANGLE, THIRD, strict=True)]
    path = arrow(tmp_path / "bench.parquet", stamp=stamps, stage=stage, tip_angle_rad=angle, on=[True] * WAY.size)
    check(new(capsys, path), Read(WAY[THIRD], ANGLE[THIRD], TIME[THIRD], said="'stage.travel_um' in um"))
    path.write_bytes(path.read_bytes()[:-40])
    assert "not read" in complaint(capsys, path, "--out", tmp_path / "other.csv")


def mat(path, **values):
    import scipy.io

    file = io.BytesIO()
    scipy.io.savemat(file, values)
    path.write_bytes(file.getvalue())
    return path


def test_mat(tmp_path, capsys):
    found = new(
        capsys, mat(tmp_path / "bench.mat", t=TIME, drive_mm=WAY, theta_rad=np.radians(ANGLE), fs=4.0, gain=[1.0, 2, 3])
    )
    assert found["kind"] == "mat"
    check(found, Read(said="1 variable of another length left out"))


def test_mat_with_a_structure_or_a_matrix(tmp_path, capsys):
    path = mat(tmp_path / "bench.mat", data={"time": TIME, "drive_mm": WAY[:, None], "angle_deg": ANGLE, "name": "a"})
    check(new(capsys, path), Read())
    path = mat(tmp_path / "matrix.mat", M=np.column_stack([TIME, WAY, ANGLE]))
    assert "no column is named as the drive: the columns are M(1), M(2), M(3)" in complaint(capsys, path)
    options = ["--drive-column", "M(2)", "--angle-column", "M(3)", "--time-column", "M(1)"]
    check(new(capsys, path, *options), Read(said="'M(2)' says no unit: taken as mm"))
    path = mat(tmp_path / "none.mat", a=1.0, b="text")
    assert "expected drive and angle as vectors of one length, or writetable to CSV" in complaint(capsys, path)


@pytest.mark.parametrize("name", ["bench.xlsx", "bench.parquet"])
def test_without_the_extra_one_line_names_it(name, tmp_path, capsys, monkeypatch):
    path = tmp_path / name
    workbook(path, Data=[HEAD, *grid()]) if name.endswith("xlsx") else arrow(path, drive_mm=WAY, angle_deg=ANGLE)
    monkeypatch.setattr(hysteresis.extras, "find_spec", lambda _: None)
    words = complaint(capsys, path)
    assert words.endswith("expected for tables in .xlsx and .parquet: pip install 'notchbend[tables]'\n")


@pytest.mark.parametrize("name", ["bench.xlsx", "bench.parquet", "bench.mat"])
def test_identify_says_how_such_a_table_becomes_a_record(name, tmp_path):
    path = tmp_path / name
    path.write_bytes(b"PK\x03\x04")
    with pytest.raises(RecordError, match=rf"{name}: expected a CSV file: `notchbend record new .*{name}` writes one"):
        read_record(path)


# --- what is large or odd --------------------------------------------------------------------------------------------


@pytest.mark.parametrize("name", ["wide.csv", "wide.txt"])
def test_100_000_columns_are_refused_at_once(name, tmp_path, capsys):
    row = ",".join(map(str, range(100_000)))
    (tmp_path / name).write_text(f"{row.replace(',', 'a,')}\n{row}\n{row}\n")
    began = time.process_time()
    assert ":1: 688,888 characters: expected at most 200,000" in complaint(capsys, tmp_path / name)
    assert time.process_time() - began < 5.0
    with pytest.raises(RecordError, match="100,000 columns: expected at most 1,000"):
        read_record(tmp_path / name)


@pytest.mark.parametrize("field", ["x" * 150_000, '"' + "x" * 150_000 + '"', '"' + "y\n" * 80_000 + '"'])
def test_a_long_field_is_refused_in_one_line(field, tmp_path, capsys):
    text = FILES["plain.csv"].decode().replace("time_s", f"{field},time_s", 1)
    (tmp_path / "long.csv").write_text(text)
    assert "expected" in complaint(capsys, tmp_path / "long.csv")


@pytest.mark.parametrize(("given", "words"), [
    ("klingon", "--encoding klingon: expected one such as utf-8, utf-16, cp1252, latin-1"),
    ("ascii", "byte 14: not ascii: expected another --encoding"),
    ("utf-16", "1 lines with values"),
])  # fmt: skip
def test_an_encoding_that_does_not_fit(given, words, put, capsys):
    assert words in complaint(capsys, put("cp1252.csv"), "--encoding", given)


def test_an_encoding_that_is_given(put, capsys):
    check(new(capsys, put("cp1252.csv"), "--encoding", "latin-1"), Read(said="'Weg [µm]' in µm"))
