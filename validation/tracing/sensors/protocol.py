"""Amplitudes and rates of new records against those of their reference: a model fitted to some says little of others.

Play operators that are fitted to one amplitude are off at another, by what no record shows. Between two amplitudes of
the reference they hold. They know no rate at all, and friction does, so that an unchanged rig at another rate may look
changed; between two rates of the reference it does not (``docs/validation/measured-traces.md``).
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from itertools import pairwise
from pathlib import Path

import numpy as np

from hysteresis.arrays import Floats
from hysteresis.records.path import branches, cycle_index, cycle_slices, first_stroke
from hysteresis.records.record import Record
from validation.tracing.settings import SAME_PROTOCOL

OTHER_AMPLITUDE = "every new record is beyond the amplitudes of the reference"
"""Word of a trace that cannot say whether the rig has changed."""
OTHER_RATE = "every new record is beyond the rates of the reference"
"""Word of a trace in which a change must explain more than what a rate makes."""
NOT_AS_RECORDED = "no effect was looked for: the records are not as their rig can have made them"
"""Word of a trace that ends before its search."""
_STILL, _RESTS = 1e-3, 0.25
"""Part of a stroke by which a drive that rests at its end may move; part of its time from which it does rest."""


def cycle_amplitudes(record: Record) -> list[float]:
    """Half the range of the drive in each cycle, those of the whole record where there is none; in the drive's unit."""
    drive = record.drive
    cycles = [drive[s] for number, s in cycle_slices(drive, cycle_index(record)) if number != 0]
    return [float(np.ptp(one)) / 2 for one in cycles or [drive]]


def cycle_rates(record: Record) -> list[float]:
    """Rate of each whole cycle, two strokes that follow each other without what the drive rests between them, Hz.

    None without times. The first stroke does not count, nor the small ones of a motor that takes hold before it, nor
    the last one, which may be a part; of one or two strokes the longer one does.
    """
    if record.time_s is None:
        return []
    drive, time = record.drive, record.time_s
    every = branches(drive)
    whole = [one for one in every[:-1] if one.start > first_stroke(drive).start]
    if len(whole) < 2:
        whole = 2 * [max(every, key=lambda one: abs(drive[one.stop - 1] - drive[one.start]))]
    taken = [_without_rest(time[one], drive[one]) for one in whole]
    return [float(1 / (a + b)) for a, b in pairwise(taken) if a + b > 0]


def _without_rest(time: Floats, drive: Floats) -> float:
    """Time of a stroke, s, but for what the drive rests at its ends; a sine, which is slow there, does not rest."""
    near = _STILL * abs(float(drive[-1] - drive[0]))
    left = int(np.argmax(np.abs(drive - drive[0]) > near))
    reached = int(np.argmax(np.abs(drive - drive[-1]) <= near))
    whole, moving = float(time[-1] - time[0]), float(time[reached] - time[max(left - 1, 0)])
    return moving if moving < (1 - _RESTS) * whole else whole


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
    """Say which records have a median cycle that is larger than all of a reference, or smaller than all.

    Nothing where a record of the reference does not tell its own.
    """
    of_each = [of_cycles(one) for one in reference]
    if not all(of_each):
        return []
    known = [own for cycles in of_each for own in cycles]
    low, high = min(known), max(known)
    own = f"{low:.3g}" if high <= (1 + SAME_PROTOCOL) * low else f"{low:.3g} to {high:.3g}"
    medians = [(one, float(np.median(cycles))) for one in records if (cycles := of_cycles(one))]
    beyond = [
        f"{Path(one.source).name or 'a record'}: the reference has no {quantity} of {median:.3g} {unit} (its own: "
        f"{own}): what differs may be of the {quantity} and no change; record the reference at this one, too"
        for one, median in medians
        if not (1 - SAME_PROTOCOL) * low <= median <= (1 + SAME_PROTOCOL) * high
    ]
    return [of_all, *beyond] if beyond and len(beyond) == len(medians) else beyond
