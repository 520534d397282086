"""Records, their files, marks and plain values by their definitions."""

import os
import sys
import types
import zlib
from dataclasses import dataclass

import numpy as np
import pytest

from hysteresis import extras, files, messages, own, plain
from hysteresis.display import html_table
from hysteresis.files import RecordError
from hysteresis.records.record import Record
from hysteresis.records.record_file import (
    check_target,
    files_of_record,
    read_columns,
    read_record,
    read_records,
    write_record,
)
from hysteresis.records.sidecar import bare_columns, check_rig_tables, is_sidecar, read_sidecar, toml

NOBODY = 99_999_999
"""A process that no machine has: its number is above the largest one."""


# --- records -------------------------------------------------------------------------------------------------------


def test_columns_are_named_with_the_unit_of_the_drive():
    three, six = np.arange(3.0), np.arange(9.0).reshape(3, 3)
    by_force = Record(three, three, drive_unit="N", drive_2=three, drive_4=three, tip_mm=six, notches_deg=six[:, :2])
    assert by_force.column_names() == {
        "force": "force_N", "angle": "angle_deg", "drive_2": "drive_2_N", "drive_4": "drive_4_N",
        "notches": ["notch_1_deg", "notch_2_deg"], "tip": ["tip_x_mm", "tip_y_mm", "tip_z_mm"],
    }  # fmt: skip
    by_steps = Record(three, three, drive_unit="step", drive_3=three, tip_mm=six[:, :2])
    assert list(by_steps.columns()) == ["drive_step", "angle_deg", "drive_3_step", "tip_x_mm", "tip_y_mm"]
    assert by_steps.columns()["tip_y_mm"].tolist() == [1, 4, 7]
    assert bare_columns(["angle_deg", "drive_3_mm", "drive_2", "force_N"]) == {
        "drive": ["drive_mm"], "angle": ["angle_deg"], "drive_3": ["drive_3_mm"],
    }  # fmt: skip


def test_a_record_for_a_notebook_shows_what_it_has():
    three = np.array([0.0, 1.0, 2.5])
    plain_one = Record(three, 2 * three)._repr_html_()
    rows = [("kind", "measured"), ("samples", "3"), ("drive", "0 to 2.5 mm"), ("angle", "0 to 5 deg")]
    assert plain_one == html_table("record", [*rows, ("columns", "drive_mm, angle_deg")])
    whole = Record(
        three, 2 * three, title="t", time_s=three + 1, cycle=[3, 4, 4], tube={"a": 1, "b": "x"}, source="f.csv"
    )  # fmt: skip
    rows += [("time", "1 to 3.5 s"), ("cycles", "3 to 4"), ("columns", "time_s, cycle, drive_mm, angle_deg")]
    assert whole._repr_html_() == html_table("t", [*rows, ("tube", "a = 1, b = x"), ("file", "f.csv")])


def test_arrays_of_a_record_have_its_length_and_records_differ_by_any_value():
    three = np.arange(3.0)
    for change in ({"notches_deg": np.zeros((2, 4))}, {"notches_deg": np.zeros((3, 0))}, {"tip_mm": np.zeros((2, 3))}):
        with pytest.raises(RecordError, match="expected shape"):
            Record(three, three, **change)
    one = Record(three, three, title="a", time_s=three, kinematics=[[0, 1], [1, 1]])
    assert one.kinematics.tolist() == [[0, 1], [1, 1]]
    assert Record(three, three, tip_mm=np.zeros((3, 2))) != Record(three, three, tip_mm=np.zeros((3, 3)))
    assert one != Record(three, three, title="b", time_s=three, kinematics=[[0, 1], [1, 1]])
    assert one != Record(three, three, title="a", kinematics=[[0, 1], [1, 1]])
    assert Record(three, three, rig={"preload_N": 1}) == Record(three, three, rig={"preload_N": 1.0})


# --- files of records ----------------------------------------------------------------------------------------------


