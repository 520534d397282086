"""Linear elasticity of one single notched ring (SNR) as a solid: quadratic tetrahedra between two end plates.

Units are mm, N, rad. Fields are flat arrays of 3 n numbers, u_x of all n nodes first, then u_y, then u_z; nodes stand
in the order of ``mesh.doflocs``. Rigid motions are (u_x, u_y, u_z, r_x, r_y, r_z) about the middle of the notch; a
rotation r_y > 0 bends the distal end (z > 0) towards +x.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from cholespy import CholeskySolverD, MatrixType
from scipy import sparse
from skfem import Basis, BilinearForm, ElementTetP2, MeshTet2
from skfem.models.elasticity import lame_parameters

from fem_models.joint.flexure import Flexure
from fem_models.rig import Rig
from fem_models.solid.mesh import snr_mesh
from hysteresis.arrays import Floats, Ints

QUADRATURE = 4
"""Order of quadrature: gradients on curved elements are integrated exactly from 3 on, which the patch test needs."""

BENDING, AXIAL = 4, 2  # places in a rigid motion


@dataclass(frozen=True)
class Solid:
    """Metal of one SNR: mesh in mm, Young's modulus in N/mm^2, stiffness (3 n, 3 n) in N/mm, not yet supported."""

    mesh: MeshTet2
    young_MPa: float
    poisson: float
    stiffness: sparse.csr_matrix

    @property
    def points_mm(self) -> Floats:
        """Nodes, shape (n, 3)."""
        return np.asarray(self.mesh.doflocs.T)


@dataclass(frozen=True)
class SnrStiffness:
    """Stiffness of one SNR between rigid end plates, and the displacements that belong to it.

    Parameters
    ----------
    stiffness
        Shape (6, 6), N, mm, rad: of the motion of the distal plate against the proximal one, taken at the middle of
        the notch, where each plate makes half of it.
    fields_mm
        Shape (3 n, 6): displacements for a unit of each relative motion.
    """

    stiffness: Floats
    fields_mm: Floats


def solid_snr(rig: Rig, *, refinement: float = 1.0, fillet_mm: float = 0.0) -> Solid:
    """Mesh and assemble one SNR of a rig; arguments and errors as :func:`fem_models.solid.mesh.snr_mesh`."""
    mesh = snr_mesh(rig, refinement=refinement, fillet_mm=fillet_mm)
    return solid(mesh, rig.material.youngs_modulus_GPa * 1e3, rig.material.poissons_ratio)


def solid(mesh: MeshTet2, young_MPa: float, poisson: float) -> Solid:
    """Assemble the stiffness of an isotropic linear elastic solid."""
    return Solid(mesh, young_MPa, poisson, elastic_stiffness(mesh, young_MPa, poisson))


def elastic_stiffness(mesh: MeshTet2, young_MPa: float, poisson: float) -> sparse.csr_matrix:
    """Stiffness (3 n, 3 n) of int lambda div u div v + 2 mu eps(u) : eps(v).

    Its blocks are sums of the scalar matrices D_ab = int d_a u d_b v, which assemble far faster than vector elements.
    """
    lam, mu = lame_parameters(young_MPa, poisson)
    basis = Basis(mesh, ElementTetP2(), intorder=QUADRATURE)
    d = {(a, b): _gradient_product(a, b).assemble(basis) for a in range(3) for b in range(a, 3)}
    d |= {(b, a): d[a, b].T for a in range(3) for b in range(a + 1, 3)}
    laplace = d[0, 0] + d[1, 1] + d[2, 2]
    blocks = [[lam * d[b, a] + mu * d[a, b] + (mu * (a == b)) * laplace for b in range(3)] for a in range(3)]
    return sparse.csr_matrix(sparse.bmat(blocks))


def mass_matrix(mesh: MeshTet2, density: float) -> sparse.csr_matrix:
    """Consistent mass (3 n, 3 n); with a density in t/mm^3 in tonnes, the unit of mass that goes with mm, N and s."""
    basis = Basis(mesh, ElementTetP2(), intorder=QUADRATURE)
    one = density * BilinearForm(lambda u, v, _: u * v).assemble(basis)
    return sparse.csr_matrix(sparse.block_diag([one] * 3))


def cells(mesh: MeshTet2) -> Ints:
    """Nodes of every tetrahedron, shape (m, 10): corners, then middles of 01, 12, 02, 03, 13, 23, as in VTK."""
    return np.asarray(mesh.dofs.element_dofs.T)


def _gradient_product(a: int, b: int) -> BilinearForm:
    return BilinearForm(lambda u, v, _: u.grad[a] * v.grad[b])


def rigid_motions(points_mm: Floats) -> Floats:
    """Displacements of points (k, 3) by the six unit rigid motions about the origin: shape (3 k, 6)."""
    count = len(points_mm)
    motions = np.zeros((3, count, 6))
    for axis in range(3):
        motions[axis, :, axis] = 1.0
        motions[:, :, 3 + axis] = np.cross(np.eye(3)[axis], points_mm).T
    return motions.reshape(3 * count, 6)


def end_nodes(solid: Solid) -> tuple[Ints, Ints]:
    """Nodes on the proximal (least z) and on the distal end face."""
    z = solid.mesh.doflocs[2]
    tolerance = 1e-6 * float(np.ptp(z))
    return np.flatnonzero(z < z.min() + tolerance), np.flatnonzero(z > z.max() - tolerance)


