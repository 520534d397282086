"""The bent manipulator in three dimensions: a mesh and a picture.

The straight tube lies along +x from the base at x = 0, the bending plane is x-y, a positive angle bends towards +y.
Joints are in the middle of their notches (:class:`fem_models.rig.joints.Places`), and s is the distance from a joint.
Cuts run along z: the remaining section is ``|y| <= c(s)``, or ``y <= c`` for one-sided slots. Rings stay rigid; a
flexure bends as a beam under a uniform moment, with a curvature proportional to 1 / I(s) along its neutral axis.
"""

from __future__ import annotations

import os
import pickle
import signal
import subprocess
import sys
import tempfile
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any, BinaryIO

import numpy as np
from numpy.typing import ArrayLike, NDArray

from fem_models.joint import joint_mechanics
from fem_models.joint.section import cut_height_mm
from fem_models.rig import Rig
from fem_models.rig.joints import MeasuredJoint, NotchedTube, NotchShape
from fem_models.rig.rig import with_joint
from fem_models.view.bending import bending_along
from hysteresis.arrays import Floats, Ints
from hysteresis.extras import require_extra

if TYPE_CHECKING:
    import pyvista as pv


# A child process draws, because VTK may abort the whole process without OpenGL. -P keeps the working folder from
# shadowing modules; the folder of this package goes last on the path, for a source tree that is not installed.
COMMAND = (
    sys.executable,
    "-P",
    "-c",
    "import sys; sys.path.append(sys.argv[1]); from fem_models.view.manipulator import _draw_job; "
    "_draw_job(sys.stdin.buffer)",
    str(Path(__file__).parents[2]),
)
TIME_LIMIT_S = 120.0
PURPOSE = "pictures in three dimensions"  # what the extra is for, in the line of error
LEAST_INK = 0.01  # share of pixels that are not background

_STEEL = "#b9c0c9"
_HEAT = (_STEEL, "#f2c14e", "#e4572e", "#8c1c13")  # from unstrained to most strained
_LINES = {"a": "#1f5fa8", "b": "#2a8c55", "axis": "#6b7280"}
_VIEW = (-0.32, 0.34, 1.0)  # from the focus to the camera
_METAL: dict[str, Any] = {"specular": 0.5, "specular_power": 20.0, "smooth_shading": True, "split_sharp_edges": True}
_BAR: dict[str, Any] = {
    "title": "bending strain, %\n",  # the empty line keeps the title off the topmost number
    "vertical": True,
    "width": 0.035,
    "height": 0.5,
    "position_x": 0.9,
    "position_y": 0.28,
    "title_font_size": 20,
    "label_font_size": 18,
    "fmt": "%.1f",
    "color": "black",
}
_LABEL: dict[str, Any] = {
    "shape": None,
    "show_points": False,
    "always_visible": True,
    "text_color": "black",
    "font_size": 22,
    "justification_horizontal": "center",
    "justification_vertical": "top",
}
# Corners of one quadrilateral of a section as (r, t) slices, in the order of a VTK hexahedron's face.
_LOW, _HIGH = slice(None, -1), slice(1, None)
_CORNERS = ((_LOW, _LOW), (_HIGH, _LOW), (_HIGH, _HIGH), (_LOW, _HIGH))


class SceneError(RuntimeError):
    """No picture or mesh can be had; one line with the reason."""


@dataclass(frozen=True)
class _Outline:
    """Dimensions of the drawing, mm. ``shape`` is None for measured joints: plain rings, their flexures unknown."""

    shape: NotchShape | None
    outer: float
    inner: float
    opening: float
    cut: float  # c at the root
    neutral: float  # y of the neutral axis of the flexures
    root: float | None  # half the width of a V's root


@dataclass(frozen=True)
class _Spine:
    """The neutral line at the sections of the tube, base to tip; arrays of shape (k,), mm and rad."""

    x: Floats  # of the straight tube
    s: Floats
    along: Floats
    across: Floats
    angle: Floats
    curvature: Floats  # unsigned, 1/mm
    neutral: Floats  # y of the neutral axis
    cut: Floats  # c
    half_opening: Floats  # of the notch

    def place(self, k: Ints, y: Floats) -> tuple[Floats, Floats]:
        """Bent position (x, y) of the points of the straight tube at section k and height y."""
        lever = y - self.neutral[k]
        return self.along[k] - lever * np.sin(self.angle[k]), self.across[k] + lever * np.cos(self.angle[k])


