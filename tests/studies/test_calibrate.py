"""``notchbend calibrate``: limits, precision against repeated estimates, the files, and what is refused."""

import json
from dataclasses import replace

import numpy as np
import pytest

from fem_models.rig import RigError, preset
from hysteresis import Record
from hysteresis.laws.bouc_wen import BoucWen
from hysteresis.own import is_own
from hysteresis.records.record_file import read_columns
from studies.calibrate import Demands, calibration, excitation
from studies.commands.cli import call

WANTED = Demands(amplitude_mm=1.0)


class Run:
    """What a chain gives, by formula: a line with a loop, 1 % of strain and 10 N for each mm."""

    def __init__(self, rig, program):
        drive = program.drive_mm
        law = BoucWen(A=-0.7, beta=0.7, gamma=0.7, n=1.0, h0_deg=0.0)
        self.record = Record(drive=drive, angle_deg=20 * drive + law.along(20 * drive), kind="simulated")
        self.peak_strain = 0.01 * np.abs(drive)[:, np.newaxis]
        self.segment_tensions_N = (20 + 10 * np.abs(drive))[:, np.newaxis, np.newaxis]


@pytest.fixture(autouse=True)
def formula(monkeypatch):
    monkeypatch.setattr(excitation, "solve_chain", Run)


@pytest.fixture(scope="module")
def rig():
    return preset("du2018", preload_N=20.0)


def test_program_starts_and_ends_at_rest_in_steps_of_the_speed(rig):
    found = calibration(rig, WANTED)
    drive, time = np.array(found.drive_mm), np.array(found.time_s)
    assert drive[0] == drive[-1] == 0
    assert np.abs(drive).max() == pytest.approx(1.0)
    assert np.abs(np.diff(drive)).max() <= 0.5 / 20 + 1e-9
    assert np.allclose(np.diff(time), 1 / 20)
    assert found.grade == "full"
    assert found.error_deg <= found.wanted_deg == pytest.approx(found.loop_width_deg / 50)
    assert not found.limited
    assert len(found.sizes) >= 3


@pytest.mark.parametrize(
    ("limits", "amplitude"), [({"strain_percent": 0.5}, 0.5), ({"tension_N": 26.0}, 0.6), ({"tension_N": 100.0}, 1.0)]
)
def test_amplitude_stays_within_strain_and_tension(rig, limits, amplitude):
    found = calibration(rig, replace(WANTED, **limits))
    assert found.amplitude_mm <= amplitude + 1e-9
    assert found.amplitude_mm > 0.6 * amplitude
    assert found.limited == (amplitude < 1)


def test_more_noise_needs_more_time(rig):
    quiet, loud = (calibration(rig, replace(WANTED, noise_deg=noise)) for noise in (0.02, 0.6))
    assert loud.duration_s > quiet.duration_s


def test_precision_is_that_of_the_covariance(rig):
    """Error over paths by 200 draws of the parameters, from the covariance by the derivatives themselves."""
    columns = np.random.default_rng(1).normal(size=(300, 4)) * [1, 10, 0.1, 1]
    covariance = excitation._covariance(columns, 0.2)
    assert covariance == pytest.approx(0.04 * np.linalg.inv(columns.T @ columns))


def test_a_rig_without_friction_gets_a_loop(rig, monkeypatch):
    class Straight(Run):
        def __init__(self, rig, program):
            super().__init__(rig, program)
            self.record = replace(self.record, angle_deg=20 * program.drive_mm)

    monkeypatch.setattr(excitation, "solve_chain", Straight)
    found = calibration(rig, WANTED)
    assert found.assumed_loop
    assert "as assumed" in str(found)


def test_command_writes_a_program_and_its_summary(tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    words = ["calibrate", "--preset", "du2018", "--amplitude", "1", "--out", "motion.csv"]
    assert call([*words, "--json"]) == 0
    said = json.loads(capsys.readouterr().out)
    stored = json.loads((tmp_path / "motion-calibrate.json").read_text())
    assert stored["duration_s"] == said["duration_s"]
    assert is_own(tmp_path / "motion-calibrate.json")
    columns = read_columns(tmp_path / "motion.csv", ["drive_mm", "time_s"])
    assert columns["drive_mm"].size == stored["samples"]
    assert call(words) == 0  # its own files are replaced


@pytest.mark.parametrize(
    ("words", "said"),
    [
        (["--amplitude", "-1"], "--amplitude"),
        (["--noise", "0"], "--noise"),
        (["--minutes", "0.05"], "--minutes 0.05: 60 samples: too short for one loop"),
        (["--tension", "5"], "beyond 6 % of strain or 5 N at every drive"),
    ],
)
def test_bad_demands_are_one_line(words, said, tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    assert call(["calibrate", "--preset", "du2018", "--amplitude", "1", *words, "--out", "motion.csv"]) == 2
    err = capsys.readouterr().err
    assert said in err
    assert err.count("\n") == 1
    assert not list(tmp_path.iterdir())


def test_demands_are_checked():
    with pytest.raises(RigError, match="--speed"):
        Demands(amplitude_mm=1.0, speed_mm_per_s=0.0)
