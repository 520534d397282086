"""Superelastic solid at finite strain: quadratic tetrahedra, its law from a rig, Newton's iteration, its strain.

Total Lagrangian, four points of quadrature, strain and law of :mod:`fem_models.solid.superelastic_kernel`. Units are
mm, N.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy import sparse
from scipy.sparse.linalg import splu

from fem_models.rig import Rig
from fem_models.rig.checks import SolverError, require
from fem_models.solid.linear import factorize
from fem_models.solid.superelastic_kernel import Assembled, Elements, Law, Numbering, Step, assemble, strains
from hysteresis.arrays import Floats, Ints

HARDENING_SHARE = 0.005
"""Slope of the plateau over Young's modulus, which keeps the tangent regular."""

TOLERANCE = 1e-9
"""Residual force where Newton's iteration ends, of the nodal forces, or of those at a strain of 1e-5 if larger."""

_ITERATIONS = 12
_EDGES = ((0, 1), (1, 2), (0, 2), (0, 3), (1, 3), (2, 3))
_GAUSS = np.where(np.eye(4, dtype=bool), 0.5854101966249685, 0.1381966011250105)  # barycentric; degree 2
_CORNERS = np.eye(4)
_NODES = np.vstack([_CORNERS, [(_CORNERS[i] + _CORNERS[j]) / 2 for i, j in _EDGES]])


@dataclass(frozen=True)
class FlagSolid:
    """Metal in its straight shape: nodes (n, 3), elements (m, 10) as :func:`fem_models.solid.linear.cells`, law (6,).

    ``gradients`` (m, 4, 10, 3) and ``volumes`` (m, 4) belong to the points of quadrature.
    """

    points_mm: Floats
    cells: Ints
    law: Law
    gradients: Floats
    volumes: Floats


@dataclass(frozen=True)
class Unknowns:
    """Numbers of the unknown displacements, (n, 3), below 0 where prescribed, and the pattern of the matrix."""

    numbers: Ints
    count: int
    places: NDArray[np.int32]
    indices: NDArray[np.int32]
    pointers: NDArray[np.int32]


@dataclass(frozen=True)
class Equilibrium:
    """Solved state: displacements (n, 3), transformation strains (m, 4), nodal forces (n, 3), N.

    ``residuals`` are those of Newton's iterations, as :data:`TOLERANCE` counts them.
    """

    displacement_mm: Floats
    transformation: Floats
    force_N: Floats
    residuals: tuple[float, ...] = ()


def flag_law(rig: Rig, *, hardening: float = HARDENING_SHARE) -> Law:
    """Law of a rig's metal; elastic where the rig is not superelastic.

    The plateaus of a rig are those in the middle of the transformation; with ``hardening``, the slope over Young's
    modulus, they start lower. The solid is bent slowly: it keeps the temperature of its surroundings.

    Raises
    ------
    RigError
        Plateaus that differ between tension and compression.
    """
    young, poisson = rig.material.youngs_modulus_GPa * 1e3, rig.material.poissons_ratio
    bulk, shear = young / (3 * (1 - 2 * poisson)), young / (2 * (1 + poisson))
    flag = rig.superelastic
    if flag is None:
        return Law(bulk, shear, upper=math.inf, lower=math.inf, span=0.0, hardening=1.0)
    alike = flag.compression_factor == 1
    require(
        alike, "superelastic.compression_factor", flag.compression_factor, "1: the solid's law is alike on both sides"
    )
    slope = hardening * young / (1 - hardening)  # over the transformation strain
    drop = slope * flag.transformation_strain / 2
    return Law(
        bulk=bulk,
        shear=shear,
        upper=float(flag.plateau_MPa + flag.shift_MPa - drop),
        lower=float(max(flag.unloading_plateau_MPa + flag.shift_MPa - drop, 1e-3 * flag.plateau_MPa)),
        span=float(flag.transformation_strain),
        hardening=slope,
    )


def flag_solid(points_mm: Floats, cells: Ints, law: Law) -> FlagSolid:
    """Prepare the elements, which may be of either orientation."""
    gradients, determinants = _gradients(points_mm, cells, _GAUSS)
    return FlagSolid(points_mm, np.ascontiguousarray(cells), law, gradients, np.abs(determinants) / 24)


def _gradients(points: Floats, cells: Ints, barycentric: Floats) -> tuple[Floats, Floats]:
    """Gradients of the shape functions (m, q, 10, 3) and Jacobians (m, q) at barycentric places (q, 4)."""
    edges = np.array(_EDGES)
    slope = np.zeros((len(barycentric), 10, 4))  # by the barycentric coordinates
    slope[:, range(4), range(4)] = 4 * barycentric - 1
    for i in (0, 1):
        slope[:, range(4, 10), edges[:, i]] = 4 * barycentric[:, edges[:, 1 - i]]
    slope = slope[..., 1:] - slope[..., :1]
    jacobian = np.einsum("qas,mai->mqis", slope, points[cells])
    return np.ascontiguousarray(slope @ np.linalg.inv(jacobian)), np.linalg.det(jacobian)


def unknowns(solid: FlagSolid, numbers: Ints) -> Unknowns:
    """Find the pattern of the matrix for the numbers (n, 3) of the displacements, below 0 for prescribed ones.

    Displacements of several nodes that share a number are one unknown.
    """
    own = numbers[solid.cells].reshape(-1, 30)
    count = int(numbers.max()) + 1
    row, column = np.broadcast_arrays(own[:, :, None], own[:, None, :])
    pairs = np.where((row < 0) | (column < 0), -1, row * count + column)
    found, where = np.unique(pairs, return_inverse=True)
    where = where.reshape(len(own), 900)
    if found[0] < 0:
        found, where = found[1:], where - 1
    pointers = np.searchsorted(found, count * np.arange(count + 1))
    return Unknowns(numbers, count, where.astype(np.int32), (found % count).astype(np.int32), pointers.astype(np.int32))


