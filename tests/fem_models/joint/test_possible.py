"""Preloads that a rig cannot have: against the chain that runs near the bound, and hand formulas."""

import re
from dataclasses import replace

import numpy as np
import pytest
from notched_rigs import PAIR, WRIST, V, make_rig

from fem_models.chain.solve import solve_chain
from fem_models.joint import joint_row
from fem_models.joint.possible import buckling_preload_N, joints_stiffness, require_possible, require_reach
from fem_models.load import LoadProgram
from fem_models.rig import RigError
from fem_models.rig.checks import SolverError
from fem_models.rig.effects import Closure, Slack
from fem_models.rig.joints import MeasuredJoint
from fem_models.rig.presets import PRESETS, preset
from fem_models.rig.rig import Tendon, with_notch

STIFF = Tendon(EA_N=1e6, moment_arm_mm=2.62, free_length_mm=150.0)
SOFT = Tendon(EA_N=5_000.0, moment_arm_mm=0.6, free_length_mm=200.0)


def refused(rig):
    with pytest.raises(RigError, match=r"preload_N = ") as caught:
        require_possible(rig, joint_row(rig))
    assert "\n" not in str(caught.value)
    return str(caught.value)


def begins(rig):
    """The number of the message at a preload of 9 % of EA, beyond any that the rig bears."""
    return float(re.search(r"below about ([\d.e+]+)", refused(replace(rig, preload_N=0.09 * rig.tendon_a.EA_N)))[1])


@pytest.mark.parametrize("rig", [V, PAIR, *(preset.rig for preset in PRESETS.values())], ids=lambda rig: rig.name)
def test_rigs_of_the_package_are_possible(rig):
    require_possible(rig, joint_row(rig))


def test_joints_that_are_alike_buckle_where_the_thrust_passes_four_k_over_the_gap():
    """Two tendons of tension T and a gap g: k = 2 T g/4, in bends whose angles add up to nothing."""
    rig = replace(PAIR, tendon_a=STIFF, tendon_b=STIFF)
    joint = joint_row(rig).first
    expected = 2 * joint.elastic_Nmm_per_rad / joint.rigid_gap_mm
    assert buckling_preload_N(rig, joint_row(rig)) == pytest.approx(expected, rel=1e-9)
    require_possible(replace(rig, preload_N=0.999 * expected), joint_row(rig))
    said = refused(replace(rig, preload_N=1.001 * expected))
    assert f"expected below {expected:.4g}, where the straight tube buckles" in said
    assert f"joints of {joint.elastic_Nmm_per_rad:.4g} Nmm/rad" in said
    assert f"2 tendons over gaps of {joint.rigid_gap_mm:.4g} mm" in said


def test_the_chain_buckles_there():
    """Without friction, one joint a little softer: it bends more than the others by d/(1 - T/Tc) (Southwell 1932)."""
    rig = make_rig("rectangular_pair", count=4)
    depth = rig.joint.notch.depth_mm
    rig = with_notch(rig, replace(rig.joint.notch, depth_mm=(depth, 1.002 * depth, depth, depth)))
    rig = replace(rig, tendon_a=STIFF, tendon_b=STIFF)
    tension = buckling_preload_N(rig, joint_row(rig))
    each = 2 * joints_stiffness(rig, joint_row(rig)) / joint_row(rig).of("rigid_gap_mm")
    assert each.min() < tension < each.max()
    found = []
    for share in (0.8, 0.95):
        run = solve_chain(replace(rig, preload_N=share * tension), LoadProgram([0.0, 0.01]))
        angles = run.record.notches_deg[-1]
        found.append((share * tension, angles[1] - angles.mean()))
    (low, off), (high, further) = found
    assert (further * high - off * low) / (further - off) == pytest.approx(tension, rel=1e-3)


def test_one_joint_is_held_by_its_tendons():
    """k + 2 s r^2 = 2 T g/4, s being the stiffness of a whole tendon: there is no bend that changes no path."""
    rig = replace(make_rig("rectangular_pair", count=1), tendon_a=STIFF, tendon_b=STIFF)
    joint, length = joint_row(rig).first, 150.0 + rig.pitch_mm
    expected = 2 * (joint.elastic_Nmm_per_rad + 2 * 1e6 / length * 2.62**2) / joint.rigid_gap_mm
    assert buckling_preload_N(rig, joint_row(rig)) == pytest.approx(expected, rel=1e-9)


