"""No model is worse than a model that it contains: a larger one is fitted again from the smaller one's optimum."""

from __future__ import annotations

from contextlib import suppress

import numpy as np

from fem_models.rig import RigError
from fem_models.rig.checks import SolverError
from hysteresis.arrays import Floats
from validation.tracing.effect import Values
from validation.tracing.fitting.fitted import Fitted
from validation.tracing.fitting.least_squares import differentiate, fit, fitted_at
from validation.tracing.fitting.model import Model
from validation.tracing.search.search import Search
from validation.tracing.settings import CONTAINED_TOLERANCE, FEW_STEPS, INSIDE_BOUNDS, NOTHING


def contains(larger: Fitted, smaller: Fitted) -> bool:
    """Whether a model has all effects of another one, in the same forms, and one more."""
    forms = {added.effect.name: added.form for added in larger.model.added}
    own = [(added.effect.name, added.form) for added in smaller.model.added]
    return len(own) + 1 == len(forms) and all(forms.get(name) is form for name, form in own)


def is_worse(larger: Fitted, smaller: Fitted) -> bool:
    """Whether the residual of a model exceeds that of one that it contains, on all or on training samples."""
    most = 1 + CONTAINED_TOLERANCE
    return larger.square > most * smaller.square or larger.train_square > most * smaller.train_square


def no_worse_than_contained(search: Search, models: list[Fitted], contained: list[Fitted]) -> list[Fitted]:
    """Fit models again that are worse than one that they contain, from there with the further effect at nothing.

    Parameters
    ----------
    contained
        Models with one effect less each.
    """
    out = []
    for larger in models:
        for smaller in sorted(contained, key=lambda one: one.square):
            if contains(larger, smaller) and is_worse(larger, smaller):
                larger = _from_contained(search, larger, smaller)
        out.append(larger)
    return out


def _from_contained(search: Search, larger: Fitted, smaller: Fitted) -> Fitted:
    """Fit a model from the optimum of one that it contains; the model as it is where it has no effect at nothing."""
    names = set(smaller.names)
    ((own, values),) = [
        (added, values)
        for added, values in zip(larger.model.added, larger.model.values(larger.x)[1], strict=True)
        if added.effect.name not in names
    ]
    model = Model(search.problem, (*smaller.model.added, own))
    if (start := at_nothing(model, smaller, values, search.threads)) is None:
        return larger
    search.report(f"{' + '.join(model.names)}, from the model without {own.effect.name}", 0)
    holdout, known = smaller.holdout, smaller.rows.jacobian
    errors = holdout.stacked(model.errors(start, search.threads))
    jacobian = differentiate(model, holdout, start, errors, search.threads, known)
    found = [fitted_at(model, holdout, start, errors, jacobian, 1)]
    with suppress(SolverError, RigError):
        found.append(fit(model, holdout, start, threads=search.threads, most_steps=FEW_STEPS, known=known))
    as_good = [one for one in (larger, *found) if not is_worse(one, smaller)]
    return min(as_good, key=lambda one: one.square, default=found[0])


def at_nothing(model: Model, smaller: Fitted, values: Values, threads: int = 1) -> Floats | None:
    """Coordinates of a model with one more effect than a fitted one, where that effect changes nothing.

    That is where a parameter of the effect is zero, one (a ratio), or at a bound: a plateau that no stress reaches, an
    end stop out of reach.

    Parameters
    ----------
    values
        The other parameters of the effect.

    Returns
    -------
    Floats or None
        Shape (p,); None where the effect changes the errors by more than a small part at all these places.
    """
    baseline, effects = smaller.model.values(smaller.x)
    low, high = model.bounds()
    parameters = model.added[-1].form.parameters
    zeros = {p.name: 0.0 for p in parameters if p.linear and not p.log}
    ones = {p.name: 1.0 for p in parameters if p.unit == "-" and p.low < 1 < p.high}
    places: list[Values] = [{**values, **together} for together in (zeros, ones) if together]
    for p in parameters:
        ends = (0.0 if not p.log and p.low <= 0 <= p.high else p.low, p.high)
        places += [{**values, p.name: end} for end in ends]
    error, least, best = smaller.rows.errors, float("inf"), None
    for place in places:
        x = np.clip(model.coordinates(baseline, [*effects, place]), low + INSIDE_BOUNDS, high - INSIDE_BOUNDS)
        with suppress(SolverError, RigError):
            change = float(np.linalg.norm(smaller.holdout.stacked(model.errors(x, threads)) - error))
            if change < least:
                least, best = change, x
        if least == 0.0:
            break  # nothing is less
    return best if least <= NOTHING * float(np.linalg.norm(error)) else None
