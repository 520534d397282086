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
    seen="one wheel moves the angle of the other plane",
    physics="The tendons are turned against the notches about the tube axis, so a moment has a component of sin(turn) "
    "in the other plane (unsymmetrical bending; Timoshenko, Strength of Materials, part I, 1955). If the tube is "
    "turned together with its tendons, it looks like `turned_sensor`.",
    distinguished_by="Slacken the tendons and hang a weight on the tip to the side. The other angle moves with a "
    "turned sensor (`turned_sensor`), not with turned tendons; on a wrist that is as stiff in both planes the records "
    "alone hardly separate them. A delay widens both loops, but moves nothing into the other plane.",
    space_forms=(SpaceForm((TURN,), _starts, chain=_chain),),
)
