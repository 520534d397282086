"""Friction that falls with the speed."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from fem_models.rig import Rig
from fem_models.rig.effects import Stribeck
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

SENSIBLE_RISE = Sensible(0.0, 4.0, "friction at rest is up to a few times that in motion")
RISE = FreeParameter("rise", "-", 0.0, 10.0, 0.05, linear=True, sensible=SENSIBLE_RISE)
SPEED = FreeParameter("speed_mm_per_s", "mm/s", 1e-4, 1e4, 0.3, log=True)


def _rig(rig: Rig, values: Values) -> Rig:
    """Add the rises, with one Stribeck speed for both: the mean weighted by them."""
    added = Stribeck(values["rise"], values["speed_mm_per_s"])
    if (declared := rig.stribeck) is None:
        return replace(rig, stribeck=added)
    rise = declared.rise + added.rise
    if rise == 0.0:
        return rig
    speed = (declared.rise * declared.speed_mm_per_s + added.rise * added.speed_mm_per_s) / rise
    return replace(rig, stribeck=Stribeck(rise, speed))


def _starts(scale: Scale, rig: Rig) -> list[Values]:
    return [{"rise": 0.3, "speed_mm_per_s": part * scale.speed} for part in (0.03, 0.15, 0.6)]


def _weakening(f: Floats, curve: CurveContext, values: Values) -> Floats:
    """Let the loop shrink with the speed of the drive."""
    speed = np.abs(np.gradient(curve.inputs.drive, curve.inputs.time_s))
    return 1.0 + values["rise"] * np.exp(-speed / values["speed"])


_CURVE = CurveForm(
    (
        RelativeParameter("rise", "-", 0.0, 10.0, 0.02, amount=True, sensible=SENSIBLE_RISE),
        RelativeParameter("speed", "drive/time", 1e-2, 1e5, 0.3, log=True),
    ),
    tuple({"rise": 0.2, "speed": part} for part in (1.0, 6.0, 40.0)),
    loop_size=_weakening,
    needs=frozenset({"time"}),
)

EFFECT = Effect(
    name="stribeck_friction",
    seen="the loop is wider in slow records",
    physics="Friction falls as the sliding speed rises: F = Fc (1 + r exp(-v/vs)) (Stribeck 1902; Armstrong-Helouvry, "
    "Dupont, Canudas de Wit, Automatica 30, 1994, doi 10.1016/0005-1098(94)90209-7). In the rig all guides have the "
    "speed of the wheel's rim.",
    distinguished_by="Record two rates: velocity weakening widens the slow loop, viscous drag the fast one. At one "
    "rate both look like a loop that changes along the stroke.",
    rig_forms=(RigForm((RISE, SPEED), _starts, rig=_rig, needs=frozenset({"time", "wheel"})),),
    curve_forms=(_CURVE,),
)