def _outline(rig: Rig) -> _Outline:
    """Outline of a rig with equal joints."""
    if isinstance(rig.joint, MeasuredJoint):
        outer = 1.15 * max(tendon.moment_arm_mm for tendon in rig.tendons)
        return _Outline(None, outer, 0.7 * outer, 0.35 * rig.pitch_mm, outer, 0.0, None)
    tube, notch, joint = rig.joint.tube, rig.joint.cut, joint_mechanics(rig)
    outer, root = tube.outer_diameter_mm / 2, None if notch.root_width_mm is None else notch.root_width_mm / 2
    inner, neutral = tube.inner_diameter_mm / 2, -joint.flexure.neutral_offset_mm
    return _Outline(notch.shape, outer, inner, notch.width_mm, outer - notch.depth_mm, neutral, root)


def _outlines(rig: Rig) -> list[_Outline]:
    """Outlines of all joints, base first."""
    if rig.joint.alike:
        return [_outline(rig)] * rig.joints
    return [_outline(with_joint(rig, number)) for number in range(rig.joints)]


def _radians(rig: Rig, joint_angles_deg: ArrayLike) -> Floats:
    angles = np.asarray(joint_angles_deg, dtype=float)
    if angles.shape != (rig.joints,) or not np.isfinite(angles).all():
        raise SceneError(f"joint_angles_deg of shape {angles.shape}: expected {rig.joints} finite angles")
    return np.radians(angles)


def _local_stations(outline: _Outline, before: float, after: float, detail: float) -> Floats:
    """Sections of one joint, s from -``before`` to ``after``; dense where the cut or the strain varies."""

    def count(full: int) -> int:
        return max(3, round(detail * full))

    edge, outer, cut, root = outline.opening / 2, outline.outer, outline.cut, outline.root
    opening = np.linspace(0.0, edge, count(9))
    if root is not None:
        # Even steps of the angle at which the flank meets the outer surface keep the V smooth where it runs out.
        c = outer * np.cos(np.linspace(np.arccos(cut / outer), 0.0, count(15)))
        if outline.inner > cut:
            c = np.append(c, outline.inner)
        opening = np.concatenate([np.linspace(0.0, root, count(5)), root + (c - cut) / (outer - cut) * (edge - root)])

    def side(half: float) -> Floats:
        steps = np.array([0.0, 0.08, 0.3, 0.65, 1.0]) if detail > 0.5 else np.array([0.0, 1.0])
        return np.asarray(np.unique(np.round(np.concatenate([opening, edge + (half - edge) * steps]), 9)))

    return np.concatenate([-side(before)[:0:-1], side(after)])


def _spine(rig: Rig, joint_angles_deg: ArrayLike, detail: float = 1.0) -> _Spine:
    angles, outlines, places = _radians(rig, joint_angles_deg), _outlines(rig), rig.joint.places()
    heading, end, rows = 0.0, 0.0, list[Floats]()
    for i, outline in enumerate(outlines):
        middle, centre = places.middles[i], places.centres[i]
        local = _local_stations(outline, middle - end, centre - middle, detail)
        notched = with_joint(rig, i).joint
        cut = cut_height_mm(notched, local) if isinstance(notched, NotchedTube) else np.full_like(local, outline.cut)
        share, curvature = bending_along(notched, outline.opening, local)
        curvature, angle = abs(angles[i]) * curvature, heading + angles[i] * share
        half, neutral = np.full_like(local, outline.opening / 2), np.full_like(local, outline.neutral)
        row = np.array([middle + local, local, angle, curvature, neutral, cut, half])
        rows.append(row if i == 0 else row[:, 1:])  # the end of a joint's part is the start of the next
        heading, end = heading + angles[i], centre
    x, s, angle, curvature, neutral, cut, half = np.concatenate(rows, axis=1)
    # From section to section the line is an arc: exact for slots, the mean curvature of the interval for a V. Where the
    # neutral axis of the next notch lies higher or lower, the line steps across the ring.
    half_angle, step = np.diff(angle) / 2, np.diff(neutral)
    chord = np.diff(x) * np.sinc(half_angle / np.pi)
    along = chord * np.cos(angle[:-1] + half_angle) - step * np.sin(angle[:-1])
    across = chord * np.sin(angle[:-1] + half_angle) + step * np.cos(angle[:-1])
    return _Spine(
        x,
        s,
        np.concatenate([[0.0], np.cumsum(along)]),
        neutral[0] + np.concatenate([[0.0], np.cumsum(across)]),
        angle,
        curvature,
        neutral,
        cut,
        half,
    )


