"""Hysteresis operators to compare a Bouc-Wen fit with: a curve, one play, and Prandtl-Ishlinskii with ten elements.

Each operator has the same freedom as the fit: a monotone f whose number of slopes is chosen by validation within the
training samples, a zero of the angle for each further record, a delay if the fit has one, and free initial states.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import partial
from typing import Literal

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import least_squares, lsq_linear, minimize_scalar

from hysteresis import Record
from hysteresis.arrays import Floats
from hysteresis.laws.backbone import Backbone, fitted_backbone
from hysteresis.laws.prandtl_ishlinskii import plays
from hysteresis.records.holdout import Split, validate_within

Kind = Literal["curve", "play", "pi", "pi-inside", "pi-leading"]

KNOTS = (1, 2, 3, 5, 9, 17)
ELEMENTS = 10
INITIAL_STATES = (-1.0, 0.0, 1.0)
_SAMPLES = 1500  # in a fit
_RADII = 40  # candidates for the radius of the one play
_AS_GOOD = 1.05  # the least number of slopes within this factor of the least error is chosen


@dataclass(frozen=True, eq=False)
class Operator:
    """A fitted operator.

    ``curve`` is f(x), ``play`` f(P[x]), ``pi`` f(x) + sum w P[x], ``pi-inside`` f(sum w P[x]), and ``pi-leading``
    f(x) - sum w P[x], with w >= 0. ``start`` is the initial state of all plays relative to the first drive, -1 to 1
    times their radius. ``zeros_deg`` has one entry per record.
    """

    kind: Kind
    backbone: Backbone
    radii: Floats
    weights: Floats
    c: Floats
    zeros_deg: Floats
    start: float
    delay_s: float

    def predict(self, record: Record, number: int = 0) -> Floats:
        """Predict the angle of a record, shape (m,), deg, with the zero of the training record ``number``."""
        drive = delayed(record, self.delay_s)
        outputs = plays(drive, self.radii, drive[0] + self.start * self.radii)
        inner = self.weights @ outputs
        if self.kind in ("pi", "pi-leading"):
            return self.backbone.at(drive)(self.c) + inner + self.zeros_deg[number]
        return self.backbone.at(inner)(self.c) + self.zeros_deg[number]


def delayed(record: Record, delay_s: float) -> Floats:
    """Drive of a record at times earlier by ``delay_s``, shape (m,)."""
    if delay_s == 0.0:
        return record.drive
    assert record.time_s is not None
    return np.interp(record.time_s - delay_s, record.time_s, record.drive)


def fit_operator(
    kind: Kind, records: Sequence[Record], splits: Sequence[Split], *, longest_delay_s: float = 0.0
) -> Operator:
    """Fit an operator to the training samples; number of slopes and initial state are chosen within them."""
    inner = [validate_within(record, split) for record, split in zip(records, splits, strict=True)]
    tried = []
    for knots in KNOTS:
        found = _fitted(kind, records, _thinned([split.train for split in inner]), knots, 0.0)
        tried.append((_rmse(found, records, [split.heldout for split in inner]), knots))
    limit = _AS_GOOD * min(tried)[0]
    knots = next(knots for error, knots in tried if error <= limit)
    train = _thinned([split.train for split in splits])
    if longest_delay_s == 0.0:
        return _fitted(kind, records, train, knots, 0.0)
    best = minimize_scalar(
        lambda delay: _rmse(_fitted(kind, records, train, knots, delay), records, train),
        bounds=(0.0, longest_delay_s),
        method="bounded",
        options={"xatol": 2e-3, "maxiter": 10},
    )
    return _fitted(kind, records, train, knots, float(best.x))


def _thinned(masks: Sequence[NDArray[np.bool_]]) -> list[NDArray[np.bool_]]:
    """Keep about _SAMPLES of the training samples; the plays still follow the whole path."""
    every = max(1, sum(int(mask.sum()) for mask in masks) // _SAMPLES)
    return [mask & (np.cumsum(mask) % every == 0) for mask in masks]


def _rmse(operator: Operator, records: Sequence[Record], masks: Sequence[NDArray[np.bool_]]) -> float:
    pairs = enumerate(zip(records, masks, strict=True))
    residuals = [(operator.predict(record, i) - record.angle_deg)[mask] for i, (record, mask) in pairs]
    return float(np.sqrt(np.mean(np.concatenate(residuals) ** 2)))


def _fitted(
    kind: Kind, records: Sequence[Record], masks: Sequence[NDArray[np.bool_]], knots: int, delay_s: float
) -> Operator:
    """Fit for one number of slopes and one delay, with the initial state of the least training error."""
    drives = [delayed(record, delay_s) for record in records]
    trained = np.concatenate([drive[mask] for drive, mask in zip(drives, masks, strict=True)])
    angle = np.concatenate([record.angle_deg[mask] for record, mask in zip(records, masks, strict=True)])
    record_of = np.repeat(np.arange(len(records)), [int(mask.sum()) for mask in masks])
    zeros = (record_of[:, np.newaxis] == np.arange(1, len(records))).astype(float)
    backbone = fitted_backbone(trained, angle, knots)
    half = 0.5 * float(np.ptp(trained))

    def outputs(radii: Floats, start: float) -> Floats:
        rows = [plays(x, radii, x[0] + start * radii)[:, mask] for x, mask in zip(drives, masks, strict=True)]
        return np.concatenate(rows, axis=1)

    solvers: dict[Kind, Callable[..., Found]] = {
        "curve": _curve,
        "play": _one_play,
        "pi": _beside,
        "pi-inside": _inside,
        "pi-leading": partial(_beside, sense=-1.0),
    }
    solve = solvers[kind]
    found = [
        (*solve(backbone, trained, angle, zeros, half, partial(outputs, start=start)), start)
        for start in INITIAL_STATES
    ]
    _, radii, weights, c, shift, start = min(found, key=lambda entry: entry[0])
    return Operator(kind, backbone, radii, weights, c, np.concatenate([[0.0], shift]), start, delay_s)


Outputs = Callable[[Floats], Floats]
Found = tuple[float, Floats, Floats, Floats, Floats]


def _linear(backbone: Backbone, x: Floats, more: Floats, angle: Floats, least: Floats) -> tuple[float, Floats]:
    """Least squares of f(x) and further columns, whose coefficients have the lower bounds ``least``."""
    columns = np.column_stack([backbone.jacobian(x, backbone.start), more, angle])
    low = np.concatenate([backbone.low, least])
    # the triangular factor has the same least squares in as many rows as columns
    triangle: Floats = np.asarray(np.linalg.qr(columns, mode="r"))
    solution = lsq_linear(triangle[:, :-1], triangle[:, -1], (low, np.full(len(low), np.inf)), "bvls")
    return float(solution.cost), solution.x


def _one_play(backbone: Backbone, x: Floats, angle: Floats, zeros: Floats, half: float, outputs: Outputs) -> Found:
    free, p = np.full(zeros.shape[1], -np.inf), len(backbone.start)

    def at(radius: float) -> tuple[float, Floats]:
        return _linear(backbone, outputs(np.array([radius]))[0], zeros, angle, free)

    radii = np.linspace(0, half, _RADII)
    near = radii[int(np.argmin([at(radius)[0] for radius in radii]))]
    step = radii[1]
    ends = max(0.0, near - step), near + step
    radius = float(minimize_scalar(lambda r: at(r)[0], bounds=ends, method="bounded").x)
    cost, solution = at(radius)
    return cost, np.array([radius]), np.ones(1), solution[:p], solution[p:]


def _curve(backbone: Backbone, x: Floats, angle: Floats, zeros: Floats, half: float, outputs: Outputs) -> Found:
    p, free = len(backbone.start), np.full(zeros.shape[1], -np.inf)
    cost, solution = _linear(backbone, x, zeros, angle, free)
    return cost, np.zeros(1), np.ones(1), solution[:p], solution[p:]


def _radii(half: float) -> Floats:
    return half * np.arange(1, ELEMENTS + 1) / (ELEMENTS + 1)


def _beside(
    backbone: Backbone, x: Floats, angle: Floats, zeros: Floats, half: float, outputs: Outputs, sense: float = 1.0
) -> Found:
    p, radii = len(backbone.start), _radii(half)
    # if the angle falls with the drive, so do the plays
    sign = sense if np.polyfit(x, angle, 1)[0] >= 0 else -sense
    least = np.concatenate([np.zeros(ELEMENTS), np.full(zeros.shape[1], -np.inf)])
    cost, solution = _linear(backbone, x, np.column_stack([sign * outputs(radii).T, zeros]), angle, least)
    return cost, radii, sign * solution[p : p + ELEMENTS], solution[:p], solution[p + ELEMENTS :]


def _inside(backbone: Backbone, x: Floats, angle: Floats, zeros: Floats, half: float, outputs: Outputs) -> Found:
    """Fit weights of sum 1 and f together; the start is the single play with the least error."""
    p, radii = len(backbone.start), _radii(half)
    rows, free = outputs(radii), np.full(zeros.shape[1], -np.inf)

    def residual(v: Floats) -> Floats:
        weights = v[:ELEMENTS] / max(float(v[:ELEMENTS].sum()), 1e-12)
        return backbone.at(weights @ rows)(v[ELEMENTS : ELEMENTS + p]) + zeros @ v[ELEMENTS + p :] - angle

    singles = [_linear(backbone, row, zeros, angle, free) for row in rows]
    best = int(np.argmin([cost for cost, _ in singles]))
    weights = np.full(ELEMENTS, 0.02)
    weights[best] = 1.0
    low = np.concatenate([np.zeros(ELEMENTS), backbone.low, free])
    start = np.maximum(np.concatenate([weights, singles[best][1]]), low + 1e-9)
    solution = least_squares(residual, start, bounds=(low, np.inf), x_scale="jac", max_nfev=60)
    weights = solution.x[:ELEMENTS] / solution.x[:ELEMENTS].sum()
    return float(solution.cost), radii, weights, solution.x[ELEMENTS : ELEMENTS + p], solution.x[ELEMENTS + p :]
