"""Solid mesh of one single notched ring (SNR): half a ring, the notch, half a ring.

Axes as in :mod:`fem_models.joint.section`: z along the tube with z = 0 in the middle of the notch, x in the bending
plane, cut faces normal to x; a one-sided notch lies at +x. gmsh's OpenCASCADE kernel cuts a quarter (y > 0, z > 0),
which is mirrored twice. The mesh therefore has the symmetries of the metal, and couplings that these forbid vanish to
rounding.
"""

from __future__ import annotations

import ctypes
import math
import signal
import tempfile
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path

import meshio
import numpy as np
from skfem import MeshTet2

from fem_models.joint.section import cut_height_mm, section
from fem_models.rig import Rig, RigError
from fem_models.rig.rig import notched_tube
from hysteresis.arrays import Floats, Ints

# Vertices 0 and 1 swapped, with the middles of their edges: a mirror image has a negative Jacobian.
_MIRRORED = [1, 0, 2, 3, 4, 6, 5, 8, 7, 9]


@dataclass(frozen=True)
class _Profile:
    """Half of a cut in the x-z plane: straight up at ``cut`` to ``root``, then to ``edge`` at the outer surface."""

    outer: float
    inner: float
    cut: float
    root: float
    edge: float
    half_pitch: float
    fillet: float
    both_sides: bool


@dataclass(frozen=True)
class MeshSize:
    """Target edge lengths, mm: of the rings, of the roots of the notch, and the distance between the two sizes.

    To refine systematically, divide both sizes by one factor.
    """

    ring_mm: float
    root_mm: float
    reach_mm: float


def mesh_size(rig: Rig, *, fillet_mm: float = 0.0, refinement: float = 1.0) -> MeshSize:
    """Edge lengths that bring the default SNR's bending stiffness within 1 % of the converged one, 2 % if it is sharp.

    Rings have one quadratic element over the wall, and at least 24 around the tube. At sharp corners, where the strain
    is singular, elements have 0.15 of the narrower of wall and arc; a fillet has four along its arc.

    Raises
    ------
    RigError
        As :func:`snr_mesh`.
    """
    profile = _profile(rig, fillet_mm)
    if not refinement > 0:
        raise ValueError(f"refinement = {refinement}: expected above 0")
    wall = profile.outer - profile.inner
    root = section(notched_tube(rig), 0.0)
    width = float(root.area_mm2) / wall / (2 if profile.both_sides else 1)
    ring = min(wall, math.pi * (profile.outer + profile.inner) / 24)
    fine = 0.15 * min(wall, width, 4 * profile.root)
    if fillet_mm > 0:
        fine = min(2 * fine, 0.4 * fillet_mm)  # no singular corner to resolve
    return MeshSize(ring / refinement, min(fine, ring) / refinement, 1.5 * wall)


def snr_mesh(rig: Rig, *, refinement: float = 1.0, fillet_mm: float = 0.0, path: Path | None = None) -> MeshTet2:
    """Mesh one SNR, a pitch long, with curved quadratic tetrahedra refined at the roots of the notch.

    Parameters
    ----------
    rig
        With tube and notch.
    refinement
        Divides the edge lengths of :func:`mesh_size`.
    fillet_mm
        Radius of the corners at the root. 0 is the sharp corner of the analytic model: stiffness converges, the strain
        in the corner does not.
    path
        Where to keep gmsh's file of the quarter (``.msh``); it is deleted by default.

    Returns
    -------
    skfem.MeshTet2
        Points in mm; every element has a positive Jacobian.

    Raises
    ------
    RigError
        Measured joints, or a fillet that does not fit the root.
    RuntimeError
        A mesh with folded elements.
    """
    profile, size = _profile(rig, fillet_mm), mesh_size(rig, fillet_mm=fillet_mm, refinement=refinement)
    with tempfile.TemporaryDirectory() as folder:
        file = path or Path(folder) / "snr.msh"
        with gmsh_session():
            _cut_quarter(profile)
            _grade(profile, size)
            _generate(file)
        quarter = meshio.read(file, file_format="gmsh")  # the ending alone could be of another program
    used, corners = np.unique(quarter.cells_dict["tetra10"], return_inverse=True)
    points, cells = quarter.points[used], corners.reshape(-1, 10)
    for axis in (1, 2):
        points, cells = _with_mirror_image(points, cells, axis)
    return MeshTet2(np.ascontiguousarray(points.T), np.ascontiguousarray(cells.T))


