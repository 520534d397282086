"""Where the tip is: rings and notches put one behind the other."""

from __future__ import annotations

import numpy as np

from fem_models.spatial.parameters import Parameters, neutral_mm
from fem_models.spatial.rig import SpatialRig
from fem_models.spatial.tables import FRAME, GIVE, HALF, STEP, TURNING
from hysteresis.arrays import Floats

TUBE_AXIS = np.array([1.0, 0.0, 0.0])


def rotation(vectors: Floats) -> Floats:
    """Rotation matrices (s, 3, 3) of rotation vectors (s, 3)."""
    angle = np.linalg.norm(vectors, axis=-1)[:, None, None]
    x, y, z = vectors.T
    zero = np.zeros_like(x)
    around = np.stack([zero, -z, y, z, zero, -x, -y, x, zero], axis=-1).reshape(-1, 3, 3)
    a, b = np.sinc(angle / np.pi), 0.5 * np.sinc(angle / (2 * np.pi)) ** 2
    return np.asarray(np.eye(3) + a * around + b * (around @ around))


def tip_and_frame(rig: SpatialRig, parameters: Parameters, joints: Floats) -> tuple[Floats, Floats]:
    """Middle of the last ring, shape (s, 3), and frame of that ring, (s, 3, 3); ``joints`` as of a run, (s, N, 6).

    The turning length of a notch and its displacement lie along the mean direction of both rings, the rest along the
    rings. Dead loads stretch and shear the notches to first order: that moves the tip, and not the tendons.
    """
    samples, n = joints.shape[:2]
    neutral = neutral_mm(rig)
    frame = np.broadcast_to(np.eye(3), (samples, 3, 3))
    own = parameters.joints
    start = 0.5 * (rig.joints[0].pitch_mm - own[0, TURNING])  # half the base ring, as in the planar chain
    place = np.broadcast_to(neutral[0] + start * TUBE_AXIS, (samples, 3))
    for k in range(n):
        cs, sn = own[k, FRAME : FRAME + 2]
        notch = np.array([[1.0, 0.0, 0.0], [0.0, cs, -sn], [0.0, sn, cs]])
        half = rotation(0.5 * joints[:, k, :3])
        before = frame @ notch
        middle = before @ half
        force = np.array(parameters.tip) + (n - k) * np.array(parameters.weight)
        moved = joints[:, k, 3:] + own[k, GIVE : GIVE + 3] * np.einsum("sji,j->si", middle, force)
        place = place + np.einsum("sij,sj->si", middle, own[k, TURNING] * TUBE_AXIS + moved)
        frame = middle @ half @ notch.T
        ring = own[k, STEP : STEP + 3] if k < n - 1 else own[k, HALF : HALF + 3]
        ring = ring - own[k, TURNING] * (1.0 if k < n - 1 else 0.5) * TUBE_AXIS
        place = place + frame @ ring
    return place - frame @ neutral[-1], frame


def bending_deg(frame: Floats) -> tuple[Floats, Floats]:
    """Bending towards y and z, shape (s, 2), and torsion, (s,), of frames (s, 3, 3).

    The shortest rotation that takes x into the ring's axis is divided by its direction; the rest is torsion.
    """
    axis = frame[:, :, 0]
    aside = np.hypot(axis[:, 1], axis[:, 2])
    total = np.arctan2(aside, axis[:, 0])
    unit = axis[:, 1:] / np.maximum(aside, 1e-300)[:, None]
    shortest = rotation(total[:, None] * np.stack([np.zeros_like(aside), -unit[:, 1], unit[:, 0]], axis=1))
    rest = np.swapaxes(shortest, 1, 2) @ frame
    return np.degrees(total[:, None] * unit), np.degrees(np.arctan2(rest[:, 2, 1], rest[:, 1, 1]))
