"""The whole notched tube as a solid, for other programs: STEP and STL, by gmsh's OpenCASCADE kernel.

Axes: z along the tube, from the base, with z = 0 at the end of the uncut tube before the first notch; x where a notch
without turn bends to, so that it is cut at +x, y across. Notches are cut by the planes of the rig, as in
:mod:`fem_models.solid.mesh`.
"""

from __future__ import annotations

import contextlib
import math
import os
import re
import sys
import tempfile
from collections.abc import Iterator
from pathlib import Path
from typing import Final

from fem_models.rig import Rig
from fem_models.rig.joints import Cut, Tube
from fem_models.rig.rig import notched_tube
from fem_models.solid.mesh import gmsh_session
from hysteresis.own import MAKER

AROUND: Final = 48
"""Edges of a surface of triangles round the tube: within 0.2 % of its radius."""
_DELAUNAY: Final = 5
_COUNTED = re.compile(r"(Open CASCADE STEP translator [\d.]+) \d+(?:\.\d+)*")


def tube_step(rig: Rig) -> bytes:
    """Give the tube as a STEP file, in mm.

    Raises
    ------
    RigError
        Measured joints.
    """
    import gmsh

    with tempfile.TemporaryDirectory() as folder, gmsh_session():
        path = Path(folder) / "tube.step"
        gmsh.option.setString("Geometry.OCCTargetUnit", "MM")
        _cut_tube(rig)
        with _quiet():
            gmsh.write(str(path))
        return _marked_step(path.read_bytes())


def tube_stl(rig: Rig) -> bytes:
    """Give the surface of the tube as triangles, binary STL, in mm; errors as :func:`tube_step`."""
    import gmsh

    with tempfile.TemporaryDirectory() as folder, gmsh_session():
        path = Path(folder) / "tube.stl"
        _cut_tube(rig)
        option = gmsh.option.setNumber
        option("Mesh.MeshSizeFromCurvature", AROUND)
        option("Mesh.MeshSizeExtendFromBoundary", 0)
        option("Mesh.Algorithm", _DELAUNAY)
        option("Mesh.Binary", 1)
        gmsh.model.mesh.generate(2)
        gmsh.write(str(path))
        content = path.read_bytes()
    return f"{MAKER}: {rig.name}".encode("ascii", "replace")[:80].ljust(80) + content[80:]


@contextlib.contextmanager
def _quiet() -> Iterator[None]:
    """Keep the messages of OpenCASCADE, which knows no Python, away from standard output."""
    sys.stdout.flush()
    kept = os.dup(1)
    nowhere = os.open(os.devnull, os.O_WRONLY)
    try:
        os.dup2(nowhere, 1)
        yield
    finally:
        os.dup2(kept, 1)
        os.close(kept)
        os.close(nowhere)


def _marked_step(content: bytes) -> bytes:
    """Put the mark of the maker, a comment, before the header; take out the time and a number that counts calls."""
    lines = _COUNTED.sub(r"\1", content.decode("utf-8")).splitlines()
    begin = next(k for k, line in enumerate(lines) if line.startswith("FILE_NAME"))
    end = next(k for k in range(begin, len(lines)) if lines[k].endswith(";"))
    name = f"FILE_NAME('tube','',(''),(''),'','{MAKER}','');"
    return "\n".join([lines[0], f"/* made by {MAKER} */", *lines[1:begin], name, *lines[end + 1 :], ""]).encode("utf-8")


def _cut_tube(rig: Rig) -> None:
    """Model the tube in the open session."""
    import gmsh

    joint, places = notched_tube(rig), notched_tube(rig).places()
    turns = rig.turns_deg
    first, last = joint.notch.at(0).spacing_mm, joint.notch.at(joint.joints - 1).spacing_mm
    long, occ = places.centres[-1] + 0.5 * (first + last), gmsh.model.occ
    outer, inner = joint.tube.outer_diameter_mm / 2, joint.tube.inner_diameter_mm / 2
    tube = occ.addCylinder(0, 0, 0, 0, 0, long, outer)
    bore = occ.addCylinder(0, 0, -0.1 * long, 0, 0, 1.2 * long, inner)
    hollow = occ.cut([(3, tube)], [(3, bore)])[0]
    cutters = [
        _cutter(joint.tube, joint.notch.at(k), places.middles[k] + first / 2, turns[k] + 180.0 * side)
        for k in range(joint.joints)
        for side in range(2 - joint.one_sided)
    ]
    occ.cut(hollow, cutters)
    occ.synchronize()


def _cutter(tube: Tube, cut: Cut, middle_mm: float, turn_deg: float) -> tuple[int, int]:
    """Prism with the profile of a cut: across the tube at +x, then turned about the tube."""
    import gmsh

    occ, outer = gmsh.model.occ, tube.outer_diameter_mm / 2
    face, edge = outer - cut.depth_mm, cut.width_mm / 2
    root = edge if cut.root_width_mm is None else cut.root_width_mm / 2
    slope = (edge - root) / cut.depth_mm
    far, broad = outer + cut.depth_mm, edge + slope * cut.depth_mm
    profile = [(face, -root), (far, -broad), (far, broad), (face, root)]
    if root == 0:
        profile = profile[:3]
    points = [occ.addPoint(x, -1.1 * outer, middle_mm + z) for x, z in profile]
    lines = [occ.addLine(one, other) for one, other in zip(points, points[1:] + points[:1], strict=True)]
    surface = occ.addPlaneSurface([occ.addCurveLoop(lines)])
    prism = next(one for one in occ.extrude([(2, surface)], 0, 2.2 * outer, 0) if one[0] == 3)
    occ.rotate([prism], 0, 0, 0, 0, 0, 1, math.radians(turn_deg))
    return prism
