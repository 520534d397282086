"""Baseline of a known rig: kinematics, elastic tendons, friction of the guides and the loop of the material.

The parameters of friction, tendons and loop are identified from the records (``docs/guide/trace.md``); the rest of the
rig is as declared. The flexures of measured joints may vary besides, where the records ask for it.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

from fem_models.analytic.of_record import require_the_rigs_unit
from fem_models.rig import Rig
from fem_models.rig.joints import MeasuredJoint, NotchedTube
from fem_models.rig.of_record import declared_rig_of, notched_tube_of, require_the_rigs_sense, rig_of
from fem_models.rig.rig import Friction, Material, Tendon, Wheel
from hysteresis.records.path import cycle_index
from hysteresis.records.record import Record
from validation.tracing.baseline.channels import channels_of
from validation.tracing.baseline.rig_problem import RigProblem
from validation.tracing.baseline.runs import run_setup
from validation.tracing.baseline.samples import kept_samples
from validation.tracing.effect import OPEN_NOTCHES, FreeParameter, Values
from validation.tracing.prepared import prepare
from validation.tracing.settings import KNOWN_RIG_SAMPLES, LEAST_RECORD_SAMPLES

LOAD_CONTROL = (
    FreeParameter("youngs_modulus_GPa", "GPa", 1.0, 200.0, 0.1, log=True),
    FreeParameter("capstan_coefficient", "-", 0.0, 1.5, 0.05),
)
"""Parameters under tendon forces that only load: a material's loop does not show."""
VARIED_FLEXURES = (
    FreeParameter("stiffness_factor", "-", 0.5, 6.0, 0.1, log=True),
    FreeParameter("hardening_slope", "-", -0.5, 1.0, 0.1),
    FreeParameter("hardening_limit", "-", -0.5, 1.0, 0.1),
)
"""Parameters of measured joints whose stiffness varies along the bend, over the largest bend of the records
(:class:`fem_models.rig.joints.MeasuredJoint`). The factor is on the stiffness after a reversal, with the loop's part:
a measured stiffness is mostly that of a whole bend, and a loop may begin stiffer than the flexure itself is. Along
the bend a stiffness varies by a factor of two at most: more is an effect."""
STRAND = 2.0
"""Tendons may be as stiff as declared by this factor either way: a strand has 0.4 to 0.6 of the modulus of its wires.
Friction F at the base is a play of 2 F / k, so that tendons of any stiffness would take every play."""
SOFT_STICK = 50.0
"""A soft guide gives way by as much as this many pitches of tendon before it slides."""
_YOUNG_GPA, _TENDON_TO_WALL_MM = 50.0, 0.1


@dataclass(frozen=True, eq=False)
class KnownRigProblem(RigProblem):
    """Records of a rig whose geometry is declared; see :class:`validation.tracing.problem.Problem`."""

    def baseline_rig(self, rig: Rig, values: Values) -> Rig:
        """Give a rig the parameters of the baseline; the ratio of the tendons' stiffnesses stays."""
        friction = replace(
            rig.friction,
            capstan_coefficient=values["capstan_coefficient"],
            sheath_N=values.get("sheath_N", rig.friction.sheath_N),
            stick_compliance_mm_per_N=values.get("stick_compliance_mm_per_N", rig.friction.stick_compliance_mm_per_N),
        )
        if "youngs_modulus_GPa" in values:
            elastic = replace(rig.material, youngs_modulus_GPa=values["youngs_modulus_GPa"])
            return replace(rig, friction=friction, material=elastic)
        if "stiffness_factor" in values:
            rig = replace(rig, joint=self._varied(rig.joint, values))
        a, b = rig.tendon_a, rig.tendon_b
        ratio = values["EA_N"] / a.EA_N
        return replace(
            rig,
            friction=friction,
            material=replace(rig.material, loop_share=values["loop_share"], loop_angle_deg=values["loop_angle_deg"]),
            tendon_a=replace(a, EA_N=values["EA_N"]),
            tendon_b=None if b is None else replace(b, EA_N=b.EA_N * ratio),
        )

    def _varied(self, joint: NotchedTube | MeasuredJoint, values: Values) -> MeasuredJoint:
        """Let the stiffness of measured joints vary along the bend."""
        assert isinstance(joint, MeasuredJoint)
        return replace(
            joint,
            flexure_stiffness_Nmm_per_rad=joint.flexure_stiffness_Nmm_per_rad * values["stiffness_factor"],
            hardening_slope=values["hardening_slope"],
            hardening_limit=values["hardening_limit"],
            hardening_angle_deg=self.scale.joint_deg,
        )


def is_of_measured_joints(problem: object) -> bool:
    """Whether a rig is known by measured joints, whose stiffness and tendons are off by some percent."""
    return isinstance(problem, KnownRigProblem) and isinstance(problem.runs[0][0].rig.joint, MeasuredJoint)


def with_varied_flexures(problem: KnownRigProblem) -> KnownRigProblem | None:
    """Let the flexures vary along the bend; None where they are no measured joints, driven in mm."""
    measured = all(isinstance(run.rig.joint, MeasuredJoint) for runs in problem.runs for run in runs)
    if not measured or "EA_N" not in problem.start:
        return None
    own = {"stiffness_factor": 2.5, "hardening_slope": 0.0, "hardening_limit": 0.0}
    loop = {"loop_share": 0.6, "loop_angle_deg": 0.4 * problem.start["loop_angle_deg"]}  # the flexure is as declared
    parameters = [_wider(one) for one in problem.parameters]
    return replace(problem, parameters=(*parameters, *VARIED_FLEXURES), start={**problem.start, **own, **loop})


