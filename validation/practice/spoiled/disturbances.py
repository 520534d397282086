"""What spoils a signal, as free functions of arrays: each has a closed form that tests compare it with."""

from __future__ import annotations

import numpy as np
from scipy.interpolate import PchipInterpolator
from scipy.signal import lfilter

from hysteresis.arrays import Floats, Mask

Rng = np.random.Generator
WANDER_PERIODS = (0.5, 0.7, 1.1, 1.9)
"""Periods of a slow wander over the duration of the record: no multiples of each other, and none of a cycle."""


def correlated_noise(count: int, correlation: float, deviation: float, rng: Rng) -> Floats:
    """Stationary AR(1) noise e_k = c e_{k-1} + n_k, whose standard deviation is ``deviation``; shape (count,).

    The correlation of samples k apart is c^k (Box, Jenkins, Reinsel, Time Series Analysis, 2008, section 3.2.3).
    """
    shocks = rng.normal(0.0, deviation, count)
    shocks[1:] *= np.sqrt(1.0 - correlation**2)
    return np.asarray(lfilter([1.0], [1.0, -correlation], shocks))


def outliers(count: int, share: float, least: float, rng: Rng) -> Floats:
    """Errors of a few samples, 0 elsewhere: of either sign, from ``least`` to three times that; shape (count,)."""
    errors = np.zeros(count)
    hit = rng.permutation(count)[: max(1, round(share * count))]
    errors[hit] = rng.choice([-1.0, 1.0], hit.size) * least * rng.uniform(1.0, 3.0, hit.size)
    return errors


def held(values: Floats, every: int, first: int = 0) -> Floats:
    """Values of a sensor that reads one sample in ``every`` and repeats it; ``first`` is the first it reads."""
    k = np.arange(values.size)
    return values[np.maximum(k - (k - first) % every, 0)]


def rounded(values: Floats, step: float) -> Floats:
    """Nearest multiples of a step: the error is at most half of it, and about step/sqrt(12) rms."""
    return np.round(values / step) * step


def read_at(time_s: Floats, values: Floats, late_s: Floats) -> Floats:
    """Values at instants that are ``late_s`` after those in the log, by monotone cubics; all shapes (m,)."""
    return np.asarray(PchipInterpolator(time_s, values)(np.clip(time_s + late_s, time_s[0], time_s[-1])))


def kept_samples(count: int, missing: float, rng: Rng) -> Mask:
    """Mark the samples that are left where a share is missing at random, the ends among them; shape (count,)."""
    keep = np.ones(count, dtype=bool)
    keep[1 + rng.permutation(count - 2)[: round(missing * count)]] = False
    return keep


def slow_wander(time_s: Floats, deviation: float, rng: Rng) -> Floats:
    """Sum of four slow sines of equal amplitude and random phase; its rms over all phases is ``deviation``."""
    turns = (time_s - time_s[0])[:, None] / ((time_s[-1] - time_s[0]) * np.array(WANDER_PERIODS))
    phases = rng.uniform(0.0, 2 * np.pi, len(WANDER_PERIODS))
    return deviation * np.sqrt(2.0 / len(WANDER_PERIODS)) * np.sin(2 * np.pi * turns + phases).sum(axis=1)


def ripple(time_s: Floats, amplitude: float, period_s: float, phase_rad: float) -> Floats:
    """Sine of the time: hum of the supply, or a resonance of the stand."""
    return amplitude * np.sin(2 * np.pi * time_s / period_s + phase_rad)
