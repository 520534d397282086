"""Sensors that spoil a record: how each is drawn, and how it reads a record that is exact.

Sizes count in the standard deviation of the practice noise, which a good sensor has, so that they are seen beside it.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace

import numpy as np

from hysteresis.arrays import Floats, Mask
from hysteresis.records.record import Record
from validation.practice.spoiled.disturbances import (
    Rng,
    correlated_noise,
    held,
    kept_samples,
    outliers,
    read_at,
    ripple,
    rounded,
    slow_wander,
)

CORRELATIONS = (0.5, 0.98)
"""Of neighbouring samples of AR(1) noise: from a filter of two samples to one of fifty."""
OUTLIER_SHARE, LEAST_OUTLIER = 0.01, 10.0
"""Part of the samples, and least size over the noise: lost marks of a camera."""
QUANTA = (2.0, 6.0)
"""Step of a coarse sensor over the noise."""
HELD_SAMPLES = (3, 9)
"""Samples for which a slow sensor repeats a value, from and below: loggers of the measured records are 4 to 6 times
faster than their sensors."""
JITTER = 0.2
"""Standard deviation of the instants, over the interval of the samples."""
MISSING = 0.15
"""Part of the samples that are missing."""
WANDER = (1.0, 3.0)
"""Standard deviation of a slow wander over the noise."""
RIPPLE = (1.0, 3.0)
"""Amplitude of a ripple over the noise."""
RIPPLE_SAMPLES = (5.0, 20.0)
"""Period of a ripple in samples."""
ENCODER_STEP_MM = 0.02
"""Step of the drive's encoder."""
DRIVE_GAIN = 0.05
"""Relative error of the drive's gain, of either sign: a pulley radius or a spindle pitch that is taken from a sheet."""

Read = Callable[[Record, float, Rng], Record]
"""From an exact record, with the standard deviation of the practice noise, to what is logged."""


@dataclass(frozen=True)
class Sensor:
    """A sensor of a drawn character.

    Parameters
    ----------
    numbers
        What was drawn, units in the names.
    read
        What is logged of an exact record.
    describes
        Effects that a catalogue may have for this very sensor: naming one of them counts neither for nor against.
    """

    numbers: Mapping[str, float]
    read: Read
    describes: tuple[str, ...] = ()


def with_angle(record: Record, angle_deg: Floats) -> Record:
    """Record with another angle."""
    return replace(record, angle_deg=angle_deg)


def white(record: Record, noise_deg: float, rng: Rng) -> Record:
    """Record with white noise of the angle, as a good sensor reads it."""
    return with_angle(record, record.angle_deg + rng.normal(0.0, noise_deg, record.angle_deg.size))


def times(record: Record) -> Floats:
    """Give the times of a practice record, which all have them."""
    assert record.time_s is not None
    return record.time_s


def samples(record: Record, kept: Mask) -> Record:
    """Record with some of its samples."""
    columns = ("drive", "angle_deg", "time_s", "cycle", "tension_a_N", "tension_b_N", "notches_deg", "tip_mm")
    chosen = {name: getattr(record, name)[kept] for name in columns if getattr(record, name) is not None}
    return replace(record, **chosen)


def _correlated(rng: Rng) -> Sensor:
    correlation = float(rng.uniform(*CORRELATIONS))

    def read(record: Record, noise_deg: float, rng: Rng) -> Record:
        noise = correlated_noise(record.angle_deg.size, correlation, noise_deg, rng)
        return with_angle(record, record.angle_deg + noise)

    return Sensor({"correlation": correlation}, read)


def _outliers(rng: Rng) -> Sensor:
    def read(record: Record, noise_deg: float, rng: Rng) -> Record:
        noisy = white(record, noise_deg, rng)
        errors = outliers(noisy.angle_deg.size, OUTLIER_SHARE, LEAST_OUTLIER * noise_deg, rng)
        return with_angle(noisy, noisy.angle_deg + errors)

    return Sensor({"share": OUTLIER_SHARE, "least_over_noise": LEAST_OUTLIER}, read)


