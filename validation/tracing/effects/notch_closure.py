"""Notches whose edges meet."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np

from fem_models.joint import joint_row
from fem_models.rig import Rig
from fem_models.rig.effects import Closure
from hysteresis.arrays import Floats
from validation.tracing.effect import (
    OPEN_NOTCHES,
    CurveContext,
    CurveForm,
    Effect,
    FreeParameter,
    RelativeParameter,
    RigForm,
    Scale,
    Values,
)

ANGLE = FreeParameter("angle_deg", "deg", 0.1, 90.0, 0.05)
STIFFNESS = FreeParameter("stiffness_Nmm_per_rad", "Nmm/rad", 1.0, 1e6, 0.3, log=True)


def _rig(rig: Rig, values: Values) -> Rig:
    """Join two contacts to one: as stiff as both together, from the mean angle weighted by stiffness.

    Notches that differ and close by their edges then have one angle, the mean of theirs.
    """
    stiffness, angle_deg = values["stiffness_Nmm_per_rad"], values["angle_deg"]
    if rig.closure is not None and rig.closure != OPEN_NOTCHES:
        declared, at = rig.closure.stiffness_Nmm_per_rad, rig.closure.angle_deg
        at = math.degrees(joint_row(rig).of("contact_angle_rad").mean()) if at is None else at
        angle_deg = (declared * at + stiffness * angle_deg) / (declared + stiffness)
        stiffness += declared
    return replace(rig, closure=Closure(stiffness, angle_deg))


def _starts(scale: Scale, rig: Rig) -> list[Values]:
    """Start from parts of the largest angle of a joint, and from the angle at which the edges meet by geometry."""
    angles = [part * scale.joint_deg for part in (0.6, 0.8, 0.92)]
    closes = math.degrees(joint_row(rig).of("closure_angle_rad").min())
    if ANGLE.low < closes < ANGLE.high:
        angles.append(closes)
    return [{"angle_deg": angle, "stiffness_Nmm_per_rad": k} for angle in angles for k in (300.0, 3e3)]


def _stiffened(theta: Floats, curve: CurveContext, values: Values) -> Floats:
    """Take slope from the angle beyond a limit on both sides."""
    return theta - values["slope_loss"] * (theta - np.clip(theta, -values["angle_deg"], values["angle_deg"]))


_CURVE = CurveForm(
    (RelativeParameter("angle_deg", "angle", 0.05, 1.1, 0.01), RelativeParameter("slope_loss", "-", 0.0, 1.0, 0.02)),
    tuple({"angle_deg": part, "slope_loss": loss} for part in (0.6, 0.8, 0.93) for loss in (0.1, 0.5)),
    angle=_stiffened,
)

EFFECT = Effect(
    name="notch_closure",
    seen="the tube stiffens beyond an angle, at both ends",
    physics="The edges of a notch meet at an angle of the joint, width over lever, and carry load from there on (York "
    "et al., ICRA 2015, doi 10.1109/ICRA.2015.7139414).",
    distinguished_by="Record a smaller amplitude: without contact the effect is gone. A superelastic plateau curves "
    "the other way. An obstacle clips one end only.",
    rig_forms=(RigForm((ANGLE, STIFFNESS), _starts, rig=_rig),),
    curve_forms=(_CURVE,),
)
