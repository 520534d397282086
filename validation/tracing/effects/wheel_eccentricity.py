"""A wheel that runs out."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np

from fem_models.rig.effects import Eccentricity
from fem_models.rig.rig import Rig, Wheel
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

SINE = FreeParameter("sine_mm", "mm", -20.0, 20.0, 0.02, linear=True)
COSINE = FreeParameter("cosine_mm", "mm", -20.0, 20.0, 0.02, linear=True)
RADIUS = FreeParameter("radius_mm", "mm", 0.02, 200.0, 0.02, log=True)


def _rig(rig: Rig, values: Values) -> Rig:
    """Give x + s sin(x/R) + c cos(x/R) as amplitude and phase."""
    size = math.hypot(values["sine_mm"], values["cosine_mm"])
    phase = math.degrees(math.atan2(values["cosine_mm"], values["sine_mm"]))
    wheel = Wheel(values["radius_mm"]) if "radius_mm" in values else rig.wheel
    return replace(rig, eccentricity=Eccentricity(size, phase), wheel=wheel)


def _declared_wheel(scale: Scale, rig: Rig) -> list[Values]:
    """Give sizes of both; the search finds their signs."""
    return [{"sine_mm": 0.02 * scale.drive, "cosine_mm": 0.02 * scale.drive}]


def _any_wheel(scale: Scale, rig: Rig) -> list[Values]:
    """Try some numbers of waves over the stroke: a sine has many optima in its period."""
    waves = np.geomspace(0.5, 5.0, 16).tolist()
    return [{**v, "radius_mm": scale.drive / (math.pi * w)} for w in waves for v in _declared_wheel(scale, rig)]


def _uneven(x: Floats, curve: CurveContext, values: Values) -> Floats:
    angle = (x + curve.drive_middle) / values["radius"]
    return x + values["sine"] * np.sin(angle) + values["cosine"] * np.cos(angle)


_CURVE = CurveForm(
    (
        RelativeParameter("sine", "drive", -1.0, 1.0, 0.005),
        RelativeParameter("cosine", "drive", -1.0, 1.0, 0.005),
        RelativeParameter("radius", "drive", 0.02, 0.7, 0.02, log=True),
    ),
    tuple(
        {"sine": 0.01 * s, "cosine": 0.01 * c, "radius": 1.0 / (math.pi * waves)}
        for waves in (0.5, 0.75, 1.0, 1.5, 2.0, 3.0, 4.0, 6.0)
        for s, c in ((1, 0), (0, 1))
    ),
    drive=_uneven,
)

EFFECT = Effect(
    name="wheel_eccentricity",
    physics="A wheel whose bore is off its centre winds x + e sin(x/R + p) in place of x: an error that is periodic in "
    "the drive, the same on the way up and down.",
    distinguished_by="Gravity and a misaligned camera are smooth over the whole stroke; this has the period of one turn. "
    "Record a larger amplitude.",
    rig_forms=(
        RigForm((SINE, COSINE), _declared_wheel, rig=_rig, needs=frozenset({"wheel"})),
        RigForm((SINE, COSINE, RADIUS), _any_wheel, rig=_rig, needs=frozenset({"wheel"})),
    ),
    curve_forms=(_CURVE,),
)
