"""Accuracy of the analytic notch: Timoshenko flexure against the solid over depth, width and wall of three shapes."""

from __future__ import annotations

import csv
import io
import multiprocessing
import time
from collections.abc import Iterable, Iterator
from concurrent.futures import ProcessPoolExecutor
from dataclasses import astuple, dataclass, fields, replace
from typing import get_args

import numpy as np

from fem_models.joint.flexure import Flexure, beam, flexure
from fem_models.rig import Rig, preset
from fem_models.rig.joints import Notch, NotchedTube, NotchShape, Tube
from fem_models.rig.rig import Material, notched_tube
from fem_models.solid import snr_stiffness, solid_snr
from fem_models.solid.linear import as_flexure, chain_stiffness
from fem_models.solid.strain import bent_chain, peak_strain

POISSON = 0.33

WALLS = (0.04, 0.07, 0.12)
WIDTHS = (0.1, 0.2, 0.4, 0.8, 1.6)
PAIR_DEPTHS = (0.30, 0.38, 0.43, 0.46, 0.48)
ONE_SIDED_DEPTHS = (0.50, 0.65, 0.75, 0.85, 0.92)
SPACINGS = (0.05, 0.1, 0.4, 0.8)
SPACING = 0.2
TRUSTED_PERCENT = 5.0
GRID_REFINEMENT = 0.7
"""Refinement of the meshes of the grid; their stiffness is 1 to 2 % above the converged one with sharp corners."""

FILLETS_MM = (0.0, 0.125)
"""Radii of the corners: sharp, and that of the 0.25 mm wire that the preset's root width derives from."""
REFINEMENTS = (0.5, 0.7, 1.0, 1.4)


@dataclass(frozen=True)
class NotchCase:
    """One notch; lengths over the tube's outer diameter, the root width of a V over its width."""

    shape: NotchShape
    wall: float
    depth: float
    width: float
    spacing: float = SPACING
    root: float = 1.0
    fillet: float = 0.0


@dataclass(frozen=True)
class NotchResult:
    """Dimensionless stiffness of one pitch: bending over E D^3, shear and axial over E D, offset over D.

    Parameters
    ----------
    beam_bending, beam_shear, beam_axial, beam_offset
        Analytic flexure in series with the tube of the ring.
    plates_bending, plates_shear, plates_axial, plates_offset
        Solid between rigid end plates: the reference for shear.
    chain_bending, chain_axial
        Solid in an endless chain of equal joints: the reference for bending and tension.
    roots_bending
        As ``beam_bending``, with the root length of :mod:`fem_models.joint.roots`.
    nodes
        Of the solid's mesh.
    """

    case: NotchCase
    beam_bending: float
    beam_shear: float
    beam_axial: float
    beam_offset: float
    plates_bending: float
    plates_shear: float
    plates_axial: float
    plates_offset: float
    chain_bending: float
    chain_axial: float
    roots_bending: float
    nodes: int

    @property
    def in_grid(self) -> bool:
        """Whether the case belongs to the grid of depth, width and wall, not to the variants of spacing and fillet."""
        return self.case.spacing == SPACING and self.case.fillet == 0

    def error_percent(self, quantity: str, model: str) -> float:
        """Error of a model, ``beam`` or ``roots``, against the solid in ``bending``, ``axial`` or ``shear``."""
        reference = "plates" if quantity == "shear" else "chain"
        return 100 * float(getattr(self, f"{model}_{quantity}") / getattr(self, f"{reference}_{quantity}") - 1)


@dataclass(frozen=True)
class MeshRun:
    """One mesh of the convergence study: bending stiffness in the chain, Nmm/rad, peak strain per radian, and cost."""

    fillet_mm: float
    refinement: float
    elements: int
    bending: float
    strain: float
    seconds: float
    megabytes: float


_RESULT_FIELDS = tuple(field for field in fields(NotchResult) if field.name != "case")


def grid() -> Iterator[NotchCase]:
    """All cases: depth, width and wall of each shape, then spacing and fillet at the middle one of each."""
    for shape in get_args(NotchShape):
        depths = ONE_SIDED_DEPTHS if shape == "rectangular" else PAIR_DEPTHS
        root = 4 / 7 if shape == "v_pair" else 1.0  # as in the preset of the paper
        for wall in WALLS:
            for depth in depths:
                for width in WIDTHS:
                    yield NotchCase(shape, wall, depth, width, root=root)
        middle = NotchCase(shape, WALLS[1], depths[2], WIDTHS[2], root=root)
        yield from (replace(middle, spacing=spacing) for spacing in SPACINGS)
        yield from (replace(middle, fillet=fillet) for fillet in (0.01, 0.02, 0.04))


def rig_of(case: NotchCase) -> Rig:
    """Rig with a tube of 1 mm outer diameter and E = 1 N/mm^2: its stiffness is dimensionless."""
    base = preset("du2018")
    tendon = replace(base.tendon_a, moment_arm_mm=0.4)
    root = case.root * case.width if case.shape == "v_pair" else None
    return replace(
        base,
        name="notch",
        joint=NotchedTube(
            Tube(1.0, 1.0 - 2 * case.wall), Notch(case.shape, 1, case.depth, case.width, case.spacing, root)
        ),
        material=Material(youngs_modulus_GPa=1e-3, poissons_ratio=POISSON),
        tendon_a=tendon,
        tendon_b=tendon,
    )


