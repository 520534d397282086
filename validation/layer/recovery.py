"""Identification of simulated loops with known parameters: recovery of the parameters, coverage of the intervals."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from typing import get_args

import numpy as np

from hysteresis import Fit, Record, identify
from hysteresis.arrays import Floats
from hysteresis.fitting.optimizers import Method
from hysteresis.fitting.settings import IdentifySettings
from hysteresis.laws.bouc_wen import BoucWen, hysteresis

PAPER = {"A": 1.895, "beta": 0.315, "gamma": 0.2606, "n": 1.176}
"""Bouc-Wen parameters of the paper, equation 10."""
RECOVERED = 1e-4
"""Relative error below which a parameter counts as recovered."""
NAMES = ("A", "beta", "gamma", "n", "saturation_deg")
NOISE_DEG = 0.05
_UP = np.linspace(-2.2, 2.2, 89)
DRIVE = np.concatenate([_UP[44:], *[np.concatenate([_UP[::-1][1:], _UP[1:]])] * 3])
"""Approach and three cycles in steps of 0.05 mm."""


@dataclass(frozen=True)
class MethodRecovery:
    """Fits of one method with different seeds: how many recovered all parameters, and the median time of a fit."""

    method: str
    recovered: int
    seeds: int
    largest_error: float
    seconds: float


@dataclass(frozen=True)
class Coverage:
    """Intervals that contain the true value, by parameter: those of the Jacobian, and those of the block bootstrap."""

    jacobian: Mapping[str, int]
    blocks: Mapping[str, int]
    count: int
    noise_deg: float


def kinematics(drive: Floats) -> Floats:
    """Odd, softening curve of +-45 deg at +-2.2 mm: shape (m,) -> (m,), deg."""
    return 22.5 * drive - 0.4225 * drive**3


def simulated_loop(model: BoucWen, noise_deg: float = 0.0, seed: int = 0) -> Record:
    """Simulate a record of a loop with white noise."""
    path = kinematics(DRIVE)
    noise = noise_deg * np.random.default_rng(seed).standard_normal(len(DRIVE))
    return Record(drive=DRIVE, angle_deg=path + hysteresis(path, model) + noise)


def largest_error(fit: Fit, model: BoucWen) -> float:
    """Largest relative error of A, beta, gamma and n."""
    return max(abs(fit.parameters[name].value / getattr(model, name) - 1) for name in PAPER)


def recovery(method: Method, seeds: int = 20) -> MethodRecovery:
    """Identify a noise-free, lagging loop with the paper's parameters, once per seed."""
    model = BoucWen(**PAPER | {"A": -PAPER["A"]})
    fits = [
        identify(simulated_loop(model), kinematics, settings=IdentifySettings(method=method, seed=seed))
        for seed in range(seeds)
    ]
    errors = [largest_error(fit, model) for fit in fits]
    recovered, seconds = sum(error <= RECOVERED for error in errors), float(np.median([fit.seconds for fit in fits]))
    return MethodRecovery(method, recovered, seeds, max(errors), seconds)


def recoveries() -> list[MethodRecovery]:
    """Compare all search methods."""
    return [recovery(method) for method in get_args(Method)]


def draws(count: int, seed: int = 0) -> Iterator[BoucWen]:
    """Draw laws that the loop makes identifiable: saturations of 1 to 4 deg, sharp and soft transitions."""
    rng = np.random.default_rng(seed)
    for _ in range(count):
        slope, saturation = rng.uniform(0.6, 2.0), rng.uniform(1.0, 4.0)
        n, rho = rng.uniform(1.2, 3.0), rng.uniform(-0.3, 0.7)
        beta = slope / saturation**n / (1 + rho)
        yield BoucWen(-slope, beta, rho * beta, n, h0_deg=saturation * rng.uniform(-0.8, 0.8))


def coverage(count: int = 200, noise_deg: float = NOISE_DEG) -> Coverage:
    """Count how often the 95 % intervals contain the true values of random laws."""
    jacobian, blocks = dict.fromkeys(NAMES, 0), dict.fromkeys(NAMES, 0)
    for seed, model in enumerate(draws(count)):
        record = simulated_loop(model, noise_deg, seed)
        fit = identify(record, kinematics, settings=IdentifySettings(generations=30, seed=seed))
        everything = fit.parameters | {"saturation_deg": fit.saturation_deg}
        for name in NAMES:
            truth = getattr(model, name)
            for found, counts in ((everything, jacobian), (fit.bootstrap, blocks)):
                low, high = found[name].low, found[name].high
                counts[name] += low is not None and high is not None and low <= truth <= high
    return Coverage(jacobian, blocks, count, noise_deg)
