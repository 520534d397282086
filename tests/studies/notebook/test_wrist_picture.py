"""The picture of a rig in space: where its tip is, which notches it shows, and that it is drawn."""

from dataclasses import replace
from io import BytesIO

import numpy as np
import pytest
from matplotlib.image import imread

import notchbend as nb
from fem_models.joint import joint_row
from fem_models.rig.presets_in_space import any_preset
from fem_models.spatial import WheelProgram, simulate_in_space
from fem_models.view import SceneError
from fem_models.view.wrist import wrist_surface

WRIST = any_preset("zhang2026")


def test_the_picture_of_a_run_ends_at_its_tip(tmp_path):
    """The chain in space counts the tip from the same base; torsion and strong bending are small in this wrist."""
    record = simulate_in_space(WRIST, WheelProgram(np.array([[0.5, 0.0], [1.0, 0.5], [1.0, 1.0]])))
    surface = wrist_surface(WRIST, record.notches_deg[-1])
    assert np.linalg.norm(record.tip_mm[-1, 1:]) > 5
    np.testing.assert_allclose(surface.tip_mm, record.tip_mm[-1], atol=0.05)  # mm; seen: 0.021
    nb.plot(WRIST, joint_angles_deg=record.notches_deg[-1]).savefig(tmp_path / "wrist.png")
    assert (imread(tmp_path / "wrist.png")[:, :, :3] < 0.9).any(axis=2).mean() > 0.03


def test_notches_are_cut_where_they_are_turned_to():
    """Over the first notch the tube is open towards y, over the second one towards z."""
    middles, surface = WRIST.joint.places().middles, wrist_surface(WRIST, np.zeros(WRIST.joints))
    centres = surface.tube.mean(axis=1)
    for number, axis in ((0, 1), (1, 2)):
        here = centres[np.abs(centres[:, 0] - middles[number]) < 0.2]
        assert np.abs(here[:, axis]).max() < 0.4
        assert np.abs(here[:, 3 - axis]).max() > 1.6
    assert len(surface.tendons) == 4
    np.testing.assert_allclose(surface.tendons[2].mean(axis=(0, 1))[1:], [0, 1.8], atol=0.02)


def test_angles_that_do_not_fit_are_refused():
    with pytest.raises(SceneError, match="expected 24 finite angles"):
        nb.plot(WRIST, joint_angles_deg=np.zeros(3))


def test_every_label_is_within_the_picture():
    """The layout of matplotlib leaves labels of axes in space out: the z of both pictures was cut off."""
    figure = nb.plot(WRIST)
    figure.savefig(BytesIO(), format="png")  # places the labels
    width, height = figure.get_size_inches() * figure.dpi
    for axes in figure.axes:
        for axis in (axes.xaxis, axes.yaxis, axes.zaxis):
            box = axis.label.get_window_extent()
            assert 0 < box.x0 < box.x1 < width
            assert 0 < box.y0 < box.y1 < height


def test_a_name_is_text_and_no_formula(tmp_path):
    named = replace(WRIST, name="$\\frac{$<b>")
    nb.plot(named).savefig(tmp_path / "wrist.png")
    assert (tmp_path / "wrist.png").stat().st_size > 10_000


def test_strain_at_the_root_is_that_of_the_joint():
    """Closed form: the strain of the outermost fibre per radian of a notch, times the angle of the most bent one."""
    angles = np.linspace(0.5, 3.0, WRIST.joints)
    strain = wrist_surface(WRIST, angles).strain_percent
    expected = 100 * joint_row(WRIST).first.peak_strain_per_rad * np.radians(3.0)
    # the edge of a notch lies between two of the 72 corners round the tube; seen: 1.7 % more
    assert strain.max() == pytest.approx(expected, rel=0.03)
    assert strain.min() == 0
