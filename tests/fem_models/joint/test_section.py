"""Sections of notched tubes against textbook segments, quadrature over planar cuts, finite elements, and Cowper."""

from dataclasses import replace
from itertools import pairwise

import numpy as np
import pytest
import skfem
from notched_rigs import PAIR, WRIST, V, make_rig
from scipy.integrate import quad
from skfem.helpers import dot, grad

from fem_models.joint.flexure import flexure
from fem_models.joint.section import cut_height_mm, section, section_fibres
from fem_models.joint.segments import below_cut_moments, segment_moments, strip_moments
from fem_models.rig import Rig, preset
from fem_models.rig.joints import Notch, NotchedTube, Tube
from fem_models.rig.rig import with_notch

TUBES = [(6.0, 5.4), (1.16, 0.86), (1.62, 1.40), (1.37, 0.94), (1.0, 0.96), (1.0, 0.3)]
PUBLISHED = [
    (1.16, 0.86, 0.97, 1.21),  # York et al., "A wrist for needle-sized surgical robots", ICRA 2015
    (1.16, 0.86, 0.988, 1.29),
    (1.37, 0.94, 1.16, 1.50),
    (1.62, 1.40, 1.46, 1.20),
    (1.0, 0.7, 0.88, 2.1),
]
"""Outer and inner diameter and depth of one-sided notches, mm, and the second moment of a radial cut over the exact."""


def slotted(outer: float, inner: float, depth: float, shape: str = "rectangular") -> NotchedTube:
    return NotchedTube(Tube(outer, inner), Notch(shape, 5, depth, 0.5, 0.5))


def by_quadrature(outer: float, inner: float, low: float, high: float) -> tuple[float, float, float, float]:
    """Area, centroid, second moment and moment of |x - centroid| of {low <= x <= high}, by Gauss points on chords.

    Each piece between the ends of outer circle and bore is integrated over an angle, in which the roots at its ends are
    smooth. Radii; no segment, no angle at the centre, and no difference of large terms.
    """
    nodes, weights = np.polynomial.legendre.leggauss(400)
    edges = [low, *(e for e in (-inner, inner) if low < e < high), high]
    x, measure = [], []
    for a, b in pairwise(edges):
        turn = 0.5 * np.pi * (1 + nodes)
        place = a + (b - a) * np.sin(turn / 2) ** 2
        outside = np.sqrt((outer - place) * (outer + place))
        chord = 2 * outside
        if -inner <= a and b <= inner:
            inside = np.sqrt(np.maximum((inner - place) * (inner + place), 0.0))
            chord = 2 * (outer - inner) * (outer + inner) / (outside + inside)
        x.append(place)
        measure.append(chord * 0.5 * (b - a) * np.sin(turn) * 0.5 * np.pi * weights)
    place, area = np.concatenate(x), np.concatenate(measure)
    centre = float((area * place).sum() / area.sum())
    lever = place - centre
    return float(area.sum()), centre, float((area * lever**2).sum()), float((area * np.abs(lever) ** 3).sum())


@pytest.mark.parametrize(("outer", "inner"), TUBES)
def test_one_sided_cut_to_1e_12_at_all_depths(outer, inner):
    # through the wall on either side, through the bore, and remains of a thousandth of the diameter
    for depth in outer * np.array([0.001, 0.02, 0.1, 0.3, 0.5, 0.7, 0.84, 0.9, 0.97, 0.98, 0.99, 0.999]):
        joint = slotted(outer, inner, float(depth))
        area, centre, second, _ = by_quadrature(outer / 2, inner / 2, -outer / 2, float(cut_height_mm(joint, 0.0)))
        ours = section(joint, 0.0)
        assert float(ours.area_mm2) == pytest.approx(area, rel=1e-12)
        assert float(ours.neutral_offset_mm) == pytest.approx(-centre, rel=1e-12, abs=1e-12 * outer)
        assert float(ours.second_moment_mm4) == pytest.approx(second, rel=1e-12)


