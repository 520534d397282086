"""Search for the parameters of theta = f(x; c) + h: a global search (paper, section 3.3), then least squares.

h is a sum of Bouc-Wen elements, one by default. The search runs on q: for each element (log |A|, log S, log n,
rho = gamma / beta) with the saturation S, then the first states h0 / S of each element in each record and the
logarithms of the amplitudes of h in further groups of records; and on the sign of A. What follows in q, the zeros of
the angle in further records and the delay, is left to the least squares. Every point of that box is an
admissible model; beta + gamma = |A| / S^n. The sign 0 stands for h = 0.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Literal

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import least_squares

from hysteresis.arrays import Floats, Mask
from hysteresis.backbone import Backbone, fit_curves
from hysteresis.bouc_wen import BoucWen, hysteresis_batch
from hysteresis.optimizers import Method, evolve
from hysteresis.path import branches

Fitness = Literal["rmse", "paper-signed-mean"]

LAW = ("A", "saturation_deg", "n", "gamma / beta")  # coordinates of an element
_SLOPE = (0.02, 20.0)  # |A|
_SATURATION = (1e-5, 1.0)  # in ranges of the angle; below, a record shows no hysteresis
_SHARPNESS = (1.0, 10.0)  # n
_RHO = (-0.95, 1.0)  # gamma / beta
_AMPLITUDE = (0.05, 20.0)  # of a further group
_ZERO = 0.5  # of a further record, in ranges of the angle
_POLISH_STEPS = 100
_ROUNDS = 3  # of the global search; after each the path of f is brought up to date


@dataclass(frozen=True, eq=False)
class Samples:
    """What a fit works on: the path visits every drive, the angles of ``seen`` count. Shapes (m,).

    Records stand one after the other; ``starts`` are their first samples. ``time_s`` and ``history``, the times and
    drives of each record in full, are there where the drive may act with a delay. ``blocks`` numbers what belongs
    together when samples are drawn for a bootstrap.
    """

    drive: Floats
    angle_deg: Floats
    seen: Mask
    starts: tuple[int, ...] = (0,)
    time_s: Floats | None = None
    history: tuple[tuple[Floats, Floats], ...] = ()
    blocks: NDArray[np.int64] | None = None

    def slices(self) -> list[slice]:
        """Give the samples of each record."""
        return [slice(a, b) for a, b in zip(self.starts, (*self.starts[1:], len(self.drive)), strict=True)]

    def drives(self, delay_s: float = 0.0) -> list[Floats]:
        """Drive of each record, ``delay_s`` earlier."""
        if delay_s == 0.0 or self.time_s is None:
            return [self.drive[part] for part in self.slices()]
        pairs = zip(self.slices(), self.history, strict=True)
        return [np.interp(self.time_s[part] - delay_s, *history) for part, history in pairs]

    def seen_drives(self) -> list[Floats]:
        """Drive of the samples seen, of each record."""
        return [self.drive[part][self.seen[part]] for part in self.slices()]

    def span_deg(self) -> float:
        """Range of the angles seen."""
        return float(np.ptp(self.angle_deg[self.seen]))

    def thinned(self, limit: int) -> Samples:
        """About ``limit`` samples, evenly chosen, with all turning points; none after a record's last one seen.

        The law is rate independent, so samples between turning points may be left out of its path.
        """
        ends = [part.start + int(np.flatnonzero(self.seen[part])[-1]) + 1 for part in self.slices()]
        every = max(1, math.ceil(sum(ends[i] - start for i, start in enumerate(self.starts)) / limit))
        keep = np.zeros(len(self.drive), dtype=bool)
        for start, end in zip(self.starts, ends, strict=True):
            keep[start:end:every] = True
            keep[[start, *(start + branch.stop - 1 for branch in branches(self.drive[start:end]))]] = True
        starts = tuple(int(keep[:start].sum()) for start in self.starts)
        time = None if self.time_s is None else self.time_s[keep]
        blocks = None if self.blocks is None else self.blocks[keep]
        return Samples(self.drive[keep], self.angle_deg[keep], self.seen[keep], starts, time, self.history, blocks)


@dataclass(frozen=True)
class Form:
    """What a model consists of, before its numbers.

    ``backbones``: f of each record, with shared coefficients. ``elements`` of h. ``groups``: of each record, counted
    from 0; the constants of h are those of group 0, and h as a whole has another size in each further group.
    ``longest_delay_s``: 0 for none.
    """

    backbones: tuple[Backbone, ...]
    elements: int = 1
    groups: tuple[int, ...] = (0,)
    longest_delay_s: float = 0.0

    @property
    def law(self) -> slice:
        """Constants of the elements in q."""
        return slice(0, 4 * self.elements)

    def state(self, record: int) -> slice:
        """First states of a record in q."""
        start = (4 + record) * self.elements
        return slice(start, start + self.elements)

    def amplitude(self, group: int) -> int:
        """Place of the logarithm of a further group's amplitude in q."""
        return (4 + len(self.groups)) * self.elements + group - 1

    @property
    def searched(self) -> int:
        """Number of coordinates that the global search is for; they come first in q."""
        return self.amplitude(max(self.groups)) + 1

    @property
    def zeros(self) -> slice:
        """Zeros of the angle in the records after the first, deg."""
        return slice(self.searched, self.searched + len(self.groups) - 1)

    @property
    def size(self) -> int:
        """Number of coordinates in q."""
        return self.zeros.stop + (self.longest_delay_s > 0)

    def delay_s(self, q: Floats) -> float:
        """Delay of the angle behind the drive."""
        return float(q[-1]) if self.longest_delay_s > 0 else 0.0

    def rows(self, sign: Floats, q: Floats, record: int) -> Floats:
        """Rows (A, beta, gamma, n, h0_deg) of k candidates: shapes (k,), (k, size) -> (k, elements, 5).

        A sign 0 has h = 0.
        """
        slope, saturation, n, rho = np.moveaxis(q[:, self.law].reshape(len(q), self.elements, 4), 2, 0)
        slope, saturation, n = np.exp(slope), np.exp(saturation), np.exp(n)
        if self.groups[record] > 0:
            size = np.exp(q[:, self.amplitude(self.groups[record])])[:, np.newaxis]
            slope, saturation = slope * size, saturation * size
        beta = slope / saturation**n / (1 + rho)
        state = np.clip(q[:, self.state(record)], -1.0, 1.0)
        sign = sign[:, np.newaxis]
        return np.stack([sign * slope, beta, rho * beta, n, np.abs(sign) * state * saturation], axis=2)

    def box(self, samples: Samples) -> tuple[Floats, Floats]:
        """Bounds of q, shapes (size,); that of the saturation scales with the range of the angle."""
        saturation = np.log(_SATURATION) + math.log(samples.span_deg())
        law = [np.log(_SLOPE), saturation, np.log(_SHARPNESS), np.array(_RHO)] * self.elements
        states = [np.array([-1.0, 1.0])] * (self.elements * len(self.groups))
        rest = [np.log(_AMPLITUDE)] * max(self.groups)
        rest += [_ZERO * samples.span_deg() * np.array([-1.0, 1.0])] * (len(self.groups) - 1)
        if self.longest_delay_s > 0:
            rest.append(np.array([0.0, self.longest_delay_s]))
        low, high = np.array([*law, *states, *rest]).T
        return low, high

    def hysteresis(self, paths: list[Floats], sign: Floats, q: Floats) -> Floats:
        """Follow k candidates along the paths of f, record after record: h, shape (k, m), deg."""
        parts = []
        for i, path in enumerate(paths):
            rows = self.rows(sign, q, i)
            h = hysteresis_batch(path, rows.reshape(-1, 5))
            parts.append(h.reshape(len(q), self.elements, -1).sum(axis=1) if self.elements > 1 else h)
        return parts[0] if len(parts) == 1 else np.concatenate(parts, axis=1)

    def angle(self, samples: Samples, point: Point) -> Floats:
        """Predict the angle f + h, shape (m,), deg."""
        paths = self.paths(samples, point)
        return self.sum(paths, np.array([point.sign]), point.q)

    def sum(self, paths: list[Floats], sign: Floats, q: Floats) -> Floats:
        """Add the zeros of the records, f and h: shape (m,), deg; ``sign`` has shape (1,)."""
        zeros = (0.0, *q[self.zeros].tolist())
        f = [path + zero for path, zero in zip(paths, zeros, strict=True)]
        return np.concatenate(f) + self.hysteresis(paths, sign, q[np.newaxis])[0]

    def paths(self, samples: Samples, point: Point) -> list[Floats]:
        """Give f along the drive of each record."""
        drives = samples.drives(self.delay_s(point.q))
        return [backbone.at(drive)(point.c) for backbone, drive in zip(self.backbones, drives, strict=True)]

    def curve(self, samples: Samples, target: Floats, q: Floats) -> tuple[Floats, Floats]:
        """Give the coefficients of f nearest to a target, shape (m,), at the samples seen, and q with its zeros."""
        targets = [target[part][samples.seen[part]] for part in samples.slices()]
        c, zeros = fit_curves(self.backbones, samples.seen_drives(), targets)
        q = q.copy()
        q[self.zeros] = zeros
        return c, q


