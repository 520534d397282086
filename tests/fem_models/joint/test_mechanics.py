"""Mechanics of a joint, derived once: arms, closure, strain, lengths, measured joints."""

from dataclasses import replace

import numpy as np
import pytest
from notched_rigs import PAIR, SHEAR, WRIST, YOUNG, V, planar

from fem_models.joint import joint_mechanics
from fem_models.joint.flexure import beam, flexure, root_length_mm
from fem_models.joint.mechanics import closing_angle_rad
from fem_models.joint.paper_elements import theta_sum
from fem_models.joint.roots import root_length
from fem_models.joint.section import section
from fem_models.joint.superelastic_section import section_path
from fem_models.rig import RigError, preset
from fem_models.rig.effects import Closure, Superelastic
from fem_models.rig.joints import MeasuredJoint
from fem_models.rig.rig import notched_tube, with_notch


def test_one_sided_notch_moves_the_neutral_axis():
    # York et al., ICRA 2015: the tendon on the notched side acts about the centroid of the remaining section
    offset = beam(WRIST).neutral_offset_mm
    assert joint_mechanics(WRIST).arms_mm == pytest.approx((0.6 + offset, 0.6 - offset))
    assert joint_mechanics(V).arms_mm == (2.62, 2.62)
    assert 0 < offset < 0.81


def test_closure_of_the_notch():
    # The '150' wrist shuts near 30.7 deg a notch (measured, GitHub nepacheco/MastersThesis); rigid-ring geometry
    # about the neutral axis leaves out that the flexure bends over its whole width.
    assert np.degrees(joint_mechanics(WRIST).closure_angle_rad) == pytest.approx(30.7, rel=0.05)
    # A V bends to an arc over its bending length, and its straight faces turn by half of the angle either way: an edge
    # of it, at R_o from the neutral line, is then at mid-notch. A hinge would have tan(t/2) = (w/2)/R_o.
    joint, notch = joint_mechanics(V), V.joint.notch
    angle, half = joint.closure_angle_rad, 0.5 * joint.closure_angle_rad
    end_of_arc = joint.bending_length_mm / angle * np.sin(half)
    face = 0.5 * (notch.width_mm - joint.bending_length_mm) * np.cos(half)
    assert end_of_arc + face == pytest.approx(3.0 * np.sin(half), rel=1e-9)
    assert angle / (2 * np.arctan(0.6 / 3.0)) == pytest.approx(1.01, abs=0.005)


def test_a_hinge_and_a_slot_are_the_limits_of_the_path_that_closes_a_notch():
    assert closing_angle_rad(1.4, 0.0, 3.1) == pytest.approx(2 * np.arctan(0.7 / 3.1))
    assert closing_angle_rad(1.4, 1.4, 3.1) == pytest.approx(1.4 / 3.1)


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
        linear[name] = np.degrees(rig.joints * joint_mechanics(rig).arms_mm.a / beam(rig).bending_Nmm_per_rad)
        assert 3.2 < slope[name] / linear[name] < 3.55
    assert linear["150"] / linear["90"] == pytest.approx(1.6)
    assert slope["150"] / slope["90"] == pytest.approx(1.6, rel=0.1)


def test_peak_strain_of_a_uniform_flexure_is_half_height_over_width():
    # pure bending: strain = e theta/w
    assert joint_mechanics(PAIR).peak_strain_per_rad == pytest.approx(0.28 / 1.2, rel=1e-9)
    offset = beam(WRIST).neutral_offset_mm
    assert joint_mechanics(WRIST).peak_strain_per_rad == pytest.approx(
        max(0.81 - offset, 0.81 - 1.40 + offset) / 0.8, rel=1e-9
    )
    # the V bends over its root of 0.6 mm and a little of the taper; 2.5 % at 45 deg (docs/theory/analytic-model.md)
    assert joint_mechanics(V).peak_strain_per_rad == pytest.approx(0.28 / 0.6, rel=0.06)
    assert joint_mechanics(V).peak_strain_per_rad * np.radians(45) / 14 == pytest.approx(0.025, abs=5e-4)


def test_measured_joint_has_its_measured_stiffness_and_no_more():
    rig = replace(V, joint=MeasuredJoint(14, 2.6, 520.0))
    joint = flexure(rig)
    assert (joint.bending_Nmm_per_rad, joint.shear_N_per_mm, joint.axial_N_per_mm) == (520.0, None, None)
    assert joint.neutral_offset_mm == 0.0
    assert joint_mechanics(rig).closure_angle_rad == np.inf
    assert float(theta_sum(rig, 10.0)) == pytest.approx(14 * 10 * 2.62 / 520)
    assert np.isnan(joint_mechanics(rig).peak_strain_per_rad)
    for ask in (lambda: notched_tube(rig), lambda: theta_sum(rig, 1.0, 2), lambda: beam(rig)):
        with pytest.raises(RigError, match=r"measured joints: expected \[tube\] and \[notch\]"):
            ask()