def _quantised(rng: Rng) -> Sensor:
    quantum = float(rng.uniform(*QUANTA))

    def read(record: Record, noise_deg: float, rng: Rng) -> Record:
        noisy = white(record, noise_deg, rng)
        return with_angle(noisy, rounded(noisy.angle_deg, quantum * noise_deg))

    return Sensor({"step_over_noise": quantum}, read)


def _held(rng: Rng) -> Sensor:
    every = int(rng.integers(*HELD_SAMPLES))

    def read(record: Record, noise_deg: float, rng: Rng) -> Record:
        noisy = white(record, noise_deg, rng)
        return with_angle(noisy, held(noisy.angle_deg, every, int(rng.integers(every))))

    # a value is on average (every - 1) / 2 samples old, which is a delay indeed
    return Sensor({"samples": float(every)}, read, describes=("sensor_hold", "time_delay"))


def _jitter(rng: Rng) -> Sensor:
    def read(record: Record, noise_deg: float, rng: Rng) -> Record:
        time = times(record)
        late = rng.normal(0.0, JITTER * float(np.median(np.diff(time))), time.size)
        return white(with_angle(record, read_at(time, record.angle_deg, late)), noise_deg, rng)

    return Sensor({"deviation_over_interval": JITTER}, read)


def _missing(rng: Rng) -> Sensor:
    def read(record: Record, noise_deg: float, rng: Rng) -> Record:
        noisy = white(record, noise_deg, rng)
        return samples(noisy, kept_samples(noisy.angle_deg.size, MISSING, rng))

    return Sensor({"share": MISSING}, read)


def _wander(rng: Rng) -> Sensor:
    over_noise = float(rng.uniform(*WANDER))

    def read(record: Record, noise_deg: float, rng: Rng) -> Record:
        noisy = white(record, noise_deg, rng)
        return with_angle(noisy, noisy.angle_deg + slow_wander(times(record), over_noise * noise_deg, rng))

    return Sensor({"deviation_over_noise": over_noise}, read)


def _ripple(rng: Rng) -> Sensor:
    over_noise, period = float(rng.uniform(*RIPPLE)), float(rng.uniform(*RIPPLE_SAMPLES))

    def read(record: Record, noise_deg: float, rng: Rng) -> Record:
        noisy, time = white(record, noise_deg, rng), times(record)
        period_s = period * float(np.median(np.diff(time)))
        wave = ripple(time, over_noise * noise_deg, period_s, float(rng.uniform(0.0, 2 * np.pi)))
        return with_angle(noisy, noisy.angle_deg + wave)

    return Sensor({"amplitude_over_noise": over_noise, "period_samples": period}, read)


def _encoder(rng: Rng) -> Sensor:
    def read(record: Record, noise_deg: float, rng: Rng) -> Record:
        return replace(white(record, noise_deg, rng), drive=rounded(record.drive, ENCODER_STEP_MM))

    return Sensor({"step_mm": ENCODER_STEP_MM}, read, describes=("encoder_step",))


def _gain(rng: Rng) -> Sensor:
    gain = DRIVE_GAIN * float(rng.choice([-1.0, 1.0]))

    def read(record: Record, noise_deg: float, rng: Rng) -> Record:
        return replace(white(record, noise_deg, rng), drive=record.drive * (1.0 + gain))

    return Sensor({"gain": gain}, read, describes=("drive_gain",))


SENSORS: dict[str, Callable[[Rng], Sensor]] = {
    "correlated_noise": _correlated,
    "outliers": _outliers,
    "quantised": _quantised,
    "held": _held,
    "jitter": _jitter,
    "missing": _missing,
    "wander": _wander,
    "ripple": _ripple,
    "drive_encoder": _encoder,
    "drive_gain": _gain,
}
"""By name."""
