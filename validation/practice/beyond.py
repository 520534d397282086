"""What a change adds to records beyond the constants of their rig, and the size that gives a wanted amount.

For generators with constants of their own. Those of the package's own rigs have :mod:`validation.practice.size`.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence

import numpy as np
from scipy.optimize import lsq_linear

from hysteresis.arrays import Floats

LEAST_SIZE = 1e-4
"""Least size of an effect; 1 is the largest."""
TOLERANCE = 0.05
"""Relative deviation of a size from its target."""
_TRIALS = 24


def beyond(tangent: Floats, plain: Sequence[Floats], changed: Sequence[Floats], most: Floats | None = None) -> float:
    """Root mean square of a change beyond a tangent, in the unit of the records.

    Parameters
    ----------
    tangent
        Columns that take what they can of the change, shape (samples, k).
    most
        Largest multiple of each column that is taken, of either sign, shape (k,); by default there is none.
    """
    change = np.concatenate(changed) - np.concatenate(plain)
    norms = np.maximum(np.linalg.norm(tangent, axis=0), 1e-300)
    scaled = tangent / norms
    if most is None:
        taken = np.linalg.lstsq(scaled, change, rcond=1e-8)[0]
    else:
        taken = lsq_linear(scaled, change, (-most * norms, most * norms)).x
    left = change - scaled @ taken
    return float(np.sqrt(np.mean(left**2)))


def size_for(ratio: Callable[[float], float], at_largest: float, target: float) -> tuple[float, float] | None:
    """Size of an effect whose ratio is the target, and the ratio that it has; None out of reach.

    By the false position of the logarithms, in a bracket: sizes are nearly powers of each other.

    Parameters
    ----------
    ratio
        From a size, between :data:`LEAST_SIZE` and 1, to what it adds over the noise.
    at_largest
        That of the size 1.
    """
    if not at_largest >= target:
        return None
    at_high, low, high = at_largest, np.log(LEAST_SIZE), 0.0
    at_low = ratio(LEAST_SIZE)
    for trial in range(_TRIALS):
        part = 0.5
        if trial % 3 < 2 and 0.0 < at_low < target:
            part = float(np.clip(np.log(target / at_low) / np.log(at_high / at_low), 0.02, 0.98))
        middle = low + part * (high - low)
        now = ratio(float(np.exp(middle)))
        if abs(now / target - 1) < TOLERANCE:
            return float(np.exp(middle)), now
        if now < target:
            low, at_low = middle, now
        else:
            high, at_high = middle, now
    return None