def _wider(parameter: FreeParameter) -> FreeParameter:
    """Let the material's loop saturate at smaller angles, where it may be friction of the tendons along the joint."""
    return replace(parameter, low=parameter.low / 5) if parameter.name == "loop_angle_deg" else parameter


def known_rig_problem(records: Sequence[Record]) -> KnownRigProblem | None:
    """Make the problem of records whose rigs are all known; None where one is not.

    Known is a rig with a drive in mm, or a tube and a notch under a tendon force.

    Raises
    ------
    RigError
        A rig that cannot be, or that its record breaks from the start.
    RecordError
        A record that bends the other way than its rig does, or whose angle or drive is in another unit.
    """
    found = [rig_under_tendon_force(record) if record.drive_unit == "N" else rig_of(record) for record in records]
    rigs = [_opened(rig) for rig in found if rig is not None]
    units = {record.drive_unit for record in records}
    if len(rigs) < len(records) or units not in ({"mm"}, {"N"}):
        return None
    load_control = units == {"N"}
    if not load_control:
        for record in records:
            require_the_rigs_sense(record)
            require_the_rigs_unit(record)
    most = max(LEAST_RECORD_SAMPLES, KNOWN_RIG_SAMPLES // len(records))
    used = prepare(records, [kept_samples(record.drive, most, cycle_index(record)) for record in records])
    channels, words = channels_of(used, rigs)
    setup = run_setup(used, rigs)
    return KnownRigProblem(
        records=used,
        channels=channels,
        channel_words=words,
        setup=setup if load_control else replace(setup, needs=setup.needs | {"drive in mm"}),
        parameters=LOAD_CONTROL if load_control else drive_parameters(rigs),
        start=declared_start(rigs[0], load_control=load_control),
    )


def soft_mm_per_N(rig: Rig) -> float:
    """Compliance of one pitch of tendon, mm/N."""
    return rig.mean_pitch_mm / rig.tendon_a.EA_N


def stick_compliance(rig: Rig) -> FreeParameter:
    """Compliance of a guide that sticks: of dry metal nothing, of a liner up to some hundreds of pitches of tendon."""
    unit = SOFT_STICK * soft_mm_per_N(rig)
    return FreeParameter("stick_compliance_mm_per_N", "mm/N", 0.0, 4 * unit, 0.1 * unit)


def drive_parameters(rigs: Sequence[Rig]) -> tuple[FreeParameter, ...]:
    """Parameters of the baseline under a drive in mm, within bounds about what is declared.

    Friction and stretch compensate each other. Without bounds a missing effect drives both to values that no rig has,
    and no effect that is added there returns from it.
    """
    rig, preload = rigs[0], max(rig.preload_N for rig in rigs)
    angle, EA = rig.material.loop_angle_deg, rig.tendon_a.EA_N
    return (
        FreeParameter("sheath_N", "N", 0.0, max(4 * rig.friction.sheath_N, 0.3 * preload, 1.0), 1.0),
        FreeParameter("capstan_coefficient", "-", 0.0, 0.5, 0.05),
        FreeParameter("loop_share", "-", 0.0, 0.9, 0.2),
        FreeParameter("loop_angle_deg", "deg", angle / 4, 4 * angle, 0.4, log=True),
        FreeParameter("EA_N", "N", EA / STRAND, STRAND * EA, 0.2, log=True),
        stick_compliance(rig),
    )


def _opened(rig: Rig) -> Rig:
    """Let notches bend on through each other where no closure is declared: the data say whether they close."""
    return rig if rig.closure is not None else replace(rig, closure=OPEN_NOTCHES)


def declared_start(rig: Rig, *, load_control: bool) -> Values:
    """Start from declared values; friction and loop above zero, where the angle has no slope in them."""
    mu = max(rig.friction.capstan_coefficient, 0.02)
    material = rig.material
    if load_control:
        return {"youngs_modulus_GPa": material.youngs_modulus_GPa, "capstan_coefficient": mu}
    return {
        "sheath_N": max(rig.friction.sheath_N, 0.02 * rig.preload_N),
        "capstan_coefficient": mu,
        "loop_share": min(max(material.loop_share, 0.1), 0.85),
        "loop_angle_deg": material.loop_angle_deg,
        "EA_N": rig.tendon_a.EA_N,
        "stick_compliance_mm_per_N": max(rig.friction.stick_compliance_mm_per_N, SOFT_STICK / 10 * soft_mm_per_N(rig)),
    }


def rig_under_tendon_force(record: Record) -> Rig | None:
    """Rig of one tendon under a force, from the tube and the notch of a record, or declared; None without either.

    Assumed is what the tables do not say: 50 GPa (40 to 60 GPa are fitted to such tubes, GitHub
    nepacheco/MastersThesis 4f920c7; identified in any case), a tendon along the wall opposite to the metal that the
    notch leaves, rigid rings. The shape at rest is the angle without force.
    """
    declared = declared_rig_of(record)  # checks its [rig] table
    if not record.tube or not record.notch:
        return declared if declared is not None and declared.tendon_b is None else None
    known = notched_tube_of(record)
    assert known is not None
    tube, notch = known.tube, replace(known.notch, rigid_roots=True)
    free = record.angle_deg[record.drive <= 0.05 * record.drive.max()]
    rest = float(free.mean()) / notch.count if free.size else 0.0
    tendon = Tendon(EA_N=5_000.0, moment_arm_mm=tube.inner_diameter_mm / 2 - _TENDON_TO_WALL_MM, free_length_mm=200.0)
    return Rig(
        name="wrist",
        material=Material(_YOUNG_GPA, 0.33),
        tendon_a=tendon,
        tendon_b=None,
        wheel=Wheel(10.0),
        preload_N=0.0,
        precurvature_deg=rest,
        friction=Friction(),
        joint=NotchedTube(tube, notch),
    )
