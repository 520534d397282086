"""Spoiled files and arbitrary contents: every reader takes them or refuses them in one line; see ``__main__``."""

import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from fem_models.rig import RigError, read_rig
from hysteresis.plain import from_plain
from hysteresis.records.record import RecordError
from hysteresis.records.record_file import read_record
from malformed.run import try_all, try_good
from malformed.samples import readers
from studies.commands.compensation import read_layer, read_reference
from studies.programs import forces_of_file, program_of_file
from studies.report.study import StudyFacts
from studies.results.fit import StoredFit, StoredModel
from studies.results.run import RunSummary
from studies.results.separation import Separation
from studies.results.study import ParetoFront, Sensitivities, StudySummary
from studies.results.trace import StoredTrace
from studies.sweep import StudyError, read_study

QUICK = settings(max_examples=25, deadline=None, derandomize=True, suppress_health_check=list(HealthCheck))
READERS = {
    "loop.csv": read_record,
    "rig.toml": read_rig,
    "study.toml": read_study,
    "program.csv": program_of_file,
    "force.csv": forces_of_file,
    "reference.csv": read_reference,
    "identify.json": read_layer,
}
KINDS = [StoredFit, StoredModel, RunSummary, Separation, ParetoFront, Sensitivities, StudySummary, StoredTrace,
         StudyFacts]  # fmt: skip
SCALARS = st.none() | st.booleans() | st.integers() | st.floats() | st.text(max_size=5)
JSON = st.recursive(SCALARS, lambda inner: st.lists(inner, max_size=3) | st.dictionaries(st.text(max_size=3), inner))
LINES = st.lists(st.sampled_from([
    "schema = 1", "[rig]", "[vary]", "[columns]", 'file = "../a"', "preload_N = [1, 1]", "preload_N = 1e308", "[tube]",
    "[program]", "amplitude_mm = -1", 'drive = "drive_mm"', 'angle = "drive_mm"', "count = 1e9", "[notch]", "[[a]]",
    "drive_mm,angle_deg", "0,0", "nan,1", "1,1e308", ",", "{", "}", '"law": null', "\0", "tendon_force_N", "-1", "1e9",
]), max_size=12).map("\n".join)  # fmt: skip


def test_good_files_are_taken_and_spoiled_ones_refused_in_one_line(tmp_path):
    good = readers(tmp_path / "good", stored=False)
    assert [one for one in try_good(good, tmp_path) if one.outcome != "taken"] == []
    assert [one for one in try_all(good, 150, 1, tmp_path) if not one.good] == []


def test_good_tables_are_taken_and_spoiled_ones_refused_in_one_line(tmp_path):
    pytest.importorskip("openpyxl")
    pytest.importorskip("pyarrow")
    from malformed.tables import tables

    good = tables(tmp_path / "good")
    assert [one for one in try_good(good, tmp_path) if one.outcome != "taken"] == []
    texts = [one for one in good if not one.name.endswith((".parquet", ".mat"))]  # these are read in other processes
    assert [one for one in try_all(texts, 88, 1, tmp_path) if not one.good] == []


@pytest.mark.parametrize("name", READERS)
@QUICK
@given(content=st.binary(max_size=60) | LINES.map(str.encode))
def test_any_content_is_read_or_refused(name, content, tmp_path):
    path = tmp_path / name
    path.write_bytes(content)
    words = ""
    try:
        READERS[name](path)
    except (RecordError, RigError, StudyError) as error:
        words = str(error)
    assert "\n" not in words
    assert len(words) < 300 + len(str(path))


@pytest.mark.parametrize("kind", KINDS)
@QUICK
@given(data=st.data())
def test_any_value_of_a_field_is_read_or_refused(kind, data):
    values = data.draw(st.dictionaries(st.sampled_from(list(kind.__dataclass_fields__)), JSON) | JSON)
    words = ""
    try:
        from_plain(kind, values, "a.json")
    except RecordError as error:
        words = str(error)
    assert "\n" not in words
    assert len(words) < 300
