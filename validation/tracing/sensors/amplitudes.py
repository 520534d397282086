"""Amplitudes of new records against those of their reference: a model that is fitted to some says little of others.

Play operators that are fitted to one amplitude are off at another, by what no record tells: of a rig that had not
changed, half the amplitude had a delay named, or stiffening. Between two amplitudes of the reference they hold.
"""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import numpy as np

from hysteresis.records.path import cycle_index, cycle_slices
from hysteresis.records.record import Record
from validation.tracing.settings import SAME_PROTOCOL

OTHER_AMPLITUDE = "every new record is beyond the amplitudes of the reference"
"""Word of a trace that cannot say whether the rig has changed."""


def cycle_amplitudes(record: Record) -> list[float]:
    """Half the range of the drive in each cycle, those of the whole record where there is none; in the drive's unit."""
    drive = record.drive
    cycles = [drive[s] for number, s in cycle_slices(drive, cycle_index(record)) if number != 0]
    return [float(np.ptp(one)) / 2 for one in cycles or [drive]]


def beyond_reference(records: Sequence[Record], reference: Sequence[Record]) -> list[Record]:
    """Find the records whose median cycle is larger than all cycles of a reference, or smaller than all."""
    low, high = _range(reference)
    low, high = (1 - SAME_PROTOCOL) * low, (1 + SAME_PROTOCOL) * high
    return [one for one in records if not low <= _median(one) <= high]


def amplitude_words(records: Sequence[Record], reference: Sequence[Record]) -> list[str]:
    """Say which new records are beyond the amplitudes of the reference; :data:`OTHER_AMPLITUDE` first if all are."""
    beyond, (low, high) = beyond_reference(records, reference), _range(reference)
    own = f"{low:.3g}" if high <= (1 + SAME_PROTOCOL) * low else f"{low:.3g} to {high:.3g}"
    words = [
        f"{Path(one.source).name or 'a record'}: the reference has no amplitude of {_median(one):.3g} {one.drive_unit} "
        f"(its own: {own}): what differs may be of the amplitude and no change; record the reference at this one, too"
        for one in beyond
    ]
    return [OTHER_AMPLITUDE, *words] if beyond and len(beyond) == len(records) else words


def _range(reference: Sequence[Record]) -> tuple[float, float]:
    known = [own for one in reference for own in cycle_amplitudes(one)]
    return min(known), max(known)


def _median(record: Record) -> float:
    return float(np.median(cycle_amplitudes(record)))
