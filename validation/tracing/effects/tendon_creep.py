"""Tendons that stretch with time."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from fem_models.rig import Rig
from fem_models.rig.effects import Creep
from hysteresis.arrays import Floats
from validation.tracing.baseline.curve_kernels import lagged
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
    combined_time,
)

SENSIBLE_FRACTION = Sensible(0.0, 4.0, "polymer tendons creep by up to a few times their elastic stretch")
FRACTION = FreeParameter("fraction", "-", 0.0, 5.0, 0.05, linear=True, sensible=SENSIBLE_FRACTION)
TIME = FreeParameter("time_s", "s", 1e-2, 1e5, 0.3, log=True)


def _rig(rig: Rig, values: Values) -> Rig:
    """Add the stretches of two Kelvin-Voigt elements in series, with one time constant for both."""
    added = Creep(values["fraction"], values["time_s"])
    if (declared := rig.creep) is None:
        return replace(rig, creep=added)
    time_s = combined_time((declared.fraction,), declared.time_s, (added.fraction,), added.time_s)
    return replace(rig, creep=Creep(declared.fraction + added.fraction, time_s))


def _starts(scale: Scale, rig: Rig) -> list[Values]:
    times = np.geomspace(0.02 * scale.duration_s, 2.0 * scale.longest_s, 6).tolist()
    return [{"fraction": 0.15, "time_s": time_s} for time_s in times]


def _stretch(x: Floats, curve: CurveContext, values: Values) -> Floats:
    """Take from the drive a part that follows it with time; the tension is in proportion to the drive."""
    return x - values["fraction"] * lagged(x, curve.inputs.time_s, values["time_s"])


_CURVE = CurveForm(
    (
        RelativeParameter("fraction", "-", 0.0, 0.95, 0.01, amount=True, sensible=SENSIBLE_FRACTION),
        RelativeParameter("time_s", "time", 3e-3, 1e2, 0.3, log=True),
    ),
    tuple({"fraction": 0.03, "time_s": part} for part in (0.02, 0.1, 0.5, 2.0, 10.0)),
    drive=_stretch,
    needs=frozenset({"time"}),
)

EFFECT = Effect(
    name="tendon_creep",
    seen="the angle goes on moving in a dwell, and returns without load",
    physics="Polymer and laid tendons stretch on under load and recover without it: Kelvin-Voigt creep between wheel "
    "and base, in proportion to the tension (Findley, Lai, Onaran 1976, ISBN 978-0-486-66016-5).",
    distinguished_by="Record a dwell at full drive on both sides. Creep changes its sign with the load; thermal drift "
    "does not. Viscous drag has no memory.",
    rig_forms=(RigForm((FRACTION, TIME), _starts, rig=_rig, needs=frozenset({"time", "wheel"})),),
    curve_forms=(_CURVE,),
)
