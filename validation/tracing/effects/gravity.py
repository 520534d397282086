"""Weight of the rings."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np

from fem_models.joint import joint_row
from fem_models.rig import Rig
from fem_models.rig.effects import Gravity
from hysteresis.arrays import Floats
from validation.tracing.effect import (
    CurveContext,
    CurveForm,
    Effect,
    FreeParameter,
    RelativeParameter,
    RigForm,
    Scale,
    Sensible,
    Values,
)

SENSIBLE_RING_MASS_ALONG = Sensible(-100.0, 100.0, "rings of millimetres with tools weigh grams")
SENSIBLE_ALONG = Sensible(-0.5, 0.5, "more weight would bend the tube without the drive", "half range")
ALONG = FreeParameter("ring_mass_along_g", "g", -200.0, 200.0, 0.2, linear=True, sensible=SENSIBLE_RING_MASS_ALONG)
ACROSS = FreeParameter("ring_mass_across_g", "g", -200.0, 200.0, 0.2, linear=True, sensible=SENSIBLE_RING_MASS_ALONG)


def _rig(rig: Rig, values: Values) -> Rig:
    """Add the weights as vectors."""
    along, across = values["ring_mass_along_g"], values["ring_mass_across_g"]
    if rig.gravity is not None:
        direction = math.radians(rig.gravity.direction_deg)
        along += rig.gravity.ring_mass_g * math.cos(direction)
        across += rig.gravity.ring_mass_g * math.sin(direction)
    return replace(rig, gravity=Gravity(math.hypot(along, across), math.degrees(math.atan2(across, along))))


def _large_g(rig: Rig) -> float:
    """Mass of each ring that would bend the straight tube across without tendons by some rad in all."""
    stiffness = float(joint_row(rig).of("flexure.bending_Nmm_per_rad").mean())
    return 6.0 * stiffness / (rig.joints * rig.length_mm) / (rig.joints * 9.80665e-3)


def _starts(scale: Scale, rig: Rig) -> list[Values]:
    """Start light, and heavy across the tube: between them lie optima at several times the noise of unknown rigs."""
    large = min(_large_g(rig), SENSIBLE_RING_MASS_ALONG.high)
    return [
        {"ring_mass_along_g": along, "ring_mass_across_g": across}
        for along, across in ((0.0, 0.5), (0.0, -0.5), (0.5, 0.0), (-0.5, 0.0), (0.0, large), (0.0, -large))
    ]


def _weight(theta: Floats, curve: CurveContext, values: Values) -> Floats:
    """Add the moment of a weight: along the straight tube it follows the sine of the heading, across it the cosine."""
    heading = np.radians(theta - curve.straight_deg)
    return theta + values["along_deg"] * np.sin(heading) + values["across_deg"] * (np.cos(heading) - 1.0)


_CURVE = CurveForm(
    (
        RelativeParameter("along_deg", "angle", -0.8, 0.8, 0.005, amount=True, sensible=SENSIBLE_ALONG),
        RelativeParameter("across_deg", "angle", -0.8, 0.8, 0.005, amount=True, sensible=SENSIBLE_ALONG),
    ),
    tuple({"along_deg": a, "across_deg": b} for a, b in ((0.02, 0.0), (-0.02, 0.0), (0.0, 0.02), (0.0, -0.02))),
    angle=_weight,
)

EFFECT = Effect(
    name="gravity",
    seen="a smooth deviation without a loop",
    physics="The weight of rings and tool bends the tube by the sine and cosine of the ring headings, given by its "
    "parts along and across the straight tube. The mounting of the rig makes it odd or even in the angle.",
    distinguished_by="Mount the rig turned by 90 or 180 degrees. A misaligned camera is also a function of the angle "
    "alone, but does not turn with the rig.",
    rig_forms=(RigForm((ALONG, ACROSS), _starts, rig=_rig),),
    curve_forms=(_CURVE,),
)
