"""The surface of a wrist that bends in two planes, and its tendons, as quadrilaterals for a picture.

The straight tube lies along +x from the base at x = 0. A notch bends in its own plane by one angle about the tube axis,
as a beam under a uniform moment. Torsion, strong bending and the shift of a neutral axis are left out.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from fem_models.joint import joint_mechanics
from fem_models.joint.section import cut_height_mm
from fem_models.rig import Rig
from fem_models.rig.joints import NotchedTube
from fem_models.rig.rig import with_joint
from fem_models.spatial.place import rotation
from fem_models.view.bending import bending_along
from fem_models.view.manipulator import SceneError
from hysteresis.arrays import Floats, Ints

AROUND = 72
"""Quadrilaterals round the tube."""
_OVER_NOTCH = 8
_ABOVE = 1.03
"""Radius at which tendons are drawn, over that of the tube: in its wall they would not be seen."""
_STRIP_RAD = 0.045
_EDGE = 0.02
"""Share of a ring's length from which on it is drawn without strain."""


@dataclass(frozen=True, eq=False)
class WristSurface:
    """The outside of the bent tube, and strips and lines of its tendons, mm.

    Parameters
    ----------
    points, quads
        Shapes (n, 3) and (k, 4): quadrilaterals of the tube by the numbers of their corners.
    strain_percent
        Shape (n,): distance from the neutral axis times the curvature of the weak bending, 0 in rings. At the root of
        a notch it is ``JointMechanics.peak_strain_per_rad`` times the angle.
    tendons
        Corners of the quadrilaterals of a strip along each tendon, (k, 4, 3), on the tube.
    lines
        Path of each tendon, (k, 3), at its radius.
    tip_mm
        Shape (3,), end of the axis.
    """

    points: Floats
    quads: Ints
    strain_percent: Floats
    tendons: tuple[Floats, ...]
    lines: tuple[Floats, ...]
    tip_mm: Floats

    @property
    def tube(self) -> Floats:
        """Corners of the quadrilaterals of the tube, shape (k, 4, 3)."""
        return np.asarray(self.points[self.quads])


@dataclass(frozen=True, eq=False)
class _Sections:
    """Sections of the tube from base to tip.

    ``x``, ``turn_rad`` and ``neutral``, the height of the neutral axis, have the shape (k,), and so has ``curvature``,
    1/mm. ``bend``, the angle of each interval, and ``notch``, its number and -1 in a ring, have (k - 1,).
    """

    x: Floats
    turn_rad: Floats
    neutral: Floats
    curvature: Floats
    bend: Floats
    notch: Ints


def wrist_surface(rig: Rig, joint_angles_deg: ArrayLike) -> WristSurface:
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
    radius = 0.5 * _tube(rig, 0).tube.outer_diameter_mm
    sections = _sections(rig, np.radians(angles))
    axis, frames = _bent_axis(rig, sections)

    def placed(around: Floats, at: float) -> Floats:
        ring = at * np.stack([0 * around, np.cos(around), np.sin(around)], axis=-1)
        return np.asarray(axis[:, None] + np.einsum("kij,aj->kai", frames, ring))

    around = 2 * np.pi * np.arange(AROUND) / AROUND
    kept = ~_cut_away(rig, sections, around + np.pi / AROUND)
    number = np.arange(sections.x.size * AROUND).reshape(-1, AROUND)
    corners = _quads(np.concatenate([number, number[:, :1]], axis=1))
    height = radius * np.cos(around - sections.turn_rad[:, None])
    strain = 100 * np.abs(height - sections.neutral[:, None]) * sections.curvature[:, None]
    strips = (np.radians(angle) + _STRIP_RAD * np.array([-1.0, 1.0]) for angle in rig.angles_deg)
    places = zip(rig.angles_deg, rig.tendons, strict=True)
    return WristSurface(
        placed(around, radius).reshape(-1, 3),
        corners[kept],
        np.where(_is_loaded(corners[kept], sections, number.size), strain.ravel(), 0.0),
        tuple(_quads(placed(strip, _ABOVE * radius)).reshape(-1, 4, 3) for strip in strips),
        tuple(placed(np.radians([angle]), tendon.moment_arm_mm)[:, 0] for angle, tendon in places),
        axis[-1],
    )


