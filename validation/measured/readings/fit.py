"""Whether a set of mechanisms meets all statements together: least squares of all residuals from several starts."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from scipy.optimize import least_squares
from scipy.stats import qmc

from fem_models.rig import RigError
from fem_models.rig.checks import SolverError
from hysteresis.arrays import Floats
from validation.measured.ensemble.priors import MechanismSet
from validation.measured.readings.loops import loops_of
from validation.measured.readings.mechanisms import rig_of
from validation.measured.readings.statements import Judged, judge, residual_vector

IMPOSSIBLE = 300.0
"""Each residual of a rig that does not follow the drive."""
COARSE_MM = 0.2
_SIZE = 11
_STEP = 2e-3  # of a quantile, of finite differences
_DRAWN = 64


@dataclass(frozen=True)
class SetFit:
    """The best rig found of a set under one reading: its constants, what it says to the statements, and how found.

    ``chi_squares`` are those of all starts, from the least on: equal ones say that the least is no chance.
    """

    constants: Mapping[str, float]
    judged: Judged
    chi_squares: tuple[float, ...]
    runs: int


class Residuals:
    """Residuals of a set at quantiles of its constants; counts the rigs that it ran."""

    def __init__(self, mechanisms: MechanismSet, reading: str) -> None:
        self.mechanisms, self.reading, self.runs = mechanisms, reading, 0

    def __call__(self, quantiles: Floats) -> Floats:
        """Residual vector, shape (11,)."""
        self.runs += 1
        try:
            chosen = rig_of(self.mechanisms.chosen(quantiles))
            return residual_vector(loops_of(chosen.rig, chosen.camera, COARSE_MM), self.reading)
        except (RigError, SolverError):
            return np.full(_SIZE, IMPOSSIBLE)


def fit_set(mechanisms: MechanismSet, reading: str, *, starts: int, seed: int) -> SetFit:
    """Fit a set from the best of scrambled Sobol draws; the same fit for a seed."""
    residuals = Residuals(mechanisms, reading)
    size = len(mechanisms.names)
    drawn = qmc.Sobol(size, rng=np.random.default_rng(seed)).random(_DRAWN)
    order = np.argsort([float(np.sum(residuals(q) ** 2)) for q in drawn], kind="stable")
    found = [
        least_squares(
            residuals,
            np.clip(drawn[k], 0.01, 0.99),
            bounds=(np.zeros(size), np.ones(size)),
            diff_step=_STEP,
            x_scale=0.2,
            max_nfev=30,
        )
        for k in order[:starts]
    ]
    best = min(found, key=lambda one: float(one.cost))
    constants = mechanisms.chosen(best.x)
    chosen = rig_of(constants)
    return SetFit(
        constants,
        judge(loops_of(chosen.rig, chosen.camera), reading),
        tuple(sorted(2 * float(one.cost) for one in found)),
        residuals.runs,
    )
