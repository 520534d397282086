"""The constants of a known rig from its measured loops, by least squares on the chain, and what the loops cannot tell.

Free are the constants of the loop (:data:`CONSTANTS`): sheath and capstan friction, share and slip angle of the
material loop, stiffness and toe region of the ropes; and the zero of the angle. The rest of the rig is as declared.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from itertools import combinations

import numpy as np
from scipy.optimize import least_squares
from scipy.stats import t as student

from fem_models.chain.solve import simulate_chain
from fem_models.load.program import LoadProgram
from fem_models.rig.checks import RigError, SolverError
from fem_models.rig.of_record import rig_of
from fem_models.rig.rig import Rig
from hysteresis.arrays import Floats
from hysteresis.path import branches, require_reversal
from hysteresis.record import Record, RecordError
from hysteresis.uncertainty import Parameter
from validation.separation.contributions import loop_program

SAMPLES = 300
"""Of a record that a fit works on: the mechanics has no time in it, samples between turning points may be left out."""
CORRELATED = 0.95  # constants more alike than this are not told apart
_AT_REST = 0.05  # of the drive's range: a record that begins so near to zero begins from rest
_STEP = 1e-3  # of finite differences, in natural sizes
_MOST_CALLS = 60


@dataclass(frozen=True)
class Constant:
    """A number of the rig that is fitted: its natural size makes constants comparable."""

    unit: str
    low: float
    high: float
    size: float


CONSTANTS = {
    "sheath_N": Constant("N", 0.0, 20.0, 1.0),
    "capstan_coefficient": Constant("-", 0.0, 1.0, 0.05),
    "loop_share": Constant("-", 0.0, 0.9, 0.2),
    "loop_angle_deg": Constant("deg", 0.2, 10.0, 1.0),
    "EA_N": Constant("N", 500.0, 300_000.0, 5_000.0),
    "toe_N": Constant("N", 0.0, 300.0, 20.0),
}


def constants_of(rig: Rig) -> dict[str, float]:
    """Values of :data:`CONSTANTS` in a rig; of the ropes, those of tendon a."""
    dry, material, rope = rig.friction, rig.material, rig.tendon_a
    values = (dry.sheath_N, dry.capstan_coefficient, material.loop_share, material.loop_angle_deg)
    return dict(zip(CONSTANTS, (*values, rope.EA_N, rope.toe_N), strict=True))


def with_constants(rig: Rig, values: Sequence[float] | Floats) -> Rig:
    """Give a rig other values of :data:`CONSTANTS`, in that order; both ropes alike."""
    sheath, mu, share, angle, EA, toe = (float(v) for v in values)
    ropes = [replace(rope, EA_N=EA, toe_N=toe) for rope in rig.tendons]
    return replace(
        rig,
        friction=replace(rig.friction, sheath_N=sheath, capstan_coefficient=mu),
        material=replace(rig.material, loop_share=share, loop_angle_deg=angle),
        tendon_a=ropes[0],
        tendon_b=ropes[1] if len(ropes) == 2 else None,
    )


@dataclass(frozen=True)
class Experiment:
    """What another record would bring, in nats of the determinant of the information (D-optimality) over the records.

    ``narrower`` is the factor by which it narrows the interval of ``constant``, the one that gains most.
    """

    what: str
    preload_N: float
    amplitude_mm: float
    gain: float
    constant: str
    narrower: float


@dataclass(frozen=True, eq=False)
class RigCalibration:
    """Fitted constants of a rig with their covariance, shape (6, 6), in their own units."""

    rig: Rig
    constants: dict[str, Parameter]
    covariance: Floats
    quantile: float  # half an interval over a standard deviation
    rmse_deg: float
    condition: float  # of the Jacobian with columns of length 1
    correlations: dict[str, float]
    inseparable: tuple[str, ...]  # in words
    experiments: tuple[Experiment, ...]  # best first


@dataclass(frozen=True)
class _Bench:
    """A record, thinned, as a run of its rig."""

    rig: Rig
    program: LoadProgram
    skip: int  # samples of the approach
    angle_deg: Floats

    def miss(self, values: Floats) -> Floats:
        angle = simulate_chain(with_constants(self.rig, values), self.program).angle_deg[self.skip :]
        off = angle - self.angle_deg
        return np.asarray(off - off.mean())  # the zero of the angle is free


def calibrate_rig(records: Sequence[Record]) -> RigCalibration:
    """Fit the constants of a known rig to its records, jointly; preloads are those that the records name.

    Raises
    ------
    RecordError
        No record, or one without a known rig, without a loop, or with a drive that is not in mm.
    RigError
        A rig that cannot be, cannot follow its record, or needs times or cycles.
    """
    benches = [_bench(record) for record in records]
    sizes = np.array([c.size for c in CONSTANTS.values()])
    low, high = (np.array([getattr(c, end) for c in CONSTANTS.values()]) / sizes for end in ("low", "high"))

    def misses(x: Floats) -> Floats:
        try:
            return np.concatenate([bench.miss(x * sizes) for bench in benches])
        except SolverError:  # constants that no rig can have; the step is made shorter
            return np.full(sum(bench.angle_deg.size for bench in benches), 1e3)

    start = np.array(list(constants_of(benches[0].rig).values())) / sizes
    start = np.clip(start, np.maximum(low, 0.1), 0.9 * high)  # from 0, friction has no slope to go by
    fit = least_squares(misses, start, bounds=(low, high), diff_step=_STEP, max_nfev=_MOST_CALLS, x_scale="jac")
    columns = jacobian(misses, fit.x, high)
    return _judged(benches, fit.x, sizes, fit.fun, columns)


def jacobian(residual: Callable[[Floats], Floats], x: Floats, high: Floats) -> Floats:
    """Differentiate a function of shape (p,) -> (m,) at x; steps stay below ``high``. Shape (m, p)."""
    at, columns = residual(x), []
    for i in range(x.size):
        step = _STEP * max(1.0, abs(x[i])) * (1.0 if x[i] + 2 * _STEP * max(1.0, abs(x[i])) < high[i] else -1.0)
        columns.append((residual(x + step * np.eye(x.size)[i]) - at) / step)
    return np.column_stack(columns)


def _bench(record: Record) -> _Bench:
    name = record.source or record.title or "record"
    rig = rig_of(record)
    if rig is None:
        expected = "expected [rig] with preset, file or measured joints, and preload_N"
        raise RecordError(f"{name}: its rig is not known: {expected}")
    if record.drive_unit != "mm":
        raise RecordError(f"{name}: drive in {record.drive_unit}: expected mm, of a known rig")
    require_reversal(record)
    every = max(1, math.ceil(record.drive.size / SAMPLES))
    keep = np.zeros(record.drive.size, dtype=bool)
    keep[::every] = True
    keep[[0, *(b.stop - 1 for b in branches(record.drive))]] = True
    drive = record.drive[keep]
    # a record that begins elsewhere has a history: the best guess is that it went the same way before
    known = abs(drive[0]) <= _AT_REST * np.ptp(drive)
    path = drive if known else np.concatenate([drive, drive])
    try:
        bench = _Bench(rig, LoadProgram(path), path.size - drive.size, record.angle_deg[keep])
        simulate_chain(rig, bench.program)
    except (RigError, SolverError) as error:
        raise RigError(f"{name}: {error}") from None
    return bench


def _judged(benches: list[_Bench], x: Floats, sizes: Floats, miss: Floats, columns: Floats) -> RigCalibration:
    """Covariance and words; samples whose residuals are alike count as fewer (first-order autoregression)."""
    m, p = columns.shape
    r = max(0.0, float(miss[1:] @ miss[:-1]) / max(float(miss @ miss), 1e-300))
    effective = max(1.0, m * (1 - r) / (1 + r))
    variance = float(miss @ miss) / max(1, m - p) * m / effective
    norms = np.linalg.norm(columns, axis=0)
    norms = np.maximum(norms, 1e-9 * norms.max())  # what the record does not show has next to no information
    _, singular, basis = np.linalg.svd(columns / norms, full_matrices=False)
    singular = np.maximum(singular, 1e-9 * singular[0])
    scaled = variance * (basis.T / singular**2) @ basis / np.outer(norms, norms)
    quantile = float(student.ppf(0.975, max(1, m - p)))
    names, half = list(CONSTANTS), quantile * np.sqrt(np.diag(scaled)) * sizes
    correlation = scaled / np.sqrt(np.outer(np.diag(scaled), np.diag(scaled)))
    pairs = {f"{names[i]} ~ {names[j]}": float(correlation[i, j]) for i, j in combinations(range(p), 2)}
    constants = {
        name: Parameter(float(v), max(c.low, float(v - h)), min(c.high, float(v + h)), c.unit)
        for (name, c), v, h in zip(CONSTANTS.items(), x * sizes, half, strict=True)
    }
    return RigCalibration(
        rig=with_constants(benches[0].rig, x * sizes),
        constants=constants,
        covariance=scaled * np.outer(sizes, sizes),
        quantile=quantile,
        rmse_deg=float(np.sqrt(np.mean(miss**2))),
        condition=float(singular[0] / singular[-1]),
        correlations=pairs,
        inseparable=_inseparable(constants, pairs),
        experiments=_experiments(benches[0], x, sizes, columns, max(variance, 1e-12)),
    )


def _inseparable(constants: dict[str, Parameter], pairs: dict[str, float]) -> tuple[str, ...]:
    words = [
        f"{pair.replace(' ~ ', ' and ')}: correlation {r:+.3f}, fixed only together"
        for pair, r in sorted(pairs.items(), key=lambda item: -abs(item[1]))
        if abs(r) > CORRELATED
    ]
    for name, c in constants.items():
        assert c.low is not None
        assert c.high is not None
        if c.high - c.low > 2 * abs(c.value):
            words.append(f"{name}: interval {c.low:.3g} to {c.high:.3g} {c.unit}, wider than its value")
    return tuple(words)


def _experiments(bench: _Bench, x: Floats, sizes: Floats, columns: Floats, variance: float) -> tuple[Experiment, ...]:
    """Predict what a second loop would add, at other preloads and amplitudes, simulated with the fitted constants."""
    weak = np.eye(x.size) * 1e-4  # an interval of 100 natural sizes where nothing is known
    known = columns.T @ columns / variance + weak
    drive, preload = bench.program.drive_mm, bench.rig.preload_N
    low, high = float(drive.min()), float(drive.max())
    limits = np.array([c.high for c in CONSTANTS.values()]) / sizes
    before, names, found = np.sqrt(np.diag(np.linalg.inv(known))), list(CONSTANTS), []
    for p, a in ((1.0, 1.0), (0.5, 1.0), (2.0, 1.0), (1.0, 0.5), (1.0, 0.25), (0.5, 0.5), (2.0, 0.5)):
        if preload == 0 and p != 1:
            continue
        rig, program = replace(bench.rig, preload_N=p * preload), loop_program(a * low, a * high, cycles=1)
        other = _Bench(rig, program, 0, np.zeros(program.drive_mm.size))
        try:
            more = jacobian(lambda y, other=other: other.miss(y * sizes), x, limits)  # type: ignore[misc]
        except (SolverError, RigError):
            continue
        information = known + more.T @ more / variance * columns.shape[0] / more.shape[0]
        gain = 0.5 * float(np.linalg.slogdet(information)[1] - np.linalg.slogdet(known)[1])
        narrower = before / np.sqrt(np.diag(np.linalg.inv(information)))
        i = int(np.argmax(narrower))
        what = "the same again" if p == a == 1 else f"preload x {p:g}, amplitude x {a:g}"
        amplitude = a * max(abs(low), abs(high))
        found.append(Experiment(what, p * preload, amplitude, gain, names[i], float(narrower[i])))
    return tuple(sorted(found, key=lambda e: -e.gain))
