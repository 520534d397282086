"""Noise of a sensor as a first-order autoregression along each record: whitening, its determinant, and draws.

Noise e of samples that are k apart is correlated by rho^k, with one variance:
e_t = rho^k e_(t-k) + (1 - rho^2k)^(1/2) w with white w (Box, Jenkins, Reinsel, Ljung, Time series analysis, 2015,
section 3.2). Samples that are held out leave a gap; a series that begins is correlated with none before.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from hysteresis.arrays import Floats, Ints, Mask


def gaps(masks: Sequence[Mask]) -> Ints:
    """Distances of the samples that are used to those before them, in one row; 0 where a series begins.

    Parameters
    ----------
    masks
        Samples of each series that are used, shapes (m_i,).
    """
    used = [np.flatnonzero(mask) for mask in masks]
    return np.concatenate([np.diff(one, prepend=one[0]) for one in used if one.size])


def correlations(gap: Ints, rho: float) -> Floats:
    """Correlation of each sample with the one before, shape (m,)."""
    return np.where(gap > 0, rho ** np.maximum(gap, 1), 0.0)


def whitened(rows: Floats, gap: Ints, rho: float) -> Floats:
    """Multiply rows by the inverse root of the correlation, shape (m,) or (m, k)."""
    own = correlations(gap, rho).reshape(-1, *[1] * (rows.ndim - 1))
    out = rows / np.sqrt(1 - own**2)
    out[1:] -= (own / np.sqrt(1 - own**2))[1:] * rows[:-1]
    return out


def coloured(white: Floats, gap: Ints, rho: float) -> Floats:
    """Give white rows the correlation: the inverse of :func:`whitened`, shape (m, k)."""
    own = correlations(gap, rho)
    out = white * np.sqrt(1 - own**2)[:, None]
    for i in np.flatnonzero(own):
        out[i] += own[i] * out[i - 1]
    return out


def log_determinant(gap: Ints, rho: float) -> float:
    """Logarithm of the determinant of the correlation matrix."""
    return float(np.log1p(-(correlations(gap, rho) ** 2)).sum())
