"""Preload that settles with the cycles."""

from __future__ import annotations

from dataclasses import replace

from fem_models.effects import PreloadLoss
from fem_models.rig import Rig
from validation.effect import Constant, Effect, RigForm, Scale, Values

FRACTION = Constant("fraction", "-", 0.0, 0.95, 0.05)
CYCLES = Constant("cycles", "-", 0.2, 200.0, 0.3, log=True)


def _rig(rig: Rig, values: Values) -> Rig:
    return replace(rig, preload_loss=PreloadLoss(values["fraction"], values["cycles"]))


def _starts(scale: Scale, rig: Rig) -> list[Values]:
    return [{"fraction": f, "cycles": part * scale.cycles} for f in (0.15, 0.4) for part in (0.3, 1.0)]


EFFECT = Effect(
    name="preload_loss",
    physics="Knots, crimps and rope seats settle: the preload falls with the number of cycles, T0 (1 - a (1 - "
    "exp(-c/c0))), so that loops widen, or shift, from cycle to cycle.",
    tell_apart="Functional fatigue changes with the cycles, too, but acts on the material's loop, not on tension; "
    "record tensions, or a second preload.",
    rig_forms=(RigForm((FRACTION, CYCLES), _starts, rig=_rig, needs=frozenset({"cycles", "two tendons"})),),
)