def _profile(rig: Rig, fillet_mm: float) -> _Profile:
    joint, cut = notched_tube(rig), float(cut_height_mm(notched_tube(rig), 0.0))
    tube, notch = joint.tube, joint.cut
    edge = notch.width_mm / 2
    root = edge if notch.root_width_mm is None else notch.root_width_mm / 2
    outer = tube.outer_diameter_mm / 2
    # the tangent point of the fillet on the flat of the root may reach its middle, no further
    flat = fillet_mm * math.tan(math.atan2(outer - cut, edge - root) / 2)
    if not 0 <= fillet_mm < math.inf or flat > root:
        raise RigError(
            f"fillet_mm = {fillet_mm}: expected 0 up to {root * fillet_mm / max(flat, 1e-300):g} mm, half the root"
        )
    return _Profile(
        outer=outer,
        inner=tube.inner_diameter_mm / 2,
        cut=cut,
        root=root,
        edge=edge,
        half_pitch=notch.pitch_mm / 2,
        fillet=fillet_mm,
        both_sides=notch.shape != "rectangular",
    )


@contextmanager
def _broken_pipes_as_before() -> Iterator[None]:
    """Put back what a broken pipe does: Python ignores the signal, gmsh lets it end the process without a word.

    A renderer or a worker that dies would take the whole program with it. ``signal.signal`` works in the main thread
    alone, and a study may mesh in another.
    """
    if not hasattr(signal, "SIGPIPE"):
        yield
        return
    get, put = ctypes.pythonapi.PyOS_getsig, ctypes.pythonapi.PyOS_setsig
    get.argtypes, get.restype = [ctypes.c_int], ctypes.c_void_p
    put.argtypes, put.restype = [ctypes.c_int, ctypes.c_void_p], ctypes.c_void_p
    before = get(signal.SIGPIPE)
    try:
        yield
    finally:
        put(signal.SIGPIPE, before)


@contextmanager
def gmsh_session() -> Iterator[None]:
    """Open a session of gmsh, which is global: quiet, on one thread, so that the same input gives the same mesh."""
    import gmsh

    with _broken_pipes_as_before():
        gmsh.initialize(interruptible=False, readConfigFiles=False)
    try:
        gmsh.option.setNumber("General.Terminal", 0)
        gmsh.option.setNumber("General.NumThreads", 1)
        yield
    finally:
        gmsh.finalize()


def _cut_quarter(profile: _Profile) -> None:
    import gmsh

    occ, length = gmsh.model.occ, profile.half_pitch
    outer = occ.addCylinder(0, 0, 0, 0, 0, length, profile.outer, angle=math.pi)
    bore = occ.addCylinder(0, 0, -length, 0, 0, 3 * length, profile.inner, angle=math.pi)
    sides = (1, -1) if profile.both_sides else (1,)
    occ.cut([(3, outer)], [(3, bore), *(_cutter(profile, side) for side in sides)])
    occ.synchronize()