def test_other_figures_of_the_page_on_the_analytic_model():
    nu = 0.33
    assert 10 * (1 + nu) / (12 + 11 * nu) / (5 / 6) == pytest.approx(1.02, abs=0.005)  # Cowper: rectangle, thin tube
    assert 2 * (1 + nu) / (4 + 3 * nu) / (1 / 2) == pytest.approx(1.07, abs=0.005)
    narrow = with_notch(WRIST, replace(WRIST.joint.notch, width_mm=0.5))
    at_one_percent = [np.degrees(0.01 / joint_mechanics(rig).peak_strain_per_rad) for rig in (narrow, WRIST)]
    assert at_one_percent == pytest.approx([2.6, 4.1], abs=0.05)
    deeper = with_notch(WRIST, replace(WRIST.joint.notch, depth_mm=1.42))
    assert planar(deeper, 0.0)[2] / planar(WRIST, 0.0)[2] == pytest.approx(1 - 0.24, abs=0.005)
    shortening = 14 / beam(V).axial_N_per_mm
    assert shortening / ((150 + 14 * 2.6) / 9000) == pytest.approx(0.025, abs=5e-4)
    assert np.degrees(14 * joint_mechanics(V).closure_angle_rad) == pytest.approx(319, abs=0.5)
    angle = np.radians(45) / 14
    assert 14 * 1.2 * angle**2 * (1 / 8 - 1 / 24) == pytest.approx(0.004, abs=5e-4)  # hinge against even curvature


def test_mechanics_are_those_of_the_flexure_with_its_lengths():
    for rig in (V, PAIR, WRIST, preset("du2018"), preset("notched-wrist-150")):
        joint, notch = joint_mechanics(rig), rig.joint.notch
        assert joint.flexure == flexure(rig)
        assert joint.turning_length_mm + joint.rigid_gap_mm == pytest.approx(notch.width_mm, rel=1e-15)
        assert 0 < joint.bending_length_mm <= notch.width_mm
        assert joint.one_sided == (notch.shape == "rectangular")
        assert joint.rest_angle_rad == np.radians(rig.precurvature_deg)
    # a slot bends over its whole width, and its chord is that of rigid ends of w/6
    assert joint_mechanics(PAIR).bending_length_mm == pytest.approx(1.2, rel=1e-12)
    assert joint_mechanics(PAIR).turning_length_mm == pytest.approx(0.8, rel=1e-12)


def test_ring_is_the_uncut_tube_between_two_flexures():
    # PAIR bends over its width, so that the ring is 1.4 mm of the round tube: E I/L, E A/L, Cowper's kappa = 1/2
    area, second, length = np.pi * (3.0**2 - 2.7**2), np.pi / 4 * (3.0**4 - 2.7**4), 1.4
    ring = joint_mechanics(PAIR).ring
    assert ring.bending_Nmm_per_rad == pytest.approx(YOUNG * second / length, rel=1e-9)
    assert ring.axial_N_per_mm == pytest.approx(YOUNG * area / length, rel=1e-9)
    shear = length**3 / (12 * YOUNG * second) + length / (0.5 * SHEAR * area)
    assert ring.shear_N_per_mm == pytest.approx(1 / shear, rel=1e-9)


@pytest.mark.parametrize("rig", [V, PAIR, WRIST])
def test_a_flexure_is_longer_by_its_root_length_at_both_ends(rig):
    """Compliances in series: that of the beam, and 2 root lengths of the thinnest section, E I each."""
    rigidity = YOUNG * float(section(rig.joint, 0.0).second_moment_mm4)
    longer = 1 / flexure(rig).bending_Nmm_per_rad - 1 / beam(rig).bending_Nmm_per_rad
    assert longer == pytest.approx(2 * root_length_mm(rig.joint) / rigidity, rel=1e-9)
    assert flexure(rig).axial_N_per_mm == beam(rig).axial_N_per_mm
    # a strip as wide as the arc, or its half in a pair, on the wall unrolled; 0.415 of it on a half plane
    wall = (rig.joint.tube.outer_diameter_mm - rig.joint.tube.inner_diameter_mm) / 2
    arc = float(section(rig.joint, 0.0).area_mm2) / wall / (1 if rig is WRIST else 2)
    assert root_length_mm(rig.joint) == pytest.approx(
        arc * root_length(rig.joint.notch.spacing_mm / 2 / arc), rel=1e-12
    )


