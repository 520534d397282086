"""A tube that twists more or less than its notches say."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING

from validation.tracing.effect import Effect, FreeParameter, Scale, Sensible, SpaceForm, Values

if TYPE_CHECKING:
    from fem_models.spatial.rig import SpatialRig

SENSIBLE_FACTOR = Sensible(-1.0, 30.0, "a torsional compliance is not below zero", name="torsional compliance", about=1)
COMPLIANCE = FreeParameter("compliance", "-", -0.95, 100.0, 0.1, linear=True, sensible=SENSIBLE_FACTOR)


def _chain(rig: SpatialRig, values: Values) -> SpatialRig:
    """Make the torsional compliance of every notch 1 + ``compliance`` times that of the rig."""
    joints = []
    for one in rig.joints:
        softer = one.stiffness._replace(torsion=one.stiffness.torsion / (1.0 + values["compliance"]))
        joints.append(replace(one, stiffness=softer))
    return replace(rig, joints=tuple(joints))


def _starts(scale: Scale) -> list[Values]:
    return [{"compliance": size} for size in (-0.3, 0.5, 3.0)]


EFFECT = Effect(
    name="torsion",
    seen="the tip twists under a side load",
    physics="Thin webs between notches twist. Their compliance is that of a thin rectangle (Saint-Venant; Timoshenko "
    "and Goodier, Theory of Elasticity, 1970, chapter 10), changed by wall, fillets and warping at the roots.",
    distinguished_by="Record the torsion of the tip with a weight on it, bent to the side. Without a side load the "
    "tendons hardly twist the tube.",
    space_forms=(SpaceForm((COMPLIANCE,), _starts, chain=_chain, needs=frozenset({"torsion"})),),
)
