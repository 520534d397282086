"""Rig files of rigs that bend in space: what takes a rig into space, and what leaves it planar."""

from dataclasses import replace

import numpy as np
import pytest

from fem_models.analytic import simulate_analytic
from fem_models.chain.solve import solve_chain
from fem_models.load import triangle
from fem_models.rig import RigError, preset, read_rig
from fem_models.rig.effects import Backlash, TipLoad
from fem_models.rig.layout import wheels_of_pairs
from fem_models.rig.presets import NAMES_IN_SPACE
from fem_models.rig.presets_in_space import PRESETS_IN_SPACE, any_preset
from fem_models.rig.rig import numeric_fields, rig_in_space, with_notch
from fem_models.rig.rig_file import read_any_rig
from fem_models.spatial import of_rig_in_space, solve_spatial
from hysteresis.records.sidecar import toml

TABLES = preset("du2018").to_dict()
TENDON = TABLES["tendon_a"]
PLANAR = {name: value for name, value in TABLES.items() if not name.startswith("tendon_")} | {"tendon": TENDON}
QUARTER = [90.0 * (k % 2) for k in range(14)]
FOUR = {"angles_deg": [0, 180, 90, 270]}


def written(folder, **changed):
    """Write a rig file with some tables changed; keys of [notch] are added to it."""
    notch = PLANAR["notch"] | changed.pop("notch", {})
    path = folder / "rig.toml"
    path.write_text(toml(PLANAR | {"notch": notch} | changed))
    return path


def test_a_turn_of_0_and_tendons_at_0_and_180_are_the_planar_rig(tmp_path):
    path = written(tmp_path, notch={"turn_deg": [0] * 14}, tendons={"angles_deg": [0, 180]})
    assert read_rig(path) == read_any_rig(path) == preset("du2018")


def test_turned_notches_and_four_tendons_are_a_rig_in_space(tmp_path):
    rig = read_any_rig(written(tmp_path, notch={"turn_deg": QUARTER}, tendons=FOUR))
    assert not rig.is_planar
    assert rig.turns_deg == tuple(QUARTER)
    assert rig.wheels == (1, 1, 2, 2)
    np.testing.assert_array_equal(rig.winding(), [[1, -1, 0, 0], [0, 0, 1, -1]])
    again = tmp_path / "again.toml"
    again.write_text(toml(rig.to_dict()))
    assert read_any_rig(again) == rig


def test_rows_have_a_turn_too(tmp_path):
    cut = {"shape": "rectangular_pair", "depth_mm": 2.8, "width_mm": 1.4, "spacing_mm": 1.2}
    rows = [cut | {"count": 2, "turn_deg": 0.0}, cut | {"turn_deg": 90.0}]
    text = toml({name: value for name, value in PLANAR.items() if name != "notch"} | {"tendons": FOUR})
    path = tmp_path / "rows.toml"
    path.write_text(text + "".join(toml({"x": row}).replace("[x]", "[[notch]]") for row in rows))
    assert read_any_rig(path).turns_deg == (0.0, 0.0, 90.0)


def test_opposite_tendons_share_a_wheel():
    assert wheels_of_pairs([0, 180, 90, 270]) == (1, 1, 2, 2)
    assert wheels_of_pairs([0, 90, 180, 270]) == (1, 2, 1, 2)
    assert wheels_of_pairs([45, -135]) == (1, 1)
    assert wheels_of_pairs([0, 120, 240]) == (1, 2, 3)


def test_loads_have_three_components(tmp_path):
    changed = {
        "tip_load": {"force_N": [0.0, -0.1, 0.2]},
        "tip_mass": {"mass_g": 25.0, "direction": [0, 0, -2]},
        "gravity": {"ring_mass_g": 0.1, "direction": [0, -1, 0]},
    }
    rig = read_any_rig(written(tmp_path, **changed))
    loads = of_rig_in_space(rig).loads
    # 9.80665 m/s^2 is the standard acceleration of gravity
    np.testing.assert_allclose(loads.tip_N, [0.0, -0.1, 0.2 - 25e-3 * 9.80665], rtol=1e-12)
    np.testing.assert_allclose(loads.ring_weight_N, [0.0, -1e-4 * 9.80665, 0.0], rtol=1e-12)
    again = tmp_path / "again.toml"
    again.write_text(toml(rig.to_dict()))
    assert read_any_rig(again) == rig


