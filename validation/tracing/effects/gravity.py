"""Weight of the rings."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np

from fem_models.rig.effects import Gravity
from fem_models.rig.rig import Rig
from hysteresis.arrays import Floats
from validation.tracing.effect import (
    CurveContext,
    CurveForm,
    Effect,
    FreeParameter,
    RelativeParameter,
    RigForm,
    Scale,
    Values,
)

ALONG = FreeParameter("ring_mass_along_g", "g", -200.0, 200.0, 0.2, linear=True)
ACROSS = FreeParameter("ring_mass_across_g", "g", -200.0, 200.0, 0.2, linear=True)


def _rig(rig: Rig, values: Values) -> Rig:
    along, across = values["ring_mass_along_g"], values["ring_mass_across_g"]
    return replace(rig, gravity=Gravity(math.hypot(along, across), math.degrees(math.atan2(across, along))))


def _starts(scale: Scale, rig: Rig) -> list[Values]:
    return [
        {"ring_mass_along_g": along, "ring_mass_across_g": across}
        for along, across in ((0.0, 0.5), (0.0, -0.5), (0.5, 0.0), (-0.5, 0.0))
    ]


def _weight(theta: Floats, curve: CurveContext, values: Values) -> Floats:
    """Moment of a weight at the heading: along the straight tube it goes with the sine, across with the cosine."""
    turn = np.radians(theta - curve.straight_deg)
    return theta + values["along_deg"] * np.sin(turn) + values["across_deg"] * (np.cos(turn) - 1.0)


_CURVE = CurveForm(
    (
        RelativeParameter("along_deg", "angle", -0.8, 0.8, 0.005),
        RelativeParameter("across_deg", "angle", -0.8, 0.8, 0.005),
    ),
    tuple({"along_deg": a, "across_deg": b} for a, b in ((0.02, 0.0), (-0.02, 0.0), (0.0, 0.02), (0.0, -0.02))),
    angle=_weight,
)

EFFECT = Effect(
    name="gravity",
    physics="Weight of rings and tool bends the tube: a moment that follows sine and cosine of the headings, given by "
    "its parts along and across the straight tube. Smooth, no loop; odd or even by the way the rig is mounted.",
    distinguished_by="A misaligned camera gives a function of the angle, too. Mount the rig turned by 90 or 180 degrees.",
    rig_forms=(RigForm((ALONG, ACROSS), _starts, rig=_rig),),
    curve_forms=(_CURVE,),
)
