"""Constants of a :class:`TendonRig` from records of stroke, tension and bending, and what the records cannot fix."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import least_squares
from scipy.stats import norm
from scipy.stats import t as student

from hysteresis.arrays import Floats
from hysteresis.record import Record
from validation.separation.tendon_rig import Run, TendonRig, bending_of_tension, run_of_stroke

RELATIONS = ("stroke to tension", "tension to bending", "stroke to bending")
LIMITS: Mapping[str, tuple[float, float, float, str]] = {
    "entry": (0.0, 2.0, 0.1, "1"),
    "constant_N": (0.0, 1.0, 0.1, "N"),
    "capstan": (0.0, 2.0, 0.1, "1/rad"),
    "zero_N": (0.0, 0.5, 0.1, "N"),
    "bias_N": (-1.0, 2.0, 0.1, "N"),
    "compliance_deg_per_N": (2.0, 200.0, 20.0, "deg/N"),
    "loop_share": (0.0, 0.8, 0.2, "1"),
    "loop_angle_deg": (0.5, 40.0, 5.0, "deg"),
    "stretch_mm_per_N": (0.0, 2.0, 0.2, "mm/N"),
    "slack_mm": (0.0, 4.0, 0.5, "mm"),
    "slack_N": (0.02, 2.0, 0.1, "N"),
    "cell_side": (0.0, 1.0, 0.3, "1"),
    "arm_mm": (1.0, 20.0, 2.0, "mm"),
    "start_mm": (-2.0, 4.0, 0.5, "mm"),
}
"""Least and greatest value of each constant, its natural size, and its unit."""
NAMES = tuple(LIMITS)
_LOW, _HIGH, _SIZE = (np.array([entry[i] for entry in LIMITS.values()]) for i in range(3))
_STEP = 1e-4  # of finite differences, in natural sizes
_MOST_CALLS = 60
_PRIOR = 10.0  # natural sizes: how far the draws of a bootstrap may go where the records say nothing
_REVERSAL = 0.05  # of the stroke's range: less is no turn


@dataclass(frozen=True, eq=False)
class Trace:
    """A record of stroke (mm), tension at the cell (N) and bending (deg), shapes (m,)."""

    name: str
    stroke_mm: Floats
    tension_N: Floats
    bending_deg: Floats

    def run(self, rig: TendonRig) -> Run:
        """Run a rig along the stroke."""
        return run_of_stroke(rig, self.stroke_mm, float(self.tension_N[0]))

    def predictions(self, rig: TendonRig) -> tuple[Floats, Floats, Floats]:
        """Give what each of :data:`RELATIONS` predicts."""
        run = self.run(rig)
        return run.tension_N, bending_of_tension(rig, self.tension_N), run.bending_deg

    def measured(self) -> tuple[Floats, Floats, Floats]:
        """Give what the predictions are held against."""
        return self.tension_N, self.bending_deg, self.bending_deg

    def errors(self, rig: TendonRig) -> tuple[float, ...]:
        """RMSE of each relation, % of the record's range."""
        pairs = zip(self.predictions(rig), self.measured(), strict=True)
        return tuple(100 * float(np.sqrt(np.mean((p - m) ** 2)) / np.ptp(m)) for p, m in pairs)

    def turns(self) -> list[int]:
        """Find where the stroke turns by more than 5 % of its range; the first sample and the last one, too."""
        x, enough = self.stroke_mm, _REVERSAL * float(np.ptp(self.stroke_mm))
        found, way, best = [0], 0.0, 0
        for i in range(x.size):
            if way == 0.0:
                way = float(np.sign(x[i] - x[0])) if abs(x[i] - x[0]) > enough else 0.0
                best = i
            elif (x[i] - x[best]) * way > 0:
                best = i
            elif (x[best] - x[i]) * way > enough:
                found.append(best)
                way, best = -way, i
        return [*found, x.size - 1]

    def loops(self) -> list[slice]:
        """Up and down again, each from one lower turn to the next."""
        turns = self.turns()
        lower = [turns[0], *(t for a, t in pairwise(turns[:-1]) if self.stroke_mm[t] < self.stroke_mm[a]), turns[-1]]
        return [slice(a, b + 1) for a, b in pairwise(lower)]


