"""Bending of a chain by one tendon without friction: closed form, with one equation to solve a joint.

The load on a joint comes from the span of the tendon across its own notch alone. Equal joints bend equally, and neither
shear nor the other joints matter. The tendon runs straight from the edge of one hole to that of the next. A flexure
is a straight chord of its bending length l (:class:`fem_models.joint.mechanics.JointMechanics`), as in a beam of one
element and in the compiled chain. Let t be the angle of a joint, u its stretch, g half the difference between
notch width and l, and r the arm about the neutral axis. The span has the length l + u + 2 (g cos(t/2) - r sin(t/2)),
whence k_bending t = T (r cos(t/2) + g sin(t/2)) and k_axial u = -T.
"""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np
from scipy.optimize import brentq

from fem_models.joint import joint_mechanics, joint_row
from fem_models.joint.flexure import Flexure
from fem_models.rig import Rig, RigError
from fem_models.rig.rig import notched_tube, with_joint
from hysteresis.arrays import Floats


def tendon_arm_mm(rig: Rig, joint: Flexure, angle_rad: float) -> float:
    """Lever arm of tendon a about the neutral axis of a joint at its angle.

    Raises
    ------
    RigError
        Measured joints: their notch is not known.
    """
    notch = notched_tube(rig).cut
    arm = rig.tendon_a.moment_arm_mm + joint.neutral_offset_mm
    gap = (notch.width_mm - joint_mechanics(rig).bending_length_mm) / 2
    return arm * math.cos(angle_rad / 2) + gap * math.sin(angle_rad / 2)


def joint_angle_rad(rig: Rig, joint: Flexure, tendon_N: float) -> float:
    """Angle of one joint at a tension of tendon a, the other slack.

    Raises
    ------
    RigError
        As :func:`tendon_arm_mm`; also where no angle below 180 deg balances the tendon.
    """

    def residual(angle: float) -> float:
        return joint.bending_Nmm_per_rad * angle - tendon_N * tendon_arm_mm(rig, joint, angle)

    if residual(math.pi) <= 0 or residual(-math.pi) >= 0:
        raise RigError(f"tendon_N = {tendon_N:g}: expected a tension that the joints of rig {rig.name} can balance")
    return float(brentq(residual, -math.pi, math.pi, xtol=1e-15))


def tendon_for_angle_N(rig: Rig, joint: Flexure, angle_rad: float) -> float:
    """Tension of tendon a that bends the whole chain by ``angle_rad``."""
    angle = angle_rad / rig.joints
    return joint.bending_Nmm_per_rad * angle / tendon_arm_mm(rig, joint, angle)


def bend_by_tendon(rig: Rig, joint: Flexure, tendon_N: float) -> tuple[float, float, float]:
    """Bending of the chain, rad, and the middle of the last ring on the tube axis, x and y in mm.

    Axes as in :mod:`fem_models.analytic.kinematics`, from the tube axis of the base. A joint of unknown axial stiffness
    counts as rigid.

    Raises
    ------
    RigError
        As :func:`joint_angle_rad`.
    """
    angle = joint_angle_rad(rig, joint, tendon_N)
    stretch = -tendon_N / joint.axial_N_per_mm if joint.axial_N_per_mm else 0.0
    heading = angle * np.arange(rig.joints + 1)
    rings = np.exp(1j * heading)
    middle = np.exp(1j * (heading[:-1] + angle / 2))
    chord = joint_mechanics(rig).bending_length_mm
    tip = ((rig.pitch_mm - chord) / 2 * (rings[:-1] + rings[1:]) + (chord + stretch) * middle).sum()
    tip += 1j * joint.neutral_offset_mm * (rings[-1] - 1)  # from the neutral axis to that of the tube
    return float(heading[-1]), float(tip.real), float(tip.imag)


def bend_each_by_tendon(rig: Rig, joints: Sequence[Flexure], tendon_N: float) -> tuple[Floats, float, float]:
    """Bending of a chain whose notches differ: angles of the joints, shape (N,), rad, and the tip, x and y in mm.

    ``joints`` has the flexure of every notch. The tip is the middle of the last ring on the neutral axis, as in the
    chain: from its place in the straight tube, over the steps of that axis from notch to notch.

    Raises
    ------
    RigError
        As :func:`joint_angle_rad`.
    """
    angles = np.array([joint_angle_rad(with_joint(rig, k), joint, tendon_N) for k, joint in enumerate(joints)])
    row = joint_row(rig)
    lengths, chords = row.lengths, np.array([joint.bending_length_mm for joint in row.each])
    stretch = np.array([-tendon_N / joint.axial_N_per_mm if joint.axial_N_per_mm else 0.0 for joint in joints])
    heading = np.cumsum([0.0, *angles])
    rings, middle = np.exp(1j * heading), np.exp(1j * (heading[:-1] + angles / 2))
    spare = row.of("turning_length_mm") - chords  # of a notch beside its chord, both ends together: it goes with rings
    straight = np.append(lengths.base, lengths.stiff) + np.append(0.0, spare / 2) + np.append(spare / 2, 0.0)
    tip = (straight * rings).sum() + ((chords + stretch) * middle).sum()
    neutral = -np.array([joint.neutral_offset_mm for joint in joints])
    tip += 1j * (np.diff(neutral) * (rings[1:-1] - 1)).sum()
    return angles, float(tip.real), float(tip.imag)


def tendon_for_sum_N(rig: Rig, joints: Sequence[Flexure], angle_rad: float) -> float:
    """Tension of tendon a at which the angles of joints that differ sum up to ``angle_rad``, above 0.

    Raises
    ------
    RigError
        An angle that no tension balances.
    """

    def angle(tendon_N: float) -> float:
        return float(bend_each_by_tendon(rig, joints, tendon_N)[0].sum())

    high = min(tendon_for_angle_N(with_joint(rig, k), one, angle_rad / len(joints)) for k, one in enumerate(joints))
    while angle(high) < angle_rad:
        high *= 1.5
    return float(brentq(lambda tendon: angle(tendon) - angle_rad, 0.0, high, xtol=1e-14, rtol=1e-14))
