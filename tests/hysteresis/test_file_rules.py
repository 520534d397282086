"""Values of records and files, messages, plain values and marks, by definition."""

import math

import numpy as np
import pytest

from hysteresis import files, messages, own, plain
from hysteresis.display import from_to, html_table
from hysteresis.files import RecordError
from hysteresis.records.record import Record, bad_cycles
from hysteresis.records.record_file import _parse, _without_repeats, read_record
from hysteresis.records.rows import check_list, is_number, table_of_rows
from hysteresis.records.sidecar import check_rig_tables, toml


def cycles_of(count, samples=11, first=1):
    """Cycles from -1 to 1 and back."""
    up = np.linspace(-1, 1, samples)
    one = np.r_[up, up[::-1][1:]]
    drive = np.r_[one, *[one[1:]] * (count - 1)]
    return drive, np.r_[first, np.repeat(np.arange(count) + first, one.size - 1)]


# --- values of records and files -----------------------------------------------------------------------------------


def test_limits_of_values():
    for value, good in ((1e9, True), (1.001e9, False)):
        if good:
            assert Record(np.array([0.0, value]), np.zeros(2)).drive[1] == value
        else:
            with pytest.raises(RecordError, match=r"drive: magnitude 1\.001e\+09: expected at most 1e\+09"):
                Record(np.array([0.0, -value]), np.zeros(2))
    assert Record(np.zeros(2), np.zeros(2), time_s=np.array([0.0, 2.0**53])).time_s[1] == 2.0**53
    with pytest.raises(RecordError, match="time_s: magnitude"):
        Record(np.zeros(2), np.zeros(2), time_s=np.array([0.0, 2.0**53 + 2]))
    assert bad_cycles(np.array([0.0, 1, 1, 0.5, 2, 1, -1])).tolist() == [False, False, False, True, False, True, True]
    assert bad_cycles(np.array([-1.0])).tolist() == [False]
    assert bad_cycles(np.array([2.0**53])).tolist() == [True]


def test_rows_of_notches_are_repeated_and_counted():
    rows = [{"depth_mm": 1.0, "width_mm": 2.0, "count": 2}, {"depth_mm": 1.5, "width_mm": 2.0}]
    assert table_of_rows("f", "notch", rows) == {"count": 3, "depth_mm": [1.0, 1.0, 1.5], "width_mm": 2.0}
    assert table_of_rows("f", "notch", [{"a": 1.0, "count": 1000}]) == {"count": 1000, "a": 1.0}
    for bad, words in (
        ([{"a": 1.0, "count": 999}, {"a": 1.0, "count": 2}], "row 2: count = 2"),
        ([{"a": 1.0, "count": 0}], "row 1: count = 0"),
        ([{"a": 1.0}] * 1001, "1,001 rows"),
        ([], "0 rows"),
        ([{"a": 1.0}, {"a": "x"}], r"row 2: a = 'x': expected a number"),
        ([{"a": 1.0}, {}], "row 2: a: missing"),
        ([{"a": 1.0}, {"a": 1.0, "b": 1.0}], "row 2: b = 1.0: expected the keys of row 1"),
        ([{"a": True}, {"a": False}], "row 2: a = False: expected True, as of row 1"),
        ([{"a": "x"}, {"a": "y"}], "row 2: a = 'y': expected 'x', as of row 1"),
    ):
        with pytest.raises(RecordError, match=words):
            table_of_rows("f", "notch", bad)
    assert [is_number(v) for v in (1, 1.5, True, "1", math.inf, 10**400)] == [True, True, False, False, False, False]
    check_list("a", [1.0] * 1000)
    for bad, words in (([], "0 numbers"), ([1.0] * 1001, "1,001 numbers"), ([1.0, "x"], "a of notch 2 = 'x'")):
        with pytest.raises(RecordError, match=words):
            check_list("a", bad)


@pytest.mark.parametrize(
    ("rig", "good"),
    [
        ({"preload_N": 1}, True), ({"preload_N": 0}, False), ({"preload_N": "1"}, False), ({"joints": 1}, True),
        ({"joints": 0}, False), ({"joints": 1.5}, False), ({"joints": True}, False), ({"preset": "x"}, True),
        ({"preset": 1}, False), ({"other": 1}, False),
    ],
)  # fmt: skip
def test_values_of_a_rig(rig, good):
    if good:
        check_rig_tables("f", {"rig": rig})
    else:
        with pytest.raises(RecordError, match=r"f: rig\."):
            check_rig_tables("f", {"rig": rig})


