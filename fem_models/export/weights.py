"""Dead loads of a rig as masses in one gravity."""

from __future__ import annotations

import math
from typing import NamedTuple

from fem_models.joint.contact import ring_weight_N, tip_force_N
from fem_models.rig import Rig

STANDARD_GRAVITY = 9.80665  # m/s^2
PARALLEL = 1e-9


class Weights(NamedTuple):
    """Gravity along the straight tube and across it, m/s^2, and the masses that have the rig's weights in it, kg."""

    gravity: tuple[float, float]
    ring_kg: float
    tip_kg: float
    lost_tip_N: float  # of a load on the tip in another direction than the weight of the rings


def dead_weights(rig: Rig) -> Weights:
    """Give the weight of the rings, and the load and the mass at the tip, as masses; one direction can be kept."""
    ring, tip = ring_weight_N(rig), tip_force_N(rig)
    ring_N, tip_N = math.hypot(*ring), math.hypot(*tip)
    if ring_N == tip_N == 0.0:
        return Weights((0.0, 0.0), 0.0, 0.0, 0.0)
    main, size = (ring, ring_N) if ring_N > 0 else (tip, tip_N)
    x, y = main[0] / size, main[1] / size
    along = tip[0] * x + tip[1] * y
    lost = tip_N - along > PARALLEL * tip_N
    gravity = (STANDARD_GRAVITY * x, STANDARD_GRAVITY * y)
    return Weights(gravity, ring_N / STANDARD_GRAVITY, 0.0 if lost else tip_N / STANDARD_GRAVITY, lost * tip_N)
