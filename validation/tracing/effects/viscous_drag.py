"""Losses that grow with the rate."""

from __future__ import annotations

from dataclasses import replace

from fem_models.rig import Rig
from fem_models.rig.effects import Drag
from hysteresis.arrays import Floats
from validation.tracing.baseline.curve_kernels import lagged
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

SENSIBLE_LAG = Sensible(0.0, 1.0, "a rig that lags by more than a quarter of a cycle hardly moves", "quarter cycle")
SENSIBLE_SHEATH = Sensible(0.0, 100.0, "100 N at 1 mm/s breaks such tendons")
SENSIBLE_JOINT = Sensible(0.0, 1e4, "a joint that takes seconds to spring back")
SHEATH = FreeParameter("sheath_N_s_per_mm", "N s/mm", 1e-6, 1e4, 0.2, log=True, linear=True, sensible=SENSIBLE_SHEATH)
JOINT = FreeParameter(
    "joint_Nmm_s_per_rad", "Nmm s/rad", 1e-4, 1e6, 0.2, log=True, linear=True, sensible=SENSIBLE_JOINT
)


def _rig(rig: Rig, values: Values) -> Rig:
    """Add a damper to those of the rig; a form names one of the two kinds."""
    declared = rig.drag or Drag()
    sheath = declared.sheath_N_s_per_mm + values.get("sheath_N_s_per_mm", 0.0)
    return replace(rig, drag=Drag(sheath, declared.joint_Nmm_s_per_rad + values.get("joint_Nmm_s_per_rad", 0.0)))


def _sheath_starts(scale: Scale, rig: Rig) -> list[Values]:
    return [{"sheath_N_s_per_mm": force / scale.speed} for force in (0.3, 2.0)]  # N, at the greatest speed


def _joint_starts(scale: Scale, rig: Rig) -> list[Values]:
    rate = max(scale.speed / rig.tendon_a.moment_arm_mm / rig.joints, 1e-9)
    return [{"joint_Nmm_s_per_rad": moment / rate} for moment in (1.0, 6.0)]  # Nmm, at the greatest speed


def _damped(theta: Floats, curve: CurveContext, values: Values) -> Floats:
    """Lag by first order: a damper against the elasticity of the tendons."""
    return lagged(theta, curve.inputs.time_s, values["lag_s"])


def _damped_by_loop(theta: Floats, curve: CurveContext, values: Values) -> Floats:
    """Lag by first order, as large as h is: a damper in the sheath acts through the same elasticity as friction."""
    return lagged(theta, curve.inputs.time_s, values["lag_s"] * curve.loop_ratio)


_LAG = RelativeParameter("lag_s", "time", 1e-5, 0.5, 0.3, log=True, sensible=SENSIBLE_LAG)
_LAGS: tuple[Values, ...] = ({"lag_s": 1e-3}, {"lag_s": 1e-2})
_CURVES = (
    CurveForm((_LAG,), _LAGS, angle=_damped, needs=frozenset({"time"})),
    CurveForm((_LAG,), _LAGS, angle=_damped_by_loop, needs=frozenset({"time", "preloads"})),
)

EFFECT = Effect(
    name="viscous_drag",
    seen="the loop is wider in fast records",
    physics="Lubricant in the sheath, or a damper, resists in proportion to the rate. Static records do not show it.",
    distinguished_by="Record two rates. A delay keeps the shape of the loop and vanishes at the ends of the stroke.",
    rig_forms=(
        RigForm((SHEATH,), _sheath_starts, rig=_rig, needs=frozenset({"time", "wheel"})),
        RigForm((JOINT,), _joint_starts, rig=_rig, needs=frozenset({"time", "wheel"})),
    ),
    curve_forms=(*_CURVES,),
)