def test_a_column_has_one_role_in_a_sidecar(tmp_path):
    path = tmp_path / "a.toml"
    head = 'schema = 1\n[columns]\ndrive = "x"\nangle = "a"\n'
    path.write_text(head + 'tip = ["u", "v", "w"]\nnotches = ["n"]\n')
    found = read_sidecar(path)
    assert found.columns == {"drive": ["x"], "angle": ["a"], "tip": ["u", "v", "w"], "notches": ["n"]}
    assert (found.drive_unit, found.kind, found.title) == ("mm", "measured", None)
    for line, words in (
        ('time = "x"', "columns.time = 'x': is columns.drive: expected another"),
        ('tip = ["u", "u"]', "columns.tip = 'u': is columns.tip: expected another"),
        ('tip = ["u", "v", "w", "z"]', "expected two columns"),
        ("notches = []", "columns.notches = []: expected a list"),
        ('notches = ["n", 1]', "expected a list of column names"),
    ):
        path.write_text(head + line)
        with pytest.raises(RecordError) as error:
            read_sidecar(path)
        assert words in str(error.value)
    for text, good in (("schema = 1\n[columns]", True), ("schema = 1", False), ("[columns]", False), ("=", False)):
        path.write_text(text)
        assert is_sidecar(path) is good


def test_keys_and_values_of_a_toml_file():
    text = toml({"a_1": -2, "é": False, "1b": [1, "x", [0.5]], "t": {"u": True}, "v": {"w": 1e300}, "last": 3})
    assert text == 'a_1 = -2\n"é" = false\n"1b" = [1, "x", [0.5]]\nlast = 3\n\n[t]\nu = true\n\n[v]\nw = 1e+300\n'


def test_values_of_a_tube_are_numbers_or_text():
    check_rig_tables("f", {"tube": {"a": -1, "b": "x"}, "notch": {"depth_mm": [1, 2.0], "shape": "v"}})
    check_rig_tables("f", {"rig": {"joints": 2, "preload_N": 1e-9, "file": "x.toml"}})
    for tables, words in (
        ({"tube": {"a": True}}, r"tube\.a = True: expected a number or text"),
        ({"tube": {"a": [1.0]}}, r"tube\.a = \[1\.0\]: expected a number or text"),
        ({"notch": 3}, r"notch = 3: expected a table"),
        ({"notch": {"a": [1, None]}}, r"notch\.a of notch 2 = None: expected a number"),
        ({"rig": {"joints": "2"}}, r"rig\.joints = '2': expected a whole number of at least 1"),
    ):
        with pytest.raises(RecordError, match=words):
            check_rig_tables("f", tables)


def test_what_a_csv_lacks_of_a_record_is_said(tmp_path):
    path = tmp_path / "a.csv"
    for header, words in (
        ("# x,angle_deg", "begins with a comment: "), ("% x", "begins with a comment: "),
        ("// x", "begins with a comment: "), ("drive_mm;angle_deg", "has no commas: "), ("a b", "has no commas: "),
        ("a\tb", "has no commas: "), ("a", "--drive-column NAME"), ("a b,c", "--drive-column NAME"),
        ("drive_mm,a", "column 'angle_deg' missing: the columns are drive_mm, a: "),
    ):  # fmt: skip
        path.write_text(header + "\n" + ",".join("0" * (header.count(",") + 1)))
        with pytest.raises(RecordError) as error:
            read_record(path)
        assert words in str(error.value)


def test_a_thousand_columns_and_two_without_a_name_are_read(tmp_path):
    path = tmp_path / "a.csv"
    path.write_text(",".join(["drive_mm", "", ' "b" ', "", *(f"c{i}" for i in range(996))]) + "\n" + "1," * 999 + "2\n")
    found = read_columns(path, ["c995", "b"], ["none", "c0"])
    assert {name: column.tolist() for name, column in found.items()} == {"c995": [2.0], "b": [1.0], "c0": [1.0]}
    path.write_text(",".join(f"c{i}" for i in range(1001)) + "\n")
    with pytest.raises(RecordError, match="1,001 columns: expected at most 1,000"):
        read_columns(path, [])


