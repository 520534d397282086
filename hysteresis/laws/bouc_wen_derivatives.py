"""The Bouc-Wen law along a path with its derivatives, computed forward along with it, in compiled code.

Between two samples the state y, positive in the direction of motion, moves by the flow of :mod:`hysteresis.laws.flow`:
y1 = Phi(y0, s) with dy/ds = F(y). The flow is autonomous, so that dPhi/dy0 = F(y1) / F(y0) and dPhi/ds = F(y1). From
these follow, sample by sample, the derivatives of h by the initial state, by the slope and the saturation, which scale
path and angle, and by whatever moves the path. Those by log n and rho = gamma / beta are central differences of the
flow, which is exact to rounding.
"""

from __future__ import annotations

import math

import numpy as np
from numba import njit

from hysteresis.arrays import Floats
from hysteresis.laws.flow import FREE, advance, set_kappa, workspace

CONSTANTS = 5
"""Coordinates of one element: log |A|, log S, log n, rho, and the initial state h0 / S from -1 to 1."""
_STEP = 1e-5  # of log n and rho
_NEAR_ONE = 1e-9  # 1 - y^n below which the flow is exponential
_HIGHEST = math.log(1e3)  # of log n, beyond any bound


@njit(cache=True)
def _state(log_n: float, rho: float) -> tuple[float, float, Floats]:
    n = math.exp(min(_HIGHEST, log_n))
    kappa = (1.0 - rho) / (1.0 + rho)
    work = workspace(n)
    set_kappa(work, n, kappa)
    return n, kappa, work


@njit(cache=True)
def _rate(y: float, n: float, kappa: float) -> float:
    return 1.0 - y**n if y > 0.0 else 1.0 + kappa * (-y) ** n


@njit(cache=True)
def _along(path: Floats, sign: float, q: Floats, out: Floats) -> None:
    """Compute h into ``out``, shape (m,)."""
    n, kappa, work = _state(q[2], q[3])
    scale, per_deg = sign * math.exp(q[1]), math.exp(q[0] - q[1])
    y, direction, chart, place = min(1.0, max(-1.0, sign * q[4])), 1.0, FREE, 0.0
    out[0] = scale * y
    for j in range(1, path.size):
        df = path[j] - path[j - 1]
        if df * direction < 0.0:
            y, direction, chart = -y, -direction, FREE
        y, chart, place = advance(y, chart, place, abs(df) * per_deg, n, kappa, work)
        y = min(1.0, y)
        out[j] = direction * scale * y


@njit(cache=True)
def follow_with_derivatives(path: Floats, of_path: Floats, sign: float, q: Floats) -> tuple[Floats, Floats]:
    """Compute h along a path, and its derivatives.

    Parameters
    ----------
    path
        Shape (m,), f in deg.
    of_path
        Shape (m, p): derivatives of the path by p coefficients.
    sign
        Of A.
    q
        Shape (5,): log |A|, log S, log n, rho, initial state; within the bounds of a fit.

    Returns
    -------
    h
        Shape (m,), deg.
    derivatives
        Shape (m, 5 + p): by q, then by the coefficients.
    """
    m, p = of_path.shape
    h, found = np.empty(m), np.zeros((m, CONSTANTS + p))
    n, kappa, work = _state(q[2], q[3])
    scale, per_deg = sign * math.exp(q[1]), math.exp(q[0] - q[1])
    y, direction, chart, place = min(1.0, max(-1.0, sign * q[4])), 1.0, FREE, 0.0
    h[0] = scale * y
    of_y = np.zeros(CONSTANTS + p)
    of_y[4] = sign
    found[0, 1], found[0, 4] = h[0], scale * sign
    for j in range(1, m):
        df = path[j] - path[j - 1]
        if df * direction < 0.0:
            y, direction, chart = -y, -direction, FREE
            for k in range(CONSTANTS + p):
                of_y[k] = -of_y[k]
        s = abs(df) * per_deg
        before = _rate(y, n, kappa)
        y, chart, place = advance(y, chart, place, s, n, kappa, work)
        y = min(1.0, y)
        after = _rate(y, n, kappa)
        ratio = after / before if before > _NEAR_ONE and after > _NEAR_ONE else math.exp(-n * s)
        of_y[0] = ratio * of_y[0] + after * s
        of_y[1] = ratio * of_y[1] - after * s
        of_y[4] = ratio * of_y[4]
        for k in range(p):
            moved = direction * per_deg * (of_path[j, k] - of_path[j - 1, k])
            of_y[CONSTANTS + k] = ratio * of_y[CONSTANTS + k] + after * moved
        out = direction * scale
        h[j] = out * y
        found[j, 0], found[j, 1], found[j, 4] = out * of_y[0], out * of_y[1] + h[j], out * of_y[4]
        for k in range(p):
            found[j, CONSTANTS + k] = out * of_y[CONSTANTS + k]
    low, high, moved_q = np.empty(m), np.empty(m), q.copy()
    for i, least, most in ((2, 0.0, _HIGHEST), (3, -1.0, 1.0)):
        a, b = max(least, q[i] - _STEP), min(most, q[i] + _STEP)
        moved_q[i] = a
        _along(path, sign, moved_q, low)
        moved_q[i] = b
        _along(path, sign, moved_q, high)
        moved_q[i] = q[i]
        for j in range(m):
            found[j, i] = (high[j] - low[j]) / (b - a)
    return h, found
