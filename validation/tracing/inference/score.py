"""The score of a record beside a fit: its marginal likelihood, of which everything linear is integrated out.

With y whitened by AR(1) (rho), X the tangent and K the discrepancy, P = M^-1 - M^-1 X (X'M^-1 X)^-1 X'M^-1 and
M = R + tau^2 D D' + sum_k scale_k^2 S_k S_k' in units of the noise's variance (restricted likelihood: Harville 1974,
doi 10.1093/biomet/61.2.383), n samples and p columns of X:

    l(y) = -(n - p)/2 [log v + s/v] - (log|M| + log|X'M^-1 X|)/2 + log prior,   s = y'P y / (n - p)

v is the variance of the noise that is most likely, max(s, floor^2). A column c of an effect takes (c'P y)^2 / (c'P c)
from y'P y, in the same contrasts, so that nothing depends on the size of its start.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from functools import cached_property

import numpy as np
from scipy.linalg import solve_triangular

from hysteresis.arrays import Floats
from validation.tracing.inference.autoregression import log_determinant, whitened
from validation.tracing.inference.discrepancy import Linearised
from validation.tracing.inference.priors import DiscrepancyPrior

RHOS = (0.0, 0.2, 0.4, 0.6, 0.8, 0.9, 0.95)
"""Correlations of neighbouring samples that are tried."""
RHO_POWER = 4.0
"""Prior density of rho in proportion to (1 - rho)^4: the noise of most sensors is nearly white."""
TAUS = (0.01, 0.03, 0.1, 0.3)
"""Standard deviations of the discrepancy in the shapes of the effects that are tried, over that of the noise.

Clean rigs have no larger ones: with these the discrepancy would take what an effect makes."""
SCALES = (0.3, 1.0, 3.0, 10.0)
"""The same of a group of smooth functions."""
LEAST_DIRECTION = 1e-5
"""Smallest singular value of what the score works in, over the largest."""

Pattern = tuple[tuple[str, float], ...]
"""Groups of smooth functions that are there, each with its scale; a relevance that is determined for each group."""


@dataclass(frozen=True)
class Covariance:
    """A point of the grid: correlation of the noise, pattern of the smooth functions, scale of the effects' shapes."""

    rho: float
    pattern: Pattern
    tau: float


@dataclass(frozen=True, eq=False)
class Reduced:
    """A record beyond its tangent, whitened, in the coordinates of the space of all shapes and smooth functions.

    Parameters
    ----------
    basis
        Orthonormal, shape (m, q).
    tangent
        Orthonormal basis of the whitened tangent, shape (m, p).
    log_determinant
        log|R| + log|X'R^-1 X|.
    """

    of: Linearised
    rho: float
    basis: Floats
    tangent: Floats
    log_determinant: float
    _modes: dict[Pattern, Modes] = field(default_factory=dict)

    @cached_property
    def shapes(self) -> Floats:
        """Shapes of the effects, shape (q, s)."""
        return self.basis.T @ whitened(self.of.shapes, self.of.gap, self.rho)

    @cached_property
    def smooth(self) -> dict[str, Floats]:
        """Groups of smooth functions, shapes (q, k)."""
        return {name: self.basis.T @ whitened(own, self.of.gap, self.rho) for name, own in self.of.smooth.items()}

    def rows(self, rows: Floats) -> Rows:
        """Reduce rows, shape (m, N)."""
        white = whitened(rows, self.of.gap, self.rho)
        inside = self.basis.T @ white
        along = self.tangent.T @ white
        square = np.einsum("ij,ij->j", white, white) - np.einsum("ij,ij->j", along, along)
        return Rows(inside, np.maximum(square - np.einsum("ij,ij->j", inside, inside), 0.0))

    def modes(self, pattern: Pattern) -> Modes:
        """Diagonalise the discrepancy with a pattern of smooth functions, once."""
        if pattern not in self._modes:
            self._modes[pattern] = _modes_of(self, pattern)
        return self._modes[pattern]


@dataclass(frozen=True, eq=False)
class Rows:
    """Reduced rows: coordinates, shape (q, N), and the square that is outside of these, shape (N,)."""

    inside: Floats
    outside: Floats


@dataclass(frozen=True, eq=False)
class Modes:
    """Modes in which noise and smooth functions have unit variance and the shapes of the effects ``sizes``.

    ``turn`` has shape (q, q), from coordinates to modes; ``shapes`` are those of the effects in modes, shape (q, s).
    """

    turn: Floats
    sizes: Floats
    log_determinant: float
    shapes: Floats

    def weights(self, tau: float) -> Floats:
        """Inverse variances, shape (q,)."""
        return np.asarray(1.0 / (1.0 + tau**2 * self.sizes))


