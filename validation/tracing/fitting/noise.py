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
    """Error of the angle that no model can be blamed for.

    Parameters
    ----------
    local_deg
        Sensor noise, from neighbouring samples.
    repeats_deg
        Repeatability, from cycles or trials that repeat each other; None where there are none.
    reference_deg
        Error that is left on a reference, of records that are compared with one.
    by_repeats
        Whether repeatability is the floor where it is known. Otherwise the smaller estimate is: cycles that change
        count as noise in one of them, corners of the loop in the other.
    """

    local_deg: float
    repeats_deg: float | None
    reference_deg: float | None = None
    by_repeats: bool = False

    @property
    def deg(self) -> float:
        """The floor."""
        if self.repeats_deg is None:
            floor = self.local_deg
        else:
            floor = self.repeats_deg if self.by_repeats else min(self.local_deg, self.repeats_deg)
        return max(floor, self.reference_deg or 0.0)

    @property
    def how(self) -> str:
        """Where the floor is from."""
        if self.reference_deg is not None and self.reference_deg >= self.deg:
            return "what is left unexplained of the reference"
        return "cycles that repeat each other" if self.deg == self.repeats_deg else "neighbouring samples"


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
