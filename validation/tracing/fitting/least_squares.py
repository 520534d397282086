"""Bounded least squares of a model, with derivatives by finite differences."""

from __future__ import annotations

from dataclasses import dataclass, field
from functools import partial
from typing import Any

import numpy as np
from scipy.optimize import least_squares

from fem_models.rig import RigError
from fem_models.rig.checks import SolverError
from hysteresis.arrays import Floats
from validation.tracing.fitting.fitted import ChannelErrors, Fitted
from validation.tracing.fitting.holdout import Holdout
from validation.tracing.fitting.model import Model
from validation.tracing.settings import CONVERGED, DIFFERENCE_STEP, INFEASIBLE_DEG, INSIDE_BOUNDS, STEPS
from validation.tracing.threads import in_threads


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
    at: tuple[bytes, Any] = (b"", None)  # the last point, and what its derivatives go on from

    def errors(self, x: Floats) -> Floats:
        """Errors of all samples, shape (m,); large where there is no solution."""
        if (key := x.tobytes()) not in self.visited:
            try:
                self.begin(x)
            except (SolverError, RigError):
                masks = self.holdout.series_masks(len(self.model.problem.channels))
                self.visited[key] = np.full(sum(mask.size for mask in masks), INFEASIBLE_DEG)
        return self.visited[key]

    def begin(self, x: Floats) -> None:
        """Evaluate the errors at a point that may have no solution.

        Raises
        ------
        SolverError, RigError
            As :meth:`validation.tracing.fitting.model.Model.errors`.
        """
        self.calls += 1
        errors, followed = self.model.followed(x, self.threads)
        self.visited[x.tobytes()], self.at = self.holdout.stacked(errors), (x.tobytes(), followed)

    def jacobian(self, x: Floats) -> Floats:
        """Differentiate all errors, shape (m, p)."""
        known = self.known if self.latest is None else None
        self.calls += x.size - (0 if known is None else known.shape[1])
        errors, (key, followed) = self.errors(x), self.at
        there = followed if key == x.tobytes() else None
        self.latest = differentiate(self.model, self.holdout, x, errors, self.threads, known, there)
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
        For runs of the records and for derivatives.
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
    own, weight = model.baseline_size, model.problem.prior_weight_deg
    train = np.concatenate(holdout.series_masks(len(model.problem.channels)))
    mean = start[:own] if prior_mean is None else prior_mean
    at = _Evaluations(model, holdout, threads, known)
    at.begin(start)  # raises where there is no solution; later points count as far off

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
    sizes, angle = [mask.size for mask in holdout.series_masks(len(model.problem.channels))], holdout.train_mask.size
    series = np.split(errors, np.cumsum(sizes)[:-1])
    of_angle, others = tuple(series[: len(holdout.train)]), tuple(series[len(holdout.train) :])
    channels = ChannelErrors(others, jacobian[angle:]) if others else None
    return Fitted(model, holdout, x, of_angle, jacobian[:angle], evaluations, channels)


def differentiate(
    model: Model,
    holdout: Holdout,
    x: Floats,
    errors: Floats,
    threads: int,
    known: Floats | None = None,
    followed: Any = None,
) -> Floats:
    """Differentiate all errors, shape (m, p), by one-sided differences away from the nearer bound, in threads.

    A rig is moved along the steps of its run, see :mod:`fem_models.chain.moved`; other models are run once a column.

    Parameters
    ----------
    errors
        Errors at ``x``, shape (m,).
    known
        First columns, where they need not be computed again.
    followed
        Of :meth:`Model.followed` at ``x``, where the model was just run there.
    """
    known = np.empty((errors.size, 0)) if known is None else known
    low, high = model.bounds()
    steps = np.where(high - x >= x - low, DIFFERENCE_STEP, -DIFFERENCE_STEP)[known.shape[1] :]
    points = [x + step * unit for step, unit in zip(steps, np.eye(x.size)[known.shape[1] :], strict=True)]
    if points and followed is None:
        followed = model.followed(x, threads)[1]
    if followed is None:
        moved = in_threads(partial(_errors_at, model), points, threads)
    else:
        moved = model.moved_errors(followed, points, threads)
    columns = [
        np.zeros_like(errors) if own is None else (holdout.stacked(own) - errors) / step
        for own, step in zip(moved, steps, strict=True)
    ]
    return np.column_stack([known, *columns])


def _errors_at(model: Model, x: Floats) -> list[Floats] | None:
    try:
        return model.errors(x)
    except (SolverError, RigError):
        return None


def solve(columns: Floats, target: Floats) -> Floats:
    """Linear least squares of columns of different magnitude, shapes (m, p), (m,) -> (p,)."""
    scale = np.maximum(np.linalg.norm(columns, axis=0), 1e-12)
    return np.asarray(np.linalg.lstsq(columns / scale, target, rcond=1e-8)[0] / scale)
