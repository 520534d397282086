"""The noise floor of the measured angle, estimated from the residual of a model."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from hysteresis import metrics
from hysteresis.arrays import Floats
from hysteresis.metrics import noise_floor
from hysteresis.record import Record
from validation.tracing.prepared import PreparedRecord
from validation.tracing.settings import LEAST_NOISE, MAD_TO_SIGMA, NOISE_BRANCH_SAMPLES


@dataclass(frozen=True)
class NoiseFloor:
    """Standard deviation of the angle's noise, deg: from neighbouring samples, and from cycles that repeat, or None."""

    local_deg: float
    repeats_deg: float | None

    @property
    def deg(self) -> float:
        """The smaller estimate: cycles that change count as noise in one of them, corners of the loop in the other."""
        return self.local_deg if self.repeats_deg is None else min(self.local_deg, self.repeats_deg)


def estimate_noise_floor(records: Sequence[PreparedRecord], residuals: Sequence[Floats]) -> NoiseFloor:
    """Estimate the noise from the residuals of a model, which are flatter than the angle.

    The local estimate is the median absolute third difference of neighbouring samples along each branch, over sqrt(20)
    (the norm of the coefficients 1, -3, 3, -1). It is at least the rounding error of the record's digits, 1/sqrt(12) of
    one, and a part of the angle's range that no sensor resolves. Branches of fewer than eight samples are left out.
    """
    local, repeats, weight = [], [], []
    for one, residual in zip(records, residuals, strict=True):
        least = max(one.rounding_deg, LEAST_NOISE * float(np.ptp(one.record.angle_deg)))
        third = [np.diff(residual[b], 3) for b in one.branches if b.stop - b.start >= NOISE_BRANCH_SAMPLES]
        if third:
            size = MAD_TO_SIGMA * float(np.median(np.abs(np.concatenate(third)))) / math.sqrt(20)
            local.append(max(size, least))
            weight.append(residual.size)
        if one.cycles_repeat:
            repeats.append(max(noise_floor(_residual_record(one, residual)), least))
    known = math.sqrt(float(np.mean(np.square(repeats)))) if repeats else None
    if not local:  # short branches only: without cycles that repeat, the whole residual may be noise
        whole = np.concatenate([r - r.mean() for r in residuals])
        return NoiseFloor(math.sqrt(float(whole @ whole) / whole.size) if known is None else known, known)
    return NoiseFloor(math.sqrt(float(np.average(np.square(local), weights=weight))), known)


def repeatability_deg(records: Sequence[PreparedRecord], residuals: Sequence[Floats]) -> float | None:
    """Estimate the deviation from one cycle or trial to the next, deg (:func:`hysteresis.metrics.repeatability_deg`).

    Parameters
    ----------
    residuals
        Of a model, which are flatter than the angle, so that trials at other loads compare better.

    Returns
    -------
    float or None
        Root mean square over the records that have cycles or trials that repeat; None where none has.
    """
    known = []
    for one, residual in zip(records, residuals, strict=True):
        if one.cycles_repeat and (size := metrics.repeatability_deg(_residual_record(one, residual))) is not None:
            known.append(max(size, one.rounding_deg))
    return math.sqrt(float(np.mean(np.square(known)))) if known else None


def _residual_record(one: PreparedRecord, residual: Floats) -> Record:
    return Record(drive=one.drive, angle_deg=residual, drive_unit=one.record.drive_unit, cycle=one.inputs.cycle)
