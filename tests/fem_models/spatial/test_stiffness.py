"""Six stiffnesses of a notch: against the section by counting its points, and against the solid."""

import math
from dataclasses import replace

import numpy as np
import pytest

from fem_models.joint.flexure import elasticity
from fem_models.rig import RigError, preset
from fem_models.rig.joints import Notch
from fem_models.rig.rig import with_notch
from fem_models.solid.linear import snr_stiffness, solid_snr
from fem_models.spatial import solve_spatial, spatial_rig, wheel_drives
from fem_models.spatial.stiffness import (
    notch_stiffness,
    second_moment_across_mm4,
    shear_centre_mm,
    stiffness_of_solid,
)

RIG = preset("du2018")
PAIR = with_notch(RIG, Notch("rectangular_pair", 5, depth_mm=2.6, width_mm=1.5, spacing_mm=1.2))
ONE_SIDED = with_notch(RIG, Notch("rectangular", 5, depth_mm=4.5, width_mm=1.5, spacing_mm=1.2))
METAL = elasticity(RIG.material)


@pytest.mark.parametrize("rig", [PAIR, ONE_SIDED], ids=["pair", "one-sided"])
def test_strong_bending_is_that_of_the_section(rig):
    """E I/w between rigid roots, I being the sum of y^2 over the points of a fine grid in the section."""
    joint = replace(rig.joint, notch=replace(rig.joint.notch, rigid_roots=True))
    outer, inner = joint.tube.outer_diameter_mm / 2, joint.tube.inner_diameter_mm / 2
    place = (np.arange(2000) + 0.5) / 2000 * 2 * outer - outer
    x, y = np.meshgrid(place, place)
    cut = outer - joint.notch.depth_mm
    inside = (np.hypot(x, y) < outer) & (np.hypot(x, y) > inner) & ((x if joint.one_sided else np.abs(x)) < cut)
    second = (y**2)[inside].sum() * (place[1] - place[0]) ** 2
    assert float(second_moment_across_mm4(joint, np.zeros(1))[0]) == pytest.approx(second, rel=5e-3)  # cells at the cut
    expected = METAL.young * second / joint.notch.width_mm
    assert notch_stiffness(joint, METAL).strong == pytest.approx(expected, rel=5e-3)


def test_torsion_of_a_pair_is_two_webs_that_shear_at_their_radius():
    """For low webs r^2 k_shear and twice G h t^3/3 (1 - 0.63 t/h), within the change of the lever along an arc."""
    joint = replace(PAIR.joint, notch=replace(PAIR.joint.notch, rigid_roots=True))
    six, radius, wall = notch_stiffness(joint, METAL), 2.96, 0.28
    arc = 2 * radius * math.asin((3.1 - 2.6) / radius)
    twist = 2 * METAL.shear * arc * wall**3 / 3 * (1 - 0.63 * wall / arc) / 1.5
    assert six.torsion == pytest.approx(radius**2 * six.shear_in + twist, rel=0.02)


BOUNDS = {  # over the solid's, at most: see docs/theory/three-dimensions.md
    "v_pair": {"weak": 1.05, "strong": 1.35, "torsion": 1.2, "axial": 2.0, "shear_in": 1.2, "shear_across": 3.0},
    "rectangular_pair": {"weak": 1.1, "strong": 1.2, "torsion": 1.2, "axial": 1.6, "shear_in": 1.2, "shear_across": 2},
    "rectangular": {"weak": 1.1, "strong": 1.1, "torsion": 1.3, "axial": 1.7, "shear_in": 1.3, "shear_across": 1.35},
}  # fmt: skip


@pytest.mark.parametrize("rig", [RIG, PAIR, ONE_SIDED], ids=list(BOUNDS))
def test_against_the_solid_between_rigid_plates(rig):
    here = notch_stiffness(rig.joint, METAL)
    there = stiffness_of_solid(snr_stiffness(solid_snr(rig, refinement=0.7)).stiffness)
    for name, most in BOUNDS[rig.joint.notch.shape].items():
        assert 1 / 1.1 < getattr(here, name) / getattr(there, name) < most, name


@pytest.mark.parametrize("depth_mm", [3.5, 4.5, 5.2])
def test_shear_centre_is_that_of_the_solid(depth_mm):
    """Across, the solid's middle moves by what it twists about its shear centre, which lies beyond the wall."""
    rig = with_notch(RIG, replace(ONE_SIDED.joint.notch, depth_mm=depth_mm))
    give = np.linalg.inv(snr_stiffness(solid_snr(rig, refinement=1.0)).stiffness)
    assert shear_centre_mm(rig.joint) == pytest.approx(give[1, 5] / give[5, 5], rel=0.03)
    assert shear_centre_mm(rig.joint) > 3.1
    assert spatial_rig(rig).joints[0].shear_centre_mm < 0
    assert shear_centre_mm(PAIR.joint) == spatial_rig(PAIR).joints[0].shear_centre_mm == 0


def test_shear_centre_of_a_thin_arc():
    """A half circle of mean radius R has it 4 R/pi from its centre; an almost closed one 2 R."""
    tube = replace(RIG.joint.tube, outer_diameter_mm=3.5, inner_diameter_mm=2.74)
    for depth_mm, over_radius in ((1.75, 4 / math.pi), (0.38 / 2 + 1e-6, 2.0)):
        joint = replace(ONE_SIDED.joint, tube=tube, notch=replace(ONE_SIDED.joint.notch, depth_mm=depth_mm))
        assert shear_centre_mm(joint) == pytest.approx(over_radius * 1.56, rel=1e-3)


def test_stiffnesses_that_are_given_have_the_ring_in_them():
    """A pitch whose six stiffnesses are those of the section with its ring in series is the rig itself."""
    rig = replace(RIG, material=replace(RIG.material, loop_share=0.0))
    drives = wheel_drives(np.array([[0.0, 0.0], [0.5, 0.0], [0.5, 0.4]]))
    turns = [90.0 * (k % 2) for k in range(14)]
    plain = spatial_rig(rig, turns_deg=turns, tendons_deg=[0, 180, 90, 270])
    six, (bends, twists) = plain.joints[0].stiffness, plain.joints[0].ring
    rings = {"weak": bends, "strong": bends, "torsion": twists}
    whole = six._replace(**{name: 1 / (1 / getattr(six, name) + 1 / ring) for name, ring in rings.items()})
    expected = solve_spatial(plain, drives)
    for given in (whole, [whole] * 14):
        found = solve_spatial(spatial_rig(rig, turns_deg=turns, tendons_deg=[0, 180, 90, 270], stiffness=given), drives)
        np.testing.assert_allclose(found.bending_deg, expected.bending_deg, atol=1e-6)
        np.testing.assert_allclose(found.torsion_deg, expected.torsion_deg, atol=1e-6)
    with pytest.raises(RigError, match="stiffness = 3 notches: expected one for each of 14 joints"):
        spatial_rig(rig, stiffness=[whole] * 3)
