"""Compliance of the rings at the roots of a flexure, as an apparent extra length in bending.

A beam between rigid rings leaves out that the ring deforms where the arc is rooted in it. In the unrolled wall this is
a strip on a plate in plane stress (O'Donnell, J. Appl. Mech. 27(3), 1960, p. 461, for the half plane). Under a moment
the strip, h wide with sharp corners, appears longer by h f(H/h) at each root. H is half the uncut tube between two
notches, whose middle stays plane. The table below solves that problem by finite elements. Nothing in it is fitted to a
notched tube, and Poisson's ratio does not enter.
"""

from __future__ import annotations

from bisect import bisect_right

import numpy as np
from numpy.typing import ArrayLike
from scipy.interpolate import PchipInterpolator

from hysteresis.arrays import Floats

HALF_PLANE = 0.415
"""Root length of a strip on a half plane, relative to its width."""

_HEIGHTS = (0.0, 0.025, 0.05, 0.1, 0.15, 0.2, 0.3, 0.4, 0.5, 0.7, 1.0, 1.4, 2.0, 3.0, 5.0, 8.0)
_LENGTHS = (
    *(0.0, 0.0244, 0.0478, 0.0911, 0.1301, 0.1648, 0.2219, 0.2650),
    *(0.2971, 0.3389, 0.3708, 0.3901, 0.4018, 0.4087, 0.4124, 0.4137),
)
_SHARE = PchipInterpolator(_HEIGHTS, _LENGTHS)
_CUBICS = [tuple(reversed(one)) for one in _SHARE.c.T.tolist()]
"""Polynomials between the heights, constant first: a study asks for one number at a time."""


def root_length(height: ArrayLike) -> Floats:
    """Apparent extra length in bending at one root, of a strip of unit width on a plate of half height ``height``.

    Same shape as ``height``, which is at least 0; interpolated in the table, 0.415 beyond it.
    """
    ratio = np.asarray(height, dtype=float)
    return np.where(ratio > _HEIGHTS[-1], HALF_PLANE, _SHARE(np.minimum(ratio, _HEIGHTS[-1])))


def root_length_of_one(height: float) -> float:
    """Give :func:`root_length` of one number, at a tenth of the time."""
    if not height < _HEIGHTS[-1]:
        return float(root_length(height))
    k = max(bisect_right(_HEIGHTS, height) - 1, 0)
    along = height - _HEIGHTS[k]
    a, b, c, d = _CUBICS[k]
    square = along * along
    return a + b * along + c * square + d * (square * along)