@dataclass(frozen=True)
class Point:
    """One model of a :class:`Form`: the sign of A (0 for h = 0), q, and the coefficients c of f, shape (p,)."""

    sign: float
    q: Floats
    c: Floats

    def models(self, form: Form, record: int = 0) -> list[BoucWen]:
        """Bouc-Wen law of each element, in one record."""
        rows = form.rows(np.array([self.sign]), self.q[np.newaxis], record)[0]
        return [BoucWen(*row.tolist()) for row in rows]


@dataclass(frozen=True)
class Effort:
    """How hard to search: individuals, generations in all, seed; ``tick`` is called after each generation."""

    method: Method
    fitness: Fitness
    seed: int
    population: int
    generations: int
    tick: Callable[[], None]


def explore(samples: Samples, form: Form, effort: Effort) -> tuple[list[Point], int]:
    """Points to start a polish from, the best of each sign of A first, then a play operator; also the evaluations.

    The h of a whole generation is computed in one compiled call, along the present estimate of f. The coefficients of
    f are not searched for: of every candidate's residual only the part counts that no change of them can mend
    (variable projection). That f starts as the best curve without hysteresis and is renewed after each round.

    ``fitness="paper-signed-mean"`` scores by -|eq. 8|; f is left as it is, and there is one point.
    """
    low, high = (bound[: form.searched] for bound in form.box(samples))
    rng = np.random.default_rng(effort.seed)
    genes = rng.uniform(low, high, (effort.population, form.searched))
    genes = np.column_stack([rng.choice([-1.0, 1.0], effort.population), genes])
    flat = plain(form, samples)
    c, rest = flat.c, flat.q[form.searched :]
    missed = rmse(samples, form, flat)
    rounds = _ROUNDS if effort.fitness == "rmse" else 1
    evaluations = 0
    for i in range(rounds):
        score = _score(samples, form, c, effort.fitness)

        def counted(batch: Floats, score: Callable[[Floats], Floats] = score) -> Floats:
            nonlocal evaluations
            evaluations += len(batch)
            return score(batch)

        share = effort.generations // rounds + (i < effort.generations % rounds)
        bounds, seed = (low, high), effort.seed + i
        genes = evolve(
            effort.method, counted, genes, bounds, generations=share, seed=seed, tick=effort.tick
        )[: effort.population]  # fmt: skip
        if effort.fitness == "paper-signed-mean":
            return [Point(float(genes[0, 0]), np.concatenate([genes[0, 1:], rest]), c)], evaluations
        points = [
            with_curve_of(form, samples, form, Point(sign, np.concatenate([genes[mine][0, 1:], rest]), c))
            for sign in (-1.0, 1.0)
            if (mine := genes[:, 0] == sign).any()
        ]
        points.sort(key=lambda point: rmse(samples, form, point))
        genes[:, 1] += points[0].q[0] - genes[genes[:, 0] == points[0].sign][0, 1]
        genes[:, 1:] = np.clip(genes[:, 1:], low, high)
        c = points[0].c
    # Without hysteresis the two branches of a play miss the curve by its half width.
    play = flat.q.copy()
    play[form.law] = np.tile([0.0, math.log(max(missed, math.exp(low[1]))), math.log(5.0), 0.9], form.elements)
    return [*points, with_curve_of(form, samples, form, Point(-1.0, play, c))], evaluations


