"""Reading records: the documented examples, and one line of error for every broken file."""

import re
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from hysteresis.records.path import require_reversal
from hysteresis.records.record import Record, RecordError
from hysteresis.records.record_file import read_columns, read_record, write_record

DOCS = (Path(__file__).parents[2] / "docs" / "guide" / "records.md").read_text(encoding="utf-8")
EXAMPLES = dict(re.findall(r"`([\w.-]+)`\n```(?:csv|toml)\n(.*?)```", DOCS, flags=re.DOTALL))
MESSAGES = re.search(r"```text\n(.*?)```", DOCS, flags=re.DOTALL)[1].splitlines()
BARE = "drive_mm,angle_deg\n0,0\n1,2\n0,1\n"


def put(folder: Path, csv: str, toml: str | None = None) -> Path:
    (folder / "loop.csv").write_bytes(csv.encode())
    if toml is not None:
        (folder / "loop.toml").write_text(toml, encoding="utf-8")
    return folder / "loop.csv"


def message(path: Path) -> str:
    with pytest.raises(RecordError) as caught:
        require_reversal(read_record(path))
    text = str(caught.value)
    assert "\n" not in text
    return text.replace(f"{path.parent}/", "")


# --- the documented examples -----------------------------------------------------------------------------------


def test_docs_examples_read(tmp_path: Path) -> None:
    for name, text in EXAMPLES.items():
        (tmp_path / name).write_text(text, encoding="utf-8")
    bare = read_record(tmp_path / "loop.csv")
    assert bare.drive.tolist() == [-2.2, 0.0, 2.2, 0.0, -2.2]
    assert bare.angle_deg.tolist() == [-45.0, -1.8, 45.0, 1.8, -45.0]
    assert (bare.drive_unit, bare.title, bare.kind, bare.time_s) == ("mm", "loop", "measured", None)
    full = read_record(tmp_path / "bench-20N.csv")
    assert full.title == "Bench, 20 N, slow"
    assert full.cycle.tolist() == [0, 0, 1, 1, 1, 1]
    assert full.time_s.tolist() == [0.0, 0.1, 0.2, 0.3, 0.4, 0.5]
    assert full.tension_b_N[1] == 10.2
    assert full.notches_deg.shape == (6, 2)
    assert full.rig["preload_N"] == 20.0
    assert full.rig["joints"] == 2
    assert full.kinematics.tolist() == [[-2.0, -40.5], [0.0, 0.0], [2.0, 40.5]]
    assert full.drive_column == "wheel_mm"


