"""Play that preload takes up, velocity weakening and loads at the tip, in both engines, against closed forms."""

from dataclasses import replace

import numpy as np
import pytest

from fem_models.chain.solve import simulate_chain
from fem_models.joint.contact import weight_N
from fem_models.load import LoadProgram, triangle
from fem_models.load.schedule import schedule
from fem_models.multibody.quasi_static import simulate_multibody
from fem_models.rig import RigError, preset
from fem_models.rig.effects import Backlash, Gravity, PreloadLoss, Stribeck, TipLoad, TipMass
from fem_models.rig.joints import MeasuredJoint
from fem_models.rig.rig import Friction, Material
from fem_models.rig.rig_file import rig_of_tables

ENGINES = {"chain": simulate_chain, "multibody": simulate_multibody}
RIG = preset("du2018")
TENDON = replace(RIG.tendon_a, toe_N=0.0)
LINEAR = replace(
    RIG,
    friction=Friction(),
    material=Material(60.0, 0.33),
    tendon_a=TENDON,
    tendon_b=TENDON,
    joint=MeasuredJoint(4, 3.0, 400.0),
)
PLAY = Backlash(width_mm=0.6, takes_up_N=5.0)


def drive_at_zero(record, cycle):
    """Drives at which the angle is zero on the way up and on the way down."""
    of_cycle = record.cycle == cycle
    drive, angle = record.drive[of_cycle], record.angle_deg[of_cycle]
    at = []
    for k in np.flatnonzero(np.sign(angle[1:]) != np.sign(angle[:-1])):
        at.append(drive[k] - angle[k] * (drive[k + 1] - drive[k]) / (angle[k + 1] - angle[k]))
    return max(at), min(at)


@pytest.mark.parametrize("engine", ENGINES)
@pytest.mark.parametrize("preload_N", [5.0, 10.0, 40.0])
def test_lost_motion_falls_with_the_preload(engine, preload_N):
    """Without friction the way back is the way out, shifted by the play: w/(1 + T/T0)."""
    steps = triangle(0.63, step_mm=0.07, cycles=2)
    record = ENGINES[engine](replace(LINEAR, preload_N=preload_N, backlash=PLAY), steps)
    up, down = drive_at_zero(record, 2)
    assert up - down == pytest.approx(0.6 / (1 + preload_N / 5.0), rel=2e-3)
    assert up + down == pytest.approx(0.0, abs=2e-3)


def test_a_play_opens_as_the_preload_is_lost():
    rig = replace(LINEAR, preload_N=10.0, backlash=PLAY, preload_loss=PreloadLoss(fraction=0.5, cycles=1.0))
    steps = triangle(1.0, step_mm=0.25, cycles=3)
    left = 10.0 * (1 - 0.5 * (1 - np.exp(-np.asarray(steps.cycle))))
    lag = steps.drive_mm - schedule(rig, steps).drive_mm
    assert np.abs(lag).max() == pytest.approx(0.5 * 0.6 / (1 + left[-1] / 5.0), rel=1e-3)
    assert PLAY.left_mm(10.0) == pytest.approx(0.2)


def test_a_play_of_no_width_changes_nothing():
    steps = triangle(2.2, step_mm=0.2)
    none = simulate_chain(replace(RIG, backlash=Backlash(0.0, 5.0)), steps).angle_deg
    np.testing.assert_array_equal(none, simulate_chain(RIG, steps).angle_deg)


@pytest.mark.parametrize("engine", ENGINES)
def test_velocity_weakening_widens_the_slow_loop(engine):
    """By hand: friction F in the sheaths alone holds the base back by F over the stiffness, both ways: widths go as F.

    At the speed v F is 1 + rise exp(-v/vs) of that of fast motion.
    """
    rig = replace(LINEAR, friction=Friction(sheath_N=0.5), stribeck=Stribeck(rise=1.5, speed_mm_per_s=0.2))
    steps = triangle(1.05, step_mm=0.07, cycles=2)
    widths = []
    for speed in (0.05, 0.3):
        timed = replace(steps, time_s=np.arange(steps.drive_mm.size) * 0.07 / speed)
        up, down = drive_at_zero(ENGINES[engine](rig, timed), 2)
        widths.append(up - down)
    ratio = (1 + 1.5 * np.exp(-0.05 / 0.2)) / (1 + 1.5 * np.exp(-0.3 / 0.2))
    assert widths[0] / widths[1] == pytest.approx(ratio, rel=3e-3)
    assert ratio > 1.5


def hanging(tip):
    """Ten stiff joints that hold themselves: the tendons between wheel and base are as soft as none."""
    soft = replace(TENDON, EA_N=1e4, free_length_mm=1e9)
    return replace(LINEAR, preload_N=1e-2, tendon_a=soft, tendon_b=soft, joint=MeasuredJoint(10, 3.0, 2000.0), **tip)


