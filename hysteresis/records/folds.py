"""Folds within the training samples, which choose the law of h; the held-out samples take no part."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from hysteresis.arrays import Floats, Mask
from hysteresis.records.holdout import Split, complete_cycles
from hysteresis.records.path import branches, cycle_index
from hysteresis.records.record import Record

_MOST_FOLDS = 4
_PARTS = 10  # of the drive's range, as in hysteresis.records.holdout
_BLOCKS = (((4, 9), (0, 5)), ((0, 5), (2, 7)), ((2, 7), (4, 9)), ((3, 8), (1, 6)))
"""Tenths on rising and on falling branches, four folds; in each, one of the branches covers every drive."""
_FIRST_STROKE = 0.05  # of the angle's range: how far a first stroke that differs lies outside the later loops
_FEWEST = 3  # samples of a fold


def inner_folds(record: Record, outer: Split) -> tuple[Split, ...]:
    """Divide the training samples into folds, in the way in which the held-out samples are taken.

    Of three or more complete cycles, each cycle after the first is predicted from those before it, as the held-out
    cycles are; of two, each is predicted from the other; of one, blocks. The model follows the whole path; only the
    angles are hidden.
    """
    labels = cycle_index(record)
    numbers = [n for n in complete_cycles(record) if outer.train[labels == n].any()]
    if len(numbers) >= 3:
        pairs = [(outer.train & (labels < n), outer.train & (labels == n)) for n in numbers[1:][-_MOST_FOLDS:]]
        by = f"{len(pairs)} folds, each a cycle predicted from those before it"
    elif len(numbers) == 2:
        pairs = [(outer.train & (labels != n), outer.train & (labels == n)) for n in numbers]
        by = "2 folds, each a cycle predicted from the other"
    else:
        pairs = [(outer.train & ~mask, outer.train & mask) for mask in _block_masks(record.drive)]
        by = f"{len(pairs)} folds of blocks of a tenth of the drive's range"
    return tuple(Split(train, mask, by) for train, mask in pairs if mask.sum() >= _FEWEST)


def _block_masks(drive: Floats) -> list[Mask]:
    part = np.minimum((_PARTS * (drive - drive.min()) / np.ptp(drive)).astype(int), _PARTS - 1)
    masks = [np.zeros(len(drive), dtype=bool) for _ in _BLOCKS]
    for branch in branches(drive):
        up = drive[branch.stop - 1] >= drive[branch.start]
        for mask, (rising, falling) in zip(masks, _BLOCKS, strict=True):
            mask[branch] = np.isin(part[branch], rising if up else falling)
    return masks


def without_first_stroke(record: Record, split: Split) -> tuple[Split, str | None]:
    """Leave the approach out of training if it differs from what follows; also return a word on that.

    A law with memory starts on a path inside its later loops. An approach that leaves the band of later angles at
    the same drive by more than 5 % of the angle's range is virgin loading, or slack that is taken up once: no law here
    has it. The path still runs through it. Only angles of training samples are looked at.
    """
    labels = cycle_index(record)
    first, later = labels == 0, labels > 0
    if not first.any() or not (split.train & later).any() or len(branches(record.drive[first])) > 1:
        return split, None
    excess = _excess(record, first & split.train, later & split.train)
    span = float(np.ptp(record.angle_deg[split.train]))
    if excess <= _FIRST_STROKE * span or (split.train & later).sum() < 0.3 * split.train.sum():
        return split, None
    word = (
        f"the first stroke is left out: it lies up to {excess:.3g} deg outside the later loops at the same drive "
        "(virgin loading, or slack that is taken up once)"
    )
    return replace(split, train=split.train & later), word


def _excess(record: Record, first: Mask, later: Mask) -> float:
    """Measure how far the angles of the first stroke lie outside the band of the later ones at the same drive, deg."""
    drive, angle = record.drive, record.angle_deg
    part = np.minimum((50 * (drive - drive.min()) / np.ptp(drive)).astype(int), 49)
    largest = 0.0
    for i in np.unique(part[first]):
        band = angle[later & (np.abs(part - i) <= 1)]
        if band.size:
            mine = np.median(angle[first & (part == i)])
            largest = max(largest, float(mine - band.max()), float(band.min() - mine))
    return largest
