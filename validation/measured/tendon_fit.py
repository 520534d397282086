"""Fit a :class:`TendonRig` to records of stroke, tension and bending; identifiability of its parameters."""

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

from hysteresis import Record
from hysteresis.arrays import Floats
from validation.measured.tendon_rig import Run, TendonRig, bending_of_tension, run_of_stroke


@dataclass(frozen=True)
class ParameterRange:
    """Unit and bounds of a fitted parameter; its scale makes parameters comparable."""

    unit: str
    low: float
    high: float
    scale: float


RELATIONS = ("stroke to tension", "tension to bending", "stroke to bending")
PARAMETERS: Mapping[str, ParameterRange] = {
    "entry": ParameterRange("1", 0.0, 2.0, 0.1),
    "constant_N": ParameterRange("N", 0.0, 1.0, 0.1),
    "capstan": ParameterRange("1/rad", 0.0, 2.0, 0.1),
    "zero_N": ParameterRange("N", 0.0, 0.5, 0.1),
    "bias_N": ParameterRange("N", -1.0, 2.0, 0.1),
    "compliance_deg_per_N": ParameterRange("deg/N", 2.0, 200.0, 20.0),
    "loop_share": ParameterRange("1", 0.0, 0.8, 0.2),
    "loop_angle_deg": ParameterRange("deg", 0.5, 40.0, 5.0),
    "stretch_mm_per_N": ParameterRange("mm/N", 0.0, 2.0, 0.2),
    "slack_mm": ParameterRange("mm", 0.0, 4.0, 0.5),
    "slack_N": ParameterRange("N", 0.02, 2.0, 0.1),
    "cell_side": ParameterRange("1", 0.0, 1.0, 0.3),
    "arm_mm": ParameterRange("mm", 1.0, 20.0, 2.0),
    "start_mm": ParameterRange("mm", -2.0, 4.0, 0.5),
}
NAMES = tuple(PARAMETERS)
_LOW = np.array([p.low for p in PARAMETERS.values()])
_HIGH = np.array([p.high for p in PARAMETERS.values()])
_SCALE = np.array([p.scale for p in PARAMETERS.values()])
_STEP = 1e-4  # of finite differences, in scales
_MOST_CALLS = 60
_LEAST_RESIDUAL = 0.01  # share of a loop's residual that survives the fit; below, that loop alone sets a parameter
_PRIOR = 10.0  # scales: standard deviation of the prior of the bootstrap
_REVERSAL = 0.05  # of the stroke's range: a smaller change of direction does not count as a reversal


@dataclass(frozen=True, eq=False)
class TendonRecord:
    """A record of stroke (mm), tension at the load cell (N) and bending (deg), shapes (m,)."""

    name: str
    stroke_mm: Floats
    tension_N: Floats
    bending_deg: Floats

    def run(self, rig: TendonRig) -> Run:
        """Run a rig along the stroke."""
        return run_of_stroke(rig, self.stroke_mm, float(self.tension_N[0]))

    def predictions(self, rig: TendonRig) -> tuple[Floats, Floats, Floats]:
        """Predict the output of each of :data:`RELATIONS`."""
        run = self.run(rig)
        return run.tension_N, bending_of_tension(rig, self.tension_N), run.bending_deg

    def measured(self) -> tuple[Floats, Floats, Floats]:
        """Measured output of each of :data:`RELATIONS`."""
        return self.tension_N, self.bending_deg, self.bending_deg

    def errors(self, rig: TendonRig) -> tuple[float, ...]:
        """RMSE of each relation, % of the record's range."""
        pairs = zip(self.predictions(rig), self.measured(), strict=True)
        return tuple(100 * float(np.sqrt(np.mean((p - m) ** 2)) / np.ptp(m)) for p, m in pairs)

    def reversals(self) -> list[int]:
        """Find the reversals of the stroke by more than 5 % of its range; the first and the last sample count too."""
        x, enough = self.stroke_mm, _REVERSAL * float(np.ptp(self.stroke_mm))
        found, direction, extreme = [0], 0.0, 0
        for i in range(x.size):
            if direction == 0.0:
                direction = float(np.sign(x[i] - x[0])) if abs(x[i] - x[0]) > enough else 0.0
                extreme = i
            elif (x[i] - x[extreme]) * direction > 0:
                extreme = i
            elif (x[extreme] - x[i]) * direction > enough:
                found.append(extreme)
                direction, extreme = -direction, i
        return [*found, x.size - 1]

    def loops(self) -> list[slice]:
        """Loops of the stroke, each from one lower reversal to the next."""
        ends, x = self.reversals(), self.stroke_mm
        lower = [ends[0], *(b for a, b in pairwise(ends[:-1]) if x[b] < x[a]), ends[-1]]
        return [slice(a, b + 1) for a, b in pairwise(lower)]


