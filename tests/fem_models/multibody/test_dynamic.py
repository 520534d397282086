"""Drag and inertia: closed forms, an eigenvalue from another model, energy, convergence, and the quasi-static limit."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.optimize import least_squares

from fem_models.joint.flexure import flexure
from fem_models.load import LoadProgram, sine, triangle
from fem_models.multibody.assembly import NITINOL_T_PER_MM3
from fem_models.multibody.dynamic import DynamicSettings, ring_inertia, solve_dynamic
from fem_models.multibody.quasi_static import solve_multibody
from fem_models.multibody.stepper import MultibodySettings
from fem_models.rig import Rig, RigError, preset
from fem_models.rig.checks import SolverError
from fem_models.rig.effects import Closure, Drag, Gravity, Superelastic, TipLoad, TipMass
from fem_models.rig.joints import MeasuredJoint
from fem_models.rig.rig import Friction, with_notch
from hysteresis.records.metrics import loop_width
from studies.commands.cli import call
from validation.engines.checks.dynamics import Delay, compare_dynamic, delay, energy_gap

DU2018 = preset("du2018")
TENDON = replace(DU2018.tendon_a, toe_N=0.0)
SHORT = with_notch(DU2018, replace(DU2018.joint.notch, count=5))
LINEAR = replace(
    SHORT, friction=Friction(), material=replace(DU2018.material, loop_share=0.0), tendon_a=TENDON, tendon_b=TENDON
)


def measured(sheath: float = 0.0, joint: float = 0.0) -> Rig:
    """Four measured joints on linear tendons without friction; the rings weigh next to nothing."""
    tendon = replace(TENDON, EA_N=9000.0)
    known = MeasuredJoint(joints=4, pitch_mm=2.6, flexure_stiffness_Nmm_per_rad=520.0)
    drag, weight = Drag(sheath, joint), Gravity(ring_mass_g=1e-3, direction_deg=0.0)
    return replace(
        LINEAR, joint=known, tendon_a=tendon, tendon_b=tendon, preload_N=30.0, drag=drag,
        gravity=weight,
    )  # fmt: skip


def response(rig: Rig, s: complex) -> complex:
    """Angle at the tip over the drive, rad/mm, of `measured` at exp(s t).

    Tendon a is k_f (x - u) from wheel to base and k_t (u - r theta) beyond, u being its slip at the base; tendon b is
    the same with the other sign. Sheath: k_f (x - u) - k_t (u - r theta) = c s u. Joints, all alike:
    2 r k_t (u - r theta) = (K + d s) theta/N. Both are solved for theta/x.
    """
    assert isinstance(rig.joint, MeasuredJoint)
    assert rig.drag is not None
    n, r, tendon = rig.joints, rig.tendon_a.moment_arm_mm, rig.tendon_a
    k_free, k_tube = tendon.EA_N / tendon.free_length_mm, tendon.EA_N / (n * rig.pitch_mm)
    joints = (rig.joint.flexure_stiffness_Nmm_per_rad + rig.drag.joint_Nmm_s_per_rad * s) / n
    matrix = np.array(
        [
            [k_free + k_tube + rig.drag.sheath_N_s_per_mm * s, -k_tube * r],
            [-2 * r * k_tube, joints + 2 * r**2 * k_tube],
        ]
    )
    return complex(np.linalg.solve(matrix, [k_free, 0.0])[1])


def fundamental(record, rate_Hz: float) -> complex:
    """Angle over drive of the fundamental, last cycle, rad/mm."""
    last = record.cycle == record.cycle.max()
    phase = np.exp(-2j * np.pi * rate_Hz * record.time_s[last])
    return complex(np.radians(record.angle_deg[last]) @ phase / (record.drive[last] @ phase))


def width(record) -> float:
    return float(loop_width(record.drive, record.angle_deg, record.cycle).max_deg)


@pytest.mark.parametrize(("sheath", "joint"), [(1.0, 0.0), (0.0, 20.0), (0.5, 10.0)])
def test_quasi_static_drag_is_the_closed_form_of_a_dashpot(sheath, joint):
    rig, omega = measured(sheath, joint), 2 * np.pi
    still = fundamental(solve_multibody(replace(rig, drag=None), sine(0.5, 1.0)).record, 1.0)
    assert abs(still / response(rig, 0.0) - 1) < 1e-3  # the curvature of the path, which the closed form lacks
    gaps = []
    for samples in (52, 104, 208):
        record = solve_multibody(rig, sine(0.5, 1.0, samples_per_cycle=samples)).record
        got = fundamental(record, 1.0) / still * response(rig, 0.0)
        euler = response(rig, (1 - np.exp(-1j * omega / samples)) * samples)  # what implicit Euler makes of d/dt
        assert abs(got / euler - 1) < 2e-4
        gaps.append(abs(got / response(rig, 1j * omega) - 1))
    np.testing.assert_allclose(np.log2(np.array(gaps[:-1]) / gaps[1:]), 1.0, atol=0.2)  # first order in time
    half = 0.5 * np.degrees(abs(response(rig, 1j * omega).imag))  # of the ellipse, at zero drive
    assert width(record) == pytest.approx(2 * half, rel=0.01)


def test_drag_widens_the_loop_with_the_rate_and_vanishes_with_it():
    dry = replace(SHORT, friction=preset("du2018-full-widths").friction)
    rig = replace(dry, drag=Drag(sheath_N_s_per_mm=0.1, joint_Nmm_s_per_rad=2.0))
    static = width(solve_multibody(dry, sine(0.8, 1.0)).record)
    widths = [width(solve_multibody(rig, sine(0.8, rate)).record) for rate in (1e-3, 0.1, 0.3, 1.0)]
    assert widths[0] == pytest.approx(static, rel=2e-3)
    assert static < widths[1] < widths[2] < widths[3]
    assert widths[3] > 1.2 * static


def test_work_of_the_wheel_is_what_was_lost_with_drag_too():
    rig = replace(SHORT, drag=Drag(sheath_N_s_per_mm=0.1, joint_Nmm_s_per_rad=2.0))
    s = solve_multibody(rig, sine(0.8, 1.0, cycles=2))
    first, end = np.flatnonzero(s.record.cycle == 2)[[0, -1]] - [1, 0]
    energies = (s.wheel_work_mJ, s.friction_loss_mJ, s.material_loss_mJ, s.viscous_loss_mJ)
    work, *losses = (e[end] - e[first] for e in energies)
    assert all(loss > 0.02 * work for loss in losses)
    assert sum(losses) == pytest.approx(work, rel=0.005)


def test_dashpots_relax_while_the_drive_rests():
    rig = measured(sheath=1.0)
    time = np.concatenate([np.linspace(0, 0.1, 11), 0.1 + np.linspace(0.02, 2.0, 40)])
    program = LoadProgram(0.5 * np.minimum(time / 0.1, 1.0), time)
    for record in (solve_multibody(rig, program).record, solve_dynamic(rig, program).record):
        free = 0.5 * np.degrees(response(rig, 0.0).real)
        assert record.angle_deg[10] < 0.9 * free
        assert record.angle_deg[-1] == pytest.approx(free, rel=2e-3)


def test_a_rig_without_drag_loses_nothing_to_it():
    assert not solve_multibody(SHORT, triangle(0.5, step_mm=0.25)).viscous_loss_mJ.any()


def test_dynamic_drag_is_the_closed_form_and_its_delay():
    rig, omega = measured(sheath=0.5, joint=10.0), 2 * np.pi
    record = solve_dynamic(rig, sine(0.5, 1.0), DynamicSettings(max_step_mm=0.02)).record
    expected = response(rig, 1j * omega)
    assert abs(fundamental(record, 1.0) / expected - 1) < 2e-3
    last = record.cycle == 1
    still = np.degrees(response(rig, 0.0).real) * record.drive
    late = delay(record.time_s[last], record.angle_deg[last], still[last])
    assert late.fundamental_s == pytest.approx(-np.angle(expected) / omega, rel=0.01)
    assert late.shift_s == pytest.approx(late.fundamental_s, rel=0.01)


def test_a_known_shift_is_found():
    time = (np.arange(200) + 1) / 200

    def curve(t):
        return 40 * np.sin(2 * np.pi * t) + 2 * np.cos(6 * np.pi * t)

    found = delay(time, curve(time - 0.004), curve(time))
    assert found == Delay(pytest.approx(0.004, rel=1e-4), pytest.approx(0.004, rel=1e-4))


def lowest_frequency_Hz(rig: Rig) -> float:
    """Rigid rings on the joints' bending stiffness, base fixed; the tendons are springs on the rotation of the tip."""
    n, p, inertia, tendon = rig.joints, rig.pitch_mm, ring_inertia(rig), rig.tendon_a
    masses = np.full(n, inertia.mass_t)
    masses[-1] += 1e-6 * rig.tip_mass.mass_g if rig.tip_mass else 0.0
    rotation = np.tril(np.ones((n, n)))  # of ring i by joint j
    lift = rotation * (np.arange(n)[:, None] - np.arange(n) + 0.5) * p  # of its centre, half a pitch past its joint
    mass = lift.T @ np.diag(masses) @ lift + inertia.about_centre_t_mm2 * rotation.T @ rotation
    tendons = 2 * tendon.EA_N / (tendon.free_length_mm + n * p) * tendon.moment_arm_mm**2
    stiffness = flexure(rig).bending_Nmm_per_rad * np.eye(n) + tendons
    return float(np.sqrt(np.linalg.eigvals(np.linalg.solve(mass, stiffness)).real.min()) / (2 * np.pi))


