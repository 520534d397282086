"""Shapes of the effects: how each start of each form of an effect changes the angle beside a fitted model."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from itertools import groupby
from typing import Any

import numpy as np

from fem_models.rig import RigError
from fem_models.rig.checks import SolverError
from hysteresis.arrays import Floats
from validation.tracing.effect import Effect, FreeParameter, RigForm, Values
from validation.tracing.fitting.fitted import Fitted
from validation.tracing.fitting.model import Model
from validation.tracing.problem import AddedEffect
from validation.tracing.settings import INSIDE_BOUNDS, NO_CHANGE_DEG


@dataclass(frozen=True, eq=False)
class Shape:
    """Change of all that is fitted by one start of an effect, or by several amounts that act together.

    Parameters
    ----------
    effect
        Name.
    columns
        Predicted change, shape (m, k), deg.
    one_sided
        Whether the amount cannot be negative; of k > 1 columns all amounts have either sign.
    """

    effect: str
    columns: Floats
    one_sided: bool


def shapes_beside(fitted: Fitted, effects: Sequence[Effect], threads: int = 1) -> list[Shape]:
    """Shapes of all effects that a fitted model lacks, by one run of the model for each start.

    Amounts of a form that have either sign, such as the sine and the cosine of a run-out, make one shape together for
    each choice of its other parameters. A start that has no solution, or changes nothing, has no shape. Forms that
    only refine others have none of their own.
    """
    found, errors = list[Shape](), _Errors(fitted, threads)
    for effect in effects:
        if effect.name in fitted.names:
            continue
        for form in fitted.model.problem.forms(effect):
            if isinstance(form, RigForm) and form.refines:
                continue
            starts = fitted.model.problem.starts(form)
            changes = [(values, _change(fitted, AddedEffect(effect, form), values, errors)) for values in starts]
            there = [(values, change) for values, change in changes if change is not None]
            found += _of_form(effect.name, form, there)
    return found


def _of_form(name: str, form: Any, changes: Sequence[tuple[Values, Floats]]) -> Iterator[Shape]:
    """Shapes of one form from the changes of its starts."""
    amounts = [p for p in form.parameters if p.acts_from_zero and not p.log]
    if len(amounts) > 1 and all(p.low < 0 for p in amounts):
        others = {p.name for p in form.parameters} - {p.name for p in amounts}

        def rest(one: tuple[Values, Floats]) -> list[tuple[str, float]]:
            return sorted((key, value) for key, value in one[0].items() if key in others)

        for _, group in groupby(sorted(changes, key=rest), key=rest):
            yield Shape(name, _spanned([change for _, change in group], len(amounts)), one_sided=False)
    else:
        for values, change in changes:
            yield Shape(name, change[:, None], one_sided=not _has_either_sign(amounts, values))


def _has_either_sign(amounts: Sequence[FreeParameter], values: Values) -> bool:
    """Whether a start has amounts, and all of them may be negative."""
    own = [p for p in amounts if values[p.name] != 0.0]
    return bool(own) and all(p.low < 0 for p in own)


def _spanned(changes: Sequence[Floats], most: int) -> Floats:
    """Span changes by as many columns as there are amounts, the strongest ones: shape (m, k)."""
    rows = np.column_stack([change / np.linalg.norm(change) for change in changes])
    left, size, _ = np.linalg.svd(rows, full_matrices=False)
    return np.asarray((left * size)[:, : min(most, int((size > 1e-3 * size[0]).sum()))])


@dataclass
class _Errors:
    """Errors of a fitted model with an effect; the rig is not run again for effects on the reading alone."""

    fitted: Fitted
    threads: int
    _followed: Any = None

    def of(self, model: Model, x: Floats, *, of_reading: bool) -> list[Floats] | None:
        """Errors at coordinates; None without a solution."""
        try:
            if not of_reading:
                return model.errors(x, self.threads)
            if self._followed is None:
                self._followed = self.fitted.model.followed(self.fitted.x, self.threads)[1]
            return model.moved_errors(self._followed, [x], 1)[0]
        except (SolverError, RigError):
            return None


def _change(fitted: Fitted, added: AddedEffect, values: Values, errors: _Errors) -> Floats | None:
    """Change of what is fitted, training samples alone, shape (m,); None without a solution or without a change."""
    model = Model(fitted.model.problem, (*fitted.model.added, added))
    baseline, effects = fitted.model.values(fitted.x)
    of_reading = isinstance(added.form, RigForm) and added.form.rig is None and not values.keys() & baseline.keys()
    baseline = {name: values.get(name, value) for name, value in baseline.items()}
    low, high = model.bounds()
    x = np.clip(model.coordinates(baseline, [*effects, values]), low + INSIDE_BOUNDS, high - INSIDE_BOUNDS)
    there = errors.of(model, x, of_reading=of_reading)
    if there is None:
        return None
    change = (fitted.holdout.stacked(there) - fitted.rows.errors)[fitted.rows.train]
    return change if np.isfinite(change).all() and np.abs(change).max() >= NO_CHANGE_DEG else None


def with_fits(shapes: Sequence[Shape], base: Fitted, fits: Sequence[Fitted]) -> list[Shape]:
    """Add what models with one more effect change where they were fitted: what starts far off do not show."""
    train = base.rows.train
    found = list[Shape]()
    for one in fits:
        name = next(name for name in one.names if name not in base.names)
        found.append(Shape(name, (one.rows.errors - base.rows.errors)[train][:, None], one_sided=True))
    every = dict.fromkeys(one.effect for one in (*shapes, *found))
    return [one for name in every for one in (*shapes, *found) if one.effect == name]
