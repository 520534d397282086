"""Baseline of records of unknown geometry: the simplest rig that could have made them.

Six measured joints between two equal tendons on the compiled chain (:mod:`fem_models.chain.solve`). Fitted are
stiffness, moment arm, the tendons with their toe region, friction of sheath, capstan and (a little) guides, the loop of
the material, and a monotone cubic between drive and wheel, which is f of the curve model. Those are fewer parameters
than f and a Bouc-Wen loop of free size in every preload have, and the loops that they can make are those of a rig:
play, slack and dampers are not among them. Forces are in proportion to the preload, 20 N where no record states one.
Lengths of tendon are given in the drive's unit.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import lru_cache

import numpy as np

from fem_models.load import LoadProgram
from fem_models.rig import Rig
from fem_models.rig.effects import Closure
from fem_models.rig.joints import MeasuredJoint
from fem_models.rig.rig import Friction, Material, Tendon, Wheel
from hysteresis.arrays import Floats, Ints
from hysteresis.records.path import cycle_index
from hysteresis.records.record import Record, RecordError
from validation.tracing.baseline.first_state import as_started
from validation.tracing.baseline.known_rig import SOFT_STICK, soft_mm_per_N, stick_compliance
from validation.tracing.baseline.rig_problem import Added, RigProblem
from validation.tracing.baseline.runs import Run, drive_runs, run_setup
from validation.tracing.baseline.samples import kept_samples, mean_slope, middle_of
from validation.tracing.effect import OPEN_NOTCHES, Effect, FreeParameter, RigForm, Scale, Values
from validation.tracing.prepared import prepare
from validation.tracing.problem import Problem, require_one_unit
from validation.tracing.settings import (
    EQUIVALENT_JOINTS,
    EQUIVALENT_RIG_SAMPLES,
    LARGEST_CUBIC,
    LARGEST_GUIDE_FRICTION,
    LARGEST_TOE,
    LEAST_TOE,
    PRIOR_WEIGHT,
    REFINED_PARTS,
    REFINED_SAMPLES,
)

_ARM_MM, _PITCH_MM, _FREE_MM, _WHEEL_MM = 2.5, 6.0, 150.0, 10.0
_FREE_BOUNDS_MM = (36.0, 600.0)
"""1 to 17 times the length that bends: a longer dry tendon stands still after a reversal, as play does."""
_PRELOAD_N, _EA_N, _STIFFNESS = 20.0, 10_000.0, 120.0
_tendon, _friction, _material = lru_cache(256)(Tendon), lru_cache(256)(Friction), lru_cache(256)(Material)
"""Parts of the rigs of one Jacobian are mostly the same: one parameter moves, in every run."""
LARGEST_RANGE_DEG = 1e5
"""Of an angle: hundreds of turns are far beyond any bend, and within the numbers that a rig may have."""
_GAP = FreeParameter("rigid_gap_mm", "mm", 0.0, 0.5 * _PITCH_MM / REFINED_PARTS**2, 0.05)
_ROOTS_SHARE = 1 / 3
"""Of the refined problem alone: the part of a notch that does not bend, which shortens the paths of both tendons in a
bend, and the part of the compliance in the roots of a flexure, that of the preset ``du2018``. Both show in a deep
bend; the search does without, since the effects are larger."""


@dataclass(frozen=True, eq=False)
class EquivalentRigProblem(RigProblem):
    """Records of a rig whose whole geometry is fitted; see :class:`validation.tracing.problem.Problem`.

    The wheel winds in (x - ``middle``) ``mm_per_unit`` of a drive x in ``unit``, at most ``half_mm`` either way.
    ``preload_N`` is the largest. The parameters are those of six joints, each of which is run as ``parts``.
    ``preload_stated`` is whether the records state it.
    """

    middle: float
    mm_per_unit: float
    half_mm: float
    unit: str
    preload_N: float
    parts: int = 1
    preload_stated: bool = False

    @property
    def prior_weight_deg(self) -> float:
        """See :class:`validation.tracing.problem.Problem`."""
        return PRIOR_WEIGHT * self.scale.angle_deg

    def forms(self, effect: Effect) -> tuple[RigForm, ...]:
        """Forms whose needs are met, lengths of tendon in the drive's unit."""
        return tuple(_in_unit(form, self.unit, self.mm_per_unit) for form in super().forms(effect))

    def starts(self, form: RigForm) -> Sequence[Values]:
        """Give starting values; those of a toe region are half of the softest one of the baseline, and beyond it.

        Slack is also started beside tendons with hardly a toe region, which would take its place; with none at all a
        rig of slack tendons often has no equilibrium.
        """
        starts, own = super().starts(form), {p.name for p in form.parameters}
        if f"slack_{self.unit}" in own and "toe_N" in self.start:
            return [*starts, *({**start, "toe_N": LEAST_TOE * self.preload_N} for start in starts)]
        if "toe_N" not in own:
            return starts
        softest = self.runs[0][0].rig.tendon_a.toe_N
        return [{"toe_N": 0.5 * softest}, *({**start, "toe_N": softest + start["toe_N"]} for start in starts)]

    def baseline_rig(self, rig: Rig, values: Values) -> Rig:
        """Give a rig the parameters of the baseline."""
        tendon = _tendon(
            values["EA_at_preload_N"],
            values["moment_arm_mm"],
            values["free_length_mm"],
            values.get("toe_N", 0.0),
        )
        friction = _friction(
            values["capstan_coefficient"],
            values["guide_N"],
            values["sheath_N"],
            rig.friction.rest_wrap_deg,
            values["stick_compliance_mm_per_N"],
        )
        declared = rig.material
        material = _material(
            declared.youngs_modulus_GPa, declared.poissons_ratio, values["loop_share"], values["loop_angle_deg"]
        )
        assert isinstance(rig.joint, MeasuredJoint)
        joint = replace(
            rig.joint,
            flexure_stiffness_Nmm_per_rad=values["flexure_stiffness_Nmm_per_rad"],
            rigid_gap_mm=values.get("rigid_gap_mm", 0.0),
        )
        return replace(rig, tendon_a=tendon, tendon_b=tendon, friction=friction, material=material, joint=joint)

    def rig(self, run: Run, values: Values, added: Added) -> Rig:
        """Rig of a run with the parameters of the baseline, and with effects.

        The tendons are as stiff at the largest preload as their parameter says, however soft their toe is. A parameter
        that the baseline and an effect have in common is the effect's alone: it is not declared but fitted, and of a
        sum neither part can be identified.
        """
        theirs = {p.name for form, _ in added for p in form.parameters} & values.keys()
        rig = super().rig(run, {**values, **dict.fromkeys(theirs, 0.0)}, added)
        a, b = rig.tendon_a, rig.tendon_b
        assert b is not None
        if a.toe_N or b.toe_N:
            rig = replace(rig, tendon_a=self._as_stiff(a), tendon_b=self._as_stiff(b))
        return divided(rig, self.parts)

    def _as_stiff(self, tendon: Tendon) -> Tendon:
        """Make a tendon with a toe region as stiff at the largest preload as it is without."""
        stiff = tendon.EA_N * (1.0 + tendon.toe_N / self.preload_N)
        return _tendon(stiff, tendon.moment_arm_mm, tendon.free_length_mm, tendon.toe_N)

    def driven(self, run: Run, values: Values) -> Run:
        """Run behind the cubic, whose slope is u + even u^2 / 2 + odd u^3 / 3 of the drive over its range."""
        return _driven(run, self.half_mm, values["even"], values["odd"])

    def tendon_mm(self, drive: Floats) -> Floats:
        """Tendon that the wheel winds in, from the drive; shapes (m,)."""
        return (drive - self.middle) * self.mm_per_unit

    def program(self, drive: Floats, time_s: Floats | None, cycle: Ints) -> LoadProgram:
        """Make a load program of a drive in the records' unit."""
        return LoadProgram(self.tendon_mm(drive), time_s, cycle)


