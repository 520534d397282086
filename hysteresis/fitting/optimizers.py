"""Global optimizers behind one call; each scores a whole batch of candidates at a time.

A candidate is a row of genes: first -1 or 1 (the sign of A), then coordinates within the bounds.
"""

from __future__ import annotations

import random
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import Literal, get_args

import numpy as np
from scipy.optimize import differential_evolution

from hysteresis.arrays import Floats
from hysteresis.extras import require_extra

Score = Callable[[Floats], Floats]  # genes (k, 1 + p) -> fitness (k,), higher is better
Method = Literal["genetic", "cma", "differential-evolution", "least-squares"]
METHODS: tuple[str, ...] = get_args(Method)


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

    Raises
    ------
    MissingError
        The library of the extra ``cma`` is missing.
    """
    runs: dict[str, Callable[..., Floats]] = {
        "genetic": _by_pygad,
        "cma": _cma,
        "differential-evolution": _differential,
        "least-squares": lambda score, genes, *_: genes,
    }
    last = runs[method](score, genes, bounds, generations, seed, tick)
    return last[np.argsort(-score(last), kind="stable")]


def _by_pygad(
    score: Score,
    genes: Floats,
    bounds: tuple[Floats, Floats],
    generations: int,
    seed: int,
    tick: Callable[[], None],
) -> Floats:
    from hysteresis.fitting.genetic import genetic  # pygad takes longer to load than all the rest

    with _random_state_kept():
        return genetic(score, genes, bounds, generations, seed, tick)


def _cma(
    score: Score,
    genes: Floats,
    bounds: tuple[Floats, Floats],
    generations: int,
    seed: int,
    tick: Callable[[], None],
) -> Floats:
    require_extra("cma", "the method cma")
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