@pytest.mark.parametrize(("outer", "inner"), TUBES)
def test_pair_of_cuts_to_1e_12_at_all_depths(outer, inner):
    for depth in outer / 2 * np.array([0.001, 0.02, 0.1, 0.2, 0.5, 0.7, 0.9, 0.97, 0.999]):
        joint = slotted(outer, inner, float(depth), "rectangular_pair")
        cut = float(cut_height_mm(joint, 0.0))
        area, _, second, _ = by_quadrature(outer / 2, inner / 2, -cut, cut)
        ours = section(joint, 0.0)
        assert float(ours.area_mm2) == pytest.approx(area, rel=1e-12)
        assert float(ours.second_moment_mm4) == pytest.approx(second, rel=1e-12)
        assert float(ours.neutral_offset_mm) == 0.0


def test_full_half_and_solid_sections():
    outer, inner = 0.81, 0.70
    whole = below_cut_moments(outer, inner, outer)
    area, second = np.pi * (outer**2 - inner**2), np.pi / 4 * (outer**4 - inner**4)
    np.testing.assert_allclose(whole[:3], [area, outer * area, second + outer**2 * area], rtol=1e-13)
    half = section(slotted(1.62, 1.40, 0.81), 0.0)
    centre = 4 / (3 * np.pi) * (outer**3 - inner**3) / (outer**2 - inner**2)
    assert float(half.area_mm2) == pytest.approx(area / 2, rel=1e-13)
    assert float(half.neutral_offset_mm) == pytest.approx(centre, rel=1e-13)
    assert float(half.second_moment_mm4) == pytest.approx(second / 2 - area / 2 * centre**2, rel=1e-12)
    # a solid rod, a tube that has no bore: whole and half disc of radius 2
    np.testing.assert_allclose(segment_moments(2.0, 4.0)[[0, 2]], [4 * np.pi, 20 * np.pi], rtol=1e-13)
    np.testing.assert_allclose(segment_moments(2.0, 2.0)[:3], [2 * np.pi, 16 / 3, 2 * np.pi], rtol=1e-13)
    np.testing.assert_allclose(strip_moments(2.0, 2.0)[[0, 2]], [4 * np.pi, 4 * np.pi], rtol=1e-13)


def test_thin_remains_do_not_cancel():
    # a flat segment is a parabola: A = 4/3 h sqrt(2 R h), centroid 2/5 h above the flat, I = 12/175 A h^2
    high = np.array([1e-6, 1e-9, 1e-12])
    area, first, second, _ = segment_moments(0.5, high)
    np.testing.assert_allclose(area, 4 / 3 * high * np.sqrt(high), rtol=2e-6)
    np.testing.assert_allclose(first / area, 0.4 * high, rtol=2e-6)
    np.testing.assert_allclose(second - first**2 / area, 12 / 175 * area * high**2, rtol=2e-6)
    # a low strip is a pair of rectangles
    low = strip_moments(3.0, high) - strip_moments(2.7, high)
    np.testing.assert_allclose(low[[0, 2]], [4 * 0.3 * high, 4 * 0.3 * high**3 / 3], rtol=1e-9)


def textbook(radius: float, cut: float) -> tuple[float, float, float]:
    """Area, first and second moment about the diameter of a disc's segment beyond ``cut``, by its central angle."""
    angle = 2 * np.arccos(min(cut / radius, 1.0))
    area = radius**2 / 2 * (angle - np.sin(angle))
    return area, 2 / 3 * radius**3 * np.sin(angle / 2) ** 3, radius**4 / 16 * (2 * angle - np.sin(2 * angle))


@pytest.mark.parametrize(("outer", "inner", "depth", "ratio"), PUBLISHED)
def test_published_tubes_are_softer_than_with_a_radial_cut(outer, inner, depth, ratio):
    """The radial cut had this much more second moment than the segments; both worked out here."""
    radii, cut = (outer / 2, inner / 2), depth - outer / 2
    area, first, about_axis = np.subtract(*(textbook(radius, cut) for radius in radii))
    exact = about_axis - first**2 / area
    assert float(section(slotted(outer, inner, depth), 0.0).second_moment_mm4) == pytest.approx(exact, rel=1e-10)
    (big, small), p = radii, np.arccos(cut / ((outer + inner) / 4))  # half angle of the annular sector
    offset = 2 * np.sin(p) * (big**3 - small**3) / (3 * p * (big**2 - small**2))
    radial = (big**4 - small**4) / 4 * (p + np.sin(2 * p) / 2) - p * (big**2 - small**2) * offset**2
    assert radial / exact == pytest.approx(ratio, abs=0.006 if ratio < 2 else 0.06)


