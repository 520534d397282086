"""Pictures of one single notched ring (SNR) as a solid: mesh, bent shape and strain."""

from __future__ import annotations

import multiprocessing
import os
import signal
from collections.abc import Iterator
from concurrent.futures import ProcessPoolExecutor
from concurrent.futures.process import BrokenProcessPool
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING

import meshio
import numpy as np
from skfem import MeshTet2

from fem_models.solid.large_bending import BentJoint, QuarterJoint, whole
from fem_models.solid.linear import Solid, cells
from fem_models.solid.strain import equivalent, nodal_strain, principal
from fem_models.view.manipulator import PURPOSE, TIME_LIMIT_S, SceneError
from hysteresis.arrays import Floats
from hysteresis.extras import require_extra
from hysteresis.files import folder_beside

if TYPE_CHECKING:
    import pyvista as pv


_STEEL, _BEYOND = "#b9c0c9", "#7b1fa2"
_HEAT = ("#e8ebee", "#f2c14e", "#e4572e", "#8c1c13")
_VIEW = (0.45, 1.0, 0.28)  # from the focus to the camera: on one arc, the axis of the tube upright


def as_meshio(solid: Solid, field_mm: Floats) -> meshio.Mesh:
    """Mesh of ten-node tetrahedra with displacement, principal and equivalent strain at the nodes.

    ``field_mm`` has shape (3 n,), as all fields of :mod:`fem_models.solid.linear`.
    """
    nodal = nodal_strain(solid, field_mm)
    data = {
        "displacement_mm": np.ascontiguousarray(field_mm.reshape(3, -1).T),
        "principal_strain_percent": 100 * principal(nodal),
        "equivalent_strain_percent": 100 * equivalent(nodal, solid.poisson),
    }
    return meshio.Mesh(solid.points_mm, [("tetra10", cells(solid.mesh))], point_data=data)


def bent_mesh(joint: QuarterJoint, bent: BentJoint, mesh: MeshTet2) -> meshio.Mesh:
    """Return the whole SNR, bent by the nonlinear solution, with the fields of :func:`as_meshio`.

    The principal strain is logarithmic, the equivalent one the transformation strain plus stress over E; ``mesh`` is
    that of :func:`fem_models.solid.mesh.snr_mesh` with the settings of the joint.

    Raises
    ------
    ValueError
        Another mesh.
    """
    displacement, main, equal = whole(joint, bent.state, mesh.doflocs.T)
    data = {
        "displacement_mm": displacement,
        "principal_strain_percent": 100 * main,
        "equivalent_strain_percent": 100 * equal,
    }
    return meshio.Mesh(np.ascontiguousarray(mesh.doflocs.T), [("tetra10", cells(mesh))], point_data=data)


def draw_mesh(mesh: meshio.Mesh, path: Path, *, limit: float, window: tuple[int, int] = (1800, 800)) -> None:
    """Draw a mesh of :func:`as_meshio` or :func:`bent_mesh`, coloured by equivalent strain, into a PNG.

    Metal beyond ``limit`` (a strain, as of :func:`fem_models.solid.strain.superelastic_limit`) is drawn in another
    colour. A child process draws: VTK may abort the whole process without OpenGL.

    Raises
    ------
    SceneError
        The renderer crashed or did not end, or a file that cannot be written.
    MissingError
        A library of the extra ``view`` is missing.
    """
    require_extra("view", PURPOSE)
    spawn = multiprocessing.get_context("spawn")
    with _staged(path) as half, ProcessPoolExecutor(1, spawn, _headless, (TIME_LIMIT_S,)) as child:
        try:
            child.submit(_draw, mesh, 100 * limit, half, window).result()
        except BrokenProcessPool:
            raise SceneError(
                f"the renderer crashed, or did not end within {TIME_LIMIT_S:g} s: is there an OpenGL on this machine?"
            ) from None


@contextmanager
def _staged(path: Path) -> Iterator[Path]:
    """Yield a file in a folder next to ``path``, and move it there when the block ends without an error."""
    try:
        with folder_beside(path) as folder:
            half = folder / path.name
            yield half
            half.replace(path)
    except OSError as error:
        raise SceneError(f"{path}: {error.strerror or error}: expected a file that can be written") from None


def _headless(limit_s: float) -> None:
    """Prepare the process that draws; the system ends it after a time, where it can."""
    if hasattr(signal, "setitimer"):
        signal.setitimer(signal.ITIMER_REAL, limit_s)
    for name in ("DISPLAY", "WAYLAND_DISPLAY"):  # a dead display would abort VTK; without any it renders off screen
        os.environ.pop(name, None)


def _draw(mesh: meshio.Mesh, limit_percent: float, path: Path, window: tuple[int, int]) -> None:
    import pyvista as pv
    from matplotlib.colors import LinearSegmentedColormap

    grid = pv.UnstructuredGrid({pv.CellType.QUADRATIC_TETRA: mesh.cells_dict["tetra10"]}, mesh.points)
    for name, values in mesh.point_data.items():
        grid.point_data[name] = values
    bent = grid.warp_by_vector("displacement_mm")
    plotter = pv.Plotter(off_screen=True, shape=(1, 2), window_size=list(window), border=False)
    plotter.set_background("white", all_renderers=True)
    plotter.subplot(0, 0)
    plotter.add_mesh(_skin(grid, 2), color=_STEEL, smooth_shading=True, split_sharp_edges=True)
    plotter.add_mesh(_edges(grid), color="#30343a", line_width=1.0)
    plotter.add_text("mesh", font_size=11, color="black")
    plotter.subplot(0, 1)
    colours = LinearSegmentedColormap.from_list("heat", _HEAT)
    plotter.add_mesh(
        _skin(bent, 3),
        scalars="equivalent_strain_percent",
        cmap=colours,
        clim=(0.0, limit_percent),
        above_color=_BEYOND,
        smooth_shading=True,
        split_sharp_edges=True,
        scalar_bar_args={
            "title": "equivalent strain, %\n",
            "above_label": f"beyond {limit_percent:.2g} %",
            "vertical": False,
            "height": 0.09,
            "width": 0.5,
            "position_x": 0.25,
            "position_y": 0.05,
            "color": "black",
            "fmt": "%.2f",
            "title_font_size": 18,
            "label_font_size": 16,
        },
    )
    outline = _skin(grid, 2).extract_feature_edges(40.0)  # of the straight one
    plotter.add_mesh(outline, color="#9aa1a9", line_width=1.0)
    plotter.add_text("bent, in true size; outline: straight", font_size=11, color="black")
    plotter.link_views()
    plotter.camera_position = [tuple(20 * np.array(_VIEW)), (0, 0, 0), (0, 0, 1)]
    plotter.enable_parallel_projection()
    plotter.reset_camera()
    plotter.camera.zoom(1.2)
    plotter.screenshot(str(path))
    plotter.close()


def _skin(grid: pv.UnstructuredGrid, subdivision: int) -> pv.PolyData:
    """Surface with curved faces cut into flat ones."""
    return grid.extract_surface(nonlinear_subdivision=subdivision, algorithm="dataset_surface")


def _edges(grid: pv.UnstructuredGrid) -> pv.PolyData:
    """Edges of the elements on the surface, straight between their corners' and middle nodes."""
    return grid.extract_surface(nonlinear_subdivision=0, algorithm="dataset_surface").extract_all_edges()
