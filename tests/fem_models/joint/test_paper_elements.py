"""The paper's two elements of a notch: exactness, order of convergence, error, and the force for an angle."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from notched_rigs import PAIR, WRIST, YOUNG, V, make_rig

from fem_models.joint.flexure import beam, flexure
from fem_models.joint.paper_elements import element_rotations, theta_sum
from fem_models.joint.section import section
from fem_models.rig import Rig


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
def test_the_angle_is_proportional_to_the_force(force, n_elements):
    per_N = theta_sum(V, 1.0, n_elements)
    assert float(theta_sum(V, force, n_elements) / per_N) == pytest.approx(force, abs=1e-12)


@pytest.mark.parametrize("n_elements", [0, 1, 3])
def test_elements_must_meet_in_the_middle(n_elements):
    with pytest.raises(ValueError, match=f"n_elements = {n_elements}: expected an even number"):
        element_rotations(V, 1.0, n_elements=n_elements)
