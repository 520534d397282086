"""Improved Bouc-Wen law (paper, eq. 6-7): theta = f + h, where h depends on the path of f alone.

The law is rate independent, so between two samples of f it is an autonomous equation in one variable.
With the saturation S = (|A| / (beta + gamma))^(1/n), the path in units of S / |A|, and y = h / S, positive in the
direction of motion, it is the flow of :mod:`hysteresis.laws.flow` with kappa = (beta - gamma) / (beta + gamma).
"""

from __future__ import annotations

import math
from dataclasses import dataclass, fields, replace

import numpy as np
from numba import njit, prange
from numpy.typing import ArrayLike

from hysteresis.arrays import Floats, Mask
from hysteresis.laws.flow import FREE, advance, set_kappa, workspace

_PARALLEL_FROM = 100_000  # samples in all: below, starting threads takes longer than the work


@dataclass(frozen=True)
class BoucWen:
    """Parameters of the improved Bouc-Wen law, angles in degrees.

    Parameters
    ----------
    A
        Slope dh/df at h = 0. Its sign is the sign of the loop: h = sign(A) z, where z obeys eq. 7 with |A|.
        A > 0 leads (h and f rise together, as eq. 7 is printed), A < 0 lags: the same loop, mirrored.
    beta, gamma
        Shape of the loop, deg^-n.
    n
        Sharpness of the transition into saturation.
    h0_deg
        h at the first sample of the path.

    Notes
    -----
    Eq. 7 with a negative A inserted directly has no saturation. A lagging measurement needs the mirrored loop.
    """

    A: float
    beta: float
    gamma: float
    n: float
    h0_deg: float = 0.0

    def __post_init__(self) -> None:
        for f in fields(self):
            value = getattr(self, f.name)
            if not math.isfinite(value):
                raise ValueError(f"BoucWen.{f.name} = {value}: expected a finite number")

    @property
    def saturation_deg(self) -> float:
        """Largest |h| that a path can reach, (|A| / (beta + gamma))^(1/n); infinite for beta + gamma <= 0."""
        total = self.beta + self.gamma
        return (abs(self.A) / total) ** (1 / self.n) if total > 0 else math.inf

    @property
    def corner_deg(self) -> None:
        """None: nothing changes at once along a straight way of f."""
        return None

    def is_bounded(self) -> bool:
        """Tell whether h stays within the saturation on every path: beta + gamma > 0.

        Ismail, Ikhouane, Rodellar 2009, doi 10.1007/s11831-009-9031-8.
        """
        return self.beta + self.gamma > 0

    def is_passive(self) -> bool:
        """Tell whether every closed loop dissipates: -beta <= gamma <= beta (same source)."""
        return -self.beta <= self.gamma <= self.beta

    def is_admissible(self) -> bool:
        """Tell whether h is bounded and passive, and unique at h = 0: n >= 1."""
        return self.is_bounded() and self.is_passive() and self.n >= 1

    def along(self, f_deg: Floats) -> Floats:
        """Compute h along a path that starts in the state h0_deg: :func:`hysteresis` without its checks of types."""
        return hysteresis_batch(f_deg, self.row()[np.newaxis])[0]

    def after(self, f_deg: Floats) -> BoucWen:
        """Return the law with the state at the end of a path."""
        return replace(self, h0_deg=float(self.along(f_deg)[-1]))

    def widened(self, factor: float) -> BoucWen:
        """Return the law with a saturation times a factor above 0, and the same A; h is held within it."""
        power, most = factor**-self.n, factor * self.saturation_deg
        h0 = min(most, max(-most, self.h0_deg))
        return replace(self, beta=power * self.beta, gamma=power * self.gamma, h0_deg=h0)

    @property
    def state(self) -> Floats:
        """Give h, shape (1,), deg."""
        return np.array([self.h0_deg])

    def in_state(self, state: Floats) -> BoucWen:
        """Return the law with another h, shape (1,), deg, held within its saturation."""
        most = self.saturation_deg
        return replace(self, h0_deg=min(most, max(-most, float(state[0]))))

    def row(self) -> Floats:
        """Return the parameters as a row (A, beta, gamma, n, h0_deg) of :func:`hysteresis_batch`, shape (5,)."""
        return np.array([self.A, self.beta, self.gamma, self.n, self.h0_deg])


