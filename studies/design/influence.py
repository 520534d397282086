"""Which tolerance costs most: Sobol indices (Saltelli's estimators in SALib) and plain differences."""

from __future__ import annotations

from functools import partial

import numpy as np
from SALib.analyze import sobol as analysis
from SALib.sample import sobol as sampling
from scipy.special import ndtri

from fem_models.rig import RigError
from hysteresis.arrays import Floats
from studies.design.evaluation import Task, bent
from studies.design.quantities import QUANTITIES
from studies.design.space import Candidate
from studies.design.workers import Crew
from studies.results.design import Influence

BLOCKS = 64
"""Blocks of (tolerances + 2) tubes; a power of two, as Sobol's points ask for."""
RESAMPLES = 100
"""For the intervals of the indices."""
CONSTANT = 1e-9
"""Relative spread of a quantity below which it has no indices."""


def influences(task: Task, candidate: Candidate, seed: int, workers: Crew) -> tuple[Influence, ...]:
    """Find what each tolerance does to each required quantity, the largest first within a quantity.

    A quantity that is unknown for a block of tubes leaves that block out; one that does not vary is left out.
    """
    names, tolerances = task.requirements.names, task.tolerances.each
    problem = {
        "num_vars": len(tolerances),
        "names": [one.name for one in tolerances],
        "bounds": [[0.0, 1.0]] * len(tolerances),
    }
    if len(tolerances) < 2:
        return ()
    unit = sampling.sample(problem, BLOCKS, calc_second_order=False, seed=seed)
    z = ndtri(np.clip(unit, 1e-9, 1 - 1e-9))
    sides = np.concatenate([side * np.eye(len(tolerances)) for side in (1.0, -1.0)])
    rows = np.array(workers.each(partial(quantities_drawn, task, candidate), list(np.concatenate([z, sides]))))
    found = []
    for name, column in zip(names, rows.T, strict=True):
        blocks = column[: len(z)].reshape(BLOCKS, -1)
        good = blocks[np.isfinite(blocks).all(axis=1)]
        if len(good) < 4 or np.ptp(good) <= CONSTANT * np.abs(good).max():
            continue
        result = analysis.analyze(problem, good.ravel(), calc_second_order=False, num_resamples=2, seed=seed)
        within = _within(good, seed)
        up, down = column[len(z) :].reshape(2, -1)
        each = [
            Influence(
                tolerance=one.name,
                quantity=name,
                unit=QUANTITIES[name].units,
                change=float(up[k] - down[k]),
                first=float(result["S1"][k]),
                total=float(result["ST"][k]),
                total_within=float(within[k]),
            )
            for k, one in enumerate(tolerances)
        ]
        found += sorted(each, key=lambda row: -row.total)
    return tuple(found)


def _within(blocks: Floats, seed: int) -> Floats:
    """Half the 95 % interval of each total index, by resampled blocks, shape (tolerances,).

    Columns of a block, shape (n, tolerances + 2), are those of Saltelli's design: a point, the point with one tolerance
    of another in turn, and that other. SALib's own resampling is not that of its seed.
    """
    rng = np.random.default_rng([seed, 59])
    rows = blocks[rng.integers(len(blocks), size=(RESAMPLES, len(blocks)))]
    first, other = rows[..., 0], rows[..., -1]
    spread = np.concatenate([first, other], axis=1).var(axis=1)
    squares = ((first[..., None] - rows[..., 1:-1]) ** 2).mean(axis=1)
    totals = 0.5 * squares / np.where(spread > 0, spread, np.inf)[:, None]
    return np.asarray(1.96 * totals.std(axis=0))


def quantities_drawn(task: Task, candidate: Candidate, z: Floats) -> Floats:
    """Give the required quantities of a drawn tube, shape (requirements,); NaN of one that cannot be bent."""
    names = task.requirements.names
    try:
        rig = task.tolerances.drawn(task.space.rig(candidate), z)
    except RigError:
        return np.full(len(names), np.nan)
    measured = bent(rig, task.space.wire(candidate), task.use)
    return np.array([np.nan if measured is None else measured.of(name) for name in names])
