"""Moments, fibres and stiffness of a notch strip by strip and by closed forms that are worked out by hand."""

from __future__ import annotations

from dataclasses import replace
from itertools import pairwise

import numpy as np
import pytest
from notched_rigs import PAIR, WRIST, YOUNG, V, make_rig
from scipy.integrate import quad

from fem_models.joint import flexure as flexures
from fem_models.joint.flexure import beam, elasticity, flexure, root_length_mm
from fem_models.joint.roots import root_length
from fem_models.joint.section import cut_height_mm, section, section_fibres
from fem_models.joint.segments import (
    below_cut_moments,
    between_cuts_moments,
    moments_about,
    segment_moments,
    strip_moments,
)
from fem_models.rig.joints import MeasuredJoint, Notch, NotchedTube, Tube
from fem_models.rig.rig import Material

OUTER, INNER = 1.5, 1.1


def chord(x: float, outer: float = OUTER, inner: float = INNER) -> float:
    """Metal of a tube at the distance x from its axis."""
    return 2 * (np.sqrt(max(outer**2 - x**2, 0.0)) - np.sqrt(max(inner**2 - x**2, 0.0)))


def by_quadrature(low: float, high: float, about: float, order: int, outer=OUTER, inner=INNER) -> float:
    edges = [low, *(e for e in (-inner, 0.0, inner) if low < e < high), high]
    return sum(
        quad(lambda x: (x - about) ** order * chord(x, outer, inner), a, b, epsabs=1e-12, limit=200)[0]
        for a, b in pairwise(edges)
    )


# --- moments -------------------------------------------------------------------------------------------------------


def test_moments_of_a_whole_disc_from_its_edge_and_from_its_middle():
    """A = pi R^2. The mean of x^2 is R^2/4: those of the powers of R + x are R, 5/4 R^2 and 7/4 R^3."""
    area = np.pi * 1.3**2
    expected = [area, area * 1.3, area * 1.25 * 1.3**2, area * 1.75 * 1.3**3]
    np.testing.assert_allclose(segment_moments(1.3, 2.6), expected, rtol=1e-13)
    from_middle = [area, 4 / 3 * 1.3**3, area * 1.3**2 / 4, 8 / 15 * 1.3**5]
    np.testing.assert_allclose(strip_moments(1.3, 1.3), from_middle, rtol=1e-13)
    half = [area / 2, 2 / 3 * 1.3**3, area * 1.3**2 / 8, 4 / 15 * 1.3**5]
    np.testing.assert_allclose(segment_moments(1.3, 1.3), half, rtol=1e-13)
    assert segment_moments(1.3, 0.0).tolist() == strip_moments(1.3, 0.0).tolist() == [0.0] * 4
    assert segment_moments(1.3, np.zeros((2, 3))).shape == strip_moments(1.3, np.zeros((2, 3))).shape == (4, 2, 3)


@pytest.mark.parametrize("cut", [-1.4, -1.1, -0.6, 0.0, 0.7, 1.1, 1.3, 1.5])
def test_moments_below_a_cut_are_of_the_distance_from_it_or_from_another_place(cut):
    """Through the far wall, the bore, the near wall, and beyond it."""
    for k in range(4):
        own = (-1.0) ** k * by_quadrature(-OUTER, cut, cut, k)
        assert float(below_cut_moments(OUTER, INNER, cut)[k]) == pytest.approx(own, rel=1e-7)
        other = by_quadrature(-OUTER, cut, -0.4, k)
        assert float(moments_about(OUTER, INNER, cut, -0.4)[k]) == pytest.approx(other, rel=1e-7, abs=1e-9)


@pytest.mark.parametrize("cut", [0.2, 0.9, 1.1, 1.3, 1.5])
def test_moments_between_cuts_are_of_the_distance_from_the_axis(cut):
    for k in range(4):
        own = 2 * by_quadrature(0.0, cut, 0.0, k)
        assert float(between_cuts_moments(OUTER, INNER, cut)[k]) == pytest.approx(own, rel=1e-7)


# --- sections ------------------------------------------------------------------------------------------------------


def test_a_v_without_a_flat_root_rises_from_its_middle():
    tube = Tube(6.0, 5.4)
    sharp = NotchedTube(tube, Notch("v_pair", 3, 2.0, 1.0, 1.0, 0.0))
    np.testing.assert_allclose(cut_height_mm(sharp, [0.0, 0.25, -0.25, 0.5, 0.7]), [1.0, 2.0, 2.0, 3.0, 3.0])
    flat = NotchedTube(tube, Notch("v_pair", 3, 2.0, 1.0, 1.0, 0.5))
    np.testing.assert_allclose(cut_height_mm(flat, [0.0, 0.25, -0.375, 0.5]), [1.0, 1.0, 2.0, 3.0])
    slot = NotchedTube(tube, Notch("rectangular", 3, 4.0, 1.0, 1.0))
    assert cut_height_mm(slot, [0.0, 9.0]).tolist() == [-1.0, -1.0]


@pytest.mark.parametrize("count", [-2, 0, 1, 3, 5])
def test_fibres_are_an_even_number_of_at_least_two(count):
    with pytest.raises(ValueError, match=f"count = {count}: expected an even number of at least 2"):
        section_fibres(WRIST.joint, count)
    assert section_fibres(WRIST.joint, 2)[0].size == 4


