"""Flag elements of a joint fitted to the curve of a solid.

Both engines take such elements as those of :func:`fem_models.joint.superelastic.flag_fibres`.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike
from scipy.optimize import nnls

from fem_models.joint.superelastic import FlagFibres, flag_moment
from fem_models.rig import Rig, RigError
from fem_models.rig.effects import Superelastic
from fem_models.solid.large_bending import MomentAngle
from hysteresis.arrays import Floats

ONSETS = 40
LOWERS = (0.9, 1.0, 1.15, 1.3)
"""How many angles of transformation the fit chooses from, and ratios of the unloading moment to that of a fibre."""


def flag_path(fibres: FlagFibres, angles_rad: ArrayLike) -> Floats:
    """Moments of flag elements along a path of angles (m,) from rest, shape (m, k), Nmm."""
    rest = np.zeros_like(fibres.stiffness)
    moments = []
    for angle in np.asarray(angles_rad, dtype=float):
        moment = flag_moment(np.full_like(rest, angle), rest, fibres)
        rest = angle - moment / fibres.stiffness
        moments.append(moment)
    return np.array(moments).reshape(-1, len(rest))


def fibres_of_curve(curve: MomentAngle) -> FlagFibres:
    """Fit flag elements to the curve of a solid, by nonnegative least squares of the moment.

    Elements differ in the angle at which they transform and, by the ratios :data:`LOWERS`, in that at which they
    transform back. Their span follows from plateau and transformation strain, as that of a fibre does. They are the
    same on either side of zero: give a curve of the side that matters, loaded and unloaded.

    Raises
    ------
    RigError
        A rig that is not superelastic.
    ValueError
        A curve of fewer than eight angles, or without a moment.
    """
    law = _law(curve.rig)
    largest = float(np.abs(curve.angle_rad).max(initial=0.0))
    if len(curve.angle_rad) < 8 or not np.abs(curve.moment_Nmm).max() > 0:
        raise ValueError(f"curve of {len(curve.angle_rad)} angles up to {largest:g} rad: expected 8 that bend at least")
    upper, below = law.plateau_MPa + law.shift_MPa, law.unloading_plateau_MPa + law.shift_MPa
    strain = upper / (curve.rig.material.youngs_modulus_GPa * 1e3)
    back = np.minimum(below / upper * np.array(LOWERS), 1.0)
    onset, lower = (grid.ravel() for grid in np.meshgrid(largest * np.geomspace(0.02, 1.0, ONSETS), back))
    onset, lower = np.append(onset, 10 * largest), np.append(lower, 1.0)  # the last one stays elastic
    flat = np.zeros_like(onset)
    one = FlagFibres(np.ones_like(onset), onset, onset * lower, onset * law.transformation_strain / strain, flat)
    stiffness, _ = nnls(flag_path(one, curve.angle_rad), curve.moment_Nmm)
    kept = stiffness > 1e-6 * stiffness.sum()
    k = stiffness[kept]
    return FlagFibres(k, k * one.upper_Nmm[kept], k * one.lower_Nmm[kept], one.span_rad[kept], flat[kept])


def _law(rig: Rig) -> Superelastic:
    if rig.superelastic is None:
        raise RigError(f"rig {rig.name}: expected [superelastic]")
    return rig.superelastic
