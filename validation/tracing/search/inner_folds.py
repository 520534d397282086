"""Inner folds: what a model of given effects predicts of training samples that its fit has not seen.

They confirm a name without the held-out samples. The choice of the effects is not repeated in each fold.
"""

from __future__ import annotations

from hysteresis.arrays import Floats
from validation.tracing.fitting.fitted import Fitted
from validation.tracing.fitting.folds import folds_of
from validation.tracing.fitting.holdout import Holdout
from validation.tracing.fitting.least_squares import fit
from validation.tracing.fitting.model import Model
from validation.tracing.settings import STEPS


def inner_fold_errors(fitted: Fitted, threads: int = 2) -> list[Floats]:
    """Errors of the training samples, each by a fit without its fold and without the held-out samples.

    The folds are those of :func:`validation.tracing.fitting.folds.folds_of`; each fit starts from the fitted model. A
    record that is held out as a whole takes no part, with its beginning: its zero would be that of held-out samples.

    Returns
    -------
    list of Floats
        One array for each part of a record in a fold, deg.

    Raises
    ------
    SolverError, RigError
        The model has no solution at its fitted parameters.
    """
    model, holdout = fitted.model, fitted.holdout
    train = [mask & (not holdout.is_held_out(i)) for i, mask in enumerate(holdout.train)]
    prior = Model(model.problem).coordinates(model.problem.start, [])
    out: list[Floats] = []
    for fold in folds_of(model.problem.records):
        test = [own & seen for own, seen in zip(fold.test, train, strict=True)]
        masks = tuple(seen & ~own for own, seen in zip(fold.test, train, strict=True))
        if not any(rows.any() for rows in test) or not any(rows.any() for rows in masks):
            continue
        inner = fit(model, Holdout(masks, fold.name), fitted.x, threads=threads, most_steps=STEPS, prior_mean=prior)
        out += [error[own] for error, own in zip(inner.errors, test, strict=True) if own.any()]
    return out
