"""Errors of each channel that was fitted: the angle, the notches, the tensions."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any, NamedTuple

import numpy as np

from hysteresis.arrays import Floats
from validation.tracing.fitting.fitted import Fitted, rms

_MOST_NOTCHES = 6  # of which each has its figure in a sentence

ChannelTable = Mapping[str, Mapping[str, Any]]
"""By the channel's name: errors on held-out samples with the unit in their keys, then ``before`` and ``after``, each
with the same of ``train`` and ``heldout`` samples."""


def channel_table(before: Fitted, after: Fitted) -> ChannelTable:
    """Errors of every channel by the baseline and by the augmented model, the zero of each record taken out."""
    first, last = _by_channel(before), _by_channel(after)
    return {name: {**last[name]["heldout"], "before": first[name], "after": last[name]} for name in last}


class ChannelFit(NamedTuple):
    """A channel that was fitted by itself, as if it were the angle: its name, its unit, and the fit."""

    name: str
    unit: str
    fitted: Fitted


def with_channel_fits(table: ChannelTable, fits: Sequence[ChannelFit]) -> ChannelTable:
    """Add channels that were fitted by themselves; effects are not added to them."""
    own = {one.name: _by_channel(one.fitted, one.unit)["angle"] for one in fits}
    return {**table, **{name: {**e["heldout"], "before": e, "after": e} for name, e in own.items()}}


def channel_words(channels: ChannelTable) -> list[str]:
    """One sentence with the held-out error of each channel beside the angle, before and after; none without any."""
    notches = {name: own for name, own in channels.items() if name.startswith("notch_")}
    others = {name: own for name, own in channels.items() if name not in ("angle", *notches)}
    if len(notches) > _MOST_NOTCHES:
        parts = [_change(f"{len(notches)} notches", list(notches.values()))]
    else:
        parts = [_change(name.replace("_", " "), [own]) for name, own in notches.items()]
    parts += [_change(name.replace("_", " "), [own]) for name, own in others.items()]
    return [f"Beside the angle, rms on held-out data: {', '.join(parts)}."] if parts else []


def _change(name: str, channels: Sequence[Mapping[str, Any]]) -> str:
    """Held-out error of a channel before and after, or the range over several of one unit."""
    (key,) = (k for k in channels[0] if k.startswith("rmse_"))
    first, last = (_range([own[when]["heldout"][key] for own in channels]) for when in ("before", "after"))
    change = f"{first} -> {last}" if any(own["before"] != own["after"] for own in channels) else last
    return f"{name} {change} {key.removeprefix('rmse_')}"


def _range(values: Sequence[float]) -> str:
    low, high = min(values), max(values)
    return f"{high:.3g}" if len(values) == 1 else f"{low:.3g} to {high:.3g}"


def _by_channel(fitted: Fitted, unit: str = "deg") -> dict[str, dict[str, dict[str, float | None]]]:
    problem, masks = fitted.model.problem, fitted.holdout.train
    series: list[tuple[str, str, Sequence[Floats], Sequence[Floats]]] = [
        ("angle", unit, problem.observed, fitted.errors)
    ]
    if fitted.channels is not None:
        at = 0
        for channel in problem.channels:
            own = fitted.channels.errors[at : at + len(channel.measured)]
            at += len(own)
            series.append((channel.name, channel.unit, channel.measured, [e / channel.weight for e in own]))
    out, owners = {}, [fitted.holdout.record_of(len(masks) + i) for i in range(len(series[-1][2]))]
    for name, unit, measured, errors in series:
        fitted_on = masks if name == "angle" else [masks[i] for i in owners]
        unseen, outside = errors, [~mask for mask in fitted_on]
        if name == "angle" and fitted.fold_errors is not None:
            unseen, outside = fitted.fold_errors, [~np.isnan(error) for error in fitted.fold_errors]
        out[name] = {
            "train": _errors(unit, measured, errors, fitted_on),
            "heldout": _errors(unit, measured, unseen, outside),
        }
    return out


def _errors(
    unit: str, measured: Sequence[Floats], errors: Sequence[Floats], chosen: Sequence[Any]
) -> dict[str, float | None]:
    """Errors of the chosen samples as :class:`hysteresis.records.metrics.Errors` has them, in the channel's unit.

    Those relative to the range are None for a channel that stands still.
    """
    values = np.concatenate([m[c] for m, c in zip(measured, chosen, strict=True)])
    error = np.concatenate([e[c] for e, c in zip(errors, chosen, strict=True)])
    span, largest, mean = float(np.ptp(values)), float(np.abs(error).max()), rms(error)
    percent, normalised = (100 * largest / span, mean / span) if span > 0 else (None, None)
    return {f"rmse_{unit}": mean, f"max_abs_{unit}": largest, "max_rel_percent": percent, "normalised": normalised}
