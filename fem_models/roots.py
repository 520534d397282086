"""What the rings give at the roots of a flexure: the length that it seems longer by when it bends.

A beam between rigid rings leaves out that the ring turns where the arc is rooted in it. In the unrolled wall that is a
strip on a plate in plane stress (O'Donnell, J. Appl. Mech. 27(3), 1960, p. 461, for the half plane). Under a moment
the strip, h wide with sharp corners, is longer by h f(H/h) at each root, H being half the uncut tube between two
notches, whose middle stays plane. The table below is that problem solved by finite elements; nothing in it is fitted
to a notched tube, and Poisson's ratio does not enter.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.interpolate import PchipInterpolator

from fem_models.rig import Rig
from fem_models.snr import flexure, section

Floats = NDArray[np.float64]

HALF_PLANE = 0.415
"""Root length of a strip on a half plane, of its width."""

_HEIGHTS = (0.0, 0.025, 0.05, 0.1, 0.15, 0.2, 0.3, 0.4, 0.5, 0.7, 1.0, 1.4, 2.0, 3.0, 5.0, 8.0)
_LENGTHS = (
    *(0.0, 0.0244, 0.0478, 0.0911, 0.1301, 0.1648, 0.2219, 0.2650),
    *(0.2971, 0.3389, 0.3708, 0.3901, 0.4018, 0.4087, 0.4124, 0.4137),
)
_SHARE = PchipInterpolator(_HEIGHTS, _LENGTHS)


def root_length(height: ArrayLike) -> Floats:
    """Length by which a strip of unit width seems longer in bending at one root, on a plate of half height ``height``.

    Same shape as ``height``, which is at least 0; interpolated in the table, 0.415 beyond it.
    """
    ratio = np.asarray(height, dtype=float)
    return np.where(ratio > _HEIGHTS[-1], HALF_PLANE, _SHARE(np.minimum(ratio, _HEIGHTS[-1])))


def root_length_mm(rig: Rig) -> float:
    """Root length of a rig's flexure at each of its two ends, mm; sharp corners.

    Raises
    ------
    RigError
        As :func:`fem_models.snr.section`.
    """
    root = section(rig, 0.0)
    assert rig.tube is not None
    assert rig.notch is not None
    wall = (rig.tube.outer_diameter_mm - rig.tube.inner_diameter_mm) / 2
    arc = float(root.area_mm2) / wall / (1 if rig.notch.shape == "rectangular" else 2)
    return arc * float(root_length(rig.notch.spacing_mm / 2 / arc))


def bending_with_roots(rig: Rig) -> float:
    """Bending stiffness of one joint, Nmm/rad: the analytic flexure with its root length at either end.

    Against the solid it is within 5 % where the beam alone is 10 to 300 % too stiff (docs/notches.md has the limits).

    Raises
    ------
    RigError
        As :func:`fem_models.snr.section`.
    """
    young = rig.material.youngs_modulus_GPa * 1e3
    rigidity = young * float(section(rig, 0.0).second_moment_mm4)
    return 1 / (1 / flexure(rig).bending_Nmm_per_rad + 2 * root_length_mm(rig) / rigidity)
