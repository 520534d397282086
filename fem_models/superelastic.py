"""Superelastic Nitinol through the section of a flexure: flag-shaped fibres, as elements in the angle of the joint."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from fem_models.rig import Rig
from fem_models.snr import flexure, section_fibres

FIBRES = 8
"""Fibres from the neutral axis to the edge: the moment at the plateau is within 1 % of that of 200."""

Floats = NDArray[np.float64]


@dataclass(frozen=True)
class FlagFibres:
    """Parallel flag elements of one joint; arrays of shape (k,).

    An element with the stiffness k (Nmm/rad) transforms when its moment reaches ``upper_Nmm``, comes back when it
    falls to ``lower_Nmm``, and is fully transformed when its rest angle has moved by ``span_rad``. At small angles
    they add up to the bending stiffness of the joint.
    """

    stiffness: Floats
    upper_Nmm: Floats
    lower_Nmm: Floats
    span_rad: Floats


def flag_fibres(rig: Rig) -> FlagFibres:
    """Give the fibres of a rig; of none where the rig is not superelastic.

    A fibre at the distance y from the neutral axis has the strain y theta/L, L being the length over which the root's
    section would bend as much as the joint does, its roots in the rings included, and contributes the moment
    sigma y dA, E y^2 dA/L per radian.
    """
    law = rig.superelastic
    if law is None:
        none = np.empty(0)
        return FlagFibres(none, none, none, none)
    y, area = section_fibres(rig, FIBRES)
    young = rig.material.youngs_modulus_GPa * 1e3
    length = young * float((y**2 * area).sum()) / flexure(rig).bending_Nmm_per_rad
    stiffness = young * y**2 * area / length
    return FlagFibres(
        stiffness=stiffness,
        upper_Nmm=stiffness * law.plateau_MPa / young * length / y,
        lower_Nmm=stiffness * law.unloading_plateau_MPa / young * length / y,
        span_rad=law.transformation_strain * length / y,
    )


def flag_moment(angle_rad: Floats, rest_rad: Floats, fibres: FlagFibres) -> Floats:
    """Moment of flag elements at their angles, Nmm; all shapes (k,).

    The elastic line from the rest angle, held between the loading branch (up to the plateau, along it, and beyond the
    span of the transformation) and the unloading one, on either side alike.
    """
    k, u = fibres.stiffness, np.abs(angle_rad)
    sign = np.where(angle_rad < 0, -1.0, 1.0)
    full = k * (u - fibres.span_rad)
    low = np.maximum(np.minimum(k * u, fibres.lower_Nmm), full)
    high = np.maximum(np.minimum(k * u, fibres.upper_Nmm), full)
    return sign * np.clip(sign * k * (angle_rad - rest_rad), low, high)
