"""All flexures of a wrist in space as one Exudyn object on the nodes of the rings: forces, and their slopes.

Each is a geometrically exact element of two nodes with one point of integration, half way between its ends (Simo and
Vu-Quoc 1986, doi 10.1016/0045-7825(86)90079-4). The nodes are Exudyn's: a place x and Euler parameters q of each ring.
The rotation half way is that of the sum q0 + q1, so that with M of it the strains are

    d = M^T (x1 - x0) - t e1,        phi = rotation vector of q0* q1.

Neither the unknowns nor the equations are those of :mod:`fem_models.spatial.kernels`: this is the check of them.
"""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np
from scipy.sparse import csr_matrix

from fem_models.joint.friction import MATERIAL_ELEMENTS, jenkins_elements
from fem_models.spatial import SpatialRig
from hysteresis.arrays import Floats

NODE = 7  # coordinates of a ring: place, Euler parameters
NUDGE = 1e-6  # mm, and of Euler parameters: differences of forces that are linear over it
UPRIGHT = np.array([0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0])  # the base: it does not move


class Strains(NamedTuple):
    """Displacements and rotation vectors in the frames of the notches, shapes (..., N, 3)."""

    displacement: Floats
    rotation: Floats


class Laws(NamedTuple):
    """Constants of the notches, in their frames."""

    frame: Floats  # (N, 3, 3): axes of a notch as columns, in the straight tube
    turning: Floats  # (N,)
    spring: Floats  # (N, 3): torsion, strong and weak bending, without the loop
    rest: Floats  # (N, 3): rotation vector without load
    force: Floats  # (N, 3): along the tube and both shears, N/mm
    shears: Floats  # (N,): shear centre from the neutral axis, towards the cut, mm
    thrust: Floats  # (N,): what the tendons press at rest
    loop: Floats  # (N, 2, e): stiffness of the Jenkins elements, strong axis and weak one
    slip: Floats  # (N, 2, e): their slip moments
    closes: Floats  # (N,): angle of closure
    contact: Floats  # (N,): stiffness of closed edges
    both: Floats  # (N,): 1 where both sides close


RIGID_N_PER_MM = 1e7
"""Stiffness of a notch that is rigid along an axis."""


def notch_frames(rig: SpatialRig) -> Floats:
    """Axes of the notches as columns, in the straight tube, shape (N, 3, 3)."""
    turn = np.radians([joint.turn_deg for joint in rig.joints])
    frames = np.zeros((turn.size, 3, 3))
    frames[:, 0, 0] = 1.0
    frames[:, 1, 1] = frames[:, 2, 2] = np.cos(turn)
    frames[:, 2, 1], frames[:, 1, 2] = np.sin(turn), -np.sin(turn)
    return frames


def laws_of(rig: SpatialRig, thrust: Floats) -> Laws:
    """Constants of a rig; uncut rings are in series with the elastic part of both bendings and of torsion."""
    n = len(rig.joints)
    spring, force, rest = np.empty((n, 3)), np.empty((n, 3)), np.zeros((n, 3))
    loop, slip = np.zeros((2, n, 2, MATERIAL_ELEMENTS))
    closes, contact, both, shears = np.empty(n), np.empty(n), np.empty(n), np.empty(n)
    for k, joint in enumerate(rig.joints):
        six, (bends, twists) = joint.stiffness, joint.ring
        split = [jenkins_elements(rig.material, bending) for bending in (six.strong, six.weak)]
        if rig.material.loop_share > 0:
            loop[k] = [part.stiffness for part in split]
            slip[k] = [part.slip_moment_Nmm for part in split]
        elastic = np.array([six.torsion, *(part.elastic_Nmm_per_rad for part in split)])
        spring[k] = 1 / (1 / elastic + 1 / np.array([twists, bends, bends]))
        force[k] = np.minimum([six.axial, six.shear_in, six.shear_across], RIGID_N_PER_MM)
        shears[k] = joint.shear_centre_mm
        rest[k, 2] = joint.mechanics.rest_angle_rad
        closes[k], both[k] = joint.mechanics.contact_angle_rad, float(not joint.mechanics.one_sided)
        stiff = rig.contact_Nmm_per_rad
        contact[k] = 1 / (1 / stiff + 1 / bends) if stiff > 0 else 0.0
    turning = np.array([joint.mechanics.turning_length_mm for joint in rig.joints])
    return Laws(notch_frames(rig), turning, spring, rest, force, shears, thrust, loop, slip, closes, contact, both)


