"""``simulate`` of a rig in space, and what planar commands say of its record."""

import json

import numpy as np
import pytest

from fem_models.load import triangle
from fem_models.rig import RigError, preset
from fem_models.rig.layout import LayoutKeys
from fem_models.rig.presets_in_space import any_preset
from fem_models.rig.rig import rig_in_space
from fem_models.spatial import WheelProgram, circle, first_wheel, of_rig_in_space, simulate_in_space, solve_spatial
from hysteresis.records.planes import not_used, require_one_wheel
from hysteresis.records.record import RecordError
from hysteresis.records.record_file import read_record, read_records, write_record
from hysteresis.records.sidecar import toml
from studies.commands.cli import call
from studies.programs import wheels_of_file

RIG = any_preset("zhang2026")
PRESET = ("--preset", "zhang2026")


def simulate(folder, *options):
    return call(["simulate", *options, "--out", str(folder / "run.csv")])


def test_a_circle_is_a_record_with_two_angles_and_four_tensions(tmp_path, capsys):
    assert simulate(tmp_path, *PRESET, "--amplitude", "0.5", "--circle", "--json") == 0
    summary, record = json.loads(capsys.readouterr().out), read_record(tmp_path / "run.csv")
    run = solve_spatial(of_rig_in_space(RIG), circle(0.5).of_tendons(RIG))
    np.testing.assert_array_equal(np.column_stack([record.angle_deg, record.angle_2_deg]), run.bending_deg)
    np.testing.assert_array_equal(record.tip_mm, run.tip_mm)
    np.testing.assert_array_equal(record.torsion_deg, run.torsion_deg)
    named = [record.tension_a_N, record.tension_b_N, record.tension_c_N, record.tension_d_N]
    np.testing.assert_array_equal(np.column_stack(named), run.tensions_N[:, :, 0])
    np.testing.assert_allclose(np.hypot(record.drive, record.drive_2)[record.cycle > 0], 0.5, rtol=1e-12)
    assert record.notches_deg.shape == (record.drive.size, 24)
    assert summary["largest_bending_deg"] == pytest.approx(np.linalg.norm(run.bending_deg, axis=1).max())
    assert set(record.to_xarray()) >= {"angle_2_deg", "torsion_deg", "drive_2_mm", "tip_mm"}


def test_an_amplitude_moves_the_first_wheel(tmp_path, capsys):
    assert simulate(tmp_path, *PRESET, "--amplitude", "0.3", "--step", "0.15", "--quiet") == 0
    record = read_record(tmp_path / "run.csv")
    assert np.abs(record.drive).max() == 0.3
    assert not record.drive_2.any()
    assert np.abs(record.angle_2_deg).max() < 1e-9  # by symmetry
    require_one_wheel(record)
    assert "angle_2, torsion, tension_c, tension_d: not used" in not_used(record)


def test_a_record_is_a_program_and_tensions_are_one(tmp_path):
    record = simulate_in_space(RIG, circle(0.2))
    write_record(record, tmp_path / "run.csv")
    again = wheels_of_file(tmp_path / "run.csv")
    np.testing.assert_array_equal(again.wheels, np.column_stack([record.drive, record.drive_2]))
    named = [record.tension_a_N, record.tension_b_N, record.tension_c_N, record.tension_d_N]
    force = WheelProgram(np.column_stack(named), by_force=True)
    # the tensions of a run by displacement lead through the same states
    np.testing.assert_allclose(simulate_in_space(RIG, force).angle_2_deg, record.angle_2_deg, atol=0.05)


def test_tensions_of_a_file(tmp_path):
    program = tmp_path / "tensions.csv"
    program.write_text("tension_1_N,tension_2_N,tension_3_N,tension_4_N\n2,2,2,2\n3,2,2,2\n3,2,3,2\n")
    assert simulate(tmp_path, *PRESET, "--program", str(program), "--quiet") == 0
    record = read_record(tmp_path / "run.csv")
    assert record.drive_unit == "N"
    np.testing.assert_allclose(record.tension_c_N, [2, 2, 3], atol=1e-9)
    assert record.angle_deg[-1] > 1
    assert record.angle_2_deg[-1] > 1


