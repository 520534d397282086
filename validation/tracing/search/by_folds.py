"""Trace records by prediction: effects are named that lower the error on data that the fit has not seen.

The criterion over all samples says little of baselines whose parameters are many and linear: they absorb a part of
every effect. Here the folds decide.

1. The baselines are fitted to all samples, and every effect beside two of them: the one that predicts best, and the one
   that fits best. An effect can hide how good a baseline is. The few effects with the lowest error are candidates.
2. In every fold, the baselines and the candidates are compared by folds inside the training samples. The best one
   predicts the samples that were held out, and that error is reported.
3. An effect is named if most folds choose an effect, if the held-out error falls beyond its interval, and if it
   matters. It is the one that the same comparison chooses by all folds (but those that extrapolate further than the
   others), as every fold chose by those inside it; the error that is reported stays that of the folds' own choices.
   Then a further effect is searched for beside it, which must be distinguished from all others but one.
"""

from __future__ import annotations

from collections.abc import Sequence
from contextlib import suppress
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np

from fem_models.rig.checks import RigError, SolverError
from hysteresis.arrays import Floats
from validation.tracing.baseline.play_operators import PlayProblem
from validation.tracing.effect import Effect, Values
from validation.tracing.fitting.fitted import Fitted
from validation.tracing.fitting.folds import (
    Fold,
    extrapolation,
    fold_errors,
    gain,
    log_score,
    mean_square,
)
from validation.tracing.fitting.holdout import Holdout
from validation.tracing.fitting.least_squares import fit
from validation.tracing.fitting.model import Model
from validation.tracing.plausibility import implausible
from validation.tracing.problem import AddedEffect, Problem
from validation.tracing.search.search import Progress
from validation.tracing.search.starts import Start, linearised_gain
from validation.tracing.settings import (
    FOLD_ALIKE,
    FOLD_CANDIDATES,
    FOLD_EFFECTS,
    FURTHER_ALIKE,
    INFEASIBLE_DEG,
    LEAST_GAIN,
    MOST_EXTRAPOLATION,
    NOT_TOLD,
    STEPS,
    WORTH_NAMING,
)


@dataclass(frozen=True, eq=False)
class FoldFits:
    """Fits of models to the training samples of folds, each computed once."""

    folds: tuple[Fold, ...]
    fits: dict[tuple[Fitted, frozenset[Fold]], Fitted | None] = field(default_factory=dict)

    def fitted(self, candidate: Fitted, *left_out: Fold) -> Fitted | None:
        """Fit a model without some folds, from prior means that have seen no data; None without a solution."""
        key = (candidate, frozenset(left_out))  # the models themselves: the number of a dead one is given again
        if key not in self.fits:
            self.fits[key] = self._fit(candidate, left_out)
        return self.fits[key]

    def _fit(self, candidate: Fitted, left_out: tuple[Fold, ...]) -> Fitted | None:
        first, *others = left_out
        holdout, model = first.training(*others), candidate.model
        if isinstance(model.problem, PlayProblem):
            model = replace(model, problem=model.problem.trained_on(holdout.train))
        with suppress(SolverError, RigError):
            return _fit(model, holdout, candidate.x)
        return None

    def errors(self, candidate: Fitted, fold: Fold, *also_left_out: Fold) -> list[Floats]:
        """Errors of a model on a fold that it was fitted without; large where it has no solution."""
        fitted = self.fitted(candidate, fold, *also_left_out)
        if fitted is None:
            return [np.full(int(test.sum()), INFEASIBLE_DEG) for test in fold.test if test.any()]
        return fold_errors(fitted, fold)

    def heldout(self, candidates: Sequence[Fitted]) -> list[Floats]:
        """Errors on all folds, each by the model named for it."""
        return [e for fold, one in zip(self.folds, candidates, strict=True) for e in self.errors(one, fold)]

    def everywhere(self, candidate: Fitted) -> list[Floats]:
        """Errors of one model on all folds."""
        return self.heldout([candidate] * len(self.folds))

    def chosen_without(self, candidates: Sequence[Fitted], fold: int) -> Fitted:
        """Model that predicts best inside the training samples of a fold: the highest log score of the inner folds.

        Each inner fold has an error of its own. One that nothing predicts, because its records alone reach so far,
        says no more than the others. What is below the noise counts little.

        An inner fold that extrapolates further than the outer fold tests something else: it is left out, unless all do.
        """
        return self._best(candidates, self.folds[fold])

    def best(self, candidates: Sequence[Fitted]) -> Fitted:
        """Model that predicts best by all folds, but for those that extrapolate, unless all do."""
        return self._best(candidates)

    def _best(self, candidates: Sequence[Fitted], *left_out: Fold) -> Fitted:
        noise = candidates[0].noise.local_deg
        inner = self._comparable(candidates[0].model.problem, left_out)
        scores = [sum(log_score(self.errors(model, one, *left_out), noise) for one in inner) for model in candidates]
        return candidates[int(np.argmax(scores))]

    def _comparable(self, problem: Problem, left_out: tuple[Fold, ...]) -> list[Fold]:
        """Folds that extrapolate no further than the one that is left out; of all folds those that do not."""
        drives = [one.drive for one in problem.inputs]
        inner = [one for one in self.folds if one not in left_out]
        most = MOST_EXTRAPOLATION + sum(extrapolation(drives, one, one.training()) for one in left_out)
        near = [one for one in inner if extrapolation(drives, one, one.training(*left_out)) <= most]
        return near or inner

    def chosen(self, candidates: Sequence[Fitted]) -> list[Fitted]:
        """Model that each fold chooses by the samples of the others."""
        return [self.chosen_without(candidates, fold) for fold in range(len(self.folds))]

    def with_fold_errors(self, fitted: Fitted, by: Sequence[Fitted]) -> Fitted:
        """Give a fit to all samples the held-out errors of the models that the folds chose."""
        rows = [np.full(error.size, np.nan) for error in fitted.errors]
        for fold, one in zip(self.folds, by, strict=True):
            parts = iter(self.errors(one, fold))
            for row, test in zip(rows, fold.test, strict=True):
                if test.any():
                    row[test] = next(parts)
        return replace(fitted, fold_errors=tuple(rows))


