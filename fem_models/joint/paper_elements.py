"""A single notched ring (SNR) by quadratic Timoshenko elements, as in the paper: eq. 1, and the force for an angle.

The paper is Mech. Sci. 9 (2018), "Hysteresis analysis of a notched continuum manipulator driven by tendon", section 2.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from fem_models.joint.flexure import elasticity
from fem_models.joint.mechanics import joint_mechanics
from fem_models.joint.section import section
from fem_models.rig import Rig
from fem_models.rig.rig import notched_tube
from hysteresis.arrays import Floats


@dataclass(frozen=True)
class ElementSolution:
    """One SNR solved with 3-node Timoshenko elements, its proximal ring clamped.

    ``z_mm``, ``deflection_mm`` and ``rotation_rad`` hold the 2 n + 1 nodes, shape (2 n + 1,), proximal first.
    ``lateral_mm`` is the displacement of the distal ring's mid-frame, ``theta_k_rad`` the rotation of node k (middle
    of the notch) and ``theta_d_rad`` the further rotation from node k to node d (distal end).
    """

    z_mm: Floats
    deflection_mm: Floats
    rotation_rad: Floats
    lateral_mm: float
    theta_k_rad: float
    theta_d_rad: float

    @property
    def theta_kd_rad(self) -> float:
        """Rotation of the whole SNR, theta_k + theta_d of the paper's eq. 1."""
        return self.theta_k_rad + self.theta_d_rad


def element_rotations(rig: Rig, moment_Nmm: float, shear_N: float = 0.0, n_elements: int = 2) -> ElementSolution:
    """Solve one SNR with quadratic Timoshenko elements (3 nodes, 2-point reduced integration), as in the paper.

    The paper divides each arc into two such elements and writes theta_kd = theta_k + theta_d (eq. 1) without further
    explanation. We read it so: node k joins the two elements, node d ends the second; theta_k is the rotation that
    element 1 contributes and theta_d the increment of element 2. Their sum is the rotation of the ring.
    The section is taken at the Gauss points, where the bending moment of such elements is exact.

    Parameters
    ----------
    moment_Nmm, shear_N
        Loads on the distal ring, referred to the mid-point of the notch, as in :class:`Flexure`.
    n_elements
        Even, so that node k is the end of an element; equal lengths. 2 is the paper's.

    Raises
    ------
    RigError
        Measured joints, which have no section.
    ValueError
        If ``n_elements`` is not an even number of at least 2.
    """
    if n_elements < 2 or n_elements % 2:
        raise ValueError(f"n_elements = {n_elements}: expected an even number of at least 2")
    half = notched_tube(rig).cut.width_mm / 2
    nodes = np.linspace(-half, half, 2 * n_elements + 1)
    stiffness = _beam_stiffness(rig, nodes)
    load = np.zeros(stiffness.shape[0])
    load[-2:] = shear_N, moment_Nmm - shear_N * half  # the mid-point's loads moved to the distal end
    solution = np.zeros_like(load)
    solution[2:] = np.linalg.solve(stiffness[2:, 2:], load[2:])
    deflection, rotation = solution[::2].copy(), solution[1::2].copy()
    return ElementSolution(
        z_mm=nodes,
        deflection_mm=deflection,
        rotation_rad=rotation,
        lateral_mm=float(deflection[-1] - half * rotation[-1]),
        theta_k_rad=float(rotation[n_elements]),
        theta_d_rad=float(rotation[-1] - rotation[n_elements]),
    )


def _beam_stiffness(rig: Rig, nodes: Floats) -> Floats:
    """Stiffness of the beam, shape (2 m, 2 m) for m nodes, unknowns (v, phi) node by node.

    Strain energy of curvature phi' and shear v' - phi.
    """
    n = len(nodes) // 2
    xi = np.array([-1.0, 1.0]) / math.sqrt(3)  # both weights are 1
    shape = np.stack([xi * (xi - 1) / 2, 1 - xi**2, xi * (xi + 1) / 2], axis=-1)
    length = float(nodes[2] - nodes[0])
    slope = np.stack([xi - 0.5, -2 * xi, xi + 0.5], axis=-1) * 2 / length
    strain = np.zeros((2, 2, 6))  # Gauss point, (curvature, shear), (v1, phi1, v2, phi2, v3, phi3)
    strain[:, 0, 1::2] = slope
    strain[:, 1, 0::2] = slope
    strain[:, 1, 1::2] = -shape
    metal = elasticity(rig.material)
    s = section(notched_tube(rig), nodes[1::2, None] + xi * length / 2)
    rigidity = np.stack([metal.young * s.second_moment_mm4, s.shear_coefficient * metal.shear * s.area_mm2], axis=-1)
    blocks = length / 2 * np.einsum("gsi,egs,gsj->eij", strain, rigidity, strain)
    stiffness = np.zeros((2 * len(nodes), 2 * len(nodes)))
    for e in range(n):
        stiffness[4 * e : 4 * e + 6, 4 * e : 4 * e + 6] += blocks[e]
    return stiffness


def theta_sum(rig: Rig, force_N: ArrayLike, n_elements: int | None = None) -> Floats:
    """Bending of the manipulator under the force of tendon a alone, g(F_T) of the paper's eq. 1, rad.

    Every joint carries the moment F * arm: no friction, and the arm does not change with the angle.

    Parameters
    ----------
    force_N
        Any shape; the result has the same.
    n_elements
        Elements of an arc (2 as in the paper); None for the converged stiffness of :func:`flexure`.

    Raises
    ------
    RigError
        With ``n_elements`` for measured joints, which have no section.
    """
    force, joint = np.asarray(force_N, dtype=float), joint_mechanics(rig)
    if n_elements is None:
        compliance = 1 / joint.flexure.bending_Nmm_per_rad
    else:
        compliance = element_rotations(rig, 1.0, n_elements=n_elements).theta_kd_rad
    return rig.joints * compliance * joint.arms_mm.a * force
