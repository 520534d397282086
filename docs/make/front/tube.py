"""The bent tube as a picture without a background, for light and for dark pages."""

from __future__ import annotations

import numpy as np
import pyvista as pv
from matplotlib.colors import LinearSegmentedColormap
from PIL import Image

from fem_models.rig import Rig
from fem_models.view.manipulator import tendon_lines, tube_mesh
from hysteresis.arrays import Floats

TENDONS = {"a": "#3b82d0", "b": "#2fa36b"}
_HEAT = LinearSegmentedColormap.from_list("heat", ("#b9c0c9", "#f2c14e", "#e4572e", "#8c1c13"))
_METAL = {"specular": 0.5, "specular_power": 20.0, "smooth_shading": True, "split_sharp_edges": True}
_TOWARDS = np.array([-0.25, 0.3, 1.0])  # from the tube to the camera
_TENDON_MM = 0.15  # radius that is drawn


class Camera:
    """Draws a rig from one place: ``window`` in pixels shows the corners ``low`` to ``high`` of the plane x-y, mm."""

    def __init__(self, rig: Rig, window: tuple[int, int], low: tuple[float, float], high: tuple[float, float]) -> None:
        self._rig = rig
        self._plotter = pv.Plotter(off_screen=True, window_size=list(window), lighting="light kit")
        self._plotter.enable_anti_aliasing("ssaa")
        self._plotter.enable_parallel_projection()
        centre = np.array([(low[0] + high[0]) / 2, (low[1] + high[1]) / 2, 0.0])
        self._plotter.camera_position = [centre + 100 * _TOWARDS / np.linalg.norm(_TOWARDS), centre, (0.0, 1.0, 0.0)]
        width, height = high[0] - low[0], high[1] - low[1]
        self._plotter.camera.parallel_scale = max(height / 2, width / 2 * window[1] / window[0])

    def take(self, joints_deg: Floats, most_percent: float) -> Image.Image:
        """Draw the tube at joint angles of shape (joints,), coloured by bending strain up to ``most_percent``."""
        plotter = self._plotter
        plotter.clear_actors()
        wall = tube_mesh(self._rig, joints_deg)
        strain = {"scalars": "strain_percent", "clim": (0.0, most_percent), "cmap": _HEAT, "show_scalar_bar": False}
        plotter.add_mesh(wall, **strain, **_METAL)
        for name, line in tendon_lines(self._rig, joints_deg).items():
            round_line = pv.lines_from_points(line).tube(radius=_TENDON_MM, n_sides=16)
            plotter.add_mesh(round_line, color=TENDONS[name], specular=0.3, smooth_shading=True)
        plotter.reset_camera_clipping_range()
        return Image.fromarray(plotter.screenshot(None, transparent_background=True, return_img=True))
