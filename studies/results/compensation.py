"""``STEM-compensate.json``: the errors of a layer that was inverted, and the files that it was made from and for."""

from __future__ import annotations

from dataclasses import dataclass

from hysteresis.plain import optional
from studies.results.made import Made

WHAT = "the summary of `notchbend compensate`"
ENDING = "-compensate.json"
"""End of the names of these files; they stand beside the drive, ``STEM.csv``."""


@dataclass(frozen=True)
class CompensationSummary:
    """Result of a compensation.

    ``heldout_rmse_deg`` is the error of the layer on held-out samples, ``without_hysteresis_rmse_deg`` that of the best
    curve without hysteresis; ``largest_correction`` is the largest difference of the drives that follow from the two.
    ``record``, ``reference`` and ``drive`` are the files of the layer, of the angles to follow, and of the drive.
    """

    schema: int
    samples: int
    heldout_rmse_deg: float
    without_hysteresis_rmse_deg: float
    largest_correction: float
    drive_unit: str
    warnings: tuple[str, ...]
    record: str | None = optional()
    reference: str | None = optional()
    drive: str | None = optional()
    made: Made | None = optional()
