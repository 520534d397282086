"""Whether the ranges keep what they promise: statements of hidden rigs, drawn from the priors, in place of the paper's.

Many rigs of the priors are run once. What a hidden rig would state, numbers and words with their errors, weights all
others by their likelihood. Of draws by these weights the hidden value is as likely to have any rank.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable
from concurrent.futures import Executor
from dataclasses import dataclass, replace
from functools import partial

import numpy as np
from scipy.special import log_ndtr

from fem_models.rig import Rig, RigError
from fem_models.rig.checks import SolverError
from fem_models.rig.ensemble import with_constants
from hysteresis.arrays import Floats, Mask
from validation.measured.ensemble.predict import predicted_shares
from validation.measured.ensemble.priors import MechanismSet
from validation.measured.readings.loops import loops_of, static_loop
from validation.measured.readings.statements import FULL, SAME, W10, W20, margins_of, residuals

DRAWS = 39
"""Draws of each hidden rig: it lies beyond all of them with 5 %."""
LEAST_EFFECTIVE = 20.0
"""Effective draws below which the ranges of a hidden rig say little."""
_NUMBERS = 4
Mapper = Callable[..., Iterable[Floats]]


@dataclass(frozen=True)
class Recovery:
    """Hidden values within the 95 % ranges, shape (rigs,), by the name of the constant or the prediction.

    ``effective`` is the number of independent draws behind the ranges, shape (rigs,).
    """

    inside: dict[str, Mask]
    effective: Floats


def recover(
    base: Rig, model: MechanismSet, reading: str, *, rigs: int, others: int, seed: int, pool: Executor | None = None
) -> Recovery:
    """Hide rigs of a model, weight ``others`` rigs by what each states, and compare; the same for any ``pool``."""
    mapper: Mapper = map if pool is None else partial(pool.map, chunksize=64)
    rng = np.random.default_rng(seed)
    quantiles = rng.random((rigs + others, len(model.names)))
    said = np.array(list(mapper(partial(_said, base, model, reading), quantiles)))
    able = np.isfinite(said).all(axis=1)
    quantiles, said = quantiles[able], said[able]
    asked, effective = [], []
    for k in range(rigs):
        noisy = said[k] + rng.standard_normal(said.shape[1])
        weight = _weight(said[rigs:], noisy)
        effective.append(1 / float((weight**2).sum()))
        asked.append(quantiles[[k, *(rigs + rng.choice(weight.size, DRAWS, p=weight))]])
    mapper = map if pool is None else pool.map
    found = list(mapper(partial(_inside, base, model), asked))
    return Recovery({name: np.array([one[name] for one in found]) for name in found[0]}, np.array(effective))


def _said(base: Rig, model: MechanismSet, reading: str, quantiles: Floats) -> Floats:
    """Numbers and margins of a rig over their errors, shape (8,); NaN where it does not follow the drive."""
    try:
        loops = loops_of(with_constants(base, model.chosen(quantiles)))
    except (RigError, SolverError):
        return np.full(2 * _NUMBERS, np.nan)
    found = residuals(loops, reading)
    full = sum(found[FULL]) / np.sqrt(2)  # two ends, one statement
    return np.array([full, *found[W10], *found[W20], *found[SAME], *margins_of(loops)])


def _weight(said: Floats, noisy: Floats) -> Floats:
    """Weights of rigs by what a hidden one stated, shape (n,): numbers, and words as signs of the margins."""
    numbers = -0.5 * ((said[:, :_NUMBERS] - noisy[:_NUMBERS]) ** 2).sum(axis=1)
    words = log_ndtr(said[:, _NUMBERS:] * np.sign(noisy[_NUMBERS:])).sum(axis=1)
    weight = np.exp(numbers + words - (numbers + words).max())
    return np.asarray(weight / weight.sum())


def _inside(base: Rig, model: MechanismSet, quantiles: Floats) -> dict[str, bool]:
    """Whether the first rig lies between the others, in every constant and prediction."""
    values = dict(zip(model.names, quantiles.T, strict=True))
    rigs = [with_constants(base, model.chosen(row)) for row in quantiles]
    at_10N = [static_loop(replace(rig, preload_N=10.0), 1.1).width_deg.max() for rig in rigs]
    values |= {"width at 1.1 mm, 10 N, deg": np.array(at_10N), **predicted_shares(rigs, threads=1)}
    values.pop("play, share of energy", None)  # none, by its law
    rank = {name: int((one[1:] < one[0]).sum()) for name, one in values.items()}
    return {name: 0 < at < DRAWS for name, at in rank.items()}