def snr_stiffness(solid: Solid) -> SnrStiffness:
    """Condense the solid to the relative motion of two rigid end plates, see :class:`SnrStiffness`."""
    proximal, distal = (_components(nodes, solid) for nodes in end_nodes(solid))
    motions = rigid_motions(solid.points_mm)
    prescribed = np.concatenate([proximal, distal])
    fields = solve_prescribed(
        solid.stiffness, prescribed, np.concatenate([-motions[proximal] / 2, motions[distal] / 2])
    )
    return SnrStiffness(fields.T @ (solid.stiffness @ fields), fields)


def plates_stiffness(solid: Solid) -> tuple[Floats, Floats]:
    """Stiffness (12, 12) of the rigid motions of both plates, proximal first, and the displacements (3 n, 12).

    Both plates count their motion about the middle of the notch. The six rigid motions of the whole are among them.
    """
    proximal, distal = (_components(nodes, solid) for nodes in end_nodes(solid))
    motions = rigid_motions(solid.points_mm)
    values = np.zeros((len(proximal) + len(distal), 12))
    values[: len(proximal), :6] = motions[proximal]
    values[len(proximal) :, 6:] = motions[distal]
    fields = solve_prescribed(solid.stiffness, np.concatenate([proximal, distal]), values)
    return fields.T @ (solid.stiffness @ fields), fields


def chain_stiffness(solid: Solid) -> SnrStiffness:
    """Stiffness of one SNR in an endless chain, every joint equal, for (u_z, r_x, r_y): shape (3, 3).

    The middles of the rings are then planes of symmetry: they stay plane but may change their shape in plane, which a
    rigid plate forbids. The chain under tension and pure bending has this stiffness exactly.
    """
    proximal, distal = (2 * len(solid.points_mm) + nodes for nodes in end_nodes(solid))
    motions = rigid_motions(solid.points_mm)[:, 2:5]
    prescribed = np.concatenate([proximal, distal, _in_plane_pins(solid)])
    values = np.concatenate([-motions[proximal] / 2, motions[distal] / 2, np.zeros((3, 3))])
    fields = solve_prescribed(solid.stiffness, prescribed, values)
    return SnrStiffness(fields.T @ (solid.stiffness @ fields), fields)


def _in_plane_pins(solid: Solid) -> Ints:
    """Three displacements that fix the in-plane rigid motions and nothing else: u_x, u_y of a node, u_y of another."""
    points = solid.points_mm
    left, right = int(points[:, 0].argmin()), int(points[:, 0].argmax())
    count = len(points)
    return np.array([left, count + left, count + right])


def _components(nodes: Ints, solid: Solid) -> Ints:
    count = len(solid.points_mm)
    return np.concatenate([axis * count + nodes for axis in range(3)])


def solve_prescribed(stiffness: sparse.csr_matrix, prescribed: Ints, values: Floats) -> Floats:
    """Displacements (3 n, m) in equilibrium without loads; those numbered ``prescribed`` take ``values`` (k, m)."""
    fields = np.zeros((stiffness.shape[0], values.shape[1]))
    fields[prescribed] = values
    free = free_unknowns(stiffness.shape[0], prescribed)
    fields[free] = factorize(stiffness[free][:, free])(-(stiffness @ fields)[free])
    return fields


def free_unknowns(count: int, prescribed: Ints) -> Ints:
    """Numbers of the other displacements.

    The three components of a node stand side by side: the factor of the matrix in that order is sparser.
    """
    free = np.setdiff1d(np.arange(count), prescribed)
    nodes = count // 3
    return free[np.lexsort((free // nodes, free % nodes))]


def factorize(matrix: sparse.csr_matrix) -> Callable[[Floats], Floats]:
    """Cholesky factor of a positive definite matrix (n, n); the function solves for right-hand sides (n, m)."""
    csc = sparse.csc_matrix(matrix)
    csc.sort_indices()
    pointers, rows = csc.indptr.astype(np.int32), csc.indices.astype(np.int32)
    factor = CholeskySolverD(csc.shape[0], pointers, rows, csc.data, MatrixType.CSC)

    def solve(loads: Floats) -> Floats:
        loads = np.ascontiguousarray(loads)
        solution = np.zeros_like(loads)
        factor.solve(loads, solution)
        return solution

    return solve


def as_flexure(stiffness: Floats) -> Flexure:
    """Read a (6, 6) stiffness as the analytic model does: pure bending, lateral force, tension at the neutral axis.

    The neutral axis is where pure bending causes no axial displacement; ``neutral_offset_mm`` counts from the tube
    axis towards -x, away from a one-sided notch.
    """
    compliance = np.linalg.inv(stiffness)
    bending, coupling = compliance[BENDING, BENDING], compliance[AXIAL, BENDING]
    return Flexure(
        bending_Nmm_per_rad=float(1 / bending),
        shear_N_per_mm=float(1 / compliance[0, 0]),
        axial_N_per_mm=float(1 / (compliance[AXIAL, AXIAL] - coupling**2 / bending)),
        neutral_offset_mm=float(-coupling / bending),
    )
