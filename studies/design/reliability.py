"""P(requirement met) under the tolerances, by drawn tubes through the chain."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import partial

import numpy as np
from scipy.stats import beta

from hysteresis.arrays import Floats, Mask
from studies.design.evaluation import Task, margins_drawn
from studies.design.space import Candidate
from studies.design.tolerance import normal_draws
from studies.design.workers import Crew
from studies.results.design import Probability

INTERVAL = 0.95


@dataclass(frozen=True)
class Drawn:
    """Tubes that were drawn: standard normal variables, shape (n, tolerances), and margins, shape (n, requirements).

    Margins are over their bounds, negative where a requirement is missed.
    """

    z: Floats
    margins: Floats

    def each(self) -> tuple[Probability, ...]:
        """P(met) of every requirement."""
        return tuple(share(column >= 0) for column in self.margins.T)

    def all(self) -> Probability:
        """P(all requirements met)."""
        return share(self.margins.min(axis=1) >= 0)


def share(met: Mask) -> Probability:
    """Share of draws that meet something, with its exact binomial interval (Clopper and Pearson 1934)."""
    n, k, tail = met.size, int(met.sum()), 0.5 * (1 - INTERVAL)
    low = 0.0 if k == 0 else float(beta.ppf(tail, k, n - k + 1))
    high = 1.0 if k == n else float(beta.ppf(1 - tail, k + 1, n - k))
    return Probability(k / n, low, high, n, "draws")


def draw(task: Task, candidate: Candidate, count: int, seed: int, workers: Crew) -> Drawn:
    """Draw tubes about a design and bend each by the chain.

    Draws depend on the seed and on the number of tolerances alone, so that designs are compared on the same ones.
    """
    z = normal_draws(task.tolerances, count, seed)
    return Drawn(z, margins_of(task, candidate, z, workers))


def margins_of(task: Task, candidate: Candidate, z: Floats, workers: Crew) -> Floats:
    """Margins of the tubes of draws, shape (n, requirements)."""
    return np.array(workers.each(partial(margins_drawn, task, candidate), list(z)))


def tightened(task: Task, candidate: Candidate, z: Floats, workers: Crew) -> Sequence[tuple[str, Probability]]:
    """P(all requirements met) with each tolerance in turn half as wide, on the same draws; the best first."""
    found = []
    for k, one in enumerate(task.tolerances.each):
        better = Task(task.space, task.requirements, task.use, task.tolerances.with_halved(k))
        found.append((one.name, share(margins_of(better, candidate, z, workers).min(axis=1) >= 0)))
    return sorted(found, key=lambda row: -row[1].value)
