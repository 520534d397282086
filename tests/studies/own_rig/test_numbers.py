"""Where the numbers of a user's own rig come from: its file, or a default."""

from pathlib import Path

import pytest

from fem_models.rig import RigError, read_rig
from fem_models.rig.rig import numeric_fields
from fem_models.rig.rig_file import given_in_file
from studies.own_rig.numbers import numbers_of_file, with_preloads

RIG = """
preload_N = 15.0
[tube]
outer_diameter_mm = 6.0
inner_diameter_mm = 5.4
[material]
youngs_modulus_GPa = 60.0
poissons_ratio = 0.33
[wheel]
radius_mm = 8.0
[friction]
sheath_N = 0.5
[tendon]
EA_N = 9000.0
moment_arm_mm = 2.5
free_length_mm = 120.0
[tendon_b]
toe_N = 4.0
"""
NOTCH = "[notch]\nshape = 'rectangular_pair'\ncount = 2\ndepth_mm = 2.6\nwidth_mm = 0.8\nspacing_mm = 1.2\n"
ROW = "[[notch]]\nshape = 'rectangular_pair'\ndepth_mm = 2.6\nwidth_mm = 0.8\nspacing_mm = 1.2\n"
DEFAULTS = {"material.loop_share", "tendon_a.toe_N", "friction.guide_N", "friction.capstan_coefficient"}


def rig_file(folder: Path, notch: str) -> Path:
    path = folder / "mine.toml"
    path.write_text(RIG + notch)
    return path


@pytest.mark.parametrize("notch", [NOTCH, 2 * ROW])
def test_defaults_are_not_called_numbers_of_the_file(notch, tmp_path):
    path = rig_file(tmp_path, notch)
    sources = {row.name: row.source for row in numbers_of_file(numeric_fields(read_rig(path)), path)}
    assert {name for name in DEFAULTS if sources[name] == "default"} == DEFAULTS
    from_file = {"preload_N", "tendon_a.EA_N", "tendon_b.EA_N", "tendon_b.toe_N", "friction.sheath_N"}
    from_file |= {"tube.outer_diameter_mm", "notch.depth_mm", "wheel.radius_mm"}
    assert {name for name in from_file if sources[name] == "file"} == from_file


def test_the_preload_is_the_file_s_and_a_note_says_those_of_the_loops(tmp_path):
    """It had been that of the last record, from the "file"."""
    path = rig_file(tmp_path, NOTCH)
    rows = numbers_of_file(numeric_fields(read_rig(path)), path)

    def note(*preloads: float) -> str:
        (row,) = (row for row in with_preloads(rows, preloads) if row.name == "preload_N")
        assert (row.value, row.source) == (15.0, "file")
        return row.note

    assert note(15.0) == ""
    assert note(10.0, 20.0) == "the loops of this report are at 10, 20 N"


def test_a_file_that_cannot_be_read_is_named(tmp_path):
    with pytest.raises(RigError, match=r"no\.toml"):
        given_in_file(tmp_path / "no.toml")
