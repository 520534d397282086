"""One joint and the bent chain in every model: analytic, solid, reduced bodies, beams, and the two engines.

All models carry the same load case: tendon a is pulled without friction, tendon b is slack, the flexures are elastic,
and every optional effect is off. Notches that differ are compared one by one. ``docs/guide/validate.md`` explains the
result.
"""

from __future__ import annotations

import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from scipy.interpolate import PchipInterpolator

from fem_models.analytic.frictionless_chain import (
    bend_by_tendon,
    bend_each_by_tendon,
    tendon_arm_mm,
    tendon_for_angle_N,
    tendon_for_sum_N,
)
from fem_models.chain import simulate_chain
from fem_models.joint import joint_mechanics, joint_row
from fem_models.joint.flexure import Flexure, beam, flexure
from fem_models.load import LoadProgram
from fem_models.multibody import simulate_multibody
from fem_models.multibody.reduced_body import ReducedBody, craig_bampton, free_frequencies_Hz
from fem_models.multibody.reduced_chain import PlaneLoad, solve_beam_chain, solve_reduced_chain
from fem_models.rig import Rig, RigError
from fem_models.rig.rig import EFFECT_TABLES, Friction, notched_tube, with_joint, with_notch
from fem_models.solid import snr_stiffness, solid_snr
from fem_models.solid.linear import Solid, as_flexure
from hysteresis import Record
from hysteresis.arrays import Floats
from hysteresis.plain import to_plain
from validation.joints.notches import beam_pitch

ANGLES_DEG = (15.0, 30.0, 45.0)
"""Bending of the solid's chain; scaled down where its notches would close."""

REFERENCE = "solid"
MODES = 4
SAMPLES = 40
_SMALL_PRELOAD_N = 1e-3  # the engines need a preload
_SOFT = 1e-5  # EA of tendon b over that of tendon a: b goes slack without a jump and pulls no more than the preload


@dataclass(frozen=True)
class BentChain:
    """The chain under a tension: bending, deg, and middle of the last ring on the tube axis, from that of the base."""

    tendon_N: float
    angle_deg: float
    tip_x_mm: float
    tip_y_mm: float


@dataclass(frozen=True)
class BentNotch:
    """One notch of a chain whose notches differ: its bending stiffness, and its angles at the tensions, deg."""

    number: int
    depth_mm: float
    width_mm: float
    bending_Nmm_per_rad: float
    angles_deg: tuple[float, ...]


@dataclass(frozen=True)
class ModelResult:
    """One model. The stiffnesses of one pitch are those of :class:`fem_models.joint.flexure.Flexure`, None if unknown.

    The bending stiffness of an engine follows from its angle at the least tension. Where notches differ, ``notches``
    has them one by one, and the stiffnesses are harmonic means: those of equal notches that give as much in a row.
    """

    name: str
    bending_Nmm_per_rad: float
    axial_N_per_mm: float | None
    shear_N_per_mm: float | None
    bent: tuple[BentChain, ...]
    seconds: float
    notches: tuple[BentNotch, ...] = ()


@dataclass(frozen=True)
class BentNotchRow:
    """A notch with the difference of its stiffness, and of its angle at the largest tension, from the reference."""

    number: int
    depth_mm: float
    width_mm: float
    bending_Nmm_per_rad: float
    angles_deg: tuple[float, ...]
    bending_percent: float
    angle_percent: float


@dataclass(frozen=True)
class BentChainRow:
    """A bent chain with its difference from the reference: of the angle in percent, of the tip in mm."""

    tendon_N: float
    angle_deg: float
    tip_mm: tuple[float, float]
    angle_percent: float
    tip_off_mm: float


@dataclass(frozen=True)
class ModelRow:
    """A model as ``validate.json`` has it; percentages are differences from the reference."""

    name: str
    bending_Nmm_per_rad: float
    axial_N_per_mm: float | None
    shear_N_per_mm: float | None
    bending_percent: float | None
    axial_percent: float | None
    shear_percent: float | None
    bent: tuple[BentChainRow, ...]
    seconds: float
    notches: tuple[BentNotchRow, ...] = ()


