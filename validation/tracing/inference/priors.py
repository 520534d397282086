"""How much clean rigs differ from their models: learnt on rigs of other makes, for each kind of baseline."""

from __future__ import annotations

import tomllib
from dataclasses import dataclass
from functools import cache
from pathlib import Path

import numpy as np

from hysteresis.arrays import Floats
from validation.tracing.settings import BaselineName

LEARNT = Path(__file__).with_name("discrepancy.toml")
TWO_SIDED_95 = 1.96
"""Standard deviations within which 95 % of a normal distribution lie."""


@dataclass(frozen=True)
class DiscrepancyPrior:
    """Standard deviation of the discrepancy in the shapes of the effects, over half the range of the angle.

    It is log-normal over rigs.

    Parameters
    ----------
    median
        Of the rigs it was learnt on.
    spread
        Standard deviation of its natural logarithm over rigs.
    spread_of_effects
        The same over the effects of one rig: a clean rig mimics some effects far more than others.
    leftover
        What 95 % of the clean rigs leave at most: discrepancy and noise above the sensor's, rms, over half the range.
    """

    median: float
    spread: float
    spread_of_effects: float
    leftover: float

    def log_density(self, scale: Floats) -> Floats:
        """Logarithm of the density of log(scale), less that of the median."""
        return np.asarray(-0.5 * (np.log(scale / self.median) / self.spread) ** 2)

    def log_density_of_smooth(self, size: Floats) -> Floats:
        """Logarithm of the density of the rms of all smooth functions, half normal, less that of none."""
        return np.asarray(-0.5 * (TWO_SIDED_95 * size / self.leftover) ** 2)


@cache
def discrepancy_priors() -> dict[BaselineName, DiscrepancyPrior]:
    """Priors by kind of baseline; a kind without one has not been learnt."""
    stored = tomllib.loads(LEARNT.read_text(encoding="utf-8"))
    return {
        name: DiscrepancyPrior(one["median"], one["spread"], one["spread_of_effects"], one["leftover"])
        for name, one in stored["kinds"].items()
    }
