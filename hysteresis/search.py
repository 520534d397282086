"""Search for the parameters of theta = f(x; c) + h: genetic algorithm (paper, section 3.3), then least squares.

The search runs on q = (log |A|, log S, log n, rho = gamma / beta, h0 / S) with the saturation S, and on the sign of
A. Every point of that box is an admissible model; beta + gamma = |A| / S^n. The sign 0 stands for h = 0.
"""

from __future__ import annotations

import math
import random
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass, replace
from typing import Literal

import numpy as np
import pygad
from numpy.typing import NDArray
from scipy.optimize import least_squares

from hysteresis.backbone import Backbone
from hysteresis.bouc_wen import BoucWen, hysteresis, hysteresis_batch
from hysteresis.path import branches

Floats = NDArray[np.float64]
Mask = NDArray[np.bool_]
Fitness = Literal["rmse", "paper-signed-mean"]

COORDINATES = ("A", "saturation_deg", "n", "gamma / beta", "h0_deg / saturation_deg")
_SLOPE = (0.02, 20.0)  # |A|
_SATURATION = (1e-5, 1.0)  # in ranges of the angle; below, a record shows no hysteresis
_SHARPNESS = (1.0, 10.0)  # n
_RHO = (-0.95, 1.0)  # gamma / beta
_POLISH_STEPS = 100
_ROUNDS = 3  # of the genetic search; after each the path of f is brought up to date


@dataclass(frozen=True)
class Samples:
    """What a fit works on: the path visits every drive, the angles of ``seen`` count. Shapes (m,)."""

    drive: Floats
    angle_deg: Floats
    seen: Mask

    def thinned(self, limit: int) -> Samples:
        """About ``limit`` samples, evenly chosen, with all turning points; none after the last one seen.

        The law is rate independent, so samples between turning points may be left out of its path.
        """
        end = int(np.flatnonzero(self.seen)[-1]) + 1
        keep = np.zeros(end, dtype=bool)
        keep[:: max(1, math.ceil(end / limit))] = True
        keep[[0, *(branch.stop - 1 for branch in branches(self.drive[:end]))]] = True
        return Samples(self.drive[:end][keep], self.angle_deg[:end][keep], self.seen[:end][keep])


@dataclass(frozen=True)
class Point:
    """One model: the sign of A (0 for h = 0), q of shape (5,), and the coefficients c of f, shape (p,)."""

    sign: float
    q: Floats
    c: Floats

    @property
    def model(self) -> BoucWen:
        """The Bouc-Wen law of this point."""
        return BoucWen(*rows(np.array([self.sign]), self.q[np.newaxis])[0].tolist())

    def angle(self, backbone: Backbone, drive: Floats) -> Floats:
        """Predict the angle f + h along a path of the drive, shape (m,) -> (m,), deg."""
        f = backbone.at(drive)(self.c)
        return f + hysteresis(f, self.model)


def rows(sign: Floats, q: Floats) -> Floats:
    """Rows (A, beta, gamma, n, h0_deg) of the coordinates: shapes (k,) and (k, 5) -> (k, 5). A sign 0 has h = 0."""
    slope, saturation, n = np.exp(q[:, :3].T)
    rho, state = q[:, 3], np.clip(q[:, 4], -1.0, 1.0)
    beta = slope / saturation**n / (1 + rho)
    return np.column_stack([sign * slope, beta, rho * beta, n, np.abs(sign) * state * saturation])


def box(samples: Samples) -> tuple[Floats, Floats]:
    """Bounds of q, shapes (5,); that of the saturation scales with the range of the angle."""
    span = float(np.ptp(samples.angle_deg[samples.seen]))
    slope, saturation, sharpness = np.log(_SLOPE), np.log(_SATURATION) + math.log(span), np.log(_SHARPNESS)
    low, high = np.column_stack([slope, saturation, sharpness, _RHO, (-1.0, 1.0)])
    return low, high


def genetic(
    samples: Samples,
    backbone: Backbone,
    *,
    fitness: Fitness,
    seed: int,
    population: int,
    generations: int,
    tick: Callable[[], None],
) -> tuple[list[Point], int]:
    """Points to start a polish from, the best of each sign of A first, then a play operator; also the evaluations.

    The h of a whole generation is computed in one compiled call, along the present estimate of f. The coefficients of
    f are not searched for: of every candidate's residual only the part counts that no change of them can mend
    (variable projection). That f starts as the best curve without hysteresis and is renewed after each round.

    ``fitness="paper-signed-mean"`` scores by -|eq. 8|; f is left as it is, and there is one point.
    """
    low, high = box(samples)
    rng = np.random.default_rng(seed)
    genes = rng.uniform(low, high, (population, 5))
    genes = np.column_stack([rng.choice([-1.0, 1.0], population), genes])
    c = backbone.fit(samples.drive[samples.seen], samples.angle_deg[samples.seen])
    missed = float(np.sqrt(np.mean((samples.angle_deg - backbone.at(samples.drive)(c))[samples.seen] ** 2)))
    rounds = _ROUNDS if fitness == "rmse" else 1
    evaluations = 0
    for i in range(rounds):
        score = _score(samples, backbone, c, fitness)

        def counted(batch: Floats, score: Callable[[Floats], Floats] = score) -> Floats:
            nonlocal evaluations
            evaluations += len(batch)
            return score(batch)

        share = generations // rounds + (i < generations % rounds)
        genes = _evolve(counted, genes, (low, high), share, seed + i, tick)
        if fitness == "paper-signed-mean":
            return [Point(float(genes[0, 0]), genes[0, 1:], c)], evaluations
        points = [
            with_curve_of(backbone, samples, backbone, Point(sign, genes[genes[:, 0] == sign][0, 1:], c))
            for sign in (-1.0, 1.0)
            if (genes[:, 0] == sign).any()
        ]
        points.sort(key=lambda point: rmse(samples, backbone, point))
        genes[:, 1] += points[0].q[0] - genes[genes[:, 0] == points[0].sign][0, 1]
        genes[:, 1:] = np.clip(genes[:, 1:], low, high)
        c = points[0].c
    # Without hysteresis the two branches of a play miss the curve by its half width.
    play = np.array([0.0, math.log(max(missed, math.exp(low[1]))), math.log(5.0), 0.9, 0.0])
    return [*points, with_curve_of(backbone, samples, backbone, Point(-1.0, play, c))], evaluations


