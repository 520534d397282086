"""A rig in three dimensions: bent, seen in a notebook and in a file; from the side where nothing can draw it."""

from io import BytesIO

import numpy as np
import pytest
from matplotlib.image import imread

import hysteresis.extras
import notchbend as nb
from fem_models.joint import joint_mechanics
from fem_models.view import SceneError
from studies.notebook import solid
from studies.own_rig import loops


def requires_opengl(figure_of):
    try:
        return figure_of()
    except SceneError as error:
        pytest.skip(str(error))


def ink(png) -> float:
    picture = imread(png)[:, :, :3]
    return float((picture < 0.97).any(axis=2).mean())


@pytest.mark.slow
def test_a_rig_is_drawn_bent_and_saved(tmp_path):
    rig = nb.preset("notched-wrist-90")
    bent = requires_opengl(lambda: nb.plot(rig, joint_angles_deg=np.full(rig.joints, 12.0)))
    bent.savefig(tmp_path / "rig.png")
    assert ink(tmp_path / "rig.png") > 0.03
    assert ink(BytesIO(bent._repr_png_())) > 0.03
    assert f"tip at {12 * rig.joints:g} deg" in bent.texts[0].get_text()


def test_by_default_no_notch_closes():
    for name in ("du2018", "notched-wrist-90"):
        rig = nb.preset(name)
        angles = solid.shown_angles_deg(rig)
        assert angles.shape == (rig.joints,)
        assert 20 < angles.sum() <= solid.SHOWN_DEG + 1e-9
        assert angles.max() < np.degrees(joint_mechanics(rig).closure_angle_rad)


def test_without_opengl_the_side_view_is_drawn_and_said(monkeypatch):
    def fail(*_, **__):
        raise SceneError("no OpenGL")

    monkeypatch.setattr(solid, "render", fail)
    rig = nb.preset("du2018")
    with pytest.warns(UserWarning, match="side view in place of three dimensions: no OpenGL"):
        figure = nb.plot(rig)
    assert figure.axes[0].get_xlabel() == "along the tube, mm"
    with pytest.raises(SceneError):
        nb.plot(rig, joint_angles_deg=np.zeros(rig.joints))  # angles that were asked for are not left out


def test_angles_that_do_not_fit_and_other_views_are_refused():
    with pytest.raises(SceneError, match="expected 14 finite angles"):
        nb.plot(nb.preset("du2018"), joint_angles_deg=[1.0, 2.0])
    with pytest.raises(ValueError, match="view = 'top': expected one of solid, side"):
        nb.plot(nb.preset("du2018"), view="top")


def test_without_the_extra_it_is_one_line_that_names_it(monkeypatch):
    monkeypatch.setattr(hysteresis.extras, "find_spec", lambda name: None)
    with pytest.raises(nb.MissingError) as error:
        nb.plot(nb.preset("du2018"))
    assert str(error.value) == (
        "pyvista is not installed: expected for pictures in three dimensions: pip install 'notchbend[view]'"
    )
    assert nb.plot(nb.preset("du2018"), view="side").axes[0].get_xlabel() == "along the tube, mm"


def test_a_run_without_the_extra_stores_why_there_is_no_picture(tmp_path, monkeypatch):
    """What ``notchbend run`` draws at its end."""
    monkeypatch.setattr(hysteresis.extras, "find_spec", lambda name: None)
    rig = nb.preset("du2018")
    picture = loops.draw_rig(rig, nb.simulate(rig, nb.triangle(0.5, cycles=1), engine="chain"), tmp_path)
    assert not list(tmp_path.iterdir())
    assert (picture.file, picture.tube) == (None, None)
    assert picture.missing.endswith("pip install 'notchbend[view]'")


def test_a_run_that_is_killed_while_it_draws_leaves_no_folder(tmp_path, monkeypatch):
    """What stands in the folder of results while the tube is drawn is what the next run replaces."""
    seen = []

    def drawn(rig, joints, path):
        seen.extend(one.name for one in tmp_path.iterdir())
        raise SceneError("killed")

    monkeypatch.setattr(loops, "render", drawn)
    rig = nb.preset("du2018")
    loops.draw_rig(rig, nb.simulate(rig, nb.triangle(0.5, cycles=1), engine="chain"), tmp_path)
    assert seen == ["tube.json"]
