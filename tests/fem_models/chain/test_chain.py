"""The chain: cases that other codes fail at, agreement with the multibody model, random rigs."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.optimize import brentq

from fem_models.chain.solve import ChainSettings, simulate_chain, solve_batch, solve_chain
from fem_models.joint import joint_mechanics
from fem_models.joint.flexure import beam, flexure
from fem_models.joint.strain import strain_per_rad
from fem_models.load import LoadProgram, triangle
from fem_models.multibody.quasi_static import simulate_multibody, solve_multibody
from fem_models.rig import Rig, RigError, preset
from fem_models.rig.checks import SolverError
from fem_models.rig.effects import Backlash, Closure, Creep, Drag, Gravity, Slack, Superelastic, TipStop
from fem_models.rig.joints import MeasuredJoint, Notch, NotchedTube, Tube
from fem_models.rig.rig import Friction, Material, Tendon, Wheel, with_notch
from hysteresis.records.metrics import loop_width
from validation.engines.checks.chain_multibody import EFFECTS, compare_chain, comparison_program, comparison_rigs

SHORT = triangle(2.2, step_mm=0.1)


def no_toe(rig: Rig) -> Rig:
    tendon = replace(rig.tendon_a, toe_N=0.0)
    return replace(rig, tendon_a=tendon, tendon_b=tendon)


@pytest.mark.parametrize("preload", [10.0, 20.0])
@pytest.mark.parametrize("name", comparison_rigs(20.0))
def test_chain_agrees_with_the_multibody_model(name, preload):
    agreement = compare_chain(name, comparison_rigs(preload)[name], comparison_program(cycles=1))
    assert agreement.max_difference_deg <= 0.1
    share = agreement.width_difference_percent
    assert share is None or abs(share) <= 3


@pytest.mark.parametrize("name", EFFECTS)
def test_each_effect_shows(name):
    # otherwise the agreement above would mean nothing
    plain, steps = preset("du2018"), comparison_program()
    rig = replace(plain, **EFFECTS[name])
    difference = np.abs(simulate_chain(rig, steps).angle_deg - simulate_chain(plain, steps).angle_deg)
    assert difference.max() > 0.15


def test_the_tip_does_not_creep_below_the_friction_limit():
    # a load change below the friction limit, then none
    rig = replace(preset("du2018"), friction=Friction(sheath_N=3.0))
    drive = np.concatenate([np.linspace(0, 1, 11), [0.999], np.full(10_000, 0.999)])
    record = simulate_chain(rig, LoadProgram(drive))
    assert abs(record.angle_deg[11] - record.angle_deg[10]) < 0.02  # 1e-3 mm of elastic unloading, 20 deg/mm at most
    assert np.ptp(record.angle_deg[11:]) < 1e-9


def test_capstan_on_both_branches():
    rig = replace(no_toe(preset("du2018")), friction=Friction(capstan_coefficient=0.2, rest_wrap_deg=20.0))
    solution = solve_chain(rig, triangle(2.2, step_mm=0.1))
    for sample in (22, 44, 88):  # end of the first branch, then at zero drive and beyond it
        angles = np.abs(np.radians(solution.record.notches_deg[sample]))
        wrap = 0.5 * (angles + np.concatenate([[2 * np.radians(20.0)], angles[:-1]]))
        a, b = solution.segment_tensions_N[sample]
        pulled, released = (a, b) if sample != 44 else (b, a)  # the drive falls at sample 44
        np.testing.assert_allclose(pulled[:-1] / pulled[1:], np.exp(0.2 * wrap), rtol=1e-6)
        np.testing.assert_allclose(released[1:] / released[:-1], np.exp(0.2 * wrap), rtol=1e-6)


def test_minor_loops_close():
    outer = np.linspace(0, 1, 11)
    minor = np.concatenate([np.linspace(1, 0.6, 9)[1:], np.linspace(0.6, 1, 9)[1:]])
    steps = LoadProgram(np.concatenate([outer, minor, minor, minor, minor, minor]))
    rig = preset("du2018-full-widths")
    alone = replace(rig, friction=Friction(sheath_N=rig.friction.sheath_N))
    assert np.ptp(simulate_chain(alone, steps).angle_deg[10::16]) < 1e-6
    # With 14 more dry guides the first passes shake down how they share the friction: 1.1e-4 deg, then 4e-6, 4e-7 and
    # less. It is the same with bristles five times as stiff, and a tenth more at a hundredth of the step.
    moved = np.abs(np.diff(simulate_chain(rig, steps).angle_deg[10::16]))
    assert moved[0] < 1.5e-4
    assert moved[1] < 1e-5
    assert moved[-1] < 1e-6


def test_energy_balance_to_a_millionth():
    for preload in (10.0, 20.0):
        steps = triangle(2.2, step_mm=0.001)
        s = solve_chain(preset("du2018", preload_N=preload), steps, ChainSettings(max_step_mm=0.001))
        start = np.flatnonzero(steps.cycle == 1)[0] - 1
        loss = s.friction_loss_mJ + s.material_loss_mJ
        work = s.wheel_work_mJ[-1] - s.wheel_work_mJ[start]
        assert loss[-1] - loss[start] == pytest.approx(work, rel=1e-6)


def test_energy_gap_closes_at_better_than_first_order():
    gaps = []
    for step in (0.1, 0.02, 0.004):
        s = solve_chain(preset("du2018"), triangle(2.2, step_mm=step), ChainSettings(max_step_mm=step))
        start = np.flatnonzero(s.record.cycle == 1)[0] - 1
        loss, work = s.friction_loss_mJ + s.material_loss_mJ, s.wheel_work_mJ
        gaps.append(abs((loss[-1] - loss[start]) / (work[-1] - work[start]) - 1))
    assert np.log(gaps[0] / gaps[2]) / np.log(25) > 1.2


def test_drag_is_friction_in_proportion_to_speed():
    # At a steady drive c v acts on a tendon that passes the base at the speed v, as dry friction of that size would.
    # The tendon between wheel and base takes up part of the drive: by hand M/(2 r) over EA/L, M being c_theta angle/N.
    rig = replace(no_toe(preset("du2018")), friction=Friction(), material=Material(60.0, 0.33))
    steps, drag = triangle(2.2, step_mm=0.05), Drag(sheath_N_s_per_mm=2.0)

    def width(rig: Rig, steps: LoadProgram) -> float:
        record = simulate_chain(rig, steps)
        return loop_width(record.drive, record.angle_deg, record.cycle).max_deg

    full = np.radians(simulate_chain(rig, steps).angle_deg.max())
    tendon = rig.tendon_a
    pull = flexure(rig).bending_Nmm_per_rad * full / rig.joints / (2 * tendon.moment_arm_mm)
    passes = 1 - pull * tendon.free_length_mm / tendon.EA_N / 2.2
    dry = width(replace(rig, friction=Friction(sheath_N=1.0)), steps)  # 2 N s/mm at 0.5 mm/s
    for seconds in (0.02, 0.1, 1.0):  # a sample of 0.05 mm: 0.1 s are 0.5 mm/s
        timed = replace(steps, time_s=seconds * np.arange(steps.drive_mm.size))
        assert width(replace(rig, drag=drag), timed) == pytest.approx(passes * dry * 0.1 / seconds, rel=0.01)


def test_drag_needs_times():
    with pytest.raises(RigError, match="drag: expected a load program with time_s"):
        simulate_chain(replace(preset("du2018"), drag=Drag(1.0)), SHORT)


def test_energy_with_drag():
    steps = triangle(2.2, step_mm=0.0025)
    steps = replace(steps, time_s=0.025 * np.arange(steps.drive_mm.size))
    rig = replace(preset("du2018"), drag=Drag(sheath_N_s_per_mm=5.0, joint_Nmm_s_per_rad=200.0))
    s = solve_chain(rig, steps, ChainSettings(max_step_mm=0.0025))
    start = np.flatnonzero(steps.cycle == 1)[0] - 1
    loss = s.friction_loss_mJ + s.material_loss_mJ + s.viscous_loss_mJ
    assert s.viscous_loss_mJ[-1] > 0.1 * loss[-1]
    work = s.wheel_work_mJ[-1] - s.wheel_work_mJ[start]
    assert loss[-1] - loss[start] == pytest.approx(work, rel=1e-6)


@pytest.mark.parametrize(
    ("drag", "drive", "time"),
    [
        (Drag(1.0, 20.0), [0, 0.2, 0.5, 0.5, 0.5, 0.3, 0.3, -0.3, -0.3], [0, 0.1, 0.2, 0.3, 1, 1.1, 5, 5.05, 6]),
        (Drag(1.0, 20.0), [0.5, 0.5, 0.5, 0.3, 0.3], [3, 3.1, 3.2, 3.3, 4]),
        (Drag(5.0, 200.0), [0, 0.5, -0.5, 0.5, 0.5], [0, 0.01, 0.02, 0.03, 0.5]),
    ],
)
def test_drag_relaxes_in_a_dwell(drag, drive, time):
    # tendon that drag has kept back comes free while the drive rests; a start off zero is a step over no time
    plain = with_notch(preset("du2018"), replace(preset("du2018").joint.notch, count=4))
    steps = LoadProgram(np.array(drive, dtype=float), time_s=np.array(time, dtype=float))
    rig = replace(plain, drag=drag)
    chain, multibody = solve_chain(rig, steps), solve_multibody(rig, steps)
    assert np.abs(chain.record.angle_deg - multibody.record.angle_deg).max() < 0.02
    assert chain.viscous_loss_mJ[-1] == pytest.approx(multibody.viscous_loss_mJ[-1], rel=2e-3)


def test_slack_tendon_does_not_push():
    rig = replace(no_toe(preset("du2018")), slack=Slack(0.5, 0.5))
    steps = triangle(2.2, step_mm=0.2)
    chain, multibody = simulate_chain(rig, steps).angle_deg, simulate_multibody(rig, steps).angle_deg
    assert np.abs(chain - multibody).max() < 0.1


@pytest.mark.slow
def test_200_random_rigs_with_effects_converge():
    rng = np.random.default_rng(8)
    for _ in range(200):
        rig, steps = random_rig(rng)
        steps = replace(steps, time_s=rng.uniform(0.01, 1) * np.arange(steps.drive_mm.size))
        tables = {
            "slack": Slack(*rng.uniform(-0.05, 0.2, 2)),
            "backlash": Backlash(rng.uniform(0, 0.2)),
            "gravity": Gravity(rng.uniform(0, 1), rng.uniform(-180, 180)),
            "superelastic": Superelastic(rng.uniform(300, 600), rng.uniform(50, 250)),
            "tip_stop": TipStop(rng.uniform(0.2, 1) * rig.joints * rig.pitch_mm, rng.uniform(0.1, 2)),
            "drag": Drag(rng.uniform(0, 2), rng.uniform(0, 50)),
            "creep": Creep(rng.uniform(0, 0.5), rng.uniform(1, 30)),
        }
        on = {name: table for name, table in tables.items() if rng.random() < 0.4}
        assert np.isfinite(simulate_chain(replace(rig, **on), steps).angle_deg).all()


def test_rate_independence():
    rig = preset("du2018")
    coarse, fine = triangle(2.0, step_mm=0.5), triangle(2.0, step_mm=0.1)
    timed = LoadProgram(fine.drive_mm, time_s=np.linspace(0, 1e-3, fine.drive_mm.size))
    angle = simulate_chain(rig, fine).angle_deg
    np.testing.assert_array_equal(simulate_chain(rig, timed).angle_deg, angle)
    np.testing.assert_allclose(simulate_chain(rig, coarse).angle_deg, angle[::5], atol=1e-6)


def test_default_calibration():
    # the paper's widths, section 3.1, read as half widths: docs/validation/readings.md
    for preload, width in ((10.0, 7.04), (20.0, 4.42)):
        record = simulate_chain(preset("du2018", preload_N=preload), SHORT)
        assert loop_width(record.drive, record.angle_deg, record.cycle).max_deg == pytest.approx(width, abs=0.1)


def test_measured_joints_with_rigid_gap_and_roots_bend_as_the_tube_that_they_are_measured_of():
    tube = preset("du2018-full-widths")
    joint = flexure(tube)
    roots = 1 - joint.bending_Nmm_per_rad / beam(tube).bending_Nmm_per_rad
    measured = MeasuredJoint(14, tube.pitch_mm, joint.bending_Nmm_per_rad, joint_mechanics(tube).rigid_gap_mm, roots)
    bare = replace(tube, joint=measured)
    hinged, rootless = (replace(bare, joint=replace(measured, **{k: 0.0})) for k in ("rigid_gap_mm", "roots_share"))

    def largest(one, other, engine, steps):
        return np.abs(engine(one, steps).angle_deg - engine(other, steps).angle_deg).max()

    for engine in (simulate_chain, simulate_multibody):
        assert largest(tube, bare, engine, triangle(1.6, step_mm=0.4)) < 1e-3
        assert largest(tube, hinged, engine, triangle(1.6, step_mm=0.4)) > 0.02  # both paths are shortened by a bend

    # a strip has strains of its own: stresses as much larger as it is strained more. It has no thrust, which at 5 N is
    # worth 0.05 deg, at 20 N 0.14 deg
    tube, bare, rootless = (replace(one, preload_N=5.0) for one in (tube, bare, rootless))
    by = strain_per_rad(bare) / strain_per_rad(tube)
    law = Superelastic(180.0, 90.0, 0.04, 1.0)
    strip = Superelastic(by * 180.0, by * 90.0, by * 0.04, 1.0)
    flagged, same, elastic = (
        replace(tube, superelastic=law), replace(bare, superelastic=strip), replace(rootless, superelastic=strip)
    )  # fmt: skip
    steps = triangle(1.6, step_mm=0.1)
    assert largest(flagged, same, simulate_chain, steps) < 0.06
    assert largest(flagged, elastic, simulate_chain, steps) > 0.5


def test_flag_law_against_beam_theory():
    # Below the plateau nothing changes; beyond it the joint is softer, and comes back to rest without an angle.
    rig = replace(no_toe(preset("du2018")), friction=Friction(), material=Material(60.0, 0.33))
    flagged = replace(rig, superelastic=Superelastic(plateau_MPa=450.0, unloading_plateau_MPa=200.0))
    small = LoadProgram(np.linspace(0, 0.5, 6))
    # the chain puts the ring in series with the spring, not with the flags: 5e-4 of a joint's compliance
    np.testing.assert_allclose(
        simulate_chain(flagged, small).angle_deg, simulate_chain(rig, small).angle_deg, rtol=1e-4
    )
    there_and_back = LoadProgram(np.concatenate([np.linspace(0, 2.2, 23), np.linspace(2.2, 0, 23)[1:]]))
    assert simulate_chain(flagged, there_and_back).angle_deg[22] > simulate_chain(rig, there_and_back).angle_deg[22]
    assert abs(simulate_chain(flagged, there_and_back).angle_deg[-1]) < 1e-6


def test_weight_bends_a_cantilever():
    # At rest the sag of the unbent chain: each joint carries the moment of the rings beyond it (hand sum).
    rig = replace(no_toe(preset("du2018", preload_N=1e-3)), friction=Friction(), material=Material(60.0, 0.33))
    tendon = replace(rig.tendon_a, EA_N=1.0, free_length_mm=1e6)  # tendons too soft to hold it
    rig = replace(rig, tendon_a=tendon, tendon_b=tendon, gravity=Gravity(ring_mass_g=0.05))
    record = simulate_chain(rig, LoadProgram(np.array([0.0, 1e-9])))
    weight, n, pitch = 0.05e-3 * 9.80665, 14, rig.pitch_mm
    moments = [weight * sum(pitch * (j - i + 0.5) for j in range(i, n)) for i in range(n)]
    stiffness = 377.0  # of a joint, test_snr and the report
    assert record.angle_deg[0] == pytest.approx(-np.degrees(sum(moments) / stiffness), rel=0.01)


def test_a_notch_may_not_close_unannounced():
    rig = with_notch(preset("du2018"), Notch("v_pair", 14, 2.86, 0.5, 2.1, 0.3))
    with pytest.raises(SolverError, match=r"sample \d+ of 111: joint \d+ at .* deg, but its notch closes at 9.2 deg"):
        simulate_chain(rig, triangle(6.6, step_mm=0.3))
    closed = replace(rig, closure=Closure(stiffness_Nmm_per_rad=5e4))
    assert np.abs(simulate_chain(closed, triangle(6.6, step_mm=0.3)).notches_deg).max() < 12


def test_creep_needs_times():
    rig = replace(preset("du2018"), creep=Creep(fraction=0.5, time_s=10.0))
    with pytest.raises(RigError, match="creep: expected a load program with time_s"):
        simulate_chain(rig, SHORT)


def random_rig(rng: np.random.Generator) -> tuple[Rig, LoadProgram]:
    """A rig in plausible ranges, with a drive that bends it by up to about 60 deg."""
    outer = rng.uniform(1.5, 8.0)
    wall, count = rng.uniform(0.04, 0.12) * outer, int(rng.integers(3, 30))
    depth = rng.uniform(0.75, 0.93) * outer / 2
    width = rng.uniform(0.1, 0.3) * outer
    shape = ("v_pair", "rectangular_pair")[int(rng.integers(2))]
    root = rng.uniform(0.3, 0.7) * width if shape == "v_pair" else None
    arm = (outer - wall) / 2

    def tendon() -> Tendon:
        return Tendon(10 ** rng.uniform(3, 4.7), arm, rng.uniform(50, 800), rng.choice([0.0, rng.uniform(1, 60)]))

    rig = Rig(
        name="random",
        joint=NotchedTube(
            Tube(outer, outer - 2 * wall), Notch(shape, count, depth, width, rng.uniform(0.1, 0.5) * outer, root)
        ),
        material=Material(rng.uniform(30, 80), 0.33, rng.choice([0.0, rng.uniform(0.05, 0.5)]), rng.uniform(0.5, 4)),
        tendon_a=tendon(),
        tendon_b=tendon(),
        wheel=Wheel(rng.uniform(4, 20)),
        preload_N=10 ** rng.uniform(0, 1.6),
        friction=Friction(rng.uniform(0, 0.3), rng.uniform(0, 0.1), rng.uniform(0, 3), rng.uniform(0, 180)),
        closure=Closure(10 ** rng.uniform(2, 4)),
    )
    most = 0.3 * count * 2 * np.arctan(width / outer)
    return rig, triangle(arm * min(np.radians(60), most), step_mm=arm * min(np.radians(60), most) / 11)


def test_500_random_rigs_converge():
    rng = np.random.default_rng(3)
    for _ in range(500):
        rig, steps = random_rig(rng)
        assert np.isfinite(simulate_chain(rig, steps).angle_deg).all()


@pytest.mark.slow
def test_20_of_them_converge_in_the_multibody_model_and_agree():
    rng = np.random.default_rng(3)
    for rig, steps in [random_rig(rng) for _ in range(500)][::25]:
        chain, multibody = simulate_chain(rig, steps).angle_deg, simulate_multibody(rig, steps).angle_deg
        # 1 %: closed notches press on rings that bend, and slack tendon pushes a little, in the multibody model alone
        assert np.abs(chain - multibody).max() <= 0.01 * np.abs(multibody).max() + 0.05


def test_batch_is_the_same_rig_by_rig_whatever_the_threads():
    rigs = [preset("du2018", preload_N=p) for p in (5.0, 10.0, 20.0, 40.0)]
    rigs.insert(2, replace(preset("du2018"), creep=Creep(0.5, 10.0)))  # cannot run without times
    batches = [solve_batch(rigs, SHORT, threads=t) for t in (1, 3)]
    np.testing.assert_array_equal(batches[0].angle_deg, batches[1].angle_deg)
    np.testing.assert_array_equal(batches[0].angle_deg[0], simulate_chain(rigs[0], SHORT).angle_deg)
    assert "creep" in batches[0].messages[2]
    assert np.isnan(batches[0].angle_deg[2]).all()
    assert np.isfinite(batches[0].angle_deg[[0, 1, 3, 4]]).all()


@pytest.mark.parametrize("preload", [2.0, 5.0, 6.0])
def test_a_tendon_that_hardly_stretches_goes_slack_and_the_other_bends_alone(preload):
    """Bending shortens both tendons, so that one that cannot stretch loses its preload; then, with n equal joints, the
    other alone has T arm(theta) = k theta, and its way in is its path, what the joints are less compressed by, and what
    it stretches: drive = n path(theta) + n (T - 2 T0) / k_axial + (T - T0) L / EA."""
    rig = preset("du2018", preload_N=preload)
    tendon = replace(rig.tendon_a, EA_N=5e7, toe_N=0.0)
    linear = replace(rig.material, loop_share=0.0)
    rig = replace(rig, tendon_a=tendon, tendon_b=tendon, friction=Friction(), material=linear)
    drive = 2.2
    solution = solve_chain(rig, triangle(drive, cycles=1))
    assert solution.segment_tensions_N[:, 1].min() == 0
    joint, arm = flexure(rig), joint_mechanics(rig).arms_mm.a
    half_gap = 0.5 * (rig.joint.notch.width_mm - joint_mechanics(rig).turning_length_mm)

    def tension(theta: float) -> float:
        slope = half_gap * np.sin(theta / 2) + arm * np.cos(theta / 2)
        return theta / (1 / joint.bending_Nmm_per_rad + 1 / joint_mechanics(rig).ring.bending_Nmm_per_rad) / slope

    def left(theta: float) -> float:
        path = 2 * (half_gap * (1 - np.cos(theta / 2)) + arm * np.sin(theta / 2))
        stretch = (tension(theta) - preload) * (tendon.free_length_mm + rig.joints * rig.pitch_mm) / tendon.EA_N
        longer = (tension(theta) - 2 * preload) / joint.axial_N_per_mm
        return drive - rig.joints * (path + longer) - stretch

    theta = brentq(left, 0.01, 0.2)
    k = int(np.argmax(solution.record.drive))
    assert solution.record.angle_deg[k] == pytest.approx(rig.joints * np.degrees(theta), rel=1e-8)
    assert solution.segment_tensions_N[k, 0] == pytest.approx(tension(theta), rel=1e-6)
