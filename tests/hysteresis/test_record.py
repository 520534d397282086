"""Records: format, messages, round trip, cycles."""

import pickle
import re
from dataclasses import replace
from itertools import pairwise
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

from hysteresis.files import write_files
from hysteresis.path import branches, cycle_index, cycle_slices, find_cycles, require_reversal
from hysteresis.record import Record, RecordError
from hysteresis.record_file import read_columns, read_record, write_record

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
    return text.removeprefix(f"{path.parent}/")


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
        (BARE.replace("drive_mm", "angle_deg"), "loop.csv:1: column 'angle_deg' stands twice"),
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
    write_record(record, tmp_path / "out" / "copy.csv")
    assert 'file = "../mine.toml"' in (tmp_path / "out" / "copy.toml").read_text()
    assert read_record(tmp_path / "out" / "copy.csv") == record


def test_kinematics_is_sorted_and_single_valued(tmp_path: Path) -> None:
    theory = tmp_path / "theory.csv"
    path = put(tmp_path, BARE, HEAD + '[kinematics]\nfile = "theory.csv"\n')
    theory.write_text("angle_deg,drive_mm\n20,1\n-20,-1\n0,0\n")
    assert read_record(path).kinematics.tolist() == [[-1, -20], [0, 0], [1, 20]]
    theory.write_text("angle_deg,drive_mm\n20,1\n-20,-1\n0,1\n")
    assert message(path) == "theory.csv: drive_mm = 1 stands twice: expected one angle a drive"
    theory.write_text("angle_deg,drive_mm\n20,1\n")
    assert message(path) == "theory.csv: 1 rows: expected at least 2"


def test_sample_logged_twice_is_read_once(tmp_path: Path) -> None:
    csv = "time_s,drive_mm,angle_deg\n0,0,0\n1,1,1\n1,1,1\n2,0,0\n"
    assert read_record(put(tmp_path, csv)).time_s.tolist() == [0, 1, 2]
    different = "time_s,drive_mm,angle_deg\n0,0,0\n1,1,1\n1,1,1.5\n2,0,0\n"
    assert message(put(tmp_path, different)).startswith("loop.csv:4: column 'time_s' = 1 after 1:")
    dwell = "drive_mm,angle_deg\n0,0\n1,1\n1,1\n0,0\n"  # point by point: a repeated row is a sample
    assert len(read_record(put(tmp_path, dwell)).drive) == 4


# --- the dataclass ---------------------------------------------------------------------------------------------


def test_arrays_are_read_only_copies() -> None:
    drive = np.array([0.0, 1.0, 0.0])
    record = Record(drive, [0, 2, 1], cycle=[0, 0, 1])
    drive[0] = 9.0
    assert record.drive[0] == 0.0
    with pytest.raises(ValueError, match="read-only"):
        record.drive[0] = 1.0
    assert record.cycle.dtype == np.int64
    assert pickle.loads(pickle.dumps(record)) == record


@pytest.mark.parametrize(
    ("change", "expected"),
    [
        ({"drive": [[0.0], [1.0]]}, "record: drive: no samples"),
        ({"drive": []}, "record: drive: no samples"),
        ({"angle_deg": [0.0, 1.0]}, r"record: angle_deg: shape \(2,\): expected shape \(3,\)"),
        ({"angle_deg": None}, r"record: angle_deg: shape \(\)"),
        ({"angle_deg": [0, np.nan, 1]}, "record: angle_deg: NaN or infinite"),
        ({"time_s": [0, 1, 1]}, "record: time_s: not increasing"),
        ({"cycle": [0, 0.5, 1]}, "record: cycle: not a count"),
        ({"cycle": [1, 0, 1]}, "record: cycle: not a count"),
        ({"drive": [0, 2e9, 0]}, r"record: drive: magnitude 2e\+09: expected at most 1e\+09"),
        ({"time_s": [0, 1, 1e16]}, r"record: time_s: magnitude 1e\+16: expected at most 9"),
        ({"notches_deg": [1, 2, 3]}, r"record: notches_deg: shape \(3,\): expected shape \(3, any\)"),
        ({"tip_mm": np.zeros((3, 3))}, r"record: tip_mm: shape \(3, 3\): expected shape \(3, 2\)"),
        ({"kinematics": [[0, 0], [0, 1]]}, "record: kinematics: not increasing"),
        ({"drive_unit": "inch"}, "record: drive_unit: 'inch'"),
        ({"kind": "guess"}, "record: kind: 'guess'"),
    ],
)
def test_record_refuses(change: dict, expected: str) -> None:
    with pytest.raises(RecordError, match=f"^{expected}"):
        Record(**{"drive": [0, 1, 0], "angle_deg": [0, 2, 1], **change})


