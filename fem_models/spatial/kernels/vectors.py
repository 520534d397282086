"""Vectors in space and rotations, compiled. A vector is a tuple of three numbers, which a compiler keeps in registers.

A rotation by the vector eta is I + a [eta]x + b [eta]x^2, with s = eta.eta, h = sqrt(s), a = sin(h)/h and
b = (1 - cos h)/s (Rodrigues 1840). a and b are even in h: they are series in s, as their derivatives are.
"""

from __future__ import annotations

import math
from typing import NamedTuple

from fem_models.spatial.kernels.compiled import spatial_njit
from hysteresis.arrays import Floats

Vector = tuple[float, float, float]
LARGEST_TURN = math.pi
"""Of a joint, rad: beyond it another rotation vector is the shorter one."""


class Turn(NamedTuple):
    """Rotation by a vector: s, and a and b with their first and second derivatives in s."""

    eta: Vector
    s: float
    a: float
    a1: float
    a2: float
    b: float
    b1: float
    b2: float


@spatial_njit(forceinline=True)
def take(values: Floats, i: int, at: int) -> Vector:
    """Three numbers of row i of a table, from a column on."""
    return values[i, at], values[i, at + 1], values[i, at + 2]


@spatial_njit(forceinline=True)
def take_at(values: Floats, i: int, j: int, at: int) -> Vector:
    """Three numbers of row (i, j) of a table, from a column on."""
    return values[i, j, at], values[i, j, at + 1], values[i, j, at + 2]


@spatial_njit(forceinline=True)
def put(values: Floats, i: int, at: int, p: Vector) -> None:
    """Write a vector to row i of a table, from a column on."""
    values[i, at], values[i, at + 1], values[i, at + 2] = p


@spatial_njit(forceinline=True)
def put_at(values: Floats, i: int, j: int, at: int, p: Vector) -> None:
    """Write a vector to row (i, j) of a table, from a column on."""
    values[i, j, at], values[i, j, at + 1], values[i, j, at + 2] = p


@spatial_njit(forceinline=True)
def dot(p: Vector, q: Vector) -> float:
    """Scalar product."""
    return p[0] * q[0] + p[1] * q[1] + p[2] * q[2]


@spatial_njit(forceinline=True)
def cross(p: Vector, q: Vector) -> Vector:
    """Vector product."""
    return p[1] * q[2] - p[2] * q[1], p[2] * q[0] - p[0] * q[2], p[0] * q[1] - p[1] * q[0]


@spatial_njit(forceinline=True)
def scaled(f: float, p: Vector) -> Vector:
    """Give f p."""
    return f * p[0], f * p[1], f * p[2]


@spatial_njit(forceinline=True)
def two(f: float, p: Vector, g: float, q: Vector) -> Vector:
    """Give f p + g q."""
    return f * p[0] + g * q[0], f * p[1] + g * q[1], f * p[2] + g * q[2]


@spatial_njit(forceinline=True)
def three(f: float, p: Vector, g: float, q: Vector, h: float, r: Vector) -> Vector:
    """Give f p + g q + h r."""
    return (
        f * p[0] + g * q[0] + h * r[0],
        f * p[1] + g * q[1] + h * r[1],
        f * p[2] + g * q[2] + h * r[2],
    )


@spatial_njit(forceinline=True)
def times(m: Floats, r: int, p: Vector) -> Vector:
    """Matrix in the rows r to r + 2 of a table times a vector."""
    return dot(take(m, r, 0), p), dot(take(m, r + 1, 0), p), dot(take(m, r + 2, 0), p)


@spatial_njit(forceinline=True)
def times_t(m: Floats, r: int, p: Vector) -> Vector:
    """Transpose of such a matrix times a vector."""
    return three(p[0], take(m, r, 0), p[1], take(m, r + 1, 0), p[2], take(m, r + 2, 0))


@spatial_njit(forceinline=True)
def add_outer(m: Floats, r: int, f: float, p: Vector, q: Vector) -> None:
    """Add f p q^T to a matrix in the rows r to r + 2 of a table."""
    for i in range(3):
        for col in range(3):
            m[r + i, col] += f * p[i] * q[col]


@spatial_njit(forceinline=True)
def add_one(m: Floats, r: int, f: float) -> None:
    """Add f times the unit matrix."""
    m[r, 0] += f
    m[r + 1, 1] += f
    m[r + 2, 2] += f


@spatial_njit()
def turn_by(eta: Vector) -> Turn:
    """Coefficients of a rotation of up to half a turn, to rounding."""
    s = dot(eta, eta)
    a = a1 = a2 = b = b1 = b2 = 0.0
    terms = 6 if s < 0.1 else 14
    for n in range(terms, -1, -1):  # Horner's rule; 1/(2 n + 1)! over the factor of the term before
        ka, kb = -1.0 / ((2 * n + 2) * (2 * n + 3)), -1.0 / ((2 * n + 3) * (2 * n + 4))
        a2 = ka * (2.0 * a1 + s * a2)
        a1 = ka * (a + s * a1)
        a = 1.0 + ka * s * a
        b2 = kb * (2.0 * b1 + s * b2)
        b1 = kb * (b + s * b1)
        b = 1.0 + kb * s * b
    return Turn(eta, s, a, a1, a2, 0.5 * b, 0.5 * b1, 0.5 * b2)


@spatial_njit(forceinline=True)
def turned(turn: Turn, p: Vector, sense: float) -> Vector:
    """Turn a vector, or turn it back with a sense of -1."""
    e = turn.eta
    return three(1.0 - turn.b * turn.s, p, sense * turn.a, cross(e, p), turn.b * dot(e, p), e)


@spatial_njit(forceinline=True)
def turned_slope(turn: Turn, u: Vector, c: Vector, w: Vector) -> Vector:
    """Gradient in eta of b [(u.eta)(c.eta) - s u.c] + 2 a eta.w; with w = c x u/2 that of u.(c turned)."""
    e = turn.eta
    eu, ec, uc = dot(e, u), dot(e, c), dot(u, c)
    along = -2.0 * turn.b * uc + 2.0 * turn.b1 * (eu * ec - turn.s * uc) + 4.0 * turn.a1 * dot(e, w)
    p = three(turn.b * ec, u, turn.b * eu, c, along, e)
    return two(1.0, p, 2.0 * turn.a, w)


@spatial_njit(forceinline=True)
def invert(m: Floats, r: int, out: int) -> None:
    """Write the inverse of the matrix in the rows r to r + 2 of a table to the rows from ``out`` on, by its minors."""
    p, q, s = take(m, r, 0), take(m, r + 1, 0), take(m, r + 2, 0)
    x, y, z = cross(q, s), cross(s, p), cross(p, q)
    by = 1.0 / dot(p, x)
    for i in range(3):
        m[out + i, 0], m[out + i, 1], m[out + i, 2] = by * x[i], by * y[i], by * z[i]
