"""Hurty-Craig-Bampton reduction of one SNR: two rigid plates and a few modes in place of the mesh.

Craig and Bampton, AIAA Journal 6(7), 1968, "Coupling of substructures for dynamic analyses", doi 10.2514/3.4741.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.linalg import eigh
from scipy.sparse.linalg import LinearOperator, eigsh

from fem_models.multibody.assembly import NITINOL_T_PER_MM3
from fem_models.solid.linear import Solid, end_nodes, factorize, free_unknowns, mass_matrix, plates_stiffness
from hysteresis.arrays import Floats


@dataclass(frozen=True)
class ReducedBody:
    """Reduced matrices; N, mm, s, rad, tonnes. Of 12 + m coordinates the first 12 are the motions of the plates.

    Parameters
    ----------
    stiffness, mass
        Shape (12 + m, 12 + m). Plates count their six motions about the middle of the notch, proximal first; modes are
        scaled to unit mass, so their part of the stiffness is the square of the angular frequency.
    frequencies_Hz
        Shape (m,): of the modes, both plates fixed, ascending.
    fields_mm
        Shape (3 n, 12 + m): displacements of the nodes for a unit of each coordinate.
    """

    stiffness: Floats
    mass: Floats
    frequencies_Hz: Floats
    fields_mm: Floats


def craig_bampton(solid: Solid, modes: int, *, density_t_per_mm3: float = NITINOL_T_PER_MM3) -> ReducedBody:
    """Reduce one SNR to its plates and ``modes`` fixed-interface modes, the lowest.

    Raises
    ------
    ValueError
        Fewer than one mode, or a density that is not above 0.
    """
    if modes < 1:
        raise ValueError(f"modes = {modes}: expected at least 1")
    if not density_t_per_mm3 > 0:
        raise ValueError(f"density_t_per_mm3 = {density_t_per_mm3}: expected above 0")
    plates, static = plates_stiffness(solid)
    mass = mass_matrix(solid.mesh, density_t_per_mm3)
    squares, shapes = _fixed_interface_modes(solid, mass, modes)
    fields = np.column_stack([static, shapes])
    stiffness = np.zeros((12 + modes, 12 + modes))  # static fields and fixed-interface modes do no work on each other
    stiffness[:12, :12] = plates
    stiffness[12:, 12:] = np.diag(squares)
    return ReducedBody(stiffness, fields.T @ (mass @ fields), np.sqrt(squares) / (2 * np.pi), fields)


def _fixed_interface_modes(solid: Solid, mass: object, count: int) -> tuple[Floats, Floats]:
    """Squares of the lowest angular frequencies with both plates fixed, and their fields (3 n, count), of unit mass."""
    nodes = len(solid.points_mm)
    ends = np.concatenate(end_nodes(solid))
    size = 3 * nodes
    free = free_unknowns(size, np.concatenate([axis * nodes + ends for axis in range(3)]))
    inner, inertia = solid.stiffness[free][:, free], mass[free][:, free]  # type: ignore[index]
    solve = factorize(inner)
    start = np.random.default_rng(0).standard_normal(len(free))  # ARPACK's own start would differ from run to run
    inverse = LinearOperator(inner.shape, matvec=lambda load: solve(load[:, None])[:, 0], dtype=float)
    squares, shapes = eigsh(inner, k=count, M=inertia, sigma=0.0, OPinv=inverse, v0=start)
    fields = np.zeros((size, count))
    fields[free] = shapes
    return squares, fields


def free_frequencies_Hz(body: ReducedBody) -> Floats:
    """Frequencies of a free body without the six rigid motions, ascending, shape (6 + m,).

    They are above those of the mesh; the lower ones are closer.
    """
    squares = eigh(body.stiffness, body.mass, eigvals_only=True)
    return np.sqrt(squares[6:]) / (2 * np.pi)
