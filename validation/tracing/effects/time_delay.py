"""An angle that is read late."""

from __future__ import annotations

from functools import partial

import numpy as np

from fem_models.rig import Rig
from hysteresis.arrays import Floats
from validation.tracing.effect import (
    CurveForm,
    Effect,
    FreeParameter,
    RelativeParameter,
    RigForm,
    SampleInputs,
    Scale,
    Sensible,
    SpaceForm,
    Values,
)

SENSIBLE_DELAY = Sensible(-1.0, 1.0, "a longer delay is a phase that no loop of an open-loop rig has", "quarter cycle")
DELAY = FreeParameter("delay_s", "s", -1e3, 1e3, 0.001, linear=True, sensible=SENSIBLE_DELAY)


def observe(angle_deg: Floats, inputs: SampleInputs, values: Values) -> Floats:
    """Angle of ``delay_s`` ago; before the first sample the first one."""
    return np.interp(inputs.time_s - values["delay_s"], inputs.time_s, angle_deg)


def _starts(scale: Scale, rig: Rig | None) -> list[Values]:
    swing = scale.drive / scale.speed
    return [{"delay_s": part * swing} for part in (0.02, 0.1)]


_CURVE = CurveForm(
    (RelativeParameter("delay_s", "time", -0.2, 0.2, 1e-4, amount=True, sensible=SENSIBLE_DELAY),),
    tuple({"delay_s": part} for part in (1e-3, 5e-3, 0.02)),
    observe=observe,
    needs=frozenset({"time"}),
)

EFFECT = Effect(
    name="time_delay",
    seen="the loop is wider in fast records, with nothing at the ends of the stroke",
    physics="Sensor filters, transmission and logging delay the reading: the logged angle is theta(t - tau).",
    distinguished_by="Record two rates, or a dwell. Viscous drag also grows with the rate, but acts at the ends of "
    "the stroke, too.",
    rig_forms=(RigForm((DELAY,), _starts, observe=observe, needs=frozenset({"time"})),),
    curve_forms=(_CURVE,),
    space_forms=(SpaceForm((DELAY,), partial(_starts, rig=None), observe=observe, needs=frozenset({"time"})),),
)
