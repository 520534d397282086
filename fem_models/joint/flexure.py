"""Analytic single notched ring (SNR): Timoshenko beams between two rigid rings.

Axes of one notch: z along the tube with z = 0 in the middle of the notch, x in the bending plane, the tendons at
+-x. Both cut faces are normal to x. Linear elasticity, small strain. The equations stand in
``docs/analytic-model.md``; the paper is Mech. Sci. 9 (2018), "Hysteresis analysis of a notched continuum manipulator
driven by tendon", section 2.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import lru_cache, wraps
from itertools import pairwise
from typing import TypeVar

import numpy as np
from numpy.typing import ArrayLike

from fem_models.joint.roots import root_length
from fem_models.rig.checks import RigError
from fem_models.rig.rig import Material, Notch, Rig, Tendon, Tube, Wheel
from hysteresis.arrays import Floats

T = TypeVar("T")

BENCH_GAP = 0.2
"""Assumed opening between the rings of measured joints, of the pitch: small, so that the path is nearly r theta."""

_ARC_NODES, _ARC_WEIGHTS = np.polynomial.legendre.leggauss(12)


@dataclass(frozen=True)
class Section:
    """Cross-section of a flexure; each field has the shape of the z it was asked at.

    ``second_moment_mm4`` is about the neutral axis, which lies ``neutral_offset_mm`` from the tube axis, away from a
    one-sided notch (0 for pairs). ``shear_coefficient`` is Timoshenko's kappa for shear in the bending plane.
    """

    area_mm2: Floats
    second_moment_mm4: Floats
    shear_coefficient: Floats
    neutral_offset_mm: Floats


@dataclass(frozen=True)
class Flexure:
    """Stiffness of one joint, referred to the middle of its notch, between rings that are rigid.

    Parameters
    ----------
    bending_Nmm_per_rad
        Moment per relative rotation of the two rings.
    shear_N_per_mm
        Lateral force through the mid-point per lateral displacement of one mid-frame against the other. The bending
        part is in it: for a uniform flexure 1/k = w^3/(12 E I) + w/(kappa G A). None where the joint was measured
        on a bench and its shear compliance is not known: treat such a joint as rigid in shear.
    axial_N_per_mm
        Axial force at the neutral axis per elongation; None as for shear.
    neutral_offset_mm
        Distance of the neutral axis from the tube axis, away from a one-sided notch; 0 for pairs and bench joints.
    """

    bending_Nmm_per_rad: float
    shear_N_per_mm: float | None
    axial_N_per_mm: float | None
    neutral_offset_mm: float


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


def _cut(rig: Rig) -> tuple[Tube, Notch]:
    if rig.tube is None or rig.notch is None:
        raise RigError(f"rig {rig.name}: joints measured on a bench: expected [tube] and [notch]")
    return rig.tube, rig.notch


def cut_height_mm(rig: Rig, z_mm: ArrayLike) -> Floats:
    """Distance of the cut face from the tube axis at z, the shape of ``z_mm``.

    A V has its flat root over ``root_width_mm`` and rises linearly to the outer surface at ``width_mm``; a slot is
    constant. Of a pair |x| <= c is left, of a one-sided notch x <= c (c is negative for a cut beyond the axis).

    Raises
    ------
    RigError
        If the joints were measured on a bench.
    """
    tube, notch = _cut(rig)
    z = np.abs(np.asarray(z_mm, dtype=float))
    outer = tube.outer_diameter_mm / 2
    if notch.shape != "v_pair":
        return np.full_like(z, outer - notch.depth_mm)
    root = notch.root_width_mm or 0.0
    return outer - notch.depth_mm * np.clip((notch.width_mm / 2 - z) / ((notch.width_mm - root) / 2), 0.0, 1.0)


def section(rig: Rig, z_mm: ArrayLike) -> Section:
    """Cross-section of the flexure at z, arrays of the shape of ``z_mm``.

    The planar cut is replaced by a radial one through the same point of the mid-wall: annular sectors of half angle
    arcsin(c/R_m) each (a pair of notches), or arccos(-c/R_m) (one-sided). ``docs/analytic-model.md`` gives the
    error of that. Where c reaches R_m the pair of arcs is the full tube.

    Raises
    ------
    RigError
        If the joints were measured on a bench or a one-sided notch leaves nothing of the tube.
    """
    tube, notch = _cut(rig)
    outer, inner = tube.outer_diameter_mm / 2, tube.inner_diameter_mm / 2
    ratio = cut_height_mm(rig, z_mm) / ((outer + inner) / 2)
    if notch.shape != "rectangular":
        return _two_arcs(outer, inner, np.arcsin(np.minimum(ratio, 1.0)))
    if ratio.size and ratio.min() <= -1:
        raise RigError(
            f"notch.depth_mm = {notch.depth_mm}: expected below {outer + (outer + inner) / 2:g} mm, "
            "or nothing is left of the wall"
        )
    return _one_arc(outer, inner, np.arccos(np.maximum(-ratio, -1.0)))


def _two_arcs(outer: float, inner: float, angle: Floats) -> Section:
    """Two annular sectors of half angle ``angle`` at +-90 deg from the bending plane, x = r sin(phi)."""
    radius, wall = (outer + inner) / 2, outer - inner
    area = 2 * angle * (outer**2 - inner**2)
    second = (outer**4 - inner**4) / 2 * (angle - np.sin(2 * angle) / 2)
    phi = angle[..., None] * _ARC_NODES
    # first moment of the arc beyond phi, cos(phi) - cos(a) written so that it does not cancel for small arcs
    beyond = 2 * radius**2 * wall * np.sin((angle[..., None] + phi) / 2) * np.sin((angle[..., None] - phi) / 2)
    shear = _shear_coefficient(area, second, 2 * radius * angle, wall, beyond, np.sin(phi))
    return Section(area, second, shear, np.zeros_like(angle))


def _one_arc(outer: float, inner: float, angle: Floats) -> Section:
    """One annular sector of half angle ``angle`` around the side away from the notch, -x = r cos(phi)."""
    radius, wall = (outer + inner) / 2, outer - inner
    area = angle * (outer**2 - inner**2)
    offset = 2 * np.sin(angle) * (outer**3 - inner**3) / (3 * angle * (outer**2 - inner**2))
    second = (outer**4 - inner**4) / 4 * (angle + np.sin(2 * angle) / 2) - area * offset**2
    phi = angle[..., None] * _ARC_NODES
    beyond = radius**2 * wall * (phi * (np.sin(angle) / angle)[..., None] - np.sin(phi))
    shear = _shear_coefficient(area, second, radius * angle, wall, beyond, np.cos(phi))
    return Section(area, second, shear, offset)


def _shear_coefficient(
    area: Floats, second: Floats, half_length: Floats, wall: float, beyond: Floats, slope: Floats
) -> Floats:
    """Kappa from the energy of the shear flow along the arcs (Jourawski) and of the shear across their wall.

    1/kappa = A/I^2 * integral of (Q^2/t + 6/5 (t^3/12 dx/dr)^2/t) ds, Q (``beyond``) being the first moment of the
    arc beyond a point and dx/dr (``slope``) the part of the linear stress that bends the wall. ``half_length`` is
    half the length of all arcs together; ``beyond`` and ``slope`` have the Gauss points of one arc on the last axis.
    """
    energy = (beyond**2 / wall + 1.2 * (wall**3 / 12 * slope) ** 2 / wall) @ _ARC_WEIGHTS
    return second**2 / (area * half_length * energy)


def _moduli(rig: Rig) -> tuple[float, float]:
    """Young's and shear modulus, N/mm^2."""
    young = rig.material.youngs_modulus_GPa * 1e3
    return young, young / (2 * (1 + rig.material.poissons_ratio))


