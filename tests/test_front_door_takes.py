"""Every function of the front door that takes a record takes its path or a DataFrame; a rig, its file or its name."""

import inspect
import re
from dataclasses import replace
from datetime import datetime

import numpy as np
import pandas as pd
import pytest

import notchbend as nb
from fem_models.rig.presets_in_space import any_preset
from fem_models.spatial import simulate_in_space
from fem_models.spatial.drives import first_wheel
from hysteresis.records.frame import record_of_frame
from studies.notebook import calls

QUICK = nb.IdentifySettings(method="least-squares")


@pytest.fixture(scope="module")
def record():
    return nb.simulate("du2018", nb.triangle(1.0, step_mm=0.1, cycles=2), engine="chain")


@pytest.fixture(scope="module")
def path(record, tmp_path_factory):
    file = tmp_path_factory.mktemp("given") / "loop.csv"
    nb.write_record(record, file)
    return file


def given(record, path):
    """The record in each of the ways."""
    return {"path": path, "text": str(path), "frame": record.to_dataframe()}


def test_a_dataframe_is_the_record_again(record):
    frame = record.to_dataframe()
    again = record_of_frame(frame)
    assert again == record
    assert again.rig == {"preset": "du2018", "preload_N": 20.0}
    columns = {"drive_mm": [0, 1, 0], "angle_deg": [0.0, 2, 1], "note": list("abc")}
    assert record_of_frame(pd.DataFrame(columns, index=[7, 8, 9])) == nb.Record([0, 1, 0], [0, 2, 1])
    assert record_of_frame(nb.Record([0, 1, 0], [0, 2, 1], drive_unit="N").to_dataframe()).drive_unit == "N"


@pytest.mark.parametrize("way", ["path", "text", "frame"])
def test_records_are_taken_in_each_way(way, record, path, tmp_path):
    one = given(record, path)[way]
    fit = nb.identify(one, settings=QUICK)
    assert fit.parameters == nb.identify(record, settings=QUICK).parameters
    drive = nb.compensate(one, [0.0, 5.0, 2.0], settings=QUICK).drive
    np.testing.assert_array_equal(drive, nb.compensate(record, [0.0, 5.0, 2.0], settings=QUICK).drive)
    assert nb.plot(one).axes[0].get_xlabel() == "drive, mm"
    assert len(nb.plot([one, record]).axes[0].get_lines()) == 2
    nb.write_record(one, tmp_path / "again.csv")
    np.testing.assert_array_equal(nb.read_record(tmp_path / "again.csv").angle_deg, record.angle_deg)


@pytest.mark.parametrize("function", ["trace", "separate"])
@pytest.mark.parametrize("way", ["path", "text", "frame"])
def test_trace_and_separate_get_the_records(function, way, record, path, monkeypatch):
    seen = []
    monkeypatch.setattr("validation.tracing.trace_records", lambda *a, **k: seen.append((a, k)))
    monkeypatch.setattr("studies.commands.separation.separate_records", lambda *a, **k: seen.append((a, k)))
    one = given(record, path)[way]
    if function == "trace":
        new = replace(record, title="new")
        nb.trace([new, new], reference=one)
        assert [found.angle_deg.tolist() for found in seen[0][1]["reference"]] == [record.angle_deg.tolist()]
    else:
        nb.separate([one, record])
    assert [found.angle_deg.tolist() for found in seen[0][0][0]] == [record.angle_deg.tolist()] * 2


def test_rigs_are_taken_by_name_and_by_file(tmp_path, monkeypatch):
    from malformed.samples import RIG

    (tmp_path / "mine.toml").write_text(RIG)
    program = nb.triangle(0.2, step_mm=0.1)
    by_file = nb.simulate(tmp_path / "mine.toml", program, engine="chain")
    assert by_file == nb.simulate(nb.read_rig(tmp_path / "mine.toml"), program, engine="chain")
    assert nb.simulate(str(tmp_path / "mine.toml"), program, engine="chain") == by_file
    run = nb.simulate("du2018", program, engine="chain")
    assert run == nb.simulate(nb.preset("du2018"), program, engine="chain")
    assert nb.plot("du2018", view="side").axes[0].lines
    assert nb.plot(tmp_path / "mine.toml", view="side").axes[0].lines
    model, _ = nb.export("du2018", tmp_path / "rig.xml", amplitude_mm=0.2)
    assert model.exists()
    seen = []
    monkeypatch.setattr("studies.commands.separation.separate_rig", lambda *a, **k: seen.append((a[0], k["members"])))
    nb.separate("du2018", members=[tmp_path / "mine.toml", "du2018"])
    assert seen == [(nb.preset("du2018"), [nb.read_rig(tmp_path / "mine.toml"), nb.preset("du2018")])]


