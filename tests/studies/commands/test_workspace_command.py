"""``workspace``, and ``compensate`` with a rig in space."""

import json
import re
from dataclasses import replace

import numpy as np
import pytest

from fem_models.rig.presets_in_space import any_preset
from hysteresis.records.record import RecordError
from hysteresis.records.record_file import read_record
from hysteresis.records.sidecar import toml
from studies.commands.cli import call
from studies.commands.identification import identify_records


@pytest.fixture
def wrist(tmp_path):
    path = tmp_path / "wrist.toml"
    path.write_text(toml(any_preset("zhang2026").to_dict() | {"name": "mine"}))
    return path


def test_workspace_writes_numbers_table_and_figure(tmp_path, wrist, capsys):
    line = ["workspace", "--rig", str(wrist), "--amplitude", "0.6", "--circles", "2", "--directions", "12"]
    assert call([*line, "--out", str(tmp_path / "ws"), "--json"]) == 0
    shown, written = json.loads(capsys.readouterr().out), json.loads((tmp_path / "ws/workspace.json").read_text())
    assert shown["area_mm2"] == written["area_mm2"] > 0
    rows = np.loadtxt(tmp_path / "ws/workspace.csv", delimiter=",", skiprows=1)
    assert rows.shape == (24, 11)
    np.testing.assert_allclose(np.hypot(rows[:12, 0], rows[:12, 1]), 0.3, rtol=1e-12)
    spread = np.linalg.norm(rows[:, 5:8] - rows[:, 8:11], axis=1)
    assert written["largest_spread_mm"] == pytest.approx(spread.max())
    assert np.shape(written["compliance"][1]["held_mm_per_N"]) == (3, 3)
    assert (tmp_path / "ws/workspace.png").read_bytes().startswith(b"\x89PNG")


@pytest.mark.parametrize(("angles", "wheels"), [([0], 1), ([30, 210], 1), ([0, 120, 240], 3)])
def test_workspace_of_one_wheel_and_of_three(angles, wheels, tmp_path, capsys):
    rig, out = tmp_path / "rig.toml", tmp_path / "ws"
    rig.write_text(toml(any_preset("zhang2026").to_dict() | {"tendons": {"angles_deg": angles}}))
    line = ["workspace", "--rig", str(rig), "--amplitude", "0.5", "--circles", "2", "--directions", "12"]
    for _ in range(2):  # its own files are replaced
        assert call([*line, "--out", str(out), "--quiet"]) == 0
    written = json.loads((out / "workspace.json").read_text())
    rows = np.loadtxt(out / "workspace.csv", delimiter=",", skiprows=1)
    assert rows.shape == ((24 if wheels > 1 else 12), wheels + 9)
    assert ("area_mm2" in written, "length_mm" in written) == (wheels > 1, wheels == 1)
    assert len(written["compliance"]) == 1 + min(wheels, 2)
    assert f"drive_{wheels}_mm" in written["compliance"][0]
    assert f"drive_{wheels + 1}_mm" not in written["compliance"][0]
    assert call(["report", str(out), "--quiet"]) == 0
    page = (out / "report.html").read_text()
    assert 'id="workspace"' in page
    assert 'id="stiffness"' in page
    assert ("length of the curve" in page) == (wheels == 1)
    program = tmp_path / "circle.csv"
    circle = call(["simulate", "--rig", str(rig), "--amplitude", "0.5", "--circle", "--out", str(program), "--quiet"])
    assert circle == (0 if wheels > 1 else 2)
    assert ("has one wheel: expected 2 to 4" in capsys.readouterr().err) == (wheels == 1)