def _cutter(profile: _Profile, side: int) -> tuple[int, int]:
    """Prism along y with the profile of half a cut, from below z = 0 to beyond the outer surface."""
    import gmsh

    occ, below = gmsh.model.occ, -0.1 * profile.half_pitch
    run = np.array([profile.outer - profile.cut, profile.edge - profile.root])
    corner, flank = np.array([profile.cut, profile.root]), run / np.hypot(*run)
    far = corner + 2 * run  # twice the depth is beyond the tube
    tangent = profile.fillet * math.tan(math.atan2(flank[0], flank[1]) / 2)

    def point(place: Floats) -> int:
        return int(occ.addPoint(side * place[0], -profile.outer, place[1]))

    foot, top, end = (point(np.array(p)) for p in ([profile.cut, below], far, [far[0], below]))
    if tangent > 0:
        first, last = point(corner - np.array([0.0, tangent])), point(corner + tangent * flank)
        centre = point(corner + np.array([profile.fillet, -tangent]))
        root = [occ.addLine(foot, first), occ.addCircleArc(first, centre, last), occ.addLine(last, top)]
    else:
        sharp = point(corner)
        root = [occ.addLine(foot, sharp), occ.addLine(sharp, top)]
    outline = occ.addCurveLoop([*root, occ.addLine(top, end), occ.addLine(end, foot)])
    prism = occ.extrude([(2, occ.addPlaneSurface([outline]))], 0, 3 * profile.outer, 0)
    return next(entity for entity in prism if entity[0] == 3)


def _grade(profile: _Profile, size: MeshSize) -> None:
    """Request small elements at the curves where the flat of the root ends."""
    import gmsh

    margin = 2 * profile.fillet + 1e-4 * profile.outer
    sides = (profile.cut, -profile.cut) if profile.both_sides else (profile.cut,)
    roots = []
    for dimension, tag in gmsh.model.getEntities(1):
        x0, _, z0, x1, _, z1 = gmsh.model.getBoundingBox(dimension, tag)
        in_z = z0 > profile.root - margin and z1 < profile.root + margin
        if in_z and any(x0 > cut - margin and x1 < cut + margin for cut in sides):
            roots.append(tag)
    field = gmsh.model.mesh.field
    distance, threshold = field.add("Distance"), field.add("Threshold")
    field.setNumbers(distance, "CurvesList", roots)
    field.setNumber(distance, "Sampling", 50)
    field.setNumber(threshold, "InField", distance)
    field.setNumber(threshold, "SizeMin", size.root_mm)
    field.setNumber(threshold, "SizeMax", size.ring_mm)
    field.setNumber(threshold, "DistMin", min(max(profile.fillet, size.root_mm), 0.5 * size.reach_mm))
    field.setNumber(threshold, "DistMax", size.reach_mm)
    field.setAsBackgroundMesh(threshold)
    for source in ("ExtendFromBoundary", "FromPoints", "FromCurvature"):
        gmsh.option.setNumber(f"Mesh.MeshSize{source}", 0)


def _generate(path: Path) -> None:
    import gmsh

    mesh = gmsh.model.mesh
    mesh.generate(3)
    mesh.setOrder(2)
    mesh.optimize("HighOrderElastic")
    mesh.optimize("HighOrder")
    elements = mesh.getElementsByType(11)[0]  # 11: the ten-node tetrahedron
    least = float(mesh.getElementQualities(elements, "minDetJac").min())
    if least <= 0:
        raise RuntimeError(f"gmsh left folded elements, least Jacobian {least:.2g} mm^3: expected above 0")
    gmsh.write(str(path))


def _with_mirror_image(points: Floats, cells: Ints, axis: int) -> tuple[Floats, Ints]:
    """Add the mirror image in the plane where coordinate ``axis`` is 0; nodes in the plane are shared."""
    tolerance = 1e-6 * float(np.ptp(points[:, axis]))
    inside = np.abs(points[:, axis]) > tolerance
    points = points.copy()
    points[~inside, axis] = 0.0
    image = points[inside].copy()
    image[:, axis] *= -1
    number = np.arange(len(points))
    number[inside] = len(points) + np.arange(len(image))
    return np.concatenate([points, image]), np.concatenate([cells, number[cells][:, _MIRRORED]])
