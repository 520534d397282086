"""A joint of one spring, dry friction and a damper, fitted to a log: a play operator of the load, and a line.

Dry friction F and a spring k let the angle follow the load M as play: k (angle - angle_0) = P[M], P a play operator of
radius F (Kuhnen 2003, doi 10.3166/ejc.9.407-418). With a damper d the joint slides at d v = M - k (angle - angle_0)
-+ F (Coulomb and viscous friction). One implicit Euler step of this, of length t, is

    e = u_j - p_(j-1),  p_j = p_(j-1) + (e - clip(e, -r, r)) t / (t + T),

with u = M, r = F, T = d / k and p = k (angle - angle_0); T = 0 is the play operator. The load is linear between
samples. The same operator of a drive is backlash: the half width of the gap is r.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
from numba import njit
from scipy.optimize import minimize

from hysteresis.arrays import Floats, Ints
from hysteresis.fitting.uncertainty import Parameter, block_spread
from hysteresis.records.path import branches

_RADII = 25
_STARTS = (-1.0, -0.5, 0.0, 0.5, 1.0)
_LAGS = (0.0, 0.003, 0.01, 0.03, 0.1)  # of the shortest stroke
_LONGEST_LAG = 0.5  # of the shortest stroke
_STROKES = 8  # fewer strokes than these are divided, so that a bootstrap has blocks to draw from
_STEP = 1e-4  # of finite differences, of each parameter's size
_SIMPLEXES = (0.04, 0.01, 0.002)  # of the range: several, because one may shrink along an edge of the cost
_PARTS = 10  # of a step from sample to sample, for a lag
_WORST = 1e300


@dataclass(frozen=True, eq=False)
class PlayJoint:
    """angle = zero + gain p + sum(c_i x_i), p the play operator with lag; m samples.

    ``start`` is the place within the play at the first sample, -1 to 1; ``lag_s`` is 0 where it was not fitted;
    ``others`` are the c_i. ``predicted``, shape (m,), is in the unit of the angle, ``rmse`` too. ``blocks`` is the
    number of blocks of the bootstrap.
    """

    radius: float
    start: float
    gain: float
    zero: float
    lag_s: float
    others: Floats
    predicted: Floats
    rmse: float
    blocks: int
    interval: Callable[[Callable[[Floats], float]], tuple[float, float]]
    """95 % interval of a function of (radius, gain, zero, lag_s, *others)."""

    def value(self, function: Callable[[Floats], float], unit: str, *, least: float | None = None) -> Parameter:
        """Give a function of (radius, gain, zero, lag_s, *others) with its 95 % interval, which ``least`` bounds."""
        x = np.array([self.radius, self.gain, self.zero, self.lag_s, *self.others])
        value, (low, high) = function(x), self.interval(function)
        if not (math.isfinite(low) and math.isfinite(high)):
            return Parameter(value, None, None, unit)
        return Parameter(value, low if least is None else max(low, least), high, unit)


def fit_play_joint(
    load: Floats, angle: Floats, *, time_s: Floats | None = None, others: Sequence[Floats] = (), seed: int = 0
) -> PlayJoint:
    """Fit the joint by least squares, with intervals by block bootstrap over the strokes of the load.

    Parameters
    ----------
    load, angle
        Shape (m,): moment or drive, and angle, each in any unit.
    time_s
        Shape (m,): the lag is fitted where it is given, and 0 without it.
    others
        Each of shape (m,): further linear terms of the angle.
    seed
        Of the bootstrap.
    """
    steps = np.ones_like(load) if time_s is None else np.r_[1.0, np.diff(time_s)]
    data = _Data(load, angle, steps, np.array([np.ones_like(load), *others]))
    shortest = 0.0 if time_s is None else min(float(np.ptp(time_s[one])) for one in branches(load))
    size, half = float(np.ptp(load)), 0.5 * float(np.ptp(load))
    lags = [share * shortest for share in (_LAGS if time_s is not None else (0.0,))]
    grid = [(r, s, lag) for r in np.linspace(0, 0.98 * half, _RADII) for s in _STARTS for lag in lags]
    best = min(grid, key=lambda x: data.cost(*x))
    scale = np.array([size, 2.0, shortest])[: 2 + (time_s is not None)]
    low, high = np.array([0.0, -0.5, 0.0])[: scale.size], np.array([0.499, 0.5, _LONGEST_LAG])[: scale.size]

    def full(z: Floats) -> tuple[float, float, float]:
        radius, start, *lag = (z * scale).tolist()
        return radius, start, lag[0] if lag else 0.0

    z = np.array(best)[: scale.size] / scale
    for width in _SIMPLEXES:
        least = data.cost(*full(z))
        away = width * np.array([1.0, 5.0, 1.0])[: scale.size]
        corners = z + np.diag(np.where(z + away > high, -away, away))
        options = {"initial_simplex": np.vstack([z, corners]), "xatol": 1e-6, "fatol": 1e-9 * least, "maxfev": 300}
        bounds = list(zip(low, high, strict=True))
        z = np.asarray(
            minimize(lambda z: data.cost(*full(z)), z, method="Nelder-Mead", bounds=bounds, options=options).x
        )
    radius, start, lag = full(z)
    linear = data.linear(radius, start, lag)
    return _with_intervals(data, np.array([radius, start, lag, *linear]), timed=time_s is not None, seed=seed)


@dataclass(frozen=True, eq=False)
class _Data:
    load: Floats
    angle: Floats
    steps: Floats
    terms: Floats  # (1 + others, m)

    def columns(self, radius: float, start: float, lag: float) -> Floats:
        return np.vstack([lagging_play(self.load, self.steps, radius, lag, start), self.terms]).T

    def linear(self, radius: float, start: float, lag: float) -> Floats:
        return np.asarray(np.linalg.lstsq(self.columns(radius, start, lag), self.angle, rcond=1e-12)[0])

    def cost(self, radius: float, start: float, lag: float) -> float:
        columns = self.columns(radius, start, lag)
        normal, right = columns.T @ columns, columns.T @ self.angle
        try:
            linear = np.linalg.solve(normal, right)
        except np.linalg.LinAlgError:
            return _WORST
        residual = self.angle - columns @ linear
        return float(residual @ residual)

    def predicted(self, x: Floats) -> Floats:
        """X = (radius, start, lag, gain, zero, *others)."""
        return np.asarray(self.columns(*x[:3]) @ x[3:])


def _with_intervals(data: _Data, x: Floats, *, timed: bool, seed: int) -> PlayJoint:
    predicted = data.predicted(x)
    sizes = np.array([np.ptp(data.load), 1.0, float(data.steps[1:].mean()), *(np.abs(x[3:]) + 1e-12)])
    jacobian = np.zeros((data.load.size, x.size))
    for i in range(x.size):
        if i == 2 and not timed:
            continue
        step = _STEP * sizes[i] * np.eye(x.size)[i]
        low = x - step
        if (i in (0, 2) and low[i] < 0) or (i == 1 and low[1] < -1):
            low = x
        high = x if i == 1 and x[1] + step[1] > 1 else x + step
        jacobian[:, i] = -(data.predicted(high) - data.predicted(low)) / (high - low)[i]
    blocks = _blocks(data.load)
    free = np.linalg.norm(jacobian, axis=0) > 0
    spread = block_spread(
        [jacobian[one][:, free] for one in blocks], [(data.angle - predicted)[one] for one in blocks], seed
    )
    order = np.array([0, 3, 4, 2, *range(5, x.size)])  # radius, gain, zero, lag, others

    def interval(function: Callable[[Floats], float]) -> tuple[float, float]:
        def of_x(values: Floats) -> float:
            return function(values[order])

        gradient = np.zeros(x.size)
        for i in np.flatnonzero(free):
            step = 1e-6 * sizes[i] * np.eye(x.size)[i]
            gradient[i] = (of_x(x + step) - of_x(x - step)) / (2 * step[i])
        half = spread.half_width(gradient[free])
        return of_x(x) - half, of_x(x) + half

    residual = data.angle - predicted
    return PlayJoint(
        radius=float(x[0]),
        start=float(x[1]),
        gain=float(x[3]),
        zero=float(x[4]),
        lag_s=float(x[2]),
        others=x[5:],
        predicted=predicted,
        rmse=float(np.sqrt(np.mean(residual**2))),
        blocks=len(blocks),
        interval=interval,
    )


def _blocks(load: Floats) -> list[Ints]:
    """Divide the samples into strokes, or strokes into equal parts where there are few."""
    every = branches(load)
    parts = math.ceil(_STROKES / len(every))
    found = []
    for i, one in enumerate(every):
        found += np.array_split(np.arange(one.start + (i > 0), one.stop), parts)
    return [one for one in found if one.size]


@njit(cache=True)
def lagging_play(load: Floats, steps: Floats, radius: float, lag: float, start: float) -> Floats:
    """Evaluate a play operator behind a lag, shape (m,): the equation of this module.

    ``steps``, shape (m,), are the times since the sample before; ``start`` is the place within the play at the first
    sample, -1 to 1.
    """
    out = np.empty(load.shape[0])
    p = load[0] + start * radius
    out[0] = p
    parts = _PARTS if lag > 0 else 1
    for j in range(1, load.shape[0]):
        step = steps[j] / parts
        for i in range(1, parts + 1):
            e = load[j - 1] + (load[j] - load[j - 1]) * i / parts - p
            excess = e - min(radius, max(-radius, e))
            p += excess * step / (step + lag)
        out[j] = p
    return out
