"""Results as JSON files: what is written is read back, and an error names the file and the field."""

import json
from dataclasses import dataclass

import pytest

from fem_models.chain.solve import solve_chain
from fem_models.load import triangle
from fem_models.rig import preset
from hysteresis.fitting.uncertainty import Parameter
from hysteresis.records.record import Record, RecordError
from studies.commands.separation import separate_rig
from studies.results import read_result, write_result
from studies.results.fit import StoredModel
from studies.results.run import FullScale, LoopSummary, Picture, RunSummary, loop_summary
from studies.results.separation import Separation
from studies.results.study import AxisRange, ParetoFront, Sensitivities, StudySummary
from studies.results.trace import StoredTrace


@dataclass(frozen=True)
class Fit:
    name: str
    parameters: dict[str, Parameter]


FIT = Fit("a", {"width_mm": Parameter(0.1, None, 0.2, "mm")})


def test_a_result_reads_back(tmp_path):
    write_result(tmp_path / "deep" / "fit.json", FIT)
    assert read_result(Fit, tmp_path / "deep" / "fit.json", "a fit") == FIT
    assert (tmp_path / "deep" / "fit.json").read_text().endswith("}\n")


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("{", "fit.json: not JSON: .*: expected a fit"),
        ("[1]", r"fit.json: \[1\]: expected a table"),
        ("{}", "fit.json: name: missing: expected a fit"),
        ('{"name": 3}', "fit.json: name: 3: expected text"),
        (
            '{"name": "a", "parameters": {"b": {"value": "x"}}}',
            "fit.json: parameters: b: value: 'x': expected a number",
        ),
    ],
)
def test_an_error_names_file_and_field(text, said, tmp_path):
    (tmp_path / "fit.json").write_text(text)
    with pytest.raises(RecordError, match=said):
        read_result(Fit, tmp_path / "fit.json", "a fit")


def test_a_missing_file_is_named(tmp_path):
    with pytest.raises(RecordError, match=r"none.json: No such file or directory: expected a fit"):
        read_result(Fit, tmp_path / "none.json", "a fit")


def test_a_separation_reads_back(tmp_path):
    made = separate_rig(preset("du2018"), 1.0)
    write_result(tmp_path / "separate.json", made)
    assert read_result(Separation, tmp_path / "separate.json", "") == made
    assert json.loads((tmp_path / "separate.json").read_text()) == {"maker": "notchbend", **made.to_dict()}
    assert "intervals" not in made.to_dict()["contributions"]["friction"]  # of rigs that are calibrated on records


def test_a_loop_has_a_width_and_a_path_has_none():
    record = solve_chain(preset("du2018"), triangle(1.0)).record
    assert isinstance(loop_summary(record), LoopSummary)
    branch = loop_summary(Record(drive=record.drive[:5], angle_deg=record.angle_deg[:5]))
    assert type(branch) is FullScale


KEYS = {
    RunSummary: "schema seed versions rig peak_strain_percent loops crosscheck fits separations trace picture sha256 "
    "own made",
    Separation: "schema rig engine drive_mm total contributions shapley energy rigid_rope_residual_percent "
    "combinations bouc_wen calibration measured warnings sensitivity inseparable ensemble records made",
    StudySummary: "schema title engine cases status computed from_store axes sample seed versions code_sha256 "
    "inputs_sha256 dataset failures quantities sensitivity pareto state seconds made",
    Sensitivities: "schema engine count cases seed confidence resamples ranges quantities without_indices computed "
    "from_store",
    ParetoFront: "schema engine objectives limits variables fixed population generations seed designs_tried "
    "designs_feasible front",
}
"""The keys of the files, which others read, in their order."""


@pytest.mark.parametrize("kind", KEYS, ids=lambda kind: kind.__name__)
def test_keys_of_the_files_stay(kind):
    assert list(kind.__dataclass_fields__) == KEYS[kind].split()


def test_keys_that_are_words_of_python(tmp_path):
    write_result(tmp_path / "a.json", AxisRange(low=1.0, high=2.0, values=None))
    assert json.loads((tmp_path / "a.json").read_text()) == {
        "maker": "notchbend",
        "from": 1.0,
        "to": 2.0,
        "values": None,
    }


def test_a_picture_has_a_file_or_a_reason(tmp_path):
    write_result(tmp_path / "a.json", Picture(tube="tube.json", caption="c", file="tube.png"))
    assert list(json.loads((tmp_path / "a.json").read_text())) == ["maker", "tube", "caption", "file"]


def test_older_results_with_fewer_fields_are_read(tmp_path):
    (tmp_path / "trace.json").write_text('{"verdict": "none"}')
    assert read_result(StoredTrace, tmp_path / "trace.json", "") == StoredTrace("none")
    (tmp_path / "identify.json").write_text('{"parameters": {}, "heldout": {}}')
    with pytest.raises(RecordError, match=r"identify.json: heldout: rmse_deg: missing"):
        read_result(StoredModel, tmp_path / "identify.json", "")
