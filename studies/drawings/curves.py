"""A rig whose joints have a measured moment-angle curve, or that of a finite element model, in place of a notch."""

from __future__ import annotations

import math
import re
from dataclasses import replace
from pathlib import Path
from typing import Any, Final

import numpy as np

from fem_models.joint import joint_mechanics
from fem_models.joint.law_of_curve import CurveLaw, law_of_curve
from fem_models.rig import Rig, RigError
from fem_models.rig.rig import Tendon
from hysteresis.arrays import Floats
from hysteresis.files import RecordError
from hysteresis.messages import listed
from hysteresis.records.record_file import column_names, read_columns

ANGLES: dict[str, float] = {"angle_deg": math.pi / 180, "angle_rad": 1.0}
MOMENTS: dict[str, float] = {"moment_Nmm": 1.0, "moment_Nm": 1e3}
DISPLACEMENTS: Final = ("displacement_mm", "displacement", "U", "u")
REACTIONS: Final = ("reaction_N", "reaction", "RF", "FORC")
"""Names of point data of a finite element model: displacement, mm, and reaction force, N, of every node."""


def rig_of_curve(path: Path, base: Rig) -> tuple[Rig, CurveLaw]:
    """Give a rig joints that have the curve of a file.

    Number and pitch of the joints, and the arms of the tendons about the neutral axis, are those of the base.

    Raises
    ------
    RigError
        One line: a file without angle and moment, a base in space, a curve that no law follows.
    """
    if not base.is_planar:
        raise RigError(f"{path}: rig {base.name} bends in space: expected a planar rig, whose joints may have a law")
    angle, moment = curve_of_vtu(path) if path.suffix.lower() == ".vtu" else curve_of_csv(path)
    law = law_of_curve(angle, moment, str(path))
    first = joint_mechanics(replace(base, joint=base.joint.of_joint(0)))
    joint = law.joint(base.joints, base.mean_pitch_mm, min(first.rigid_gap_mm, 0.5 * base.mean_pitch_mm))
    change: dict[str, Any] = {
        "joint": joint,
        "superelastic": None,
        "tendon_a": replace(base.tendon_a, moment_arm_mm=first.arms_mm.a),
        "tendon_b": None if base.tendon_b is None else _other(base.tendon_b, first.arms_mm.b, path),
    }
    if base.closure is not None and base.closure.angle_deg is None:
        change["closure"] = replace(base.closure, angle_deg=math.degrees(first.closure_angle_rad))
    return replace(base, **change), law


def _other(tendon: Tendon, arm_mm: float, path: Path) -> Tendon:
    if arm_mm <= 0:
        raise RigError(f"{path}: arm of tendon b about the neutral axis = {arm_mm:.3g} mm: expected above 0")
    return replace(tendon, moment_arm_mm=arm_mm)


def curve_of_csv(path: Path) -> tuple[Floats, Floats]:
    """Read angles, rad, and moments, Nmm, of shape (m,), in the order of the path from rest.

    Raises
    ------
    RigError
        One line: a file or a column that is missing, or is no number.
    """
    try:
        names = column_names(path)
        columns = read_columns(path, names)
    except RecordError as error:
        raise RigError(str(error)) from None
    out = []
    for known in (ANGLES, MOMENTS):
        found = [name for name in known if name in names]
        if len(found) != 1:
            raise RigError(f"{path}: columns {listed(names)}: expected one of {listed(known)}")
        out.append(known[found[0]] * columns[found[0]])
    if not all(np.isfinite(one).all() for one in out):
        raise RigError(f"{path}: expected finite numbers")
    return out[0], out[1]


def curve_of_vtu(path: Path) -> tuple[Floats, Floats]:
    """Read the steps of a finite element model: files of one name that differ in the number at its end.

    z runs along the tube, and the joint bends in x-z. The nodes with the least and the largest z of the mesh are its
    ends. The angle is that by which the far end turns against the near one, and the moment that of the reactions on
    the far end, about the middle between both. The straight joint without load comes first.

    Raises
    ------
    RigError
        One line: a file that cannot be read, or lacks displacement or reaction.
    """
    stem = re.sub(r"\d+$", "", path.stem)
    files = [one for one in path.parent.glob("*.vtu") if re.fullmatch(rf"{re.escape(stem)}\d*", one.stem)]
    files.sort(key=lambda one: int("0" + one.stem[len(stem) :]))
    steps = [_step(file) for file in files]
    angle, moment = np.array([(0.0, 0.0), *steps]).T
    return angle, moment


def _step(path: Path) -> tuple[float, float]:
    import meshio

    try:
        mesh = meshio.read(path)
    except (meshio.ReadError, OSError, ValueError, KeyError, SyntaxError):
        raise RigError(f"{path}: expected a mesh, VTU") from None
    found = []
    for known in (DISPLACEMENTS, REACTIONS):
        name = next((name for name in known if name in mesh.point_data), None)
        if name is None:
            raise RigError(f"{path}: point data {listed(sorted(mesh.point_data))}: expected one of {listed(known)}")
        found.append(np.asarray(mesh.point_data[name], dtype=float)[:, :3])
    points, (moved, force) = np.asarray(mesh.points, dtype=float), found
    z = points[:, 2]
    near, far = z < z.min() + 1e-6 * np.ptp(z), z > z.max() - 1e-6 * np.ptp(z)
    now = points + moved
    angle = _turn(points[far], now[far]) - _turn(points[near], now[near])
    arm = now[far] - 0.5 * (now[far].mean(axis=0) + now[near].mean(axis=0))
    return angle, float((arm[:, 2] * force[far, 0] - arm[:, 0] * force[far, 2]).sum())


def _turn(before: Floats, after: Floats) -> float:
    """Angle about y by which a face has turned, positive from z towards x, by least squares."""
    one, other = (points[:, [0, 2]] - points[:, [0, 2]].mean(axis=0) for points in (before, after))
    (x, z), (u, w) = one.T, other.T
    return math.atan2(float((z * u - x * w).sum()), float((x * u + z * w).sum()))
