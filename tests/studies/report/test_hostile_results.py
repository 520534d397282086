"""Stored results are input: names that lead elsewhere, spoiled fields, and chunks that are gone, are refused."""

import json
import shutil
from pathlib import Path

import pytest
import zarr
from results_folder import copy_results

from hysteresis.records.record import RecordError
from studies.report import write_report
from studies.results.manifest import KEY, digests, require_complete
from studies.sweep import StudyError, open_study
from studies.sweep.store import open_store


@pytest.fixture(scope="module")
def results(tmp_path_factory):
    folder = tmp_path_factory.mktemp("results")
    copy_results(tmp_path_factory, folder)
    (folder / "secret.png").write_bytes(b"\x89PNG\r\n\x1a\nsecret")
    store = folder / "study" / "study.zarr"
    zarr.open_group(store, mode="r+").attrs[KEY] = json.dumps(digests(store))
    return folder


@pytest.fixture
def folder(results, tmp_path):
    shutil.copytree(results, tmp_path / "results")
    return tmp_path / "results"


def change(path: Path, keys: str, value: object) -> None:
    values = json.loads(path.read_text())
    inner, *way = values, *(int(key) if key.isdigit() else key for key in keys.split("."))
    for key in way[:-1]:
        inner = inner[key]
    inner[way[-1]] = value
    path.write_text(json.dumps(values))


@pytest.mark.parametrize(
    ("file", "keys", "value", "said"),
    [
        ("trace/trace.json", "figures.0.file", "../secret.png", "outside its folder"),
        ("trace/trace.json", "figures.0.file", "/etc/passwd", "outside its folder"),
        ("trace/trace.json", "figures.0.file", "trace.json", "ends in .png or .csv"),
        ("trace/trace.json", "figures.0.file", "a\0b.png", "NUL in the name"),
        ("trace/trace.json", "figures.0.file", ".", "expected a name that ends"),
        ("trace/trace.json", "noise_floor_deg", 10**400, "an integer of|64 bits"),
        ("trace/trace.json", "before.train.rmse_deg", 1e308, "at most 1e"),
        ("run/run.json", "picture.file", "../secret.png", "outside its folder"),
        ("run/run.json", "picture.tube", "../trace/trace.json", "outside its folder"),
        ("run/run.json", "loops", [], "0 loops"),
        ("run/run.json", "crosscheck", [], "2 loops, 0 rows"),
        ("run/run.json", "loops.0.record", "../../trace/x", "outside its folder"),
        ("run/run.json", "fits.0.name", "/../../trace/x", "outside its folder"),
        ("run/run.json", "separations.0.file", "../trace/trace.json", "outside its folder"),
        ("run/separate-du2018-20N.json", "rig", {}, "rig: name = None"),
        *(("run/run.json", "schema", value, "schema = .*: expected 1") for value in (True, 2, 1.0, "1", None)),
        ("trace/trace.json", "schema", 2, "schema = 2: expected 1"),
        ("run/identify-du2018-20N.json", "schema", True, "schema = True: expected 1"),
        ("run/tube.json", "points_mm", [], "shape"),
        ("run/tube.json", "triangles.0.0", 10**9, "triangles: expected numbers of its"),
        ("run/tube.json", "strain_percent.0", None, "strain_percent: expected finite"),
        ("study/sensitivity.json", "quantities.full_scale_angle_deg.indices", {}, "expected one for each input"),
    ],
)
def test_a_spoiled_result_is_refused(file, keys, value, said, folder):
    change(folder / file, keys, value)
    with pytest.raises(RecordError, match=said) as caught:
        write_report(folder / Path(file).parent)
    assert "\n" not in str(caught.value)
    assert not (folder / Path(file).parent / "report.html").exists()


@pytest.mark.parametrize("text", ["679", "[]", "null", '"a"'])
@pytest.mark.parametrize(
    "name",
    ["run.json", "trace.json", "validate.json", "pareto.json", "wrist.json", "workspace.json", "identify.json",
     "separate.json", "drives-compensate.json", "six-stiffnesses.json",
     "follow.json"],
)  # fmt: skip
def test_a_result_that_is_no_object_is_refused(name, text, tmp_path):
    (tmp_path / name).write_text(text)
    with pytest.raises(RecordError, match=name) as caught:
        write_report(tmp_path)
    assert "\n" not in str(caught.value)
    assert [path.name for path in tmp_path.iterdir()] == [name]


def test_a_figure_that_is_no_picture_is_refused(folder):
    change(folder / "trace" / "trace.json", "figures.0.file", "a.png")
    (folder / "trace" / "a.png").write_text("root:x:0:0")
    with pytest.raises(RecordError, match=r"a.png: no PNG"):
        write_report(folder / "trace")


def test_a_chunk_that_is_gone_or_changed_is_noticed(folder):
    store = folder / "study" / "study.zarr"
    require_complete(store)
    chunk = next(path for path in sorted(store.rglob("*")) if path.is_file() and "full_scale" in str(path) and "c" in
                 path.relative_to(store).parts)  # fmt: skip
    content = chunk.read_bytes()
    chunk.write_bytes(content[:-1])
    with pytest.raises(StudyError, match=r"full_scale_angle_deg/c/.*: changed"):
        open_study(folder / "study")
    chunk.unlink()
    for read, error in ((open_study, StudyError), (write_report, RecordError)):
        with pytest.raises(error, match=r"full_scale_angle_deg/c/.*: missing: expected all chunks"):
            read(folder / "study")
    chunk.write_bytes(content)
    assert KEY not in open_study(folder / "study").attrs


def test_a_store_of_cases_that_is_spoiled_is_refused(tmp_path):
    for quantities, status in (("{", "ok"), ("[]", "ok"), ('{"a": "b"}', "ok"), ("{}", "finished")):
        with open_store(tmp_path) as store:
            store._db.execute("DELETE FROM cases")
            store._db.execute("INSERT INTO cases VALUES ('k', '{}', ?, 1, '', 0.1, ?)", (status, quantities))
            with pytest.raises(StudyError, match="spoiled: expected the store of a study"):
                store.find("k")


def test_another_database_is_not_used_as_a_store(tmp_path):
    with open_store(tmp_path) as store:
        store._db.execute("ALTER TABLE cases RENAME TO mine")
    with pytest.raises(StudyError, match="another database"), open_store(tmp_path):
        pass