# a tool of fifteen rings, its weight taken off: five times slower
HORIZONTAL = replace(LINEAR, tip_mass=TipMass(3.0), tip_load=TipLoad(3e-6 * 9806.65, 90.0))


@pytest.mark.parametrize("rig", [LINEAR, HORIZONTAL], ids=["rings", "mass at the tip"])
def test_free_vibration_has_the_frequency_of_a_chain_of_rigid_rings(rig):
    period = 1 / lowest_frequency_Hz(rig)
    time = np.arange(0, 7 * period, period / 80)
    pushed = 0.02 * 0.5 * (1 - np.cos(np.pi * np.minimum(1, time / period)))
    solution = solve_dynamic(rig, LoadProgram(pushed, time))
    free = time > 1.2 * period
    angle, t = solution.record.angle_deg[free], time[free] / period

    def misfit(p):
        wave = p[1] * np.cos(2 * np.pi * p[3] * t) + p[2] * np.sin(2 * np.pi * p[3] * t)
        return p[0] + np.exp(-p[4] * t) * wave - angle

    fit = least_squares(misfit, [angle.mean(), 0.5 * np.ptp(angle), 0, 1, 0])
    # 1 % below: the shear of the flexures, which the chain lacks, and the integrator at 80 steps a period
    assert fit.x[3] == pytest.approx(1.0, abs=0.02)
    assert abs(fit.x[4]) < 5e-3  # the integrator's own damping, a period
    assert np.ptp(angle) > 5e-3
    # energy moves back and forth between rings and springs
    assert solution.kinetic_mJ[free].min() < 0.02 * solution.kinetic_mJ[free].max()