def test_compensate_writes_drives_that_simulate_takes(tmp_path, wrist, capsys):
    reference, out = tmp_path / "wanted.csv", tmp_path / "drives.csv"
    turn = np.linspace(0, 2 * np.pi, 13)
    rows = [(0.0, 0.0), (5.0, 0.0), *(10.0 * np.column_stack([np.cos(turn), np.sin(turn)])).tolist()]
    reference.write_text("angle_deg,angle_2_deg\n" + "".join(f"{a},{b}\n" for a, b in rows))
    assert call(["compensate", str(wrist), "--reference", str(reference), "--out", str(out), "--json"]) == 0
    summary = json.loads(capsys.readouterr().out)
    assert summary["largest_error_deg"] < 2e-3 < summary["rms_without_compensation_deg"]
    again = tmp_path / "again.csv"
    assert call(["simulate", "--rig", str(wrist), "--program", str(out), "--out", str(again), "--quiet"]) == 0
    record = read_record(again)
    np.testing.assert_allclose(np.column_stack([record.angle_deg, record.angle_2_deg]), rows, atol=2e-3)
    (tmp_path / "again.csv").unlink()
    assert call(["report", str(tmp_path), "--quiet"]) == 0
    page = (tmp_path / "report.html").read_text()
    assert page.count('class="still"') == 3  # drives, angles, tensions
    assert f"{summary['samples']} samples of rig mine" in page
    found = re.search(r'<td class="found">(.*?)</td>', page)[1]
    assert [float(one) for one in found.removesuffix(" deg").split(" → ")] == pytest.approx(
        [summary["rms_without_compensation_deg"], summary["rms_deg"]], rel=5e-3
    )


def test_what_is_refused(tmp_path, wrist, capsys):
    planar = tmp_path / "planar.toml"
    tables = any_preset("du2018").to_dict()
    planar.write_text(toml(tables))
    reference = tmp_path / "wanted.csv"
    reference.write_text("angle_deg\n0\n1\n2\n")
    out = str(tmp_path / "out.csv")
    for line, said in (
        (["workspace", "--rig", str(planar), "--amplitude", "1", "--out", str(tmp_path)], "bends in one plane"),
        (["workspace", "--rig", str(wrist), "--amplitude", "-1", "--out", str(tmp_path)], "amplitude = -1"),
        (["compensate", str(planar), "--reference", str(reference), "--out", out], "bends in one plane"),
        (["compensate", str(wrist), "--reference", str(reference), "--out", out], "column 'angle_2_deg' missing"),
    ):
        assert call(line) == 2
        message = capsys.readouterr().err
        assert said in message
        assert message.count("\n") == 1


def test_identify_takes_one_plane_of_a_rig_in_space(tmp_path, wrist, capsys):
    program, record = tmp_path / "program.csv", tmp_path / "second.csv"
    quarter = np.linspace(0, 0.8, 9)
    cycle = [quarter[::-1][1:], -quarter[1:], -quarter[::-1][1:], quarter[1:]]
    drive = np.concatenate([quarter, *cycle, *cycle])
    program.write_text("drive_1_mm,drive_2_mm\n" + "".join(f"0,{x}\n" for x in drive))
    assert call(["simulate", "--rig", str(wrist), "--program", str(program), "--out", str(record), "--quiet"]) == 0
    line = ["identify", str(record), "--law", "bouc-wen", "--out", str(tmp_path / "fit"), "--json"]
    assert call(line) == 2
    assert "columns.drive_2: this wheel moves" in capsys.readouterr().err
    assert call([*line, "--plane", "2"]) == 0
    fit = json.loads(capsys.readouterr().out)
    assert fit["kinematics"] == "chain"  # in space, without friction and loop
    assert fit["heldout"]["rmse_deg"] < 0.5
    # opposite notches of one plane are alike: the other plane stays straight
    assert abs(fit["coupling"][0]["share"]) < 1e-9
    # of a record in which the other wheel moves too, no curve of one wheel is the backbone
    whole = read_record(record)
    both = replace(whole, drive=0.5 * drive, drive_2=drive)
    with pytest.raises(RecordError, match=r"columns\.drive_2: this wheel moves"):
        identify_records([both])
