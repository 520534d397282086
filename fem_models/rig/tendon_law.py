"""Tension of a tendon over its elongation: linear in the tube, with a toe region between wheel and base."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import ArrayLike
from scipy.special import wrightomega

from fem_models.rig.checks import RigError
from fem_models.rig.rig import Tendon
from hysteresis.arrays import Floats


def _compliances(tendon: Tendon, length_in_tube_mm: float) -> tuple[float, float]:
    """Compliances a, mm/N, and b, mm, of the elongation a (T - T0) + b ln(T/T0)."""
    toe = tendon.toe_N if tendon.toe_N > 1e-9 else 0.0  # a toe far below any tension would overflow c/b below
    return (length_in_tube_mm + tendon.free_length_mm) / tendon.EA_N, tendon.free_length_mm * toe / tendon.EA_N


def tendon_stretch_mm(tendon: Tendon, tension_N: ArrayLike, preload_N: float, length_in_tube_mm: float) -> Floats:
    """Elongation of a tendon against its preloaded state, mm, the shape of ``tension_N``.

    Linear in the tube; between wheel and base k(T) = k_inf T/(T + toe), which integrates to
    L_free/EA [(T - T0) + toe ln(T/T0)]. At zero tension it is where a linear tendon becomes slack, and
    -inf for a tendon with a toe.

    Raises
    ------
    ValueError
        Negative tension.
    """
    tension = np.asarray(tension_N, dtype=float)
    if not (tension >= 0).all():
        raise RigError(f"tension_N = {tension[~(tension >= 0)].flat[0]:g}: expected at least 0, tendons do not push")
    a, b = _compliances(tendon, length_in_tube_mm)
    if b == 0:
        return a * (tension - preload_N)
    with np.errstate(divide="ignore"):
        return a * (tension - preload_N) + b * np.log(tension / preload_N)


def tendon_tension_N(tendon: Tendon, stretch_mm: ArrayLike, preload_N: float, length_in_tube_mm: float) -> Floats:
    """Tension at an elongation against the preloaded state: the inverse of :func:`tendon_stretch_mm`.

    A linear tendon is slack (0 N) below its free length. With a toe, a T + b ln T = c is solved by the Wright omega
    function: T = (b/a) omega(c/b + ln(a/b)), which falls towards 0 and never reaches it.
    """
    stretch = np.asarray(stretch_mm, dtype=float)
    a, b = _compliances(tendon, length_in_tube_mm)
    if b == 0:
        return np.maximum(preload_N + stretch / a, 0.0)
    c = stretch + a * preload_N + b * math.log(preload_N)
    return b / a * wrightomega(c / b + math.log(a / b))


def tendon_stiffness_N_per_mm(tendon: Tendon, tension_N: Floats, length_in_tube_mm: float) -> Floats:
    """Slope of :func:`tendon_tension_N` at tensions, their shape; 0 of a slack tendon."""
    a, b = _compliances(tendon, length_in_tube_mm)
    taut = tension_N > 0
    return np.where(taut, 1 / (a + b / np.where(taut, tension_N, 1.0)), 0.0)