def with_curve_of(new: Form, samples: Samples, old: Form, point: Point) -> Point:
    """Fit a new f with h left as it is, and rescale A so that h keeps its shape on the path of the new f."""
    f = old.paths(samples, point)
    h = old.hysteresis(f, np.array([point.sign]), point.q[np.newaxis])[0]
    c, q = new.curve(samples, samples.angle_deg - h, point.q)
    moved = replace(point, q=q, c=c)
    before, after = (sum(float(np.abs(np.diff(p)).sum()) for p in paths) for paths in (f, new.paths(samples, moved)))
    if before > 0 and after > 0:
        slopes = slice(0, old.law.stop, 4)
        moved.q[slopes] = np.clip(moved.q[slopes] + math.log(before / after), *np.log(_SLOPE))
    return moved


def split_element(form: Form, point: Point, share: float) -> tuple[Form, Point]:
    """Replace the one element by two that saturate one after the other, at ``share`` and 2 - share of its path."""
    two = replace(form, elements=2)
    half = point.q[form.law] + np.array([math.log(0.5), math.log(0.5), 0.0, 0.0])
    law = [half + np.array([0.0, math.log(part), 0.0, 0.0]) for part in (share, 2 - share)]
    states = np.repeat(point.q[4 : 4 + len(form.groups)], 2)
    return two, replace(point, q=np.concatenate([*law, states, point.q[4 + len(form.groups) :]]))


