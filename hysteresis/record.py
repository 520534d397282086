"""A record: drive and angle of one test, measured or simulated, with what is known of it.

The file format (a CSV and a TOML sidecar of the same stem) stands in ``docs/records.md``.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any, Literal

import numpy as np
from numpy.typing import NDArray

DriveUnit = Literal["mm", "deg", "step", "N"]
DRIVE_UNITS: tuple[str, ...] = ("mm", "deg", "step", "N")


class RecordError(ValueError):
    """A record that cannot be read or used; one line naming file, line or field, value and what was expected."""


@dataclass(frozen=True)
class Record:
    """One test of one rig, sample by sample. All arrays have the same length m.

    ``drive_unit`` is N for load-controlled data (the drive is then the tendon force). ``rig``, ``tube`` and
    ``notch`` hold the sidecar's tables as they stand: what they mean is the mechanical model's business.
    ``kinematics`` is the user's own theory f(x) as rows (drive, angle_deg), shape (k, 2).
    """

    drive: NDArray[np.float64]
    angle_deg: NDArray[np.float64]
    drive_unit: DriveUnit = "mm"
    title: str = ""
    kind: Literal["measured", "simulated"] = "measured"
    time_s: NDArray[np.float64] | None = None
    cycle: NDArray[np.int64] | None = None
    tension_a_N: NDArray[np.float64] | None = None
    tension_b_N: NDArray[np.float64] | None = None
    notches_deg: NDArray[np.float64] | None = None  # shape (m, notches), base to tip
    tip_mm: NDArray[np.float64] | None = None  # shape (m, 2): along the straight tube, and across in the bending plane
    rig: Mapping[str, Any] = field(default_factory=dict)
    tube: Mapping[str, Any] = field(default_factory=dict)
    notch: Mapping[str, Any] = field(default_factory=dict)
    kinematics: NDArray[np.float64] | None = None
    source: str = ""  # the file it came from, for messages; "" when made in memory
