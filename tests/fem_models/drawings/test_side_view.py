"""The dimensioned drawing: it has the numbers of the rig, and the outline of the metal."""

import re

import matplotlib
import numpy as np
import pytest

from fem_models.drawings import side_view, side_view_pdf, side_view_svg
from fem_models.rig import preset
from fem_models.rig.presets_in_space import any_preset
from fem_models.rig.rig import notched_tube


def texts(rig):
    """Every word of the drawing: text as text, not as outlines."""
    with matplotlib.rc_context({"svg.fonttype": "none"}):
        figure = side_view._figure(rig)
    return {text.get_text() for axes in figure.axes for text in axes.texts}


def test_dimensions_are_those_of_the_rig():
    found = texts(preset("du2018"))
    assert {
        "width 1.4",
        "depth 2.825",
        "ring 1.2",
        "pitch 2.6",
        "root 0.8",
        "web 0.55",
        "Ø6.2",
        "Ø5.64",
        "37.6",
    } <= found
    assert "notch 1 of 14, all alike" in found


def test_a_rig_with_turned_notches_is_seen_from_two_sides():
    found = texts(any_preset("zhang2026"))
    assert {"side view", "from above", "a", "b", "c", "d"} <= found


@pytest.mark.parametrize("angle", [0.0, 180.0, 90.0])
def test_edge_is_the_metal_that_is_left(angle):
    """Depth at the middle of a one-sided notch, none opposite; at its side the height of the cut edge."""
    rig = preset("notched-wrist-90")
    joint = notched_tube(rig)
    edge = side_view._edge(side_view._cuts(rig), joint.tube, 11.5, angle)
    half = np.arccos((0.81 - 1.4) / 0.81)
    expected = {0.0: 0.81 - 1.4, 180.0: 0.81, 90.0: 0.81 * np.cos(half - np.pi / 2)}[angle]
    assert edge[:, 1].min() == pytest.approx(expected)


def test_files_are_alike_every_time_and_carry_their_maker():
    rig = preset("du2018")
    svg, pdf = side_view_svg(rig), side_view_pdf(rig)
    assert svg == side_view_svg(rig)
    assert pdf == side_view_pdf(rig)
    assert pdf.startswith(b"%PDF")
    assert re.search("made by notchbend", svg[:4096])
