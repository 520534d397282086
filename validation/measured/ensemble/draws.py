"""What the paper's facts say of the constants of du2018 that they do not fix: draws from the priors, with weights.

Three constants follow from the three numbers (:mod:`validation.measured.ensemble.solve`); the others are drawn from
their priors. The weight of a draw is the density of the priors of the solved constants over |d numbers/d ln constants|:
the integral of prior and facts over the three, for numbers that are known far better than the constants. The full
scale, known to half a degree only, is one more drawn number. The mean of the weights is the evidence of the model. The
place of the widest point is a condition that draws meet or not.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable
from dataclasses import dataclass

import numpy as np
from scipy.stats import qmc

from fem_models.rig import Rig
from hysteresis.arrays import Floats, Mask
from validation.measured.ensemble.facts import FULL_SCALE_RESOLUTION_DEG, PAPER, PLACE_RESOLUTION_MM, Facts
from validation.measured.ensemble.priors import Model
from validation.measured.ensemble.solve import solve_constants

FACT_COLUMNS = ("full_scale_deg", "width_10N_deg", "width_20N_deg", "widest_at_10N_mm", "widest_at_20N_mm")
Mapper = Callable[[Callable[[Floats], Floats], Iterable[Floats]], Iterable[Floats]]
"""``map``, or that of a pool of workers."""


class Density:
    """Density of the facts' numbers at quantiles of the drawn constants; callable in other processes too.

    The last quantile is that of the full scale.
    """

    def __init__(self, base: Rig, model: Model, goal: Facts = PAPER) -> None:
        self.base, self.model, self.goal = base, model, goal

    @property
    def size(self) -> int:
        """Number of quantiles."""
        return len(self.model.drawn) + 1

    @property
    def columns(self) -> tuple[str, ...]:
        """Names of what a row holds: the logarithm of the density, all constants, the facts."""
        return ("log_density", *self.model.drawn, *self.model.solved, *FACT_COLUMNS)

    def chosen(self, quantiles: Floats) -> dict[str, float]:
        """Drawn constants at quantiles of their priors, and the fixed ones."""
        pairs = zip(self.model.drawn, quantiles, strict=False)
        return {name: float(self.model.priors[name].at(q)) for name, q in pairs} | dict(self.model.fixed)

    def __call__(self, quantiles: Floats) -> Floats:
        """Row of :attr:`columns`; -inf for the logarithm where no rig shows the numbers, or beyond the priors."""
        if not ((quantiles >= 0) & (quantiles <= 1)).all():
            return np.append(-np.inf, np.full(len(self.columns) - 1, np.nan))
        chosen = self.chosen(quantiles)
        full = self.goal.full_scale_deg + (2 * float(quantiles[-1]) - 1) * FULL_SCALE_RESOLUTION_DEG
        found = solve_constants(self.base, chosen, self.model, Facts(full, self.goal.widths_deg, (0.0, 0.0)))
        drawn = [chosen[name] for name in self.model.drawn]
        if found is None:
            return np.array([-np.inf, *drawn, *[np.nan] * (len(self.columns) - 1 - len(drawn))])
        prior = sum(self.model.priors[name].log_density_per_log(v) for name, v in found.constants.items())
        facts = found.facts
        numbers = (facts.full_scale_deg, *facts.widths_deg, *facts.widest_at_mm)
        return np.array([prior - math.log(found.determinant), *drawn, *found.constants.values(), *numbers])


@dataclass(frozen=True)
class Draws:
    """Draws of one model: quantiles, shape (n, p), and rows of :attr:`Density.columns`, shape (n, c)."""

    quantiles: Floats
    rows: Floats
    columns: tuple[str, ...]

    def column(self, name: str) -> Floats:
        """One column, shape (n,)."""
        return np.asarray(self.rows[:, self.columns.index(name)])

    @property
    def weight(self) -> Floats:
        """Density of each draw, shape (n,), not normalised; 0 where no rig shows the numbers."""
        return np.exp(self.column("log_density"))

    @property
    def place_met(self) -> Mask:
        """Draws whose loops are both widest near zero drive, shape (n,)."""
        places = np.abs(self.rows[:, -2:])
        return np.asarray((places <= PLACE_RESOLUTION_MM + 1e-9).all(axis=1))

    @property
    def evidence(self) -> tuple[float, float]:
        """Density of the three numbers, per deg^2 of the widths, and its standard error."""
        box = 2 * FULL_SCALE_RESOLUTION_DEG
        return box * float(self.weight.mean()), box * float(self.weight.std() / math.sqrt(self.weight.size))

    @property
    def place_share(self) -> tuple[float, float]:
        """Probability of the place of the widest point, given the three numbers, and its standard error."""
        share = self.weight / self.weight.sum()
        met = float(share[self.place_met].sum())
        return met, float(np.sqrt((share**2 * (self.place_met - met) ** 2).sum()))

    @property
    def effective(self) -> float:
        """Number of equally weighted draws that would say as much as those that meet all facts; 0 for none."""
        return _equally_weighted(self.weight * self.place_met)

    @property
    def effective_of_numbers(self) -> float:
        """The same of the draws that show the three numbers, wherever the loops are widest."""
        return _equally_weighted(self.weight)

    @property
    def places_mm(self) -> tuple[tuple[float, ...], tuple[float, ...]]:
        """Quantiles of 5, 50 and 95 % of the drive's magnitude where the loops of 10 and 20 N are widest, mm."""
        low, high = (weighted_quantiles(np.abs(x), self.weight, (0.05, 0.5, 0.95)) for x in self.rows[:, -2:].T)
        return low, high


def _equally_weighted(weight: Floats) -> float:
    """Effective sample size of weights (Kish 1965, Survey Sampling, section 11.7); 0 of none."""
    return float(weight.sum() ** 2 / (weight**2).sum()) if weight.any() else 0.0


def weighted_quantiles(values: Floats, weight: Floats, at: tuple[float, ...]) -> tuple[float, ...]:
    """Quantiles of weighted values, shapes (n,); values without weight do not count."""
    known = weight > 0
    order = np.argsort(values[known])
    part = np.cumsum(weight[known][order])
    return tuple(float(values[known][order][np.searchsorted(part, q * part[-1])]) for q in at)


def draw(base: Rig, model: Model, count: int, seed: int, *, goal: Facts = PAPER, mapper: Mapper = map) -> Draws:
    """Draw from the priors by a scrambled Sobol sequence; the same draws for a seed, whatever maps them.

    Parameters
    ----------
    count
        Number of draws, a power of two.
    goal
        Facts that the rigs are to show.

    Raises
    ------
    ValueError
        No draw shows the numbers.
    """
    density = Density(base, model, goal)
    quantiles = qmc.Sobol(density.size, rng=np.random.default_rng(seed)).random(count)
    rows = np.array(list(mapper(density, quantiles)))
    if not np.isfinite(rows[:, 0]).any():
        raise ValueError(f"{count} draws: none shows the numbers: expected at least one")
    return Draws(quantiles, rows, density.columns)
