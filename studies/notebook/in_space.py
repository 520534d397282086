"""The picture of a rig that bends in two planes: straight beside bent."""

from __future__ import annotations

from typing import Any

import numpy as np
from matplotlib.colors import to_rgb
from numpy.typing import ArrayLike

from fem_models.rig import Rig
from fem_models.view.in_space import WristSurface, wrist_surface
from hysteresis.arrays import Floats
from studies.notebook.solid import NotebookFigure, shown_angles_deg

_STEEL = "#b9c0c9"
_TENDONS = ("#1f5fa8", "#2a8c55", "#c0562a", "#7a4fa3")
_LIGHT = np.array([0.3, -0.6, 0.74])
_ZOOM = 0.92
_ELEVATION_DEG, _AZIMUTH_DEG = 24.0, -62.0


def wrist_figure(rig: Rig, joint_angles_deg: ArrayLike | None = None) -> NotebookFigure:
    """Draw the straight wrist, and beside it the bent one; tendons lie on the tube, so that they are seen.

    Parameters
    ----------
    joint_angles_deg
        Shape (joints,), base to tip, each in the plane of its notch. By default all bend alike.

    Raises
    ------
    SceneError
        As :func:`fem_models.view.in_space.wrist_surface`.
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