def _kinks(rig: Rig) -> list[float]:
    """Where the section changes abruptly for z > 0: the edge of a V's root, and where its two arcs meet."""
    tube, notch = _cut(rig)
    if notch.shape != "v_pair":
        return []
    half, root = notch.width_mm / 2, (notch.root_width_mm or 0.0) / 2
    to_mid_wall = (tube.outer_diameter_mm - tube.inner_diameter_mm) / 4
    return [z for z in (root, half - (half - root) * to_mid_wall / notch.depth_mm) if 0 < z < half]


def _graded_gauss(kinks: list[float]) -> tuple[Floats, Floats]:
    """Points and weights for integrands that are smooth between kinks but steep after them, as 1/I of a V.

    Each piece is cut at halves of halves towards both of its ends, with Gauss points on every cut.
    """
    nodes, weights = np.polynomial.legendre.leggauss(12)
    edges = [kinks[0]]
    for a, b in pairwise(kinks):
        edges += [a + (b - a) * 0.5**k for k in range(12, 0, -1)]
        edges += [b - (b - a) * 0.5**k for k in range(2, 25)] + [b]
    low, length = np.array(edges[:-1]), np.diff(edges)
    return (
        (low[:, None] + 0.5 * length[:, None] * (1 + nodes)).ravel(),
        (0.5 * length[:, None] * weights).ravel(),
    )


