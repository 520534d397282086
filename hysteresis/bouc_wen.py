"""Improved Bouc-Wen law (paper, eq. 6-7): theta = f + h, with h a function of the path of f alone.

The law is rate independent, so between two samples of f it is an autonomous equation in one variable.
With the saturation S = (|A| / (beta + gamma))^(1/n), the path counted in units of S / |A| and y = h / S
taken positive in the direction of motion, it reads

    dy/ds = 1 - y^n            for y > 0,
    dy/ds = 1 + kappa |y|^n    for y < 0,    kappa = (beta - gamma) / (beta + gamma).

The kernel follows that flow by Taylor series of adaptive order and step, and crosses y = 0, where |y|^n has no
Taylor series, by the convergent series of its exact integral. The error of a step is near rounding, whatever
the sampling of the path.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, fields

import numpy as np
from numba import njit, prange
from numpy.typing import ArrayLike, NDArray
from scipy.optimize import brentq
from scipy.special import hyp2f1

Floats = NDArray[np.float64]

_ORDER = 16  # highest power of the Taylor series
_TOLERANCE = 1e-13  # of y, which is of order 1
_EDGE = 0.25  # below this value of |g| |y|^n the series of the exact integral is used
_SATURATED = 42.0  # after this much path 1 - y is below exp(-41) for every n >= 1 and kappa >= 0


@dataclass(frozen=True)
class BoucWen:
    """Parameters of the improved Bouc-Wen law, angles in degrees.

    Parameters
    ----------
    A
        Slope dh/df at h = 0. Its sign is the sign of the loop: h = sign(A) z, where z obeys eq. 7 with |A|.
        A > 0 leads (h and f rise together, as eq. 7 is printed), A < 0 lags: the same loop, mirrored.
    beta, gamma
        Shape of the loop, deg^-n.
    n
        Sharpness of the way into saturation.
    h0_deg
        h at the first sample of the path.

    Notes
    -----
    Eq. 7 with a negative A put in as it stands has no saturation of its own: the mirror is what a lagging
    measurement needs.
    """

    A: float
    beta: float
    gamma: float
    n: float
    h0_deg: float = 0.0

    def __post_init__(self) -> None:
        for f in fields(self):
            value = getattr(self, f.name)
            if not math.isfinite(value):
                raise ValueError(f"BoucWen.{f.name} = {value}: expected a finite number")

    @property
    def saturation_deg(self) -> float:
        """Largest |h| that a path can reach, (|A| / (beta + gamma))^(1/n); infinite for beta + gamma <= 0."""
        total = self.beta + self.gamma
        return (abs(self.A) / total) ** (1 / self.n) if total > 0 else math.inf

    def is_admissible(self) -> bool:
        """Tell whether h is bounded and the loop dissipates: beta + gamma > 0, -beta <= gamma <= beta, n >= 1.

        Ismail, Ikhouane, Rodellar 2009, doi 10.1007/s11831-009-9031-8.
        """
        return self.beta + self.gamma > 0 and -self.beta <= self.gamma <= self.beta and self.n >= 1

    def row(self) -> NDArray[np.float64]:
        """Parameters as a row (A, beta, gamma, n, h0_deg) of :func:`hysteresis_batch`, shape (5,)."""
        return np.array([getattr(self, f.name) for f in fields(self)], dtype=float)


def hysteresis(f_deg: ArrayLike, model: BoucWen) -> NDArray[np.float64]:
    """Hysteretic angle h along a path of f.

    Parameters
    ----------
    f_deg
        Shape (m,), the single-valued angle f(x) in the order in which it was visited, deg.
    model
        Its parameters; ``model.h0_deg`` is h at the first sample.

    Returns
    -------
    NDArray
        Shape (m,), h in deg. The angle of the manipulator is f + h (eq. 6).

    Raises
    ------
    ValueError
        For a path that is not a row of finite numbers, an inadmissible model, or an initial state beyond
        saturation.
    """
    return hysteresis_batch(f_deg, model.row()[np.newaxis])[0]


def hysteresis_batch(f_deg: ArrayLike, parameters: ArrayLike) -> NDArray[np.float64]:
    """Hysteretic angle of many parameter sets along one path, in parallel.

    Parameters
    ----------
    f_deg
        Shape (m,), path of f in deg.
    parameters
        Shape (k, 5), rows (A, beta, gamma, n, h0_deg).

    Returns
    -------
    NDArray
        Shape (k, m), h in deg.

    Raises
    ------
    ValueError
        As :func:`hysteresis`; the message names the first bad row.
    """
    path = np.ascontiguousarray(f_deg, dtype=float)
    rows = np.ascontiguousarray(parameters, dtype=float)
    if path.ndim != 1 or not np.isfinite(path).all():
        raise ValueError(f"f_deg of shape {path.shape}: expected a row of finite numbers")
    if rows.ndim != 2 or rows.shape[1] != 5:
        raise ValueError(f"parameters of shape {rows.shape}: expected (k, 5): A, beta, gamma, n, h0_deg")
    if path.size == 0:
        return np.empty((len(rows), 0))
    _require_admissible(rows)
    # Threads cost more to wake than a single row takes.
    return _follow_all(path, rows) if len(rows) > 1 else _follow(path, rows[0])[np.newaxis]


def _require_admissible(rows: NDArray[np.float64]) -> None:
    A, beta, gamma, n, h0 = rows.T
    total = beta + gamma
    with np.errstate(all="ignore"):
        saturation = (np.abs(A) / total) ** (1 / n)
        good = (total > 0) & (np.abs(gamma) <= beta) & (n >= 1) & np.isfinite(saturation)
        # A state on the limit may sit a rounding error beyond it.
        good &= np.abs(h0) <= saturation * (1 + 1e-9)
    if not good.all():
        i = int(np.argmin(good))
        raise ValueError(
            f"Bouc-Wen parameters {i}: A, beta, gamma, n, h0_deg = {', '.join(f'{v:g}' for v in rows[i])}: expected "
            f"beta + gamma > 0, |gamma| <= beta, n >= 1 and |h0_deg| <= (|A| / (beta + gamma))^(1/n)"
        )


@njit(cache=True, parallel=True)
def _follow_all(path: Floats, rows: Floats) -> Floats:
    out = np.empty((rows.shape[0], path.shape[0]))
    for i in prange(rows.shape[0]):
        out[i] = _follow(path, rows[i])
    return out


@njit(cache=True)
def _follow(path: Floats, row: Floats) -> Floats:
    """Follow one path with one admissible row: h, shape (m,)."""
    A, beta, gamma, n, h0 = row[0], row[1], row[2], row[3], row[4]
    out = np.zeros(path.shape[0])
    saturation = (abs(A) / (beta + gamma)) ** (1.0 / n)
    if saturation == 0.0:  # A = 0: no hysteresis
        return out
    scale = math.copysign(saturation, A)
    per_deg = abs(A) / saturation
    kappa = (beta - gamma) / (beta + gamma)
    W = np.empty(_ORDER + 1)
    P = np.empty(_ORDER + 1)
    z = min(1.0, max(-1.0, h0 / scale))
    out[0] = h0
    for j in range(1, path.shape[0]):
        df = path[j] - path[j - 1]
        if df > 0.0:
            z = _advance(z, df * per_deg, n, kappa, W, P)
        elif df < 0.0:
            z = -_advance(-z, -df * per_deg, n, kappa, W, P)
        out[j] = scale * z
    return out


@njit(cache=True)
def _advance(y: float, s: float, n: float, kappa: float, W: Floats, P: Floats) -> float:
    """Advance y, in [-1, 1], by the path s > 0 of the normalised flow. W and P are work space."""
    while s > 0.0:
        if s > _SATURATED or y >= 1.0:
            return 1.0
        size = abs(y)
        g = 1.0 if y >= 0.0 else -kappa
        power = size**n
        if abs(g) * power <= _EDGE and s > 0.25 * size:
            y, s = _through_zero(y, s, n, kappa)
            continue
        step = s if y > 0.0 else min(s, 0.5 * size / (1.0 + kappa * power))  # |y| halves at most: no way past 0
        size, step = _taylor(size, power, step, n, g, math.copysign(1.0, y), W, P)
        y = min(1.0, math.copysign(size, y))
        s -= step
    return y


@njit(cache=True)
def _taylor(
    w0: float, power: float, step: float, n: float, g: float, sign: float, W: Floats, P: Floats
) -> tuple[float, float]:
    """Take one step of dw/ds = sign (1 - g w^n), w > 0: the new w and the path it took, at most ``step``.

    W and P hold the terms (coefficient times step^k) of w and of p = w^n, which obeys w p' = n p w'.
    """
    W[0], P[0] = w0, power
    W[1] = sign * (1.0 - g * power) * step
    total = w0 + W[1]
    for k in range(1, _ORDER):
        term = 0.0
        for j in range(1, k + 1):
            term += (n * j - (k - j)) * W[j] * P[k - j]
        P[k] = term / (k * w0)
        W[k + 1] = -sign * g * step * P[k] / (k + 1)
        total += W[k + 1]
        if abs(W[k]) + abs(W[k + 1]) <= _TOLERANCE:
            return total, step
    last, before = abs(W[_ORDER]), abs(W[_ORDER - 1])
    shrink = 0.9 * min(
        1.0,
        (_TOLERANCE / max(last, _TOLERANCE)) ** (1.0 / _ORDER),
        (_TOLERANCE / max(before, _TOLERANCE)) ** (1.0 / (_ORDER - 1)),
    )
    total = W[_ORDER]
    for k in range(_ORDER - 1, -1, -1):
        total = total * shrink + W[k]
    return total, shrink * step


@njit(cache=True)
def _through_zero(y: float, s: float, n: float, kappa: float) -> tuple[float, float]:
    """Give y and the path left, in the zone around y = 0; it ends where y^n = _EDGE on the far side."""
    clock = 0.0
    if y < 0.0:
        to_zero = _clock(-y, n, -kappa)
        if s <= to_zero:
            return -_unclock(to_zero - s, n, -kappa), 0.0
        s -= to_zero
    else:
        clock = _clock(y, n, 1.0)
    # Just outside the zone, or the caller would come back here for ever.
    edge = _EDGE ** (1.0 / n) * (1.0 + 1e-12)
    to_edge = _clock(edge, n, 1.0) - clock
    if s <= to_edge:
        return _unclock(clock + s, n, 1.0), 0.0
    return edge, s - to_edge


@njit(cache=True)
def _clock(w: float, n: float, g: float) -> float:
    """Integrate dt / (1 - g t^n) from 0 to w = w sum_k (g w^n)^k / (1 + k n), for |g| w^n <= _EDGE."""
    x = g * w**n
    total, power, k = 1.0, x, 1.0
    while abs(power) > 1e-16:
        total += power / (1.0 + k * n)
        power *= x
        k += 1.0
    return w * total


@njit(cache=True)
def _unclock(t: float, n: float, g: float) -> float:
    """Invert :func:`_clock` by Newton's method, from the first two terms of its series."""
    w = t * (1.0 - g * t**n / (n + 1.0))
    for _ in range(8):
        change = (_clock(w, n, g) - t) * (1.0 - g * w**n)
        w -= change
        if abs(change) <= 1e-15 * w:
            break
    return w


