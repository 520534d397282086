"""What is written into a MuJoCo file for its reader: how to drive the model, what it has, and what it has lost."""

from __future__ import annotations

import numpy as np

from fem_models.export.loop import GuideLoop
from fem_models.export.weights import dead_weights
from fem_models.joint import JointRow
from fem_models.rig import Rig
from fem_models.rig.rig import EFFECT_TABLES

KEPT = ("slack", "backlash", "closure", "gravity", "tip_mass", "tip_load", "drive_gain")
"""Effects that the file has; the others of :data:`fem_models.rig.rig.EFFECT_TABLES` are lost."""


def notes(rig: Rig, joints: JointRow, loop: GuideLoop, speed_mm_per_s: float) -> list[str]:
    """Lines for the head of the file."""
    widest = float(np.abs(loop.drive_mm).max())
    return [
        f"rig {rig.name}, preload {rig.preload_N:g} N, made by notchbend for drives up to {widest:g} mm. "
        "Units: m, N, kg, rad, s.",
        "Drive: the control is the displacement at the wheel's rim in m; positive pulls tendon a. The sensor 'bending' "
        f"is the angle in rad. Move the control by at most {speed_mm_per_s:g} mm per second of the model: inertia and "
        "damping are chosen to come to rest soon and are not the rig's. A faster drive makes another loop.",
        "Solver: noslip_iterations makes dry friction hold; without them it creeps, and the loop closes with time. "
        "Integrator, time step, armature and damping belong together.",
        "Kept: hinges with the bending stiffness of the flexures; Jenkins elements (metal*); tendons over holes "
        "and notches that pull only; their springs between wheel and base, the toe region as several "
        "in parallel (free_*); friction at the base (slip_*) and at every guide (guide_*)"
        + "".join(f"; {name}" for name in KEPT if getattr(rig, name) is not None)
        + ".",
        *(f"Lost: {line}" for line in lost(rig, joints)),
    ]


def lost(rig: Rig, joints: JointRow) -> list[str]:
    """Say what the file does not have of a rig, one line each."""
    dry, axial = rig.friction, max(joint.axial_compliance for joint in joints.each)
    lines = ["shear of flexures and rings, out of plane motion, collisions."]
    if axial > 0:
        lines.append(f"flexures shorten under thrust, {axial:.3g} mm/N a joint: rigid along the tube here.")
    lines.append("stretch of the tendon in the tube lies between base and first ring, not from guide to guide.")
    if dry.capstan_coefficient > 0:
        lines.append(
            f"capstan friction, mu = {dry.capstan_coefficient:g}: tanh(mu wrap / 2) times the tensions on both sides. "
            "Each guide has its mean along the loop. The table of tensions next to this file has the true values."
        )
    if dry.stick_compliance_mm_per_N > 0:
        lines.append(f"compliance of guides that stick, {dry.stick_compliance_mm_per_N:g} mm/N.")
    if not joints.first.hardening.is_linear:
        lines.append("stiffness that varies along the bend: the one at rest counts.")
    if load := dead_weights(rig).lost_tip_N:
        lines.append(f"load on the tip, {load:.3g} N, in another direction than the weight of the rings.")
    for name in EFFECT_TABLES:
        if name not in KEPT and (effect := getattr(rig, name)) is not None:
            lines.append(f"{name}: {effect}.")
    return lines