def root_length_mm(rig: Rig) -> float:
    """Length by which a flexure seems longer at each of its two ends when it bends, mm; sharp corners.

    The ring turns where an arc is rooted in it: :mod:`fem_models.joint.roots`.

    Raises
    ------
    RigError
        As :func:`section`.
    """
    tube, notch = _cut(rig)
    wall = (tube.outer_diameter_mm - tube.inner_diameter_mm) / 2
    arc = float(section(rig, 0.0).area_mm2) / wall / (1 if notch.shape == "rectangular" else 2)
    return arc * float(root_length(notch.spacing_mm / 2 / arc))


def _of_metal(function: Callable[[Rig], T]) -> Callable[[Rig], T]:
    """Remember a function of a rig that looks at the tube, the notch and the elastic constants alone."""

    @lru_cache(maxsize=1024)
    def known(tube: Tube, notch: Notch, young_GPa: float, poissons_ratio: float, /) -> T:
        rope = Tendon(1.0, 0.5 * tube.inner_diameter_mm, 1.0)
        metal = Material(young_GPa, poissons_ratio)
        return function(Rig("", metal, rope, None, Wheel(1.0), preload_N=0.0, tube=tube, notch=notch))

    @wraps(function)
    def of(rig: Rig) -> T:
        if rig.tube is None or rig.notch is None:
            return function(rig)
        return known(rig.tube, rig.notch, rig.material.youngs_modulus_GPa, rig.material.poissons_ratio)

    return of


@_of_metal
def flexure(rig: Rig) -> Flexure:
    """Stiffness of one joint: the analytic beam of :func:`beam`, longer in bending by its root length at either end.

    The beam alone is 10 to 300 % too stiff in bending; with the roots most notches are within 5 % of solid finite
    elements (docs/notches.md, which also says where not). A bench rig gives its measured bending stiffness only.

    Raises
    ------
    RigError
        As :func:`section`.
    """
    if rig.bench is not None:
        return Flexure(rig.bench.flexure_stiffness_Nmm_per_rad, None, None, 0.0)
    between = beam(rig)
    if _cut(rig)[1].rigid_roots:
        return between
    rigidity = _moduli(rig)[0] * float(section(rig, 0.0).second_moment_mm4)
    bending = 1 / (1 / between.bending_Nmm_per_rad + 2 * root_length_mm(rig) / rigidity)
    return replace(between, bending_Nmm_per_rad=bending)


@_of_metal
def beam(rig: Rig) -> Flexure:
    """Stiffness of a notch between rigid rings by quadrature of the closed-form sections: the paper's analytic model.

    1/k_bending = int dz/(E I), 1/k_shear = int z^2/(E I) dz + int dz/(kappa G A), 1/k_axial = int dz/(E A).
    Moment, lateral and axial force at the mid-point do not couple because the notch is symmetric about z = 0 (and
    the axial force is taken at the neutral axis).

    Raises
    ------
    RigError
        As :func:`section`.
    """
    young, shear_modulus = _moduli(rig)

    z, weights = _graded_gauss([0.0, *_kinks(rig), _cut(rig)[1].width_mm / 2])
    s = section(rig, z)
    bend = 1 / (young * s.second_moment_mm4)
    shear = 1 / (s.shear_coefficient * shear_modulus * s.area_mm2)
    half_notch = np.array([bend, z**2 * bend + shear, 1 / (young * s.area_mm2)]) @ weights
    bending, lateral, axial = (0.5 / half_notch).tolist()
    return Flexure(bending, lateral, axial, float(section(rig, 0.0).neutral_offset_mm))


@_of_metal
def bending_length_mm(rig: Rig) -> float:
    """Length over which a notch bends: E I of its root over the beam's bending stiffness, the width for a slot.

    It places the flexure; what the rings give at its roots makes the joint softer, not the notch wider.
    """
    if rig.notch is None:
        return BENCH_GAP * rig.pitch_mm
    root = _moduli(rig)[0] * float(section(rig, 0.0).second_moment_mm4)
    return min(root / beam(rig).bending_Nmm_per_rad, rig.notch.width_mm)


