"""Chains of notches that differ: closed forms, the multibody model, equal notches by the same path, energy, traces."""

from dataclasses import replace

import numpy as np
import pytest

from fem_models.analytic import simulate_analytic
from fem_models.analytic.kinematics import equal_joints, theory_curve
from fem_models.analytic.unequal_joints import bend_at_drive
from fem_models.chain.along import line_along, moved_along, moved_run, moved_series, taped_run
from fem_models.chain.each import each_joint
from fem_models.chain.equations import BY_DEPTH, external_moments, work_space
from fem_models.chain.follow import follow, tape_of
from fem_models.chain.parameters import Memory, memory_at_rest
from fem_models.chain.solve import chain_case, followed, run_space, solve_chain, solve_chain_by_force
from fem_models.joint import joint_mechanics, joint_row
from fem_models.joint.contact import ring_weight_N, tip_force_N
from fem_models.load import LoadProgram, triangle
from fem_models.load.stepping import at_rest
from fem_models.multibody.quasi_static import solve_multibody, solve_multibody_by_force
from fem_models.rig import Rig, RigError, preset
from fem_models.rig.checks import SolverError
from fem_models.rig.effects import Closure, Gravity, Superelastic, TipLoad, TipStop
from fem_models.rig.joints import Notch, NotchedTube, Tube
from fem_models.rig.rig import Friction, notched_tube, with_joint, with_notch

DU2018 = preset("du2018", preload_N=20.0)
WRIST = preset("notched-wrist-90")
DEPTHS = (1.36, 1.39, 1.42, 1.45)
PULL = np.concatenate([np.linspace(0.0, 1.2, 13), np.linspace(1.1, 0.0, 12)])


def tip_first(rig: Rig = WRIST) -> Rig:
    """The measured wrist's tube with four notches, each deeper than the one before it."""
    return with_notch(rig, replace(notched_tube(rig).notch, count=4, depth_mm=DEPTHS))


def graded(rig: Rig = DU2018, depth: float = 0.04) -> Rig:
    """A V-pair row whose depths, widths, spacings and roots all vary."""
    notch = notched_tube(rig).notch
    part = np.linspace(-1.0, 1.0, notch.count)
    return with_notch(
        rig,
        replace(
            notch,
            depth_mm=tuple(notched_tube(rig).cut.depth_mm + depth * part),
            width_mm=tuple(notched_tube(rig).cut.width_mm - 0.1 * part),
            spacing_mm=tuple(notched_tube(rig).cut.spacing_mm + 0.2 * part**2),
            root_width_mm=tuple(0.8 + 0.1 * part),
        ),
    )


def smooth(rig: Rig) -> Rig:
    """Without friction and without material loop."""
    return replace(rig, friction=Friction(), material=replace(rig.material, loop_share=0.0))


LAWS = {
    "elastic": {},
    "superelastic": {"superelastic": Superelastic()},
    "not alike": {"superelastic": Superelastic(compression_factor=1.3)},
    "loads": {"gravity": Gravity(0.3, 40.0), "tip_load": TipLoad(0.05, 90.0), "tip_stop": TipStop(8.0, 10.0)},
    "closes": {"closure": Closure(1e3, 2.5)},
}
STEPPED = {"gravity": Gravity(20.0, 40.0), "tip_load": TipLoad(0.3, 160.0), "tip_stop": TipStop(1.0, 2.0)}
"""Loads on a wrist whose neutral axes step."""


EACH_LAW = pytest.mark.parametrize(
    "law",
    [
        pytest.param(law, marks=pytest.mark.slow) if name == "not alike" else law for name, law in LAWS.items()
    ],  # compiles
    ids=LAWS,
)


@EACH_LAW
def test_equal_joints_by_the_path_of_those_that_differ(law):
    """The same numbers given joint by joint; superelastic steps end at 1e-10 of the preload, not at rounding."""
    rig = replace(DU2018, **law)
    case, joints = chain_case(rig, triangle(2.2)), joint_row(rig)
    run, _ = followed(rig, case)
    memory = memory_at_rest(rig, joints)
    if joints.first.section:
        n = rig.joints
        many = {name: np.repeat(getattr(memory, name), n, axis=0) for name in ("fibre_height", "fibre_area")}
        memory = Memory(**memory._asdict() | many)
    same = run_space(case, rig.joints)
    each = case.parameters._replace(each=each_joint(rig, joints))
    failed, _ = follow(case.path, each, memory, same, tape_of(0, rig.joints))
    assert failed.sample == -1
    atol = 1e-12 if rig.superelastic is None else 1e-10
    np.testing.assert_allclose(same.angles, run.angles, rtol=0, atol=atol)
    np.testing.assert_allclose(same.tensions, run.tensions, rtol=1e-12, atol=1e-10)
    np.testing.assert_allclose(same.energies, run.energies, rtol=1e-9, atol=1e-10)


