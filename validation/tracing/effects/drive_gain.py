"""A drive that winds more or less than is logged."""

from __future__ import annotations

from dataclasses import replace
from functools import partial

from fem_models.rig import Rig
from fem_models.rig.effects import DriveGain
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
    SpaceForm,
    Values,
)

SENSIBLE_ERROR = Sensible(
    -0.15,
    0.15,
    "a radius or a pitch is known to some per cent; a wrong wheel is off by more",
    name="drive gain",
    about=1.0,
)
ERROR = FreeParameter("error", "-", -0.5, 1.0, 0.005, linear=True, sensible=SENSIBLE_ERROR)


def _rig(rig: Rig, values: Values) -> Rig:
    """Multiply the gains: (1 + a)(1 + b) in place of 1 + a."""
    declared = 0.0 if rig.drive_gain is None else rig.drive_gain.error
    return replace(rig, drive_gain=DriveGain(declared + values["error"] + declared * values["error"]))


def _drive(x: Floats, curve: CurveContext, values: Values) -> Floats:
    """Wind more or less, from the drive's zero on."""
    return x + values["error"] * (x + curve.drive_middle)


_CURVE = CurveForm(
    (RelativeParameter("error", "-", -0.5, 1.0, 0.005, amount=True, sensible=SENSIBLE_ERROR),),
    ({"error": 0.02}, {"error": -0.02}),
    drive=_drive,
    needs=frozenset({"reference"}),
)


def _wheels(wheels_mm: Floats, values: Values) -> Floats:
    """Wind more or less with every wheel."""
    return (1.0 + values["error"]) * wheels_mm


def _starts(scale: Scale, rig: Rig | None) -> list[Values]:
    return [{"error": side * 0.02} for side in (-1, 1)]


EFFECT = Effect(
    name="drive_gain",
    seen="the bend is too large or too small by a constant factor",
    physics="A wheel radius or spindle pitch that is off by some per cent winds (1 + e) x in place of x. With an "
    "unknown geometry, or a drive in turns of a motor, only a comparison with a reference shows it.",
    distinguished_by="Measure the tendon that a turn of the motor winds. A wrong gain of the camera stretches the "
    "loop with the angle. A wrong gain of the drive keeps widths in the drive, such as a play, and changes the loop "
    "and the ends of the stroke.",
    rig_forms=(RigForm((ERROR,), _starts, rig=_rig, needs=frozenset({"drive in mm"})),),
    curve_forms=(_CURVE,),
    space_forms=(SpaceForm((ERROR,), partial(_starts, rig=None), wheels=_wheels),),
)