def equivalent_rig_problem(records: Sequence[Record], samples: int = EQUIVALENT_RIG_SAMPLES) -> EquivalentRigProblem:
    """Make the problem of records of one rig that is not known.

    Parameters
    ----------
    records
        All with one unit of the drive, not N; ``rig["preload_N"]`` is used where all have it.
    samples
        Of a record at most, about.

    Raises
    ------
    RecordError
        Records of different units of the drive, or an angle that no manipulator bends to.
    SolverError
        A drive that no such rig follows.
    """
    require_one_unit(records)
    for record in records:
        if (span := float(np.ptp(record.angle_deg))) > LARGEST_RANGE_DEG:
            where = record.source or "record"
            raise RecordError(f"{where}: angle = {span:g} deg from end to end: expected at most {LARGEST_RANGE_DEG:g}")
    used = prepare(records, [kept_samples(record.drive, samples, cycle_index(record)) for record in records])
    drives, angles = [one.drive for one in used], [one.angle_deg for one in used]
    middle, slope = middle_of(drives), mean_slope(drives, angles)
    mm_per_unit = math.copysign(math.radians(abs(slope)) * _ARM_MM, slope)
    stated = all(record.rig.get("preload_N", 0.0) > 0 for record in records)
    preloads = [float(record.rig["preload_N"]) if stated else _PRELOAD_N for record in records]
    largest, several = max(preloads), max(preloads) > 1.05 * min(preloads)
    joint_deg = 0.5 * max(float(np.ptp(angle)) for angle in angles) / EQUIVALENT_JOINTS
    rigs = [replace(_rig(largest, joint_deg), preload_N=preload) for preload in preloads]
    return EquivalentRigProblem(
        records=used,
        parameters=_parameters(largest, joint_deg, several=several),
        start=_start(largest, joint_deg, several=several),
        setup=run_setup(used, rigs, lambda drive: (drive - middle) * mm_per_unit),
        middle=middle,
        mm_per_unit=mm_per_unit,
        half_mm=max(float(np.abs((drive - middle) * mm_per_unit).max()) for drive in drives),
        unit=records[0].drive_unit,
        preload_N=largest,
        preload_stated=stated,
    )