@dataclass(frozen=True, eq=False)
class FoundByFolds:
    """What the folds found.

    Parameters
    ----------
    baseline, best
        Fits to all samples with the errors of the outer folds; the same where nothing is named.
    candidates
        Every model that went to the folds.
    alike
        For each named effect, those that are not distinguished from it.
    """

    baseline: Fitted
    best: Fitted
    candidates: tuple[Fitted, ...]
    alike: tuple[tuple[str, ...], ...]


@dataclass(frozen=True, eq=False)
class _Step:
    """An effect that is named: the fit with it, what each fold chose, and the effects that predict as well."""

    fitted: Fitted
    chosen: list[Fitted]
    alike: tuple[str, ...]


def find_by_folds(
    baselines: Sequence[Fitted], effects: Sequence[Effect], fits: FoldFits, report: Progress
) -> FoundByFolds:
    """Search for effects beside one of several baselines.

    Parameters
    ----------
    baselines
        Fits to all samples (:func:`fit_all`) of models of the same records.
    """
    chosen = fits.chosen(baselines)
    baseline = fits.best(baselines)
    first = list(chosen)
    best, candidates, alike = baseline, list[Fitted](), list[tuple[str, ...]]()
    for _ in range(FOLD_EFFECTS):
        like_named = {name for names in alike for name in names}  # would share the size of the named effect
        further = [e for e in effects if e.name not in like_named]
        beside = dict.fromkeys([best, _fits_best(baselines)] if best is baseline else [best])
        front = [one for before in beside for one in front_runners(before, further, report)]
        if not front:
            break
        report("cross-validation", 0)
        candidates += [fits.with_fold_errors(one, [one] * len(fits.folds)) for one in front]
        step = _named(fits, best, chosen, [*baselines, *([best] if best is not baseline else [])], front)
        if step is None or _taken(fits, best, chosen, step) < NOT_TOLD * _square(fits, first):
            break
        if best is not baseline and len(step.alike) > FURTHER_ALIKE:
            break
        best, chosen = step.fitted, step.chosen
        alike.append(step.alike)
    before = fits.with_fold_errors(baseline, first)
    after = before if best is baseline else fits.with_fold_errors(best, chosen)
    return FoundByFolds(before, after, tuple(candidates), tuple(alike))


def _taken(fits: FoldFits, before: Fitted, chosen: Sequence[Fitted], step: _Step) -> float:
    """Mean square that a step takes, deg^2, of the folds' choices and of what is named: the smaller one.

    Where folds disagreed about the step before, the next one also takes what only their other choices had left.
    """
    named = [before] * len(fits.folds), [step.fitted] * len(fits.folds)
    return min(_square(fits, a) - _square(fits, b) for a, b in ((chosen, step.chosen), named))


