"""Flexures whose stiffness varies along the bend: the three engines against each other and a quadrature."""

import math
from dataclasses import replace

import numpy as np
import pytest
from scipy.integrate import quad

from fem_models.analytic.kinematics import angle_for_drive_rad
from fem_models.chain.solve import solve_chain
from fem_models.joint.hardening import Hardening, beyond_linear_rad
from fem_models.load import LoadProgram
from fem_models.multibody.quasi_static import solve_multibody
from fem_models.rig import RigError, preset
from fem_models.rig.effects import Fatigue
from fem_models.rig.joints import MeasuredJoint
from fem_models.rig.rig import Friction, Material

JOINT = MeasuredJoint(14, 2.6, 520.0, hardening_slope=0.8, hardening_limit=1.5, hardening_angle_deg=2.0)
LINEAR = MeasuredJoint(14, 2.6, 520.0)
RIG = replace(preset("du2018"), joint=JOINT)
WITHOUT_LOSS = replace(RIG, friction=Friction(), material=Material(60.0, 0.33))
DRIVE_MM = np.concatenate(
    [np.linspace(0.0, 2.0, 11)[1:], np.linspace(2.0, -2.0, 21)[1:], np.linspace(-2.0, 1.0, 16)[1:]]
)
PROGRAM = LoadProgram(DRIVE_MM)


@pytest.mark.parametrize(
    "hardening", [Hardening(0.8, 1.5, 0.03), Hardening(-0.6, -0.3, 0.1), Hardening(1.0, 0.0, 0.05)]
)
def test_moment_is_the_integral_of_the_stiffness(hardening):
    def growth(angle):
        u = angle / hardening.angle_rad
        return (hardening.slope * u + hardening.limit * u**2) / (1 + u**2)

    for angle in (0.002, 0.05, 0.4):
        integral = quad(growth, 0.0, angle, epsabs=1e-14)[0]
        both = beyond_linear_rad(np.array([angle, -angle]), hardening)
        np.testing.assert_allclose(both, [integral, -integral], rtol=1e-10)


def test_engines_agree_on_flexures_that_harden():
    chain = solve_chain(WITHOUT_LOSS, PROGRAM).record.angle_deg
    multibody = solve_multibody(WITHOUT_LOSS, PROGRAM).record.angle_deg
    analytic = np.degrees(angle_for_drive_rad(WITHOUT_LOSS, DRIVE_MM))
    linear = solve_chain(replace(WITHOUT_LOSS, joint=LINEAR), PROGRAM).record.angle_deg
    assert np.abs(chain - linear).max() > 0.2  # it matters
    np.testing.assert_allclose(multibody, chain, atol=0.02)
    np.testing.assert_allclose(analytic, chain, atol=5e-3)


def test_twins_agree_with_friction_and_a_rest_angle_that_moves():
    fatigue = Fatigue(loop_loss=0.2, residual_deg=0.1, cycles=1.0)
    rig = replace(RIG, fatigue=fatigue)
    program = LoadProgram(DRIVE_MM, cycle=np.repeat([1, 2], [25, DRIVE_MM.size - 25]))
    chain = solve_chain(rig, program)
    multibody = solve_multibody(rig, program)
    np.testing.assert_allclose(multibody.record.angle_deg, chain.record.angle_deg, atol=0.02)


def test_stiffness_stays_positive():
    with pytest.raises(RigError, match=r"hardening_slope = -1\.5: expected a stiffness above 0"):
        replace(LINEAR, hardening_slope=-1.5, hardening_limit=-0.9)
    u = np.linspace(0, 50, 20001)
    slope, limit = -1.3, -0.5
    replace(LINEAR, hardening_slope=slope, hardening_limit=limit)
    assert (1 + (slope * u + limit * u**2) / (1 + u**2)).min() > 0
    with pytest.raises(RigError, match="hardening_angle_deg = 0"):
        replace(LINEAR, hardening_angle_deg=0.0)
    assert math.isclose(
        0.5 * (limit - math.hypot(slope, limit)), ((slope * u + limit * u**2) / (1 + u**2)).min(), rel_tol=1e-3
    )
