"""The path of the drive: branches between reversals, and cycles."""

from __future__ import annotations

from itertools import pairwise
from typing import TYPE_CHECKING

import numpy as np

from hysteresis.arrays import Floats, Ints
from hysteresis.files import RecordError

if TYPE_CHECKING:  # records have a loop width, which is measured with this
    from hysteresis.records.record import Record

_SAME_DRIVE = 0.05  # of the drive's range: two samples count as the same drive
_TAKES_HOLD = 0.1  # of the drive's range: a shorter stroke at the beginning is a drive that takes hold
_MOST_TO_AND_FRO = 3  # such strokes
NOISE_OF_SECOND_DIFFERENCES = 1.4826 / 6.0**0.5
"""Standard deviation of white noise over the median size of its second differences."""
_SAME_ANGLE = 0.02  # of the angle's range: two samples count as the same angle


def branches(drive: Floats, *, tolerance: float | None = None) -> list[slice]:
    """Divide the drive into monotonic branches between its reversals.

    A sample is a turning point if the drive then moves back by more than ``tolerance``, so that noise, quantisation
    and dwell are not reversals. Of equal extreme samples, the first one is the turning point.

    Parameters
    ----------
    drive
        Shape (m,).
    tolerance
        In the drive's unit; by default 2 % of its range, at least 1e-9.

    Returns
    -------
    list of slice
        They cover all samples in order; two neighbours share the turning point. One slice if there is no reversal.
    """
    if tolerance is None:
        tolerance = max(1e-9, 0.02 * float(np.ptp(drive)))
    reversals = [0]
    low = high = 0
    direction = 0  # of the present branch: +1 up, -1 down, 0 unknown
    values = drive.tolist()
    for i, x in enumerate(values):
        if x > values[high]:
            high = i
        if x < values[low]:
            low = i
        if direction >= 0 and values[high] - x > tolerance:
            reversal, direction, low = high, -1, i
        elif direction <= 0 and x - values[low] > tolerance:
            reversal, direction, high = low, 1, i
        else:
            continue
        reversals.append(reversal)
    # The first entry found is the start of the first branch, not a reversal. That branch starts at sample 0.
    ends = [0, *reversals[2:], len(values) - 1]
    return [slice(a, b + 1) for a, b in pairwise(ends)]


def turning_points(drive: Floats, *, noisy: bool = True) -> Ints:
    """Give the samples at which the drive turns by more than its noise: all that a law with a memory needs, shape (n,).

    Those of :func:`branches`, and those of strokes shorter than 2 % of the range, down to a thousandth of it or to
    eight times the noise, which second differences show. What is not ``noisy`` has none.
    """
    extent = float(np.ptp(drive))
    bends = np.abs(np.diff(drive, 2)) if noisy and drive.size > 2 else np.zeros(1)
    noise = NOISE_OF_SECOND_DIFFERENCES * float(np.median(bends))
    tolerance = min(0.02 * extent, max(1e-3 * extent, 8.0 * noise))
    return np.array([branch.stop - 1 for branch in branches(drive, tolerance=max(1e-9, tolerance))])


def first_stroke(drive: Floats) -> slice:
    """Give the first stroke of a record, which starts from an unknown state.

    Up to three strokes before it that are shorter than a tenth of the drive's range leave the state nearly as unknown:
    a motor that takes hold moves to and fro, and behind a play by more. More of them are a program.

    Parameters
    ----------
    drive
        Shape (m,).
    """
    every, least = branches(drive), _TAKES_HOLD * float(np.ptp(drive))
    begins = every[: _MOST_TO_AND_FRO + 1]
    return next((one for one in begins if abs(drive[one.stop - 1] - drive[one.start]) >= least), every[0])


