"""Least squares of the declared model with effects added, and what a fit is worth on data that it has not seen."""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np
from scipy.optimize import least_squares

from fem_models.rig.checks import RigError, SolverError
from hysteresis.arrays import Floats, Mask
from validation.tracing.effect import FreeParameter, Values
from validation.tracing.problem import AddedEffect, Problem

_STEP = 1e-3  # of finite differences, in sizes of the constants
_MOST_CALLS = 30
_FAR = 1e3  # deg: error of constants that no rig can have; the step is made shorter
_INSIDE = 1e-6  # sizes: a start at a bound is moved in
_CLOSE = 1e-4  # relative change of the sum of squares, and of the coordinates, at which a fit ends
_OF_BRANCH = 8.0
_MOSTLY = 0.3  # of a record: less is only its start
_NOTHING = 1e-9  # deg: an effect that changes less is not there
_MOST_TIMES = 100.0  # a start is made larger by
_AS_PROMISED = 0.5  # of the linear promise that a larger start must keep
_FURTHEST = 2.0  # times the start's own size: how far the other constants are taken along


@dataclass(frozen=True, eq=False)
class Model:
    """The declared model of a problem with effects added; constants in one row, those of the declared model first."""

    problem: Problem
    added: tuple[AddedEffect, ...] = ()

    @cached_property
    def parameters(self) -> tuple[FreeParameter, ...]:
        """All constants, shape (p,)."""
        return (*self.problem.parameters, *(c for a in self.added for c in a.form.parameters))

    @property
    def own(self) -> int:
        """Number of constants of the declared model."""
        return len(self.problem.parameters)

    def row(self, baseline: Values, more: Sequence[Values]) -> Floats:
        """Coordinates of values, shape (p,)."""
        values = [baseline[c.name] for c in self.problem.parameters]
        for a, given in zip(self.added, more, strict=True):
            values += [given[c.name] for c in a.form.parameters]
        return np.array([c.to_unit(v) for c, v in zip(self.parameters, values, strict=True)])

    def values(self, x: Floats) -> tuple[Values, list[Values]]:
        """Values of coordinates: of the declared model, and of each effect."""
        from_unit = [c.from_unit(v) for c, v in zip(self.parameters, x.tolist(), strict=True)]
        at, more = self.own, list[Values]()
        for a in self.added:
            names = [c.name for c in a.form.parameters]
            more.append(dict(zip(names, from_unit[at : at + len(names)], strict=True)))
            at += len(names)
        return dict(zip([c.name for c in self.problem.parameters], from_unit[: self.own], strict=True)), more

    def bounds(self) -> tuple[Floats, Floats]:
        """Bounds of the coordinates, shapes (p,)."""
        low, high = zip(*((c.to_unit(c.low), c.to_unit(c.high)) for c in self.parameters), strict=True)
        return np.array(low), np.array(high)

    def errors(self, x: Floats) -> list[Floats]:
        """Model less measurement of each record, deg.

        Raises
        ------
        SolverError, RigError
            From the model.
        """
        baseline, more = self.values(x)
        angles = self.problem.predict(baseline, [(a.form, v) for a, v in zip(self.added, more, strict=True)])
        return [angle - seen for angle, seen in zip(angles, self.problem.observed, strict=True)]


@dataclass(frozen=True, eq=False)
class Holdout:
    """Which samples of each record are fitted, shapes (m_i,), the others being held out; and by what rule."""

    train: tuple[Mask, ...]
    by: str

    def zero(self, i: int, error: Floats) -> float:
        """Zero of a record: the mean over its fitted samples, over all where they are few."""
        return float(error[slice(None) if self.held(i) else self.train[i]].mean())

    def held(self, i: int) -> bool:
        """Tell whether a record is held out but for its start."""
        return bool(self.train[i].mean() <= _MOSTLY)

    def centred(self, errors: Sequence[Floats]) -> list[Floats]:
        """Take the zero of each record out."""
        return [e - self.zero(i, e) for i, e in enumerate(errors)]

    def row(self, errors: Sequence[Floats]) -> Floats:
        """Errors of all records in one row, shape (m,), with zeros taken out."""
        return np.concatenate(self.centred(errors))

    @cached_property
    def seen(self) -> Mask:
        """Which of that row are fitted, shape (m,)."""
        return np.concatenate(self.train)


