"""Sections of notched tubes against finite elements, quadrature over planar cuts, and Cowper's shear coefficients."""

from dataclasses import replace

import numpy as np
import pytest
import skfem
from notched_rigs import PAIR, WRIST, V, make_rig, planar
from skfem.helpers import dot, grad

from fem_models.joint.section import cut_height_mm, section
from fem_models.rig import Rig
from fem_models.rig.rig import with_notch


def saint_venant(rig: Rig) -> tuple[float, float, float, float]:
    """Area, second moment, centroid and shear coefficient of one sector, from a finite element mesh of it.

    Shear stress is the gradient of the flexure function: Laplace's equation with source -x/I and free edges
    (Saint-Venant, exact for Poisson's ratio 0); 1/kappa = A times its energy.
    """
    outer, inner = rig.joint.tube.outer_diameter_mm / 2, rig.joint.tube.inner_diameter_mm / 2
    ratio = float(cut_height_mm(rig.joint, 0.0)) / ((outer + inner) / 2)
    one_sided = rig.joint.notch.shape == "rectangular"
    half = np.arccos(-ratio) if one_sided else np.arcsin(ratio)
    grid = skfem.MeshQuad.init_tensor(np.linspace(inner, outer, 9), np.linspace(-half, half, 121))
    r, phi = grid.p
    x, y = (-r * np.cos(phi), r * np.sin(phi)) if one_sided else (r * np.sin(phi), r * np.cos(phi))
    basis = skfem.Basis(skfem.MeshQuad(np.array([x, y]), grid.t), skfem.ElementQuad2())
    area = skfem.Functional(lambda w: 1.0 + 0 * w.x[0]).assemble(basis)
    centre = skfem.Functional(lambda w: w.x[0]).assemble(basis) / area
    second = skfem.Functional(lambda w: (w.x[0] - centre) ** 2).assemble(basis)
    laplace = skfem.BilinearForm(lambda u, v, _: dot(grad(u), grad(v))).assemble(basis)
    source = skfem.LinearForm(lambda v, w: (w.x[0] - centre) / second * v).assemble(basis)
    flexure_function = skfem.solve(*skfem.condense(laplace, source, D=np.array([0])))
    return area, second, centre, 1 / (area * float(source @ flexure_function))


@pytest.mark.parametrize(
    "rig",
    [PAIR, make_rig("rectangular_pair", depth=1.5), make_rig("rectangular_pair", depth=0.3)]
    + [with_notch(WRIST, replace(WRIST.joint.notch, depth_mm=d)) for d in (0.5, 1.0, 1.4, 1.5)],
)
def test_sector_against_finite_elements_of_the_section(rig):
    area, second, centre, shear = saint_venant(rig)
    ours = section(rig.joint, 0.0)
    arcs = 1 if rig.joint.notch.shape == "rectangular" else 2
    assert float(ours.area_mm2) == pytest.approx(arcs * area, rel=1e-3)  # 1e-3: arcs meshed with straight edges
    assert float(ours.second_moment_mm4) == pytest.approx(arcs * second, rel=1e-3)
    assert float(ours.neutral_offset_mm) == pytest.approx(-centre, abs=1e-3)
    assert float(ours.shear_coefficient) == pytest.approx(shear, rel=0.01)  # 1 %: thin-wall shear flow


def test_shear_coefficient_meets_cowper_at_both_ends():
    # Cowper 1966, doi 10.1115/1.3625046, at nu = 0: rectangle 10/12; round tube of m = R_i/R_o
    small = make_rig("rectangular_pair", outer=6.0, inner=5.99, depth=2.9)
    assert float(section(small.joint, 0.0).shear_coefficient) == pytest.approx(10 / 12, rel=1e-3)
    m2 = 0.9**2
    tube = 6 * (1 + m2) ** 2 / (7 * (1 + m2) ** 2 + 20 * m2)
    ours = float(section(make_rig("rectangular_pair", depth=1e-9).joint, 0.0).shear_coefficient)
    assert ours == pytest.approx(tube, rel=0.01)


@pytest.mark.parametrize(("depth", "error"), [(1.1, 0.003), (1.3, 0.025), (1.4, 0.082)])
def test_planar_cut_of_the_one_sided_notch(depth, error):
    rig = with_notch(WRIST, replace(WRIST.joint.notch, depth_mm=depth))
    area, centre, second = planar(rig, 0.0)
    ours = section(rig.joint, 0.0)
    assert float(ours.area_mm2) == pytest.approx(area, rel=0.003)
    assert float(ours.neutral_offset_mm) == pytest.approx(-centre, rel=0.002)
    assert float(ours.second_moment_mm4) == pytest.approx(second, rel=error)


def test_cut_height_of_a_v():
    # flat root of 0.6, then straight up to the outer radius at 0.6 from the middle, 3 beyond
    np.testing.assert_allclose(cut_height_mm(V.joint, [0.0, -0.3, 0.45, -0.6, 1.0]), [0.28, 0.28, 1.64, 3.0, 3.0])
