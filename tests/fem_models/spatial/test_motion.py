"""Workspace, tip compliance and compensated drives of wrists in space."""

from dataclasses import replace

import numpy as np
import pytest

from fem_models.chain.solve import simulate_chain
from fem_models.load import LoadProgram
from fem_models.rig import RigError, preset
from fem_models.rig.checks import SolverError
from fem_models.rig.effects import TipLoad
from fem_models.rig.layout import Layout
from fem_models.rig.presets_in_space import any_preset
from fem_models.rig.rig import Friction, rig_in_space
from fem_models.spatial import WheelProgram, of_rig_in_space, simulate_in_space, solve_spatial
from fem_models.spatial.motion.backbone import plane_backbone
from fem_models.spatial.motion.compensated import compensated_wheels
from fem_models.spatial.motion.steps import at_rest, moved_to
from fem_models.spatial.motion.workspace import smooth_rig, tip_compliance, workspace

PLANAR = replace(preset("du2018"), tendon_b=None)
RIG = replace(PLANAR, layout=Layout(tuple(90.0 * (k % 2) for k in range(14)), (0.0, 180.0, 90.0, 270.0), (1, 1, 2, 2)))
ZHANG = any_preset("zhang2026")


def ring(radius, count=36):
    turn = 2 * np.pi * np.arange(1, count + 1) / count
    out = np.column_stack([np.linspace(0, radius, 7)[1:], np.zeros(6)])
    return np.concatenate([out, radius * np.column_stack([np.cos(turn), np.sin(turn)])])


def bending(rig, wheels):
    record = simulate_in_space(rig, WheelProgram(wheels))
    return np.column_stack([record.angle_deg, record.angle_2_deg])


def test_steps_from_an_equilibrium_are_those_of_a_run():
    wheels = ring(0.8, 12)
    run = solve_spatial(of_rig_in_space(RIG), WheelProgram(wheels).of_tendons(RIG))
    state = at_rest(of_rig_in_space(RIG))
    for s, drives in enumerate(wheels @ RIG.winding()):
        moved_to(state, drives + 0.3)  # a trial leaves the equilibrium as it is
        state = moved_to(state, drives)
        np.testing.assert_allclose(state.bending_deg, run.bending_deg[s], atol=0.01)  # other halvings of the steps
        np.testing.assert_allclose(state.tip_mm, run.tip_mm[s], atol=0.01)


@pytest.mark.parametrize(("rig", "radius_deg"), [(RIG, 15.0), (ZHANG, 30.0)], ids=["du2018 in two planes", "zhang2026"])
def test_compensated_wheels_lead_the_tip_round_a_circle_and_back(rig, radius_deg):
    """The drives that were found are simulated from rest; those of the wrist without friction miss by 100 times."""
    there = ring(radius_deg)
    wanted = np.concatenate([there, there[6:][::-1][1:]])
    found = compensated_wheels(rig, wanted)
    off = np.linalg.norm(bending(rig, found.wheels_mm) - wanted, axis=1)
    plain = np.linalg.norm(bending(rig, compensated_wheels(smooth_rig(rig), wanted).wheels_mm) - wanted, axis=1)
    rms, rms_plain = (np.sqrt(np.mean(errors**2)) for errors in (off, plain))
    assert rms < 1.5e-3  # the search stops at 1e-3 deg of either angle
    assert rms_plain > 100 * rms
    assert found.trials < 10 * len(wanted)


def test_angles_out_of_reach_name_their_sample():
    with pytest.raises(SolverError, match=r"sample 1: no motion|no equilibrium|closes"):
        compensated_wheels(RIG, np.array([[1.0, 0.0], [1e4, 0.0]]))
    with pytest.raises(RigError, match="wheels = 1: expected 2"):
        compensated_wheels(rig_in_space(preset("du2018")), np.zeros((3, 2)))
    with pytest.raises(RigError, match="wanted_deg = shape"):
        compensated_wheels(RIG, np.zeros(3))


@pytest.mark.parametrize("angles_deg", [(0.0, 120.0, 240.0), (0.0, 90.0, 180.0, 270.0)])
def test_three_and_four_wheels_follow_angles_without_pulling_against_each_other(angles_deg):
    count = len(angles_deg)
    rig = replace(replace(ZHANG, tendon_b=None), layout=Layout(ZHANG.turns_deg, angles_deg, tuple(range(1, count + 1))))
    wanted = ring(15.0, 12)
    found = compensated_wheels(rig, wanted)
    assert found.wheels_mm.shape == (18, count)
    np.testing.assert_allclose(found.wheels_mm.sum(axis=1), 0.0, atol=1e-12)  # the tube keeps its length
    np.testing.assert_allclose(bending(rig, found.wheels_mm), wanted, atol=2e-3)


def test_a_tendon_without_an_opposite_one_cannot_push():
    """Two tendons at a right angle: the wrist does not bend away from either once it is slack."""
    rig = replace(replace(ZHANG, tendon_b=None), layout=Layout(ZHANG.turns_deg, (0.0, 90.0), (1, 2)))
    with pytest.raises(SolverError, match="sample 1: no motion of the wheels found for -20, 0 deg"):
        compensated_wheels(rig, np.array([[3.0, 3.0], [-20.0, 0.0]]))


