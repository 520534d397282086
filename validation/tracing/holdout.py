"""What of several records is fitted, and what is held out: a shift of protocol where the records allow one."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from hysteresis.arrays import Mask
from hysteresis.holdout import hold_out
from validation.tracing.fitting import Holdout
from validation.tracing.prepared import PreparedRecord

_START = 0.05  # of a record held out: where it comes from is no secret
_SAME = 0.1  # protocols are the same within this part of their size


@dataclass(frozen=True)
class Protocol:
    """How a record was driven: preload (N), half the drive's range, cycles per second; NaN where unknown."""

    preload_N: float
    amplitude: float
    rate_Hz: float


def protocol(one: PreparedRecord) -> Protocol:
    """Read the protocol off a record."""
    time_s, cycle = one.inputs.time_s, one.inputs.cycle
    cycles, seconds = np.unique(cycle[cycle > 0]).size, float(time_s[-1] - time_s[0])
    rate = max(cycles, 1) / seconds if one.inputs.timed else float("nan")
    return Protocol(one.preload_N, float(np.ptp(one.record.drive)) / 2, rate)


def divide_records(records: Sequence[PreparedRecord], *, own_preload: bool = True) -> Holdout:
    """Divide records into what is fitted and what is held out.

    Of three records or more the one is held out whose protocol the others cover best: its preload and rate are among
    theirs, so that only its amplitude, or what is left of them, is new. Of one or two records the last cycles, or
    blocks where there is one cycle; trials that only load are cycles.

    Parameters
    ----------
    own_preload
        Whether a record may be held out whose preload no other one has: a model in which the preload does not act, but
        is fitted to, has nothing to say of it, and is held out within records then.

    Raises
    ------
    RecordError
        Too few samples for either part.
    """
    protocols = [protocol(one) for one in records]
    out = _most_covered(protocols)
    loads = [p.preload_N for p in protocols]
    alone = not any(_alike(loads[out], load) for i, load in enumerate(loads) if i != out)
    if len(records) >= 3 and (own_preload or not alone):
        name = Path(records[out].record.source).name or f"record {out + 1}"
        masks = tuple(
            np.ones(one.kept.size, dtype=bool) if i != out else np.arange(one.kept.size) < _START * one.kept.size
            for i, one in enumerate(records)
        )
        begins = f"its first {100 * _START:.0f} %, which tell the state it starts in, and its zero are its own"
        return Holdout(masks, f"{name}, another protocol than those fitted; {begins}")
    parts = [_within(one) for one in records]
    return Holdout(tuple(mask for mask, _ in parts), "; ".join(dict.fromkeys(by for _, by in parts)))


def _within(one: PreparedRecord) -> tuple[Mask, str]:
    if one.record.drive_unit == "N":
        trials = np.unique(one.inputs.cycle)
        if trials.size >= 2:
            last = trials[-max(1, trials.size // 3)]
            return one.inputs.cycle < last, f"trials from {last} on"
    split = hold_out(one.record)
    return split.train[one.kept], split.by


def _most_covered(protocols: Sequence[Protocol]) -> int:
    """Index of the record that the others cover best; the smallest amplitude among equals, then the last."""

    def new(i: int, name: str) -> int:
        mine = getattr(protocols[i], name)
        others = [getattr(p, name) for j, p in enumerate(protocols) if j != i]
        return int(not any(_alike(mine, other) for other in others))

    def cost(i: int) -> tuple[int, int, float, int]:
        lost = 2 * new(i, "preload_N") + 2 * new(i, "rate_Hz")
        largest = int(protocols[i].amplitude >= max(p.amplitude for p in protocols) * (1 - _SAME))
        alone = sum(_alike(protocols[i].amplitude, p.amplitude) for p in protocols) == 1
        return (lost, int(largest and alone), protocols[i].amplitude, -i)

    return min(range(len(protocols)), key=cost)


def _alike(a: float, b: float) -> bool:
    return bool((np.isnan(a) and np.isnan(b)) or abs(a - b) <= _SAME * max(abs(a), abs(b)))
