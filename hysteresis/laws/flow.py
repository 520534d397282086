"""The flow dy/ds = 1 - y^n for y > 0, 1 + kappa |y|^n for y < 0: any Bouc-Wen law on a monotonic branch.

s is the path, y the state, positive in the direction of motion. Three charts cover the range of y:

- around y = 0, where |y|^n has no Taylor series: y = t R(g |t|^n), with the path t from zero, g = 1 above zero and
  -kappa below. The coefficients of R depend on n alone, and t advances with the path;
- near saturation: y = Y(u), and u decays exactly as exp(-n s). The coefficients of Y depend on n alone;
- elsewhere: Taylor series of adaptive order and step.

All errors are near rounding for any sampling of the path. The coordinate of a chart is kept from sample to sample.
"""

from __future__ import annotations

import math

import numpy as np
from numba import njit

from hysteresis.arrays import Floats

ORDER = 24  # highest power of R and Y
_TAYLOR_ORDER = 16
_TOLERANCE = 1e-13  # of y, which is of order 1
_LAST_TERM = 1e-14  # of a series at the limit of its chart
_EDGE = 0.3  # largest |g| |t|^n of the chart around zero: the exact integral also converges fast there
_SATURATED = 1e-17  # u below which y is 1
_LARGEST_U = 0.9  # of the chart of saturation, if its series is not limited by its terms (n = 1)

_OVER = 1.0 / np.maximum(1.0, np.arange(ORDER + 2.0))  # 1 / k, tabulated because divisions are slow
R, Y, LIMITS, W, P = range(5)  # rows of a work space, shape (5, ORDER + 1)
T_ABOVE, Y_ABOVE, T_BELOW, Y_BELOW, U_TOP, Y_TOP, Y_OVER = range(7)  # entries of its row LIMITS
FREE, ZERO, TOP = range(3)  # charts


@njit(cache=True)
def workspace(n: float) -> Floats:
    """Compute the series of the two charts for one n >= 1, and their limits; :func:`set_kappa` adds the others."""
    work = np.empty((5, ORDER + 1))
    r, y, p = work[R], work[Y], work[P]
    # dy/dt = 1 - g y^n, and p = r^n obeys r p' = n p r'.
    r[0] = 1.0
    for k in range(ORDER):
        power = 0.0
        for j in range(1, k + 1):
            power += (n * j - (k - j)) * r[j] * p[k - j]
        p[k] = power * _OVER[k] if k > 0 else 1.0
        r[k + 1] = -p[k] / (1.0 + (k + 1) * n)
    # u dy/du = -(1 - p) / n with p = y^n, so p_k = n k y_k; the scale of u is free: y = 1 - u + ...
    y[0], y[1] = 1.0, -1.0
    for k in range(2, ORDER + 1):
        power = 0.0
        for j in range(1, k):
            power += j * (n * (k - j) - j) * y[j] * y[k - j]
        y[k] = power * _OVER[k] * _OVER[k - 1]
    limits = work[LIMITS]
    limits[U_TOP] = min(_LARGEST_U, _radius(y))
    limits[Y_TOP], limits[Y_OVER] = _series(y, limits[U_TOP]), _series(y, -limits[U_TOP])
    x = min(_EDGE, _radius(r))
    limits[T_ABOVE] = x ** (1.0 / n)
    limits[Y_ABOVE] = limits[T_ABOVE] * _series(r, x)
    return work


@njit(cache=True)
def set_kappa(work: Floats, n: float, kappa: float) -> None:
    """Set the limits of the chart around zero for y < 0."""
    limits = work[LIMITS]
    limits[T_BELOW] = limits[Y_BELOW] = math.inf
    if kappa > 0.0:
        limits[T_BELOW] = limits[T_ABOVE] * kappa ** (-1.0 / n)
        limits[Y_BELOW] = limits[T_BELOW] * _series(work[R], -(limits[T_ABOVE] ** n))


@njit(cache=True)
def advance(
    y: float, chart: int, place: float, s: float, n: float, kappa: float, work: Floats
) -> tuple[float, int, float]:
    """Advance the state y by the path s > 0; return the new y, its chart and its coordinate there.

    ``chart`` and ``place`` are the results of the previous step in the same direction; the chart is FREE after a
    reversal.
    """
    limits = work[LIMITS]
    while s > 0.0:
        if chart == TOP:
            if abs(place) < _SATURATED:
                return 1.0, TOP, 0.0
            place *= math.exp(-n * s)
            return _series_near(work[Y], place, limits[U_TOP]), TOP, place
        if chart == ZERO:
            place += s
            if place <= limits[T_ABOVE]:
                return _around_zero(place, n, kappa, work[R]), ZERO, place
            # Just outside the chart, so that the loop does not enter it again.
            chart, s, y = FREE, place - limits[T_ABOVE], limits[Y_ABOVE] * (1.0 + 1e-12)
        if limits[Y_TOP] <= y <= limits[Y_OVER]:
            chart, place = TOP, _decay_place(y, n, work[Y])
        elif -limits[Y_BELOW] <= y <= limits[Y_ABOVE]:
            chart, place = ZERO, _path_from_zero(y, n, kappa)
        else:
            size = abs(y)
            power = size**n
            g = 1.0 if y > 0.0 else -kappa
            step = (
                s if y > 0.0 else min(s, 0.5 * size / (1.0 + kappa * power))
            )  # |y| at most halves, so that no step crosses 0
            size, step = _taylor(size, power, step, n, g, math.copysign(1.0, y), work[W], work[P])
            y, s = math.copysign(size, y), s - step
    return y, chart, place


