"""Identification of loops whose parameters are known: do they come back, and do the intervals hold them."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from hysteresis import identify
from hysteresis.arrays import Floats
from hysteresis.bouc_wen import BoucWen, hysteresis
from hysteresis.fit import Fit
from hysteresis.record import Record
from hysteresis.settings import IdentifySettings

PAPER = {"A": 1.895, "beta": 0.315, "gamma": 0.2606, "n": 1.176}  # eq. 10
NAMES = ("A", "beta", "gamma", "n", "saturation_deg")
NOISE_DEG = 0.05
_UP = np.linspace(-2.2, 2.2, 89)
DRIVE = np.concatenate([_UP[44:], *[np.concatenate([_UP[::-1][1:], _UP[1:]])] * 3])  # approach and 3 cycles, 0.05 mm


def kinematics(drive: Floats) -> Floats:
    """Odd, +-45 deg at +-2.2 mm, softening: shape (m,) -> (m,), deg."""
    return 22.5 * drive - 0.4225 * drive**3


def loop(model: BoucWen, noise_deg: float = 0.0, seed: int = 0) -> Record:
    """Record of a loop with white noise."""
    path = kinematics(DRIVE)
    noise = noise_deg * np.random.default_rng(seed).standard_normal(len(DRIVE))
    return Record(drive=DRIVE, angle_deg=path + hysteresis(path, model) + noise)


def largest_error(fit: Fit, model: BoucWen) -> float:
    """Largest relative error of A, beta, gamma and n."""
    return max(abs(fit.parameters[name].value / getattr(model, name) - 1) for name in PAPER)


def recovery(seeds: int = 20, within: float = 1e-4) -> list[str]:
    """Noise-free loops of the paper's parameters, lagging: how many seeds bring them back."""
    model = BoucWen(**PAPER | {"A": -PAPER["A"]})
    lines = [
        "## Parameters of a loop without noise", "",
        f"The paper's parameters (eq. 10), lagging; {seeds} seeds of each method. Asked: all within 1e-4.", "",
        "| method | within 1e-4 | largest relative error | seconds a fit |", "|---|---|---|---|",
    ]  # fmt: skip
    for method in ("genetic", "cma", "differential-evolution", "least-squares"):
        fits = [
            identify(loop(model), kinematics, settings=IdentifySettings(method=method, seed=seed))
            for seed in range(seeds)
        ]
        found = [largest_error(fit, model) for fit in fits]
        good, seconds = sum(error <= within for error in found), np.median([fit.seconds for fit in fits])
        lines.append(f"| {method} | {good} of {seeds} | {max(found):.1e} | {seconds:.2f} |")
    return [*lines, ""]


def draws(count: int, seed: int = 0) -> Iterator[BoucWen]:
    """Laws at random that the loop can show: a saturation of 1 to 4 deg, both sharp and soft."""
    rng = np.random.default_rng(seed)
    for _ in range(count):
        slope, saturation = rng.uniform(0.6, 2.0), rng.uniform(1.0, 4.0)
        n, rho = rng.uniform(1.2, 3.0), rng.uniform(-0.3, 0.7)
        beta = slope / saturation**n / (1 + rho)
        yield BoucWen(-slope, beta, rho * beta, n, h0_deg=saturation * rng.uniform(-0.8, 0.8))


def covered(count: int = 200, noise_deg: float = NOISE_DEG) -> tuple[dict[str, int], dict[str, int]]:
    """How often the 95 % intervals hold the truth: those of the Jacobian, and those by blocks."""
    jacobian, blocks = dict.fromkeys(NAMES, 0), dict.fromkeys(NAMES, 0)
    for seed, model in enumerate(draws(count)):
        fit = identify(loop(model, noise_deg, seed), kinematics, settings=IdentifySettings(generations=30, seed=seed))
        everything = fit.parameters | {"saturation_deg": fit.saturation_deg}
        for name in NAMES:
            truth = getattr(model, name)
            for found, counts in ((everything, jacobian), (fit.bootstrap, blocks)):
                low, high = found[name].low, found[name].high
                counts[name] += low is not None and high is not None and low <= truth <= high
    return jacobian, blocks


def coverage(count: int = 200) -> list[str]:
    """Table of :func:`covered`."""
    jacobian, blocks = covered(count)
    head = (
        f"{count} laws at random, white noise of {NOISE_DEG:g} deg, three cycles of 0.05 mm steps. Asked: 90 to 99 %."
    )
    lines = ["## Intervals of 95 %: how often they hold the truth", "", head, ""]
    lines += ["| parameter | Jacobian, % | blocks, % |", "|---|---|---|"]
    lines += [f"| {name} | {100 * jacobian[name] / count:.1f} | {100 * blocks[name] / count:.1f} |" for name in NAMES]
    return [*lines, ""]
