"""A sensor or camera that is turned about the tube axis against the rig: it mixes both bending angles."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import numpy as np

from validation.tracing.effect import Effect, FreeParameter, Scale, Sensible, SpaceForm, Values

if TYPE_CHECKING:
    from hysteresis.arrays import Floats

SENSIBLE_TURN = Sensible(-30.0, 30.0, "a sensor that is turned further against the tube is seen at once")
TURN = FreeParameter("sensor_turn_deg", "deg", -45.0, 45.0, 0.5, linear=True, sensible=SENSIBLE_TURN)


def sensor(across: Floats, values: Values) -> Floats:
    """Components along the axes of a sensor that is turned from y towards z, from those along y and z; (m, 2)."""
    turn = math.radians(values["sensor_turn_deg"])
    axes = np.array([[math.cos(turn), math.sin(turn)], [-math.sin(turn), math.cos(turn)]])
    return across @ axes.T


def _starts(scale: Scale) -> list[Values]:
    return [{"sensor_turn_deg": side * 2.0} for side in (-1, 1)]


EFFECT = Effect(
    name="turned_sensor",
    seen="one wheel moves the reading of the other plane",
    physics="The sensor is turned about the tube axis against the rig. It mixes both bending angles as a plane "
    "rotation does (Goldstein, Classical Mechanics, 2nd edition, 1980, chapter 4). Tensions, friction and torsion do "
    "not change.",
    distinguished_by="Slacken the tendons and hang a weight on the tip to the side. A turned sensor shows a part of "
    "the change in the other plane, turned tendons (`plane_coupling`) show none; on a wrist that is as stiff in both "
    "planes the records alone hardly separate them. Or look at the marks of tube, tendons and sensor.",
    space_forms=(SpaceForm((TURN,), _starts, sensor=sensor),),
)