@njit(cache=True)
def _radius(series: Floats) -> float:
    """Return the largest argument at which the last terms of a power series are at most _LAST_TERM."""
    last = 0.0
    for k in range(ORDER - 2, ORDER + 1):
        last = max(last, abs(series[k]) ** (1.0 / k))
    return _LAST_TERM ** (1.0 / ORDER) / last if last > 0.0 else math.inf


@njit(cache=True, fastmath={"contract"})
def _series(series: Floats, x: float, order: int = ORDER) -> float:
    """Sum a power series to an even order; even and odd powers apart, so that a processor computes them in parallel."""
    square = x * x
    even, odd = series[order], series[order - 1]
    for k in range(order - 2, 0, -2):
        even = even * square + series[k]
        odd = odd * square + series[k - 1]
    return even * square + series[0] + odd * x


@njit(cache=True)
def _series_near(series: Floats, x: float, limit: float) -> float:
    """Sum only the significant terms: the last one is at most about _LAST_TERM at the limit."""
    size = abs(x)
    if size > 0.06 * limit:
        return _series(series, x)
    return _series(series, x, 10) if size > 3e-4 * limit else _series(series, x, 4)


@njit(cache=True)
def _around_zero(t: float, n: float, kappa: float, series: Floats) -> float:
    return t * _series(series, t**n if t > 0.0 else -kappa * (-t) ** n)


@njit(cache=True)
def _path_from_zero(y: float, n: float, kappa: float) -> float:
    """Integrate dy / (1 - g |y|^n) from zero: y sum_k (g |y|^n)^k / (1 + k n)."""
    x = abs(y) ** n * (1.0 if y > 0.0 else -kappa)
    total, power, k = 0.0, 1.0, 1.0
    while abs(power) > 1e-17:
        total += power / k
        power *= x
        k += n
    return y * total


@njit(cache=True)
def _decay_place(y: float, n: float, series: Floats) -> float:
    """Invert Y by Newton's method; its slope is -(1 - y^n) / (n u)."""
    u = 1.0 - y
    for _ in range(12):
        found = _series(series, u)
        slope = (1.0 - found**n) / (n * u) if abs(u) > 1e-3 else 1.0 - (n - 1.0) * u
        change = (found - y) / slope
        u += change
        if abs(change) <= 1e-8:  # the next change would be about its square
            break
    return u


@njit(cache=True)
def _taylor(
    w0: float, power: float, step: float, n: float, g: float, sign: float, W: Floats, P: Floats
) -> tuple[float, float]:
    """Take one step of dw/ds = sign (1 - g w^n), w > 0; return the new w and the length of the step, at most ``step``.

    W and P hold the terms (coefficient times step^k) of w and of p = w^n, which obeys w p' = n p w'.
    """
    W[0], P[0] = w0, power
    over_w0, scale = 1.0 / w0, -sign * g * step
    W[1] = sign * (1.0 - g * power) * step
    total = w0 + W[1]
    for k in range(1, _TAYLOR_ORDER):
        term = 0.0
        for j in range(1, k + 1):
            term += ((n + 1.0) * j - k) * W[j] * P[k - j]
        P[k] = term * over_w0 * _OVER[k]
        W[k + 1] = scale * P[k] * _OVER[k + 1]
        total += W[k + 1]
        if abs(W[k]) + abs(W[k + 1]) <= _TOLERANCE:
            return total, step
    last, before = abs(W[_TAYLOR_ORDER]), abs(W[_TAYLOR_ORDER - 1])
    shrink = 0.9 * min(
        1.0,
        (_TOLERANCE / max(last, _TOLERANCE)) ** (1.0 / _TAYLOR_ORDER),
        (_TOLERANCE / max(before, _TOLERANCE)) ** (1.0 / (_TAYLOR_ORDER - 1)),
    )
    total = W[_TAYLOR_ORDER]
    for k in range(_TAYLOR_ORDER - 1, -1, -1):
        total = total * shrink + W[k]
    return total, shrink * step