def trace(record: Record) -> Trace:
    """Take what is needed from a record with a tension."""
    assert record.tension_a_N is not None
    return Trace(record.title or record.source or "record", record.drive, record.tension_a_N, record.angle_deg)


def misses(rig: TendonRig, records: Sequence[Trace]) -> Floats:
    """Residuals of all relations, in ranges of the record: shape (3 m,), over sqrt(m) of each record."""
    parts = []
    for record in records:
        scale = 1 / np.sqrt(record.stroke_mm.size)
        for predicted, measured in zip(record.predictions(rig), record.measured(), strict=True):
            parts.append((predicted - measured) * scale / np.ptp(measured))
    return np.concatenate(parts)


def fit(records: Sequence[Trace], start: TendonRig, fixed: Mapping[str, float] | None = None) -> TendonRig:
    """Least squares over all constants but those that are ``fixed``, by the three relations with equal weight."""
    base = replace(start, **(fixed or {}))
    free = np.array([name not in (fixed or {}) for name in NAMES])

    def residual(q: Floats) -> Floats:
        return misses(_with(base, free, q * _SIZE[free]), records)

    low, high = _LOW[free] / _SIZE[free], _HIGH[free] / _SIZE[free]
    at = np.clip(base.row()[free] / _SIZE[free], low + 1e-3, high - 1e-3)
    found = least_squares(
        residual,
        at,
        bounds=(low, high),
        x_scale="jac",
        diff_step=_STEP,
        max_nfev=_MOST_CALLS,
        ftol=1e-11,
        xtol=1e-11,
        gtol=1e-13,
    )
    return _with(base, free, found.x * _SIZE[free])


def _with(rig: TendonRig, free: NDArray[np.bool_], values: Floats) -> TendonRig:
    row = rig.row()
    row[free] = values
    return TendonRig(*row.tolist())


def jacobian(rig: TendonRig, residual: Callable[[TendonRig], Floats]) -> Floats:
    """Differentiate by the constants in natural sizes, shape (m, 14); steps stay within the limits."""
    at, row, columns = residual(rig), rig.row(), []
    for i in range(row.size):
        step = 1e-3 * _SIZE[i] * (1.0 if row[i] + 2e-3 * _SIZE[i] < _HIGH[i] else -1.0)
        moved = TendonRig(*(row + step * np.eye(row.size)[i]).tolist())
        columns.append((residual(moved) - at) / (step / _SIZE[i]))
    return np.column_stack(columns)


def draws(
    rig: TendonRig, records: Sequence[Trace], count: int, seed: int, fixed: Mapping[str, float] | None = None
) -> list[TendonRig]:
    """Draw loops with replacement and refit each draw by one Gauss-Newton step, within the limits.

    What is ``fixed`` stays. What the records do not show is held by a normal prior of 10 natural sizes. A loop is a
    block: what its samples have in common in their residual counts as it is (Kunsch 1989, doi
    10.1214/aos/1176347265). Steps are longer by the ratio of the quantiles of Student's t and the normal
    distribution, and by sqrt(k / (k - 1)): there are few loops, k.
    """
    residual, J = misses(rig, records), jacobian(rig, lambda r: misses(r, records))
    J[:, [name in (fixed or {}) for name in NAMES]] = 0.0
    blocks = _blocks(records)
    names = np.unique(blocks)
    normals = np.array([J[blocks == b].T @ J[blocks == b] for b in names])
    pulls = np.array([J[blocks == b].T @ residual[blocks == b] for b in names])
    noise = float(residual @ residual) / len(names)  # a loop counts as one observation
    prior = np.eye(len(NAMES)) * noise / _PRIOR**2
    rng = np.random.default_rng(seed)
    pulls = pulls - pulls.mean(axis=0)  # at the bounds the sum is not zero
    k, out = len(names), []
    wider = math.sqrt(k / (k - 1)) * float(student.ppf(0.975, k - 1) / norm.ppf(0.975))
    for _ in range(count):
        weights = rng.multinomial(len(names), np.full(len(names), 1 / len(names))).astype(float)
        matrix = 0.5 * np.tensordot(weights, normals, 1) + 0.5 * normals.sum(axis=0) + prior
        step = -wider * np.linalg.solve(matrix, weights @ pulls)
        out.append(TendonRig(*np.clip(rig.row() + step * _SIZE, _LOW, _HIGH).tolist()))
    return out