def saint_venant(outer: float, inner: float, cut: float, one_sided: bool) -> float:
    """Shear coefficient of {x <= cut} or {|x| <= cut} of a tube, from a finite element mesh of half or a quarter of it.

    Shear stress is the gradient of the flexure function: Laplace's equation with source -(x - x_0)/I and free edges
    (Saint-Venant, exact for Poisson's ratio 0); 1/kappa = A times its energy.
    """
    across, along = np.meshgrid(np.linspace(0, 1, 13), np.linspace(0, 1, 161), indexing="ij")
    if one_sided and cut < -inner:  # a segment without bore: from its flat outwards
        phi = along * np.arccos(-cut / outer)
        r = -cut / np.cos(phi) + across * (outer + cut / np.cos(phi))
    elif abs(cut) < inner:
        r = inner + across * (outer - inner)
        phi = np.pi / 2 * (not one_sided) + along * (np.arccos(-cut / r) - np.pi / 2 * (not one_sided))
    else:  # the plane runs through the far wall
        start, meets = np.pi / 2 * (not one_sided), np.arccos(-cut / outer)
        phi = np.interp(along, [0, 0.5, 1], [start, meets, np.pi])
        r = inner + across * (np.where(phi < meets, outer, -cut / np.minimum(np.cos(phi), -1e-9)) - inner)
    mesh = skfem.MeshQuad.init_tensor(np.arange(13.0), np.arange(161.0))
    index = mesh.p.astype(int)
    mesh = skfem.MeshQuad(np.array([(-r * np.cos(phi))[*index], (r * np.sin(phi))[*index]]), mesh.t)
    basis = skfem.Basis(mesh, skfem.ElementQuad2())
    area = skfem.Functional(lambda w: 1.0 + 0 * w.x[0]).assemble(basis)
    centre = skfem.Functional(lambda w: w.x[0]).assemble(basis) / area if one_sided else 0.0
    second = skfem.Functional(lambda w: (w.x[0] - centre) ** 2).assemble(basis)
    laplace = skfem.BilinearForm(lambda u, v, _: dot(grad(u), grad(v))).assemble(basis)
    source = skfem.LinearForm(lambda v, w: (w.x[0] - centre) / second * v).assemble(basis)
    held = np.array([0]) if one_sided else basis.get_dofs(lambda p: np.abs(p[0]) < 1e-9).all()
    flexure_function = skfem.solve(*skfem.condense(laplace, source, D=held))
    return 1 / (area * float(source @ flexure_function))


@pytest.mark.parametrize("inner", [0.92, 0.86, 0.74])
@pytest.mark.parametrize("shape", ["rectangular", "rectangular_pair"])
def test_shear_coefficient_against_finite_elements_of_the_section(shape, inner):
    """Within 1 % of an arc or a tube; never much above, and up to 5 % below in a segment that has no bore."""
    one_sided = shape == "rectangular"
    depths = [0.05, 0.5, 1.0, 1.4, 1.7, 1.8, 1.86, 1.9, 1.95] if one_sided else [0.02, 0.1, 0.2, 0.5, 0.8, 0.95, 0.99]
    for depth in depths:
        joint = slotted(2.0, 2 * inner, depth, shape)
        expected = saint_venant(1.0, inner, 1 - depth, one_sided)
        error = float(section(joint, 0.0).shear_coefficient) / expected - 1
        assert error < 0.007
        assert error > (-0.05 if one_sided and 1 - depth < 0.05 - inner else -0.01)


def test_shear_coefficient_meets_cowper_at_both_ends():
    # Cowper 1966, doi 10.1115/1.3625046, at nu = 0: rectangle 10/12; round tube of m = R_i/R_o
    for inner in (5.99, 5.4, 4.0):  # a low strip is a rectangle even where it is far lower than the wall is thick
        small = make_rig("rectangular_pair", outer=6.0, inner=inner, depth=2.97)
        assert float(section(small.joint, 0.0).shear_coefficient) == pytest.approx(10 / 12, rel=1e-3)
    m2 = 0.9**2
    tube = 6 * (1 + m2) ** 2 / (7 * (1 + m2) ** 2 + 20 * m2)
    for shape in ("rectangular_pair", "rectangular"):
        ours = float(section(make_rig(shape, depth=1e-9).joint, 0.0).shear_coefficient)
        assert ours == pytest.approx(tube, rel=0.003)