def test_equality() -> None:
    record = Record([0, 1, 0], [0, 2, 1], rig={"preload_N": 10.0})
    assert record == replace(record, source="somewhere.csv", drive_column="x")
    assert record != replace(record, angle_deg=[0, 2, 3])
    assert record != replace(record, time_s=[0, 1, 2])
    assert record != replace(record, rig={})
    assert record != "record"


# --- writing ---------------------------------------------------------------------------------------------------

finite = st.floats(-1e9, 1e9)
times = st.floats(-(2.0**53), 2.0**53)
positive = st.floats(min_value=1e-300, allow_nan=False, allow_infinity=False)
words = st.text(max_size=20)


@st.composite
def records(draw: st.DrawFn) -> Record:
    m = draw(st.integers(3, 12))

    def row(*shape: int):
        return arrays(float, (m, *shape), elements=finite)

    def increasing(n: int, values=finite):
        return st.lists(values, min_size=n, max_size=n, unique=True).map(sorted)

    def maybe(strategy):
        return draw(st.none() | strategy)

    theory = maybe(increasing(4))
    rig = st.fixed_dictionaries(
        {}, optional={"preset": words, "preload_N": positive, "joints": st.integers(1, 99), "pitch_mm": positive}
    )
    table = st.dictionaries(words, words | finite | st.integers(), max_size=3)
    return Record(
        draw(row()),
        draw(row()),
        drive_unit=draw(st.sampled_from(["mm", "deg", "step", "N"])),
        title=draw(words),
        kind=draw(st.sampled_from(["measured", "simulated"])),
        time_s=maybe(increasing(m, times)),
        cycle=maybe(st.lists(st.integers(-5, 2**40), min_size=m, max_size=m).map(sorted)),
        tension_a_N=maybe(row()),
        tension_b_N=maybe(row()),
        notches_deg=maybe(row(draw(st.integers(1, 3)))),
        tip_mm=maybe(row(2)),
        rig=draw(rig),
        tube=draw(table),
        notch=draw(table),
        kinematics=None if theory is None else np.column_stack([theory, draw(arrays(float, 4, elements=finite))]),
    )


@settings(max_examples=150)
@given(record=records())
def test_round_trip_is_exact(tmp_path_factory: pytest.TempPathFactory, record: Record) -> None:
    path = tmp_path_factory.mktemp("records") / "run-0.3hz.csv"
    write_record(record, path)
    again = read_record(path)
    assert again == record
    assert again.source == str(path)


@pytest.mark.parametrize(
    ("record", "expected"),
    [
        (Record([0, 1], [0, 1]), "loop.csv: 2 samples"),
        (Record([0, 1, 0], [0, 1, 0], rig={"name": "x"}), "loop.toml: rig.name: unknown key"),
        (Record([0, 1, 0], [0, 1, 0], tube={"outer_diameter_mm": None}), "loop.toml: tube.outer_diameter_mm = None"),
    ],
)
def test_write_refuses_what_read_would_refuse(tmp_path: Path, record: Record, expected: str) -> None:
    with pytest.raises(RecordError) as caught:
        write_record(record, tmp_path / "loop.csv")
    assert str(caught.value).removeprefix(f"{tmp_path}/").startswith(expected)
    assert list(tmp_path.iterdir()) == []