STILL = LoadProgram(np.array([0.0, 1e-9]))


@pytest.mark.parametrize("engine", ENGINES)
@pytest.mark.parametrize(
    ("tip", "force_N"),
    [
        ({"tip_load": TipLoad(0.2, 90.0)}, 0.2),
        ({"tip_load": TipLoad(0.2, -90.0)}, -0.2),
        ({"tip_mass": TipMass(20.0)}, -0.02 * 9.80665),
        ({"tip_mass": TipMass(20.0, 90.0)}, 0.02 * 9.80665),
        ({"tip_mass": TipMass(20.0), "tip_load": TipLoad(0.3, 90.0)}, 0.3 - 0.02 * 9.80665),
    ],
)
def test_a_stiff_straight_chain_gives_by_the_sum_of_its_springs(engine, tip, force_N):
    """By hand: joint i turns by F l_i/k, and the tip moves by F times the sum of l_i^2/k, l_i being its distance."""
    record = ENGINES[engine](hanging(tip), STILL)
    distance = 3.0 * (np.arange(10) + 0.5)
    assert record.angle_deg[0] == pytest.approx(np.degrees(force_N * (distance / 2000.0).sum()), rel=4e-3)
    assert record.tip_mm[0, 1] == pytest.approx(force_N * (distance**2 / 2000.0).sum(), rel=4e-3)


@pytest.mark.parametrize("engine", ENGINES)
@pytest.mark.parametrize("direction_deg", [-90.0, 35.0])
def test_a_mass_at_the_tip_is_a_load_of_its_weight(engine, direction_deg):
    simulate, steps = ENGINES[engine], triangle(2.2, step_mm=0.55)
    mass = simulate(replace(RIG, tip_mass=TipMass(40.0, direction_deg)), steps).angle_deg
    load = simulate(replace(RIG, tip_load=TipLoad(weight_N(40.0), direction_deg)), steps).angle_deg
    np.testing.assert_allclose(mass, load, atol=1e-6)
    assert np.abs(mass - simulate(RIG, steps).angle_deg).max() > 0.1


def test_load_and_weights_at_the_tip_add():
    """A load as large as the weight the other way leaves nothing; the weight of the rings is not the tip's."""
    steps = triangle(1.1, step_mm=0.275)
    off = replace(RIG, tip_mass=TipMass(40.0), tip_load=TipLoad(weight_N(40.0), 90.0))
    np.testing.assert_allclose(simulate_chain(off, steps).angle_deg, simulate_chain(RIG, steps).angle_deg, atol=1e-9)
    rings = simulate_chain(replace(RIG, gravity=Gravity(40.0 / RIG.joints)), steps).angle_deg
    tip = simulate_chain(replace(RIG, tip_mass=TipMass(40.0)), steps).angle_deg
    straight = simulate_chain(RIG, steps).angle_deg
    assert np.abs(tip - straight).max() > 1.5 * np.abs(rings - straight).max()


def test_a_rig_file_knows_both():
    rig = replace(RIG, backlash=PLAY, tip_mass=TipMass(12.0, 30.0))
    assert rig_of_tables(rig.to_dict(), "file", "name") == rig


@pytest.mark.parametrize(
    ("make", "complaint"),
    [
        (lambda: Backlash(-0.1, 5.0), "backlash.width_mm = -0.1: expected at least 0"),
        (lambda: Backlash(0.1, 0.0), "backlash.takes_up_N = 0.0: expected above 0"),
        (lambda: TipMass(-1.0), "tip_mass.mass_g = -1.0: expected at least 0"),
    ],
)
def test_impossible_values_are_named(make, complaint):
    with pytest.raises(RigError, match=complaint):
        make()


@pytest.mark.parametrize("engine", ENGINES)
@pytest.mark.parametrize("load", [{"tip_load": TipLoad(0.2, 90.0)}, {"gravity": Gravity(0.3)}], ids=["tip", "weight"])
@pytest.mark.parametrize("first_mm", [1e-17, 1e-6, 1e-4])
def test_loads_come_on_however_little_the_drive_moves_first(engine, load, first_mm):
    """A sine may begin at a rounding error in place of zero."""
    rig, drive = replace(RIG, **load), triangle(1.0, step_mm=0.25).drive_mm
    from_zero = ENGINES[engine](rig, LoadProgram(drive)).angle_deg
    near_zero = ENGINES[engine](rig, LoadProgram(np.concatenate([[first_mm], drive[1:]]))).angle_deg
    assert np.abs(near_zero - from_zero).max() < 0.02