def test_a_list_of_equal_numbers_is_the_scalar_rig():
    notch = notched_tube(DU2018).notch
    listed = with_notch(DU2018, replace(notch, depth_mm=(notched_tube(DU2018).cut.depth_mm,) * notch.count))
    one, other = solve_chain(DU2018, triangle(1.0)), solve_chain(listed, triangle(1.0))
    np.testing.assert_array_equal(one.record.notches_deg, other.record.notches_deg)


def test_small_bending_is_that_of_joints_in_series():
    """Closed form: without friction all joints see one tension T, so joint i turns by T arm_i / k_i.

    The tip then turns by the sum. k is of the joint with its ring in series, as the chain has it; the tension is small,
    and the chord of a notch makes the lever grow by half its angle times half the gap over the arm: 1 % here.
    """
    rig = smooth(tip_first())
    rig = replace(rig, superelastic=None, closure=None, precurvature_deg=0.0)
    force = np.array([0.0, 1e-3])
    found = np.radians(solve_chain_by_force(rig, force).record.notches_deg[-1])
    expected = []
    for number in range(4):
        joint = joint_mechanics(with_joint(rig, number))
        stiffness = 1 / (1 / joint.flexure.bending_Nmm_per_rad + 1 / joint.ring.bending_Nmm_per_rad)
        expected.append(1e-3 * (rig.tendon_a.moment_arm_mm + joint.flexure.neutral_offset_mm) / stiffness)
    np.testing.assert_allclose(found, expected, rtol=1e-3)
    assert found.sum() == pytest.approx(sum(expected), rel=1e-3)
    assert (np.diff(found) > 0).all()


def test_deeper_notches_bend_more_and_tip_first():
    record = solve_chain_by_force(tip_first(), PULL).record
    bent = record.notches_deg[1:13] - record.notches_deg[0]
    open_yet = bent.max(axis=1) < 14.0  # a closed notch waits for the others
    assert open_yet.sum() > 5
    assert (np.diff(bent[open_yet], axis=1) > 0).all()  # at every force on the way out
    at_half = [int(np.argmax(bent[:, k] > 3.0)) for k in range(4)]
    assert at_half == sorted(at_half, reverse=True)  # the tip passes 3 deg first
    shallow_last = replace(notched_tube(tip_first()).notch, depth_mm=DEPTHS[::-1])
    turned = solve_chain_by_force(with_notch(tip_first(), shallow_last), PULL).record
    assert turned.notches_deg[12, 0] > turned.notches_deg[12, -1]


def test_dead_loads_and_stop_act_over_the_steps_of_the_neutral_axis():
    """Moments, their slopes and the tip's levers against differences of a potential: points placed in the plane.

    Joints are points at their neutral axes, in the straight tube at (middle, -offset). Ring and tip are at the level of
    the joint before them.
    """
    rig = replace(
        tip_first(), gravity=Gravity(30.0, 40.0), tip_load=TipLoad(0.3, 160.0), tip_stop=TipStop(0.1, 2.0),
        superelastic=None,
    )  # fmt: skip
    row = joint_row(rig)
    (middles, centres), offset = map(np.array, row.places), row.of("flexure.neutral_offset_mm")
    assert np.ptp(offset) > 0.02
    weight, tip = np.array(ring_weight_N(rig)), np.array(tip_force_N(rig))

    def place(heading):
        along, across = np.exp(1j * heading), 1j * np.exp(1j * heading)
        steps = (np.diff(middles) * along[:-1] - np.diff(offset) * across[:-1]).cumsum()
        joints = middles[0] - 1j * offset[0] + np.append(0.0, steps)
        return joints + (centres - middles) * along

    def potential(heading, loads=(1.0, 1.0, 1.0)):
        rings = place(heading)
        depth = rings[-1].imag + offset[-1] - rig.tip_stop.y_mm  # the straight tip is at no height
        of_weight = -(weight * [rings.real.sum(), rings.imag.sum()]).sum()
        of_tip = -(tip * [rings[-1].real, rings[-1].imag]).sum()
        return np.dot(loads, [of_weight, of_tip, 0.5 * rig.tip_stop.stiffness_N_per_mm * depth**2])

    theta = np.array([0.05, 0.1, 0.07, 0.12])
    case, n, step = chain_case(rig, LoadProgram(np.array([0.0, 0.1]))), 4, 1e-4
    work, heading = work_space(case.parameters, n), np.cumsum(theta)
    x = np.zeros(3 * n + 3)
    x[3::3] = theta
    load = at_rest(0.0)._replace(dead=1.0)
    assert external_moments(x, case.parameters, load, work, BY_DEPTH) == rig.tip_stop.stiffness_N_per_mm
    unit = step * np.eye(n)
    slope = [(potential(heading + u) - potential(heading - u)) / (2 * step) for u in unit]
    moments = -np.cumsum(slope[::-1])[::-1]  # on a joint act all headings beyond it
    np.testing.assert_allclose(work.external, moments, rtol=1e-6)
    lever = [(place(heading + u) - place(heading - u))[-1].imag / (2 * step) for u in unit]
    np.testing.assert_allclose(work.lever[3::3], lever, rtol=1e-6)
    curved = [(potential(heading + u) - 2 * potential(heading) + potential(heading - u)) / step**2 for u in unit]
    stiff = np.array(curved) - rig.tip_stop.stiffness_N_per_mm * work.lever[3::3] ** 2  # which the kernel adds apart
    np.testing.assert_allclose(work.restoring, stiff, rtol=1e-4)


