"""Training samples and held-out samples of several records: a change of protocol is held out where records allow it."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from pathlib import Path

import numpy as np

from hysteresis.arrays import Floats, Mask
from hysteresis.records.holdout import hold_out
from validation.tracing.prepared import PreparedRecord
from validation.tracing.settings import KNOWN_BEGINNING, SAME_PROTOCOL


@dataclass(frozen=True, eq=False)
class Holdout:
    """Training masks of all records, shapes (m_i,), and by what rule the other samples are held out.

    The angle of every record has an unknown offset (its zero), which is taken out of the errors. So has each channel of
    a record; errors of channels follow those of the angle, record by record. ``with_channels`` are the records that
    channels belong to: all of them, unless each angle of a run stands as a record. ``whole`` are the records that are
    held out as a whole, but for their beginning; so is a record without any training sample. The last ``reference`` of
    them are a reference: they are fitted, and no error of what is traced.
    """

    train: tuple[Mask, ...]
    by: str
    with_channels: tuple[int, ...] | None = None
    whole: frozenset[int] = frozenset()
    reference: int = 0

    @property
    def traced(self) -> slice:
        """The records that are traced."""
        return slice(len(self.train) - self.reference)

    @cached_property
    def train_mask(self) -> Mask:
        """Training mask of all records in one row, shape (m,)."""
        return np.concatenate(self.train)

    def record_of(self, series: int) -> int:
        """Record of a series: the angles of all records come first, then each channel of its records."""
        count = len(self.train)
        owners = range(count) if self.with_channels is None else self.with_channels
        return series if series < count else owners[(series - count) % len(owners)]

    def series_masks(self, channels: int) -> list[Mask]:
        """Training masks of all series, with so many channels."""
        owners = len(self.train if self.with_channels is None else self.with_channels)
        return [self.train[self.record_of(i)] for i in range(len(self.train) + channels * owners)]

    def is_held_out(self, i: int) -> bool:
        """Whether a record is held out as a whole, but for its beginning."""
        return i in self.whole or not self.train[i].any()

    def offset_deg(self, i: int, error_deg: Floats) -> float:
        """Offset of a record: the mean error of its training samples, or of all samples of a held-out record."""
        return float(error_deg[slice(None) if self.is_held_out(i) else self.train[i]].mean())

    def without_offsets(self, errors: Sequence[Floats]) -> list[Floats]:
        """Errors of each record less its offset, and so those of each channel."""
        return [e - self.offset_deg(self.record_of(i), e) for i, e in enumerate(errors)]

    def stacked(self, errors: Sequence[Floats]) -> Floats:
        """Errors of all records less their offsets in one row, shape (m,); then those of the channels."""
        return np.concatenate(self.without_offsets(errors))

    def everything(self) -> Holdout:
        """Put all samples of the same records into the training set."""
        return replace(self, train=tuple(np.ones_like(mask) for mask in self.train), whole=frozenset())


@dataclass(frozen=True)
class Protocol:
    """How a record was driven: preload (N), half the drive's range, cycles per second; NaN where unknown."""

    preload_N: float
    amplitude: float
    rate_Hz: float


def protocol(one: PreparedRecord) -> Protocol:
    """Protocol of a record."""
    time_s, cycle = one.inputs.time_s, one.inputs.cycle
    cycles, seconds = np.unique(cycle[cycle > 0]).size, float(time_s[-1] - time_s[0])
    rate = max(cycles, 1) / seconds if one.inputs.timed else float("nan")
    return Protocol(one.preload_N, float(np.ptp(one.record.drive)) / 2, rate)


def divide_records(records: Sequence[PreparedRecord], *, own_preload: bool = True) -> Holdout:
    """Divide records into training samples and held-out samples.

    Of three records or more, the one is held out whose protocol the others cover best: they have its preload and its
    rate, so that only its amplitude is new, or as little else as possible. Of one or two records the last cycles are
    held out, or blocks of the path where there is a single cycle. Trials under a tendon force count as cycles.

    Parameters
    ----------
    own_preload
        Whether a record may be held out whose preload no other record has. Without, such records are divided within
        themselves.

    Raises
    ------
    RecordError
        Too few samples for either part.
    """
    protocols = [protocol(one) for one in records]
    out = _most_covered(protocols)
    preloads = [p.preload_N for p in protocols]
    alone = not any(_same(preloads[out], other) for i, other in enumerate(preloads) if i != out)
    if len(records) >= 3 and (own_preload or not alone):
        name = Path(records[out].record.source).name or f"record {out + 1}"
        masks = tuple(
            np.ones(one.kept.size, dtype=bool)
            if i != out
            else np.arange(one.kept.size) < KNOWN_BEGINNING * one.kept.size
            for i, one in enumerate(records)
        )
        beginning = f"its first {100 * KNOWN_BEGINNING:.0f} % (its initial state) and its offset are fitted"
        others = [p for i, p in enumerate(protocols) if i != out]
        repeats = any(_same_protocol(protocols[out], other) for other in others)
        how = "whose protocol others have, too" if repeats else "whose protocol differs from those fitted"
        by = f"{name}, {how}; {beginning}"
        return Holdout(masks, by, whole=frozenset({out}))
    parts = [_within(one) for one in records]
    return Holdout(tuple(mask for mask, _ in parts), "; ".join(dict.fromkeys(by for _, by in parts)))


def _within(one: PreparedRecord) -> tuple[Mask, str]:
    if one.record.drive_unit == "N":
        trials = np.unique(one.inputs.cycle)
        if trials.size >= 2:
            first = trials[-max(1, trials.size // 3)]
            return one.inputs.cycle < first, f"trials from {first} on"
    split = hold_out(one.record)
    return split.train[one.kept], split.by


def _most_covered(protocols: Sequence[Protocol]) -> int:
    """Index of the record that the others cover best; the smallest amplitude among equals, then the last."""

    def cost(i: int) -> tuple[int, float, int]:
        new = _is_new(protocols, i, "preload_N") + _is_new(protocols, i, "rate_Hz")
        return new, protocols[i].amplitude, -i

    return min(range(len(protocols)), key=cost)


def _is_new(protocols: Sequence[Protocol], i: int, name: str) -> bool:
    own = getattr(protocols[i], name)
    return not any(_same(own, getattr(p, name)) for j, p in enumerate(protocols) if j != i)


def _same_protocol(a: Protocol, b: Protocol) -> bool:
    return _same(a.preload_N, b.preload_N) and _same(a.amplitude, b.amplitude) and _same(a.rate_Hz, b.rate_Hz)


def _same(a: float, b: float) -> bool:
    return bool((np.isnan(a) and np.isnan(b)) or abs(a - b) <= SAME_PROTOCOL * max(abs(a), abs(b)))
