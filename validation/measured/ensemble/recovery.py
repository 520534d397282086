"""Whether the ranges keep what they promise: facts of hidden rigs, drawn from the priors, in place of the paper's."""

from __future__ import annotations

from concurrent.futures import Executor
from contextlib import suppress
from dataclasses import dataclass, replace
from functools import partial

import numpy as np

from fem_models.rig import Rig
from fem_models.rig.checks import SolverError
from fem_models.rig.ensemble import with_constants
from hysteresis.arrays import Floats
from validation.measured.ensemble.draws import Density, Draws, draw, weighted_quantiles
from validation.measured.ensemble.facts import FULL_SCALE_RESOLUTION_DEG, Facts, loop_numbers
from validation.measured.ensemble.predict import WIDTHS
from validation.measured.ensemble.priors import Model
from validation.separation.ensemble import LEVEL

_ENDS = (0.5 - LEVEL / 2, 0.5 + LEVEL / 2)


@dataclass(frozen=True)
class Recovery:
    """Hidden values within their ranges, shape (rigs,), by the name of the constant or the prediction.

    ``effective`` is the number of independent draws behind the ranges, shape (rigs,): fewer make them too narrow.
    """

    inside: dict[str, Floats]
    effective: Floats


def recover(base: Rig, model: Model, *, rigs: int, draws: int, seed: int, pool: Executor | None = None) -> Recovery:
    """Hide rigs of a model, draw what their three numbers leave open, and compare; the place is no condition.

    The full scale is given to half a degree, as in the paper. Repeatable for a seed, whatever the ``pool``.
    """
    mapper = map if pool is None else partial(pool.map, chunksize=8)
    density, rng = Density(base, model), np.random.default_rng(seed)
    inside: dict[str, list[float]] = {}
    effective: list[float] = []
    while len(effective) < rigs:
        hidden = density.chosen(rng.random(density.size))
        hidden |= {name: float(model.priors[name].at(rng.random(1))[0]) for name in model.solved}
        rig = with_constants(base, hidden)
        off = float(rng.uniform(-1, 1)) * FULL_SCALE_RESOLUTION_DEG
        try:
            goal = _facts(rig, off)
            for preload, amplitude in WIDTHS.values():
                loop_numbers(replace(rig, preload_N=preload), amplitude)
        except SolverError:  # such a rig has no such facts
            continue
        try:
            found = draw(base, model, draws, seed + len(effective) + 1, goal=goal, mapper=mapper)
        except ValueError:  # no draw shows its numbers: nothing of it is within a range
            for name in (*model.drawn, *model.solved, *WIDTHS):
                inside.setdefault(name, []).append(0.0)
            effective.append(0.0)
            continue
        values = {name: (hidden[name], found.column(name)) for name in (*model.drawn, *model.solved)}
        values |= _predicted(base, model, rig, found)
        for name, (true, drawn) in values.items():
            low, high = weighted_quantiles(drawn, np.where(np.isfinite(drawn), found.weight, 0.0), _ENDS)
            inside.setdefault(name, []).append(float(low <= true <= high))
        effective.append(float(found.weight.sum() ** 2 / (found.weight**2).sum()))
    return Recovery({name: np.array(one) for name, one in inside.items()}, np.array(effective))


def _facts(rig: Rig, off_deg: float) -> Facts:
    low, high = (loop_numbers(replace(rig, preload_N=p)) for p in (10.0, 20.0))
    return Facts(high.full_scale_deg + off_deg, (low.width_deg, high.width_deg), (0.0, 0.0))


def _predicted(base: Rig, model: Model, rig: Rig, found: Draws) -> dict[str, tuple[float, Floats]]:
    """Give true widths at other preloads and amplitudes, and those of the draws, NaN without weight."""
    names = (*model.drawn, *model.solved)
    out = {}
    for title, (preload, amplitude) in WIDTHS.items():
        drawn = np.full(found.weight.size, np.nan)
        for k in np.flatnonzero(found.weight > 0):
            constants = {name: float(found.column(name)[k]) for name in names} | dict(model.fixed)
            with suppress(SolverError):  # notches that close at another preload: no such loop
                drawn[k] = loop_numbers(with_constants(base, {**constants, "preload_N": preload}), amplitude).width_deg
        out[title] = (loop_numbers(replace(rig, preload_N=preload), amplitude).width_deg, drawn)
    return out
