"""The tendon between wheel and base as linear springs that only pull, for codes without a toe region."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from fem_models.rig.rig import Tendon
from fem_models.rig.tendon_law import tendon_stretch_mm
from hysteresis.arrays import Floats

PIECES = 32
"""Springs of a tendon with a toe region: its tension is then within 0.25 % where the range is 1 to 50."""
MARGIN = 2.0
"""Range of the springs beyond the tensions of the loop, as a factor on either side."""


class Springs(NamedTuple):
    """Parallel springs, shape (k,) each: the tension is the sum of stiffness * max(0, stretch - start)."""

    stiffness_N_per_mm: Floats
    start_mm: Floats

    def tension_N(self, stretch_mm: Floats) -> Floats:
        """Tension at stretches against the preloaded state, any shape."""
        beyond = np.maximum(np.asarray(stretch_mm)[..., None] - self.start_mm, 0.0)
        return np.asarray(beyond @ self.stiffness_N_per_mm)


def springs(tendon: Tendon, preload_N: float, lowest_N: float, highest_N: float) -> Springs:
    """Write the tension of a tendon between wheel and base as a sum of springs.

    The law of :func:`fem_models.rig.tendon_law.tendon_stretch_mm` is convex, so a sum of springs that only pull is
    exact at the knots between them, which are even in the logarithm of the tension. Beyond the highest knot the tendon
    is linear, and below the lowest its tension falls to zero along a line.

    Parameters
    ----------
    lowest_N, highest_N
        Tensions of the loop that the springs have to cover.
    """
    stiffness = tendon.EA_N / tendon.free_length_mm
    if tendon.toe_N == 0:
        return Springs(np.array([stiffness]), np.array([-preload_N / stiffness]))
    low = max(min(lowest_N, preload_N), 1e-3 * preload_N) / MARGIN
    high = max(highest_N, preload_N) * MARGIN
    tension = np.geomspace(low, high, PIECES)
    stretch = tendon_stretch_mm(tendon, tension, preload_N, 0.0)
    chords = np.diff(tension) / np.diff(stretch)
    slopes = np.concatenate([chords, [stiffness * high / (high + tendon.toe_N)]])
    start = np.concatenate([[stretch[0] - tension[0] / slopes[0]], stretch[1:]])
    return Springs(np.diff(slopes, prepend=0.0), start)
