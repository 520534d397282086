"""Friction that varies along the stroke."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from fem_models.rig import Rig
from fem_models.rig.effects import PositionFriction
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

SENSIBLE_GROWTH = Sensible(
    -2.5, 2.5, "a change by more than e^5 over the stroke is a tendon that jams", "1/half stroke"
)
SENSIBLE_GROWTH_OF_CURVE = Sensible(-1.8, 1.8, "a change by more than e^3.6 over the stroke is a tendon that jams")
GROWTH = FreeParameter("growth_per_mm", "1/mm", -20.0, 20.0, 0.02, linear=True, sensible=SENSIBLE_GROWTH)


def _rig(rig: Rig, values: Values) -> Rig:
    """Add the growths: the factors multiply."""
    declared = 0.0 if rig.position_friction is None else rig.position_friction.growth_per_mm
    return replace(rig, position_friction=PositionFriction(declared + values["growth_per_mm"]))


def _starts(scale: Scale, rig: Rig) -> list[Values]:
    return [{"growth_per_mm": side * 0.2 / scale.drive} for side in (-1, 1)]


def _along(f: Floats, curve: CurveContext, values: Values) -> Floats:
    """Let the loop grow along the stroke."""
    return np.exp(values["growth"] * (curve.inputs.drive - curve.drive_middle) / curve.drive_half_range)


_CURVE = CurveForm(
    (RelativeParameter("growth", "-", -2.0, 2.0, 0.02, amount=True, sensible=SENSIBLE_GROWTH_OF_CURVE),),
    ({"growth": 0.1}, {"growth": -0.1}),
    loop_size=_along,
)

EFFECT = Effect(
    name="position_friction",
    seen="the loop widens towards one end of the stroke",
    physics="A tight stretch of a guide, a worn tendon or a bent sheath: the friction of the guides varies as exp(g "
    "x) with the drive x.",
    distinguished_by="Record a second preload, or move the rig's zero along the tendon. Unequal tendons also widen "
    "one side of the loop, but change slopes and tensions with it; without a geometry the two are one operator.",
    rig_forms=(RigForm((GROWTH,), _starts, rig=_rig, needs=frozenset({"wheel"})),),
    curve_forms=(_CURVE,),
)
