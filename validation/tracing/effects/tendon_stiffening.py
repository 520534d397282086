"""Ropes that are soft at low tension."""

from __future__ import annotations

from dataclasses import replace

from fem_models.rig.rig import Rig
from hysteresis.arrays import Floats
from validation.tracing.baseline.curve_kernels import two_ropes
from validation.tracing.effect import (
    CurveContext,
    CurveForm,
    Effect,
    FreeParameter,
    RelativeParameter,
    RigForm,
    Scale,
    Values,
)

TOE = FreeParameter("toe_N", "N", 0.0, 500.0, 5.0)


def _rig(rig: Rig, values: Values) -> Rig:
    b = rig.tendon_b
    toe = values["toe_N"]
    return replace(
        rig, tendon_a=replace(rig.tendon_a, toe_N=toe), tendon_b=None if b is None else replace(b, toe_N=toe)
    )


def _starts(scale: Scale, rig: Rig) -> list[Values]:
    here = rig.tendon_a.toe_N
    return [{"toe_N": here + more} for more in (-0.5 * here, 5.0, 20.0, 60.0) if here + more > 0 and more != 0]


def _toe(curve: CurveContext, values: Values) -> tuple[float, float, float]:
    """Preload over k_inf, stiffness of ropes to joint, toe over preload."""
    return values["give"] * curve.preload_ratio, values["stiffness_ratio"], values["toe"] / curve.preload_ratio


def _turn(x: Floats, curve: CurveContext, values: Values) -> Floats:
    """Give what the ropes pass on, in units of what stiff strands would."""
    turn, _ = two_ropes(x, *_toe(curve, values), 0.0, 0.0)
    return turn * (1.0 + 0.5 / values["stiffness_ratio"])


def _soft(f: Floats, curve: CurveContext, values: Values) -> Floats:
    """Friction of a given force moves the angle by the ropes' compliance."""
    _, soft = two_ropes(f * (curve.drive_half_range / curve.angle_half_range_deg), *_toe(curve, values), 0.0, 0.0)
    return soft


_CURVE = CurveForm(
    (
        RelativeParameter("toe", "-", 0.0, 50.0, 0.2),
        RelativeParameter("give", "drive", 1e-3, 2.0, 0.2, log=True),
        RelativeParameter("stiffness_ratio", "-", 0.05, 50.0, 0.2, log=True),
    ),
    tuple({"toe": toe, "give": give, "stiffness_ratio": 4.0} for toe in (0.5, 3.0) for give in (0.05, 0.4)),
    drive=_turn,
    loop_size=_soft,
)

EFFECT = Effect(
    name="tendon_stiffening",
    physics="A laid rope is soft until its strands bed down: k(T) = k_inf T/(T + toe) (toe region; Costello, Theory of "
    "Wire Rope, 1997, doi 10.1007/978-1-4612-1970-5). The sign is odd in the drive, strongest at low tension.",
    distinguished_by="At one preload a wider loop passes for backlash or more friction; the effect falls with preload, they "
    "do not. Record a second preload.",
    rig_forms=(RigForm((TOE,), _starts, rig=_rig, needs=frozenset({"wheel", "two tendons"})),),
    curve_forms=(_CURVE,),
)
