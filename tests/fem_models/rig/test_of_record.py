"""The rig of a record, as its sidecar describes it."""

from dataclasses import replace

import numpy as np
import pytest

from fem_models.rig import RigError, preset
from fem_models.rig.of_record import require_the_rigs_sense, rig_of
from fem_models.rig.presets import sidecar_table
from fem_models.rig.rig import Wheel
from hysteresis.records.record import Record, RecordError


def record(**known) -> Record:
    return Record(drive=np.array([0.0, 1, 0, 1]), angle_deg=np.array([0.0, 2, 0, 2]), source="loop.csv", **known)


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
    measured = rig_of(record(rig=MEASURED))
    assert measured is not None
    assert (measured.joints, measured.pitch_mm, measured.tendon_a.EA_N) == (14, 2.6, 9000.0)


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
def test_an_impossible_rig_is_named_with_the_record(known, message):
    with pytest.raises(RigError) as caught:
        rig_of(record(**known))
    assert str(caught.value).startswith("loop.csv: ")
    assert message in str(caught.value)


def test_sidecar_table_names_the_preset_only_where_it_is_the_preset():
    assert sidecar_table(preset("du2018", preload_N=10.0)) == {"preset": "du2018", "preload_N": 10.0}
    other = replace(preset("du2018"), wheel=Wheel(12.0))
    assert sidecar_table(other) == {"preload_N": 20.0}


@pytest.mark.parametrize("sense", [1, -1])
@pytest.mark.parametrize("spike", [0.0, 999.0])
def test_the_sense_of_a_rig_that_bends_is_read_from_its_line(sense, spike):
    drive = np.tile([0, 0.5, 1, 0.5, 0, -0.5, -1, -0.5], 20)
    angle = 3.0 * sense * drive + np.random.default_rng(1).normal(0, 0.5, drive.size)
    angle[7] += spike
    if sense > 0:
        require_the_rigs_sense(Record(drive, angle))
    else:
        with pytest.raises(RecordError, match="falls as drive_mm rises"):
            require_the_rigs_sense(Record(drive, angle))


def test_noise_of_a_stuck_rig_says_nothing_of_its_sense():
    drive = np.tile([0, 0.5, 1, 0.5, 0, -0.5, -1, -0.5], 20)
    angles = [np.random.default_rng(seed).normal(0, 0.5, drive.size) for seed in range(20)]
    assert 5 < sum(drive @ angle < 0 for angle in angles) < 15  # the line falls in about a half of them
    for angle in angles:
        require_the_rigs_sense(Record(drive, angle))
