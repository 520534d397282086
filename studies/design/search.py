"""Search for tubes that meet the requirements, then for what they trade: NSGA-II (doi 10.1109/4235.996017, pymoo)."""

from __future__ import annotations

import warnings
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import partial

import numpy as np
from pymoo.algorithms.moo.nsga2 import NSGA2
from pymoo.core.problem import Problem
from pymoo.termination import get_termination
from scipy.stats import qmc

from hysteresis.arrays import Floats
from studies.design.evaluation import Evaluated, Task, evaluate, evaluate_robust
from studies.design.space import Candidate
from studies.design.workers import Crew
from studies.results.study import Goal
from studies.sweep.pareto import front

WORST = 1e9
"""Objective of a tube that misses a requirement: its constraint excludes it, but the search needs a number."""
Progress = Callable[[str, int, int], None]
"""Takes what is done, how many are done, and of how many."""


@dataclass(frozen=True)
class Search:
    """What a search is: its size, its seed, and what is traded.

    It starts from the best of ``explore`` tubes spread over the whole space (Sobol's points), or from ``start``.
    """

    population: int
    generations: int
    seed: int
    trade: tuple[tuple[str, Goal], ...]
    explore: int = 0
    start: tuple[Floats, ...] = ()


@dataclass(frozen=True)
class Found:
    """All tubes that were tried, each once, in the order of the search, with their points of the unit cube."""

    tried: tuple[Evaluated, ...]
    points: tuple[Floats, ...]

    @property
    def feasible(self) -> tuple[Evaluated, ...]:
        """Tubes that meet all requirements."""
        return tuple(one for one in self.tried if not one.shortfalls)


def search(
    task: Task, settings: Search, workers: Crew, least_beta: Sequence[float] = (), progress: Progress | None = None
) -> Found:
    """Search; where ``least_beta`` is given, a number a requirement, tubes need that reliability, too.

    The same tube is tried once. Results do not depend on the workers.
    """
    robust, words = len(least_beta) > 0, "robust tubes" if len(least_beta) else "tubes"
    work = partial(evaluate_robust if robust else evaluate, task)
    known, points = dict[Candidate, Evaluated](), dict[Candidate, Floats]()

    def evaluated(rows: Floats) -> list[Evaluated]:
        candidates = [task.space.candidate(row) for row in rows]
        new = [one for one in dict.fromkeys(candidates) if one not in known]
        known.update(zip(new, workers.each(work, new), strict=True))
        for one, row in zip(candidates, rows, strict=True):
            points.setdefault(one, row)
        return [known[one] for one in candidates]

    explored = _spread(settings.explore, task.space.size, settings.seed)
    order = np.argsort([_missed(one, least_beta) for one in evaluated(explored)], kind="stable")
    start = (*settings.start, *explored[order])[: settings.population]
    algorithm = NSGA2(pop_size=settings.population, sampling=_filled(start, task.space.size, settings))
    algorithm.setup(
        Problem(n_var=task.space.size, n_obj=len(settings.trade), n_ieq_constr=1, xl=0.0, xu=1.0),
        termination=get_termination("n_gen", settings.generations), seed=settings.seed, verbose=False,
    )  # fmt: skip
    while algorithm.has_next():
        population = algorithm.ask()
        results = evaluated(np.asarray(population.get("X"), dtype=float))
        goals = np.array([_goals(one, settings.trade) for one in results])
        missed = np.array([[_missed(one, least_beta)] for one in results])
        population.set("F", goals, "G", missed)
        for individual in population:  # marked as evaluated, so that the search does not evaluate them again
            individual.evaluated.update({"F", "G", "H"})
        algorithm.tell(infills=population)
        if progress is not None:
            progress(words, algorithm.n_iter - 1, settings.generations)
    return Found(tuple(known.values()), tuple(points[one] for one in known))


def _spread(count: int, size: int, seed: int) -> Floats:
    """Spread points over the unit cube, shape (count, size)."""
    with warnings.catch_warnings():  # about counts that are no power of two
        warnings.simplefilter("ignore", UserWarning)
        return np.asarray(qmc.Sobol(size, scramble=True, rng=seed).random(count)) if count else np.empty((0, size))


def _filled(start: Sequence[Floats], size: int, settings: Search) -> Floats:
    """Fill a first population up by a Latin hypercube."""
    rest = settings.population - len(start)
    return np.array([*start, *qmc.LatinHypercube(size, rng=settings.seed).random(max(rest, 0))])


def _goals(one: Evaluated, trade: Sequence[tuple[str, Goal]]) -> list[float]:
    values = [one.measured.of(name) * (1 if goal == "min" else -1) for name, goal in trade]
    return [value if np.isfinite(value) and abs(value) < WORST else WORST for value in values]


def _missed(one: Evaluated, least_beta: Sequence[float]) -> float:
    if one.shortfalls or not least_beta:
        return one.missed + (REFUSED_ROBUST if least_beta else 0.0)
    return sum(max(least - beta, 0.0) for least, beta in zip(least_beta, one.reliability, strict=True))


REFUSED_ROBUST = 1e2
"""Added where a tube misses a nominal requirement in a search for robust ones."""


def best(tried: Sequence[Evaluated], trade: Sequence[tuple[str, Goal]], shown: int) -> tuple[Evaluated, ...]:
    """Choose from the front of some tubes: the best of each quantity that is traded, and evenly in between.

    They are in the order of the first quantity.
    """
    if not tried:
        return ()
    goals = np.array([_goals(one, trade) for one in tried])
    rows = front(goals)
    order = rows[np.lexsort(goals[rows].T[::-1])]
    keep = np.unique(np.linspace(0, len(order) - 1, min(shown, len(order))).round().astype(int))
    return tuple(tried[int(order[k])] for k in keep)