def beam_pitch(rig: Rig) -> Flexure:
    """Analytic stiffness of a pitch about its middle: the flexure in series with the uncut tube on both sides."""
    joint, tube, notch = beam(rig), notched_tube(rig).tube, notched_tube(rig).cut
    assert joint.shear_N_per_mm is not None
    assert joint.axial_N_per_mm is not None
    young = rig.material.youngs_modulus_GPa * 1e3
    outer, inner = tube.outer_diameter_mm / 2, tube.inner_diameter_mm / 2
    area, second = np.pi * (outer**2 - inner**2), np.pi / 4 * (outer**4 - inner**4)
    half, edge, length = notch.pitch_mm / 2, notch.width_mm / 2, notch.spacing_mm
    joint_bend, y = 1 / joint.bending_Nmm_per_rad, joint.neutral_offset_mm
    bend = joint_bend + length / (young * second)
    # kappa = 1/2 as in fem_models.joint.mechanics
    lateral = 1 / joint.shear_N_per_mm + 2 * (half**3 - edge**3) / (3 * young * second)
    lateral += length * 4 * (1 + rig.material.poissons_ratio) / (young * area)
    axial = 1 / joint.axial_N_per_mm + y**2 * joint_bend + length / (young * area)  # at the tube axis
    coupling = y * joint_bend
    return Flexure(1 / bend, 1 / lateral, 1 / (axial - coupling**2 / bend), coupling / bend)


def solve(case: NotchCase, refinement: float = GRID_REFINEMENT) -> NotchResult:
    """Solve one case with both models."""
    rig = rig_of(case)
    pitch = beam_pitch(rig)
    solid = solid_snr(rig, refinement=refinement, fillet_mm=case.fillet)
    plates = as_flexure(snr_stiffness(solid).stiffness)
    chain = np.linalg.inv(chain_stiffness(solid).stiffness)
    roots = 1 / flexure(rig).bending_Nmm_per_rad - 1 / beam(rig).bending_Nmm_per_rad
    assert pitch.shear_N_per_mm is not None
    assert pitch.axial_N_per_mm is not None
    assert plates.shear_N_per_mm is not None
    assert plates.axial_N_per_mm is not None
    return NotchResult(
        case=case,
        beam_bending=pitch.bending_Nmm_per_rad,
        beam_shear=pitch.shear_N_per_mm,
        beam_axial=pitch.axial_N_per_mm,
        beam_offset=pitch.neutral_offset_mm,
        plates_bending=plates.bending_Nmm_per_rad,
        plates_shear=plates.shear_N_per_mm,
        plates_axial=plates.axial_N_per_mm,
        plates_offset=plates.neutral_offset_mm,
        chain_bending=float(1 / chain[2, 2]),
        chain_axial=float(1 / (chain[0, 0] - chain[0, 2] ** 2 / chain[2, 2])),
        roots_bending=1 / (1 / pitch.bending_Nmm_per_rad + roots),
        nodes=len(solid.points_mm),
    )


def solve_all(cases: Iterable[NotchCase], workers: int = 2) -> list[NotchResult]:
    """Solve cases in worker processes; the results have the order of the cases."""
    with ProcessPoolExecutor(workers, mp_context=multiprocessing.get_context("spawn")) as pool:
        return list(pool.map(solve, cases, chunksize=2))


def csv_text(results: Iterable[NotchResult]) -> str:
    """Results as CSV: a row per case; the fields of case and result are the columns, results with six digits."""
    stream = io.StringIO()
    writer = csv.writer(stream, lineterminator="\n")
    writer.writerow([field.name for field in (*fields(NotchCase), *_RESULT_FIELDS)])
    for result in results:
        numbers = (getattr(result, field.name) for field in _RESULT_FIELDS)
        writer.writerow([*astuple(result.case), *(f"{v:.6g}" if isinstance(v, float) else v for v in numbers)])
    return stream.getvalue()


def mesh_run(fillet_mm: float, refinement: float) -> MeshRun:
    """Solve the joint of the default rig on one mesh; memory is the peak of the process: use a new process per mesh."""
    import resource

    solid = solid_snr(preset("du2018"), refinement=refinement, fillet_mm=fillet_mm)
    chain = np.linalg.inv(chain_stiffness(solid).stiffness)
    peak = peak_strain(solid, bent_chain(solid))
    return MeshRun(
        fillet_mm=fillet_mm,
        refinement=refinement,
        elements=solid.mesh.nelements,
        bending=float(1 / chain[2, 2]),
        strain=peak.principal_nodes,
        seconds=time.process_time(),  # since the start of the process: includes imports and two factorisations
        megabytes=resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024,
    )


def convergence() -> list[MeshRun]:
    """Run the convergence study, each mesh in a new process."""
    context = multiprocessing.get_context("spawn")
    with ProcessPoolExecutor(1, mp_context=context, max_tasks_per_child=1) as pool:
        return [pool.submit(mesh_run, fillet, r).result() for fillet in FILLETS_MM for r in REFINEMENTS]