def plain(form: Form, samples: Samples) -> Point:
    """Fit f alone, h = 0: A = 0, beta = 1, gamma = 0, n = 1."""
    q = np.zeros(form.size)
    q[form.zeros.stop :] = 0.05 * form.longest_delay_s  # where a delay is sought, it starts from here
    c, q = form.curve(samples, samples.angle_deg, q)
    return Point(0.0, q, c)


def rmse(samples: Samples, form: Form, point: Point) -> float:
    """Root mean square deviation over the samples seen, deg."""
    deviation = (form.angle(samples, point) - samples.angle_deg)[samples.seen]
    return float(np.sqrt(np.mean(deviation**2)))


def _score(samples: Samples, form: Form, c: Floats, fitness: Fitness) -> Callable[[Floats], Floats]:
    """Fitness of genes (sign, q): shape (k, 1 + size) -> (k,), higher is better. The delay is left out."""
    paths = [backbone.at(drive)(c) for backbone, drive in zip(form.backbones, samples.drives(), strict=True)]
    missing = (samples.angle_deg - np.concatenate(paths))[samples.seen]
    seen = samples.seen_drives()
    of_c = np.concatenate([b.jacobian(drive, c) for b, drive in zip(form.backbones, seen, strict=True)])
    which = np.repeat(np.arange(len(seen)), [len(drive) for drive in seen])
    of_zeros = which[:, np.newaxis] == np.arange(1, len(seen))
    directions = np.linalg.qr(np.column_stack([of_c, of_zeros]))[0]

    def score(genes: Floats) -> Floats:
        residual = form.hysteresis(paths, genes[:, 0], genes[:, 1:])[:, samples.seen] - missing
        if fitness == "paper-signed-mean":
            return -np.abs(residual.mean(axis=1)) / samples.span_deg()
        residual -= (residual @ directions) @ directions.T
        return -np.sqrt(np.mean(residual**2, axis=1))

    return score


def polish(samples: Samples, form: Form, point: Point) -> tuple[Point, int]:
    """Least squares on q and c together, the path of h being that of the same f; also the evaluations it took."""
    residual = residual_of(samples, form, point.sign)
    low, high = form.box(samples)
    bounds = np.concatenate([low, form.backbones[0].low]), np.concatenate([high, form.backbones[0].high])
    calls = 0

    def counted(x: Floats) -> Floats:
        nonlocal calls
        calls += 1
        return residual(x)

    start = np.clip(np.concatenate([point.q, point.c]), *bounds)
    solution = least_squares(
        counted, start, bounds=bounds, x_scale="jac", max_nfev=_POLISH_STEPS, ftol=1e-10, xtol=1e-10, gtol=1e-10
    )
    return replace(point, q=solution.x[: form.size], c=solution.x[form.size :]), calls


def residual_of(samples: Samples, form: Form, sign: float) -> Callable[[Floats], Floats]:
    """Give the function x = (q, c) -> prediction - measurement over the samples seen, deg."""
    fixed = None
    if form.longest_delay_s == 0:
        fixed = [backbone.at(drive) for backbone, drive in zip(form.backbones, samples.drives(), strict=True)]
    signs = np.array([sign])

    def residual(x: Floats) -> Floats:
        q, c = x[: form.size], x[form.size :]
        paths = form.paths(samples, Point(sign, q, c)) if fixed is None else [f(c) for f in fixed]
        return (form.sum(paths, signs, q) - samples.angle_deg)[samples.seen]

    return residual
