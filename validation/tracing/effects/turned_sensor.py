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
    physics="The frame of the sensor or camera is turned about the tube axis against the rig, or the rig with its "
    "tendons against it. Both bending angles are components of one vector across the tube, and a turned frame mixes "
    "them as a plane rotation does (Goldstein, Classical Mechanics, 2nd edition, 1980, chapter 4). Tensions, friction "
    "and torsion stay as they are.",
    distinguished_by="Turned tendons (`plane_coupling`) turn the bending of the wrist itself, and read nearly the same "
    "on a wrist that is as stiff in both planes. Slacken the tendons, hang a weight on the tip to the side, and read "
    "both angles before and after: a turned sensor shows a part of the change in the other plane, turned tendons show "
    "none. Or look at the marks of tube, tendons and sensor.",
    space_forms=(SpaceForm((TURN,), _starts, sensor=sensor),),
)
