"""Bounded least squares of a model, with derivatives by finite differences."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, field

import numpy as np
from scipy.optimize import least_squares

from fem_models.rig import RigError
from fem_models.rig.checks import SolverError
from hysteresis.arrays import Floats
from validation.tracing.fitting.fitted import ChannelErrors, Fitted
from validation.tracing.fitting.holdout import Holdout
from validation.tracing.fitting.model import Model
from validation.tracing.settings import CONVERGED, DIFFERENCE_STEP, INFEASIBLE_DEG, INSIDE_BOUNDS, STEPS


@dataclass(eq=False)
class _Evaluations:
    """Errors and derivatives of a model at the points that the solver visits.

    The solver asks for a Jacobian where it has been: errors are kept by coordinates.
    """

    model: Model
    holdout: Holdout
    threads: int
    known: Floats | None
    calls: int = 0
    latest: Floats | None = None  # Jacobian of all samples, of which the solver gets the training rows
    visited: dict[bytes, Floats] = field(default_factory=dict)

    def errors(self, x: Floats) -> Floats:
        """Errors of all samples, shape (m,); large where there is no solution."""
        if (key := x.tobytes()) not in self.visited:
            self.calls += 1
            try:
                self.visited[key] = self.holdout.stacked(self.model.errors(x))
            except (SolverError, RigError):
                series = 1 + len(self.model.problem.channels)
                self.visited[key] = np.full(series * self.holdout.train_mask.size, INFEASIBLE_DEG)
        return self.visited[key]

    def jacobian(self, x: Floats) -> Floats:
        """Differentiate all errors, shape (m, p)."""
        known = self.known if self.latest is None else None
        self.calls += x.size - (0 if known is None else known.shape[1])
        self.latest = differentiate(self.model, self.holdout, x, self.errors(x), self.threads, known)
        return self.latest


def fit(
    model: Model,
    holdout: Holdout,
    start: Floats,
    *,
    threads: int = 2,
    most_steps: int = STEPS,
    known: Floats | None = None,
    prior_mean: Floats | None = None,
) -> Fitted:
    """Fit all parameters together to the training samples (trust region reflective, scipy).

    Parameters
    ----------
    start
        Coordinates, shape (p,).
    threads
        For the derivatives.
    most_steps
        Least-squares steps at most.
    known
        Derivatives by the first k coordinates, accurate enough for the first step, shape (m, k).
    prior_mean
        Prior mean of the baseline's coordinates, shape (k,), of which
        :attr:`~validation.tracing.problem.Problem.prior_weight_deg` is the weight; the start by default.

    Raises
    ------
    SolverError, RigError
        The model has no solution at the start.
    """
    low, high = model.bounds()
    start = np.clip(start, low + INSIDE_BOUNDS, high - INSIDE_BOUNDS)
    model.errors(start)  # raises where there is no solution; later points count as far off
    own, weight = model.baseline_size, model.problem.prior_weight_deg
    train = np.tile(holdout.train_mask, 1 + len(model.problem.channels))
    mean = start[:own] if prior_mean is None else prior_mean
    at = _Evaluations(model, holdout, threads, known)

    def residual(x: Floats) -> Floats:
        errors = at.errors(x)[train]
        return np.concatenate([errors, weight * (x[:own] - mean)]) if weight else errors

    def jacobian(x: Floats) -> Floats:
        rows = np.asarray(at.jacobian(x)[train])
        return np.vstack([rows, weight * np.eye(own, x.size)]) if weight else rows

    found = least_squares(
        residual, start, jacobian, bounds=(low, high), xtol=CONVERGED, ftol=CONVERGED, max_nfev=most_steps
    )
    assert at.latest is not None
    return fitted_at(model, holdout, found.x, at.errors(found.x), at.latest, at.calls)


def fitted_at(model: Model, holdout: Holdout, x: Floats, errors: Floats, jacobian: Floats, evaluations: int) -> Fitted:
    """Make a fitted model of the errors of all samples and channels at its coordinates, and of their derivatives."""
    sizes, angle = [mask.size for mask in holdout.train], holdout.train_mask.size
    series = np.split(errors, np.cumsum(sizes * (1 + len(model.problem.channels)))[:-1])
    of_angle, others = tuple(series[: len(sizes)]), tuple(series[len(sizes) :])
    channels = ChannelErrors(others, jacobian[angle:]) if others else None
    return Fitted(model, holdout, x, of_angle, jacobian[:angle], evaluations, channels)


def differentiate(
    model: Model, holdout: Holdout, x: Floats, errors: Floats, threads: int, known: Floats | None = None
) -> Floats:
    """Differentiate all errors, shape (m, p), by one-sided differences away from the nearer bound, in threads.

    Parameters
    ----------
    errors
        Errors at ``x``, shape (m,).
    known
        First columns, where they need not be computed again.
    """
    known = np.empty((errors.size, 0)) if known is None else known
    low, high = model.bounds()

    def column(i: int) -> Floats:
        step = DIFFERENCE_STEP if high[i] - x[i] >= x[i] - low[i] else -DIFFERENCE_STEP
        moved = x.copy()
        moved[i] += step
        try:
            return (holdout.stacked(model.errors(moved)) - errors) / step
        except (SolverError, RigError):
            return np.zeros_like(errors)

    return np.column_stack([known, *_in_threads(column, range(known.shape[1], x.size), threads)])


def _in_threads(column: Callable[[int], Floats], items: Iterable[int], threads: int) -> list[Floats]:
    if threads <= 1:
        return [column(i) for i in items]
    with ThreadPoolExecutor(threads) as pool:
        return list(pool.map(column, items))


def solve(columns: Floats, target: Floats) -> Floats:
    """Linear least squares of columns of different magnitude, shapes (m, p), (m,) -> (p,)."""
    scale = np.maximum(np.linalg.norm(columns, axis=0), 1e-12)
    return np.asarray(np.linalg.lstsq(columns / scale, target, rcond=1e-8)[0] / scale)
