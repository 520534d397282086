"""Decide what a record shows: is there an effect, which, is there another one beside it, and what is left."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass, replace
from typing import Literal

import numpy as np
from threadpoolctl import threadpool_limits

from fem_models.rig import RigError
from fem_models.rig.checks import SolverError
from validation.tracing.baseline.known_rig import KnownRigProblem
from validation.tracing.effect import Effect, acting, catalogue
from validation.tracing.fitting.fitted import Fitted
from validation.tracing.fitting.folds import Estimate, share
from validation.tracing.fitting.least_squares import fit
from validation.tracing.fitting.model import Model
from validation.tracing.inference.chance import SIMULATIONS, Chance, chance_of
from validation.tracing.inference.discrepancy import linearised
from validation.tracing.inference.front_runners import FrontRunner, front_runners_of, left_deg
from validation.tracing.inference.leftover import leftover_deg
from validation.tracing.inference.priors import DiscrepancyPrior, discrepancy_priors
from validation.tracing.inference.relevance import Grid, relevant_grid
from validation.tracing.inference.shapes import Shape, shapes_beside, with_fits
from validation.tracing.outcome import Trace
from validation.tracing.plausibility import implausible
from validation.tracing.search.race import raced
from validation.tracing.search.search import Progress
from validation.tracing.settings import CONTAINED_TOLERANCE, MOST_ALIKE, MOST_EFFECTS, POLICIES
from validation.tracing.verdict import without_effects

DecisionVerdict = Literal["none", "effect", "partial", "ambiguous", "unexplained"]
ALPHA = 0.05
NO_CLAIM, LIKE_CHANCE = 2.0, 0.5
"""p by the shapes of the starts above which no effect is fitted: over alpha where no more is left than clean rigs
leave, and whatever is left."""
EARLY_SIMULATIONS = 199


@dataclass(frozen=True)
class Compared:
    """A model with effects: its own p, how far its score is behind, and the share of the error that it explains.

    ``within`` as of :class:`validation.tracing.inference.front_runners.FrontRunner`.
    """

    fitted: Fitted
    p: float
    within: bool
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
    baseline
        The model without effects beside which they were tested.
    best
        The best model: the baseline where nothing is claimed.
    compared
        Models with as many effects that were fitted, the best first.
    shown
        Fits that leave less than all of these, with parameters that make no sense.
    discrepancy_deg
        What the best model leaves above the noise of the sensor, rms.
    leaves_more
        Whether that is more than clean rigs leave.
    statistics, critical
        T of each first effect, and its values that chance reaches in 0.01, 0.05 and 0.2 of the draws.
    decides
        Whether the verdict of the trace is this one.
    """

    alpha: float
    p_none: float
    simulations: int
    verdict: DecisionVerdict
    baseline: Fitted
    best: Fitted
    compared: tuple[Compared, ...]
    shown: tuple[Fitted, ...]
    discrepancy_deg: float
    leaves_more: bool
    statistics: Mapping[str, float]
    critical: Mapping[float, float]
    decides: bool = False

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
        return tuple(one.names for one in self.compared if one.p > self.alpha or one.within) if self.claimed else ()

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
    """Test of one more effect beside a model, and the models with one that were fitted, the best first.

    ``shown`` are fits that leave less, with parameters that make no sense.
    """

    grid: Grid
    chance: Chance
    found: Sequence[FrontRunner]
    shown: Sequence[Fitted]


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
    most_effects: int
    race: bool
    report: Progress


