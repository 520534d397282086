"""Runs of the chain that remember their steps, and runs of moved rigs along them: derivatives at a fraction of a run.

See :mod:`fem_models.chain.moved`.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from fem_models.chain.follow import Run, Tape
from fem_models.chain.moved import Line, follow_moved, linearise
from fem_models.chain.parameters import ChainSettings, Memory, Parameters, memory_at_rest
from fem_models.chain.solve import ChainCase, chain_case, followed, run_space, tip_mm
from fem_models.joint import JointRow
from fem_models.load import LoadProgram
from fem_models.rig import Rig
from fem_models.rig.checks import SolverError
from hysteresis.arrays import Floats

LARGEST_MOVE_RAD = 0.02
"""Difference of a joint's angle from that of the rig up to which a moved rig is near it: the largest step of Newton's
method, too."""

NO_CHANGE_RAD, NO_CHANGE_N = 1e-9, 1e-7
"""Differences that are not told from the residual at which Newton's method ends."""


@dataclass(frozen=True, eq=False)
class ChainSeries:
    """What a run gives that sensors read, shapes (m,)."""

    rig: Rig
    joints: JointRow
    run: Run

    @property
    def joint_angles_rad(self) -> Floats:
        """Angles of the joints, shape (m, N)."""
        return self.run.angles

    @property
    def tensions_N(self) -> Floats:
        """Tensions at the wheel, shape (m, 2)."""
        return self.run.tensions[:, :, 0]

    @property
    def angle_deg(self) -> Floats:
        """Angle of the tip."""
        return np.degrees(np.cumsum(self.run.angles, axis=1)[:, -1])

    @property
    def notches_deg(self) -> Floats:
        """Angles of the joints, shape (m, N)."""
        return np.degrees(self.run.angles)

    @property
    def tension_a_N(self) -> Floats:
        """Tension of tendon a at the wheel."""
        return self.tensions_N[:, 0]

    @property
    def tension_b_N(self) -> Floats | None:
        """Tension of tendon b at the wheel; None for a rig of one tendon."""
        return None if self.rig.tendon_b is None else self.tensions_N[:, 1]

    @property
    def tip_mm(self) -> Floats:
        """Centre of the last ring along the straight tube and across it, shape (m, 2)."""
        return tip_mm(self.rig, self.joints, self.run)


@dataclass(frozen=True, eq=False)
class TapedRun:
    """A run of a rig with the steps that it took."""

    rig: Rig
    case: ChainCase
    series: ChainSeries
    tape: Tape


def taped_run(rig: Rig, load: LoadProgram | Floats, settings: ChainSettings | None = None) -> TapedRun:
    """Run a rig through a load program, or under tendon forces in N, shape (m,).

    Raises
    ------
    SolverError, RigError
        As :func:`fem_models.chain.solve.solve_chain`.
    """
    case = chain_case(rig, load, settings)
    run, tape = followed(rig, case, taped=True)
    return TapedRun(rig, case, ChainSeries(rig, case.joints, run), tape)


def line_along(base: TapedRun) -> Line:
    """Linearise a run: the equations at each of its steps, for :func:`moved_series`.

    Raises
    ------
    SolverError
        A tangent without stiffness.
    """
    case, rig = base.case, base.rig
    try:
        return linearise(base.tape, case.path, case.parameters, memory_at_rest(rig, case.joints))
    except ZeroDivisionError:
        raise SolverError(f"rig {rig.name}: a tangent without stiffness") from None


def moved_series(base: TapedRun, line: Line, rig: Rig, load: LoadProgram | Floats) -> ChainSeries:
    """Run a rig that differs from that of a run by little, along its steps: to first order in the difference.

    A rig that differs in kind, or by much, is run by itself. So is one whose superelastic sections differ from joint to
    joint: the softest takes most of the bending, and just after a reversal a fibre of the moved rig may still be on the
    plateau where that of the rig unloads. One that differs by no more than the tolerance of Newton's method does not
    differ.

    Raises
    ------
    SolverError, RigError
        A rig that cannot be, or that does not follow the load when it is run by itself.
    """
    case = chain_case(rig, load)
    memory = memory_at_rest(rig, case.joints)
    sections_differ = case.joints.first.section is not None and not case.joints.alike
    if not sections_differ and _of_one_kind(base, case, memory):
        run = run_space(case, rig.joints)
        if follow_moved(line, case.path, case.parameters, memory, run) <= LARGEST_MOVE_RAD:
            series = ChainSeries(rig, case.joints, run)
            return base.series if _same(series, base.series) else series
    return ChainSeries(rig, case.joints, followed(rig, case)[0])


def _same(one: ChainSeries, other: ChainSeries) -> bool:
    return bool(
        np.abs(one.joint_angles_rad - other.joint_angles_rad).max() < NO_CHANGE_RAD
        and np.abs(one.tensions_N - other.tensions_N).max() < NO_CHANGE_N
    )


def _of_one_kind(base: TapedRun, case: ChainCase, memory: Memory) -> bool:
    """Whether a rig has the parts of the rig that was run, and its samples."""
    own = memory_at_rest(base.rig, base.case.joints)
    shapes = [(a.shape, b.shape) for a, b in zip(own, memory, strict=True)]
    return (
        all(a == b for a, b in shapes)
        and base.case.path.drive.shape == case.path.drive.shape
        and _kind(base.case.parameters) == _kind(case.parameters)
    )


def _kind(rig: Parameters) -> tuple[bool, ...]:
    """Parts that a rig has or has not: guides with friction, tendons, toe regions, contacts, a tip stop."""
    rough = rig.capstan > 0.0, rig.guide > 0.0, rig.sheath > 0.0
    guides = rough[0] or rough[1], rough[0] or rough[1] or rough[2]
    tendons = [value > 0.0 for pair in (rig.toe, rig.segment, rig.free) for value in pair]
    contacts = rig.contact_both, rig.stop_stiffness > 0.0, rig.load_control
    return (*guides, *tendons, *contacts)
