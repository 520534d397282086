"""How the angle of a notch is spread over its width, for pictures."""

from __future__ import annotations

import numpy as np

from fem_models.joint.section import section
from fem_models.rig.joints import MeasuredJoint, NotchedTube
from hysteresis.arrays import Floats


def bending_along(joint: NotchedTube | MeasuredJoint, opening_mm: float, s_mm: Floats) -> tuple[Floats, Floats]:
    """Share of the angle of a notch before each place, and its curvature in 1/mm per radian, of the shape of ``s_mm``.

    ``s_mm`` is the distance from the middle of the notch, ``opening_mm`` its width. A uniform moment bends the flexure
    with a curvature proportional to 1 / I(s) (Euler and Bernoulli); measured joints, whose section is not known, bend
    evenly.
    """
    fine = np.linspace(-opening_mm / 2, opening_mm / 2, 801)
    flexibility = np.ones_like(fine)
    if isinstance(joint, NotchedTube):
        flexibility = 1 / section(joint, fine).second_moment_mm4
    share = np.concatenate([[0.0], np.cumsum((flexibility[1:] + flexibility[:-1]) / 2 * np.diff(fine))])
    curvature = np.interp(s_mm, fine, flexibility / share[-1], left=0.0, right=0.0)
    return np.interp(s_mm, fine, share / share[-1]), curvature
