"""Draws of a rig's constants from what the paper's static statements say, by nautilus.

The likelihood is that of the statements, each with its own error (:mod:`validation.measured.readings.statements`); the
tests at 1 Hz are left out. nautilus draws from regions that neural networks find, and weights what it draws, so that
the draws are independent, and their weights give the evidence (Lange 2023, doi 10.1093/mnras/stad2441).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Protocol

import numpy as np

from fem_models.rig import Rig, RigError
from fem_models.rig.checks import SolverError
from fem_models.rig.ensemble import with_constants
from hysteresis.arrays import Floats
from validation.measured.ensemble.priors import MechanismSet
from validation.measured.readings.loops import loops_of
from validation.measured.readings.statements import STATIC_SIZE, residual_vector

IMPOSSIBLE = -1e5
"""Logarithm of the likelihood of a rig that does not follow the drive."""
BATCH = 128
"""Rigs that are drawn at once: fixed, so that draws are the same on every machine."""


@dataclass(frozen=True)
class LogLikelihood:
    """Logarithm of the likelihood of the static statements at quantiles of a model's constants, shape (p,)."""

    base: Rig
    model: MechanismSet
    reading: str

    def __call__(self, quantiles: Floats) -> float:
        """Run the rig's loops."""
        try:
            loops = loops_of(with_constants(self.base, self.model.chosen(quantiles)))
        except (RigError, SolverError):
            return IMPOSSIBLE
        row = residual_vector(loops, self.reading)[:STATIC_SIZE]
        return -0.5 * float(row @ row)


@dataclass(frozen=True)
class Posterior:
    """Weighted draws of one run: quantiles of the priors, shape (n, p), and weights that add up to 1, shape (n,).

    ``log_evidence`` is the logarithm of the mean likelihood over the priors, ``runs`` the number of rigs that were run.
    """

    quantiles: Floats
    weight: Floats
    log_evidence: float
    runs: int

    @property
    def effective(self) -> float:
        """Number of equally weighted draws that would say as much (Kish 1965, Survey Sampling, section 11.7)."""
        return 1 / float((self.weight**2).sum())

    def resampled(self, count: int, seed: int) -> Floats:
        """Give draws of equal weight, shape (count, p), in an order by chance."""
        rng = np.random.default_rng(seed)
        at = np.searchsorted(np.cumsum(self.weight), (np.arange(count) + rng.random()) / count)
        return self.quantiles[rng.permutation(np.minimum(at, self.weight.size - 1))]


class Likelihood(Protocol):
    """Logarithm of a likelihood at quantiles of the priors of a model's constants."""

    @property
    def model(self) -> MechanismSet:
        """The constants."""

    def __call__(self, quantiles: Floats) -> float:
        """Give it at quantiles, shape (p,)."""


def sample(likelihood: Likelihood, *, live: int, effective: int, seed: int) -> Posterior:
    """Draw until there are so many effective draws, with so many live points; the same draws for a seed."""
    from nautilus import Sampler  # needed where members are made; they are shipped

    size = len(likelihood.model.names)
    sampler = Sampler(
        _same, likelihood, n_dim=size, n_live=live, n_networks=1, n_batch=BATCH, seed=seed, pass_dict=False
    )
    sampler.run(n_eff=effective, discard_exploration=True)
    points, log_weight, _ = sampler.posterior()
    return Posterior(points, np.exp(log_weight), float(sampler.log_z), int(sampler.n_like))


def _same(quantiles: Floats) -> Floats:
    return quantiles


def r_hat(runs: Sequence[Floats]) -> float:
    """Largest R-hat of a quantile over runs of as many draws, shapes (n, p).

    Gelman et al., Bayesian Data Analysis, 2013, section 11.4, each run being a chain.
    """
    chains = np.stack(runs, axis=1)
    within = chains.var(axis=0, ddof=1).mean(axis=0)
    between = chains.mean(axis=0).var(axis=0, ddof=1)
    count = chains.shape[0]
    return float(np.sqrt((count - 1) / count + between / within).max())