def test_a_ring_of_an_uncut_tube_weighs_what_the_tube_does():
    hardly = with_notch(DU2018, replace(DU2018.joint.notch, depth_mm=1e-6))
    tube = np.pi / 4 * (6.2**2 - 5.64**2) * 2.6 * NITINOL_T_PER_MM3
    assert ring_inertia(hardly).mass_t == pytest.approx(tube)
    assert 0.5 * tube < ring_inertia(DU2018).mass_t < tube
    heavy = replace(DU2018, gravity=Gravity(ring_mass_g=2.0))
    assert ring_inertia(heavy).mass_t == pytest.approx(2e-6)
    assert ring_inertia(heavy).about_centre_t_mm2 / 2e-6 == pytest.approx((3.1**2 + 2.82**2) / 4 + 2.6**2 / 12)


def test_slowly_driven_the_dynamic_loop_is_the_static_one():
    program = sine(2.2, 0.02)
    static, moving = solve_multibody(DU2018, program).record, solve_dynamic(DU2018, program).record
    assert width(moving) == pytest.approx(width(static), rel=0.002)
    np.testing.assert_allclose(moving.angle_deg, static.angle_deg, atol=5e-3)
    np.testing.assert_allclose(moving.tension_a_N, static.tension_a_N, atol=0.05)
    np.testing.assert_allclose(moving.tip_mm, static.tip_mm, atol=5e-3)


@pytest.mark.slow
@pytest.mark.parametrize("drag", [None, Drag(sheath_N_s_per_mm=0.05)], ids=["dry", "drag"])
def test_the_paper_s_sine_at_half_the_step(drag):
    result = compare_dynamic(replace(preset("du2018-full-widths"), drag=drag), 1.0, cycles=1)
    assert result.halved_step_percent < 1
    assert result.halved_step_percent < 0.1  # what it is: 2e-3 %
    assert abs(result.energy_gap_percent) < 0.5
    if drag is None:
        # 1 Hz is far below the lowest frequency, 140 Hz: inertia makes a hundredth of a degree
        assert result.width_dynamic_deg == pytest.approx(result.width_static_deg, rel=0.01)
        assert abs(result.delay.shift_s) < 5e-5
    else:
        assert result.width_dynamic_deg > 1.2 * result.width_static_deg
        assert result.delay.shift_s > 5e-4


def test_the_integration_is_of_second_order_where_nothing_slips():
    rig, program = replace(LINEAR, drag=Drag(0.2, 0.2)), sine(0.8, 1.0, samples_per_cycle=16)
    first_mm = 0.8 * np.sin(2 * np.pi / 16) * 1.001  # how far the drive goes in a sample, where it is fastest
    runs = [solve_dynamic(rig, program, DynamicSettings(max_step_mm=first_mm / k)) for k in (4, 8, 16, 64)]
    assert [round(1 / (16 * run.step_s)) for run in runs] == [4, 8, 16, 64]
    angles = [run.record.angle_deg[5:] for run in runs]
    gaps = [np.sqrt(((angle - angles[-1]) ** 2).mean()) for angle in angles[:-1]]
    orders = np.log2(np.array(gaps[:-1]) / gaps[1:])
    np.testing.assert_allclose(orders, 2.0, atol=0.25)