def test_docs_python_example_runs(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    put(tmp_path, EXAMPLES["loop.csv"])
    exec(re.search(r"```python\n(.*?)```", DOCS, flags=re.DOTALL)[1], {})
    assert (tmp_path / "copy.toml").exists()


BROKEN = {
    "loop.csv: No such file": (None, None),
    "loop.csv: empty": ("", None),
    "loop.csv: column 'drive_mm'": ("drive_mm;angle_deg\n0;0\n1;1\n0;0\n", None),
    "loop.csv: column 'cycle': 200": ("cycle,drive_mm,angle_deg\n" + "".join(f"{i},0,0\n" for i in range(200)), None),
    "loop.csv: column": ("drive_mm,theta\n0,0\n1,1\n0,0\n", None),
    "loop.csv:3: column 'angle_deg' = 'n/a'": (BARE.replace("1,2", "1,n/a"), None),
    "loop.csv:3: column 'angle_deg' = nan": (BARE.replace("1,2", "1,nan"), None),
    "loop.csv:3: 3 fields": (BARE.replace("1,2", "1,2,3"), None),
    "loop.csv: one sample": ("drive_mm,angle_deg\n0,0\n", None),
    "loop.csv:4: column 'time_s'": ("time_s,drive_mm,angle_deg\n0,0,0\n0.2,1,1\n0.1,0,0\n", None),
    "loop.csv:3: column 'cycle'": ("cycle,drive_mm,angle_deg\n0,0,0\n1.5,1,1\n2,0,0\n", None),
    "loop.csv: drive": (BARE.replace("0,1\n", "2,3\n"), None),
    "loop.toml: schema": (BARE, "schema = 2"),
    "loop.toml: rig.preload": (BARE, "schema = 1\n[rig]\npreload = 10.0"),
}


@pytest.mark.parametrize("expected", MESSAGES)
def test_documented_messages(tmp_path: Path, expected: str) -> None:
    csv, toml = next(files for start, files in BROKEN.items() if expected.startswith(start))
    path = tmp_path / "loop.csv" if csv is None else put(tmp_path, csv, toml)
    assert message(path) == expected


def test_every_broken_file_is_documented() -> None:
    assert len(MESSAGES) == len(BROKEN)


# --- reading ---------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("csv", "expected"),
    [
        ("\n\n", "loop.csv: empty"),
        ("drive_mm,angle_deg\n", "loop.csv: 0 samples"),
        ("drive_mm,angle_deg\n0,0\n1,1\n", "loop.csv: 2 samples"),
        (BARE.replace("0,1\n", "0,\n"), "loop.csv:4: column 'angle_deg' = '': expected a number"),
        (BARE.replace("1,2", "1_0,2"), "loop.csv:3: column 'drive_mm' = '1_0': expected a number"),
        (BARE.replace("1,2", "1#,2"), "loop.csv:3: column 'drive_mm' = '1#': expected a number"),
        (BARE.replace("1,2", "1,-inf"), "loop.csv:3: column 'angle_deg' = -inf: expected a finite number"),
        (BARE.replace("1,2", "1,1e999"), "loop.csv:3: column 'angle_deg' = 1e999: expected a finite number"),
        (BARE.replace("1,2", "1,-1.1e9"), "loop.csv:3: column 'angle_deg' = -1.1e9: expected at most 1e+09 in magn"),
        (BARE.replace("1,2", "1e300,2"), "loop.csv:3: column 'drive_mm' = 1e300: expected at most 1e+09 in magnitude"),
        (BARE.replace("1,2", ""), "loop.csv:3: 0 fields: expected 2"),
        (BARE.replace("1,2", "1"), "loop.csv:3: 1 fields: expected 2"),
        (BARE.replace("1,2", "1,5,2"), "loop.csv:3: 3 fields"),
        (BARE.replace(",", ";"), "loop.csv: column 'drive_mm' missing: the columns are drive_mm;angle_deg"),
        (
            BARE.replace("angle_deg", "#2"),
            "loop.csv: column 'angle_deg' missing: the columns are drive_mm, #2: `notchbend record new loop.csv --d",
        ),
        (BARE.replace("drive_mm", "angle_deg"), "loop.csv:1: column 'angle_deg' occurs twice"),
        (BARE.replace("1,2", "0,2"), "loop.csv: drive 'drive_mm' never reverses"),
        ("cycle,drive_mm,angle_deg\n2,0,0\n1,1,1\n2,0,0\n", "loop.csv:3: column 'cycle' = 1:"),
        ("time_s,drive_mm,angle_deg\n0,0,0\n0,1,1\n1,0,0\n", "loop.csv:3: column 'time_s' = 0 after 0:"),
    ],
)
def test_bad_csv(tmp_path: Path, csv: str, expected: str) -> None:
    assert message(put(tmp_path, csv)).startswith(expected)


def test_text_in_a_long_file_is_found_at_its_line(tmp_path: Path) -> None:
    rows = [f"{k},{k}" for k in range(1000)]
    rows[700] = "700,7oo"
    text = message(put(tmp_path, "drive_mm,angle_deg\n" + "\n".join(rows)))
    assert text == "loop.csv:702: column 'angle_deg' = '7oo': expected a number"


def test_not_utf8_and_not_a_file(tmp_path: Path) -> None:
    (tmp_path / "loop.csv").write_bytes(b"drive_mm,angle_deg \xb0\n0,0\n")
    assert "is not UTF-8: expected a CSV file in UTF-8" in message(tmp_path / "loop.csv")
    (tmp_path / "folder.csv").mkdir()
    assert "expected a CSV file" in message(tmp_path / "folder.csv")
    assert "not its sidecar" in message(tmp_path / "loop.toml")


HEAD = 'schema = 1\n[columns]\ndrive = "drive_mm"\nangle = "angle_deg"\n'


