"""Chains of reduced bodies and of beams: against each other, closed forms, and Exudyn's own eigenvalues."""

import math
from dataclasses import replace

import exudyn as exu
import numpy as np
import pytest

from fem_models.analytic.frictionless_chain import bend_by_tendon, joint_angle_rad, tendon_for_angle_N
from fem_models.joint.flexure import Flexure
from fem_models.multibody.reduced_body import craig_bampton, free_frequencies_Hz
from fem_models.multibody.reduced_chain import (
    PlaneLoad,
    floating_body,
    relative_motion,
    solve_beam_chain,
    solve_reduced_chain,
)
from fem_models.rig import RigError, preset
from fem_models.rig.joints import MeasuredJoint, Notch, NotchedTube, Tube
from fem_models.rig.rig import with_notch
from fem_models.solid.linear import as_flexure, snr_stiffness, solid_snr
from validation.joints.models import compare_models, joint_stiffness

LOADS = [
    PlaneLoad(moment_Nmm=40.0),
    PlaneLoad(lateral_N=4.0),
    PlaneLoad(axial_N=-3.0, lateral_N=1.0),
    PlaneLoad(tendon_N=15.0),
]


def pair():
    rig = preset("du2018")
    return with_notch(rig, replace(rig.joint.notch, count=4))


def one_sided():
    tendon = replace(preset("du2018").tendon_a, moment_arm_mm=0.6)
    notch = Notch("rectangular", count=3, depth_mm=1.2, width_mm=0.8, spacing_mm=1.2)
    return replace(
        pair(), name="one-sided", joint=NotchedTube(Tube(1.62, 1.4), notch), tendon_a=tendon, tendon_b=tendon
    )


@pytest.fixture(scope="module", params=[pair, one_sided], ids=["pair", "one-sided"])
def case(request):
    rig = request.param()
    body = solid_snr(rig, refinement=0.4)
    return rig, body, craig_bampton(body, 2), as_flexure(snr_stiffness(body).stiffness)


def test_joint_of_reduced_bodies_has_the_stiffness_of_the_solid(case):
    rig, body, reduced, joint = case
    found = joint_stiffness(rig, lambda one, loads: solve_reduced_chain(one, body, reduced, loads))
    assert found.bending_Nmm_per_rad == pytest.approx(joint.bending_Nmm_per_rad, rel=1e-6)
    assert found.axial_N_per_mm == pytest.approx(joint.axial_N_per_mm, rel=1e-4)
    assert found.shear_N_per_mm == pytest.approx(joint.shear_N_per_mm, rel=1e-4)
    assert found.neutral_offset_mm == pytest.approx(joint.neutral_offset_mm, abs=1e-5)
    condensed = as_flexure(relative_motion(reduced)[0][:6, :6])
    assert condensed.bending_Nmm_per_rad == pytest.approx(joint.bending_Nmm_per_rad, rel=1e-9)


def test_reduced_bodies_and_beams_bend_alike_at_large_angles(case):
    """Both are linear about the frame midway between two rings, so that they are one model in two formulations."""
    rig, body, reduced, joint = case
    scale = joint.bending_Nmm_per_rad / 266.0 * 2.64 / rig.tendon_a.moment_arm_mm
    loads = [PlaneLoad(*(scale * np.array([a.moment_Nmm, a.lateral_N, a.axial_N, a.tendon_N]))) for a in LOADS]
    beams, bodies = solve_beam_chain(rig, joint, loads), solve_reduced_chain(rig, body, reduced, loads)
    assert max(abs(pose.angle_rad) for pose in beams) > math.radians(25)
    for one, other in zip(beams, bodies, strict=True):
        assert other.rotation_rad == pytest.approx(one.rotation_rad, abs=1e-7)
        assert other.tip_mm == pytest.approx(one.tip_mm, abs=1e-6)


def test_tendon_bends_beams_as_the_closed_form_says(case):
    rig, _, _, joint = case
    tension = tendon_for_angle_N(rig, joint, 0.6)
    angle, x, y = bend_by_tendon(rig, joint, tension)
    assert angle == pytest.approx(0.6, rel=1e-12)
    (pose,) = solve_beam_chain(rig, joint, [PlaneLoad(tendon_N=tension)])
    assert pose.angle_rad == pytest.approx(angle, rel=1e-8)
    assert pose.tip_mm == pytest.approx([x, y], abs=1e-7)


