"""Rig files: what they contain, and errors that name file, field, value and expectation."""

from pathlib import Path

import pytest

from fem_models.rig import RigError, read_rig
from fem_models.rig.rig_file import rig_of_tables

RIG_FILE = """
preload_N = 15.0
tube = {outer_diameter_mm = 6.0, inner_diameter_mm = 5.4}
notch = {shape = "rectangular_pair", count = 10, depth_mm = 2.6, width_mm = 0.8, spacing_mm = 1.2}
material = {youngs_modulus_GPa = 60.0, poissons_ratio = 0.33}
wheel = {radius_mm = 8.0}
friction = {guide_N = 0.1}
[tendon]
EA_N = 9000.0
moment_arm_mm = 2.5
free_length_mm = 120.0
[tendon_b]
moment_arm_mm = 2.4
"""


def test_rig_file(tmp_path: Path):
    path = tmp_path / "mine.toml"
    path.write_text(RIG_FILE)
    rig = read_rig(path)
    assert read_rig(str(path)) == rig
    assert rig.name == "mine"
    assert (rig.joints, rig.pitch_mm) == (10, 2.0)
    assert (rig.tendon_a.moment_arm_mm, rig.tendon_b.moment_arm_mm) == (2.5, 2.4)
    assert rig.tendon_b.EA_N == 9000.0


@pytest.mark.parametrize(
    ("old", "new", "message"),
    [
        ("radius_mm = 8.0", "radius = 8.0", "wheel.radius = 8.0: expected one of radius_mm"),
        ("wheel = {radius_mm = 8.0}", "", "wheel: missing"),
        ("EA_N = 9000.0", "EA_N = -9000.0", "tendon.EA_N = -9000.0: expected above 0"),
        ("EA_N = 9000.0", "", "EA_N: missing, expected in [tendon_"),
        ("inner_diameter_mm = 5.4", "inner_diameter_mm = 7", "tube.inner_diameter_mm = 7: expected below"),
        ("preload_N = 15.0", "preload_N = 'taut'", "preload_N = 'taut': expected a number"),
        ("preload_N = 15.0", "preload_N = ", "not TOML"),
        ("[tendon]", "colour = 'red'\n[tendon]", "colour = 'red': expected one of"),
        (
            "[tendon]",
            "[superelastic]\nheating_time_s = 0\n[tendon]",
            "superelastic.heating_time_s = 0: expected above 0",
        ),
        ("[tendon]", "[superelastic]\ntemperature_C = 0\n[tendon]", "superelastic.temperature_C = 0: expected warmer"),
        (
            "[tendon]",
            "[superelastic]\ncompression_factor = -1\n[tendon]",
            "superelastic.compression_factor = -1: expected above 0",
        ),
    ],
)
def test_bad_rig_files_are_named(tmp_path: Path, old: str, new: str, message: str):
    path = tmp_path / "mine.toml"
    path.write_text(RIG_FILE.replace(old, new, 1))
    with pytest.raises(RigError) as caught:
        read_rig(path)
    assert str(caught.value).startswith(str(path))
    assert message in str(caught.value)
    assert "\n" not in str(caught.value)


def test_nitinol_needs_no_constants(tmp_path: Path):
    path = tmp_path / "mine.toml"
    path.write_text(RIG_FILE.replace("{youngs_modulus_GPa = 60.0, poissons_ratio = 0.33}", "{}") + "[superelastic]\n")
    rig = read_rig(path)
    assert (rig.material.youngs_modulus_GPa, rig.material.poissons_ratio) == (62.9, 0.33)
    law = rig.superelastic
    assert (law.plateau_MPa, law.unloading_plateau_MPa, law.transformation_strain) == (480.0, 225.0, 0.046)
    assert (law.compression_factor, law.shift_MPa, law.heating_time_s) == (1.0, 0.0, None)
    path.write_text(RIG_FILE + "[superelastic]\ncompression_factor = 1.44\ntemperature_C = 20\nheating_time_s = 3\n")
    law = read_rig(path).superelastic
    assert law.shift_MPa == pytest.approx(-17 * 6.52)
    assert (law.compression_factor, law.heating_time_s) == (1.44, 3)
    assert rig_of_tables(rig.to_dict(), "as written") == rig


@pytest.mark.parametrize(
    ("old", "new"),
    [
        ("tube = {outer_diameter_mm = 6.0, inner_diameter_mm = 5.4}", ""),
        ("wheel =", "bench = {joints = 10, pitch_mm = 2.0, flexure_stiffness_Nmm_per_rad = 500.0}\nwheel ="),
    ],
)
def test_a_rig_file_has_notches_or_measured_joints(tmp_path: Path, old: str, new: str):
    path = tmp_path / "mine.toml"
    path.write_text(RIG_FILE.replace(old, new, 1))
    with pytest.raises(
        RigError, match=r"mine.toml: rig mine: expected either \[tube\] and \[notch\], or measured joints"
    ):
        read_rig(path)


def test_joint_is_no_table_of_a_rig_file(tmp_path: Path):
    path = tmp_path / "mine.toml"
    path.write_text(RIG_FILE.replace("wheel =", "joint = 3\nwheel =", 1))
    with pytest.raises(RigError, match=r"joint = 3: expected one of .*notch"):
        read_rig(path)


@pytest.mark.parametrize("arm", ["3.01", "5.9"])
def test_a_tendon_outside_the_tube_is_refused(arm, tmp_path):
    """The tube has an outer diameter of 6 mm; the arm counts from its axis."""
    path = tmp_path / "rig.toml"
    path.write_text(RIG_FILE.replace("moment_arm_mm = 2.5", f"moment_arm_mm = {arm}"))
    with pytest.raises(RigError, match=rf"tendon_a\.moment_arm_mm = {arm}: expected at most 3, the outer radius"):
        read_rig(path)
    path.write_text(RIG_FILE.replace("moment_arm_mm = 2.5", "moment_arm_mm = 3"))
    assert read_rig(path).tendon_a.moment_arm_mm == 3