@dataclass(frozen=True, eq=False)
class Fitted:
    """A model at the end of its fit.

    ``errors`` are the model less the measurement of each record, with zeros taken out; ``row`` has them in one row,
    shape (m,), and ``jacobian``, shape (m, p), is its derivative.
    """

    model: Model
    holdout: Holdout
    x: Floats
    errors: tuple[Floats, ...]
    jacobian: Floats
    evaluations: int

    @cached_property
    def row(self) -> Floats:
        """All errors, shape (m,)."""
        return np.concatenate(self.errors)

    @property
    def train(self) -> Floats:
        """Errors of the fitted samples."""
        return np.asarray(self.row[self.holdout.seen])

    @property
    def heldout(self) -> Floats:
        """Errors of the others."""
        return np.asarray(self.row[~self.holdout.seen])

    @property
    def residuals(self) -> list[Floats]:
        """Measurement less model of each record."""
        return [-e for e in self.errors]

    @property
    def names(self) -> tuple[str, ...]:
        """Effects that are in it."""
        return tuple(a.effect.name for a in self.model.added)

    @property
    def train_rmse_deg(self) -> float:
        """Over the fitted samples."""
        return rms(self.train)

    @property
    def heldout_rmse_deg(self) -> float:
        """Over the others."""
        return rms(self.heldout)

    @property
    def square(self) -> float:
        """Mean square over all samples, those held out among them."""
        return float(self.row @ self.row) / self.row.size


def rms(error: Floats) -> float:
    """Root mean square; 0 of nothing."""
    return math.sqrt(float(error @ error) / error.size) if error.size else 0.0


def fit(
    model: Model,
    holdout: Holdout,
    start: Floats,
    *,
    threads: int = 2,
    most_calls: int = _MOST_CALLS,
    known: Floats | None = None,
    prior_mean: Floats | None = None,
) -> Fitted:
    """Fit all constants together by bounded least squares (trust region reflective, scipy).

    Parameters
    ----------
    start
        Coordinates, shape (p,).
    threads
        For derivatives.
    most_calls
        Steps at most.
    known
        Derivatives of the first coordinates, known well enough for the first step, shape (m, k).
    home
        Coordinates of the declared constants that a hold pulls to (:attr:`validation.tracing.problem.Problem.hold_deg`), shape
        (k,); the start by default.

    Raises
    ------
    SolverError, RigError
        The model cannot follow its records at the start.
    """
    low, high = model.bounds()
    calls, seen, size = 0, holdout.seen, holdout.seen.size
    latest: list[Floats] = []  # whole Jacobian, of which the fit takes its rows
    visited: dict[bytes, Floats] = {}  # errors by coordinates: a Jacobian is asked for where errors have been

    def errors(x: Floats) -> Floats:
        nonlocal calls
        if (key := x.tobytes()) not in visited:
            calls += 1
            try:
                visited[key] = holdout.row(model.errors(x))
            except (SolverError, RigError):
                visited[key] = np.full(size, _FAR)
        return visited[key]

    def jacobian(x: Floats) -> Floats:
        nonlocal calls
        calls += x.size - (0 if known is None or latest else known.shape[1])
        latest[:] = [columns(model, holdout, x, errors(x), threads, known if not latest else None)]
        return np.asarray(latest[0][seen])

    start = np.clip(start, low + _INSIDE, high - _INSIDE)
    holdout.row(model.errors(start))  # raises where there is no way
    prior_weight, own = model.problem.prior_weight_deg, model.own
    prior_mean = start[:own] if prior_mean is None else prior_mean

    def held(x: Floats) -> Floats:
        return (
            np.concatenate([errors(x)[seen], prior_weight * (x[:own] - prior_mean)])
            if prior_weight
            else errors(x)[seen]
        )

    def slope(x: Floats) -> Floats:
        return np.vstack([jacobian(x), prior_weight * np.eye(own, x.size)]) if prior_weight else jacobian(x)

    found = least_squares(held, start, slope, bounds=(low, high), xtol=_CLOSE, ftol=_CLOSE, max_nfev=most_calls)
    at = np.split(errors(found.x), np.cumsum([t.size for t in holdout.train])[:-1])
    return Fitted(model, holdout, found.x, tuple(at), latest[0], calls)


