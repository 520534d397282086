"""Stiffness of one notch against closed forms and a fine Timoshenko beam."""

import pickle
from dataclasses import replace

import numpy as np
import pytest
import skfem
from notched_rigs import PAIR, SHEAR, WRIST, YOUNG, V, make_rig, planar
from scipy.integrate import quad

from fem_models.joint.flexure import (
    Elasticity,
    _graded_gauss,
    _kinks,
    beam,
    beam_of_notch,
    flexure,
    root_length_mm,
)
from fem_models.joint.section import section
from fem_models.rig import Rig
from fem_models.rig.joints import Notch, NotchedTube, Tube
from fem_models.rig.rig import with_notch

METAL = Elasticity(YOUNG, SHEAR, 0.33)


def test_full_tube_when_the_depth_vanishes():
    second = np.pi / 4 * (3.0**4 - 2.7**4)
    for shape in ("rectangular_pair", "rectangular", "v_pair"):
        rig = make_rig(shape, depth=1e-9)
        assert beam(rig).bending_Nmm_per_rad == pytest.approx(YOUNG * second / 1.2, rel=1e-9)
        assert beam(rig).axial_N_per_mm == pytest.approx(YOUNG * np.pi * (3.0**2 - 2.7**2) / 1.2, rel=1e-9)


def test_flexure_of_a_v_is_the_integral_over_planar_cuts():
    bend = quad(lambda z: 1 / planar(V, z)[2], 0, 0.6, points=[0.3, 0.6 - 0.3 * 0.3 / 2.72], epsrel=1e-9)[0]
    assert beam(V).bending_Nmm_per_rad == pytest.approx(YOUNG / (2 * bend), rel=1e-7)
    axial = quad(lambda z: 1 / planar(V, z)[0], 0, 0.6, points=[0.3, 0.6 - 0.3 * 0.3 / 2.72], epsrel=1e-9)[0]
    assert beam(V).axial_N_per_mm == pytest.approx(YOUNG / (2 * axial), rel=1e-7)


TUBES = [
    (6.2, 5.4, 2.72, 1.2, 0.4),
    (1.16, 0.86, 0.57, 0.3, 0.0),
    (3.0, 2.97, 1.2, 2.0, 0.01),
    (2.0, 0.4, 0.9, 0.8, 0.7),
]
"""Outer and inner diameter, depth, width and root of a V, mm; the last but one has the thinnest wall."""


@pytest.mark.parametrize(("outer", "inner", "depth", "width", "root"), [*TUBES, (2.0, 1.0, 0.3, 0.5, 0.1)])
def test_compiled_integrals_of_a_v_are_those_of_its_sections(outer, inner, depth, width, root):
    """The same points, their sections by numpy; the last notch ends within the wall."""
    joint = NotchedTube(Tube(outer, inner), Notch("v_pair", 5, depth, width, 1.0, root))
    ours = beam_of_notch(joint, METAL)
    z, weights = _graded_gauss([0.0, *_kinks(joint), width / 2])
    s = section(joint, z)
    assert ours.bending_Nmm_per_rad == pytest.approx(0.5 * YOUNG / ((1 / s.second_moment_mm4) @ weights), rel=1e-13)
    assert ours.axial_N_per_mm == pytest.approx(0.5 * YOUNG / ((1 / s.area_mm2) @ weights), rel=1e-13)


def test_a_notch_within_the_wall_has_its_kink_at_the_root_alone():
    tube = NotchedTube(Tube(2.0, 1.0), Notch("v_pair", 5, 0.3, 0.5, 1.0, 0.1))
    bend = quad(lambda z: 1 / section(tube, z).second_moment_mm4, 0, 0.25, points=[0.05], epsrel=1e-11)[0]
    assert beam_of_notch(tube, METAL).bending_Nmm_per_rad == pytest.approx(0.5 * YOUNG / bend, rel=1e-10)


def test_shear_of_a_notch_is_worked_out_when_it_is_asked_for():
    joint = flexure(V)
    assert "shear_N_per_mm" not in vars(joint)
    assert pickle.loads(pickle.dumps(joint)) == joint == flexure(V)
    assert f"shear_N_per_mm={joint.shear_N_per_mm!r}" in repr(joint)


def test_uniform_flexure_is_that_of_the_closed_form():
    s, joint, w = section(PAIR.joint, 0.0), beam(PAIR), 1.2
    bending, shear = YOUNG * s.second_moment_mm4, s.shear_coefficient * SHEAR * s.area_mm2
    assert joint.bending_Nmm_per_rad == pytest.approx(float(bending / w), rel=1e-12)
    assert 1 / joint.shear_N_per_mm == pytest.approx(float(w**3 / (12 * bending) + w / shear), rel=1e-12)
    assert joint.axial_N_per_mm == pytest.approx(float(YOUNG * s.area_mm2 / w), rel=1e-12)


