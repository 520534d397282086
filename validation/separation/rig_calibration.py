"""Calibrate a known rig on its measured loops: least squares with the chain, and identifiability of the parameters.

The fitted parameters (:data:`PARAMETERS`) are sheath and capstan friction, share and slip angle of the material loop,
and stiffness and toe region of the tendons. The zero of the angle is free. The rest of the rig stays as given.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from itertools import combinations

import numpy as np
from scipy.optimize import OptimizeResult, least_squares
from scipy.stats import chi2
from scipy.stats import t as student

from fem_models.chain import simulate_chain
from fem_models.chain.solve import chain_angle_deg
from fem_models.load import LoadProgram
from fem_models.rig import Rig, RigError
from fem_models.rig.checks import SolverError
from fem_models.rig.of_record import require_the_rigs_sense, rig_of
from hysteresis import Record
from hysteresis.arrays import Floats, Mask
from hysteresis.fitting.uncertainty import Parameter
from hysteresis.records.metrics import noise_floor
from hysteresis.records.path import branches, require_reversal
from hysteresis.records.record import RecordError
from hysteresis.sensors.readings import Cleaned, cleaned, sensor_notes
from validation.separation.contributions import loop_program

SAMPLES = 300
"""Samples of a record that the fit keeps. The mechanics is quasi-static: only the reversals are indispensable."""
CORRELATED = 0.95
"""Magnitude of the correlation above which two parameters are reported as inseparable."""
_AT_REST = 0.05  # share of the drive's range: a record that begins this close to zero begins from rest
_STEP = 1e-3  # of finite differences, in scales of the parameters
_MOST_CALLS = 60
_OTHER_LOOPS = (0.5, 1.0, 2.0)  # slip angles over that of the rig, from which the fit starts again
_LEAST_NOISE = 1e-6  # of the range of the angle: less comes from a simulation


@dataclass(frozen=True)
class ParameterRange:
    """Unit and bounds of a fitted parameter; its scale makes parameters comparable."""

    unit: str
    low: float
    high: float
    scale: float


PARAMETERS = {
    "sheath_N": ParameterRange("N", 0.0, 20.0, 1.0),
    "capstan_coefficient": ParameterRange("-", 0.0, 1.0, 0.05),
    "loop_share": ParameterRange("-", 0.0, 0.9, 0.2),
    "loop_angle_deg": ParameterRange("deg", 0.2, 10.0, 1.0),
    "EA_N": ParameterRange("N", 500.0, 300_000.0, 5_000.0),
    "toe_N": ParameterRange("N", 0.0, 300.0, 20.0),
}


def parameters_of(rig: Rig) -> dict[str, float]:
    """Values of :data:`PARAMETERS` in a rig; tendon a stands for both."""
    dry, material, tendon = rig.friction, rig.material, rig.tendon_a
    values = (dry.sheath_N, dry.capstan_coefficient, material.loop_share, material.loop_angle_deg)
    return dict(zip(PARAMETERS, (*values, tendon.EA_N, tendon.toe_N), strict=True))


def with_parameters(rig: Rig, values: Sequence[float] | Floats) -> Rig:
    """Replace the values of :data:`PARAMETERS`, in that order; both tendons get the same."""
    sheath, mu, share, angle, EA, toe = (float(v) for v in values)
    tendons = [replace(tendon, EA_N=EA, toe_N=toe) for tendon in rig.tendons]
    return replace(
        rig,
        friction=replace(rig.friction, sheath_N=sheath, capstan_coefficient=mu),
        material=replace(rig.material, loop_share=share, loop_angle_deg=angle),
        tendon_a=tendons[0],
        tendon_b=tendons[1] if len(tendons) == 2 else None,
    )


@dataclass(frozen=True)
class Experiment:
    """Information gain of a further record: gain in half the log-determinant of the information (D-optimality), nats.

    ``narrower`` is the factor by which the record narrows the interval of ``parameter``, the one that gains most.
    """

    what: str
    preload_N: float
    amplitude_mm: float
    gain: float
    parameter: str
    narrower: float

    def to_dict(self) -> dict[str, str | float]:
        """Values as in ``separate.json``, where the parameter's key is ``constant``."""
        return {("constant" if name == "parameter" else name): value for name, value in vars(self).items()}


@dataclass(frozen=True, eq=False)
class RigCalibration:
    """Fitted parameters of a rig.

    Parameters
    ----------
    parameters
        Values with 95 % intervals.
    covariance
        Shape (6, 6), in the parameters' units.
    quantile
        Half width of an interval over the standard deviation.
    noise_deg
        Of the angle, from cycles that repeat or from neighbouring samples. Intervals are
        wider by :attr:`misfit` where that is more than 1.
    notes
        What was taken out of the records before the fit.
    condition
        Condition number of the Jacobian with columns scaled to length 1.
    correlations
        By pair of parameters.
    inseparable
        Sentences about parameters that the records do not identify.
    experiments
        Further records, the most informative first.
    """

    rig: Rig
    parameters: dict[str, Parameter]
    covariance: Floats
    quantile: float
    rmse_deg: float
    noise_deg: float
    condition: float
    correlations: dict[str, float]
    inseparable: tuple[str, ...]
    experiments: tuple[Experiment, ...]
    notes: tuple[str, ...] = ()

    @property
    def misfit(self) -> float:
        """Residual of the rig over the noise."""
        return self.rmse_deg / self.noise_deg


