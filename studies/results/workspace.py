"""``workspace.json``: what the tip of a rig in space reaches, and what force moves it."""

from __future__ import annotations

from dataclasses import dataclass

from hysteresis.plain import optional
from studies.results.made import Made

WHAT = "the result of `notchbend workspace`"
FILES = ("workspace.json", "workspace.csv", "workspace.png")
WAYS = {"smooth": "no friction, no loop", "forth": "with friction, forth", "back": "with friction, back"}
"""Tips of the table by the beginning of their columns, and their words."""

Row = tuple[float, float, float]
Matrix = tuple[Row, Row, Row]


@dataclass(frozen=True, kw_only=True)
class ComplianceAt:
    """Tip compliance, mm/N, rows and columns x, y, z: guides that stick, and a wrist without friction and loop.

    There is a drive for each wheel.
    """

    drive_1_mm: float
    drive_2_mm: float | None = optional()
    drive_3_mm: float | None = optional()
    drive_4_mm: float | None = optional()
    held_mm_per_N: Matrix
    sliding_mm_per_N: Matrix

    @property
    def drives_mm(self) -> tuple[float, ...]:
        """Drives of the wheels that there are."""
        every = (self.drive_1_mm, self.drive_2_mm, self.drive_3_mm, self.drive_4_mm)
        return tuple(one for one in every if one is not None)


@dataclass(frozen=True, kw_only=True)
class WorkspaceSummary:
    """What a tip reaches.

    Areas are those within the outermost circle of the drives, seen along the straight tube; a rig with one wheel has a
    curve in their place, of ``length_mm``. ``spread`` is the distance of the tips that the same drives reach when the
    wheels go round forth and back: what friction leaves open. The table ``file`` has ``circles`` times ``directions``
    rows.
    """

    schema: int
    rig: str
    preload_N: float
    amplitude_mm: float
    file: str
    circles: int
    directions: int
    largest_bending_deg: float
    reach_y_mm: float
    reach_z_mm: float
    least_x_mm: float
    area_mm2: float | None = optional()
    area_without_friction_mm2: float | None = optional()
    length_mm: float | None = optional()
    largest_spread_mm: float
    mean_spread_mm: float
    least_tension_N: float
    largest_tension_N: float
    compliance: tuple[ComplianceAt, ...]
    made: Made | None = optional()
