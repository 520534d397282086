"""Features of the residual of a case, for a classifier."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from hysteresis.arrays import Floats
from hysteresis.records.record import Record
from validation.practice.benchmark.sparse_regression import group_gains
from validation.practice.benchmark.terms import ResidualTerms, effects_of_terms
from validation.practice.hidden.curve_with_plays import RADII

NAMES: tuple[str, ...] = (
    "log of the residual over the noise",
    "correlation of neighbours",
    *(f"gain of {name}" for name in effects_of_terms()),
    *(f"loop of {radius:g}" for radius in RADII),
    "records",
    "log of the samples",
    "preloads",
    "amplitudes",
    "known rig",
)
"""What each feature is."""


def features(records: Sequence[Record], found: ResidualTerms) -> Floats:
    """Give the features of a case, shape of :data:`NAMES`; an effect without a term in these records has no gain."""
    residual, gains = found.residual_deg, group_gains(found)
    neighbours = float(residual[1:] @ residual[:-1] / (residual @ residual))
    return np.array(
        [
            np.log10(found.over_noise),
            neighbours,
            *(gains.get(name, 0.0) for name in effects_of_terms()),
            *np.clip(found.loops, -10.0, 10.0),
            len(records),
            np.log10(residual.size),
            len({record.rig.get("preload_N") for record in records}),
            len({round(float(np.ptp(record.drive)), 1) for record in records}),
            float("moment_arm_mm" in records[0].rig or "preset" in records[0].rig),
        ]
    )