@dataclass(frozen=True)
class _Loop:
    """A thinned record with the rig and the load program that reproduce it; ``read`` are its readings."""

    rig: Rig
    program: LoadProgram
    skip: int  # samples of the approach
    angle_deg: Floats
    read: Mask

    def residual(self, values: Floats) -> Floats:
        angle = chain_angle_deg(with_parameters(self.rig, values), self.program)[self.skip :]
        difference = (angle - self.angle_deg)[self.read]
        return np.asarray(difference - difference.mean())  # the zero of the angle is free


def calibrate_rig(records: Sequence[Record]) -> RigCalibration:
    """Fit the parameters of a known rig jointly to its records; each record gives its own preload.

    Raises
    ------
    RecordError
        No record; or a record without a known rig, without a loop, or with a drive that is not in mm.
    RigError
        The rig is invalid, cannot follow its record, or needs times or cycles.
    """
    sensed = [cleaned(record) for record in records]
    loops = [_loop(one) for one in sensed]
    noise_deg = _noise_deg([one.record for one in sensed])
    scales = np.array([c.scale for c in PARAMETERS.values()])
    low, high = (np.array([getattr(c, end) for c in PARAMETERS.values()]) / scales for end in ("low", "high"))

    def residual(x: Floats) -> Floats:
        try:
            return np.concatenate([loop.residual(x * scales) for loop in loops])
        except SolverError:  # no equilibrium with these values: the large residual shortens the step
            return np.full(sum(int(loop.read.sum()) for loop in loops), 1e3)

    start = np.array(list(parameters_of(loops[0].rig).values())) / scales
    start = np.clip(start, np.maximum(low, 0.1), 0.9 * high)  # friction of 0 has a vanishing derivative

    def fitted(x: Floats) -> OptimizeResult:
        return least_squares(residual, x, bounds=(low, high), diff_step=_STEP, max_nfev=_MOST_CALLS, x_scale="jac")

    fits = [fitted(start)]
    loop = [list(PARAMETERS).index(name) for name in ("loop_share", "loop_angle_deg")]
    for factor in _OTHER_LOOPS:  # a loop of the material may be several optima away
        other = min(fits, key=_cost).x.copy()
        other[loop] = np.clip([start[loop[0]], factor * start[loop[1]]], low[loop], high[loop])
        fits.append(fitted(other))
    fit, *others = sorted(fits, key=_cost)
    optima = [(one.x - fit.x, 2 * _cost(one) - 2 * _cost(fit)) for one in others]
    columns = jacobian(residual, fit.x, high)
    found = _calibration(loops, fit.x, scales, (fit.fun, columns), noise_deg, optima)
    return replace(found, notes=sensor_notes(sensed))


def _cost(fit: OptimizeResult) -> float:
    return float(fit.cost)


def jacobian(residual: Callable[[Floats], Floats], x: Floats, high: Floats) -> Floats:
    """Differentiate a function (p,) -> (m,) at x by finite differences below ``high``; shape (m, p)."""
    at, columns = residual(x), []
    for i in range(x.size):
        step = _STEP * max(1.0, abs(x[i])) * (1.0 if x[i] + 2 * _STEP * max(1.0, abs(x[i])) < high[i] else -1.0)
        columns.append((residual(x + step * np.eye(x.size)[i]) - at) / step)
    return np.column_stack(columns)


def _noise_deg(records: Sequence[Record]) -> float:
    """Give the noise of all records together, at least what their digits resolve."""
    floor = math.sqrt(sum(noise_floor(record) ** 2 for record in records) / len(records))
    return max(floor, _LEAST_NOISE * max(float(np.ptp(record.angle_deg)) for record in records))


def _loop(sensed: Cleaned) -> _Loop:
    record, read = sensed.record, sensed.read
    name = record.source or record.title or "record"
    rig = rig_of(record)
    if rig is None:
        expected = "expected [rig] with preset, file or measured joints, and preload_N"
        raise RecordError(f"{name}: the rig is unknown: {expected}")
    if record.drive_unit != "mm":
        raise RecordError(f"{name}: drive in {record.drive_unit}: expected mm for a known rig")
    require_reversal(record)
    require_the_rigs_sense(record)
    every = max(1, math.ceil(int(read.sum()) / SAMPLES))
    keep = np.zeros(record.drive.size, dtype=bool)
    keep[np.flatnonzero(read)[::every]] = True
    keep[[0, *(b.stop - 1 for b in branches(record.drive))]] = True
    drive = record.drive[keep]
    # a record that does not begin at rest has a history: assume that the same drive went before it
    from_rest = abs(drive[0]) <= _AT_REST * np.ptp(drive)
    path = drive if from_rest else np.concatenate([drive, drive])
    try:
        loop = _Loop(rig, LoadProgram(path), path.size - drive.size, record.angle_deg[keep], read[keep])
        simulate_chain(rig, loop.program)
    except (RigError, SolverError) as error:
        raise RigError(f"{name}: {error}") from None
    return loop


