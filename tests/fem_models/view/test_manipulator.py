import os
import subprocess
import sys

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from matplotlib.image import imread
from scipy.integrate import quad, solve_ivp

from fem_models.joint import joint_mechanics
from fem_models.joint.flexure import beam
from fem_models.joint.section import cut_height_mm, section
from fem_models.rig import Rig
from fem_models.rig.joints import MeasuredJoint, Notch, NotchedTube, Tube
from fem_models.rig.rig import Material, Tendon, Wheel
from fem_models.view import SceneError, render
from fem_models.view import manipulator as scene
from fem_models.view.manipulator import tendon_lines, tube_mesh
from studies.report.tube import DETAIL, coarse_surface

MATERIAL = Material(youngs_modulus_GPa=60.0, poissons_ratio=0.3)


def rig(joint: NotchedTube | MeasuredJoint, arm_mm: float) -> Rig:
    tendon = Tendon(EA_N=9000.0, moment_arm_mm=arm_mm, free_length_mm=150.0)
    return Rig("test", MATERIAL, tendon, tendon, Wheel(10.0), 10.0, joint=joint)


V_PAIR = rig(NotchedTube(Tube(6.0, 5.4), Notch("v_pair", 14, 2.72, 1.2, 1.4, 0.6)), 2.62)
SLOT_PAIR = rig(NotchedTube(Tube(6.0, 5.4), Notch("rectangular_pair", 4, 2.5, 1.2, 1.4)), 2.62)
ONE_SIDED = rig(NotchedTube(Tube(1.62, 1.40), Notch("rectangular", 5, 1.40, 0.8, 1.2)), 0.66)
SHALLOW = rig(NotchedTube(Tube(6.0, 5.0), Notch("rectangular_pair", 3, 0.2, 1.2, 1.4)), 2.4)  # does not reach the bore
DEEP = rig(
    NotchedTube(Tube(6.0, 5.0), Notch("rectangular", 3, 5.6, 1.2, 1.4)), 2.4
)  # leaves no more than a part of the wall
MEASURED = rig(MeasuredJoint(6, 2.6, 520.0), 2.62)
NOTCHED = {"v": V_PAIR, "slot": SLOT_PAIR, "one-sided": ONE_SIDED, "shallow": SHALLOW, "deep": DEEP}


def even(bent: Rig, total_deg: float) -> np.ndarray:
    return np.full(bent.joints, total_deg / bent.joints)


def middle_of_tip(bent: Rig, angles_deg: np.ndarray) -> np.ndarray:
    """Middle of the distal end face: the points of the straight mesh at x = length, followed into the bent one."""
    straight, _, _ = scene._bent_wall(bent, np.zeros(bent.joints))
    points, _, _ = scene._bent_wall(bent, angles_deg)
    face = points[np.isclose(straight[:, 0], bent.joints * bent.pitch_mm)]
    return (face.max(axis=0) + face.min(axis=0)) / 2


def chain_of_arcs(bent: Rig, angles_rad: np.ndarray, neutral_mm: float) -> tuple[float, float]:
    """Tip of rigid rings joined by arcs of constant curvature along y = neutral, by complex numbers."""
    notch = bent.joint.notch
    position, heading = 1j * neutral_mm, 0.0
    for theta in angles_rad:
        position += notch.spacing_mm / 2 * np.exp(1j * heading)
        chord = notch.width_mm if theta == 0 else 2 * notch.width_mm / theta * np.sin(theta / 2)
        position += chord * np.exp(1j * (heading + theta / 2))
        heading += theta
        position += notch.spacing_mm / 2 * np.exp(1j * heading)
    position += -neutral_mm * 1j * np.exp(1j * heading)
    return position.real, position.imag


@pytest.mark.parametrize("name", ["slot", "one-sided"])
def test_tip_of_slotted_tube_is_that_of_a_chain_of_arcs(name):
    bent = NOTCHED[name]
    angles = np.random.default_rng(3).uniform(-8, 20, bent.joints)
    neutral = -float(section(bent.joint, 0.0).neutral_offset_mm)
    expected = chain_of_arcs(bent, np.radians(angles), neutral)
    np.testing.assert_allclose(middle_of_tip(bent, angles)[:2], expected, atol=1e-5)  # a polygon for the end face


def test_tip_of_v_notched_tube_is_that_of_a_beam_under_a_uniform_moment():
    """Independent integration of x' = cos phi, y' = sin phi, phi' = theta k / (E I) for a single joint."""
    one = rig(NotchedTube(V_PAIR.joint.tube, Notch("v_pair", 1, 2.72, 1.2, 1.4, 0.6)), 2.62)
    theta = np.radians(20.0)
    rate = theta * beam(one).bending_Nmm_per_rad / (MATERIAL.youngs_modulus_GPa * 1e3)

    def slope(x: float, state: np.ndarray) -> list[float]:
        bend = rate / float(section(one.joint, x - 1.3).second_moment_mm4) if abs(x - 1.3) < 0.6 else 0.0
        return [np.cos(state[2]), np.sin(state[2]), bend]

    end = solve_ivp(slope, (0, 2.6), [0.0, 0.0, 0.0], rtol=1e-9, atol=1e-9, max_step=0.01).y[:, -1]
    assert end[2] == pytest.approx(theta, rel=1e-5)
    np.testing.assert_allclose(middle_of_tip(one, [20.0])[:2], end[:2], atol=2e-5)


