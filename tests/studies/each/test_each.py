"""``notchbend identify --each``: many devices, each by itself."""

import csv
import json
import os

import numpy as np
import pytest

import notchbend as nb
from hysteresis import Record
from hysteresis.fitting.uncertainty import Parameter
from hysteresis.laws.bouc_wen import BoucWen, hysteresis
from hysteresis.own import is_own
from hysteresis.records.record import RecordError
from studies.commands.cli import call
from studies.each import EachResult, EachSettings, FittedDevice, fit_each, work
from studies.each.page import unlike
from studies.each.result import COLUMNS, csv_table, parquet_table
from studies.each.work import records_of
from studies.notebook.calls import OF_EACH


def device(seed):
    rng = np.random.default_rng(seed)
    phase = np.arange(265) / 88 % 1.0
    wave = np.where(phase < 0.25, 4 * phase, np.where(phase < 0.75, 2 - 4 * phase, 4 * phase - 4))
    f = 35.0 * wave
    angle = f + hysteresis(f, BoucWen(-0.9, 0.3, 0.1, rng.uniform(1.3, 1.6))) + 0.05 * rng.standard_normal(265)
    return Record(2.2 * wave, angle)


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    out = tmp_path_factory.mktemp("devices")
    for seed in range(9):
        nb.write_record(device(seed), out / f"d{seed}.csv")
    (out / "broken.csv").write_text("drive_mm,angle_deg\n1,2\n3,x\n")
    (out / "line.csv").write_text("drive_mm,angle_deg\n" + "".join(f"{i},{i}\n" for i in range(60)))
    (out / "notes.txt").write_text("no record")
    return out


@pytest.fixture(scope="module")
def found(folder):
    return fit_each(records_of(folder), EachSettings(OF_EACH), workers=1)


def test_every_record_has_its_rows_and_a_reason_where_it_has_no_fit(folder, found):
    assert [one.record for one in found.devices] == [str(path) for path in sorted(folder.glob("*.csv"))]
    assert [(one.record.rsplit("/", 1)[1], one.problem) for one in found.failed] == [
        ("broken.csv", f"{folder / 'broken.csv'}:3: column 'angle_deg' = 'x': expected a number"),
        ("line.csv", "drive 'drive_mm' never reverses: expected a loop (there and back)"),
    ]
    for one in found.fitted:
        assert one.law == "bouc-wen"
        assert {"saturation_deg", "slope_after_reversal", "reach_deg", "A", "beta", "gamma", "n"} <= set(one.parameters)
        assert "saturation_deg" in one.fixed
        assert one.noise_deg == pytest.approx(0.05, rel=0.3)


def test_the_result_is_the_same_whatever_the_workers(folder, found):
    assert csv_table(fit_each(records_of(folder), EachSettings(OF_EACH), workers=2)) == csv_table(found)


def test_one_record_alone_has_the_same_fit(folder, found):
    alone = nb.identify(folder / "d3.csv", settings=OF_EACH)
    row = next(one for one in found.devices if one.record.endswith("d3.csv"))
    assert row.parameters["n"] == alone.parameters["n"]
    assert row.heldout_rmse_deg == alone.heldout.rmse_deg


@pytest.mark.parametrize("ended", ["d1.csv", "d6.csv"])
def test_a_record_that_ends_its_process_is_lost_alone(folder, monkeypatch, ended):
    def fit(records, **options):
        if records[0].source.endswith(ended):
            os._exit(9)
        raise RecordError("not fitted here")

    monkeypatch.setattr(work, "identify_records", fit)
    found = fit_each(records_of(folder), EachSettings(OF_EACH), workers=2)
    assert [one.record.rsplit("/", 1)[1] for one in found.devices if one.problem == work.ENDED] == [ended]
    assert sum("not fitted here" in one.problem for one in found.devices) == 9


def test_a_csv_has_the_columns_of_the_contract(found):
    rows = list(csv.DictReader(csv_table(found).splitlines()))
    assert tuple(rows[0]) == COLUMNS
    assert len(rows) == 2 + sum(len(one.parameters) for one in found.fitted)
    broken = rows[0]
    assert broken["words"].endswith("expected a number")
    assert (broken["parameter"], broken["value"], broken["fixed"]) == ("", "", "False")


def test_parquet_has_the_same_rows(found, tmp_path):
    parquet = pytest.importorskip("pyarrow.parquet")
    (tmp_path / "fits.parquet").write_bytes(parquet_table(found))
    table = parquet.read_table(tmp_path / "fits.parquet").to_pydict()
    assert tuple(table) == COLUMNS
    known = [None if np.isnan(value) else value for value in found.columns()["low"]]
    assert table["low"] == known


def test_a_dataframe_and_a_list_of_records():
    pytest.importorskip("pandas")
    found = nb.identify_each([device(0), device(1).to_dataframe()], workers=1)
    frame = found.to_dataframe()
    assert list(frame.columns) == list(COLUMNS)
    assert frame.query("parameter == 'saturation_deg'").shape[0] == 2


def test_the_command_writes_table_summary_and_page(folder, tmp_path, capsys):
    assert call(["identify", "--each", str(folder), "--out", str(tmp_path), "--workers", "1"]) == 0
    assert "9 of 11 records fitted" in capsys.readouterr().out
    summary = json.loads((tmp_path / "each.json").read_text())
    assert (summary["records"], summary["fitted"], summary["table"]) == (11, 9, "fits.csv")
    assert all(is_own(tmp_path / name) for name in ("fits.csv", "each.json", "report.html"))
    assert "never reverses" in (tmp_path / "report.html").read_text()


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (["--each", "nowhere"], "expected a folder of records"),
        ([], "expected one or more, or --each FOLDER"),
    ],
)
def test_what_cannot_be_is_one_line(arguments, words, tmp_path, capsys):
    assert call(["identify", *arguments, "--out", str(tmp_path / "out")]) == 2
    said = capsys.readouterr().err
    assert words in said
    assert said.count("\n") == 1


def test_a_device_far_from_the_others_is_unlike_them():
    def one(name, value):
        return FittedDevice(name, "bouc-wen", {"n": Parameter(value, value - 0.1, value + 0.1, "1")}, ("n",))

    many = tuple(one(f"d{k}", 1.5 + 0.01 * k) for k in range(9))
    assert [found.record for found in unlike(EachResult((*many, one("odd", 3.0))))] == ["odd"]
    assert unlike(EachResult(many)) == []
