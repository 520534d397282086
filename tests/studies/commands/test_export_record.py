"""``notchbend export RECORD --to mujoco``: the files, what is said, and what is refused."""

import json
from pathlib import Path

import numpy as np
import pytest

from hysteresis.laws.prandtl_ishlinskii import plays
from studies.commands.cli import call

DRIVE = np.interp(np.linspace(0, 5, 200), np.arange(6), [0, 1, -1, 1, -1, 0])


@pytest.fixture
def here(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    angle = 10 * plays(DRIVE, [0.1])[0] + 0.02 * np.random.default_rng(0).standard_normal(200)
    rows = "".join(f"{x:.6f},{y:.6f}\n" for x, y in zip(DRIVE, angle, strict=True))
    Path("bench.csv").write_text("drive_mm,angle_deg\n" + rows)
    Path("pull.csv").write_text("tendon_force_N,angle_deg\n" + rows)
    sidecar = 'schema = 1\n[columns]\nforce = "tendon_force_N"\nangle = "angle_deg"\n'
    Path("pull.toml").write_text(sidecar)
    return tmp_path


def test_writes_model_and_values_and_says_what_is_left_out(here, capsys):
    command = ["export", "bench.csv", "--to", "mujoco", "--out", "joint.xml"]
    assert call(command) == 0
    said = capsys.readouterr().out.splitlines()
    assert len([line for line in said if line.startswith("frictionloss: left out: the record has no force")]) == 1
    assert any(line.startswith("backlash: 0.034") for line in said)  # 0.2 mm at 10 deg/mm is 0.0349 rad
    values = json.loads(Path("joint-values.json").read_text())
    assert values["maker"] == "notchbend"
    assert set(values["values"]) == {"gain", "zero", "backlash"}
    assert set(values["missing"]) == {"frictionloss", "damping", "stiffness", "springref"}
    found = values["values"]["backlash"]
    assert found["low"] < np.radians(2.0) < found["high"]
    assert found["unit"] == "rad"
    first = Path("joint.xml").read_bytes()
    assert call([*command, "--quiet"]) == 0  # its own files are replaced
    assert Path("joint.xml").read_bytes() == first


def test_the_moment_arm_is_that_of_the_option_or_of_the_rig(here):
    command = ["export", "pull.csv", "--to", "mujoco", "--quiet", "--out"]
    assert call([*command, "joint.xml", "--moment-arm", "2.64"]) == 0
    Path("pull.toml").write_text(Path("pull.toml").read_text() + '[rig]\npreset = "du2018"\npreload_N = 20.0\n')
    assert call([*command, "rig.xml"]) == 0
    one, other = (json.loads(Path(name).read_text()) for name in ("joint-values.json", "rig-values.json"))
    # friction is 0.1 N at the arm
    assert one["values"]["frictionloss"]["value"] == pytest.approx(0.1 * 2.64e-3, rel=0.02)
    ratio = other["moment_arm_mm"] / 2.64
    assert other["values"]["stiffness"]["value"] == pytest.approx(ratio * one["values"]["stiffness"]["value"])


@pytest.mark.parametrize(
    ("words", "said"),
    [
        (["pull.csv", "--out", "a.xml"], "pull.csv: moment arm: missing"),
        (["pull.csv", "--out", "a.xml", "--moment-arm", "0"], "--moment-arm 0: expected a number above 0"),
        (["pull.csv", "--out", "a.xml", "--moment-arm", "nan"], "--moment-arm nan: expected a number above 0"),
        (["bench.csv", "--out", "a.csv"], "a.csv: expected a name that ends in .xml"),
        (["bench.csv", "--out", "a.xml", "--preset", "du2018"], "--preset du2018: with the record bench.csv"),
        (["bench.csv", "--out", "a.xml", "--name", "x"], "--name x: with --to mujoco"),
        (["none.csv", "--out", "a.xml"], "none.csv"),
        (["--preset", "du2018", "--out", "a.xml", "--moment-arm", "2"], "--moment-arm 2.0: with a rig"),
    ],
)
def test_refuses_in_one_line_and_writes_nothing(here, capsys, words, said):
    before = sorted(one.name for one in here.iterdir())
    assert call(["export", *words, "--to", "mujoco", "--quiet"]) == 2
    error = capsys.readouterr().err
    assert said in error
    assert error.count("\n") == 1
    assert sorted(one.name for one in here.iterdir()) == before
