"""Energy that a wrist in space holds, compiled: what the work of the drives is booked against."""

from __future__ import annotations

from fem_models.spatial.kernels.compiled import spatial_njit
from fem_models.spatial.parameters import Memory, Parameters
from fem_models.spatial.tables import (
    BRISTLE,
    CONTACT,
    ELEMENTS,
    FREE,
    GIVE,
    LOOP,
    MOVED,
    PRELOAD,
    REST,
    SEGMENT,
    SLIPS,
    SPRING,
    THRUST,
    TOE,
)
from hysteresis.arrays import Floats


@spatial_njit()
def stored_energy(x: Floats, tension: Floats, rig: Parameters, memory: Memory) -> float:
    """Elastic energy of tendons, guides that stick and notches above that at rest, mJ, at an equilibrium.

    Weights are not in it. A slack tendon has given back what its preload had stored.
    """
    (n, m), own, total = memory.guides.shape, rig.joints, 0.0
    for j in range(m):
        free, toe, preload, here = rig.tendons[j, FREE], rig.tendons[j, TOE], rig.tendons[j, PRELOAD], tension[j, 0]
        total += (here**2 - preload**2 + 2.0 * toe * (here - preload)) / (2.0 * free)
        for k in range(n):
            total += (tension[j, k + 1] ** 2 - preload**2) / (2.0 * rig.crossings[k, j, SEGMENT])
            total += 0.5 * rig.crossings[k, j, BRISTLE] * (x[k, SLIPS + j] - memory.guides[k, j]) ** 2
    for k in range(n):
        for i in range(3):
            total += 0.5 * own[k, SPRING + i] * (x[k, i] - own[k, REST + i]) ** 2
            moved = x[k, MOVED + i]
            if own[k, GIVE + i] > 0.0:
                total += moved * (0.5 * moved / own[k, GIVE + i] - own[k, THRUST + i])
        for e in range(2 * ELEMENTS):
            total += 0.5 * own[k, LOOP + e] * (x[k, 1 + e // ELEMENTS] - memory.jenkins[k, e]) ** 2
        past = abs(x[k, 2]) - own[k, CONTACT]
        if past > 0.0 and (x[k, 2] > 0.0 or own[k, CONTACT + 2] == 1.0):
            total += 0.5 * own[k, CONTACT + 1] * past**2
    return total
