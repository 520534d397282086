"""A curve with play operators, fitted to records by linear least squares: a baseline that knows no rig.

The angle is a cubic of the drive, plus play operators of the drive, each through a cubic of its own, plus a zero for
each record: a Prandtl-Ishlinskii model (Kuhnen 2003, doi 10.3166/ejc.9.407-418) whose loops vary with the position.
Where the records have several preloads, the slope and the plays have a part in proportion to the preload.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from hysteresis.arrays import Floats
from hysteresis.laws.prandtl_ishlinskii import plays
from hysteresis.records.record import Record

DEGREE = 3
"""Of all cubics. On a measured manipulator, plays alone leave 0.95 deg, and plays through cubics 0.15 deg."""
RADII = (0.01, 0.02, 0.04, 0.08, 0.15, 0.25, 0.4, 0.6, 0.8)
"""Of the plays, over half the range of the drive."""
SMALLEST_SINGULAR = 1e-9
"""Over the largest one: smaller ones are taken as 0."""


@dataclass(frozen=True, eq=False)
class CurveWithPlays:
    """A fitted baseline.

    Parameters
    ----------
    low, high
        Range of the drive in which the polynomial and the radii count, the drive's unit.
    preload_N
        Mean preload; NaN where the records do not differ in it.
    weights
        Of the columns of :func:`regressors`, the zeros of the records left out.
    residuals
        Residual of the angle of each record that was fitted, deg, shapes (m_i,).
    """

    low: float
    high: float
    preload_N: float
    weights: Floats
    residuals: tuple[Floats, ...]

    @property
    def level_deg(self) -> float:
        """Root mean square of the residual."""
        return float(np.sqrt(np.mean(np.concatenate(self.residuals) ** 2)))


def fit_curve_with_plays(records: Sequence[Record]) -> CurveWithPlays:
    """Fit all records together."""
    low = min(float(record.drive.min()) for record in records)
    high = max(float(record.drive.max()) for record in records)
    preloads = np.array([float(record.rig.get("preload_N", np.nan)) for record in records])
    mean = float(preloads.mean()) if np.ptp(preloads) > 0 else np.nan
    columns = np.concatenate([regressors(record, low, high, mean) for record in records])
    X = np.column_stack([zeros_of(records), columns])
    angle = np.concatenate([record.angle_deg for record in records])
    weights = np.linalg.lstsq(X, angle, rcond=SMALLEST_SINGULAR)[0]
    return CurveWithPlays(low, high, mean, weights[len(records) :], split(angle - X @ weights, records))


def change_beyond_curve(fitted: CurveWithPlays, records: Sequence[Record]) -> float:
    """Root mean square of what changed records differ by from a fitted baseline, deg.

    The weights of the plays stay; a polynomial of the drive and the zero of each record are free, so that what is a
    curve of the drive alone does not count. The residual of the records that were fitted is taken off in squares.
    """
    columns = [regressors(record, fitted.low, fitted.high, fitted.preload_N) for record in records]
    left = np.concatenate([r.angle_deg - c @ fitted.weights for r, c in zip(records, columns, strict=True)])
    smooth = np.column_stack([zeros_of(records), np.concatenate(columns)[:, :DEGREE]])
    left = left - smooth @ np.linalg.lstsq(smooth, left, rcond=SMALLEST_SINGULAR)[0]
    return float(np.sqrt(max(np.mean(left**2) - fitted.level_deg**2, 0.0)))


def regressors(record: Record, low: float, high: float, preload_N: float) -> Floats:
    """Columns of one record: the polynomial, the plays, and their part in proportion to the preload if it is known."""
    path = 2.0 * (record.drive - low) / (high - low) - 1.0
    curve = np.polynomial.chebyshev.chebvander(path, DEGREE)[:, 1:]
    each = plays(path, RADII).T
    loops = np.column_stack([each**power for power in range(1, DEGREE + 1)])
    if np.isnan(preload_N):
        return np.column_stack([curve, loops])
    more = float(record.rig["preload_N"]) / preload_N - 1.0
    return np.column_stack([curve, loops, more * path, more * each])


def zeros_of(records: Sequence[Record]) -> Floats:
    """Give a column for the zero of each record, shape (samples of all records, records)."""
    return np.repeat(np.eye(len(records)), [record.drive.size for record in records], axis=0)


def split(values: Floats, records: Sequence[Record]) -> tuple[Floats, ...]:
    """Divide values of all samples by record."""
    return tuple(np.split(values, np.cumsum([record.drive.size for record in records])[:-1]))