def test_no_function_is_left_out():
    """A parameter named as a record or a rig has a type that takes all ways."""
    for name, function in inspect.getmembers(calls, inspect.isfunction):
        if not hasattr(nb, name) or function.__module__ != calls.__name__:
            continue
        for key, parameter in inspect.signature(function).parameters.items():
            if key in ("record", "records", "reference", "model"):
                assert "RecordLike" in parameter.annotation, name
            if key in ("rig", "members"):
                assert "RigLike" in parameter.annotation, name


@pytest.mark.parametrize("call", [
    lambda wrong: nb.identify(wrong), lambda wrong: nb.trace(wrong), lambda wrong: nb.separate(wrong),
    lambda wrong: nb.compensate(wrong, [0.0]), lambda wrong: nb.write_record(wrong, "a.csv"),
    lambda wrong: nb.identify([wrong]),
])  # fmt: skip
@pytest.mark.parametrize("wrong", [3, None, {"a": 1}, object()])
def test_something_else_is_refused_in_one_line(call, wrong):
    with pytest.raises(TypeError, match=r"^[^\n]*: expected a Record, the path of a CSV, or a DataFrame$") as error:
        call(wrong)
    assert re.match(r"(records?|model|records\[0\]) = ", str(error.value))


@pytest.mark.parametrize("wrong", [3, None, np.arange(3)])
def test_something_else_is_no_rig(wrong, tmp_path):
    for call in (lambda: nb.simulate(wrong, nb.triangle(0.2)), lambda: nb.export(wrong, tmp_path / "a.xml")):
        with pytest.raises(TypeError, match=r"^(rig|what) = .*: expected a Rig, the path of a rig file, or the na"):
            call()
    with pytest.raises(nb.RigError, match=r"^rig = du2019: expected a preset \(du2018, .*\), or the path of a rig"):
        nb.simulate("du2019", nb.triangle(0.2))


@pytest.mark.parametrize(("columns", "words"), [
    ({"x": [0, 1, 0], "angle_deg": [0, 1, 0]}, "column 'drive_mm' missing: the columns are x, angle_deg:"),
    ({"drive_mm": [0, 1, 0], "theta": [0, 1, 0]}, "column 'angle_deg' missing: the columns are drive_mm, theta"),
    ({"drive_mm": [0, 1, 0], "angle_deg": ["a", 1, 0]}, "column 'angle_deg': object: expected numbers in every row"),
    ({"drive_mm": [0, 1, 0], "angle_deg": [0, None, 0]}, "row 1: column 'angle_deg' = nan: expected a finite number"),
    ({"drive_mm": [datetime(2026, 1, k) for k in (1, 2, 3)], "angle_deg": [0, 1, 0]}, "column 'drive_mm': datetime64"),
    ({"drive_mm": [0, 0.1, 0.2, 1], "angle_deg": [350, 355, 2, 40]}, "row 2: angle_deg = 2 after 355: wrapped at a"),
])  # fmt: skip
def test_a_dataframe_that_is_no_record_is_refused_in_one_line(columns, words):
    with pytest.raises(nb.RecordError) as error:
        nb.identify(pd.DataFrame(columns))
    assert words in str(error.value)
    assert str(error.value).startswith("DataFrame: ")


@pytest.mark.parametrize(("drive", "words"), [
    (np.ma.masked_array([0, 1, 0], [0, 1, 0]), "drive: masked values: expected a number in every row"),
    (np.array(["2026-01-01", "2026-01-02", "2026-01-03"], "datetime64[ns]"), "drive: dates: expected numbers"),
    (["a", "b", "c"], "drive: ['a', 'b', 'c']: expected numbers"),
])  # fmt: skip
def test_arrays_that_are_no_numbers_are_refused(drive, words):
    with pytest.raises(nb.RecordError, match=r"^record: ") as error:
        nb.Record(drive, [0, 1, 0])
    assert words in str(error.value)


def test_a_rig_in_space_is_simulated_by_the_chain_in_space():
    rig, program = any_preset("zhang2026"), nb.triangle(0.2, step_mm=0.1)
    assert nb.simulate("zhang2026", program) == simulate_in_space(rig, first_wheel(program, rig))
    with pytest.raises(nb.RigError, match="engine analytic with rig zhang2026"):
        nb.simulate("zhang2026", nb.triangle(0.2), engine="analytic")
