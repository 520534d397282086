"""What records hold beside the angle, and a known rig gives, too: notch angles, tensions, the place of the tip."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from fem_models.rig import Rig
from validation.tracing.fitting.noise import counts_as, noise_of_angle
from validation.tracing.prepared import TIP, Channel, PreparedRecord, channel_unit, channel_values


def channels_of(records: Sequence[PreparedRecord], rigs: Sequence[Rig]) -> tuple[tuple[Channel, ...], tuple[str, ...]]:
    """Channels that all records have and their rigs give, and a word for each that is left out.

    A notch counts as the angle does, degree by degree: errors of the notches add up to that of the tip. A tension
    counts by its range, as the angle does by its own; the place of the tip by the larger of its two ranges. None counts
    by so much that its noise is more than that of the angle.
    """
    values = [channel_values(one.record) for one in records]
    reach = max(float(np.ptp(one.angle_deg)) for one in records)
    noise_deg = noise_of_angle(records)
    out, words = list[Channel](), list[str]()
    notches = max(sum(name.startswith("notch") for name in own) for own in values)
    if notches and any(rig.joints != notches for rig in rigs):
        words.append(f"notch angles are not fitted: the records have {notches}, the rig has {rigs[0].joints} joints")
    for name in dict.fromkeys(name for own in values for name in own):
        is_notch = name.startswith("notch")
        if (is_notch and words) or (name.startswith("tension") and records[0].record.drive_unit == "N"):
            continue  # the tension is the drive itself
        if reason := _left_out(name, values, rigs):
            words.append(f"{name} is not fitted: {reason}")
            continue
        measured = tuple(own[name][one.kept] for own, one in zip(values, records, strict=True))
        together = TIP if name in TIP else (name,)
        span = max(float(np.ptp(own[one])) for own in values for one in together)
        if span > 0 and any(np.ptp(row) > 0 for row in measured):
            weight = min(1.0 if is_notch else reach / span, counts_as(records, measured, noise_deg))
            out.append(Channel(name, channel_unit(name), weight, measured))
    return tuple(out), tuple(dict.fromkeys(words))


def _left_out(name: str, values: Sequence[dict[str, np.ndarray]], rigs: Sequence[Rig]) -> str:
    """Give the reason why a channel is no part of the fit; empty where it is."""
    if any(name not in own for own in values):
        return "not all records have it"
    if name == "tension_b" and any(rig.tendon_b is None for rig in rigs):
        return "the rig has one tendon"
    return ""
