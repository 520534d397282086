"""Parts of the page of `notchbend app`: warnings, words, files that it saves and opens."""

import base64
import io
import zipfile
from dataclasses import replace

import numpy as np
import pytest

from fem_models.chain import solve_chain
from fem_models.joint.strain import FATIGUE
from fem_models.rig import preset
from fem_models.rig.checks import SolverError
from fem_models.rig.presets import PRESETS
from fem_models.rig.rig_file import read_rig
from hysteresis.records.metrics import loop_width
from hysteresis.records.record import Record, RecordError
from studies.app.advice import in_words, warnings_of
from studies.app.files import MOST_BYTES, opened_record, record_files, rig_text, shown
from studies.app.loop_svg import less_backbone
from studies.app.playground import outer_mm
from studies.app.scene import TENDON_COLOURS, mesh_of
from studies.bench_record import SHIPPED
from studies.report.tube import coarse_surface
from studies.results.files import file_stem
from validation.separation import loop_program

START = {"amplitude_mm": 2.2, "notch.depth_mm": 2.825, "preload_N": 20.0, "notch.width_mm": 1.4}


@pytest.fixture(scope="module")
def solution():
    return solve_chain(preset("du2018"), loop_program(-2.2, 2.2))


def test_loop_less_backbone_is_as_wide_as_the_loop(solution):
    record = solution.record
    drive, bare = less_backbone(record)
    assert (drive.min(), drive.max()) == (-2.2, 2.2)
    width = loop_width(record.drive, record.angle_deg, record.cycle).max_deg
    assert np.ptp(bare) == pytest.approx(width, rel=0.02)  # the loop is symmetric about its backbone
    approach = Record(record.drive[:40], record.angle_deg[:40])
    assert less_backbone(approach) is None


def test_limits_are_said_with_the_drive_where_they_are_passed(solution):
    rig = preset("du2018")
    fatigue, plateau = warnings_of(rig, solution)
    # loading from rest: half the range of the strain is half the strain, which passes the limit at twice its size
    loading = solution.record.drive[: int(solution.record.drive.argmax()) + 1]
    strain = np.abs(solution.peak_strain[: loading.size]).max(axis=1)
    at = np.interp(2 * FATIGUE.strain, strain, loading)
    assert fatigue.startswith(f"Fatigue at 10^7 cycles: half the range of the strain above 0.4 % from {at:.2f} mm on")
    assert f"from {np.interp(0.01, strain, loading):.2f} mm on" in plateau
    assert warnings_of(rig, solve_chain(rig, loop_program(-0.1, 0.1))) == []


def test_a_slack_tendon_is_said():
    rig = preset("du2018", preload_N=1.0)
    said = [words for words in warnings_of(rig, solve_chain(rig, loop_program(-2.2, 2.2))) if "slack" in words]
    assert [words.split(",")[0] for words in said] == ["Tendon a goes slack", "Tendon b goes slack"]


@pytest.mark.parametrize(
    ("error", "moved", "said"),
    [
        (
            "rig r, sample 2 of 9: no equilibrium between drives 0.0725963 and 0.0725964 mm",
            {"notch.depth_mm": 3.0},
            "The tube finds no resting shape beyond a drive of 0.073 mm: it snaps, or buckles. Try a less deep notch.",
        ),
        (
            "rig r, sample 24 of 397: joint 1 at 26.2 deg, but its notch closes at 25.4 deg: expected a",
            {"amplitude_mm": 30.0, "notch.width_mm": 1.0},
            "The notch of joint 1 is closed at 25.4 deg, before the full drive. Try a smaller amplitude or a wider",
        ),
        ("notch.depth_mm = 9: expected below 3.1 mm", {}, "These values are not possible: notch.depth_mm = 9: "),
    ],
)
def test_no_answer_is_said_with_what_to_move(error, moved, said):
    assert in_words(SolverError(error), START | moved, START).startswith(said)


@pytest.mark.parametrize("name", PRESETS)
def test_a_saved_rig_is_read_as_it_was(name, tmp_path):
    rig = replace(preset(name), name='{{7*7}} "quoted" <b>')
    (tmp_path / "rig.toml").write_text(rig_text(rig))
    assert read_rig(tmp_path / "rig.toml") == rig


def test_names_of_files_have_nothing_of_a_path_or_a_script():
    assert file_stem("../../etc/passwd") == "etc-passwd"
    assert file_stem("a'); alert(1); ('") == "a-alert-1"
    assert file_stem("...") == "rig"


def test_a_saved_record_is_opened_again(solution):
    rig = replace(preset("du2018"), name="mine/../yours")
    packed = zipfile.ZipFile(io.BytesIO(record_files({"": solution.record}, rig)))
    names = packed.namelist()
    assert names == [f"mine-..-yours/mine-..-yours{end}" for end in ("-rig.toml", ".csv", ".toml")]
    files = [{"name": name, "content": packed.read(name)} for name in names[1:]]
    assert np.array_equal(opened_record(files).angle_deg, solution.record.angle_deg)


@pytest.mark.parametrize(
    ("files", "said"),
    [
        ([], "no CSV was chosen"),
        ([("a.csv", b""), ("b.csv", b"")], "b.csv: expected one record"),
        ([("a.exe", b"")], "a.exe: expected one record"),
        ([("a.csv", "text")], "a.csv: expected one record"),
        ([("a.csv", b" " * (MOST_BYTES + 1))], "bytes: expected at most"),
        ([("my.csv", b"drive_mm,angle_deg\n0,0\n1,one\n0,0\n")], "my.csv:3: column 'angle_deg' = 'one'"),
        ([("x/../my.csv", b"\xff\xfe")], "my.csv"),
    ],
)
def test_files_that_are_no_record_are_refused_in_one_line(files, said):
    with pytest.raises(RecordError) as error:
        opened_record([{"name": name, "content": content} for name, content in files])
    assert said in str(error.value)
    assert "/tmp" not in str(error.value)


def test_a_record_in_other_units_is_refused(solution):
    with pytest.raises(RecordError, match="bench: drive in deg: expected mm"):
        shown(replace(solution.record, drive_unit="deg"), "bench")


def test_tendons_are_part_of_the_picture(solution):
    rig = preset("du2018")
    joints = np.full(rig.joints, 2.0)
    tube = coarse_surface(rig, joints)
    line = np.array([[0.0, 1.0, 0.0], [10.0, 1.0, 0.0]])
    bare, whole = (mesh_of(tube, tendons, outer_mm(rig)) for tendons in ({}, {"a": line, "b": -line}))
    added = whole.mesh.points.shape[0] - bare.mesh.points.shape[0]
    assert added > 0
    values = np.frombuffer(base64.b64decode(whole.field.values.bvals), dtype=np.uint8).reshape(-1, 3)
    assert {tuple(row) for row in values[-added:].tolist()} == {TENDON_COLOURS["a"], TENDON_COLOURS["b"]}


def test_the_shipped_record_can_be_opened():
    content = {path: path.read_bytes() for path in (SHIPPED, SHIPPED.with_suffix(".toml"))}
    assert less_backbone(opened_record([{"name": p.name, "content": c} for p, c in content.items()])) is not None
