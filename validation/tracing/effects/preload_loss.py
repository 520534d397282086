"""Preload that settles with the cycles."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from fem_models.rig import Rig
from fem_models.rig.effects import PreloadLoss
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
    combined_time,
    compound,
)

SENSIBLE_FRACTION = Sensible(0.0, 0.9, "a tendon that has lost its preload is slack")
SENSIBLE_WIDENING = Sensible(0.0, 5.0, "loops of slack tendons")
FRACTION = FreeParameter("fraction", "-", 0.0, 0.95, 0.05, linear=True, sensible=SENSIBLE_FRACTION)
CYCLES = FreeParameter("cycles", "-", 0.2, 200.0, 0.3, log=True)


def _rig(rig: Rig, values: Values) -> Rig:
    """Compound the losses, with one number of cycles for both."""
    added = PreloadLoss(values["fraction"], values["cycles"])
    if (declared := rig.preload_loss) is None:
        return replace(rig, preload_loss=added)
    cycles = combined_time((declared.fraction,), declared.cycles, (added.fraction,), added.cycles)
    return replace(rig, preload_loss=PreloadLoss(compound(declared.fraction, added.fraction), cycles))


def _starts(scale: Scale, rig: Rig) -> list[Values]:
    return [{"fraction": f, "cycles": part * scale.cycles} for f in (0.15, 0.4) for part in (0.3, 1.0)]


def _remaining(curve: CurveContext, values: Values) -> Floats:
    """Preload that remains, over the largest one."""
    return curve.preload_ratio * (1.0 + values["fraction"] * np.expm1(-curve.inputs.cycle / values["cycles"]))


def _slope_known(f: Floats, curve: CurveContext, values: Values) -> Floats:
    at_start = curve.slope_loss_per_loop * curve.loop_ratio
    return f * (1.0 + at_start) / (1.0 + at_start * curve.softness(_remaining(curve, values)))


def _loop_known(f: Floats, curve: CurveContext, values: Values) -> Floats:
    return curve.softness(_remaining(curve, values))


def _slope_free(f: Floats, curve: CurveContext, values: Values) -> Floats:
    return f * (1.0 - values["slope_loss"] * -np.expm1(-curve.inputs.cycle / values["cycles"]))


def _loop_free(f: Floats, curve: CurveContext, values: Values) -> Floats:
    return 1.0 + values["widening"] * -np.expm1(-curve.inputs.cycle / values["cycles"])


_CYCLES = RelativeParameter("cycles", "-", 0.2, 200.0, 0.3, log=True)
_CURVES = (
    CurveForm(  # records at other preloads show what a loss does
        (RelativeParameter("fraction", "-", 0.0, 0.95, 0.02, amount=True, sensible=SENSIBLE_FRACTION), _CYCLES),
        tuple({"fraction": 0.2, "cycles": c} for c in (1.0, 5.0)),
        backbone=_slope_known,
        loop_size=_loop_known,
        needs=frozenset({"cycles", "preloads"}),
    ),
    CurveForm(
        (
            RelativeParameter("widening", "-", 0.0, 10.0, 0.05, amount=True, sensible=SENSIBLE_WIDENING),
            RelativeParameter("slope_loss", "-", -0.5, 0.9, 0.005, amount=True),
            _CYCLES,
        ),
        tuple({"widening": 0.2, "slope_loss": 0.01, "cycles": c} for c in (1.0, 5.0)),
        backbone=_slope_free,
        loop_size=_loop_free,
        needs=frozenset({"cycles"}),
    ),
)

EFFECT = Effect(
    name="preload_loss",
    seen="loops widen, or shift, from cycle to cycle",
    physics="Knots, crimps and tendon seats settle. The preload falls with the number of cycles c as T0 (1 - a (1 - "
    "exp(-c/c0))).",
    distinguished_by="Record the tensions, or a second preload. Functional fatigue acts on the loop of the material, "
    "not on the tension.",
    rig_forms=(RigForm((FRACTION, CYCLES), _starts, rig=_rig, needs=frozenset({"cycles", "two tendons"})),),
    curve_forms=(*_CURVES,),
)
