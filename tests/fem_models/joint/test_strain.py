"""Peak strain of the flexures, and the limits that a run exceeds."""

from dataclasses import replace

import numpy as np
import pytest

from fem_models.chain.solve import solve_chain
from fem_models.joint import joint_mechanics
from fem_models.joint.section import root_section
from fem_models.joint.strain import FATIGUE, StrainLimit, limits_passed, peak_strain, strain_limits
from fem_models.joint.superelastic_section import elongation_under_mm
from fem_models.load import LoadProgram
from fem_models.load_control import run_load_control
from fem_models.multibody.quasi_static import solve_multibody
from fem_models.rig import RigError, preset
from fem_models.rig.effects import Superelastic
from fem_models.rig.rig import Material
from studies.own_rig.loops import strain_summary

WRIST = preset("notched-wrist-150")
UP_AND_BACK = np.concatenate([[0.0], np.linspace(0.1, 1.9, 10), np.linspace(1.7, 0.0, 8)])


def test_peak_strain_is_counted_from_rest():
    strain = peak_strain(joint_mechanics(WRIST), np.radians([WRIST.precurvature_deg, WRIST.precurvature_deg + 10.0]))
    np.testing.assert_allclose(strain, [0.0, np.radians(10.0) * joint_mechanics(WRIST).peak_strain_per_rad], atol=1e-12)


def test_thrust_adds_its_strain_to_the_outer_fibre_that_it_strains_more():
    law = Superelastic(450.0, 220.0)
    pair = joint_mechanics(replace(preset("du2018"), superelastic=law))
    longer = np.full((2, 3), -0.002 * pair.section.length_mm)  # 0.2 % of compression, as 40 N on this section
    angles, per_rad = np.array([[0.03, 0.03, 0.02], [-0.03, -0.02, -0.03]]), pair.peak_strain_per_rad
    assert elongation_under_mm(pair.section, 40.0) == pytest.approx(longer[0, 0], rel=0.1)
    bending = peak_strain(pair, angles)
    found = peak_strain(pair, angles, longer)
    # positive bending presses the side of tendon a; the third joint is pressed more on the other side
    np.testing.assert_allclose(found - bending, [[0.002, 0.002, -0.002], [0.002, 0.002, -0.002]], atol=1e-12)
    np.testing.assert_allclose(np.abs(found).max(axis=0), 0.03 * per_rad + 0.002)
    np.testing.assert_allclose(np.ptp(found, axis=0), np.ptp(bending, axis=0))  # the range of a fibre is as without
    one_sided = joint_mechanics(WRIST)
    assert max(one_sided.outer_fibres_per_rad) == one_sided.peak_strain_per_rad
    assert one_sided.outer_fibres_per_rad[0] != one_sided.outer_fibres_per_rad[1]


def test_both_engines_have_the_strain_of_the_thrust():
    rig = replace(
        preset("du2018", preload_N=20.0), material=Material(60.0, 0.33), superelastic=Superelastic(450.0, 220.0)
    )
    steps = LoadProgram(np.array([0.0, 0.2]))
    area = float(joint_mechanics(rig).section.area_mm2.sum())
    for solve in (solve_chain, solve_multibody):
        run = solve(rig, steps)
        elastic = run.segment_tensions_N[:, :, 1:].sum(axis=1) / (60e3 * area)  # N/EA
        bending = peak_strain(joint_mechanics(rig), np.radians(run.record.notches_deg))
        np.testing.assert_allclose(run.peak_strain, bending + elastic, rtol=2e-3)


@pytest.mark.parametrize("preload_N", [10.0, 20.0])
def test_linear_rigs_have_the_strain_of_the_thrust(preload_N):
    """N/(E A) of the root beside the bending: 2.25 % for du2018 at 20 N and 2.2 mm, 2.03 % by bending alone."""
    rig = preset("du2018", preload_N=preload_N)
    root, young = root_section(rig.joint), 1e3 * rig.material.youngs_modulus_GPa
    joint = joint_mechanics(rig)
    for solve, drive in ((solve_chain, np.linspace(0.0, 2.2, 23)), (solve_multibody, np.array([0.0, 0.2]))):
        run = solve(rig, LoadProgram(drive))
        thrust = run.segment_tensions_N[:, :, 1:].sum(axis=1)
        bending = np.abs(np.radians(run.record.notches_deg)) * joint.peak_strain_per_rad
        np.testing.assert_allclose(np.abs(run.peak_strain), bending + thrust / (young * root.area_mm2), rtol=1e-9)
        assert run.peak_strain[0] == pytest.approx(2 * preload_N / (young * root.area_mm2), rel=1e-3)
        if preload_N == 20.0 and solve is solve_chain:
            assert 100 * np.abs(run.peak_strain).max() == pytest.approx(2.25, abs=0.01)
            assert 100 * bending.max() == pytest.approx(2.03, abs=0.01)


def test_limits_are_exceeded_between_samples_by_interpolation():
    limits = (StrainLimit("a", 0.015, "peak", "test"), StrainLimit("b", 0.015, "alternating", "test"))
    drive, strain = np.array([1.0, 2.0, 3.0, 4.0]), np.array([[0.0, 0.01], [0.0, 0.02], [0.0, -0.01], [0.0, -0.02]])
    peak, alternating = limits_passed(drive, strain, limits)
    assert (peak.drive, peak.joint, peak.largest) == (1.5, 2, 0.02)
    # half the range is 0.010 at the second sample, 0.015 at the third, 0.020 at the last
    assert (alternating.joint, alternating.largest) == (2, 0.02)
    assert alternating.drive == pytest.approx(3.0)
    assert limits_passed(drive, strain, (FATIGUE,))[0].drive == 1.0  # 1 % at the first sample: half of it is 0.5 %
    assert limits_passed(drive, 0.1 * strain, (FATIGUE,))[0].drive is None
    with pytest.raises(RigError, match="not known"):
        limits_passed(drive, np.full((4, 2), np.nan), limits)


def test_limits_of_a_wrist_come_in_their_order():
    fatigue, start, end = limits_passed(
        UP_AND_BACK[:11], run_load_control(WRIST, UP_AND_BACK[:11]).peak_strain, strain_limits(WRIST)
    )
    assert fatigue.drive < start.drive < end.drive
    assert start.limit.strain == pytest.approx(WRIST.superelastic.plateau_MPa / WRIST.material.youngs_modulus_GPa / 1e3)
    assert all(p.joint == 1 for p in (fatigue, start, end))  # friction: the first notch bends most
    assert all(p.limit.source for p in (fatigue, start, end))


def test_the_report_has_the_strain_of_its_run():
    rig = preset("du2018")
    solution = solve_multibody(rig, LoadProgram(np.linspace(0.0, 2.2, 12)))
    summary = strain_summary(rig, solution)
    joint, angle = joint_mechanics(rig), np.radians(np.abs(solution.record.notches_deg).max())
    thrust = solution.segment_tensions_N[-1, :, 1:].sum(axis=0).max()
    expected = angle * joint.peak_strain_per_rad + thrust * joint.axial_strain_per_N
    assert summary.peak_strain_percent == pytest.approx(100 * expected, rel=1e-3)
    at = [limit.passed_at_mm for limit in summary.strain_limits]
    assert 0 < at[0] < at[1] < 2.2  # 0.4 % alternating, then 1 %; 2.5 % at 45 deg stays below 6 %
    assert at[2] is None
