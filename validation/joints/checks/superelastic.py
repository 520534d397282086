"""Superelastic notch: moment over angle of the solid, of the section law, and of flag elements fitted to the solid."""

from __future__ import annotations

import multiprocessing
import time
from collections.abc import Sequence
from concurrent.futures import ProcessPoolExecutor
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from fem_models.joint import joint_mechanics
from fem_models.joint.superelastic_section import section_path
from fem_models.rig import Rig, preset
from fem_models.rig.effects import Superelastic
from fem_models.rig.joints import Notch, NotchedTube, Tube
from fem_models.rig.rig import notched_tube, with_notch
from fem_models.solid import snr_mesh
from fem_models.solid.large_bending import MomentAngle, bend, measured, quarter_joint
from fem_models.solid.strain import superelastic_limit
from fem_models.solid.superelastic import HARDENING_SHARE
from fem_models.solid.superelastic_elements import fibres_of_curve, flag_path
from fem_models.view.solid import bent_mesh, draw_mesh
from hysteresis.arrays import Floats

LAW = Superelastic(plateau_MPa=450.0, unloading_plateau_MPa=200.0, transformation_strain=0.04)
DU2018 = (("du2018", 0.0), ("du2018, 10 N", 20.0), ("du2018, 20 N", 40.0))
"""Names of the default notch with the thrust of two tendons at a preload, N."""
REFINEMENTS = (0.4, 0.6, 0.9)
REFINEMENT = REFINEMENTS[1]
TENTH = 0.1


@dataclass(frozen=True)
class Case:
    """A notch with the radius of its corners, the largest angle of a joint, and the thrust that presses it together."""

    name: str
    rig: Rig
    fillet_mm: float
    largest_deg: float
    thrust_N: float = 0.0


@dataclass(frozen=True)
class CaseResult:
    """Moment over angle of one case: loading, unloading to zero, and loading again to half of the angle.

    Parameters
    ----------
    curve
        Of the solid.
    laws
        Moments on the same path, shapes (k,): the section between rigid rings; the section in series with elastic
        roots, as in both engines; and the elements fitted to the solid's first loop.
    without_thrust
        Moment of the engines' section on the same path without the thrust, shape (k,).
    strain_fibre
        Strain of the outermost fibre, shape (k,).
    elements
        Number of fitted elements.
    """

    case: Case
    curve: MomentAngle
    laws: tuple[Floats, ...]
    without_thrust: Floats
    strain_fibre: Floats
    elements: int


@dataclass(frozen=True)
class MeshRun:
    """Moment and strain at the largest angle for one mesh and one slope of the plateau; wall time in seconds."""

    name: str
    refinement: float
    hardening: float
    elements: int
    moment_Nmm: float
    strain: float
    seconds: float


def hardened(young_GPa: float) -> Superelastic:
    """Section law with the same slope of the plateau as the solid."""
    return replace(LAW, plateau_modulus_GPa=HARDENING_SHARE * young_GPa)


def wrist(width_mm: float, spacing_mm: float) -> Rig:
    """Rig of a measured wrist (GitHub nepacheco/MastersThesis, 4f920c7): tube of 1.62/1.40 mm, five one-sided slots."""
    base = preset("du2018")
    tendon = replace(base.tendon_a, moment_arm_mm=0.6)
    return replace(
        base,
        name=f"wrist {width_mm:g}",
        joint=NotchedTube(
            Tube(1.62, 1.40), Notch("rectangular", 5, depth_mm=1.40, width_mm=width_mm, spacing_mm=spacing_mm)
        ),
        material=replace(base.material, youngs_modulus_GPa=50.0, loop_share=0.0),
        superelastic=hardened(50.0),
        tendon_a=tendon,
        tendon_b=tendon,
    )


def cases() -> list[Case]:
    """Both wrists up to notch closure, and the default joint up to nearly four times its working angle."""
    found = []
    for name, width, spacing in (("wrist '90'", 0.5, 1.5), ("wrist '150'", 0.8, 1.2)):
        rig = wrist(width, spacing)
        found.append(Case(name, rig, 0.03, float(np.degrees(joint_mechanics(rig).closure_angle_rad))))
    pair = replace(preset("du2018"), superelastic=hardened(60.0))
    pair = replace(pair, material=replace(pair.material, loop_share=0.0))  # all metal follows the law
    return [*found, *(Case(name, pair, 0.125, 12.0, thrust) for name, thrust in DU2018)]


