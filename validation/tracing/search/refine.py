"""Named effects in forms that refine them, at the end of a search."""

from __future__ import annotations

from contextlib import suppress

import numpy as np

from fem_models.rig import RigError
from fem_models.rig.checks import SolverError
from hysteresis.arrays import Floats
from validation.tracing.effect import RigForm
from validation.tracing.fitting.fitted import Fitted
from validation.tracing.fitting.least_squares import fit
from validation.tracing.fitting.model import Model
from validation.tracing.problem import AddedEffect
from validation.tracing.search.search import Progress
from validation.tracing.settings import FEW_STEPS, MOST_STEPS, VERY_STRONG_EVIDENCE


def refined(fitted: Fitted, report: Progress, *, threads: int = 2, prior_mean: Floats | None = None) -> Fitted:
    """Fit the effects of a model in the forms that refine them (:class:`validation.tracing.effect.RigForm`).

    A refined form stays on very strong evidence of the training samples alone.

    Parameters
    ----------
    report
        Called with what is being computed.
    threads, prior_mean
        As in :func:`validation.tracing.fitting.least_squares.fit`.
    """
    for place, added in enumerate(fitted.model.added):
        names = {p.name for p in added.form.parameters}
        for form in fitted.model.problem.forms(added.effect):
            if isinstance(form, RigForm) and form.refines and names < {p.name for p in form.parameters}:
                report(f"{' + '.join(fitted.names)}, refined", 0)
                fitted = _in_form(fitted, place, form, threads, prior_mean)
    return fitted


def _in_form(fitted: Fitted, place: int, form: RigForm, threads: int, prior_mean: Floats | None) -> Fitted:
    """Fit one effect in another form, from its present parameters; the model as it is where that is no better.

    Other parameters may have absorbed what the new ones describe, as a rising plateau does the end of a flat one: so
    these also start from their own starts.
    """
    added = list(fitted.model.added)
    forms = fitted.model.problem.forms(added[place].effect)
    simplest = {p.name for p in min(forms, key=lambda one: len(one.parameters)).parameters}
    added[place] = AddedEffect(added[place].effect, form)
    model = Model(fitted.model.problem, tuple(added))
    baseline, effects = fitted.model.values(fitted.x)
    starts = fitted.model.problem.starts(form)
    present = effects[place]
    kept = (present, {name: value for name, value in present.items() if name in simplest})
    rows = [
        model.coordinates(baseline, [*effects[:place], {**start, **values}, *effects[place + 1 :]])
        for start in starts for values in kept
    ]  # fmt: skip
    few = list[Fitted]()
    for x in np.unique(rows, axis=0):
        with suppress(SolverError, RigError):
            few.append(fit(model, fitted.holdout, x, threads=threads, most_steps=FEW_STEPS, prior_mean=prior_mean))
    if not few:
        return fitted
    start = min(few, key=lambda one: one.train_square).x
    with suppress(SolverError, RigError):
        finer = fit(model, fitted.holdout, start, threads=threads, most_steps=MOST_STEPS, prior_mean=prior_mean)
        gain = fitted.train_bic(fitted.train_samples) - finer.train_bic(fitted.train_samples)
        return finer if gain > VERY_STRONG_EVIDENCE else fitted
    return fitted