def _calibration(
    loops: list[_Loop],
    x: Floats,
    scales: Floats,
    fit: tuple[Floats, Floats],
    noise_deg: float,
    optima: Sequence[tuple[Floats, float]],
) -> RigCalibration:
    """Covariance, correlations and advice from the residual and the Jacobian of a fit.

    Autocorrelated residuals (first order) count as fewer samples, and those beyond the noise widen all intervals. So
    does another optimum, given by its distance and its sum of squares above the best one's, that lies in the joint
    95 % region of a likelihood ratio (Seber and Wild 1989, section 5.3): intervals reach it.
    """
    residual, columns = fit
    m, p = columns.shape
    r = max(0.0, float(residual[1:] @ residual[:-1]) / max(float(residual @ residual), 1e-300))
    effective = max(1.0, m * (1 - r) / (1 + r))
    variance = float(residual @ residual) / max(1, m - p) * m / effective
    norms = np.linalg.norm(columns, axis=0)
    norms = np.maximum(norms, 1e-9 * norms.max())  # a parameter without influence has next to no information
    _, singular, basis = np.linalg.svd(columns / norms, full_matrices=False)
    singular = np.maximum(singular, 1e-9 * singular[0])
    unit = (basis.T / singular**2) @ basis / np.outer(norms, norms)
    rmse_deg = float(np.sqrt(np.mean(residual**2)))
    widened = variance * max(1.0, rmse_deg / noise_deg) ** 2
    quantile = float(student.ppf(0.975, max(1, m - p)))
    alike = [step for step, above in optima if above <= widened * float(chi2.ppf(0.95, p))]
    scaled = widened * unit + sum((np.outer(step, step) / quantile**2 for step in alike), np.zeros((p, p)))
    names, half = list(PARAMETERS), quantile * np.sqrt(np.diag(scaled)) * scales
    correlation = unit / np.sqrt(np.outer(np.diag(unit), np.diag(unit)))
    pairs = {f"{names[i]} ~ {names[j]}": float(correlation[i, j]) for i, j in combinations(range(p), 2)}
    parameters = {
        name: Parameter(float(v), max(c.low, float(v - h)), min(c.high, float(v + h)), c.unit)
        for (name, c), v, h in zip(PARAMETERS.items(), x * scales, half, strict=True)
    }
    return RigCalibration(
        rig=with_parameters(loops[0].rig, x * scales),
        parameters=parameters,
        covariance=scaled * np.outer(scales, scales),
        quantile=quantile,
        rmse_deg=rmse_deg,
        noise_deg=noise_deg,
        condition=float(singular[0] / singular[-1]),
        correlations=pairs,
        inseparable=_inseparable(parameters, pairs),
        experiments=_experiments(loops[0], x, scales, columns, max(variance, 1e-12)),
    )


def _inseparable(parameters: dict[str, Parameter], pairs: dict[str, float]) -> tuple[str, ...]:
    sentences = [
        f"{pair.replace(' ~ ', ' and ')}: correlation {r:+.3f}, identified only in combination"
        for pair, r in sorted(pairs.items(), key=lambda item: -abs(item[1]))
        if abs(r) > CORRELATED
    ]
    for name, c in parameters.items():
        assert c.low is not None
        assert c.high is not None
        if c.high - c.low > 2 * abs(c.value):
            unit = "" if c.unit == "-" else f" {c.unit}"
            sentences.append(f"{name}: interval {c.low:.3g} to {c.high:.3g}{unit}, wider than its value")
    return tuple(sentences)


def _experiments(loop: _Loop, x: Floats, scales: Floats, columns: Floats, variance: float) -> tuple[Experiment, ...]:
    """Information gain of a further loop at other preloads and amplitudes, simulated with the fitted parameters."""
    weak = np.eye(x.size) * 1e-4  # prior of 100 scales, for what the records do not identify
    known = columns.T @ columns / variance + weak
    drive, preload = loop.program.drive_mm, loop.rig.preload_N
    low, high = float(drive.min()), float(drive.max())
    limits = np.array([c.high for c in PARAMETERS.values()]) / scales
    before, names, found = np.sqrt(np.diag(np.linalg.inv(known))), list(PARAMETERS), []
    for p, a in ((1.0, 1.0), (0.5, 1.0), (2.0, 1.0), (1.0, 0.5), (1.0, 0.25), (0.5, 0.5), (2.0, 0.5)):
        if preload == 0 and p != 1:
            continue
        rig, program = replace(loop.rig, preload_N=p * preload), loop_program(a * low, a * high, cycles=1)
        angles = np.zeros(program.drive_mm.size)
        other = _Loop(rig, program, 0, angles, angles == 0)
        try:
            more = jacobian(lambda y, other=other: other.residual(y * scales), x, limits)  # type: ignore[misc]
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