@pytest.mark.parametrize(
    ("words", "said"),
    [
        (("simulate", *PRESET, "--amplitude", "1", "--engine", "analytic"), "expected chain or multibody"),
        (("simulate", *PRESET, "--amplitude", "1", "--dynamic"), "expected a quasi-static run"),
        (("simulate", *PRESET, "--amplitude", "1", "--ensemble"), "--ensemble with rig zhang2026"),
        (("simulate", *PRESET, "--circle"), "expected --amplitude"),
        (("simulate", "--preset", "du2018", "--amplitude", "1", "--circle"), "--circle: both wheels of a rig in space"),
        (("export", *PRESET, "--to", "mujoco"), "bends in space, which run, simulate"),
        (("separate", *PRESET), "bends in space, which run, simulate"),
        (("identify", "RECORD"), "columns.drive_2: this wheel moves"),
        (("separate", "RECORD"), "columns.drive_2: this wheel moves"),
        (("compensate", "RECORD", "--reference", "RECORD"), "columns.drive_2: this wheel moves"),
    ],
)
def test_what_knows_planar_rigs_only_says_so_in_one_line(words, said, tmp_path, capsys):
    record = tmp_path / "circle.csv"
    write_record(simulate_in_space(RIG, circle(0.1)), record)
    out = tmp_path / (
        "run.csv" if words[0] in ("simulate", "compensate") else "run.xml" if words[0] == "export" else "out"
    )
    line = [str(record) if word == "RECORD" else word for word in words]
    assert call([*line, "--out", str(out)]) == 2
    message = capsys.readouterr().err
    assert said in message
    assert message.count("\n") == 1


def test_what_a_program_in_space_cannot_be(tmp_path):
    path = tmp_path / "p.csv"
    for text, words in (
        ("force\n1\n2\n", "expected 'drive_1_mm'"),
        ("drive_1_mm,tension_1_N\n0,1\n1,1\n", "'drive_1_mm' beside 'tension_1_N'"),
        ("time_s,tension_1_N\n0,1\n1,1\n", "'time_s' beside"),
    ):
        path.write_text(text)
        with pytest.raises(RecordError, match=words):
            wheels_of_file(path)
    path.write_text("drive_1_mm\n0\n1\n")
    with pytest.raises(RigError, match=r"drives = 1 columns: expected one for each of 2 wheels"):
        wheels_of_file(path).of_tendons(RIG)
    path.write_text("tension_1_N\n-1\n1\n")
    with pytest.raises(RigError, match=r"p.csv: drives = a tension of -1"):
        wheels_of_file(path)


def test_a_record_in_which_two_wheels_move_is_not_read_for_one_plane(tmp_path):
    path = tmp_path / "circle.csv"
    write_record(simulate_in_space(RIG, circle(0.1)), path)
    with pytest.raises(RecordError, match="drive_2: this wheel moves"):
        read_records([path])


def test_a_planar_program_keeps_its_cycles():
    program = first_wheel(triangle(1.0, step_mm=0.5), RIG)
    np.testing.assert_array_equal(program.cycle, triangle(1.0, step_mm=0.5).cycle)
    assert program.wheels.shape == (11, 2)


def test_the_multibody_engine_agrees_with_the_chain(tmp_path):
    """Two engines of the same laws: within 0.1 deg, as was wanted of them."""
    keys = LayoutKeys("", tuple(90.0 * (k % 2) for k in range(14)), (0.0, 180.0, 90.0, 270.0), (1, 1, 2, 2))
    rig, wrist = rig_in_space(preset("du2018"), keys), tmp_path / "wrist.toml"
    wrist.write_text(toml(rig.to_dict()))
    program = tmp_path / "program.csv"
    program.write_text("drive_1_mm,drive_2_mm\n0,0\n0.3,0\n0.3,0.3\n0,0.3\n")
    assert simulate(tmp_path, "--rig", str(wrist), "--engine", "multibody", "--program", str(program), "--quiet") == 0
    here, there = read_record(tmp_path / "run.csv"), simulate_in_space(rig, wheels_of_file(program))
    assert "multibody in space" in here.title
    np.testing.assert_allclose(here.angle_deg, there.angle_deg, atol=0.1)
    np.testing.assert_allclose(here.angle_2_deg, there.angle_2_deg, atol=0.1)
