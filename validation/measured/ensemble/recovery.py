"""Whether the ranges keep what they promise: statements of hidden rigs, drawn from the priors, in place of the paper's.

A hidden rig states numbers and words with the errors of the paper's. Its constants are drawn from what it states as the
members of the ensemble are from the paper. If the draws are right, the hidden value is as likely to have any rank
among them (Talts et al. 2018, arXiv 1804.06788).
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from scipy.special import log_ndtr

from fem_models.rig import Rig, RigError
from fem_models.rig.checks import SolverError
from fem_models.rig.ensemble import with_constants
from hysteresis.arrays import Floats
from validation.measured.ensemble.posterior import IMPOSSIBLE, sample
from validation.measured.ensemble.predict import predicted_shares
from validation.measured.ensemble.priors import MechanismSet
from validation.measured.readings.loops import loops_of, static_loop
from validation.measured.readings.statements import FULL, SAME, W10, W20, margins_of, residuals

DRAWS = 39
"""Draws of each hidden rig: it lies beyond all of them with 5 %."""
_NUMBERS = 4


@dataclass(frozen=True)
class HiddenLikelihood:
    """Logarithm of the likelihood of what a hidden rig stated: numbers over their errors, and words as signs."""

    base: Rig
    model: MechanismSet
    reading: str
    stated: tuple[float, ...]

    def __call__(self, quantiles: Floats) -> float:
        """Run the rig's loops; ``quantiles`` of the priors, shape (p,)."""
        said = said_by(self.base, self.model, self.reading, quantiles)
        if said is None:
            return IMPOSSIBLE
        off = said[:_NUMBERS] - self.stated[:_NUMBERS]
        words = log_ndtr(said[_NUMBERS:] * np.sign(self.stated[_NUMBERS:]))
        return float(words.sum() - 0.5 * off @ off)


def said_by(base: Rig, model: MechanismSet, reading: str, quantiles: Floats) -> Floats | None:
    """Numbers and margins of a rig over their errors, shape (8,); None where it does not follow the drive."""
    try:
        loops = loops_of(with_constants(base, model.chosen(quantiles)))
    except (RigError, SolverError):
        return None
    found = residuals(loops, reading)
    full = sum(found[FULL]) / np.sqrt(2)  # two ends, one statement
    return np.array([full, *found[W10], *found[W20], *found[SAME], *margins_of(loops)])


def inside(base: Rig, model: MechanismSet, reading: str, *, seed: int, live: int, effective: int) -> dict[str, bool]:
    """Hide a rig, and say whether it lies between the draws from what it states, in every constant and prediction.

    ``live`` and ``effective`` are points and draws of nautilus.
    """
    rng, said = np.random.default_rng(seed), None
    while said is None:
        hidden = rng.random(len(model.names))
        said = said_by(base, model, reading, hidden)
    stated = said + rng.standard_normal(said.size)
    likelihood = HiddenLikelihood(base, model, reading, tuple(stated.tolist()))
    drawn = sample(likelihood, live=live, effective=effective, seed=seed)
    rows = np.vstack([hidden, drawn.resampled(DRAWS, seed)])
    rigs = [with_constants(base, model.chosen(row)) for row in rows]
    at_10N = [static_loop(replace(rig, preload_N=10.0), 1.1).width_deg.max() for rig in rigs]
    values = dict(zip(model.names, rows.T, strict=True))
    values |= {"width at 1.1 mm, 10 N, deg": np.array(at_10N), **predicted_shares(rigs, threads=1)}
    values.pop("play, share of energy", None)  # none, by its law
    return {name: 0 < int((one[1:] < one[0]).sum()) < DRAWS for name, one in values.items()}
