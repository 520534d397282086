"""The picture of a rig in three dimensions, bent, as a figure of a notebook."""

from __future__ import annotations

import io
import tempfile
from pathlib import Path

import numpy as np
from matplotlib.figure import Figure
from matplotlib.image import imread
from numpy.typing import ArrayLike

from fem_models.joint import joint_row
from fem_models.rig import Rig
from fem_models.view import render
from hysteresis.arrays import Floats

SHOWN_DEG = 60.0
"""Angle of the tip in a picture, where the notches do not close before."""
_OF_CLOSURE = 0.9
_WINDOW = (1400, 900)
_DPI = 150


class NotebookFigure(Figure):
    """A figure that shows itself in a notebook without pyplot, which would show it a second time."""

    def _repr_png_(self) -> bytes:
        stream = io.BytesIO()
        self.savefig(stream, format="png", dpi=110)
        return stream.getvalue()


def shown_angles_deg(rig: Rig) -> Floats:
    """Give the angle of every joint in a picture, shape (joints,): all equal, and no notch closed.

    Raises
    ------
    RigError
        As :func:`fem_models.joint.joint_mechanics`.
    """
    closed = np.degrees(joint_row(rig).of("closure_angle_rad").min())
    return np.full(rig.joints, min(SHOWN_DEG / rig.joints, _OF_CLOSURE * closed))


def solid_figure(rig: Rig, joint_angles_deg: ArrayLike) -> NotebookFigure:
    """Draw the bent tube with its tendons, coloured by bending strain.

    Parameters
    ----------
    joint_angles_deg
        Shape (joints,), base to tip.

    Raises
    ------
    SceneError
        A wrong number of angles, or no OpenGL on this machine.
    RigError
        As :func:`fem_models.joint.joint_mechanics`.
    MissingError
        A library of the extra ``view`` is missing.
    """
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "rig.png"
        render(rig, joint_angles_deg, path, window=_WINDOW)
        picture = imread(path)
    angles: Floats = np.asarray(joint_angles_deg, dtype=float)
    figure = NotebookFigure(figsize=(_WINDOW[0] / _DPI, _WINDOW[1] / _DPI), dpi=_DPI)
    axes = figure.add_axes((0.0, 0.0, 1.0, 1.0))
    axes.imshow(picture)
    axes.set_axis_off()
    words = f"{rig!r}, tip at {angles.sum():.3g} deg"
    figure.text(0.02, 0.96, words, fontsize=9.5, va="top", parse_math=False)
    return figure