@lru_cache(maxsize=128)
def _driven(run: Run, half_mm: float, even: float, odd: float) -> Run:
    """Run behind a cubic; remembered, because most parameters of a fit do not change the drive."""

    def bent(program: LoadProgram) -> LoadProgram:
        u = program.drive_mm / half_mm
        return replace(program, drive_mm=program.drive_mm * (1.0 + u * (0.5 * even + odd / 3.0 * u)))

    assert isinstance(run.program, LoadProgram)
    return replace(run, program=bent(run.program), short=None if run.short is None else bent(run.short))


def _with_roots(rig: Rig) -> Rig:
    """Give the joints of a rig the roots of a notched flexure."""
    assert isinstance(rig.joint, MeasuredJoint)
    return replace(rig, joint=replace(rig.joint, roots_share=_ROOTS_SHARE))


def divided(rig: Rig, parts: int) -> Rig:
    """Give a rig whose measured joints are each made of ``parts`` in series, as long and as stiff together."""
    if parts == 1:
        return rig
    joint, shut, mass, drag, tired = rig.joint, rig.closure, rig.gravity, rig.drag, rig.fatigue
    assert isinstance(joint, MeasuredJoint)
    stiff = parts * joint.flexure_stiffness_Nmm_per_rad
    return replace(
        rig,
        joint=replace(
            joint,
            joints=parts * joint.joints,
            pitch_mm=joint.pitch_mm / parts,
            flexure_stiffness_Nmm_per_rad=stiff,
            rigid_gap_mm=parts * joint.rigid_gap_mm,  # of half the angle, the square of which shortens a path
        ),
        friction=replace(rig.friction, guide_N=rig.friction.guide_N / parts),
        material=replace(rig.material, loop_angle_deg=rig.material.loop_angle_deg / parts),
        precurvature_deg=rig.precurvature_deg / parts,
        closure=shut and Closure(parts * shut.stiffness_Nmm_per_rad, shut.angle_deg and shut.angle_deg / parts),
        gravity=mass and replace(mass, ring_mass_g=mass.ring_mass_g / parts),
        drag=drag and replace(drag, joint_Nmm_s_per_rad=parts * drag.joint_Nmm_s_per_rad),
        fatigue=tired and replace(tired, residual_deg=tired.residual_deg / parts),
    )