def test_euler_bernoulli_limit_is_reached_with_the_square_of_the_slenderness():
    def shear_part(width: float) -> float:
        rig = make_rig("rectangular_pair", width=width)
        bending = YOUNG * float(section(rig.joint, 0.0).second_moment_mm4)
        return 12 * bending / (beam(rig).shear_N_per_mm * width**3) - 1

    parts = np.array([shear_part(w) for w in (5.0, 10.0, 20.0, 40.0)])
    np.testing.assert_allclose(np.log2(parts[:-1] / parts[1:]), 2.0, atol=1e-6)
    assert parts[-1] < 1e-3


def fine_beam(rig: Rig, moment: float, shear: float, n: int = 400) -> tuple[float, float]:
    """Rotation and lateral displacement of the distal mid-frame: mixed P2/P1 Timoshenko beam in scikit-fem."""
    half = rig.joint.notch.width_mm / 2
    mesh = skfem.MeshLine(np.linspace(-half, half, n + 1))
    v_basis = skfem.Basis(mesh, skfem.ElementLineP2(), intorder=6)
    r_basis = v_basis.with_element(skfem.ElementLineP1())

    def bending(z):
        return YOUNG * section(rig.joint, z).second_moment_mm4

    def shearing(z):
        s = section(rig.joint, z)
        return s.shear_coefficient * SHEAR * s.area_mm2

    vv = skfem.BilinearForm(lambda u, v, w: shearing(w.x[0]) * u.grad[0] * v.grad[0]).assemble(v_basis)
    vr = skfem.BilinearForm(lambda r, v, w: -shearing(w.x[0]) * r * v.grad[0]).assemble(r_basis, v_basis)
    rr = skfem.BilinearForm(
        lambda r, q, w: bending(w.x[0]) * r.grad[0] * q.grad[0] + shearing(w.x[0]) * r * q
    ).assemble(r_basis)
    matrix = skfem.bmat([[vv, vr], [vr.T, rr]], "csr")
    v_ends = [int(v_basis.nodal_dofs[0, i]) for i in (0, n)]
    r_ends = [vv.shape[0] + int(r_basis.nodal_dofs[0, i]) for i in (0, n)]
    load = np.zeros(matrix.shape[0])
    load[v_ends[1]], load[r_ends[1]] = shear, moment - shear * half
    u = skfem.solve(*skfem.condense(matrix, load, D=np.array([v_ends[0], r_ends[0]])))
    return u[r_ends[1]], u[v_ends[1]] - half * u[r_ends[1]]


@pytest.mark.parametrize("rig", [V, make_rig(root=0.0), make_rig(root=0.4, depth=2.5), PAIR, WRIST])
def test_flexure_against_a_fine_beam_in_scikit_fem(rig):
    joint = beam(rig)
    rotation, still = fine_beam(rig, 1.0, 0.0)
    assert rotation * joint.bending_Nmm_per_rad == pytest.approx(1, rel=1e-3)  # the mesh: 400 equal elements
    turn, lateral = fine_beam(rig, 0.0, 1.0)
    assert lateral * joint.shear_N_per_mm == pytest.approx(1, rel=1e-3)
    # moment and lateral force at the mid-point do not couple, by symmetry
    assert abs(still) < 1e-9 * rotation * rig.joint.notch.width_mm
    assert abs(turn) < 1e-9 * lateral / rig.joint.notch.width_mm


def test_the_fine_beam_converges_to_the_closed_form_at_second_order():
    exact = 1 / beam(V).bending_Nmm_per_rad
    gaps = np.array([abs(fine_beam(V, 1.0, 0.0, n)[0] / exact - 1) for n in (200, 400, 800)])
    np.testing.assert_allclose(np.log2(gaps[:-1] / gaps[1:]), 2, atol=0.2)


@pytest.mark.parametrize("rig", [PAIR, WRIST, V], ids=["pair", "one-sided", "v"])
def test_roots_are_lengths_of_the_narrowest_section_in_series(rig):
    """1/k = 1/k_between + 2 l/(E I); roots that are rigid leave the notch between them."""
    notch = rig.joint.notch
    soft, rigid = (with_notch(rig, replace(notch, rigid_roots=yes)) for yes in (False, True))
    rigidity = YOUNG * float(section(soft.joint, 0.0).second_moment_mm4)
    between = beam(soft).bending_Nmm_per_rad
    assert flexure(rigid).bending_Nmm_per_rad == pytest.approx(between, rel=1e-12)
    more = 2 * root_length_mm(soft.joint) / rigidity
    assert more * between > 0.02
    assert 1 / flexure(soft).bending_Nmm_per_rad == pytest.approx(1 / between + more, rel=1e-12)
