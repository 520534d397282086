"""What records of a rig in space hold beside the angles, and the chain in space gives: tensions, place of the tip."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import numpy as np

from fem_models.spatial import SpatialSolution
from hysteresis.arrays import Floats
from hysteresis.records.record import Record
from validation.tracing.effect import SpaceForm, Values
from validation.tracing.fitting.noise import counts_as, noise_of_angle
from validation.tracing.prepared import TIP_IN_SPACE, Channel, PreparedRecord, channel_unit

TENSIONS = ("tension_a", "tension_b", "tension_c", "tension_d")


def channels_in_space(records: Sequence[Record], angles: Sequence[PreparedRecord], tendons: int) -> tuple[Channel, ...]:
    """Channels that all records have, at the samples of the first angle of each; ``angles`` are all angles of all.

    ``tendons`` is the number of tendons that all rigs have.

    Tensions count by the largest range of all tensions, as the angles do by the largest of theirs, and the place of the
    tip by the largest of its three ranges: that of a wheel that stands still has hardly more than noise. None counts by
    so much that its noise is more than that of the angles.
    """
    values, first = [_measured(one) for one in records], angles[:: len(angles) // len(records)]
    reach = max(float(np.ptp(one.angle_deg)) for one in angles)
    noise_deg, out = noise_of_angle(angles), list[Channel]()
    for name in (*TENSIONS[:tendons], *TIP_IN_SPACE):
        if any(name not in own for own in values):
            continue
        together = TIP_IN_SPACE if name in TIP_IN_SPACE else TENSIONS
        span = max(float(np.ptp(own[one])) for own in values for one in together if one in own)
        measured = tuple(own[name][one.kept] for own, one in zip(values, first, strict=True))
        if any(np.ptp(row) > 0 for row in measured):
            weight = min(reach / span, counts_as(first, measured, noise_deg))
            out.append(Channel(name, channel_unit(name), weight, measured))
    return tuple(out)


def _measured(record: Record) -> dict[str, Floats]:
    tensions = {name: getattr(record, f"{name}_N") for name in TENSIONS}
    out = {name: values for name, values in tensions.items() if values is not None}
    tip = () if record.tip_mm is None else record.tip_mm.T
    return out | dict(zip(TIP_IN_SPACE, tip, strict=False))


def in_space(solved: SpatialSolution, added: Sequence[tuple[SpaceForm, Values]]) -> dict[str, Floats]:
    """Give the values of all channels in a run, shapes (m,); the sensor of the angles reads the tip, too."""
    across = solved.tip_mm[:, 1:]
    for form, values in added:
        across = across if form.sensor is None else form.sensor(across, values)
    tip = (solved.tip_mm[:, 0], *across.T)
    return dict(zip(TENSIONS, solved.tensions_N[:, :, 0].T, strict=False)) | dict(zip(TIP_IN_SPACE, tip, strict=True))


def left_out(records: Sequence[Record], channels: Sequence[Channel]) -> tuple[str, ...]:
    """Say which columns of the records are not fitted."""
    fitted = {one.name for one in channels}
    there = [name for name in (*TENSIONS, *TIP_IN_SPACE) if any(name in _measured(one) for one in records)]
    names = [name for name in there if name not in fitted]
    names += ["the notch angles"] if any(one.notches_deg is not None for one in records) else []
    files = ", ".join(dict.fromkeys(Path(one.source).name for one in records if one.source))
    return (f"not fitted for a rig in space: {', '.join(names)} of {files or 'the records'}",) if names else ()
