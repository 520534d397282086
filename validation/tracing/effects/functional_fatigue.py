"""Nitinol that changes with the cycles."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from fem_models.rig.effects import Fatigue
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

LOSS = FreeParameter("loop_loss", "-", 0.0, 1.0, 0.05, linear=True)
RESIDUAL = FreeParameter("residual_deg", "deg", -5.0, 5.0, 0.02, linear=True)
CYCLES = FreeParameter("cycles", "-", 0.2, 200.0, 0.3, log=True)


def _rig(rig: Rig, values: Values) -> Rig:
    return replace(
        rig, fatigue=Fatigue(values.get("loop_loss", 0.0), values.get("residual_deg", 0.0), values["cycles"])
    )


def _starts(scale: Scale, rig: Rig) -> list[Values]:
    turn = 0.05 * scale.angle_deg / rig.joints
    return [
        {"loop_loss": 0.3, "residual_deg": side * turn, "cycles": part * scale.cycles}
        for side in (-1, 1)
        for part in (0.3, 1.0)
    ]


def _done(curve: CurveContext, values: Values) -> Floats:
    return -np.expm1(-curve.inputs.cycle / values["cycles"])


def _shrunk(f: Floats, curve: CurveContext, values: Values) -> Floats:
    return 1.0 - values["loop_loss"] * _done(curve, values)


def _left_over(theta: Floats, curve: CurveContext, values: Values) -> Floats:
    return theta + values["residual_deg"] * _done(curve, values)


_CURVE = CurveForm(
    (
        RelativeParameter("loop_loss", "-", 0.0, 0.99, 0.02),
        RelativeParameter("residual_deg", "angle", -1.0, 1.0, 0.002),
        RelativeParameter("cycles", "-", 0.2, 200.0, 0.3, log=True),
    ),
    tuple({"loop_loss": 0.1, "residual_deg": side * 0.02, "cycles": c} for side in (-1, 1) for c in (1.0, 5.0)),
    loop_size=_shrunk,
    angle=_left_over,
    needs=frozenset({"cycles"}),
)

EFFECT = Effect(
    name="functional_fatigue",
    physics="Cycling trains Nitinol: its loop shrinks and a residual strain grows, both exponential in the number of "
    "cycles (Eggeler et al. 2004, doi 10.1016/j.msea.2003.10.327).",
    distinguished_by="A loss of preload acts on tension and widens the loop; record tensions, or a second preload.",
    rig_forms=(RigForm((LOSS, RESIDUAL, CYCLES), _starts, rig=_rig, needs=frozenset({"cycles"})),),
    curve_forms=(_CURVE,),
)
