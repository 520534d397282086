"""Training and held-out samples of a record."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from hysteresis.arrays import Mask
from hysteresis.records.path import branches, cycle_index, cycle_slices
from hysteresis.records.record import Record, RecordError

_PARTS = 10  # blocks are tenths of the drive's range, on each branch
_FEWEST_TRAIN, _FEWEST_HELDOUT = 20, 3


@dataclass(frozen=True)
class Split:
    """Training and held-out masks over the samples of a record, shape (m,), and a description of the second.

    A model always runs along the whole path; the fit does not use the angles of ``heldout``.
    """

    train: Mask
    heldout: Mask
    by: str

    def only(self, read: Mask) -> Split:
        """Leave samples that are no readings of the angle out of both parts, shape (m,)."""
        return self if read.all() else Split(self.train & read, self.heldout & read, self.by)


def hold_out(record: Record) -> Split:
    """Hold out the last third of the complete cycles (at least one) and the samples after them.

    In a record of a single cycle, tenths of the drive's range are held out: two on the rising and two others on the
    falling branches, so that one of the branches covers every drive.

    Raises
    ------
    RecordError
        Too few samples for either part.
    """
    everything = np.ones(len(record.drive), dtype=bool)
    complete = complete_cycles(record)
    if len(complete) >= 2:
        return _last_cycles(record, everything, complete[-max(1, len(complete) // 3)])
    return _blocks(record, everything, rising=(1, 6), falling=(3, 8))


def validate_within(record: Record, outer: Split) -> Split:
    """Split the training samples into a training and a validation fold, to choose the form of a model.

    The validation fold (``heldout`` of the result) is the last complete training cycle if there are two or more, else
    blocks at other drives than those of :func:`hold_out`.
    """
    labels = cycle_index(record)
    complete = [number for number in complete_cycles(record) if _is_of_training(outer, labels == number)]
    if len(complete) >= 2:
        return _last_cycles(record, outer.train, complete[-1])
    return _blocks(record, outer.train, rising=(4, 9), falling=(0, 5))


def _is_of_training(split: Split, cycle: Mask) -> bool:
    """Whether no sample of a cycle is held out: some may be no readings."""
    return bool(split.train[cycle].any() and not split.heldout[cycle].any())


def complete_cycles(record: Record) -> list[int]:
    """Return the numbers of the cycles whose drive reverses and returns at least half-way."""
    complete = []
    for number, part in cycle_slices(record.drive, cycle_index(record)):
        drive = record.drive[part]
        back = abs(drive[-1] - drive[0]) <= 0.5 * np.ptp(drive)
        if number >= 1 and len(branches(drive)) >= 2 and back:
            complete.append(number)
    return complete


def _last_cycles(record: Record, among: Mask, first: int) -> Split:
    labels = cycle_index(record)
    heldout = among & (labels >= first)
    last = int(labels[heldout].max())
    cycles = f"cycle {first}" if last == first else f"cycles {first} to {last}"
    by = f"{cycles}, predicted by continuing the path from the start of the record"
    return _checked(record, Split(among & ~heldout, heldout, by))


def _blocks(record: Record, among: Mask, rising: tuple[int, ...], falling: tuple[int, ...]) -> Split:
    drive = record.drive
    part = np.minimum((_PARTS * (drive - drive.min()) / np.ptp(drive)).astype(int), _PARTS - 1)
    heldout = np.zeros(len(drive), dtype=bool)
    for branch in branches(drive):
        up = drive[branch.stop - 1] >= drive[branch.start]
        heldout[branch] = np.isin(part[branch], rising if up else falling)

    def numbers(parts: tuple[int, ...]) -> str:
        return " and ".join(str(i + 1) for i in parts)

    by = (
        f"blocks of a tenth of the drive's range, {numbers(rising)} on rising and {numbers(falling)} on falling "
        "branches; the model follows the whole path, the angles in the blocks are held out"
    )
    return _checked(record, Split(among & ~heldout, among & heldout, by))


def _checked(record: Record, split: Split) -> Split:
    train, heldout = int(split.train.sum()), int(split.heldout.sum())
    if train < _FEWEST_TRAIN or heldout < _FEWEST_HELDOUT:
        raise RecordError(
            f"{record.source or 'record'}: {train} samples to fit and {heldout} to hold out: "
            f"expected at least {_FEWEST_TRAIN} and {_FEWEST_HELDOUT}"
        )
    return split
