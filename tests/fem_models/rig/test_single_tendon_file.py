"""Rig files of a single tendon."""

from pathlib import Path

import pytest

from fem_models.rig import RigError, read_rig
from fem_models.view.manipulator import tendon_lines

RIG_FILE = """
preload_N = 0
tendons = 1
precurvature_deg = 2.0
wheel = {radius_mm = 8.0}
tube = {outer_diameter_mm = 1.62, inner_diameter_mm = 1.40}
notch = {shape = "rectangular", count = 5, depth_mm = 1.40, width_mm = 0.8, spacing_mm = 1.2}
material = {youngs_modulus_GPa = 16.0, poissons_ratio = 0.33}
tendon = {EA_N = 5000.0, moment_arm_mm = 0.6, free_length_mm = 200.0}
"""


def test_a_rig_file_of_a_single_tendon(tmp_path: Path):
    path = tmp_path / "mine.toml"
    path.write_text(RIG_FILE)
    rig = read_rig(path)
    assert rig.tendon_b is None
    assert rig.tendons == (rig.tendon_a,)
    assert rig.precurvature_deg == 2.0
    assert rig.to_dict()["tendons"] == 1
    assert set(tendon_lines(rig, [1.0] * 5)) == {"a"}


@pytest.mark.parametrize(
    ("old", "new", "message"),
    [
        ("tendons = 1", "tendons = 3", "tendons = 3: expected 1 or 2"),
        ("tendons = 1", "", "preload_N = 0: expected above 0"),
        ("preload_N = 0", "preload_N = -1", "preload_N = -1: expected at least 0"),
        ("free_length_mm = 200.0", "free_length_mm = 200.0, toe_N = 5", "preload_N = 0: expected above 0"),
        ("tendon =", "tendon_b = {EA_N = 1.0}\ntendon =", "[tendon_b]: expected absent with tendons = 1"),
        ("precurvature_deg = 2.0", "precurvature_deg = 200.0", "precurvature_deg = 200.0: expected within +-90"),
    ],
)
def test_errors_of_a_rig_file_name_file_and_field(tmp_path: Path, old, new, message):
    path = tmp_path / "mine.toml"
    path.write_text(RIG_FILE.replace(old, new, 1))
    with pytest.raises(RigError) as caught:
        read_rig(path)
    assert str(caught.value).startswith(str(path))
    assert message in str(caught.value)
