"""The task in this package's multibody model (Exudyn)."""

from __future__ import annotations

from collections.abc import Callable

from task import Floats, Task

from fem_models.load import LoadProgram
from fem_models.multibody.quasi_static import solve_multibody

DIFFERENCE = "flexures also shear and shorten, rings bend"
CLOSED_FORM = None
LACKS = "motion out of the plane"


def prepare(task: Task, drive_mm: Floats) -> Callable[[], Floats]:
    """Return a function that runs the loop without friction: angles in deg."""
    return lambda: solve_multibody(task.rig, LoadProgram(drive_mm)).record.angle_deg
