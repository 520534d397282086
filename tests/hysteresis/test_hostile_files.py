"""Files that are no records: special files, names that lead elsewhere, sizes and numbers beyond the limits."""

import os
import re
from pathlib import Path

import pytest

from hysteresis.files import RecordError, inside, read_bytes, read_json, read_toml
from hysteresis.messages import listed, one_line, quoted
from hysteresis.records.record_file import read_record

BARE = "drive_mm,angle_deg\n0,0\n1,2\n0,1\n"
HEAD = 'schema = 1\n[columns]\ndrive = "drive_mm"\nangle = "angle_deg"\n'


def refusal(path: Path) -> str:
    with pytest.raises(RecordError) as caught:
        read_record(path)
    text = str(caught.value)
    assert "\n" not in text
    assert len(text) < 300 + len(str(path.parent))
    return text.replace(f"{path.parent}/", "")


@pytest.fixture
def loop(tmp_path: Path) -> Path:
    (tmp_path / "loop.csv").write_text(BARE)
    return tmp_path / "loop.csv"


def with_sidecar(loop: Path, toml: str) -> str:
    loop.with_suffix(".toml").write_text(toml)
    return refusal(loop)


@pytest.mark.parametrize(
    ("make", "said"),
    [
        (os.mkfifo, "loop.csv: is a fifo: expected a CSV file"),
        (os.mkdir, "loop.csv: is a folder: expected a CSV file"),
        (lambda path: path.symlink_to("/dev/zero"), "loop.csv: is a device: expected a CSV file"),
        (lambda path: path.symlink_to("nowhere"), "loop.csv: a link to a file that does not exist"),
        (lambda path: path.symlink_to(path), "loop.csv: Too many levels of symbolic links"),
    ],
)
def test_a_special_file_is_refused(make, said, tmp_path):
    make(tmp_path / "loop.csv")
    assert refusal(tmp_path / "loop.csv").startswith(said)


@pytest.mark.parametrize("target", ["nowhere", "loop.toml"])
def test_a_sidecar_that_is_a_broken_link_is_an_error(target, loop):
    loop.with_suffix(".toml").symlink_to(target)
    assert refusal(loop).startswith("loop.toml: ")


def test_a_file_beyond_its_limit_is_refused_before_it_is_read(loop):
    os.truncate(loop, 2**40)
    assert refusal(loop) == "loop.csv: 1,048,576.0 MB: expected a CSV file, at most 512 MB"
    loop.write_text(BARE)
    loop.with_suffix(".toml").touch()
    os.truncate(loop.with_suffix(".toml"), 2**21)
    assert refusal(loop).endswith("at most 1 MB")


@pytest.mark.skipif(not Path("/proc/self/status").is_file(), reason="needs a file that says it is empty")
def test_a_file_that_has_more_than_it_said_is_refused():
    """As one that another program appends to: what was read would end amid a line."""
    with pytest.raises(RecordError, match=r"/proc/self/status: grows while it is read: expected a CSV file"):
        read_bytes(Path("/proc/self/status"), "a CSV file")


def test_columns_and_digits_have_limits(loop):
    loop.write_text(BARE.replace("1,2", "1." + "1" * 200 + ",2"))
    assert refusal(loop) == "loop.csv:3: column 'drive_mm': 202 characters: expected at most 100"
    loop.write_text(",".join(["drive_mm", "angle_deg", *map(str, range(2000))]) + "\n")
    assert refusal(loop) == "loop.csv:1: 2,002 columns: expected at most 1,000"