def test_mechanics_follow_what_changes_beside_the_tube():
    rig = replace(V, tendon_a=replace(V.tendon_a, moment_arm_mm=2.5), precurvature_deg=1.0)
    joint = joint_mechanics(rig)
    assert joint.arms_mm == (2.5, 2.62)
    assert joint.flexure is joint_mechanics(V).flexure  # remembered: the tube is the same
    assert joint.contact_angle_rad == np.inf
    closing = replace(rig, closure=Closure(1e3))
    assert joint_mechanics(closing).contact_angle_rad == joint.closure_angle_rad
    assert joint_mechanics(replace(rig, closure=Closure(1e3, angle_deg=3.0))).contact_angle_rad == np.radians(3.0)
    stiffer = replace(rig, material=replace(rig.material, youngs_modulus_GPa=120.0))
    assert joint_mechanics(stiffer).flexure.bending_Nmm_per_rad == pytest.approx(2 * joint.flexure.bending_Nmm_per_rad)


def test_small_forces_of_a_single_tendon_are_compared_with_a_degree_of_a_joint():
    single = replace(V, tendon_b=None, preload_N=0.0)
    joint = joint_mechanics(single)
    assert joint.arms_mm == (2.62, 0.0)
    degree = np.radians(1.0) * joint.flexure.bending_Nmm_per_rad / 2.62
    assert joint.force_scale_N == pytest.approx(degree)
    assert joint_mechanics(replace(single, preload_N=1e3)).force_scale_N == 1e3
    assert joint_mechanics(V).force_scale_N == 20.0


def test_material_elements_add_up_to_the_bending_stiffness():
    law = Superelastic(plateau_MPa=450.0, unloading_plateau_MPa=220.0)
    rig = replace(V, superelastic=law, material=replace(V.material, loop_share=0.4))
    joint = joint_mechanics(rig)
    bending = joint.flexure.bending_Nmm_per_rad
    assert joint.jenkins.elastic_Nmm_per_rad + joint.jenkins.stiffness.sum() == pytest.approx(bending)
    # the share that the Jenkins loop leaves: below the plateau all is elastic, along the notch as a whole
    small = section_path(joint.section, [1e-4], [0.0])
    assert small.moment_Nmm[0] / 1e-4 == pytest.approx(0.6 * bending, rel=1e-6)
    assert small.tangent[0] == pytest.approx(0.6 * bending, rel=1e-6)
    squeezed = section_path(joint.section, [0.0], [3.0])
    shorter = joint.section.axial_compliance * 3.0 - squeezed.elongation_mm[0]
    assert 3.0 / shorter == pytest.approx(joint.flexure.axial_N_per_mm, rel=1e-6)
    assert joint_mechanics(V).section is None
    assert joint_mechanics(V).fibres.stiffness.size == joint_mechanics(V).jenkins.stiffness.size == 0


def test_only_a_superelastic_section_leaves_the_axial_stiffness_to_the_fibres():
    law = Superelastic(plateau_MPa=450.0, unloading_plateau_MPa=220.0)
    assert joint_mechanics(V).axial_compliance == 1 / joint_mechanics(V).flexure.axial_N_per_mm
    assert joint_mechanics(replace(V, superelastic=law)).axial_compliance < 0.3 * joint_mechanics(V).axial_compliance
    slots = preset("notched-wrist-150")
    assert joint_mechanics(slots).axial_compliance == pytest.approx(0.0, abs=1e-9)
    assert joint_mechanics(replace(slots, superelastic=None)).axial_compliance > 1e-5


def test_a_slot_closes_where_the_edges_at_the_chord_of_its_arc_meet():
    rig = preset("notched-wrist-150")
    angle = joint_mechanics(rig).closure_angle_rad
    lever = rig.joint.tube.outer_diameter_mm / 2 + float(section(rig.joint, 0.0).neutral_offset_mm)
    chord = 2 * rig.joint.notch.width_mm / angle * np.sin(angle / 2)
    assert chord == pytest.approx(2 * lever * np.sin(angle / 2))
    # measured: 30.7 and 19.1 deg, both tubes with the same lever
    assert np.degrees(angle) == pytest.approx(30.7, abs=0.5)
    assert np.degrees(joint_mechanics(preset("notched-wrist-90")).closure_angle_rad) == pytest.approx(19.1, abs=0.3)
