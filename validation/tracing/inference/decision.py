"""Decide what a record shows: is there an effect, which, is there another one beside it, and what is left."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Literal

import numpy as np
from threadpoolctl import threadpool_limits

from validation.tracing.baseline.known_rig import KnownRigProblem
from validation.tracing.effect import Effect, acting, catalogue
from validation.tracing.fitting.fitted import Fitted
from validation.tracing.fitting.folds import Estimate, share
from validation.tracing.inference.chance import SIMULATIONS, Chance, chance_of
from validation.tracing.inference.discrepancy import linearised, tangent_of
from validation.tracing.inference.front_runners import FrontRunner, front_runners_of
from validation.tracing.inference.leftover import leftover_deg
from validation.tracing.inference.priors import DiscrepancyPrior, discrepancy_priors
from validation.tracing.inference.relevance import Grid, relevant_grid
from validation.tracing.inference.shapes import Shape, shapes_beside, with_fits
from validation.tracing.outcome import Trace
from validation.tracing.plausibility import implausible
from validation.tracing.search.race import raced
from validation.tracing.settings import MOST_EFFECTS

DecisionVerdict = Literal["none", "effect", "partial", "ambiguous", "unexplained"]
ALPHA = 0.05
MOST_RACED = 5
"""Effects with the largest statistics that are fitted in earnest, beside those that leave least in the search."""
NO_CLAIM = 0.3
"""p by the fits of the search from which no effect is fitted further: nothing will be claimed."""
EARLY_SIMULATIONS = 199


@dataclass(frozen=True)
class Compared:
    """A model with effects: its own p, how far its score is behind, and the share of the error that it takes."""

    fitted: Fitted
    p: float
    behind: float
    explained: Estimate

    @property
    def names(self) -> tuple[str, ...]:
        """Effects that it has."""
        return self.fitted.names


@dataclass(frozen=True)
class Decision:
    """What a record shows.

    Parameters
    ----------
    alpha
        Probability of a claim on records without an effect, as far as they are of the simulated kind.
    p_none
        How often chance would look as much like an effect.
    simulations
        Draws behind each p.
    best
        The best model: the baseline where nothing is claimed.
    compared
        Models with as many effects that were fitted, the best first.
    discrepancy_deg
        What the best model leaves above the noise of the sensor, rms.
    statistics, critical
        T of each first effect, and its values that chance reaches in 0.01, 0.05 and 0.2 of the draws.
    """

    alpha: float
    p_none: float
    simulations: int
    verdict: DecisionVerdict
    best: Fitted
    compared: tuple[Compared, ...]
    discrepancy_deg: float
    statistics: Mapping[str, float]
    critical: Mapping[float, float]

    @property
    def claimed(self) -> bool:
        """Whether there is an effect."""
        return self.p_none <= self.alpha

    @property
    def names(self) -> tuple[str, ...]:
        """Effects of the best model."""
        return self.compared[0].names if self.claimed and self.compared else ()

    @property
    def not_distinguished(self) -> tuple[tuple[str, ...], ...]:
        """Effects of the models that the record does not tell apart, the best first; empty where nothing is claimed."""
        return tuple(one.names for one in self.compared if one.p > self.alpha) if self.claimed else ()

    @property
    def confusable(self) -> tuple[tuple[str, ...], ...]:
        """For each effect that is named, those that may be in its place."""
        others = [dict.fromkeys(names) for names in self.not_distinguished[1:]]
        out = list[tuple[str, ...]]()
        for own in self.names:
            rest = {*self.names} - {own}
            out.append(tuple(name for names in others if rest <= {*names} for name in names if name not in self.names))
        return tuple(tuple(dict.fromkeys(names)) for names in out)

    def p_of(self, name: str) -> float | None:
        """Give the p of the best model with an effect; None where there is none among those that were compared."""
        return next((one.p for one in self.compared if name in one.names), None)


@dataclass(frozen=True, eq=False)
class _Stage:
    """Test of one more effect beside a model, and the models with one that were fitted, the best first."""

    grid: Grid
    chance: Chance
    found: Sequence[FrontRunner]


@dataclass(frozen=True, eq=False)
class _Asked:
    """What is decided, and how."""

    trace: Trace
    prior: DiscrepancyPrior
    effects: Sequence[Effect]
    alpha: float
    seed: int
    threads: int
    simulations: int
    race: bool


def decide(
    trace: Trace,
    *,
    effects: Sequence[Effect] | None = None,
    alpha: float = ALPHA,
    seed: int = 0,
    threads: int = 1,
    simulations: int = SIMULATIONS,
    race: bool = True,
) -> Decision | None:
    """Decide what the records of a trace show, from the fits of its search and those of a race.

    ``effects`` are those that are tried, by default the whole catalogue. A further effect is looked for as long as more
    is left than clean rigs leave, and named where that ends it. Without a ``race``, which takes several times as long
    as the rest, the fits of the search alone are compared, with one effect each. None where the discrepancy of clean
    rigs has not been learnt for the kind of baseline, where records are compared with a reference, or where folds hold
    out every sample in turn.
    """
    prior, baseline = learnt_prior(trace), trace.baseline
    if prior is None or trace.reference or baseline.fold_errors is not None:
        return None
    tried = acting(catalogue() if effects is None else effects, in_space=False)
    asked = _Asked(trace, prior, tried, alpha, seed, threads, simulations, race)
    with threadpool_limits(1, user_api="blas"):
        first = _stage(asked, baseline)
        last, best, left = found = first, baseline, _left_of(asked, first, None)
        while len(best.names) < (MOST_EFFECTS if race else 1):
            stage = first if best is baseline else _stage(asked, best)
            if stage.chance.p > alpha or not stage.found:
                break
            last, best = stage, stage.found[0].fitted
            left = _left_of(asked, last, last.found[0])
            found = (last, best, left) if last is first else found
            if not _is_more(asked, left):
                break
        if _is_more(asked, left):  # further effects that take a part may take what the baseline lacks
            last, best, left = found
    p_none = first.chance.p
    compared = tuple(_compared(trace, one) for one in last.found)
    return Decision(
        alpha=alpha,
        p_none=p_none,
        simulations=simulations,
        verdict=_verdict([one.p > alpha for one in compared], claimed=p_none <= alpha, more=_is_more(asked, left)),
        best=best,
        compared=compared,
        discrepancy_deg=left,
        statistics=first.chance.statistics,
        critical=first.chance.critical,
    )


def learnt_prior(trace: Trace) -> DiscrepancyPrior | None:
    """Give the prior of the kind of baseline; that of known rigs is learnt of one plane and a drive in mm alone."""
    problem = trace.baseline.model.problem
    in_mm = isinstance(problem, KnownRigProblem) and "drive in mm" in problem.setup.needs
    return discrepancy_priors().get(trace.model) if in_mm or not trace.known else None


def _stage(asked: _Asked, base: Fitted) -> _Stage:
    """Test whether there is one more effect than those of a model, and compare all models that have it.

    Where the fits of the search do not look like chance, the effects with the largest statistics are fitted in earnest,
    and what they change joins the shapes of their starts: of the records and of the draws alike.
    """
    shapes = shapes_beside(base, asked.effects, asked.threads)
    known = [one for one in _searched(asked.trace, len(base.names) + 1) if {*base.names} < {*one.names}]
    grid, chance = _tested(asked, base, with_fits(shapes, base, known), min(EARLY_SIMULATIONS, asked.simulations))
    if asked.race and chance.p <= NO_CLAIM:
        leading = sorted(chance.statistics, key=lambda name: -chance.statistics[name])[:MOST_RACED]
        names = {*leading, *(_added(base, one) for one in known[:MOST_RACED])}
        effects = [effect for effect in asked.effects if effect.name in names]
        known = _plausible(raced(base, effects, known, asked.threads))
        shapes = with_fits(shapes, base, known)
        grid, chance = _tested(asked, base, shapes, asked.simulations)
    elif asked.simulations > EARLY_SIMULATIONS:
        chance = chance_of(grid, seed=asked.seed, simulations=asked.simulations)
    others = [one for one in _searched(asked.trace, len(base.names) + 1) if not {*base.names} < {*one.names}]
    found = front_runners_of(grid, [*known, *others], seed=asked.seed, simulations=asked.simulations)
    return _Stage(grid, chance, found)


def _tested(asked: _Asked, base: Fitted, shapes: Sequence[Shape], simulations: int) -> tuple[Grid, Chance]:
    grid = relevant_grid(linearised(base, shapes), asked.prior)
    return grid, chance_of(grid, seed=asked.seed, simulations=simulations)


def _added(base: Fitted, fitted: Fitted) -> str:
    """Name the effect that a model has more than another."""
    return next(name for name in fitted.names if name not in base.names)


def _searched(trace: Trace, count: int) -> list[Fitted]:
    """Give the models of a search with so many effects, the best fit of each, where their parameters make sense."""
    own = sorted((c.fitted for c in trace.candidates if len(c.names) == count), key=lambda one: one.train_square)
    best = dict[frozenset[str], Fitted]()
    for one in _plausible(one for one in own if np.isfinite(one.train_square)):
        best.setdefault(frozenset(one.names), one)
    return [*best.values()]


def _plausible(fits: Iterable[Fitted]) -> list[Fitted]:
    return [one for one in fits if not implausible(one)]


def _left_of(asked: _Asked, stage: _Stage, best: FrontRunner | None) -> float:
    """Measure what the best model of a stage leaves above the noise, deg, or that beside which it tests.

    What one cycle differs from the next counts as noise where the floor is from that.
    """
    floor = asked.trace.floor
    linear, sensor = stage.grid.linear, floor.deg if floor.by_repeats else floor.sensor_deg
    if best is None:
        return leftover_deg(linear, stage.chance.covariance, stage.chance.noise_deg, sensor)
    rows = best.fitted.rows
    own = replace(linear, residual=-rows.errors[rows.train], tangent=tangent_of(best.fitted))
    return leftover_deg(own, best.covariance, best.noise_deg, sensor)


def _is_more(asked: _Asked, left_deg: float) -> bool:
    """Whether more is left than clean rigs leave."""
    half_range = max(float(np.ptp(one.angle_deg)) for one in asked.trace.baseline.model.problem.records) / 2
    return left_deg > asked.prior.leftover * half_range


def _verdict(in_set: Sequence[bool], *, claimed: bool, more: bool) -> DecisionVerdict:
    """Verdict from which models are in the set, and whether more is left than clean rigs leave."""
    if not claimed:
        return "unexplained" if more else "none"
    if not any(in_set):
        return "unexplained"
    return "partial" if more else "effect" if sum(in_set) == 1 else "ambiguous"


def _compared(trace: Trace, one: FrontRunner) -> Compared:
    before, after = trace.baseline.heldout_errors, one.fitted.heldout_errors
    return Compared(one.fitted, one.p, one.behind, share(before, after, trace.floor.deg))
