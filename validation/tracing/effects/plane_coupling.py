"""Tendons that are turned against the notches: one wheel moves both bending planes."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING

from validation.tracing.effect import Effect, FreeParameter, Scale, Sensible, SpaceForm, Values

if TYPE_CHECKING:
    from fem_models.spatial.rig import SpatialRig

SENSIBLE_TURN = Sensible(-30.0, 30.0, "a tube that is turned further in its mounting is seen at once")
TURN = FreeParameter("turn_deg", "deg", -45.0, 45.0, 0.5, linear=True, sensible=SENSIBLE_TURN)


def _chain(rig: SpatialRig, values: Values) -> SpatialRig:
    """Turn all tendons about the tube axis, from y towards z; notches and loads stay."""
    turned = [replace(one, angle_deg=one.angle_deg + values["turn_deg"]) for one in rig.tendons]
    return replace(rig, tendons=tuple(turned))


def _starts(scale: Scale) -> list[Values]:
    return [{"turn_deg": side * 2.0} for side in (-1, 1)]


EFFECT = Effect(
    name="plane_coupling",
    physics="The tendons are turned against the notches about the tube axis. A moment of one wheel has a component in "
    "the other bending plane, of sin(turn) of its size (Euler-Bernoulli beam with two principal axes; Timoshenko, "
    "Strength of Materials, part I, 1955, on unsymmetrical bending). A tube that is turned in its mounting together "
    "with its tendons reads as a turned sensor does.",
    distinguished_by="A second angle that the first wheel moves. A sensor that is turned about the tube axis "
    "(`turned_sensor`) reads nearly the same on a wrist that is as stiff in both planes: slacken the tendons, hang a "
    "weight on the tip to the side, and see whether the other angle moves, as only a turned sensor shows. A delay "
    "widens the loops of both angles and moves no wheel's motion into the other plane.",
    space_forms=(SpaceForm((TURN,), _starts, chain=_chain),),
)
