"""Kinematics of the manipulator: the tube as a chain of joints, its tendons, and the theory curve without friction.

Everything lies in the bending plane: x along the straight tube from its base, y across towards tendon a. Joints sit
in the middle of the notches, on the neutral axis; rings are rigid. The equations stand in
``docs/theory/analytic-model.md``; eq. 2 and 3 are those of the paper (Mech. Sci. 9, 2018, section 2.2).
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.polynomial import chebyshev
from numpy.typing import ArrayLike
from scipy.optimize.elementwise import find_root

from fem_models.analytic.unequal_joints import Bending, bend_at_drive, bend_to_angle
from fem_models.joint import JointMechanics, joint_mechanics
from fem_models.joint.hardening import beyond_linear_rad
from fem_models.load import LoadProgram
from fem_models.load.run_record import simulated_record
from fem_models.rig import Rig, RigError
from fem_models.rig.joints import MeasuredJoint, NotchedTube
from fem_models.rig.rig import EFFECT_TABLES, Tendon, require_planar
from fem_models.rig.tendon_law import tendon_stretch_mm, tendon_tension_N
from hysteresis.arrays import Floats
from hysteresis.records.record import Record


class TipPose(NamedTuple):
    """Tip of the manipulator in the bending plane; the shape of the joint angles without their last axis."""

    x_mm: Floats
    y_mm: Floats
    angle_rad: Floats


class TheoryCurve(NamedTuple):
    """Static equilibrium without friction, sample by sample, shape (m,). Tensions are those of the whole tendon."""

    angle_deg: Floats
    tension_a_N: Floats
    tension_b_N: Floats


@dataclass(frozen=True)
class InverseFit:
    """theta_sum as a polynomial of the tip's position across the tube, for equal joint angles.

    Call it with ``y_mm`` (any shape); it returns theta_sum in rad. ``coefficients`` are those of a Chebyshev series
    in y / ``y_limit_mm``; ``max_residual_deg`` is the largest error found inside the fitted range.
    """

    coefficients: tuple[float, ...]
    y_limit_mm: float
    max_residual_deg: float

    def __call__(self, y_mm: ArrayLike) -> Floats:
        """Bending angle, rad, at the position ``y_mm`` of the tip; ValueError outside the fitted range."""
        y = np.asarray(y_mm, dtype=float)
        outside = ~(np.abs(y) <= self.y_limit_mm * (1 + 1e-12))
        if outside.any():
            raise ValueError(
                f"y_mm = {y[outside].flat[0]:g}: expected within +-{self.y_limit_mm:g} mm, the fitted range"
            )
        return np.asarray(chebyshev.chebval(y / self.y_limit_mm, self.coefficients), dtype=float)


def _joint_angles(rig: Rig, joint_angles_rad: ArrayLike) -> Floats:
    angles = np.asarray(joint_angles_rad, dtype=float)
    if angles.ndim == 0 or angles.shape[-1] != rig.joints:
        raise ValueError(f"joint_angles_rad: shape {angles.shape}: expected (..., {rig.joints}), one angle a joint")
    return angles


def tip_pose(rig: Rig, joint_angles_rad: ArrayLike) -> TipPose:
    """Tip of the chain of links and joints, eq. 2 in the plane.

    Half a pitch lies between base and first joint and between last joint and tip, one pitch between joints; of notches
    that differ joints are in the middle of theirs.

    Parameters
    ----------
    joint_angles_rad
        Shape (..., N), relative rotations, base first.

    Raises
    ------
    ValueError
        If the last axis does not have one angle a joint.
    """
    heading = np.cumsum(_joint_angles(rig, joint_angles_rad), axis=-1)
    first, links = _links(rig)
    tip = first + np.exp(1j * heading) @ links
    return TipPose(tip.real, tip.imag, heading[..., -1])


def _links(rig: Rig) -> tuple[float, Floats]:
    """Lengths from base to first joint, and from each joint to the next one, at the last to the tip, shape (N,)."""
    if rig.joint.alike:
        links = np.full(rig.joints, rig.pitch_mm)
        links[-1] /= 2
        return rig.pitch_mm / 2, links
    middles, centres = rig.joint.places()
    return middles[0], np.diff(middles, append=centres[-1])


def chain_transforms(rig: Rig, joint_angles_rad: ArrayLike) -> Floats:
    """Frames of the chain in the base frame, homogeneous, shape (..., N + 2, 4, 4): eq. 2, product by product.

    Standard Denavit-Hartenberg links with theta_i, d = 0, alpha = 0 and a = H(i), the rotation before the
    translation. Frame 0 (after T_b^0) has its origin on joint 1, frame i on joint i + 1; H(N) = 0, so that frame N
    has its origin on the last joint and the orientation of the last ring; the last frame (after T_N^d) is the tip.

    Parameters
    ----------
    joint_angles_rad
        Shape (..., N), relative rotations, base first.

    Raises
    ------
    ValueError
        If the last axis does not have one angle a joint.
    """
    angles = _joint_angles(rig, joint_angles_rad)
    (first, links), straight = _links(rig), np.zeros(angles.shape[:-1])
    frames = [_link(straight, first)]
    for i in range(rig.joints):
        length = links[i] if i < rig.joints - 1 else 0.0
        frames.append(frames[-1] @ _link(angles[..., i], length))
    frames.append(frames[-1] @ _link(straight, links[-1]))
    return np.stack(frames, axis=-3)


def _link(angle: Floats, length: float) -> Floats:
    """Rot_z(angle) Trans_x(length), shape (..., 4, 4)."""
    c, s, zero, one = np.cos(angle), np.sin(angle), np.zeros_like(angle), np.ones_like(angle)
    rows = [[c, -s, zero, length * c], [s, c, zero, length * s], [zero, zero, one, zero], [zero, zero, zero, one]]
    return np.stack([np.stack(row, axis=-1) for row in rows], axis=-2)


def equal_joints(rig: Rig, theta_sum_rad: ArrayLike) -> Floats:
    """Joint angles, shape (..., N), that share the bending ``theta_sum_rad`` (shape (...)) equally.

    Raises
    ------
    RigError
        Notches that differ.
    """
    if not rig.joint.alike:
        raise RigError(f"rig {rig.name}: joints that differ do not bend alike: expected equal notches")
    theta = np.asarray(theta_sum_rad, dtype=float)
    return np.repeat(theta[..., None] / rig.joints, rig.joints, axis=-1)


def inverse_tip(rig: Rig, limit_deg: float = 60.0, degree: int = 11) -> InverseFit:
    """Inverse kinematics by the curve fit of the paper (section 2.2): theta_sum from the tip's position y.

    Assumes equal joint angles. ``drive_for_angle_mm(rig, inverse_tip(rig)(y))`` is then the paper's zeta, eq. 3.

    Parameters
    ----------
    limit_deg
        The fit covers -limit_deg..limit_deg.
    degree
        Odd degree of the polynomial; the even coefficients vanish because y is odd in the angle.

    Raises
    ------
    ValueError
        If y does not grow with the angle over the whole range (beyond about 130 deg it returns), or the degree is
        not odd.
    """
    if degree < 1 or degree % 2 == 0:
        raise ValueError(f"degree = {degree}: expected an odd number of at least 1")
    limit = math.radians(limit_deg)
    dense = np.linspace(-limit, limit, 2001)
    y = tip_pose(rig, equal_joints(rig, dense)).y_mm
    if not (limit > 0 and (np.diff(y) > 0).all()):
        raise ValueError(f"limit_deg = {limit_deg:g}: expected a range in which the tip's y grows with the angle")
    nodes = limit * chebyshev.chebpts1(8 * degree)
    y_limit = float(y[-1])
    fit = chebyshev.chebfit(tip_pose(rig, equal_joints(rig, nodes)).y_mm / y_limit, nodes, degree)
    fit[::2] = 0.0
    residual = np.abs(chebyshev.chebval(y / y_limit, fit) - dense).max()
    return InverseFit(tuple(fit.tolist()), y_limit, math.degrees(residual))


@dataclass(frozen=True)
class _EqualJoints:
    """A rig with equal joints, so that one unknown remains: the bending ``theta`` of the manipulator, rad."""

    rig: Rig
    joint: JointMechanics

    @property
    def limit_rad(self) -> float:
        """Bending at which the notches close, or 180 deg a joint where no notch is known."""
        return self.rig.joints * min(self.joint.closure_angle_rad, math.pi)

    @property
    def rest_rad(self) -> float:
        """Bending at rest."""
        return self.rig.joints * self.joint.rest_angle_rad

    @property
    def stiffness(self) -> float:
        """Bending stiffness, Nmm/rad: the elastic part, to which the material loop is added as hysteresis."""
        return self.joint.flexure.bending_Nmm_per_rad * (1 - self.rig.material.loop_share) / self.rig.joints

    def resistance_Nmm(self, theta: Floats) -> Floats:
        """Moment of the flexures at a bending."""
        bent, hardening = np.asarray(theta - self.rest_rad, dtype=float), self.joint.hardening
        if hardening.is_linear:
            return self.stiffness * bent
        n = self.rig.joints
        return self.stiffness * (bent + n * beyond_linear_rad(bent / n, hardening))

    def path_mm(self, theta: Floats, arm_mm: float) -> Floats:
        """Shortening of the path of a tendon on the inner side of the bend; :func:`path_shortening_mm`."""
        n = self.rig.joints
        half = theta / (2 * n)
        match self.rig.joint:
            case MeasuredJoint(rigid_gap_mm=gap):
                return arm_mm * theta + 2 * n * gap * np.sin(half / 2) ** 2
            case NotchedTube(cut=notch):
                return 2 * n * (arm_mm * np.sin(half) + notch.width_mm * np.sin(half / 2) ** 2)

    def path_arm_mm(self, theta: Floats, arm_mm: float) -> Floats:
        """Differentiate :meth:`path_mm`: the lever arm of the chord about the joint."""
        half = theta / (2 * self.rig.joints)
        match self.rig.joint:
            case MeasuredJoint(rigid_gap_mm=gap):
                return arm_mm + gap / 2 * np.sin(half)
            case NotchedTube(cut=notch):
                return arm_mm * np.cos(half) + notch.width_mm / 2 * np.sin(half)

    def require_open(self, theta: Floats) -> None:
        """Raise a RigError where a bending closes the notches."""
        limit = self.limit_rad
        outside = ~(np.abs(theta) <= limit * (1 + 1e-12))
        if outside.any():
            raise RigError(
                f"theta = {math.degrees(theta[outside].flat[0]):g} deg: expected within +-{math.degrees(limit):g} deg, "
                f"where the notches of rig {self.rig.name} stay open"
            )

    def tensions(self, drive: Floats, theta: Floats) -> tuple[Floats, Floats]:
        """Tensions of tendons a and b, N, at a drive and a bending."""
        rig, rest = self.rig, np.asarray(self.rest_rad)
        inside = rig.length_mm
        found = [
            tendon_tension_N(
                tendon,
                side * drive - self.path_mm(side * theta, arm) + self.path_mm(side * rest, arm),
                rig.preload_N,
                inside,
            )
            for side, tendon, arm in zip((1, -1), rig.tendons, self.joint.arms_mm, strict=False)
        ]
        return found[0], found[1] if len(found) == 2 else np.zeros_like(found[0])

    def imbalance(self, theta: Floats, drive: Floats) -> Floats:
        """Moment on a joint that tendons and flexure leave over, Nmm, at a bending and a drive.

        The derivative of the potential energy, so that path and arm belong together.
        """
        tension_a, tension_b = self.tensions(drive, theta)
        return (
            self.path_arm_mm(theta, self.joint.arms_mm.a) * tension_a
            - self.path_arm_mm(-theta, self.joint.arms_mm.b) * tension_b
            - self.resistance_Nmm(theta)
        )


def path_shortening_mm(rig: Rig, theta_sum_rad: ArrayLike, moment_arm_mm: float) -> Floats:
    """How much the path of a tendon in the tube gets shorter by bending towards it, equal joint angles.

    The tendon leaves and enters the rings at their edges, half a notch width g from the joint, and spans the notch
    straight: 2 (g cos(t/2) - r sin(t/2)) at the joint angle t, 2 g when straight. The tendon on the other side is
    at -theta (its path gets longer, by less: both sides share the even part 2 N g (1 - cos(t/2))). Of measured joints
    the arm is taken as constant, r theta, and g is their rigid gap.

    Parameters
    ----------
    theta_sum_rad
        Any shape; the result has the same.

    Raises
    ------
    ValueError
        Beyond the angle at which the notches close.
    """
    theta, equal = np.asarray(theta_sum_rad, dtype=float), _EqualJoints(rig, joint_mechanics(rig))
    equal.require_open(theta)
    return equal.path_mm(theta, moment_arm_mm)


def drive_for_angle_mm(rig: Rig, theta_sum_rad: ArrayLike) -> Floats:
    """Drive that bends the manipulator by ``theta_sum_rad``, x = xi(theta_sum) of eq. 3, without friction.

    Path of the tendons plus their stretch, in static equilibrium with the flexures: all alike, or each its own way
    where notches differ (:mod:`fem_models.analytic.unequal_joints`).

    Parameters
    ----------
    theta_sum_rad
        Any shape; the result has the same.

    Raises
    ------
    ValueError
        Beyond the angle at which the notches close.
    RigError
        If a tendon has no arm about the neutral axis that bends the manipulator towards it (one-sided notches), or is
        absent.
    """
    if rig.tendon_b is None:
        raise RigError(f"rig {rig.name}: one tendon: expected two, or there is no drive for every angle")
    if not rig.joint.alike:
        return _in_shape(theta_sum_rad, bend_to_angle(rig, np.ravel(theta_sum_rad)).drive_mm)
    theta, equal = np.asarray(theta_sum_rad, dtype=float), _EqualJoints(rig, joint_mechanics(rig))
    equal.require_open(theta)
    inside, preload, arms = rig.length_mm, rig.preload_N, equal.joint.arms_mm
    rest = np.asarray(equal.rest_rad)
    path_a = equal.path_mm(theta, arms.a) - equal.path_mm(rest, arms.a)
    path_b = equal.path_mm(-theta, arms.b) - equal.path_mm(-rest, arms.b)
    arm_a, arm_b = equal.path_arm_mm(theta, arms.a), equal.path_arm_mm(-theta, arms.b)
    if not ((arm_a > 0).all() and (arm_b > 0).all()):
        raise RigError(
            f"rig {rig.name}: moment arms about the neutral axis {arms.a:g} and {arms.b:g} mm: expected both above "
            "0, or there is no drive for every angle"
        )
    resistance = np.abs(equal.resistance_Nmm(theta))

    def bound(tendon: Tendon, path: Floats, other: Floats, arm: Floats, other_arm: Floats) -> Floats:
        # a drive at which this tendon surely wins: the other one is at its preload at most
        needed = np.maximum((preload * other_arm + resistance) / arm, preload)
        return np.maximum(path, -other) + tendon_stretch_mm(tendon, needed, preload, inside)

    high = bound(rig.tendon_a, path_a, path_b, arm_a, arm_b)
    low = -bound(rig.tendon_b, path_b, path_a, arm_b, arm_a)
    margin = 1e-9 * (1 + np.abs(high) + np.abs(low))  # either end may be the root itself, give or take rounding
    root = find_root(lambda drive, angle: equal.imbalance(angle, drive), (low - margin, high + margin), args=(theta,))
    if not np.all(root.success):
        raise RigError(f"theta: no drive of rig {rig.name} found for {theta[~root.success].flat[0]:g} rad")
    return np.asarray(root.x)


def angle_for_drive_rad(rig: Rig, drive_mm: ArrayLike) -> Floats:
    """Bending angle theta_sum at a drive, static equilibrium without friction; the paper's f(x) in rad.

    Parameters
    ----------
    drive_mm
        Any shape; the result has the same.

    Raises
    ------
    ValueError
        A drive that would close the notches.
    """
    if not rig.joint.alike:
        return _in_shape(drive_mm, bend_at_drive(rig, np.ravel(drive_mm)).angles_rad.sum(axis=-1))
    drive, equal = np.asarray(drive_mm, dtype=float), _EqualJoints(rig, joint_mechanics(rig))
    limit = equal.limit_rad
    bracket = (np.full_like(drive, -limit), np.full_like(drive, limit))
    root = find_root(equal.imbalance, bracket, args=(drive,))
    if not np.all(root.success):
        raise RigError(
            f"drive_mm = {drive[~root.success].flat[0]:g}: expected a drive that bends rig {rig.name} within "
            f"+-{math.degrees(limit):g} deg, where its notches stay open"
        )
    return np.asarray(root.x)


def theory_curve(rig: Rig, drive_mm: ArrayLike) -> TheoryCurve:
    """Angle and tensions over the drive, in static equilibrium without friction and without material loop.

    Raises
    ------
    ValueError
        As :func:`angle_for_drive_rad`.
    """
    drive = np.asarray(drive_mm, dtype=float)
    if not rig.joint.alike:
        return _theory_of(drive, bend_at_drive(rig, drive.ravel()))
    theta = angle_for_drive_rad(rig, drive)
    return TheoryCurve(np.degrees(theta), *_EqualJoints(rig, joint_mechanics(rig)).tensions(drive, theta))


def _in_shape(given: ArrayLike, values: Floats) -> Floats:
    return values.reshape(np.shape(given))


def _theory_of(drive: Floats, bending: Bending) -> TheoryCurve:
    theta = bending.angles_rad.sum(axis=-1)
    rows = (np.degrees(theta), bending.tension_a_N, bending.tension_b_N)
    return TheoryCurve(*(_in_shape(drive, row) for row in rows))


def simulate_analytic(rig: Rig, program: LoadProgram) -> Record:
    """Run a load program on the analytic model: the engine without hysteresis, (Rig, LoadProgram) -> Record.

    Every sample is an equilibrium by itself; the times of the program only go into the record. Friction and the
    material loop are left out.

    Raises
    ------
    RigError
        A rig with an effect; as :func:`angle_for_drive_rad`.
    """
    require_planar(rig)
    beyond = [name for name in EFFECT_TABLES if getattr(rig, name) is not None]
    if beyond:
        raise RigError(
            f"rig {rig.name}: [{beyond[0]}]: not part of the analytic model: expected a rig without it, or the "
            "engine chain or multibody"
        )
    if isinstance(rig.joint, MeasuredJoint) and rig.joint.has_law:
        raise RigError(
            f"rig {rig.name}: law_share: not part of the analytic model: expected the engine chain or multibody"
        )
    if rig.joint.alike:
        curve = theory_curve(rig, program.drive_mm)
        joints = equal_joints(rig, np.radians(curve.angle_deg))
    else:
        bending = bend_at_drive(rig, program.drive_mm)
        curve, joints = _theory_of(program.drive_mm, bending), bending.angles_rad
    tip = tip_pose(rig, joints)
    return simulated_record(
        "analytic",
        rig,
        program,
        angle_deg=curve.angle_deg,
        joint_angles_rad=joints,
        tension_N=np.column_stack([curve.tension_a_N, curve.tension_b_N]),
        tip_mm=np.column_stack([tip.x_mm, tip.y_mm]),
    )
