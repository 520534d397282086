"""Sine, cosine and hyperbolic tangent of small numbers, row by row: as exact as the library's, a few joints at a time.

Joints turn by some degrees, and tendons wrap little at a guide. For such arguments short series reach the rounding of
the numbers; a compiler does four at a time, where a call of the library takes one. Larger arguments go to the library.
"""

from __future__ import annotations

import math

from fem_models.chain.compiled import chain_njit
from hysteresis.arrays import Floats

SMALL = 0.3
"""Up to here the first term left out is below 1e-16 of the value."""


@chain_njit(forceinline=True)
def small_sine(z: float) -> float:
    """Taylor's series of the sine to the 11th power."""
    s = z * z
    return z + z * s * (-1 / 6 + s * (1 / 120 + s * (-1 / 5040 + s * (1 / 362880 - s / 39916800))))


@chain_njit(forceinline=True)
def small_cosine(z: float) -> float:
    """Taylor's series of the cosine to the 12th power."""
    s = z * z
    return 1.0 + s * (-1 / 2 + s * (1 / 24 + s * (-1 / 720 + s * (1 / 40320 + s * (-1 / 3628800 + s / 479001600)))))


@chain_njit(forceinline=True)
def small_tanh(z: float) -> float:
    """Lambert's continued fraction of the hyperbolic tangent, z/(1 + z^2/(3 + z^2/(5 + ...))), to the 11."""
    s = z * z
    above = 10395.0 + s * (1260.0 + 21.0 * s)
    return z * above / (10395.0 + s * (4725.0 + s * (210.0 + s)))


@chain_njit(forceinline=True)
def half_turns(angle: Floats, steepest: float, sine: Floats, cosine: Floats) -> None:
    """Fill sine and cosine of half of angles up to ``steepest``, shapes (N,)."""
    if 0.5 * steepest <= SMALL:
        for i in range(angle.size):
            sine[i], cosine[i] = small_sine(0.5 * angle[i]), small_cosine(0.5 * angle[i])
    else:
        for i in range(angle.size):
            sine[i], cosine[i] = math.sin(0.5 * angle[i]), math.cos(0.5 * angle[i])


@chain_njit(forceinline=True)
def friction_ratios(angle: Floats, steepest: float, capstan: float, rest_wrap: float, ratio: Floats) -> None:
    """Fill the ratio of each guide's friction to the sum of its tensions, tanh(mu wrap/2), shapes (N,).

    A tendon turns at a guide by half the angles of the joints before and beyond it, at the base by ``rest_wrap`` more.
    """
    if capstan == 0.0:
        ratio[:] = 0.0
        return
    before = 2.0 * rest_wrap
    if 0.5 * capstan * (steepest + rest_wrap) <= SMALL:
        for i in range(angle.size):
            here = abs(angle[i])
            ratio[i] = small_tanh(0.25 * capstan * (here + before))
            before = here
    else:
        for i in range(angle.size):
            here = abs(angle[i])
            ratio[i] = math.tanh(0.25 * capstan * (here + before))
            before = here


@chain_njit(allocates=True)  # called from Python
def tip_reach(angles: Floats, rings: Floats, aside: Floats, turning: Floats, tip: Floats) -> None:
    """Fill how far rings and notches reach from joint 1 to the middle of the last ring, shape (m, 2).

    ``angles`` has shape (m, N). A notch, as long as ``turning``, shape (N,), lies along the mean of the headings before
    and beyond it, a ring of the length in ``rings`` along its own; headings are turned on from joint to joint. Across a
    ring it goes by ``aside`` to the neutral axis of the next notch, and the tip counts from its place in the straight
    tube.
    """
    samples, joints = angles.shape
    for k in range(samples):
        along, across, x, y = 1.0, 0.0, 0.0, 0.0  # of the heading; of the place
        for i in range(joints):
            half = 0.5 * angles[k, i]
            if abs(half) <= SMALL:
                cs, sn = small_cosine(half), small_sine(half)
            else:
                cs, sn = math.cos(half), math.sin(half)
            along, across = along * cs - across * sn, along * sn + across * cs
            x, y = x + turning[i] * along, y + turning[i] * across
            along, across = along * cs - across * sn, along * sn + across * cs
            x, y = x + rings[i] * along, y + rings[i] * across
            x, y = x - aside[i] * across, y + aside[i] * (along - 1.0)
        tip[k, 0], tip[k, 1] = x, y
