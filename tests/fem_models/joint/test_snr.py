"""Analytic single notched ring: sections, stiffness, the paper's elements, against independent references."""

from dataclasses import replace

import numpy as np
import pytest
import skfem
from hypothesis import given
from hypothesis import strategies as st
from scipy.integrate import quad
from skfem.helpers import dot, grad

from fem_models.joint.flexure import beam, closure_angle_rad, flexure, moment_arms_mm, peak_strain_per_rad
from fem_models.joint.paper_elements import element_rotations, force_for_angle, theta_sum
from fem_models.joint.section import cut_height_mm, section
from fem_models.rig import Rig, RigError
from fem_models.rig.joints import MeasuredJoint, Notch, NotchedTube, Tube
from fem_models.rig.rig import Material, Tendon, Wheel, notched_tube, with_notch

YOUNG = 60e3  # N/mm^2
SHEAR = YOUNG / (2 * 1.33)


def make_rig(
    shape: str = "v_pair",
    *,
    outer: float = 6.0,
    inner: float = 5.4,
    depth: float = 2.72,
    width: float = 1.2,
    root: float | None = 0.6,
    arm: float = 2.62,
    count: int = 14,
) -> Rig:
    """The paper's manipulator with dimensions that fit it; keywords change one."""
    rope = Tendon(EA_N=9000.0, moment_arm_mm=arm, free_length_mm=150.0)
    return Rig(
        name="test",
        material=Material(youngs_modulus_GPa=60.0, poissons_ratio=0.33),
        tendon_a=rope,
        tendon_b=rope,
        wheel=Wheel(10.0),
        preload_N=20.0,
        joint=NotchedTube(
            Tube(outer, inner), Notch(shape, count, depth, width, 1.4, root if shape == "v_pair" else None)
        ),
    )


V = make_rig()
PAIR = make_rig("rectangular_pair")
WRIST = make_rig("rectangular", outer=1.62, inner=1.40, depth=1.40, width=0.8, arm=0.6, count=5)  # the '150' wrist


def planar(rig: Rig, z: float) -> tuple[float, float, float]:
    """Area, centroid and second moment of the tube cut by planes, by quadrature over chords: no sectors in it."""
    outer, inner = rig.joint.tube.outer_diameter_mm / 2, rig.joint.tube.inner_diameter_mm / 2
    high = float(cut_height_mm(rig.joint, z))
    low = -outer if rig.joint.notch.shape == "rectangular" else -high

    def moment(power: int) -> float:
        def chord(x: float) -> float:
            wall = np.sqrt(max(outer**2 - x**2, 0)) - np.sqrt(max(inner**2 - x**2, 0))
            return 2 * x**power * wall

        inside = [x for x in (-inner, inner) if low < x < high]
        return quad(chord, low, high, points=inside or None, epsabs=1e-12, limit=200)[0]

    area, first, second = (moment(k) for k in range(3))
    return area, first / area, second - first**2 / area


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


def test_full_tube_when_the_depth_vanishes():
    second = np.pi / 4 * (3.0**4 - 2.7**4)
    for shape in ("rectangular_pair", "rectangular", "v_pair"):
        rig = make_rig(shape, depth=1e-9)
        assert beam(rig).bending_Nmm_per_rad == pytest.approx(YOUNG * second / 1.2, rel=1e-9)
        assert beam(rig).axial_N_per_mm == pytest.approx(YOUNG * np.pi * (3.0**2 - 2.7**2) / 1.2, rel=1e-9)


def test_planar_cut_of_the_pair_is_met_within_a_third_of_a_percent():
    # the figures of docs/theory/analytic-model.md
    area, _, second = planar(V, 0.0)
    ours = section(V.joint, 0.0)
    assert float(ours.area_mm2) == pytest.approx(area, rel=1e-5)
    assert float(ours.second_moment_mm4) == pytest.approx(second, rel=0.003)
    bend = quad(lambda z: 1 / planar(V, z)[2], 0, 0.6, points=[0.3], epsrel=1e-7)[0]
    assert beam(V).bending_Nmm_per_rad == pytest.approx(YOUNG / (2 * bend), rel=0.003)


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


@pytest.mark.parametrize("rig", [PAIR, WRIST])
def test_elements_are_exact_for_a_uniform_section(rig):
    joint, solution = beam(rig), element_rotations(rig, 3.0, shear_N=2.0)
    assert solution.theta_kd_rad == pytest.approx(3.0 / joint.bending_Nmm_per_rad, rel=1e-10)
    assert solution.lateral_mm == pytest.approx(2.0 / joint.shear_N_per_mm, rel=1e-10)
    alone = element_rotations(rig, 3.0)
    assert alone.theta_k_rad == pytest.approx(alone.theta_d_rad, rel=1e-10)  # both halves bend alike


