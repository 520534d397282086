"""The closed loop of a rig that is exported: its tensions and the friction of its guides along the drive."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

import numpy as np

from fem_models.chain.solve import solve_chain
from fem_models.joint.friction import friction_limits_N, guide_wrap_rad
from fem_models.load import LoadProgram, triangle
from fem_models.rig import Rig
from fem_models.rig.checks import require
from hysteresis.arrays import Floats, Ints

STEPS_OF_AMPLITUDE = 16
"""Steps from no drive to full drive, so that its quarters fall on samples."""
BY_TIME_OR_CYCLE = ("creep", "drag", "stribeck", "preload_loss", "fatigue", "run_in", "position_friction")
"""Effects that neither a table of one quasi-static loop nor a model in MuJoCo has."""


@dataclass(frozen=True, eq=False)
class GuideLoop:
    """Tensions and friction along one loop; t tendons, N guides.

    ``drive_mm``, ``branch`` and ``angle_deg`` have shape (m,); the branch is 0 from rest to full drive, 1 on the way
    back to the other end, 2 on the way up again. ``before_N``, ``beyond_N`` and ``limit_N`` have shape (m, t, N): the
    tension on the side of the wheel, that on the side of the tip, and the most that friction can take up between them.
    ``wrap_rad`` has shape (m, N).
    """

    drive_mm: Floats
    branch: Ints
    angle_deg: Floats
    wrap_rad: Floats
    before_N: Floats
    beyond_N: Floats
    limit_N: Floats


def guide_loop(rig: Rig, amplitude_mm: float) -> GuideLoop:
    """Run the chain through 0, +A, -A, +A and collect what happens at each guide.

    Effects of time and of the count of cycles are left out: :data:`BY_TIME_OR_CYCLE`.

    Raises
    ------
    RigError, SolverError
        An amplitude that is not above 0; a rig that cannot follow the drive.
    """
    require(math.isfinite(amplitude_mm) and amplitude_mm > 0, "amplitude_mm", amplitude_mm, "above 0")
    drive = triangle(amplitude_mm, step_mm=amplitude_mm / STEPS_OF_AMPLITUDE).drive_mm
    solution = solve_chain(steady(rig), LoadProgram(drive))
    assert solution.record.notches_deg is not None  # an engine's record has them
    tensions = solution.segment_tensions_N[:, : len(rig.tendons)]
    before, beyond = tensions[:, :, :-1], tensions[:, :, 1:]
    wrap = np.array([guide_wrap_rad(rig.friction, row) for row in np.radians(solution.record.notches_deg)])
    steps = np.arange(drive.size)
    return GuideLoop(
        drive_mm=drive,
        branch=np.searchsorted([STEPS_OF_AMPLITUDE, 3 * STEPS_OF_AMPLITUDE], steps),
        angle_deg=solution.record.angle_deg,
        wrap_rad=wrap,
        before_N=before,
        beyond_N=beyond,
        limit_N=friction_limits_N(rig.friction, before, beyond, wrap[:, None, :]),
    )


def steady(rig: Rig) -> Rig:
    """Return the rig without effects of time and of the count of cycles."""
    superelastic = rig.superelastic and replace(rig.superelastic, heating_time_s=None)
    return replace(rig, **dict.fromkeys(BY_TIME_OR_CYCLE), superelastic=superelastic)  # type: ignore[arg-type]
