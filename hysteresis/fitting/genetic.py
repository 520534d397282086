"""The genetic search on pygad. pygad takes longer to load than the rest: only a search imports this module."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
import pygad

from hysteresis.arrays import Floats, Ints

_MUTATED = 0.15  # of the genes
_NEAR = 0.5  # of the mutations: a step from the present value, not a new draw


class _WholeGenerations(pygad.GA):
    """pygad with one call for the fitness of a generation, and one for its best.

    pygad looks up every candidate among parents and elite and checks its fitness one by one, which takes longer than
    a compiled score of all candidates.
    """

    def cal_pop_fitness(self) -> Floats:
        """Score the population, including the elite: shape (k,)."""
        return np.asarray(self.fitness_func(self, self.population, None))

    def best_solution(self, pop_fitness: Floats | None = None) -> tuple[Floats, np.float64, int]:
        """Return genes, fitness and index of the fittest."""
        fitness = self.cal_pop_fitness() if pop_fitness is None else np.asarray(pop_fitness)
        best = int(fitness.argmax())
        return self.population[best].copy(), fitness[best], best


def genetic(
    score: Callable[[Floats], Floats],
    genes: Floats,
    bounds: tuple[Floats, Floats],
    generations: int,
    seed: int,
    tick: Callable[[], None],
) -> Floats:
    """Genetic search: tournaments of three, uniform crossover, elitism; mutations are new draws or shrinking steps.

    The parameters are those of :func:`hysteresis.fitting.optimizers.evolve`. pygad seeds the global generators.
    The operators are those of pygad, but vectorised over a generation: its own work gene by gene.
    """
    rng = np.random.default_rng(seed)
    low, high = (np.concatenate([[sign], bound]) for sign, bound in zip((-1.0, 1.0), bounds, strict=True))

    def select(fitness: Any, count: int, ga: pygad.GA) -> tuple[Floats, Ints]:
        drawn = rng.integers(0, len(fitness), (count, 3))
        best = drawn[np.arange(count), np.asarray(fitness)[drawn].argmax(axis=1)]
        return ga.population[best], best

    def cross(parents: Floats, shape: tuple[int, int], ga: pygad.GA) -> Floats:
        first, second = rng.integers(0, len(parents), (2, shape[0]))
        return np.where(rng.random(shape) < 0.5, parents[first], parents[second])

    def mutate(offspring: Floats, ga: pygad.GA) -> Floats:
        size = 0.1 * 0.02 ** (ga.generations_completed / max(1, generations))
        drawn = np.where(
            rng.random(offspring.shape) < _NEAR,
            np.clip(offspring + size * (high - low) * rng.standard_normal(offspring.shape), low, high),
            rng.uniform(low, high, offspring.shape),
        )
        drawn[:, 0] = np.where(drawn[:, 0] < 0, -1.0, 1.0)
        return np.where(rng.random(offspring.shape) < _MUTATED, drawn, offspring)

    search = _WholeGenerations(
        num_generations=generations,
        num_parents_mating=len(genes) // 2,
        initial_population=genes,
        fitness_func=lambda _, batch, __: score(np.atleast_2d(batch)),
        fitness_batch_size=len(genes),
        parent_selection_type=select,
        crossover_type=cross,
        mutation_type=mutate,
        keep_elitism=max(1, len(genes) // 20),
        on_generation=lambda _: tick(),
        random_seed=seed,
        suppress_warnings=True,
    )
    search.run()
    return np.asarray(search.population, dtype=float)