def test_a_workspace_without_friction_is_a_function_of_the_drives():
    found = workspace(smooth_rig(RIG), 1.0, circles=2, directions=12)
    assert found.spread_mm.max() < 1e-6
    np.testing.assert_allclose(found.forth_mm, found.smooth_mm, atol=1e-6)
    # turns of 0 and 90 degrees: the mirror images in y and in z are the same wrist
    np.testing.assert_allclose(found.smooth_mm[:, 3], found.smooth_mm[:, 9] * [1, -1, -1], atol=1e-6)


def test_friction_leaves_the_tip_open():
    weak = replace(preset("du2018-full-widths"), tendon_b=None, layout=RIG.layout)
    found = workspace(weak, 1.0, circles=2, directions=12)
    # at the same drives the tip lags the wheels on the way forth, and on the way back: on either side of no friction
    assert 0.3 < found.spread_mm.mean() < 1.0
    assert found.area_mm2(found.forth_mm) == pytest.approx(found.area_mm2(found.back_mm), rel=1e-3)
    circle_mm2 = np.pi * np.abs(found.smooth_mm[-1, :, 1]).max() * np.abs(found.smooth_mm[-1, :, 2]).max()
    # a polygon of 12 in an ellipse has sin(2 pi/12)/(2 pi/12) of its area
    assert found.area_mm2(found.smooth_mm) == pytest.approx(circle_mm2 * np.sin(np.pi / 6) / (np.pi / 6), rel=0.05)


def test_compliance_is_that_of_the_planar_chain_under_a_tip_load():
    """Without friction, of a planar rig bent by 0.8 mm: the planar chain's tip under small loads either way.

    Loads stretch and shear the notches in space, and not in the planar chain: the trace of what that adds does not
    change as the notches turn, and is the sum of their axial and shear compliances.
    """
    rig = smooth_rig(rig_in_space(preset("du2018")))
    found = tip_compliance(rig, np.array([0.8]), force_N=1e-2).sliding[:2, :2]
    program, planar = LoadProgram(np.linspace(0, 0.8, 9)), np.empty((2, 2))
    for column, direction_deg in enumerate((0.0, 90.0)):
        ahead, behind = (
            simulate_chain(replace(rig.in_plane, tip_load=TipLoad(1e-2, direction_deg + turn)), program).tip_mm[-1]
            for turn in (0.0, 180.0)
        )
        planar[:, column] = (ahead - behind) / 2e-2
    gives = sum(1 / joint.stiffness.axial + 1 / joint.stiffness.shear_in for joint in of_rig_in_space(rig).joints)
    np.testing.assert_allclose(found, planar, atol=gives)
    assert np.trace(found - planar) == pytest.approx(gives, rel=0.01)


@pytest.mark.parametrize("wheels", [(0.0, 0.0), (0.8, 0.0), (0.6, 0.6)])
def test_compliance_is_symmetric_and_smallest_where_guides_stick(wheels):
    """Maxwell's reciprocity; axial and shear of the notches move the tip alone, which leaves a part of a hundredth."""
    found = tip_compliance(RIG, np.array(wheels))
    for matrix in (found.held, found.sliding):
        np.testing.assert_allclose(matrix, matrix.T, atol=0.01 * np.abs(matrix).max())
        assert np.linalg.eigvalsh(0.5 * (matrix + matrix.T)).min() > 0
    more = found.sliding - found.held
    assert np.linalg.eigvalsh(0.5 * (more + more.T)).min() > -1e-6
    assert found.sliding[1, 1] > 10 * found.held[1, 1]


@pytest.mark.parametrize("plane", [1, 2])
def test_the_backbone_of_a_plane_is_the_run_without_friction(plane):
    """At whatever drives and in whatever order; little friction changes little."""
    drive = np.array([0.3, -0.6, 0.0, 0.9, -0.6])
    still = [0.2, 0.2]
    wheels = np.full((5, 2), 0.2)
    wheels[:, plane - 1] = drive
    curve = plane_backbone(RIG, plane, still)(drive)
    np.testing.assert_allclose(curve, bending(smooth_rig(RIG), wheels)[:, plane - 1], atol=1e-6)
    little = replace(RIG, friction=Friction(0.002), material=smooth_rig(RIG).material)
    np.testing.assert_allclose(curve, bending(little, wheels)[:, plane - 1], atol=0.05)


def test_a_backbone_needs_the_wheels_of_the_rig():
    one_wheel = replace(PLANAR, layout=Layout(RIG.turns_deg, (0.0, 180.0), (1, 1)))
    with pytest.raises(RigError, match="plane = 2: expected 1 to 1, the wheels of rig"):
        plane_backbone(one_wheel, 2, [0.0])
    with pytest.raises(RigError, match="still_mm = 1 wheels: expected the 2 of rig"):
        plane_backbone(RIG, 1, [0.0])
