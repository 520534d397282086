"""Baseline of a known rig that bends in space: both bending angles, and torsion, by the chain in space.

Every angle of a record stands as a record: with its zero, its noise and its errors. The parameters are those of
:mod:`validation.tracing.baseline.known_rig`; the fit takes a run for each derivative.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from fem_models.rig import Rig
from fem_models.rig.checks import SolverError
from fem_models.rig.of_record import bends_in_space, rig_in_space_of
from fem_models.rig.rig import Friction, Material
from fem_models.spatial import SpatialProgram, SpatialRig, SpatialSolution, of_rig_in_space, solve_spatial
from hysteresis.arrays import Floats, Ints
from hysteresis.records.path import cycle_index, require_reversal
from hysteresis.records.record import FURTHER_DRIVES, Record, RecordError
from validation.tracing.baseline.channels_in_space import channels_in_space, in_space, left_out
from validation.tracing.baseline.known_rig import declared_start, drive_parameters
from validation.tracing.baseline.samples import fastest, kept_samples
from validation.tracing.effect import Effect, FreeParameter, Need, Scale, SpaceForm, Values
from validation.tracing.fitting.holdout import Holdout, divide_records
from validation.tracing.prepared import PreparedRecord, RecordSet, prepared
from validation.tracing.settings import FROM_REST, KNOWN_RIG_SAMPLES, LEAST_RECORD_SAMPLES

BENDING = ("angle", "angle_2")
Added = Sequence[tuple[SpaceForm, Values]]


@dataclass(frozen=True, eq=False)
class SpaceRun:
    """A record as a run of its rig from rest.

    ``wheels_mm`` (m, wheels) is the path that is run, ``winding`` (wheels, tendons) what a wheel winds in of each
    tendon, and ``at`` the samples of the path that each angle of the record is fitted at.
    """

    chain: SpatialRig
    winding: Floats
    wheels_mm: Floats
    at: tuple[Ints, ...]

    def solve(self, chain: SpatialRig, wheels_mm: Floats) -> SpatialSolution:
        """Run a chain along a motion of the wheels."""
        return solve_spatial(chain, SpatialProgram(wheels_mm @ self.winding))


@dataclass(frozen=True, eq=False)
class SpaceProblem(RecordSet):
    """Records of a known rig in space; see :class:`validation.tracing.problem.Problem`.

    ``records`` are the ``angles`` of the first record, then those of the second one, and so on. Effects that are added
    do not act on the last ``reference`` runs; those of ``shared`` act on all, and are parameters of the baseline.
    """

    parameters: tuple[FreeParameter, ...]
    start: Values
    runs: tuple[SpaceRun, ...]
    angles: tuple[str, ...]
    scale: Scale
    needs: frozenset[Need]
    reference: int = 0
    shared: tuple[SpaceForm, ...] = ()

    @property
    def prior_weight_deg(self) -> float:
        """See :class:`validation.tracing.problem.Problem`: the few parameters of a known rig need no prior."""
        return 0.0

    def forms(self, effect: Effect) -> tuple[SpaceForm, ...]:
        """Forms whose needs are met."""
        return tuple(form for form in effect.space_forms if form.needs <= self.needs)

    def starts(self, form: SpaceForm) -> Sequence[Values]:
        """Give starting values of a form's parameters."""
        return form.starts(self.scale)

    def divided(self) -> Holdout:
        """Divide the records into training samples and held-out samples: all angles of a record alike."""
        count = len(self.angles)
        parts = [self._divided(self.records[k::count]) for k in range(count)]
        by_record = zip(*(part.train for part in parts), strict=True)
        first = tuple(range(0, len(self.records), count))
        whole = frozenset(i * count + k for k, part in enumerate(parts) for i in part.whole)
        masks = tuple(mask for masks in by_record for mask in masks)
        return Holdout(masks, parts[0].by, first, whole, self.reference * count)

    def _divided(self, records: Sequence[PreparedRecord]) -> Holdout:
        """Divide within each record where some are a reference: else all that has changed may be held out."""
        if not self.reference:
            return divide_records(records)
        parts = [divide_records([one]) for one in records]
        return Holdout(tuple(part.train[0] for part in parts), "; ".join(dict.fromkeys(part.by for part in parts)))

    def predict(self, values: Values, added: Added) -> list[Floats]:
        """Angles of all records; see :meth:`validation.tracing.problem.Problem.predict`."""
        return self.predict_series(values, added)[: len(self.records)]

    def predict_series(self, values: Values, added: Added) -> list[Floats]:
        """Angles of all records, then each channel of all runs."""
        out, others = list[Floats](), list[dict[str, Floats]]()
        traced = len(self.runs) - self.reference
        shared = [(form, {p.name: values[_of_all(p.name)] for p in form.parameters}) for form in self.shared]
        for number, run in enumerate(self.runs):
            chain, wheels = with_parameters(run.chain, values), run.wheels_mm
            acting = (*shared, *(added if number < traced else ()))
            for form, more in acting:
                chain = chain if form.chain is None else form.chain(chain, more)
                wheels = wheels if form.wheels is None else form.wheels(wheels, more)
            solved = run.solve(chain, wheels)
            bending = solved.bending_deg
            for form, more in acting:
                bending = bending if form.sensor is None else form.sensor(bending, more)
            series = (*bending.T, solved.torsion_deg)
            for angle, at, own in zip(self.angles, run.at, series, strict=False):
                read, inputs = own[at], self.inputs[len(out)]
                for form, more in acting:
                    if form.observe is not None and angle in form.angles:
                        read = form.observe(read, inputs, more)
                out.append(read)
            others.append({name: own[run.at[0]] for name, own in in_space(solved, acting).items()})
        return [*out, *(own[channel.name] for channel in self.channels for own in others)]


