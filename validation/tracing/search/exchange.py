"""Named effects left out or exchanged for others, beside all else that is named."""

from __future__ import annotations

from collections.abc import Sequence
from contextlib import suppress
from dataclasses import replace

import numpy as np

from fem_models.rig import RigError
from fem_models.rig.checks import SolverError
from hysteresis.arrays import Ints
from validation.tracing.effect import Effect
from validation.tracing.fitting.fitted import Fitted
from validation.tracing.fitting.least_squares import fit, fitted_at
from validation.tracing.fitting.model import Model
from validation.tracing.search.candidates import candidates_with_one_more
from validation.tracing.search.search import Search
from validation.tracing.search.starts import every_start
from validation.tracing.settings import VERY_STRONG_EVIDENCE


def pruned(search: Search, fitted: Fitted) -> Fitted:
    """Leave out effects that are not needed: a first effect may lose its use beside the second."""
    for name in fitted.names[::-1]:
        if len(fitted.names) < 2:
            break
        kept = tuple(added for added in fitted.model.added if added.effect.name != name)
        baseline, effects = fitted.model.values(fitted.x)
        values = [v for added, v in zip(fitted.model.added, effects, strict=True) if added.effect.name != name]
        model = Model(search.problem, kept)
        search.report(" + ".join(model.names), 0)
        try:
            without = fit(model, fitted.holdout, model.coordinates(baseline, values), threads=search.threads)
        except (SolverError, RigError):
            continue
        if without.bic(fitted.samples) - fitted.bic(fitted.samples) < VERY_STRONG_EVIDENCE:
            fitted = without
    return fitted


def exchanged(search: Search, fitted: Fitted, most: int | None) -> list[Fitted]:
    """Models in which one named effect is exchanged for another one.

    A competitor of the first effect may have fallen behind before the second effect was added, and so may never have
    been fitted beside it.

    Parameters
    ----------
    most
        Effects tried in each place, by the linearised gain.
    """
    models = list[Fitted]()
    for place, added in enumerate(fitted.model.added):
        others = replace(search, effects=[e for e in search.effects if e.name != added.effect.name])
        with suppress(SolverError, RigError):
            found = candidates_with_one_more(others, _without(fitted, place), most)
            models += [_with_last_at(g, place) for g in found]
    return models


def from_every_start(search: Search, fitted: Fitted, effect: Effect) -> list[Fitted]:
    """Fit an effect in the place of the only one of a model, from all its starts with the same baseline.

    After the first steps the best two go on, because which start is the right one may show after more steps only.
    """
    base, early = _without(fitted, 0), list[Fitted]()
    own = replace(search, policy=replace(search.policy, starts_from_declared=False), _forms={})
    for one in every_start(base, effect, own.forms(effect)):
        found = [search.with_effect(base, one.added, x, search.policy.first_steps) for x in one.starts]
        early += [there for there in found if there is not None]
    early.sort(key=lambda there: there.square)
    finished = [search.with_effect(base, one.model.added[0], one.x) for one in early[:2]]
    return [one for one in finished if one is not None]


def _without(fitted: Fitted, place: int) -> Fitted:
    """Take an effect out of a model, with all other parameters as they are."""
    kept = [i for i in range(len(fitted.model.added)) if i != place]
    model, columns = _with_effects(fitted.model, kept)
    x = fitted.x[columns]
    errors = fitted.holdout.stacked(model.errors(x))
    return fitted_at(model, fitted.holdout, x, errors, fitted.rows.jacobian[:, columns], 1)


def _with_last_at(fitted: Fitted, place: int) -> Fitted:
    """Move the last effect of a model to another place: that of the effect for which it was exchanged."""
    last = len(fitted.model.added) - 1
    model, columns = _with_effects(fitted.model, [*range(place), last, *range(place, last)])
    x, jacobian = fitted.x[columns], fitted.rows.jacobian[:, columns]
    return fitted_at(model, fitted.holdout, x, fitted.rows.errors, jacobian, fitted.evaluations)


def _with_effects(model: Model, which: Sequence[int]) -> tuple[Model, Ints]:
    """Model with some of its effects in a given order, and the places of their coordinates in the whole model's."""
    ends = np.cumsum([model.baseline_size, *(len(added.form.parameters) for added in model.added)])
    columns = [np.arange(model.baseline_size), *(np.arange(ends[i], ends[i + 1]) for i in which)]
    return Model(model.problem, tuple(model.added[i] for i in which)), np.concatenate(columns)