def columns(model: Model, holdout: Holdout, x: Floats, at: Floats, threads: int, known: Floats | None = None) -> Floats:
    """Differentiate all errors, shape (m, p); one-sided, away from the nearer bound, columns in threads.

    ``known`` are the first columns where they need not be worked out again.
    """
    known = np.empty((at.size, 0)) if known is None else known
    low, high = model.bounds()

    def one(i: int) -> Floats:
        step = _STEP if high[i] - x[i] >= x[i] - low[i] else -_STEP
        moved = x.copy()
        moved[i] += step
        try:
            return (holdout.row(model.errors(moved)) - at) / step
        except (SolverError, RigError):
            return np.zeros_like(at)

    return np.column_stack([known, *_in_threads(one, range(known.shape[1], x.size), threads)])


def _in_threads(one: Any, items: Iterable[int], threads: int) -> list[Any]:
    if threads <= 1:
        return [one(i) for i in items]
    with ThreadPoolExecutor(threads) as pool:
        return list(pool.map(one, items))


@dataclass(frozen=True, eq=False)
class Start:
    """A start of an effect beside a fitted model: what it would gain, were all of it linear."""

    added: AddedEffect
    x: Floats
    gain: float  # part of the sum of squares, fitted samples


def linearised_gain(fitted: Fitted, added: AddedEffect, values: Values, *, sized: bool = False) -> Start | None:
    """Judge a start of an effect by one run of the model with it; None where it cannot be run or changes nothing.

    The change of the angle, as it is or in any size, and of all that is fitted already, linearly, is fitted to the
    residual. The start takes the other constants along. Values may name constants of the declared model, too. Where
    another size promises more, constants that are linear get it, once (``sized``).
    """
    holdout = fitted.holdout
    model = Model(fitted.model.problem, (*fitted.model.added, added))
    baseline, more = fitted.model.values(fitted.x)
    baseline = {name: values.get(name, value) for name, value in baseline.items()}
    low, high = model.bounds()
    x = np.clip(model.row(baseline, [*more, values]), low + _INSIDE, high - _INSIDE)
    try:
        change = (holdout.row(model.errors(x)) - fitted.row)[holdout.seen]
    except (SolverError, RigError):
        return None
    if not np.isfinite(change).all() or np.abs(change).max() < _NOTHING:
        return None
    own = fitted.jacobian[holdout.seen]
    whole = float(fitted.train @ fitted.train)
    others = solve(own, -(fitted.train + change))
    left = fitted.train + change + own @ others
    gain = 1 - float(left @ left) / whole
    best = Start(added, _moved(x, others, low, high), gain)
    moves = solve(np.column_stack([own, change]), -fitted.train)
    size = float(moves[-1])
    if size <= 0:
        return best
    left = fitted.train + np.column_stack([own, change]) @ moves
    if (linear := 1 - float(left @ left) / whole) <= gain:
        return best
    best = Start(added, _moved(x, moves[:-1] * min(1.0, _FURTHEST / size), low, high), linear)
    if sized or not any(c.linear for c in added.form.parameters) or 1 / _FURTHEST < size < _FURTHEST:
        return best
    by = {c.name: min(size, _MOST_TIMES) if c.linear else 1.0 for c in added.form.parameters}
    other = linearised_gain(fitted, added, {name: v * by.get(name, 1.0) for name, v in values.items()}, sized=True)
    return other if other is not None and other.gain > _AS_PROMISED * linear else best


