"""The curve that the loop of a record lies around: a thin loop is seen when this curve is taken from its angle.

Of the samples alone; :mod:`hysteresis.laws.backbone` has the curve f of a model, which is fitted together with a law.
"""

from __future__ import annotations

import numpy as np

from hysteresis.arrays import Floats, Mask
from hysteresis.records.path import branches, cycle_index
from hysteresis.records.record import Record

_BIN = 0.01  # of the drive's range: closer samples of one direction are averaged
_FULL = 0.95  # of the drive's range: cycles that are as wide give the curve, inner loops do not
_THIN = 0.15  # of the angle's range: a loop this wide can be read without help


def backbone_of(record: Record) -> Floats | None:
    """Compute the middle between the rising and the falling branches of the full cycles of a record.

    Returns
    -------
    Floats or None
        The curve at the drives of the record, shape (m,), deg; None if the drive does not go there and back.
    """
    span = float(np.ptp(record.drive))
    if span == 0:
        return None
    cycle = cycle_index(record)
    full = [n for n in np.unique(cycle) if n > 0 and np.ptp(record.drive[cycle == n]) >= _FULL * span]
    used: Mask = np.isin(cycle, full) if full else np.ones(cycle.size, dtype=bool)
    ends = record.drive[used].min() + _BIN * span, record.drive[used].max() - _BIN * span
    rising, falling = np.zeros((2, used.size), dtype=bool)
    for part in branches(record.drive):
        first, last = record.drive[part.start], record.drive[part.stop - 1]
        if used[part][1:].any():
            at_end = not ends[0] < first < ends[1]  # there the turning point is of both directions
            (rising if last > first else falling)[part.start + (0 if at_end else 1) : part.stop] = True
    if not rising.any() or not falling.any():
        return None
    up, down = _curve(record, rising, span), _curve(record, falling, span)
    both = np.clip(record.drive, max(up[0][0], down[0][0]), min(up[0][-1], down[0][-1]))
    middle = 0.5 * (np.interp(both, *up) + np.interp(both, *down))
    # where only one direction has samples, the curve goes on as that one does; the other stays at its end
    return middle + sum(np.interp(record.drive, *one) - np.interp(both, *one) for one in (up, down))


def is_thin(record: Record, backbone: Floats) -> bool:
    """Tell whether the loop around a backbone, shape (m,), deg, looks like a line at the scale of the angle."""
    return bool(np.ptp(record.angle_deg - backbone) < _THIN * np.ptp(record.angle_deg))


def _curve(record: Record, samples: Mask, span: float) -> tuple[Floats, Floats]:
    """Average some samples where they are close; return drives, increasing, and angles, shape (k,) each."""
    drive, angle = record.drive[samples], record.angle_deg[samples]
    _, place, count = np.unique(np.round(drive / (_BIN * span)), return_inverse=True, return_counts=True)
    return np.bincount(place, drive) / count, np.bincount(place, angle) / count