def _sectors(outline: _Outline, r: Floats, spine: _Spine) -> list[tuple[Floats, Floats, NDArray[np.bool_]]]:
    """Sectors of the wall: first and last angle about x, shape (r, x), and the intervals of x where it is solid."""
    ring = np.abs(spine.s[:-1] + spine.s[1:]) / 2 > spine.half_opening[:-1]
    ring |= spine.s[1:] < spine.s[:-1]  # the interval that runs over from one pitch into the next
    everywhere = np.ones_like(ring)
    if outline.shape is None:
        zero = np.zeros((r.size, spine.x.size))
        return [(zero, zero + np.pi, ring), (zero + np.pi, zero + 2 * np.pi, ring)]
    edge = np.arccos(np.clip(spine.cut / r[:, None], -1.0, 1.0))
    edge[edge < 1e-3] = 0.0  # rounding of c / r = 1 would leave a crack as wide as its square root
    edge[edge > np.pi - 1e-3] = np.pi
    if outline.shape == "rectangular":
        return [(edge, 2 * np.pi - edge, everywhere), (-edge, edge, ring)]
    arcs = [(edge, np.pi - edge, everywhere), (np.pi + edge, 2 * np.pi - edge, everywhere)]
    if outline.shape == "v_pair":
        return arcs  # a V runs out at the edge of its ring: there the two arcs close the circle
    return [*arcs, (-edge, edge, ring), (np.pi - edge, np.pi + edge, ring)]


def _straight_wall(outlines: list[_Outline], spine: _Spine, detail: float) -> tuple[Floats, Ints, Ints]:
    """Points (n, 3) of the straight wall, the section of each (n,), and hexahedra (m, 8) of them."""
    outline = outlines[0]
    r = np.linspace(outline.inner, outline.outer, 3 if detail > 0.5 else 2)
    r = np.unique([*r, *(abs(one.cut) for one in outlines if one.inner < abs(one.cut) < one.outer)])
    points, sections, cells, first = [], [], [], 0
    for start, end, solid in _sectors(outline, r, spine):
        steps = max(round(8 * min(1.0, detail)), int(np.ceil(detail * np.degrees((end - start).max()) / 4.5)))
        phi = start[:, None, :] + np.linspace(0.0, 1.0, steps + 1)[:, None] * (end - start)[:, None, :]  # (r, t, x)
        k = np.broadcast_to(np.arange(spine.x.size), phi.shape)
        y, z = r[:, None, None] * np.cos(phi), r[:, None, None] * np.sin(phi)
        points.append(np.stack([spine.x[k], y, z], axis=-1).reshape(-1, 3))
        sections.append(k.ravel())
        number = first + np.arange(phi.size).reshape(phi.shape)
        ends = number[:, :, :-1][:, :, solid], number[:, :, 1:][:, :, solid]
        cells.append(np.stack([end[i, j] for end in ends for i, j in _CORNERS], axis=-1).reshape(-1, 8))
        first += phi.size
    grid = np.round(np.concatenate(points) * 1e7).astype(np.int64)  # sectors meet where their points are the same
    _, kept, back = np.unique(grid, axis=0, return_index=True, return_inverse=True)
    hexahedra = back.ravel()[np.concatenate(cells)]
    corners = 1 + (np.diff(np.sort(hexahedra, axis=1), axis=1) > 0).sum(axis=1)
    solid_cells = hexahedra[corners >= 6]  # a sector that has shrunk to a line leaves cells without volume
    used, renumbered = np.unique(solid_cells, return_inverse=True)
    kept = kept[used]
    return np.concatenate(points)[kept], np.concatenate(sections)[kept], renumbered.reshape(-1, 8)


def _bent_wall(rig: Rig, joint_angles_deg: ArrayLike, detail: float = 1.0) -> tuple[Floats, Ints, Floats]:
    """Points (n, 3) of the bent wall in mm, hexahedra (m, 8), and the bending strain (n,) in percent."""
    outlines, spine = _outlines(rig), _spine(rig, joint_angles_deg, detail)
    straight, at, cells = _straight_wall(outlines, spine, detail)
    y, shape = straight[:, 1], outlines[0].shape
    strain = np.zeros_like(y)
    if shape is not None:
        reach = y if shape == "rectangular" else np.abs(y)
        loaded = reach <= spine.cut[at] + 1e-6  # not the free edges of the rings
        strain = np.where(loaded, 100 * np.abs(y - spine.neutral[at]) * spine.curvature[at], 0.0)
    return np.column_stack([*spine.place(at, y), straight[:, 2]]), cells, strain


