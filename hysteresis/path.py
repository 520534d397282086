"""The path of the drive: branches between reversals, whole cycles, and whether there is a loop at all."""

from __future__ import annotations

from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from hysteresis.record import Record, RecordError

_SAME_DRIVE = 0.05  # of the drive's range: two samples at the same place of the path
_SAME_ANGLE = 0.02  # of the angle's range


def branches(drive: NDArray[np.float64], *, tolerance: float | None = None) -> list[slice]:
    """Monotonic runs of the drive between its reversals.

    A sample is a turning point once the drive has come back from it by more than ``tolerance``, so that noise,
    quantisation and dwell make no reversal. Of equal extreme samples the first one turns.

    Parameters
    ----------
    drive
        Shape (m,).
    tolerance
        In the drive's unit; by default 2 % of its range, at least 1e-9.

    Returns
    -------
    list of slice
        They cover all samples in order; two neighbours share the turning sample. One slice without a reversal.
    """
    if tolerance is None:
        tolerance = max(1e-9, 0.02 * float(np.ptp(drive)))
    turns = [0]
    low = high = 0
    direction = 0  # of the present branch: +1 up, -1 down, 0 not known yet
    values = drive.tolist()
    for i, x in enumerate(values):
        if x > values[high]:
            high = i
        if x < values[low]:
            low = i
        if direction >= 0 and values[high] - x > tolerance:
            turn, direction, low = high, -1, i
        elif direction <= 0 and x - values[low] > tolerance:
            turn, direction, high = low, 1, i
        else:
            continue
        turns.append(turn)
    # The first entry found is where the first branch starts, not a reversal: that branch starts at sample 0.
    turns = [0, *turns[2:], len(values) - 1]
    return [slice(a, b + 1) for a, b in pairwise(turns)]


def find_cycles(drive: NDArray[np.float64], angle_deg: NDArray[np.float64]) -> NDArray[np.int64]:
    """Find the cycles of a path from its reversals.

    A cycle goes from a turning point of one kind (both upper or both lower) to the next of that kind; the turning
    sample belongs to the cycle that it ends. 0 is the way from the start to the first turning point (virgin or
    approach branch), 1 the first cycle after it; an incomplete last cycle has its own number.

    There is no approach, and numbers start at 1, where the first cycle comes back to its start: to the same drive
    (within 5 % of its range) and the same angle (within 2 % of its range). The angle has to agree, too, because a
    virgin branch from an extreme of the drive does not repeat. Where an approach would leave no complete cycle,
    coming back to the drive at the start is enough: such a record is one loop, wherever it starts.

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


def cycle_index(record: Record) -> NDArray[np.int64]:
    """Cycle of every sample, shape (m,): the record's own numbers, or else those of :func:`find_cycles`.

    0 is the approach, which is no cycle.
    """
    return record.cycle if record.cycle is not None else find_cycles(record.drive, record.angle_deg)


def cycle_slices(drive: NDArray[np.float64], cycle: NDArray[np.int64]) -> list[tuple[int, slice]]:
    """Give the samples of each cycle in order, with the sample before it, where the cycle starts.

    That sample is left out where the drive was reset between two cycles (trials that only load): where it jumps
    by more than half its range from one number to the next.
    """
    starts = np.flatnonzero(np.diff(cycle)) + 1
    resets = set(_resets(drive, cycle).tolist())
    bounds = pairwise([0, *starts.tolist(), len(cycle)])
    return [(int(cycle[a]), slice(a if a == 0 or a in resets else a - 1, b)) for a, b in bounds]


def _resets(drive: NDArray[np.float64], cycle: NDArray[np.int64]) -> NDArray[np.int64]:
    jump = np.abs(np.diff(drive)) > 0.5 * np.ptp(drive)
    return np.flatnonzero(jump & (np.diff(cycle) != 0)) + 1


def require_reversal(record: Record) -> None:
    """Raise unless the drive goes there and back at least once.

    A reset between two trials (see :func:`cycle_slices`) is no way back.

    Raises
    ------
    RecordError
        The drive stands still or goes one way only.
    """
    resets = _resets(record.drive, cycle_index(record))
    tolerance = max(1e-9, 0.02 * float(np.ptp(record.drive)))
    if all(len(branches(trial, tolerance=tolerance)) == 1 for trial in np.split(record.drive, resets)):
        raise RecordError(
            f"{record.source or 'record'}: drive {record.drive_column!r} never reverses: "
            "expected a loop (there and back)"
        )