def path_deg(largest: float) -> Floats:
    """Angles of a comparison: up in 12 steps, down to zero, and up again to half; shape (30,)."""
    up = largest * np.arange(1, 13) / 12
    return np.concatenate([up, up[-2::-1], [0.0], up[:6]])


def solve(case: Case) -> CaseResult:
    """Bend one case as a solid and evaluate the section laws on the same path."""
    angles = np.radians(path_deg(case.largest_deg))
    joint = quarter_joint(case.rig, refinement=REFINEMENT, fillet_mm=case.fillet_mm, thrust_N=case.thrust_N)
    curve = measured(joint, list(bend(joint, angles, step_rad=np.radians(3.0))))
    first = slice(0, 24)
    fitted = fibres_of_curve(replace(curve, angle_rad=curve.angle_rad[first], moment_Nmm=curve.moment_Nmm[first]))
    rigid = with_notch(case.rig, replace(notched_tube(case.rig).notch, rigid_roots=True))
    laws = [section_moment(one, angles, case.thrust_N) for one in (rigid, case.rig)]
    return CaseResult(
        case,
        curve,
        (*laws, flag_path(fitted, angles).sum(axis=1)),
        section_moment(case.rig, angles, 0.0),
        joint_mechanics(case.rig).peak_strain_per_rad * angles,
        len(fitted.stiffness),
    )


def section_moment(rig: Rig, angles_rad: Floats, thrust_N: float) -> Floats:
    """Moment of the section under a thrust along a path of angles, shape (k,): the thrust comes first."""
    section = joint_mechanics(rig).section
    assert section is not None
    return section_path(section, np.append(0.0, angles_rad), thrust_N).moment_Nmm[1:]


def mesh_run(job: tuple[Case, float, float]) -> MeshRun:
    """Bend a case once to its largest angle; the job has the case, the refinement and the slope of the plateau."""
    case, refinement, hardening = job
    begin = time.perf_counter()
    joint = quarter_joint(case.rig, refinement=refinement, fillet_mm=case.fillet_mm, hardening=hardening)
    angles = np.radians(case.largest_deg) * np.linspace(0, 1, 7)[1:]
    curve = measured(joint, list(bend(joint, angles, step_rad=np.radians(5.0)))[-1:])
    return MeshRun(
        case.name,
        refinement,
        hardening,
        len(joint.solid.cells),
        float(curve.moment_Nmm[0]),
        float(curve.principal_strain[0]),
        time.perf_counter() - begin,
    )


def solve_all() -> tuple[list[CaseResult], list[MeshRun]]:
    """Solve all cases and their mesh study in two processes."""
    chosen = cases()
    free = [case for case in chosen if case.thrust_N == 0]
    jobs = [(case, r, HARDENING_SHARE) for r in reversed(REFINEMENTS) for case in free]
    jobs += [(chosen[1], REFINEMENT, 0.001), (chosen[1], REFINEMENT, 0.02)]
    with ProcessPoolExecutor(2, multiprocessing.get_context("spawn")) as pool:
        runs = pool.map(mesh_run, jobs)
        results = list(pool.map(solve, chosen))
        return results, list(runs)


def largest_errors(result: CaseResult) -> Sequence[float]:
    """Largest difference of each law from the solid, percent of the solid's largest moment."""
    scale = np.abs(result.curve.moment_Nmm).max()
    return [100 * float(np.abs(law - result.curve.moment_Nmm).max() / scale) for law in result.laws]


def trusted_deg(result: CaseResult) -> float:
    """Angle up to which the engines' law stays within a tenth of the solid's largest moment while it is loaded."""
    steps = 1 + int(result.curve.angle_rad.argmax())
    off = np.abs(result.laws[1] - result.curve.moment_Nmm)[:steps] / np.abs(result.curve.moment_Nmm).max()
    outside = np.flatnonzero(off > TENTH)
    return float(np.degrees(result.curve.angle_rad[outside[0] - 1 if outside.size else steps - 1]))


def draw(case: Case, degrees: float, path: Path) -> None:
    """Draw a bent notch; metal beyond the onset of the plateau has another colour."""
    joint = quarter_joint(case.rig, refinement=REFINEMENT, fillet_mm=case.fillet_mm)
    bent = list(bend(joint, [np.radians(degrees)]))[-1]
    mesh = snr_mesh(case.rig, refinement=REFINEMENT, fillet_mm=case.fillet_mm)
    draw_mesh(bent_mesh(joint, bent, mesh), path, limit=superelastic_limit(case.rig))
