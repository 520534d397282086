"""Planar rigs in the chain in space against the planar chain, at any angle about the tube axis."""

from dataclasses import replace

import numpy as np
import pytest

from fem_models.chain.solve import solve_chain
from fem_models.joint import joint_row
from fem_models.load import LoadProgram, triangle
from fem_models.rig import RigError, preset
from fem_models.rig.checks import SolverError
from fem_models.rig.effects import Closure, Gravity, Superelastic, TipLoad, TipMass
from fem_models.rig.joints import MeasuredJoint, Notch
from fem_models.rig.rig import Friction, with_notch
from fem_models.spatial import SpatialProgram, solve_spatial, spatial_rig, wheel_drives

RIG = preset("du2018")
LOOP = triangle(2.2, step_mm=0.1)
ONE_SIDED = with_notch(RIG, Notch("rectangular", 8, depth_mm=4.5, width_mm=1.5, spacing_mm=1.2))
SINGLE = replace(preset("notched-wrist-90"), superelastic=None, closure=Closure(1000.0, 8.0))
UP_AND_DOWN = LoadProgram(np.concatenate([np.linspace(0, 1, 21), np.linspace(1, 0, 21)[1:]]))
SHORT = triangle(1.0, step_mm=0.1)
WIDTHS, SPACINGS = (1.5, 1.2, 1.8, 1.3), (1.0, 1.5, 0.8, 2.0)
UNEVEN = with_notch(RIG, Notch("rectangular", 4, 4.5, WIDTHS, SPACINGS))
STEPPED = with_notch(RIG, Notch("rectangular", 4, (4.3, 4.4, 4.5, 4.6), WIDTHS, SPACINGS))  # neutral axes step
UNEVEN_PAIRS = with_notch(RIG, Notch("v_pair", 4, (2.6, 2.65, 2.7, 2.7), WIDTHS, SPACINGS, root_width_mm=0.3))
CASES = {
    "10 N": (preset("du2018", preload_N=10.0), LOOP),
    "20 N": (RIG, LOOP),
    "capstan": (replace(RIG, friction=Friction(capstan_coefficient=0.2, guide_N=0.05, rest_wrap_deg=20.0)), LOOP),
    "weight": (replace(RIG, gravity=Gravity(1.0, -60.0)), LOOP),
    "tip": (replace(RIG, tip_load=TipLoad(0.3, 160.0), tip_mass=TipMass(5.0)), LOOP),
    "one-sided": (replace(ONE_SIDED, gravity=Gravity(1.0, -60.0)), SHORT),
    "uneven pitch": (replace(UNEVEN, friction=Friction(0.2, 0.05, 0.2), gravity=Gravity(1.0, -60.0)), SHORT),
    "steps of the neutral axis": (
        replace(STEPPED, friction=Friction(0.2, 0.05, 0.2), gravity=Gravity(20.0, -60.0), tip_load=TipLoad(0.3, 160.0)),
        SHORT,
    ),
    "uneven pairs": (replace(UNEVEN_PAIRS, tip_load=TipLoad(0.3, 160.0)), SHORT),
    "one tendon, closing notches": (SINGLE, UP_AND_DOWN),
    "bench": (replace(RIG, joint=MeasuredJoint(8, 3.0, 300.0, rigid_gap_mm=0.5), precurvature_deg=2.0), SHORT),
}


def drives(rig, program):
    return wheel_drives(program.drive_mm) if rig.tendon_b else program.drive_mm[:, None]


