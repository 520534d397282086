"""Uncertainty of a least-squares fit whose noise is correlated from sample to sample, as a filtered sensor's is.

The noise is an autoregression, fitted to the residual by the equations of Yule and Walker, its order the one of the
least BIC (Schwarz 1978, doi 10.1214/aos/1176344136). The fit has taken part of the noise out of the residual: with the
hat matrix H, the residual of noise with covariance S has (1 - H) S (1 - H), and what that lacks at each lag is added.
With S, the parameters have the covariance (J'J)^-1 J' S J (J'J)^-1.
"""

from __future__ import annotations

import numpy as np
from scipy.linalg import solve_toeplitz

from hysteresis.arrays import Floats
from hysteresis.fitting.form import Form, Point
from hysteresis.fitting.samples import Samples
from hysteresis.fitting.uncertainty import Uncertainty, linearise, student_quantile

MOST_ORDER = 4
_ROUNDS = 3  # in which what the fit took out is added
_LONGEST = 400  # lags of the covariance
_FORGOTTEN = 1e-3  # of the variance: a covariance that is smaller counts as none
_SLOWEST = 0.98  # root of an autoregression: it forgets at least so fast


def serial_uncertainty(samples: Samples, form: Form, point: Point) -> Uncertainty:
    """Covariance of the unknowns of a fit to one record under correlated noise; see the module.

    Neighbours are samples that follow each other in ``samples``; those that are held out belong to no pair.
    """
    line = linearise(samples, form, point)
    p, train = int(line.free.sum()), np.flatnonzero(samples.train)
    m, size = train.size, samples.train.size
    inverse, condition = line.inverse()
    jacobian, residual = np.zeros((size, p)), np.zeros(size)
    jacobian[train], residual[train] = line.columns[:, line.free], line.residual
    measured = np.array([residual[: size - k] @ residual[k:] for k in range(MOST_ORDER + 1)])
    there = samples.train.astype(float)
    pairs = np.maximum(1.0, [there[: size - k] @ there[k:] for k in range(MOST_ORDER + 1)])
    lags = measured / pairs * m / max(1, m - p)
    order = _order(lags, m)
    noise = _covariances(lags, order)
    for _ in range(_ROUNDS):
        lags = (measured + _taken(jacobian, inverse, noise)) / pairs
        noise = _covariances(lags, order)
    middle = jacobian.T @ _applied(noise, jacobian)
    covariance = np.zeros((line.free.size, line.free.size))
    covariance[np.ix_(line.free, line.free)] = inverse @ middle @ inverse
    summed = noise[0] + 2.0 * float(noise[1:].sum())
    effective = m * min(1.0, float(noise[0]) / max(summed, 1e-300))
    return Uncertainty(covariance, student_quantile(m - p), condition, line.unidentifiable, effective)


def _order(lags: Floats, samples: int) -> int:
    """Order of the autoregression of the least BIC."""
    if lags[0] <= 0.0:
        return 0
    scores = []
    for order in range(MOST_ORDER + 1):
        left = lags[0] - (_coefficients(lags, order) @ lags[1 : order + 1] if order else 0.0)
        scores.append(samples * np.log(max(left, 1e-12 * lags[0])) + order * np.log(samples))
    return int(np.argmin(scores))


def _coefficients(lags: Floats, order: int) -> Floats:
    """Coefficients of the autoregression, shape (order,), by the equations of Yule and Walker."""
    return np.asarray(solve_toeplitz(lags[:order], lags[1 : order + 1]))


def _covariances(lags: Floats, order: int) -> Floats:
    """Covariances of the autoregression at all lags that count, shape (n,), the variance first."""
    if order == 0:
        return lags[:1]
    coefficients = _coefficients(lags, order)
    slowest = float(np.abs(np.roots([1.0, *-coefficients])).max())
    if slowest > _SLOWEST:
        coefficients = coefficients * (_SLOWEST / slowest) ** np.arange(1, order + 1)
    found = list(lags[: order + 1])
    while len(found) < _LONGEST and max(map(abs, found[-order:])) > _FORGOTTEN * lags[0]:
        found.append(float(coefficients @ found[: -order - 1 : -1]))
    return np.array(found)


def _applied(noise: Floats, columns: Floats) -> Floats:
    """Multiply a covariance matrix with columns, shape (m, p) -> (m, p)."""
    out = noise[0] * columns
    for k in range(1, min(noise.size, len(columns))):
        out[k:] += noise[k] * columns[:-k]
        out[:-k] += noise[k] * columns[k:]
    return np.asarray(out)


def _taken(jacobian: Floats, inverse: Floats, noise: Floats) -> Floats:
    """Sum up what the fit takes out of the sums of products of the residual at each lag, shape (MOST_ORDER + 1,)."""
    through = jacobian @ inverse
    moved = _applied(noise, jacobian)
    moved[~jacobian.any(axis=1)] = 0.0  # held out
    spread = through @ (jacobian.T @ moved)
    size = len(jacobian)
    taken = np.empty(MOST_ORDER + 1)
    for k in range(MOST_ORDER + 1):
        early, late = slice(0, size - k), slice(k, size)
        crossed = np.sum(through[early] * moved[late]) + np.sum(moved[early] * through[late])
        taken[k] = crossed - np.sum(spread[early] * through[late])
    return taken
