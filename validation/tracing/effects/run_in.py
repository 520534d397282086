"""First cycles that differ: friction that runs in."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from fem_models.rig import Rig
from fem_models.rig.effects import RunIn
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
)

SENSIBLE_EXCESS = Sensible(-0.8, 5.0, "friction of fresh surfaces is a few times that of worn ones")
EXCESS = FreeParameter("excess", "-", -0.9, 5.0, 0.05, linear=True, sensible=SENSIBLE_EXCESS)
CYCLES = FreeParameter("cycles", "-", 0.2, 20.0, 0.3, log=True)


def _rig(rig: Rig, values: Values) -> Rig:
    """Add the excesses, with one number of cycles for both."""
    added = RunIn(values["excess"], values["cycles"])
    if (declared := rig.run_in) is None:
        return replace(rig, run_in=added)
    cycles = combined_time((declared.excess,), declared.cycles, (added.excess,), added.cycles)
    return replace(rig, run_in=RunIn(declared.excess + added.excess, cycles))


def _starts(scale: Scale, rig: Rig) -> list[Values]:
    return [{"excess": 0.3, "cycles": part * scale.cycles} for part in (0.2, 0.6)]


def _decay(f: Floats, curve: CurveContext, values: Values) -> Floats:
    """Let the loop decay with the cycles to a steady one."""
    return 1.0 + values["excess"] * np.exp(-curve.inputs.cycle / values["cycles"])


_CURVE = CurveForm(
    (
        RelativeParameter("excess", "-", -0.9, 10.0, 0.02, amount=True, sensible=SENSIBLE_EXCESS),
        RelativeParameter("cycles", "-", 0.2, 20.0, 0.3, log=True),
    ),
    tuple({"excess": 0.2, "cycles": c} for c in (0.7, 3.0)),
    loop_size=_decay,
    needs=frozenset({"cycles"}),
)

EFFECT = Effect(
    name="run_in",
    seen="the first loops are wider than the later ones",
    physics="After assembly or rest the guides rub more, until surfaces wear in and lubricant spreads. The friction "
    "decays with the number of cycles c as F (1 + e exp(-c/c0)) (running-in; Khonsari, Ghatrehsamani and Akbarzadeh, "
    "Wear 474-475, 2021, 203871).",
    distinguished_by="Record more cycles, and a rest between. Functional fatigue shrinks the loop of the material and "
    "adds a residual angle; a loss of preload changes friction and slope. Without a geometry, fatigue without a "
    "residual angle is the same operator.",
    rig_forms=(RigForm((EXCESS, CYCLES), _starts, rig=_rig, needs=frozenset({"cycles", "wheel"})),),
    curve_forms=(_CURVE,),
)
