"""A load on the tip."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np

from fem_models.joint import joint_row
from fem_models.rig import Rig
from fem_models.rig.effects import TipLoad
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
)

SENSIBLE_FORCE_ALONG = Sensible(-20.0, 20.0, "instruments of this kind push and pull with up to some 10 N")
SENSIBLE_ALONG = Sensible(-0.6, 0.6, "more load would bend the tube without the drive", "half range")
ALONG = FreeParameter("force_along_N", "N", -50.0, 50.0, 0.05, linear=True, sensible=SENSIBLE_FORCE_ALONG)
ACROSS = FreeParameter("force_across_N", "N", -50.0, 50.0, 0.05, linear=True, sensible=SENSIBLE_FORCE_ALONG)
_NEARLY_STRAIGHT_RAD = 1e-3  # below it the levers are taken from their series


def _rig(rig: Rig, values: Values) -> Rig:
    """Add the forces as vectors."""
    along, across = values.get("force_along_N", 0.0), values["force_across_N"]
    if rig.tip_load is not None:
        direction = math.radians(rig.tip_load.direction_deg)
        along += rig.tip_load.force_N * math.cos(direction)
        across += rig.tip_load.force_N * math.sin(direction)
    return replace(rig, tip_load=TipLoad(math.hypot(along, across), math.degrees(math.atan2(across, along))))


def _unit_N(rig: Rig) -> float:
    """Force across the tip that would bend the straight tube without tendons by about 1 rad in all."""
    stiffness = float(joint_row(rig).of("flexure.bending_Nmm_per_rad").mean())
    return 2.0 * stiffness / (rig.joints * rig.length_mm)


def _across(scale: Scale, rig: Rig) -> list[Values]:
    return [{"force_across_N": side * 0.1 * _unit_N(rig)} for side in (-1, 1)]


def _both(scale: Scale, rig: Rig) -> list[Values]:
    """Start small and large along the tube, where a force softens or stiffens more the larger it is, and across it.

    A large force across bends a wrist of unknown geometry far from where its baseline has followed: small starts end in
    optima in between, at twice the noise.
    """
    unit = _unit_N(rig)
    parts = ((0.3, 0.05), (-0.3, 0.05), (-1.5, 0.05), (-1.5, -0.05), (1.5, 0.05), (1.5, -0.05), (0.0, 3.0), (0.0, -3.0))
    return [{"force_along_N": along * unit, "force_across_N": across * unit} for along, across in parts]


def levers(heading_rad: Floats) -> tuple[Floats, Floats]:
    """Levers of a force on the tip of a tube that bends in an arc, along and across the straight tube, over its length.

    By virtual work: the tip is at (sin h / h, (1 - cos h) / h) for the heading h of the tip, and the levers are the
    derivatives of that by h, shapes (m,). They are 0 and 1/2 at rest, and -h/3 and 1/2 - h^2/8 near it.
    """
    near = np.abs(heading_rad) < _NEARLY_STRAIGHT_RAD
    h = np.where(near, 1.0, heading_rad)
    along = np.where(near, -heading_rad / 3, (h * np.cos(h) - np.sin(h)) / h**2)
    across = np.where(near, 0.5 - heading_rad**2 / 8, (h * np.sin(h) - 1 + np.cos(h)) / h**2)
    return along, across


def _load(theta: Floats, curve: CurveContext, values: Values) -> Floats:
    """Add what the moment of the load bends; what it bends the straight tube by is part of the zero."""
    along, across = levers(np.radians(theta - curve.straight_deg))
    return theta + values["along_deg"] * 3 * along + values["across_deg"] * (2 * across - 1)


_CURVE = CurveForm(
    (
        RelativeParameter("along_deg", "angle", -0.8, 0.8, 0.005, amount=True, sensible=SENSIBLE_ALONG),
        RelativeParameter("across_deg", "angle", -0.8, 0.8, 0.005, amount=True, sensible=SENSIBLE_ALONG),
    ),
    tuple({"along_deg": a, "across_deg": b} for a, b in ((0.02, 0.0), (-0.02, 0.0), (0.0, 0.02), (0.0, -0.02))),
    angle=_load,
)

EFFECT = Effect(
    name="tip_load",
    seen="an offset to one side, and another stiffness",
    physics="A dead force on the tip, such as a hanging weight, given by its parts along and across the straight "
    "tube. A joint feels the force times the lever to the tip, which changes as it bends (virtual work).",
    distinguished_by="Take the load off, or turn the rig by 90 or 180 degrees. The weight of the rings acts nearly "
    "alike, more at the base; a misaligned camera is also a function of the angle alone. A load also changes the "
    "tensions: record them.",
    rig_forms=(RigForm((ACROSS,), _across, rig=_rig), RigForm((ALONG, ACROSS), _both, rig=_rig)),
    curve_forms=(_CURVE,),
)
