"""Rigs and load programs: what cannot exist is refused with one line that names field, value and expectation."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from fem_models.load import LoadProgram, sine, triangle
from fem_models.rig import RigError, preset, read_rig
from fem_models.rig.joints import Notch, Tube
from fem_models.rig.of_record import rig_of
from fem_models.rig.presets import PRESETS, sidecar_table
from fem_models.rig.rig import Friction, Material, Tendon, Wheel, numeric_fields, with_notch
from hysteresis.record import Record


@pytest.mark.parametrize(
    ("make", "message"),
    [
        (lambda: Tube(6.0, 6.5), "tube.inner_diameter_mm = 6.5: expected below tube.outer_diameter_mm = 6.0"),
        (lambda: Tube(6.0, float("nan")), "tube.inner_diameter_mm = nan: expected a finite number"),
        (lambda: Notch("u_pair", 3, 1, 1, 1), "notch.shape = u_pair: expected one of v_pair"),
        (lambda: Notch("v_pair", 3, 1, 1, 1), "notch.root_width_mm = None: expected a number"),
        (lambda: Notch("rectangular", 0, 1, 1, 1), "notch.count = 0: expected a whole number"),
        (lambda: Notch("rectangular", 3, -1, 1, 1), "notch.depth_mm = -1: expected above 0"),
        (lambda: Material(-60, 0.3), "material.youngs_modulus_GPa = -60: expected above 0"),
        (lambda: Tendon("stiff", 2.6, 100), "tendon.EA_N = 'stiff': expected a number"),  # type: ignore[arg-type]
        (lambda: Friction(guide_N=-0.1), "friction.guide_N = -0.1: expected at least 0"),
        (lambda: preset("du2018", preload_N=-1.0), "preload_N = -1.0: expected above 0"),
        (lambda: preset("du2019"), "preset = du2019: expected one of du2018"),
        (
            lambda: with_notch(preset("du2018"), Notch("v_pair", 14, 3.2, 1.4, 1.2, 0.8)),
            "notch.depth_mm = 3.2: expected below 3.1 mm, the outer radius",
        ),
        (lambda: triangle(-2.2), "amplitude_mm = -2.2: expected above 0"),
        (lambda: LoadProgram(np.array([0.0])), "expected a row of at least 2 values"),
        (lambda: LoadProgram(np.array([0.0, np.nan])), "expected finite numbers"),
        (lambda: LoadProgram(np.zeros(2), time_s=np.zeros(2)), "expected strictly increasing times"),
    ],
)
def test_what_cannot_exist_is_refused(make, message):
    with pytest.raises(RigError) as caught:
        make()
    assert message in str(caught.value)
    assert "\n" not in str(caught.value)


def test_every_default_has_a_source():
    for name, known in PRESETS.items():
        assert set(known.sources) == set(numeric_fields(known.rig)), name


def test_paper_program_has_the_stated_samples():
    # section 4.2: -2.2..2.2 mm and back in steps of 0.1 mm, 88 steps a cycle, entered from zero drive
    program = triangle(2.2, step_mm=0.1, cycles=10)
    assert program.drive_mm.size == 22 + 10 * 88 + 1
    assert program.drive_mm[[0, 22, 66, 110]] == pytest.approx([0, 2.2, -2.2, 2.2])
    np.testing.assert_allclose(np.abs(np.diff(program.drive_mm)), 0.1)
    assert np.bincount(program.cycle).tolist() == [23] + [88] * 10


@given(amplitude=st.floats(0.1, 10), step=st.floats(0.01, 1.0), cycles=st.integers(1, 3), rate=st.floats(0.01, 10))
def test_programs_reach_their_amplitude(amplitude, step, cycles, rate):
    for program in (
        triangle(amplitude, step_mm=min(step, amplitude), cycles=cycles),
        sine(amplitude, rate, cycles=cycles),
    ):
        assert program.drive_mm.max() == pytest.approx(amplitude)
        assert program.drive_mm.min() == pytest.approx(-amplitude)
        assert program.cycle.max() == cycles
    assert np.abs(np.diff(triangle(amplitude, step_mm=min(step, amplitude)).drive_mm)).max() <= step * (1 + 1e-9)


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


def record(**known) -> Record:
    return Record(drive=np.array([0.0, 1, 0, 1]), angle_deg=np.array([0.0, 2, 0, 2]), source="bench.csv", **known)


MEASURED = {
    "joints": 14,
    "moment_arm_mm": 2.62,
    "flexure_stiffness_Nmm_per_rad": 520.0,
    "tendon_EA_N": 9000.0,
    "tendon_free_length_mm": 150.0,
    "pitch_mm": 2.6,
    "preload_N": 20.0,
}


def test_rig_of_a_record():
    assert rig_of(record()) is None
    assert rig_of(record(rig={"preload_N": 20.0})) is None
    assert rig_of(record(rig={"preset": "du2018", "preload_N": 12.0})) == preset("du2018", preload_N=12.0)
    assert rig_of(record(rig={"preset": "du2018"}, drive_unit="step")) == preset("du2018")
    assert rig_of(record(rig={"preset": "du2018"}, drive_unit="N")) is None
    bench = rig_of(record(rig=MEASURED))
    assert bench is not None
    assert (bench.joints, bench.pitch_mm, bench.tendon_a.EA_N) == (14, 2.6, 9000.0)


@pytest.mark.parametrize(
    ("known", "message"),
    [
        ({"rig": {**MEASURED, "flexure_stiffness_Nmm_per_rad": -5.0}}, "flexure_stiffness_Nmm_per_rad = -5.0"),
        ({"rig": {k: v for k, v in MEASURED.items() if k != "pitch_mm"}}, "rig.pitch_mm: missing"),
        ({"rig": {"preset": "du2018", "joints": 14}}, "preset and measured quantities: expected one of them"),
        ({"rig": {"preset": "nobody"}}, "preset = nobody"),
        ({"tube": {"outer_diameter_mm": 1.4, "inner_diameter_mm": 1.6}}, "tube.inner_diameter_mm = 1.6"),
        ({"tube": {"outer_diameter_mm": 1.6, "inner_diameter_mm": 1.4}}, "[tube] alone"),
        (
            {
                "tube": {"outer_diameter_mm": 1.62, "inner_diameter_mm": 1.4},
                "notch": {"shape": "rectangular", "count": 5, "depth_mm": 1.7, "width_mm": 0.8, "spacing_mm": 1.2},
            },
            "notch.depth_mm = 1.7: expected below 1.62 mm, the outer diameter",
        ),
    ],
)
def test_a_rig_that_cannot_be_is_named_with_the_record(known, message):
    with pytest.raises(RigError) as caught:
        rig_of(record(**known))
    assert str(caught.value).startswith("bench.csv: ")
    assert message in str(caught.value)


def test_sidecar_table_names_the_preset_only_where_it_is_the_preset():
    assert sidecar_table(preset("du2018", preload_N=10.0)) == {"preset": "du2018", "preload_N": 10.0}
    other = replace(preset("du2018"), wheel=Wheel(12.0))
    assert sidecar_table(other) == {"preload_N": 20.0}
