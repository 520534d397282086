"""Final fits to the training samples alone, for errors on the held-out samples.

The search for records of unknown geometry uses all samples: a baseline of which all is free absorbs an effect that only
one amplitude shows, and all records together distinguish the effects.
"""

from __future__ import annotations

from contextlib import suppress
from dataclasses import dataclass, replace

import numpy as np

from fem_models.rig import RigError
from fem_models.rig.checks import SolverError
from hysteresis.arrays import Floats
from validation.tracing.baseline.equivalent_rig import refined_problem
from validation.tracing.fitting.fitted import Fitted
from validation.tracing.fitting.holdout import Holdout, divide_records
from validation.tracing.fitting.least_squares import fit
from validation.tracing.fitting.model import Model
from validation.tracing.outcome import Candidate, Trace, competitors_of
from validation.tracing.problem import Problem
from validation.tracing.result import nearest_candidate
from validation.tracing.search.refine import refined
from validation.tracing.search.restarts import other_loops
from validation.tracing.search.search import Progress
from validation.tracing.settings import EQUIVALENT_RIG, FAR_ABOVE, MOST_STEPS, SearchPolicy


def refit_without_heldout(trace: Trace, policy: SearchPolicy, threads: int, report: Progress) -> Trace:
    """Fit all models of a trace again, to the training samples alone.

    The baseline and the named effects of an equivalent rig are fitted with more samples and joints than in the search
    (:func:`validation.tracing.baseline.equivalent_rig.refined_problem`), and from other loops. Where such a fit has no
    solution, both are fitted as in the search, so that their errors are of the same samples.

    Raises
    ------
    SolverError
        The baseline or the named effects have no solution without the held-out samples.
    """
    problem = trace.baseline.model.problem
    is_rig = policy is EQUIVALENT_RIG
    coarse = _Refit.of(problem, policy, threads, report)
    final = _Refit.of(refined_problem(problem), policy, threads, report) if is_rig else coarse
    named = [trace.baseline, *([trace.augmented] if trace.augmented is not trace.baseline else [])]
    found = final.all_of(named)
    if len(found) < len(named):
        final = coarse
        found = final.all_of(named)
    if len(found) < len(named):
        raise SolverError("no equilibrium without the held-out samples", 0)
    if is_rig:
        found[0] = final.baseline_beside(found[0], found[-1])
    again = {id(fitted): one for fitted, one in zip(named, found, strict=True)}
    for competitor in competitors_of(trace)[1:] if is_rig and trace.effects else ():
        if (one := final.thoroughly(competitor, from_other_loops=False)) is not None:
            again[id(competitor)] = one
    for candidate in trace.candidates:
        if id(candidate.fitted) not in again:
            again[id(candidate.fitted)] = coarse.briefly(candidate.fitted, policy)
    candidates = tuple(replace(c, fitted=again[id(c.fitted)]) for c in trace.candidates)
    far = found[0].heldout_rmse_deg > FAR_ABOVE * trace.floor.deg  # of which no effect missing is doubted later
    if is_rig and not trace.effects and (trace.verdict == "unexplained" or far):
        candidates = final.with_nearest(candidates)
    return replace(trace, baseline=found[0], augmented=found[-1], candidates=candidates)


@dataclass(frozen=True, eq=False)
class _Refit:
    """Fits of models to the training samples of one problem."""

    problem: Problem
    holdout: Holdout
    threads: int
    report: Progress

    @classmethod
    def of(cls, problem: Problem, policy: SearchPolicy, threads: int, report: Progress) -> _Refit:
        """Divide the records of a problem."""
        return cls(problem, divide_records(problem.records, own_preload=policy.own_preload), threads, report)

    @property
    def prior_mean(self) -> Floats:
        """The baseline's start: parameters fitted to all samples would carry what is held out."""
        return Model(self.problem).coordinates(self.problem.start, [])

    def all_of(self, models: list[Fitted]) -> list[Fitted]:
        """Fit models thoroughly; those without a solution are left out."""
        return [one for fitted in models if (one := self.thoroughly(fitted)) is not None]

    def thoroughly(self, fitted: Fitted, *, from_other_loops: bool = True) -> Fitted | None:
        """Fit a model from its parameters and from other loops, with effects in forms that refine them."""
        self.report(f"{' + '.join(fitted.names) or 'the baseline model'}, without the held-out samples", 0)
        model, found = Model(self.problem, fitted.model.added), list[Fitted]()
        for x in (fitted.x, *(other_loops(fitted) if from_other_loops else ())):
            baseline, effects = fitted.model.values(x)
            start = model.coordinates({**self.problem.start, **baseline}, effects)
            with suppress(SolverError, RigError):
                found.append(
                    fit(
                        model, self.holdout, start, threads=self.threads, most_steps=MOST_STEPS,
                        prior_mean=self.prior_mean,
                    )
                )  # fmt: skip
        best = min(found, key=lambda one: one.train_square, default=None)
        return best and refined(best, self.report, threads=self.threads, prior_mean=self.prior_mean)

    def baseline_beside(self, baseline: Fitted, augmented: Fitted) -> Fitted:
        """Fit the baseline again from its parameters in a model with effects; the better fit.

        The residual of a baseline that missed its optimum is no evidence for the effects.
        """
        if not augmented.names:
            return baseline
        start = augmented.x[: baseline.model.baseline_size]
        with suppress(SolverError, RigError):  # parameters that the rig can only have with its effects
            again = fit(
                baseline.model, self.holdout, start, threads=self.threads, most_steps=MOST_STEPS,
                prior_mean=self.prior_mean,
            )  # fmt: skip
            return min(baseline, again, key=lambda one: one.train_square)
        return baseline

    def with_nearest(self, candidates: tuple[Candidate, ...]) -> tuple[Candidate, ...]:
        """Fit the nearest candidate as the baseline is, so that their errors are of the same samples and compare.

        Where it is no longer the nearest then, the next one is fitted, too.
        """
        fine = set[tuple[str, ...]]()
        while (nearest := nearest_candidate(candidates)) is not None and nearest.names not in fine:
            again = self.thoroughly(nearest.fitted, from_other_loops=False)
            if again is None:
                break
            fine.add(nearest.names)
            candidates = tuple(replace(c, fitted=again) if c is nearest else c for c in candidates)
        return candidates

    def briefly(self, fitted: Fitted, policy: SearchPolicy) -> Fitted:
        """Fit a candidate that is not named; its errors are NaN where it has no equilibrium."""
        self.report(f"{' + '.join(fitted.names)}, without the held-out samples", 0)
        known = fitted.rows.jacobian if policy.refit_from_jacobian else None
        try:
            return fit(
                fitted.model, self.holdout, fitted.x, threads=self.threads, most_steps=policy.refit_steps, known=known,
                prior_mean=self.prior_mean,
            )  # fmt: skip
        except (SolverError, RigError):  # an equilibrium that hangs on the last digit of its parameters
            nothing = tuple(np.full(e.size, np.nan) for e in fitted.errors)
            return replace(fitted, holdout=self.holdout, errors=nothing)
