"""Static equilibrium without friction of notches that differ: every joint has an angle of its own.

Without friction a tendon has one tension T along the tube. Joint i, of the stiffness k_i, balances the moments of both
tendons on their levers A_i(t) = a_i cos(t/2) + w_i/2 sin(t/2) and B_i(t) = b_i cos(t/2) - w_i/2 sin(t/2),

    k_i (t_i - rest) = A_i(t_i) T_a - B_i(t_i) T_b

and the tensions follow from the stretch of the whole tendons, which all joints shorten together. The potential energy
has these residuals for its slopes, so that Newton's matrix is symmetric: a diagonal and one dyad a tendon.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from fem_models.joint import JointRow, joint_row
from fem_models.rig import Rig, RigError
from fem_models.rig.tendon_law import tendon_stiffness_N_per_mm, tendon_tension_N
from hysteresis.arrays import Floats

_ITERATIONS, _HALVINGS = 100, 12
_LARGEST_RAD = 0.1
_UPHILL = 0.5  # slope of the energy at the end of a step, over that at its start, at most
_TOLERANCE = 1e-12
"""Largest moment that the joints leave over, over the stiffest joint times a radian."""


class Bending(NamedTuple):
    """Equilibria, one row each: joint angles (m, N), rad, tensions (m,), N, and drives (m,), mm."""

    angles_rad: Floats
    tension_a_N: Floats
    tension_b_N: Floats
    drive_mm: Floats


class _Pull(NamedTuple):
    """Levers of a tendon in the direction of positive angles, and their slopes (m, N); tension and slope (m,)."""

    lever: Floats
    bow: Floats
    tension: Floats
    stiffness: Floats


@dataclass(frozen=True)
class _Joints:
    """What the equations take of a rig; arrays of shape (N,), arms and widths of both tendons (2, N)."""

    rig: Rig
    row: JointRow

    @property
    def stiffness(self) -> Floats:
        """Bending stiffness of each joint, Nmm/rad, without the material loop."""
        return self.row.of("flexure.bending_Nmm_per_rad") * (1 - self.rig.material.loop_share)

    @property
    def widths(self) -> Floats:
        """Widths of the notches."""
        return self.row.of("turning_length_mm") + self.row.of("rigid_gap_mm")

    def pull(self, side: int, angles: Floats, drive: Floats) -> _Pull:
        """Levers and tension of tendon a (side 1) or b (-1) at angles (m, N) and drives (m,)."""
        tendon, arm = self.rig.tendons[0 if side > 0 else 1], self.row.of("arms_mm")[:, 0 if side > 0 else 1]
        half, rest, width = 0.5 * side * angles, 0.5 * side * self.row.first.rest_angle_rad, self.widths

        def path(bent: ArrayLike) -> Floats:
            return np.asarray(2 * (arm * np.sin(bent) + width * np.sin(np.asarray(bent) / 2) ** 2))

        stretch = side * drive - path(half).sum(axis=-1) + path(rest).sum()
        tension = tendon_tension_N(tendon, stretch, self.rig.preload_N, self.rig.length_mm)
        lever = side * (arm * np.cos(half) + width / 2 * np.sin(half))
        bow = 0.5 * (width / 2 * np.cos(half) - arm * np.sin(half))
        return _Pull(lever, bow, tension, tendon_stiffness_N_per_mm(tendon, tension, self.rig.length_mm))

    def balance(self, angles: Floats, drive: Floats) -> tuple[Floats, Floats, Floats]:
        """Moments left over (m, N), their slopes by the angles (m, N, N) and by the drive (m, N)."""
        left = -self.stiffness * (angles - self.row.first.rest_angle_rad)
        slope = np.zeros((*angles.shape, angles.shape[-1]))
        diagonal, by_drive = np.broadcast_to(-self.stiffness, angles.shape).copy(), np.zeros_like(angles)
        for side in (1, -1)[: len(self.rig.tendons)]:
            pull = self.pull(side, angles, drive)
            left = left + pull.lever * pull.tension[:, None]
            diagonal += pull.bow * pull.tension[:, None]
            slope -= pull.stiffness[:, None, None] * pull.lever[:, :, None] * pull.lever[:, None, :]
            by_drive += side * pull.stiffness[:, None] * pull.lever
        slope[:, np.arange(angles.shape[-1]), np.arange(angles.shape[-1])] += diagonal
        return left, slope, by_drive


def bend_at_drive(rig: Rig, drive_mm: ArrayLike) -> Bending:
    """Equilibria at drives, shape (m,).

    Raises
    ------
    RigError
        Where no equilibrium is found, or a notch closes.
    """
    drive = np.atleast_1d(np.asarray(drive_mm, dtype=float))
    return _solved(rig, drive, None)


def bend_to_angle(rig: Rig, theta_sum_rad: ArrayLike) -> Bending:
    """Equilibria at bendings of the whole manipulator, shape (m,); two tendons.

    Raises
    ------
    RigError
        As :func:`bend_at_drive`.
    """
    theta = np.atleast_1d(np.asarray(theta_sum_rad, dtype=float))
    return _solved(rig, np.zeros_like(theta), theta)


def _solved(rig: Rig, drive: Floats, theta: Floats | None) -> Bending:
    """Find equilibria by Newton's method, at drives, or at bendings ``theta`` with the drives unknown."""
    joints, n = _Joints(rig, joint_row(rig)), rig.joints
    angles = np.full((drive.size, n), joints.row.first.rest_angle_rad)
    if theta is not None:
        angles = np.repeat(theta[:, None] / n, n, axis=1)
        arm = float(np.abs(joints.row.of("arms_mm")[:, 0]).mean())
        drive = arm * (theta - n * joints.row.first.rest_angle_rad)
    scale = float(joints.stiffness.max())
    left, slope, by_drive = joints.balance(angles, drive)
    for _ in range(_ITERATIONS):
        size = np.abs(left).max(axis=1)
        if (size <= _TOLERANCE * scale).all():
            break
        turn, wind = _step(left, slope, by_drive, bordered=theta is not None)
        largest = np.maximum(np.abs(turn).max(axis=1), 1e-300)
        part = np.minimum(1.0, _LARGEST_RAD / largest)
        downhill = (left * turn).sum(axis=1)  # the slope of the energy along the step, its sign turned
        for _ in range(_HALVINGS):
            trial = joints.balance(angles + part[:, None] * turn, drive + part * wind)
            worse = (trial[0] * turn).sum(axis=1) < -_UPHILL * np.abs(downhill)
            worse &= size > _TOLERANCE * scale
            if not worse.any():
                break
            part = np.where(worse, 0.5 * part, part)
        angles, drive = angles + part[:, None] * turn, drive + part * wind
        left, slope, by_drive = trial
    else:
        worst = int(np.abs(left).max(axis=1).argmax())
        raise RigError(f"rig {rig.name}: no equilibrium found near a drive of {drive[worst]:g} mm")
    _require_open(joints, angles)
    pulls = [joints.pull(side, angles, drive).tension for side in (1, -1)[: len(rig.tendons)]]
    return Bending(angles, pulls[0], pulls[1] if len(pulls) == 2 else np.zeros_like(pulls[0]), drive)


