"""One joint and the bent chain by every model, side by side: analytic, solid, reduced bodies, beams, engines.

The load case is one that all of them can carry: tendon a pulled without friction, tendon b slack, flexures elastic and
every optional effect off. See ``docs/guide/validate.md`` for what the table says.
"""

from __future__ import annotations

import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from scipy.interpolate import PchipInterpolator

from fem_models.analytic.frictionless_chain import bend_by_tendon, tendon_arm_mm, tendon_for_angle_N
from fem_models.chain.solve import simulate_chain
from fem_models.joint.flexure import Flexure, beam, closure_angle_rad, flexure, moment_arms_mm
from fem_models.load.program import LoadProgram
from fem_models.multibody.quasi_static import simulate_multibody
from fem_models.multibody.reduced_body import ReducedBody, craig_bampton, free_frequencies_Hz
from fem_models.multibody.reduced_chain import PlaneLoad, solve_beam_chain, solve_reduced_chain
from fem_models.rig.checks import RigError
from fem_models.rig.rig import EFFECT_TABLES, Friction, Rig, notched_tube, with_notch
from fem_models.solid.linear import Solid, as_flexure, snr_stiffness, solid_snr
from hysteresis.arrays import Floats
from hysteresis.record import Record
from validation.joints.notches import beam_pitch

ANGLES_DEG = (15.0, 30.0, 45.0)
"""To which the solid's chain is bent; less where its notches would close."""

JUDGE = "solid"
MODES = 4
SAMPLES = 40
LITTLE_N = 1e-3
"""Preload of the engines, which cannot do without."""
SOFT = 1e-5
"""Stiffness of tendon b of that of tendon a: it falls slack without a jump and never pulls more than the preload."""


@dataclass(frozen=True)
class Bent:
    """The chain under a tension: bending, deg; middle of the last ring on the tube axis, mm, from that of the base."""

    tendon_N: float
    angle_deg: float
    tip_x_mm: float
    tip_y_mm: float


@dataclass(frozen=True)
class ModelResult:
    """One model. Stiffnesses of one pitch as :class:`fem_models.joint.flexure.Flexure` has them, None where it has none.

    Of the engines the bending stiffness is that which their angle at the least tension stands for.
    """

    name: str
    bending_Nmm_per_rad: float
    axial_N_per_mm: float | None
    shear_N_per_mm: float | None
    bent: tuple[Bent, ...]
    seconds: float


@dataclass(frozen=True)
class Comparison:
    """All models of a rig, at the same tensions; frequencies are the lowest of one reduced body that is free."""

    rig: str
    nodes: int
    free_frequencies_Hz: tuple[float, ...]
    models: tuple[ModelResult, ...]

    def model(self, name: str) -> ModelResult:
        """Look up one model; StopIteration where there is none."""
        return next(model for model in self.models if model.name == name)

    def to_dict(self) -> dict[str, Any]:
        """Plain values, with what each model differs by from the solid."""
        judge = self.model(JUDGE)
        return {
            "rig": self.rig,
            "judge": JUDGE,
            "solid_nodes": self.nodes,
            "free_frequencies_Hz": list(self.free_frequencies_Hz),
            "models": [_row(model, judge) for model in self.models],
        }


def _row(model: ModelResult, judge: ModelResult) -> dict[str, Any]:
    def percent(quantity: str) -> float | None:
        own, right = getattr(model, quantity), getattr(judge, quantity)
        return None if own is None else 100 * (own / right - 1)

    names = ("bending_Nmm_per_rad", "axial_N_per_mm", "shear_N_per_mm")
    bent = [
        {
            "tendon_N": own.tendon_N,
            "angle_deg": own.angle_deg,
            "tip_mm": [own.tip_x_mm, own.tip_y_mm],
            "angle_percent": 100 * (own.angle_deg / right.angle_deg - 1),
            "tip_off_mm": float(np.hypot(own.tip_x_mm - right.tip_x_mm, own.tip_y_mm - right.tip_y_mm)),
        }
        for own, right in zip(model.bent, judge.bent, strict=True)
    ]
    return {
        "name": model.name,
        **{name: getattr(model, name) for name in names},
        **{f"{name.split('_')[0]}_percent": percent(name) for name in names},
        "bent": bent,
        "seconds": model.seconds,
    }