def tube_mesh(rig: Rig, joint_angles_deg: ArrayLike, *, detail: float = 1.0) -> pv.PolyData:
    """Surface of the notched tube, bent.

    Parameters
    ----------
    rig
        A rig with tube and notch; measured joints are drawn as plain rings without flexures.
    joint_angles_deg
        Shape (joints,), base to tip.
    detail
        Density of the mesh along the tube and around it; 1 is for pictures. Smaller values are for interactive views in
        a browser: about a quarter leaves a tenth of the points. The strain at the root of the notch does not change.

    Returns
    -------
    pyvista.PolyData
        Closed surface in mm. Point data ``strain_percent``: distance from the neutral axis times curvature in the
        flexures; 0 in rings. At the root of the notch it is ``JointMechanics.peak_strain_per_rad`` times the angle.

    Raises
    ------
    SceneError
        For a wrong number of angles.
    RigError
        As :func:`fem_models.joint.joint_mechanics`.
    MissingError
        A library of the extra ``view`` is missing.
    """
    points, cells, strain = _bent_wall(rig, joint_angles_deg, detail)
    require_extra("view", PURPOSE)
    import pyvista as pv  # takes a second to import: only drawing waits for it

    grid = pv.UnstructuredGrid({pv.CellType.HEXAHEDRON: cells}, points)
    grid.point_data["strain_percent"] = strain
    return grid.extract_surface(algorithm="dataset_surface", pass_pointid=False, pass_cellid=False).clean()


def tendon_lines(rig: Rig, joint_angles_deg: ArrayLike) -> dict[str, Floats]:
    """Paths of tendons ``a`` and, if any, ``b``: arrays (k, 3) in mm, along the rings and straight across the openings.

    They start one pitch before the base, at y = +-moment_arm_mm. Raises as :func:`tube_mesh`.
    """
    spine = _spine(rig, joint_angles_deg)
    at_edge = np.isclose(np.abs(spine.s), spine.half_opening)
    at_edge[[0, -1]] = True
    k = np.flatnonzero(at_edge)
    lines = {}
    for name, side, tendon in zip("ab", (1, -1), rig.tendons, strict=False):
        y = side * tendon.moment_arm_mm
        line = np.column_stack([*spine.place(k, np.full(k.size, y)), np.zeros(k.size)])
        lines[name] = np.concatenate([[[-rig.mean_pitch_mm, y, 0.0]], line])
    return lines


def render(rig: Rig, joint_angles_deg: ArrayLike, path: Path, *, window: tuple[int, int] = (1400, 900)) -> None:
    """Draw the bent manipulator with its tendons into a PNG.

    A child process draws. A crash of the renderer, a missing OpenGL or an empty picture raise a SceneError and leave
    the file at ``path`` unchanged.

    Parameters
    ----------
    rig, joint_angles_deg
        As for :func:`tube_mesh`.
    path
        The PNG, in a folder that exists.
    window
        Width and height in pixels.

    Raises
    ------
    SceneError
        One line with the reason.
    MissingError
        A library of the extra ``view`` is missing.
    """
    angles = np.degrees(_radians(rig, joint_angles_deg))
    require_extra("view", PURPOSE)
    with _staged(path) as half:
        _run(pickle.dumps((rig, angles, half.resolve(), window)))
        ink = _ink(half)
        if ink < LEAST_INK:
            raise SceneError(f"the renderer drew an empty picture: {100 * ink:.2g} % of the pixels show something")


@contextmanager
def _staged(path: Path) -> Iterator[Path]:
    """Yield a temporary file next to ``path``, and move it there when the block ends without an error."""
    try:
        handle, name = tempfile.mkstemp(prefix=f".{path.stem}-", suffix=path.suffix, dir=path.parent)
    except OSError as error:
        raise SceneError(f"{path}: {error.strerror}: expected a folder that can be written to") from None
    os.close(handle)
    half = Path(name)
    try:
        yield half
        half.chmod(0o644)  # mkstemp lets only the owner read
        half.replace(path)
    except OSError as error:
        raise SceneError(f"{path}: {error.strerror or error}") from None
    finally:
        half.unlink(missing_ok=True)


def _run(job: bytes) -> None:
    # Without a display VTK renders off screen (EGL) by itself; with a dead display it may abort.
    environment = {k: v for k, v in os.environ.items() if k not in ("DISPLAY", "WAYLAND_DISPLAY")}
    try:
        child = subprocess.run(
            COMMAND, input=job, capture_output=True, timeout=TIME_LIMIT_S, check=False, env=environment
        )
    except subprocess.TimeoutExpired:
        raise SceneError(f"the renderer did not end within {TIME_LIMIT_S:g} s") from None
    except OSError as error:
        raise SceneError(f"the renderer did not start: {error.strerror}") from None
    if child.returncode < 0:
        name = signal.Signals(-child.returncode).name
        raise SceneError(f"the renderer crashed with {name}: is there an OpenGL on this machine?")
    if child.returncode:
        printed = child.stderr.decode(errors="replace").strip().splitlines() or ["no message"]
        raise SceneError(f"the renderer failed with exit code {child.returncode}: {printed[-1].strip()[:200]}")