def tendon_record(record: Record) -> TendonRecord:
    """Take stroke, tension and bending of a record that has a tension."""
    assert record.tension_a_N is not None
    return TendonRecord(record.title or record.source or "record", record.drive, record.tension_a_N, record.angle_deg)


def residuals(rig: TendonRig, records: Sequence[TendonRecord]) -> Floats:
    """Residuals of all relations over the record's range and over sqrt(m), shape (3 m,) for each record."""
    parts = []
    for record in records:
        scale = 1 / np.sqrt(record.stroke_mm.size)
        for predicted, measured in zip(record.predictions(rig), record.measured(), strict=True):
            parts.append((predicted - measured) * scale / np.ptp(measured))
    return np.concatenate(parts)


def fit(records: Sequence[TendonRecord], start: TendonRig, fixed: Mapping[str, float] | None = None) -> TendonRig:
    """Fit all parameters that are not ``fixed`` by least squares, with equal weight of the three relations."""
    base = replace(start, **(fixed or {}))
    free = np.array([name not in (fixed or {}) for name in NAMES])

    def residual(q: Floats) -> Floats:
        return residuals(_with(base, free, q * _SCALE[free]), records)

    low, high = _LOW[free] / _SCALE[free], _HIGH[free] / _SCALE[free]
    at = np.clip(base.row()[free] / _SCALE[free], low + 1e-3, high - 1e-3)
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
    return _with(base, free, found.x * _SCALE[free])


def _with(rig: TendonRig, free: NDArray[np.bool_], values: Floats) -> TendonRig:
    row = rig.row()
    row[free] = values
    return TendonRig(*row.tolist())


def jacobian(rig: TendonRig, residual: Callable[[TendonRig], Floats]) -> Floats:
    """Differentiate with respect to the scaled parameters, shape (m, 14); steps stay within the bounds."""
    at, row, columns = residual(rig), rig.row(), []
    for i in range(row.size):
        step = 1e-3 * _SCALE[i] * (1.0 if row[i] + 2e-3 * _SCALE[i] < _HIGH[i] else -1.0)
        moved = TendonRig(*(row + step * np.eye(row.size)[i]).tolist())
        columns.append((residual(moved) - at) / (step / _SCALE[i]))
    return np.column_stack(columns)


def bootstrap(
    rig: TendonRig,
    records: Sequence[TendonRecord],
    count: int,
    seed: int,
    fixed: Mapping[str, float] | None = None,
    bias: Floats | None = None,
) -> list[TendonRig]:
    """Bootstrap over whole loops: each draw is refitted by one Gauss-Newton step within the bounds.

    Parameters in ``fixed`` keep their values. A normal prior of 10 scales holds what the records do not identify. The
    loop is the block, so correlated residuals within it count as they are (Kunsch 1989, doi 10.1214/aos/1176347265).
    As the number k of loops is small, steps are longer by the ratio of the quantiles of Student's t and the normal
    distribution, and by sqrt(k / (k - 1)). ``bias`` of :func:`bias_of_noise`, shape (14,), is taken off every draw.
    """
    residual, J = residuals(rig, records), jacobian(rig, lambda r: residuals(r, records))
    J[:, [name in (fixed or {}) for name in NAMES]] = 0.0
    blocks = _blocks(records)
    names = np.unique(blocks)
    normals = np.array([J[blocks == b].T @ J[blocks == b] for b in names])
    gradients = _widened([(J[blocks == b], residual[blocks == b]) for b in names], normals.sum(axis=0))
    noise = float(residual @ residual) / len(names)  # a loop counts as one observation
    prior = np.eye(len(NAMES)) * noise / _PRIOR**2
    rng = np.random.default_rng(seed)
    gradients = gradients - gradients.mean(axis=0)  # at the bounds the sum is not zero
    k, out, middle = len(names), [], rig.row() - (0.0 if bias is None else bias)
    wider = math.sqrt(k / (k - 1)) * float(student.ppf(0.975, k - 1) / norm.ppf(0.975))
    for _ in range(count):
        weights = rng.multinomial(len(names), np.full(len(names), 1 / len(names))).astype(float)
        matrix = 0.5 * np.tensordot(weights, normals, 1) + 0.5 * normals.sum(axis=0) + prior
        step = -wider * np.linalg.solve(matrix, weights @ gradients)
        out.append(TendonRig(*np.clip(middle + step * _SCALE, _LOW, _HIGH).tolist()))
    return out


