"""Root length against its plane problem, and the comparison of the analytic notch with the solid."""

import csv
from dataclasses import fields, replace
from pathlib import Path

import numpy as np
import pytest
from skfem import Basis, ElementTriP2, ElementVector, FacetBasis, LinearForm, MeshTri, condense, solve
from skfem.models.elasticity import linear_elasticity, plane_stress

from docs.make.notches import TABLE, figure, page
from fem_models.joint.flexure import beam, flexure
from fem_models.joint.roots import HALF_PLANE, root_length
from fem_models.rig import preset
from fem_models.rig.joints import Notch
from fem_models.rig.rig import with_notch
from fem_models.solid import solid_snr
from fem_models.solid.linear import chain_stiffness
from validation.joints import NotchCase
from validation.joints.notches import FILLETS_MM, MeshRun, NotchResult, beam_pitch, csv_text, grid, mesh_run, rig_of
from validation.joints.notches import solve as solve_case

RIG = preset("du2018")


def read_results(path: Path) -> list[NotchResult]:
    """Read a table of :func:`csv_text`."""
    own = {field.name for field in fields(NotchCase)}
    with path.open(newline="") as stream:
        rows = [{k: v if k == "shape" else float(v) for k, v in row.items()} for row in csv.DictReader(stream)]
    return [
        NotchResult(NotchCase(**{k: row[k] for k in own}), **{k: v for k, v in row.items() if k not in own})
        for row in rows
    ]


@pytest.fixture(scope="module")
def results():
    return read_results(TABLE)


def graded(start: float, end: float, least: float) -> np.ndarray:
    """Points from start to end with steps that increase by a quarter away from start."""
    steps = [least]
    while sum(steps) < abs(end - start):
        steps.append(1.25 * steps[-1])
    return start + (end - start) * np.concatenate([[0.0], np.cumsum(steps)]) / sum(steps)


def plane_root_length(height: float, poisson: float) -> float:
    """Strip of unit width and length 2 on a plate of that height, plane stress, by P2 triangles on a graded grid.

    The plate's lower edge stays straight and may slide; the strip carries a unit moment at its end.
    """
    wide, long, least = 6 * max(height, 1.0), 2.0, min(0.02, height / 6)
    inner = np.concatenate([graded(0.5, 0.0, least), graded(0.5, wide, least)])
    x = np.unique(np.concatenate([inner, -inner]).round(12))
    y = np.unique(np.concatenate([graded(0.0, -height, least), graded(0.0, long, least)]).round(12))
    whole = MeshTri.init_tensor(x, y)
    middle = whole.p[:, whole.t].mean(axis=1)
    mesh = whole.remove_elements(np.flatnonzero((middle[1] > 0) & (np.abs(middle[0]) > 0.5)))
    basis = Basis(mesh, ElementVector(ElementTriP2()), intorder=4)
    stiffness = linear_elasticity(*plane_stress(1.0, poisson)).assemble(basis)
    top = FacetBasis(mesh, basis.elem, facets=mesh.facets_satisfying(lambda p: np.isclose(p[1], long)), intorder=4)
    load = LinearForm(lambda v, w: -12 * w.x[0] * v[1]).assemble(top)
    foot = basis.get_dofs(lambda p: np.isclose(p[1], -height))
    slide = foot.all(["u^1"])
    held = np.append(foot.all(["u^2"]), slide[np.abs(basis.doflocs[0, slide]).argmin()])
    field = solve(*condense(stiffness, load, D=held))
    return float(load @ field) / 12 - long  # rotation times E I is the length, with E I = 1/12


@pytest.mark.parametrize("height", [0.1, 0.3, 1.0, 3.0])
def test_root_lengths_are_those_of_the_plane_problem(height):
    assert float(root_length(height)) == pytest.approx(plane_root_length(height, 0.33), rel=0.01)


def test_limits_of_the_root_length():
    """Zero without a plate; a thin plate continues the strip; beyond a half plane, and with nu, it is constant."""
    assert float(root_length(0.0)) == 0.0
    assert float(root_length(0.01)) == pytest.approx(0.01, rel=0.03)
    assert root_length(np.array([7.9, 8.1, 1e6])) == pytest.approx([HALF_PLANE] * 3, rel=0.005)
    heights = np.linspace(0, 10, 500)
    assert (np.diff(root_length(heights)) >= 0).all()
    assert plane_root_length(0.3, 0.0) == pytest.approx(plane_root_length(0.3, 0.45), rel=0.005)


