"""Loops in figures: a thin loop is drawn less its backbone, too, and no title is cut or pushes the axes away."""

import warnings

import numpy as np
import pytest

import notchbend as nb
from hysteresis.records.backbone import backbone_of, is_thin
from hysteresis.records.metrics import loop_width

WIDTH_DEG = 2.0
TITLE = "A title of a measured record that is much longer than one chart of a figure in a notebook is wide, in a file"


def loop(width_deg: float, *, cycles: int = 2, inner: bool = False) -> nb.Record:
    """A loop of constant width around x + 0.1 x^3, with a turning point that both branches share."""
    up = np.linspace(-2.0, 2.0, 41)
    drive = np.concatenate([np.concatenate([up[:-1], up[::-1][:-1]])] * cycles + [up[:1]])
    side = np.concatenate([np.r_[0.0, np.full(39, -1.0), 0.0, np.full(39, 1.0)]] * cycles + [[0.0]])
    if inner:  # of half the amplitude and offset, which the full cycles must not see
        drive, side = np.concatenate([drive, -2 + 0.5 * (drive[1:] + 2)]), np.concatenate([side, 3 + side[1:]])
    angle = 20 * drive + 0.1 * drive**3 + 0.5 * width_deg * side
    return nb.Record(drive, angle, title=TITLE)


@pytest.mark.parametrize("inner", [False, True])
def test_backbone_is_the_middle_of_the_full_cycles(inner: bool) -> None:
    record = loop(WIDTH_DEG, inner=inner)
    np.testing.assert_allclose(backbone_of(record), 20 * record.drive + 0.1 * record.drive**3, atol=5e-3)


def test_backbone_goes_on_where_only_one_branch_is() -> None:
    """A decaying drive never comes back to its first peak: the approach up there is no loop."""
    turns = np.linspace(0, 3, 241)
    program = nb.LoadProgram(2.2 * np.exp(-0.25 * turns) * np.sin(2 * np.pi * turns))
    record = nb.simulate(nb.preset("du2018"), program, engine="chain")
    width = loop_width(record.drive, record.angle_deg).max_deg
    assert np.ptp(record.angle_deg - backbone_of(record)) < 1.1 * width


def test_no_backbone_without_a_way_back() -> None:
    assert backbone_of(nb.Record(np.linspace(0, 1, 9), np.linspace(0, 20, 9))) is None
    assert backbone_of(nb.Record(np.zeros(9), np.linspace(0, 20, 9))) is None


def test_thin_loop_is_opened_and_a_wide_one_is_not() -> None:
    thin, wide = loop(WIDTH_DEG), loop(20.0)
    assert is_thin(thin, backbone_of(thin))
    angle, opened = nb.plot(thin).axes
    assert np.ptp(angle.lines[0].get_ydata()) == pytest.approx(np.ptp(thin.angle_deg))
    assert np.ptp(opened.lines[0].get_ydata()) == pytest.approx(WIDTH_DEG, abs=0.01)
    assert len(nb.plot(wide).axes) == 1
    assert len(nb.plot([thin, wide]).axes) == 2


def test_a_long_title_leaves_the_axes_their_room() -> None:
    figure = nb.plot(loop(WIDTH_DEG))
    with warnings.catch_warnings():
        warnings.simplefilter("error")  # matplotlib warns where axes collapse
        figure.draw_without_rendering()
    box = figure.axes[0]._left_title.get_window_extent()
    assert box.x1 < figure.axes[1].get_position().x0 * figure.bbox.width
