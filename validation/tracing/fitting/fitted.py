"""A fitted model: its parameters and errors, and what the tracer compares it by, each computed once."""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import cached_property
from itertools import pairwise
from typing import NamedTuple

import numpy as np

from hysteresis.arrays import Floats, Mask
from validation.tracing.fitting.criterion import bic, independent_samples, lag_one_correlation
from validation.tracing.fitting.holdout import Holdout
from validation.tracing.fitting.model import Model
from validation.tracing.fitting.noise import NoiseFloor, estimate_noise_floor


class Rows(NamedTuple):
    """All that a model is fitted to, the angle first: errors (m,), derivatives (m, p) and training mask (m,)."""

    errors: Floats
    jacobian: Floats
    train: Mask


class ChannelErrors(NamedTuple):
    """Errors of what is fitted together with the angle: of each channel those of all records.

    ``errors`` are in deg by the channel's weight, less the offset of the record, shapes (m_i,); ``jacobian`` has their
    derivatives by the coordinates.
    """

    errors: tuple[Floats, ...]
    jacobian: Floats


@dataclass(frozen=True, eq=False)
class Fitted:
    """A model with fitted parameters.

    Models are compared by all that they are fitted to; errors and noise are those of the angle.

    Parameters
    ----------
    x
        Coordinates, shape (p,).
    errors
        Predicted less measured angle of each record, less its offset, shapes (m_i,), deg.
    jacobian
        Derivative of all these errors by the coordinates, shape (m, p).
    evaluations
        Runs of the model that the fit took.
    channels
        Errors of the channels that were fitted, too; None where there are none.
    fold_errors
        Errors of all samples, each by a fit that has not seen it, shapes (m_i,), deg, NaN where there is none; None
        where samples are held out once (``holdout``).
    """

    model: Model
    holdout: Holdout
    x: Floats
    errors: tuple[Floats, ...]
    jacobian: Floats
    evaluations: int
    channels: ChannelErrors | None = None
    fold_errors: tuple[Floats, ...] | None = None

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

    @cached_property
    def heldout_errors(self) -> list[Floats]:
        """Errors of the held-out samples of each record that is traced."""
        if self.fold_errors is not None:
            return [error[~np.isnan(error)] for error in self.fold_errors]
        every = [error[~train] for error, train in zip(self.errors, self.holdout.train, strict=True)]
        return every[self.holdout.traced]

    @property
    def heldout_error_deg(self) -> Floats:
        """Errors of the held-out samples."""
        return np.concatenate(self.heldout_errors)

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
        """Rms error of all samples; of records with a reference, those of the new records, in which effects act."""
        traced = self.errors[self.holdout.traced]
        return math.sqrt(self.mean_square) if len(traced) == len(self.errors) else rms(np.concatenate(traced))

    @cached_property
    def noise(self) -> NoiseFloor:
        """Noise floor, estimated from this model's residual."""
        return estimate_noise_floor(self.model.problem.records, self.residuals)

    @cached_property
    def rows(self) -> Rows:
        """All that the model is fitted to, in one row."""
        if self.channels is None:
            return Rows(self.error_deg, self.jacobian, self.holdout.train_mask)
        mask = np.concatenate(self.holdout.series_masks(len(self.model.problem.channels)))
        errors = np.concatenate([self.error_deg, *self.channels.errors])
        return Rows(errors, np.vstack([self.jacobian, self.channels.jacobian]), mask)

    @cached_property
    def square(self) -> float:
        """Mean square of all that the model is fitted to, held-out samples included, deg^2."""
        return self.mean_square if self.channels is None else _mean_square(self.rows.errors)

    @cached_property
    def train_square(self) -> float:
        """The same of the training samples."""
        return self.train_rmse_deg**2 if self.channels is None else _mean_square(self.rows.errors[self.rows.train])

    @cached_property
    def samples(self) -> float:
        """Number of independent samples that all samples are worth, by the correlation of this model's errors."""
        return independent_samples(self.rows.errors.size, lag_one_correlation(self._series), self._branches)

    @cached_property
    def variance_samples(self) -> float:
        """Number of independent samples that the mean square is worth as the variance of all errors.

        A channel far quieter than the others adds little to it, and counts for as little.
        """
        return self._counted_part * self.samples

    @cached_property
    def angle_samples(self) -> float:
        """The same of the angle alone."""
        if self.channels is None:
            return self.samples
        return independent_samples(self.error_deg.size, lag_one_correlation(self.errors), self._branches_of_angle)

    @cached_property
    def train_samples(self) -> float:
        """Number of independent samples that the training samples are worth."""
        masks = self.holdout.train
        errors = [error[masks[self.holdout.record_of(i)]] for i, error in enumerate(self._series)]
        count = int(self.rows.train.sum())
        branches = round(count / self.rows.errors.size * self._branches)
        return independent_samples(count, lag_one_correlation(errors), branches)

    def bic(self, samples: float) -> float:
        """Criterion over all samples, the less the better; models are compared for one number of ``samples``."""
        return bic(self.square, self.x.size, samples)

    def angle_bic(self, samples: float) -> float:
        """Criterion over all samples of the angle alone."""
        return bic(self.mean_square, self.x.size, samples)

    def train_bic(self, samples: float) -> float:
        """Criterion over the training samples."""
        return bic(self.train_square, self.x.size, samples)

    @property
    def _series(self) -> tuple[Floats, ...]:
        return self.errors if self.channels is None else (*self.errors, *self.channels.errors)

    @cached_property
    def _counted_part(self) -> float:
        """Part of all samples that a mean square over channels of unequal errors is worth.

        Satterthwaite 1946, doi 10.2307/3002019: (sum of S)^2 / (sum of S^2/n) of n samples with sum of squares S each.
        """
        if self.channels is None:
            return 1.0
        ends = np.cumsum([len(channel.measured) for channel in self.model.problem.channels])
        parts = [self.errors, *(self.channels.errors[i:j] for i, j in pairwise([0, *ends]))]
        sizes = [sum(e.size for e in errors) for errors in parts]
        squares = [sum(float(e @ e) for e in errors) for errors in parts]
        together = sum(s * s / n for s, n in zip(squares, sizes, strict=True) if n)
        return sum(squares) ** 2 / together / sum(sizes) if together > 0 else 1.0

    @property
    def _branches(self) -> int:
        records = self.model.problem.records
        return sum(records[self.holdout.record_of(i)].branch_count for i in range(len(self._series)))

    @property
    def _branches_of_angle(self) -> int:
        return sum(one.branch_count for one in self.model.problem.records)


def _mean_square(error: Floats) -> float:
    return float(error @ error) / error.size


def rms(error: Floats) -> float:
    """Root mean square; 0 of nothing."""
    return math.sqrt(float(error @ error) / error.size) if error.size else 0.0