def test_straight_tube_fills_its_box():
    mesh = tube_mesh(V_PAIR, np.zeros(14))
    np.testing.assert_allclose(mesh.bounds, (0, 14 * 2.6, -3, 3, -3, 3), atol=1e-6)


def analytic_volume(bent: Rig) -> float:
    """Annulus times length, less the part of the annulus beyond each cut (circular segments), integrated over z."""

    def segment(radius: float, c: float) -> float:
        c = min(max(c, -radius), radius)
        return radius**2 * np.arccos(c / radius) - c * np.sqrt(radius**2 - c**2)

    outer, inner = bent.joint.tube.outer_diameter_mm / 2, bent.joint.tube.inner_diameter_mm / 2
    sides = 1 if bent.joint.notch.shape == "rectangular" else 2

    def cut(z: float) -> float:
        c = float(cut_height_mm(bent.joint, z))
        return sides * (segment(outer, c) - segment(inner, c))

    removed = 2 * quad(cut, 0, bent.joint.notch.width_mm / 2, limit=200)[0]
    return np.pi * (outer**2 - inner**2) * bent.joints * bent.pitch_mm - bent.joints * removed


@pytest.mark.parametrize("name", NOTCHED)
def test_volume_is_that_of_the_cut_tube_straight_and_bent(name):
    bent = NOTCHED[name]
    straight = tube_mesh(bent, np.zeros(bent.joints))
    assert straight.volume == pytest.approx(analytic_volume(bent), rel=0.01)
    # A fibre at y from the neutral axis, where the centroid is, stretches by y kappa: no change of volume. The
    # neutral axis of the model is that of radial cuts, hence the tolerance for the one-sided notches.
    assert tube_mesh(bent, even(bent, 30.0)).volume == pytest.approx(straight.volume, rel=1e-3)


@pytest.mark.parametrize("detail", [1.0, DETAIL])
@pytest.mark.parametrize("bent", [*NOTCHED.values(), MEASURED], ids=[*NOTCHED, "measured"])
def test_surface_has_no_holes(bent, detail):
    mesh = tube_mesh(bent, even(bent, 30.0), detail=detail)
    holes = mesh.extract_feature_edges(
        boundary_edges=True, feature_edges=False, manifold_edges=False, non_manifold_edges=False
    )
    assert holes.n_cells == 0
    assert mesh.n_cells > 1000 * detail


def test_surface_of_the_interactive_view_has_no_holes():
    """It is cut at its sharp edges, where each side has points of its own: with those put together, it is closed."""
    mesh = coarse_surface(V_PAIR, even(V_PAIR, 30.0))
    assert mesh.n_open_edges > 0
    whole = mesh.clean()
    assert not whole.extract_feature_edges(
        boundary_edges=True, feature_edges=False, manifold_edges=False, non_manifold_edges=False
    ).n_cells
    assert whole.volume == pytest.approx(tube_mesh(V_PAIR, even(V_PAIR, 30.0)).volume, rel=0.01)


@pytest.mark.parametrize("name", NOTCHED)
def test_largest_strain_is_that_of_the_analytic_ring(name):
    bent = NOTCHED[name]
    expected = 100 * np.radians(4.0) * joint_mechanics(bent).peak_strain_per_rad
    strain = tube_mesh(bent, np.full(bent.joints, 4.0))["strain_percent"]
    assert strain.max() == pytest.approx(expected, rel=1e-3)
    assert strain.min() == 0


def test_rings_and_straight_joints_are_not_strained():
    angles = np.zeros(14)
    angles[3] = 5.0
    points, _, strain = scene._bent_wall(V_PAIR, angles)
    x = scene._bent_wall(V_PAIR, np.zeros(14))[0][:, 0]
    assert strain[np.abs(x - 3.5 * 2.6) > 0.6 + 1e-6].max() == 0
    assert strain.max() > 1
    assert points.shape == (x.size, 3)


