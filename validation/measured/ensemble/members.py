"""Members of the ensemble of du2018: from weighted draws on by emcee's ensemble sampler.

The draws that meet all facts are few and weighted. Resampled by their weights they are draws from what the facts say,
so the sampler starts where it is to arrive, and needs no burn-in. It has a walker for every member, and moves those
that start from the same draw apart.

emcee: Foreman-Mackey et al. 2013, doi 10.1086/670067; differential evolution moves: ter Braak 2006,
doi 10.1007/s11222-006-8769-1.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping
from concurrent.futures import Executor
from dataclasses import dataclass

import numpy as np

from fem_models.rig import Rig
from hysteresis.arrays import Floats
from validation.measured.ensemble.draws import Density, Draws
from validation.measured.ensemble.facts import PAPER, PLACE_RESOLUTION_MM, Facts
from validation.measured.ensemble.priors import Model

STEPS = 48
"""Steps of the sampler: walkers that start from the same draw part."""


class _OfPlace:
    """Density where the loops are widest near zero drive, else -inf: the logarithm and the row of a draw."""

    def __init__(self, density: Density) -> None:
        self.density = density

    def __call__(self, quantiles: Floats) -> tuple[float, Floats]:
        row = self.density(np.asarray(quantiles))
        met = (np.abs(row[-2:]) <= PLACE_RESOLUTION_MM + 1e-9).all()  # not of NaN
        return (float(row[0]) if met else -np.inf), row


class _Pool:
    """The map of an executor, with batches that do not wait for each other."""

    def __init__(self, executor: Executor) -> None:
        self.executor = executor

    def map(self, function: Callable[[Floats], object], items: Iterable[Floats]) -> list[object]:
        return list(self.executor.map(function, items, chunksize=6))


@dataclass(frozen=True)
class Member:
    """Constants of a rig by name, and its facts."""

    constants: Mapping[str, float]
    facts: Facts


def extend(
    base: Rig, model: Model, draws: Draws, count: int, seed: int, *, goal: Facts = PAPER, pool: Executor | None = None
) -> tuple[list[Member], float]:
    """Give ``count`` members of a model, and the share of the sampler's steps that moved.

    Repeatable for a seed, whatever the number of workers in ``pool``.

    Raises
    ------
    ValueError
        No draw meets the place of the widest point.
    """
    import emcee  # needed where members are made; they are shipped

    chance = draws.weight * draws.place_met
    if not chance.any():
        raise ValueError("no draw meets the place of the widest point: expected more draws")
    random = np.random.RandomState(seed)  # emcee's kind of generator
    walkers = max(count + count % 2, 2 * draws.quantiles.shape[1] + 2)
    start = draws.quantiles[random.choice(chance.size, walkers, p=chance / chance.sum())]
    density = Density(base, model, goal)
    sampler = emcee.EnsembleSampler(
        walkers,
        density.size,
        _OfPlace(density),
        moves=[(emcee.moves.StretchMove(), 0.5), (emcee.moves.DEMove(), 0.5)],
        pool=None if pool is None else _Pool(pool),
    )
    state = emcee.State(start, random_state=random.get_state())
    sampler.run_mcmc(state, STEPS, skip_initial_state_check=True)
    members = [_member(density, row) for row in sampler.get_blobs()[-1][:count]]
    return members, float(np.mean(sampler.acceptance_fraction))


def _member(density: Density, row: Floats) -> Member:
    values = dict(zip(density.columns, row.tolist(), strict=True))
    names = (*density.model.drawn, *density.model.solved)
    full, *numbers = list(values.values())[-5:]
    facts = Facts(full, (numbers[0], numbers[1]), (numbers[2], numbers[3]))
    return Member({name: values[name] for name in names} | dict(density.model.fixed), facts)