def turning_length_mm(rig: Rig) -> float:
    """Length of the part of a notch that both engines turn by half the joint's angle, the rest going with the rings.

    A slot bends to a circular arc, with the chord w (1 - t^2/24 + ...) at the angle t. Rigid ends of w/6 and
    two thirds of w along the mean direction have the same: w/3 cos(t/2) + 2 w/3. A V bends close to its root, over
    :func:`bending_length_mm`, and so do measured joints.
    """
    length = bending_length_mm(rig)
    return length if rig.notch is None or rig.notch.shape == "v_pair" else 2 / 3 * length


def rigid_gap_mm(rig: Rig) -> float:
    """Length of a notch beside the part that bends, both ends together: it turns with the rings."""
    if rig.notch is None:
        return rig.bench.rigid_gap_mm if rig.bench else 0.0
    return rig.notch.width_mm - turning_length_mm(rig)


@_of_metal
def ring_stiffness(rig: Rig) -> tuple[float, float, float]:
    """Bending, axial and shear stiffness of the uncut tube between two flexures, at its middle: Nmm/rad, N/mm, N/mm.

    Of measured joints it is part of the joint: far stiffer here.
    """
    length_mm = rig.pitch_mm - bending_length_mm(rig)
    if rig.tube is None:
        rigid = 1e2 * max(rope.EA_N for rope in rig.tendons) / rig.pitch_mm
        return rigid * rig.pitch_mm**2, rigid, rigid
    outer, inner = rig.tube.outer_diameter_mm / 2, rig.tube.inner_diameter_mm / 2
    young = _moduli(rig)[0]
    area, second = math.pi * (outer**2 - inner**2), math.pi / 4 * (outer**4 - inner**4)
    # kappa = 1/2 of a thin round tube (Cowper 1966, doi 10.1115/1.3625046, for zero Poisson's ratio)
    shear = length_mm**3 / (12 * young * second) + length_mm * 4 * (1 + rig.material.poissons_ratio) / (young * area)
    return young * second / length_mm, young * area / length_mm, 1 / shear


def section_fibres(rig: Rig, count: int) -> tuple[Floats, Floats]:
    """Distances from the neutral axis (mm, above 0) and areas (mm^2) of fibres at the root, shapes (k,).

    Of a pair of notches, Gauss points over the arcs at the mid-wall, ``count`` on either side of the neutral axis; the
    two sides are alike, so their areas are added. What a one-sided notch leaves is a strip hardly higher than the wall
    is thick: points over the wall, too, up to the flat face of the cut, gathered into ``count`` classes of distance,
    either side alike. A class keeps the area's first and second moment, those of a flat plateau and of elasticity.
    """
    tube, notch = _cut(rig)
    outer, inner = tube.outer_diameter_mm / 2, tube.inner_diameter_mm / 2
    radius, per_angle = (outer + inner) / 2, (outer**2 - inner**2) / 2
    ratio = float(cut_height_mm(rig, 0.0)) / radius
    nodes, weights = np.polynomial.legendre.leggauss(count)
    if notch.shape != "rectangular":
        angle = math.asin(min(ratio, 1.0))
        phi = 0.5 * angle * (1 + nodes)
        return radius * np.sin(phi), 4 * per_angle * 0.5 * angle * weights
    cells = 100 * count  # over the angle; the midpoint rule leaves 1e-5 of the moments
    across, thick = np.polynomial.legendre.leggauss(6)
    r = radius + 0.5 * (outer - inner) * across
    open_to = np.arccos(np.clip(-float(cut_height_mm(rig, 0.0)) / r, -1.0, 1.0))  # to the cut face, which is flat
    height = r[:, None] * np.cos(open_to[:, None] * (np.arange(cells) + 0.5) / cells)
    area = np.broadcast_to((0.5 * thick * (outer - inner) * 2 * r * open_to / cells)[:, None], height.shape)
    distance = np.abs(height - (area * height).sum() / area.sum())
    kind = np.minimum((count * distance / distance.max()).astype(int), count - 1).ravel()
    first = np.bincount(kind, (area * distance).ravel(), count)
    second = np.bincount(kind, (area * distance**2).ravel(), count)
    return second / first, first**2 / second


