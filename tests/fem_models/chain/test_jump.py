"""A tube whose path of equilibria ends jumps to the next one: against a closed form, and rigs that stalled before."""

import math
from dataclasses import replace

import numpy as np
import pytest

from fem_models.chain import solve_chain
from fem_models.chain.along import line_along, moved_along, moved_run, taped_run
from fem_models.chain.parameters import ChainSettings
from fem_models.joint import joint_row
from fem_models.load import triangle
from fem_models.rig import Rig, preset
from fem_models.rig.effects import Drag
from fem_models.rig.joints import MeasuredJoint, Notch, NotchedTube, Tube
from fem_models.rig.rig import Friction, Material, Tendon, Wheel

ARM_MM, HALF_GAP_MM, STEPS = 2.0, 5.0, 50
SOFT = Tendon(EA_N=2_000.0, moment_arm_mm=ARM_MM, free_length_mm=2_000.0)
BISTABLE = Rig(
    name="bistable",
    joint=MeasuredJoint(1, 20.0, 50.0, rigid_gap_mm=2 * HALF_GAP_MM),
    material=Material(),
    tendon_a=SOFT,
    tendon_b=SOFT,
    wheel=Wheel(10.0),
    preload_N=12.5,
    precurvature_deg=2.0,
)
"""Two soft tendons press a joint together over a gap by more than it can carry straight: it bends to either side."""


def drive_mm(theta):
    """Drive at which the joint is in balance at an angle, rad: closed form, linear in the drive while both are taut.

    k (theta - rest) = Ta la + Tb lb, with Ta, Tb = P + K (+-x - shortening of the path), l the lever of a path, K the
    tendon's stiffness, over its free length and the pitch.
    """
    k, rest = joint_row(BISTABLE).first.elastic_Nmm_per_rad, math.radians(BISTABLE.precurvature_deg)
    stiffness = SOFT.EA_N / (SOFT.free_length_mm + 20.0)

    def path(side, angle):
        return 2 * (HALF_GAP_MM * (1 - np.cos(angle / 2)) + side * ARM_MM * np.sin(angle / 2))

    def lever(side):
        return HALF_GAP_MM * np.sin(theta / 2) + side * ARM_MM * np.cos(theta / 2)

    short_a, short_b = path(1, theta) - path(1, rest), path(-1, theta) - path(-1, rest)
    moment = k * (theta - rest) - BISTABLE.preload_N * (lever(1) + lever(-1))
    given = moment + stiffness * (short_a * lever(1) + short_b * lever(-1))
    return given / (stiffness * (lever(1) - lever(-1)))


THETA = np.linspace(-2.0, 2.0, 400_001)
DRIVE = drive_mm(THETA)
FOLDS = np.flatnonzero(np.diff(np.sign(np.diff(DRIVE)))) + 1
PROGRAM = triangle(
    1.3 * float(np.abs(DRIVE[FOLDS]).max()), step_mm=1.3 * float(np.abs(DRIVE[FOLDS]).max()) / STEPS, cycles=2
)


def balanced_deg(drive):
    """All angles in balance at a drive."""
    return np.degrees(THETA[np.flatnonzero(np.diff(np.sign(DRIVE - drive)))])


@pytest.fixture(scope="module")
def snapped():
    return solve_chain(BISTABLE, PROGRAM)


def test_both_sides_of_a_jump_by_the_closed_form(snapped):
    record = snapped.record
    assert FOLDS.size == 2
    for sample in range(record.drive.size):
        assert np.abs(balanced_deg(record.drive[sample]) - record.angle_deg[sample]).min() < 0.01
    jumps = np.flatnonzero(snapped.jump)
    np.testing.assert_array_equal(record.jump, snapped.jump)
    assert jumps.size == 4  # down and up in either cycle
    for sample in jumps:
        before, after = record.angle_deg[sample - 1 : sample + 1]
        assert before * after < 0
        fold = DRIVE[FOLDS[np.argmin(np.abs(THETA[FOLDS] - math.radians(before)))]]
        low, high = sorted(record.drive[sample - 1 : sample + 1])
        assert low <= fold <= high


def test_the_loss_of_a_jump_closes_the_energy(snapped):
    """Without friction all that the wheel puts in is lost in the jumps: the area between the branches, the same."""
    cycle = slice(-4 * STEPS - 1, None)
    work, lost = (np.ptp(value[cycle][[0, -1]]) for value in (snapped.wheel_work_mJ, snapped.jump_loss_mJ))
    assert lost == pytest.approx(work, rel=5e-3)
    assert lost > 1.0
    assert snapped.friction_loss_mJ[-1] == snapped.material_loss_mJ[-1] == 0.0


@pytest.mark.parametrize("viscosity", [0.5, 0.01, 20.0])
def test_where_a_jump_ends_does_not_depend_on_the_viscosity(snapped, viscosity):
    other = solve_chain(BISTABLE, PROGRAM, ChainSettings(viscosity=viscosity))
    assert np.abs(other.record.angle_deg - snapped.record.angle_deg).max() < 1e-3
    np.testing.assert_array_equal(other.jump, snapped.jump)


