"""Large bending of one superelastic notched ring (SNR) as a solid: its moment over its angle, and its strain.

One quarter is solved with :mod:`fem_models.solid.superelastic`: the bending plane y = 0 and the middle of the notch
z = 0 are planes of symmetry. The middle of the ring stays plane and rotates by half the angle of the joint, free to
change its shape in plane and free of axial force, as in an endless chain in pure bending
(:func:`fem_models.solid.linear.chain_stiffness` is its slope at rest). A thrust presses the rings together along the
normal of the middle of the notch, as tendons do that span it. The moment is then that about the line through both ends
of the bending length, on the neutral axis of the straight section: engines count their levers from there. Contact of
the edges of a notch is left out.
Units are mm, N, rad.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import ArrayLike
from scipy.spatial import cKDTree
from skfem import MeshTet2

from fem_models.joint import joint_mechanics
from fem_models.rig import Rig
from fem_models.rig.checks import SolverError
from fem_models.rig.rig import notched_tube
from fem_models.solid.linear import cells as cells_of
from fem_models.solid.mesh import snr_mesh
from fem_models.solid.superelastic import (
    HARDENING_SHARE,
    Equilibrium,
    FlagSolid,
    Unknowns,
    flag_law,
    flag_solid,
    newton,
    nodal_strain,
    straight,
    unknowns,
)
from hysteresis.arrays import Floats, Ints, Mask

_HALVINGS = 7


@dataclass(frozen=True)
class BentJoint:
    """One equilibrium of a joint: its angle, and the moment about y of the whole section."""

    angle_rad: float
    moment_Nmm: float
    neutral_offset_mm: float
    state: Equilibrium


@dataclass(frozen=True)
class QuarterJoint:
    """Quarter (y >= 0, z >= 0) of one SNR, which of its nodes lie in the middle of the ring, (n,), and the thrust."""

    rig: Rig
    solid: FlagSolid
    unknowns: Unknowns
    end: Mask
    thrust_N: float = 0.0


@dataclass(frozen=True)
class MomentAngle:
    """Moment of one joint over a path of angles, and the strain of its metal; arrays of shape (k,).

    Parameters
    ----------
    rig
        The joint's rig.
    angle_rad, moment_Nmm
        The path, from the straight virgin state.
    principal_strain
        Largest principal logarithmic strain by magnitude, at the nodes. At a sharp corner it grows with the mesh.
    equivalent_strain
        Largest equivalent strain: that of a bar with the same transformation strain and stress, the sum of the
        transformation strain and of stress over E.
    transformed
        Volume share of martensite in the metal between the two rings (|z| below half the width of the notch).
    neutral_offset_mm
        Where the two rings, extended, intersect, from the tube axis towards -x; nan at angle 0.
    """

    rig: Rig
    angle_rad: Floats
    moment_Nmm: Floats
    principal_strain: Floats
    equivalent_strain: Floats
    transformed: Floats
    neutral_offset_mm: Floats


def quarter_joint(
    rig: Rig,
    *,
    refinement: float = 1.0,
    fillet_mm: float = 0.0,
    hardening: float = HARDENING_SHARE,
    thrust_N: float = 0.0,
) -> QuarterJoint:
    """Mesh a quarter of one SNR; errors as :func:`fem_models.solid.mesh.snr_mesh`."""
    points, cells = quarter_of(snr_mesh(rig, refinement=refinement, fillet_mm=fillet_mm))
    joint = joint_of(rig, flag_solid(points, cells, flag_law(rig, hardening=hardening)))
    return replace(joint, thrust_N=thrust_N)


def quarter_of(mesh: MeshTet2) -> tuple[Floats, Ints]:
    """Nodes (n, 3) and elements (m, 10) of a mesh of a whole SNR where y >= 0 and z >= 0."""
    points, cells = mesh.doflocs.T, cells_of(mesh)
    middle = points[cells].mean(axis=1)
    used, chosen = np.unique(cells[(middle[:, 1] > 0) & (middle[:, 2] > 0)], return_inverse=True)
    return np.ascontiguousarray(points[used]), chosen.reshape(-1, 10)


def joint_of(rig: Rig, solid: FlagSolid) -> QuarterJoint:
    """Assign the unknowns of a quarter; all nodes of the ring's middle share their displacement along its normal."""
    x, y, z = solid.points_mm.T
    tolerance = 1e-6 * float(np.ptp(z))
    middle, end = np.abs(z) < tolerance, z > z.max() - tolerance
    fixed = np.zeros((len(x), 3), dtype=bool)
    fixed[:, 1] = np.abs(y) < tolerance
    fixed[:, 2] = middle
    fixed[np.flatnonzero(middle)[0], 0] = True  # the plane z = 0 does not fix the shift along x
    shared = np.zeros_like(fixed)
    shared[end, 2] = True
    numbers = np.full(fixed.shape, -1)
    own = ~fixed & ~shared
    numbers[own] = np.arange(own.sum())
    numbers[shared] = own.sum()
    return QuarterJoint(rig, solid, unknowns(solid, numbers), end)


def bend(joint: QuarterJoint, angles_rad: ArrayLike, *, step_rad: float = math.radians(2.0)) -> Iterator[BentJoint]:
    """Bend a straight joint along a path of angles (k,) and yield its equilibrium at each of them.

    Steps in between are ``step_rad`` at most, and are halved where Newton's iteration fails.

    Raises
    ------
    SolverError
        A step that does not converge; the message has the angle.
    """
    state, angle, before, last_step = straight(joint.solid), 0.0, None, 0.0
    if joint.thrust_N:
        state = _rotated(joint, state, 0.0, 0.0, None)
    for target in np.asarray(angles_rad, dtype=float):
        longest = step_rad
        while abs(target - angle) > 1e-12:
            step = float(np.clip(target - angle, -longest, longest))
            if step * last_step < 0:
                before = None  # a reversal: the metal leaves the plateau
            try:
                new = _rotated(joint, state, angle, angle + step, before)
            except SolverError as error:
                longest = abs(step) / 2
                if longest < step_rad / 2**_HALVINGS:
                    raise SolverError(f"joint at {math.degrees(angle):.2f} deg: {error}") from None
                continue
            before, last_step, angle, state = state.transformation, step, angle + step, new
            longest = min(2 * longest, step_rad)
        yield _bent_joint(joint, float(target), state)