@pytest.mark.parametrize("law", ["elastic", "superelastic"])
def test_twins_on_a_tip_first_wrist(law):
    rig = tip_first() if law == "superelastic" else replace(tip_first(), superelastic=None)
    force = np.concatenate([np.linspace(0.0, 1.0, 6), np.linspace(0.8, 0.0, 5)])  # equal notches differ as much
    chain, multibody = solve_chain_by_force(rig, force), solve_multibody_by_force(rig, force)
    np.testing.assert_allclose(chain.record.notches_deg, multibody.record.notches_deg, atol=0.1)
    np.testing.assert_allclose(chain.record.angle_deg, multibody.record.angle_deg, atol=0.1)
    np.testing.assert_allclose(chain.record.tip_mm, multibody.record.tip_mm, atol=0.02)
    np.testing.assert_allclose(chain.peak_strain, multibody.peak_strain, atol=5e-4)


@pytest.mark.slow
@pytest.mark.parametrize("law", ["elastic", "superelastic", "loads"])
def test_twins_on_a_row_of_v_pairs(law):
    rig = replace(graded(), **LAWS[law])
    if law == "loads":
        rig = replace(rig, tip_stop=None)
    chain, multibody = solve_chain(rig, triangle(2.2, cycles=1)), solve_multibody(rig, triangle(2.2, cycles=1))
    np.testing.assert_allclose(chain.record.notches_deg, multibody.record.notches_deg, atol=0.02)
    np.testing.assert_allclose(chain.record.angle_deg, multibody.record.angle_deg, atol=0.02)
    np.testing.assert_allclose(chain.segment_tensions_N, multibody.segment_tensions_N, atol=0.02)
    assert np.ptp(chain.record.notches_deg[22]) > 1.0


def test_energy_closes():
    """The work of the wheel over a closed loop is what friction and material take, at steps of 0.001 mm."""
    rig = graded(replace(DU2018, name="graded"), depth=0.04)
    program = triangle(0.6, cycles=2, step_mm=0.001)
    solution = solve_chain(rig, program)
    ends = np.flatnonzero(solution.record.drive == solution.record.drive.max())
    work = np.ptp(solution.wheel_work_mJ[ends])
    lost = np.ptp((solution.friction_loss_mJ + solution.material_loss_mJ)[ends])
    assert work == pytest.approx(lost, rel=1e-5)


def test_analytic_model_bends_every_joint_by_itself():
    rig = smooth(graded())
    drive = triangle(2.2, cycles=1)
    analytic, chain = simulate_analytic(rig, drive), solve_chain(rig, drive).record
    # the rings' compliance is in the chain only: up to 2 % of a joint's bending
    np.testing.assert_allclose(analytic.notches_deg, chain.notches_deg, atol=0.12)
    np.testing.assert_allclose(analytic.angle_deg, chain.angle_deg, atol=0.1)
    with pytest.raises(RigError, match="expected equal notches"):
        equal_joints(rig, 0.1)


def test_solver_of_joints_that_differ_has_the_answer_of_equal_ones():
    rig = smooth(DU2018)
    drive = np.linspace(-2.2, 2.2, 9)
    curve, found = theory_curve(rig, drive), bend_at_drive(rig, drive)
    np.testing.assert_allclose(np.degrees(found.angles_rad.sum(axis=1)), curve.angle_deg, atol=1e-9)
    np.testing.assert_allclose(found.tension_a_N, curve.tension_a_N, atol=1e-9)
    np.testing.assert_allclose(found.tension_b_N, curve.tension_b_N, atol=1e-9)


