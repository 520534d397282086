"""Control chart of one number over the records of a device: an exponentially weighted moving average.

E_i = lambda x_i + (1 - lambda) E_(i-1) (Roberts 1959, doi 10.1080/00401706.1959.10489860), started at the mean of the
reference records. Mean and standard deviation of a steady device are estimated from few records, which makes usual
limits raise false alarms far too often (Jones, Champ and Rigdon 2001, doi 10.1198/004017001750386279). With independent
normal numbers the statistic does not depend on the true mean and deviation, so its limit is found by simulation for
just that many reference records and records to come.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import lru_cache

import numpy as np

from hysteresis.arrays import Floats

WEIGHT = 0.3
"""lambda: the last three or four records count."""
DRAWS = 40_000
LONGEST = 4_000
"""Records after which the run length of a simulated device is cut off."""
_RUNS = 1_000


@dataclass(frozen=True, eq=False)
class Chart:
    """A chart over n records.

    ``average``, shape (n,), is NaN in the reference, and ``low`` and ``high`` are its limits. ``alarm`` is the first
    record outside, counted from 0, None without one.
    """

    mean: float
    deviation: float
    average: Floats
    low: float
    high: float
    alarm: int | None


def control_chart(values: Floats, reference: int, false_alarm: float) -> Chart:
    """Chart numbers, shape (n,).

    Parameters
    ----------
    reference
        How many of the first are a steady device, at least 3, fewer than n.
    false_alarm
        Probability that a steady device is outside in any of its n records.

    Raises
    ------
    ValueError
        A reference that is too short or too long.
    """
    if not 3 <= reference < values.size:
        raise ValueError(f"reference = {reference}: expected 3 to {values.size - 1}, fewer than the records")
    mean, deviation = float(values[:reference].mean()), float(values[:reference].std(ddof=1))
    average = np.full(values.size, np.nan)
    last = mean
    for i in range(reference, values.size):
        last = WEIGHT * float(values[i]) + (1.0 - WEIGHT) * last
        average[i] = last
    half = limit(reference, values.size, false_alarm) * max(deviation, 1e-12 * max(1.0, abs(mean)))
    outside = np.flatnonzero(np.abs(average - mean) > half)
    return Chart(mean, deviation, average, mean - half, mean + half, int(outside[0]) if outside.size else None)


@lru_cache(maxsize=64)
def limit(reference: int, count: int, false_alarm: float) -> float:
    """Distance of the limits from the mean, in standard deviations of the reference."""
    return float(np.quantile(_largest(reference, count, DRAWS), 1.0 - false_alarm))


@lru_cache(maxsize=64)
def run_length(reference: int, count: int, false_alarm: float) -> float:
    """Median number of records of a steady device to the first alarm; infinite beyond :data:`LONGEST`."""
    half, rng = limit(reference, count, false_alarm), np.random.default_rng(2)
    mean, deviation = _of_reference(reference, _RUNS, rng)
    last, alive = mean.copy(), np.ones(_RUNS, dtype=bool)
    for length in range(1, LONGEST + 1):
        last = WEIGHT * rng.standard_normal(_RUNS) + (1.0 - WEIGHT) * last
        alive &= np.abs(last - mean) <= half * deviation
        if alive.sum() <= _RUNS // 2:
            return float(length)
    return math.inf


def _of_reference(reference: int, draws: int, rng: np.random.Generator) -> tuple[Floats, Floats]:
    drawn = rng.standard_normal((draws, reference))
    return drawn.mean(axis=1), drawn.std(axis=1, ddof=1)


def _largest(reference: int, count: int, draws: int) -> Floats:
    """Largest distance from the mean over its deviation, of steady devices, shape (draws,)."""
    rng = np.random.default_rng(1)
    mean, deviation = _of_reference(reference, draws, rng)
    last, most = mean.copy(), np.zeros(draws)
    for _ in range(count - reference):
        last = WEIGHT * rng.standard_normal(draws) + (1.0 - WEIGHT) * last
        most = np.maximum(most, np.abs(last - mean))
    return most / deviation
