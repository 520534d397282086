"""Spoiled sensors and protocols: each meets a closed form, and cases are repeatable."""

from dataclasses import replace

import numpy as np
import pytest

from hysteresis import Record
from validation.practice.planned import CHIRP_FACTOR, LEAST_ENVELOPE, Planned, program_of
from validation.practice.spoiled import PLANS, SENSORS, draw_spoiled_protocol, draw_spoiled_sensor
from validation.practice.spoiled.disturbances import (
    correlated_noise,
    held,
    kept_samples,
    outliers,
    read_at,
    ripple,
    rounded,
    slow_wander,
)
from validation.practice.spoiled.draw import Asked

MANY = 200_000
CLEAN = Asked(7, "unknown", 1)


@pytest.fixture
def rng():
    return np.random.default_rng(5)


@pytest.mark.parametrize("correlation", [0.5, 0.9, 0.98])
def test_correlated_noise_has_the_correlations_of_ar1(rng, correlation):
    noise = correlated_noise(MANY, correlation, 0.04, rng)
    # samples worth: n (1 - c^2) / (1 + c^2) or fewer
    assert noise.std() == pytest.approx(0.04, rel=0.05)
    for lag in (1, 2, 5):
        assert np.mean(noise[lag:] * noise[:-lag]) / noise.var() == pytest.approx(correlation**lag, abs=0.03)
    starts = [correlated_noise(2, correlation, 1.0, rng)[0] for _ in range(4000)]
    assert np.std(starts) == pytest.approx(1.0, rel=0.05)  # stationary from the first sample


def test_outliers_are_as_many_and_as_large_as_asked(rng):
    errors = outliers(5000, 0.01, 2.0, rng)
    hit = np.abs(errors[errors != 0])
    assert hit.size == 50
    assert 2.0 <= hit.min() < hit.max() <= 6.0
    assert np.mean(hit) == pytest.approx(4.0, rel=0.15)  # of a uniform size from 2 to 6


def test_held_samples_repeat_the_last_one_that_was_read():
    values = np.arange(10.0)
    assert held(values, 4, 1).tolist() == [0, 1, 1, 1, 1, 5, 5, 5, 5, 9]
    ramp = np.arange(4000.0)
    assert np.mean(ramp - held(ramp, 4)) == 1.5  # (every - 1) / 2 samples late


def test_rounding_error_is_uniform(rng):
    values = rng.normal(0.0, 10.0, MANY)
    error = rounded(values, 0.5) - values
    assert np.abs(error).max() <= 0.25
    assert error.std() == pytest.approx(0.5 / np.sqrt(12), rel=0.01)


def test_jitter_of_a_ramp_is_its_slope_times_the_time(rng):
    time = np.linspace(0.0, 100.0, 5001)
    late = rng.normal(0.0, 0.004, time.size)
    error = (read_at(time, 3.0 * time, late) - 3.0 * time)[1:-1]
    np.testing.assert_allclose(error, 3.0 * late[1:-1], atol=1e-9)


def test_missing_samples_are_as_many_as_asked(rng):
    kept = kept_samples(400, 0.15, rng)
    assert kept.sum() == 340
    assert kept[0]
    assert kept[-1]


def test_wander_and_ripple_have_their_rms(rng):
    time = np.linspace(0.0, 40.0, 2000)
    squares = [np.mean(slow_wander(time, 0.3, rng) ** 2) for _ in range(500)]
    assert np.sqrt(np.mean(squares)) == pytest.approx(0.3, rel=0.05)
    assert np.sqrt(np.mean(ripple(time, 0.2, 0.5, 1.0) ** 2)) == pytest.approx(0.2 / np.sqrt(2), rel=0.01)


def test_shapes_of_a_program():
    plan = Planned(20.0, 2.0, 0.1, 4, 200)
    drives = {shape: program_of(replace(plan, shape=shape)) for shape in ("sine", "triangle", "chirp", "growing")}
    for program in drives.values():
        assert program.drive_mm[0] == 0.0
        assert program.cycle.max() == 4
    slopes = np.abs(np.diff(drives["triangle"].drive_mm))
    assert np.median(slopes) == pytest.approx(4 * 2.0 / 200, abs=1e-4)  # 4 A in a cycle, straight
    assert np.ptp(np.diff(np.flatnonzero(np.diff(np.sign(np.diff(drives["sine"].drive_mm)))))) == 0
    # zeros of the chirp: the last half turn is as much shorter than the first as the rate is higher
    chirp = drives["chirp"]
    crossings = chirp.time_s[1:-1][np.diff(np.sign(chirp.drive_mm[1:])) != 0]
    rate = 1 / (2 * np.diff(crossings))
    middle = 0.5 * (crossings[1:] + crossings[:-1]) / chirp.time_s[-1]
    assert rate == pytest.approx(0.1 * (1 + (CHIRP_FACTOR - 1) * middle), rel=0.05)
    first, last = (np.abs(drives["growing"].drive_mm[drives["growing"].cycle == cycle]).max() for cycle in (1, 4))
    assert first < last == pytest.approx(2.0, rel=0.06)
    assert first > 2.0 * LEAST_ENVELOPE


@pytest.mark.parametrize("name", SENSORS)
def test_sensor_is_drawn_again_alike_and_leaves_the_truth(name):
    case, sensor = draw_spoiled_sensor(CLEAN, name)
    again, _ = draw_spoiled_sensor(CLEAN, name)
    assert case.records == again.records
    assert case.truth.effects == ()
    assert all(np.isfinite(value) for value in sensor.numbers.values())


def test_only_the_gain_and_the_encoder_touch_the_drive():
    plain, _ = draw_spoiled_sensor(CLEAN, "outliers")
    drive = plain.records[0].drive
    gain, sensor = draw_spoiled_sensor(CLEAN, "drive_gain")
    np.testing.assert_allclose(gain.records[0].drive, drive * (1 + sensor.numbers["gain"]), atol=1e-4)
    step, _ = draw_spoiled_sensor(CLEAN, "drive_encoder")
    assert np.abs(step.records[0].drive - drive).max() <= 0.01 + 1e-9
    assert np.unique(np.round(step.records[0].drive / 0.02 % 1, 6) % 1).tolist() == [0.0]


@pytest.mark.parametrize("generator", ["own", "lumped"])
def test_protocols_change_only_what_they_say(generator):
    usual = draw_spoiled_sensor(replace(CLEAN, generator=generator), "outliers")[0].records
    cases = {name: draw_spoiled_protocol(replace(CLEAN, generator=generator), name).records for name in PLANS}
    assert len(cases["one_record"]) == 1
    assert len(cases["two_rates"]) == 2
    assert len({r.rig["preload_N"] for r in usual}) == 2
    assert len({r.rig["preload_N"] for r in cases["one_preload"]}) == 1
    assert all(r.cycle is None or r.cycle.max() == 1 for r in cases["one_cycle"])
    a, b = (r.time_s[-1] for r in cases["two_rates"])
    assert a > 3 * b
    assert len({r.drive.size for r in cases["sampling"]}) == len(cases["sampling"])
    assert all(isinstance(r, Record) and r.kind == "simulated" for records in cases.values() for r in records)


def test_effect_under_a_spoiled_protocol_has_a_moderate_size():
    case = draw_spoiled_protocol(replace(CLEAN, label="backlash", kind="known"), "two_rates")
    assert case.truth.effects == ("backlash",)
    assert 3.0 <= case.truth.ratios[0] <= 8.0
