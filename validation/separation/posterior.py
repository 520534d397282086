"""Samples of a posterior by randomised fits: each solves the least squares of perturbed records and a perturbed prior.

Let H(z), shape (m + p,), hold the residual of the records over its noise and, below it, z itself, whose prior is
standard normal. With the Jacobian J = Q R at the smallest H, a sample solves the p equations

    Q' H(z) = xi,    xi ~ N(0, I)

(randomise-then-optimise: Bardsley et al. 2014, doi 10.1137/140964023). For a linear H these are samples of the
posterior. Otherwise each one has the weight

    exp(-|H|^2 / 2 + |Q' H|^2 / 2) / |det Q' J(z)|

whose mean is the evidence of the law, up to a factor that all laws of the same records share. Samples of several optima
and laws are therefore put together by their weights alone.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Protocol

import numpy as np
from numpy.typing import ArrayLike
from scipy.optimize import least_squares
from scipy.special import ndtri

from hysteresis.arrays import Floats

_MOST_FITS = 25  # evaluations of a least squares
_MOST_STEPS = 6  # of Newton's method for a sample
_PARTS = 2  # of the way to a sample that is not found at once
_SOLVED, _NEAR = 0.15, 1.0  # standard deviations that a sample is off: enough, and at most


class Target(Protocol):
    """The function H(z), whose half sum of squares is the negative logarithm of the posterior's density."""

    def residual(self, z: Floats, /) -> Floats:
        """H at z, shape (p,) -> (m + p,)."""

    def columns(self, z: Floats, /) -> Floats:
        """Jacobian of H at z, shape (m + p, p)."""


@dataclass(frozen=True, eq=False)
class Optimum:
    """A smallest |H|: where it is, H there, and its Jacobian, shape (m + p, p)."""

    z: Floats
    residual: Floats
    columns: Floats

    @property
    def square(self) -> float:
        """Sum of squares."""
        return float(self.residual @ self.residual)

    @property
    def log_evidence(self) -> float:
        """Evidence by Laplace's approximation, up to the same factor as the weights of samples."""
        return -0.5 * self.square - float(np.log(np.abs(np.diag(np.linalg.qr(self.columns, "r")))).sum())


@dataclass(frozen=True, eq=False)
class Sample:
    """A sample with the logarithm of its weight among those of one optimum."""

    z: Floats
    log_weight: float


def optimum(target: Target, start: Floats) -> Optimum:
    """Least squares from a start, shape (p,)."""
    fit = least_squares(
        target.residual, start, jac=target.columns, method="trf", ftol=1e-5, xtol=1e-6, gtol=1e-6, max_nfev=_MOST_FITS
    )
    return Optimum(fit.x, fit.fun, target.columns(fit.x))


def sampled(target: Target, best: Optimum, count: int, rng: np.random.Generator) -> list[Sample]:
    """Draw samples about an optimum; those whose equations have no solution nearby are left out."""
    factors, found = np.linalg.qr(best.columns), []
    for _ in range(count):
        try:
            found.append(_sample(target, best.z, factors, rng.standard_normal(best.z.size)))
        except np.linalg.LinAlgError:  # the step leads to where nothing changes
            continue
    return [one for one in found if one is not None]


def _sample(target: Target, start: Floats, factors: tuple[Floats, Floats], xi: Floats) -> Sample | None:
    """Solve for one xi: at once, or where that fails a part of the way at a time, with a Jacobian at each."""
    q, tangent = factors[0].T, factors[1]
    size, z, h = _solved(target, q, xi, start + np.linalg.solve(tangent, xi), tangent)
    if size > _SOLVED:
        z = start
        for part in np.arange(1, _PARTS + 1) / _PARTS:
            z = z + np.linalg.solve(tangent, part * xi - q @ target.residual(z))
            size, z, h = _solved(target, q, part * xi, z, tangent)
            tangent = q @ target.columns(z)
    if size > _NEAR:
        return None
    across = q @ h
    _, log_det = np.linalg.slogdet(q @ target.columns(z))
    return Sample(z, -0.5 * float(h @ h - across @ across) - float(log_det))


def _solved(target: Target, q: Floats, xi: Floats, z: Floats, tangent: Floats) -> tuple[float, Floats, Floats]:
    """Newton's method for Q' H = xi from z with a Jacobian that is updated; give what is still off, z and H there."""
    h = target.residual(z)
    off, nearest = q @ h - xi, (math.inf, z, h)
    for _ in range(_MOST_STEPS):
        size = float(np.linalg.norm(off))
        nearest = min(nearest, (size, z, h), key=lambda one: one[0])
        if size <= _SOLVED:
            break
        step = -np.linalg.solve(tangent, off)
        new = target.residual(z + step)
        if np.linalg.norm(q @ new - xi) > size:
            step *= 0.5
            new = target.residual(z + step)
        moved = q @ new - xi
        tangent = tangent + np.outer(moved - off - tangent @ step, step) / float(step @ step)  # Broyden's update
        z, h, off = z + step, new, moved
    return nearest


def about(best: Optimum, count: int, rng: np.random.Generator) -> list[Sample]:
    """Draw samples of Laplace's approximation, for a posterior that is too narrow for finite differences."""
    factor = np.linalg.qr(best.columns, "r")
    steps = np.linalg.solve(factor, rng.standard_normal((best.z.size, count))).T
    return [Sample(best.z + step, best.log_evidence) for step in steps]


def weights_of(log_weights: ArrayLike) -> Floats:
    """Weights that add up to 1, shape (n,)."""
    logs = np.asarray(log_weights)
    weights = np.exp(logs - logs.max())
    return np.asarray(weights / weights.sum())


def flattened(log_weights: ArrayLike, enough: float) -> Floats:
    """Weights that add up to 1, shape (n,), raised to the largest power up to 1 that leaves ``enough`` samples.

    Where few samples have most of the weight, the others say more of the spread than their weights do. Without a power
    that leaves as many, all weigh the same.
    """
    logs = np.asarray(log_weights)
    low, high = 0.0, 1.0
    if effective(weights_of(logs)) >= enough:
        return weights_of(logs)
    for _ in range(30):
        middle = 0.5 * (low + high)
        low, high = (middle, high) if effective(weights_of(middle * logs)) >= enough else (low, middle)
    return weights_of(low * logs)


def effective(weights: Floats) -> float:
    """Effective number of samples: that of samples of equal weight which determine a mean as well."""
    return float(1 / (weights**2).sum())


def quantiles(values: ArrayLike, weights: Floats, levels: Sequence[float]) -> list[float]:
    """Quantiles of weighted samples, at plotting positions i/(n + 1): the interval holds a further sample as often.

    Between samples they are linear in the normal score. Beyond the outermost sample they are on its line from the
    median: few samples do not reach far enough.

    Parameters
    ----------
    values, weights
        Shape (n,); weights add up to 1.
    """
    order = np.argsort(values)
    ranked, share = np.asarray(values, dtype=float)[order], weights[order]
    n = effective(weights)
    scores = ndtri((np.cumsum(share) - 0.5 * share + 0.5 / n) / (1 + 1 / n))
    median = float(np.interp(0.0, scores, ranked))

    def at(score: float) -> float:
        for end in (0, -1):
            if abs(score) > abs(scores[end]) > 0 and score * scores[end] > 0:
                return median + (float(ranked[end]) - median) * score / float(scores[end])
        return float(np.interp(score, scores, ranked))

    return [at(float(ndtri(level))) for level in levels]
