"""Play operators, whose weighted sums are Prandtl-Ishlinskii operators: the comparison for a Bouc-Wen law.

A play operator of radius r follows its input u as p = max(u - r, min(u + r, p)). A sum over several radii with
non-negative weights is rate independent, and its loops are congruent (Kuhnen 2003, doi 10.3166/ejc.9.407-418).
"""

from __future__ import annotations

import numpy as np
from numba import njit
from numpy.typing import ArrayLike

from hysteresis.arrays import Floats


def plays(u: ArrayLike, radii: ArrayLike, start: ArrayLike | None = None) -> Floats:
    """Evaluate play operators along one path.

    Parameters
    ----------
    u
        Shape (m,), the input in chronological order.
    radii
        Shape (k,), in the unit of u; at least 0.
    start
        Shape (k,), outputs before the first sample, moved into the play of the first sample; by default u[0].

    Returns
    -------
    NDArray
        Shape (k, m).

    Raises
    ------
    ValueError
        Arrays of another shape, numbers that are not finite, or a negative radius.
    """
    path, widths = np.ascontiguousarray(u, dtype=float), np.ascontiguousarray(radii, dtype=float)
    if path.ndim != 1 or path.size == 0 or not np.isfinite(path).all():
        raise ValueError(f"u of shape {path.shape}: expected a row of finite numbers")
    if widths.ndim != 1 or not (np.isfinite(widths).all() and (widths >= 0).all()):
        raise ValueError(f"radii = {widths.tolist()}: expected a row of finite numbers of at least 0")
    before = np.full(widths.shape, path[0]) if start is None else np.ascontiguousarray(start, dtype=float)
    if before.shape != widths.shape:
        raise ValueError(f"start of shape {before.shape}: expected that of the radii, {widths.shape}")
    return _follow(path, widths, before)


@njit(cache=True)
def _follow(path: Floats, radii: Floats, start: Floats) -> Floats:
    out = np.empty((radii.shape[0], path.shape[0]))
    for i in range(radii.shape[0]):
        p, r = start[i], radii[i]
        for j in range(path.shape[0]):
            p = max(path[j] - r, min(path[j] + r, p))
            out[i, j] = p
    return out
