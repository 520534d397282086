"""Asymmetric Bouc-Wen law of Song and Der Kiureghian, 2006 (doi 10.1061/(ASCE)0733-9399(2006)132:6(610)).

h' = f' (A - |h|^n psi), psi = b1 sgn(f' h) + b2 sgn(f f') + b3 sgn(f h) + b4 sgn(f') + b5 sgn(h) + b6 sgn(f),

with f measured from a centre. psi changes only where f reverses, f crosses the centre or h crosses zero. Between these
events h follows the flow of :mod:`hysteresis.laws.flow`; its parameters depend on the side of the centre and the
direction.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numba import njit
from numpy.typing import ArrayLike

from hysteresis.arrays import Floats, Mask
from hysteresis.laws.flow import FREE, advance, set_kappa, workspace


@dataclass(frozen=True)
class AsymmetricBoucWen:
    """Parameters of the asymmetric law, angles in degrees.

    Parameters
    ----------
    A
        As in :class:`hysteresis.laws.bouc_wen.BoucWen`: h = sign(A) z, where z obeys the law with |A|.
    betas
        b1 to b6, deg^-n. b1 alone is the symmetric law with gamma = 0; b2 to b6 make sides or directions differ.
    n
        Sharpness, at least 1.
    centre_deg
        f at the boundary of the two sides.
    h0_deg
        h at the first sample of the path.
    """

    A: float
    betas: tuple[float, float, float, float, float, float]
    n: float
    centre_deg: float = 0.0
    h0_deg: float = 0.0

    def saturations_deg(self) -> Floats:
        """Return the limit of |h|, shape (2, 2): below and above the centre, f falling and rising; NaN for no limit."""
        with_motion = _psi(np.array(self.betas))[:, :, 0]
        with np.errstate(invalid="ignore", divide="ignore"):
            return np.where(with_motion > 0, (abs(self.A) / with_motion) ** (1 / self.n), np.nan)

    def is_admissible(self) -> bool:
        """Tell whether h is bounded and every closed loop dissipates.

        Sufficient conditions: psi > 0 where h has the direction of motion (h then tends to a limit), psi <= 0 where it
        is opposite (unloading is at least as steep as at h = 0), and n >= 1.
        """
        psi = _psi(np.array(self.betas))
        return bool((psi[:, :, 0] > 0).all() and (psi[:, :, 1] <= 0).all() and self.n >= 1)

    def row(self) -> Floats:
        """Return the parameters as a row (A, b1 to b6, n, centre_deg, h0_deg), shape (10,)."""
        return np.array([self.A, *self.betas, self.n, self.centre_deg, self.h0_deg])


def asymmetric_hysteresis(f_deg: ArrayLike, model: AsymmetricBoucWen) -> Floats:
    """Compute the hysteretic angle along a path of f, shape (m,) -> (m,), deg; see :func:`asymmetric_batch`."""
    return asymmetric_batch(f_deg, model.row()[np.newaxis])[0]


def asymmetric_batch(f_deg: ArrayLike, parameters: ArrayLike) -> Floats:
    """Compute the hysteretic angle of many parameter sets along one path.

    Parameters
    ----------
    f_deg
        Shape (m,), path of f in deg.
    parameters
        Shape (k, 10), rows (A, b1 to b6, n, centre_deg, h0_deg).

    Returns
    -------
    NDArray
        Shape (k, m), h in deg.

    Raises
    ------
    ValueError
        A path or rows of another shape or not finite, or a row that is not admissible (the message has its number).
    """
    path, rows = np.ascontiguousarray(f_deg, dtype=float), np.ascontiguousarray(parameters, dtype=float)
    if path.ndim != 1 or not np.isfinite(path).all():
        raise ValueError(f"f_deg of shape {path.shape}: expected a row of finite numbers")
    if rows.ndim != 2 or rows.shape[1] != 10 or not np.isfinite(rows).all():
        raise ValueError(f"parameters of shape {rows.shape}: expected (k, 10) finite numbers")
    h, admissible = _follow_all(path, rows)
    if not admissible.all():
        i = int(np.argmin(admissible))
        raise ValueError(
            f"asymmetric Bouc-Wen parameters {i}: {', '.join(f'{v:g}' for v in rows[i])}: expected n >= 1, psi > 0 "
            "with the motion, psi <= 0 against it, and |h0_deg| within the limits"
        )
    return h


@njit(cache=True)
def _psi(b: Floats) -> Floats:
    """Tabulate psi, shape (2, 2, 2), over the side of the centre, the direction, and h with (0) or against (1) it."""
    psi = np.empty((2, 2, 2))
    for i in range(2):
        for j in range(2):
            for k in range(2):
                side, direction = 2.0 * i - 1.0, 2.0 * j - 1.0
                sign = direction * (1.0 - 2.0 * k)
                of_two = b[0] * direction * sign + b[1] * side * direction + b[2] * side * sign
                psi[i, j, k] = of_two + b[3] * direction + b[4] * sign + b[5] * side
    return psi


@njit(cache=True)
def _follow_all(path: Floats, rows: Floats) -> tuple[Floats, Mask]:
    """Return h, shape (k, m), and which rows are admissible, shape (k,)."""
    out = np.zeros((rows.shape[0], path.shape[0]))
    admissible = np.empty(rows.shape[0], dtype=np.bool_)
    for i in range(rows.shape[0]):
        admissible[i] = _follow(path, rows[i], out[i])
    return out, admissible


@njit(cache=True)
def _follow(path: Floats, row: Floats, out: Floats) -> bool:
    """Compute h of one row into ``out``, shape (m,); return False for an inadmissible row."""
    return _follow_table(path, np.array([row[0], row[7], row[8], row[9]]), _psi(row[1:7]), out)


@njit(cache=True)
def table_batch(path: Floats, laws: Floats, tables: Floats) -> tuple[Floats, Mask]:
    """Compute h of laws whose psi is tabulated, as :func:`asymmetric_batch` does from b1 to b6.

    Parameters
    ----------
    path
        Shape (m,), path of f in deg.
    laws
        Shape (k, 4), rows (A, n, centre_deg, h0_deg).
    tables
        Shape (k, 2, 2, 2): psi below and above the centre, f falling and rising, h with and against the motion.

    Returns
    -------
    tuple
        h, shape (k, m), and which laws are admissible, shape (k,); h of the others is undefined.
    """
    out = np.zeros((laws.shape[0], path.shape[0]))
    admissible = np.empty(laws.shape[0], dtype=np.bool_)
    for i in range(laws.shape[0]):
        admissible[i] = _follow_table(path, laws[i], tables[i], out[i])
    return out, admissible


@njit(cache=True)
def _follow_table(path: Floats, law: Floats, psi: Floats, out: Floats) -> bool:
    A, n, centre, h0 = law[0], law[1], law[2], law[3]
    if n < 1.0 or psi[:, :, 0].min() <= 0.0 or psi[:, :, 1].max() > 0.0:
        return False
    if abs(h0) > (abs(A) / psi[:, :, 0].min()) ** (1.0 / n) * (1.0 + 1e-9):
        return False
    if A == 0.0 or path.shape[0] == 0:
        return True
    work = workspace(n)
    z = math.copysign(1.0, A) * h0
    out[0] = h0
    for j in range(1, path.shape[0]):
        a, b = path[j - 1], path[j]
        # A step across the centre is divided there.
        if (a - centre) * (b - centre) < 0.0:
            z = _within_a_side(z, a, centre, centre, abs(A), n, psi, work)
            a = centre
        z = _within_a_side(z, a, b, centre, abs(A), n, psi, work)
        out[j] = math.copysign(1.0, A) * z
    return True


@njit(cache=True)
def _within_a_side(
    z: float, a: float, b: float, centre: float, slope: float, n: float, psi: Floats, work: Floats
) -> float:
    """Advance z from f = a to b, both on one side of the centre."""
    if a == b:
        return z
    direction = 1.0 if b > a else -1.0
    cell = psi[1 if a + b > 2.0 * centre else 0, 1 if b > a else 0]
    limit = (slope / cell[0]) ** (1.0 / n)
    kappa = -cell[1] / cell[0]
    set_kappa(work, n, kappa)
    y = advance(direction * z / limit, FREE, 0.0, abs(b - a) * slope / limit, n, kappa, work)[0]
    return direction * limit * y