def cross(a: Floats, b: Floats) -> Floats:
    """Vector products, shapes (..., 3); numpy's own is three times as slow on small arrays."""
    a0, a1, a2, b0, b1, b2 = a[..., 0], a[..., 1], a[..., 2], b[..., 0], b[..., 1], b[..., 2]
    out = np.empty(np.broadcast_shapes(a.shape, b.shape))
    out[..., 0], out[..., 1], out[..., 2] = a1 * b2 - a2 * b1, a2 * b0 - a0 * b2, a0 * b1 - a1 * b0
    return out


def rotate(q: Floats, v: Floats) -> Floats:
    """Turn vectors by Euler parameters of any length, shapes (..., 4) and (..., 3)."""
    w, u = q[..., :1], q[..., 1:]
    twice = 2 * cross(u, v)
    return v + (w * twice + cross(u, twice)) / np.sum(q * q, axis=-1, keepdims=True)


def conjugate(q: Floats) -> Floats:
    """Euler parameters of the rotation back."""
    return q * np.array([1.0, -1.0, -1.0, -1.0])


def product(p: Floats, q: Floats) -> Floats:
    """Euler parameters of q, then p."""
    w = p[..., :1] * q[..., :1] - np.sum(p[..., 1:] * q[..., 1:], axis=-1, keepdims=True)
    return np.concatenate([w, p[..., :1] * q[..., 1:] + q[..., :1] * p[..., 1:] + cross(p[..., 1:], q[..., 1:])], -1)


def rotation_vector(q: Floats) -> Floats:
    """Rotation vectors of Euler parameters, shape (..., 4), up to half a turn."""
    q = np.where(q[..., :1] < 0, -q, q)
    sine = np.linalg.norm(q[..., 1:], axis=-1, keepdims=True)
    half = np.arctan2(sine, q[..., :1])
    return 2 * q[..., 1:] * np.where(sine > 1e-12, half / np.maximum(sine, 1e-300), 1 / q[..., :1])


def _to_parameters(q: Floats, torque: Floats) -> Floats:
    """Generalized force on Euler parameters of a torque in the frame that they turn: its spin is 2 G(q) dq/q.q."""
    w, u = q[..., :1], q[..., 1:]
    along = -np.sum(u * torque, axis=-1, keepdims=True)
    force = np.concatenate([along, w * torque + cross(u, torque)], axis=-1)
    return 2 * force / np.sum(q * q, axis=-1, keepdims=True)


def _torques(phi: Floats, moment: Floats) -> tuple[Floats, Floats]:
    """Torques on the rings before and beyond, in their frames, of a moment by the rotation vector.

    By the transposes of the inverse left and right Jacobians (Bullo and Murray 1995).
    """
    half = 0.5 * np.linalg.norm(phi, axis=-1, keepdims=True)
    small = half < 1e-3
    safe = np.where(small, 1.0, half)
    c = np.where(small, (1 + half**2 / 15) / 12, (1 - safe / np.tan(safe)) / (4 * safe**2))
    aside = cross(phi, moment)
    even = moment + c * cross(phi, aside)
    return -(even + 0.5 * aside), even - 0.5 * aside


