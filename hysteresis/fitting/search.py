"""Search for the parameters of theta = f(x; c) + h: a global search (paper, section 3.3), then least squares.

:mod:`hysteresis.fitting.form` defines the coordinates q of h and the coefficients c of f.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np
from scipy.optimize import least_squares

from hysteresis.arrays import Floats
from hysteresis.fitting.form import SLOPE, Form, Point, rmse, without_hysteresis
from hysteresis.fitting.forward import is_forward, polish_forward
from hysteresis.fitting.optimizers import Method, evolve
from hysteresis.fitting.samples import Samples
from hysteresis.fitting.settings import Fitness
from hysteresis.laws.elements import Law

POLISH_SAMPLES = 2500
"""Samples that the last least squares use, about."""
FINE, COARSE = 1e-10, 1e-5
"""Tolerances of least squares: of a result, and of what only serves a comparison."""
_POLISH_STEPS = 100
_ROUNDS = 3  # of the global search; f is fitted again after each


@dataclass(frozen=True)
class Effort:
    """Size of one search: individuals, generations in all, seed; ``tick`` is called after each generation."""

    method: Method
    fitness: Fitness
    seed: int
    population: int
    generations: int
    tick: Callable[[], None]


@dataclass(frozen=True)
class Found:
    """Result of all searches: the model, evaluations in all, and how many searches ended as well as the best."""

    form: Form
    point: Point
    evaluations: int
    seeds_agreeing: int


def explore(samples: Samples, form: Form, effort: Effort) -> tuple[list[Point], int]:
    """Search globally; return starting points for :func:`polish`, and the number of evaluations.

    The best point of each sign of A comes first, then a play operator. One compiled call computes the h of a whole
    generation along the present estimate of f. The coefficients of f are not searched: the score of a candidate is the
    part of its residual that no change of them can remove (variable projection, Golub and Pereyra 1973,
    doi 10.1137/0710036). f starts as the best curve without hysteresis and is fitted again after each round.

    ``fitness="paper-signed-mean"`` scores by -|eq. 8|; f is not fitted again, and there is one point.
    """
    low, high = (bound[: form.searched] for bound in form.bounds(samples))
    rng = np.random.default_rng(effort.seed)
    genes = rng.uniform(low, high, (effort.population, form.searched))
    genes = np.column_stack([rng.choice([-1.0, 1.0], effort.population), genes])
    baseline = without_hysteresis(form, samples)
    c, rest = baseline.c, baseline.q[form.searched :]
    baseline_rmse = rmse(samples, form, baseline)
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
            with_curve_of(form, samples, form, Point(sign, np.concatenate([genes[same][0, 1:], rest]), c))
            for sign in (-1.0, 1.0)
            if (same := genes[:, 0] == sign).any()
        ]
        points.sort(key=lambda point: rmse(samples, form, point))
        genes[:, 1] += points[0].q[0] - genes[genes[:, 0] == points[0].sign][0, 1]
        genes[:, 1:] = np.clip(genes[:, 1:], low, high)
        c = points[0].c
    # The two branches of a play deviate by its half width from the best curve without hysteresis.
    play = baseline.q.copy()
    play[form.law] = form.base_law.play(math.log(max(baseline_rmse, math.exp(low[1])))) * form.elements
    return [*points, with_curve_of(form, samples, form, Point(-1.0, play, c))], evaluations


def with_curve_of(new: Form, samples: Samples, old: Form, point: Point) -> Point:
    """Fit the f of another form, with h unchanged; A is rescaled so that h keeps its shape on the path of the new f."""
    f = old.paths(samples, point)
    h = old.hysteresis(f, np.array([point.sign]), point.q[np.newaxis])[0]
    c, q = new.curve(samples, samples.angle_deg - h, point.q)
    moved = replace(point, q=q, c=c)
    before, after = (sum(float(np.abs(np.diff(p)).sum()) for p in paths) for paths in (f, new.paths(samples, moved)))
    if before > 0 and after > 0:
        slopes = slice(0, old.law.stop, old.base_law.size)
        moved.q[slopes] = np.clip(moved.q[slopes] + math.log(before / after), *np.log(SLOPE))
    return moved


def extended(form: Form, point: Point, law: Law, more: Sequence[float]) -> tuple[Form, Point]:
    """Give a model of one element another law that contains its own, with ``more`` as the further constants."""
    at = form.law.stop
    return replace(form, base_law=law), replace(point, q=np.concatenate([point.q[:at], more, point.q[at:]]))


def split_element(form: Form, point: Point, share: float) -> tuple[Form, Point]:
    """Split the one element into two that saturate one after the other, at ``share`` and 2 - share of its path."""
    two = replace(form, elements=2)
    half = point.q[form.law] + np.array([math.log(0.5), math.log(0.5), 0.0, 0.0])
    law = [half + np.array([0.0, math.log(part), 0.0, 0.0]) for part in (share, 2 - share)]
    states = np.repeat(point.q[4 : 4 + len(form.groups)], 2)
    return two, replace(point, q=np.concatenate([*law, states, point.q[4 + len(form.groups) :]]))


def _score(samples: Samples, form: Form, c: Floats, fitness: Fitness) -> Callable[[Floats], Floats]:
    """Fitness of genes (sign, q): shape (k, 1 + size) -> (k,), higher is better. The delay is ignored."""
    paths = [backbone.at(drive)(c) for backbone, drive in zip(form.backbones, samples.drives(), strict=True)]
    missing = (samples.angle_deg - np.concatenate(paths))[samples.train]
    train = samples.train_drives()
    of_c = np.concatenate([b.jacobian(drive, c) for b, drive in zip(form.backbones, train, strict=True)])
    record = np.repeat(np.arange(len(train)), [len(drive) for drive in train])
    of_zeros = record[:, np.newaxis] == np.arange(1, len(train))
    directions = np.linalg.qr(np.column_stack([of_c, of_zeros]))[0]

    def score(genes: Floats) -> Floats:
        residual = form.hysteresis(paths, genes[:, 0], genes[:, 1:])[:, samples.train] - missing
        if fitness == "paper-signed-mean":
            return -np.abs(residual.mean(axis=1)) / samples.span_deg()
        residual -= (residual @ directions) @ directions.T
        return -np.sqrt(np.mean(residual**2, axis=1))

    return score


def polish(
    samples: Samples,
    form: Form,
    point: Point,
    held: Mapping[int, float] | None = None,
    tolerance: float = FINE,
) -> tuple[Point, int]:
    """Refine q and c together by least squares, h following the path of the same f; also the number of evaluations.

    ``held`` keeps entries of q at given values. ``tolerance`` is that of scipy's least squares, relative.
    """
    if is_forward(form):
        return polish_forward(samples, form, point, held, tolerance)
    residual = residual_of(samples, form, point.sign)
    low, high = form.bounds(samples)
    bounds = np.concatenate([low, form.backbones[0].low]), np.concatenate([high, form.backbones[0].high])
    whole = np.concatenate([point.q, point.c])
    free = np.ones(len(whole), dtype=bool)
    for i, value in (held or {}).items():
        whole[i], free[i] = value, False
    whole = np.clip(whole, *bounds)
    calls = 0

    def counted(x: Floats) -> Floats:
        nonlocal calls
        calls += 1
        whole[free] = x
        return residual(whole)

    solution = least_squares(
        counted,
        whole[free],
        bounds=(bounds[0][free], bounds[1][free]),
        x_scale="jac",
        max_nfev=_POLISH_STEPS,
        ftol=tolerance,
        xtol=tolerance,
        gtol=tolerance,
    )
    whole[free] = solution.x
    return replace(point, q=whole[: form.size].copy(), c=whole[form.size :].copy()), calls


def residual_of(samples: Samples, form: Form, sign: float) -> Callable[[Floats], Floats]:
    """Return the function x = (q, c) -> prediction - measurement over the training samples, deg."""
    fixed = None
    if form.longest_delay_s == 0:
        fixed = [backbone.at(drive) for backbone, drive in zip(form.backbones, samples.drives(), strict=True)]
    signs = np.array([sign])

    def residual(x: Floats) -> Floats:
        q, c = x[: form.size], x[form.size :]
        paths = form.paths(samples, Point(sign, q, c)) if fixed is None else [f(c) for f in fixed]
        return (form.sum(paths, signs, q) - samples.angle_deg)[samples.train]

    return residual
