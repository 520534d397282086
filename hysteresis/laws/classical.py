"""Classical Bouc-Wen law (paper, eq. 4-5): the force F = c x' + k (x - x0) + alpha z with the hysteretic state z."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np
from numpy.typing import ArrayLike

from hysteresis.arrays import Floats
from hysteresis.laws.bouc_wen import BoucWen, hysteresis_batch


@dataclass(frozen=True)
class Classical:
    """Parameters of the classical law.

    Parameters
    ----------
    c, k, x0, alpha
        Damping, stiffness, rest position, and weight of z.
    law
        Parameters of eq. 5, z' = A x' - beta |x'| |z|^(n-1) z - gamma x' |z|^n, which is eq. 7 with x in place of f.
        The units of x and z replace degrees, and ``h0_deg`` is z at the first sample.
    """

    c: float
    k: float
    x0: float
    alpha: float
    law: BoucWen = field(default_factory=lambda: BoucWen(1.0, 0.5, 0.5, 1.0))

    def row(self) -> Floats:
        """Return the row (c, k, x0, alpha, A, beta, gamma, n, z0) of :func:`force_batch`, shape (9,)."""
        return np.concatenate([[self.c, self.k, self.x0, self.alpha], self.law.row()])


def force(time_s: ArrayLike, x: ArrayLike, model: Classical) -> Floats:
    """Compute the force along a motion, shape (m,) -> (m,); see :func:`force_batch`."""
    return force_batch(time_s, x, model.row()[np.newaxis])[0]


def force_batch(time_s: ArrayLike, x: ArrayLike, parameters: ArrayLike) -> Floats:
    """Compute the force of many parameter sets along one motion.

    Parameters
    ----------
    time_s, x
        Shape (m,), m >= 2: increasing times, and the displacement; x' is the central difference.
    parameters
        Shape (k, 9), rows (c, k, x0, alpha, A, beta, gamma, n, z0).

    Returns
    -------
    NDArray
        Shape (k, m).

    Raises
    ------
    ValueError
        Arrays of another shape, times that do not increase, or an inadmissible row.
    """
    time, path = np.asarray(time_s, dtype=float), np.asarray(x, dtype=float)
    rows = np.atleast_2d(np.asarray(parameters, dtype=float))
    if time.ndim != 1 or time.shape != path.shape or time.size < 2 or not (np.diff(time) > 0).all():
        raise ValueError(f"time_s, x: shapes {time.shape}, {path.shape}: expected two rows alike, times increasing")
    if rows.shape[1] != 9:
        raise ValueError(f"parameters of shape {rows.shape}: expected (k, 9): c, k, x0, alpha, A, beta, gamma, n, z0")
    c, k, x0, alpha = rows[:, :4].T[:, :, np.newaxis]
    return c * np.gradient(path, time) + k * (path - x0) + alpha * hysteresis_batch(path, rows[:, 4:])