class Flexures:
    """The flexures of a wrist and what their loops remember, on the nodes of an Exudyn system.

    ``rest``, shape (N, 2, e), are the rest angles of the Jenkins elements. ``viscous``, Nmm/rad, resists rotations in a
    jump; they count from ``before``, (N, 3).
    """

    def __init__(self, laws: Laws, between: Floats, straight: Floats) -> None:
        """Take flexures between the nodes of the rings, at rest without load.

        Parameters
        ----------
        between
            Shape (N, 3), in the straight tube: from the node of the ring before to the near end of each flexure.
        straight
            Shape (N, 7): reference coordinates of the nodes, at the far ends.
        """
        self.laws, self.between, self.straight = laws, between, straight
        self.rest = np.repeat(laws.rest[:, 1:, None], MATERIAL_ELEMENTS, axis=2)
        self.viscous, self.before = 0.0, laws.rest
        ring = np.arange(-1, len(between))[:, None] * NODE + np.arange(NODE)
        self.of = np.concatenate([ring[:-1], ring[1:]], axis=1)  # coordinates of a flexure, those of the base below 0
        rows, columns = np.repeat(self.of, 2 * NODE, axis=1), np.tile(self.of, (1, 2 * NODE))
        self.moves = (rows >= 0) & (columns >= 0)
        self.slopes_at = rows[self.moves], columns[self.moves]

    def ends(self, q: Floats) -> Floats:
        """Coordinates of both rings at each flexure, shape (N, 14), at those of the system's nodes, (7 N,)."""
        rings = np.concatenate([UPRIGHT[None], q.reshape(-1, NODE) + self.straight])
        return np.concatenate([rings[:-1], rings[1:]], axis=1)

    def strains(self, ends: Floats) -> tuple[Strains, Floats, Floats]:
        """Strains, with the way from end to end and the Euler parameters half way; ends of shape (..., N, 14)."""
        q0, q1, frame = ends[..., 3:7], ends[..., 10:], self.laws.frame
        middle = q0 + np.where(np.sum(q0 * q1, axis=-1, keepdims=True) < 0, -q1, q1)
        way = ends[..., 7:10] - ends[..., :3] - rotate(q0, self.between)
        along = rotate(conjugate(middle), way)
        moved = np.einsum("nji,...nj->...ni", frame, along)
        moved[..., 0] -= self.laws.turning
        phi = np.einsum("nji,...nj->...ni", frame, rotation_vector(product(conjugate(q0), q1)))
        return Strains(moved, phi), along, middle

    def placed(self, strains: Strains) -> Floats:
        """Coordinates of the nodes that have strains, shape (7 N,): one ring after the other."""
        half = 0.5 * np.einsum("nij,nj->ni", self.laws.frame, strains.rotation)
        size = np.linalg.norm(half, axis=1, keepdims=True)
        halves = np.concatenate([np.cos(size), np.sinc(size / np.pi) * half], axis=1)
        moved = np.einsum("nij,nj->ni", self.laws.frame, strains.displacement)
        moved[:, 0] += self.laws.turning
        turned, w, (x, y, z) = np.empty((len(moved) + 1, 4)), halves[:, 0], halves[:, 1:].T
        turned[0] = UPRIGHT[3:]
        after = np.stack([w, -x, -y, -z, x, w, z, -y, y, -z, w, x, z, y, -x, w], axis=1).reshape(-1, 4, 4)
        for k, one in enumerate(after):  # q times the rotation of the notch
            turned[k + 1] = one @ turned[k]
        middle = turned[:-1] + turned[1:]
        ways = rotate(turned[:-1], self.between) + rotate(middle, moved)
        return np.asarray((np.concatenate([np.cumsum(ways, axis=0), turned[1:]], axis=1) - self.straight).ravel())

    def loads(self, strains: Strains) -> tuple[Floats, Floats]:
        """Force and moment of the notches in their frames, shapes (..., N, 3)."""
        laws, phi = self.laws, strains.rotation
        force = laws.force * self._of_shear_centre(strains)
        force[..., 0] -= laws.thrust
        moment = laws.spring * (phi - laws.rest) + self.viscous * (phi - self.before)
        moment[..., 0] += laws.shears * force[..., 2]
        moment[..., 1:] += np.clip(laws.loop * (phi[..., 1:, None] - self.rest), -laws.slip, laws.slip).sum(axis=-1)
        angle = phi[..., 2]
        past = np.maximum(angle - laws.closes, 0.0) - laws.both * np.maximum(-angle - laws.closes, 0.0)
        moment[..., 2] += laws.contact * past
        return force, moment

    def _of_shear_centre(self, strains: Strains) -> Floats:
        """Displacement of the axis of the notch, where across that of its shear centre, shape (..., N, 3)."""
        moved = strains.displacement.copy()
        moved[..., 2] += self.laws.shears * strains.rotation[..., 0]
        return moved

    def slip(self, phi: Floats) -> float:
        """Move the rest angles of the Jenkins elements that slip at rotation vectors, (N, 3); return the loss, mJ."""
        laws, bends = self.laws, phi[:, 1:, None]
        moment = laws.loop * (bends - self.rest)
        over = np.sign(moment) * np.maximum(np.abs(moment) - laws.slip, 0.0)
        slid = np.divide(over, laws.loop, out=np.zeros_like(over), where=laws.loop > 0)
        self.rest = self.rest + slid
        return float((laws.slip * np.abs(slid)).sum())

    def stored_mJ(self, strains: Strains) -> float:
        """Energy of the flexures above that at rest, whose thrust is that of the tendons."""
        laws, moved, phi = self.laws, self._of_shear_centre(strains), strains.rotation
        total = 0.5 * (laws.force * moved**2).sum() - (laws.thrust * moved[:, 0]).sum()
        total += 0.5 * (laws.spring * (phi - laws.rest) ** 2).sum()
        total += 0.5 * (laws.loop * (phi[:, 1:, None] - self.rest) ** 2).sum()
        past = np.maximum(phi[:, 2] - laws.closes, 0.0) + laws.both * np.maximum(-phi[:, 2] - laws.closes, 0.0)
        return float(total + 0.5 * (laws.contact * past**2).sum())

    def forces(self, ends: Floats) -> Floats:
        """Slopes of the energy in the coordinates of the ends, shape (..., N, 14)."""
        strains, along, middle = self.strains(ends)
        force, moment = (np.einsum("nij,...nj->...ni", self.laws.frame, load) for load in self.loads(strains))
        phi = np.einsum("nij,...nj->...ni", self.laws.frame, strains.rotation)
        q0, q1 = ends[..., 3:7], ends[..., 10:]
        before, beyond = _torques(phi, moment)
        pull = rotate(middle, force)
        before = before - cross(self.between, rotate(conjugate(q0), pull))
        half_way = _to_parameters(middle, cross(force, along))
        sense = np.where(np.sum(q0 * q1, axis=-1, keepdims=True) < 0, -1.0, 1.0)
        parts = -pull, half_way + _to_parameters(q0, before), pull, sense * half_way + _to_parameters(q1, beyond)
        return np.concatenate(parts, axis=-1)

    def acting(self, mbs: Any, t: float, number: int, q: Any, q_t: Any) -> Floats:
        """User function of Exudyn: forces on the coordinates of the nodes."""
        parts = self.forces(self.ends(np.asarray(q)))
        out = -parts[:, NODE:]
        out[:-1] -= parts[1:, :NODE]
        return out.ravel()

    def slopes(self, mbs: Any, t: float, number: int, q: Any, q_t: Any, by_place: float, by_speed: float) -> Any:
        """User function of Exudyn: slopes of the forces, by differences over all flexures at once."""
        ends, size = self.ends(np.asarray(q)), 7 * len(self.between)
        nudged = ends + NUDGE * np.eye(2 * NODE)[:, None, :]
        change = (self.forces(nudged) - self.forces(nudged - 2 * NUDGE * np.eye(2 * NODE)[:, None, :])) / (2 * NUDGE)
        values = by_place * np.moveaxis(change, 0, 2).reshape(len(ends), -1)[self.moves]
        return csr_matrix((values, self.slopes_at), shape=(size, size))