@pytest.mark.parametrize(
    ("toml", "expected"),
    [
        ("schema = ", "loop.toml: not TOML"),
        ('title = "x"', "loop.toml: schema = 'missing': expected 1"),
        ("schema = true", "loop.toml: schema = True: expected 1"),
        ("schema = 1\ntitle = 3", "loop.toml: title = 3: expected text"),
        ('schema = 1\nkind = "guess"', "loop.toml: kind = 'guess': expected measured or simulated"),
        ("schema = 1\ncolums = 1", "loop.toml: colums: unknown key: expected one of schema, title"),
        ("schema = 1\ncolumns = 1", "loop.toml: columns = 1: expected a table"),
        ('schema = 1\n[columns]\nangle = "angle_deg"', "loop.toml: columns.drive, columns.force: expected one of"),
        ('schema = 1\n[columns]\ndrive = "drive_mm"', "loop.toml: columns.angle: missing"),
        (HEAD + 'force = "drive_mm"', "loop.toml: columns.drive, columns.force: expected one of"),
        (HEAD + "time = 3", "loop.toml: columns.time = 3: expected the name of a column"),
        (HEAD + 'time = "clock"', "loop.csv: column 'clock' missing: the columns are drive_mm, angle_deg"),
        (HEAD + 'notches = "n1"', "loop.toml: columns.notches = 'n1': expected a list of column names"),
        (HEAD + 'tip = ["drive_mm"]', "loop.toml: columns.tip = ['drive_mm']: expected two columns"),
        (HEAD + '[drive]\nunit = "inch"', "loop.toml: drive.unit = 'inch': expected mm or deg or step"),
        (HEAD.replace("drive =", "force =") + '[drive]\nunit = "mm"', "loop.toml: drive.unit = 'mm': expected N"),
        (HEAD + '[drive]\nunits = "mm"', "loop.toml: drive.units: unknown key: expected one of unit"),
        (HEAD + "[rig]\npreload_N = -1", "loop.toml: rig.preload_N = -1: expected a number above 0"),
        (HEAD + "[rig]\npreload_N = true", "loop.toml: rig.preload_N = True: expected a number above 0"),
        (HEAD + "[rig]\njoints = 2.5", "loop.toml: rig.joints = 2.5: expected a whole number"),
        (HEAD + "[rig]\npreload_N = 1" + 400 * "0", "loop.toml: rig.preload_N = 1000"),
        (HEAD + "[rig]\npreset = 1", "loop.toml: rig.preset = 1: expected text"),
        (HEAD + "[tube]\nouter_diameter_mm = nan", "loop.toml: tube.outer_diameter_mm = nan: expected a number"),
        (HEAD + "[kinematics]", "loop.toml: kinematics.file: expected the name of a CSV file"),
        (HEAD + '[kinematics]\nfile = "theory.csv"', "theory.csv: No such file or directory: expected a CSV file"),
    ],
)
def test_bad_sidecar(tmp_path: Path, toml: str, expected: str) -> None:
    assert message(put(tmp_path, BARE, toml)).startswith(expected)


def test_bom_crlf_and_blank_last_lines(tmp_path: Path) -> None:
    path = put(tmp_path, "\ufeff" + BARE.replace("\n", "\r\n") + "\r\n \r\n")
    assert read_record(path) == Record([0, 1, 0], [0, 2, 1], title="loop")
    (tmp_path / "loop.toml").write_bytes(("\ufeff" + HEAD.replace("\n", "\r\n")).encode())
    assert read_record(path).drive.tolist() == [0, 1, 0]


def test_bare_csv_picks_up_the_optional_columns(tmp_path: Path) -> None:
    csv = "time_s,cycle,drive_mm,angle_deg,tension_a_N,tension_b_N\n0,0,0,0,9,8\n1,0,1,2,7,6\n2,1,0,1,5,4\n"
    record = read_record(put(tmp_path, csv))
    assert record.time_s.tolist() == [0, 1, 2]
    assert record.cycle.tolist() == [0, 0, 1]
    assert record.cycle.dtype == np.int64
    assert record.tension_a_N.tolist() == [9, 7, 5]
    assert record.tension_b_N.tolist() == [8, 6, 4]


