"""Files of requirements: a wrong one is refused in one line with file, field and value."""

import math
from pathlib import Path

import pytest

from studies.commands import call
from studies.design.design_file import read_design
from studies.design.stock import TUBES, WIRES

GOOD = """\
schema = 1
[require]
bend_deg = { min = 90, confidence = 0.99 }
tension_N = { max = 4 }
outer_diameter_mm = { max = 1.3 }
"""
BAD = {
    "schema": (GOOD.replace("schema = 1", "schema = 2"), ["schema = 2", "expected 1"]),
    "no table": ("schema = 1\n", ["require: missing"]),
    "table of another name": (GOOD + "[requires]\n", ["requires", "expected one of schema"]),
    "unknown quantity": (GOOD + "bent_deg = { min = 3 }\n", ["require.bent_deg", "expected a quantity", "bend_deg"]),
    "bare number": (GOOD + "reach_mm = 3\n", ["require.reach_mm = 3", "min = , max ="]),
    "no bound": (GOOD + "reach_mm = { confidence = 0.9 }\n", ["require.reach_mm", "expected min, max or both"]),
    "bounds the wrong way": (GOOD + "reach_mm = { min = 3, max = 2 }\n", ["reach_mm.max = 2", "above min = 3"]),
    "confidence of 1": (GOOD + "reach_mm = { min = 3, confidence = 1 }\n", ["confidence = 1", "below 1"]),
    "no bend": (GOOD.replace("bend_deg = {", "reach_mm = {"), ["require.bend_deg.min", "above 0"]),
    "tip force without tension": (
        GOOD.replace("tension_N = { max = 4 }", "tip_force_N = { min = 1 }"), ["tip_force_N", "require.tension_N.max"]),
    "unknown tolerance": (GOOD + "[tolerance]\nlength_mm = { sd = 1 }\n", ["tolerance.length_mm", "depth_mm"]),
    "tolerance of two kinds": (
        GOOD + "[tolerance]\ndepth_mm = { sd = 1, plus_minus = 2 }\n", ["tolerance.depth_mm", "expected one of sd"]),
    "tolerance of 0": (GOOD + "[tolerance]\ndepth_mm = { sd = 0 }\n", ["tolerance.depth_mm.sd = 0", "above 0"]),
    "lognormal with a width": (
        GOOD + '[tolerance]\ndepth_mm = { plus_minus = 0.1, distribution = "lognormal" }\n', ["with sd_percent"]),
    "range the wrong way": (GOOD + "[design]\nwidth_mm = [2, 1]\n", ["design.width_mm = [2, 1]", "least and most"]),
    "count that is not whole": (GOOD + "[design]\ncount = [2.5, 4]\n", ["design.count", "whole numbers"]),
    "depth beyond the tube": (GOOD + "[design]\ndepth_share = [0.5, 1.2]\n", ["depth_share", "0.99"]),
    "tube given": (GOOD + "[rig.tube]\nouter_diameter_mm = 1\n", ["rig.tube", "stock and search give it"]),
    "arm given": (GOOD + "[rig.tendon]\nmoment_arm_mm = 1\n", ["rig.tendon.moment_arm_mm", "wire and tube give it"]),
    "stock without numbers": (GOOD + "[stock]\ntubes = [[1.0]]\n", ["stock.tubes", "outer, inner"]),
    "kerf of 0": (GOOD + "[cutting]\nkerf_mm = 0\n", ["cutting.kerf_mm = 0", "above 0"]),
    "trade of no quantity": (GOOD + '[trade]\nmass = "min"\n', ["trade.mass", "expected a quantity"]),
    "life of a linear metal": (
        GOOD + "cycles = { min = 10 }\n[rig]\nsuperelastic = false\n", ["require.cycles", "[metal] missing"]),
    "metal out of range": (
        GOOD + "[metal]\nstrain = 0\ncycles = 1\nexponent = 1\nscatter = 1\n", ["metal.strain = 0", "above 0"]),
    "file outside": (GOOD + '[rig]\nfile = "../rig.toml"\n', ["rig.file = '../rig.toml'", "outside"]),
}  # fmt: skip


def file_of(tmp_path: Path, text: str) -> Path:
    path = tmp_path / "require.toml"
    path.write_text(text)
    return path


@pytest.mark.parametrize("case", BAD)
def test_bad_file_is_refused_in_one_line(case, tmp_path, capsys):
    text, words = BAD[case]
    path = file_of(tmp_path, text)
    assert call(["design", str(path), "--out", str(tmp_path / "out")]) == 2
    error = capsys.readouterr().err
    assert error.count("\n") == 1
    assert all(word in error for word in [str(path), *words]), error
    assert not (tmp_path / "out").exists()


def test_what_is_not_given_is_the_default(tmp_path):
    design = read_design(file_of(tmp_path, GOOD))
    assert (design.space.tubes, design.space.wires) == (TUBES, WIRES)
    assert design.space.base.superelastic is not None
    assert design.use.bend_deg == 90
    assert (design.use.tension_N, design.use.drive_mm) == (4, math.inf)
    assert dict(design.trade) == {"length_mm": "min", "tension_N": "min"}
    assert design.tolerances.each == ()


def test_own_stock_and_metal(tmp_path):
    text = GOOD + (
        "cycles = { min = 10 }\n[rig]\nsuperelastic = false\n[rig.material]\nyoungs_modulus_GPa = 3.5\n"
        "[metal]\nstrain = 0.002\ncycles = 1e5\nexponent = 0.5\nscatter = 0.4\n"
        "[stock]\ntubes = [[6, 4]]\nwires = [[0.3, 2000]]\n"
    )
    design = read_design(file_of(tmp_path, text))
    assert design.space.base.superelastic is None
    assert design.space.base.material.youngs_modulus_GPa == 3.5
    assert design.use.life is not None
    assert [(t.outer_mm, t.inner_mm) for t in design.space.tubes] == [(6, 4)]
    assert design.space.wires[0].breaking_N == pytest.approx(2000 * math.pi * 0.3**2 / 4)


def test_seed_of_the_call_replaces_that_of_the_file(tmp_path):
    path = file_of(tmp_path, "seed = 5\n" + GOOD)
    assert read_design(path).seed == 5
    assert read_design(path, seed=7).seed == 7


def test_example_of_the_guide_is_read():
    folder = Path(__file__).parents[3] / "docs"
    for path in (folder / "guide" / "require.toml", *(folder / "validation" / "design").glob("*.toml")):
        assert read_design(path).requirements.each
