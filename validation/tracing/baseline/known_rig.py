"""Records of a known rig as a problem for the tracer: the compiled chain, its constants, and effects added to the rig.

Declared model (docs/guide/trace.md): kinematics, elastic tendons, friction of the guides (capstan and constant) and the
loop of the material. Its constants are identified from the data; the rest of the rig is as declared.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace
from itertools import pairwise
from typing import Any

import numpy as np
from numpy.typing import NDArray

from fem_models.chain.solve import ChainSolution, chain_angle_deg, solve_chain, solve_pulled_chain
from fem_models.joint.strain import strain_per_rad
from fem_models.load.program import LoadProgram
from fem_models.rig.effects import Closure
from fem_models.rig.joints import NotchedTube
from fem_models.rig.of_record import notched_tube_of, rig_of
from fem_models.rig.rig import Friction, Material, Rig, Tendon, Wheel
from hysteresis.arrays import Floats
from hysteresis.path import branches, cycle_index
from hysteresis.record import Record, RecordError
from validation.tracing.effect import Effect, FreeParameter, RigForm, SampleInputs, Scale, Values, cycles_repeat
from validation.tracing.prepared import PreparedRecord, RecordSet, prepare

PULLED = (
    FreeParameter("youngs_modulus_GPa", "GPa", 1.0, 200.0, 0.1, log=True),
    FreeParameter("capstan_coefficient", "-", 0.0, 1.5, 0.05),
)
"""Of the declared model under tendon forces, loading only: a material's loop does not show."""
SAMPLES, LEAST_OF_RECORD = 4000, 200
"""Of all records together, and of one that is thinned."""
AT_REST = 0.05  # of the drive's range: a record that begins so near to zero begins from rest
_APPROACH = 24  # samples from one end of the drive to the other, for a record that begins elsewhere
_EXACTLY = 1e-9  # of the drive's range: cycles that repeat each other
SOFT, NEVER_DEG = 1.0, 1e3
"""Stiffness and angle of a closure that is not there."""
_YOUNG_GPA, _ROPE_WALL_MM = 50.0, 0.1


@dataclass(frozen=True, eq=False)
class Run:
    """A piece of a record as a run of its rig from rest; ``skip`` samples of the run are the approach.

    Cycles that repeat each other exactly need not be gone through again by a rig without a memory for time and cycles:
    ``short`` ends after the second one, and ``where`` says which of its samples stands for each sample of the run.
    """

    rig: Rig
    program: LoadProgram | Floats  # forces, in N, where a force pulls
    skip: int
    short: LoadProgram | None = None
    where: NDArray[np.int64] | None = None

    def solve(self, rig: Rig) -> ChainSolution:
        """Run a rig through it."""
        if isinstance(self.program, LoadProgram):
            return solve_chain(rig, self.program)
        return solve_pulled_chain(rig, self.program)

    def angle_deg(self, rig: Rig) -> Floats:
        """Angle of a rig along the record, shape (m,)."""
        forgets = rig.creep is None and rig.drag is None and rig.preload_loss is None and rig.fatigue is None
        if not isinstance(self.program, LoadProgram):
            return self.solve(rig).record.angle_deg[self.skip :]
        if self.short is None or not forgets:
            return chain_angle_deg(rig, self.program)[self.skip :]
        return chain_angle_deg(rig, self.short)[self.where][self.skip :]


@dataclass(frozen=True, eq=False)
class RigProblem(RecordSet):
    """Satisfies :class:`validation.tracing.problem.Problem`; ``runs`` are those of each record."""

    parameters: tuple[FreeParameter, ...]
    start: Values
    runs: tuple[tuple[Run, ...], ...]
    scale: Scale
    has: frozenset[str]

    @property
    def prior_weight_deg(self) -> float:
        """See :class:`validation.tracing.problem.Problem`: the few constants of a known rig need no hold."""
        return 0.0

    def forms(self, effect: Effect) -> tuple[RigForm, ...]:
        """Forms whose needs are met."""
        return tuple(form for form in effect.rig_forms if form.needs <= self.has)

    def starts(self, form: RigForm) -> Sequence[Values]:
        """Values to start from."""
        return form.starts(self.scale, self.runs[0][0].rig)

    def baseline(self, rig: Rig, values: Values) -> Rig:
        """Give a rig constants of the declared model."""
        return with_constants(rig, values)

    def driven(self, run: Run, values: Values) -> Run:
        """Run as the wheel sees it: as it is, for a rig that is known."""
        return run

    def program(self, drive: Floats, time_s: Floats | None, cycle: NDArray[np.int64]) -> LoadProgram:
        """Make a load program of a drive in the records' unit."""
        return LoadProgram(drive, time_s, cycle)

    def rig(self, run: Run, values: Values, added: Sequence[tuple[RigForm, Values]]) -> Rig:
        """Rig of a run with constants of the declared model, and with effects."""
        rig = self.baseline(run.rig, values)
        for form, more in added:
            if form.rig is not None:
                rig = form.rig(rig, more)
        return rig

    def predict(self, values: Values, added: Sequence[tuple[RigForm, Values]]) -> list[Floats]:
        """Angles of all records; see :meth:`validation.tracing.problem.Problem.predict`."""
        out = []
        for runs, record_inputs in zip(self.runs, self.inputs, strict=True):
            parts = [self.driven(run, values).angle_deg(self.rig(run, values, added)) for run in runs]
            out.append(observed_angle_deg(np.concatenate(parts), record_inputs, added))
        return out


