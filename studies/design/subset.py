"""Small probabilities by subset simulation (Au and Beck 2001, doi 10.1016/S0266-8920(01)00019-4).

P(g < 0) of standard normal variables is a product of probabilities of about one tenth: of a sample, the tenth with the
lowest g sets the next level, and Markov chains that start there fill the sample of that level. 1e-3 then takes three
levels in place of the hundred thousand draws that count as many failures. The chains are those of Papaioannou et al.
2015 (doi 10.1016/j.probengmech.2015.06.006): a candidate keeps the correlation rho with where it comes from, and is
taken where it stays below the level.

The interval is that of independent repetitions: the estimator is correlated along its chains, and a formula for that
would have to be believed.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from scipy.stats import t as student

from hysteresis.arrays import Floats
from studies.results.design import Probability

LEVEL = 0.1
MOST_LEVELS = 12
CORRELATION = 0.8
"""Of a candidate of a chain with where it comes from."""

LimitState = Callable[[Floats], Floats]
"""Takes rows of standard normal variables, (n, d), gives g, (n,); below 0 is a failure."""


@dataclass(frozen=True)
class SubsetSize:
    """Draws of a level, and independent repetitions that make the interval."""

    draws: int = 500
    repetitions: int = 8


def small_probability(g: LimitState, dimensions: int, seed: int, size: SubsetSize | None = None) -> Probability:
    """P(g < 0) with a 95 % interval from independent repetitions, on a logarithmic scale.

    Where a repetition found no failure in :data:`MOST_LEVELS` levels it counts as 10 to the minus that.
    """
    size = size or SubsetSize()
    found, calls = [], 0
    for repetition in range(size.repetitions):
        value, used = subset_simulation(g, dimensions, np.random.default_rng([seed, repetition, 61]), size.draws)
        found.append(value)
        calls += used
    logs, n = np.log(found), size.repetitions
    mean = float(np.mean(found))
    half = float(student.ppf(0.975, n - 1) * logs.std(ddof=1) / math.sqrt(n)) if n > 1 else math.inf
    centre = float(logs.mean())
    low, high = math.exp(centre - half), min(math.exp(centre + half), 1.0)
    return Probability(mean, min(low, mean), max(high, mean), calls, "subset simulation")


def subset_simulation(g: LimitState, dimensions: int, rng: np.random.Generator, draws: int) -> tuple[float, int]:
    """Estimate P(g < 0) once; also gives how often g was computed."""
    kept = max(int(LEVEL * draws), 2)
    z = rng.standard_normal((draws, dimensions))
    values, probability, calls = g(z), 1.0, draws
    for _ in range(MOST_LEVELS):
        order = np.argsort(values, kind="stable")
        level = float(values[order[kept - 1]])
        if level <= 0:
            return probability * float(np.mean(values < 0)), calls
        probability *= kept / draws
        z, values, used = _fill(g, z[order[:kept]], values[order[:kept]], level, draws, rng)
        calls += used
    return probability * LEVEL, calls


def _fill(
    g: LimitState, seeds: Floats, values: Floats, level: float, draws: int, rng: np.random.Generator
) -> tuple[Floats, Floats, int]:
    """Grow a chain from every seed until there are as many draws as before; none leaves the level."""
    rows, found, used = [seeds], [values], 0
    at, now = seeds, values
    while sum(map(len, rows)) < draws:
        candidate = CORRELATION * at + math.sqrt(1 - CORRELATION**2) * rng.standard_normal(at.shape)
        tried = g(candidate)
        used += len(candidate)
        taken = tried <= level
        at, now = np.where(taken[:, None], candidate, at), np.where(taken, tried, now)
        rows.append(at)
        found.append(now)
    return np.concatenate(rows)[:draws], np.concatenate(found)[:draws], used
