"""Runs of the chain that remember their steps, and runs of moved rigs along them: derivatives at a fraction of a run.

See :mod:`fem_models.chain.moved`.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, fields
from functools import cached_property

import numpy as np

from fem_models.chain.follow import Run, Tape
from fem_models.chain.moved import Line, follow_moved, linearise
from fem_models.chain.parameters import Memory, memory_at_rest
from fem_models.chain.solve import ChainCase, chain_case, followed, run_space, tip_mm
from fem_models.joint import JointRow
from fem_models.load import LoadProgram
from fem_models.rig import Rig
from fem_models.rig.checks import SolverError
from hysteresis.arrays import Floats

LARGEST_MOVE_RAD = 0.02
"""Difference of a joint's angle from that of the rig up to which a moved rig is near it: the largest step of Newton's
method, too."""

_NOT_SCHEDULED = {
    "name", "material", "tendon_a", "tendon_b", "friction", "joint", "closure", "gravity", "tip_stop", "tip_load",
    "tip_mass", "layout",
}  # fmt: skip
_SCHEDULED = tuple(f.name for f in fields(Rig) if f.name not in _NOT_SCHEDULED)
"""Parts of a rig that :func:`fem_models.load.schedule.schedule` may read; of the others only a lost preload does."""
_Kind = tuple[object, ...]

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
    """A run of a rig through a load with the steps that it took."""

    rig: Rig
    load: LoadProgram | Floats
    case: ChainCase
    series: ChainSeries
    tape: Tape

    @property
    def has_steps(self) -> bool:
        """Whether all of the run's steps are on the tape: not where the chain relaxed to its next equilibrium."""
        return self.tape.part.size > 0

    @cached_property
    def kind(self) -> _Kind:
        """Parts of the rig that a rig moved along its steps has, too."""
        return _kind(self.case, memory_at_rest(self.rig, self.case.joints))


def taped_run(rig: Rig, load: LoadProgram | Floats, case: ChainCase | None = None) -> TapedRun:
    """Run a rig through a load program, or under tendon forces in N, shape (m,).

    With its ``case`` at hand (:func:`fem_models.chain.solve.chain_case`) hardly more than the kernel is left, which
    releases the interpreter's lock.

    Raises
    ------
    SolverError, RigError
        As :func:`fem_models.chain.solve.solve_chain`.
    """
    case = case or chain_case(rig, load)
    run, tape = followed(rig, case, taped=True)
    return TapedRun(rig, load, case, ChainSeries(rig, case.joints, run), tape)


def line_along(base: TapedRun) -> Line:
    """Linearise a run: the equations at each of its steps, for :func:`moved_along`.

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


@dataclass(frozen=True, eq=False)
class MovedRun:
    """A rig that differs by little from one that was run, ready for the kernel; ``run`` is room for its results.

    ``of_one_kind`` is whether it has the parts of the rig that was run, and its samples. A rig whose superelastic
    sections differ from joint to joint never is: the softest takes most of the bending, and just after a reversal a
    fibre of the moved rig may still be on the plateau where that of the rig unloads.
    """

    rig: Rig
    load: LoadProgram | Floats
    case: ChainCase
    memory: Memory
    run: Run
    of_one_kind: bool


def moved_run(base: TapedRun, rig: Rig, load: LoadProgram | Floats, like: ChainCase | None = None) -> MovedRun:
    """Derive what the kernel takes of a rig that differs by little from the one that was run.

    ``like`` as of :func:`fem_models.chain.solve.chain_case`.

    Raises
    ------
    RigError
        A rig that cannot be.
    """
    path = base.case.path if load is base.load and _same_schedule(rig, base.rig) else None
    case = chain_case(rig, load, path=path, like=like)
    memory = memory_at_rest(rig, case.joints)
    sections_differ = case.joints.first.section is not None and not case.joints.alike
    of_one_kind = not sections_differ and base.has_steps and base.kind == _kind(case, memory)
    return MovedRun(rig, load, case, memory, run_space(case, rig.joints), of_one_kind)


def moved_along(line: Line, moved: MovedRun) -> float:
    """Take a moved rig along the steps of the rig; give the largest difference of a joint's angle, rad.

    Hardly more than the kernel, which releases the interpreter's lock.
    """
    if not moved.of_one_kind:
        return math.inf
    return float(follow_moved(line, moved.case.path, moved.case.parameters, moved.memory, moved.run))


def moved_series(base: TapedRun, moved: MovedRun, difference_rad: float) -> ChainSeries:
    """Give what sensors read of a moved rig, from the difference by :func:`moved_along`.

    A rig that differs in kind, or by much, is run by itself. One that differs by no more than the tolerance of Newton's
    method does not differ.

    Raises
    ------
    SolverError, RigError
        A rig that does not follow the load when it is run by itself.
    """
    if difference_rad <= LARGEST_MOVE_RAD:
        series = ChainSeries(moved.rig, moved.case.joints, moved.run)
        return base.series if _same(series, base.series) else series
    case = chain_case(moved.rig, moved.load)  # a moved arm has other steps
    return ChainSeries(moved.rig, case.joints, followed(moved.rig, case)[0])


def _same_schedule(one: Rig, other: Rig) -> bool:
    """Whether two rigs have the same inputs in every sample of one load."""
    if one.preload_loss is not None:  # which depends on the tendons' stretch
        return False
    return all(getattr(one, name) == getattr(other, name) for name in _SCHEDULED)


def _same(one: ChainSeries, other: ChainSeries) -> bool:
    return bool(
        np.abs(one.joint_angles_rad - other.joint_angles_rad).max() < NO_CHANGE_RAD
        and np.abs(one.tensions_N - other.tensions_N).max() < NO_CHANGE_N
    )


def _kind(case: ChainCase, memory: Memory) -> _Kind:
    """Parts that a rig has or has not: guides with friction, tendons, toe regions, contacts, a tip stop, elements."""
    rig = case.parameters
    rough = rig.capstan > 0.0, rig.guide > 0.0, rig.sheath > 0.0
    guides = rough[0] or rough[1], rough[0] or rough[1] or rough[2]
    tendons = [value > 0.0 for pair in (rig.toe, rig.segment, rig.free) for value in pair]
    contacts = rig.contact_both, rig.stop_stiffness > 0.0, rig.load_control
    shapes = [array.shape for array in memory]
    return (type(rig.each), case.path.drive.size, *shapes, *guides, *tendons, *contacts)
