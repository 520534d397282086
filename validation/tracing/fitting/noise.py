"""The noise floor of the measured angle, estimated from the residual of a model."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from hysteresis.arrays import Floats
from hysteresis.records import metrics
from hysteresis.records.metrics import noise_floor
from hysteresis.records.record import Record
from validation.tracing.prepared import PreparedRecord
from validation.tracing.settings import (
    CORRELATED,
    DECIMATIONS,
    LEAST_NOISE,
    MAD_TO_SIGMA,
    MOST_CORRELATED,
    MOST_CORRELATION,
    MOST_OF_RESIDUAL,
    MOST_WANDER,
    NOISE_BRANCH_SAMPLES,
    NOISE_DIFFERENCES,
)

NOT_KNOWN = "no branch of the drive has enough samples to tell the noise: from about four a branch on it can"
"""Reason not to say whether an effect is missing."""


@dataclass(frozen=True)
class NoiseFloor:
    """Error of the angle that no model can be blamed for.

    Parameters
    ----------
    local_deg
        Sensor noise, from neighbouring samples; the whole residual, or repeatability, where these do not tell.
    repeats_deg
        Repeatability, from cycles or trials that repeat each other; None where there are none. In a fit's own floor,
        records without such cycles count by their neighbouring samples.
    reference_deg
        Error that is left on a reference, of records that are compared with one.
    by_repeats
        Whether repeatability is the floor where it is known. Otherwise the smaller estimate is: cycles that change
        count as noise in one of them, corners of the loop in the other.
    local_known
        Whether neighbouring samples tell the noise.
    """

    local_deg: float
    repeats_deg: float | None
    reference_deg: float | None = None
    by_repeats: bool = False
    local_known: bool = True

    @property
    def known(self) -> bool:
        """Whether the floor is noise: cycles of a record that drifts differ by the drift, too."""
        by_reference = self.reference_deg is not None and self.reference_deg >= self.deg
        return self.local_known or by_reference or (self.by_repeats and self.repeats_deg is not None)

    @property
    def sensor_deg(self) -> float | None:
        """Sensor noise; None where neighbouring samples do not tell it."""
        return self.local_deg if self.local_known else None

    @property
    def unrepeated_deg(self) -> float | None:
        """Noise of the sensor, or what one cycle differs from the next if that is more; None where neither is known."""
        return max(self.local_deg, self.repeats_deg or 0.0) if self.local_known else self.repeats_deg

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
            return "the residual that the reference leaves"
        if self.deg == self.repeats_deg:
            return f"cycles or trials that repeat each other{'' if self.known else ', by noise or by a drift'}"
        return "neighbouring samples" if self.local_known else "the whole residual: the noise is not known"


def estimate_noise_floor(records: Sequence[PreparedRecord], residuals: Sequence[Floats]) -> NoiseFloor:
    """Estimate the noise from the residuals of a model, which are flatter than the angle.

    The local estimate is the median absolute third difference of neighbouring samples along each branch, over sqrt(20)
    (the norm of the coefficients 1, -3, 3, -1). It is at least the rounding error of the record's digits, 1/sqrt(12) of
    one, a part of the angle's range that no sensor resolves, and the error that the steps of the drive make. That one
    repeats with the cycles, and adds to what these differ by. A branch of four samples has one such difference. Records
    with fewer than five are left out; without any, the noise is not known, and the floor is the whole residual.
    """
    local, repeats = list[tuple[float, int]](), list[tuple[float, int]]()  # sizes, and samples that they are of
    for one, residual in zip(records, residuals, strict=True):
        least = max(one.rounding_deg, LEAST_NOISE * float(np.ptp(one.record.angle_deg)))
        steps = one.drive_step_deg
        long = [b for b in one.branches if b.stop - b.start >= NOISE_BRANCH_SAMPLES]
        third = np.concatenate([np.empty(0), *(np.diff(residual[b], 3) for b in long)])
        own = list[tuple[float, int]]()
        if third.size >= NOISE_DIFFERENCES:
            size = MAD_TO_SIGMA * float(np.median(np.abs(third))) / math.sqrt(20)
            own = [(max(size, least, steps), residual.size)]
        local += own
        if one.cycles_repeat:
            own = [(math.hypot(max(noise_floor(_residual_record(one, residual)), least), steps), residual.size)]
        repeats += own  # of a record whose cycles differ, its neighbouring samples: it has noise of its own
    known = _rms(repeats) if any(one.cycles_repeat for one in records) else None
    if not local:  # short branches only: without cycles that repeat, the whole residual may be noise
        whole = np.concatenate([r - r.mean() for r in residuals])
        rms_deg = math.sqrt(float(whole @ whole) / whole.size)
        return NoiseFloor(rms_deg if known is None else known, known, local_known=False)
    return NoiseFloor(_rms(local), known)


def _rms(sizes: Sequence[tuple[float, int]]) -> float:
    """Root mean square of sizes, each of so many samples."""
    values, counts = zip(*sizes, strict=True)
    return math.sqrt(float(np.average(np.square(values), weights=counts)))


def repeatability_deg(records: Sequence[PreparedRecord], residuals: Sequence[Floats]) -> float | None:
    """Estimate the deviation from one cycle or trial to the next, deg.

    By :func:`hysteresis.records.metrics.repeatability_deg`.

    Parameters
    ----------
    residuals
        Of a model, which are flatter than the angle, so that trials at other loads compare better.

    Returns
    -------
    float or None
        Root mean square over the samples of records that have cycles or trials that repeat; None where none has.
    """
    known = list[tuple[float, int]]()
    for one, residual in zip(records, residuals, strict=True):
        if one.cycles_repeat and (size := metrics.repeatability_deg(_residual_record(one, residual))) is not None:
            known.append((math.hypot(max(size, one.rounding_deg), one.drive_step_deg), residual.size))
    return _rms(known) if known else None


def sensor_noise_deg(records: Sequence[PreparedRecord], residuals: Sequence[Floats]) -> float | None:
    """Estimate the noise with what neighbouring samples hide: a sensor's wander, ripple, outliers, correlated noise.

    It is what one cycle differs from the next, where the residual is no more than a few times the noise of neighbouring
    samples or where this is correlated: what does not repeat is no property of the rig. More is a rig that changes,
    such as after lost counts. Where no cycles repeat, it is the standard deviation of correlated noise alone.

    Returns
    -------
    float or None
        None where neither can be told.
    """
    floor, found = estimate_noise_floor(records, residuals), correlated_noise_deg(records, residuals)
    repeats, row = repeatability_deg(records, residuals), np.concatenate([r - r.mean() for r in residuals])
    rms_deg = math.sqrt(float(row @ row) / row.size)
    if found is not None and found > MOST_OF_RESIDUAL * rms_deg:
        found = None  # noise is no larger than the residual that it is a part of: that is structure
    if repeats is None:
        return found
    wanders = floor.local_known and rms_deg <= MOST_WANDER * floor.local_deg
    return repeats if wanders or found is not None else None


def correlated_noise_deg(records: Sequence[PreparedRecord], residuals: Sequence[Floats]) -> float | None:
    """Estimate correlated noise by the third differences of samples 1, 2, 4 and 8 apart, standard deviation in deg.

    Of noise with correlations c^k (first-order autoregression) their mean square is 20 times the variance times
    (1 - C)(1 - C/2 + C^2/10), C being c^j for samples j apart. That of white noise is the same for all j; that of a
    smooth function grows as j^6.

    Returns
    -------
    float or None
        None for noise that is white, or structure that is smooth.
    """
    sizes = np.array([_third_difference_deg(records, residuals, j) for j in DECIMATIONS])
    if not np.all(sizes > 0) or sizes[1] / sizes[0] < CORRELATED:
        return None
    if np.any(sizes[1:] / sizes[:-1] > MOST_CORRELATED):
        return None
    c = np.linspace(0.0, MOST_CORRELATION, 200)[:, None] ** np.array(DECIMATIONS)
    shape = np.sqrt((1 - c) * (1 - c / 2 + c**2 / 10))
    ratio = np.log(sizes / shape)
    best = int(np.argmin(np.var(ratio, axis=1)))
    return float(np.exp(np.mean(ratio[best])))


def counts_as(records: Sequence[PreparedRecord], measured: Sequence[Floats], noise_deg: float) -> float:
    """Degrees of the angle that one unit of a channel may count as, so that its noise counts as that of the angle.

    Effects that act on the angle alone would otherwise be lost in the noise of what was measured beside it.

    Parameters
    ----------
    measured
        Values of each record, shapes (m_i,).
    noise_deg
        That of the angle, by :func:`noise_of_angle`.

    Returns
    -------
    float
        Infinite where neighbouring samples do not tell the noise of the channel: differences of a smooth function grow
        with the distance of the samples.
    """
    noise, apart = neighbours_noise(records, measured), _third_difference_deg(records, measured, 2)
    if apart > MOST_CORRELATED * noise:
        return math.inf
    return noise_deg / noise if noise > 0 and noise_deg > 0 else math.inf


def noise_of_angle(records: Sequence[PreparedRecord]) -> float:
    """Estimate the noise of the measured angle, deg: at least the error of its digits and of the drive's steps.

    Of an angle in coarse digits most neighbours are equal.
    """
    least = max(max(one.rounding_deg, one.drive_step_deg) for one in records)
    return max(neighbours_noise(records, [one.angle_deg for one in records]), least)


def neighbours_noise(records: Sequence[PreparedRecord], measured: Sequence[Floats]) -> float:
    """Estimate the noise of measured values from the third differences of neighbours, in their unit.

    It is at least a part of the range that no sensor resolves; that also where all branches are short.
    """
    least = LEAST_NOISE * max(float(np.ptp(values)) for values in measured)
    return float(np.fmax(_third_difference_deg(records, measured, 1), least))


def _third_difference_deg(records: Sequence[PreparedRecord], residuals: Sequence[Floats], apart: int) -> float:
    """Median third difference of samples some apart along each branch, as the standard deviation of white noise."""
    found = [
        np.diff(residual[b][first::apart], 3)
        for one, residual in zip(records, residuals, strict=True)
        for b in one.branches
        for first in range(apart)
    ]
    row = np.concatenate(found)
    return MAD_TO_SIGMA * float(np.median(np.abs(row))) / math.sqrt(20) if row.size else math.nan


def _residual_record(one: PreparedRecord, residual: Floats) -> Record:
    return Record(drive=one.drive, angle_deg=residual, drive_unit=one.record.drive_unit, cycle=one.inputs.cycle)