def _of_all(name: str) -> str:
    """Name of a parameter of an effect that all records have, reference included."""
    return f"{name}_of_all"


def with_reference(problem: SpaceProblem, reference: int, shared: Sequence[tuple[SpaceForm, Values]]) -> SpaceProblem:
    """Compare records with the last of them, so many runs; effects of those are shared by all."""
    more = [(one, values[one.name]) for form, values in shared for one in form.parameters]
    return replace(
        problem,
        reference=reference,
        shared=tuple(form for form, _ in shared),
        parameters=(*problem.parameters, *(replace(one, name=_of_all(one.name)) for one, _ in more)),
        start={**problem.start, **{_of_all(one.name): value for one, value in more}},
        needs=problem.needs | {"reference"},
    )


def with_parameters(chain: SpatialRig, values: Values) -> SpatialRig:
    """Give a chain the parameters of the baseline; the ratios of the tendons' stiffnesses stay."""
    ratio = values["EA_N"] / chain.tendons[0].tendon.EA_N
    friction: Friction = replace(
        chain.friction,
        capstan_coefficient=values["capstan_coefficient"],
        sheath_N=values["sheath_N"],
        stick_compliance_mm_per_N=values["stick_compliance_mm_per_N"],
    )
    material: Material = replace(
        chain.material, loop_share=values["loop_share"], loop_angle_deg=values["loop_angle_deg"]
    )
    tendons = [replace(one, tendon=replace(one.tendon, EA_N=one.tendon.EA_N * ratio)) for one in chain.tendons]
    return replace(chain, friction=friction, material=material, tendons=tuple(tendons))