def newton(
    solid: FlagSolid,
    sought: Unknowns,
    start: Equilibrium,
    lift_mm: Floats,
    frames: Floats,
    *,
    before: Floats | None = None,
    push_N: Floats | None = None,
) -> Equilibrium:
    """Move the prescribed displacements by ``lift_mm`` (n, 3) and find the equilibrium of the rest.

    Parameters
    ----------
    start
        Where to begin; its transformation strains are the history.
    frames
        Axes of the unknowns of each node as rows, shape (n, 3, 3).
    before
        Transformation strains for the first tangent. Where the load continues in its direction, those before the last
        step keep metal on a plateau there.
    push_N
        Forces on the nodes along x, y, z, (n, 3), which keep their direction; none by default.

    Raises
    ------
    SolverError
        No convergence.
    """
    pushed = np.zeros(sought.count + 1)  # the last one: prescribed
    if push_N is not None:
        np.add.at(pushed, sought.numbers, np.einsum("nij,nj->ni", frames, push_N))
    place, lift, residuals = start.displacement_mm, lift_mm, []
    elements = Elements(gradients=solid.gradients, volumes=solid.volumes, cells=solid.cells)
    numbering = Numbering(
        frames=frames,
        numbers=sought.numbers,
        places=sought.places,
        entries=len(sought.indices),
        unknowns=sought.count,
    )
    none = np.zeros_like(lift_mm)
    least = 1e-5 * solid.law.shear * float(np.linalg.norm(solid.volumes.sum(axis=1) ** (2 / 3)))
    for iteration in range(_ITERATIONS):
        history = before if iteration == 0 and before is not None else start.transformation
        step = Step(displacement=place, transformation=history, lift=lift)
        found: Assembled = assemble(elements, solid.law, step, numbering)
        load, force = found.load + pushed[:-1], found.force
        if iteration:
            residuals.append(float(np.linalg.norm(load) / max(float(np.linalg.norm(force)), least)))
            if not residuals[-1] < 1e6:
                break
            if residuals[-1] < TOLERANCE:
                return Equilibrium(place, found.transformation, force, tuple(residuals))
        data = found.data.copy()  # CHOLMOD reallocates it, which memory of a compiled function does not allow
        matrix = sparse.csc_matrix((data, sought.indices, sought.pointers), shape=(sought.count, sought.count))
        change = np.append(_solver(matrix)(load[:, None])[:, 0], 0.0)[sought.numbers]  # -1 is the last: prescribed
        place = place + lift + np.einsum("nij,ni->nj", frames, change)
        lift = none
    raise SolverError(f"Newton's residuals {', '.join(f'{r:.1e}' for r in residuals)}: expected below {TOLERANCE:g}")


def _solver(matrix: sparse.csc_matrix) -> Callable[[Floats], Floats]:
    """Cholesky factor, or an LU one where compression has made the tangent indefinite."""
    try:
        return factorize(matrix)
    except ValueError:
        return splu(matrix).solve


def straight(solid: FlagSolid) -> Equilibrium:
    """Return the virgin state."""
    none = np.zeros_like(solid.points_mm)
    return Equilibrium(none, np.zeros_like(solid.volumes), none)


def nodal_strain(solid: FlagSolid, state: Equilibrium) -> tuple[Floats, Floats]:
    """Largest principal logarithmic strain by magnitude (n,), and equivalent strain (n,) as :class:`MomentAngle`.

    Elements give both at their nodes, the transformation extrapolated linearly; the mean weighted by volume is taken.
    """
    at_nodes, _ = _gradients(solid.points_mm, solid.cells, _NODES)
    weight = np.repeat(solid.volumes.sum(axis=1), 10)
    nodes = solid.cells.ravel()
    local = strains(at_nodes, solid.cells, state.displacement_mm).reshape(-1, 6)
    grown = np.clip(state.transformation @ np.linalg.solve(_GAUSS, _NODES.T), 0.0, solid.law.span).ravel()
    total = np.bincount(nodes, weight)
    mean = np.stack([np.bincount(nodes, weight * c) for c in local.T], axis=1) / total[:, None]
    transformed = np.bincount(nodes, weight * grown) / total
    tensor = mean[:, [[0, 5, 4], [5, 1, 3], [4, 3, 2]]] * np.where(np.eye(3), 1.0, math.sqrt(0.5))
    values = np.arcsinh(2 * np.linalg.eigvalsh(tensor)) / 2
    principal = np.where(-values[:, 0] > values[:, 2], values[:, 0], values[:, 2])
    deviator = values - values.mean(axis=1, keepdims=True)
    equivalent = np.sqrt(2 / 3 * (deviator**2).sum(axis=1))
    bulk, shear = solid.law.bulk, solid.law.shear
    young = 9 * bulk * shear / (3 * bulk + shear)
    return principal, transformed + 3 * shear / young * (equivalent - transformed)


def dissipated(solid: FlagSolid, before: Equilibrium, after: Equilibrium) -> float:
    """Work of transformation between two states, Nmm; a closed path dissipates all of it.

    Points must move in one direction between them: int q dg without the stored part h g dg.
    """
    change = after.transformation - before.transformation
    law = solid.law
    rate = np.where(change > 0, law.upper, law.lower) if law.span else 0.0
    return float((solid.volumes * rate * change).sum())
