"""Tendons that differ from side to side."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from fem_models.rig import Rig
from fem_models.rig.effects import Slack
from hysteresis.arrays import Floats
from validation.tracing.effect import (
    CurveContext,
    CurveForm,
    Effect,
    FreeParameter,
    Need,
    RelativeParameter,
    RigForm,
    Scale,
    Sensible,
    Values,
)

SENSIBLE_ARM_RATIO = Sensible(0.8, 1.25, "holes are drilled to a tenth of the radius")
SENSIBLE_STIFFNESS_RATIO = Sensible(0.33, 3.0, "two tendons of one kind, of free lengths that differ")
SENSIBLE_EA_RATIO = Sensible(0.33, 3.0, "two tendons of one kind")
SENSIBLE_REST_LENGTH = Sensible(-0.5, 0.5, "a longer tendon would be slack for half the stroke", "half stroke")
SENSIBLE_SKEW = Sensible(-1.0, 1.0, "loops that differ by more are of different tendons")
SENSIBLE_KINK = Sensible(-0.4, 0.4, "slopes of two tendons of one kind")
SENSIBLE_EVEN = Sensible(-0.5, 0.5, "slopes of two tendons of one kind", "half range")
ARM = FreeParameter("arm_ratio", "-", 0.5, 2.0, 0.02, sensible=SENSIBLE_ARM_RATIO)
STIFFNESS = FreeParameter("stiffness_ratio", "-", 0.1, 10.0, 0.05, log=True, sensible=SENSIBLE_STIFFNESS_RATIO)
EA = FreeParameter("EA_ratio", "-", 0.1, 10.0, 0.05, log=True, sensible=SENSIBLE_EA_RATIO)
REST = FreeParameter("rest_length_mm", "mm", -3.0, 3.0, 0.02, linear=True, sensible=SENSIBLE_REST_LENGTH)


def _rig(rig: Rig, values: Values) -> Rig:
    """Let tendon b differ: moment arm and stiffness, of its free length or of all of it, by factors, rest length by mm.

    Friction shares out the stretch of the tendon within the rings, so that the two stiffnesses act differently.
    """
    b = rig.tendon_b
    assert b is not None  # the form needs two tendons
    b = replace(
        b,
        moment_arm_mm=b.moment_arm_mm * values.get("arm_ratio", 1.0),
        EA_N=b.EA_N * values.get("EA_ratio", 1.0),
        free_length_mm=b.free_length_mm / values.get("stiffness_ratio", 1.0),
    )
    here = rig.slack or Slack()
    slack = Slack(here.tendon_a_mm, here.tendon_b_mm + values.get("rest_length_mm", 0.0))
    return replace(rig, tendon_b=b, slack=slack if slack != Slack() else None)


def _arm(scale: Scale, rig: Rig) -> list[Values]:
    return [{"arm_ratio": 0.96}, {"arm_ratio": 1.04}]


def _stiffness(scale: Scale, rig: Rig) -> list[Values]:
    return [{"stiffness_ratio": 0.85}, {"stiffness_ratio": 1.18}]


def _EA(scale: Scale, rig: Rig) -> list[Values]:
    return [{"EA_ratio": 0.85}, {"EA_ratio": 1.18}]


def _rest(scale: Scale, rig: Rig) -> list[Values]:
    return [{"rest_length_mm": part * scale.drive} for part in (-0.03, 0.03)]


def _arm_stiffness(scale: Scale, rig: Rig) -> list[Values]:
    return [{"arm_ratio": a, "stiffness_ratio": s} for a in (0.97, 1.03) for s in (0.9, 1.1)]


def _arm_EA(scale: Scale, rig: Rig) -> list[Values]:
    return [{"arm_ratio": a, "EA_ratio": e} for a in (0.97, 1.03) for e in (0.9, 1.1)]


_TWO: frozenset[Need] = frozenset({"two tendons"})


def _sides(x: Floats, curve: CurveContext, values: Values) -> Floats:
    """Let the slopes differ from side to side."""
    return x + values.get("kink", 0.0) * np.abs(x)


def _even(f: Floats, curve: CurveContext, values: Values) -> Floats:
    """Add an even part to f that grows as the preload falls; that at the largest preload is part of f."""
    return f + values.get("even_deg", 0.0) * (1.0 / curve.preload_ratio - 1.0) * (f / curve.angle_half_range_deg) ** 2


def _skew(f: Floats, curve: CurveContext, values: Values) -> Floats:
    """Make the loop wider on one side than on the other."""
    return np.exp(values["skew"] * f / curve.angle_half_range_deg)


_SKEW = RelativeParameter("skew", "-", -2.0, 2.0, 0.02, amount=True, sensible=SENSIBLE_SKEW)
_CURVES = (
    CurveForm((_SKEW,), ({"skew": 0.1}, {"skew": -0.1}), loop_size=_skew),
    CurveForm(
        (_SKEW, RelativeParameter("kink", "-", -0.6, 0.6, 0.01, amount=True, sensible=SENSIBLE_KINK)),
        tuple({"skew": skew, "kink": kink} for skew in (-0.1, 0.1) for kink in (-0.03, 0.03)),
        drive=_sides,
        loop_size=_skew,
    ),
    CurveForm(
        (_SKEW, RelativeParameter("even_deg", "angle", -1.0, 1.0, 0.005, amount=True, sensible=SENSIBLE_EVEN)),
        tuple({"skew": skew, "even_deg": even} for skew in (-0.1, 0.1) for even in (-0.01, 0.01)),
        backbone=_even,
        loop_size=_skew,
        needs=frozenset({"preloads"}),
    ),
)

EFFECT = Effect(
    name="unequal_tendons",
    seen="an offset, and slopes and widths that differ from side to side",
    physics="Assembly makes the moment arm, stiffness or rest length of one tendon differ: the angle has a part that "
    "is even in the drive. The authors of the reference rig explain their residual by it (Mechanical Sciences 9, "
    "2018, section 4.4).",
    distinguished_by="Record a second preload. The even part of a misaligned camera is the same at every preload, and "
    "does not change the width of the loop. An obstacle clips one side only.",
    rig_forms=(
        RigForm((ARM,), _arm, rig=_rig, needs=_TWO),
        RigForm((STIFFNESS,), _stiffness, rig=_rig, needs=_TWO),
        RigForm((EA,), _EA, rig=_rig, needs=_TWO),
        RigForm((REST,), _rest, rig=_rig, needs=_TWO),
        RigForm((ARM, STIFFNESS), _arm_stiffness, rig=_rig, needs=_TWO),
        RigForm((ARM, EA), _arm_EA, rig=_rig, needs=_TWO),
    ),
    curve_forms=(*_CURVES,),
)
