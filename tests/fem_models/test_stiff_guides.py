"""Guides that stick stick: tensions behind rigid bends by the capstan equation, and what follows a reversal."""

from dataclasses import replace

import numpy as np
import pytest

from fem_models.chain.solve import ChainSettings, solve_chain, solve_chain_by_force
from fem_models.load import triangle
from fem_models.multibody.quasi_static import solve_multibody, solve_multibody_by_force
from fem_models.multibody.stepper import MultibodySettings
from fem_models.rig import Rig, preset
from fem_models.rig.joints import MeasuredJoint
from fem_models.rig.rig import Friction, Material, Tendon, Wheel

MU, JOINTS, BEND_DEG, MOST_N = 0.3, 10, 9.0, 40.0
RIGID_BENDS = Rig(
    name="rigid bends",
    material=Material(60.0, 0.33),
    tendon_a=Tendon(EA_N=9000.0, moment_arm_mm=2.62, free_length_mm=150.0),
    tendon_b=None,
    wheel=Wheel(10.0),
    preload_N=0.0,
    precurvature_deg=BEND_DEG,
    friction=Friction(capstan_coefficient=MU),
    joint=MeasuredJoint(JOINTS, 2.6, 1e6),  # 40 N bend a joint by 0.006 deg
)
BY_FORCE = {"chain": solve_chain_by_force, "multibody": solve_multibody_by_force}
BY_DRIVE = {"chain": (solve_chain, ChainSettings), "multibody": (solve_multibody, MultibodySettings)}


def capstan(force_N):
    """Tension of every segment under a history of forces at the wheel, shape (m,) -> (m, N + 1), in closed form.

    A stiff tendon that does not slide keeps its tension. Where it slides, it loses exp(mu phi) on its way in, and gains
    as much on its way out: a wave from the wheel turns the tensions over. The base has half the wrap of a ring.
    """
    wrap = np.radians(BEND_DEG) * (np.arange(JOINTS) + 0.5)
    keeps = np.exp(-MU * np.concatenate([[0.0], wrap]))
    tension, out = np.zeros(JOINTS + 1), []
    for force in force_N:
        tension = np.clip(tension, force * keeps, force / keeps)
        out.append(tension)
    return np.array(out)


@pytest.mark.parametrize("engine", BY_FORCE)
def test_tensions_behind_rigid_bends_are_those_of_the_capstan_equation_on_loading_and_unloading(engine):
    up, down, again = np.arange(0, MOST_N + 0.1, 0.5), np.arange(MOST_N, 1.9, -0.5), np.arange(2, 30.1, 0.5)
    force = np.concatenate([up, down, again])
    tension, exact = BY_FORCE[engine](RIGID_BENDS, force).segment_tensions_N[:, 0], capstan(force)
    # by hand: nine rings of 9 deg and half of one at the base
    assert exact[up.size - 1, -1] == pytest.approx(MOST_N * np.exp(-MU * np.radians(9.5 * BEND_DEG)))
    assert exact[up.size - 1, -1] == pytest.approx(25.56, abs=0.01)
    assert exact[up.size + 20, -1] == exact[up.size - 1, -1]  # the wave has not reached the tip
    assert np.abs(tension - exact)[:, -1].max() <= 0.15
    assert np.abs(tension - exact).max() <= 0.2


@pytest.mark.parametrize("stiffness", [1e6, 1e8, 1e9])
@pytest.mark.parametrize("engine", BY_FORCE)
def test_the_capstan_equation_holds_however_stiff_the_joints_are(engine, stiffness):
    """A tolerance of the moments that grew with the stiffness left 13.84 N at the tip in place of 12.78, at 1e8."""
    rig = replace(RIGID_BENDS, joint=MeasuredJoint(JOINTS, 2.6, stiffness))
    force = np.concatenate([np.arange(0.0, 20.1, 0.5), np.arange(20.0, 10.0, -0.5)])
    tension, exact = BY_FORCE[engine](rig, force).segment_tensions_N[:, 0], capstan(force)
    assert exact[40, -1] == pytest.approx(12.78, abs=0.01)
    assert tension[40, -1] == pytest.approx(exact[40, -1], abs=0.02)
    assert np.abs(tension - exact).max() <= 0.1


@pytest.mark.parametrize("engine", BY_FORCE)
def test_a_tendon_that_was_let_go_at_rest_is_pulled_in_against_all_guides(engine):
    # Preloaded by 5 N at rest, and without force at the wheel before the first sample.
    force = np.array([5.0])
    tension = BY_FORCE[engine](replace(RIGID_BENDS, preload_N=5.0), force).segment_tensions_N[0, 0]
    np.testing.assert_allclose(tension, capstan(force)[0], atol=0.05)


@pytest.mark.parametrize("engine", BY_DRIVE)
def test_after_a_reversal_the_manipulator_moves_as_with_bristles_without_give(engine):
    solve, settings = BY_DRIVE[engine]
    rig, program = preset("du2018", preload_N=10.0), triangle(2.2)
    after = np.flatnonzero(np.diff(np.sign(np.diff(program.drive_mm)))) + 2
    own, *angles = (
        solve(rig, program, *given).record.angle_deg for given in [(), *((settings(bristle_ratio=r),) for r in (5, 10))]
    )
    # the remaining give falls with the stiffness: its limit by the last two
    limit = 2 * angles[1] - angles[0]
    assert np.abs(own - limit)[after].max() <= 0.002  # 0.30 deg with springs of 2 % of EA/pitch
    assert np.abs(own - limit).max() <= 0.005


@pytest.mark.parametrize("engine", BY_FORCE)
def test_a_soft_guide_gives_way_by_its_compliance_before_it_slides(engine):
    """One guide, before a joint that does not bend: the tendon comes in by its stretch, force by force."""
    compliance, limit = 0.02, 3.0
    rig = replace(
        RIGID_BENDS, precurvature_deg=0.0, preload_N=1.0,
        friction=Friction(sheath_N=limit, stick_compliance_mm_per_N=compliance), joint=MeasuredJoint(1, 2.6, 1e6),
    )  # fmt: skip
    force = np.array([1.0, 2.0, 3.0, 3.5, 3.9])
    tension = BY_FORCE[engine](rig, force).segment_tensions_N[:, 0, -1]
    # force - tension = way / compliance at the guide, and the segment behind it stretches by the way
    segment = 9000.0 / 2.6
    way = (force - 1.0) / (1 / compliance + segment)
    np.testing.assert_allclose(tension, 1.0 + segment * way, rtol=2e-3)
    assert np.abs(force - tension).max() < limit  # it has not slid