def test_toml_of_plain_values():
    text = toml({"a": 1, "b c": [1.5, True], "t": {"x": "y\x7f"}, "none": {}, "f": np.float64(2)})
    assert text == 'a = 1\n"b c" = [1.5, true]\nf = 2.0\n\n[t]\nx = "y\\u007f"\n'


def test_cells_and_rows_of_a_csv(tmp_path):
    path = tmp_path / "a.csv"

    def parse(*rows, wanted=("b",), clocks=()):
        return _parse(path, ["a", "b"], list(rows), list(wanted), clocks)

    assert parse("1,2", "3,4", wanted=("b", "a", "b"))["b"].tolist() == [2, 4]
    assert parse()["b"].size == 0
    assert parse("1," + "0" * 99 + "2")["b"].tolist() == [2]
    assert parse("x" * 200 + ",2")["b"].tolist() == [2]  # columns that are not wanted may hold anything
    assert parse("1,2e9", clocks=("b",))["b"].tolist() == [2e9]
    for rows, words in (
        (["1,2", "3"], "a.csv:3: 1 fields: expected 2"),
        (["1,2", " "], "a.csv:3: 0 fields: expected 2"),
        (["1,2", "3,4,5"], "a.csv:3: 3 fields: expected 2"),
        (["1," + "0" * 100 + "2"], "a.csv:2: column 'b': 101 characters: expected at most 100"),
        (["1,2", "3,x"], "a.csv:3: column 'b' = 'x': expected a number"),
        (["1,2", "3,1_0"], "a.csv:3: column 'b' = '1_0': expected a number"),
        (["1,2", "3,nan"], "a.csv:3: column 'b' = nan: expected a finite number"),
        (["1,2e9"], r"a.csv:2: column 'b' = 2e9: expected at most 1e\+09 in magnitude"),
    ):
        with pytest.raises(RecordError, match=words):
            parse(*rows)


def test_rows_that_were_logged_twice_are_read_once(tmp_path):
    path = tmp_path / "a.csv"
    path.write_text("time_s,drive_mm,angle_deg\n0,1,2\n0,1,2\n1,2,3\n2,3,4\n")
    assert read_record(path).time_s.tolist() == [0, 1, 2]
    columns = {"time": ["t"]}
    with pytest.raises(RecordError, match=r"a\.csv:4: column 't' = 0 after 0: expected increasing time"):
        _without_repeats(path, ["0", "1", "2", "3"], {"t": np.array([-1.0, 0, 0, 1])}, columns)
    with pytest.raises(RecordError, match="2 samples: expected at least 3"):
        _without_repeats(path, ["0", "0", "1"], {"t": np.array([0.0, 0, 1])}, columns)
    with pytest.raises(RecordError, match=r"a\.csv:4: column 'c' = 1: expected a whole number that never falls"):
        _without_repeats(path, ["0", "1", "2"], {"c": np.array([1.0, 2, 1])}, {"cycle": ["c"]})


# --- messages, plain values, marks ---------------------------------------------------------------------------------


def test_texts_are_cut_where_they_are_long():
    assert messages.quoted("a" * 78) == repr("a" * 78)
    assert messages.quoted("a" * 79) == repr("a" * 79)[:77] + "..."
    assert messages.as_given("a" * 80) == "a" * 80
    assert messages.as_given("a" * 81) == "a" * 77 + "..."
    assert messages.as_given("a\n") == repr("a\n")
    assert messages.quoted(2**14000) == "an integer of 14001 bits"
    assert messages.quoted([[[[[1]]]]]) == "[[[[...]]]]"
    assert messages.listed(["ab"] * 38, 150) == ", ".join(["ab"] * 38)  # 150 characters
    shown = messages.listed(["ab"] * 39, 150)
    assert shown == ", ".join(["ab"] * 32) + " and 7 more"  # 32 of 4 characters: 128 of 130
    assert messages.listed(["a" * 80, "b"], 20) == "a" * 80 + " and 1 more"
    assert messages.one_line(" a \n b\x00") == "a b\\x00"
    assert messages.one_line("x" * 280) == "x" * 280
    cut = messages.one_line("x" * 200 + "y" * 200)
    assert cut == "x" * 182 + " ... " + "y" * 93
    assert len(cut) == 280


