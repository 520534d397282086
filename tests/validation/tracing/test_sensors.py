"""Sensors that hold, lose or correlate their values: which samples are readings, and what counts as noise."""

from dataclasses import replace

import numpy as np
import pytest

from fem_models.chain.solve import simulate_chain
from fem_models.load import sine
from fem_models.rig import preset
from hysteresis.records.held import held_updates
from hysteresis.records.record import Record
from hysteresis.sensors.readings import isolated_spikes, readings_of
from validation.practice.spoiled.disturbances import correlated_noise, held, outliers, rounded, slow_wander
from validation.tracing.effect import catalogue
from validation.tracing.fitting.noise import correlated_noise_deg, sensor_noise_deg
from validation.tracing.prepared import prepared
from validation.tracing.sensors.drive_steps import drive_step_deg, sensor_words
from validation.tracing.trace import trace_records

NOISE_DEG = 0.05
SAMPLES = 500
PHASE = np.linspace(0, 6 * np.pi, SAMPLES)
DRIVE, TIME_S = 2.0 * np.sin(PHASE), np.linspace(0, 30, SAMPLES)


def noisy(seed=0):
    return 20.0 * DRIVE + np.random.default_rng(seed).normal(0, NOISE_DEG, SAMPLES)


def record(angle, **more):
    return Record(drive=DRIVE, angle_deg=angle, time_s=TIME_S, **more)


def test_spikes_are_found_and_noise_kinks_leaps_and_steps_of_the_sensor_are_none():
    clean = noisy()
    errors = outliers(SAMPLES, 0.01, 1.0, np.random.default_rng(4))
    found = isolated_spikes(clean + errors, TIME_S)
    assert np.array_equal(np.flatnonzero(found), np.flatnonzero(errors))
    kink = 20.0 * np.abs(np.linspace(-1, 1, SAMPLES))
    leap = np.where(np.arange(SAMPLES) < 250, 0.0, 5.0)
    for angle in (clean, clean + kink, clean + leap, rounded(clean, 0.3), kink, leap):
        assert not isolated_spikes(angle, TIME_S).any()


def test_spikes_do_not_move_the_errors_about_them():
    spoiled = noisy()
    spoiled[200] += 3.0
    one = prepared(record(spoiled), np.arange(SAMPLES))
    error = one.filled(spoiled - noisy())
    assert np.abs(error).max() < 1e-9
    assert abs(one.angle_deg[200] - noisy()[200]) < 4 * NOISE_DEG
    assert sensor_words([record(spoiled)], 1.0) == ("1 of 500 angles are isolated spikes, which are left out",)


def test_held_values_are_read_where_they_change_and_the_path_keeps_its_turning_points():
    spoiled = held(noisy(), 6, 2)
    updates = held_updates(DRIVE, spoiled)
    assert np.array_equal(np.flatnonzero(updates), np.arange(2, SAMPLES, 6))
    one = prepared(record(spoiled), np.arange(SAMPLES))
    assert one.drive.max() == DRIVE.max()
    assert one.drive.min() == DRIVE.min()
    read = one.readings.read[one.kept]
    assert np.array_equal(one.angle_deg[read], noisy()[one.kept][read])
    assert "6 samples" in sensor_words([record(spoiled)], 1.0)[0]
    assert held_updates(DRIVE, rounded(noisy(), 5.0)) is None  # a coarse sensor repeats values, too
    assert readings_of(record(noisy())).read.all()


def test_steps_of_the_drive_make_an_error_that_is_measured_and_commanded_steps_make_none():
    """Against the error itself: the drive rounded less the drive, times the slope."""
    coarse = record(20.0 * DRIVE)
    coarse = replace(coarse, drive=rounded(DRIVE, 0.02))
    assert drive_step_deg(coarse) == pytest.approx(20.0 * np.std(coarse.drive - DRIVE), rel=0.1)
    assert drive_step_deg(record(20.0 * DRIVE)) < 0.01
    few = 2.0 * np.sin(np.linspace(0, 4 * np.pi, 65))
    assert drive_step_deg(Record(drive=few, angle_deg=20.0 * few)) == 0.0
    ladder = np.tile(np.concatenate([np.arange(0, 2, 0.02), np.arange(2, 0, -0.02)]), 2)
    assert drive_step_deg(Record(drive=ladder, angle_deg=20.0 * ladder)) < 1e-9
    assert "0.12 deg" in sensor_words([coarse], 0.1)[0]
    fast = 2.0 * np.sin(np.linspace(0, 8 * np.pi, 361))  # several steps a sample: most of its values are never read
    skipped = Record(drive=rounded(fast, 0.02), angle_deg=20.0 * fast)
    assert drive_step_deg(skipped) == pytest.approx(20.0 * 0.02 / np.sqrt(12), rel=0.1)


@pytest.mark.parametrize("correlation", [0.6, 0.9])
def test_correlated_noise_is_measured_in_one_cycle(correlation):
    drive = np.sin(np.linspace(0, 2 * np.pi, 2000))
    rng = np.random.default_rng(1)
    one = prepared(Record(drive=drive, angle_deg=drive), np.arange(drive.size))
    noise = correlated_noise(drive.size, correlation, NOISE_DEG, rng)
    assert correlated_noise_deg([one], [noise]) == pytest.approx(NOISE_DEG, rel=0.3)
    assert correlated_noise_deg([one], [rng.normal(0, NOISE_DEG, drive.size)]) is None
    assert correlated_noise_deg([one], [drive]) is None


def test_a_wander_is_noise_and_a_rig_that_changes_is_none():
    one = prepared(record(noisy()), np.arange(SAMPLES))
    rng = np.random.default_rng(2)
    white = rng.normal(0, NOISE_DEG, SAMPLES)
    wander = white + slow_wander(TIME_S, 2 * NOISE_DEG, rng)
    assert NOISE_DEG < np.std(wander) < 1.15 * sensor_noise_deg([one], [wander]) < 2 * np.std(wander)
    changed = white + np.where(TIME_S < 14.0, 0.0, 0.6)
    assert sensor_noise_deg([one], [changed]) is None


@pytest.mark.parametrize("spoil", ["correlated", "held"])
def test_clean_records_of_spoiled_sensors_have_no_missing_effect(spoil):
    rng, records = np.random.default_rng(5), []
    for preload in (20.0, 10.0):
        rig = preset("du2018", preload_N=preload)
        run = simulate_chain(rig, sine(2.2, 0.1, cycles=2, samples_per_cycle=88))
        angle, size = run.angle_deg, run.angle_deg.size
        if spoil == "correlated":
            angle = angle + correlated_noise(size, 0.8, NOISE_DEG, rng)
        else:
            angle = held(angle + rng.normal(0, NOISE_DEG, size), 5, 1)
        known = {"preset": "du2018", "preload_N": preload}
        one = Record(drive=run.drive, angle_deg=angle, time_s=run.time_s, cycle=run.cycle, rig=known)
        records.append(replace(one, source=f"{preload:g}N.csv"))
    few = ("backlash", "thermal_drift", "time_delay", "viscous_drag")
    trace = trace_records(records, effects=[effect for effect in catalogue() if effect.name in few])
    assert trace.verdict == "none"
    assert bool(trace.words)
    assert trace.baseline.heldout_rmse_deg < 1.3 * NOISE_DEG
