"""Records and fits of the tracer that tests make by hand."""

from types import SimpleNamespace

import numpy as np

from hysteresis.records.record import Record
from validation.tracing.fitting.fitted import ChannelErrors, Fitted
from validation.tracing.fitting.holdout import Holdout
from validation.tracing.prepared import prepared


def one_record(samples=40, cycles=1, **more):
    """A record of triangles from 0 to 1 and back, so many samples a cycle."""
    k = np.arange(samples * cycles)
    drive = 1 - np.abs((k % samples) / (samples / 2) - 1)
    return prepared(Record(drive=drive, angle_deg=10 * drive + 0.01 * (k % 3), cycle=1 + k // samples, **more), k)


def made(errors, *, channels=None, train=None, branch_counts=None, size=2, **more):
    """A fit of given errors, one array a record, and of given errors of a tension."""
    rows = tuple(np.asarray(e, dtype=float) for e in errors)
    counts = branch_counts or [1] * len(rows)
    records = [SimpleNamespace(branch_count=n) for n in counts]
    tension = () if channels is None else (SimpleNamespace(name="tension", measured=channels),)
    model = SimpleNamespace(problem=SimpleNamespace(records=records, channels=tension), names=())
    masks = tuple(np.ones(e.size, dtype=bool) for e in rows) if train is None else train
    total = sum(e.size for e in rows)
    own = None
    if channels is not None:
        own = ChannelErrors(tuple(np.asarray(e, dtype=float) for e in channels), np.full((total, size), 3.0))
    return Fitted(model, Holdout(masks, "n"), np.zeros(size), rows, np.ones((total, size)), 1, own, **more)