def with_curve_of(new: Backbone, samples: Samples, old: Backbone, point: Point) -> Point:
    """Fit a new f with h left as it is, and rescale A so that h keeps its shape on the path of the new f."""
    f = old.at(samples.drive)(point.c)
    h = hysteresis(f, point.model)
    c = new.fit(samples.drive[samples.seen], (samples.angle_deg - h)[samples.seen])
    before, after = (float(np.abs(np.diff(path)).sum()) for path in (f, new.at(samples.drive)(c)))
    q = point.q.copy()
    if before > 0 and after > 0:
        q[0] = np.clip(q[0] + math.log(before / after), *np.log(_SLOPE))
    return replace(point, q=q, c=c)


def plain(backbone: Backbone, samples: Samples) -> Point:
    """Fit f alone, h = 0: A = 0, beta = 1, gamma = 0, n = 1."""
    return Point(0.0, np.zeros(5), backbone.fit(samples.drive[samples.seen], samples.angle_deg[samples.seen]))


def rmse(samples: Samples, backbone: Backbone, point: Point) -> float:
    """Root mean square deviation over the samples seen, deg."""
    deviation = (point.angle(backbone, samples.drive) - samples.angle_deg)[samples.seen]
    return float(np.sqrt(np.mean(deviation**2)))


def _score(samples: Samples, backbone: Backbone, c: Floats, fitness: Fitness) -> Callable[[Floats], Floats]:
    """Fitness of genes (sign, q): shape (k, 6) -> (k,), higher is better."""
    f = backbone.at(samples.drive)(c)
    missing = (samples.angle_deg - f)[samples.seen]
    span = float(np.ptp(samples.angle_deg[samples.seen]))
    directions = np.linalg.qr(backbone.jacobian(samples.drive[samples.seen], c))[0]

    def score(genes: Floats) -> Floats:
        h = hysteresis_batch(f, rows(genes[:, 0], genes[:, 1:]))[:, samples.seen]
        residual = h - missing
        if fitness == "paper-signed-mean":
            return -np.abs(residual.mean(axis=1)) / span
        residual -= (residual @ directions) @ directions.T
        return -np.sqrt(np.mean(residual**2, axis=1))

    return score


def _evolve(
    score: Callable[[Floats], Floats],
    genes: Floats,
    bounds: tuple[Floats, Floats],
    generations: int,
    seed: int,
    tick: Callable[[], None],
) -> Floats:
    """Let a population of genes (sign, q) evolve; the last generation, shape (k, 6), the fittest first."""
    space: list[object] = [[-1.0, 1.0]]
    space += [{"low": float(a), "high": float(b)} for a, b in zip(*bounds, strict=True)]
    with _own_random_state():
        search = pygad.GA(
            num_generations=generations,
            num_parents_mating=len(genes) // 2,
            initial_population=genes,
            gene_space=space,
            fitness_func=lambda _, batch, __: score(np.atleast_2d(batch)).tolist(),
            fitness_batch_size=len(genes),
            parent_selection_type="tournament",
            crossover_type="uniform",
            mutation_type="random",
            mutation_probability=0.15,
            keep_elitism=max(1, len(genes) // 20),
            on_generation=lambda _: tick(),
            random_seed=seed,
            suppress_warnings=True,
        )
        search.run()
    last = np.asarray(search.population, dtype=float)
    return last[np.argsort(-score(last), kind="stable")]


@contextmanager
def _own_random_state() -> Iterator[None]:
    """Leave the global generators, which pygad seeds, as they were."""
    ours, theirs = random.getstate(), np.random.get_state()  # noqa: NPY002
    try:
        yield
    finally:
        random.setstate(ours)
        np.random.set_state(theirs)  # noqa: NPY002


def polish(samples: Samples, backbone: Backbone, point: Point) -> tuple[Point, int]:
    """Least squares on q and c together, the path of h being that of the same f; also the evaluations it took."""
    residual = residual_of(samples, backbone, point.sign)
    low, high = box(samples)
    bounds = np.concatenate([low, backbone.low]), np.concatenate([high, backbone.high])
    calls = 0

    def counted(x: Floats) -> Floats:
        nonlocal calls
        calls += 1
        return residual(x)

    start = np.clip(np.concatenate([point.q, point.c]), *bounds)
    solution = least_squares(
        counted, start, bounds=bounds, x_scale="jac", max_nfev=_POLISH_STEPS, ftol=1e-10, xtol=1e-10, gtol=1e-10
    )
    return replace(point, q=solution.x[:5], c=solution.x[5:]), calls


def residual_of(samples: Samples, backbone: Backbone, sign: float) -> Callable[[Floats], Floats]:
    """Give the function x = (q, c) -> prediction - measurement over the samples seen, deg."""
    f = backbone.at(samples.drive)

    def residual(x: Floats) -> Floats:
        path = f(x[5:])
        h = hysteresis(path, Point(sign, x[:5], x[5:]).model)
        return (path + h - samples.angle_deg)[samples.seen]

    return residual
