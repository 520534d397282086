"""What members say of friction, elasticity and material: shares of the loop at 20 N, and constants."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np

from validation.measured.ensemble.predict import predicted_shares
from validation.measured.readings.mechanisms import rig_of
from validation.separation.ensemble import Range, range_of


def share_ranges(members: Sequence[Mapping[str, float]]) -> dict[str, Range]:
    """90 % ranges of the shares of energy and width over members; play dissipates nothing."""
    found = predicted_shares([rig_of(one).rig for one in members], threads=1)
    return {name: range_of(values) for name, values in found.items() if name != "play, share of energy"}


def constant_ranges(members: Sequence[Mapping[str, float]]) -> dict[str, Range]:
    """90 % ranges of the constants that vary."""
    out = {name: np.array([one[name] for one in members]) for name in members[0]}
    return {name: range_of(values) for name, values in out.items() if np.ptp(values) > 0}


def evenly(members: Sequence[Mapping[str, float]], count: int) -> list[Mapping[str, float]]:
    """Take ``count`` of the members, evenly spaced, or all if there are fewer."""
    if len(members) <= count:
        return list(members)
    return [members[k] for k in np.linspace(0, len(members) - 1, count).astype(int)]