@dataclass(frozen=True)
class ModelComparison:
    """All models of a rig at the same tensions.

    ``nodes`` counts the nodes of the solid; ``free_frequencies_Hz`` are the lowest natural frequencies of one free
    reduced body, none where notches differ.
    """

    rig: str
    nodes: int
    free_frequencies_Hz: tuple[float, ...]
    models: tuple[ModelResult, ...]

    def model(self, name: str) -> ModelResult:
        """Look up a model by name; raises StopIteration for an unknown name."""
        return next(model for model in self.models if model.name == name)

    def rows(self) -> tuple[ModelRow, ...]:
        """Models with their differences from the solid."""
        return tuple(_row(model, self.model(REFERENCE)) for model in self.models)

    def to_dict(self) -> dict[str, Any]:
        """Plain values as in ``validate.json``."""
        return {
            "rig": self.rig,
            "judge": REFERENCE,
            "solid_nodes": self.nodes,
            "free_frequencies_Hz": list(self.free_frequencies_Hz),
            "models": to_plain(self.rows()),
        }


def _row(model: ModelResult, reference: ModelResult) -> ModelRow:
    bent = [
        BentChainRow(
            tendon_N=own.tendon_N,
            angle_deg=own.angle_deg,
            tip_mm=(own.tip_x_mm, own.tip_y_mm),
            angle_percent=100 * (own.angle_deg / other.angle_deg - 1),
            tip_off_mm=float(np.hypot(own.tip_x_mm - other.tip_x_mm, own.tip_y_mm - other.tip_y_mm)),
        )
        for own, other in zip(model.bent, reference.bent, strict=True)
    ]
    return ModelRow(
        name=model.name,
        bending_Nmm_per_rad=model.bending_Nmm_per_rad,
        axial_N_per_mm=model.axial_N_per_mm,
        shear_N_per_mm=model.shear_N_per_mm,
        bending_percent=_percent(model.bending_Nmm_per_rad, reference.bending_Nmm_per_rad),
        axial_percent=_percent(model.axial_N_per_mm, reference.axial_N_per_mm),
        shear_percent=_percent(model.shear_N_per_mm, reference.shear_N_per_mm),
        bent=tuple(bent),
        seconds=model.seconds,
        notches=tuple(_notch_row(own, other) for own, other in zip(model.notches, reference.notches, strict=True)),
    )


def _notch_row(own: BentNotch, other: BentNotch) -> BentNotchRow:
    return BentNotchRow(
        **vars(own),
        bending_percent=100 * (own.bending_Nmm_per_rad / other.bending_Nmm_per_rad - 1),
        angle_percent=100 * (own.angles_deg[-1] / other.angles_deg[-1] - 1),
    )


def _percent(value: float | None, reference: float | None) -> float | None:
    return None if value is None or reference is None else 100 * (value / reference - 1)


def compare_models(
    rig: Rig,
    *,
    angles_deg: Sequence[float] = ANGLES_DEG,
    refinement: float = 1.0,
    progress: Callable[[str], None] = lambda _: None,
) -> ModelComparison:
    """Solve one joint and the chain of a rig with every model.

    Parameters
    ----------
    angles_deg
        Bending of the solid's chain, ascending, above 0; the tensions follow from it. All are scaled down if the last
        exceeds 0.8 of the bending at which the notches close.
    refinement
        Of the solid's mesh, as in :func:`fem_models.solid.mesh.snr_mesh`.
    progress
        Called with the name of each model before it is solved.

    Raises
    ------
    RigError
        The rig has measured joints, for which there is no solid; or from the models.
    SolverError
        From the models.
    """
    notched_tube(rig)  # refuses measured joints
    plain = _plain(rig)
    if not rig.joint.alike:
        return _compare_each(plain, angles_deg, refinement, progress)
    progress(REFERENCE)
    start = time.perf_counter()
    solid = solid_snr(plain, refinement=refinement)
    metal = as_flexure(snr_stiffness(solid).stiffness)
    tensions = _tensions(plain, metal, angles_deg)
    results = [_closed_form(REFERENCE, plain, metal, tensions, start)]
    for name, joint in analytic_joints(plain).items():
        progress(name)
        results.append(_closed_form(name, plain, joint, tensions, time.perf_counter()))
    progress("reduced bodies")
    start = time.perf_counter()
    body = craig_bampton(solid, MODES)
    results.append(_reduced(plain, solid, body, tensions, start))
    progress("beams")
    results.append(_beams(plain, metal, tensions))
    for name, engine in (("multibody", simulate_multibody), ("chain", simulate_chain)):
        progress(name)
        results.append(_engine(name, engine, plain, tensions))
    frequencies = tuple(free_frequencies_Hz(body)[:3].tolist())
    return ModelComparison(rig.name, len(solid.points_mm), frequencies, tuple(results))


