"""Records of few samples a branch: noise that is told from drift, or not known; drives that are commanded in steps."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from hysteresis.arrays import Floats
from hysteresis.records.record import Record
from validation.tracing.effect import catalogue
from validation.tracing.fitting.noise import NOT_KNOWN, estimate_noise_floor, sensor_noise_deg
from validation.tracing.prepared import PreparedRecord, prepared
from validation.tracing.result import in_words, trace_report
from validation.tracing.sensors.drive_steps import drive_step_deg
from validation.tracing.trace import trace_records

NOISE_DEG = 0.05


def sine(per_cycle: int, cycles: int, decay: float = 0.0) -> Floats:
    phase = np.arange(per_cycle * cycles + 1) / per_cycle
    return 2.0 * np.exp(-decay * phase) * np.sin(2 * np.pi * phase)


def triangle(per_branch: int, cycles: int) -> Floats:
    """In steps of 1 mm, per_branch samples from one turn to the next."""
    up = np.arange(per_branch, dtype=float)
    return np.concatenate([np.tile(np.concatenate([up[:-1], up[:0:-1]]), cycles), [0.0]])


def few(drive: Floats, residual: Floats) -> PreparedRecord:
    one = Record(
        drive=drive, angle_deg=10.0 * drive + residual, drive_unit="mm", time_s=np.arange(drive.size, dtype=float)
    )
    return prepared(one, np.arange(drive.size))


@pytest.mark.parametrize("drive", [sine(12, 8), sine(10, 8, decay=0.15)], ids=["equal", "shrinking"])
@pytest.mark.parametrize("seed", [0, 1, 2])
def test_few_samples_a_branch_tell_noise_from_drift(drive: Floats, seed: int) -> None:
    residual = np.linspace(0, 3.0, drive.size) + np.random.default_rng(seed).normal(0, NOISE_DEG, drive.size)
    one = few(drive, residual)
    floor = estimate_noise_floor([one], [residual])
    assert floor.known
    assert floor.how == "neighbouring samples"
    assert floor.sensor_deg == pytest.approx(NOISE_DEG, rel=0.4)


@pytest.mark.parametrize("decay", [0.0, 0.15])
def test_noise_that_no_branch_tells_is_not_known(decay: float) -> None:
    drive = sine(4, 8, decay)
    drift = np.linspace(0, 1.5, drive.size)
    one = few(drive, drift)
    floor = estimate_noise_floor([one], [drift])
    assert not floor.known
    assert floor.sensor_deg is None
    assert sensor_noise_deg([one], [drift]) is None
    assert ("the noise is not known" in floor.how) or ("by noise or by a drift" in floor.how)


def drifting(drive: Floats, drift_deg: float) -> Record:
    noise = np.random.default_rng(1).normal(0, NOISE_DEG, drive.size)
    t = np.linspace(0, 50.0, drive.size)
    return Record(drive=drive, angle_deg=10.0 * drive + drift_deg * t / 50 + noise, drive_unit="mm", time_s=t)


@pytest.mark.slow
@pytest.mark.parametrize(("per_cycle", "cycles"), [(12, 5), (12, 8), (4, 10)])
def test_a_drift_in_few_samples_is_named(per_cycle: int, cycles: int) -> None:
    """Nor is it taken for a loop that has not closed yet."""
    effects = [effect for effect in catalogue() if effect.name == "thermal_drift"]
    trace = trace_records([drifting(sine(per_cycle, cycles), 1.5)], effects=effects)
    assert trace.verdict != "none"
    assert trace.names == ("thermal_drift",)


@pytest.mark.parametrize("drift_deg", [0.0, 0.3])
def test_where_few_samples_do_not_tell_the_noise_nothing_is_denied(drift_deg: float) -> None:
    effects = [effect for effect in catalogue() if effect.name == "thermal_drift"]
    trace = trace_records([drifting(sine(4, 10), drift_deg)], effects=effects)
    assert trace.verdict == "unexplained"
    assert trace.names == ()
    assert NOT_KNOWN in trace.words
    assert in_words(trace_report(trace))[0].startswith("Whether an effect is missing cannot be said")


def test_a_drive_in_whole_steps_is_exact_and_an_encoder_is_not() -> None:
    for drive in (triangle(4, 6), triangle(9, 6), sine(4, 8), sine(6, 8)):
        exact = Record(drive=drive, angle_deg=10.0 * drive)
        assert drive_step_deg(exact) == 0.0
        assert drive_step_deg(replace(exact, drive=drive + 3.0)) == 0.0
    fine = 2.0 * np.sin(np.linspace(0, 6 * np.pi, 500))
    coarse = 0.02 * np.round(fine / 0.02)
    measured = drive_step_deg(Record(drive=coarse, angle_deg=20.0 * fine))
    assert measured == pytest.approx(20.0 * np.std(coarse - fine), rel=0.1)