@pytest.mark.parametrize("rig", [WRIST, PAIR, V, preset("du2018")], ids=["one-sided", "slot pair", "V", "du2018"])
@pytest.mark.parametrize("count", [2, 8, 40])
def test_fibres_keep_area_and_moments_of_the_section(rig: Rig, count):
    distance, area = section_fibres(rig.joint, count)
    exact = section(rig.joint, 0.0)
    assert distance.shape == area.shape == (2 * count,)
    assert (np.diff(distance) > 0).all()
    assert (area > 0).all()
    assert (distance < 0).sum() == count
    assert area.sum() == pytest.approx(float(exact.area_mm2), rel=1e-12)
    assert (area * distance**2).sum() == pytest.approx(float(exact.second_moment_mm4), rel=1e-12)
    assert abs((area * distance).sum()) < 1e-12 * (area * np.abs(distance)).sum()


def test_fibres_of_each_side_have_its_moments():
    outer, inner, cut = 0.81, 0.70, 0.81 - 1.40
    distance, area = section_fibres(WRIST.joint, 8)
    _, centre, _, third = by_quadrature(outer, inner, -outer, cut)
    beyond = by_quadrature(outer, inner, -outer, centre)  # the side away from the notch
    side = distance < 0
    assert area[side].sum() == pytest.approx(beyond[0], rel=1e-12)
    assert (area * distance)[side].sum() == pytest.approx(beyond[0] * (beyond[1] - centre), rel=1e-11)
    assert (area * np.abs(distance) ** 3).sum() == pytest.approx(third, rel=1e-5)  # the kink of |x| limits the points
    assert -outer - centre < distance[0] < 0.9 * (-outer - centre)
    assert 0.9 * (cut - centre) < distance[-1] < cut - centre
    with pytest.raises(ValueError, match="count = 3: expected an even number"):
        section_fibres(WRIST.joint, 3)


def test_sections_along_a_v():
    # flat root of 0.6, then straight up to the outer radius at 0.6 from the middle, 3 beyond
    z = np.array([[0.0, -0.3, 0.45], [-0.6, 1.0, 0.57]])
    high = np.array([[0.28, 0.28, 1.64], [3.0, 3.0, 2.728]])  # 2.728: through the wall, beyond the bore
    np.testing.assert_allclose(cut_height_mm(V.joint, z), high)
    found = section(V.joint, z)
    for place, cut in np.ndenumerate(high):
        area, _, second, _ = by_quadrature(3.0, 2.7, -cut, cut)
        assert found.area_mm2[place] == pytest.approx(area, rel=1e-12)
        assert found.second_moment_mm4[place] == pytest.approx(second, rel=1e-12)
    assert section(V.joint, np.empty(0)).area_mm2.shape == (0,)


def test_any_cut_that_leaves_metal_has_a_section():
    deepest = with_notch(WRIST, replace(WRIST.joint.notch, depth_mm=1.6199))
    left = section(deepest.joint, 0.0)
    assert float(left.second_moment_mm4) == pytest.approx(12 / 175 * float(left.area_mm2) * 1e-4**2, rel=1e-4)
    assert flexure(deepest).bending_Nmm_per_rad > 0


@pytest.mark.parametrize("part", [0.3, 0.69, 0.71, 1.0])
def test_moments_of_strips_and_segments_of_a_disc_by_quadrature(part):
    """All four orders on either side of the places where the series gives way to elementary functions."""
    radius = 1.3
    half, height = part * radius, 2 * part * radius

    def chord(x):
        return 2 * np.sqrt(max(radius**2 - x**2, 0.0))

    for k in range(4):
        strip = 2 * quad(lambda x, k=k: x**k * chord(x), 0, half, epsabs=1e-13)[0]
        assert float(strip_moments(radius, half)[k]) == pytest.approx(strip, rel=1e-8)
        flat = height - radius  # of the flat side from the centre
        below = quad(lambda x, k=k, flat=flat: (flat - x) ** k * chord(x), -radius, flat, epsabs=1e-13)[0]
        assert float(segment_moments(radius, height)[k]) == pytest.approx(below, rel=1e-8)
