"""The record: checks, equality, representations and tables."""

import json
import pickle
from dataclasses import replace
from pathlib import Path

import numpy as np
import pandas as pd
import pytest

from hysteresis.records.record import Record, RecordError
from hysteresis.records.record_file import write_record


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
        ({"tip_mm": np.zeros((3, 4))}, r"record: tip_mm: shape \(3, 4\): expected shape \(3, 2\)"),
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


# --- representations and tables --------------------------------------------------------------------------------

FULL = Record(
    [0.0, 1.0, 0.0],
    [0.0, 2.0, 1.0],
    title="bench <1>",
    time_s=[0.0, 0.1, 0.2],
    cycle=[0, 0, 1],
    tension_a_N=[10.0, 12.0, 11.0],
    notches_deg=[[0, 0], [1, 1], [0.5, 0.5]],
    tip_mm=[[30, 0], [29, 2], [30, 1]],
    rig={"preload_N": 10.0},
    kinematics=[[-1, -2], [1, 2]],
)
COLUMNS = [
    "time_s", "cycle", "drive_mm", "angle_deg", "tension_a_N", "notch_1_deg", "notch_2_deg", "tip_x_mm", "tip_y_mm",
]  # fmt: skip


def test_repr_is_one_line_without_arrays() -> None:
    long = Record(np.sin(np.arange(5000.0)), np.arange(5000.0), title="long")
    assert repr(long) == "Record('long', measured, 5000 samples, drive -1 to 1 mm, angle 0 to 4999 deg)"


def test_html_escapes_the_title_and_names_the_ranges() -> None:
    html = FULL._repr_html_()
    assert "bench &lt;1&gt;" in html
    assert "0 to 2 deg" in html
    assert "preload_N = 10.0" in html


def test_to_dict_has_plain_values() -> None:
    values = json.loads(json.dumps(FULL.to_dict()))
    assert list(values["columns"]) == COLUMNS
    assert values["columns"]["cycle"] == [0, 0, 1]
    assert values["rig"] == {"preload_N": 10.0}
    assert values["kinematics"] == [[-1, -2], [1, 2]]
    assert "tube" not in values


def test_dataframe_has_the_columns_of_the_csv(tmp_path: Path) -> None:
    frame = FULL.to_dataframe()
    write_record(FULL, tmp_path / "loop.csv")
    pd.testing.assert_frame_equal(frame, pd.read_csv(tmp_path / "loop.csv"))
    assert list(frame) == COLUMNS
    assert frame.attrs["title"] == "bench <1>"
    forced = Record([0, 1, 0], [0, 2, 1], drive_unit="N").to_dataframe()
    assert list(forced) == ["force_N", "angle_deg"]


def test_xarray_has_units_and_coordinates() -> None:
    data = FULL.to_xarray()
    assert data["drive_mm"].attrs["units"] == "mm"
    assert data["tension_a_N"].attrs["units"] == "N"
    assert data["time_s"].attrs["units"] == "s"
    assert data["cycle"].attrs["units"] == "1"
    assert data["notches_deg"].dims == ("sample", "notch")
    assert data["notches_deg"].sel(notch=2).values.tolist() == [0, 1, 0.5]
    assert data["tip_mm"].sel(axis="across").values.tolist() == [0, 2, 1]
    assert data.attrs == {"title": "bench <1>", "kind": "measured", "rig_preload_N": 10.0}
    assert set(data.coords) == {"time_s", "cycle", "notch", "axis"}
