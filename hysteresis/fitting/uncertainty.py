"""95 % intervals of identified parameters: from the Jacobian at the least-squares solution, and by block bootstrap."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass, replace

import numpy as np
from scipy.special import stdtrit

from hysteresis.arrays import Floats, Mask
from hysteresis.fitting.form import Form, Point
from hysteresis.fitting.samples import Samples
from hysteresis.fitting.search import residual_of
from hysteresis.laws.elements import BOUC_WEN

_CONFIDENCE = 0.95
_GRADIENT_STEP = 1e-5  # of q, for what follows from it
_STEP = 1e-6  # of finite differences; the kernel of h is exact to about 1e-13
_CANCELLED = 1e-13  # of the variances that cancel each other: a smaller sum is rounding
_UNIDENTIFIABLE = 1e-9  # of the largest column of the Jacobian; smaller columns are rounding
_WIDEST_LOG = 30.0  # half width of a logarithm's interval; a wider one is not reported
_WIDEST_STATE = 4.0  # saturations: an interval of an initial state that is wider says nothing
_RANGES = {"chi": (-1.0, math.inf), "share_at_largest": (0.0, 1.0), "gamma_over_beta": (-1.0, 1.0)}
"""Constants of laws that may be 0 or negative, with their ranges."""
_DRAWS = 400
_LEAST_RESIDUAL = 0.01  # share of a block's residual that survives the fit; below, that block alone sets a parameter


@dataclass(frozen=True)
class Parameter:
    """A value with its 95 % interval; ``low`` and ``high`` are None if the data does not determine the value."""

    value: float
    low: float | None
    high: float | None
    unit: str

    def to_dict(self) -> dict[str, float | str | None]:
        """Return plain values for JSON."""
        return {"value": self.value, "low": self.low, "high": self.high, "unit": self.unit}

    def __str__(self) -> str:
        unit = "" if self.unit in ("-", "1") else f" {self.unit}"
        if self.low is None or self.high is None:
            return f"{self.value:.4g}{unit}"
        return f"{self.value:.4g} ({self.low:.4g} to {self.high:.4g}){unit}"


@dataclass(frozen=True, eq=False)
class Uncertainty:
    """Covariance of x = (q, c), shape (s + p, s + p), with the basis of its intervals.

    ``quantile`` times a standard deviation is half an interval. If ``freedom`` is given, it maps a gradient to degrees
    of freedom, and the quantile is that of Student's t. ``condition`` is the condition number of the Jacobian with
    columns scaled to length 1: it is large if other parameters can compensate for a change of one. ``unidentifiable``,
    shape (s + p,), marks the parameters to which the samples are insensitive. ``effective`` is the effective number of
    independent samples.
    """

    covariance: Floats
    quantile: float
    condition: float
    unidentifiable: Mask
    effective: float
    freedom: Callable[[Floats], float] | None = None

    def half_width(self, gradient: Floats) -> float:
        """Half width of the interval of a function of x with this gradient, shape (s + p,).

        It is infinite where the samples do not tell, or where the variance is the rounding of large ones that cancel.
        """
        if (gradient[self.unidentifiable] != 0).any():
            return math.inf
        variance = float(gradient @ self.covariance @ gradient)
        terms = float(np.abs(gradient) @ np.abs(self.covariance) @ np.abs(gradient))
        if variance <= _CANCELLED * terms:
            return math.inf if terms > 0.0 else 0.0
        quantile = self.quantile if self.freedom is None else student_quantile(self.freedom(gradient))
        return quantile * math.sqrt(variance)

    def correlation(self, i: int, j: int) -> float:
        """Correlation of two entries of x; 0 if the variance of one is 0."""
        size = math.sqrt(self.covariance[i, i] * self.covariance[j, j])
        return float(self.covariance[i, j] / size) if size > 0 else 0.0


@dataclass(frozen=True, eq=False)
class Linearised:
    """Residual at the end of the least squares, and its Jacobian by finite differences.

    ``free`` marks the entries of x that are identifiable and at no bound, ``unidentifiable`` those without influence.
    """

    residual: Floats
    columns: Floats
    free: Mask
    unidentifiable: Mask

    def inverse(self) -> tuple[Floats, float]:
        """Return (J^T J)^-1 of the free entries, and the condition number of J with columns scaled to length 1."""
        jacobian = self.columns[:, self.free]
        norms = np.linalg.norm(jacobian, axis=0)
        _, singular, basis = np.linalg.svd(jacobian / norms, full_matrices=False)
        largest = float(singular.max(initial=1e-300))  # empty if no parameter is identifiable
        singular = np.maximum(singular, 1e-12 * largest)
        within = (basis.T / singular**2) @ basis / np.outer(norms, norms)
        return within, largest / float(singular.min(initial=largest))


def linearise(samples: Samples, form: Form, point: Point) -> Linearised:
    """Differentiate the residual. Coefficients of f at a bound (a flat piece) count as known."""
    residual = residual_of(samples, form, point.sign)
    x = np.concatenate([point.q, point.c])
    high = form.bounds(samples)[1]
    at_bound = point.c - form.backbones[0].low <= 1e-6 * np.abs(point.c).max()
    free = np.concatenate([np.ones(form.size, dtype=bool), ~at_bound])
    at_end = residual(x)
    columns = np.zeros((len(at_end), len(x)))
    for i in np.flatnonzero(free):
        step = _STEP * max(1.0, abs(x[i]))
        if i < form.size and x[i] + step > high[i]:
            step = -step
        columns[:, i] = (residual(x + step * np.eye(len(x))[i]) - at_end) / step
    norms = np.linalg.norm(columns, axis=0)
    unidentifiable = free & (norms <= _UNIDENTIFIABLE * norms.max())
    return Linearised(at_end, columns, free & ~unidentifiable, unidentifiable)


def uncertainty(samples: Samples, form: Form, point: Point) -> Uncertainty:
    """Covariance s^2 (J^T J)^-1 m / m_eff at the end of the least squares.

    The residual of an incomplete model is not white noise. Its m samples count as m_eff = m (1 - r) / (1 + r), where r
    is the correlation of neighbouring samples (first-order autoregression).
    """
    line = linearise(samples, form, point)
    within, condition = line.inverse()
    e, m, p = line.residual, len(line.residual), int(line.free.sum())
    neighbours = float(e[1:] @ e[:-1]) / max(float(e @ e), 1e-300)
    effective = m * (1 - max(0.0, neighbours)) / (1 + max(0.0, neighbours))
    variance = float(e @ e) / max(1, m - p) * m / max(1.0, effective)
    quantile = student_quantile(m - p)
    return Uncertainty(_of_all(line, variance * within), quantile, condition, line.unidentifiable, effective)


def bootstrap(samples: Samples, form: Form, point: Point, seed: int) -> Uncertainty:
    """Covariance by block bootstrap; one Gauss-Newton step refits each draw of blocks with replacement.

    Residuals may be correlated within a block in any way (Kunsch 1989, doi 10.1214/aos/1176347265). The fit reduces the
    residual of the blocks that determine a parameter. Their residual is therefore divided by the root of the share that
    survives the fit. As these blocks may be few, the quantiles are those of Student's t with Satterthwaite's degrees of
    freedom (both: Bell and McCaffrey 2002, Survey Methodology 28(2), 169-181).

    Parameters
    ----------
    samples, form, point
        End of the least squares; ``samples.blocks`` has at least two blocks.
    seed
        Of the draws.
    """
    line = linearise(samples, form, point)
    jacobian = line.columns[:, line.free]
    assert samples.blocks is not None
    names, number = np.unique(samples.blocks[samples.train], return_inverse=True)
    parts = [number == i for i in range(len(names))]
    blocks = _Blocks.of([jacobian[part] for part in parts], [line.residual[part] for part in parts])
    steps = blocks.steps(np.random.default_rng(seed))
    k = len(names)
    centred = steps - steps.mean(axis=0)
    covariance = centred.T @ centred / (_DRAWS - 1)
    return Uncertainty(
        _of_all(line, covariance), student_quantile(k - 1), line.inverse()[1], line.unidentifiable, float(k),
        lambda gradient: blocks.freedom(gradient[line.free]),
    )  # fmt: skip


def block_spread(jacobians: Sequence[Floats], residuals: Sequence[Floats], seed: int) -> Uncertainty:
    """Give the block bootstrap of :func:`bootstrap` from the blocks of a least-squares fit of any model.

    Parameters
    ----------
    jacobians, residuals
        Of each of at least two blocks: derivatives of the residual, shape (m_b, p), no column all zero over all blocks;
        residual, shape (m_b,).
    seed
        Of the draws.
    """
    blocks = _Blocks.of(jacobians, residuals)
    steps, k = blocks.steps(np.random.default_rng(seed)), len(jacobians)
    centred = steps - steps.mean(axis=0)
    scaled = np.concatenate(jacobians) / blocks.size
    return Uncertainty(
        centred.T @ centred / (_DRAWS - 1), student_quantile(k - 1), float(np.linalg.cond(scaled)),
        np.zeros(steps.shape[1], dtype=bool), float(k), blocks.freedom,
    )  # fmt: skip


def student_quantile(freedom: float) -> float:
    """Quantile of Student's t; scipy.stats has the same, but takes as long to load as the rest of scipy together."""
    return float(stdtrit(max(1.0, freedom), 0.5 + 0.5 * _CONFIDENCE))


