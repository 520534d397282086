"""Moments of the section of a tube cut by planes, in closed form: outer circular segment less inner one.

Small remains are the difference of nearly equal elementary terms. They are written with Gauss's hypergeometric
function instead, whose series has no such difference. A moment is that of the area times the k-th power of a distance,
k = 0..3. The equations stand in ``docs/theory/analytic-model.md``.
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import ArrayLike
from scipy.special import beta, hyp2f1

from hysteresis.arrays import Floats

ORDERS = 4
"""Moments of the orders 0 to 3."""


def segment_moments(radius: float, height: ArrayLike) -> Floats:
    """Moments of a circular segment, of the distance from its flat side; shape (4, ...) for heights of shape (...).

    The height runs from 0 to 2 ``radius``, the whole disc. With h the height, s = h/(2R) and t the place in it,

        int 8 R^2 (2 R (s - t))^k sqrt(t (1 - t)) dt,  t = 0..s,

    is the integral of the chord: 8 R^2 (2R)^k s^(k + 3/2) B(3/2, k + 1) 2F1(-1/2, 3/2; k + 5/2; s).
    """
    part = np.asarray(height, dtype=float) / (2 * radius)
    flat = np.minimum(part, 0.5)
    k = np.arange(ORDERS).reshape(-1, *[1] * part.ndim)
    series = 8 * 2.0**k * flat ** (k + 1.5) * beta(1.5, k + 1) * hyp2f1(-0.5, 1.5, k + 2.5, flat)
    return np.asarray(radius ** (k + 2) * np.where(part < 0.5, series, _high_segment(np.clip(part, 0.5, 1.0))), float)


def _high_segment(part: Floats) -> Floats:
    """Moments of a segment of a disc of radius 1 that is at least a half disc: elementary, shape (4, ...)."""
    half = 2 * np.arcsin(np.sqrt(part))  # of the angle at the centre
    sin, cos = np.sin(half), np.cos(half)
    about_centre = (
        half - sin * cos,
        2 / 3 * sin**3,
        half / 4 - np.sin(4 * half) / 16,
        2 * (sin**3 / 3 - sin**5 / 5),
    )
    return np.stack([_shifted(about_centre, -cos, k) for k in range(ORDERS)])


def _shifted(moments: tuple[Floats, ...] | Floats, by: ArrayLike, order: int) -> Floats:
    """Moment of one order after all distances have grown by ``by``."""
    step = np.asarray(by, dtype=float)
    return np.asarray(sum(math.comb(order, j) * step ** (order - j) * moments[j] for j in range(order + 1)))


def strip_moments(radius: float, half_width: ArrayLike) -> Floats:
    """Moments of the strip |x| <= c of a disc, of the distance from its middle; shape (4, ...) for c of shape (...).

    c runs from 0 to ``radius``; 4 R c^(k + 1)/(k + 1) 2F1(-1/2, (k + 1)/2; (k + 3)/2; c^2/R^2).
    """
    part = np.asarray(half_width, dtype=float) / radius
    narrow, wide = np.minimum(part, 0.7), np.arcsin(np.clip(part, 0.7, 1.0))
    k = np.arange(ORDERS).reshape(-1, *[1] * part.ndim)
    series = 4 * narrow ** (k + 1) / (k + 1) * hyp2f1(-0.5, (k + 1) / 2, (k + 3) / 2, narrow**2)
    cos = np.cos(wide)
    elementary = (
        2 * wide + np.sin(2 * wide),
        4 / 3 * (1 - cos**3),
        wide / 2 - np.sin(4 * wide) / 8,
        4 * (2 / 15 - cos**3 / 3 + cos**5 / 5),
    )
    return np.asarray(radius ** (k + 2) * np.where(part < 0.7, series, np.stack(elementary)), float)


def below_cut_moments(outer: float, inner: float, cut: ArrayLike) -> Floats:
    """Moments of {x <= cut} of a tube, of the distance from the cut; radii in mm, shape (4, ...) for cuts of (...)."""
    height = np.asarray(cut, dtype=float) + outer
    into_bore = height - (outer - inner)
    bore = segment_moments(inner, np.clip(into_bore, 0.0, 2 * inner))
    past = np.maximum(into_bore - 2 * inner, 0.0)  # the bore lies wholly below the cut, and this far from it
    shifted = np.stack([_shifted(bore, past, k) for k in range(ORDERS)])
    return segment_moments(outer, np.clip(height, 0.0, 2 * outer)) - shifted


def between_cuts_moments(outer: float, inner: float, cut: ArrayLike) -> Floats:
    """Moments of {|x| <= cut} of a tube, of the distance from its axis; radii in mm, shape (4, ...) for cuts (...)."""
    half = np.asarray(cut, dtype=float)
    return strip_moments(outer, np.minimum(half, outer)) - strip_moments(inner, np.minimum(half, inner))


def moments_about(outer: float, inner: float, cut: ArrayLike, place: float) -> Floats:
    """Moments of {x <= cut} of a tube, of x - ``place``, shape (4, ...) for cuts of shape (...)."""
    x = np.asarray(cut, dtype=float)
    distances = below_cut_moments(outer, inner, x)
    sign = (-1.0) ** np.arange(ORDERS).reshape(-1, *[1] * x.ndim)
    return np.stack([_shifted(sign * distances, x - place, k) for k in range(ORDERS)])
