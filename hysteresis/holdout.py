"""Which samples a fit may see, and which it is judged by."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from hysteresis.arrays import Mask
from hysteresis.path import branches, cycle_index, cycle_slices
from hysteresis.record import Record, RecordError

_PARTS = 10  # blocks are tenths of the drive's range, on each branch
_FEWEST_TRAIN, _FEWEST_HELD = 20, 3


@dataclass(frozen=True)
class Split:
    """Two masks over the samples of a record, shape (m,), and the words for the second.

    A model is always run along the whole path: only the angles of ``heldout`` are hidden from the fit.
    """

    train: Mask
    heldout: Mask
    by: str


def hold_out(record: Record) -> Split:
    """Hold out the last third of the whole cycles (at least one) and what follows them.

    A record of a single cycle has tenths of the drive's range held out, two on the rising and two others on the
    falling branches, so that each place is still seen on one of them.

    Raises
    ------
    RecordError
        Too few samples for either part.
    """
    everything = np.ones(len(record.drive), dtype=bool)
    whole = _whole_cycles(record)
    if len(whole) >= 2:
        return _last_cycles(record, everything, whole[-max(1, len(whole) // 3)])
    return _blocks(record, everything, rising=(1, 6), falling=(3, 8))


def validate_within(record: Record, outer: Split) -> Split:
    """Split the training samples again, to choose the form of a model without a look at what is held out.

    The last whole training cycle where there are two or more, else blocks at other places than those of
    :func:`hold_out`.
    """
    labels = cycle_index(record)
    whole = [number for number in _whole_cycles(record) if outer.train[labels == number].all()]
    if len(whole) >= 2:
        return _last_cycles(record, outer.train, whole[-1])
    return _blocks(record, outer.train, rising=(4, 9), falling=(0, 5))


def _whole_cycles(record: Record) -> list[int]:
    """Numbers of the cycles that go there and at least half the way back."""
    whole = []
    for number, part in cycle_slices(record.drive, cycle_index(record)):
        drive = record.drive[part]
        back = abs(drive[-1] - drive[0]) <= 0.5 * np.ptp(drive)
        if number >= 1 and len(branches(drive)) >= 2 and back:
            whole.append(number)
    return whole


def _last_cycles(record: Record, among: Mask, first: int) -> Split:
    labels = cycle_index(record)
    held = among & (labels >= first)
    last = int(labels[held].max())
    cycles = f"cycle {first}" if last == first else f"cycles {first} to {last}"
    by = f"{cycles}, predicted by running the path on from the start of the record"
    return _checked(record, Split(among & ~held, held, by))


def _blocks(record: Record, among: Mask, rising: tuple[int, ...], falling: tuple[int, ...]) -> Split:
    drive = record.drive
    part = np.minimum((_PARTS * (drive - drive.min()) / np.ptp(drive)).astype(int), _PARTS - 1)
    held = np.zeros(len(drive), dtype=bool)
    for branch in branches(drive):
        up = drive[branch.stop - 1] >= drive[branch.start]
        held[branch] = np.isin(part[branch], rising if up else falling)

    def words(parts: tuple[int, ...]) -> str:
        return " and ".join(str(i + 1) for i in parts)

    by = (
        f"blocks of a tenth of the drive's range, {words(rising)} on rising and {words(falling)} on falling "
        "branches; the path runs through them, their angles are hidden"
    )
    return _checked(record, Split(among & ~held, among & held, by))


def _checked(record: Record, split: Split) -> Split:
    train, held = int(split.train.sum()), int(split.heldout.sum())
    if train < _FEWEST_TRAIN or held < _FEWEST_HELD:
        raise RecordError(
            f"{record.source or 'record'}: {train} samples to fit and {held} to hold out: "
            f"expected at least {_FEWEST_TRAIN} and {_FEWEST_HELD}"
        )
    return split