def test_write_to_no_folder_or_wrong_name(tmp_path: Path) -> None:
    record = Record([0, 1, 0], [0, 1, 0])
    (tmp_path / "file").touch()
    with pytest.raises(RecordError, match="expected a folder that can be written to"):
        write_record(record, tmp_path / "file" / "loop.csv")
    with pytest.raises(RecordError, match=r"expected a name that ends in \.csv"):
        write_record(record, tmp_path / "loop.toml")


def test_failed_write_leaves_the_old_record(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    old = Record([0, 1, 0], [0, 1, 0], title="old")
    write_record(old, tmp_path / "loop.csv")
    write_text = Path.write_text

    def full_disk(self: Path, text: str, **options: object) -> int:
        if "loop.csv" in self.name:
            write_text(self, text[:10], **options)
            raise OSError(28, "No space left on device")
        return write_text(self, text, **options)

    monkeypatch.setattr(Path, "write_text", full_disk)
    with pytest.raises(RecordError, match="No space left on device"):
        write_record(replace(old, title="new", drive=[0, 2, 0]), tmp_path / "loop.csv")
    assert read_record(tmp_path / "loop.csv") == old
    assert sorted(p.name for p in tmp_path.iterdir()) == ["loop.csv", "loop.toml"]


def test_a_folder_in_the_place_of_either_file_leaves_nothing(tmp_path: Path) -> None:
    for name in ("loop.csv", "loop.toml"):
        (tmp_path / name).mkdir()
        with pytest.raises(RecordError, match=rf"{name}: is a folder: expected the name of a file"):
            write_record(Record([0, 1, 0], [0, 1, 0]), tmp_path / "loop.csv")
        assert [path.name for path in tmp_path.iterdir()] == [name]
        (tmp_path / name).rmdir()


@pytest.mark.parametrize("failure", [PermissionError(13, "Permission denied"), KeyboardInterrupt()])
def test_a_replacement_that_fails_after_the_first_is_taken_back(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, failure: BaseException
) -> None:
    (tmp_path / "old.txt").write_text("old")
    replace_file = Path.replace

    def second_fails(self: Path, target: Path) -> Path:
        if target.name == "last.txt":
            raise failure
        return replace_file(self, target)

    monkeypatch.setattr(Path, "replace", second_fails)
    with pytest.raises((RecordError, KeyboardInterrupt)):
        write_files({tmp_path / name: "new" for name in ("old.txt", "new.txt", "last.txt")})
    assert {path.name: path.read_text() for path in tmp_path.iterdir()} == {"old.txt": "old"}


def test_only_a_sidecar_is_replaced(tmp_path: Path) -> None:
    record = Record([0, 1, 0], [0, 1, 0])
    for text in ("preload_N = 15.0\n", "schema = 1\n", "not = = toml"):
        (tmp_path / "loop.toml").write_text(text)
        with pytest.raises(RecordError, match=r"loop\.toml: not the sidecar of a record"):
            write_record(record, tmp_path / "loop.csv")
        assert [path.read_text() for path in tmp_path.iterdir()] == [text]
    (tmp_path / "loop.toml").unlink()
    write_record(record, tmp_path / "loop.csv")
    write_record(replace(record, title="again"), tmp_path / "loop.csv")
    assert read_record(tmp_path / "loop.csv").title == "again"


# --- branches and cycles ---------------------------------------------------------------------------------------


def ends(drive: np.ndarray, **options: float) -> list[int]:
    return [s.stop - 1 for s in branches(np.asarray(drive, dtype=float), **options)]


def test_branches_of_a_triangle() -> None:
    assert branches(np.array([0.0, 1, 2, 1, 0, -1, 0])) == [slice(0, 3), slice(2, 6), slice(5, 7)]
    assert ends([0, 1, 2]) == [2]
    assert ends([1, 1, 1]) == [2]
    assert ends([5]) == [0]


def test_branches_ignore_dwell_noise_and_quantisation() -> None:
    rng = np.random.default_rng(3)
    phase = np.linspace(0, 6 * np.pi, 3001)
    clean = 2.2 * np.sin(phase)
    turning = 500 * np.array([0.5, 1.5, 2.5, 3.5, 4.5, 5.5])  # samples where the sine has its extremes
    noisy = clean + rng.uniform(-0.02, 0.02, clean.size)  # 0.9 % of the range, below the 2 % of the default
    for drive in (clean, noisy, np.round(clean / 0.04) * 0.04, np.clip(clean, -2.0, 2.0)):
        found = np.array(ends(drive)[:-1])
        assert len(found) == 6
        assert np.all(np.abs(found - turning) < 80)  # |sin| > 0.89 within 80 samples of its extreme


def test_branches_tolerance() -> None:
    drive = [0, 10, 9.9, 10.5, 0]  # the dip of 0.1 is 1 % of the range
    assert ends(drive) == [3, 4]
    assert ends(drive, tolerance=0.05) == [1, 2, 3, 4]


@settings(max_examples=200)
@given(drive=arrays(float, st.integers(1, 60), elements=st.floats(-1e6, 1e6)), tolerance=st.floats(0, 1e6))
def test_branches_cover_the_path_and_run_one_way(drive: np.ndarray, tolerance: float) -> None:
    runs = branches(drive, tolerance=tolerance)
    assert runs[0].start == 0
    assert runs[-1].stop == len(drive)
    assert all(a.stop - 1 == b.start for a, b in pairwise(runs))
    ways = [np.sign(drive[s.stop - 1] - drive[s.start]) for s in runs[1:-1]]
    assert all(a == -b != 0 for a, b in pairwise(ways))
    for s, way in zip(runs[1:-1], ways, strict=True):  # never back by more than the tolerance within a run
        x = way * drive[s]
        assert np.all(np.maximum.accumulate(x) - x <= tolerance)


def cycles(drive: list[float], angle: list[float] | None = None) -> list[int]:
    return find_cycles(np.array(drive, dtype=float), np.array(angle or drive, dtype=float)).tolist()


def test_cycles_after_an_approach() -> None:
    # 0 to +2 (approach), two loops +2 -> -2 -> +2, and a last one that stays incomplete.
    drive = [0, 2, 0, -2, 0, 2, 0, -2, 0, 2, 0]
    assert cycles(drive) == [0, 0, 1, 1, 1, 1, 2, 2, 2, 2, 3]


def test_cycles_from_an_extreme() -> None:
    assert cycles([-2, 0, 2, 0, -2, 0, 2, 0, -2]) == [1, 1, 1, 1, 1, 2, 2, 2, 2]
    assert cycles([-2, 0, 2, 0, -2, 0]) == [1, 1, 1, 1, 1, 2]


def test_virgin_branch_from_an_extreme_is_an_approach() -> None:
    drive = [0, 1, 2, 1, 0, 1, 2, 1, 0]
    angle = [0, 5, 20, 15, 4, 6, 20, 15, 4]  # comes back to 4, not to the virgin 0
    assert cycles(drive, angle) == [0, 0, 0, 1, 1, 1, 1, 2, 2]
    # With a single cycle there is nothing else to look at.
    assert cycles(drive[:5], angle[:5]) == [1] * 5


def test_one_loop_from_the_middle() -> None:
    assert cycles([0, 1, 2, 1, 0, -1, -2, -1, 0]) == [1] * 9
    assert cycles([0, 1, 2, 1, 0, -1, -2]) == [0, 0, 0, 1, 1, 1, 1]
    assert cycles([0, 1, 2]) == [0, 0, 0]


def test_cycle_column_goes_first() -> None:
    record = Record([0, 1, 0, 1], [0, 1, 0, 1], cycle=[3, 3, 4, 4])
    assert cycle_index(record).tolist() == [3, 3, 4, 4]
    assert cycle_slices(record.drive, record.cycle) == [(3, slice(0, 2)), (4, slice(2, 4))]  # 1 -> 0 is a reset
    small = Record([0, 1, 2, 1, 0], [0, 1, 2, 1, 0], cycle=[0, 0, 0, 1, 1])
    assert cycle_slices(small.drive, small.cycle) == [(0, slice(0, 3)), (1, slice(2, 5))]


def test_reset_between_trials_is_no_reversal() -> None:
    loading = Record([0, 1, 2, 0, 1, 2], [0, 5, 9, 0, 5, 9], drive_unit="N", cycle=[1, 1, 1, 2, 2, 2])
    with pytest.raises(RecordError, match="record: drive 'drive' never reverses: expected a loop"):
        require_reversal(loading)
    require_reversal(replace(loading, cycle=None))  # without numbers it is a way back
    require_reversal(Record([0, 1, 2, 1, 0], [0, 1, 2, 1, 0], cycle=[0, 0, 0, 1, 1]))


# --- real records ----------------------------------------------------------------------------------------------

# Branches, cycle numbers: from the README of the records ("3 cycles and the virgin branch", "one closed loop",
# "sine of seven decaying amplitudes", "5 and 3 trials") and, for the da Vinci tool, from rate times duration.
COUNTS = {
    "surgical-manipulator-0-80": (7, {0, 1, 2, 3}),
    "surgical-manipulator-feedforward": (8, {0, 1, 2, 3, 4}),
    "tee-probe-antero-posterior": (3, {1}),
    "catheter-taut-0.1hz": (14, set(range(8))),
    "catheter-taut-0.5hz": (14, set(range(8))),
    "catheter-slack-0.1hz": (14, set(range(8))),
    "catheter-slack-0.3hz": (14, set(range(8))),
    "tendon-robot-zero-0.10hz": (14, set(range(1, 8))),
    "tendon-robot-zero-0.30hz": (14, set(range(8))),
    "tendon-robot-mean-0.02hz": (6, {0, 1, 2, 3}),
    "davinci-tool-load050-0.1hz": (4, {1, 2}),
    "davinci-tool-load050-0.3hz": (12, set(range(1, 7))),
    "davinci-tool-load010-0.1hz": (4, {0, 1, 2}),
    "notched-wrist-90": (9, {1, 2, 3, 4, 5}),
    "notched-wrist-150": (5, {1, 2, 3}),
}


@pytest.mark.parametrize("stem", COUNTS)
def test_cycles_of_measured_records(measured: Path, stem: str) -> None:
    record = read_record(measured / f"{stem}.csv")
    runs, numbers = COUNTS[stem]
    assert len(branches(record.drive)) == runs
    assert set(cycle_index(record).tolist()) == numbers


def test_every_measured_record_reads_and_round_trips(measured: Path, tmp_path: Path) -> None:
    for sidecar in sorted(measured.glob("*.toml")):
        record = read_record(sidecar.with_suffix(".csv"))
        write_record(record, tmp_path / f"{sidecar.stem}.csv")
        assert read_record(tmp_path / f"{sidecar.stem}.csv") == record
        if record.drive_unit == "N":
            with pytest.raises(RecordError, match="'tendon_force_N' never reverses"):
                require_reversal(record)
        else:
            require_reversal(record)


def test_material_curve_is_no_record(measured: Path) -> None:
    with pytest.raises(RecordError, match="column 'angle_deg' missing: the columns are time_s, drive_mm, force_N"):
        read_record(measured / "niti-diamond.csv")


def test_virgin_branch_of_the_surgical_manipulator(measured: Path) -> None:
    record = read_record(measured / "surgical-manipulator-0-80.csv")
    virgin = record.drive[cycle_index(record) == 0]
    assert virgin[0] == pytest.approx(0, abs=1e-3)  # the README: sine 0..80 deg
    assert virgin[-1] == 80
    assert len(record.drive) == 8085 - 11  # rows of the file less the samples it logs twice
