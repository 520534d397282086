"""Compliance of one half of a V notch in bending and along the tube, compiled: studies derive a notch for every case.

Between a pair of cuts at +-c a tube has the area and the second moment of two strips, outer less inner
(:func:`fem_models.joint.segments.strip_moments`). With w = arcsin(c/R) these are

    R^2 (2 w + sin 2w)        R^4 (w/2 - sin(4w)/8)

and for a narrow strip, where the latter cancels, its series 4 R^4 sum a_n (c/R)^(2n + 3)/(2n + 3) in the coefficients
a_n of sqrt(1 - t).
"""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np

from fem_models.compiled import njit_of
from hysteresis.arrays import Floats

NODES, WEIGHTS = np.polynomial.legendre.leggauss(12)
LEFT, RIGHT = 12, 24
"""Halvings of an interval towards its ends: the integrands are steep after a kink, and have a root before the next."""
_NARROW, _TERMS = 0.3, 16  # 0.3^32 is below the rounding of the first term

_njit = njit_of(Path(__file__))


@_njit(allocates=False)
def between_cuts(outer: float, inner: float, cut: float) -> tuple[float, float]:
    """Area and second moment of {|x| <= cut} of a tube, radii and cut in mm."""
    area, second = _strip(outer, cut)
    bore_area, bore_second = _strip(inner, cut)
    return area - bore_area, second - bore_second


@_njit(allocates=False, forceinline=True)
def _strip(radius: float, cut: float) -> tuple[float, float]:
    """Area and second moment of {|x| <= cut} of a disc."""
    part, square = min(cut / radius, 1.0), radius * radius
    half, cos = math.asin(part), math.sqrt((1.0 - part) * (1.0 + part))
    area = square * 2.0 * (half + part * cos)
    if part > _NARROW:
        return area, 0.5 * square * square * (half - part * cos * (1.0 - 2.0 * part * part))
    term, total = 1.0, 0.0
    for n in range(_TERMS):
        total += term / (2 * n + 3)
        term *= part * part * (n - 0.5) / (n + 1)
    return area, 4.0 * square * square * part * part * part * total


@_njit(allocates=False)
def _slope(
    radii: tuple[float, float], start: tuple[float, float], end: tuple[float, float], nodes: Floats, weights: Floats
) -> tuple[float, float]:
    """Integrals of 1/(second moment) and 1/area over z, from one (z, cut) to the next; the cut grows linearly."""
    length, rise, bends, gives = end[0] - start[0], end[1] - start[1], 0.0, 0.0
    for piece in range(LEFT + RIGHT):
        if piece < LEFT:
            low, high = 0.5 ** (LEFT + 1 - piece) if piece else 0.0, 0.5 ** (LEFT - piece)
        else:
            low = 1.0 - 0.5 ** (piece - LEFT + 1)
            high = 1.0 - 0.5 ** (piece - LEFT + 2) if piece < LEFT + RIGHT - 1 else 1.0
        half = 0.5 * (high - low)
        for k in range(nodes.size):
            area, second = between_cuts(radii[0], radii[1], start[1] + rise * (low + half * (1.0 + nodes[k])))
            bends += half * weights[k] / second
            gives += half * weights[k] / area
    return length * bends, length * gives


@_njit(allocates=False)
def half_notch(
    radii: tuple[float, float], depth: float, half_root: float, half_width: float, nodes: Floats, weights: Floats
) -> tuple[float, float]:
    """Integrals of 1/(second moment), mm^-3, and 1/area, mm^-1, over one half of a V: its root and its flank.

    ``radii`` are the outer and the inner one. The flank has a kink where it leaves the bore.
    """
    outer, inner = radii
    cut = outer - depth
    area, second = between_cuts(outer, inner, cut)
    bends, gives = half_root / second, half_root / area
    start, end = (half_root, cut), (half_width, outer)
    if cut < inner:
        kink = (half_width - (half_width - half_root) * (outer - inner) / depth, inner)
        more_bends, more_gives = _slope(radii, start, kink, nodes, weights)
        bends, gives, start = bends + more_bends, gives + more_gives, kink
    more_bends, more_gives = _slope(radii, start, end, nodes, weights)
    return bends + more_bends, gives + more_gives
