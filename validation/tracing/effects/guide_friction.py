"""Friction of the guides besides the capstan in the bends and a constant force at the base."""

from __future__ import annotations

import math
from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np

from fem_models.rig import Rig
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

if TYPE_CHECKING:
    from fem_models.spatial.rig import SpatialRig

SENSIBLE_BASE_CAPSTAN = Sensible(0.0, 1.6, "mu phi of steel on steel, 0.5, round half a turn")
SENSIBLE_GUIDE = Sensible(0.0, 2.0, "guides in series would hold the tendons at usual preloads")
SENSIBLE_CAPSTAN = Sensible(0.0, 1.0, "mu of dry metal or polymer is below 1")
BASE = FreeParameter("base_capstan", "-", 0.0, 2.0, 0.01, linear=True, sensible=SENSIBLE_BASE_CAPSTAN)
GUIDE = FreeParameter("guide_N", "N", 0.0, 5.0, 0.02, linear=True, sensible=SENSIBLE_GUIDE)
CAPSTAN = FreeParameter(
    "capstan",
    "-",
    -0.5,
    1.0,
    0.01,
    linear=True,
    sensible=Sensible(-0.5, 0.5, "mu of dry metal or polymer changes by less"),
)
LEAST_MU = 1e-3


def _at_base(rig: Rig, values: Values) -> Rig:
    """Add to the wrap at the base, given by mu phi, since only the product acts there."""
    mu = max(rig.friction.capstan_coefficient, LEAST_MU)
    declared = rig.friction.rest_wrap_deg * rig.friction.capstan_coefficient / mu
    wrap = declared + math.degrees(values["base_capstan"] / mu)
    return replace(rig, friction=replace(rig.friction, capstan_coefficient=mu, rest_wrap_deg=wrap))


def _at_guides(rig: Rig, values: Values) -> Rig:
    """Add to the friction force of every guide."""
    return replace(rig, friction=replace(rig.friction, guide_N=rig.friction.guide_N + values["guide_N"]))


def _base_starts(scale: Scale, rig: Rig) -> list[Values]:
    return [{"base_capstan": value} for value in (0.02, 0.1)]


def _guide_starts(scale: Scale, rig: Rig) -> list[Values]:
    return [{"guide_N": value} for value in (0.03, 0.15)]


def _wrap(f: Floats, curve: CurveContext, values: Values) -> Floats:
    """Let the loop grow with the bend, by the capstan equation."""
    return np.exp(values["capstan"] * np.radians(np.abs(f - curve.straight_deg)))


def _chain(rig: SpatialRig, values: Values) -> SpatialRig:
    """Add to the capstan friction in the bends, which a fit without a reference has as its own."""
    mu = rig.friction.capstan_coefficient + values["capstan"]
    return replace(rig, friction=replace(rig.friction, capstan_coefficient=mu))


def _space_starts(scale: Scale) -> list[Values]:
    return [{"capstan": value} for value in (-0.02, 0.02, 0.1)]


_CURVE = CurveForm(
    (RelativeParameter("capstan", "-", 0.0, 5.0, 0.05, amount=True, sensible=SENSIBLE_CAPSTAN),),
    ({"capstan": 0.1}, {"capstan": 0.6}),
    loop_size=_wrap,
)

EFFECT = Effect(
    name="guide_friction",
    seen="the loop is wider, and more so at a higher preload",
    physics="Tendons rub at bends: T2 = T1 exp(mu phi) (Euler 1769). The baseline has this in the bends of the tube, "
    "and a constant force at the base. The effect adds friction in proportion to tension between wheel and base, or a "
    "constant force at every guide.",
    distinguished_by="Record a second preload. Guide friction grows with tension; a Bouc-Wen loop and a constant "
    "force do not.",
    rig_forms=(
        RigForm((BASE,), _base_starts, rig=_at_base, needs=frozenset({"wheel"})),
        RigForm((GUIDE,), _guide_starts, rig=_at_guides),
    ),
    curve_forms=(_CURVE,),
    space_forms=(SpaceForm((CAPSTAN,), _space_starts, chain=_chain, needs=frozenset({"reference"})),),
)
