"""Errors of each channel that was fitted: the angle, the notches, the tensions."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from hysteresis.arrays import Floats
from validation.tracing.fitting.fitted import Fitted, rms

ChannelTable = Mapping[str, Mapping[str, Any]]
"""By the channel's name: errors on held-out samples with the unit in their keys, then ``before`` and ``after``, each
with the same of ``train`` and ``heldout`` samples."""


def channel_table(before: Fitted, after: Fitted) -> ChannelTable:
    """Errors of every channel by the baseline and by the augmented model, the zero of each record taken out."""
    first, last = _by_channel(before), _by_channel(after)
    return {name: {**last[name]["heldout"], "before": first[name], "after": last[name]} for name in last}


def channel_words(channels: ChannelTable) -> list[str]:
    """One sentence with the held-out error of each channel beside the angle, before and after; none without any."""
    parts = []
    for name, own in channels.items():
        (key,) = (k for k in own if k.startswith("rmse_"))
        first, last = own["before"]["heldout"][key], own["after"]["heldout"][key]
        if name != "angle":
            change = f"{first:.3g} -> {last:.3g}" if own["before"] != own["after"] else f"{last:.3g}"
            parts.append(f"{name.replace('_', ' ')} {change} {key.removeprefix('rmse_')}")
    return [f"Fitted together with the angle, rms on held-out data: {', '.join(parts)}."] if parts else []


def _by_channel(fitted: Fitted) -> dict[str, dict[str, dict[str, float]]]:
    problem, masks = fitted.model.problem, fitted.holdout.train
    series: list[tuple[str, str, Sequence[Floats], Sequence[Floats]]] = [
        ("angle", "deg", problem.observed, fitted.errors)
    ]
    if fitted.channels is not None:
        count = len(masks)
        for k, channel in enumerate(problem.channels):
            own = fitted.channels.errors[k * count : (k + 1) * count]
            series.append((channel.name, channel.unit, channel.measured, [e / channel.weight for e in own]))
    out = {}
    for name, unit, measured, errors in series:
        parts = {"train": masks, "heldout": [~mask for mask in masks]}
        out[name] = {fold: _errors(unit, measured, errors, chosen) for fold, chosen in parts.items()}
    return out


def _errors(unit: str, measured: Sequence[Floats], errors: Sequence[Floats], chosen: Sequence[Any]) -> dict[str, float]:
    """Errors of the chosen samples as :class:`hysteresis.metrics.Errors` has them, in the channel's unit."""
    values = np.concatenate([m[c] for m, c in zip(measured, chosen, strict=True)])
    error = np.concatenate([e[c] for e, c in zip(errors, chosen, strict=True)])
    span, largest, mean = float(np.ptp(values)), float(np.abs(error).max()), rms(error)
    relative = {"max_rel_percent": 100 * largest / span, "normalised": mean / span} if span > 0 else {}
    return {f"rmse_{unit}": mean, f"max_abs_{unit}": largest, **relative}
