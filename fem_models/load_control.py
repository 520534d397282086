"""Load control: the tension of the one tendon at the wheel goes in, the angle of every notch comes out."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

import numpy as np
from numpy.typing import ArrayLike

from fem_models.chain.solve import ChainSolution, solve_pulled_chain
from fem_models.multibody.quasi_static import MultibodySolution, solve_pulled_multibody
from fem_models.rig.rig import Rig
from hysteresis.arrays import Floats
from hysteresis.record import Record


@dataclass(frozen=True)
class Pull:
    """A rig under forces, sample by sample.

    Parameters
    ----------
    force_N
        Shape (m,), tension at the wheel in the order it was visited.
    notches_deg
        Shape (m, N), angle of every notch, its precurvature included, base first.
    angle_deg
        Shape (m,), of the tip.
    tip_mm
        Shape (m, 2), along the straight tube and across it.
    peak_strain
        Shape (m, N), of :func:`fem_models.joint.strain.peak_strain`; NaN for measured joints.
    record
        The same as a record whose drive is the force, for :func:`hysteresis.record_file.write_record`.
    """

    force_N: Floats
    notches_deg: Floats
    angle_deg: Floats
    tip_mm: Floats
    peak_strain: Floats
    record: Record


def pull(rig: Rig, force_N: ArrayLike, engine: Literal["chain", "multibody"] = "chain") -> Pull:
    """Pull the one tendon of a rig by forces, quasi-statically, from rest and in the order given.

    The tension itself is prescribed, no drive searched for: a flat stretch of the law, where the angle runs away at
    nearly the same force, is gone through in steps of the force. Friction and material remember the way, so that
    forces which fall again give the unloading branch.

    Parameters
    ----------
    force_N
        Shape (m,), at least 0. The wheel end sees them; the tip sees less, by friction.

    Raises
    ------
    RigError
        A rig of two tendons, or with effects of time and cycles; forces that cannot be.
    SolverError
        Where no equilibrium is found.
    """
    force = np.asarray(force_N, dtype=float)
    solution: ChainSolution | MultibodySolution
    solution = solve_pulled_chain(rig, force) if engine == "chain" else solve_pulled_multibody(rig, force)
    record = solution.record
    assert record.notches_deg is not None
    assert record.tip_mm is not None
    return Pull(record.drive, record.notches_deg, record.angle_deg, record.tip_mm, solution.peak_strain, record)
