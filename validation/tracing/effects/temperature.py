"""Metal that is warmer or colder than declared."""

from __future__ import annotations

from dataclasses import replace

from fem_models.rig import Rig, RigError
from validation.tracing.effect import Effect, FreeParameter, RigForm, Scale, Sensible, Values

SENSIBLE_WARMER = Sensible(-40.0, 40.0, "from a cold room to a body and a warm lamp")
WARMER = FreeParameter("warmer_K", "K", -150.0, 150.0, 1.0, linear=True, sensible=SENSIBLE_WARMER)


def _rig(rig: Rig, values: Values) -> Rig:
    """Warm the surroundings of the declared law: both plateaus rise."""
    if (law := rig.superelastic) is None:
        raise RigError("superelastic = None: expected a declared plateau for a change of temperature to shift")
    return replace(rig, superelastic=replace(law, temperature_C=law.temperature_C + values["warmer_K"]))


def _starts(scale: Scale, rig: Rig) -> list[Values]:
    return [{"warmer_K": side * 3.0} for side in (-1, 1)]


EFFECT = Effect(
    name="temperature",
    seen="the plateau begins at another bend than declared",
    physics="The stresses at which Nitinol transforms rise with the temperature, by 6.5 MPa/K where the rig declares "
    "no other slope (Clausius-Clapeyron relation).",
    distinguished_by="Measure the temperature of the tube, or record again in warm water. Another plateau stress of "
    "the material looks the same at one temperature.",
    rig_forms=(RigForm((WARMER,), _starts, rig=_rig, needs=frozenset({"declared plateau"})),),
)
