"""Global optimizers behind one call; each scores a whole batch of candidates at a time.

A candidate is a row of genes: first -1 or 1 (the sign of A), then coordinates within the bounds.
"""

from __future__ import annotations

import random
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import Any, Literal, get_args

import numpy as np
import pygad
from scipy.optimize import differential_evolution

from hysteresis.arrays import Floats, Ints

Score = Callable[[Floats], Floats]  # genes (k, 1 + p) -> fitness (k,), higher is better
Method = Literal["genetic", "cma", "differential-evolution", "least-squares"]
METHODS: tuple[str, ...] = get_args(Method)

_MUTATED = 0.15  # of the genes
_NEAR = 0.5  # of the mutations: a step from the present value, not a new draw


def evolve(
    method: Method,
    score: Score,
    genes: Floats,
    bounds: tuple[Floats, Floats],
    *,
    generations: int,
    seed: int,
    tick: Callable[[], None],
) -> Floats:
    """Search from a population; return the last one, the fittest first.

    Parameters
    ----------
    method
        ``"genetic"`` (pygad), ``"cma"`` (CMA-ES, one run for each sign), ``"differential-evolution"`` (scipy), or
        ``"least-squares"``: no global search; least squares start from the best of the population.
    score
        Fitness of a whole batch, computed in one call.
    genes
        Shape (k, 1 + p), the first population.
    bounds
        Of the coordinates, shapes (p,).
    generations
        Batches of k; CMA-ES and differential evolution end earlier if they have converged.
    seed, tick
        The same seed gives the same result; ``tick`` is called after each generation.

    Returns
    -------
    NDArray
        Shape (k, 1 + p).
    """
    runs: dict[str, Callable[..., Floats]] = {
        "genetic": _genetic,
        "cma": _cma,
        "differential-evolution": _differential,
        "least-squares": lambda score, genes, *_: genes,
    }
    last = runs[method](score, genes, bounds, generations, seed, tick)
    return last[np.argsort(-score(last), kind="stable")]


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


def _genetic(
    score: Score,
    genes: Floats,
    bounds: tuple[Floats, Floats],
    generations: int,
    seed: int,
    tick: Callable[[], None],
) -> Floats:
    """Genetic search: tournaments of three, uniform crossover, elitism; mutations are new draws or shrinking steps.

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

    with _random_state_kept():
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


def _cma(
    score: Score,
    genes: Floats,
    bounds: tuple[Floats, Floats],
    generations: int,
    seed: int,
    tick: Callable[[], None],
) -> Floats:
    import cma  # type: ignore[import-untyped]  # takes longer to load than all the rest, and only this method needs it

    low, high = bounds
    ends = [genes]
    for sign in (-1.0, 1.0):
        of_sign = genes[genes[:, 0] == sign]
        if not len(of_sign):
            continue
        start = of_sign[np.argmax(score(of_sign)), 1:]
        options = {
            "bounds": [0.0, 1.0], "popsize": max(4, len(genes) // 2), "seed": seed + 1, "verbose": -9,
            "maxiter": generations,
        }  # fmt: skip
        with _random_state_kept():
            search = cma.CMAEvolutionStrategy((start - low) / (high - low), 0.25, options)
            while not search.stop():
                points = np.array(search.ask())
                batch = np.column_stack([np.full(len(points), sign), low + np.clip(points, 0, 1) * (high - low)])
                search.tell(points, (-score(batch)).tolist())
                if sign < 0:
                    tick()
        ends.append(np.concatenate([[sign], low + np.clip(search.result.xbest, 0, 1) * (high - low)])[np.newaxis])
    return np.concatenate(ends)


def _differential(
    score: Score,
    genes: Floats,
    bounds: tuple[Floats, Floats],
    generations: int,
    seed: int,
    tick: Callable[[], None],
) -> Floats:
    def loss(columns: Floats) -> Floats:
        rows = np.atleast_2d(columns.T)
        return -score(np.column_stack([np.where(rows[:, 0] < 0, -1.0, 1.0), rows[:, 1:]]))

    solution = differential_evolution(
        loss,
        [(-1.0, 1.0), *zip(*bounds, strict=True)],
        init=genes,
        maxiter=generations,
        vectorized=True,
        updating="deferred",
        polish=False,
        tol=1e-10,
        rng=np.random.default_rng(seed),
        callback=lambda intermediate_result: tick(),
    )
    last = np.concatenate([solution.x[np.newaxis], solution.population])
    last[:, 0] = np.where(last[:, 0] < 0, -1.0, 1.0)
    return last


@contextmanager
def _random_state_kept() -> Iterator[None]:
    """Restore the state of the global generators, which the libraries seed."""
    of_python, of_numpy = random.getstate(), np.random.get_state()  # noqa: NPY002
    try:
        yield
    finally:
        random.setstate(of_python)
        np.random.set_state(of_numpy)  # noqa: NPY002