def _rotated(
    joint: QuarterJoint, state: Equilibrium, angle: float, target: float, before: Floats | None
) -> Equilibrium:
    """Rotate the ring's middle, whose nodes move with it, and find the new equilibrium."""
    points, end = joint.solid.points_mm, joint.end
    lift = np.zeros_like(points)
    place = points[end] + state.displacement_mm[end]
    lift[end] = place @ (_rotation((target - angle) / 2) - np.eye(3)).T
    frames = np.tile(np.eye(3), (len(points), 1, 1))
    frames[end] = _rotation(target / 2).T  # rows: along the plane, y, normal
    push = np.zeros_like(points)
    push[end, 2] = -joint.thrust_N / 2 / end.sum()  # half of the section
    return newton(joint.solid, joint.unknowns, state, lift, frames, before=before, push_N=push)


def _rotation(angle: float) -> Floats:
    """Rotation about y."""
    c, s = math.cos(angle), math.sin(angle)
    return np.array([[c, 0.0, s], [0.0, 1.0, 0.0], [-s, 0.0, c]])


def _bent_joint(joint: QuarterJoint, angle: float, state: Equilibrium) -> BentJoint:
    """Moment of both halves of the section, and the line about which the ring has rotated against the other one."""
    points = joint.solid.points_mm[joint.end]
    place, force = points + state.displacement_mm[joint.end], state.force_N[joint.end]
    moment = 2 * float((place[:, 2] * force[:, 0] - place[:, 0] * force[:, 2]).sum())
    local = place @ _rotation(angle / 2)  # along the plane, y, normal
    sine, cosine = math.sin(angle / 2), math.cos(angle / 2)
    if joint.thrust_N:
        mechanics = joint_mechanics(joint.rig)
        along = float(local[:, 2].mean()) - 0.5 * (points[0, 2] * 2 - mechanics.turning_length_mm)
        across = float((local[:, 0] - points[:, 0]).mean()) - mechanics.flexure.neutral_offset_mm
        moment -= joint.thrust_N * (across * cosine + along * sine)
    middle = local[:, 2].mean() * cosine - (local[:, 0] - points[:, 0]).mean() * sine
    offset = (points[0, 2] * cosine - middle) / sine if sine else math.nan
    return BentJoint(angle, moment, float(offset), state)


def moment_angle(
    rig: Rig,
    angles_rad: ArrayLike,
    *,
    refinement: float = 1.0,
    fillet_mm: float = 0.0,
    hardening: float = HARDENING_SHARE,
    step_rad: float = math.radians(2.0),
) -> MomentAngle:
    """Bend one SNR of a rig along a path of angles (k,) from its straight virgin state.

    Raises
    ------
    RigError
        As :func:`fem_models.solid.mesh.snr_mesh`.
    SolverError
        As :func:`bend`.
    """
    joint = quarter_joint(rig, refinement=refinement, fillet_mm=fillet_mm, hardening=hardening)
    return measured(joint, list(bend(joint, angles_rad, step_rad=step_rad)))


def measured(joint: QuarterJoint, path: Sequence[BentJoint]) -> MomentAngle:
    """Strains and martensite of a path of :func:`bend`."""
    strains = [nodal_strain(joint.solid, bent.state) for bent in path]
    share = [_transformed(joint, bent.state) for bent in path]
    return MomentAngle(
        rig=joint.rig,
        angle_rad=np.array([bent.angle_rad for bent in path]),
        moment_Nmm=np.array([bent.moment_Nmm for bent in path]),
        principal_strain=np.array([np.abs(principal).max() for principal, _ in strains]),
        equivalent_strain=np.array([equivalent.max() for _, equivalent in strains]),
        transformed=np.array(share),
        neutral_offset_mm=np.array([bent.neutral_offset_mm for bent in path]),
    )


def _transformed(joint: QuarterJoint, state: Equilibrium) -> float:
    solid = joint.solid
    if solid.law.span == 0:
        return 0.0
    between = solid.points_mm[solid.cells, 2].mean(axis=1) < notched_tube(joint.rig).cut.width_mm / 2
    volumes = solid.volumes[between]
    return float((volumes * state.transformation[between]).sum() / (volumes.sum() * solid.law.span))


def whole(joint: QuarterJoint, state: Equilibrium, points_mm: Floats) -> tuple[Floats, Floats, Floats]:
    """Displacements (k, 3), principal and equivalent strain (k,) at the nodes (k, 3) of the whole SNR's mesh.

    Raises
    ------
    ValueError
        Nodes of another mesh.
    """
    mirror = np.where(points_mm < 0, -1.0, 1.0)
    mirror[:, 0] = 1.0
    distance, twin = cKDTree(joint.solid.points_mm).query(points_mm * mirror)
    if distance.max() > 1e-6 * float(np.ptp(points_mm)):
        raise ValueError(f"nodes {distance.max():.2g} mm off the quarter's: expected those of its whole mesh")
    principal, equivalent = nodal_strain(joint.solid, state)
    return state.displacement_mm[twin] * mirror, principal[twin], equivalent[twin]
