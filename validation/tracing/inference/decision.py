"""Decide what a record shows, from the fits that a search has made: is there an effect, which, and what is left."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Literal

import numpy as np
from threadpoolctl import threadpool_limits

from validation.tracing.baseline.known_rig import KnownRigProblem
from validation.tracing.effect import acting, catalogue
from validation.tracing.fitting.fitted import Fitted
from validation.tracing.fitting.folds import Estimate, share
from validation.tracing.inference.chance import SIMULATIONS, chance_of
from validation.tracing.inference.discrepancy import linearised, tangent_of
from validation.tracing.inference.leftover import leftover_deg
from validation.tracing.inference.priors import DiscrepancyPrior, discrepancy_priors
from validation.tracing.inference.relevance import relevant_grid
from validation.tracing.inference.rivals import MOST_RIVALS, Rival, rivals_of
from validation.tracing.inference.shapes import shapes_beside
from validation.tracing.outcome import Trace
from validation.tracing.plausibility import implausible

DecisionVerdict = Literal["none", "effect", "partial", "ambiguous", "unexplained"]
ALPHA = 0.05


@dataclass(frozen=True)
class NamedRival:
    """A fitted effect: its name, its own p, how far its score is behind, and the share of the error that it takes."""

    name: str
    p: float
    behind: float
    explained: Estimate


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
    rivals
        Fitted effects, the best first.
    discrepancy_deg
        What the best model leaves above the noise of the sensor, rms.
    statistics, critical
        T of each effect, and its values that chance reaches in 0.01, 0.05 and 0.2 of the draws.
    """

    alpha: float
    p_none: float
    simulations: int
    verdict: DecisionVerdict
    rivals: tuple[NamedRival, ...]
    discrepancy_deg: float
    statistics: Mapping[str, float]
    critical: Mapping[float, float]

    @property
    def claimed(self) -> bool:
        """Whether there is an effect."""
        return self.p_none <= self.alpha

    @property
    def not_distinguished(self) -> tuple[str, ...]:
        """Effects that the record does not tell apart, the best first; empty where nothing is claimed."""
        return tuple(one.name for one in self.rivals if one.p > self.alpha) if self.claimed else ()

    def p_of(self, name: str) -> float | None:
        """Give an effect's own p; None where it was not among the fits that were compared."""
        return next((one.p for one in self.rivals if one.name == name), None)


def decide(
    trace: Trace, *, alpha: float = ALPHA, seed: int = 0, threads: int = 1, simulations: int = SIMULATIONS
) -> Decision | None:
    """Decide what the records of a trace show, by the fits of its search with one effect each.

    None where the discrepancy of clean rigs has not been learnt for the kind of baseline, where records are compared
    with a reference, or where folds hold out every sample in turn.
    """
    prior, baseline = learnt_prior(trace), trace.baseline
    if prior is None or trace.reference or baseline.fold_errors is not None:
        return None
    effects = acting(catalogue(), in_space=False)
    with threadpool_limits(1, user_api="blas"):
        linear = linearised(baseline, shapes_beside(baseline, effects, threads))
        grid = relevant_grid(linear, prior)
        chance = chance_of(grid, seed=seed, simulations=simulations)
        rivals = rivals_of(grid, front_runners(trace), seed=seed, simulations=simulations)
        claimed = chance.p <= alpha
        if claimed and rivals:
            first = rivals[0]
            own = replace(
                linear, residual=-first.fitted.rows.errors[first.fitted.rows.train], tangent=tangent_of(first.fitted)
            )
            left = leftover_deg(own, first.covariance, first.noise_deg, trace.floor.sensor_deg)
        else:
            left = leftover_deg(linear, chance.covariance, chance.noise_deg, trace.floor.sensor_deg)
    more = left > prior.leftover * linear.half_range_deg
    return Decision(
        alpha=alpha,
        p_none=chance.p,
        simulations=simulations,
        verdict=_verdict([one.p > alpha for one in rivals], claimed=claimed, more=more),
        rivals=tuple(_named(trace, one) for one in rivals),
        discrepancy_deg=left,
        statistics=chance.statistics,
        critical=chance.critical,
    )


def learnt_prior(trace: Trace) -> DiscrepancyPrior | None:
    """Give the prior of the kind of baseline; that of known rigs is learnt of one plane and a drive in mm alone."""
    problem = trace.baseline.model.problem
    in_mm = isinstance(problem, KnownRigProblem) and "drive in mm" in problem.setup.needs
    return discrepancy_priors().get(trace.model) if in_mm or not trace.known else None


def front_runners(trace: Trace) -> list[Fitted]:
    """Give the fits with one effect that leave least, the best of each effect, where their parameters make sense."""
    single = sorted((c.fitted for c in trace.candidates if len(c.names) == 1), key=lambda one: one.train_square)
    best = dict[str, Fitted]()
    for one in single:
        if (
            len(best) < MOST_RIVALS
            and one.names[0] not in best
            and np.isfinite(one.train_square)
            and not implausible(one)
        ):
            best[one.names[0]] = one
    return [*best.values()]


def _verdict(in_set: Sequence[bool], *, claimed: bool, more: bool) -> DecisionVerdict:
    """Verdict from which fits are in the set, and whether more is left than clean rigs leave."""
    if not claimed:
        return "unexplained" if more else "none"
    if not any(in_set):
        return "unexplained"
    return "partial" if more else "effect" if sum(in_set) == 1 else "ambiguous"


def _named(trace: Trace, rival: Rival) -> NamedRival:
    before, after = trace.baseline.heldout_errors, rival.fitted.heldout_errors
    return NamedRival(rival.fitted.names[0], rival.p, rival.behind, share(before, after, trace.floor.deg))