def decide(
    trace: Trace,
    *,
    effects: Sequence[Effect] | None = None,
    alpha: float = ALPHA,
    seed: int = 0,
    threads: int = 1,
    most_effects: int = MOST_EFFECTS,
    race: bool = True,
    report: Progress | None = None,
) -> Decision | None:
    """Decide what the records of a trace show beside its baseline.

    ``effects`` are those that are tried, by default the whole catalogue; ``report`` is called before every one that is
    fitted. Without a ``race`` the fits of the trace's search are compared, those with one effect: in a second or two. A
    further effect is looked for as long as more is left than clean rigs leave, and named where that ends it.
    None where the discrepancy of clean rigs has not been learnt for the kind of baseline, where records are compared
    with a reference, or where folds hold out every sample in turn.
    """
    prior = learnt_prior(trace)
    if prior is None or trace.reference or trace.baseline.fold_errors is not None:
        return None
    tried = acting(catalogue() if effects is None else effects, in_space=False)
    told = report or (lambda words, ahead: None)
    most = most_effects if race else 1
    asked = _Asked(trace, prior, tried, alpha, seed, threads, SIMULATIONS, most, race, told)
    with threadpool_limits(1, user_api="blas"):
        first = _stage(asked, trace.baseline)
        better = _better_baseline(asked, first) if race else None
        if better is not None:
            asked = replace(asked, trace=without_effects(POLICIES[trace.model], better))
            first = _stage(asked, better, [one.fitted for one in first.found])
        return _decided(asked, first)


def _decided(asked: _Asked, first: _Stage) -> Decision:
    """Look for further effects after the first, and judge the residual."""
    baseline, alpha = asked.trace.baseline, asked.alpha
    last, best, left = found = first, baseline, _left_of(asked, first, None)
    while len(best.names) < asked.most_effects:
        stage = first if best is baseline else _stage(asked, best)
        if stage.chance.p > alpha or not stage.found:
            break
        if stage is not first and len(_in_set(stage.found, alpha)) > 1:  # a further effect that is told apart
            break
        last, best = stage, stage.found[0].fitted
        left = _left_of(asked, last, last.found[0])
        found = (last, best, left) if last is first else found
        if not _is_more(asked, left):
            break
    if _is_more(asked, left):  # further effects that take a part may take what the baseline lacks
        last, best, left = found
    compared, more = tuple(_compared(asked.trace, one) for one in last.found), _is_more(asked, left)
    return Decision(
        alpha=alpha,
        p_none=first.chance.p,
        simulations=asked.simulations,
        verdict=_verdict(
            [one.p > alpha or one.within for one in compared],
            claimed=first.chance.p <= alpha,
            more=more,
            most=best is not baseline and _explains_most(baseline, best, left),
        ),
        baseline=asked.trace.baseline,
        best=best,
        compared=compared,
        shown=tuple(last.shown),
        discrepancy_deg=left,
        leaves_more=more,
        statistics=first.chance.statistics,
        critical=first.chance.critical,
    )


def _better_baseline(asked: _Asked, first: _Stage) -> Fitted | None:
    """Fit the baseline again from its parameters beside the best effect; None where that is no better."""
    if first.chance.p > asked.alpha or not first.found:
        return None
    before, best = asked.trace.baseline, first.found[0].fitted
    model = Model(before.model.problem)
    with suppress(SolverError, RigError):
        found = fit(model, before.holdout, best.x[: model.baseline_size], threads=asked.threads)
        return found if found.train_square < (1 - CONTAINED_TOLERANCE) * before.train_square else None
    return None


def learnt_prior(trace: Trace) -> DiscrepancyPrior | None:
    """Give the prior of the kind of baseline; that of known rigs is learnt of one plane and a drive in mm alone."""
    problem = trace.baseline.model.problem
    in_mm = isinstance(problem, KnownRigProblem) and "drive in mm" in problem.setup.needs
    return discrepancy_priors().get(trace.model) if in_mm or not trace.known else None


