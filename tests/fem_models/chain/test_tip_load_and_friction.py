"""A load on the tip, a wrong gain of the drive, and friction that varies by speed, place and cycle.

Expected are closed forms, runs of another friction, and the multibody model.
"""

from dataclasses import replace

import numpy as np
import pytest

from fem_models.chain.solve import simulate_chain
from fem_models.joint.flexure import flexure
from fem_models.load import LoadProgram, sine, triangle
from fem_models.multibody.quasi_static import simulate_multibody
from fem_models.rig import RigError, preset
from fem_models.rig.effects import DriveGain, Gravity, PositionFriction, RunIn, Stribeck, TipLoad
from fem_models.rig.joints import MeasuredJoint
from fem_models.rig.rig import Friction, Material
from hysteresis.records.metrics import loop_width

STEPS = triangle(2.2, step_mm=0.2)
RIG = preset("du2018")


def soft_tendons(rig):
    """A rig that its tendons do not hold, without friction and material loop."""
    tendon = replace(rig.tendon_a, EA_N=1e4, free_length_mm=1e10, toe_N=0.0)
    return replace(
        rig, preload_N=1e-3, friction=Friction(), material=Material(60.0, 0.33), tendon_a=tendon, tendon_b=tendon
    )


@pytest.mark.parametrize("force_N", [0.01, 20.0])
def test_a_tip_load_bends_one_joint_by_the_moment_of_its_lever(force_N):
    """By hand: k theta = F (p/2) cos theta, the tip being half a pitch beyond the joint; for large angles, too."""
    stiffness, pitch = 50.0, 3.0
    rig = replace(soft_tendons(RIG), joint=MeasuredJoint(1, pitch, stiffness), tip_load=TipLoad(force_N, 90.0))
    theta = np.radians(simulate_chain(rig, LoadProgram(np.array([0.0, 1e-9]))).angle_deg[0])
    assert theta == pytest.approx(force_N * 0.5 * pitch * np.cos(theta) / stiffness, rel=1e-3)


def test_a_tip_load_sags_a_chain_by_the_sum_of_its_levers():
    """For small angles the load's moment on joint i is F times its distance to the middle of the last ring."""
    rig = replace(soft_tendons(RIG), tip_load=TipLoad(force_N=1e-3))
    record = simulate_chain(rig, LoadProgram(np.array([0.0, 1e-9])))
    n, pitch = rig.joints, rig.pitch_mm
    moment = 1e-3 * sum((n - 0.5 - i) * pitch for i in range(n))
    assert record.angle_deg[0] == pytest.approx(-np.degrees(moment / flexure(rig).bending_Nmm_per_rad), rel=0.01)


def test_a_tip_load_and_weight_add_as_forces():
    """On a tube of one joint the weight of its ring acts where the tip load does."""
    rig = replace(RIG, joint=MeasuredJoint(1, 3.0, 400.0))
    weight_N = 30e-6 * 9806.65
    heavy = simulate_chain(replace(rig, gravity=Gravity(30.0, 20.0)), triangle(0.2, step_mm=0.05)).angle_deg
    loaded = simulate_chain(replace(rig, tip_load=TipLoad(weight_N, 20.0)), triangle(0.2, step_mm=0.05)).angle_deg
    np.testing.assert_allclose(loaded, heavy, atol=1e-9)


@pytest.mark.parametrize("direction_deg", [-90.0, 0.0, 160.0])
def test_both_engines_agree_under_a_tip_load(direction_deg):
    rig = replace(RIG, tip_load=TipLoad(0.3, direction_deg))
    chain, multibody = simulate_chain(rig, STEPS).angle_deg, simulate_multibody(rig, STEPS).angle_deg
    assert np.abs(chain - multibody).max() < 0.03
    assert np.abs(chain - simulate_chain(RIG, STEPS).angle_deg).max() > 0.15


def test_a_gain_of_the_drive_is_another_drive():
    other = replace(STEPS, drive_mm=0.95 * STEPS.drive_mm)
    off = simulate_chain(replace(RIG, drive_gain=DriveGain(-0.05)), STEPS).angle_deg
    np.testing.assert_allclose(off, simulate_chain(RIG, other).angle_deg, atol=1e-12)