@pytest.mark.parametrize(
    ("changed", "words"),
    [
        ({"notch": {"turn_deg": [0, 90]}}, "notch.turn_deg = 2 numbers: expected one number, or 14"),
        ({"notch": {"turn_deg": "x"}}, "notch.turn_deg = 'x': expected a number"),
        ({"tendons": {"angles_deg": [0] * 5}}, "tendons.angles_deg = .*: expected a list of 1 to 4 angles"),
        ({"tendons": {"angle_deg": [0]}}, "tendons.angle_deg = .*: expected one of angles_deg, wheels"),
        ({"tendons": FOUR | {"wheels": [1, 1, 1, 2]}}, "tendons.wheels = .*at most 2 on a wheel"),
        ({"tendons": FOUR | {"wheels": [1, 1, 3, 3]}}, "tendons.wheels"),
        ({"tendons": FOUR, "tendon_b": TENDON}, "tendon_b.: expected absent with .tendons."),
        ({"tip_load": {"force_N": [1, 2]}}, "tip_load.force_N = .1, 2.: expected three components"),
        ({"tip_load": {"force_N": [1, 2, 3], "direction_deg": 0}}, "tip_load.direction_deg: expected absent"),
        ({"tip_mass": {"mass_g": 1, "direction": [0, 0, 0]}}, "tip_mass.direction = .*not 0"),
        ({"tip_mass": {"direction": [0, 0, 1]}}, "tip_mass.mass_g: missing"),
        ({"tip_mass": {"mass_g": -1, "direction": [0, 0, 1]}}, "tip_mass.mass_g = -1"),
        ({"tendons": FOUR, "backlash": {"width_mm": 0.1}}, "backlash = given: expected none in space"),
    ],
)
def test_what_a_rig_file_cannot_say(tmp_path, changed, words):
    with pytest.raises(RigError, match=words) as caught:
        read_any_rig(written(tmp_path, **changed))
    assert "rig.toml: " in str(caught.value)
    assert "\n" not in str(caught.value)


def test_a_planar_reader_names_the_key_and_who_knows_it(tmp_path):
    with pytest.raises(RigError, match=r"rig.toml: notch.turn_deg: rig du2018 bends in space, which run, simulate"):
        read_rig(written(tmp_path, notch={"turn_deg": 90}))
    with pytest.raises(RigError, match="preset = zhang2026: the rig bends in space"):
        preset("zhang2026")


def test_planar_engines_refuse_a_rig_in_space():
    program = triangle(0.5)
    for rig in (any_preset("zhang2026"), rig_in_space(preset("du2018"))):
        for run in (solve_chain, simulate_analytic):
            with pytest.raises(RigError, match=f"rig {rig.name} bends in space, which run, simulate"):
                run(rig, program)


def test_a_planar_rig_is_a_rig_with_two_opposite_tendons_on_one_wheel():
    rig = preset("du2018")
    assert rig.is_planar
    assert rig.in_plane is rig
    assert (rig.angles_deg, rig.wheels, rig.turns_deg) == ((0.0, 180.0), (1, 1), (0.0,) * 14)
    here, there = of_rig_in_space(rig), of_rig_in_space(rig_in_space(rig))
    assert (here.tendons, here.loads) == (there.tendons, there.loads)
    assert [joint.stiffness for joint in here.joints] == [joint.stiffness for joint in there.joints]
    assert rig_in_space(rig).in_plane == rig != rig_in_space(rig)
    alone = replace(rig, tendon_b=None)
    assert (alone.angles_deg, alone.wheels, alone.winds_both_ways(1)) == ((0.0,), (1,), False)


def test_effects_that_the_chain_in_space_lacks_are_refused():
    with pytest.raises(RigError, match="backlash = given"):
        rig_in_space(replace(preset("du2018"), backlash=Backlash(0.1)))


def test_a_wrist_of_different_depths_is_that_of_the_planar_chain():
    """Two engines: the compiled planar chain has notches that differ since before."""
    notch = replace(preset("du2018").joint.notch, depth_mm=tuple(np.linspace(2.7, 2.85, 14)))
    rig, program = with_notch(preset("du2018"), notch), triangle(1.0, step_mm=0.1)
    planar = solve_chain(rig, program)
    space = solve_spatial(of_rig_in_space(rig_in_space(rig)), np.outer(program.drive_mm, [1.0, -1.0]))
    np.testing.assert_allclose(space.bending_deg[:, 0], planar.record.angle_deg, atol=1e-6)
    np.testing.assert_allclose(space.notches_deg[:, :, 2], planar.record.notches_deg, atol=1e-6)


def test_a_load_of_the_planar_rig_acts_in_its_plane():
    rig = rig_in_space(replace(preset("du2018"), tip_load=TipLoad(1.0, 90.0)))
    np.testing.assert_allclose(of_rig_in_space(rig).loads.tip_N, [0.0, 1.0, 0.0], atol=1e-15)


@pytest.mark.parametrize("name", PRESETS_IN_SPACE)
def test_every_number_of_a_preset_in_space_has_a_source(name):
    known = PRESETS_IN_SPACE[name]
    own = {"notch.turn_deg", "tendons.angles_deg", "tendons.wheels"}
    assert set(known.sources) == set(numeric_fields(known.rig)) | own
    assert {source.kind for source in known.sources.values()} >= {"stated", "assumed"}
    assert tuple(PRESETS_IN_SPACE) == NAMES_IN_SPACE
    assert any_preset(name, preload_N=3.0).preload_N == 3.0
    assert "24 notches, 4 tendons on 2 wheels" in repr(known.rig)