def test_columns_by_name(tmp_path: Path) -> None:
    path = put(tmp_path, "note,drive_mm,time_s\nx,1,1.7e9\ny,2,1.8e9\n")  # seconds of the clock
    columns = read_columns(path, ["drive_mm"], optional=["time_s", "cycle"])
    assert {name: values.tolist() for name, values in columns.items()} == {"drive_mm": [1, 2], "time_s": [1.7e9, 1.8e9]}
    with pytest.raises(RecordError, match=r"loop\.csv: column 'angle_deg' missing"):
        read_columns(path, ["angle_deg"])
    with pytest.raises(RecordError, match=r"loop\.csv:3: 0 fields: expected 1"):
        read_columns(put(tmp_path, "drive_mm\n0\n\n1\n"), ["drive_mm"])


def test_sidecar_reads_only_the_columns_it_names(tmp_path: Path) -> None:
    csv = "drive_mm,angle_deg,time_s\n0,0,noon\n1,2,noon\n0,1,noon\n"
    assert read_record(put(tmp_path, csv, HEAD)).time_s is None


def test_force_tip_and_tables(tmp_path: Path) -> None:
    toml = (
        'schema = 1\nkind = "simulated"\n[columns]\nforce = "f"\nangle = "a"\ntip = ["x", "y"]\n'
        '[tube]\nouter_diameter_mm = 1.62\n[notch]\nshape = "rectangular"\ncount = 5\n'
        '[rig]\nfile = "rigs/mine.toml"\n'
    )
    record = read_record(put(tmp_path, "f,a,x,y\n0,0,30,0\n1,5,29,2\n0,1,30,0.5\n", toml))
    assert record.drive_unit == "N"
    assert record.kind == "simulated"
    assert record.tip_mm.tolist() == [[30, 0], [29, 2], [30, 0.5]]
    assert record.tube == {"outer_diameter_mm": 1.62}
    assert record.notch == {"shape": "rectangular", "count": 5}
    assert record.rig == {"file": str((tmp_path / "rigs" / "mine.toml").resolve())}


def test_rig_file_survives_a_move_to_another_folder(tmp_path: Path) -> None:
    record = read_record(put(tmp_path, BARE, HEAD + '[rig]\nfile = "mine.toml"\n'))
    (tmp_path / "out").mkdir()
    (tmp_path / "mine.toml").write_text('name = "mine"\n')
    write_record(record, tmp_path / "out" / "copy.csv")
    assert 'file = "copy.rig.toml"' in (tmp_path / "out" / "copy.toml").read_text()  # beside it: it can be moved on
    (tmp_path / "mine.toml").unlink()
    again = read_record(tmp_path / "out" / "copy.csv")
    assert Path(again.rig["file"]).read_text() == 'name = "mine"\n'
    assert replace(again, rig=record.rig) == record


def test_kinematics_is_sorted_and_single_valued(tmp_path: Path) -> None:
    theory = tmp_path / "theory.csv"
    path = put(tmp_path, BARE, HEAD + '[kinematics]\nfile = "theory.csv"\n')
    theory.write_text("angle_deg,drive_mm\n20,1\n-20,-1\n0,0\n")
    assert read_record(path).kinematics.tolist() == [[-1, -20], [0, 0], [1, 20]]
    theory.write_text("angle_deg,drive_mm\n20,1\n-20,-1\n0,1\n")
    assert message(path) == "theory.csv:4: drive_mm = 1 occurs twice: expected one angle a drive"
    theory.write_text("angle_deg,drive_mm\n20,1\n")
    assert message(path) == "theory.csv: 1 rows: expected at least 2"


def test_sample_logged_twice_is_read_once(tmp_path: Path) -> None:
    csv = "time_s,drive_mm,angle_deg\n0,0,0\n1,1,1\n1,1,1\n2,0,0\n"
    assert read_record(put(tmp_path, csv)).time_s.tolist() == [0, 1, 2]
    different = "time_s,drive_mm,angle_deg\n0,0,0\n1,1,1\n1,1,1.5\n2,0,0\n"
    assert message(put(tmp_path, different)).startswith("loop.csv:4: column 'time_s' = 1 after 1:")
    dwell = "drive_mm,angle_deg\n0,0\n1,1\n1,1\n0,0\n"  # point by point: a repeated row is a sample
    assert len(read_record(put(tmp_path, dwell)).drive) == 4


def test_material_curve_is_no_record(measured: Path) -> None:
    with pytest.raises(RecordError, match="column 'angle_deg' missing: the columns are time_s, drive_mm, force_N"):
        read_record(measured / "niti-diamond.csv")