def find_cycles(drive: Floats, angle_deg: Floats) -> Ints:
    """Find the cycles of a path from its reversals.

    A cycle extends from a turning point of one kind (both upper or both lower) to the next of that kind; the turning
    point belongs to the cycle that it ends. Cycle 0 is the approach, from the start to the first turning point (virgin
    branch); cycle 1 is the first one after it. An incomplete last cycle has its own number.

    There is no approach, and numbers start at 1, if the first cycle returns to its start: to the same drive (within
    5 % of its range) and the same angle (within 2 % of its range). The angle must agree as well, because a virgin
    branch from an extreme of the drive does not repeat. If an approach would leave no complete cycle, returning to the
    initial drive is enough: such a record is one loop, wherever it starts.

    Parameters
    ----------
    drive, angle_deg
        Shape (m,).

    Returns
    -------
    NDArray
        Shape (m,), whole numbers.
    """
    ends = [branch.stop - 1 for branch in branches(drive)]
    near = _SAME_DRIVE * np.ptp(drive)
    numbers = np.arange(len(drive))

    def same(i: int, j: int) -> bool:
        return bool(abs(drive[i] - drive[j]) <= near)

    if len(ends) == 1:
        return np.zeros(len(drive), dtype=np.int64)
    repeats = same(0, ends[1]) and abs(angle_deg[0] - angle_deg[ends[1]]) <= _SAME_ANGLE * np.ptp(angle_deg)
    complete_later = len(ends) > 3 or (len(ends) == 3 and same(ends[0], ends[2]))
    if repeats or (not complete_later and same(0, ends[1])):
        return np.searchsorted(ends[1::2], numbers) + 1
    if not complete_later and same(0, ends[-1]):
        return np.ones(len(drive), dtype=np.int64)
    return np.searchsorted(ends[0::2], numbers)


def cycle_index(record: Record) -> Ints:
    """Return the cycle of every sample, shape (m,): the record's own numbers, else those of :func:`find_cycles`.

    0 is the approach, which is not a cycle.
    """
    return record.cycle if record.cycle is not None else find_cycles(record.drive, record.angle_deg)


def cycle_slices(drive: Floats, cycle: Ints) -> list[tuple[int, slice]]:
    """Return the samples of each cycle in order, including the sample before it, at which the cycle starts.

    That sample is excluded if the drive was reset between two cycles (trials that only load): if it jumps by more than
    half its range from one number to the next.
    """
    starts = np.flatnonzero(np.diff(cycle)) + 1
    resets = set(_resets(drive, cycle).tolist())
    bounds = pairwise([0, *starts.tolist(), len(cycle)])
    return [(int(cycle[a]), slice(a if a == 0 or a in resets else a - 1, b)) for a, b in bounds]


def _resets(drive: Floats, cycle: Ints) -> Ints:
    jump = np.abs(np.diff(drive)) > 0.5 * np.ptp(drive)
    return np.flatnonzero(jump & (np.diff(cycle) != 0)) + 1


def moved_while_held(drive: Floats, angle_deg: Floats) -> float:
    """Give the part of the angle's travel that it makes while the drive stands still, 0 to 1.

    Of a drive that jumps from value to value, nearly all of it: such a record shows how late the angle follows, and its
    loop is none. Travel is between the first and the last sample at a value, so that noise counts little.
    """
    starts = np.r_[0, np.flatnonzero(np.diff(drive) != 0) + 1]
    ends = np.r_[starts[1:] - 1, drive.size - 1]
    held = float(np.abs(angle_deg[ends] - angle_deg[starts]).sum())
    moved = float(np.abs(angle_deg[starts[1:]] - angle_deg[ends[:-1]]).sum())
    return held / (held + moved) if held + moved > 0 else 0.0


def require_reversal(record: Record) -> None:
    """Raise unless the drive reverses at least once.

    A reset between two trials (see :func:`cycle_slices`) is not a reversal.

    Raises
    ------
    RecordError
        The drive is constant or monotonic.
    """
    resets = _resets(record.drive, cycle_index(record))
    tolerance = max(1e-9, 0.02 * float(np.ptp(record.drive)))
    if all(len(branches(trial, tolerance=tolerance)) == 1 for trial in np.split(record.drive, resets)):
        raise RecordError(
            f"{record.source or 'record'}: drive {record.drive_column!r} never reverses: "
            "expected a loop (there and back)"
        )
