"""A single tendon that takes hold late."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from fem_models.rig import Rig
from fem_models.rig.effects import Slack
from hysteresis.arrays import Floats
from validation.tracing.baseline.curve_kernels import play
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

SENSIBLE_ENGAGES_AFTER = Sensible(0.0, 1.8, "a tendon that never takes hold", "half stroke")
SENSIBLE_LAG = Sensible(0.0, 0.5, "a wider play leaves the angle still for most of the stroke", "half stroke")
LATE = FreeParameter("engages_after_mm", "mm", 0.0, 20.0, 0.05, linear=True, sensible=SENSIBLE_ENGAGES_AFTER)


def _rig(rig: Rig, values: Values) -> Rig:
    """Add the length that the wheel winds before the tendon takes hold."""
    here = rig.slack or Slack()
    return replace(rig, slack=Slack(here.tendon_a_mm + values["engages_after_mm"], here.tendon_b_mm))


def _starts(scale: Scale, rig: Rig) -> list[Values]:
    return [{"engages_after_mm": part * scale.drive} for part in (0.05, 0.3)]


def _above(x: Floats, curve: CurveContext, values: Values) -> Floats:
    """Follow the drive above a place alone; on the way back as much later as the tendon hangs on."""
    return np.maximum(_hanging_on(x, curve, values), values["engages_above"])


def _below(x: Floats, curve: CurveContext, values: Values) -> Floats:
    return np.minimum(_hanging_on(x, curve, values), values["engages_below"])


def _hanging_on(x: Floats, curve: CurveContext, values: Values) -> Floats:
    return play(x, values["lag"], curve.initial_state) if "lag" in values else x


_LAG = RelativeParameter("lag", "drive", 0.0, 0.8, 0.01, sensible=SENSIBLE_LAG)
_ABOVE = RelativeParameter("engages_above", "drive", -1.1, 0.9, 0.01)
_BELOW = RelativeParameter("engages_below", "drive", -0.9, 1.1, 0.01)
_CURVES = (
    CurveForm((_ABOVE,), tuple({"engages_above": at} for at in (-0.85, -0.5)), drive=_above),
    CurveForm((_BELOW,), tuple({"engages_below": at} for at in (0.85, 0.5)), drive=_below),
    CurveForm((_ABOVE, _LAG), ({"engages_above": -0.7, "lag": 0.05},), drive=_above),
    CurveForm((_BELOW, _LAG), ({"engages_below": 0.7, "lag": 0.05},), drive=_below),
)

EFFECT = Effect(
    name="tendon_engagement",
    seen="with a single tendon, nothing moves at one end of the stroke",
    physics="A single tendon hangs loose at one end of the stroke and engages late. It may let go at another place on "
    "the way back. A tendon pulls and never pushes (unilateral tendon, as in fem_models.multibody.quasi_static).",
    distinguished_by="Record more preload, or a stroke that begins in the taut range. Slack between two tendons is a "
    "dead zone inside the stroke; at its very end they are the same. Notches that close clip the other end.",
    rig_forms=(RigForm((LATE,), _starts, rig=_rig, needs=frozenset({"wheel", "one tendon"})),),
    curve_forms=(*_CURVES,),
)
