"""The record about a fit as a linear model: zeros and parameters, discrepancy in the shapes of effects, and noise.

y = X b + delta + eps: y is what the fit leaves, X has the derivatives by the parameters and a zero of each series, eps
is noise (:mod:`validation.tracing.inference.autoregression`). delta is what any rig differs by from its model: it has
the shapes of the effects, and smooth functions of what was recorded, by groups. It is Gaussian (Kennedy, O'Hagan 2001,
doi 10.1111/1467-9868.00294).
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from itertools import accumulate

import numpy as np

from hysteresis.arrays import Floats, Ints
from validation.tracing.fitting.fitted import Fitted
from validation.tracing.fitting.smooth import bases_of
from validation.tracing.inference.autoregression import gaps
from validation.tracing.inference.shapes import Shape

LEAST_BEYOND = 3e-3
"""Part of a shape that must be beyond the derivatives of the fit: less is an error of these."""


@dataclass(frozen=True, eq=False)
class Linearised:
    """A record about a fit.

    Parameters
    ----------
    residual
        Measured less predicted, training samples of all series, shape (m,), deg.
    tangent
        Orthonormal basis of the derivatives and zeros, shape (m, p).
    gap
        See :func:`validation.tracing.inference.autoregression.gaps`, shape (m,).
    floor_deg
        Noise that the sensor has at least: of its digits and of the steps of the drive.
    half_range_deg
        Half the largest range of the angle.
    shapes
        Columns of the effects beyond the tangent, of unit rms, shape (m, s).
    blocks
        First column of each shape; further columns of a shape are amounts that act together.
    effects
        First shape of each effect.
    one_sided
        Whether the amount of each shape cannot be negative.
    names
        Of the effects.
    smooth
        Columns of each group of smooth functions beyond the tangent, together of unit rms, shapes (m, k).
    """

    residual: Floats
    tangent: Floats
    gap: Ints
    floor_deg: float
    half_range_deg: float
    shapes: Floats
    blocks: Ints
    effects: Ints
    one_sided: Ints
    names: tuple[str, ...]
    smooth: Mapping[str, Floats]

    @property
    def freedom(self) -> int:
        """Samples beyond the tangent."""
        return self.residual.size - self.tangent.shape[1]

    @property
    def within_steps(self) -> bool:
        """Whether the residual is within the digits of the angle and the steps of the drive.

        These errors are no draws, but follow the drive as an effect may: such a residual shows nothing.
        """
        return float(np.mean(self.residual**2)) <= self.floor_deg**2

    @property
    def shares(self) -> Floats:
        """Part of the discrepancy of its effect that each column of the shapes has, shape (s,)."""
        counts = self.counts
        return np.repeat(1.0 / counts, counts) if counts.size else np.empty(0)

    @property
    def counts(self) -> Ints:
        """Columns of each effect."""
        return np.diff([*self.blocks[self.effects], self.shapes.shape[1]])


def linearised(fitted: Fitted, shapes: Sequence[Shape]) -> Linearised:
    """Describe the training samples of a fit, all series that were fitted, by a linear model."""
    rows, records = fitted.rows, fitted.model.problem.records
    masks = fitted.holdout.series_masks(len(fitted.model.problem.channels))
    tangent = tangent_of(fitted)
    smooth = {
        name: _padded(basis, rows.errors.size)[rows.train] for name, basis in bases_of(fitted.model.problem).items()
    }
    kept = [(one, columns) for one in shapes if (columns := _beyond(one.columns, tangent)) is not None]
    owners = [one.effect for one, _ in kept]
    names = tuple(dict.fromkeys(owners))
    sizes = [columns.shape[1] for _, columns in kept]
    return Linearised(
        residual=-rows.errors[rows.train],
        tangent=tangent,
        gap=gaps(masks),
        floor_deg=max(float(np.hypot(one.rounding_deg, one.drive_step_deg)) for one in records),
        half_range_deg=max(float(np.ptp(one.angle_deg)) for one in records) / 2,
        shapes=np.column_stack([columns for _, columns in kept]) if kept else np.empty((tangent.shape[0], 0)),
        blocks=np.array([0, *accumulate(sizes)][:-1] if sizes else [], dtype=np.int64),
        effects=np.array([owners.index(name) for name in names], dtype=np.int64),
        one_sided=np.array([one.one_sided for one, _ in kept], dtype=bool),
        names=names,
        smooth={name: c for name, basis in smooth.items() if (c := _together(basis, tangent)) is not None},
    )


def tangent_of(fitted: Fitted) -> Floats:
    """Orthonormal basis of the derivatives of a fit and of the zeros of its series, training samples, shape (m, p).

    A parameter at a bound is not free, and has no column.
    """
    low, high = fitted.model.bounds()
    free = np.minimum(fitted.x - low, high - fitted.x) > 1e-3
    masks = fitted.holdout.series_masks(len(fitted.model.problem.channels))
    sizes = [int(mask.sum()) for mask in masks]
    zeros = np.repeat(np.eye(len(sizes)), sizes, axis=0)[:, np.array(sizes) > 0]
    return orthonormal(np.column_stack([fitted.rows.jacobian[fitted.rows.train][:, free], zeros]))


def orthonormal(columns: Floats, least: float = 1e-7) -> Floats:
    """Orthonormal basis of columns of any magnitude, shape (m, r)."""
    size = np.linalg.norm(columns, axis=0)
    left, singular, _ = np.linalg.svd(columns[:, size > 0] / size[size > 0], full_matrices=False)
    return np.asarray(left[:, singular > least * singular[:1].max(initial=0.0)])


def _beyond(columns: Floats, tangent: Floats) -> Floats | None:
    """Columns beyond a tangent, each of unit rms; None where nothing of them is."""
    left = columns - tangent @ (tangent.T @ columns)
    size, whole = np.linalg.norm(left, axis=0), np.linalg.norm(columns, axis=0)
    there = size > LEAST_BEYOND * whole
    return left[:, there] / size[there] * np.sqrt(len(left)) if there.any() else None


def _together(columns: Floats, tangent: Floats) -> Floats | None:
    """Columns beyond a tangent, together of unit rms; None where nothing of them is."""
    left = columns - tangent @ (tangent.T @ columns)
    size = float(np.linalg.norm(left))
    return left / size * np.sqrt(len(left)) if size > LEAST_BEYOND * np.linalg.norm(columns) else None


def _padded(basis: Floats, count: int) -> Floats:
    """Columns of the angle over all that is fitted: channels have none."""
    return np.vstack([basis, np.zeros((count - len(basis), basis.shape[1]))])