def _compare_each(
    rig: Rig, angles_deg: Sequence[float], refinement: float, progress: Callable[[str], None]
) -> ModelComparison:
    """Compare notches that differ: the solid of each, the analytic flexures, and both engines.

    Reduced bodies and beams are left out: with the stiffness of the solid they are its closed form.
    """
    ones = [with_joint(rig, number) for number in range(rig.joints)]
    start, nodes, known = time.perf_counter(), 0, dict[Any, Flexure]()
    for number, one in enumerate(ones):
        progress(f"{REFERENCE}, notch {number + 1}")
        if one.joint not in known:
            solid = solid_snr(one, refinement=refinement)
            known[one.joint] = as_flexure(snr_stiffness(solid).stiffness)
            nodes = max(nodes, len(solid.points_mm))
    metal = [known[one.joint] for one in ones]
    tensions = _tensions_of_each(rig, ones, metal, angles_deg)
    results = [_closed_form_of_each(REFERENCE, rig, metal, tensions, start)]
    analytic = [analytic_joints(one) for one in ones]
    for name in analytic[0]:
        progress(name)
        flexures = [joints[name] for joints in analytic]
        results.append(_closed_form_of_each(name, rig, flexures, tensions, time.perf_counter()))
    for name, engine in (("multibody", simulate_multibody), ("chain", simulate_chain)):
        progress(name)
        results.append(_engine_of_each(name, engine, rig, tensions))
    return ModelComparison(rig.name, nodes, (), tuple(results))


def _tensions_of_each(rig: Rig, ones: Sequence[Rig], metal: Sequence[Flexure], angles_deg: Sequence[float]) -> Floats:
    """Tensions that bend the solid's chain by angles, scaled down where its first notch would close."""
    closing = [0.8 * joint_mechanics(one).closure_angle_rad for one in ones]
    limits = [tendon_for_angle_N(one, joint, angle) for one, joint, angle in zip(ones, metal, closing, strict=True)]
    largest = float(bend_each_by_tendon(rig, metal, min(limits))[0].sum())
    angles = np.radians(angles_deg)
    angles *= min(1.0, largest / angles[-1])
    return np.array([tendon_for_sum_N(rig, metal, angle) for angle in angles.tolist()])


def _closed_form_of_each(
    name: str, rig: Rig, joints: Sequence[Flexure], tensions_N: Floats, start: float
) -> ModelResult:
    found = [bend_each_by_tendon(rig, joints, tension) for tension in tensions_N.tolist()]
    bent = [
        BentChain(tension, float(np.degrees(angles.sum())), x, y)
        for (angles, x, y), tension in zip(found, tensions_N.tolist(), strict=True)
    ]
    angles_deg = np.degrees([angles for angles, _, _ in found])
    stiffness = np.array([joint.bending_Nmm_per_rad for joint in joints])
    mean = Flexure(_mean(stiffness), _mean_of(joints, "shear_N_per_mm"), _mean_of(joints, "axial_N_per_mm"), 0.0)
    return replace(_result(name, mean, bent, start), notches=_notches(rig, stiffness, angles_deg))


def _mean(stiffness: Floats) -> float:
    return float(len(stiffness) / (1 / stiffness).sum())


def _mean_of(joints: Sequence[Flexure], field: str) -> float | None:
    values = [getattr(joint, field) for joint in joints]
    return None if None in values else _mean(np.array(values))


def _notches(rig: Rig, stiffness: Floats, angles_deg: Floats) -> tuple[BentNotch, ...]:
    notch = notched_tube(rig).notch
    return tuple(
        BentNotch(
            k + 1, notch.at(k).depth_mm, notch.at(k).width_mm, float(stiffness[k]), tuple(angles_deg[:, k].tolist())
        )
        for k in range(rig.joints)
    )


