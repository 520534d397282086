"""The lumped rig: closed forms that it must meet, and cases that are repeatable and of the asked size."""

from dataclasses import replace

import numpy as np
import pytest

from fem_models.rig.of_record import rig_of
from validation.practice.beyond import beyond
from validation.practice.lumped import LumpedRig, cases, simulate_lumped
from validation.practice.lumped.cases import CLEAN, SIZES, draw_lumped_case, draw_lumped_noiseless, effects
from validation.tracing import catalogue

# straight curve, linear tendons: then every branch is a line
LINEAR = LumpedRig(toe_mm=1e-7, loop_Nmm=0.0, coulomb_N=0.0, capstan=0.0)
ARM, TENDON, JOINT = LINEAR.arm_mm[0], LINEAR.tendon_N_per_mm[0], LINEAR.bending_Nmm_per_rad
LABELS = sorted(effects(np.random.default_rng(0)))


def program(amplitude=1.0, samples=200, cycles=2):
    k = np.arange(1, samples * cycles + 1)
    return amplitude * np.sin(2 * np.pi * k / samples), k * 0.05, 1 + (k - 1) // samples


def angle(rig, **of_program):
    return simulate_lumped(rig, *program(**of_program))[0]


def test_without_losses_the_angle_is_that_of_springs():
    # moments: 2 k r (x - r theta) = K theta, while both tendons are taut
    drive, *_ = program()
    exact = 2 * TENDON * ARM * drive / (JOINT + 2 * TENDON * ARM**2)
    assert np.radians(angle(LINEAR)) == pytest.approx(exact, abs=1e-6)


def test_coulomb_friction_makes_a_loop_of_known_width():
    # 2 k r (x - r theta) - K theta = +-2 r F on sliding branches
    friction = 1.5
    rig = replace(LINEAR, coulomb_N=friction, bristle_N_per_mm=2e4)
    bend = np.radians(angle(rig))
    rising, falling = bend[399], bend[299]  # both at zero drive
    assert falling - rising == pytest.approx(4 * ARM * friction / (JOINT + 2 * TENDON * ARM**2), rel=1e-3)


def test_friction_in_proportion_to_tension_grows_with_the_preload():
    rig = replace(LINEAR, capstan=0.2, bristle_N_per_mm=2e3)
    low, high = (np.ptp(angle(replace(rig, preload_N=preload))[[199, 299]]) for preload in (10.0, 20.0))
    assert high == pytest.approx(2 * low, rel=0.05)


def test_work_of_the_wheel_is_what_friction_and_drag_take():
    # a closed loop: springs give back what they took
    rig = replace(LINEAR, coulomb_N=1.0, viscous_N_s_per_mm=0.5, bristle_N_per_mm=2e4, substeps=16)
    drive, time, cycle = program(samples=400)
    bend, tensions = simulate_lumped(rig, drive, time, cycle)
    last = slice(399, 800)
    pull = tensions[last, 0] - tensions[last, 1]
    work = float(np.sum(0.5 * (pull[1:] + pull[:-1]) * np.diff(drive[last])))
    slid = ARM * np.abs(np.diff(np.radians(bend[last])))
    lost = float(np.sum(2 * slid * (1.0 + 0.5 * slid / 0.05)))
    assert lost == pytest.approx(work, rel=0.02)


@pytest.mark.parametrize("label", LABELS)
def test_every_effect_of_the_catalogue_has_the_size_that_was_asked_for(label):
    assert label in {effect.name for effect in catalogue()}
    case, _ = draw_lumped_noiseless(5, "known", label, 0, change=short)
    assert case.truth.effects == (label,)
    assert 0.9 * SIZES[0] < case.truth.ratios[0] < 1.1 * SIZES[1]


def short(usual, rng):
    """Records of two cycles of 60 samples."""
    return [replace(plan, cycles=2, samples_per_cycle=60) for plan in usual]


def test_the_size_of_an_effect_is_beyond_the_constants_of_the_rig():
    """Softer tendons are none, however large; a play, of which friction and stiffness take much, is less than it is."""
    rng = np.random.default_rng(2)
    rig, protocol = cases.drawn_rig(rng), cases._draw_protocol(rng)
    plain = cases._records(rig, protocol)
    tangent = cases._own_tangent(rig, protocol, plain, "known")
    softer = replace(rig, tendon_N_per_mm=tuple(0.99 * k for k in rig.tendon_N_per_mm))
    played = replace(rig, play_mm=0.1)
    for changed, most in ((softer, 0.02), (played, 0.6)):
        angles = cases._records(changed, protocol)
        whole = np.sqrt(np.mean((np.concatenate(angles) - np.concatenate(plain)) ** 2))
        assert beyond(tangent, plain, angles) < most * whole
    assert cases._own_tangent(rig, protocol, plain, "unknown").shape[1] == tangent.shape[1] + 1  # the arm


def test_the_catalogue_is_covered():
    assert set(LABELS) <= {effect.name for effect in catalogue()}


def test_a_case_is_the_same_again_and_another_seed_is_not():
    one, again, other = (draw_lumped_case(seed, "unknown", CLEAN, 0) for seed in (5, 5, 6))
    assert all((a.angle_deg == b.angle_deg).all() for a, b in zip(one.records, again.records, strict=True))
    assert one.records[0].angle_deg.size != other.records[0].angle_deg.size or not np.array_equal(
        one.records[0].angle_deg, other.records[0].angle_deg
    )
    assert all(set(record.rig) == {"preload_N"} for record in one.records)  # the geometry is not told


def test_a_known_rig_is_told_as_measured_joints():
    record = draw_lumped_case(5, "known", CLEAN, 0).records[0]
    rig = rig_of(record)
    assert rig.joints == 12
    assert rig.preload_N == 20.0


def test_effect_that_the_rig_does_not_have_is_refused():
    with pytest.raises(ValueError, match="wear: the lumped rig does not have it"):
        draw_lumped_case(1, "known", "wear", 0)