def observed_angle_deg(
    angle_deg: Floats, record_inputs: SampleInputs, added: Sequence[tuple[RigForm, Values]]
) -> Floats:
    """Angle that is seen, by the effects that act on the reading."""
    for form, more in added:
        if form.observe is not None:
            angle_deg = form.observe(angle_deg, record_inputs, more)
    return angle_deg


def with_constants(rig: Rig, values: Values) -> Rig:
    """Give a rig constants of the declared model; the ratio of the ropes' stiffness stays."""
    dry = replace(
        rig.friction,
        capstan_coefficient=values["capstan_coefficient"],
        sheath_N=values.get("sheath_N", rig.friction.sheath_N),
    )
    if "youngs_modulus_GPa" in values:
        return replace(
            rig, friction=dry, material=replace(rig.material, youngs_modulus_GPa=values["youngs_modulus_GPa"])
        )
    material = replace(rig.material, loop_share=values["loop_share"], loop_angle_deg=values["loop_angle_deg"])
    a, b = rig.tendon_a, rig.tendon_b
    ratio = values["EA_N"] / a.EA_N
    return replace(
        rig,
        friction=dry,
        material=material,
        tendon_a=replace(a, EA_N=values["EA_N"]),
        tendon_b=None if b is None else replace(b, EA_N=b.EA_N * ratio),
    )


