"""Tendons longer than the preload requires."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from fem_models.rig import Rig
from fem_models.rig.effects import Slack
from hysteresis.arrays import Floats
from validation.tracing.baseline.curve_kernels import two_tendons
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

SENSIBLE_SLACK = Sensible(0.0, 0.9, "nothing moves with more", "half stroke")
SENSIBLE_CENTRE = Sensible(-1.0, 1.0, "a dead zone outside the stroke does not show", "half stroke")
SLACK = FreeParameter("slack_mm", "mm", 0.0, 5.0, 0.05, linear=True, sensible=SENSIBLE_SLACK)
CENTRE = FreeParameter("centre_mm", "mm", -5.0, 5.0, 0.05, linear=True, sensible=SENSIBLE_CENTRE)


def _rig(rig: Rig, values: Values) -> Rig:
    here = rig.slack or Slack()
    more, centre = values["slack_mm"], values.get("centre_mm", 0.0)
    return replace(rig, slack=Slack(here.tendon_a_mm + more + centre, here.tendon_b_mm + more - centre))


def _starts(scale: Scale, rig: Rig) -> list[Values]:
    return [{"slack_mm": part * scale.drive} for part in (0.02, 0.08, 0.2)]


def _off_centre(scale: Scale, rig: Rig) -> list[Values]:
    return [
        {"slack_mm": part * scale.drive, "centre_mm": side * 0.02 * scale.drive}
        for part in (0.04, 0.12)
        for side in (-1, 1)
    ]


_TWO: frozenset[Need] = frozenset({"two tendons"})


def _dead_zone(x: Floats, curve: CurveContext, values: Values) -> Floats:
    """Stand still within the slack about a centre."""
    centre, slack = values.get("centre", 0.0), values["slack"]
    return x - np.clip(x - centre, -slack, slack)


def _tendons(x: Floats, curve: CurveContext, values: Values) -> tuple[Floats, Floats]:
    slack = values["slack"]
    return two_tendons(x, values["give"] * curve.preload_ratio, values["stiffness_ratio"], 0.0, slack, slack)


def _joint(x: Floats, curve: CurveContext, values: Values) -> Floats:
    """Let the preload take up some of the slack, and one tendon go slack while the other one pulls."""
    return _tendons(x, curve, values)[0] * (1.0 + 0.5 / values["stiffness_ratio"])


def _soft(f: Floats, curve: CurveContext, values: Values) -> Floats:
    return _tendons(f * (curve.drive_half_range / curve.angle_half_range_deg), curve, values)[1]


_SLACK = RelativeParameter("slack", "drive", 0.0, 0.9, 0.01, amount=True, sensible=SENSIBLE_SLACK)
_CENTRE = RelativeParameter("centre", "drive", -1.0, 1.0, 0.01)
_GIVE = RelativeParameter("give", "drive", 1e-3, 2.0, 0.2, log=True)  # stretch of a tendon by its preload
_RATIO = RelativeParameter("stiffness_ratio", "-", 0.05, 50.0, 0.2, log=True)
_CURVES = (
    CurveForm((_SLACK,), ({"slack": 0.02}, {"slack": 0.1}), drive=_dead_zone),
    CurveForm(
        (_SLACK, _CENTRE),
        tuple({"slack": 0.08, "centre": centre} for centre in (-0.9, -0.5, -0.1, 0.1, 0.5)),
        drive=_dead_zone,
    ),
    CurveForm(
        (_SLACK, _GIVE, _RATIO),
        tuple({"slack": 0.1, "give": give, "stiffness_ratio": 5.0} for give in (0.05, 0.2)),
        drive=_joint,
        loop_size=_soft,
    ),
)

EFFECT = Effect(
    name="tendon_slack",
    seen="nothing moves near the centre, on the way up and down alike",
    physics="Tendons longer than the declared preload requires: neither is taut about the centre. A tendon pulls and "
    "never pushes (unilateral tendon, as in fem_models.multibody.quasi_static).",
    distinguished_by="Record more preload: the dead zone shrinks. Backlash comes after every reversal, slack at one "
    "position of the drive.",
    rig_forms=(
        RigForm((SLACK,), _starts, rig=_rig, needs=_TWO),
        RigForm((SLACK, CENTRE), _off_centre, rig=_rig, needs=_TWO),
    ),
    curve_forms=(*_CURVES,),
)
