"""Compiled elements of the superelastic solid: ten-node tetrahedra at finite strain, four points of quadrature.

The strain is E = (C - C^-1)/4 (Bazant, J. Eng. Mater. Technol. 120, 1998, doi 10.1115/1.2807001). A stretch exp(e)
has E = sinh(2 e)/2: the logarithmic strain to 0.7 % of it at 10 %, equal and opposite in tension and compression, zero
under rotation, and without eigenvectors. Symmetric tensors are 6-vectors (11, 22, 33, r 23, r 13, r 12), r = sqrt(2).
"""

from __future__ import annotations

import math
from pathlib import Path
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from fem_models.compiled import njit_of
from hysteresis.arrays import Floats, Ints

solid_njit = njit_of(Path(__file__))

_ROOT2 = math.sqrt(2.0)
_I = np.array([0, 1, 2, 1, 0, 0])
_J = np.array([0, 1, 2, 2, 2, 1])
_SCALE = np.array([1.0, 1.0, 1.0, _ROOT2, _ROOT2, _ROOT2])


class Law(NamedTuple):
    """Superelastic law of the metal; moduli and stresses in N/mm^2."""

    bulk: float
    shear: float
    upper: float  # stress at which the metal transforms
    lower: float  # stress at which it transforms back
    span: float  # transformation strain in all
    hardening: float  # slope of the plateaus over the transformation strain


class Elements(NamedTuple):
    """Ten-node tetrahedra in the straight shape, with four points of quadrature each."""

    gradients: Floats  # of the shape functions, (m, 4, 10, 3), 1/mm
    volumes: Floats  # (m, 4), mm^3
    cells: Ints  # nodes, (m, 10)


class Step(NamedTuple):
    """Where an iteration of Newton's method starts, and what it prescribes."""

    displacement: Floats  # (n, 3)
    transformation: Floats  # (m, 4), strains before the step
    lift: Floats  # (n, 3), prescribed displacements that this iteration makes


class Numbering(NamedTuple):
    """Unknowns of the nodes, and where their pairs stand in the matrix."""

    frames: Floats  # axes of every node's unknowns as rows, (n, 3, 3)
    numbers: Ints  # (n, 3), below 0 where prescribed
    places: NDArray[np.int32]  # of every pair of unknowns of an element in the matrix, (m, 900), below 0 for none
    entries: int  # of the matrix
    unknowns: int  # how many


class Assembled(NamedTuple):
    """Tangent and residual of one Newton iteration."""

    data: Floats  # entries of the matrix
    load: Floats  # right-hand side
    force: Floats  # nodal forces along x, y, z, (n, 3)
    transformation: Floats  # strains, (m, 4)


@solid_njit()
def flag(equivalent: float, rest: float, law: Law) -> tuple[float, float, float]:
    """Equivalent stress, its slope over the equivalent strain, and the transformation strain, from that before.

    q = 3 mu (e - g). The metal transforms where q reaches upper + h g, transforms back where it falls to lower + h g,
    and g stays in [0, span]: the linear rule of Auricchio, Taylor, Lubliner 1997, doi 10.1016/S0045-7825(96)01232-7, in
    closed form. In a bar e - q/(3 mu) + q/E is the strain, q the stress.
    """
    elastic, hardening, span = 3 * law.shear, law.hardening, law.span
    least = min(max((elastic * equivalent - law.upper) / (elastic + hardening), 0.0), span)
    most = min(max((elastic * equivalent - law.lower) / (elastic + hardening), 0.0), span)
    slope, now = elastic, rest
    if least > rest:
        now = least
        if least < span:
            slope = elastic * hardening / (elastic + hardening)
    elif most < rest:
        now = most
        if most > 0.0:
            slope = elastic * hardening / (elastic + hardening)
    return elastic * (equivalent - now), slope, now