def compare_models(
    rig: Rig,
    *,
    angles_deg: Sequence[float] = ANGLES_DEG,
    refinement: float = 1.0,
    progress: Callable[[str], None] = lambda _: None,
) -> Comparison:
    """Solve one joint and the chain of a rig by every model.

    Parameters
    ----------
    angles_deg
        Bending of the solid's chain, ascending, above 0; the tensions follow from them. All are scaled down where the
        last would take more than nine tenths of the way to closing notches.
    refinement
        Of the solid's mesh, as in :func:`fem_models.solid.mesh.snr_mesh`.
    progress
        Called with the name of each model before it is solved.

    Raises
    ------
    RigError
        Joints measured on a bench, which have no solid; or from the models.
    SolverError
        From the models.
    """
    notched_tube(rig)  # refuses measured joints
    plain = _plain(rig)
    progress(JUDGE)
    start = time.perf_counter()
    solid = solid_snr(plain, refinement=refinement)
    metal = as_flexure(snr_stiffness(solid).stiffness)
    tensions = _tensions(plain, metal, angles_deg)
    results = [_closed_form(JUDGE, plain, metal, tensions, start)]
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
    return Comparison(rig.name, len(solid.points_mm), tuple(free_frequencies_Hz(body)[:3].tolist()), tuple(results))


def analytic_joints(rig: Rig) -> dict[str, Flexure]:
    """Analytic stiffnesses of a pitch, ring in series: the beam alone, and with what the rings give at its roots."""
    pitch = beam_pitch(rig)
    roots = 1 / flexure(rig).bending_Nmm_per_rad - 1 / beam(rig).bending_Nmm_per_rad
    return {
        "beam": pitch,
        "beam with roots": replace(pitch, bending_Nmm_per_rad=1 / (1 / pitch.bending_Nmm_per_rad + roots)),
    }


def _plain(rig: Rig) -> Rig:
    """Without friction, material loop, effects and the ropes' toe, and as good as without preload."""
    none: dict[str, Any] = dict.fromkeys(EFFECT_TABLES)
    return replace(
        rig,
        preload_N=LITTLE_N,
        friction=Friction(),
        material=replace(rig.material, loop_share=0.0),
        tendon_a=replace(rig.tendon_a, toe_N=0.0),
        tendon_b=replace(rig.tendon_b, toe_N=0.0, EA_N=SOFT * rig.tendon_a.EA_N) if rig.tendon_b else None,
        precurvature_deg=0.0,
        **none,
    )


def _tensions(rig: Rig, joint: Flexure, angles_deg: Sequence[float]) -> Floats:
    angles = np.radians(angles_deg)
    angles *= min(1.0, 0.8 * rig.joints * closure_angle_rad(rig) / angles[-1])
    return np.array([tendon_for_angle_N(rig, joint, angle) for angle in angles])


def _closed_form(name: str, rig: Rig, joint: Flexure, tensions_N: Floats, start: float) -> ModelResult:
    bent = []
    for tension in tensions_N.tolist():
        angle, x, y = bend_by_tendon(rig, joint, tension)
        bent.append(Bent(tension, float(np.degrees(angle)), x, y))
    return _result(name, joint, bent, start)


def _result(name: str, joint: Flexure, bent: Sequence[Bent], start: float) -> ModelResult:
    return ModelResult(
        name=name,
        bending_Nmm_per_rad=joint.bending_Nmm_per_rad,
        axial_N_per_mm=joint.axial_N_per_mm,
        shear_N_per_mm=joint.shear_N_per_mm,
        bent=tuple(bent),
        seconds=time.perf_counter() - start,
    )


