"""An obstacle on one side."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from fem_models.rig import Rig, RigError
from fem_models.rig.effects import TipStop
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

SENSIBLE_STIFFNESS = Sensible(1e-3, 1e4, "from a hair to a steel post")
ABOVE = FreeParameter("y_mm", "mm", 0.0, 1e3, 0.1)
BELOW = FreeParameter("y_mm", "mm", -1e3, -1e-6, 0.1)
STIFFNESS = FreeParameter("stiffness_N_per_mm", "N/mm", 1e-4, 1e5, 0.3, log=True, sensible=SENSIBLE_STIFFNESS)


def _rig(rig: Rig, values: Values) -> Rig:
    """Join two obstacles on one side to one: as stiff as both together, at the mean place weighted by stiffness.

    A rig has one obstacle. One on the other side than the declared one is refused.
    """
    y_mm, stiffness = values["y_mm"], values["stiffness_N_per_mm"]
    if (declared := rig.tip_stop) is not None:
        if declared.y_mm * y_mm < 0:
            raise RigError(
                f"tip_stop.y_mm = {declared.y_mm}: expected an obstacle on the side of y = {y_mm:g} mm alone"
            )
        y_mm = (declared.stiffness_N_per_mm * declared.y_mm + stiffness * y_mm) / (
            declared.stiffness_N_per_mm + stiffness
        )
        stiffness += declared.stiffness_N_per_mm
    return replace(rig, tip_stop=TipStop(y_mm, stiffness))


def _starts(side: float, scale: Scale) -> list[Values]:
    parts = (0.6, 0.8, 0.93)
    return [{"y_mm": side * part * scale.tip_mm, "stiffness_N_per_mm": k} for part in parts for k in (0.1, 2.0)]


def _stop_above(theta: Floats, curve: CurveContext, values: Values) -> Floats:
    return theta - values["slope_loss"] * np.maximum(theta - values["angle_deg"], 0.0)


def _stop_below(theta: Floats, curve: CurveContext, values: Values) -> Floats:
    return theta - values["slope_loss"] * np.minimum(theta - values["angle_deg"], 0.0)


_LOSS = RelativeParameter("slope_loss", "-", 0.0, 1.0, 0.02, amount=True)
_CURVES = tuple(
    CurveForm(
        (RelativeParameter("angle_deg", "angle", -1.1, 1.1, 0.01), _LOSS),
        tuple({"angle_deg": side * part, "slope_loss": loss} for part in (0.6, 0.8, 0.93) for loss in (0.1, 0.5)),
        angle=law,
    )
    for side, law in ((1.0, _stop_above), (-1.0, _stop_below))
)

EFFECT = Effect(
    name="tip_contact",
    seen="the slope falls with a kink, on one side",
    physics="The tip meets an obstacle, such as a wall or a camera stand. Beyond that angle the bending goes on with "
    "less slope.",
    distinguished_by="Look for an obstacle, or record a smaller amplitude. Unequal tendons change the whole of one "
    "side, without a kink. Notches that close clip both ends.",
    rig_forms=(
        RigForm((ABOVE, STIFFNESS), lambda scale, rig: _starts(1.0, scale), rig=_rig),
        RigForm((BELOW, STIFFNESS), lambda scale, rig: _starts(-1.0, scale), rig=_rig),
    ),
    curve_forms=(*_CURVES,),
)
