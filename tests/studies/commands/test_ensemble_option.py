"""``--ensemble`` of simulate and separate."""

import json
from dataclasses import replace

import numpy as np
import pytest

from fem_models.rig import ensemble, preset
from fem_models.rig.rig import Friction
from hysteresis.records.record_file import read_columns
from studies.commands.cli import call
from studies.commands.separation import separate_rig, summary


@pytest.fixture
def few(monkeypatch):
    """Four members in place of all."""
    monkeypatch.setattr(
        "studies.commands.options.ensemble", lambda name, preload_N: ensemble(name, preload_N=preload_N)[::50]
    )


def test_simulate_gives_ranges_beside_the_record(tmp_path, few, capsys):
    out = tmp_path / "loop.csv"
    arguments = ["simulate", "--preset", "du2018", "--preload", "10", "--amplitude", "2.2"]
    assert call([*arguments, "--engine", "chain", "--ensemble", "--json", "--out", str(out)]) == 0
    told = capsys.readouterr()
    found = json.loads(told.out)
    assert found["ensemble"]["members"] == 4
    width = found["ensemble"]["ranges"]["loop_width_deg"]
    assert 6.8 < width["low"] < width["high"] < 7.3
    bands = read_columns(tmp_path / "loop-ensemble.csv", ["drive_mm", "angle_low_deg", "angle_high_deg"])
    assert (bands["angle_low_deg"] <= bands["angle_high_deg"] + 1e-9).all()
    assert np.abs(bands["angle_high_deg"]).max() > 40


@pytest.mark.slow
def test_separate_gives_ranges_sensitivities_and_raw_loops(tmp_path, few, capsys):
    assert call(["separate", "--preset", "du2018", "--ensemble", "--out", str(tmp_path)]) == 0
    told = " ".join(capsys.readouterr().out.split())
    assert "90 % of 4 members of the ensemble: 4." in told
    assert "raw loops, deg wide and mJ: none" in told
    assert "one loop cannot separate" in told
    found = json.loads((tmp_path / "separate.json").read_text(encoding="utf-8"))
    low, high = found["contributions"]["friction"]["intervals"]["share"]
    assert 0 < low < high < 1.1  # the stretch of the tendons may have less than none
    assert found["ensemble"]["width_deg"] == pytest.approx([4.42, 4.42], abs=0.25)
    assert found["sensitivity"]["tendon.EA_N"]["width"] < 0


def test_a_rig_without_a_loop_gives_valid_json_and_no_derivative_of_its_width():
    rig = preset("du2018")
    quiet = replace(rig, friction=Friction(), material=replace(rig.material, loop_share=0.0))
    result = separate_rig(quiet, 2.2)
    assert not any("nan" in line or "d ln(width)" in line for line in summary(result))
    found = json.loads(json.dumps(result.to_dict(), allow_nan=False))["sensitivity"]["tendon.EA_N"]
    assert found["width"] is None
    assert found["range"] != 0


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (["simulate", "--preset", "du2018", "--amplitude", "1"], "--ensemble with --engine multibody"),
        (["separate", "--preset", "du2018", "--engine", "multibody"], "--engine multibody with --ensemble"),
        (["separate", "--preset", "notched-wrist-90"], "ensemble of notched-wrist-90: expected a preset that has one"),
    ],
)
def test_what_has_no_ensemble_is_refused(tmp_path, capsys, arguments, message):
    assert call([*arguments, "--ensemble", "--out", str(tmp_path / "out.csv")]) == 2
    assert message in capsys.readouterr().err
    assert not (tmp_path / "out.csv").exists()


@pytest.mark.slow
def test_study_runs_over_the_members(tmp_path, capsys):
    """Widths of the members at 10 and 20 N are the facts that all of them meet; ranges stand in a table."""
    file = tmp_path / "two.toml"
    file.write_text(
        'schema = 1\nengine = "chain"\n[rig]\npreset = "du2018"\n[program]\namplitude_mm = 2.2\ncycles = 1\n'
        '[vary]\npreload_N = [10, 20]\n[quantities]\ngroups = ["loop"]\n',
        encoding="utf-8",
    )
    out = tmp_path / "out"
    assert call(["study", str(file), "--ensemble", "--workers", "1", "--out", str(out), "--json"]) == 0
    assert json.loads(capsys.readouterr().out)["status"] == {
        "ok": 2 * len(ensemble("du2018")),
        "failed": 0,
        "pending": 0,
    }
    table = read_columns(out / "ensemble.csv", ["preload_N", "loop_width_max_deg_low", "loop_width_max_deg_high"])
    assert table["preload_N"].tolist() == [10, 20]
    assert table["loop_width_max_deg_low"] == pytest.approx([7.04, 4.42], abs=0.25)
    assert table["loop_width_max_deg_high"] == pytest.approx([7.04, 4.42], abs=0.25)


def test_study_of_a_rig_without_an_ensemble_is_refused(tmp_path, capsys):
    file = tmp_path / "wrist.toml"
    file.write_text(
        'schema = 1\nengine = "chain"\n[rig]\npreset = "notched-wrist-90"\n[program]\namplitude_mm = 1.0\n'
        "[vary]\npreload_N = [0, 1]\n",
        encoding="utf-8",
    )
    assert call(["study", str(file), "--ensemble", "--out", str(tmp_path / "out")]) == 2
    assert "ensemble of notched-wrist-90: expected a preset that has one: du2018" in capsys.readouterr().err
