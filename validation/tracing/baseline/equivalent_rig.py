"""Records of unknown geometry as a problem for the tracer: the simplest rig that could have made them.

Six measured joints between two equal ropes on the compiled chain (:mod:`fem_models.chain.solve`). Stiffness, moment arm,
ropes with their toe region, friction of sheath, capstan and, a little, guides, and the loop of the material are free,
and so is a monotone cubic between drive and wheel, f of the curve model. That is fewer constants than f and a Bouc-Wen
loop of free size in every preload have, and the loops it can make are those of a rig: what play, slack or a damper add
is not among them. Forces are in proportion to the preload, 20 N where no record tells one; lengths of rope are given in
the drive's unit.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from fem_models.load.program import LoadProgram
from fem_models.rig.effects import Closure
from fem_models.rig.joints import MeasuredJoint
from fem_models.rig.rig import Friction, Material, Rig, Tendon, Wheel
from hysteresis.arrays import Floats
from hysteresis.record import Record
from validation.tracing.baseline.curve import mean_slope, middle_of
from validation.tracing.baseline.known_rig import (
    NEVER_DEG,
    SOFT,
    RigProblem,
    Run,
    has,
    runs_of,
    scale_of,
    thinned,
)
from validation.tracing.effect import Effect, FreeParameter, RigForm, Scale, Values
from validation.tracing.prepared import prepare
from validation.tracing.problem import Problem, require_one_unit

JOINTS, PARTS_AT_LAST = 6, 2
"""Joints, in the search, and parts of each in the last fit. Between slack ropes of a wrist of 14 joints, six are 0.2 of
the noise off where they are fitted and 0.5 to 0.7 where not (score-6, ``tendon_slack`` 06, without its noise)."""
SAMPLES, SAMPLES_AT_LAST = 300, 1200
"""Of a record at most, about: for the search, and for the last fit."""
_ARM_MM, _PITCH_MM, _FREE_MM, _WHEEL_MM = 2.5, 6.0, 150.0, 10.0
_FREE_BOUNDS_MM = (36.0, 600.0)  # 1 to 17 times the length that bends: with more, a dry rope stands still as play does
_PRELOAD_N, _EA_N, _STIFFNESS = 20.0, 10_000.0, 120.0
_TOE = 2.2  # of the largest preload: as soft as the paper's rope at 20 N; softer is an effect (stiffening)
_GUIDES = 0.02  # of the largest preload, all guides together: more is an effect
_HOLD = 5e-4  # of half the largest range of the angle
_SHAPE = 0.45  # even and odd part of the cubic, as in the curve model
_GAP = FreeParameter("rigid_gap_mm", "mm", 0.0, 0.5 * _PITCH_MM / PARTS_AT_LAST**2, 0.05)
_ROOTS = 1 / 3
"""Of the last fit alone: what of a notch does not bend, which shortens the paths of both ropes in a bend, and the part
of the compliance in the roots of a flexure, that of the preset ``du2018``. A deep bend tells them; the search does
without, whose effects are larger."""


@dataclass(frozen=True, eq=False)
class EquivalentRigProblem(RigProblem):
    """A :class:`RigProblem` of a rig that is not known: its whole geometry is fitted.

    ``middle`` and ``mm`` make rope of drive, (x - middle) mm; ``half_mm`` is the largest way of it, ``unit`` the
    drive's; ``preload_N`` is the largest. Constants are those of six joints, each of which is run as ``parts``.
    """

    middle: float
    mm: float
    half_mm: float
    unit: str
    preload_N: float
    parts: int = 1

    @property
    def prior_weight_deg(self) -> float:
        """See :class:`validation.tracing.problem.Problem`."""
        return _HOLD * self.scale.angle_deg

    def forms(self, effect: Effect) -> tuple[RigForm, ...]:
        """Forms whose needs are met, lengths of rope in the drive's unit."""
        return tuple(_in_unit(form, self.unit, self.mm) for form in super().forms(effect))

    def baseline(self, rig: Rig, values: Values) -> Rig:
        """Give a rig the constants that were fitted."""
        rope = replace(
            rig.tendon_a,
            EA_N=values["EA_at_preload_N"],
            toe_N=values.get("toe_N", 0.0),
            moment_arm_mm=values["moment_arm_mm"],
            free_length_mm=values["free_length_mm"],
        )
        dry = replace(rig.friction, **{name: values[name] for name in ("sheath_N", "capstan_coefficient", "guide_N")})
        metal = replace(rig.material, loop_share=values["loop_share"], loop_angle_deg=values["loop_angle_deg"])
        assert isinstance(rig.joint, MeasuredJoint)
        joint = replace(
            rig.joint,
            flexure_stiffness_Nmm_per_rad=values["flexure_stiffness_Nmm_per_rad"],
            rigid_gap_mm=values.get("rigid_gap_mm", 0.0),
        )
        return replace(rig, tendon_a=rope, tendon_b=rope, friction=dry, material=metal, joint=joint)

    def rig(self, run: Run, values: Values, added: Sequence[tuple[RigForm, Values]]) -> Rig:
        """Rig of a run; ropes are as stiff at the largest preload as their constant says, however soft their toe is."""
        rig = super().rig(run, values, added)
        a, b = rig.tendon_a, rig.tendon_b
        assert b is not None
        by_a, by_b = 1.0 + a.toe_N / self.preload_N, 1.0 + b.toe_N / self.preload_N
        rig = replace(rig, tendon_a=replace(a, EA_N=a.EA_N * by_a), tendon_b=replace(b, EA_N=b.EA_N * by_b))
        return divided(rig, self.parts)

    def driven(self, run: Run, values: Values) -> Run:
        """Run behind the cubic, whose slope is u + even u^2 / 2 + odd u^3 / 3 of the drive over its range."""

        def bent(program: LoadProgram) -> LoadProgram:
            u = program.drive_mm / self.half_mm
            return replace(
                program, drive_mm=program.drive_mm * (1.0 + u * (0.5 * values["even"] + values["odd"] / 3.0 * u))
            )

        assert isinstance(run.program, LoadProgram)
        return replace(run, program=bent(run.program), short=None if run.short is None else bent(run.short))

    def program(self, drive: Floats, time_s: Floats | None, cycle: NDArray[np.int64]) -> LoadProgram:
        """Make a load program of a drive in the records' unit."""
        return LoadProgram((drive - self.middle) * self.mm, time_s, cycle)


