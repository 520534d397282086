"""`simulate` of a tube that jumps: words, and the column of the record."""

from pathlib import Path

import numpy as np

from hysteresis.records.record_file import read_record
from studies.commands.cli import call

RIG = """
preload_N = 12.5
precurvature_deg = 2.0

[bench]
joints = 1
pitch_mm = 20.0
flexure_stiffness_Nmm_per_rad = 50.0
rigid_gap_mm = 10.0

[material]
youngs_modulus_GPa = 60.0
poissons_ratio = 0.33

[wheel]
radius_mm = 10.0

[tendon]
EA_N = 2000.0
moment_arm_mm = 2.0
free_length_mm = 2000.0
"""
"""Two soft tendons press a joint together until it bends to either side: tests/fem_models/chain/test_jump.py."""


def test_simulate_says_where_the_tube_jumps(tmp_path: Path, capsys):
    rig, out = tmp_path / "snap.toml", tmp_path / "loop.csv"
    rig.write_text(RIG)
    assert call(["simulate", "--rig", str(rig), "--amplitude", "1.2", "--engine", "chain", "--out", str(out)]) == 0
    record = read_record(out)
    jumps = record.drive[record.jump == 1]
    assert jumps.size == 2  # down and up
    said = " ".join(capsys.readouterr().out.split())
    assert f"the tube jumps at {jumps[0]:.4g}, {jumps[1]:.4g} mm" in said
    assert (np.abs(np.diff(record.angle_deg))[np.flatnonzero(record.jump) - 1] > 20).all()
