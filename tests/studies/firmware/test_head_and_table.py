"""The head of the C files, and the branch tables."""

import json
import re

import numpy as np
import pytest
from firmware_fits import CASES, stored_fit

from hysteresis.records.record import Record
from hysteresis.records.record_file import write_record
from studies.firmware import compensator_files, read_compensator, table_files
from studies.firmware.about import in_comment
from studies.firmware.branches import branches
from studies.firmware.vector import predicted


def header(path):
    files = compensator_files(read_compensator(path, "wrist"), path.parent)
    return files[path.parent / "wrist.h"]


def test_head_says_what_it_is_of(tmp_path):
    text = " ".join(header(stored_fit(tmp_path / "identify.json", "two elements")).split())
    for words in (
        "wrist: made by notchbend ",
        "Records: loops/bench-20N.csv.",
        "Law: Bouc-Wen, 2 elements; largest hysteresis 3.331 deg.",  # exp(0.1) + exp(0.8)
        "Held-out error: 0.1234 deg rms;",
        "Noise: 0.0456 deg.",
        "Valid for drives of -2 to 2 mm",
        "a preload as in the records, rates as in the records",
        "SHA-256 of identify.json: ",
        "no static state, of the library only exp, pow, sqrt (expf, powf, sqrtf for float) of math.h.",
    ):
        assert words in text


def test_head_has_preload_and_rate_of_a_record_that_is_still_there(tmp_path):
    path = stored_fit(tmp_path / "identify.json")
    drive = np.array([0.0, 1.0, -2.0, 2.0])
    (tmp_path / "loops").mkdir()
    record = Record(drive=drive, angle_deg=drive, time_s=np.array([0.0, 1.0, 3.0, 4.0]), rig={"preload_N": 20.0})
    write_record(record, tmp_path / "loops/bench-20N.csv")
    assert "preload 20 N, rates of up to 4 mm/s," in " ".join(header(path).split())
    write_record(Record(drive=9 * drive, angle_deg=drive, rig={"preload_N": 20.0}), tmp_path / "loops/bench-20N.csv")
    assert "a preload as in the records" in " ".join(header(path).split())  # another record of the same name


def test_files_are_the_same_again_and_without_a_date(tmp_path):
    path = stored_fit(tmp_path / "identify.json")
    compensator = read_compensator(path, "wrist")
    first, again = (compensator_files(compensator, tmp_path) for _ in range(2))
    assert first == again
    assert not re.search(r"\b20\d\d-\d\d|UTC", "".join(first.values()))


def test_a_name_of_a_record_cannot_leave_the_comment(tmp_path):
    path = stored_fit(tmp_path / "identify.json")
    values = json.loads(path.read_text())
    values["records"] = ["a*/int main(){}/*??/\n$name \\"]
    path.write_text(json.dumps(values))
    text = header(path)
    comment = text[: text.index("#ifndef")]
    assert "a_/int main(){}/___/ _name _" in comment
    assert comment.count("*/") == comment.count("/*") == 1
    assert in_comment("f \u00b0 x") == "f _ x"


@pytest.mark.parametrize("case", CASES)
def test_table_is_the_settled_loop(tmp_path, case):
    """Rate independence: few long steps to the end of the other branch give the same loop as many short ones."""
    layer = read_compensator(stored_fit(tmp_path / "identify.json", case), "wrist").layer
    table = branches(layer)
    low, high = (-2.0, 2.0) if layer.f(np.array([2.0]))[0] > 0 else (2.0, -2.0)
    settled = [low, high] * 30
    assert (np.diff(table.rising) >= 0).all() == (low < high)
    assert (np.diff(table.falling) >= 0).all() == (low < high)
    for drives, approach in ((table.rising, [*settled, low]), (table.falling, settled)):
        for k in (1, 2, 3, *range(8, 121, 16), 125, 126, 127):
            angle = predicted(layer, np.array([*approach, drives[k]]))[-1]
            assert angle == pytest.approx(table.angle_deg[k], abs=2e-3)  # h drops at the centre


def test_table_has_whole_numbers_beside(tmp_path):
    compensator = read_compensator(stored_fit(tmp_path / "identify.json"), "wrist")
    (text,) = table_files(compensator, tmp_path).values()
    lines = text.splitlines()
    assert lines[0] == "angle_deg,rising_mm,falling_mm,angle_mdeg,rising_um,falling_um"
    rows = np.array([line.split(",") for line in lines[1:]], dtype=float)
    assert rows.shape == (129, 6)
    np.testing.assert_array_equal(rows[:, 3:], np.rint(1000 * rows[:, :3]))
    assert all(re.fullmatch(r"-?\d+,-?\d+,-?\d+", line.split(",", 3)[3]) for line in lines[1:])
    assert (np.diff(rows[:, :3], axis=0) > 0).all()
