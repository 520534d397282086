"""Ranges over an ensemble of rigs, and how far a measurement would narrow them."""

from __future__ import annotations

from collections.abc import Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike
from scipy.special import ndtri
from scipy.stats import rankdata

from fem_models.load import LoadProgram
from fem_models.rig import Rig
from hysteresis.arrays import Floats
from validation.separation.contributions import Contributions, separate

LEVEL = 0.9
"""Share of the members within a range."""
_DEGREE = 3


@dataclass(frozen=True)
class Range:
    """Median of a number over an ensemble, and the range from its 5 % to its 95 % quantile."""

    low: float
    median: float
    high: float

    @property
    def width(self) -> float:
        """High minus low."""
        return self.high - self.low

    def __str__(self) -> str:
        return f"{self.median:.3g} ({self.low:.3g} to {self.high:.3g})"


def range_of(values: ArrayLike) -> Range:
    """Median and 90 % range of values over an ensemble, shape (members,).

    Raises
    ------
    ValueError
        No value, or one that is not finite.
    """
    found = np.asarray(values, dtype=float)
    if found.size == 0 or not np.isfinite(found).all():
        raise ValueError(f"{found.size} values of an ensemble: expected finite numbers")
    low, median, high = np.quantile(found, [(1 - LEVEL) / 2, 0.5, (1 + LEVEL) / 2])
    return Range(float(low), float(median), float(high))


def separate_each(rigs: Sequence[Rig], program: LoadProgram, *, threads: int | None = None) -> list[Contributions]:
    """Divide the loop of every rig of an ensemble, in threads; the order of the rigs is kept.

    Raises
    ------
    SolverError, RigError
        As :func:`validation.separation.contributions.separate`.
    """
    with ThreadPoolExecutor(threads) as pool:
        return list(pool.map(lambda rig: separate(rig, program), rigs))


def left_by(measured: ArrayLike, wanted: ArrayLike, error: float, *, seed: int = 0) -> float:
    """Give the part of a range that is expected to be left once another number has been measured.

    The wanted number is regressed on the measured one over the members, by a cubic in its normal score; the range of
    the residual over that of the number itself is that part. The error of the measurement is added to the members'
    numbers first, so that what it hides is not explained. Of jointly normal numbers with correlation r it is
    sqrt(1 - r^2).

    Parameters
    ----------
    measured, wanted
        Shape (members,).
    error
        Standard deviation of the measurement, in the unit of ``measured``.
    """
    x, y = np.array(measured, dtype=float), np.asarray(wanted, dtype=float)
    x = x + error * np.random.default_rng(seed).standard_normal(x.size)
    if np.ptp(x) == 0 or np.ptp(y) == 0:
        return 1.0
    powers = np.vander(ndtri((rankdata(x) - 0.5) / x.size), _DEGREE + 1)
    residual = y - powers @ np.linalg.lstsq(powers, y, rcond=None)[0]
    return range_of(residual).width / range_of(y).width


def gathered(found: Sequence[Contributions], quantity: str) -> dict[str, Floats]:
    """Shares of a quantity over an ensemble by part, shape (members,); NaN where a rig has no such loop.

    A rig without play has a share of 0 of it.
    """
    shares = [one.shares(quantity) for one in found]
    names = dict.fromkeys(name for one in shares if one is not None for name in one)
    return {name: np.array([np.nan if one is None else one.get(name, 0.0) for one in shares]) for name in names}
