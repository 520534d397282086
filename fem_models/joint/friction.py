"""Dry friction of the tendons at their guides, and the material loop: laws shared by all engines."""

from __future__ import annotations

from dataclasses import replace
from typing import NamedTuple

import numpy as np

from fem_models.rig.rig import Friction, Material
from hysteresis.arrays import Floats

MATERIAL_ELEMENTS = 3
"""Jenkins elements of a joint: enough for a loop without visible corners at the paper's step of 0.1 mm."""


def scaled_friction(friction: Friction, factor: float) -> Friction:
    """Friction of all guides times a factor: capstan coefficient and constant forces."""
    if factor == 1.0:
        return friction
    return replace(
        friction,
        capstan_coefficient=factor * friction.capstan_coefficient,
        guide_N=factor * friction.guide_N,
        sheath_N=factor * friction.sheath_N,
    )


def guide_wrap_rad(friction: Friction, joint_angles_rad: Floats) -> Floats:
    """Wrap of the tendon at each guide at the current joint angles.

    Guide 0 is the base, guide i the ring after joint i; the tip is an anchor, no guide. The tendon is straight inside a
    ring and along the chord of a notch, so its wrap at a ring is half the angle of either neighbouring joint.

    Parameters
    ----------
    joint_angles_rad
        Shape (N,), relative rotation of each joint.

    Returns
    -------
    Shape (N,), wrap of guides 0..N-1, radians.
    """
    half = 0.5 * np.abs(joint_angles_rad)
    wrap = half.copy()
    wrap[1:] += half[:-1]
    wrap[0] += np.radians(friction.rest_wrap_deg)
    return wrap


def friction_limits_N(
    friction: Friction,
    proximal_N: Floats,
    distal_N: Floats,
    wrap_rad: Floats,
) -> Floats:
    """Largest difference of tension that friction at each guide can balance, shapes (..., N).

    The capstan equation T_p = T_d exp(+-mu phi) is |T_p - T_d| = (T_p + T_d) tanh(mu phi / 2), the same in
    both directions of sliding (derived from Euler's belt formula); a tension-independent part is added.
    """
    constant = np.full(proximal_N.shape[-1], float(friction.guide_N))
    constant[0] += friction.sheath_N
    total = np.maximum(proximal_N, 0.0) + np.maximum(distal_N, 0.0)
    return constant + total * np.tanh(0.5 * friction.capstan_coefficient * wrap_rad)


class JenkinsElements(NamedTuple):
    """Bending stiffness of one joint as an elastic spring in parallel with ``k`` elements that slip at a moment.

    ``elastic_Nmm_per_rad`` is a number; ``stiffness`` (Nmm/rad) and ``slip_moment_Nmm`` have the shape (k,).
    """

    elastic_Nmm_per_rad: float
    stiffness: Floats
    slip_moment_Nmm: Floats


def jenkins_elements(material: Material, bending_Nmm_per_rad: float) -> JenkinsElements:
    """Split the bending stiffness of a joint into a spring and parallel Jenkins elements.

    Slip angles are spread evenly, an Iwan model (J. Applied Mechanics 33(4), 1966, doi 10.1115/1.3625199). No element
    without a material loop.
    """
    if material.loop_share == 0:
        return JenkinsElements(bending_Nmm_per_rad, np.empty(0), np.empty(0))
    k = MATERIAL_ELEMENTS
    stiffness = np.full(k, material.loop_share * bending_Nmm_per_rad / k)
    slip_rad = np.radians(material.loop_angle_deg) * (np.arange(k) + 0.5) / k
    return JenkinsElements(bending_Nmm_per_rad * (1 - material.loop_share), stiffness, stiffness * slip_rad)