TIMED = sine(2.2, 0.1, cycles=2, samples_per_cycle=60)
VARYING = {
    "stribeck": Stribeck(rise=1.0, speed_mm_per_s=0.5),
    "position_friction": PositionFriction(growth_per_mm=0.3),
    "run_in": RunIn(excess=0.8, cycles=0.8),
}


@pytest.mark.parametrize("name", VARYING)
def test_both_engines_agree_on_friction_that_varies(name):
    rig = replace(RIG, **{name: VARYING[name]})
    chain, multibody = simulate_chain(rig, TIMED).angle_deg, simulate_multibody(rig, TIMED).angle_deg
    assert np.abs(chain - multibody).max() < 0.05
    assert np.abs(chain - simulate_chain(RIG, TIMED).angle_deg).max() > 0.1


def with_friction(factor):
    dry = RIG.friction
    more = replace(
        dry,
        capstan_coefficient=factor * dry.capstan_coefficient,
        guide_N=factor * dry.guide_N,
        sheath_N=factor * dry.sheath_N,
    )
    return simulate_chain(replace(RIG, friction=more), TIMED).angle_deg


def test_limits_of_friction_that_varies():
    """Far from where it varies, it is a friction of other size: creeping, in the first cycles of many, nowhere."""
    slow = simulate_chain(replace(RIG, stribeck=Stribeck(0.7, 1e6)), TIMED).angle_deg
    np.testing.assert_allclose(slow, with_friction(1.7), atol=1e-5)
    fast = simulate_chain(replace(RIG, stribeck=Stribeck(0.7, 1e-9)), TIMED).angle_deg
    np.testing.assert_allclose(fast[:15], with_friction(1.0)[:15], atol=1e-5)  # until it comes to rest
    fresh = simulate_chain(replace(RIG, run_in=RunIn(0.7, 1e9)), TIMED).angle_deg
    np.testing.assert_allclose(fresh, with_friction(1.7), atol=1e-5)
    worn = simulate_chain(replace(RIG, run_in=RunIn(0.7, 1e-3)), TIMED).angle_deg
    assert np.abs(worn - with_friction(1.0))[40:].max() < 0.02
    same = simulate_chain(replace(RIG, position_friction=PositionFriction(0.0)), TIMED).angle_deg
    np.testing.assert_array_equal(same, with_friction(1.0))


def test_friction_that_grows_along_the_stroke_widens_one_side():
    def width(rig, side):
        record = simulate_chain(rig, TIMED)
        kept = (side * record.drive > 0.5) & (record.cycle == 2)
        up = kept & (np.gradient(record.drive) > 0)
        down = kept & (np.gradient(record.drive) < 0)
        return record.angle_deg[down].mean() - record.angle_deg[up].mean()

    rig = replace(RIG, position_friction=PositionFriction(0.3))
    assert width(rig, 1) > 1.2 * width(RIG, 1)
    assert width(rig, -1) < 0.9 * width(RIG, -1)


def test_friction_by_speed_and_cycle_needs_times_and_cycles():
    with pytest.raises(RigError, match="stribeck: expected a load program with time_s"):
        simulate_chain(replace(RIG, stribeck=VARYING["stribeck"]), STEPS)
    with pytest.raises(RigError, match="cycle: missing"):
        simulate_chain(replace(RIG, run_in=VARYING["run_in"]), LoadProgram(STEPS.drive_mm))


def test_run_in_ends_at_the_steady_loop():
    steps = triangle(2.2, step_mm=0.2, cycles=4)
    run = simulate_chain(replace(RIG, run_in=RunIn(0.8, 0.8)), steps)
    steady = simulate_chain(RIG, steps)
    widths = [
        loop_width(*(column[run.cycle == c] for column in (run.drive, run.angle_deg, run.cycle))).max_deg
        / loop_width(*(column[run.cycle == c] for column in (steady.drive, steady.angle_deg, steady.cycle))).max_deg
        for c in (1, 2, 4)
    ]
    assert widths[0] > widths[1] > widths[2]
    assert widths[2] == pytest.approx(1.0, abs=0.02)