def bias_of_noise(
    rig: TendonRig, records: Sequence[TendonRecord], count: int, seed: int, fixed: Mapping[str, float] | None = None
) -> Floats:
    """How far noise shifts a fit, shape (14,): records simulated with a rig and with noise as measured, and refitted.

    Two relations take the measured tension as their input. Its noise moves the dry friction of the model to and fro,
    which no average over samples removes. The noise is the white part of the residuals of tension from stroke and of
    bending from stroke.
    """
    rng, shifts = np.random.default_rng(seed), []
    for _ in range(count):
        simulated = []
        for record in records:
            run = record.run(rig)
            tension, bending = (
                clean + _white(measured - clean) * rng.standard_normal(clean.size)
                for clean, measured in ((run.tension_N, record.tension_N), (run.bending_deg, record.bending_deg))
            )
            simulated.append(TendonRecord(record.name, record.stroke_mm, tension, bending))
        shifts.append(fit(simulated, rig, fixed).row() - rig.row())
    return np.asarray(np.mean(shifts, axis=0))


def _white(residual: Floats) -> float:
    """Measure the white part of a residual by the median of its first differences: standard deviation."""
    return float(np.median(np.abs(np.diff(residual))) / (norm.ppf(0.75) * math.sqrt(2)))


def _widened(parts: Sequence[tuple[Floats, Floats]], whole: Floats) -> Floats:
    """Gradients J^T W e of the blocks, shape (k, p), W = (1 - H)^-1/2: the fit has reduced the residual of its blocks.

    H is a block's part of the hat matrix (Bell and McCaffrey 2002, Survey Methodology 28(2), 169-181).
    """
    values, vectors = np.linalg.eigh(np.linalg.pinv(whole, rcond=1e-12, hermitian=True))
    root = vectors * np.sqrt(np.maximum(values, 0.0))
    out = []
    for columns, residual in parts:
        basis, own, _ = np.linalg.svd(columns @ root, full_matrices=False)
        more = np.maximum(1.0 - own**2, _LEAST_RESIDUAL) ** -0.5 - 1.0
        out.append(columns.T @ (residual + basis @ (more * (basis.T @ residual))))
    return np.array(out)


def _blocks(records: Sequence[TendonRecord]) -> NDArray[np.int64]:
    """Loop of each residual of :func:`residuals`."""
    parts, first = [], 0
    for record in records:
        loop_of, loops = np.zeros(record.stroke_mm.size, dtype=np.int64), record.loops()
        for i, loop in enumerate(loops):
            loop_of[loop.start :] = first + i
        first += len(loops)
        parts += [loop_of] * len(RELATIONS)
    return np.concatenate(parts)


def correlations(rig: TendonRig, records: Sequence[TendonRecord]) -> tuple[Floats, Floats]:
    """Correlations of the parameters, shape (14, 14), and the least identified direction, shape (14,), in scales."""
    J = jacobian(rig, lambda r: residuals(r, records))
    matrix = J.T @ J + 1e-12 * np.eye(len(NAMES))
    covariance = np.linalg.inv(matrix)
    deviation = np.sqrt(np.diag(covariance))
    weakest = np.linalg.eigh(matrix)[1][:, 0]
    return covariance / np.outer(deviation, deviation), weakest * np.sign(weakest[np.argmax(np.abs(weakest))])


@dataclass(frozen=True)
class Experiment:
    """Information gain of a further record: gain in half the log-determinant of the information, nats.

    ``narrower`` has the factor by which the interval of each parameter narrows.
    """

    what: str
    gain: float
    narrower: dict[str, float]


def experiments(rig: TendonRig, records: Sequence[TendonRecord]) -> list[Experiment]:
    """Information gain of further records, simulated with the fitted parameters; the largest gain first.

    All parameters count as unknown. The noise of a relation is the residual of the fit; a loop counts as one
    observation, as in :func:`bootstrap`.
    """
    residual = residuals(rig, records)
    noise = float(residual @ residual) / sum(len(record.loops()) for record in records)
    J = jacobian(rig, lambda r: residuals(r, records))
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


def _proposals(rig: TendonRig, first: TendonRecord, noise: float) -> dict[str, Callable[[TendonRig], Floats]]:
    """Further records by description, each with its outputs over its noise."""
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
        "the first record again": lambda r: residuals(r, [first]) / np.sqrt(noise),
        "the load cell read with the tendon off, to 0.005 N": lambda r: np.array([r.zero_N / 0.005]),
        "a second load cell at the robot's base": lambda r: first.run(r).robot_N * per_N,
        "the robot held straight, up to the same tension": held_straight,
        "a quarter of the amplitude about 60 % of the stroke": about_a_mean,
    }
