"""A wheel that runs out."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np

from fem_models.rig import Rig, RigError
from fem_models.rig.effects import Eccentricity
from fem_models.rig.rig import Wheel
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

SENSIBLE_SINE = Sensible(
    -0.1,
    0.1,
    "a bore is off by hundredths of a millimetre, a wheel that is not round by a tenth of its radius at most",
    "wheel radius",
    "run-out",
)
SINE = FreeParameter("sine_mm", "mm", -20.0, 20.0, 0.02, linear=True, sensible=SENSIBLE_SINE)
COSINE = FreeParameter("cosine_mm", "mm", -20.0, 20.0, 0.02, linear=True, sensible=SENSIBLE_SINE)
RADIUS = FreeParameter("radius_mm", "mm", 0.02, 200.0, 0.02, log=True)


def _rig(rig: Rig, values: Values) -> Rig:
    """Add x + s sin(x/R) + c cos(x/R) to the run-out of the wheel, as phasors.

    A radius that is fitted replaces the declared one, which only the run-out depends on. Beside a declared run-out it
    is refused: one wheel has one period.
    """
    sine, cosine = values["sine_mm"], values["cosine_mm"]
    if (declared := rig.eccentricity) is not None:
        if "radius_mm" in values:
            raise RigError(
                f"eccentricity.amplitude_mm = {declared.amplitude_mm}: expected none where the radius is free"
            )
        phase = math.radians(declared.phase_deg)
        sine += declared.amplitude_mm * math.cos(phase)
        cosine += declared.amplitude_mm * math.sin(phase)
    wheel = Wheel(values["radius_mm"]) if "radius_mm" in values else rig.wheel
    eccentricity = Eccentricity(math.hypot(sine, cosine), math.degrees(math.atan2(cosine, sine)))
    return replace(rig, eccentricity=eccentricity, wheel=wheel)


def _declared_wheel(scale: Scale, rig: Rig) -> list[Values]:
    """Give sizes of both parameters; the search finds their signs."""
    return [{"sine_mm": 0.02 * scale.drive, "cosine_mm": 0.02 * scale.drive}]


def _any_wheel(scale: Scale, rig: Rig) -> list[Values]:
    """Start from several numbers of waves over the stroke: a sine has many optima in its period."""
    waves = np.geomspace(0.5, 5.0, 16).tolist()
    return [{**v, "radius_mm": scale.drive / (math.pi * w)} for w in waves for v in _declared_wheel(scale, rig)]


def _uneven(x: Floats, curve: CurveContext, values: Values) -> Floats:
    angle = (x + curve.drive_middle) / values["radius"]
    return x + values["sine"] * np.sin(angle) + values["cosine"] * np.cos(angle)


_CURVE = CurveForm(
    (
        RelativeParameter("sine", "drive", -1.0, 1.0, 0.005, amount=True, sensible=SENSIBLE_SINE),
        RelativeParameter("cosine", "drive", -1.0, 1.0, 0.005, amount=True, sensible=SENSIBLE_SINE),
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
    seen="a wave along the drive, the same on the way up and down",
    physics="A wheel whose bore is off its centre winds x + e sin(x/R + p) in place of x. The error is periodic in "
    "the drive.",
    distinguished_by="Record a larger amplitude: the error repeats with every turn of the wheel. Gravity and a "
    "misaligned camera are smooth over the whole stroke.",
    rig_forms=(
        RigForm((SINE, COSINE), _declared_wheel, rig=_rig, needs=frozenset({"wheel"})),
        RigForm((SINE, COSINE, RADIUS), _any_wheel, rig=_rig, needs=frozenset({"wheel"})),
    ),
    curve_forms=(_CURVE,),
)
