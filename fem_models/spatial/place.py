"""Where the tip is: rings and notches put one behind the other."""

from __future__ import annotations

import numpy as np

from fem_models.spatial.parameters import Parameters, neutral_mm
from fem_models.spatial.rig import SpatialRig
from fem_models.spatial.tables import FRAME, GIVE, HALF, SHEARS, STEP, TURNING
from hysteresis.arrays import Floats

TUBE_AXIS, ACROSS = np.array([1.0, 0.0, 0.0]), np.array([0.0, 0.0, 1.0])


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
    own, (samples, n) = parameters.joints, joints.shape[:2]
    neutral, (cs, sn) = neutral_mm(rig), own[:, FRAME : FRAME + 2].T
    notch = np.zeros((n, 3, 3))
    notch[:, 0, 0], notch[:, 1, 1], notch[:, 2, 2] = 1.0, cs, cs
    notch[:, 1, 2], notch[:, 2, 1] = -sn, sn
    half = rotation(0.5 * joints[..., :3].reshape(-1, 3)).reshape(samples, n, 3, 3)
    into, out = notch @ half, half @ np.swapaxes(notch, 1, 2)
    middle, frame = np.empty_like(half), np.empty_like(half)
    last = np.broadcast_to(np.eye(3), (samples, 3, 3))
    for k in range(n):
        middle[:, k] = last @ into[:, k]
        last = frame[:, k] = middle[:, k] @ out[:, k]
    force = np.array(parameters.tip) + np.arange(n, 0, -1)[:, None] * np.array(parameters.weight)
    moved = joints[..., 3:] - own[:, SHEARS, None] * joints[..., :1] * ACROSS
    moved += own[:, GIVE : GIVE + 3] * np.einsum("skji,kj->ski", middle, force)
    along = own[:, TURNING, None] * TUBE_AXIS
    ring = own[:, STEP : STEP + 3] - 0.5 * (along + np.concatenate([along[1:], along[-1:]]))
    ring[-1] = own[-1, HALF : HALF + 3] - 0.5 * along[-1] - neutral[-1]
    start = 0.5 * (rig.joints[0].pitch_mm - own[0, TURNING])  # half the base ring, as in the planar chain
    place = (middle @ (along + moved)[..., None] + frame @ ring[..., None])[..., 0].sum(axis=1)
    return place + neutral[0] + start * TUBE_AXIS, last


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