def _ink(path: Path) -> float:
    """Share of the pixels that are not white, to the left of the scalar bar."""
    from matplotlib.image import imread

    try:
        picture = imread(path)
    except (OSError, SyntaxError, ValueError):  # what Pillow raises for a file that is no PNG
        raise SceneError("the renderer left no readable picture") from None
    return float((picture[:, : int(0.85 * picture.shape[1]), :3] < 0.99).any(axis=2).mean())


def _draw_job(stream: BinaryIO) -> None:
    """Do the job that :func:`render` pickled: the entry of the child process."""
    _draw(*pickle.load(stream))


def _draw(rig: Rig, joint_angles_deg: Floats, path: Path, window: tuple[int, int]) -> None:
    import pyvista as pv
    from matplotlib.colors import LinearSegmentedColormap

    outline, wall = _outlines(rig)[0], tube_mesh(rig, joint_angles_deg)
    plotter = pv.Plotter(off_screen=True, window_size=list(window), lighting="light kit")
    plotter.set_background("white")
    plotter.enable_anti_aliasing("ssaa")
    if wall["strain_percent"].max() > 0:
        colours = LinearSegmentedColormap.from_list("heat", _HEAT)
        plotter.add_mesh(wall, scalars="strain_percent", cmap=colours, show_scalar_bar=False, **_METAL)
        plotter.add_scalar_bar(**_BAR)
    else:
        plotter.add_mesh(wall, color=_STEEL, **_METAL)
    lines = tendon_lines(rig, joint_angles_deg)
    if outline.shape is None:  # rings without flexures are not connected
        spine = _spine(rig, joint_angles_deg)
        lines["axis"] = np.column_stack([spine.along, spine.across, np.zeros(spine.x.size)])
    drawn = [wall]
    for name, line in lines.items():
        drawn.append(pv.lines_from_points(line).tube(radius=0.035 * outline.outer, n_sides=16))
        plotter.add_mesh(drawn[-1], color=_LINES[name], specular=0.3, smooth_shading=True)
    _frame(plotter, drawn)
    plotter.screenshot(str(path))
    plotter.close()


def _frame(plotter: pv.Plotter, drawn: list[pv.PolyData]) -> None:
    """View the bending plane obliquely, from above and in front of the base; add a scale in mm and the axes."""
    import pyvista as pv

    points = np.concatenate([mesh.points for mesh in drawn])
    low, size = points.min(axis=0), float(np.ptp(points, axis=0).max())
    length = _round_length(0.25 * size)
    left, down = float(low[0]), float(low[1] - 0.08 * size)
    bar = pv.Line((left, down, 0.0), (left + length, down, 0.0)).tube(radius=0.002 * size)
    plotter.add_mesh(bar, color="black", lighting=False)
    plotter.add_point_labels([(left + length / 2, down - 0.02 * size, 0.0)], [f"{length:g} mm"], **_LABEL)
    plotter.add_axes(line_width=3, color="black", viewport=(0.86, 0.02, 0.98, 0.2))

    towards = np.array(_VIEW) / np.linalg.norm(_VIEW)
    right = np.cross((0.0, 1.0, 0.0), towards)
    right /= np.linalg.norm(right)
    up = np.cross(towards, right)
    below = np.array([[left, down - 0.07 * size, 0.0]])  # the foot of the label
    projected = np.concatenate([points, below]) @ np.column_stack([right, up])
    middle, half = (projected.max(axis=0) + projected.min(axis=0)) / 2, np.ptp(projected, axis=0) / 2
    aspect = plotter.window_size[0] / plotter.window_size[1]
    scale = max(half[1] / 0.92, half[0] / (0.8 * aspect))
    focus = right * (middle[0] + 0.14 * scale * aspect) + up * middle[1]  # the right eighth is the scalar bar's
    plotter.enable_parallel_projection()
    plotter.camera_position = [focus + 10 * size * towards, focus, (0.0, 1.0, 0.0)]
    plotter.camera.parallel_scale = scale
    plotter.reset_camera_clipping_range()


def _round_length(length: float) -> float:
    """Round down to 1, 2 or 5 times a power of ten."""
    decade = 10.0 ** np.floor(np.log10(length))
    return float(max(m * decade for m in (1, 2, 5) if m * decade <= length))