def test_limits_of_plain_values():
    read = lambda kind, value: plain._read(kind, value, "w")  # noqa: E731
    assert read(int, 2**63) == 2**63
    assert read(float, 1e30) == 1e30
    assert read(float, math.inf) == math.inf
    assert math.isnan(read(float, None))
    for kind, value, words in (
        (int, 2**63 + 1, "at most 64 bits"),
        (int, -(2**63) - 1, "at most 64 bits"),
        (int, True, "a whole number"),
        (int, 1.0, "a whole number"),
        (float, 1.1e30, "in magnitude"),
        (bool, 1, "true or false"),
        (str, 1, "text"),
        (tuple[int, int], [1], "a list of 2"),
        (tuple[int, ...], 1, "a list"),
    ):
        with pytest.raises(RecordError, match=words):
            read(kind, value)
    assert read(bool, True) is True
    assert read(tuple[int, ...], [1, 2, 3]) == (1, 2, 3)
    assert plain._array(float, [1e30, math.nan], "w").shape == (2,)
    for value in ([1.1e30], 1.1e30):
        with pytest.raises(RecordError, match="in magnitude"):
            plain._array(float, value, "w")
    assert plain.to_plain({"a": (1, math.inf), "b": np.array([1.5])}) == {"a": [1, None], "b": [1.5]}
    assert plain.to_plain(math.inf, finite=False) == math.inf


def test_marks_of_pictures_and_pages():
    head = b"\x89PNG\r\n\x1a\n" + bytes(25)
    png = own.marked_png(head + b"rest")
    text = b"tEXtSoftware\0notchbend"
    assert png[:33] == head
    assert png[33:37] == (18).to_bytes(4, "big")
    assert png[37 : 37 + len(text)] == text
    assert png.endswith(b"rest")
    assert len(png) == 33 + 4 + len(text) + 4 + 4
    assert own.marked_png(png) == png
    assert own.marked_png(b"other") == b"other"
    assert own.marked_page("<head></head><head>").count("generator") == 1
    pdf = own.marked_pdf(b"x")
    assert own.marked_pdf(pdf) == pdf != b"x"


def test_files_carry_their_marks_in_their_first_and_last_bytes(tmp_path):
    pdf = tmp_path / "a.pdf"
    pdf.write_bytes(own.marked_pdf(b"x" * 5000))
    assert own.is_own(pdf)
    pdf.write_bytes(own.marked_pdf(b"x") + b"y")
    assert not own.is_own(pdf)
    page = tmp_path / "a.html"
    for before, mine in ((4096 - 43, True), (4096, False)):
        page.write_bytes(b" " * before + b'<meta name="generator" content="notchbend">')
        assert own.is_own(page) is mine


def test_files_are_read_within_limits(tmp_path):
    path = tmp_path / "a.toml"
    path.write_bytes(b"x" * 10)
    assert files.read_bytes(path, "y", most=10) == b"x" * 10
    with pytest.raises(RecordError, match=r"0\.0 MB: expected y, at most 0 MB"):
        files.read_bytes(path, "y", most=9)
    deep = lambda levels: "a = " + "[" * levels + "]" * levels  # noqa: E731
    path.write_text(deep(15))
    files.read_toml(path, "y")
    path.write_text(deep(16))
    with pytest.raises(RecordError, match="nested too deep: expected at most 16 levels"):
        files.read_toml(path, "y")
    path.write_text(".".join("a" * 16) + " = 1")
    files.read_toml(path, "y")
    path.write_text(".".join("a" * 17) + " = 1")
    with pytest.raises(RecordError, match="at most 16 parts"):
        files.read_toml(path, "y")
    path.write_text("a\rb\r\nc")
    assert files.read_text(path, "y") == "a\nb\nc"
    assert (files.MB, files.MOST_BYTES, files.MOST_TOML_BYTES) == (1024**2, 512 * 1024**2, 1024**2)


def test_all_files_come_back_where_one_cannot_be_put_in_its_place(tmp_path):
    old, new = tmp_path / "old", tmp_path / "new"
    old.write_text("before")

    def fail():
        with files._put_back([old, new]):
            old.write_text("after")
            new.write_text("after")
            raise InterruptedError

    with pytest.raises(InterruptedError):
        fail()
    assert (old.read_text(), new.exists(), len(list(tmp_path.iterdir()))) == ("before", False, 1)


def test_tables_and_ranges_for_a_notebook():
    html = html_table("<c>", [("a", "1"), ("b", "2")], ("h",), ["n"])
    assert html.count("<tr>") == 3
    assert "&lt;c&gt;" in html
    assert html.endswith("</table>\n<div>n</div>")
    assert "thead" not in html_table("c", [])
    assert from_to([2.2, -2.25], "mm") == "-2.25 to 2.2 mm"