@dataclass(frozen=True, eq=False)
class _Blocks:
    """Matrices of k blocks with p free parameters for a bootstrap, columns scaled to length 1.

    ``normals``, shape (k, p, p): J^T J; ``gradients``, (k, p): J^T W e, W = (1 - H)^-1/2 of the block, H its part of
    the hat matrix; ``weighted``, (k, p, p): J^T W^2 J; ``crossed``, (k, p, p): J^T W J; ``inverse``, (p, p), of the sum
    of the normals.
    """

    normals: Floats
    gradients: Floats
    weighted: Floats
    crossed: Floats
    inverse: Floats
    size: Floats

    @classmethod
    def of(cls, jacobians: Sequence[Floats], residuals: Sequence[Floats]) -> _Blocks:
        size = np.sqrt(np.maximum(sum((j**2).sum(axis=0) for j in jacobians), 1e-300))
        scaled = [j / size for j in jacobians]
        normals = np.array([j.T @ j for j in scaled])
        inverse = np.linalg.pinv(normals.sum(axis=0), rcond=1e-14, hermitian=True)
        values, vectors = np.linalg.eigh(inverse)
        root = vectors * np.sqrt(np.maximum(values, 0.0))
        gradients, weighted, crossed = (np.zeros_like(part) for part in (normals[:, 0], normals, normals))
        for i, (j, e) in enumerate(zip(scaled, residuals, strict=True)):
            basis, own, _ = np.linalg.svd(j @ root, full_matrices=False)
            more = np.maximum(1.0 - own**2, _LEAST_RESIDUAL) ** -0.5 - 1.0
            once = j + basis @ (more[:, np.newaxis] * (basis.T @ j))  # W J
            gradients[i], weighted[i], crossed[i] = once.T @ e, once.T @ once, j.T @ once
        return cls(normals, gradients, weighted, crossed, inverse, size)

    def steps(self, rng: np.random.Generator) -> Floats:
        """Gauss-Newton steps of the draws, shape (draws, p)."""
        k = len(self.gradients)
        draws = rng.multinomial(k, np.full(k, 1 / k), _DRAWS).astype(float)
        # If few blocks determine a parameter, the normal matrix of a draw may be singular; 10 % of the whole is added.
        whole = self.normals.sum(axis=0)
        gradients = self.gradients - self.gradients.mean(axis=0)
        found = np.empty((_DRAWS, self.gradients.shape[1]))
        for i, draw in enumerate(draws):
            matrix = 0.9 * np.tensordot(draw, self.normals, 1) + 0.1 * whole
            found[i] = np.linalg.lstsq(matrix, -(draw @ gradients), rcond=1e-14)[0]
        return found / self.size

    def freedom(self, gradient: Floats) -> float:
        """Degrees of freedom of the variance of a combination of parameters, for white noise."""
        direction = self.inverse @ (gradient / self.size)
        own = np.einsum("i,kij,j->k", direction, self.weighted, direction)
        ends = np.einsum("kij,j->ki", self.crossed, direction)
        gram = np.diag(own) - ends @ self.inverse @ ends.T
        total = float((gram**2).sum())
        return float(np.trace(gram)) ** 2 / total if total > 0 else math.inf