def refined_problem(problem: Problem) -> EquivalentRigProblem:
    """Give a problem of finer samples and joints, for the last fit.

    It has :data:`REFINED_SAMPLES` a record, joints in :data:`REFINED_PARTS`, roots, and a rigid gap as a parameter
    more.
    """
    assert isinstance(problem, EquivalentRigProblem)
    records = [one.record for one in problem.records]
    used = prepare(records, [kept_samples(record.drive, REFINED_SAMPLES, cycle_index(record)) for record in records])
    in_mm = [replace(one.inputs, drive=problem.tendon_mm(one.drive)) for one in used]
    with_roots = {id(runs[0].rig): _with_roots(runs[0].rig) for runs in problem.runs}  # records share one object
    rigs = [with_roots[id(runs[0].rig)] for runs in problem.runs]
    runs = tuple(drive_runs(rig, inputs) for rig, inputs in zip(rigs, in_mm, strict=True))
    runs = tuple(tuple(map(as_started, own, before)) for own, before in zip(runs, problem.runs, strict=True))
    return replace(
        problem,
        records=used,
        setup=replace(problem.setup, runs=runs),
        parameters=(*problem.parameters, _GAP),
        start={**problem.start, _GAP.name: 0.0},
        parts=REFINED_PARTS,
    )


def _rig(preload_N: float, joint_deg: float) -> Rig:
    """Rig to start from; its toe region is the softest one of the baseline."""
    tendon = Tendon(_EA_N, _ARM_MM, _FREE_MM, toe_N=LARGEST_TOE * preload_N)
    return Rig(
        name="equivalent",
        material=Material(60.0, 0.33, loop_share=0.3, loop_angle_deg=0.6 * joint_deg),
        tendon_a=tendon,
        tendon_b=tendon,
        wheel=Wheel(_WHEEL_MM),
        preload_N=preload_N,
        friction=Friction(capstan_coefficient=0.05, sheath_N=0.05 * preload_N),
        joint=MeasuredJoint(EQUIVALENT_JOINTS, _PITCH_MM, _STIFFNESS),
        closure=OPEN_NOTCHES,
    )


def _parameters(preload_N: float, joint_deg: float, *, several: bool) -> tuple[FreeParameter, ...]:
    unit = preload_N / _PRELOAD_N
    parameters = [
        FreeParameter("sheath_N", "N", 0.0, 0.5 * preload_N, unit),
        FreeParameter("capstan_coefficient", "-", 0.0, 0.5, 0.05),
        FreeParameter(
            "guide_N",
            "N",
            0.0,
            LARGEST_GUIDE_FRICTION * preload_N / EQUIVALENT_JOINTS,
            0.1 * LARGEST_GUIDE_FRICTION * preload_N / EQUIVALENT_JOINTS,
        ),
        FreeParameter("loop_share", "-", 0.0, 0.9, 0.2),
        FreeParameter("loop_angle_deg", "deg", joint_deg / 10, 4 * joint_deg, 0.4, log=True),
        FreeParameter("EA_at_preload_N", "N", _EA_N * unit / 20, _EA_N * unit * 10, 0.2, log=True),
        FreeParameter("moment_arm_mm", "mm", 0.4 * _ARM_MM, 2.5 * _ARM_MM, 0.01, log=True),
        FreeParameter("flexure_stiffness_Nmm_per_rad", "Nmm/rad", 10.0 * unit, 5_000.0 * unit, 0.2, log=True),
        FreeParameter("free_length_mm", "mm", *_FREE_BOUNDS_MM, 0.2, log=True),
        stick_compliance(_rig(preload_N, joint_deg)),
        FreeParameter("even", "-", -LARGEST_CUBIC, LARGEST_CUBIC, 0.01),
        FreeParameter("odd", "-", -LARGEST_CUBIC, LARGEST_CUBIC, 0.01),
    ]
    if several:  # one preload does not separate a long toe region from a soft strand
        parameters.append(FreeParameter("toe_N", "N", 0.0, LARGEST_TOE * preload_N, 5.0 * unit))
    return tuple(parameters)


