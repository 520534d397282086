"""Tendons that are soft at low tension."""

from __future__ import annotations

from dataclasses import replace

from fem_models.rig import Rig
from hysteresis.arrays import Floats
from validation.tracing.baseline.curve_kernels import two_tendons
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

SENSIBLE_TOE = Sensible(0.0, 300.0, "several times the toe of the reference rig's steel strand")
SENSIBLE_TOE_OF_CURVE = Sensible(
    0.0, 20.0, "several times the toe of the reference rig's steel strand at its least preload"
)
STARTS_N = (5.0, 20.0, 60.0)
TOE = FreeParameter("toe_N", "N", 0.0, 500.0, 5.0, sensible=SENSIBLE_TOE)


def _rig(rig: Rig, values: Values) -> Rig:
    """Add the toes, as the compliances (1 + toe / T) / k_inf of strands in series add."""
    a, b, toe = rig.tendon_a, rig.tendon_b, values["toe_N"]
    return replace(
        rig,
        tendon_a=replace(a, toe_N=a.toe_N + toe),
        tendon_b=None if b is None else replace(b, toe_N=b.toe_N + toe),
    )


def _starts(scale: Scale, rig: Rig) -> list[Values]:
    return [{"toe_N": toe} for toe in STARTS_N]


def _toe(curve: CurveContext, values: Values) -> tuple[float, float, float]:
    """Preload over k_inf, stiffness of the tendons over that of the joint, toe over preload."""
    return values["give"] * curve.preload_ratio, values["stiffness_ratio"], values["toe"] / curve.preload_ratio


def _joint(x: Floats, curve: CurveContext, values: Values) -> Floats:
    """Give the drive that reaches the joint, relative to that through stiff strands."""
    angle, _ = two_tendons(x, *_toe(curve, values), 0.0, 0.0)
    return angle * (1.0 + 0.5 / values["stiffness_ratio"])


def _soft(f: Floats, curve: CurveContext, values: Values) -> Floats:
    """Size the loop by the compliance of the tendons, through which a given friction force moves the angle."""
    _, soft = two_tendons(f * (curve.drive_half_range / curve.angle_half_range_deg), *_toe(curve, values), 0.0, 0.0)
    return soft


_CURVE = CurveForm(
    (
        RelativeParameter("toe", "-", 0.0, 50.0, 0.2, amount=True, sensible=SENSIBLE_TOE_OF_CURVE),
        RelativeParameter("give", "drive", 1e-3, 2.0, 0.2, log=True),
        RelativeParameter("stiffness_ratio", "-", 0.05, 50.0, 0.2, log=True),
    ),
    tuple({"toe": toe, "give": give, "stiffness_ratio": 4.0} for toe in (0.5, 3.0) for give in (0.05, 0.4)),
    drive=_joint,
    loop_size=_soft,
)

EFFECT = Effect(
    name="tendon_stiffening",
    seen="the bend is too small at a low preload",
    physics="A laid tendon is soft until its strands bed down: k(T) = k_inf T/(T + toe) (toe region; Costello, Theory "
    "of Wire Rope, 1997, doi 10.1007/978-1-4612-1970-5). The effect is odd in the drive.",
    distinguished_by="Record a second preload: the effect falls with preload. At one preload it looks like a wider "
    "loop, as backlash and more friction do; these do not fall.",
    rig_forms=(RigForm((TOE,), _starts, rig=_rig, needs=frozenset({"wheel", "two tendons"})),),
    curve_forms=(_CURVE,),
)