def _step(left: Floats, slope: Floats, by_drive: Floats, *, bordered: bool) -> tuple[Floats, Floats]:
    """Newton's step of angles and drives; bordered by the condition that the sum of the angles stays."""
    if not bordered:
        return np.asarray(np.linalg.solve(slope, -left[:, :, None])[:, :, 0]), np.zeros(len(left))
    m, n = left.shape
    matrix = np.zeros((m, n + 1, n + 1))
    matrix[:, :n, :n], matrix[:, :n, n], matrix[:, n, :n] = slope, by_drive, 1.0
    step = np.linalg.solve(matrix, np.concatenate([-left, np.zeros((m, 1))], axis=1)[:, :, None])[:, :, 0]
    return np.asarray(step[:, :n]), np.asarray(step[:, n])


def _require_open(joints: _Joints, angles: Floats) -> None:
    """Raise a RigError where a bending closes a notch, in either direction."""
    limit = np.minimum(joints.row.of("closure_angle_rad"), math.pi)
    past = np.argwhere(~(np.abs(angles) <= limit * (1 + 1e-12)))
    if past.size:
        sample, number = past[0]
        raise RigError(
            f"joint {number + 1} = {math.degrees(angles[sample, number]):g} deg: expected within "
            f"+-{math.degrees(limit[number]):g} deg, where the notch of rig {joints.rig.name} stays open"
        )