def reduced(linear: Linearised, rho: float, directions: Floats | None = None) -> Reduced:
    """Reduce a record for one correlation of the noise; ``directions`` are spanned, too, shape (m, k)."""
    tangent, triangle = np.linalg.qr(whitened(linear.tangent, linear.gap, rho))
    others = () if directions is None else (directions,)
    columns = whitened(np.column_stack([linear.shapes, *linear.smooth.values(), *others]), linear.gap, rho)
    columns -= tangent @ (tangent.T @ columns)
    columns -= tangent @ (tangent.T @ columns)
    size, turn = np.linalg.eigh(columns.T @ columns)
    kept = size > LEAST_DIRECTION**2 * size[-1:].max(initial=0.0)
    basis = columns @ (turn[:, kept] / np.sqrt(size[kept]))
    basis = solve_triangular(np.linalg.cholesky(basis.T @ basis), basis.T, lower=True).T
    determinant = log_determinant(linear.gap, rho) + 2 * float(np.log(np.abs(np.diag(triangle))).sum())
    return Reduced(linear, rho, basis, tangent, determinant)


def _modes_of(one: Reduced, pattern: Pattern) -> Modes:
    count = one.basis.shape[1]
    variance = np.eye(count)
    for name, scale in pattern:
        variance += scale**2 * one.smooth[name] @ one.smooth[name].T
    lower = np.linalg.cholesky(variance)
    inverse = solve_triangular(lower, np.eye(count), lower=True)
    own = inverse @ (one.shapes * np.sqrt(one.of.shares))
    sizes, turn = np.linalg.eigh(own @ own.T)
    turn = turn.T @ inverse
    determinant = 2 * float(np.log(np.diag(lower)).sum())
    return Modes(turn, np.maximum(sizes, 0.0), determinant, turn @ one.shapes)


@dataclass(frozen=True, eq=False)
class Scored:
    """Scores of rows at one covariance: without an effect, shape (N,), and with each effect, shape (e, N)."""

    plain: Floats
    with_effect: Floats


def scored(one: Reduced, rows: Rows, covariance: Covariance, prior: DiscrepancyPrior) -> Scored:
    """Score rows without an effect, and with the best start of each."""
    modes = one.modes(covariance.pattern)
    weights = modes.weights(covariance.tau)
    turned = modes.turn @ rows.inside
    square = rows.outside + weights @ turned**2
    least = square - gains(one.of, modes.shapes, weights, turned)
    return Scored(*(log_likelihood(one, values, covariance, prior) for values in (square, least)))


def plain_square(one: Reduced, rows: Rows, covariance: Covariance) -> Floats:
    """Give y'P y of rows without an effect, shape (N,)."""
    modes = one.modes(covariance.pattern)
    return np.asarray(rows.outside + modes.weights(covariance.tau) @ (modes.turn @ rows.inside) ** 2)


def gains(linear: Linearised, shapes: Floats, weights: Floats, turned: Floats) -> Floats:
    """Part of y'P y that the best start of each effect takes, shape (e, N)."""
    if not linear.names:
        return np.empty((0, turned.shape[1]))
    taken = squares_by_shape(linear, shapes, weights, turned)
    return np.asarray(np.maximum.reduceat(taken, linear.effects, axis=0))


def squares_by_shape(linear: Linearised, shapes: Floats, weights: Floats, turned: Floats) -> Floats:
    """Part of y'P y that each shape takes, no negative amount where it is one-sided, shape (k, N)."""
    own = shapes * np.sqrt(weights)[:, None]
    unit = own / np.maximum(np.linalg.norm(own, axis=0), 1e-300)
    sizes = np.diff([*linear.blocks, own.shape[1]])
    for first, size in zip(linear.blocks[sizes > 1], sizes[sizes > 1], strict=True):
        unit[:, first : first + size] = np.linalg.qr(own[:, first : first + size])[0]
    along = (unit * np.sqrt(weights)[:, None]).T @ turned
    sided = np.repeat(linear.one_sided & (sizes == 1), sizes)
    along[sided] = np.maximum(along[sided], 0.0)
    return np.asarray(np.add.reduceat(along**2, linear.blocks, axis=0))


def log_likelihood(one: Reduced, square: Floats, covariance: Covariance, prior: DiscrepancyPrior) -> Floats:
    """Score from y'P y, any shape."""
    linear = one.of
    variance = np.maximum(square / linear.freedom, 1e-300)
    likely = np.maximum(variance, linear.floor_deg**2)
    fit = -0.5 * linear.freedom * (np.log(likely) + variance / likely)
    noise = np.sqrt(likely) / linear.half_range_deg
    smooth = math.hypot(*(scale for _, scale in covariance.pattern)) * noise
    known = prior.log_density(covariance.tau * noise) + prior.log_density_of_smooth(smooth)
    return np.asarray(fit + known + constant(one, covariance))


def constant(one: Reduced, covariance: Covariance) -> float:
    """Give the determinants, and the priors of correlation and pattern."""
    modes = one.modes(covariance.pattern)
    shapes = -0.5 * float(np.log1p(covariance.tau**2 * modes.sizes).sum())
    chosen = -len(covariance.pattern) * math.log(max(len(one.of.smooth), 1) * len(SCALES))
    rho = RHO_POWER * math.log1p(-covariance.rho)
    return shapes - 0.5 * (modes.log_determinant + one.log_determinant) + chosen + rho


def noise_deg(linear: Linearised, square: float) -> float:
    """Give the standard deviation of the noise that is most likely, deg, from y'P y."""
    return math.sqrt(max(square / linear.freedom, linear.floor_deg**2))
