"""The picture of a rig in three dimensions, bent, as a figure of a notebook; of one in space straight beside bent."""

from __future__ import annotations

import io
import tempfile
from pathlib import Path
from typing import Any

import numpy as np
from matplotlib.colors import to_rgb
from matplotlib.figure import Figure
from matplotlib.image import imread
from numpy.typing import ArrayLike

from fem_models.joint import joint_row
from fem_models.rig import Rig
from fem_models.view import render
from fem_models.view.wrist import WristSurface, wrist_surface
from hysteresis.arrays import Floats

SHOWN_DEG = 60.0
"""Angle of the tip in a picture, where the notches do not close before."""
_OF_CLOSURE = 0.9
_WINDOW = (1400, 900)
_DPI = 150
_STEEL = "#b9c0c9"
_TENDONS = ("#1f5fa8", "#2a8c55", "#c0562a", "#7a4fa3")
_LIGHT = np.array([0.3, -0.6, 0.74])
_ZOOM = 0.92
_ELEVATION_DEG, _AZIMUTH_DEG = 24.0, -62.0


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


def wrist_figure(rig: Rig, joint_angles_deg: ArrayLike | None = None) -> NotebookFigure:
    """Draw the straight wrist, and beside it the bent one; tendons lie on the tube, so that they are seen.

    Parameters
    ----------
    joint_angles_deg
        Shape (joints,), base to tip, each in the plane of its notch. By default all bend alike.

    Raises
    ------
    SceneError
        As :func:`fem_models.view.wrist.wrist_surface`.
    """
    angles = shown_angles_deg(rig) if joint_angles_deg is None else np.asarray(joint_angles_deg, dtype=float)
    bent = wrist_surface(rig, angles)
    figure = NotebookFigure(figsize=(9.4, 4.6))
    words = f"bent, tip at ({', '.join(f'{value:.3g}' for value in bent.tip_mm.round(9) + 0.0)}) mm"
    straight = wrist_surface(rig, 0 * angles)
    corners = np.concatenate([one.tube.reshape(-1, 3) for one in (straight, bent)])
    box = np.array([corners.min(axis=0), corners.max(axis=0)])  # one for both, so that they have one scale
    for number, (title, surface) in enumerate((("straight", straight), (words, bent))):
        _draw(figure, number + 1, surface, title, box)
    figure.suptitle(repr(rig), fontsize=9.5, parse_math=False)
    return figure


def _draw(figure: NotebookFigure, number: int, surface: WristSurface, title: str, box: Floats) -> None:
    from mpl_toolkits.mplot3d.art3d import Poly3DCollection  # type: ignore[import-untyped]

    # the layout of matplotlib does not count the labels of axes in space: each picture has room for them at its right
    place = (0.5 * (number - 1), 0.0, 0.46, 0.88)
    axes: Any = figure.add_axes(place, projection="3d", elev=_ELEVATION_DEG, azim=_AZIMUTH_DEG)
    quads = np.concatenate([surface.tube, *surface.tendons])
    tones = [_shaded(surface.tube, _STEEL)]
    tones += [_shaded(one, _TENDONS[j % len(_TENDONS)]) for j, one in enumerate(surface.tendons)]
    colours = np.concatenate(tones)
    axes.add_collection3d(Poly3DCollection(quads, facecolors=colours, edgecolors=colours, linewidths=0.2))
    low, high = box
    axes.set(xlim=(low[0], high[0]), ylim=(low[1], high[1]), zlim=(low[2], high[2]))
    axes.set_box_aspect(high - low, zoom=_ZOOM)
    for axis, words, pad in ((axes.xaxis, "x, mm", 5.0), (axes.yaxis, "y, mm", 1.0), (axes.zaxis, "z, mm", -2.0)):
        axis.set_label_text(words, fontsize=8.5)
        axis.labelpad = pad
    axes.locator_params(nbins=5)
    axes.tick_params(labelsize=7)
    axes.set_title(title, fontsize=9.5)


def _shaded(quads: Floats, colour: str) -> Floats:
    """Colour of each quadrilateral, (k, 3), by its angle to the light."""
    normal = np.cross(quads[:, 2] - quads[:, 0], quads[:, 3] - quads[:, 1])
    size = np.maximum(np.linalg.norm(normal, axis=1), 1e-12)
    bright = 0.62 + 0.38 * np.abs(normal @ _LIGHT) / size
    return np.clip(bright[:, None] * np.array(to_rgb(colour)), 0.0, 1.0)