def known_rig_problem(records: Sequence[Record]) -> RigProblem | None:
    """Make the problem of records whose rigs are all known; None where one is not.

    Known is a rig with a drive in mm, or a tube and a notch under a tendon force.

    Raises
    ------
    RigError
        A rig that cannot be, or that its record breaks from the start.
    RecordError
        A record that bends the other way than its rig does.
    """
    rigs = [rig_under_tendon_force(record) if record.drive_unit == "N" else rig_of(record) for record in records]
    if any(rig is None for rig in rigs) or any(r.drive_unit not in ("mm", "N") for r in records):
        return None
    if len({record.drive_unit for record in records}) > 1:
        return None
    if records[0].drive_unit == "mm":
        _require_the_rigs_sense(records)
    most = max(LEAST_OF_RECORD, SAMPLES // len(records))
    rigs = [rig and _open(rig) for rig in rigs]
    pulled = records[0].drive_unit == "N"
    used = prepare(records, [thinned(record, most) for record in records])
    make = trial_runs if pulled else runs_of
    runs = tuple(make(one.drive, one.inputs, rig) for one, rig in zip(used, rigs, strict=True) if rig)
    inputs = [one.inputs for one in used]
    first = runs[0][0].rig
    return RigProblem(
        records=used,
        parameters=PULLED if pulled else _constants(rig for rig in rigs if rig),
        start=_start(first, pulled),
        runs=runs,
        scale=scale_of(used, [record.drive for record in records], runs, inputs),
        has=has(first, inputs, pulled=pulled),
    )


def _require_the_rigs_sense(records: Sequence[Record]) -> None:
    """Refuse angles that fall as the drive rises: to turn them round would take tendon b for tendon a, silently."""
    for record in records:
        if float((record.drive - record.drive.mean()) @ record.angle_deg) < 0:
            raise RecordError(
                f"{record.source or 'record'}: angle_deg: falls as drive_mm rises: expected the signs of the rig, in "
                "which a pull at tendon a is a positive drive and bends to positive angles"
            )


def _constants(rigs: Iterable[Rig]) -> tuple[FreeParameter, ...]:
    """Constants of the declared model under a drive in mm, within what a rig that was declared so can be.

    Friction and stretch make good for each other: without bounds, an effect that is missing drives both to where no
    rig is, and no effect added there finds back.
    """
    all_rigs = tuple(rigs)
    rig = all_rigs[0]
    preload = max(r.preload_N for r in all_rigs)
    turn, EA = rig.material.loop_angle_deg, rig.tendon_a.EA_N
    return (
        FreeParameter("sheath_N", "N", 0.0, max(4 * rig.friction.sheath_N, 0.3 * preload, 1.0), 1.0),
        FreeParameter("capstan_coefficient", "-", 0.0, 0.5, 0.05),
        FreeParameter("loop_share", "-", 0.0, 0.9, 0.2),
        FreeParameter("loop_angle_deg", "deg", turn / 4, 4 * turn, 0.4, log=True),
        FreeParameter("EA_N", "N", EA / 4, 4 * EA, 0.2, log=True),
    )


def _open(rig: Rig) -> Rig:
    """Let notches pass through each other where no closure is declared: it is for the data to say that they close."""
    return rig if rig.closure is not None else replace(rig, closure=Closure(SOFT, NEVER_DEG))


def _start(rig: Rig, pulled: bool) -> Values:
    """Constants as declared; friction and loop not from zero, where they have no slope to go by."""
    mu = max(rig.friction.capstan_coefficient, 0.02)
    if pulled:
        return {"youngs_modulus_GPa": rig.material.youngs_modulus_GPa, "capstan_coefficient": mu}
    material = rig.material
    return {
        "sheath_N": max(rig.friction.sheath_N, 0.02 * rig.preload_N),
        "capstan_coefficient": mu,
        "loop_share": min(max(material.loop_share, 0.1), 0.85),
        "loop_angle_deg": material.loop_angle_deg,
        "EA_N": rig.tendon_a.EA_N,
    }


def rig_under_tendon_force(record: Record) -> Rig | None:
    """Rig of one tendon from a record's tube and notch, under a tendon force; None where they are not given.

    What the tables do not say is assumed: 50 GPa (40 to 60 GPa are fitted to such tubes, GitHub
    nepacheco/MastersThesis 4f920c7; identified in any case), a rope along the wall opposite to the metal that is left,
    rigid rings. The shape at rest is the angle without force.
    """
    if not record.tube or not record.notch:
        return None
    rig_of(record)  # checks its [rig] table, too
    known = notched_tube_of(record)
    assert known is not None
    tube, notch = known.tube, replace(known.notch, rigid_roots=True)
    free = record.angle_deg[record.drive <= 0.05 * record.drive.max()]
    rest = float(free.mean()) / notch.count if free.size else 0.0
    rope = Tendon(EA_N=5_000.0, moment_arm_mm=tube.inner_diameter_mm / 2 - _ROPE_WALL_MM, free_length_mm=200.0)
    return Rig(
        name="wrist",
        material=Material(_YOUNG_GPA, 0.33),
        tendon_a=rope,
        tendon_b=None,
        wheel=Wheel(10.0),
        preload_N=0.0,
        precurvature_deg=rest,
        friction=Friction(),
        joint=NotchedTube(tube, notch),
    )


def thinned(record: Record, most: int) -> NDArray[np.int64]:
    """Choose samples of a record to work on, at most about ``most``: evenly, with all turning points.

    With the first sample of every cycle, too: what changes with the cycle changes there.
    """
    m = record.drive.size
    keep = np.zeros(m, dtype=bool)
    keep[:: max(1, math.ceil(m / most))] = True
    keep[[0, *(branch.stop - 1 for branch in branches(record.drive))]] = True
    keep[np.flatnonzero(np.diff(cycle_index(record))) + 1] = True
    return np.flatnonzero(keep)


def trial_runs(force_N: Floats, record_inputs: SampleInputs, rig: Rig) -> tuple[Run, ...]:
    """Make a run from rest of every trial of a record under a tendon force, shape (m,)."""
    force = np.maximum(force_N, 0.0)  # the zero of a load cell wanders
    starts = np.flatnonzero(np.append(True, np.diff(record_inputs.cycle) != 0))
    return tuple(Run(rig, part, 0) for part in np.split(force, starts[1:]))


def runs_of(drive: Floats, record_inputs: SampleInputs, rig: Rig) -> tuple[Run, ...]:
    """Make a run from rest of a record whose wheel winds in ``drive``, mm, shape (m,)."""
    way = _approach(drive)
    step = np.diff(record_inputs.time_s).mean()
    time = np.concatenate([record_inputs.time_s[0] - step * np.arange(way.size, 0, -1), record_inputs.time_s])
    cycle = np.concatenate([np.zeros(way.size, dtype=np.int64), np.maximum(record_inputs.cycle, 0)])
    program = LoadProgram(np.concatenate([way, drive]), time_s=time if record_inputs.timed else None, cycle=cycle)
    repeats = _repeats(program.drive_mm)
    if repeats is None:
        return (Run(rig, program, way.size),)
    end, where = repeats
    return (Run(rig, program, way.size, LoadProgram(program.drive_mm[:end]), where),)


def _repeats(drive: Floats) -> tuple[int, NDArray[np.int64]] | None:
    """Find cycles that repeat each other: samples up to the second one's end, and which of them each sample is like."""
    ends = [branch.stop - 1 for branch in branches(drive)]
    if len(ends) < 4:
        return None
    start, period = ends[0], ends[2] - ends[0]
    if not np.allclose(drive[start + period :], drive[start:-period], rtol=0, atol=_EXACTLY * np.ptp(drive)):
        return None
    k = np.arange(drive.size)
    return start + 2 * period + 1, np.where(k <= start + 2 * period, k, start + period + (k - start) % period)


def _approach(drive: Floats) -> Floats:
    """Way from rest to the first sample of a record that begins elsewhere: once through its range, as a guess."""
    low, high, first = float(drive.min()), float(drive.max()), float(drive[0])
    if abs(first) <= AT_REST * (high - low):
        return np.empty(0)
    ends = [0.0, high, low, first] if first < 0.5 * (low + high) else [0.0, low, high, first]
    way = [
        np.linspace(a, b, max(2, math.ceil(abs(b - a) / (high - low) * _APPROACH)))[:-1]
        for a, b in pairwise(ends)
        if a != b
    ]
    return np.concatenate(way)


def scale_of(
    records: Sequence[PreparedRecord],
    drives: Sequence[Floats],
    runs: Sequence[Sequence[Run]],
    inputs: Sequence[SampleInputs],
) -> Scale:
    """Orders of magnitude, the mechanical ones by the rigs as they are declared.

    Parameters
    ----------
    drives
        Whole drive of each record in mm, or force in N.
    """
    angles = [one.record.angle_deg for one in records]
    solved = [run.solve(run.rig).record for all_of in runs for run in all_of]
    notches = [np.abs(r.notches_deg).max() for r in solved if r.notches_deg is not None]
    tips = [np.abs(r.tip_mm[:, 1]).max() for r in solved if r.tip_mm is not None]
    rig = runs[0][0].rig
    young = rig.material.youngs_modulus_GPa * 1e3
    seen = max(map(_reach_deg, angles)) / rig.joints
    joint = max(seen, float(max(notches)))
    times = [s.time_s for s in inputs]
    speeds = [np.abs(np.diff(s.drive) / np.diff(s.time_s)).max() for s in inputs]
    return Scale(
        drive=max(float(np.ptp(drive)) for drive in drives) / 2,
        angle_deg=max(float(np.ptp(angle)) for angle in angles) / 2,
        joint_deg=joint,
        tip_mm=float(max(tips)),
        stress_MPa=young * strain_per_rad(rig) * math.radians(joint),
        duration_s=min(float(t[-1] - t[0]) for t in times),
        longest_s=max(float(t[-1] - t[0]) for t in times),
        speed=float(max(speeds)),
        cycles=max(1.0, float(max(s.cycle.max() for s in inputs))),
    )


def _reach_deg(angle_deg: Floats) -> float:
    """Largest bend that a record shows for sure: half its range where its zero may be anywhere."""
    low, high = float(angle_deg.min()), float(angle_deg.max())
    return max(-low, high) if abs(low + high) < 0.5 * (high - low) else 0.5 * (high - low)


def has(rig: Rig, inputs: Sequence[SampleInputs], *, pulled: bool) -> frozenset[Any]:
    """Give the needs that are met."""
    there = set()
    if all(s.timed for s in inputs):
        there.add("time")
    if pulled:
        there.add("force")
    else:
        there.add("wheel")
        if cycles_repeat(inputs):
            there.add("cycles")
    if rig.tendon_b is not None:
        there.add("two tendons")
    return frozenset(there)
