"""Peak strain of the flexures, and the limits that a run exceeds."""

import numpy as np
import pytest

from fem_models.joint import joint_mechanics
from fem_models.joint.strain import FATIGUE, StrainLimit, limits_passed, peak_strain, strain_limits
from fem_models.load import LoadProgram
from fem_models.load_control import run_load_control
from fem_models.multibody.quasi_static import solve_multibody
from fem_models.rig import RigError, preset
from studies.commands.first_report import strain_summary

WRIST = preset("notched-wrist-150")
UP_AND_BACK = np.concatenate([[0.0], np.linspace(0.1, 1.9, 10), np.linspace(1.7, 0.0, 8)])


def test_peak_strain_is_counted_from_rest():
    strain = peak_strain(joint_mechanics(WRIST), np.radians([WRIST.precurvature_deg, WRIST.precurvature_deg + 10.0]))
    np.testing.assert_allclose(strain, [0.0, np.radians(10.0) * joint_mechanics(WRIST).peak_strain_per_rad], atol=1e-12)


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
    angle = np.radians(np.abs(solution.record.notches_deg).max())
    assert summary.peak_strain_percent == pytest.approx(100 * angle * joint_mechanics(rig).peak_strain_per_rad)
    at = [limit.passed_at_mm for limit in summary.strain_limits]
    assert 0 < at[0] < at[1] < 2.2  # 0.4 % alternating, then 1 %; 2.5 % at 45 deg stays below 6 %
    assert at[2] is None