def test_a_theory_of_two_rows_and_a_rig_in_a_folder_below_are_kept(tmp_path):
    (tmp_path / "rigs").mkdir()
    (tmp_path / "rigs" / "r.toml").write_text("x = 1\n")
    three = np.array([0.0, 1.0, 0.0])
    rig = {"file": str(tmp_path / "rigs" / "r.toml")}
    record = Record(three, three, title="", rig=rig, kinematics=[[0.0, 1.0], [2.0, 3.0]])
    path = tmp_path / "a.csv"
    write_record(record, path)
    again = read_record(path)
    assert again == record
    assert (again.source, again.drive_column) == (str(path), "drive_mm")
    assert 'file = "rigs/r.toml"' in (tmp_path / "a.toml").read_text()
    made = {one.name for one in tmp_path.iterdir() if one.is_file()}
    assert made == {"a.csv", "a.toml", "a.kinematics.csv"}
    assert {one.name for one in files_of_record(path)} == made | {"a.rig.toml"}
    assert path.read_text() == "drive_mm,angle_deg\n0.0,0.0\n1.0,1.0\n0.0,0.0\n"
    with pytest.raises(RecordError, match=r"columns\.drive_2: missing"):
        read_records([path], plane=2)


def test_neither_the_csv_nor_the_sidecar_of_a_new_record_is_one_of_its_inputs(tmp_path):
    path = tmp_path / "a.csv"
    check_target(path, [tmp_path / "b.csv", tmp_path / "b.toml"])
    for name in ("a.csv", "a.toml"):
        with pytest.raises(RecordError, match=f"writing {name} would replace the input"):
            check_target(path, [tmp_path / "b.csv", tmp_path / "." / name])
    path.write_text("x")
    os.link(path, tmp_path / "c.csv")
    with pytest.raises(RecordError, match=r"writing a\.csv would replace the input"):
        check_target(path, [tmp_path / "c.csv"])
    for name, good in (("d.CSV", True), ("d.txt", False)):
        if good:
            check_target(tmp_path / name)
        else:
            with pytest.raises(RecordError, match=r"ends in \.csv"):
                check_target(tmp_path / name)


# --- words ---------------------------------------------------------------------------------------------------------


def test_a_list_of_names_is_whole_where_it_fits():
    assert messages.listed(["a", "b"]) == "a, b"
    assert messages.listed(["a" * 8] * 20, 150) == ", ".join(["a" * 8] * 13) + " and 7 more"  # 13 times 10: 130
    names = ["a" * 9, *["a" * 8] * 19]  # 13 of them: 131
    assert messages.listed(names, 150) == ", ".join(names[:12]) + " and 8 more"


def test_integers_of_fourteen_thousand_bits_have_digits():
    assert messages.quoted(2**13_999).startswith("131")  # 10 to the power 13,999 times 0.3010300 less 4,214
    assert messages.quoted(2**13_999).endswith("...")
    assert messages.quoted(-(2**14_000)) == "an integer of 14001 bits"


# --- files ---------------------------------------------------------------------------------------------------------


def test_what_dead_processes_staged_for_a_file_is_removed_and_nothing_else(tmp_path):
    path = tmp_path / "a.csv"
    dead = [f".a.csv.{NOBODY}.part", f".a.csv.{NOBODY}.old", f".a.csv.{10**30}.part"]
    kept = [
        f".a.csv.{os.getppid()}.part", ".a.csv.12x.part", f".a.csv.{NOBODY}.tmp", f".b.csv.{NOBODY}.part",
        f"a.csv.{NOBODY}.part", f".a.csv.{NOBODY}.part.part",
    ]  # fmt: skip
    for name in (*dead, *kept):
        (tmp_path / name).write_text("x")
    folder = tmp_path / f".a.csv.{NOBODY - 1}.part"
    folder.mkdir()
    (folder / "inner").write_text("x")
    files.write_files({path: b"new"})
    assert sorted(one.name for one in tmp_path.iterdir()) == sorted([path.name, *kept])
    assert path.read_bytes() == b"new"


def test_processes_that_run_are_told_from_others():
    assert files._runs(os.getpid())
    assert files._runs(1)
    assert not files._runs(NOBODY)
    assert not files._runs(10**30)


def test_a_place_is_checked_before_anything_is_made(tmp_path):
    files.require_place(tmp_path / "a" / "b" / "c.csv")
    assert list(tmp_path.iterdir()) == []
    (tmp_path / "file").write_text("x")
    files.require_place(tmp_path / "file")
    with pytest.raises(RecordError, match=r"file.c\.csv: Not a directory"):
        files.require_place(tmp_path / "file" / "c.csv")
    (tmp_path / "link").symlink_to(tmp_path / "nowhere")
    with pytest.raises(RecordError, match=r"link: is no folder"):
        files.require_place(tmp_path / "link" / "b" / "c.csv")
    with pytest.raises(RecordError, match=r"too long"):
        files.require_place(tmp_path / ("x" * 300))
    asked = []
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(files.os, "access", lambda folder, mode: asked.append((folder, mode)))
        with pytest.raises(RecordError, match="cannot be written to"):
            files.require_place(tmp_path / "c.csv")
    assert asked == [(tmp_path, os.W_OK | os.X_OK)]