@pytest.mark.parametrize(("drag", "step_s", "jumps"), [(1e-3, 100.0, 4), (1e-3, 1.0, 0), (1.0, 1.0, 0)])
def test_drag_takes_its_part_of_a_jump_once(drag, step_s, jumps):
    """Where dashpots are too weak to carry the tube over, it jumps; either way the energy closes."""
    slowed = replace(BISTABLE, drag=Drag(sheath_N_s_per_mm=0.0, joint_Nmm_s_per_rad=drag))
    found = solve_chain(slowed, replace(PROGRAM, time_s=step_s * np.arange(PROGRAM.drive_mm.size)))
    assert found.jump.sum() == jumps
    cycle = slice(-4 * STEPS - 1, None)
    lost = found.viscous_loss_mJ + found.jump_loss_mJ
    work = np.ptp(found.wheel_work_mJ[cycle][[0, -1]])
    assert np.ptp(lost[cycle][[0, -1]]) == pytest.approx(work, rel=0.015)


def test_with_friction_either():
    rubbing = replace(BISTABLE, friction=Friction(capstan_coefficient=0.1, sheath_N=0.2))
    wide = replace(PROGRAM, drive_mm=2 * PROGRAM.drive_mm)
    one, half = (solve_chain(rubbing, wide, ChainSettings(viscosity=v)) for v in (1.0, 0.5))
    assert one.jump.any()
    assert np.abs(one.record.angle_deg - half.record.angle_deg).max() < 1e-3
    cycle = slice(-4 * STEPS - 1, None)
    lost = one.friction_loss_mJ + one.jump_loss_mJ
    assert np.ptp(lost[cycle][[0, -1]]) == pytest.approx(np.ptp(one.wheel_work_mJ[cycle][[0, -1]]), rel=1e-2)


def test_a_path_without_a_jump_has_no_column():
    found = solve_chain(preset("du2018"), triangle(1.0))
    assert found.record.jump is None
    assert not found.jump.any()
    assert (found.jump_loss_mJ == 0).all()


def test_a_run_that_relaxed_has_no_derivative_along_its_steps():
    base = taped_run(BISTABLE, PROGRAM)
    assert not base.has_steps
    moved = moved_run(base, replace(BISTABLE, preload_N=1.001 * BISTABLE.preload_N), PROGRAM)
    assert moved_along(line_along(base), moved) == math.inf


def workshop(tube, notch, E_GPa, loop, friction, EA_N, arm_mm, free_mm, preload_N, toe_N=0.0):
    tendon = Tendon(EA_N, arm_mm, free_mm, toe_N)
    return Rig(
        name="workshop",
        joint=NotchedTube(Tube(*tube), Notch(*notch)),
        material=Material(E_GPa, 0.33, *loop),
        tendon_a=tendon,
        tendon_b=tendon,
        wheel=Wheel(10.0),
        preload_N=preload_N,
        friction=Friction(**friction),
    )


ONE_SIDED = workshop(
    (2.3413, 1.7407), ("rectangular", 11, 1.9694, 0.2293, 0.8416), 69.44, (),
    {"capstan_coefficient": 0.1, "sheath_N": 0.0117}, 2051.0, 0.7932, 590.0, 0.5853,
)  # fmt: skip
LOW_PRELOAD = workshop(
    (5.2811, 4.8192), ("v_pair", 23, 2.0738, 1.2064, 1.4774, 0.8155), 36.95, (0.136, 1.75),
    {"capstan_coefficient": 0.2}, 33077.0, 2.208, 84.49, 1.32, 0.926,
)  # fmt: skip


@pytest.mark.parametrize(("rig", "amplitude_mm"), [(ONE_SIDED, 0.5), (LOW_PRELOAD, 1.2545)], ids=["arms", "toe"])
def test_rigs_that_are_hard_to_follow(rig, amplitude_mm):
    """Unequal arms bend a preloaded rig at rest; a toe region leaves next to no tension in the tendon let go."""
    found = solve_chain(rig, triangle(amplitude_mm, step_mm=amplitude_mm / 22))
    fine = solve_chain(rig, triangle(amplitude_mm, step_mm=amplitude_mm / 88))
    assert not found.jump.any()
    np.testing.assert_allclose(fine.record.angle_deg[::4], found.record.angle_deg, rtol=0, atol=0.05)
    work, lost = fine.wheel_work_mJ[88:], (fine.friction_loss_mJ + fine.material_loss_mJ)[88:]
    assert np.ptp(lost[[0, -1]]) == pytest.approx(np.ptp(work[[0, -1]]), rel=0.02)


def test_rest_of_unequal_arms_by_the_moment_of_the_preload():
    """Closed form, without friction: both tendons pull by what is left of the preload as the tube bends.

    Each joint turns by t = (a Ta - b Tb)/k, and the tendons give way by N a t and pay out N b t over their length.
    """
    rig = replace(ONE_SIDED, friction=Friction())
    joint, n = joint_row(rig).first, rig.joints
    (a, b), tendon = joint.arms_mm, rig.tendon_a
    stiffness = tendon.EA_N / (tendon.free_length_mm + rig.length_mm)
    turned = (a - b) * rig.preload_N / (joint.elastic_Nmm_per_rad + n * stiffness * (a * a + b * b))
    angle = solve_chain(rig, triangle(0.1)).record.angle_deg[0]
    assert angle == pytest.approx(math.degrees(n * turned), rel=0.02)
