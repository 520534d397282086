"""Least squares of one record with one Bouc-Wen element by forward derivatives, compiled.

The unknowns are those of :mod:`hysteresis.fitting.form`, x = (q, c), with f linear in c. The method is that of
Levenberg and Marquardt with the scaling of More (1978, doi 10.1007/BFb0067700) and the damping of Nielsen (1999,
IMM-REP-1999-05); unknowns at a bound that the gradient pushes on rest there, and steps end at the bounds.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np
from numba import njit

from hysteresis.arrays import Floats, Mask
from hysteresis.fitting.form import Form, Point
from hysteresis.fitting.samples import Samples
from hysteresis.laws.bouc_wen_derivatives import CONSTANTS, follow_with_derivatives
from hysteresis.laws.elements import BOUC_WEN

_STEPS = 100
_FIRST_DAMPING, _MOST_DAMPING = 1e-3, 1e12
_LEAST_GAIN = 1e-4  # of what the linear model promises, for a step to be taken


@dataclass(frozen=True, eq=False)
class Problem:
    """A record for the compiled least squares.

    ``origin`` and ``columns``, shapes (m,) and (m, p): f = origin + columns @ c at every sample. ``train`` marks the
    samples whose angles count.
    """

    origin: Floats
    columns: Floats
    angle_deg: Floats
    train: Mask

    @classmethod
    def of(cls, samples: Samples, form: Form) -> Problem:
        """Take the samples of the one record of a form that :func:`is_forward` accepts."""
        backbone = form.backbones[0]
        f, none = backbone.at(samples.drive), np.zeros(len(backbone.start))
        origin = np.ascontiguousarray(f(none), dtype=float)
        columns = np.ascontiguousarray(backbone.jacobian(samples.drive, none))
        return cls(origin, columns, np.ascontiguousarray(samples.angle_deg), np.ascontiguousarray(samples.train))

    def linearised(self, sign: float, x: Floats) -> tuple[Floats, Floats]:
        """Residual at the training samples and its derivatives by x, shapes (m,) and (m, s + p)."""
        residual, jacobian = _linearised(self.origin, self.columns, self.angle_deg, sign, x)
        return residual[self.train], jacobian[self.train]


def is_forward(form: Form) -> bool:
    """Tell whether a form asks for forward derivatives, and is one that has them."""
    plain = form.base_law is BOUC_WEN and form.elements == 1 and form.groups == (0,) and form.longest_delay_s == 0
    return form.forward and plain and form.backbones[0].linear


def polish_forward(
    samples: Samples, form: Form, point: Point, held: Mapping[int, float] | None, tolerance: float
) -> tuple[Point, int]:
    """Do what :func:`hysteresis.fitting.search.polish` does, for a form that :func:`is_forward` accepts."""
    low, high = bounds_of(samples, form)
    whole, free = np.concatenate([point.q, point.c]), np.ones(form.size + len(point.c), dtype=bool)
    for i, value in (held or {}).items():
        whole[i], free[i] = value, False
    problem = Problem.of(samples, form)
    x, _, calls = descend(problem, point.sign, np.clip(whole, low, high), (low, high), free, tolerance)
    return replace(point, q=x[: form.size].copy(), c=x[form.size :].copy()), calls


def bounds_of(samples: Samples, form: Form) -> tuple[Floats, Floats]:
    """Bounds of x, shapes (s + p,)."""
    low, high = form.bounds(samples)
    return np.concatenate([low, form.backbones[0].low]), np.concatenate([high, form.backbones[0].high])


def descend(
    problem: Problem, sign: float, start: Floats, bounds: tuple[Floats, Floats], free: Mask, tolerance: float
) -> tuple[Floats, float, int]:
    """Minimise the sum of squares over the unknowns that are ``free``; give x, the sum and the evaluations."""
    data = problem.origin, problem.columns, problem.angle_deg, problem.train
    found: tuple[Floats, float, int] = _descend(data, sign, start.copy(), bounds, free, tolerance)
    return found


@njit(cache=True)
def _linearised(origin: Floats, columns: Floats, angle: Floats, sign: float, x: Floats) -> tuple[Floats, Floats]:
    m, p = columns.shape
    path = origin.copy()
    for j in range(m):
        for k in range(p):
            path[j] += columns[j, k] * x[CONSTANTS + k]
    h, jacobian = follow_with_derivatives(path, columns, sign, x[:CONSTANTS])
    for j in range(m):
        for k in range(p):
            jacobian[j, CONSTANTS + k] += columns[j, k]
    return path + h - angle, jacobian


@njit(cache=True)
def _normal(residual: Floats, jacobian: Floats, train: Mask) -> tuple[float, Floats, Floats]:
    """Sum of squares, gradient (of half of it) and normal matrix over the training samples."""
    size = jacobian.shape[1]
    total, gradient, matrix = 0.0, np.zeros(size), np.zeros((size, size))
    for j in range(residual.size):
        if not train[j]:
            continue
        total += residual[j] * residual[j]
        for a in range(size):
            of_a = jacobian[j, a]
            gradient[a] += of_a * residual[j]
            for b in range(a + 1):
                matrix[a, b] += of_a * jacobian[j, b]
    for a in range(size):
        for b in range(a):
            matrix[b, a] = matrix[a, b]
    return total, gradient, matrix


@njit(cache=True)
def _step(
    matrix: Floats, gradient: Floats, scale: Floats, damping: float, moving: Mask, low: Floats, high: Floats
) -> Floats:
    """Damped step between bounds: what would pass one goes to it, and the others are solved for again."""
    size = gradient.size
    step, free = np.zeros(size), moving.copy()
    for _ in range(size):
        at = np.flatnonzero(free)
        if at.size == 0:
            break
        right = -(gradient + matrix @ np.where(free, 0.0, step))
        inner, aim = np.empty((at.size, at.size)), np.empty(at.size)
        for a in range(at.size):
            aim[a] = right[at[a]] / scale[at[a]]
            for b in range(at.size):
                inner[a, b] = matrix[at[a], at[b]] / (scale[at[a]] * scale[at[b]])
            inner[a, a] += damping
        found, passed = np.linalg.solve(inner, aim), False
        for a in range(at.size):
            k = at[a]
            step[k] = found[a] / scale[k]
            if not low[k] <= step[k] <= high[k]:
                step[k], free[k], passed = min(high[k], max(low[k], step[k])), False, True
        if not passed:
            break
    return step


@njit(cache=True)
def _descend(
    data: tuple[Floats, Floats, Floats, Mask],
    sign: float,
    x: Floats,
    bounds: tuple[Floats, Floats],
    free: Mask,
    tolerance: float,
) -> tuple[Floats, float, int]:
    (origin, columns, angle, train), (low, high), size = data, bounds, x.size
    residual, jacobian = _linearised(origin, columns, angle, sign, x)
    total, gradient, matrix = _normal(residual, jacobian, train)
    scale, damping, growth, calls = np.zeros(size), _FIRST_DAMPING, 2.0, 1
    while calls < _STEPS:
        moving = np.zeros(size, dtype=np.bool_)
        for k in range(size):
            scale[k] = max(scale[k], np.sqrt(matrix[k, k]))
            held = (x[k] <= low[k] and gradient[k] > 0.0) or (x[k] >= high[k] and gradient[k] < 0.0)
            moving[k] = free[k] and not held and scale[k] > 0.0
        if not moving.any():
            break
        step = _step(matrix, gradient, scale, damping, moving, low - x, high - x)
        longest = np.max(np.abs(step) / np.maximum(1.0, np.abs(x)))
        if longest <= tolerance:
            break
        promised = -2.0 * (gradient @ step) - step @ (matrix @ step)
        after, after_jacobian = _linearised(origin, columns, angle, sign, x + step)
        after_total, after_gradient, after_matrix = _normal(after, after_jacobian, train)
        calls += 1
        gain = (total - after_total) / promised if promised > 0.0 else -1.0
        if gain > _LEAST_GAIN:
            x = x + step
            done = total - after_total <= tolerance * total and gain > 0.25
            total, gradient, matrix = after_total, after_gradient, after_matrix
            damping *= max(1.0 / 3.0, 1.0 - (2.0 * gain - 1.0) ** 3)
            growth = 2.0
            if done:
                break
        else:
            damping *= growth
            growth *= 2.0
            if damping > _MOST_DAMPING:
                break
    return x, total, calls