def test_sizes_in_messages_are_in_binary_megabytes(tmp_path):
    path = tmp_path / "a.csv"
    with path.open("wb") as file:
        file.truncate(3 * 2**19)
    with pytest.raises(RecordError, match=r"a\.csv: 1\.5 MB: expected a table, at most 1 MB"):
        files.read_bytes(path, "a table", most=2**20)
    assert len(files.read_bytes(path, "a table", most=3 * 2**19)) == 3 * 2**19


def test_json_is_sixteen_levels_deep_at_most(tmp_path):
    path = tmp_path / "a.json"
    for levels, good in ((16, True), (17, False)):
        for opened, closed in (("[", "]"), ('{"a":', "}")):
            path.write_text(opened * levels + "1" + closed * levels)
            if good:
                files.read_json(path, "values")
            else:
                with pytest.raises(RecordError, match="at most 16 levels"):
                    files.read_json(path, "values")
    path.write_text(r'["\u00e9", "\ud83d\ude00"]')
    assert files.read_json(path, "values") == ["\u00e9", "\U0001f600"]
    path.write_text(r'["\ud83d"]')
    with pytest.raises(RecordError, match="not JSON"):
        files.read_json(path, "values")


def test_two_keys_of_many_parts_are_refused_at_any_length(tmp_path):
    path = tmp_path / "a.toml"
    path.write_text(".".join("a" * 40) + " = 1")
    with pytest.raises(RecordError, match="at most 16 parts"):
        files.read_toml(path, "values")


def test_old_copies_are_gone_after_files_are_replaced(tmp_path):
    old, new = tmp_path / "old", tmp_path / "new"
    old.write_text("before")
    files.write_files({old: "after", new: "after"})
    assert sorted(one.name for one in tmp_path.iterdir()) == ["new", "old"]
    assert (old.read_text(), new.read_text()) == ("after", "after")


# --- marks ---------------------------------------------------------------------------------------------------------


def test_a_mark_in_a_picture_has_the_checksum_of_its_kind_and_text():
    """A chunk of a PNG: length of the text, kind, text, and the CRC of the last two."""
    head = b"\x89PNG\r\n\x1a\n" + bytes(25)
    chunk = own.marked_png(head + b"rest")[len(head) : -len(b"rest")]
    length = int.from_bytes(chunk[:4], "big")
    assert len(chunk) == 4 + 4 + length + 4
    assert chunk[4 : 8 + length] == b"tEXtSoftware\0notchbend"
    assert int.from_bytes(chunk[-4:], "big") == zlib.crc32(chunk[4:-4])


@pytest.mark.parametrize(
    ("maker", "kind", "mine"),
    [("notchbend", "simulated", True), ("notchbend 1.2", "simulated", True), ("notchbend", "measured", False),
     ("camera", "simulated", False)],
)  # fmt: skip
def test_a_record_is_own_where_its_sidecar_says_that_it_was_simulated(tmp_path, maker, kind, mine):
    sidecar, table = tmp_path / "a.toml", tmp_path / "a.csv"
    sidecar.write_text(f'maker = "{maker}"\nkind = "{kind}"\n')
    assert own.is_own(sidecar) is mine
    table.write_text("drive,angle_deg,f_alone_deg,predicted_deg,\n")
    assert own.is_own(table) is mine
    sidecar.unlink()
    assert own.is_own(table)
    assert not own.is_own(tmp_path / "b.csv")