def test_a_notch_that_closes_is_named():
    rig = replace(tip_first(), closure=None, superelastic=None)
    with pytest.raises(SolverError, match=r"joint 4 at .* deg, but its notch closes at"):
        solve_chain_by_force(rig, np.linspace(0.0, 6.0, 20))
    with pytest.raises(RigError, match=r"joint 4 = .* where the notch of rig notched-wrist-90 stays open"):
        bend_at_drive(rig, [1.0])
    with pytest.raises(RigError, match="no equilibrium found near a drive of"):  # the softest joints give way
        bend_at_drive(smooth(graded()), [9.0])


def test_a_moved_load_on_stepped_neutral_axes():
    """Derivative of angle and tip by the tip's force, over the force's levers with their steps."""
    rig, force = replace(tip_first(), superelastic=None, **STEPPED), PULL

    def loaded(e):
        return replace(rig, tip_load=TipLoad(0.3 * (1 + e), 160.0))

    base, e = taped_run(rig, force), 1e-4
    ready = moved_run(base, loaded(e), force)
    found = moved_series(base, ready, moved_along(line_along(base), ready))
    ahead, behind = (taped_run(loaded(way * e), force).series for way in (1, -1))
    for name in ("angle_deg", "tip_mm"):
        central = (getattr(ahead, name) - getattr(behind, name)) / 2
        moved = getattr(found, name) - getattr(base.series, name)
        assert np.linalg.norm(moved - central) < 0.01 * np.linalg.norm(central)


@pytest.mark.parametrize("law", ["elastic", "superelastic", "closes"])
def test_moved_rigs_along_the_steps(law):
    """First-order runs of rigs that differ by little are those of full runs, to second order in the difference."""
    rig, program = replace(graded(), **LAWS[law]), triangle(2.0, cycles=1)
    base = taped_run(rig, program)
    line = line_along(base)
    moves = {
        "stiffness": lambda e: replace(rig, material=replace(rig.material, youngs_modulus_GPa=62.9 * (1 + e))),
        "friction": lambda e: replace(rig, friction=replace(rig.friction, sheath_N=rig.friction.sheath_N * (1 + e))),
        "depth": lambda e: replace(graded(depth=0.04 * (1 + e)), **LAWS[law]),
    }
    for name, moved in moves.items():
        off = []
        for e in (1e-3, 5e-4):
            full = solve_chain(moved(e), program).record.angle_deg
            ready = moved_run(base, moved(e), program)
            series = moved_series(base, ready, moved_along(line, ready))
            off.append(np.abs(series.angle_deg - full).max())
            change = np.abs(full - base.series.angle_deg).max()
            assert off[-1] < 0.02 * change + 1e-4, name


def test_records_of_the_same_drive_have_the_work_of_the_stiffer_joint_less():
    """A limit: a joint as good as uncut does not bend, and the chain is that of the others."""
    tube = Tube(7.0, 6.0)
    joint = NotchedTube(tube, replace(notched_tube(DU2018).notch, count=3, depth_mm=(2.82, 0.6, 2.82)))
    stiff = smooth(replace(DU2018, joint=joint))
    record = solve_chain(stiff, LoadProgram(np.array([0.0, 0.2]))).record
    assert abs(record.notches_deg[-1, 1]) < 0.02 * record.notches_deg[-1, 0]
    assert record.notches_deg[-1, 0] == pytest.approx(record.notches_deg[-1, 2], rel=1e-6)


@pytest.mark.parametrize("direction_deg", [0.0, 180.0])
def test_the_multibody_model_has_the_steps_in_the_levers_of_dead_loads(direction_deg):
    """One-sided notches with steps of 0.04 to 0.07 mm: without them both engines are 0.005 deg apart at 3 N.

    The difference that remains is that of the rings, RIGID_RINGS times as stiff as their section in compression.
    """
    notch = Notch("rectangular", 5, (4.0, 4.2, 4.35, 4.5, 4.6), 1.4, 1.3)
    rig = replace(with_notch(DU2018, notch), tip_load=TipLoad(3.0, direction_deg), gravity=Gravity(20.0, 70.0))
    program = triangle(0.6, step_mm=0.1)
    chain, multibody = solve_chain(rig, program).record, solve_multibody(rig, program).record
    np.testing.assert_allclose(multibody.angle_deg, chain.angle_deg, atol=2e-3)
