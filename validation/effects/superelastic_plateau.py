"""Nitinol beyond the elastic strain."""

from __future__ import annotations

from dataclasses import replace

from fem_models.effects import Superelastic
from fem_models.rig import Rig
from validation.effect import Constant, Effect, RigForm, Scale, Values

PLATEAU = Constant("plateau_MPa", "MPa", 20.0, 1e4, 0.05, log=True)
UNLOADING = Constant("unloading_ratio", "-", 0.05, 1.0, 0.05)


def _rig(rig: Rig, values: Values) -> Rig:
    plateau = values["plateau_MPa"]
    return replace(rig, superelastic=Superelastic(plateau, plateau * values["unloading_ratio"]))


def _starts(scale: Scale, rig: Rig) -> list[Values]:
    return [{"plateau_MPa": part * scale.stress_MPa, "unloading_ratio": r} for part in (0.5, 0.8) for r in (0.5, 0.9)]


EFFECT = Effect(
    name="superelastic_plateau",
    physics="Beyond about 1 % of strain Nitinol transforms at a nearly constant stress and comes back at a lower one "
    "(flag; Auricchio, Taylor, Lubliner 1997, doi 10.1016/S0045-7825(96)01232-7): the slope changes past a strain, "
    "with a loop away from the centre.",
    tell_apart="Notches that close curve the other way; record a larger amplitude.",
    rig_forms=(RigForm((PLATEAU, UNLOADING), _starts, rig=_rig),),
)
