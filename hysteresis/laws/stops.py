"""Stop operators with a power-law density of thresholds: Prandtl-Ishlinskii (Iwan) laws with few constants.

h = A sum w_k E_k[f]. Each stop E_k follows the increments of f and is held within +- r_k: h = A (f - sum w_k P_k[f]),
with plays P_k. The thresholds are those of Segalman's four-parameter Iwan model (2005, doi 10.1115/1.1989354): a
density proportional to r^chi up to the largest threshold R, and a share of the weight at R itself. The density is
represented by :data:`THRESHOLDS` thresholds of equal weight, at the middles of its quantiles.

In the generalised law the thresholds are r_k b(f) (Al Janaideh, Rakheja and Su 2009, doi
10.1016/j.mechatronics.2009.02.001: plays between two curves, here f - r b and f + r b), with b = exp(a x + c x^2) and
x = (f - centre) / half range. The loop is then wider where b is larger.
"""

from __future__ import annotations

import math

import numpy as np
from numba import njit

from hysteresis.arrays import Floats

THRESHOLDS = 20  # that represent the density; one more is R
FARTHEST = 1.2
"""|x| beyond which b stays constant."""


@njit(cache=True)
def thresholds(mean: float, power: float, share: float) -> Floats:
    """Place the thresholds, shape (THRESHOLDS + 1,), in the unit of ``mean``; the last one is R.

    Parameters
    ----------
    mean
        Weighted mean of all thresholds: the saturation of h for A = 1.
    power
        chi + 1, above 0: the share of the density up to r is (r / R)^power.
    share
        Weight of R in addition to the density, 0 to 1.
    """
    r = np.ones(THRESHOLDS + 1)
    for k in range(THRESHOLDS):
        r[k] = ((k + 0.5) / THRESHOLDS) ** (1.0 / power)
    return r * (mean / ((1.0 - share) * r[:THRESHOLDS].mean() + share))


@njit(cache=True)
def width_factor(f: float, skew: float, bow: float, centre: float, half: float) -> float:
    """Evaluate b at an angle f, deg."""
    x = min(FARTHEST, max(-FARTHEST, (f - centre) / half))
    return math.exp((skew + bow * x) * x)


@njit(cache=True)
def largest_factor(skew: float, bow: float) -> float:
    """Give the largest b."""
    ends = abs(skew) * FARTHEST + bow * FARTHEST**2
    top = -0.5 * skew / bow if bow < 0.0 else 0.0
    return math.exp(max(ends, (skew + bow * top) * top) if abs(top) < FARTHEST else ends)


@njit(cache=True)
def start_of(state: float, r: Floats) -> Floats:
    """Give the stops after a monotonic path of ``state`` times R from rest: shape of ``r``."""
    return np.minimum(r, np.maximum(-r, state * r[-1]))


@njit(cache=True)
def follow_stops(path: Floats, rows: Floats, centre: float, half: float) -> Floats:
    """Compute h of k laws along a path of f.

    Parameters
    ----------
    path
        Shape (m,), f in deg.
    rows
        Shape (k, 7): A, saturation (deg), chi + 1, share at R, a, c, and the initial state from -1 to 1: the stops
        start as after a monotonic path of that part of R, where b is largest.
    centre, half
        Of x, deg.

    Returns
    -------
    NDArray
        Shape (k, m), deg.
    """
    out = np.zeros((rows.shape[0], path.shape[0]))
    for i in range(rows.shape[0]):
        A, saturation, power, share = rows[i, 0], rows[i, 1], rows[i, 2], rows[i, 3]
        skew, bow, state = rows[i, 4], rows[i, 5], rows[i, 6]
        if A == 0.0 or path.shape[0] == 0:
            continue
        r = thresholds(saturation / abs(A), power, share)
        stops = start_of(math.copysign(1.0, A) * state, largest_factor(skew, bow) * r)
        _follow(path, A, share, r, np.array([skew, bow, centre, half]), stops, out[i])
    return out


@njit(cache=True)
def _follow(path: Floats, A: float, share: float, r: Floats, place: Floats, stops: Floats, out: Floats) -> None:
    """Compute h of one law into ``out``, shape (m,); ``stops`` are its state and end as that of the last sample."""
    last = r.shape[0] - 1
    of_one, constant = A * (1.0 - share) / last, place[0] == 0.0 and place[1] == 0.0
    b = width_factor(path[0], place[0], place[1], place[2], place[3])
    for k in range(last + 1):
        stops[k] = min(b * r[k], max(-b * r[k], stops[k]))
    out[0] = of_one * stops[:last].sum() + A * share * stops[last]
    for j in range(1, path.shape[0]):
        df = path[j] - path[j - 1]
        if not constant:
            b = width_factor(path[j], place[0], place[1], place[2], place[3])
        total = 0.0
        for k in range(last + 1):
            limit = b * r[k]
            e = min(limit, max(-limit, stops[k] + df))
            stops[k] = e
            if k < last:
                total += e
        out[j] = of_one * total + A * share * stops[last]


def advanced(path: Floats, constants: Floats, place: tuple[float, float], stops: Floats) -> tuple[Floats, Floats]:
    """Advance one law: h along a path, shape (m,), and the stops at its end.

    ``constants``, shape (6,), is a row of :func:`follow_stops` without its state; ``place`` is (centre, half).
    """
    A, saturation, power, share, skew, bow = constants.tolist()
    out, end = np.zeros(len(path)), stops.copy()
    if A != 0.0 and len(path):
        r = thresholds(saturation / abs(A), power, share)
        _follow(np.ascontiguousarray(path, dtype=float), A, share, r, np.array([skew, bow, *place]), end, out)
    return out, end
