"""Timoshenko's shear coefficient of a tube cut by planes, for Poisson's ratio 0.

1/kappa = A/I^2 times the energy of a field of shear stress that carries the flexural stress x - x_0. A field in
equilibrium has at least the energy of the true one. The two here are nearly so: the one with less energy is the better.
The equations and their error against finite elements stand in ``docs/theory/analytic-model.md``.
"""

from __future__ import annotations

import numpy as np

from hysteresis.arrays import Floats

_POINTS = 16
_NODES, _WEIGHTS = np.polynomial.legendre.leggauss(_POINTS)


def _tail_matrix() -> Floats:
    """Integrals from every Gauss point to 1 of the polynomial through values at all of them, shape (n, n)."""
    order = np.arange(_POINTS)
    legendre = np.polynomial.legendre.legvander(_NODES, _POINTS)
    tail = np.empty((_POINTS, _POINTS))
    tail[:, 0] = 1 - _NODES
    tail[:, 1:] = (legendre[:, : _POINTS - 1] - legendre[:, 2:]) / (2 * order[1:] + 1)
    return tail @ ((order[:, None] + 0.5) * legendre[:, :_POINTS].T * _WEIGHTS)


_TAIL = _tail_matrix()


def wall_energy(outer: float, inner: float, cut: Floats, centroid: Floats, start_rad: float) -> Floats:
    """Energy of a shear flow along the wall (Jourawski), and of the shear across it, of one half of {x <= cut}.

    x = -r cos(phi), and phi runs from ``start_rad`` to the end of the metal: 0 for a one-sided notch, pi/2 for a
    quarter of the section between a pair of them. Cuts along the radius carry the flow Q, the moment of the metal
    beyond them about the centroid, evenly over their length t. t shrinks where the plane runs through the wall. The
    part of the stress that bends the wall adds 6/5 (t^3/12 cos(phi))^2/t. Shape of ``cut`` and ``centroid``, (m,).
    """
    meets = np.sort([_angle(outer, cut), _angle(inner, cut)], axis=0)  # where the plane meets the two surfaces
    ends = np.maximum(np.stack([np.full_like(cut, start_rad), meets[0], meets[1]]), start_rad)
    energy, beyond = np.zeros_like(cut), np.zeros_like(cut)
    for low, high, is_cut in ((ends[1], ends[2], True), (ends[0], ends[1], False)):
        half = 0.5 * (high - low)[:, None]
        cos = np.cos(low[:, None] + half * (1 + _NODES))
        r_in, r_out = np.full_like(cos, inner), np.full_like(cos, outer)
        if is_cut:
            at_plane = np.clip(-cut[:, None] / np.where(cos == 0, 1e-300, cos), inner, outer)
            upper = cut[:, None] > 0
            r_in, r_out = np.where(upper, inner, at_plane), np.where(upper, at_plane, outer)
        wall = np.maximum(r_out - r_in, 1e-12 * outer)
        lever = -cos * (r_out**2 + r_out * r_in + r_in**2) / 3 - centroid[:, None] * (r_out + r_in) / 2
        density = wall * lever
        flow = beyond[:, None] + half * (density @ _TAIL.T)
        per_length = (flow**2 + 1.2 * (wall**3 / 12 * cos) ** 2) / wall
        energy += half[:, 0] * ((per_length * (r_out + r_in) / 2) @ _WEIGHTS)
        beyond += half[:, 0] * (density @ _WEIGHTS)
    return energy


def _angle(radius: float, cut: Floats) -> Floats:
    """Angle at which the plane x = cut meets a circle, arccos(-cut/radius); 0 and pi beyond it."""
    return 2 * np.arcsin(np.sqrt(np.clip((radius + cut) / (2 * radius), 0.0, 1.0)))


def level_energy(outer: float, inner: float, cut: Floats) -> Floats:
    """Energy in a quarter of {|x| <= cut} of a shear stress that is even over each chord, cuts below ``inner``.

    Its component along the chord makes it tangential to both surfaces and varies linearly between them. Shape (m,).
    """
    half = 0.5 * cut[:, None]
    x = half * (1 + _NODES)
    y_out, y_in = np.sqrt(outer**2 - x**2), np.sqrt(inner**2 - x**2)
    chord = y_out - y_in
    flow = half * ((x * chord) @ _TAIL.T)
    a, b = x / y_out, x / y_in
    return np.asarray(half[:, 0] * ((flow**2 / chord * (1 + (a**2 + a * b + b**2) / 3)) @ _WEIGHTS))
