"""Superelastic fibres of a section, and the plateau that they give a joint."""

from dataclasses import replace

import numpy as np
import pytest

from fem_models.chain.solve import solve_chain_by_force
from fem_models.joint import joint_mechanics
from fem_models.joint.flexure import flexure
from fem_models.joint.section import section_fibres
from fem_models.joint.superelastic import FIBRES
from fem_models.joint.superelastic_section import section_path
from fem_models.load_control import run_load_control
from fem_models.rig import RigError, preset
from fem_models.rig.effects import Closure, Superelastic
from fem_models.rig.rig import Friction

WRIST = preset("notched-wrist-150")
NEVER = Closure(1000.0, angle_deg=1e3)
LINEAR = replace(WRIST, superelastic=None, friction=Friction(), closure=NEVER)


def test_plateau_moment_of_a_one_sided_notch_is_that_of_the_tube_cut_by_a_plane():
    outer, inner, cut = 0.81, 0.70, 1.40 - 0.81
    x, y = np.meshgrid(np.linspace(0, 0.85, 3401), np.linspace(0, 0.85, 3401))
    height = x[(np.hypot(x, y) < outer) & (np.hypot(x, y) > inner) & (x > cut)]
    cell = 2 * 0.00025**2
    law = Superelastic(200.0, 100.0, transformation_strain=0.5, fibres_per_side=128)  # the neutral one is on neither
    flat = replace(WRIST, superelastic=law)
    found = section_path(joint_mechanics(flat).section, [1e-4, 3.0], 0.0)
    # without thrust equal areas are pulled and pressed: the median height is neutral, not the centre
    assert found.moment_Nmm[1] == pytest.approx(200.0 * cell * np.abs(height - np.median(height)).sum(), rel=3e-3)
    assert found.tangent[0] == pytest.approx(flexure(flat).bending_Nmm_per_rad, rel=1e-9)


@pytest.mark.parametrize("rig", [WRIST, preset("du2018")], ids=["one-sided", "pair"])
def test_moment_of_a_flexure_is_within_one_percent_of_that_of_many_fibres(rig):
    law = Superelastic(450.0, 220.0, transformation_strain=0.5, plateau_modulus_GPa=2.0)
    few, many = (section_fibres(rig.joint, count) for count in (FIBRES, 400))
    strain = 450.0 / 60e3 * np.linspace(0.2, 6.0, 200)  # of the outermost fibre

    def moment(fibres):
        distance, area = fibres
        at = np.abs(distance) * strain[:, None] / np.abs(many[0]).max()
        stress = np.minimum(60e3 * at, 450.0 + 1e3 * law.plateau_modulus_GPa * (at - 450.0 / 60e3))
        return (np.abs(distance) * area * stress).sum(axis=1)

    np.testing.assert_allclose(moment(few), moment(many), rtol=0.01)


def test_a_sloped_plateau_has_its_slope():
    law = Superelastic(200.0, 100.0, transformation_strain=0.5, plateau_modulus_GPa=4.0)
    rig = replace(LINEAR, superelastic=law)
    # far past the start every fibre is on its plateau: the joint has E2/E of its elastic stiffness
    run = solve_chain_by_force(rig, np.array([0.0, 2.6, 2.61]))
    angle = np.radians(run.record.notches_deg)
    arm, half = joint_mechanics(rig).arms_mm.a, 0.5 * angle
    lever = arm * np.cos(half) + rig.joint.notch.width_mm / 6 * np.sin(half)
    moment = run.segment_tensions_N[:, 0, 1:] * lever
    slope = (np.diff(moment, axis=0)[-1] / np.diff(angle, axis=0)[-1])[0]
    expected = flexure(rig).bending_Nmm_per_rad * 4.0 / rig.material.youngs_modulus_GPa
    assert slope == pytest.approx(expected, rel=0.03)
    with pytest.raises(RigError, match=r"plateau_modulus_GPa = 90.0: expected below"):
        run_load_control(replace(rig, superelastic=replace(law, plateau_modulus_GPa=90.0)), [0.1])
