"""Superelastic notch: moment over angle of the solid beside the section law, and the flag elements fitted to it.

``python -m validation.joints.superelastic`` bends two measured wrists' notches and the default ring, and writes
``docs/validation/superelastic.md``, ``docs/images/superelastic.png`` and ``docs/images/superelastic-strain.png``.
"""

from __future__ import annotations

import multiprocessing
import time
from collections.abc import Sequence
from concurrent.futures import ProcessPoolExecutor
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from fem_models.joint.flexure import closure_angle_rad, peak_strain_per_rad
from fem_models.joint.superelastic import flag_fibres
from fem_models.rig.effects import Superelastic
from fem_models.rig.joints import Notch, NotchedTube, Tube
from fem_models.rig.presets import preset
from fem_models.rig.rig import Rig, notched_tube, with_notch
from fem_models.solid.large_bending import MomentAngle, bend, measured, quarter_joint
from fem_models.solid.mesh import snr_mesh
from fem_models.solid.strain import superelastic_limit
from fem_models.solid.superelastic import HARDENING_SHARE
from fem_models.solid.superelastic_elements import fibres_of_curve, flag_path
from fem_models.view.solid import bent_mesh, draw_mesh
from hysteresis.arrays import Floats
from hysteresis.files import write_files

LAW = Superelastic(plateau_MPa=450.0, unloading_plateau_MPa=200.0, transformation_strain=0.04)
REFINEMENTS = (0.4, 0.6, 0.9)
REFINEMENT = REFINEMENTS[1]
DOCS = Path(__file__).parents[2] / "docs"


@dataclass(frozen=True)
class Case:
    """A notch, the radius of its corners, and the largest angle."""

    name: str
    rig: Rig
    fillet_mm: float
    largest_deg: float


@dataclass(frozen=True)
class CaseResult:
    """Curve of the solid up, down to zero and half way up again, and moments of the section laws on the same path.

    ``laws`` are the fibres between rigid rings, those with elastic roots as both engines have them, and the fit to the
    first way up and down; ``strain_fibre`` is that of the outermost fibre, shape (k,).
    """

    case: Case
    curve: MomentAngle
    laws: tuple[Floats, ...]
    strain_fibre: Floats
    elements: int


@dataclass(frozen=True)
class MeshRun:
    """Moment and strain at the largest angle on one mesh or with one slope of the plateau; seconds of the clock."""

    name: str
    refinement: float
    hardening: float
    elements: int
    moment_Nmm: float
    strain: float
    seconds: float


def hardened(young_GPa: float) -> Superelastic:
    """Give the section law the slope of the plateau that the solid has."""
    return replace(LAW, plateau_modulus_GPa=HARDENING_SHARE * young_GPa)


def wrist(width_mm: float, spacing_mm: float) -> Rig:
    """One of the measured wrists (GitHub nepacheco/MastersThesis, 4f920c7): 1.62/1.40 mm, five one-sided slots."""
    base = preset("du2018")
    rope = replace(base.tendon_a, moment_arm_mm=0.6)
    return replace(
        base,
        name=f"wrist {width_mm:g}",
        joint=NotchedTube(
            Tube(1.62, 1.40), Notch("rectangular", 5, depth_mm=1.40, width_mm=width_mm, spacing_mm=spacing_mm)
        ),
        material=replace(base.material, youngs_modulus_GPa=50.0),
        superelastic=hardened(50.0),
        tendon_a=rope,
        tendon_b=rope,
    )


def cases() -> list[Case]:
    """Both wrists until their notches close, and the default ring to nearly four times its working angle."""
    found = []
    for name, width, spacing in (("wrist '90'", 0.5, 1.5), ("wrist '150'", 0.8, 1.2)):
        rig = wrist(width, spacing)
        found.append(Case(name, rig, 0.03, float(np.degrees(closure_angle_rad(rig)))))
    return [*found, Case("du2018", replace(preset("du2018"), superelastic=hardened(60.0)), 0.125, 12.0)]


def path_deg(largest: float) -> Floats:
    """Angles of a comparison: up, down, and half way up again, 12 steps to the largest."""
    up = largest * np.arange(1, 13) / 12
    return np.concatenate([up, up[-2::-1], [0.0], up[:6]])


def solve(case: Case) -> CaseResult:
    """Bend one case and evaluate the section laws beside it."""
    angles = np.radians(path_deg(case.largest_deg))
    joint = quarter_joint(case.rig, refinement=REFINEMENT, fillet_mm=case.fillet_mm)
    curve = measured(joint, list(bend(joint, angles, step_rad=np.radians(3.0))))
    first = slice(0, 24)
    fitted = fibres_of_curve(replace(curve, angle_rad=curve.angle_rad[first], moment_Nmm=curve.moment_Nmm[first]))
    rigid = with_notch(case.rig, replace(notched_tube(case.rig).notch, rigid_roots=True))
    laws = (flag_fibres(rigid), flag_fibres(case.rig), fitted)
    return CaseResult(
        case,
        curve,
        tuple(flag_path(law, angles).sum(axis=1) for law in laws),
        peak_strain_per_rad(case.rig) * angles,
        len(fitted.stiffness),
    )


def mesh_run(job: tuple[Case, float, float]) -> MeshRun:
    """Bend a case once to its largest angle on a mesh of its own."""
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
    """Solve all cases and their mesh study, two at a time."""
    chosen = cases()
    jobs = [(case, r, HARDENING_SHARE) for r in reversed(REFINEMENTS) for case in chosen]
    jobs += [(chosen[1], REFINEMENT, 0.001), (chosen[1], REFINEMENT, 0.02)]
    with ProcessPoolExecutor(2, multiprocessing.get_context("spawn")) as pool:
        runs = pool.map(mesh_run, jobs)
        results = list(pool.map(solve, chosen))
        return results, list(runs)


def largest_errors(result: CaseResult) -> Sequence[float]:
    """Largest difference of each law to the solid, percent of the solid's largest moment."""
    scale = np.abs(result.curve.moment_Nmm).max()
    return [100 * float(np.abs(law - result.curve.moment_Nmm).max() / scale) for law in result.laws]


def draw(case: Case, degrees: float, path: Path) -> None:
    """Picture of a bent notch, metal beyond the plateau's onset in a colour of its own."""
    joint = quarter_joint(case.rig, refinement=REFINEMENT, fillet_mm=case.fillet_mm)
    bent = list(bend(joint, [np.radians(degrees)]))[-1]
    mesh = snr_mesh(case.rig, refinement=REFINEMENT, fillet_mm=case.fillet_mm)
    draw_mesh(bent_mesh(joint, bent, mesh), path, limit=superelastic_limit(case.rig))


def main() -> None:
    """Solve everything and write the page and its figure into the documentation."""
    from docs.make.superelastic import figure, page

    results, runs = solve_all()
    write_files({DOCS / "validation" / "superelastic.md": page(results, runs)})
    picture = DOCS / "images" / "superelastic.png"
    picture.parent.mkdir(exist_ok=True)
    part = picture.with_suffix(".part")
    part.write_bytes(figure(results))
    part.replace(picture)
    draw(cases()[1], 15.0, picture.with_name("superelastic-strain.png"))


if __name__ == "__main__":
    main()