def test_roots_correct_the_default_rig():
    """Sharp corners, spacing 1.2 mm: the beam is 48 % too stiff; with roots it is within 5 %."""
    solid = 1 / np.linalg.inv(chain_stiffness(solid_snr(RIG)).stiffness)[2, 2]
    assert beam(RIG).bending_Nmm_per_rad / solid == pytest.approx(1.48, abs=0.03)
    assert flexure(RIG).bending_Nmm_per_rad / solid == pytest.approx(1.0, abs=0.05)


@pytest.mark.slow
@pytest.mark.parametrize("shape", ["rectangular_pair", "rectangular"])
def test_long_flexures_are_beams(shape):
    """The roots matter less for wide notches: the error falls as 1/width."""
    errors = [solve_case(NotchCase(shape, 0.07, 0.45, width), 0.6).error_percent("bending", "beam") for width in (1, 2)]
    assert errors[0] / errors[1] == pytest.approx(2.0, abs=0.3)


def test_beam_of_a_pitch_adds_the_ring():
    """A slot as long as the pitch has no ring; otherwise E I_tube/s is in series."""
    case = NotchCase("rectangular", 0.07, 0.6, 0.5, spacing=1e-9)
    rig = rig_of(case)
    joint, pitch = beam(rig), beam_pitch(rig)
    assert pitch.bending_Nmm_per_rad == pytest.approx(joint.bending_Nmm_per_rad, rel=1e-6)
    assert pitch.axial_N_per_mm == pytest.approx(joint.axial_N_per_mm, rel=1e-6)
    assert pitch.neutral_offset_mm == pytest.approx(joint.neutral_offset_mm, rel=1e-6)
    second = np.pi / 4 * (0.5**4 - 0.43**4)
    longer = beam_pitch(rig_of(replace(case, spacing=0.3)))
    assert 1 / longer.bending_Nmm_per_rad - 1 / pitch.bending_Nmm_per_rad == pytest.approx(0.3 / second, rel=1e-6)


@pytest.mark.slow
def test_table_is_complete_and_reproducible(results, tmp_path):
    assert [r.case for r in results] == list(grid())
    case = next(r for r in results if r.case.shape == "rectangular_pair" and r.case.width == 0.4)
    again = solve_case(case.case)
    assert again.chain_bending == pytest.approx(case.chain_bending, rel=1e-4)
    assert again.beam_shear == pytest.approx(case.beam_shear, rel=1e-4)
    (tmp_path / "again.csv").write_text(csv_text(results))
    assert read_results(tmp_path / "again.csv") == results


def test_claims_of_the_page(results):
    """The beam is never too compliant; with roots it is accurate, unless a deep one-sided notch is short."""
    main = [r for r in results if r.in_grid]
    assert min(r.error_percent("bending", "beam") for r in main) > 0
    beam, roots = (np.abs([r.error_percent("bending", m) for r in main]) for m in ("beam", "roots"))
    assert np.median(beam) > 25
    assert np.median(roots) < 3
    assert np.quantile(roots, 0.9) < 8
    assert roots.max() < 23
    one_sided = {r.case: abs(r.error_percent("bending", "roots")) for r in main if r.case.shape == "rectangular"}
    for case, error in one_sided.items():  # the section is exact: the rest is the roots', and falls with the width
        of_depth = [one_sided[other] for other in one_sided if replace(other, width=case.width) == case]
        assert of_depth == sorted(of_depth, reverse=True)
        assert error < 4 or case.width < 1.6
    assert all(r.plates_bending >= r.chain_bending for r in results)  # plates constrain what the chain leaves free


def test_page_and_figure(results):
    runs = [MeshRun(f, r, int(1e6 * r**3), 265 + r**-3, 0.3, 1.0, 300.0) for f in FILLETS_MM for r in (0.7, 1.0, 1.4)]
    text = page(results, runs)
    assert "observed order 3.00" in text
    assert figure(results)[:8] == b"\x89PNG\r\n\x1a\n"


def test_run_of_a_mesh_reports_its_cost():
    run = mesh_run(0.125, 0.5)
    assert run.elements > 500
    assert run.seconds > 0
    assert run.megabytes > 50


def test_closed_flanks_of_a_steep_v():
    rig = with_notch(RIG, Notch("v_pair", 3, 2.86, 1.4, 1.2, 0.0))
    assert flexure(rig).bending_Nmm_per_rad < beam(rig).bending_Nmm_per_rad
