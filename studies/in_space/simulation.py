"""``notchbend simulate`` of a rig in space."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from fem_models.rig import Rig, RigError
from fem_models.spatial.drives import WheelProgram
from fem_models.spatial.motion.run_record import record_of, simulate_in_space
from fem_models.spatial.rig import of_rig_in_space
from hysteresis.records.record import Record
from studies.engines import EngineName, require_exudyn


@dataclass(frozen=True)
class SpaceSummary:
    """Largest values of a run in space; the bending is the angle between base and tip in any direction."""

    title: str
    samples: int
    largest_bending_deg: float
    largest_angle_deg: float
    largest_angle_2_deg: float
    largest_torsion_deg: float
    largest_tension_N: float
    slack_samples: int
    largest_notch_deg: float


def simulate_any(rig: Rig, program: WheelProgram, engine: EngineName | None, dynamic: bool) -> Record:
    """Run the engine for rigs in space.

    Raises
    ------
    RigError
        An engine that knows planar rigs only.
    """
    if dynamic:
        raise RigError(f"--dynamic with rig {rig.name}, which bends in space: expected a quasi-static run")
    if engine == "analytic":
        raise RigError(f"--engine {engine} with rig {rig.name}, which bends in space: expected chain or multibody")
    if engine != "multibody":
        return simulate_in_space(rig, program)
    require_exudyn()
    from fem_models.multibody.spatial.solve import solve_spatial_multibody

    run = solve_spatial_multibody(of_rig_in_space(rig), program.of_tendons(rig))
    return record_of(rig, program, run, "multibody in space")


def summary_of(record: Record) -> SpaceSummary:
    """Summarise a run in space."""
    assert record.angle_2_deg is not None
    assert record.torsion_deg is not None
    assert record.notches_deg is not None
    named = (record.tension_a_N, record.tension_b_N, record.tension_c_N, record.tension_d_N)
    tensions = np.array([one for one in named if one is not None])
    return SpaceSummary(
        title=record.title,
        samples=record.drive.size,
        largest_bending_deg=float(np.hypot(record.angle_deg, record.angle_2_deg).max()),
        largest_angle_deg=float(np.abs(record.angle_deg).max()),
        largest_angle_2_deg=float(np.abs(record.angle_2_deg).max()),
        largest_torsion_deg=float(np.abs(record.torsion_deg).max()),
        largest_tension_N=float(tensions.max()),
        slack_samples=int((tensions <= 0).any(axis=0).sum()),
        largest_notch_deg=float(np.abs(record.notches_deg).max()),
    )