def _start(preload_N: float, joint_deg: float, *, several: bool) -> Mapping[str, float]:
    unit = preload_N / _PRELOAD_N
    start = {
        "sheath_N": unit,
        "capstan_coefficient": 0.05,
        "guide_N": 0.1 * LARGEST_GUIDE_FRICTION * preload_N / EQUIVALENT_JOINTS,
        "loop_share": 0.3,
        "loop_angle_deg": 0.6 * joint_deg,
        "EA_at_preload_N": 0.4 * _EA_N * unit,
        "moment_arm_mm": _ARM_MM,
        "flexure_stiffness_Nmm_per_rad": _STIFFNESS * unit,
        "free_length_mm": _FREE_MM,
        "stick_compliance_mm_per_N": SOFT_STICK / 10 * soft_mm_per_N(_rig(preload_N, joint_deg)),
        "even": 0.0,
        "odd": 0.0,
    }
    return {**start, "toe_N": 0.3 * preload_N} if several else start


_TENDON_POWERS = {
    **dict.fromkeys(
        (
            "width_mm", "free_width_mm", "preloaded_width_mm", "slack_mm", "engages_after_mm", "centre_mm",
            "rest_length_mm", "sine_mm", "cosine_mm", "radius_mm", "speed_mm_per_s",
        ),
        1,
    ),
    **dict.fromkeys(("growth_per_mm", "sheath_N_s_per_mm"), -1),
}  # fmt: skip
"""Parameters of rig forms that are lengths of tendon at the wheel to a power, or have such a length as a factor."""
_SIGNED = frozenset({"centre_mm", "cosine_mm", "growth_per_mm"})
"""Of those, what changes sign with the drive; its bounds are symmetric."""


def _in_unit(form: RigForm, unit: str, mm_per_unit: float) -> RigForm:
    """Give lengths of tendon in the drive's unit; the place of a tip stop stays in mm of the equivalent rig."""
    size = abs(mm_per_unit)
    if unit == "mm" and math.isclose(size, 1.0):
        return form
    powers = {p.name: _TENDON_POWERS[p.name] for p in form.parameters if p.name in _TENDON_POWERS}
    renamed = {name: name.replace("mm", unit) for name in powers}

    def factor(name: str) -> float:
        return float((mm_per_unit if name in _SIGNED else size) ** powers[name])

    def to_mm(values: Values) -> Values:
        return {**values, **{name: values[other] * factor(name) for name, other in renamed.items()}}

    def from_mm(values: Values) -> Values:
        return {renamed.get(name, name): v / factor(name) if name in renamed else v for name, v in values.items()}

    def converted(p: FreeParameter) -> FreeParameter:
        if p.name not in renamed:
            return p
        by = abs(factor(p.name))
        scale = p.scale if p.log else p.scale / by
        in_unit = p.unit.replace("mm", unit)
        return replace(p, name=renamed[p.name], unit=in_unit, low=p.low / by, high=p.high / by, scale=scale)

    def starts(scale: Scale, rig: Rig) -> list[Values]:
        return [from_mm(values) for values in form.starts(scale, rig)]

    change = form.rig
    return replace(
        form,
        parameters=tuple(map(converted, form.parameters)),
        starts=starts,
        rig=None if change is None else lambda rig, values: change(rig, to_mm(values)),
    )
