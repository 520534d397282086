"""Records of a rig as runs from rest of the compiled chain, derived once for a fit of hundreds of runs."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from itertools import pairwise

import numpy as np

from fem_models.chain.along import ChainSeries
from fem_models.chain.solve import ChainSolution, chain_angle_deg, solve_chain, solve_chain_by_force
from fem_models.joint.strain import strain_per_rad
from fem_models.load import LoadProgram
from fem_models.rig import Rig, RigError
from fem_models.rig.checks import SolverError
from hysteresis.arrays import Floats, Ints
from hysteresis.records.path import branches
from hysteresis.records.record import Record
from validation.tracing.baseline.samples import fastest
from validation.tracing.effect import Need, SampleInputs, Scale, cycles_repeat
from validation.tracing.prepared import Channel, PreparedRecord
from validation.tracing.settings import APPROACH_SAMPLES, EXACT_REPEAT, FROM_REST, SAME_PRELOAD


@dataclass(frozen=True, eq=False)
class Run:
    """A piece of a record as a run of its rig from rest; the first ``skip`` samples of the run are its approach.

    Cycles that repeat each other exactly need not be run again by a rig without a memory for time and cycles:
    ``short`` ends after the second one, and ``where`` gives its sample that stands for each sample of the run. The
    drive may have come to the first sample from ``away_mm`` beyond it (:mod:`.first_state`).
    """

    rig: Rig
    program: LoadProgram | Floats  # tendon forces, N, under load control
    skip: int
    short: LoadProgram | None = None
    where: Ints | None = None
    away_mm: float = 0.0

    def solve(self, rig: Rig) -> ChainSolution:
        """Run a rig through it."""
        if isinstance(self.program, LoadProgram):
            return solve_chain(rig, self.program)
        return solve_chain_by_force(rig, self.program)

    def angle_deg(self, rig: Rig) -> Floats:
        """Angle of a rig along the record, shape (m,)."""
        if not isinstance(self.program, LoadProgram):
            return self.solve(rig).record.angle_deg[self.skip :]
        if self.short is None or not _forgets(rig):
            return chain_angle_deg(rig, self.program)[self.skip :]
        return chain_angle_deg(rig, self.short)[self.where][self.skip :]

    def load(self, rig: Rig) -> LoadProgram | Floats:
        """Load that a rig is run through: of cycles that repeat each other only two, where it has no memory."""
        return self.program if self.short is None or not _forgets(rig) else self.short

    def rows(self, series: ChainSeries, channels: Sequence[Channel]) -> Floats:
        """Angle and channels along the record, shape (m, 1 + channels), of a rig that was run through its load."""
        rows = np.column_stack([series.angle_deg, *(channel.of(series) for channel in channels)])
        shortened = self.where is not None and rows.shape[0] < self.where.size
        return (rows[self.where] if shortened else rows)[self.skip :]


def _forgets(rig: Rig) -> bool:
    """Whether a rig has no memory for time and cycles."""
    heats = rig.superelastic is not None and rig.superelastic.heating_time_s is not None
    timeless = rig.creep is None and rig.drag is None and rig.stribeck is None and not heats
    return timeless and rig.preload_loss is None and rig.fatigue is None and rig.run_in is None


@dataclass(frozen=True, eq=False)
class RunSetup:
    """What is derived of records and their declared rigs, once for all runs of a fit.

    ``runs`` are those of each record, ``scale`` the orders of magnitude of all, ``needs`` those of forms that are met.
    """

    runs: tuple[tuple[Run, ...], ...]
    scale: Scale
    needs: frozenset[Need]


def _as_it_is(drive: Floats) -> Floats:
    return drive


def run_setup(
    records: Sequence[PreparedRecord], rigs: Sequence[Rig], to_mm: Callable[[Floats], Floats] = _as_it_is
) -> RunSetup:
    """Derive the runs of records with a drive, or under a tendon force in N.

    Parameters
    ----------
    to_mm
        From a drive in the records' unit to the tendon that the wheel winds in.

    Raises
    ------
    SolverError, RigError
        A rig that does not follow its record.
    """
    load_control = records[0].record.drive_unit == "N"
    inputs = [one.inputs for one in records]
    in_mm = [replace(one, drive=to_mm(one.drive)) for one in inputs]
    cut = _force_runs if load_control else drive_runs
    rigs = [next(other for other in rigs if other == rig) for rig in rigs]  # one object, which is told at a glance
    runs = tuple(cut(rig, one) for rig, one in zip(rigs, in_mm, strict=True))
    scale = _scale([one.record for one in records], runs, in_mm, to_mm)
    return RunSetup(runs, scale, _met_needs(rigs, inputs, load_control=load_control))


def _force_runs(rig: Rig, inputs: SampleInputs) -> tuple[Run, ...]:
    """Make a run of every trial under a tendon force."""
    force = np.maximum(inputs.drive, 0.0)  # the zero of a load cell wanders
    starts = np.flatnonzero(np.append(True, np.diff(inputs.cycle) != 0))
    return tuple(Run(rig, part, 0) for part in np.split(force, starts[1:]))


def drive_runs(rig: Rig, inputs: SampleInputs) -> tuple[Run, ...]:
    """Make one run of a record that is driven in mm, with an approach from rest where it begins elsewhere."""
    approach = _approach(inputs.drive)
    step = np.diff(inputs.time_s).mean()
    time = np.concatenate([inputs.time_s[0] - step * np.arange(approach.size, 0, -1), inputs.time_s])
    cycle = np.concatenate([np.zeros(approach.size, dtype=np.int64), np.maximum(inputs.cycle, 0)])
    program = LoadProgram(np.concatenate([approach, inputs.drive]), time_s=time if inputs.timed else None, cycle=cycle)
    repeats = _repeats(program.drive_mm)
    if repeats is None:
        return (Run(rig, program, approach.size),)
    end, where = repeats
    return (Run(rig, program, approach.size, LoadProgram(program.drive_mm[:end]), where),)


def _repeats(drive: Floats) -> tuple[int, Ints] | None:
    """Find cycles that repeat each other: where the second one ends, and the sample that each sample is like."""
    ends = [branch.stop - 1 for branch in branches(drive)]
    if len(ends) < 4:
        return None
    start, period = ends[0], ends[2] - ends[0]
    if not np.allclose(drive[start + period :], drive[start:-period], rtol=0, atol=EXACT_REPEAT * np.ptp(drive)):
        return None
    k = np.arange(drive.size)
    return start + 2 * period + 1, np.where(k <= start + 2 * period, k, start + period + (k - start) % period)


def _approach(drive: Floats) -> Floats:
    """Guess the path from rest to the first sample of a record that begins elsewhere: once through its range."""
    low, high, first = float(drive.min()), float(drive.max()), float(drive[0])
    if abs(first) <= FROM_REST * (high - low):
        return np.empty(0)
    ends = [0.0, high, low, first] if first < 0.5 * (low + high) else [0.0, low, high, first]
    path = [
        np.linspace(a, b, max(2, math.ceil(abs(b - a) / (high - low) * APPROACH_SAMPLES)))[:-1]
        for a, b in pairwise(ends)
        if a != b
    ]
    return np.concatenate(path)


def _scale(
    records: Sequence[Record],
    runs: Sequence[Sequence[Run]],
    inputs: Sequence[SampleInputs],
    to_mm: Callable[[Floats], Floats],
) -> Scale:
    """Orders of magnitude, the mechanical ones from runs of the declared rigs."""
    solved = [_solved(run, record) for record, of_record in zip(records, runs, strict=True) for run in of_record]
    notches = [np.abs(r.notches_deg).max() for r in solved if r.notches_deg is not None]
    tips = [np.abs(r.tip_mm[:, 1]).max() for r in solved if r.tip_mm is not None]
    rig = runs[0][0].rig
    young = rig.material.youngs_modulus_GPa * 1e3
    measured = max(map(_reach_deg, records)) / rig.joints
    joint = max(measured, float(max(notches)))
    times = [s.time_s for s in inputs]
    speeds = [fastest(s.drive, s.time_s) for s in inputs]
    return Scale(
        drive=max(float(np.ptp(to_mm(r.drive))) for r in records) / 2,
        angle_deg=max(float(np.ptp(r.angle_deg)) for r in records) / 2,
        joint_deg=joint,
        tip_mm=float(max(tips)),
        stress_MPa=young * strain_per_rad(rig) * math.radians(joint),
        duration_s=min(float(t[-1] - t[0]) for t in times),
        longest_s=max(float(t[-1] - t[0]) for t in times),
        speed=float(max(speeds)),
        cycles=max(1.0, float(max(s.cycle.max() for s in inputs))),
    )


def _solved(run: Run, record: Record) -> Record:
    """Run a declared rig; where it finds no equilibrium, the record is named that drives it there."""
    try:
        return run.solve(run.rig).record
    except (SolverError, RigError) as error:
        raise type(error)(f"{record.source or 'record'}: {error}") from None


def _reach_deg(record: Record) -> float:
    """Largest bend that a record shows for sure, deg.

    A tendon force starts from rest, and so does a drive that goes one way from zero: the whole angle is bend. Where the
    drive goes both ways, or never to zero, the zero of the angle may be anywhere, and half its range is bend for sure.
    """
    angle, drive = record.angle_deg, record.drive
    low, high, span = float(angle.min()), float(angle.max()), float(np.ptp(angle))
    if record.drive_unit == "N":
        return max(-low, high, span)
    if min(abs(float(drive.min())), abs(float(drive.max()))) <= FROM_REST * float(np.ptp(drive)):
        return span
    return max(-low, high) if abs(low + high) < 0.5 * span else 0.5 * span


def _met_needs(rigs: Sequence[Rig], inputs: Sequence[SampleInputs], *, load_control: bool) -> frozenset[Need]:
    """Needs of forms (:attr:`validation.tracing.effect.RigForm.needs`) that records and rig meet."""
    needs: set[Need] = {"force" if load_control else "wheel"}
    if all(s.timed for s in inputs):
        needs.add("time")
    if not load_control and cycles_repeat(inputs):
        needs.add("cycles")
    preloads = [rig.preload_N for rig in rigs]
    needs.add("preloads" if max(preloads) > (1 + SAME_PRELOAD) * min(preloads) else "one preload")
    needs.add("two tendons" if rigs[0].tendon_b is not None else "one tendon")
    if rigs[0].superelastic is not None:
        needs.add("declared plateau")
    return frozenset(needs)