@pytest.mark.parametrize("turn_deg", [0.0, 37.0])
@pytest.mark.parametrize("name", CASES)
def test_a_planar_rig_is_that_of_the_planar_chain(name, turn_deg):
    rig, program = CASES[name]
    planar = solve_chain(rig, program)
    space = solve_spatial(spatial_rig(rig, turns_deg=turn_deg), drives(rig, program))
    cs, sn = np.cos(np.radians(turn_deg)), np.sin(np.radians(turn_deg))
    np.testing.assert_allclose(space.bending_deg @ [cs, sn], planar.record.angle_deg, atol=1e-7)
    assert np.abs(space.bending_deg @ [-sn, cs]).max() < 1e-9
    assert np.abs(space.torsion_deg).max() < 1e-9
    count = len(rig.tendons)
    np.testing.assert_allclose(space.tensions_N, planar.segment_tensions_N[:, :count], atol=1e-6)
    np.testing.assert_allclose(space.notches_deg[:, :, 2], planar.record.notches_deg, atol=1e-7)
    for here, there in (
        (space.work_mJ, planar.wheel_work_mJ),
        (space.friction_mJ, planar.friction_loss_mJ),
        (space.material_mJ, planar.material_loss_mJ),
    ):
        np.testing.assert_allclose(here, there, atol=1e-7)


@pytest.mark.parametrize(("rig", "program"), [(RIG, LOOP), (UNEVEN_PAIRS, SHORT)], ids=["alike", "uneven"])
def test_the_tip_is_where_the_planar_chain_has_it(rig, program):
    """The elongation of notches counts along them here, along the straight tube there: 1e-3 mm, bent by 45 deg."""
    planar, space = solve_chain(rig, program), solve_spatial(spatial_rig(rig), wheel_drives(program.drive_mm))
    np.testing.assert_allclose(space.tip_mm[:, :2], planar.record.tip_mm, atol=1e-3)
    assert np.abs(space.tip_mm[:, 2]).max() < 1e-12


def test_the_tip_of_one_sided_notches_goes_over_the_steps_of_the_neutral_axis():
    """The planar chain has the point of the last ring at its neutral axis, the chain in space that at the tube's."""
    rig = replace(STEPPED, gravity=Gravity(20.0, -60.0))
    planar, space = solve_chain(rig, SHORT), solve_spatial(spatial_rig(rig), wheel_drives(SHORT.drive_mm))
    heading = np.radians(planar.record.angle_deg)
    offset = joint_row(rig).each[-1].flexure.neutral_offset_mm
    to_centre = offset * np.column_stack([-np.sin(heading), np.cos(heading) - 1.0])
    # the steps of 0.1 mm in all move it by 0.04 mm; for the rest see the test above
    np.testing.assert_allclose(space.tip_mm[:, :2], planar.record.tip_mm + to_centre, atol=1.5e-3)


def test_a_prescribed_tension_is_that_of_the_planar_chain_under_load_control():
    from fem_models.chain.solve import solve_chain_by_force

    force = np.concatenate([np.linspace(0, 3, 16), np.linspace(3, 0, 16)[1:]])
    planar = solve_chain_by_force(SINGLE, force)
    space = solve_spatial(spatial_rig(SINGLE), SpatialProgram(force[:, None], (True,)))
    np.testing.assert_allclose(space.bending_deg[:, 0], planar.record.angle_deg, atol=1e-6)
    np.testing.assert_allclose(space.work_mJ, planar.wheel_work_mJ, atol=1e-6)


def test_what_is_not_known_in_space_is_refused():
    with pytest.raises(RigError, match=r"superelastic = given: expected none in space"):
        spatial_rig(replace(RIG, superelastic=Superelastic()))
    with pytest.raises(RigError, match="turns_deg = 3 angles: expected one for each of 14 joints"):
        spatial_rig(RIG, turns_deg=[0.0, 90.0, 0.0])
    with pytest.raises(RigError, match="hardening_slope"):
        spatial_rig(replace(RIG, joint=MeasuredJoint(3, 3.0, 300.0, hardening_slope=0.1)))
    with pytest.raises(RigError, match="drives = 3 columns: expected one for each of 2 tendons"):
        solve_spatial(spatial_rig(RIG), np.zeros((2, 3)))
    with pytest.raises(RigError, match="at least 0"):
        SpatialProgram(np.array([[-1.0]]), (True,))


def test_no_equilibrium_raises_with_sample_and_drives():
    with pytest.raises(SolverError, match=r"closes at|no equilibrium between drives"):
        solve_spatial(spatial_rig(RIG), wheel_drives([0.0, 3.0, 60.0]))