def _fits_best(baselines: Sequence[Fitted]) -> Fitted:
    """Baseline with the lowest error on all samples, which an effect such as a drift can hide."""
    return min(baselines, key=lambda one: one.mean_square)


def _square(fits: FoldFits, chosen: Sequence[Fitted]) -> float:
    return mean_square(fits.heldout(chosen))


def fit_all(model: Model, effects: Sequence[Values] = ()) -> Fitted:
    """Fit a model to all samples, from the problem's start and from values of its effects.

    Raises
    ------
    SolverError, RigError
        The model has no solution there.
    """
    return fit_to_all(model, model.coordinates(model.problem.start, effects))


def fit_to_all(model: Model, start: Floats) -> Fitted:
    """Fit a model to all samples from coordinates, shape (p,).

    Raises
    ------
    SolverError, RigError
        The model has no solution there.
    """
    return _fit(model, _everything(model.problem), start)


def _everything(problem: Problem) -> Holdout:
    return Holdout(tuple(np.ones(one.kept.size, dtype=bool) for one in problem.records), "nothing")


def _fit(model: Model, holdout: Holdout, start: Floats) -> Fitted:
    mean = Model(model.problem).coordinates(model.problem.start, [])
    return fit(model, holdout, start, threads=1, most_steps=STEPS, prior_mean=mean)


def front_runners(best: Fitted, effects: Sequence[Effect], report: Progress) -> list[Fitted]:
    """Fit each effect beside a model to all samples; those with the lowest error and constants that make sense."""
    others = [effect for effect in effects if effect.name not in best.names]
    fitted = [_front_runner(best, effect, report, len(others) - done) for done, effect in enumerate(others)]
    return sorted((one for one in fitted if one is not None), key=lambda one: one.mean_square)[:FOLD_CANDIDATES]


def _front_runner(best: Fitted, effect: Effect, report: Progress, ahead: int = 0) -> Fitted | None:
    """Fit an effect from its best start; where its constants make no sense, in its other forms, best start first.

    A steady drift is also one towards a far limit, whose size is outside its sensible range.
    """
    problem, starts = best.model.problem, list[Start]()
    for form in problem.forms(effect):
        added = AddedEffect(effect, form)
        tried = [linearised_gain(best, added, values) for values in either_sign(form, problem.starts(form))]
        starts += sorted((one for one in tried if one is not None), key=lambda one: one.gain)[-1:]
    for start in sorted(starts, key=lambda one: -one.gain):
        if start.gain < LEAST_GAIN:
            break
        report(" + ".join([*best.names, effect.name]), ahead)
        with suppress(SolverError, RigError):
            model = Model(problem, (*best.model.added, start.added))
            fitted = fit_to_all(model, start.x)
            if not implausible(fitted):
                return fitted
    return None


def either_sign(form: Any, starts: Sequence[Values]) -> list[Values]:
    """Give starts, and these with the amounts of the other sign where their bounds allow one."""
    signed = {p.name for p in form.parameters if p.acts_from_zero and p.low < 0 < p.high}
    mirrored = [{name: -v if name in signed else v for name, v in start.items()} for start in starts if signed]
    return [*starts, *(other for other in mirrored if other not in starts)]


def _named(
    fits: FoldFits, before: Fitted, without: Sequence[Fitted], contained: Sequence[Fitted], front: Sequence[Fitted]
) -> _Step | None:
    """Effect that the folds name beside a model; None where they name none.

    Parameters
    ----------
    without
        What each fold chose before.
    contained
        Models without a further effect that folds may choose.
    """
    chosen = fits.chosen([*contained, *front])
    old, new = fits.heldout(without), fits.heldout(chosen)
    longer = [one for one in chosen if len(one.names) > len(before.names)]
    mattered = mean_square(new) < WORTH_NAMING**2 * mean_square(old)
    if not (mattered and 2 * len(longer) > len(chosen) and gain(old, new).is_positive):
        return None
    best = fits.best(front)
    others = [one for one in front if one.names[-1] != best.names[-1]]
    errors = {id(one): fits.everywhere(one) for one in front}
    least = mean_square(errors[id(best)])
    limit = max(FOLD_ALIKE**2 * least, least + NOT_TOLD * max(0.0, mean_square(old) - least))

    def is_alike(one: Fitted) -> bool:
        near = one in longer or mean_square(errors[id(one)]) <= limit
        return near or not gain(errors[id(one)], errors[id(best)]).is_positive

    sure = [one for one in others if is_alike(one) and gain(old, errors[id(one)]).is_positive]
    return _Step(best, chosen, tuple(dict.fromkeys(one.names[-1] for one in sure)))
