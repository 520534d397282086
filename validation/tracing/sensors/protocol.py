"""Amplitudes and rates of new records against those of their reference: a model fitted to some says little of others.

Play operators that are fitted to one amplitude are off at another, by what no record tells: of a rig that had not
changed, half the amplitude had a delay named, or stiffening. Between two amplitudes of the reference they hold. They
know no rate at all, and friction does: of surgical tools that had not changed, a record at one rate against a reference
at one other rate had a late tendon or a play named. Between two rates of the reference none had.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from pathlib import Path

import numpy as np

from hysteresis.records.path import branches, cycle_index, cycle_slices
from hysteresis.records.record import Record
from validation.tracing.settings import SAME_PROTOCOL

OTHER_AMPLITUDE = "every new record is beyond the amplitudes of the reference"
"""Word of a trace that cannot say whether the rig has changed."""
OTHER_RATE = "every new record is beyond the rates of the reference"
"""Word of a trace in which a change must explain more than what a rate makes."""
_OF_CYCLE = 0.25
"""Part of the drive's range that a stroke of a cycle has at least."""


def cycle_amplitudes(record: Record) -> list[float]:
    """Half the range of the drive in each cycle, those of the whole record where there is none; in the drive's unit."""
    drive = record.drive
    cycles = [drive[s] for number, s in cycle_slices(drive, cycle_index(record)) if number != 0]
    return [float(np.ptp(one)) / 2 for one in cycles or [drive]]


def cycle_rates(record: Record) -> list[float]:
    """Rate of each whole cycle, Hz, from one turning point of the drive to the next but one; none without times.

    Small strokes are no cycles: a motor that takes hold moves to and fro. A record of fewer turning points than three
    has the rate of its longest stroke.
    """
    if record.time_s is None:
        return []
    ends = [one.stop - 1 for one in branches(record.drive, tolerance=_OF_CYCLE * float(np.ptp(record.drive)))]
    turns = record.time_s[ends[:-1]]  # the record ends anywhere
    periods = turns[2:] - turns[:-2]
    if not periods.size:
        periods = 2 * np.diff(record.time_s[[0, *ends]]).max(keepdims=True)
    return [float(1 / period) for period in periods if period > 0]


def amplitude_words(records: Sequence[Record], reference: Sequence[Record]) -> list[str]:
    """Say which new records are beyond the amplitudes of the reference; :data:`OTHER_AMPLITUDE` first if all are."""
    unit = records[0].drive_unit
    return _words(cycle_amplitudes, "amplitude", unit, OTHER_AMPLITUDE, records, reference)


def rate_words(records: Sequence[Record], reference: Sequence[Record]) -> list[str]:
    """Say which new records are beyond the rates of the reference; :data:`OTHER_RATE` first if all are."""
    return _words(cycle_rates, "rate", "Hz", OTHER_RATE, records, reference)


def _words(
    of_cycles: Callable[[Record], list[float]],
    quantity: str,
    unit: str,
    of_all: str,
    records: Sequence[Record],
    reference: Sequence[Record],
) -> list[str]:
    """Say which records have a median cycle that is larger than all of a reference, or smaller than all."""
    known = [own for one in reference for own in of_cycles(one)]
    if not known:
        return []
    low, high = min(known), max(known)
    own = f"{low:.3g}" if high <= (1 + SAME_PROTOCOL) * low else f"{low:.3g} to {high:.3g}"
    medians = [(one, float(np.median(cycles))) for one in records if (cycles := of_cycles(one))]
    beyond = [
        f"{Path(one.source).name or 'a record'}: the reference has no {quantity} of {median:.3g} {unit} (its own: "
        f"{own}): what differs may be of the {quantity} and no change; record the reference at this one, too"
        for one, median in medians
        if not (1 - SAME_PROTOCOL) * low <= median <= (1 + SAME_PROTOCOL) * high
    ]
    return [of_all, *beyond] if beyond and len(beyond) == len(records) else beyond