def _of_all(line: Linearised, covariance: Floats) -> Floats:
    """Extend a covariance of the free entries to all of x, with zeros."""
    out = np.zeros((len(line.free), len(line.free)))
    out[np.ix_(line.free, line.free)] = covariance
    return out


def coordinates(form: Form) -> list[tuple[str, int]]:
    """Names and indices in x of the parameters of the law: A, saturation_deg and its constants, of each element."""
    names = ("A", "saturation_deg", *(constant.name for constant in form.base_law.constants))
    size = form.base_law.size
    return [(name + _mark(i), size * i + j) for i in range(form.elements) for j, name in enumerate(names)]


def _mark(i: int) -> str:
    return f"_{i + 1}" if i else ""


def parameters_of(samples: Samples, form: Form, point: Point, spread: Uncertainty | None) -> dict[str, Parameter]:
    """Return A, beta, gamma, n, h0_deg, saturation_deg, the rest of q, and the coefficients of f, with intervals.

    Names of a second element end in ``_2``, initial states of further records in ``_record_2`` and so on.
    ``amplitude_2`` is the ratio of h in the second group of records to h in the first; ``zero_deg_record_2`` is the
    offset of the second record's angle from f + h. Without a ``spread`` the intervals are None. Intervals of A, n and
    the saturation end at the bounds of the search. For h = 0 (sign 0) the intervals of its parameters are None.
    """
    found: dict[str, Parameter] = {}
    reader = Reader.of(spread, samples, form, point)
    bouc_wen = form.base_law is BOUC_WEN
    for i in range(form.elements):
        of_law = _element(reader, samples, form, point, i) if bouc_wen else _of_other_law(reader, form, point)
        found |= {name + _mark(i): value for name, value in of_law.items()}
    for record in range(len(form.groups)):
        for i in range(form.elements):
            suffix = _mark(i) + (f"_record_{record + 1}" if record else "")
            found[f"h0_deg{suffix}"] = _initial(reader, samples, form, point, (record, i))
    for group in range(1, max(form.groups) + 1):
        place = form.amplitude(group)
        found[f"amplitude_{group + 1}"] = reader.positive(math.exp(point.q[place]), reader.along(place), "1")
    if form.longest_delay_s > 0:
        found["delay_s"] = reader.plain(form.delay_s(point.q), reader.along(form.size - 1), "s")
    if point.sign == 0:
        found = {name: replace(parameter, low=None, high=None) for name, parameter in found.items()}
    for record, place in enumerate(range(form.zeros.start, form.zeros.stop), 2):
        found[f"zero_deg_record_{record}"] = reader.plain(float(point.q[place]), reader.along(place), "deg")
    backbone = form.backbones[0]
    for i, (name, unit) in enumerate(zip(backbone.names, backbone.units, strict=True)):
        found[name] = reader.plain(float(point.c[i]), reader.along(form.size + i), unit)
    return found


