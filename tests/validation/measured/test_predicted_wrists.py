"""Prediction of York's wrist: the rig file is the middle of the ranges, small forces have a closed form, the band."""

from pathlib import Path

import numpy as np
import pytest

from fem_models.joint.flexure import flexure
from fem_models.load_control import run_load_control
from fem_models.rig import preset, read_rig
from fem_models.rig.rig import numeric_fields
from hysteresis import read_record
from studies.commands.cli import call
from validation.measured.predicted_wrists import AUTHORS, RANGES, band, influence_deg, middle, predicted, score
from validation.measured.wrists import Trials

FILE = Path(__file__).parents[3] / "docs" / "validation" / "york2015.toml"
RIG = read_rig(FILE)
FORCE = np.linspace(0.0, 4.2, 22)


def test_rig_file_is_the_middle_of_the_ranges():
    one, other = (numeric_fields(rig) for rig in (RIG, middle(RIG)))
    assert one.keys() == other.keys()
    assert [*one.values()] == pytest.approx([*other.values()], rel=1e-3)
    assert all(RANGES[name].low <= value <= RANGES[name].high for name, value in AUTHORS.items())


def test_small_forces_bend_the_tube_as_its_segment_of_a_ring():
    # York et al., ICRA 2015, eq. of the static model: F (r + y) = E I/w theta, y and I of the planar segment, by a grid
    rig = predicted(RIG, {**AUTHORS, "mu": 0.0})
    y, x = np.meshgrid(np.linspace(-0.58, 0.58, 2321), np.linspace(0, 0.58, 1161))
    inside = (np.hypot(x, y) < 0.58) & (np.hypot(x, y) > 0.43) & (y < 0.58 - 0.988)
    height, cell = y[inside], 2 * 0.0005**2
    inertia = cell * ((height - height.mean()) ** 2).sum()
    arm, rigid = 0.43 - height.mean(), 75e3 * inertia / 0.508
    tip = run_load_control(rig, [0.0, 0.1]).angle_deg[1]
    elastic = np.degrees(5 * 0.1 * arm / flexure(rig).bending_Nmm_per_rad)
    assert flexure(rig).bending_Nmm_per_rad < rigid  # the roots give
    assert tip == pytest.approx(elastic, rel=0.01)
    assert 1.0 < tip / np.degrees(5 * 0.1 * arm / rigid) < 2.0


def test_band_holds_the_middle_and_widens_with_depth():
    found = band(RIG, FORCE, samples=64)
    assert (found.low_deg <= found.middle_deg).all()
    assert (found.middle_deg <= found.high_deg).all()
    assert (np.diff(found.median_deg) > 0).all()
    effect = influence_deg(RIG, 3.0)
    assert effect["depth"] > 0 > max(effect[name] for name in ("E", "plateau", "mu", "tendon"))
    assert max(effect, key=lambda name: abs(effect[name])) == "depth"
    assert found.high_deg[-1] < 1.01 * 5 * np.degrees(0.508 / (0.58 + 0.47))  # all notches closed


def test_score_counts_what_lies_inside():
    levels, which = np.array([0.0, 0.5, 1.0]), np.array([0, 1, 2, 2])
    middle_deg = run_load_control(middle(preset("notched-wrist-150")), levels).angle_deg[which]
    tip_deg = middle_deg + np.array([0, 0, 0, 90.0])
    trials = Trials("150", levels[which], np.zeros((4, 5)), tip_deg, np.ones(4, dtype=int))
    found = score(trials, samples=32)
    assert (found.inside, found.count) == (3, 4)
    assert found.rmse_deg == pytest.approx(45.0)


def test_the_command_runs_the_rig_file_under_forces(tmp_path):
    program = tmp_path / "forces.csv"
    program.write_text("\n".join(["tendon_force_N", *(f"{f:.2f}" for f in FORCE)]))
    out = tmp_path / "york.csv"
    options = ["--rig", str(FILE), "--program", str(program), "--engine", "chain", "--out", str(out)]
    assert call(["simulate", *options]) == 0
    np.testing.assert_allclose(read_record(out).angle_deg, run_load_control(RIG, FORCE).angle_deg, atol=0.01)