def moment_arms_mm(rig: Rig) -> tuple[float, float]:
    """Moment arms of tendon a and tendon b about the neutral axis, each positive on its own side.

    Pairs of notches and bench joints: ``moment_arm_mm`` as it stands. One-sided notches: ``moment_arm_mm`` counts
    from the tube axis; tendon a runs on the notched side and gains the neutral offset, tendon b loses it (York et
    al., ICRA 2015, "A wrist for needle-sized surgical robots"). The arm of tendon b may come out at or below 0: it
    then cannot bend the manipulator its way. A tendon b that is not there has the arm 0.

    Raises
    ------
    RigError
        As :func:`section`.
    """
    offset = 0.0 if rig.notch is None else float(section(rig, 0.0).neutral_offset_mm)
    arm_b = 0.0 if rig.tendon_b is None else rig.tendon_b.moment_arm_mm - offset
    return rig.tendon_a.moment_arm_mm + offset, arm_b


def force_scale_N(rig: Rig) -> float:
    """Tension that small forces are measured by: the preload; of one tendon at least what bends a joint by a degree."""
    if rig.tendon_b is not None:
        return rig.preload_N
    return max(rig.preload_N, math.radians(1.0) * flexure(rig).bending_Nmm_per_rad / moment_arms_mm(rig)[0])


def closure_angle_rad(rig: Rig) -> float:
    """Angle of one joint at which the edges of its notch meet at the outer surface; inf for a bench rig.

    Of a V 2 atan(w/2 / (R_o + neutral offset)): the rings turn about the neutral axis at mid-notch. A slot bends all
    the way, to a circular arc whose chord its edges have to pass: w / (R_o + neutral offset).

    Raises
    ------
    RigError
        As :func:`section`.
    """
    if rig.bench is not None:
        return math.inf
    tube, notch = _cut(rig)
    lever = tube.outer_diameter_mm / 2 + float(section(rig, 0.0).neutral_offset_mm)
    return 2 * math.atan2(notch.width_mm / 2, lever) if notch.shape == "v_pair" else notch.width_mm / lever


def element_rotations(rig: Rig, moment_Nmm: float, shear_N: float = 0.0, n_elements: int = 2) -> ElementSolution:
    """Solve one SNR with quadratic Timoshenko elements (3 nodes, 2-point reduced integration), as in the paper.

    The paper cuts each arc into two such elements and writes theta_kd = theta_k + theta_d (eq. 1) without more.
    Our reading: node k joins the two elements, node d ends the second; theta_k is the rotation that element 1
    contributes and theta_d the increment that element 2 contributes, so that their sum is the rotation of the ring.
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
        As :func:`section`.
    ValueError
        If ``n_elements`` is not an even number of at least 2.
    """
    if n_elements < 2 or n_elements % 2:
        raise ValueError(f"n_elements = {n_elements}: expected an even number of at least 2")
    half = _cut(rig)[1].width_mm / 2
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
    young, shear_modulus = _moduli(rig)
    s = section(rig, nodes[1::2, None] + xi * length / 2)
    rigidity = np.stack([young * s.second_moment_mm4, s.shear_coefficient * shear_modulus * s.area_mm2], axis=-1)
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
        As :func:`section`; also with ``n_elements`` for a bench rig, which has no section.
    """
    force = np.asarray(force_N, dtype=float)
    if n_elements is None:
        compliance = 1 / flexure(rig).bending_Nmm_per_rad
    else:
        compliance = element_rotations(rig, 1.0, n_elements=n_elements).theta_kd_rad
    return rig.joints * compliance * moment_arms_mm(rig)[0] * force


def force_for_angle(rig: Rig, theta_sum_rad: ArrayLike, n_elements: int | None = None) -> Floats:
    """Force of tendon a, N, that bends the manipulator by ``theta_sum_rad``: the inverse of :func:`theta_sum`."""
    return np.asarray(theta_sum_rad, dtype=float) / theta_sum(rig, 1.0, n_elements)


@_of_metal
def peak_strain_per_rad(rig: Rig) -> float:
    """Strain of the outermost fibre at the root of the notch per radian of one joint, linear elastic.

    k e/(E I_root) of the :func:`beam`, as if the notch alone bent. The rings take part of the angle, and at a sharp
    root the strain is higher than the section's: the solid of the default rig, filleted, has more (docs/notches.md).
    e is the larger distance from the neutral axis: the cut face, or the outer surface opposite a one-sided notch.

    Raises
    ------
    RigError
        As :func:`section`.
    """
    tube, notch = _cut(rig)
    root = section(rig, 0.0)
    offset = float(root.neutral_offset_mm)
    fibre = float(cut_height_mm(rig, 0.0)) + offset
    if notch.shape == "rectangular":
        fibre = max(fibre, tube.outer_diameter_mm / 2 - offset)
    return beam(rig).bending_Nmm_per_rad * fibre / (_moduli(rig)[0] * float(root.second_moment_mm4))
