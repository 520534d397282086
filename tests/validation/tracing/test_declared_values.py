"""What the file of a rig states beside what the records say."""

from dataclasses import replace

import numpy as np
import pytest

from fem_models.chain import simulate_chain
from fem_models.load import triangle
from fem_models.rig import preset
from fem_models.rig.effects import Backlash
from hysteresis.fitting.uncertainty import Parameter
from hysteresis.records.record import Record
from validation.tracing import catalogue, trace_records
from validation.tracing.declared import differing_words, stated_values
from validation.tracing.result import in_words, trace_report
from validation.tracing.search.detection import absorbed_effects, detection_limits

FITTED = {"sheath_N": Parameter(2.0, 1.8, 2.2, "N"), "EA_N": Parameter(9000.0, 8000.0, 10_000.0, "N")}
LOOP = np.array([0.0, 1.0, -1.0, 0.0])


@pytest.mark.parametrize(
    ("sheath_N", "told"), [(2.1, False), (2.39, False), (2.41, True), (1.61, False), (1.59, True), (0.5, True)]
)
def test_a_value_is_told_beyond_twice_the_interval(sheath_N, told):
    words = differing_words(FITTED, {"sheath_N": Parameter(sheath_N, None, None, "N")})
    assert bool(words) is told
    if told:
        assert words[0].startswith(f"sheath_N is 2 (1.8 to 2.2) N in these records, {sheath_N:g} N in the file of the")
        assert "backlash" in words[0]


def test_a_value_at_the_bound_of_the_fit_is_told_outside_its_interval():
    fitted = {"sheath_N": Parameter(4.4999995, 1.66, 4.5, "N"), "capstan_coefficient": Parameter(0.0, 0.0, 0.01, "-")}
    words = differing_words(fitted, {"sheath_N": Parameter(0.5, None, None, "N")})
    assert words[0].startswith("sheath_N is 4.5 (1.66 to 4.5) N at the bound of the fit in these records, 0.5 N in the")
    assert differing_words(fitted, {"sheath_N": Parameter(1.7, None, None, "N")}) == ()
    assert differing_words(fitted, {"capstan_coefficient": Parameter(0.012, None, None, "-")}) == ()  # 0 is an end


def test_only_what_a_file_states_is_compared(tmp_path):
    rig = tmp_path / "rig.toml"
    rig.write_text(
        "preload_N = 10.0\n"
        "[tube]\nouter_diameter_mm = 5.0\ninner_diameter_mm = 4.4\n[notch]\nshape = 'v_pair'\ncount = 12\n"
        "depth_mm = 2.0\nwidth_mm = 1.0\nroot_width_mm = 0.4\nspacing_mm = 1.5\n[material]\nyoungs_modulus_GPa = 50.0\n"
        "[friction]\nsheath_N = 0.5\n[tendon]\nEA_N = 9000.0\nmoment_arm_mm = 2.2\nfree_length_mm = 200.0\n"
        "[wheel]\nradius_mm = 10.0\n"
    )
    record = Record(LOOP, LOOP, rig={"file": "rig.toml", "preload_N": 10.0}, source=str(tmp_path / "a.csv"))
    fitted = {**FITTED, "capstan_coefficient": Parameter(0.1, 0.0, 0.2, "-")}
    assert {name: one.value for name, one in stated_values(record, fitted).items()} == {"sheath_N": 0.5, "EA_N": 9000}
    of_preset = Record(LOOP, LOOP, rig={"preset": "du2018", "preload_N": 10.0})
    assert set(stated_values(of_preset, fitted)) == set(fitted)
    assert stated_values(Record(LOOP, LOOP), fitted) == {}


def test_a_play_that_friction_takes_is_told_by_the_file():
    """One record does not tell a play from friction at the base; the file does."""
    rig = replace(preset("du2018"), preload_N=20.0, backlash=Backlash(0.08))
    loop = simulate_chain(rig, triangle(1.5, step_mm=0.05, cycles=2))
    angle = loop.angle_deg + np.random.default_rng(1).normal(0, 0.05, loop.drive.size)
    trace = trace_records([Record(loop.drive, angle, rig={"preset": "du2018", "preload_N": 20.0})])
    effects = [effect for effect in catalogue() if effect.name in ("backlash", "unequal_tendons")]
    limits = detection_limits(trace.augmented, effects, trace.floor.deg)
    report = trace_report(trace, limits=limits, absorbed=absorbed_effects(trace.augmented, effects, limits))
    assert report.verdict == "none"
    assert [one.name for one in report.detection_limits] == ["unequal_tendons"]
    assert "The fit absorbs these at every size, so they may be there: backlash." in in_words(report)
    assert report.declared["sheath_N"].value == pytest.approx(3.49)
    assert report.baseline["sheath_N"].value > 4.6
    assert any("sheath_N is 4." in words and "3.49 N in the file" in words for words in in_words(report))