def together(added: AddedEffect, starts: Sequence[Values]) -> list[Values]:
    """Give starts in which all constants that are linear have a size, one for each choice of the others.

    None where there is at most one such constant, which :func:`promise` finds the size of.
    """
    linear = [c.name for c in added.form.parameters if c.linear and not c.log]
    groups: dict[tuple[tuple[str, float], ...], dict[str, float]] = {}
    for values in starts if len(linear) > 1 else ():
        others = tuple(sorted((name, value) for name, value in values.items() if name not in linear))
        sizes = groups.setdefault(others, dict.fromkeys(linear, 0.0))
        sizes.update({name: max(sizes[name], abs(values[name])) for name in linear})
    return [{**dict(others), **sizes} for others, sizes in groups.items() if all(sizes.values())]


def joint_linearised_gain(fitted: Fitted, added: AddedEffect, sizes: Values) -> Start | None:
    """Judge a start whose linear constants get the sizes and signs that promise most together, each tried by itself.

    A tilted camera's gain and perspective promise little one by one, since each fits the other's part badly.
    """
    model = Model(fitted.model.problem, (*fitted.model.added, added))
    baseline, more = fitted.model.values(fitted.x)
    baseline = {name: sizes.get(name, value) for name, value in baseline.items()}
    linear = [c.name for c in added.form.parameters if c.linear and not c.log]
    low, high = model.bounds()
    none = {**sizes, **dict.fromkeys(linear, 0.0)}

    def at(values: Values) -> Floats:
        x = np.clip(model.row(baseline, [*more, values]), low + _INSIDE, high - _INSIDE)
        return fitted.holdout.row(model.errors(x))[fitted.holdout.seen]

    try:
        without = at(none)
        changes = np.column_stack([at({**none, name: sizes[name]}) - without for name in linear])
    except (SolverError, RigError):
        return None
    if not np.isfinite(changes).all() or (np.abs(changes).max(axis=0) < _NOTHING).any():
        return None
    moves = solve(np.column_stack([fitted.jacobian[fitted.holdout.seen], changes]), -without)
    found = np.clip(moves[-len(linear) :], -_MOST_TIMES, _MOST_TIMES)
    values = {**sizes, **{name: sizes[name] * float(k) for name, k in zip(linear, found, strict=True)}}
    return linearised_gain(fitted, added, values, sized=True)


def _moved(x: Floats, others: Floats, low: Floats, high: Floats) -> Floats:
    """Take the constants that were there along, by no more than their size each."""
    x = x.copy()
    x[: others.size] += np.clip(others, -1.0, 1.0)
    return np.clip(x, low + _INSIDE, high - _INSIDE)


def solve(columns: Floats, target: Floats) -> Floats:
    """Least squares of columns that differ in size, shapes (m, p), (m,) -> (p,)."""
    scale = np.maximum(np.linalg.norm(columns, axis=0), 1e-12)
    return np.asarray(np.linalg.lstsq(columns / scale, target, rcond=1e-8)[0] / scale)


def correlation_of_neighbours(errors: Sequence[Floats]) -> float:
    """First-order autocorrelation along the records, between 0 and 0.99."""
    over = sum(float(e[1:] @ e[:-1]) for e in errors)
    under = sum(float(e @ e) for e in errors)
    return min(max(over / under if under > 0 else 0.0, 0.0), 0.99)


def independent(samples: int, correlation: float, branches: int) -> float:
    """Count the samples that are as good as independent: m (1 - r)/(1 + r) of a first-order autoregression.

    A branch of the path counts for eight at least, about the constants of a smooth curve.
    """
    return max(min(samples, _OF_BRANCH * branches), samples * (1 - correlation) / (1 + correlation))


def bic(square: float, parameters: int, samples: float) -> float:
    """Bayesian information criterion of a mean square error (Schwarz 1978, doi 10.1214/aos/1176344136)."""
    return samples * math.log(max(square, 1e-300)) + parameters * math.log(samples)