def test_each_kind_of_file_has_its_own_mark(tmp_path):
    marks = {
        "a.json": b' {"maker": "notchbend", "x": 1}',
        "a.html": own.marked_page("<head></head>").encode(),
        "a.png": own.marked_png(b"\x89PNG\r\n\x1a\n" + bytes(25)),
        "a.pdf": own.marked_pdf(b""),
        "a.xml": b"<mujoco model='a'>\n <!-- made by notchbend -->",
    }
    for name in marks:
        for other in marks:
            path = tmp_path / f"{other.split('.')[1]}.{name.split('.')[1]}"
            path.write_bytes(marks[other])
            assert own.is_own(path) is (other == name)
    (tmp_path / "a.zarr").mkdir()
    assert not own.is_own(tmp_path / "a.zarr")
    (tmp_path / "a.zarr" / "zarr.json").write_text('{"attributes": {"maker": "notchbend"}}')
    assert own.is_own(tmp_path / "a.zarr")
    (tmp_path / "short.pdf").write_bytes(b"%")
    assert not own.is_own(tmp_path / "short.pdf")


def test_a_file_without_a_mark_is_own_where_a_marked_one_names_it(tmp_path):
    paths = [tmp_path / name for name in ("z.txt", "absent.txt", "next.py", "a.txt", "trace.json")]
    for path in paths:
        if path.stem != "absent":
            path.write_text("x")
    assert own.foreign(paths) == [paths[0], paths[2], paths[3], paths[4]]
    paths[-1].write_text('{"maker": "notchbend", "next": "next.py"}')
    assert own.foreign(paths) == [paths[0], paths[3]]


# --- plain values --------------------------------------------------------------------------------------------------


@dataclass(frozen=True)
class Part:
    """A result with a key of another name, one that may be absent and one that may be None."""

    start: float = plain.named("from")
    width: float | None = plain.optional()
    none: float | None = None
    numbers: tuple[int, ...] = ()

    def __post_init__(self):
        if self.start < 0:
            raise ValueError("from below 0")


def test_only_an_optional_field_is_absent_where_it_is_none():
    assert plain.to_plain(Part(1.0)) == {"from": 1.0, "none": None, "numbers": []}
    full = Part(1.0, 2.0, 3.0, (4, 5))
    assert plain.to_plain(full) == {"from": 1.0, "width": 2.0, "none": 3.0, "numbers": [4, 5]}
    assert plain.from_plain(Part, plain.to_plain(full)) == full
    assert plain.from_plain(Part, {"from": 1, "other": 2}) == Part(1)
    assert plain.to_plain(Part) is Part
    found = plain.to_plain({"a": [np.float64(np.inf), np.array([-np.inf, 1.0])]}, finite=False)
    assert found == {"a": [np.inf, [-np.inf, 1.0]]}
    assert plain.to_plain(Part(1.0, np.inf, 2.0)) == {"from": 1.0, "width": None, "none": 2.0, "numbers": []}


def test_an_error_of_plain_values_says_where_it_is():
    for values, where, words in (
        (3, "", "Part: 3: expected a table"), (3, "f", "f: 3: expected a table"), ({}, "", "from: missing"),
        ({}, "f", "f: from: missing"), ({"from": -1.0}, "", "from below 0"), ({"from": -1.0}, "f", "f: from below 0"),
        ({"from": 1, "numbers": [1, 2, "x"]}, "f", "f: numbers[2]: 'x': expected a whole number"),
    ):  # fmt: skip
        with pytest.raises(RecordError) as error:
            plain.from_plain(Part, values, where)
        assert str(error.value) == words


# --- small parts ---------------------------------------------------------------------------------------------------


def test_a_table_has_a_header_cell_in_each_row():
    left = 'style="text-align:left"'
    assert html_table("c", [("a", "1", "<"), ("b",)], ("h", "&")).split("\n") == [
        "<table>",
        f"<caption {left}>c</caption>",
        "<thead><tr><th>h</th><th>&amp;</th></tr></thead>",
        f"<tr><th {left}>a</th><td {left}>1</td><td {left}>&lt;</td></tr>",
        f"<tr><th {left}>b</th></tr>",
        "</table>",
    ]


def test_the_first_library_of_an_extra_that_is_missing_is_named(monkeypatch):
    monkeypatch.setitem(extras.EXTRAS, "three", ("numpy", "no_such_library", "no_other_library"))
    with pytest.raises(
        extras.MissingError, match=r"^no_such_library is not installed: expected for a use: .*\[three\]"
    ):
        extras.require_extra("three", "a use")
    monkeypatch.setitem(sys.modules, "no_such_library", types.ModuleType("no_such_library"))
    assert not extras._is_installed("no_such_library")
    monkeypatch.setitem(extras.EXTRAS, "three", ("numpy",))
    extras.require_extra("three", "a use")