def equivalent_rig_problem(records: Sequence[Record], samples: int = SAMPLES) -> EquivalentRigProblem:
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
        Records of different units of the drive.
    SolverError
        A drive that no such rig follows.
    """
    require_one_unit(records)
    used = prepare(records, [thinned(record, samples) for record in records])
    inputs, observed = [one.inputs for one in used], [one.angle_deg for one in used]
    drives = [one.drive for one in used]
    middle, slope = middle_of(drives), mean_slope(drives, observed)
    mm = math.copysign(math.radians(abs(slope)) * _ARM_MM, slope)
    told = all(record.rig.get("preload_N", 0.0) > 0 for record in records)
    loads = [float(record.rig["preload_N"]) if told else _PRELOAD_N for record in records]
    joint = 0.5 * max(float(np.ptp(angle)) for angle in observed) / JOINTS
    rigs = [replace(_rig(max(loads), joint), preload_N=load) for load in loads]
    runs = tuple(runs_of((one.drive - middle) * mm, one.inputs, rig) for one, rig in zip(used, rigs, strict=True))
    largest, several = max(loads), max(loads) > 1.05 * min(loads)
    roped = tuple(replace(record_inputs, drive=(record_inputs.drive - middle) * mm) for record_inputs in inputs)
    return EquivalentRigProblem(
        records=used,
        parameters=_constants(largest, joint, several=several),
        start=_start(largest, joint, several=several),
        runs=runs,
        scale=scale_of(used, [(record.drive - middle) * mm for record in records], runs, roped),
        has=has(rigs[0], inputs, pulled=False),
        middle=middle,
        mm=mm,
        half_mm=max(float(np.abs(record_inputs.drive).max()) for record_inputs in roped),
        unit=records[0].drive_unit,
        preload_N=largest,
    )


def _rooted(rig: Rig) -> Rig:
    """Give the joints of a rig the roots of a notched flexure."""
    assert isinstance(rig.joint, MeasuredJoint)
    return replace(rig, joint=replace(rig.joint, roots_share=_ROOTS))


def divided(rig: Rig, parts: int) -> Rig:
    """Give a rig of measured joints with each of them made of as many in series: as long and as stiff together."""
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
    """Give the problem with :data:`SAMPLES_AT_LAST` a record, joints in :data:`PARTS_AT_LAST`, roots, a rigid gap."""
    assert isinstance(problem, EquivalentRigProblem)
    records = [one.record for one in problem.records]
    used = prepare(records, [thinned(record, SAMPLES_AT_LAST) for record in records])
    rigs = [_rooted(runs[0].rig) for runs in problem.runs]
    return replace(
        problem,
        records=used,
        runs=tuple(
            runs_of((one.drive - problem.middle) * problem.mm, one.inputs, rig)
            for one, rig in zip(used, rigs, strict=True)
        ),
        parameters=(*problem.parameters, _GAP),
        start={**problem.start, _GAP.name: 0.0},
        parts=PARTS_AT_LAST,
    )


def _rig(preload_N: float, joint_deg: float) -> Rig:
    """Rig to start from; its toe is the softest that is declared, from where that of an effect starts."""
    rope = Tendon(_EA_N, _ARM_MM, _FREE_MM, toe_N=_TOE * preload_N)
    return Rig(
        name="equivalent",
        material=Material(60.0, 0.33, loop_share=0.3, loop_angle_deg=0.6 * joint_deg),
        tendon_a=rope,
        tendon_b=rope,
        wheel=Wheel(_WHEEL_MM),
        preload_N=preload_N,
        friction=Friction(capstan_coefficient=0.05, sheath_N=0.05 * preload_N),
        joint=MeasuredJoint(JOINTS, _PITCH_MM, _STIFFNESS),
        closure=Closure(SOFT, NEVER_DEG),
    )


def _constants(preload_N: float, joint_deg: float, *, several: bool) -> tuple[FreeParameter, ...]:
    unit = preload_N / _PRELOAD_N
    parameters = [
        FreeParameter("sheath_N", "N", 0.0, 0.5 * preload_N, unit),
        FreeParameter("capstan_coefficient", "-", 0.0, 0.5, 0.05),
        FreeParameter("guide_N", "N", 0.0, _GUIDES * preload_N / JOINTS, 0.1 * _GUIDES * preload_N / JOINTS),
        FreeParameter("loop_share", "-", 0.0, 0.9, 0.2),
        FreeParameter("loop_angle_deg", "deg", joint_deg / 10, 4 * joint_deg, 0.4, log=True),
        FreeParameter("EA_at_preload_N", "N", _EA_N * unit / 20, _EA_N * unit * 10, 0.2, log=True),
        FreeParameter("moment_arm_mm", "mm", 0.4 * _ARM_MM, 2.5 * _ARM_MM, 0.01, log=True),
        FreeParameter("flexure_stiffness_Nmm_per_rad", "Nmm/rad", 10.0 * unit, 5_000.0 * unit, 0.2, log=True),
        FreeParameter("free_length_mm", "mm", *_FREE_BOUNDS_MM, 0.2, log=True),
        FreeParameter("even", "-", -_SHAPE, _SHAPE, 0.01),
        FreeParameter("odd", "-", -_SHAPE, _SHAPE, 0.01),
    ]
    if several:  # one preload does not tell a soft rope from a soft strand
        parameters.append(FreeParameter("toe_N", "N", 0.0, _TOE * preload_N, 5.0 * unit))
    return tuple(parameters)


def _start(preload_N: float, joint_deg: float, *, several: bool) -> Mapping[str, float]:
    unit = preload_N / _PRELOAD_N
    start = {
        "sheath_N": unit,
        "capstan_coefficient": 0.05,
        "guide_N": 0.1 * _GUIDES * preload_N / JOINTS,
        "loop_share": 0.3,
        "loop_angle_deg": 0.6 * joint_deg,
        "EA_at_preload_N": 0.4 * _EA_N * unit,
        "moment_arm_mm": _ARM_MM,
        "flexure_stiffness_Nmm_per_rad": _STIFFNESS * unit,
        "free_length_mm": _FREE_MM,
        "even": 0.0,
        "odd": 0.0,
    }
    return {**start, "toe_N": 0.3 * preload_N} if several else start


def _in_unit(form: RigForm, unit: str, mm: float) -> RigForm:
    """Give a form's lengths of rope in the drive's unit; a tip's way stays in mm of the equivalent rig."""
    size = abs(mm)
    roped = {c.name for c in form.parameters if c.unit == "mm" and c.name in _ROPE}
    if unit == "mm" and math.isclose(size, 1.0):
        return form
    named = {name: f"{name.removesuffix('_mm')}_{unit}" for name in roped}

    def by(name: str) -> float:
        return mm if name in _SIDED else size

    def back(values: Values) -> Values:
        return {**values, **{name: values[there] * by(name) for name, there in named.items()}}

    def there(values: Values) -> Values:
        return {named.get(name, name): v / by(name) if name in named else v for name, v in values.items()}

    def scaled(c: FreeParameter) -> FreeParameter:
        if c.name not in named:
            return c
        per = c.scale if c.log else c.scale / size
        return replace(c, name=named[c.name], unit=unit, low=c.low / size, high=c.high / size, scale=per)

    def starts(scale: Scale, rig: Rig) -> list[Values]:
        return [there(values) for values in form.starts(scale, rig)]

    rig_of_form = form.rig
    return replace(
        form,
        parameters=tuple(map(scaled, form.parameters)),
        starts=starts,
        rig=None if rig_of_form is None else lambda rig, values: rig_of_form(rig, back(values)),
    )


_ROPE = frozenset({"width_mm", "slack_mm", "centre_mm", "rest_length_mm", "sine_mm", "cosine_mm", "radius_mm"})
"""Constants of rig forms that are lengths of rope at the wheel."""
_SIDED = frozenset({"centre_mm", "cosine_mm"})  # of those, what changes sign with the drive; its bounds are symmetric