@solid_njit()
def stress(strain: Floats, rest: float, law: Law, out: Floats, tangent: Floats) -> float:
    """Stress (6,) conjugate to the strain (6,), its derivative (6, 6), and the new transformation strain.

    The transformation strain lies along the deviator of stress, and so of strain: 2/3 g dev(E)/e.
    """
    mean = (strain[0] + strain[1] + strain[2]) / 3
    norm = 0.0
    for i in range(6):
        d = strain[i] - (mean if i < 3 else 0.0)
        norm += d * d
    equivalent = math.sqrt(2 / 3 * norm)
    q, slope, now = flag(equivalent, rest, law)
    secant = q / equivalent if equivalent > 1e-14 else 3 * law.shear
    along = 4 / 9 * (slope - secant) / equivalent**2 if equivalent > 1e-14 else 0.0
    for i in range(6):
        d_i = strain[i] - (mean if i < 3 else 0.0)
        out[i] = 2 / 3 * secant * d_i + (3 * law.bulk * mean if i < 3 else 0.0)
        for j in range(6):
            d_j = strain[j] - (mean if j < 3 else 0.0)
            tangent[i, j] = along * d_i * d_j
            if i < 3 and j < 3:
                tangent[i, j] += law.bulk - 2 / 9 * secant
        tangent[i, i] += 2 / 3 * secant
    return now


@solid_njit()
def deformation(gradients: Floats, place: Floats, out: Floats) -> None:
    """Deformation gradient (3, 3) from gradients (10, 3) of the shape functions and displacements (10, 3)."""
    for i in range(3):
        for j in range(3):
            total = 1.0 if i == j else 0.0
            for a in range(10):
                total += place[a, i] * gradients[a, j]
            out[i, j] = total


@solid_njit()
def strain_of(f: Floats, inverse: Floats, strain: Floats) -> None:
    """Strain (6,) of a deformation gradient, and C^-1 (3, 3)."""
    c = f.T @ f
    for i in range(3):
        i1, i2 = (i + 1) % 3, (i + 2) % 3
        for j in range(3):
            j1, j2 = (j + 1) % 3, (j + 2) % 3
            inverse[i, j] = c[i1, j1] * c[i2, j2] - c[i1, j2] * c[i2, j1]
    determinant = c[0, 0] * inverse[0, 0] + c[0, 1] * inverse[0, 1] + c[0, 2] * inverse[0, 2]
    inverse /= determinant
    for k in range(6):
        i, j = _I[k], _J[k]
        strain[k] = _SCALE[k] * 0.25 * (c[i, j] - inverse[i, j])


@solid_njit()
def _sandwich(p: Floats, q: Floats, factor: float, out: Floats) -> None:
    """Add factor (P X Q + Q X P)/2 as an operator (6, 6) on symmetric X; P and Q are symmetric."""
    for row in range(6):
        i, j = _I[row], _J[row]
        for column in range(6):
            k, m = _I[column], _J[column]
            value = p[i, k] * q[m, j] + q[i, k] * p[m, j]
            if k != m:
                value = 0.5 * (value + p[i, m] * q[k, j] + q[i, m] * p[k, j])
            out[row, column] += 0.5 * factor * value * _SCALE[row] * (2 / _SCALE[column] if k != m else 1.0)


@solid_njit()
def _second_piola(f: Floats, rest: float, law: Law, second: Floats, tangent: Floats, work: Floats) -> float:
    """Second Piola stress (3, 3), its derivative (6, 6) by Green's strain, and the new transformation strain.

    S = (T + C^-1 T C^-1)/2 and dS = (G D G/4) dE_G - (C^-1 dE_G B + B dE_G C^-1), G = 1 + C^-1 . C^-1,
    B = C^-1 T C^-1. ``work`` has shape (3, 6, 6).
    """
    inverse, strain, conjugate = np.empty((3, 3)), np.empty(6), np.empty(6)
    strain_of(f, inverse, strain)
    law_tangent, both, product = work[0], work[1], work[2]
    now = stress(strain, rest, law, conjugate, law_tangent)
    both[:] = 0.0
    for i in range(6):
        both[i, i] = 1.0
    _sandwich(inverse, inverse, 1.0, both)
    t = np.empty((3, 3))
    for k in range(6):
        t[_I[k], _J[k]] = t[_J[k], _I[k]] = conjugate[k] / _SCALE[k]
    back = inverse @ t @ inverse
    second[:] = 0.5 * (t + back)
    product[:] = law_tangent @ both
    tangent[:] = 0.25 * (both @ product)
    _sandwich(inverse, back, -2.0, tangent)
    return now


