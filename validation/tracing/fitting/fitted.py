"""A fitted model: its parameters and errors, and what the tracer compares it by, each computed once."""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from hysteresis.arrays import Floats
from validation.tracing.fitting.criterion import bic, independent_samples, lag_one_correlation
from validation.tracing.fitting.holdout import Holdout
from validation.tracing.fitting.model import Model
from validation.tracing.fitting.noise import NoiseFloor, estimate_noise_floor


@dataclass(frozen=True, eq=False)
class Fitted:
    """A model with fitted parameters.

    Parameters
    ----------
    x
        Coordinates, shape (p,).
    errors
        Predicted less measured angle of each record, less its offset, shapes (m_i,), deg.
    jacobian
        Derivative of all errors by the coordinates, shape (m, p).
    evaluations
        Runs of the model that the fit took.
    """

    model: Model
    holdout: Holdout
    x: Floats
    errors: tuple[Floats, ...]
    jacobian: Floats
    evaluations: int

    @property
    def names(self) -> tuple[str, ...]:
        """Effects that the model has beside the baseline."""
        return self.model.names

    @cached_property
    def error_deg(self) -> Floats:
        """Errors of all records in one row, shape (m,)."""
        return np.concatenate(self.errors)

    @property
    def residuals(self) -> list[Floats]:
        """Measured less predicted angle of each record."""
        return [-e for e in self.errors]

    @property
    def train_error_deg(self) -> Floats:
        """Errors of the training samples."""
        return np.asarray(self.error_deg[self.holdout.train_mask])

    @property
    def heldout_error_deg(self) -> Floats:
        """Errors of the held-out samples."""
        return np.asarray(self.error_deg[~self.holdout.train_mask])

    @cached_property
    def train_rmse_deg(self) -> float:
        """Rms error of the training samples."""
        return rms(self.train_error_deg)

    @cached_property
    def heldout_rmse_deg(self) -> float:
        """Rms error of the held-out samples."""
        return rms(self.heldout_error_deg)

    @cached_property
    def mean_square(self) -> float:
        """Mean square error of all samples, held-out ones included, deg^2."""
        return float(self.error_deg @ self.error_deg) / self.error_deg.size

    @property
    def rmse_deg(self) -> float:
        """Rms error of all samples."""
        return math.sqrt(self.mean_square)

    @cached_property
    def noise(self) -> NoiseFloor:
        """Noise floor, estimated from this model's residual."""
        return estimate_noise_floor(self.model.problem.records, self.residuals)

    @cached_property
    def samples(self) -> float:
        """Number of independent samples that all samples are worth, by the correlation of this model's errors."""
        return independent_samples(self.error_deg.size, lag_one_correlation(self.errors), self._branches)

    @cached_property
    def train_samples(self) -> float:
        """The same for the training samples."""
        errors = [error[train] for error, train in zip(self.errors, self.holdout.train, strict=True)]
        count = int(self.holdout.train_mask.sum())
        branches = round(count / self.error_deg.size * self._branches)
        return independent_samples(count, lag_one_correlation(errors), branches)

    def bic(self, samples: float) -> float:
        """Criterion over all samples, the less the better; models are compared for one number of ``samples``."""
        return bic(self.mean_square, self.x.size, samples)

    def train_bic(self, samples: float) -> float:
        """Criterion over the training samples."""
        return bic(self.train_rmse_deg**2, self.x.size, samples)

    @property
    def _branches(self) -> int:
        return sum(one.branch_count for one in self.model.problem.records)


def rms(error: Floats) -> float:
    """Root mean square; 0 of nothing."""
    return math.sqrt(float(error @ error) / error.size) if error.size else 0.0