@pytest.mark.parametrize(
    ("toml", "said"),
    [
        ("a = " + "[" * 9999, "loop.toml: nested too deep"),
        ("a." * 9999 + "a = 1", "loop.toml: key a.a"),
        ("schema = " + "9" * 5000, "loop.toml: not TOML: Exceeds the limit"),
        ("schema = 0x" + "f" * 5000, "loop.toml: schema = an integer of 20000 bits: expected 1"),
        (f'schema = "{"x" * 5000}"', "loop.toml: schema = 'xxx"),
        (HEAD + 'time = "angle_deg"', "loop.toml: columns.time = 'angle_deg': is columns.angle: expected another"),
        (HEAD + 'notches = ["n", "n"]', "loop.toml: columns.notches = 'n': is columns.notches: expected another"),
        (HEAD + '[kinematics]\nfile = "../theory.csv"', "loop.toml: kinematics.file = '../theory.csv': outside its f"),
        (HEAD + '[kinematics]\nfile = "/etc/passwd"', "loop.toml: kinematics.file = '/etc/passwd': outside its folder"),
        (
            HEAD + '[kinematics]\nfile = "loop.toml"',
            "loop.toml: kinematics.file = 'loop.toml': expected a name that",
        ),
        (HEAD + '[rig]\nfile = "../../x.toml"', "loop.toml: rig.file = '../../x.toml': outside its folder"),
        (HEAD + '[rig]\nfile = "a\\u0000b.toml"', "loop.toml: rig.file = 'a\\x00b.toml': NUL in the name"),
    ],
)
def test_a_hostile_sidecar_is_refused_in_one_line(toml, said, loop):
    assert with_sidecar(loop, toml).startswith(said)


def test_a_link_that_leads_out_of_the_folder_is_outside(tmp_path):
    (tmp_path / "own").mkdir()
    (tmp_path / "theory.csv").write_text("drive_mm,angle_deg\n0,0\n1,1\n")
    (tmp_path / "own" / "theory.csv").symlink_to(tmp_path / "theory.csv")
    with pytest.raises(RecordError, match="outside its folder"):
        inside(tmp_path / "own" / "loop.toml", "kinematics.file", "theory.csv")
    (tmp_path / "linked").symlink_to(tmp_path / "own")  # the folder itself may be a link
    (tmp_path / "own" / "b.csv").touch()
    assert inside(tmp_path / "linked" / "loop.toml", "kinematics.file", "b.csv").exists()


def test_names_with_nul_and_devices_are_no_files(tmp_path):
    with pytest.raises(RecordError, match="NUL in the name"):
        read_bytes(tmp_path / "a\0b", "a file")
    with pytest.raises(RecordError, match="is a device"):
        read_bytes(Path("/dev/zero"), "a file")


def test_json_is_refused_where_it_is_deep_or_half_a_character(tmp_path):
    file = tmp_path / "a.json"
    for text, said in (("[" * 10_000, "nested too deep"), ("[" * 20 + "]" * 20, "nested too deep"),
                       ('{"a": "\\ud800"}', "not JSON"), ("9" * 5000, "not JSON")):  # fmt: skip
        file.write_text(text)
        with pytest.raises(RecordError, match=said):
            read_json(file, "results")


def test_dots_in_texts_and_numbers_are_no_deep_keys(tmp_path):
    file = tmp_path / "a.toml"
    file.write_text(f'# {"a." * 50}\ntitle = "{"." * 50}"\nvalues = [{", ".join(["0.5"] * 50)}]\n')
    assert len(read_toml(file, "a file")["values"]) == 50


def test_values_are_cut_and_lines_are_printable():
    assert len(quoted("x" * 999)) == 80
    assert len(quoted([{"a": ["x" * 999] * 999}] * 999)) == 80
    assert quoted("a\x1b[31m") == "'a\\x1b[31m'"
    assert listed("abc") == "a, b, c"
    assert re.fullmatch(r"name0, .*, name\d+ and \d+ more", listed(f"name{i}" for i in range(999)))
    fours = ["abcd"] * 20  # six characters each with comma and space: five of them in 50 - 20
    assert listed(fours, 50) == "abcd, abcd, abcd, abcd, abcd and 15 more"
    assert listed(fours, 20 * 6 - 2) == ", ".join(fours)
    assert one_line("a\n\x1b[31m") == "a \\x1b[31m"
    assert len(one_line("word " * 999 + "expected this")) == 280
    assert one_line("word " * 999 + "expected this").endswith("expected this")
