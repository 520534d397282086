"""Strain of one SNR as a solid: principal and equivalent, at points of quadrature and at nodes, and its peaks."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from skfem import Basis, ElementTetP2

from fem_models.rig import Rig
from fem_models.solid.linear import QUADRATURE, Solid, cells, chain_stiffness
from hysteresis.arrays import Floats

SUPERELASTIC_LIMIT = 0.01
"""Strain at which the plateau of Nitinol starts, for a rig without a superelastic law: about 1 %.

See docs/theory/analytic-model.md.
"""


@dataclass(frozen=True)
class PeakStrain:
    """Largest strains of one joint per radian of its bending.

    ``principal_*`` is the largest principal strain by magnitude; ``equivalent_*`` is the von Mises stress over Young's
    modulus, which in a fibre under tension is its strain. ``*_points`` is the largest at the points of quadrature
    inside the elements, a lower bound; ``*_nodes`` extrapolates to the nodes and averages over the elements there,
    which is the value on the surface of the root. ``place_mm`` is the node of the latter.
    """

    principal_points: float
    principal_nodes: float
    equivalent_points: float
    equivalent_nodes: float
    place_mm: tuple[float, float, float]


def bent_chain(solid: Solid) -> Floats:
    """Displacements (3 n,) of one SNR bent by 1 rad in an endless chain, free of axial force, in linear theory."""
    chain = chain_stiffness(solid)
    per_moment = np.linalg.inv(chain.stiffness)[:, 2]
    return chain.fields_mm @ (per_moment / per_moment[2])


def strain(solid: Solid, field_mm: Floats, *, at_nodes: bool = False) -> Floats:
    """Small strain (m, q, 3, 3) in each of m elements, at q points of quadrature or at its ten nodes."""
    rule = (ElementTetP2.doflocs.T, np.full(10, 1 / 60)) if at_nodes else None
    basis = Basis(solid.mesh, ElementTetP2(), quadrature=rule, intorder=None if at_nodes else QUADRATURE)
    gradient = np.stack([basis.interpolate(component).grad for component in field_mm.reshape(3, -1)])
    return 0.5 * (gradient + gradient.swapaxes(0, 1)).transpose(2, 3, 0, 1)


def principal(strain: Floats) -> Floats:
    """Principal strain of the largest magnitude, with its sign; strain (..., 3, 3)."""
    values = np.linalg.eigvalsh(strain)
    return np.where(-values[..., 0] > values[..., 2], values[..., 0], values[..., 2])


def equivalent(strain: Floats, poisson: float) -> Floats:
    """Von Mises stress over Young's modulus, of strain (..., 3, 3)."""
    deviator = strain - np.trace(strain, axis1=-2, axis2=-1)[..., None, None] / 3 * np.eye(3)
    return np.sqrt(1.5 * (deviator**2).sum(axis=(-2, -1))) / (1 + poisson)


def nodal_strain(solid: Solid, field_mm: Floats) -> Floats:
    """Strain (n, 3, 3) at the nodes, the mean of what the elements around each extrapolate, weighted by volume."""
    basis = Basis(solid.mesh, ElementTetP2(), intorder=QUADRATURE)
    volume = np.broadcast_to(basis.dx.sum(axis=1)[:, None], (solid.mesh.nelements, 10)).ravel()
    nodes = cells(solid.mesh).ravel()
    local = strain(solid, field_mm, at_nodes=True).reshape(-1, 9)
    total = np.stack([np.bincount(nodes, volume * component) for component in local.T], axis=1)
    return (total / np.bincount(nodes, volume)[:, None]).reshape(-1, 3, 3)


def peak_strain(solid: Solid, field_mm: Floats) -> PeakStrain:
    """Largest strains of a field; give it that of :func:`bent_chain`.

    With sharp corners (``fillet_mm`` = 0) they grow without bound as the mesh is refined.
    """
    inside, nodal = strain(solid, field_mm), nodal_strain(solid, field_mm)
    at_nodes = np.abs(principal(nodal))
    place = solid.points_mm[int(at_nodes.argmax())]
    return PeakStrain(
        principal_points=float(np.abs(principal(inside)).max()),
        principal_nodes=float(at_nodes.max()),
        equivalent_points=float(equivalent(inside, solid.poisson).max()),
        equivalent_nodes=float(equivalent(nodal, solid.poisson).max()),
        place_mm=(float(place[0]), float(place[1]), float(place[2])),
    )


def superelastic_limit(rig: Rig) -> float:
    """Strain where the metal leaves its elastic line: plateau over Young's modulus, or :data:`SUPERELASTIC_LIMIT`."""
    if rig.superelastic is None:
        return SUPERELASTIC_LIMIT
    return rig.superelastic.start_MPa / (rig.material.youngs_modulus_GPa * 1e3)
