"""Energy that a wrist in space holds, compiled: what the work of the drives is booked against."""

from __future__ import annotations

from fem_models.spatial.compiled import spatial_njit
from fem_models.spatial.joint import Joints
from fem_models.spatial.parameters import Memory, Parameters
from hysteresis.arrays import Floats


@spatial_njit()
def stored_energy(x: Floats, rig: Parameters, memory: Memory, joints: Joints) -> float:
    """Elastic energy of tendons, guides that stick and notches above that at rest, mJ, at an equilibrium.

    Weights are not in it. A slack tendon has given back what its preload had stored.
    """
    n, m = rig.bristle.shape
    total = 0.0
    for j in range(m):
        tension, preload = joints.tension[j, 0], rig.preload[j]
        total += (tension**2 - preload**2 + 2.0 * rig.toe[j] * (tension - preload)) / (2.0 * rig.free[j])
        for k in range(n):
            tension = joints.tension[j, k + 1]
            total += (tension**2 - preload**2) / (2.0 * rig.segment[k, j])
            total += 0.5 * rig.bristle[k, j] * (x[k, 6 + j] - memory.guides[k, j]) ** 2
    for k in range(n):
        for i in range(3):
            total += 0.5 * rig.spring[k, i] * (x[k, i] - rig.rest[k, i]) ** 2
            if rig.give[k, i] > 0.0:
                total += x[k, 3 + i] * (0.5 * x[k, 3 + i] / rig.give[k, i] - rig.thrust[k, i])
        for axis in range(2):
            for e in range(rig.loop.shape[2]):
                total += 0.5 * rig.loop[k, axis, e] * (x[k, 1 + axis] - memory.jenkins[k, axis, e]) ** 2
        past = abs(x[k, 2]) - rig.contact[k, 0]
        if past > 0.0 and (x[k, 2] > 0.0 or rig.contact[k, 2] == 1.0):
            total += 0.5 * rig.contact[k, 1] * past**2
    return total
