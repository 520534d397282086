"""``STEM-compensate.json``: the errors of a layer that was inverted, and the files that it was made from and for."""

from __future__ import annotations

from dataclasses import dataclass

from hysteresis.plain import optional
from studies.results.made import Made

WHAT = "the summary of `notchbend compensate`"
WHAT_IN_SPACE = "the summary of `notchbend compensate` of a rig in space"
ENDING = "-compensate.json"
"""End of the names of these files; they stand beside the drive, ``STEM.csv``."""


@dataclass(frozen=True)
class CompensationSummary:
    """Result of a compensation.

    ``heldout_rmse_deg`` is the error of the layer on held-out samples, ``without_hysteresis_rmse_deg`` that of the best
    curve without hysteresis; ``largest_correction`` is the largest difference of the drives that follow from the two.
    ``delay_s``: so much earlier than the reference the drive begins, because the angle lags it by as much. ``record``,
    ``reference`` and ``drive`` are the files of the layer, of the angles to follow, and of the drive.
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
    delay_s: float = 0.0


@dataclass(frozen=True)
class SpaceCompensation:
    """Errors of the drives that were found, and root mean square of those for the wrist without friction and loop, deg.

    An error is the distance of both angles from the wanted ones. It is that of the model: the drives are simulated
    again from rest.
    """

    schema: int
    rig: str
    reference: str
    drive: str
    samples: int
    rms_deg: float
    largest_error_deg: float
    rms_without_compensation_deg: float
    largest_correction_mm: float
    made: Made | None = optional()
