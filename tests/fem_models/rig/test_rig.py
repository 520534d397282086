"""Rigs: impossible values are refused with one line that names field, value and expectation."""

from dataclasses import fields, replace

import numpy as np
import pytest

from fem_models.load import LoadProgram, triangle
from fem_models.rig import RigError, preset
from fem_models.rig.joints import MeasuredJoint, Notch, Tube
from fem_models.rig.presets import PRESETS
from fem_models.rig.rig import Friction, Material, Tendon, numeric_fields, with_notch, with_number
from fem_models.rig.rig_file import rig_of_tables


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
def test_impossible_values_are_refused(make, message):
    with pytest.raises(RigError) as caught:
        make()
    assert message in str(caught.value)
    assert "\n" not in str(caught.value)


def test_every_default_has_a_source():
    for name, known in PRESETS.items():
        assert set(known.sources) == set(numeric_fields(known.rig)), name


def test_dotted_numbers_are_those_of_a_rig_file():
    rig = preset("du2018")
    tables = rig.to_dict()
    assert [key for key in tables if key in ("friction", "tube", "notch")] == ["friction", "tube", "notch"]
    assert "joint" not in tables
    for name, value in numeric_fields(rig).items():
        part, _, key = name.rpartition(".")
        assert (tables[part][key] if part else tables[name]) == value
    assert "joint" in {f.name for f in fields(rig)}


def test_a_rig_comes_back_from_its_tables():
    measured = replace(preset("du2018"), joint=MeasuredJoint(14, 2.6, 520.0, rigid_gap_mm=0.1))
    assert measured.to_dict()["bench"]["rigid_gap_mm"] == 0.1
    single = replace(preset("notched-wrist-90"), name="wrist")
    for rig in (preset("du2018"), measured, single):
        assert rig_of_tables(rig.to_dict(), "rig.toml") == rig


@pytest.mark.parametrize(
    ("name", "read"),
    [
        ("preload_N", lambda rig: rig.preload_N),
        ("tube.inner_diameter_mm", lambda rig: rig.joint.tube.inner_diameter_mm),
        ("notch.depth_mm", lambda rig: rig.joint.notch.depth_mm),
        ("tendon_b.EA_N", lambda rig: rig.tendon_b.EA_N),
    ],
)
def test_one_number_of_a_rig_is_changed_by_its_dotted_name(name, read):
    rig = preset("du2018")
    other = with_number(rig, name, 1.01 * read(rig))
    assert read(other) == 1.01 * read(rig)
    assert with_number(other, name, read(rig)) == rig
    with pytest.raises(RigError, match=r"bench.pitch_mm = 2: expected a number of rig du2018"):
        with_number(rig, "bench.pitch_mm", 2)
    measured = replace(rig, joint=MeasuredJoint(14, 2.6, 520.0))
    assert with_number(measured, "bench.pitch_mm", 2.5).joint == MeasuredJoint(14, 2.5, 520.0)
