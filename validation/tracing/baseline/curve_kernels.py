"""Compiled operators of the curve model: loops along a path, play, lag, flag, two tendons with a toe region."""

from __future__ import annotations

import math

import numpy as np
from numba import njit

from hysteresis.arrays import Floats
from hysteresis.laws.flow import FREE, advance, set_kappa, workspace

_LEAST_STIFFNESS = 0.05  # of two slack tendons, over that of a taut one: the loop of a dead zone stays finite


@njit(cache=True)
def bouc_wen_element(path: Floats, reach: float, n: float, rho: float, state: float, weight: Floats) -> Floats:
    """Bouc-Wen element of saturation 1 along a path of f.

    Parameters
    ----------
    path
        Shape (m,), f in deg.
    reach, n, rho
        Of an element y that goes from 0 to 1 over a path of about ``reach``; rho is gamma / beta.
    state
        y at the first sample, in -1..1; its sign is that of a motion towards larger f.
    weight
        Shape (m,), factor on the reach: of a loop whose saturation grows by it the slope after a reversal stays.

    Returns
    -------
    Floats
        Shape (m,), y, above 0 behind a motion towards larger f; saturation and weight are left to the caller (paper,
        eq. 7, by :mod:`hysteresis.laws.flow`).
    """
    m = path.shape[0]
    out = np.empty(m)
    kappa = (1.0 - rho) / (1.0 + rho)
    work = workspace(n)
    set_kappa(work, n, kappa)
    y, direction, chart, place = state, 1.0, FREE, 0.0
    out[0] = y
    for j in range(1, m):
        df = path[j] - path[j - 1]
        if df * direction < 0.0:
            y, direction, chart = -y, -direction, FREE
        y, chart, place = advance(y, chart, place, abs(df) / (reach * weight[j]), n, kappa, work)
        y = min(1.0, y)
        out[j] = direction * y
    return out


@njit(cache=True)
def play(x: Floats, width: float, state: float) -> Floats:
    """Play operator: the output follows x within half a width, shape (m,); ``state`` -1..1 is where x is in the gap."""
    out = np.empty_like(x)
    half = 0.5 * width
    out[0] = x[0] - state * half
    for j in range(1, x.shape[0]):
        out[j] = min(max(out[j - 1], x[j] - half), x[j] + half)
    return out


@njit(cache=True)
def lagged(x: Floats, time_s: Floats, lag_s: float) -> Floats:
    """First-order lag, c' = (x - c) / lag, exact for an x that is linear between its samples; c starts as x does."""
    out = np.empty_like(x)
    out[0] = x[0]
    for j in range(1, x.shape[0]):
        step = time_s[j] - time_s[j - 1]
        z = step / lag_s
        fade = math.exp(-z)
        # mean of exp(-s) over the step; its series where the difference would cancel
        mean = (1.0 - fade) / z if z > 1e-6 else 1.0 - 0.5 * z
        out[j] = fade * out[j - 1] + (mean - fade) * x[j - 1] + (1.0 - mean) * x[j]
    return out


@njit(cache=True)
def transformed(f: Floats, onset: float, loop: float) -> Floats:
    """Part that is transformed beyond an onset on either side, shape (m,); it transforms back ``loop`` later."""
    out = np.empty_like(f)
    up = down = 0.0
    for j in range(f.shape[0]):
        up = max(0.0, f[j] - onset, min(up, f[j] - onset + loop))
        down = max(0.0, -f[j] - onset, min(down, -f[j] - onset + loop))
        out[j] = up - down
    return out


@njit(cache=True)
def tendon_tension(stretch: float, toe: float) -> float:
    """Tension over preload of a tendon with a toe region, from its stretch over (preload / k_inf).

    Solves t - 1 + toe ln t = stretch, which is k(T) = k_inf T / (T + T_toe) integrated; toe is T_toe over preload.
    """
    if toe <= 0.0:
        return max(0.0, 1.0 + stretch)
    # In ln t the left side is convex and rising: Newton's method from above converges monotonically.
    s = math.log(1.0 + max(stretch, 0.0))
    for _ in range(50):
        t = math.exp(s)
        change = (t - 1.0 + toe * s - stretch) / (t + toe)
        s -= change
        if abs(change) < 1e-12:
            break
    return math.exp(s)


@njit(cache=True)
def two_tendons(
    x: Floats, unit: float, stiffness: float, toe: float, slack_a: float, slack_b: float
) -> tuple[Floats, Floats]:
    """One joint between two preloaded tendons with a toe region, driven by x.

    Parameters
    ----------
    x
        Shape (m,), drive.
    unit
        Preload over k_inf, in the drive's unit.
    stiffness
        r^2 k_inf over the joint's stiffness.
    toe
        T_toe over preload.
    slack_a, slack_b
        By how much either tendon is longer than the preload requires, in the drive's unit.

    Returns
    -------
    tuple
        r theta, and the tendons' compliance over that at zero drive without slack; shapes (m,). Moments balance at
        r theta = stiffness (T_a - T_b) / k_inf; the tendons are stretched by +-(x - r theta) less their slack. Derived.
    """
    angle, soft = np.empty_like(x), np.empty_like(x)
    d, at_rest = 0.0, 0.5 * (1.0 + toe)
    for j in range(x.shape[0]):
        target = x[j] / unit
        low, high, slope = -math.inf, math.inf, 0.0
        for _ in range(80):
            a, b = tendon_tension(d - slack_a / unit, toe), tendon_tension(-d - slack_b / unit, toe)
            slope = (a / (a + toe) if a > 0.0 else 0.0) + (b / (b + toe) if b > 0.0 else 0.0)
            excess = d + stiffness * (a - b) - target  # rises with d, with kinks where a tendon goes slack
            low, high = (d, high) if excess < 0.0 else (low, d)
            change = excess / (1.0 + stiffness * slope)
            if abs(change) < 1e-11 * (1.0 + abs(d)):
                break
            d = d - change if low < d - change < high else 0.5 * (low + high)
        angle[j] = x[j] - d * unit  # d starts the next sample: neighbours are near
        soft[j] = 1.0 / (max(slope, _LEAST_STIFFNESS) * at_rest)
    return angle, soft
