"""The surface of a wrist that bends in two planes, and its tendons, as quadrilaterals for a picture.

The straight tube lies along +x from the base at x = 0. A notch bends in its own plane by one angle, evenly over its
width, about the tube axis; torsion, strong bending and the shift of a neutral axis are left out of the picture.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from fem_models.joint.section import cut_height_mm
from fem_models.rig.in_space import RigInSpace
from fem_models.rig.joints import NotchedTube
from fem_models.rig.rig import with_joint
from fem_models.spatial.place import rotation
from fem_models.view.manipulator import SceneError
from hysteresis.arrays import Floats

AROUND = 72
"""Quadrilaterals round the tube."""
_OVER_NOTCH = 8
_ABOVE = 1.03
"""Radius at which tendons are drawn, over that of the tube: in its wall they would not be seen."""
_STRIP_RAD = 0.045


@dataclass(frozen=True, eq=False)
class WristSurface:
    """Corners of quadrilaterals, mm: of the tube, (k, 4, 3), and of each tendon; ``tip_mm``, (3,), end of the axis."""

    tube: Floats
    tendons: tuple[Floats, ...]
    tip_mm: Floats


def wrist_surface(rig: RigInSpace, joint_angles_deg: ArrayLike) -> WristSurface:
    """Make the bent surface.

    Parameters
    ----------
    joint_angles_deg
        Shape (joints,), base to tip, each in the plane of its notch, such as a sample of ``record.notches_deg``.

    Raises
    ------
    SceneError
        Another number of angles, or angles that are not finite.
    """
    angles = np.asarray(joint_angles_deg, dtype=float)
    if angles.shape != (rig.joints,) or not np.isfinite(angles).all():
        raise SceneError(f"joint_angles_deg of shape {angles.shape}: expected {rig.joints} finite angles")
    assert isinstance(rig.rig.joint, NotchedTube)
    radius = 0.5 * rig.rig.joint.tube.outer_diameter_mm
    x, notch = _sections(rig)
    axis, frames = _bent_axis(rig, x, notch, np.radians(angles))

    def placed(around: Floats, at: float) -> Floats:
        ring = at * np.stack([0 * around, np.cos(around), np.sin(around)], axis=-1)
        return np.asarray(axis[:, None] + np.einsum("kij,aj->kai", frames, ring))

    around = 2 * np.pi * np.arange(AROUND + 1) / AROUND
    kept = ~_cut_away(rig, x, notch, 0.5 * (around[1:] + around[:-1]))
    strips = (np.radians(angle) + _STRIP_RAD * np.array([-1.0, 1.0]) for angle in rig.angles_deg)
    return WristSurface(
        _quads(placed(around, radius))[kept],
        tuple(_quads(placed(strip, _ABOVE * radius)).reshape(-1, 4, 3) for strip in strips),
        axis[-1],
    )


def _quads(points: Floats) -> Floats:
    """Corners (k - 1, a - 1, 4, 3) of the quadrilaterals of a grid of points (k, a, 3)."""
    return np.stack([points[:-1, :-1], points[1:, :-1], points[1:, 1:], points[:-1, 1:]], axis=2)


def _sections(rig: RigInSpace) -> tuple[Floats, Floats]:
    """Places x of the sections, shape (k,), and the notch of each interval, (k - 1,), -1 in a ring."""
    joint = rig.rig.joint
    assert isinstance(joint, NotchedTube)
    places = joint.places()
    x, notch = [0.0], list[int]()
    for number, middle in enumerate(places.middles):
        half = 0.5 * joint.notch.at(number).width_mm
        x += np.linspace(middle - half, middle + half, _OVER_NOTCH + 1).tolist()
        notch += [-1] + [number] * _OVER_NOTCH
    return np.array([*x, float(places.centres[-1])]), np.array([*notch, -1])


def _bent_axis(rig: RigInSpace, x: Floats, notch: Floats, angles: Floats) -> tuple[Floats, Floats]:
    """Points of the tube axis, (k, 3), and frames of the sections, (k, 3, 3): columns along the tube, y and z."""
    turns = np.radians(rig.turns_deg)
    about = np.column_stack([0 * turns, -np.sin(turns), np.cos(turns)])  # axis 3 of a notch: x turns towards its axis 2
    place, frame = np.zeros((x.size, 3)), np.tile(np.eye(3), (x.size, 1, 1))
    for k, number in enumerate(notch.astype(int)):
        step = np.zeros(3) if number < 0 else angles[number] / _OVER_NOTCH * about[number]
        half, whole = rotation(np.array([0.5 * step, step]))
        place[k + 1] = place[k] + (x[k + 1] - x[k]) * (frame[k] @ half)[:, 0]
        frame[k + 1] = frame[k] @ whole
    return place, frame


def _cut_away(rig: RigInSpace, x: Floats, notch: Floats, around: Floats) -> np.ndarray:
    """Whether the middle of a quadrilateral is in a notch, shape (k - 1, AROUND)."""
    joint = rig.rig.joint
    assert isinstance(joint, NotchedTube)
    middles, radius = joint.places().middles, 0.5 * joint.tube.outer_diameter_mm
    out = np.zeros((notch.size, around.size), dtype=bool)
    both = joint.notch.shape in ("v_pair", "rectangular_pair")
    for number in range(rig.joints):
        here = np.flatnonzero(notch == number)
        one = with_joint(rig.rig, number).joint
        assert isinstance(one, NotchedTube)
        cut = cut_height_mm(one, 0.5 * (x[here] + x[here + 1]) - middles[number])
        height = radius * np.cos(around - np.radians(rig.turns_deg[number]))
        out[here] = (np.abs(height) if both else height)[None] > cut[:, None]
    return out
