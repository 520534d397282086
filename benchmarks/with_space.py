"""The task in this package's compiled chain in space."""

from __future__ import annotations

from collections.abc import Callable

from task import Floats, Task

from fem_models.spatial.drives import wheel_drives
from fem_models.spatial.rig import spatial_rig
from fem_models.spatial.solve import solve_spatial

DIFFERENCE = "flexures also shorten, twist and bend across, and bend over their length"
CLOSED_FORM = None
LACKS = "inertia; flexible rings; superelastic fibres"


def prepare(task: Task, drive_mm: Floats) -> Callable[[], Floats]:
    """Return a function that runs the loop without friction: angles in deg."""
    rig, drives = spatial_rig(task.rig), wheel_drives(drive_mm)
    return lambda: solve_spatial(rig, drives).bending_deg[:, 0]
