"""Pictures, the file for MuJoCo and the side view of notches that differ."""

from dataclasses import replace

import numpy as np
import pytest

from fem_models.analytic.kinematics import tip_pose
from fem_models.chain.solve import solve_chain
from fem_models.export.loop import guide_loop
from fem_models.export.mujoco import mujoco_model
from fem_models.joint import joint_row
from fem_models.load import LoadProgram
from fem_models.rig import Rig, preset
from fem_models.rig.rig import Friction, notched_tube, with_notch
from fem_models.view.manipulator import tendon_lines, tube_mesh

WRIST, DU2018 = preset("notched-wrist-90"), preset("du2018", preload_N=20.0)


def differing(rig: Rig) -> Rig:
    notch, part = notched_tube(rig).notch, np.linspace(0.0, 1.0, rig.joints)
    cut = notched_tube(rig).cut
    changes = {"depth_mm": cut.depth_mm + 0.03 * part, "width_mm": cut.width_mm + 0.1 * part}
    return with_notch(rig, replace(notch, **{name: tuple(values) for name, values in changes.items()}))


@pytest.mark.parametrize("rig", [WRIST, DU2018], ids=["one-sided", "pair"])
def test_mesh_has_the_strain_of_every_joint_and_the_places_of_the_notches(rig):
    rig = differing(rig)
    row, angles = joint_row(rig), np.full(rig.joints, 3.0)
    mesh = tube_mesh(rig, angles)
    expected = 100 * np.radians(3.0) * row.of("peak_strain_per_rad").max()
    assert mesh["strain_percent"].max() == pytest.approx(expected, rel=0.01)
    assert mesh.n_open_edges == tube_mesh(WRIST if rig.name == WRIST.name else DU2018, angles).n_open_edges
    straight = tube_mesh(rig, 0 * angles)
    assert straight.points[:, 0].max() == pytest.approx(rig.length_mm, abs=1e-6)
    full = np.pi / 4 * (notched_tube(rig).tube.outer_diameter_mm ** 2 - notched_tube(rig).tube.inner_diameter_mm ** 2)
    assert 0 < straight.volume < full * rig.length_mm


def test_mesh_ends_where_the_kinematics_say():
    """Chords of arcs are shorter than the hinges' links: 1 % of the bending, and steps of the neutral axis."""
    rig = differing(DU2018)
    angles = np.linspace(1.0, 4.0, rig.joints)
    line = tendon_lines(rig, angles)["a"]
    tip = tip_pose(rig, np.radians(angles))
    heading = np.radians(angles.sum())
    end = line[-1, :2] - rig.tendon_a.moment_arm_mm * np.array([-np.sin(heading), np.cos(heading)])
    np.testing.assert_allclose(end, [tip.x_mm, tip.y_mm], atol=0.02)


def test_mujoco_bends_joint_by_joint():
    """Against the chain, as for equal notches within 1 %: what stretches in the tube, and friction at its mean."""
    mujoco = pytest.importorskip("mujoco", reason="MuJoCo is not installed: the extras bench and dev have it")
    rig = replace(differing(DU2018), friction=Friction())
    model = mujoco.MjModel.from_xml_string(mujoco_model(rig, guide_loop(rig, 1.0)))
    data = mujoco.MjData(model)
    mujoco.mj_kinematics(model, data)
    joints = [model.joint(f"joint{k + 1}") for k in range(rig.joints)]
    at = [1e3 * data.xanchor[joint.id][0] for joint in joints]
    np.testing.assert_allclose(at, joint_row(rig).places.middles, atol=1e-4)  # mm; the file has nine digits
    drive = np.linspace(0.0, 1.0, 21)
    for here in np.linspace(0.0, 1.0, 1000):
        data.ctrl[0] = 1e-3 * here
        mujoco.mj_step(model, data)
    mujoco.mj_step(model, data, 500)
    bent = np.degrees([data.qpos[joint.qposadr[0]] for joint in joints])
    record = solve_chain(rig, LoadProgram(drive)).record
    np.testing.assert_allclose(bent, record.notches_deg[-1], rtol=0.02)
    assert np.ptp(bent) > 0.5