def _tube(rig: Rig, number: int) -> NotchedTube:
    """Tube and notch of one joint."""
    joint = with_joint(rig.in_plane, number).joint
    assert isinstance(joint, NotchedTube)  # a rig in space has no measured joints
    return joint


def _quads(grid: Floats) -> Floats:
    """Corners (k - 1, a - 1, 4, ...) of the quadrilaterals of a grid (k, a, ...)."""
    return np.stack([grid[:-1, :-1], grid[1:, :-1], grid[1:, 1:], grid[:-1, 1:]], axis=2)


def _is_loaded(quads: Ints, sections: _Sections, points: int) -> np.ndarray:
    """Whether a point belongs to a quadrilateral between the rings, shape (points,)."""
    out = np.zeros(points, dtype=bool)
    out[quads[sections.notch[quads[:, 0] // AROUND] >= 0]] = True
    return out


def _sections(rig: Rig, angles: Floats) -> _Sections:
    """Sections over every notch, and two in each ring, where the strain ends."""
    joint = rig.joint
    assert isinstance(joint, NotchedTube)
    places, rows, notch, bend = joint.places(), [[0.0, 0.0, 0.0, 0.0]], list[int](), list[float]()
    ends = np.append(places.middles[1:], places.centres[-1])
    for number, (middle, beyond) in enumerate(zip(places.middles, ends, strict=True)):
        one, width = _tube(rig, number), joint.notch.at(number).width_mm
        s = np.linspace(-width / 2, width / 2, _OVER_NOTCH + 1)
        share, curvature = bending_along(one, width, s)
        neutral = -joint_mechanics(with_joint(rig.in_plane, number)).flexure.neutral_offset_mm
        edge = _EDGE * (beyond - middle - width / 2)
        turn = np.radians(rig.turns_deg[number])
        for at, curved in zip([s[0] - edge, *s, s[-1] + edge], [0.0, *curvature, 0.0], strict=True):
            rows.append([middle + at, turn, neutral, abs(angles[number]) * curved])
        notch += [-1, -1] + [number] * _OVER_NOTCH + [-1]
        bend += [0.0, 0.0, *(angles[number] * np.diff(share)).tolist(), 0.0]
    rows.append([float(places.centres[-1]), 0.0, 0.0, 0.0])
    x, turns, neutrals, curvatures = np.array(rows).T
    return _Sections(x, turns, neutrals, curvatures, np.array([*bend, 0.0]), np.array([*notch, -1]))


def _bent_axis(rig: Rig, sections: _Sections) -> tuple[Floats, Floats]:
    """Points of the tube axis, (k, 3), and frames of the sections, (k, 3, 3): columns along the tube, y and z."""
    turns, x = np.radians(rig.turns_deg), sections.x
    about = np.column_stack([0 * turns, -np.sin(turns), np.cos(turns)])  # axis 3 of a notch: x turns towards its axis 2
    place, frame = np.zeros((x.size, 3)), np.tile(np.eye(3), (x.size, 1, 1))
    for k, (number, bend) in enumerate(zip(sections.notch, sections.bend, strict=True)):
        step = bend * about[max(number, 0)]
        half, whole = rotation(np.array([0.5 * step, step]))
        place[k + 1] = place[k] + (x[k + 1] - x[k]) * (frame[k] @ half)[:, 0]
        frame[k + 1] = frame[k] @ whole
    return place, frame


def _cut_away(rig: Rig, sections: _Sections, around: Floats) -> np.ndarray:
    """Whether the middle of a quadrilateral is in a notch, shape (k - 1, AROUND)."""
    joint, x = rig.joint, sections.x
    assert isinstance(joint, NotchedTube)
    middles, radius = joint.places().middles, 0.5 * joint.tube.outer_diameter_mm
    out = np.zeros((sections.notch.size, around.size), dtype=bool)
    both = joint.notch.shape in ("v_pair", "rectangular_pair")
    for number in range(rig.joints):
        here = np.flatnonzero(sections.notch == number)
        cut = cut_height_mm(_tube(rig, number), 0.5 * (x[here] + x[here + 1]) - middles[number])
        height = radius * np.cos(around - np.radians(rig.turns_deg[number]))
        out[here] = (np.abs(height) if both else height)[None] > cut[:, None]
    return out