def _reduced(rig: Rig, solid: Solid, body: ReducedBody, tensions_N: Floats, start: float) -> ModelResult:
    joint = measured_joint(rig, lambda one, loads: solve_reduced_chain(one, solid, body, loads))
    poses = solve_reduced_chain(rig, solid, body, [PlaneLoad(tendon_N=t) for t in tensions_N.tolist()])
    return _result("reduced bodies", joint, _bent(poses, tensions_N), start)


def _beams(rig: Rig, metal: Flexure, tensions_N: Floats) -> ModelResult:
    start = time.perf_counter()
    joint = measured_joint(rig, lambda one, loads: solve_beam_chain(one, metal, loads))
    poses = solve_beam_chain(rig, metal, [PlaneLoad(tendon_N=t) for t in tensions_N.tolist()])
    return _result("beams", joint, _bent(poses, tensions_N), start)


def measured_joint(rig: Rig, solve: Callable[[Rig, list[PlaneLoad]], list[Any]]) -> Flexure:
    """Read stiffnesses off the movement of a chain of one joint under small loads at its tip.

    The loads act half a pitch beyond the middle of the notch: a lateral force bends as well.
    """
    one, arm = with_notch(rig, replace(notched_tube(rig).notch, count=1)), rig.pitch_mm / 2
    force = 1e-4 * flexure(rig).bending_Nmm_per_rad  # of either sign, so that what is left is of second order
    kinds = ("moment_Nmm", "lateral_N", "axial_N")
    poses = solve(one, [PlaneLoad(**{kind: sign * force}) for kind in kinds for sign in (1, -1)])
    (turn, _, _), (_, _, pushed), (coupling, pulled, _) = (
        np.array([ahead.angle_rad - back.angle_rad, *(ahead.tip_mm - back.tip_mm)]) / (2 * force)
        for ahead, back in zip(poses[::2], poses[1::2], strict=True)
    )
    stiffness = 1 / np.array([turn, pulled - coupling**2 / turn, pushed - arm**2 * turn])
    bending, axial, lateral = stiffness.tolist()
    return Flexure(bending, lateral, axial, float(-coupling / turn))


def _bent(poses: Sequence[Any], tensions_N: Floats) -> list[Bent]:
    return [
        Bent(tension, float(np.degrees(pose.angle_rad)), *pose.tip_mm.tolist())
        for pose, tension in zip(poses, tensions_N.tolist(), strict=True)
    ]


def _engine(name: str, simulate: Callable[[Rig, LoadProgram], Record], rig: Rig, tensions_N: Floats) -> ModelResult:
    """Wind up tendon a until it has the largest tension, and read angle and tip between the samples."""
    start = time.perf_counter()
    joint, arm, rope = flexure(rig), moment_arms_mm(rig)[0], rig.tendon_a
    angle, _, _ = bend_by_tendon(rig, joint, float(tensions_N[-1]))
    stretch = (rig.joints * rig.pitch_mm + rope.free_length_mm) / rope.EA_N
    stretch += 1.2 * rig.joints / joint.axial_N_per_mm if joint.axial_N_per_mm else 0.0
    drive = 1.1 * (arm * angle + stretch * tensions_N[-1])
    record = simulate(rig, LoadProgram(np.linspace(0.0, drive, SAMPLES + 1)))
    assert record.tension_a_N is not None
    assert record.tip_mm is not None
    heading, neutral = np.radians(record.angle_deg), joint.neutral_offset_mm
    tip = record.tip_mm + neutral * np.column_stack([-np.sin(heading), np.cos(heading) - 1])  # to the tube axis
    if not record.tension_a_N[-1] >= tensions_N[-1]:
        raise RigError(f"rig {rig.name}: {name} reached {record.tension_a_N[-1]:g} N: expected {tensions_N[-1]:g} N")
    at = PchipInterpolator(record.tension_a_N, np.column_stack([record.angle_deg, tip]))
    bent = [Bent(tension, *at(tension).tolist()) for tension in tensions_N.tolist()]
    turn = np.radians(bent[0].angle_deg) / rig.joints
    bending = bent[0].tendon_N * tendon_arm_mm(rig, joint, turn) / turn
    return _result(name, Flexure(bending, None, None, neutral), bent, start)