def _engine_of_each(
    name: str, simulate: Callable[[Rig, LoadProgram], Record], rig: Rig, tensions_N: Floats
) -> ModelResult:
    """As :func:`_engine`, with the angle of every notch; the tip is on the neutral axis."""
    start = time.perf_counter()
    joints = [joint.flexure for joint in joint_row(rig).each]
    angles, _, _ = bend_each_by_tendon(rig, joints, float(tensions_N[-1]))
    axial = sum(1 / joint.axial_N_per_mm for joint in joints if joint.axial_N_per_mm)
    arms = joint_row(rig).of("arms_mm")[:, 0]
    at = _wound(name, simulate, rig, float(tensions_N[-1]), float(arms @ angles), axial)
    found = np.array([at(tension) for tension in tensions_N.tolist()])
    bent = [BentChain(t, *row[:3]) for t, row in zip(tensions_N.tolist(), found.tolist(), strict=True)]
    least = np.radians(found[0, 3:])
    levers = [
        tendon_arm_mm(with_joint(rig, k), joint, angle)
        for k, (joint, angle) in enumerate(zip(joints, least.tolist(), strict=True))
    ]
    stiffness = tensions_N[0] * np.array(levers) / least
    result = _result(name, Flexure(_mean(stiffness), None, None, 0.0), bent, start)
    return replace(result, notches=_notches(rig, stiffness, found[:, 3:]))


def analytic_joints(rig: Rig) -> dict[str, Flexure]:
    """Analytic stiffnesses of a pitch, with the ring in series: the beam alone, and with elastic roots in the rings."""
    pitch = beam_pitch(rig)
    roots = 1 / flexure(rig).bending_Nmm_per_rad - 1 / beam(rig).bending_Nmm_per_rad
    return {
        "beam": pitch,
        "beam with roots": replace(pitch, bending_Nmm_per_rad=1 / (1 / pitch.bending_Nmm_per_rad + roots)),
    }


def _plain(rig: Rig) -> Rig:
    """Remove friction, material loop, effects and toe regions; the preload is negligible."""
    none: dict[str, Any] = dict.fromkeys(EFFECT_TABLES)
    return replace(
        rig,
        preload_N=_SMALL_PRELOAD_N,
        friction=Friction(),
        material=replace(rig.material, loop_share=0.0),
        tendon_a=replace(rig.tendon_a, toe_N=0.0),
        tendon_b=replace(rig.tendon_b, toe_N=0.0, EA_N=_SOFT * rig.tendon_a.EA_N) if rig.tendon_b else None,
        precurvature_deg=0.0,
        **none,
    )


def _tensions(rig: Rig, joint: Flexure, angles_deg: Sequence[float]) -> Floats:
    angles = np.radians(angles_deg)
    angles *= min(1.0, 0.8 * rig.joints * joint_mechanics(rig).closure_angle_rad / angles[-1])
    return np.array([tendon_for_angle_N(rig, joint, angle) for angle in angles])


def _closed_form(name: str, rig: Rig, joint: Flexure, tensions_N: Floats, start: float) -> ModelResult:
    bent = []
    for tension in tensions_N.tolist():
        angle, x, y = bend_by_tendon(rig, joint, tension)
        bent.append(BentChain(tension, float(np.degrees(angle)), x, y))
    return _result(name, joint, bent, start)


def _result(name: str, joint: Flexure, bent: Sequence[BentChain], start: float) -> ModelResult:
    return ModelResult(
        name=name,
        bending_Nmm_per_rad=joint.bending_Nmm_per_rad,
        axial_N_per_mm=joint.axial_N_per_mm,
        shear_N_per_mm=joint.shear_N_per_mm,
        bent=tuple(bent),
        seconds=time.perf_counter() - start,
    )


def _reduced(rig: Rig, solid: Solid, body: ReducedBody, tensions_N: Floats, start: float) -> ModelResult:
    joint = joint_stiffness(rig, lambda one, loads: solve_reduced_chain(one, solid, body, loads))
    poses = solve_reduced_chain(rig, solid, body, [PlaneLoad(tendon_N=t) for t in tensions_N.tolist()])
    return _result("reduced bodies", joint, _bent(poses, tensions_N), start)


def _beams(rig: Rig, metal: Flexure, tensions_N: Floats) -> ModelResult:
    start = time.perf_counter()
    joint = joint_stiffness(rig, lambda one, loads: solve_beam_chain(one, metal, loads))
    poses = solve_beam_chain(rig, metal, [PlaneLoad(tendon_N=t) for t in tensions_N.tolist()])
    return _result("beams", joint, _bent(poses, tensions_N), start)


