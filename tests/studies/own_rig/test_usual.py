"""Values that no such device has are said, with the usual range and its source; those of the presets are usual."""

from dataclasses import replace

import pytest

from fem_models.rig import preset
from fem_models.rig.presets import PRESETS
from studies.commands.cli import call
from studies.own_rig.usual import unusual

RIG = preset("du2018")


@pytest.mark.parametrize("name", PRESETS)
def test_presets_are_usual(name):
    assert unusual(preset(name)) == []


@pytest.mark.parametrize(("rig", "words"), [
    (replace(RIG, material=replace(RIG.material, youngs_modulus_GPa=60_000.0)),
     "material.youngs_modulus_GPa = 60000 GPa: usual is 5 to 100 GPa (Nitinol 28 to 83: SMA Inc."),
    (replace(RIG, tendon_a=replace(RIG.tendon_a, EA_N=9.0)), "tendon_a.EA_N = 9 N: usual is 100 to 200000 N (E pi"),
    (replace(RIG, preload_N=1e5), "preload_N = 100000 N: usual is 0 to 400 N (a steel wire of 0.5 mm breaks at"),
    (replace(RIG, tendon_a=replace(RIG.tendon_a, moment_arm_mm=5.0)),
     "tendon_a.moment_arm_mm = 5: outside the tube of 6.2 mm: usual is a tendon within its outer radius, 3.1 mm"),
])  # fmt: skip
def test_a_value_that_no_device_has_is_said(rig, words):
    assert any(one.startswith(words) for one in unusual(rig))


def test_lengths_in_micrometres_are_said_where_the_strain_is(tmp_path, capsys):
    """All lengths a thousand times too large: the verdict on strain was safe, without a word."""
    from malformed.samples import RIG as text

    micro = text.replace("1.62", "1620").replace("1.40", "1400").replace("depth_mm = 1.2", "depth_mm = 1200")
    micro = micro.replace("width_mm = 0.8", "width_mm = 800").replace("spacing_mm = 1.2", "spacing_mm = 1200")
    micro = micro.replace("moment_arm_mm = 0.6", "moment_arm_mm = 600")
    (tmp_path / "mine.toml").write_text(micro)
    arguments = ["--rig", str(tmp_path / "mine.toml"), "--amplitude", "0.2", "--engine", "chain"]
    assert call(["simulate", *arguments, "--out", str(tmp_path / "loop.csv")]) == 0
    assert "note: tube.outer_diameter_mm = 1620 mm: usual is 0.3 to 20 mm" in capsys.readouterr().out
