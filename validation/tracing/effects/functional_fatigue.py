"""Nitinol that changes with the cycles."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from fem_models.rig import Rig
from fem_models.rig.effects import Fatigue
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

RESIDUAL_BECAUSE = "residual strains stay well below those of the bend"
SENSIBLE_RESIDUAL = Sensible(-0.5, 0.5, RESIDUAL_BECAUSE, "half range")
SENSIBLE_EACH = Sensible(-0.5, 0.5, RESIDUAL_BECAUSE, "half range per joint")
SENSIBLE_CYCLES = Sensible(0.5, 200.0, "training takes cycles: what is over within half of one is a first stroke")
LOSS = FreeParameter("loop_loss", "-", 0.0, 1.0, 0.05, linear=True)
RESIDUAL = FreeParameter("residual_deg", "deg", -5.0, 5.0, 0.02, linear=True, sensible=SENSIBLE_EACH)
CYCLES = FreeParameter("cycles", "-", 0.2, 200.0, 0.3, log=True, sensible=SENSIBLE_CYCLES)


def _rig(rig: Rig, values: Values) -> Rig:
    """Compound the losses of the loop, add the residual angles, with one number of cycles for both."""
    added = Fatigue(values.get("loop_loss", 0.0), values.get("residual_deg", 0.0), values["cycles"])
    if (declared := rig.fatigue) is None:
        return replace(rig, fatigue=added)
    both = Fatigue(
        compound(declared.loop_loss, added.loop_loss),
        declared.residual_deg + added.residual_deg,
        combined_time(
            (declared.loop_loss, declared.residual_deg),
            declared.cycles,
            (added.loop_loss, added.residual_deg),
            added.cycles,
        ),
    )
    return replace(rig, fatigue=both)


def _starts(scale: Scale, rig: Rig) -> list[Values]:
    residual = 0.05 * scale.angle_deg / rig.joints
    return [
        {"loop_loss": 0.3, "residual_deg": side * residual, "cycles": part * scale.cycles}
        for side in (-1, 1)
        for part in (0.3, 1.0)
    ]


def _progress(curve: CurveContext, values: Values) -> Floats:
    return -np.expm1(-curve.inputs.cycle / values["cycles"])


def _loop_size(f: Floats, curve: CurveContext, values: Values) -> Floats:
    return 1.0 - values["loop_loss"] * _progress(curve, values)


def _with_residual(theta: Floats, curve: CurveContext, values: Values) -> Floats:
    return theta + values["residual_deg"] * _progress(curve, values)


_CURVE = CurveForm(
    (
        RelativeParameter("loop_loss", "-", 0.0, 0.99, 0.02, amount=True),
        RelativeParameter("residual_deg", "angle", -1.0, 1.0, 0.002, amount=True, sensible=SENSIBLE_RESIDUAL),
        RelativeParameter("cycles", "-", 0.2, 200.0, 0.3, log=True, sensible=SENSIBLE_CYCLES),
    ),
    tuple({"loop_loss": 0.1, "residual_deg": side * 0.02, "cycles": c} for side in (-1, 1) for c in (1.0, 5.0)),
    loop_size=_loop_size,
    angle=_with_residual,
    needs=frozenset({"cycles"}),
)

EFFECT = Effect(
    name="functional_fatigue",
    seen="the loop shrinks and the angle shifts from cycle to cycle",
    physics="Cycling trains Nitinol: its loop shrinks and a residual strain grows, both exponential in the number of "
    "cycles (Eggeler et al. 2004, doi 10.1016/j.msea.2003.10.327).",
    distinguished_by="Record the tensions, or a second preload. A loss of preload acts on the tension, and widens the "
    "loop.",
    rig_forms=(RigForm((LOSS, RESIDUAL, CYCLES), _starts, rig=_rig, needs=frozenset({"cycles"})),),
    curve_forms=(_CURVE,),
)
