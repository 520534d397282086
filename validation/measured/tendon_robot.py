"""Measured tendon robot with a load cell: one rig for stroke, tension and bending, against one operator per relation.

The records are not part of the project: ``notchbend data fetch`` gets them.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from hysteresis import Record, read_record
from hysteresis.arrays import Floats
from hysteresis.records.holdout import Split
from validation.layer import fit_operator
from validation.layer.comparators import Kind
from validation.measured.tendon_fit import (
    RELATIONS,
    TendonRecord,
    bias_of_noise,
    bootstrap,
    fit,
    residuals,
    tendon_record,
)
from validation.measured.tendon_parts import TendonContributions, tendon_contributions
from validation.measured.tendon_rig import TendonRig

TRAINING = ("zero-0.10hz", "zero-0.20hz")
HELD_OUT = ("zero-0.15hz", "zero-0.30hz", "mean-0.02hz")
KINDS: Mapping[Kind, str] = {
    "curve": "curve f(x)",
    "play": "play, f(P[x])",
    "pi": "Prandtl-Ishlinskii of 10, f(x) + sum w P[x]",
    "pi-inside": "Prandtl-Ishlinskii of 10, f(sum w P[x])",
    "pi-leading": "Prandtl-Ishlinskii of 10, f(x) - sum w P[x]",
}
FIXED: Mapping[str, float] = {"zero_N": 0.0}
"""Parameters that the baseline structure does not fit: the reading of the load cell without load is zero."""
BASELINE = "baseline"
STRUCTURES: Mapping[str, Mapping[str, float]] = {
    BASELINE: {},
    "cell reads 0.2 N without load": {"zero_N": 0.2},
    "cell reads 0.4 N without load": {"zero_N": 0.4},
    "no capstan friction along the robot": {"capstan": 0.0},
    "cell reads 0.2 N, no capstan friction along the robot": {"zero_N": 0.2, "capstan": 0.0},
    "no constant friction": {"constant_N": 0.0},
    "stretch by the mean of both tensions": {"cell_side": 0.5},
    "only constant friction before the robot": {"entry": 0.0},
    "no material loop": {"loop_share": 0.0, "loop_angle_deg": 8.0},
    "no stretch": {"stretch_mm_per_N": 0.0, "cell_side": 1.0},
    "no friction": {"entry": 0.0, "constant_N": 0.0, "capstan": 0.0},
}
"""Structures of the rig: parameters that are fixed in addition to :data:`FIXED`."""
EQUIVALENT = 1.05
"""Structures whose training error is within this factor of the least are not distinguished by the records."""
TOP_DEG = 55.0
"""Bending of the loop whose contributions are computed."""
DRAWS = 200
REFITS = 10
"""Simulated records that measure how far noise shifts the fit."""
_GRID_DEG = 2.5
_FROM_DEG = 5.0  # below, the robot has hardly left its stop
_REVERSED = 0.6  # of the largest bending: in unloading, all friction has reversed below it
_LEAST_LOOP_DEG = 15.0
_RESAMPLES = 2000


@dataclass(frozen=True)
class TensionRatio:
    """Regression ln(loading / unloading tension) = 2 (wrap + slope theta); 95 % intervals from resampled loops.

    Parameters
    ----------
    wrap, slope_per_rad
        Value, lower and upper bound.
    loops
        Number of loops.
    least, largest
        Ratio on the regression line at the least and at the largest bending.
    """

    wrap: tuple[float, float, float]
    slope_per_rad: tuple[float, float, float]
    loops: int
    least: float
    largest: float


@dataclass(frozen=True)
class RobotStudy:
    """Everything that the page about the robot shows.

    Parameters
    ----------
    data
        Records, by name.
    rig
        Baseline structure, fitted to the training records.
    fits
        All structures, by name.
    equivalent
        Structures within :data:`EQUIVALENT` of the least training error.
    drawn
        Bootstrap of the baseline structure.
    """

    data: Mapping[str, TendonRecord]
    rig: TendonRig
    fits: Mapping[str, TendonRig]
    equivalent: Mapping[str, TendonRig]
    drawn: Sequence[TendonRig]

    @property
    def training(self) -> list[TendonRecord]:
        """Records of the fit."""
        return [self.data[name] for name in TRAINING]

    @property
    def heldout(self) -> list[TendonRecord]:
        """Records that were not used in the fit."""
        return [self.data[name] for name in HELD_OUT]


def loop_ratios(record: TendonRecord, tension_N: Floats) -> list[tuple[Floats, Floats]]:
    """Bending, rad, and logarithm of loading over unloading tension on a grid of bending, for each loop."""
    found = []
    for loop in record.loops():
        bent, tension = record.bending_deg[loop], tension_N[loop]
        top = int(np.argmax(record.stroke_mm[loop]))
        if top < 2 or bent.size - top < 3 or bent[top] < _LEAST_LOOP_DEG:
            continue
        rising, falling = np.maximum.accumulate(bent[: top + 1]), np.maximum.accumulate(bent[top:][::-1])
        grid = np.arange(max(_FROM_DEG, rising[0], falling[0]), _REVERSED * bent[top], _GRID_DEG)
        one, other = np.interp(grid, rising, tension[: top + 1]), np.interp(grid, falling, tension[top:][::-1])
        if grid.size > 1 and other.min() > 0:
            found.append((np.radians(grid), np.log(one / other)))
    return found


def tension_ratio(records: Sequence[TendonRecord], tensions_N: Sequence[Floats], seed: int = 0) -> TensionRatio:
    """Regress the logarithm of the tension ratio on bending; whole loops are resampled for the intervals."""
    loops = [loop for record, t in zip(records, tensions_N, strict=True) for loop in loop_ratios(record, t)]

    def line(chosen: Sequence[tuple[Floats, Floats]]) -> Floats:
        theta, ratio = (np.concatenate([loop[i] for loop in chosen]) for i in range(2))
        return np.polyfit(theta, ratio, 1)[::-1] / 2

    rng = np.random.default_rng(seed)
    drawn = [line([loops[i] for i in rng.integers(0, len(loops), len(loops))]) for _ in range(_RESAMPLES)]
    low, high = np.quantile(drawn, [0.025, 0.975], axis=0)
    wrap, slope = line(loops)
    theta = np.concatenate([t for t, _ in loops])
    ends = [float(np.exp(2 * (wrap + slope * end))) for end in (theta.min(), theta.max())]
    return TensionRatio(
        (float(wrap), float(low[0]), float(high[0])),
        (float(slope), float(low[1]), float(high[1])),
        len(loops),
        ends[0],
        ends[1],
    )


def tension_ratios(found: RobotStudy) -> dict[str, TensionRatio]:
    """Tension ratio of the measured readings for assumed zeros of the cell, and of the fitted rig."""
    records = list(found.data.values())
    without = replace(found.rig, capstan=0.0)
    tensions = {
        "measured, as the cell reads": [r.tension_N for r in records],
        "measured, above 0.2 N": [r.tension_N - 0.2 for r in records],
        "measured, above 0.4 N, about the reading at rest": [r.tension_N - 0.4 for r in records],
        "the fitted rig, as its cell reads": [r.run(found.rig).tension_N for r in records],
        "the fitted rig without capstan friction along the robot": [r.run(without).tension_N for r in records],
    }
    return {name: tension_ratio(records, each) for name, each in tensions.items()}


def operator_errors(
    kind: Kind, relation: int, train: Sequence[TendonRecord], evaluated: Sequence[TendonRecord]
) -> list[float]:
    """Fit an operator to one relation of the training records; RMSE in % of the range of each evaluated record."""
    records = [_relation(record, relation) for record in train]
    everything = [Split(np.ones(r.drive.size, dtype=bool), np.zeros(r.drive.size, dtype=bool), "") for r in records]
    operator = fit_operator(kind, records, everything)
    found = []
    for record in evaluated:
        one = _relation(record, relation)
        found.append(
            100 * float(np.sqrt(np.mean((operator.predict(one) - one.angle_deg) ** 2)) / np.ptp(one.angle_deg))
        )
    return found


def _relation(record: TendonRecord, relation: int) -> Record:
    """Input and output of one of the relations as a record."""
    x = record.tension_N if relation == 1 else record.stroke_mm
    unit = "N" if relation == 1 else "mm"
    return Record(drive=x, angle_deg=record.measured()[relation], drive_unit=unit, source=record.name)  # type: ignore[arg-type]


def heldout_errors(rig: TendonRig, records: Sequence[TendonRecord]) -> Floats:
    """RMSE of each relation over all records, % of range, shape (3,)."""
    return np.asarray(np.sqrt(np.mean(np.square([record.errors(rig) for record in records]), axis=0)))


def training_error(rig: TendonRig, train: Sequence[TendonRecord]) -> float:
    """Root mean square over the three relations and the records, % of range."""
    residual = residuals(rig, train)
    return 100 * float(np.sqrt(residual @ residual / (len(RELATIONS) * len(train))))


def contributions(rigs: Sequence[TendonRig]) -> list[TendonContributions]:
    """Divide the loop from rest to :data:`TOP_DEG` of each rig."""
    return [tendon_contributions(rig, TOP_DEG) for rig in rigs]


def study(folder: Path) -> RobotStudy:
    """Fit all structures to the training records.

    Raises
    ------
    RecordError
        As :func:`hysteresis.records.record_file.read_record`.
    """
    data = {n: tendon_record(read_record(folder / f"tendon-robot-{n}.csv")) for n in (*TRAINING, *HELD_OUT)}
    train = [data[n] for n in TRAINING]
    best = fit(train, TendonRig(), FIXED)
    fits = {name: fit(train, best, {**FIXED, **more}) if more else best for name, more in STRUCTURES.items()}
    limit = EQUIVALENT * min(training_error(rig, train) for rig in fits.values())
    equivalent = {name: rig for name, rig in fits.items() if training_error(rig, train) <= limit}
    bias = bias_of_noise(best, train, REFITS, seed=1, fixed=FIXED)
    return RobotStudy(data, best, fits, equivalent, bootstrap(best, train, DRAWS, seed=0, fixed=FIXED, bias=bias))