def test_elements_are_two_point_gauss_quadrature_of_the_closed_form():
    # an element with 2 x 2 strains at its Gauss points is statically determinate: M there is exact, whatever E I
    n, half = 2, 0.6
    edges = np.linspace(-half, half, n + 1)
    points = (edges[:-1, None] + edges[1:, None]) / 2 + np.array([-1, 1]) / np.sqrt(3) * half / n
    expected = np.sum(half / n / (YOUNG * section(V.joint, points).second_moment_mm4))
    assert element_rotations(V, 1.0).theta_kd_rad == pytest.approx(expected, rel=1e-10)


def rotation_errors(rig: Rig, counts: tuple[int, ...]) -> np.ndarray:
    stiffness = beam(rig).bending_Nmm_per_rad
    return np.array([element_rotations(rig, 1.0, n_elements=n).theta_kd_rad * stiffness - 1 for n in counts])


@pytest.mark.parametrize("root", [0.0, 0.6])
def test_elements_converge_at_fourth_order_where_kinks_are_element_ends(root):
    # order 4 is that of 2-point Gauss; with these roots the kinks lie on element ends from 4 elements on. The taper
    # decays within c/slope = 0.03 mm, so the order shows once an element is shorter than that (64 of them).
    errors = np.abs(rotation_errors(make_rig(root=root), (2, 4, 8, 16, 32, 64, 128, 256)))
    assert (np.diff(errors) < 0).all()
    orders = np.log2(errors[:-1] / errors[1:])
    assert orders[-2] > 3.5
    assert orders[-1] == pytest.approx(4, abs=0.2)


def test_elements_converge_at_second_order_where_a_kink_lies_inside_one():
    # the kink at 0.2 mm is never an element end; its place within its element makes single steps uneven, hence the mean
    errors = np.abs(rotation_errors(make_rig(root=0.4), (4, 256)))
    assert np.log2(errors[0] / errors[1]) / 6 == pytest.approx(2, abs=0.3)


@pytest.mark.parametrize(
    ("root", "percent"), [(0.6, -4.5), (0.5, 12.3), (0.4, 36.5), (0.3, 74.0), (0.2, -31.8), (0.0, -64.9)]
)
def test_error_of_the_two_elements_of_the_paper(root, percent):
    # the table of docs/theory/analytic-model.md; the reference is the closed form, itself checked against the fine beam
    assert 100 * rotation_errors(make_rig(root=root), (2,))[0] == pytest.approx(percent, abs=0.05)


def test_error_of_more_elements():
    # docs/theory/analytic-model.md
    np.testing.assert_allclose(100 * rotation_errors(V, (4, 8, 16, 32)), [-3.11, -1.69, -0.57, -0.11], atol=0.005)


def test_lateral_error_of_the_two_elements_of_the_paper():
    # docs/theory/analytic-model.md
    lateral = element_rotations(V, 0.0, shear_N=1.0).lateral_mm * beam(V).shear_N_per_mm - 1
    assert 100 * lateral == pytest.approx(-18.9, abs=0.05)


def test_theta_sum_adds_the_joints():
    # 20 N on an arm of 2.62 mm at each of 14 joints
    assert float(theta_sum(V, 20.0)) == pytest.approx(14 * 20 * 2.62 / flexure(V).bending_Nmm_per_rad)
    two = element_rotations(V, 20 * 2.62)
    assert float(theta_sum(V, 20.0, n_elements=2)) == pytest.approx(14 * (two.theta_k_rad + two.theta_d_rad))


@given(st.floats(-100, 100), st.sampled_from([None, 2, 4]))
def test_force_for_angle_inverts_theta_sum(force, n_elements):
    assert float(force_for_angle(V, theta_sum(V, force, n_elements), n_elements)) == pytest.approx(force, abs=1e-12)


def test_one_sided_notch_moves_the_neutral_axis():
    # York et al., ICRA 2015: the tendon on the notched side acts about the centroid of what is left
    offset = beam(WRIST).neutral_offset_mm
    assert moment_arms_mm(WRIST) == pytest.approx((0.6 + offset, 0.6 - offset))
    assert moment_arms_mm(V) == (2.62, 2.62)
    assert 0 < offset < 0.81


def test_closure_of_the_notch():
    # The '150' wrist shuts near 30.7 deg a notch (measured, GitHub nepacheco/MastersThesis); rigid-ring geometry
    # about the neutral axis leaves out that the flexure bends over its whole width.
    assert np.degrees(closure_angle_rad(WRIST)) == pytest.approx(30.7, rel=0.05)
    # edges of a pair meet where tan(t/2) = (w/2)/R_o
    assert np.tan(closure_angle_rad(V) / 2) == pytest.approx(0.6 / 3.0)


