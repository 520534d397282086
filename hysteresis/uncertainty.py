"""Intervals of identified parameters, from the Jacobian of the least squares at its end."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.stats import t as student

from hysteresis.backbone import Backbone
from hysteresis.search import Point, Samples, box, residual_of

Floats = NDArray[np.float64]

_CONFIDENCE = 0.95
_STEP = 1e-6  # of finite differences; the kernel of h is exact to about 1e-13
_BLIND = 1e-9  # of the largest column of the Jacobian: smaller ones are rounding
_WIDEST_LOG = 30.0  # half width of the interval of a logarithm beyond which there is no interval


@dataclass(frozen=True)
class Parameter:
    """A value with its 95 % interval; the interval is None where the data does not give one."""

    value: float
    low: float | None
    high: float | None
    unit: str

    def to_dict(self) -> dict[str, Any]:
        """Plain values for JSON."""
        return {"value": self.value, "low": self.low, "high": self.high, "unit": self.unit}

    def __str__(self) -> str:
        if self.low is None or self.high is None:
            return f"{self.value:.4g} {self.unit}"
        return f"{self.value:.4g} ({self.low:.4g} to {self.high:.4g}) {self.unit}"


@dataclass(frozen=True, eq=False)
class Uncertainty:
    """Covariance of x = (q, c), shape (5 + p, 5 + p), and what it rests on.

    ``quantile`` times a standard deviation is half an interval. ``condition`` is that of the Jacobian with columns
    of length 1: large where a change of one parameter can be made good by others. ``blind``, shape (5 + p,), marks
    what the samples do not show at all; ``effective`` is the number of independent samples that the residual is worth.
    """

    covariance: Floats
    quantile: float
    condition: float
    blind: NDArray[np.bool_]
    effective: float

    def half(self, gradient: Floats) -> float:
        """Half width of the interval of a function of x with this gradient, shape (5 + p,); may be infinite."""
        if (gradient[self.blind] != 0).any():
            return math.inf
        return self.quantile * math.sqrt(max(0.0, float(gradient @ self.covariance @ gradient)))


def uncertainty(samples: Samples, backbone: Backbone, point: Point) -> Uncertainty:
    """Covariance s^2 (J^T J)^-1 m / m_eff at the end of a polish.

    The residual of a model that lacks an effect is no white noise. Its m samples count as
    m_eff = m (1 - r) / (1 + r), r being the correlation of neighbours (first-order autoregression).
    Coefficients of f that are held by a bound (a flat piece of the curve) count as known.
    """
    residual = residual_of(samples, backbone, point.sign)
    x = np.concatenate([point.q, point.c])
    high = box(samples)[1]
    free = np.concatenate([np.ones(5, dtype=bool), point.c - backbone.low > 1e-6 * np.abs(point.c).max()])
    at_end = residual(x)
    columns = np.zeros((len(at_end), len(x)))
    for i in np.flatnonzero(free):
        step = _STEP * max(1.0, abs(x[i]))
        if i < 5 and x[i] + step > high[i]:
            step = -step
        columns[:, i] = (residual(x + step * np.eye(len(x))[i]) - at_end) / step
    norms = np.linalg.norm(columns, axis=0)
    blind = free & (norms <= _BLIND * norms.max())
    free &= ~blind
    jacobian, norms = columns[:, free], norms[free]
    m, p = jacobian.shape
    _, singular, basis = np.linalg.svd(jacobian / norms, full_matrices=False)
    largest = float(singular.max(initial=1e-300))  # there are none where the samples show nothing at all
    singular = np.maximum(singular, 1e-12 * largest)
    within = (basis.T / singular**2) @ basis / np.outer(norms, norms)
    neighbours = float(at_end[1:] @ at_end[:-1]) / max(float(at_end @ at_end), 1e-300)
    effective = m * (1 - max(0.0, neighbours)) / (1 + max(0.0, neighbours))
    variance = float(at_end @ at_end) / max(1, m - p) * m / max(1.0, effective)
    covariance = np.zeros((len(x), len(x)))
    covariance[np.ix_(free, free)] = variance * within
    quantile = float(student.ppf(0.5 + 0.5 * _CONFIDENCE, max(1, m - p)))
    return Uncertainty(covariance, quantile, largest / float(singular.min(initial=largest)), blind, effective)


def parameters_of(
    samples: Samples, backbone: Backbone, point: Point, spread: Uncertainty | None
) -> dict[str, Parameter]:
    """Give A, beta, gamma, n, h0_deg, saturation_deg and the coefficients of f with their intervals.

    Without a spread the intervals are None. Intervals of A, n and the saturation end at the bounds of the search.
    Where h = 0 (sign 0) those of its parameters are None.
    """
    low, high = box(samples)
    model, q, size = point.model, point.q, len(point.q) + len(point.c)
    saturation, rho = math.exp(q[1]) if point.sign else 0.0, float(q[3])

    def along(*entries: float, at: int = 0) -> Floats:
        gradient = np.zeros(size)
        gradient[at : at + len(entries)] = entries
        return gradient

    def plain(value: float, gradient: Floats, unit: str) -> Parameter:
        half = math.inf if spread is None else spread.half(gradient)
        if not math.isfinite(half):
            return Parameter(value, None, None, unit)
        return Parameter(value, value - half, value + half, unit)

    def positive(value: float, gradient: Floats, unit: str, ends: tuple[float, float] | None = None) -> Parameter:
        """Interval of the logarithm; ``ends`` bound it."""
        half = math.inf if spread is None else spread.half(gradient)
        if spread is None or value == 0 or (ends is None and half > _WIDEST_LOG):
            return Parameter(value, None, None, unit)
        log_low, log_high = math.log(value) - half, math.log(value) + half
        if ends is not None:
            log_low, log_high = max(log_low, ends[0]), min(log_high, ends[1])
        return Parameter(value, math.exp(log_low), math.exp(log_high), unit)

    of_log_beta = along(1.0, -model.n, -model.n * q[1], -1 / (1 + rho))
    slope = positive(abs(model.A), along(1.0), "1", (low[0], high[0]))
    if point.sign < 0:
        slope = Parameter(
            model.A,
            None if slope.high is None else -slope.high,
            None if slope.low is None else -slope.low,
            "1",
        )
    found = {
        "A": slope,
        "beta": positive(model.beta, of_log_beta, "deg^-n"),
        "gamma": plain(model.gamma, model.beta * (rho * of_log_beta + along(1.0, at=3)), "deg^-n"),
        "n": positive(model.n, along(1.0, at=2), "1", (low[2], high[2])),
        "h0_deg": plain(model.h0_deg, along(model.h0_deg, at=1) + along(saturation, at=4), "deg"),
        "saturation_deg": positive(saturation, along(1.0, at=1), "deg", (low[1], high[1])),
    }
    if point.sign == 0:
        found = {name: replace(parameter, low=None, high=None) for name, parameter in found.items()}
    for i, (name, unit) in enumerate(zip(backbone.names, backbone.units, strict=True)):
        found[name] = plain(float(point.c[i]), along(1.0, at=5 + i), unit)
    return found