def _blocks(records: Sequence[Trace]) -> NDArray[np.int64]:
    """Loop of each residual of :func:`misses`."""
    parts, first = [], 0
    for record in records:
        mine, loops = np.zeros(record.stroke_mm.size, dtype=np.int64), record.loops()
        for i, loop in enumerate(loops):
            mine[loop.start :] = first + i
        first += len(loops)
        parts += [mine] * len(RELATIONS)
    return np.concatenate(parts)


def correlations(rig: TendonRig, records: Sequence[Trace]) -> tuple[Floats, Floats]:
    """Correlations of the constants, shape (14, 14), and the weakest direction, shape (14,), in natural sizes."""
    J = jacobian(rig, lambda r: misses(r, records))
    matrix = J.T @ J + 1e-12 * np.eye(len(NAMES))
    covariance = np.linalg.inv(matrix)
    size = np.sqrt(np.diag(covariance))
    weakest = np.linalg.eigh(matrix)[1][:, 0]
    return covariance / np.outer(size, size), weakest * np.sign(weakest[np.argmax(np.abs(weakest))])


@dataclass(frozen=True)
class Experiment:
    """What a further record would bring: nats of the determinant of the information, and intervals narrowed."""

    what: str
    gain: float
    narrower: dict[str, float]  # factor for each constant


def experiments(rig: TendonRig, records: Sequence[Trace]) -> list[Experiment]:
    """Simulate further records with the fitted constants; best first. All constants count as unknown.

    The noise of a relation is that of the fit; a loop counts as one observation, as in :func:`draws`.
    """
    miss = misses(rig, records)
    noise = float(miss @ miss) / sum(len(record.loops()) for record in records)
    J = jacobian(rig, lambda r: misses(r, records))
    known = J.T @ J / noise + np.eye(len(NAMES)) / _PRIOR**2
    before = np.sqrt(np.diag(np.linalg.inv(known)))
    found = []
    for what, rows in _proposals(rig, records[0], noise).items():
        more = jacobian(rig, rows)
        information = known + more.T @ more
        gain = 0.5 * float(np.linalg.slogdet(information)[1] - np.linalg.slogdet(known)[1])
        narrower = before / np.sqrt(np.diag(np.linalg.inv(information)))
        found.append(Experiment(what, gain, dict(zip(NAMES, narrower.tolist(), strict=True))))
    return sorted(found, key=lambda e: -e.gain)


def _proposals(rig: TendonRig, first: Trace, noise: float) -> dict[str, Callable[[TendonRig], Floats]]:
    """Further records in words, and what each would show in units of its noise."""
    scale = 1 / np.sqrt(noise * first.stroke_mm.size)
    per_N, per_deg = scale / np.ptp(first.tension_N), scale / np.ptp(first.bending_deg)
    swing = (first.stroke_mm - first.stroke_mm.min()) / np.ptp(first.stroke_mm)
    rest = float(first.tension_N[0])
    reach = rig.stretch_mm_per_N * float(first.tension_N.max()) + rig.start_mm
    middle = np.concatenate([np.linspace(0.0, 0.6, 100), 0.6 + 0.25 * (swing - swing.mean())]) * first.stroke_mm.max()

    def held_straight(r: TendonRig) -> Floats:
        stiff = replace(r, compliance_deg_per_N=1e-3)
        return run_of_stroke(stiff, swing * reach, rest).tension_N * per_N

    def about_a_mean(r: TendonRig) -> Floats:
        run = run_of_stroke(r, middle, rest)
        return np.concatenate([run.tension_N * per_N, run.bending_deg * per_deg])

    return {
        "the first record again": lambda r: misses(r, [first]) / np.sqrt(noise),
        "the cell read with the tendon off, to 0.005 N": lambda r: np.array([r.zero_N / 0.005]),
        "a second load cell at the robot's base": lambda r: first.run(r).robot_N * per_N,
        "the robot held straight, up to the same tension": held_straight,
        "a quarter of the amplitude about 60 % of the stroke": about_a_mean,
    }