def branch_closed_form(h0_deg: float, f0_deg: float, f1_deg: float, model: BoucWen) -> float:
    """Exact h at the end of a monotonic branch, by the hypergeometric function; slow, an independent check.

    The path between two states of one sign is an integral of dt / (1 - g t^n) = t 2F1(1, 1/n; 1 + 1/n; g t^n),
    which is solved for its upper end.

    Parameters
    ----------
    h0_deg
        State at the start, within the saturation; ``model.h0_deg`` is not used.
    f0_deg, f1_deg
        Ends of the branch.
    model
        Admissible parameters.

    Returns
    -------
    float
        h in deg at ``f1_deg``.
    """
    _require_admissible(np.array([[model.A, model.beta, model.gamma, model.n, h0_deg]]))
    if f1_deg == f0_deg or model.A == 0:
        return h0_deg
    n, scale = model.n, math.copysign(model.saturation_deg, model.A)
    kappa = (model.beta - model.gamma) / (model.beta + model.gamma)
    direction = math.copysign(1.0, f1_deg - f0_deg)

    def path_from_zero(y: float) -> float:
        g = 1.0 if y >= 0 else -kappa
        return y * float(hyp2f1(1.0, 1 / n, 1 + 1 / n, g * abs(y) ** n))

    start = direction * h0_deg / scale
    highest = 1 - 1e-15
    if start >= highest:
        return direction * scale
    end = path_from_zero(start) + abs(f1_deg - f0_deg) * abs(model.A / scale)
    if end >= path_from_zero(highest):
        return direction * scale
    y = brentq(lambda y: path_from_zero(y) - end, start, highest, xtol=1e-15, rtol=4 * np.finfo(float).eps)
    return direction * scale * float(y)
