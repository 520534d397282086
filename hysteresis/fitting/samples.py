"""Samples of one or several records in one row, with the mask of those that a fit may use."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from hysteresis.arrays import Floats, Ints, Mask
from hysteresis.records.path import branches, cycle_index, turning_points
from hysteresis.records.record import Record

_ENOUGH_CYCLES = 8  # training cycles from which a bootstrap draws whole cycles; below, pieces of branches
_PIECES = 5  # of a branch


@dataclass(frozen=True, eq=False)
class Samples:
    """Data of a fit. The path visits every drive; only the angles of the training mask ``train`` count. Shapes (m,).

    Records follow one another; ``starts`` are their first samples. ``time_s`` and ``history``, the times and drives of
    each complete record, are present if the drive may act with a delay. ``blocks`` numbers the blocks that a bootstrap
    draws. ``turns`` are the samples at which the drive turns, which stay when others are left out.
    """

    drive: Floats
    angle_deg: Floats
    train: Mask
    starts: tuple[int, ...] = (0,)
    time_s: Floats | None = None
    history: tuple[tuple[Floats, Floats], ...] = ()
    blocks: Ints | None = None
    turns: Mask | None = None

    def slices(self) -> list[slice]:
        """Return the samples of each record."""
        return [slice(a, b) for a, b in zip(self.starts, (*self.starts[1:], len(self.drive)), strict=True)]

    def drives(self, delay_s: float = 0.0) -> list[Floats]:
        """Return the drive of each record, ``delay_s`` earlier."""
        if delay_s == 0.0 or self.time_s is None:
            return [self.drive[part] for part in self.slices()]
        pairs = zip(self.slices(), self.history, strict=True)
        return [np.interp(self.time_s[part] - delay_s, *history) for part, history in pairs]

    def train_drives(self) -> list[Floats]:
        """Return the drive of the training samples of each record."""
        return [self.drive[part][self.train[part]] for part in self.slices()]

    def span_deg(self) -> float:
        """Return the range of the training angles."""
        return float(np.ptp(self.angle_deg[self.train]))

    def thinned(self, limit: int) -> Samples:
        """Keep about ``limit`` evenly spaced samples and all reversals; none after a record's last training sample.

        The law is rate independent, so samples between reversals may be left out of its path.
        """
        ends = [part.start + int(np.flatnonzero(self.train[part])[-1]) + 1 for part in self.slices()]
        every = max(1, math.ceil(sum(ends[i] - start for i, start in enumerate(self.starts)) / limit))
        keep = np.zeros(len(self.drive), dtype=bool)
        for start, end in zip(self.starts, ends, strict=True):
            keep[start:end:every] = True
            keep[[start, end - 1]] = True
        if self.turns is not None:
            keep |= self.turns & (np.arange(keep.size) < np.repeat(ends, np.diff([*self.starts, keep.size])))
        starts = tuple(int(keep[:start].sum()) for start in self.starts)
        time = None if self.time_s is None else self.time_s[keep]
        blocks = None if self.blocks is None else self.blocks[keep]
        turns = None if self.turns is None else self.turns[keep]
        few = self.drive[keep], self.angle_deg[keep], self.train[keep]
        return Samples(*few, starts, time, self.history, blocks, turns)


def join(records: Sequence[Record], train: Sequence[Mask], *, timed: bool = False) -> Samples:
    """Join records into the samples of one fit.

    Parameters
    ----------
    records
        One after the other.
    train
        Training mask of each record, shapes (m_i,).
    timed
        Whether the samples keep their times, for a delay; all records then have times.
    """
    starts = np.cumsum([0, *(len(r.drive) for r in records)])[:-1]
    times = [r.time_s for r in records if r.time_s is not None] if timed else []
    return Samples(
        np.concatenate([r.drive for r in records]),
        np.concatenate([r.angle_deg for r in records]),
        np.concatenate(list(train)),
        tuple(int(start) for start in starts),
        np.concatenate(times) if times else None,
        tuple((time, r.drive) for time, r in zip(times, records, strict=True)) if times else (),
        _blocks(records, train),
        np.concatenate([_turns(record) for record in records]),
    )


def _turns(record: Record) -> Mask:
    """Mark the samples at which the drive turns; of a record that was thinned, all of them: it kept no others."""
    out = np.zeros(record.drive.size, dtype=bool)
    out[turning_points(record.drive, noisy=not record.left_out)] = True
    return out


def _blocks(records: Sequence[Record], train: Sequence[Mask]) -> Ints:
    """Assign samples to bootstrap blocks: cycles if the training part has enough of them, else fifths of branches."""
    cycles = [cycle_index(record) for record in records]
    if sum(len(np.unique(c[mask])) for c, mask in zip(cycles, train, strict=True)) < _ENOUGH_CYCLES:
        cycles = [np.zeros_like(c) for c in cycles]
        for record, numbers in zip(records, cycles, strict=True):
            for i, branch in enumerate(branches(record.drive)):
                size = branch.stop - branch.start
                numbers[branch] = _PIECES * i + np.arange(size) * _PIECES // size
    firsts = np.cumsum([0, *(int(numbers.max()) + 1 for numbers in cycles)])[:-1]
    return np.concatenate([numbers + first for numbers, first in zip(cycles, firsts, strict=True)])