def test_friction_of_the_present_tensions_needs_no_small_step():
    # capstan friction follows the tensions within a step; a lag of one step would cost 1 % of the width here
    rig = replace(SHORT, friction=Friction(capstan_coefficient=0.3, rest_wrap_deg=60.0))
    program = sine(0.8, 0.05)
    exact = width(solve_multibody(rig, program, MultibodySettings(max_step_mm=0.01)).record)
    assert width(solve_dynamic(rig, program).record) == pytest.approx(exact, rel=2e-3)


def test_energy_of_a_fast_run_with_friction_and_drag():
    rig = replace(SHORT, drag=Drag(sheath_N_s_per_mm=0.1, joint_Nmm_s_per_rad=2.0))
    run = solve_dynamic(rig, sine(0.8, 3.0, cycles=2))
    assert abs(energy_gap(run, 2)) < 0.01
    assert (run.kinetic_mJ >= 0).all()
    assert run.kinetic_mJ.max() > 0
    assert run.viscous_loss_mJ[-1] > run.material_loss_mJ[-1] > 0


def test_a_tendon_that_falls_slack_becomes_taut_again():
    # closed notches stop the joints, the released tendon falls slack: nothing then determines its slip
    rig = replace(LINEAR, closure=Closure(20_000.0, angle_deg=2.0))
    program = sine(1.2, 1.0)
    static, moving = solve_multibody(rig, program), solve_dynamic(rig, program)
    assert static.record.tension_b_N.min() < 0.01
    np.testing.assert_allclose(moving.record.angle_deg, static.record.angle_deg, atol=0.02)


def test_what_a_dynamic_run_needs_is_in_the_message():
    with pytest.raises(RigError, match="expected a load program with time_s for a dynamic run"):
        solve_dynamic(DU2018, triangle(1.0))
    with pytest.raises(RigError, match=r"measured joints: expected gravity\.ring_mass_g above 0"):
        solve_dynamic(replace(measured(), gravity=None), sine(0.5, 1.0))
    tight = DynamicSettings(newton_iterations=1, max_halvings=0)
    with pytest.raises(SolverError, match=r"rig du2018, sample \d+ of 126: no step in time from drive .* mm at .* s"):
        solve_dynamic(SHORT, sine(0.8, 1.0), tight)


@pytest.mark.parametrize(
    ("options", "complaint"),
    [
        ((), "--dynamic without times: expected --rate, or a --program with time_s"),
        (("--rate", "1", "--engine", "chain"), "--dynamic with --engine chain: expected --engine multibody"),
    ],
)
def test_a_dynamic_run_that_cannot_be_is_one_line_and_2(options, complaint, tmp_path, capsys):
    command = ["simulate", "--preset", "du2018", "--amplitude", "1", "--dynamic", *options]
    assert call([*command, "--out", str(tmp_path / "loop.csv")]) == 2
    error = capsys.readouterr().err
    assert complaint in error
    assert error.count("\n") == 1
    assert not list(tmp_path.iterdir())


def test_simulate_in_time_from_the_command_line(tmp_path, capsys):
    command = ["simulate", "--preset", "du2018", "--amplitude", "0.4", "--rate", "1", "--dynamic"]
    assert call([*command, "--out", str(tmp_path / "loop.csv")]) == 0
    printed = capsys.readouterr().out
    assert "dynamic multibody" in printed
    assert "quasi-static" not in printed


def test_joints_heat_themselves_in_time_as_they_do_quasi_statically():
    law = Superelastic(430.0, 300.0, heating_time_s=1e4)  # keeps its heat
    heated, slow = (
        replace(SHORT, friction=Friction(), superelastic=one) for one in (law, replace(law, heating_time_s=None))
    )
    program = sine(1.4, 0.5, cycles=1, samples_per_cycle=80)
    moving, still, cold = (
        solve_dynamic(heated, program),
        solve_multibody(heated, program),
        solve_multibody(slow, program),
    )
    assert np.ptp(still.warming_K) > 3.0
    off, by_heat = (np.abs(run.record.angle_deg - still.record.angle_deg).max() for run in (moving, cold))
    assert off < 0.1 * by_heat
    off, by_heat = (abs(run.material_loss_mJ[-1] / still.material_loss_mJ[-1] - 1) for run in (moving, cold))
    assert off < 0.3 * by_heat
