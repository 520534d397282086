"""The law of the metal where a rig file states none: the flag past the plateau of Nitinol, and a line in words."""

import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from fem_models.chain import simulate_chain
from fem_models.joint import joint_mechanics
from fem_models.load import triangle
from fem_models.rig import preset, read_rig
from fem_models.rig.effects import Superelastic
from fem_models.rig.metal import METAL_RANGES
from fem_models.rig.rig import Material
from hysteresis.records.metrics import loop_width
from hysteresis.records.record_file import read_record
from hysteresis.records.sidecar import toml
from studies.commands.cli import call
from studies.own_rig.metal import law_of_metal

LINEAR = replace(
    preset("du2018-full-widths"), name="mine", material=Material(youngs_modulus_GPa=60.0, poissons_ratio=0.33)
)
FLAG = replace(LINEAR, superelastic=Superelastic())
REACH_MM = 2.2


def rig_file(folder: Path, **material: float) -> Path:
    """Write a rig file whose [material] has its elastic constants, and what is given."""
    tables = LINEAR.to_dict()
    elastic = {"youngs_modulus_GPa": 60.0, "poissons_ratio": 0.33}
    path = folder / "mine.toml"
    path.write_text(toml({**tables, "material": {**elastic, **material}}))
    return path


def width_deg(rig):
    record = simulate_chain(rig, triangle(REACH_MM, cycles=2))
    return loop_width(record.drive, record.angle_deg, record.cycle).max_deg


def test_a_rig_that_states_no_law_has_the_flag_past_the_plateau(tmp_path):
    """480 MPa over 60 GPa are 0.8 %; the joints of the preset are strained by more than twice that."""
    file = rig_file(tmp_path)
    found = law_of_metal(read_rig(file), -REACH_MM, REACH_MM, file)
    assert found.by_default
    assert found.rig == FLAG
    assert width_deg(found.rig) > 1.1 * width_deg(LINEAR)
    for words in ("0.8 %", "480/225 MPa (280 to 520 and 30 to 260)", "flag law of the metal's table", "linear"):
        assert words in found.words
    assert f"{width_deg(LINEAR):.2f}"[:3] in found.words


def test_below_the_plateau_the_law_does_not_matter(tmp_path):
    file = rig_file(tmp_path)
    small = 0.2
    found = law_of_metal(read_rig(file), -small, small, file)
    assert found.rig == read_rig(file)
    assert found.words is None
    bare, flag = (simulate_chain(rig, triangle(small)).angle_deg for rig in (LINEAR, FLAG))
    np.testing.assert_allclose(flag, bare, atol=0.02 * np.ptp(bare))


@pytest.mark.parametrize("share", [0.0, 0.3])
def test_a_stated_law_stays_and_the_line_says_what_each_gives(tmp_path, share):
    file = rig_file(tmp_path, loop_share=share)
    rig = read_rig(file)
    found = law_of_metal(rig, -REACH_MM, REACH_MM, file)
    assert found.rig == rig
    assert not found.by_default
    assert "the law that the rig states" in found.words
    assert ("Jenkins" in found.words) == (share > 0)


def test_a_preset_keeps_its_own_law():
    rig = preset("du2018")
    found = law_of_metal(rig, -REACH_MM, REACH_MM)
    assert found.rig is rig
    assert f"the rig's Jenkins loop {width_deg(rig):.3g} deg" in found.words
    wrist = preset("notched-wrist-90")
    assert law_of_metal(wrist, 0.0, 1.0).words is None  # it states the flag


def test_the_defaults_lie_within_the_table_of_the_metal():
    law = Superelastic()
    for name, (low, high, source) in METAL_RANGES.items():
        assert low <= getattr(law, name.partition(".")[2]) <= high
        assert source


def test_simulate_runs_the_flag_and_its_record_names_it(tmp_path, capsys):
    file, out = rig_file(tmp_path), tmp_path / "out" / "loop.csv"
    arguments = ["--rig", str(file), "--amplitude", "2.2", "--engine", "chain", "--out", str(out)]
    assert call(["simulate", *arguments]) == 0
    shown = " ".join(capsys.readouterr().out.split())
    assert "run with the flag law by default" in shown
    record = read_record(out)
    assert read_rig(record.rig["file"]).superelastic == Superelastic()
    np.testing.assert_allclose(record.angle_deg, simulate_chain(FLAG, triangle(2.2)).angle_deg, atol=1e-6)


def test_separate_divides_the_loop_of_the_flag(tmp_path):
    file = rig_file(tmp_path)
    assert call(["separate", "--rig", str(file), "--out", str(tmp_path), "--quiet"]) == 0
    found = json.loads((tmp_path / "separate.json").read_text())
    assert found["rig"]["superelastic"]["plateau_MPa"] == 480.0
    assert found["contributions"]["material"]["share"] > 0.05
    assert any("run with the flag law by default" in words for words in found["warnings"])


def test_peak_strain_of_the_decision_has_the_thrust():
    joint = joint_mechanics(LINEAR)
    record = simulate_chain(LINEAR, triangle(REACH_MM))
    bending = np.radians(np.abs(record.notches_deg).max()) * joint.peak_strain_per_rad
    thrust = 40.0 * joint.axial_strain_per_N
    words = law_of_metal(LINEAR, -REACH_MM, REACH_MM).words
    assert float(words.split("strained by ")[1].split(" %")[0]) == pytest.approx(100 * (bending + thrust), rel=0.02)
