"""What is named is fitted at the end in the forms that refine it."""

from __future__ import annotations

from contextlib import suppress

import numpy as np

from fem_models.rig.checks import RigError, SolverError
from hysteresis.arrays import Floats
from validation.tracing.effect import RigForm
from validation.tracing.fitting import Fitted, Model, bic, fit
from validation.tracing.problem import AddedEffect
from validation.tracing.search import ALIKE, ALL_CALLS, FEW_CALLS, Progress, samples_of


def refined(fitted: Fitted, report: Progress, *, threads: int = 2, prior_mean: Floats | None = None) -> Fitted:
    """Fit the effects of a model in forms that refine them (:class:`validation.tracing.effect.RigForm`).

    The samples that are fitted choose, by very strong evidence (:data:`validation.tracing.search.ALIKE`).

    Parameters
    ----------
    fitted
        A fit that has not seen what is held out.
    tell
        Called with what is being done.
    threads, home
        As in :func:`validation.tracing.fitting.fit`.
    """
    for place, added in enumerate(fitted.model.added):
        names = {c.name for c in added.form.parameters}
        for form in fitted.model.problem.forms(added.effect):
            if isinstance(form, RigForm) and form.refines and names < {c.name for c in form.parameters}:
                report(f"{' + '.join(fitted.names)}, finer")
                fitted = _in_form(fitted, place, form, threads, prior_mean)
    return fitted


def _in_form(fitted: Fitted, place: int, form: RigForm, threads: int, prior_mean: Floats | None) -> Fitted:
    """Fit one effect in another form, from where it stands; the model as it is where that is no better."""
    with_form = list(fitted.model.added)
    with_form[place] = AddedEffect(with_form[place].effect, form)
    model = Model(fitted.model.problem, tuple(with_form))
    baseline, more = fitted.model.values(fitted.x)
    starts = fitted.model.problem.starts(form)
    rows = [model.row(baseline, [*more[:place], {**s, **more[place]}, *more[place + 1 :]]) for s in starts]
    few = list[Fitted]()
    for x in np.unique(rows, axis=0):
        with suppress(SolverError, RigError):
            few.append(fit(model, fitted.holdout, x, threads=threads, most_calls=FEW_CALLS, prior_mean=prior_mean))
    if not few:
        return fitted
    start = min(few, key=lambda one: one.train_rmse_deg).x
    with suppress(SolverError, RigError):
        finer = fit(model, fitted.holdout, start, threads=threads, most_calls=ALL_CALLS, prior_mean=prior_mean)
        samples = samples_of(fitted, held_out=False)
        gain = _criterion(fitted, samples) - _criterion(finer, samples)
        return finer if gain > ALIKE else fitted
    return fitted


def _criterion(fitted: Fitted, samples: float) -> float:
    return bic(fitted.train_rmse_deg**2, fitted.x.size, samples)
