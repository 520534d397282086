"""Ropes that are soft at low tension."""

from __future__ import annotations

from dataclasses import replace

from fem_models.rig import Rig
from validation.effect import Constant, Effect, RigForm, Scale, Values

TOE = Constant("toe_N", "N", 0.0, 500.0, 5.0)


def _rig(rig: Rig, values: Values) -> Rig:
    b = rig.tendon_b
    toe = values["toe_N"]
    return replace(
        rig, tendon_a=replace(rig.tendon_a, toe_N=toe), tendon_b=None if b is None else replace(b, toe_N=toe)
    )


def _starts(scale: Scale, rig: Rig) -> list[Values]:
    here = rig.tendon_a.toe_N
    return [{"toe_N": here + more} for more in (-0.5 * here, 5.0, 20.0, 60.0) if here + more > 0 and more != 0]


EFFECT = Effect(
    name="tendon_stiffening",
    physics="A laid rope is soft until its strands bed down: k(T) = k_inf T/(T + toe) (toe region; Costello, Theory of "
    "Wire Rope, 1997, doi 10.1007/978-1-4612-1970-5). The sign is odd in the drive, strongest at low tension.",
    tell_apart="At one preload a wider loop passes for backlash or more friction; the effect falls with preload, they "
    "do not. Record a second preload.",
    rig_forms=(RigForm((TOE,), _starts, rig=_rig, needs=frozenset({"wheel", "two tendons"})),),
)