def _initial(reader: Reader, samples: Samples, form: Form, point: Point, which: tuple[int, int]) -> Parameter:
    """Return h at the first sample of a record, ``which`` = (record, element)."""
    record, i = which
    first = form.paths(samples, point)[record][:1]

    def initial(q: Floats) -> float:
        return float(replace(point, q=q).elements(form, record)[i].along(first)[0])

    size, place = form.base_law.size, form.state(record).start + i
    if point.sign == 0:
        return reader.plain(0.0, reader.along(place, 0.0), "deg")
    places = [*range(size * i, size * (i + 1)), place]
    found = reader.plain(initial(point.q), reader.gradient(initial, point.q, places), "deg")
    largest = point.elements(form, record)[i].saturation_deg
    known = found.low is not None and found.high is not None and found.high - found.low < _WIDEST_STATE * largest
    return found if known else replace(found, low=None, high=None)


def _of_other_law(reader: Reader, form: Form, point: Point) -> dict[str, Parameter]:
    """Return the constants of a law other than Bouc-Wen, of one element, and its saturation."""
    law = form.base_law

    def named(q: Floats) -> dict[str, tuple[float, str]]:
        return law.named(point.sign, form.values(q[np.newaxis], 0)[0, 0])

    def gradient(name: str) -> Floats:
        return reader.gradient(lambda q: named(q)[name][0], point.q, range(law.size))

    found = {
        name: _bounded(reader, name, value, unit, gradient(name)) for name, (value, unit) in named(point.q).items()
    }
    if point.sign == 0:
        return found | {"saturation_deg": reader.positive(0.0, reader.along(1), "deg")}

    def log_half_width(q: Floats) -> float:
        return math.log(law.half_width_deg(point.sign, form.values(q[np.newaxis], 0)[0, 0]))

    along = reader.gradient(log_half_width, point.q, range(law.size))
    return found | {"saturation_deg": reader.positive(math.exp(log_half_width(point.q)), along, "deg")}