def hysteresis(f_deg: ArrayLike, model: BoucWen) -> Floats:
    """Compute the hysteretic angle h along a path of f.

    Parameters
    ----------
    f_deg
        Shape (m,), the single-valued angle f(x) in chronological order, deg.
    model
        Its parameters; ``model.h0_deg`` is h at the first sample.

    Returns
    -------
    NDArray
        Shape (m,), h in deg. The angle of the manipulator is f + h (eq. 6).

    Raises
    ------
    ValueError
        A path that is not a row of finite numbers, an inadmissible model, or an initial state beyond saturation.
    """
    return hysteresis_batch(f_deg, model.row()[np.newaxis])[0]


def hysteresis_batch(f_deg: ArrayLike, parameters: ArrayLike) -> Floats:
    """Compute the hysteretic angle of many parameter sets along one path, in parallel.

    Parameters
    ----------
    f_deg
        Shape (m,), path of f in deg.
    parameters
        Shape (k, 5), rows (A, beta, gamma, n, h0_deg).

    Returns
    -------
    NDArray
        Shape (k, m), h in deg.

    Raises
    ------
    ValueError
        As :func:`hysteresis`; the message names the first bad row.
    """
    path = np.ascontiguousarray(f_deg, dtype=float)
    rows = np.ascontiguousarray(parameters, dtype=float)
    if path.ndim != 1:
        raise ValueError(f"f_deg of shape {path.shape}: expected a row of finite numbers")
    if rows.ndim != 2 or rows.shape[1] != 5:
        raise ValueError(f"parameters of shape {rows.shape}: expected (k, 5): A, beta, gamma, n, h0_deg")
    follow = _follow_parallel if len(rows) * path.size > _PARALLEL_FROM else _follow_all
    h, admissible = follow(path, rows)
    if not admissible.all():
        _refuse(path, rows, admissible)
    return h


def _refuse(path: Floats, rows: Floats, admissible: Mask) -> None:
    if not np.isfinite(path).all():
        raise ValueError(f"f_deg of shape {path.shape}: expected a row of finite numbers")
    i = int(np.argmin(admissible))
    raise ValueError(
        f"Bouc-Wen parameters {i}: A, beta, gamma, n, h0_deg = {', '.join(f'{v:g}' for v in rows[i])}: expected "
        f"beta + gamma > 0, |gamma| <= beta, n >= 1 and |h0_deg| <= (|A| / (beta + gamma))^(1/n)"
    )


@njit(cache=True)
def _follow_all(path: Floats, rows: Floats) -> tuple[Floats, Mask]:
    """Return h, shape (k, m), and which rows are admissible, shape (k,); h of the others is undefined."""
    out = np.empty((rows.shape[0], path.shape[0]))
    admissible = np.empty(rows.shape[0], dtype=np.bool_)
    for i in range(rows.shape[0]):
        admissible[i] = _follow(path, rows[i], out[i])
    return out, admissible


@njit(cache=True, parallel=True)
def _follow_parallel(path: Floats, rows: Floats) -> tuple[Floats, Mask]:
    out = np.empty((rows.shape[0], path.shape[0]))
    admissible = np.empty(rows.shape[0], dtype=np.bool_)
    for i in prange(rows.shape[0]):
        admissible[i] = _follow(path, rows[i], out[i])
    return out, admissible


@njit(cache=True)
def _follow(path: Floats, row: Floats, out: Floats) -> bool:
    """Compute h of one row into ``out``, shape (m,); return False for an inadmissible row, or a NaN in the path."""
    A, beta, gamma, n, h0 = row[0], row[1], row[2], row[3], row[4]
    total = beta + gamma
    if not (total > 0.0 and abs(gamma) <= beta and n >= 1.0):
        return False
    saturation = (abs(A) / total) ** (1.0 / n)
    # A state at saturation may exceed it by a rounding error.
    if not (saturation < math.inf and abs(h0) <= saturation * (1.0 + 1e-9)):
        return False
    if path.shape[0] == 0:
        return True
    out[0] = h0
    if saturation == 0.0:  # A = 0: no hysteresis
        out[:] = 0.0
        return True
    scale = math.copysign(saturation, A)
    per_deg = abs(A) / saturation
    kappa = (beta - gamma) / total
    work = workspace(n)
    set_kappa(work, n, kappa)
    y, direction, chart, place = min(1.0, max(-1.0, h0 / scale)), 1.0, FREE, 0.0
    for j in range(1, path.shape[0]):
        df = path[j] - path[j - 1]
        if not abs(df) < math.inf:
            return False
        if df * direction < 0.0:
            y, direction, chart = -y, -direction, FREE
        y, chart, place = advance(y, chart, place, abs(df) * per_deg, n, kappa, work)
        y = min(1.0, y)
        out[j] = direction * scale * y
    return bool(abs(path[0]) < math.inf)