def test_measured_wrists_scale_with_the_width_and_are_softer_than_linear(measured):
    # Slope of tip angle over force up to 0.8 N, all trials. Both wrists have one cross-section, so their ratio is that
    # of the widths, 0.8/0.5, whatever the material law, between rigid rings; the slopes themselves are the figure of
    # docs/theory/analytic-model.md for how far a linear 60 GPa is off where the strain passes 1 %.
    slope, linear = {}, {}
    for name, width in (("90", 0.5), ("150", 0.8)):
        data = np.genfromtxt(measured / f"notched-wrist-{name}.csv", delimiter=",", names=True)
        low = data["tendon_force_N"] < 0.8
        slope[name] = np.polyfit(data["tendon_force_N"][low], data["tip_deg"][low], 1)[0]
        rig = with_notch(WRIST, replace(WRIST.joint.notch, width_mm=width))
        linear[name] = np.degrees(rig.joints * moment_arms_mm(rig)[0] / beam(rig).bending_Nmm_per_rad)
        assert 3.3 < slope[name] / linear[name] < 4.0
    assert linear["150"] / linear["90"] == pytest.approx(1.6)
    assert slope["150"] / slope["90"] == pytest.approx(1.6, rel=0.1)


def test_peak_strain_of_a_uniform_flexure_is_half_height_over_width():
    # pure bending: strain = e theta/w
    assert peak_strain_per_rad(PAIR) == pytest.approx(0.28 / 1.2, rel=1e-9)
    offset = beam(WRIST).neutral_offset_mm
    assert peak_strain_per_rad(WRIST) == pytest.approx(max(0.81 - offset, 0.81 - 1.40 + offset) / 0.8, rel=1e-9)
    # the V bends over its root of 0.6 mm and a little of the taper; 2.5 % at 45 deg (docs/theory/analytic-model.md)
    assert peak_strain_per_rad(V) == pytest.approx(0.28 / 0.6, rel=0.06)
    assert peak_strain_per_rad(V) * np.radians(45) / 14 == pytest.approx(0.025, abs=5e-4)


def test_bench_joint_gives_what_was_measured_and_nothing_else():
    rig = replace(V, joint=MeasuredJoint(14, 2.6, 520.0))
    joint = flexure(rig)
    assert (joint.bending_Nmm_per_rad, joint.shear_N_per_mm, joint.axial_N_per_mm) == (520.0, None, None)
    assert joint.neutral_offset_mm == 0.0
    assert closure_angle_rad(rig) == np.inf
    assert float(theta_sum(rig, 10.0)) == pytest.approx(14 * 10 * 2.62 / 520)
    assert np.isnan(peak_strain_per_rad(rig))
    for ask in (lambda: notched_tube(rig), lambda: theta_sum(rig, 1.0, 2), lambda: beam(rig)):
        with pytest.raises(RigError, match=r"measured joints: expected \[tube\] and \[notch\]"):
            ask()


@pytest.mark.parametrize("n_elements", [0, 1, 3])
def test_elements_must_meet_in_the_middle(n_elements):
    with pytest.raises(ValueError, match=f"n_elements = {n_elements}: expected an even number"):
        element_rotations(V, 1.0, n_elements=n_elements)


def test_one_sided_notch_that_leaves_nothing_of_the_wall():
    rig = with_notch(WRIST, replace(WRIST.joint.notch, depth_mm=1.6))
    with pytest.raises(RigError, match=r"notch.depth_mm = 1.6: expected below 1.565 mm"):
        beam(rig)


def test_other_figures_of_the_page_on_the_analytic_model():
    nu = 0.33
    assert 10 * (1 + nu) / (12 + 11 * nu) / (5 / 6) == pytest.approx(1.02, abs=0.005)  # Cowper: rectangle, thin tube
    assert 2 * (1 + nu) / (4 + 3 * nu) / (1 / 2) == pytest.approx(1.07, abs=0.005)
    narrow = with_notch(WRIST, replace(WRIST.joint.notch, width_mm=0.5))
    at_one_percent = [np.degrees(0.01 / peak_strain_per_rad(rig)) for rig in (narrow, WRIST)]
    assert at_one_percent == pytest.approx([2.6, 4.2], abs=0.05)
    deeper = with_notch(WRIST, replace(WRIST.joint.notch, depth_mm=1.42))
    assert planar(deeper, 0.0)[2] / planar(WRIST, 0.0)[2] == pytest.approx(1 - 0.24, abs=0.005)
    shortening = 14 / beam(V).axial_N_per_mm
    assert shortening / ((150 + 14 * 2.6) / 9000) == pytest.approx(0.025, abs=5e-4)
    assert np.degrees(14 * closure_angle_rad(V)) == pytest.approx(317, abs=0.5)
    turn = np.radians(45) / 14
    assert 14 * 1.2 * turn**2 * (1 / 8 - 1 / 24) == pytest.approx(0.004, abs=5e-4)  # hinge against even curvature
