"""Branch tables: the drive for an angle on the rising and on the falling branch of the settled loop over all drives."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from hysteresis.arrays import Floats
from studies.commands.compensation import Layer

ROWS = 129
_FINE = 4001
_LOOPS = 20  # until the state at a turning point no longer depends on the first one, also far from saturation


@dataclass(frozen=True, eq=False)
class Branches:
    """Drives at angles, shapes (ROWS,), on the branch on which the angle rises, and on that on which it falls."""

    angle_deg: Floats
    rising: Floats
    falling: Floats


def branches(layer: Layer, rows: int = ROWS) -> Branches:
    """Tabulate the settled loop over all drives of the records."""
    low, high = layer.drive_range
    up = np.linspace(low, high, _FINE)
    loop = np.concatenate([up, up[-2:0:-1]])
    path = np.concatenate([np.linspace(layer.first_drive, low, _FINE)[:-1], *[loop] * _LOOPS, up])
    f = layer.f(path)
    angle = f + sum(element.along(f) for element in layer.elements)
    onward, back = angle[-_FINE:], angle[-2 * _FINE + 1 : -_FINE + 1]
    forward, backward = (up, onward), (up[::-1], back)
    if f[-1] < f[-_FINE]:  # the angle falls where the drive rises
        forward, backward = backward, forward
    rising, falling = _last_to_reach(*forward, 1.0), _last_to_reach(*backward, -1.0)
    ends = max(rising[1][0], falling[1][0]), min(rising[1][-1], falling[1][-1])
    places = np.linspace(*ends, rows)
    return Branches(places, np.interp(places, rising[1], rising[0]), np.interp(places, falling[1], falling[0]))


def _last_to_reach(drive: Floats, angle: Floats, sign: float) -> tuple[Floats, Floats]:
    """Give drives by rising angle; where the angle first moves against f after a reversal, the later drive counts."""
    onward = np.minimum.accumulate((sign * angle)[::-1])[::-1]
    return (drive, onward) if sign > 0 else (drive[::-1], -onward[::-1])