@pytest.mark.parametrize(("shape", "depth"), [("rectangular", 1.9), ("rectangular", 0.8), ("rectangular_pair", 0.7)])
def test_fibres_of_each_strip_have_its_moments(shape, depth):
    """Three strips of equal height on either side of the neutral axis."""
    joint = NotchedTube(Tube(2 * OUTER, 2 * INNER), Notch(shape, 5, depth, 0.5, 0.5))
    cut, pair = OUTER - depth, shape == "rectangular_pair"
    neutral = 0.0 if pair else by_quadrature(-OUTER, cut, 0.0, 1) / by_quadrature(-OUTER, cut, 0.0, 0)
    low = -cut if pair else -OUTER
    edges = np.r_[np.linspace(low, neutral, 4), np.linspace(neutral, cut, 4)[1:]]
    distance, area = section_fibres(joint, 6)
    for i, (a, b) in enumerate(pairwise(edges)):
        own = slice(2 * i, 2 * i + 2)
        assert (a - neutral < distance[own]).all()
        assert (distance[own] < b - neutral).all()
        for k in range(4):
            expected = by_quadrature(a, b, neutral, k)
            assert float(np.sum(area[own] * distance[own] ** k)) == pytest.approx(expected, rel=1e-6, abs=1e-9)


# --- stiffness -----------------------------------------------------------------------------------------------------


def test_elastic_constants_are_in_newtons_per_square_millimetre():
    found = elasticity(Material(youngs_modulus_GPa=50.0, poissons_ratio=0.25))
    assert found == (50000.0, 20000.0, 0.25)


def test_a_measured_joint_has_its_bending_stiffness_only():
    rig = replace(V, joint=MeasuredJoint(joints=14, pitch_mm=2.6, flexure_stiffness_Nmm_per_rad=520.0))
    assert flexure(rig) == flexures.Flexure(520.0, None, None, 0.0)


def test_kinks_of_a_v_are_the_edge_of_its_root_and_where_it_leaves_the_bore():
    """A wall of 0.3 mm is 0.3/2.72 of the depth; a V without a root has one kink, a slot none."""
    assert flexures._kinks(V.joint) == pytest.approx([0.3, 0.6 - 0.3 * 0.3 / 2.72])
    assert flexures._kinks(make_rig(root=0.0).joint) == pytest.approx([0.6 - 0.6 * 0.3 / 2.72])
    assert flexures._kinks(PAIR.joint) == flexures._kinks(WRIST.joint) == []


def test_quadrature_between_kinks_is_exact_for_steep_functions():
    z, weights = flexures._graded_gauss([0.0, 0.3, 0.8])
    assert (np.diff(z) > 0).all()
    assert weights.sum() == pytest.approx(0.8, rel=1e-14)
    assert float(np.sum(weights * z**9)) == pytest.approx(0.8**10 / 10, rel=1e-13)
    root = np.where(z < 0.3, np.sqrt(np.abs(0.3 - z)), np.sqrt(np.abs(z - 0.3)))
    assert float(np.sum(weights * root)) == pytest.approx(2 / 3 * (0.3**1.5 + 0.5**1.5), rel=1e-8)


@pytest.mark.parametrize("rig", [PAIR, WRIST, V], ids=["pair", "one-sided", "v"])
def test_a_root_is_that_of_a_strip_as_wide_as_one_arc(rig):
    """An arc is the metal over the wall; of a pair there are two. The plate is half the uncut tube high."""
    tube, notch = rig.joint.tube, rig.joint.notch
    outer, inner = tube.outer_diameter_mm / 2, tube.inner_diameter_mm / 2
    cut = outer - notch.depth_mm
    area = by_quadrature(-outer if rig is WRIST else -cut, cut, 0.0, 0, outer, inner)
    arc = area / (outer - inner) / (1 if rig is WRIST else 2)
    expected = arc * float(root_length(notch.spacing_mm / 2 / arc))
    assert root_length_mm(rig.joint) == pytest.approx(expected, rel=1e-7)


def test_a_notch_has_its_axial_stiffness_and_its_neutral_axis_as_a_beam():
    """A slot: E A/w; the neutral axis lies by the centroid away from the notch. Roots do not act along the tube."""
    cut = 0.81 - 1.40
    area = by_quadrature(-0.81, cut, 0.0, 0, 0.81, 0.70)
    centre = by_quadrature(-0.81, cut, 0.0, 1, 0.81, 0.70) / area
    second = by_quadrature(-0.81, cut, centre, 2, 0.81, 0.70)
    for found in (beam(WRIST), flexure(WRIST)):
        assert found.axial_N_per_mm == pytest.approx(YOUNG * area / 0.8, rel=1e-7)
        assert found.neutral_offset_mm == pytest.approx(-centre, rel=1e-7)
    assert beam(WRIST).bending_Nmm_per_rad == pytest.approx(YOUNG * second / 0.8, rel=1e-7)
    assert beam(V).neutral_offset_mm == 0.0
    assert float(section(WRIST.joint, 0.0).area_mm2) == pytest.approx(area, rel=1e-7)