def test_small_loads_bend_as_the_linear_chain(case):
    """N M/k under a moment, sum of s^2/k_b + 1/k_s under a lateral force, s from each notch to the tip."""
    rig, body, reduced, joint = case
    loads = [PlaneLoad(moment_Nmm=1e-2), PlaneLoad(lateral_N=1e-3)]
    bent, pushed = solve_reduced_chain(rig, body, reduced, loads)
    assert bent.angle_rad == pytest.approx(rig.joints * 1e-2 / joint.bending_Nmm_per_rad, rel=1e-6)
    arms = rig.pitch_mm * (np.arange(rig.joints) + 0.5)
    lateral = (arms**2 / joint.bending_Nmm_per_rad + 1 / joint.shear_N_per_mm).sum()
    assert pushed.tip_mm[1] == pytest.approx(1e-3 * lateral, rel=1e-4)


def test_floating_body_has_the_frequencies_of_the_reduced_one(case):
    """Exudyn's mass of a body with a frame that floats against the reduced matrices, which know no frame."""
    _, body, reduced, _ = case
    mbs = exu.SystemContainer().AddSystem()
    floating_body(body, reduced, rotation="NodeType.RotationRxyz").AddObjectFFRFreducedOrder(mbs)
    mbs.Assemble()
    squares = mbs.ComputeODE2Eigenvalues()[0]
    found = np.sqrt(np.sort(np.abs(squares))[6:]) / (2 * np.pi)
    assert found == pytest.approx(free_frequencies_Hz(reduced), rel=1e-6)


def test_more_modes_bring_free_frequencies_down():
    """Rayleigh and Ritz: a larger basis bounds each frequency from above, the closer."""
    body = solid_snr(pair(), refinement=0.4)
    few, more = (free_frequencies_Hz(craig_bampton(body, modes)) for modes in (1, 8))
    assert (more[: len(few)] <= few * (1 + 1e-9)).all()
    assert more[0] == pytest.approx(few[0], rel=0.05)
    assert few[0] > 1e3


def test_models_stand_side_by_side():
    rig = pair()
    table = compare_models(rig, angles_deg=(4.0, 12.0), refinement=0.4)
    solid = table.model("solid")
    assert [bent.angle_deg for bent in solid.bent] == pytest.approx([4.0, 12.0])
    for name in ("reduced bodies", "beams"):
        assert table.model(name).bent[1].angle_deg == pytest.approx(12.0, rel=1e-6)
        assert table.model(name).bending_Nmm_per_rad == pytest.approx(solid.bending_Nmm_per_rad, rel=1e-6)
    engines = [table.model(name).bent[1] for name in ("multibody", "chain")]
    assert engines[0].angle_deg == pytest.approx(engines[1].angle_deg, rel=2e-3)
    assert engines[0].tip_y_mm == pytest.approx(engines[1].tip_y_mm, rel=5e-3)
    rows = {row["name"]: row for row in table.to_dict()["models"]}
    assert (
        rows["beam"]["bending_percent"] > 30
    )  # rings are not rigid where arcs are rooted (docs/validation/notches.md)
    assert abs(rows["beam with roots"]["bending_percent"]) < 5
    assert rows["solid"]["bent"][1]["tip_off_mm"] == 0


def test_angles_stop_short_of_closed_notches():
    rig = one_sided()
    table = compare_models(rig, angles_deg=(60.0, 600.0), refinement=0.4)
    angles = [bent.angle_deg for bent in table.model("solid").bent]
    assert angles[0] == pytest.approx(angles[1] / 10)
    assert angles[1] < 600
    reduced, beams = table.model("reduced bodies").bent[-1], table.model("beams").bent[-1]
    assert reduced.angle_deg == pytest.approx(beams.angle_deg, rel=1e-5)
    multibody, chain = table.model("multibody").bent[-1], table.model("chain").bent[-1]
    assert multibody.tip_y_mm == pytest.approx(chain.tip_y_mm, rel=0.02)


def test_impossible_inputs_are_named():
    rig = pair()
    with pytest.raises(RigError, match="tendon_N = 10000"):
        joint_angle_rad(rig, Flexure(10.0, None, None, 0.0), 1e4)
    with pytest.raises(ValueError, match="axial and shear"):
        solve_beam_chain(rig, Flexure(10.0, None, None, 0.0), [PlaneLoad()])
    measured = replace(rig, joint=MeasuredJoint(4, 2.6, 500.0))
    with pytest.raises(RigError, match="measured joints"):
        compare_models(measured)