def space_problem(records: Sequence[Record]) -> SpaceProblem | None:
    """Make the problem of records whose rigs all bend in space; None where none does.

    Raises
    ------
    RigError
        A rig that cannot be.
    RecordError
        Records of which some rigs bend in space and others do not; a record without a second angle or a wheel's drive,
        with a drive in another unit than mm, or one that does not begin with all wheels at zero.
    SolverError
        A rig that does not follow its record.
    """
    found = [bends_in_space(record) for record in records]
    if not any(found):
        return None
    if not all(found):
        other = records[found.index(False)]
        raise RecordError(f"{other.source or 'record'}: rig: of one plane: expected a rig in space, as of the others")
    rigs = [rig_in_space_of(record) for record in records]
    wheels = [_wheels_mm(record, rig) for record, rig in zip(records, rigs, strict=True)]
    twists = all(one.torsion_deg is not None for one in records) and any(_moves(one.torsion_deg) for one in records)
    angles = (*BENDING, "torsion") if twists else BENDING
    most = max(LEAST_RECORD_SAMPLES, KNOWN_RIG_SAMPLES // len(records))
    used, runs = list[PreparedRecord](), list[SpaceRun]()
    for number, (record, rig, path) in enumerate(zip(records, rigs, wheels, strict=True)):
        own = _angle_records(record, path, angles, number)
        kept = _kept(path, cycle_index(own[0]), most)
        ready = [prepared(one, kept) for one in own]
        along = np.unique(np.concatenate([one.kept for one in ready]))
        at = tuple(np.searchsorted(along, one.kept) for one in ready)
        used += ready
        runs.append(SpaceRun(of_rig_in_space(rig), rig.winding(), path[along], at))
    channels = channels_in_space(records, used, min(len(rig.angles_deg) for rig in rigs))
    needs: set[Need] = {"time"} if all(one.inputs.timed for one in used) else set()
    needs |= {"torsion"} if twists else set()
    return SpaceProblem(
        records=tuple(used),
        channels=channels,
        channel_words=left_out(records, channels),
        parameters=drive_parameters([rig.in_plane for rig in rigs]),
        start=declared_start(rigs[0].in_plane, load_control=False),
        runs=tuple(runs),
        angles=angles,
        scale=_scale(used, runs, records),
        needs=frozenset(needs),
    )


def _moves(values: Floats | None) -> bool:
    return values is not None and float(np.ptp(values)) > 0.0


def _wheels_mm(record: Record, rig: Rig) -> Floats:
    """Motion of all wheels, shape (m, wheels), from zero on."""
    where = record.source or "record"
    if record.drive_unit != "mm":
        raise RecordError(f"{where}: drive.unit = {record.drive_unit}: expected mm, for a rig in space")
    if record.angle_2_deg is None:
        raise RecordError(f"{where}: columns.angle_2: missing: expected both angles of a rig in space")
    columns = [record.drive]
    for key in FURTHER_DRIVES[: rig.wheel_count - 1]:
        drive = getattr(record, key)
        if drive is None:
            raise RecordError(f"{where}: columns.{key}: missing: expected a drive for each of {rig.wheel_count} wheels")
        columns.append(drive)
    wheels = np.column_stack(columns)
    span = float(np.ptp(wheels, axis=0).max())
    if float(np.abs(wheels[0]).max()) > FROM_REST * span:
        first = ", ".join(f"{value:g}" for value in wheels[0])
        raise RecordError(f"{where}: drive: begins at {first} mm: expected all wheels of a rig in space to begin at 0")
    return wheels


def _angle_records(record: Record, wheels_mm: Floats, angles: Sequence[str], number: int) -> list[Record]:
    """Each angle of a record as a record, over the drive of the wheel that moves most."""
    drive = wheels_mm[:, int(np.ptp(wheels_mm, axis=0).argmax())]
    name = record.source.removesuffix(".csv") or f"record {number + 1}"
    given = {"angle": record.angle_deg, "angle_2": record.angle_2_deg, "torsion": record.torsion_deg}
    values = {name: value for name, value in given.items() if value is not None}
    plain = Record(
        drive, record.angle_deg, title=record.title, kind=record.kind, time_s=record.time_s, cycle=record.cycle,
        rig=record.rig, source=record.source,
    )  # fmt: skip
    require_reversal(plain)
    plain = replace(plain, cycle=cycle_index(plain))
    return [replace(plain, angle_deg=values[angle], source=f"{name} {angle}") for angle in angles]


def _kept(wheels_mm: Floats, cycle: Ints, most: int) -> Ints:
    """Choose samples with the turning points of all wheels that move."""
    moving = [column for column in wheels_mm.T if np.ptp(column) > 0]
    return np.unique(np.concatenate([kept_samples(column, most, cycle) for column in moving]))


def _solved(run: SpaceRun, record: Record) -> SpatialSolution:
    """Run a declared rig; where it finds no equilibrium, the record is named that drives it there."""
    try:
        return run.solve(run.chain, run.wheels_mm)
    except SolverError as error:
        raise SolverError(f"{record.source or 'record'}: {error}") from None


def _scale(used: Sequence[PreparedRecord], runs: Sequence[SpaceRun], records: Sequence[Record]) -> Scale:
    """Orders of magnitude, the tip's from runs of the declared rigs; stresses are those of no effect here."""
    solved = [_solved(run, record) for run, record in zip(runs, records, strict=True)]
    times = [one.inputs.time_s for one in used]
    speeds = [fastest(one.inputs.drive, one.inputs.time_s) for one in used]
    return Scale(
        drive=max(float(np.ptp(run.wheels_mm, axis=0).max()) for run in runs) / 2,
        angle_deg=max(float(np.ptp(one.angle_deg)) for one in used) / 2,
        joint_deg=max(float(np.abs(one.notches_deg).max()) for one in solved),
        tip_mm=max(float(np.abs(one.tip_mm[:, 1:]).max()) for one in solved),
        stress_MPa=0.0,
        duration_s=min(float(t[-1] - t[0]) for t in times),
        longest_s=max(float(t[-1] - t[0]) for t in times),
        speed=float(max(speeds)),
        cycles=max(1.0, float(max(one.inputs.cycle.max() for one in used))),
    )
