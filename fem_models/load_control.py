"""Load control: the tendon force at the wheel is prescribed, and the angle of every notch results."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

import numpy as np
from numpy.typing import ArrayLike

from fem_models.chain.solve import ChainSolution, solve_chain_by_force
from fem_models.multibody.quasi_static import MultibodySolution, solve_multibody_by_force
from fem_models.rig import Rig
from hysteresis.arrays import Floats
from hysteresis.records.record import Record


@dataclass(frozen=True)
class LoadControlRun:
    """A rig under tendon forces, sample by sample.

    Parameters
    ----------
    force_N
        Shape (m,), tension at the wheel in the order in which it was applied.
    notches_deg
        Shape (m, N), angle of every notch with its precurvature, base first.
    angle_deg
        Shape (m,), of the tip.
    tip_mm
        Shape (m, 2), along the straight tube and across it.
    peak_strain
        Shape (m, N), of :func:`fem_models.joint.strain.peak_strain`; NaN for measured joints.
    record
        The same as a record whose drive is the force, for :func:`hysteresis.records.record_file.write_record`.
    """

    force_N: Floats
    notches_deg: Floats
    angle_deg: Floats
    tip_mm: Floats
    peak_strain: Floats
    record: Record


def run_load_control(rig: Rig, force_N: ArrayLike, engine: Literal["chain", "multibody"] = "chain") -> LoadControlRun:
    """Apply forces to the single tendon of a rig, quasi-statically, from rest and in the order given.

    The tension itself is prescribed, without a search for the drive. A plateau of the material law, where the angle
    grows at nearly constant force, is therefore no difficulty. Friction and material depend on the path, so that
    decreasing forces give the unloading branch.

    Parameters
    ----------
    force_N
        Shape (m,), at least 0: tension at the wheel. Friction reduces it towards the tip.

    Raises
    ------
    RigError
        A rig of two tendons, or with effects of time and cycles; negative or infinite forces.
    SolverError
        No equilibrium was found.
    """
    force = np.asarray(force_N, dtype=float)
    solution: ChainSolution | MultibodySolution
    solution = solve_chain_by_force(rig, force) if engine == "chain" else solve_multibody_by_force(rig, force)
    record = solution.record
    assert record.notches_deg is not None
    assert record.tip_mm is not None
    return LoadControlRun(
        force_N=record.drive,
        notches_deg=record.notches_deg,
        angle_deg=record.angle_deg,
        tip_mm=record.tip_mm,
        peak_strain=solution.peak_strain,
        record=record,
    )