def _stage(asked: _Asked, base: Fitted, known: Sequence[Fitted] = ()) -> _Stage:
    """Test whether there is one more effect than those of a model, and compare all models that have it.

    Where the shapes of the starts do not look like chance, all effects race, and what their fits change joins these
    shapes: of the records and of the draws alike. So they do where more is left than clean rigs leave, before this is
    called unexplained. ``known`` are fits with one more effect that were made already.
    """
    shapes = shapes_beside(base, asked.effects, asked.threads)
    early = max(EARLY_SIMULATIONS, math.ceil(2.0 / asked.alpha))  # enough for a p that asks for the race
    grid, chance = _tested(asked, base, shapes, min(early, asked.simulations))
    fits, shown = list[Fitted](), list[Fitted]()
    most = LIKE_CHANCE if _is_more(asked, _left_beside(asked, grid, chance)) else NO_CLAIM * asked.alpha
    if asked.race and chance.p > most and asked.simulations > early:
        chance = chance_of(grid, seed=asked.seed, simulations=asked.simulations)
    if not asked.race:
        fits = [one for one in _searched(asked.trace, base) if not implausible(one)]
        grid, chance = _tested(asked, base, with_fits(shapes, base, fits), asked.simulations)
    elif chance.p <= most:
        names = {one.effect for one in shapes}
        effects = [effect for effect in asked.effects if effect.name in names]
        every = raced(base, effects, asked.threads, asked.report, known)
        fits = [one for one in every if not implausible(one)]
        shown = every[: every.index(fits[0])] if fits else every[:1]
        grid, chance = _tested(asked, base, with_fits(shapes, base, fits), asked.simulations)
    found = front_runners_of(grid, fits, seed=asked.seed, simulations=asked.simulations)
    return _Stage(grid, chance, found, shown)


def _searched(trace: Trace, base: Fitted) -> list[Fitted]:
    """Fits of the search with one more effect than those of a model."""
    every = [one.fitted for one in trace.candidates]
    return [one for one in every if {*base.names} < {*one.names} and len(one.names) == len(base.names) + 1]


def _in_set(found: Sequence[FrontRunner], alpha: float) -> list[FrontRunner]:
    """Models that the record does not tell from the best one."""
    return [one for one in found if one.p > alpha or one.within]


def _tested(asked: _Asked, base: Fitted, shapes: Sequence[Shape], simulations: int) -> tuple[Grid, Chance]:
    grid = relevant_grid(linearised(base, shapes), asked.prior)
    return grid, chance_of(grid, seed=asked.seed, simulations=simulations)


def _left_of(asked: _Asked, stage: _Stage, best: FrontRunner | None) -> float:
    """Measure what the best model of a stage leaves above the noise, deg, or that beside which it tests."""
    return _left_beside(asked, stage.grid, stage.chance) if best is None else left_deg(stage.grid, best)


def _left_beside(asked: _Asked, grid: Grid, chance: Chance) -> float:
    return leftover_deg(grid.linear, chance.covariance, chance.noise_deg, asked.trace.floor.unrepeated_deg)


def _is_more(asked: _Asked, left_deg: float) -> bool:
    """Whether more is left than clean rigs leave."""
    half_range = max(float(np.ptp(one.angle_deg)) for one in asked.trace.baseline.model.problem.records) / 2
    return left_deg > asked.prior.leftover * half_range


def _explains_most(baseline: Fitted, best: Fitted, left_deg: float) -> bool:
    """Whether effects explain more of the mean square of the training samples than they leave above the noise."""
    return baseline.train_rmse_deg**2 - best.train_rmse_deg**2 > left_deg**2


def _verdict(in_set: Sequence[bool], *, claimed: bool, more: bool, most: bool) -> DecisionVerdict:
    """Verdict from which models are in the set, whether more is left than clean rigs leave, and most is explained."""
    if not claimed:
        return "unexplained" if more else "none"
    if not 0 < sum(in_set) <= 1 + MOST_ALIKE or (more and not most):
        return "unexplained"
    return "partial" if more else "effect" if sum(in_set) == 1 else "ambiguous"


def _compared(trace: Trace, one: FrontRunner) -> Compared:
    before, after = trace.baseline.heldout_errors, one.fitted.heldout_errors
    return Compared(one.fitted, one.p, one.within, one.behind, share(before, after, trace.floor.deg))
