"""Many devices: cost of a fit with intervals, and how often the intervals hold the truth.

``python -m benchmarks.many_devices [COUNT] [SEED]`` draws devices from a prior, simulates a record of each (3 cycles of
88 samples, noise of two makes) and fits every one by itself, as ``notchbend identify --each`` does. It prints processor
time a device, and for each parameter the share of devices whose 95 % interval holds the true value, among those whose
record fixes it. The first devices are also fitted with the genetic search, to compare residuals.
"""

from __future__ import annotations

import math
import resource
import sys
import time
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from hysteresis import Record
from hysteresis.arrays import Floats
from hysteresis.fitting.form import Form, Point
from hysteresis.fitting.identification import identify
from hysteresis.fitting.response import after_reversal
from hysteresis.fitting.settings import DEFAULTS, IdentifySettings
from hysteresis.laws.bouc_wen import BoucWen, hysteresis
from studies.each import EachResult, EachSettings, fit_each

CYCLES, SAMPLES, AMPLITUDE_MM = 3, 88, 2.2
NOISES = ("white", "correlated")
CORRELATION = 0.5
"""Of neighbouring samples, of the second make of noise."""
EACH = replace(DEFAULTS, method="least-squares", forward=True)
PARAMETERS = ("saturation_deg", "slope_after_reversal", "reach_deg", "A", "beta", "gamma", "n", "h0_deg")
WITH_SEARCH = 20
"""Devices that are fitted with the genetic search, too."""


@dataclass(frozen=True)
class Device:
    """A simulated device: its record, and the true values of the parameters."""

    record: Record
    truth: dict[str, float]


def device(seed: Sequence[int], noise: str) -> Device:
    """Draw a device: slope, bow and twist of f, the four constants of the law, zero, and size of the noise."""
    rng = np.random.default_rng(list(seed))
    phase = np.arange(CYCLES * SAMPLES + 1) / SAMPLES % 1.0
    wave = np.where(phase < 0.25, 4 * phase, np.where(phase < 0.75, 2 - 4 * phase, 4 * phase - 4))
    f = rng.uniform(12.0, 22.0) * AMPLITUDE_MM * wave * (1 + rng.uniform(-0.1, 0.1) * wave)
    f += rng.uniform(-0.02, 0.02) * float(np.ptp(f)) * wave**3
    slope, n = rng.uniform(0.6, 1.1), math.exp(rng.uniform(math.log(1.1), math.log(3.5)))
    saturation = float(np.ptp(f)) * math.exp(rng.uniform(math.log(0.015), math.log(0.06)))
    rho = rng.uniform(-0.3, 0.7)
    beta = slope / saturation**n / (1 + rho)
    h = hysteresis(f, BoucWen(-slope, beta, rho * beta, n))
    sigma = math.exp(rng.uniform(math.log(0.02), math.log(0.1)))
    angle = f + h + sigma * _noise(rng, f.size, noise) + rng.normal()
    row = np.array([math.log(slope), math.log(saturation), math.log(n), rho, 0.0])
    truth = {"A": -slope, "beta": beta, "gamma": rho * beta, "n": n, "h0_deg": 0.0, "saturation_deg": saturation}
    return Device(Record(AMPLITUDE_MM * wave, angle), truth | after_reversal(Form(()), Point(-1.0, row, np.zeros(0))))


def _noise(rng: np.random.Generator, samples: int, make: str) -> Floats:
    """White noise of variance 1, or that of an autoregression of the first order."""
    noise = rng.standard_normal(samples)
    if make == "correlated":
        for k in range(1, samples):
            noise[k] = CORRELATION * noise[k - 1] + math.sqrt(1 - CORRELATION**2) * noise[k]
    return noise


def coverage(devices: Sequence[Device], found: EachResult, name: str) -> tuple[int, float]:
    """Count the devices whose record fixes a parameter, and the share of them whose interval holds its value."""
    inside = [
        low <= one.truth[name] <= high
        for one, fit in zip(devices, found.devices, strict=True)
        if name in fit.fixed
        and (low := fit.parameters[name].low) is not None
        and (high := fit.parameters[name].high) is not None
    ]
    return len(inside), float(np.mean(inside)) if inside else math.nan


def _spent() -> float:
    own, workers = resource.getrusage(resource.RUSAGE_SELF), resource.getrusage(resource.RUSAGE_CHILDREN)
    return own.ru_utime + own.ru_stime + workers.ru_utime + workers.ru_stime


def _residual(record: Record, settings: IdentifySettings) -> float:
    return identify(record, settings=settings).train.rmse_deg


def _say(line: str) -> None:
    sys.stdout.write(f"{line}\n")
    sys.stdout.flush()


def main(count: int, seed: int, workers: int) -> None:
    """Print cost and coverage."""
    fit_each([device([seed, 0, 0], "white").record], EachSettings(EACH), workers=1)  # compiles
    for number, noise in enumerate(NOISES):
        devices = [device([seed, number, k], noise) for k in range(count)]
        before, start = _spent(), time.perf_counter()
        found = fit_each([one.record for one in devices], EachSettings(EACH), workers=workers)
        spent, took = _spent() - before, time.perf_counter() - start
        _say(f"{noise} noise: {count} devices, {len(found.failed)} without a fit")
        _say(f"  processor time {spent:.1f} s, {1e3 * spent / count:.1f} ms a device; took {took:.1f} s")
        for name in PARAMETERS:
            fixed, share = coverage(devices, found, name)
            _say(f"  {name:<22} fixed by {fixed:4d} records: {100 * share:.1f} % of the intervals hold it")
    pairs = [device([seed, 0, k], "white").record for k in range(min(count, WITH_SEARCH))]
    ratios = [_residual(one, EACH) / _residual(one, DEFAULTS) for one in pairs]
    _say(f"residual over that with the genetic search: {min(ratios):.9f} to {max(ratios):.9f}, {len(ratios)} devices")


if __name__ == "__main__":
    given = [int(text) for text in sys.argv[1:]]
    main(*(given + [1000, 2026, 2][len(given) :]))