def _bounded(reader: Reader, name: str, value: float, unit: str, gradient: Floats) -> Parameter:
    """Return a constant of a law; the interval of a number of one sign is that of its logarithm."""
    if name in _RANGES:
        one, (least, most) = reader.plain(value, gradient, unit), _RANGES[name]
        if one.low is None or one.high is None:
            return one
        return replace(one, low=max(one.low, least), high=min(one.high, most))
    if value == 0:
        return Parameter(value, None, None, unit)
    one = reader.positive(abs(value), gradient / value, unit)
    if value > 0:
        return one
    low, high = (None if end is None else -end for end in (one.high, one.low))
    return Parameter(value, low, high, unit)


@dataclass(frozen=True)
class Reader:
    """Makes a parameter with an interval from a value and its gradient; ``bounds`` are those of q."""

    spread: Uncertainty | None
    size: int
    bounds: tuple[Floats, Floats]

    @classmethod
    def of(cls, spread: Uncertainty | None, samples: Samples, form: Form, point: Point) -> Reader:
        """Make a reader for one model."""
        return cls(spread, form.size + len(point.c), form.bounds(samples))

    def along(self, at: int, value: float = 1.0) -> Floats:
        """Return the gradient of a value times one entry of x, shape (s + p,)."""
        gradient = np.zeros(self.size)
        gradient[at] = value
        return gradient

    def gradient(self, function: Callable[[Floats], float], q: Floats, places: Iterable[int]) -> Floats:
        """Differentiate a function of q by central differences at some places, within the bounds: shape (s + p,)."""
        found, (low, high) = np.zeros(self.size), self.bounds
        for i in places:
            up, down = q.copy(), q.copy()
            up[i], down[i] = min(q[i] + _GRADIENT_STEP, high[i]), max(q[i] - _GRADIENT_STEP, low[i])
            found[i] = (function(up) - function(down)) / (up[i] - down[i])
        return found

    def plain(self, value: float, gradient: Floats, unit: str) -> Parameter:
        """Return a parameter with the interval of its value."""
        half = math.inf if self.spread is None else self.spread.half_width(gradient)
        if not math.isfinite(half):
            return Parameter(value, None, None, unit)
        return Parameter(value, value - half, value + half, unit)

    def positive(self, value: float, gradient: Floats, unit: str, ends: tuple[float, float] | None = None) -> Parameter:
        """Return a positive parameter with the interval of its logarithm, which ``ends`` bound."""
        half = math.inf if self.spread is None else self.spread.half_width(gradient)
        if self.spread is None or value == 0 or (ends is None and half > _WIDEST_LOG):
            return Parameter(value, None, None, unit)
        log_low, log_high = math.log(value) - half, math.log(value) + half
        if ends is not None:
            log_low, log_high = max(log_low, ends[0]), min(log_high, ends[1])
        return Parameter(value, math.exp(log_low), math.exp(log_high), unit)


def _element(reader: Reader, samples: Samples, form: Form, point: Point, i: int) -> dict[str, Parameter]:
    low, high = form.bounds(samples)
    at = 4 * i
    _, log_saturation, _, rho = (float(v) for v in point.q[at : at + 4])
    model = point.models(form)[i]
    saturation = math.exp(log_saturation) if point.sign else 0.0
    of_log_beta = np.zeros(reader.size)
    of_log_beta[at : at + 4] = 1.0, -model.n, -model.n * log_saturation, -1 / (1 + rho)
    of_gamma = model.beta * (rho * of_log_beta + reader.along(at + 3))
    slope = reader.positive(abs(model.A), reader.along(at), "1", (low[at], high[at]))
    if point.sign < 0:
        ends = [None if end is None else -end for end in (slope.high, slope.low)]
        slope = Parameter(model.A, ends[0], ends[1], "1")
    return {
        "A": slope,
        "beta": reader.positive(model.beta, of_log_beta, "deg^-n"),
        "gamma": reader.plain(model.gamma, of_gamma, "deg^-n"),
        "n": reader.positive(model.n, reader.along(at + 2), "1", (low[at + 2], high[at + 2])),
        "saturation_deg": reader.positive(saturation, reader.along(at + 1), "deg", (low[at + 1], high[at + 1])),
    }