def joint_stiffness(rig: Rig, solve: Callable[[Rig, list[PlaneLoad]], list[Any]]) -> Flexure:
    """Derive the stiffnesses of a joint from the motion of a chain of one joint under small loads at its tip.

    The loads act half a pitch beyond the middle of the notch; a lateral force therefore also bends the joint.
    """
    one, arm = with_notch(rig, replace(notched_tube(rig).notch, count=1)), rig.pitch_mm / 2
    force = 1e-4 * flexure(rig).bending_Nmm_per_rad  # central differences: the error is of second order
    kinds = ("moment_Nmm", "lateral_N", "axial_N")
    poses = solve(one, [PlaneLoad(**{kind: sign * force}) for kind in kinds for sign in (1, -1)])
    (rotation, _, _), (_, _, lateral_motion), (coupling, axial_motion, _) = (
        np.array([ahead.angle_rad - back.angle_rad, *(ahead.tip_mm - back.tip_mm)]) / (2 * force)
        for ahead, back in zip(poses[::2], poses[1::2], strict=True)
    )
    stiffness = 1 / np.array([rotation, axial_motion - coupling**2 / rotation, lateral_motion - arm**2 * rotation])
    bending, axial, lateral = stiffness.tolist()
    return Flexure(bending, lateral, axial, float(-coupling / rotation))


def _bent(poses: Sequence[Any], tensions_N: Floats) -> list[BentChain]:
    return [
        BentChain(tension, float(np.degrees(pose.angle_rad)), *pose.tip_mm.tolist())
        for pose, tension in zip(poses, tensions_N.tolist(), strict=True)
    ]


def _engine(name: str, simulate: Callable[[Rig, LoadProgram], Record], rig: Rig, tensions_N: Floats) -> ModelResult:
    """Wind up tendon a to the largest tension, and interpolate angle and tip between the samples."""
    start = time.perf_counter()
    joint, arm = flexure(rig), joint_mechanics(rig).arms_mm.a
    angle, _, _ = bend_by_tendon(rig, joint, float(tensions_N[-1]))
    axial = rig.joints / joint.axial_N_per_mm if joint.axial_N_per_mm else 0.0
    neutral = joint.neutral_offset_mm
    at = _wound(name, simulate, rig, float(tensions_N[-1]), arm * angle, axial, neutral)
    bent = [BentChain(tension, *at(tension).tolist()[:3]) for tension in tensions_N.tolist()]
    joint_rad = np.radians(bent[0].angle_deg) / rig.joints
    bending = bent[0].tendon_N * tendon_arm_mm(rig, joint, joint_rad) / joint_rad
    return _result(name, Flexure(bending, None, None, neutral), bent, start)


def _wound(
    name: str,
    simulate: Callable[[Rig, LoadProgram], Record],
    rig: Rig,
    largest_N: float,
    turned_mm: float,
    axial_mm_per_N: float,
    neutral_mm: float = 0.0,
) -> PchipInterpolator:
    """Run an engine to the largest tension; of a tension the angle, deg, the tip, mm, and the notches, deg.

    ``turned_mm`` is what the joints take of the tendon, ``axial_mm_per_N`` how all of them give along the tube, and
    ``neutral_mm`` the way from the neutral axis to that of the tube.
    """
    tendon = rig.tendon_a
    stretch = (rig.length_mm + tendon.free_length_mm) / tendon.EA_N + 1.2 * axial_mm_per_N
    record = simulate(rig, LoadProgram(np.linspace(0.0, 1.1 * (turned_mm + stretch * largest_N), SAMPLES + 1)))
    assert record.tension_a_N is not None
    assert record.tip_mm is not None
    assert record.notches_deg is not None
    heading = np.radians(record.angle_deg)
    tip = record.tip_mm + neutral_mm * np.column_stack([-np.sin(heading), np.cos(heading) - 1])  # to the tube axis
    if not record.tension_a_N[-1] >= largest_N:
        raise RigError(f"rig {rig.name}: {name} reached {record.tension_a_N[-1]:g} N: expected {largest_N:g} N")
    return PchipInterpolator(record.tension_a_N, np.column_stack([record.angle_deg, tip, record.notches_deg]))
