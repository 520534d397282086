"""``simulate`` with a program of tendon forces."""

import json

import numpy as np
import pytest

from fem_models.load_control import run_load_control
from fem_models.rig import preset
from hysteresis.records.record_file import read_record
from studies.commands.cli import call

FORCES = [*np.linspace(0.0, 1.2, 7).tolist(), 0.8, 0.4, 0.0]


def simulate(folder, text, *options):
    program = folder / "forces.csv"
    program.write_text(text)
    rest = [*(options or ("--preset", "notched-wrist-150")), "--out", str(folder / "bend.csv")]
    return call(["simulate", "--program", str(program), *rest])


def as_csv(values, column="tendon_force_N"):
    return "\n".join([column, *map(str, values)]) + "\n"


@pytest.mark.parametrize("engine", ["chain", "multibody"])
def test_record_has_the_angles_at_the_forces_of_the_file(engine, tmp_path, capsys):
    options = ("--preset", "notched-wrist-150", "--engine", engine, "--json", "--quiet")
    assert simulate(tmp_path, as_csv(FORCES), *options) == 0
    record, summary = read_record(tmp_path / "bend.csv"), json.loads(capsys.readouterr().out)
    expected = run_load_control(preset("notched-wrist-150"), FORCES, engine)
    assert record.drive_unit == "N"
    np.testing.assert_allclose(record.drive, FORCES)
    np.testing.assert_allclose(record.angle_deg, expected.angle_deg, atol=1e-9)
    np.testing.assert_allclose(record.notches_deg, expected.notches_deg, atol=1e-9)
    assert summary["full_scale_deg"] == pytest.approx(expected.angle_deg.max())
    assert 0.0 < summary["widest_at_force_N"] < 1.2


def test_rig_of_a_file_without_preload_is_named_in_the_sidecar(tmp_path):
    rig = tmp_path / "tube.toml"
    rig.write_text(
        "preload_N = 0\ntendons = 1\n[tube]\nouter_diameter_mm = 1.62\ninner_diameter_mm = 1.4\n"
        '[notch]\nshape = "rectangular"\ncount = 5\ndepth_mm = 1.4\nwidth_mm = 0.8\nspacing_mm = 1.2\n'
        "[material]\nyoungs_modulus_GPa = 50.0\npoissons_ratio = 0.33\n[wheel]\nradius_mm = 10.0\n"
        "[tendon]\nEA_N = 5000.0\nmoment_arm_mm = 0.6\nfree_length_mm = 200.0\n"
    )
    assert simulate(tmp_path, as_csv([0.0, 0.3, 0.6]), "--rig", str(rig), "--engine", "chain", "--quiet") == 0
    assert read_record(tmp_path / "bend.csv").rig == {"file": str(rig)}


@pytest.mark.parametrize(
    ("text", "options", "words"),
    [
        ("tendon_force_N,time_s\n0,0\n1,1\n0,2\n", (), ["forces.csv", "'time_s'", "tendon_force_N"]),
        ("tendon_force_N,drive_mm\n0,0\n1,1\n0,2\n", (), ["forces.csv", "'drive_mm'", "tendon_force_N"]),
        (as_csv([0.0, -0.5, 0.0]), (), ["forces.csv:3", "-0.5", "at least 0"]),
        (as_csv([0.0, "one"]), (), ["forces.csv:3", "one"]),
        (as_csv([0.0]), (), ["forces.csv", "1 values", "at least 2"]),
        (as_csv(FORCES), ("--engine", "analytic"), ["--engine analytic", "chain or multibody"]),
        (as_csv(FORCES), ("--dynamic",), ["--dynamic", "tendon_force_N"]),
        (as_csv(FORCES), ("--amplitude", "2"), ["--amplitude 2", "--program"]),
    ],
)
def test_bad_forces_end_with_one_line(text, options, words, tmp_path, capsys):
    assert simulate(tmp_path, text, "--preset", "notched-wrist-150", *options) == 2
    error = capsys.readouterr().err
    assert error.count("\n") == 1
    assert all(word in error for word in words), error
    assert not (tmp_path / "bend.csv").exists()


def test_two_tendons_cannot_be_load_controlled(tmp_path, capsys):
    assert simulate(tmp_path, as_csv(FORCES), "--preset", "du2018", "--engine", "chain") == 2
    assert "two tendons: expected a rig of one tendon" in capsys.readouterr().err
