"""Starting points of an effect beside a fitted model, judged by one run of the model each: the linearised gain."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from fem_models.rig import RigError
from fem_models.rig.checks import SolverError
from hysteresis.arrays import Floats
from validation.tracing.effect import Effect, Values
from validation.tracing.fitting.fitted import Fitted
from validation.tracing.fitting.least_squares import solve
from validation.tracing.fitting.model import Model
from validation.tracing.problem import AddedEffect
from validation.tracing.settings import (
    INSIDE_BOUNDS,
    KEPT_GAIN,
    LARGEST_FACTOR,
    LARGEST_STEP,
    LEAST_GAIN,
    LESSER_FORM,
    NO_CHANGE_DEG,
    STARTS_PER_EFFECT,
)


@dataclass(frozen=True, eq=False)
class Start:
    """A starting point of a model with one more effect.

    Parameters
    ----------
    x
        Coordinates, shape (p,).
    gain
        Linearised gain: part of the training samples' sum of squares that the effect would explain, were it linear.
    """

    added: AddedEffect
    x: Floats
    gain: float


@dataclass(frozen=True, eq=False)
class FormStarts:
    """A form of an effect with the parameters that it is started from."""

    form: Any
    starts: Sequence[Values]


def best_starts(fitted: Fitted, effect: Effect, forms: Sequence[FormStarts], threads: int = 1) -> list[Start]:
    """Best start of each form of an effect, best first; forms that gain much less than the best one are left out."""
    best = []
    for one in forms:
        added = AddedEffect(effect, one.form)
        found = [linearised_gain(fitted, added, values, threads=threads) for values in one.starts]
        found += [joint_linearised_gain(fitted, added, own, threads) for own in joint_starts(added, one.starts)]
        there = [start for start in found if start is not None and start.gain > LEAST_GAIN]
        if there:
            best.append(max(there, key=lambda start: start.gain))
    best.sort(key=lambda start: -start.gain)
    return [start for start in best[:STARTS_PER_EFFECT] if start.gain > LESSER_FORM * best[0].gain]


@dataclass(frozen=True, eq=False)
class Starts:
    """A form of an effect with the coordinates of all its starts, shape (p,) each."""

    added: AddedEffect
    starts: Sequence[Floats]


def every_start(fitted: Fitted, effect: Effect, forms: Sequence[FormStarts]) -> list[Starts]:
    """Every start of every form of an effect beside a fitted model; values may name parameters of the baseline."""
    model, (baseline, effects) = fitted.model, fitted.model.values(fitted.x)
    found = list[Starts]()
    for one in forms:
        added = AddedEffect(effect, one.form)
        more = Model(model.problem, (*model.added, added))
        own = [{name: values.get(name, value) for name, value in baseline.items()} for values in one.starts]
        xs = [more.coordinates(base, [*effects, values]) for base, values in zip(own, one.starts, strict=True)]
        found.append(Starts(added, xs))
    return found


def linearised_gain(
    fitted: Fitted, added: AddedEffect, values: Values, *, enlarged: bool = False, threads: int = 1
) -> Start | None:
    """Judge a start of an effect by one run of the model with it; None where that fails or changes nothing.

    The change of the angle, as it is or scaled by a factor, is fitted to the residual together with the linearised
    fitted model, whose parameters the start takes along. Where a larger effect gains more, parameters that act linearly
    are multiplied by the factor, and the model is run once more (``enlarged``).

    Parameters
    ----------
    values
        Parameters of the effect; they may name parameters of the baseline, too.
    """
    holdout, rows, train = fitted.holdout, fitted.rows, fitted.rows.train
    model = Model(fitted.model.problem, (*fitted.model.added, added))
    baseline, effects = fitted.model.values(fitted.x)
    baseline = {name: values.get(name, value) for name, value in baseline.items()}
    low, high = model.bounds()
    x = np.clip(model.coordinates(baseline, [*effects, values]), low + INSIDE_BOUNDS, high - INSIDE_BOUNDS)
    try:
        change = (holdout.stacked(model.errors(x, threads)) - rows.errors)[train]
    except (SolverError, RigError):
        return None
    if not np.isfinite(change).all() or np.abs(change).max() < NO_CHANGE_DEG:
        return None
    jacobian, error = rows.jacobian[train], rows.errors[train]
    whole = float(error @ error)
    others = solve(jacobian, -(error + change))
    residual = error + change + jacobian @ others
    gain = 1 - float(residual @ residual) / whole
    best = Start(added, _moved(x, others, low, high), gain)
    steps = solve(np.column_stack([jacobian, change]), -error)
    factor = float(steps[-1])
    if factor <= 0:
        return best
    residual = error + np.column_stack([jacobian, change]) @ steps
    if (linear := 1 - float(residual @ residual) / whole) <= gain:
        return best
    best = Start(added, _moved(x, steps[:-1] * min(1.0, LARGEST_STEP / factor), low, high), linear)
    if enlarged or not any(p.linear for p in added.form.parameters) or 1 / LARGEST_STEP < factor < LARGEST_STEP:
        return best
    by = {p.name: min(factor, LARGEST_FACTOR) if p.linear else 1.0 for p in added.form.parameters}
    larger = {name: value * by.get(name, 1.0) for name, value in values.items()}
    other = linearised_gain(fitted, added, larger, enlarged=True, threads=threads)
    return other if other is not None and other.gain > KEPT_GAIN * linear else best


def joint_starts(added: AddedEffect, starts: Sequence[Values]) -> list[Values]:
    """Give starts in which all linear parameters have a magnitude, one for each choice of the other parameters.

    Empty where there is at most one linear parameter, whose magnitude :func:`linearised_gain` finds.
    """
    linear = [p.name for p in added.form.parameters if p.linear and not p.log]
    groups: dict[tuple[tuple[str, float], ...], dict[str, float]] = {}
    for values in starts if len(linear) > 1 else ():
        others = tuple(sorted((name, value) for name, value in values.items() if name not in linear))
        largest = groups.setdefault(others, dict.fromkeys(linear, 0.0))
        largest.update({name: max(largest[name], abs(values[name])) for name in linear})
    return [{**dict(others), **largest} for others, largest in groups.items() if all(largest.values())]


def joint_linearised_gain(fitted: Fitted, added: AddedEffect, values: Values, threads: int = 1) -> Start | None:
    """Judge a start whose linear parameters get the magnitudes and signs that gain most together.

    Each of them changes the angle in a run of its own. A tilted camera's gain and perspective gain little one by one,
    since each makes the fit of the other worse.

    Parameters
    ----------
    values
        As :func:`joint_starts` gives them.
    """
    model = Model(fitted.model.problem, (*fitted.model.added, added))
    baseline, effects = fitted.model.values(fitted.x)
    baseline = {name: values.get(name, value) for name, value in baseline.items()}
    linear = [p.name for p in added.form.parameters if p.linear and not p.log]
    low, high = model.bounds()
    train = fitted.rows.train
    none = {**values, **dict.fromkeys(linear, 0.0)}

    def errors_with(own: Values) -> Floats:
        x = np.clip(model.coordinates(baseline, [*effects, own]), low + INSIDE_BOUNDS, high - INSIDE_BOUNDS)
        return fitted.holdout.stacked(model.errors(x, threads))[train]

    try:
        without = errors_with(none)
        changes = np.column_stack([errors_with({**none, name: values[name]}) - without for name in linear])
    except (SolverError, RigError):
        return None
    if not np.isfinite(changes).all() or (np.abs(changes).max(axis=0) < NO_CHANGE_DEG).any():
        return None
    steps = solve(np.column_stack([fitted.rows.jacobian[train], changes]), -without)
    factors = np.clip(steps[-len(linear) :], -LARGEST_FACTOR, LARGEST_FACTOR)
    scaled = {name: values[name] * float(factor) for name, factor in zip(linear, factors, strict=True)}
    return linearised_gain(fitted, added, {**values, **scaled}, enlarged=True, threads=threads)


def _moved(x: Floats, others: Floats, low: Floats, high: Floats) -> Floats:
    """Move the first coordinates along, each by no more than 1."""
    x = x.copy()
    x[: others.size] += np.clip(others, -1.0, 1.0)
    return np.clip(x, low + INSIDE_BOUNDS, high - INSIDE_BOUNDS)
