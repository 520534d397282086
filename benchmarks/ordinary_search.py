"""The paper's search in a conventional implementation: plain pygad, one candidate at a time, Runge-Kutta in Python.

This is what a user would write from the paper (section 3.3) and the first example of pygad: eq. 7 as printed, the loop
as an array, and the numbers of a candidate as pygad passes them, as numpy numbers.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from itertools import pairwise

import numpy as np
import pygad
from numpy.typing import NDArray


def slope(h: float, df: float, A: float, beta: float, gamma: float, n: float) -> float:
    """Evaluate eq. 7 as printed, for a change df of f in one unit of time."""
    return A * df - beta * np.abs(df) * np.abs(h) ** (n - 1) * h - gamma * df * np.abs(h) ** n


def follow(path: Sequence[float], parts: int, A: float, beta: float, gamma: float, n: float) -> list[float]:
    """Integrate h along a path of f by classical Runge-Kutta, ``parts`` steps from sample to sample."""
    h, out = 0.0, [0.0]
    for a, b in pairwise(path):
        df = (b - a) / parts
        for _ in range(parts):
            k1 = slope(h, df, A, beta, gamma, n)
            k2 = slope(h + 0.5 * k1, df, A, beta, gamma, n)
            k3 = slope(h + 0.5 * k2, df, A, beta, gamma, n)
            k4 = slope(h + k3, df, A, beta, gamma, n)
            h += (k1 + 2 * k2 + 2 * k3 + k4) / 6
        out.append(h)
    return out


def search(
    path: NDArray[np.float64],
    angle_deg: NDArray[np.float64],
    bounds: Sequence[tuple[float, float]],
    *,
    population: int,
    generations: int,
    parts: int,
    seed: int,
) -> tuple[list[float], float]:
    """Run the search; return A, beta, gamma, n, and their root mean square error in deg."""

    def error(solution: Sequence[float]) -> float:
        deviation = path + np.array(follow(path, parts, *solution)) - angle_deg
        found = float(np.sqrt(np.mean(deviation**2)))
        return found if math.isfinite(found) else 1e6  # the steps are too long for this candidate

    ga = pygad.GA(
        num_generations=generations,
        num_parents_mating=population // 2,
        sol_per_pop=population,
        num_genes=len(bounds),
        gene_space=[{"low": low, "high": high} for low, high in bounds],
        fitness_func=lambda _, solution, __: -error(solution),
        parent_selection_type="tournament",
        crossover_type="uniform",
        mutation_type="random",
        mutation_probability=0.15,
        keep_elitism=5,
        random_seed=seed,
        suppress_warnings=True,
    )
    with np.errstate(all="ignore"):
        ga.run()
    solution, fitness, _ = ga.best_solution(ga.last_generation_fitness)
    return [float(v) for v in solution], -float(fitness)