def test_slack_tendons_and_joints_without_a_gap_do_not_buckle():
    rig = replace(PAIR, tendon_a=STIFF, tendon_b=STIFF, preload_N=1e4)
    refused(rig)
    loose = replace(rig, slack=Slack(10.0, 10.0))  # mm, beyond the stretch of the preload
    require_possible(loose, joint_row(loose))
    measured = replace(rig, joint=MeasuredJoint(14, 2.6, 500.0))
    require_possible(measured, joint_row(measured))


@pytest.mark.parametrize(
    "rig",
    [
        replace(WRIST, tendon_a=SOFT, tendon_b=None, preload_N=1.0),
        replace(WRIST, tendon_a=SOFT, tendon_b=SOFT, preload_N=1.0),
    ],
    ids=["one tendon", "two of unequal arms"],
)
def test_a_preload_that_closes_a_notch_at_rest(rig):
    """The number in the message is the one at which the chain closes it, to a fifth; what it bears is not refused."""
    most, program = begins(rig), LoadProgram([0.0, 1e-3])
    solve_chain(replace(rig, preload_N=0.8 * most), program)
    with pytest.raises(SolverError, match="sample 0 of 2: joint 1 at"):
        solve_chain(replace(rig, preload_N=1.1 * most), program)
    require_possible(replace(rig, preload_N=1.1 * most), joint_row(rig))  # an estimate
    assert "closes a notch at rest (at " in refused(replace(rig, preload_N=1.3 * most))
    closing = replace(rig, preload_N=1.3 * most, closure=Closure(1000.0))
    require_possible(closing, joint_row(closing))


def test_friction_holds_a_notch_open():
    rig = replace(WRIST, tendon_a=SOFT, tendon_b=None, preload_N=1.0)
    rough = replace(rig, friction=replace(rig.friction, capstan_coefficient=0.3))
    assert begins(rough) > 1.2 * begins(rig)


@pytest.mark.parametrize(("EA_N", "most"), [(100.0, "10"), (1234.0, "123.4")])
def test_a_preload_that_breaks_a_tendon(EA_N, most):
    tendon = replace(V.tendon_a, EA_N=EA_N)
    rig = replace(V, tendon_a=tendon, tendon_b=tendon, preload_N=0.1 * EA_N)
    require_possible(rig, joint_row(rig))
    said = refused(replace(rig, preload_N=0.11 * EA_N))
    assert f"expected at most {most}, where tendon_a of EA_N = {EA_N:g} is stretched by 10 %" in said


@pytest.mark.parametrize("shape", ["v_pair", "rectangular_pair", "rectangular"])
def test_a_notch_that_leaves_next_to_nothing_is_refused_or_has_a_ligament(shape):
    """Depths up to the last digit below the limit, alike and in a list; beyond it the limit is named."""
    rig = make_rig(shape, count=3)
    limit = 6.0 if shape == "rectangular" else 3.0
    for depth in (2.71, 0.9 * limit, limit - 1e-6):
        row = joint_row(with_notch(rig, replace(rig.joint.notch, depth_mm=depth)))
        assert 0 < row.first.flexure.bending_Nmm_per_rad < np.inf
    for depths in (limit, 2 * limit, (2.7, 2.71, limit)):
        with pytest.raises(RigError, match=rf"notch\.depth_mm.* = {np.max(depths):g}.*: expected below {limit:g} mm"):
            with_notch(rig, replace(rig.joint.notch, depth_mm=depths))


@pytest.mark.parametrize(
    ("drive_mm", "slack_mm", "bound"),
    [(500.0, 0.0, "at most"), (-500.0, 0.0, "at least"), (500.0, 10.0, "at most")],
)
def test_a_drive_that_no_tendon_bears_is_refused_with_the_one_that_it_bears(drive_mm, slack_mm, bound):
    """L/EA (T - T0) of stretch from the preload T0 to T = EA/10, the toe's of the free length, 14 pitches, 28 arms."""
    rig = preset("du2018")
    tendon, length, most_N = rig.tendon_a, 14 * 2.6, 1_700.0
    taut, toe = (tendon.free_length_mm + length) * (most_N - 20.0), tendon.free_length_mm * tendon.toe_N
    stretch = (taut + toe * np.log(most_N / 20.0)) / tendon.EA_N
    most_mm = np.sign(drive_mm) * (stretch + length + 2 * 14 * tendon.moment_arm_mm + slack_mm)
    slack = np.array([[slack_mm, 0.0]] * 2)
    with pytest.raises(RigError, match=f"= {drive_mm:g}: expected {bound} {most_mm:.4g}, where"):
        require_reach(rig, np.array([0.0, drive_mm]), slack)
    require_reach(rig, np.array([0.0, 0.2 * drive_mm]), slack)