@solid_njit()
def _add_point(
    gradients: Floats, f: Floats, second: Floats, tangent: Floats, weight: float, k: Floats, force: Floats
) -> None:
    """Add a point of quadrature to the stiffness (30, 30) and the forces (30,) of an element."""
    b, db = np.empty((30, 6)), np.empty(6)
    for a in range(10):
        for i in range(3):
            for s in range(6):
                p, q = _I[s], _J[s]
                value = f[i, p] * gradients[a, q]
                if p != q:
                    value = (value + f[i, q] * gradients[a, p]) / _ROOT2
                b[3 * a + i, s] = value
    s6 = np.empty(6)
    for s in range(6):
        s6[s] = second[_I[s], _J[s]] * _SCALE[s]
    for row in range(30):
        total = 0.0
        for s in range(6):
            total += b[row, s] * s6[s]
            value = 0.0
            for r in range(6):
                value += b[row, r] * tangent[r, s]
            db[s] = value * weight
        force[row] += weight * total
        for column in range(row + 1):
            value = 0.0
            for s in range(6):
                value += db[s] * b[column, s]
            k[row, column] += value
    for a in range(10):
        for c in range(a + 1):
            value = 0.0
            for i in range(3):
                for j in range(3):
                    value += gradients[a, i] * second[i, j] * gradients[c, j]
            for i in range(3):
                k[3 * a + i, 3 * c + i] += weight * value


@solid_njit()
def assemble(elements: Elements, law: Law, step: Step, numbering: Numbering) -> Assembled:
    """Assemble the tangent and the residual of one Newton iteration."""
    gradients, volumes, cells = elements.gradients, elements.volumes, elements.cells
    displacement, rest, lift = step.displacement, step.transformation, step.lift
    data, load = np.zeros(numbering.entries), np.zeros(numbering.unknowns)
    force, now = np.zeros_like(displacement), np.empty_like(rest)
    place, moved = np.empty((10, 3)), np.empty(30)
    f, second, tangent, work = np.empty((3, 3)), np.empty((3, 3)), np.empty((6, 6)), np.empty((3, 6, 6))
    for e in range(len(cells)):
        k, own = np.zeros((30, 30)), np.zeros(30)
        for a in range(10):
            for i in range(3):
                place[a, i] = displacement[cells[e, a], i]
                moved[3 * a + i] = lift[cells[e, a], i]
        for g in range(volumes.shape[1]):
            deformation(gradients[e, g], place, f)
            now[e, g] = _second_piola(f, rest[e, g], law, second, tangent, work)
            _add_point(gradients[e, g], f, second, tangent, volumes[e, g], k, own)
        for row in range(30):
            for column in range(row):
                k[column, row] = k[row, column]
        total = own + k @ moved
        for a in range(10):
            force[cells[e, a]] += own[3 * a : 3 * a + 3]
        _scatter(e, k, total, cells[e], numbering, data, load)
    return Assembled(data=data, load=load, force=force, transformation=now)


@solid_njit()
def _scatter(e: int, k: Floats, total: Floats, nodes: Ints, numbering: Numbering, data: Floats, load: Floats) -> None:
    """Rotate element e into the axes of its unknowns and add it to the matrix and to the right-hand side."""
    frames, numbers, places = numbering.frames, numbering.numbers, numbering.places[e]
    for a in range(10):
        frame = frames[nodes[a]]
        if frame[0, 0] != 1.0:
            k[3 * a : 3 * a + 3] = frame @ k[3 * a : 3 * a + 3].copy()
            k[:, 3 * a : 3 * a + 3] = k[:, 3 * a : 3 * a + 3].copy() @ frame.T.copy()
            total[3 * a : 3 * a + 3] = frame @ total[3 * a : 3 * a + 3].copy()
    for row in range(30):
        number = numbers[nodes[row // 3], row % 3]
        if number < 0:
            continue
        load[number] -= total[row]
        for column in range(30):
            where = places[30 * row + column]
            if where >= 0:
                data[where] += k[row, column]


@solid_njit()
def strains(gradients: Floats, cells: Ints, displacement: Floats) -> Floats:
    """Strain E (m, q, 6) at the points of ``gradients`` (m, q, 10, 3)."""
    result = np.empty((*gradients.shape[:2], 6))
    place, f, inverse = np.empty((10, 3)), np.empty((3, 3)), np.empty((3, 3))
    for e in range(len(cells)):
        for a in range(10):
            for i in range(3):
                place[a, i] = displacement[cells[e, a], i]
        for g in range(gradients.shape[1]):
            deformation(gradients[e, g], place, f)
            strain_of(f, inverse, result[e, g])
    return result