@settings(max_examples=8)
@given(st.lists(st.floats(-10, 10), min_size=4, max_size=4))
def test_opposite_angles_give_the_mirror_image(angles):
    up, cells, strain = scene._bent_wall(SLOT_PAIR, angles)
    down, other_cells, other_strain = scene._bent_wall(SLOT_PAIR, np.negative(angles))
    mirrored, ours = (down * (1, -1, 1)), up
    np.testing.assert_array_equal(cells, other_cells)
    key = scene._bent_wall(SLOT_PAIR, np.zeros(4))[0]
    twin = {tuple(p): i for i, p in enumerate(np.round(key, 5) + 0.0)}
    pairs = np.array([twin[tuple(p)] for p in np.round(key * (1, -1, 1), 5) + 0.0])
    np.testing.assert_allclose(mirrored[pairs], ours, atol=1e-5)
    np.testing.assert_allclose(other_strain[pairs], strain, atol=1e-6)


def test_tendons_keep_their_arm_and_shorten_by_it():
    """Chord of the inner tendon over an opening: 2 (w / theta - r) sin(theta / 2), of the outer one + r."""
    total = 30.0
    lines = tendon_lines(SLOT_PAIR, even(SLOT_PAIR, total))
    theta, notch = np.radians(total / 4), SLOT_PAIR.joint.notch
    for name, arm in (("a", 2.62), ("b", -2.62)):
        length = np.linalg.norm(np.diff(lines[name], axis=0), axis=1).sum()
        openings = 4 * 2 * (notch.width_mm / theta - arm) * np.sin(theta / 2)
        # the piece before the base is one pitch long, the rings are rigid
        assert length == pytest.approx(2.6 + 4 * notch.spacing_mm + openings, abs=1e-9)


def test_a_rig_of_measured_joints_is_drawn_as_rings_of_its_moment_arm():
    mesh = tube_mesh(MEASURED, np.zeros(6))
    np.testing.assert_allclose(mesh.bounds[2:4], (-1.15 * 2.62, 1.15 * 2.62), atol=1e-6)
    assert mesh.connectivity()["RegionId"].max() == 6  # seven rings, apart
    assert mesh["strain_percent"].max() == 0


@pytest.mark.parametrize("angles", [np.zeros(13), np.zeros((14, 1)), np.full(14, np.nan), 3.0])
def test_wrong_angles_are_named(angles):
    with pytest.raises(SceneError, match="expected 14 finite angles"):
        tube_mesh(V_PAIR, angles)


@pytest.fixture(scope="module")
def opengl():
    draw = "import pyvista as p; s = p.Plotter(off_screen=True); s.add_mesh(p.Sphere()); s.screenshot(return_img=True)"
    environment = {k: v for k, v in os.environ.items() if k not in ("DISPLAY", "WAYLAND_DISPLAY")}
    if subprocess.run([sys.executable, "-c", draw], env=environment, capture_output=True, check=False).returncode:
        pytest.skip("VTK cannot draw on this machine: no OpenGL")


@pytest.mark.usefixtures("opengl")
@pytest.mark.parametrize("bent", [V_PAIR, ONE_SIDED, MEASURED], ids=["v", "one-sided", "measured"])
def test_picture_shows_something_and_replaces_the_old_one(bent, tmp_path):
    path = tmp_path / "scene.png"
    path.write_text("old")
    render(bent, even(bent, 60.0), path, window=(700, 450))
    assert scene._ink(path) > 0.05
    assert imread(path).shape[:2] == (450, 700)
    assert [p.name for p in tmp_path.iterdir()] == ["scene.png"]


WHITE = (
    "import pickle, sys; import numpy as np; from matplotlib.image import imsave;"
    "imsave(pickle.load(sys.stdin.buffer)[2], np.ones((9, 14, 3)))"
)


@pytest.mark.parametrize(
    ("code", "reason"),
    [
        ("import os; os.abort()", "crashed with SIGABRT"),
        ("raise SystemExit('no EGL device')", "exit code 1: no EGL device"),
        ("import sys; sys.exit(7)", "exit code 7: no message"),
        ("pass", "no readable picture"),
        (WHITE, "empty picture: 0 %"),
        ("import time; time.sleep(60)", "did not end within 1 s"),
    ],
)
def test_failing_renderer_is_one_line_and_leaves_the_old_picture(code, reason, tmp_path, monkeypatch):
    path = tmp_path / "scene.png"
    path.write_text("old")
    monkeypatch.setattr(scene, "COMMAND", (sys.executable, "-c", code))
    monkeypatch.setattr(scene, "TIME_LIMIT_S", 1.0 if "sleep" in code else 60.0)
    with pytest.raises(SceneError, match=reason) as caught:
        render(SLOT_PAIR, even(SLOT_PAIR, 20.0), path)
    assert "\n" not in str(caught.value)
    assert path.read_text() == "old"
    assert [p.name for p in tmp_path.iterdir()] == ["scene.png"]


def test_missing_renderer_is_named(tmp_path, monkeypatch):
    monkeypatch.setattr(scene, "COMMAND", (str(tmp_path / "no-python"),))
    with pytest.raises(SceneError, match="did not start: No such file"):
        render(SLOT_PAIR, even(SLOT_PAIR, 20.0), tmp_path / "scene.png")
